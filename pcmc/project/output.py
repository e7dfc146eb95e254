"""The output of a project: files and a picture, all of them or none."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from .. import io
from ..base import validate
from ..base.arrays import Floats
from ..base.errors import FileError, FileWarning, PcmcError, unknown
from ..base.files import atomic_writes, check_name, system_error, writing
from ..base.interrupts import defer_interrupts
from ..base.units import NO_UNITS, Units
from ..certificate.certificate import Certificate
from ..forces.curvature import curvature_error, mean_curvature
from ..plot.figure import SUFFIXES, check_suffix
from ..surface import Surface

PathLike = str | os.PathLike[str]
Works = list[tuple[Path, Callable[[Path], Any]]]  # each file with the function that writes it
OnStep = Callable[[str], object]  # called with a few words at each step of a project
COLOURS = ("patches", "curvature", "error", "reactions")


def ignore(step: str) -> None:
    """An ``OnStep`` that shows nothing."""


def fields(surface: Surface, certificate: Certificate) -> dict[str, Floats]:
    """Values (n,) by vertex: mean curvature (1/length), its relative error, and the size of the
    reaction at supports (force)."""
    return {
        "mean curvature": mean_curvature(surface),
        "error": curvature_error(surface),
        "reaction": np.linalg.norm(certificate.reactions, axis=1),
    }


def write_all(works: Works, progress: OnStep | None = None) -> list[Path]:
    """Write files, each by its own function of a path; all of them appear together, or none.

    The functions write to temporary files; errors and warnings name the final ones.
    """
    report = progress or ignore
    paths = [path for path, _ in works]
    check_outputs(paths)
    with atomic_writes(paths) as temporaries:
        for (path, write), temporary in zip(works, temporaries, strict=True):
            report(f"writing {path.name}")
            try:
                with writing(temporary), defer_interrupts(), _final_name_in_warnings(temporary, path):
                    write(temporary)
            except PcmcError as error:
                text = str(error).replace(f"{temporary}: ", "")
                raise FileError(f"{path}: {text}", what=str(path)) from None
    return paths


@contextmanager
def _final_name_in_warnings(temporary: Path, path: Path) -> Iterator[None]:
    """Warnings name the final file."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", FileWarning)
        yield
    for warning in caught:
        text = str(warning.message).replace(str(temporary), str(path))
        warnings.warn(text, warning.category, stacklevel=4)


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


def check_picture(views: Sequence[Any], colour: str) -> None:
    """Refuse views or a colour that ``paint`` does not know."""
    validate.choice("colour", colour, COLOURS)
    if not views:
        validate.refuse("views", views, "at least one view")
    if colour == "reactions" and len(views) > 1:
        validate.refuse("views", len(views), "one view for a picture of reactions")
    for view in views:
        _check_view(view)


def _check_view(view: Any) -> None:
    from ..plot.scene import VIEWS

    if isinstance(view, str):
        validate.choice("view", view, tuple(VIEWS))
    else:
        angles = view if isinstance(view, Sequence) and len(view) == 2 else [math.nan]
        if not all(isinstance(angle, int | float) and math.isfinite(angle) for angle in angles):
            validate.refuse("view", view, "a name or two angles in degrees")


def check_names(files: Iterable[PathLike], picture: PathLike | None = None) -> None:
    """Refuse empty file names, and those whose suffix is no format of surfaces, or of pictures."""
    for file in files:
        if not str(file).strip():
            raise FileError(
                "the name of an output file is empty; give one, such as 'roof.obj'", what="output"
            )
        suffix = Path(file).suffix.lower()
        if suffix not in io.FORMATS:
            hint = "; a picture has its own option" if suffix in SUFFIXES else ""
            text = f"{file}: {unknown('suffix', suffix, io.FORMATS)}{hint}"
            raise FileError(text, what=str(file), found=suffix)
    if picture is not None:
        check_suffix(picture)


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
