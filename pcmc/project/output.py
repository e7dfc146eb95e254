"""What a project writes: files and a picture, all of them or none."""

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
from ..base.arrays import Floats
from ..base.errors import FileError, FileWarning, LostWarning, OptionError, PcmcError, unknown
from ..base.files import atomic_writes
from ..base.interrupts import defer_interrupts
from ..certificate.certificate import Certificate
from ..energy.curvature import curvature_error, mean_curvature
from ..solvers.result import Result
from ..surface import Surface

PathLike = str | os.PathLike[str]
Say = Callable[[str], object]
COLOURS = ("patches", "curvature", "error", "reactions")


def silent(words: str) -> None:
    """Say nothing."""


def save(
    result: Result, files: Iterable[PathLike], picture: PathLike | None = None, *,
    view: Any = "diagonal", colour: str = "patches", progress: Say | None = None,
) -> list[Path]:  # fmt: skip
    """Write a result to files and a picture of it: all of them, or none.

    ``fields`` and the certificate go where the format can carry them.
    """
    surface, found = result.surface, result.certificate
    scalars = fields(surface, found)

    def write(path: Path) -> None:
        io.write(path, surface, scalars=scalars, certificate=found)

    def draw(path: Path) -> None:
        paint(surface, path, view, colour)

    works = [(Path(file), write) for file in files]
    if picture is not None:
        works.append((Path(picture), draw))
    return write_all(works, progress)


def fields(surface: Surface, found: Certificate) -> dict[str, Floats]:
    """What travels with a surface, by vertex: mean curvature (1/length), its relative error, and the size
    of the reaction where it is supported (force)."""
    return {
        "mean curvature": mean_curvature(surface),
        "error": curvature_error(surface),
        "reaction": np.linalg.norm(found.reactions, axis=1),
    }


def write_all(
    works: Iterable[tuple[Path, Callable[[Path], None]]], progress: Say | None = None
) -> list[Path]:
    """Files and what writes each, given where to; all appear together, or none does.

    Errors name the file itself and not the temporary one in its place.
    """
    say, works = progress or silent, list(works)
    paths = [path for path, _ in works]
    check_outputs(paths)
    with atomic_writes(paths) as temporaries:
        for (path, write), temporary in zip(works, temporaries, strict=True):
            say(f"writing {path.name}")
            try:
                with defer_interrupts(), _named(temporary, path):
                    write(temporary)
            except OSError as error:
                raise FileError(f"{path}: cannot be written ({error.strerror or error})") from None
            except PcmcError as error:
                text = str(error).replace(f"{temporary}: ", "")
                raise FileError(f"{path}: {text}") from None
    return paths


@contextmanager
def _named(temporary: Path, path: Path) -> Iterator[None]:
    """Warnings with the file's own name, but for what its format cannot carry, which nobody asked for."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", FileWarning)
        yield
    for warning in found:
        if not issubclass(warning.category, LostWarning):
            text = str(warning.message).replace(str(temporary), str(path))
            warnings.warn(text, warning.category, stacklevel=4)


def paint(surface: Surface, path: PathLike, view: Any, colour: str) -> None:
    """A picture with the patches, the mean curvature (1/length) or its relative error as colours, or
    with the reactions of the supports as arrows."""
    # needs the extra plot, which a project without picture does not
    from ..plot import draw, reactions

    check_picture(view, colour)
    if colour == "curvature":
        draw(surface, path, view=view, scalars=mean_curvature(surface), label="mean curvature")
    elif colour == "error":
        draw(surface, path, view=view, scalars=curvature_error(surface), label="curvature error")
    elif colour == "reactions":
        reactions(surface, path, view=view)
    else:
        draw(surface, path, view=view, legend=True)


def check_picture(view: Any, colour: str) -> None:
    """Refuse a view or colour that ``paint`` does not know."""
    from ..plot.scene import VIEWS

    if colour not in COLOURS:
        raise OptionError(unknown("colour", colour, COLOURS))
    if isinstance(view, str):
        if view not in VIEWS:
            raise OptionError(unknown("view", view, VIEWS))
    elif not (isinstance(view, Sequence) and len(view) == 2) or not all(
        isinstance(angle, int | float) and math.isfinite(angle) for angle in view
    ):
        raise OptionError(f"view: expected a name or two angles in degrees, found {view!r}")


def check_names(files: Iterable[PathLike], picture: PathLike | None = None) -> None:
    """Refuse names of files that hold no surface, and of a picture that is none."""
    for file in files:
        suffix = Path(file).suffix.lower()
        if suffix not in io.FORMATS:
            hint = "; a picture has an option of its own" if suffix == ".png" else ""
            raise FileError(f"{file}: {unknown('suffix', suffix, io.FORMATS)}{hint}")
    if picture is not None and Path(picture).suffix.lower() != ".png":
        raise FileError(f"{picture}: a picture is written as .png; name it so")


def check_outputs(paths: Iterable[Path], made: Path | None = None) -> None:
    """Refuse, before any work, what cannot be written; ``made`` is a folder that is made if missing."""
    seen: list[str] = []
    if made is not None and made.exists() and not made.is_dir():
        raise FileError(f"{made}: is a file; the output needs a folder")
    for path in paths:
        if path.is_dir():
            raise FileError(f"{path}: is a folder; give the name of a file")
        place = os.path.normcase(path.absolute())
        if place in seen:
            raise FileError(f"{path}: is named twice among the output")
        seen.append(place)
        folder = path.parent
        if folder != made and not folder.is_dir():
            raise FileError(f"{path}: there is no folder {folder}; make it first")
        there = next(f for f in (folder.absolute(), *folder.absolute().parents) if f.exists())
        if not there.is_dir():
            raise FileError(f"{path}: {there} is a file; the output needs a folder")
        if not os.access(there, os.W_OK):
            shown = folder if folder.is_dir() else there
            raise FileError(f"{path}: cannot be written (the folder {shown} is read-only)")
