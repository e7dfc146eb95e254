"""The files of a roof, each with the function that writes it; all appear together, or none."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from .. import io
from ..base.errors import FileError, FileWarning, PcmcError
from ..base.files import PathLike, atomic_writes, check_name, system_error, writing
from ..base.interrupts import defer_interrupts
from ..base.libraries import require
from ..base.units import NO_UNITS, Units
from ..certificate.certificate import Certificate
from ..cloth.sheets import pattern_files
from ..drawings.drawing_set import net_files, table_paths
from ..forces.curvature import curvature_error, mean_curvature
from ..io.mesh_data import CURVATURE
from ..panelling import Panels
from ..plot import draw, lines, member_forces, panel, reactions, under_load
from ..structure import Analysis, StructuralModel, write_structure
from ..surface import Surface, unfolded
from .checking import in_file
from .file import Project
from .members import filed_besides, warn_of_members
from .outcome import OnStep, Outcome, ignore
from .settings import SCHEDULE_TABLES, check_picture, cost_paths

WRITERS = (  # libraries that some formats need, whatever is in the file, with their extras
    ("trimesh", "files", (".glb", ".gltf")),
    ("pyvista", "files", (".vtp", ".vtu")),
    ("rhino3dm", "files", (".3dm",)),
    ("ifcopenshell", "ifc", (".ifc",)),
    ("ezdxf", "cad", (".dxf",)),
    ("pyarrow", "files", (".parquet",)),
)
FileJob = tuple[Path, Callable[..., Any]]  # a file with the function that writes it
FileJobs = list[FileJob]


def project_files(project: Project, outcome: Outcome, anyway: bool, progress: OnStep) -> FileJobs:
    """The files that a project asks for; its documents say so if the roof is not certified."""
    output, made = project.output, list[tuple[str, FileJob]]()  # with what each holds

    def add(what: str, jobs: Iterable[FileJob]) -> None:
        made.extend((what, job) for job in jobs)

    add("surface", surface_files(outcome, output.files))
    if output.picture is not None:
        add("picture", [picture_job(outcome, Path(output.picture), output.all_views, output.colour)])
    if not output.documents:
        return [job for _, job in made]
    about = outcome.units, output.sheet, outcome.name, outcome.mark
    progress("drawing, sorting panels, modelling")
    with in_file(project.path):
        if output.drawings:
            for sheets in outcome.drawing_set(output, anyway=anyway).files(*output.drawings):
                add("drawing" if sheets[0].suffix.lower() == ".svg" else "drawings", [sheets])
        if output.panels is not None and output.tolerance is not None:
            add("panels", schedule_jobs(Path(output.panels), outcome.panels(output.tolerance, anyway=anyway)))
        if output.net_size is not None:
            progress("laying out panels")
            net = outcome.panel_net(output.net_size, output.net_pattern, output.net_direction, anyway)
            add("net of panels", net_files(net, output.net, *about))
        if output.structure is not None and project.structure is not None:
            model = outcome.model(project.structure, anyway)
            add("structural model", [model_job(outcome, Path(output.structure), model)])
        analysis = outcome.analysis(anyway, progress)
        if output.structure is not None and analysis is not None:
            add("under load", analysis_jobs(outcome, Path(output.structure), analysis))
        if project.pattern is not None and (output.pattern or output.report):
            progress("cutting strips")
            pattern = outcome.cutting_pattern(project.pattern, anyway)
            add("cutting pattern", pattern_files(pattern, output.pattern, *about))
        if output.report is not None:
            listed = dict.fromkeys((path.name for path in project.inputs), "drawing or mesh of the roof")
            listed |= {project.path.name: "project"} | {path.name: what for what, (path, _) in made}
            add("report", [(Path(output.report), outcome.report(output, files=listed, anyway=anyway).write)])
    return [job for _, job in made]


def surface_files(outcome: Outcome, files: Iterable[PathLike], colour: str = "") -> FileJobs:
    """The files of a roof with all that their formats hold; ``colour`` is the scalar that colours vertices.

    Scalars of a surface that was not solved are those of its file. LostWarning where files do not hold the
    members of the project.
    """
    paths = [*map(Path, files)]
    holding = {path: io.FORMATS[path.suffix.lower()].besides for path in paths}
    besides = filed_besides(outcome) if any(holding.values()) else {}
    for held in (True, False):
        if some := [path.name for path in paths if bool(holding[path]) == held]:
            warn_of_members(outcome, ", ".join(some), held)
    if outcome.result is not None:
        return certified_files(*outcome.shown, paths, outcome.units, colour, besides, outcome.mark)
    data, about = outcome.data, dict[str, Any](units=outcome.units, colour=colour, mark=outcome.mark)
    about |= {"scalars": data.scalars, "certificate": data.certificate or None} if data else {}
    if outcome.unfold:
        unfold, half = unfolded(outcome.surface), outcome.surface
        place = {half.m: unfold.face, half.n: unfold.vertex}
        carried = {name: values[place[len(values)]] for name, values in about.get("scalars", {}).items()}
        about |= {"scalars": carried, "certificate": None}
    write = partial(io.write, surface=outcome.shown.surface, **about)
    more = {path: {key: besides[key] for key in keys if key in besides} for path, keys in holding.items()}
    return [(path, partial(write, **more[path])) for path in paths]


def certified_files(
    surface: Surface,
    certificate: Certificate,
    files: Iterable[PathLike],
    units: Units,
    colour: str = "",
    besides: Mapping[str, Any] | None = None,
    mark: str = "",
) -> FileJobs:
    """The files of a surface at rest: what their formats hold of its certificate, mean curvature (1/length),
    relative curvature error, size of the reactions at supports (force), and ``filed_besides``; with the
    ``mark`` where the certificate has none."""
    scalars = {CURVATURE: mean_curvature(surface), "error": curvature_error(surface)}
    scalars["reaction"] = np.linalg.norm(certificate.reactions, axis=1)
    jobs: FileJobs = []
    for file in map(Path, files):
        form = io.FORMATS[file.suffix.lower()]
        coloured = {name: values for name, values in scalars.items() if name == colour}
        about: dict[str, Any] = {"units": units, "colour": colour, "mark": certificate.mark or mark}
        about["scalars"] = form.carried(surface, scalars) | coloured
        about["certificate"] = certificate if form.certificate else None
        about |= {key: value for key, value in (besides or {}).items() if key in form.besides}
        jobs.append((file, partial(io.write, surface=surface, **about)))
    return jobs


def write_all(jobs: FileJobs, progress: OnStep = ignore) -> list[Path]:
    """Write files, each by its own function of a path: all appear together, or none."""
    paths = [path for path, _ in jobs]
    check_outputs(paths)
    with atomic_writes(paths) as temporaries:
        for (path, write), temporary in zip(jobs, temporaries, strict=True):
            progress(f"writing {path.name}")
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always", FileWarning)
                try:
                    with writing(temporary), defer_interrupts():
                        write(temporary)
                except PcmcError as error:
                    text = str(error).replace(f"{temporary}: ", "")
                    raise FileError(f"{path}: {text}", what=str(path)) from None
            for warning in caught:
                text = str(warning.message).replace(str(temporary), str(path))
                warnings.warn(text, warning.category, stacklevel=2)
    return paths


def schedule_jobs(path: Path, schedule: Panels) -> FileJobs:
    """The files of a schedule, each with the function that writes it."""
    tables = (schedule.panels, schedule.families, schedule.edges)
    paths = table_paths(path, SCHEDULE_TABLES)
    return [(one, partial(table.to_csv, index=False)) for one, table in zip(paths, tables, strict=True)]


def cost_jobs(path: Path, costs: pd.DataFrame) -> FileJobs:
    """The table and the picture of ``FewerFamilies.costs``, with the functions that write them."""
    curves = {"surfaces on the way": costs, "the cheapest": costs[costs["cheapest"]]}
    pairs = {name: (one["change"], one["cost"]) for name, one in curves.items()}
    picture = partial(lines, pairs, x="change of shape, length", y="cost", markers=True)
    return list(zip(cost_paths(path), (partial(costs.to_csv, index=False), picture), strict=True))


def model_job(outcome: Outcome, path: Path, model: StructuralModel) -> FileJob:
    """The file of a structural model, with the function that writes it."""
    return path, partial(write_structure, model=model, mark=outcome.mark)


def analysis_jobs(outcome: Outcome, path: Path, analysis: Analysis) -> FileJobs:
    """The tables and pictures of an analysis beside the structural model."""
    pictures: dict[str, Any] = {"cases": under_load}
    pictures |= {"member-forces": member_forces} if analysis.model.beams else {}
    jobs = {f"{name}.csv": partial(table.to_csv, index=False) for name, table in analysis.tables.items()}
    jobs |= {f"{name}.png": partial(draw, analysis, mark=outcome.mark) for name, draw in pictures.items()}
    return [(path.with_name(f"{path.stem}-{name}"), write) for name, write in jobs.items()]


def picture_job(outcome: Outcome, path: Path, views: Sequence[Any], colour: str) -> FileJob:
    """The picture of what is shown, with the function that draws it."""
    look: dict[str, Any] = {"views": views, "colour": colour, "units": outcome.units, "mark": outcome.mark}
    return path, partial(draw_picture, outcome.shown.surface, **look)


def draw_picture(
    surface: Surface,
    path: PathLike,
    views: Sequence[Any],
    colour: str,
    units: Units = NO_UNITS,
    mark: str = "",
) -> None:
    """Draw patches, Meyer's mean curvature (1/length) or its relative error as colours; or reactions."""
    check_picture(views, colour)
    if colour == "reactions":
        reactions(surface, path, view=views[0], units=units, mark=mark)
        return
    look: dict[str, Any] = {"mark": mark, "legend": colour not in ("curvature", "error")}
    if colour == "curvature":
        look |= {"scalars": mean_curvature(surface), "label": f"Meyer's mean curvature, {units.curvature}"}
    elif colour == "error":
        look |= {"scalars": curvature_error(surface), "label": "error of Meyer's mean curvature, relative"}
    if len(views) == 1:
        draw(surface, path, view=views[0], **look)
    else:
        look |= {"scalars": [look["scalars"]] * len(views)} if "scalars" in look else {}
        panel([surface] * len(views), path, views=views, **look)


