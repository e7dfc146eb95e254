"""Running a project: solve it, then write all that it asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

from .. import io
from ..base.files import folder as made
from ..structure import write_structure
from ..surface import Surface, unfolded
from . import cache
from .documents import schedule_works
from .file import PathLike, Project, in_file, load
from .outcome import Outcome
from .output import OnStep, Works, check_names, check_outputs, fields, ignore, paint, write_all
from .solving import solve_from_start

CONTENTS = {
    ".csv": "panels",
    ".inp": "structural model",
    ".dxf": "drawings",
    ".pdf": "drawings",
    ".svg": "drawing",
}


def run(
    path: PathLike, out_dir: PathLike | None = None, progress: OnStep | None = None, *, anyway: bool = False
) -> Outcome:
    """Mesh, solve, meet the targets, certify, and write all output of a project.

    Parameters
    ----------
    path : the project file.
    out_dir : folder for the output, made if it is missing; by default that of the project file.
    progress : called with a few words at each step.
    anyway : write the output even if the surface is not certified or misses a target.

    Returns
    -------
    Outcome
        Nothing is written, and ``files`` is empty, if the surface is not certified or misses a target.

    Raises
    ------
    FileError, PlanError, OptionError
        The message is one line and names the file. Nothing is written.

    Warns
    -----
    BalanceWarning
        Before solving, if the tensions at a junction cannot balance.
    """
    project = load(path)
    project = project if out_dir is None else project.in_folder(out_dir)
    return run_project(project, progress, anyway=anyway)


def run_project(
    project: Project,
    progress: OnStep | None = None,
    *,
    changed: Callable[[Surface], Surface] | None = None,
    anyway: bool = False,
    use_cache: bool = True,
    check_after: bool = True,
) -> Outcome:
    """As ``run``, for a loaded project; ``changed`` is applied to its initial surface.

    The mesh check comes after the files are written, so that Ctrl-C during it leaves them. Where a report is
    among them, it comes before, unless ``mesh_check`` is false or the mesh is large. Without ``check_after``
    the caller makes it. A good roof is kept in
    the cache, unless it was changed or ``use_cache`` is false; it is solved in any case.
    """
    report = progress or ignore
    project = project if project.folder is not None else project.in_folder(project.path.parent)
    outputs = project.outputs
    check_names(project.files, project.picture)
    check_outputs(outputs, project.folder, inputs=project.inputs)
    outcome = solve_from_start(project, report, changed)
    if project.whole:
        report("certifying the whole")
        outcome.whole  # noqa: B018 — computed here, while the progress is shown
    for what in project.margin if outcome.certified else ():
        outcome.margin(what, report)
    if outputs and (outcome.good or anyway):
        works = surface_files(outcome, project.files)
        if project.picture is not None:
            painting = partial(paint, views=project.views, colour=project.colour, units=outcome.units)
            works.append((Path(project.picture), partial(painting, outcome.shown.surface)))
        works += _documents(project, outcome, anyway, report)
        with made(project.folder or Path()):
            outcome = outcome.written(write_all(works, report))
    if use_cache and changed is None:
        cache.keep(project, outcome)
    if check_after and project.mesh_check and outcome.wants_mesh_check():
        outcome.check_mesh(report)
    return outcome


def _documents(project: Project, outcome: Outcome, anyway: bool, report: OnStep) -> Works:
    """The project's documents, each with the function that writes it.

    A document of a roof that is not certified is marked.
    """
    documents, works = project.documents, Works()
    if not documents.names:
        return works
    if documents.report is not None and outcome.wants_mesh_check():
        outcome.check_mesh(report)
    report("drawing, sorting panels, modelling")
    with in_file(project.path):
        if documents.drawings:
            works += outcome.drawing_set(documents, anyway=anyway).files(*documents.drawings)
        if documents.panels is not None and documents.tolerance is not None:
            schedule = outcome.panels(documents.tolerance, anyway=anyway)
            works += schedule_works(Path(documents.panels), schedule)
        if documents.structure is not None and project.structure is not None:
            model = outcome.model(project.structure, anyway)
            works.append((Path(documents.structure), partial(write_structure, model=model)))
        if documents.report is not None:
            listed = {path.name: "project" for path in project.inputs[:1]}
            listed |= {path.name: "drawing or mesh of the roof" for path in project.inputs[1:]}
            listed |= {Path(file).name: "surface" for file in project.files}
            listed |= {} if project.picture is None else {Path(project.picture).name: "picture"}
            listed |= {path.name: CONTENTS[path.suffix.lower()] for path, _ in works}
            works.append(
                (Path(documents.report), outcome.report(documents, files=listed, anyway=anyway).write)
            )
    return works


def surface_files(outcome: Outcome, files: Iterable[PathLike], colour: str = "") -> Works:
    """The files of a roof with all that their formats hold, for ``write_all``.

    ``colour`` names the scalar that colours vertices. The fields of a surface that was not solved are those
    of its file, and are missed where a format lacks them; fields and certificate of another nobody asked for.
    """
    surface, certificate, data = *outcome.shown, outcome.data
    about: dict[str, Any] = {"units": outcome.units, "colour": colour}
    if outcome.result is None:
        about |= {"scalars": data.scalars, "certificate": data.certificate or None} if data else {}
        if outcome.unfold:
            unfold, half = unfolded(outcome.surface), outcome.surface
            place = {half.m: unfold.face, half.n: unfold.vertex}
            carried = {name: values[place[len(values)]] for name, values in about.get("scalars", {}).items()}
            about |= {"scalars": carried, "certificate": None}
        return [(Path(file), partial(io.write, surface=surface, **about)) for file in files]
    works: Works = []
    scalars = fields(surface, certificate)
    for file in map(Path, files):
        form = io.FORMATS[file.suffix.lower()]
        coloured = {name: values for name, values in scalars.items() if name == colour}
        about["scalars"] = form.carried(surface, scalars) | coloured
        about["certificate"] = certificate if form.certificate else None
        works.append((file, partial(io.write, surface=surface, **about)))
    return works
