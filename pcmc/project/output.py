"""Writing the output of a project: files, a picture and tables, all of them or none."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ..base.errors import FileError, FileWarning, PcmcError
from ..base.files import PathLike, atomic_writes, check_name, system_error, writing
from ..base.interrupts import defer_interrupts
from ..base.units import NO_UNITS, Units
from ..forces.curvature import curvature_error, mean_curvature
from ..panelling import Panels
from ..surface import Surface
from .settings import check_picture, schedule_paths

FileJobs = list[tuple[Path, Callable[[Path], Any]]]  # each file with the function that writes it
OnStep = Callable[[str], object]  # called with a few words at each step of a project


def ignore(step: str) -> None:
    """An ``OnStep`` that shows nothing."""


def write_all(jobs: FileJobs, progress: OnStep = ignore) -> list[Path]:
    """Write files, each by its own function of a path; all of them appear together, or none.

    The functions write to temporary files; errors and warnings name the final ones.
    """
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
    paths = schedule_paths(path)
    return [(one, partial(table.to_csv, index=False)) for one, table in zip(paths, tables, strict=True)]


def paint(
    surface: Surface, path: PathLike, views: Sequence[Any], colour: str, units: Units = NO_UNITS
) -> None:
    """Draw patches, mean curvature (1/length) or its relative error as colours, or reactions as arrows.

    Several views stand side by side; reactions have one.
    """
    # needs the extra plot, which a project without a picture does not
    from ..plot import draw, panel, reactions

    check_picture(views, colour)
    look: dict[str, Any] = {"legend": True}
    scalars = None
    if colour == "reactions":
        reactions(surface, path, view=views[0], units=units)
        return
    if colour == "curvature":
        scalars, look = mean_curvature(surface), {"label": f"mean curvature, {units.curvature}"}
    elif colour == "error":
        scalars, look = curvature_error(surface), {"label": "curvature error"}
    if len(views) == 1:
        draw(surface, path, view=views[0], scalars=scalars, **look)
    else:
        count = len(views)
        each = None if scalars is None else [scalars] * count
        panel([surface] * count, path, views=views, scalars=each, **look)


def check_outputs(paths: Iterable[Path], made: Path | None = None, *, inputs: Iterable[Path] = ()) -> None:
    """Refuse, before any work, paths that cannot be written, and those of a command's own ``inputs``.

    The folder ``made`` may be missing. A link to an input, and another way to write its path, is the input.
    """
    seen, read = set(), [path for path in inputs if path.exists()]
    if made is not None and made.exists() and not made.is_dir():
        raise FileError(f"{made} is a file; the output needs a folder", what=str(made))
    for path in paths:
        check_name(path)
        place = os.path.normcase(path.resolve())
        folder = path.parent
        try:
            is_folder = path.is_dir()
            there = next(f for f in (folder.absolute(), *folder.absolute().parents) if f.exists())
        except OSError as error:  # a name that is too long
            raise system_error(path, "written", error) from None
        problem = None
        if is_folder:
            problem = "is a folder; give the name of a file"
        elif path.exists() and any(path.samefile(one) for one in read):
            problem = "is read here, and is not written over; name another file"
        elif path.exists() and not path.is_file():
            problem = "is a pipe or a device; name a file"
        elif place in seen:
            problem = "is named twice; name two files for the output"
        elif folder != made and not folder.is_dir():
            problem = f"there is no folder {folder}; create it first"
        elif not there.is_dir():
            problem = f"{there} is a file; the output needs a folder"
        elif not os.access(there, os.W_OK):
            problem = f"cannot be written (the folder {folder if folder.is_dir() else there} is read-only)"
        if problem:
            raise FileError(f"{path}: {problem}", what=str(path))
        seen.add(place)