def check_outputs(
    paths: Iterable[Path],
    made: Path | None = None,
    *,
    inputs: Iterable[Path] = (),
    pictures: Iterable[PathLike | None] | None = None,
) -> None:
    """Refuse, before any work, paths that cannot be written, as a library is missing, too; and those of a
    command's own ``inputs``, also by links and other ways to write them. The folder ``made`` may be missing.
    With the paths that are ``pictures``, what draws these and documents must be there, too."""
    paths = list(paths)
    if pictures is not None:
        drawn = {Path(picture) for picture in pictures if picture is not None}
        documents = [path for path in paths if path.suffix.lower() == ".pdf" and path not in drawn]
        if documents:
            require("reportlab", extra="report")
        if documents or drawn:
            require("matplotlib", extra="plot")
    for library, extra, suffixes in WRITERS:
        if any(path.suffix.lower() in suffixes for path in paths):
            require(library, extra=extra)
    seen, read = set(), [path for path in inputs if path.exists()]
    if made is not None and made.exists() and not made.is_dir():
        raise FileError(f"{made} is a file; the output needs a folder", what=str(made))
    for path in paths:
        check_name(path)
        place, folder, problem = str(path.resolve()).casefold(), path.parent, None  # alike on some systems
        try:
            is_folder = path.is_dir()
            there = next(f for f in (folder.absolute(), *folder.absolute().parents) if f.exists())
        except OSError as error:  # a name that is too long
            raise system_error(path, "written", error) from None
        if is_folder:
            problem = "is a folder; give the name of a file"
        elif path.exists() and any(path.samefile(one) for one in read):
            problem = "is read here, and is not written over; name another file"
        elif path.exists() and not path.is_file():
            problem = "is a pipe or a device; name a file"
        elif path.exists() and not os.access(path, os.W_OK):
            problem = "is there and read-only; name another file, or let it be written"
        elif place in seen:
            problem = "is named twice (capitals count as small letters); name two files"
        elif folder != made and not folder.is_dir():
            problem = f"there is no folder {folder}; create it first"
        elif not there.is_dir():
            problem = f"{there} is a file; the output needs a folder"
        elif not os.access(there, os.W_OK):
            problem = f"cannot be written (the folder {folder if folder.is_dir() else there} is read-only)"
        if problem:
            raise FileError(f"{path}: {problem}", what=str(path))
        seen.add(place)
