"""Surfaces from files."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy.typing as npt

from ..base.errors import FileError, FileWarning, MissingExtra, PcmcError, SurfaceError
from ..base.files import as_path, check_regular, system_error
from ..base.units import MICROMETRES, Units
from ..base.validate import choice
from ..surface import Plane, Surface
from .flat_walls import restore_walls
from .formats import FORMATS, READ_ONLY, Format, format_of
from .import_warnings import import_warnings
from .libraries import unreadable
from .mesh_data import MeshData, checked, merged, to_surface, without_unused
from .metadata import with_parts
from .scaling import converted, stated

NO_SUPPORTS = "no supports in the file: its boundary is taken as fixed"
NO_UNIT = "no unit of length in the file; name it with --units mm, say"


def read(
    path: str | os.PathLike[str],
    *,
    tensions: Mapping[str, float] | float | None = None,
    pressures: Mapping[str, float] | float | None = None,
    fixed: npt.ArrayLike | str | None = None,
    on_plane: npt.ArrayLike | None = None,
    plane: Plane | None = None,
    units: str = "m",
) -> Surface:
    """The Surface in a file, read as its suffix says.

    Parameters
    ----------
    path : the file; ``pcmc.io.FORMATS`` lists the suffixes.
    tensions, pressures : by patch name, or one number for all, in place of the file's. Formats that
        carry neither give 1 for both.
    fixed, on_plane : as in Surface, in place of the file's; ``fixed="boundary"`` fixes all boundary
        vertices, and is the default for formats without supports.
    plane : Π in place of the file's, or the plane z = 0 if it has none.
    units : the unit of length of the Surface. A file in another unit is converted: coordinates, and the
        tensions and pressures that it has. The numbers of a file without a unit stay. A Surface itself has no
        unit: give the same to ``write``.

    Warns
    -----
    FileWarning : once, with all that was changed (another unit, polygons cut into triangles, unused
        vertices left out, ...) and all probable mistakes in a mesh from another program (an open seam,
        patches turned against each other, an axis up that is not z).

    Raises
    ------
    FileError : for a file that is missing, cut off or not of its suffix's format. ``what`` is the
        file, ``where`` the line or element.
    SurfaceError : for a mesh that is not a surface.
    MissingExtra : when the format needs a library that is not installed.
    OptionError : for an unknown unit.
    """
    choice("units", units, tuple(MICROMETRES))
    data = load(path)
    return _surface(path, converted(data, units), (tensions, pressures, fixed, on_plane, plane))


def read_bare(path: str | os.PathLike[str], units: str = "", assumed: str = "") -> tuple[Surface, MeshData]:
    """The Surface in a file and all its data; a note if it lacks supports, tensions or a unit.

    Parameters
    ----------
    path : of the file.
    units : the unit of length wanted; by default the file's own.
    assumed : of the numbers in a file without a unit; by default the one wanted.
    """
    data = converted(stated(load(path), assumed or units), units)
    return _surface(path, data, ()), data


def _surface(path: str | os.PathLike[str], data: MeshData, given: tuple[Any, ...]) -> Surface:
    """The Surface of a file's data; warns of all that was changed."""
    try:
        surface = to_surface(data, *given)
    except PcmcError as error:
        raised = error.in_file(path)
        if isinstance(error, SurfaceError):
            raised.args = (f"{raised}; or try: pcmc repair {os.fspath(path)} -o clean.obj",)
        raise raised from None
    notes = (*data.notes, *import_warnings(data, path))
    if not given:
        some = f" of {', '.join(map(repr, data.bare))}" if len(data.bare) < len(data.patches) else ""
        values = f"tensions and pressures{some} are 1 unless given"
        hints = {
            NO_SUPPORTS: data.support is None,
            values: data.bare,
            NO_UNIT: data.bare and not data.units,
        }
        notes = (*notes, *(text for text, true in hints.items() if true))
    if notes:
        warnings.warn(f"{os.fspath(path)}: {'; '.join(notes)}", FileWarning, stacklevel=3)
    return surface


def load(path: str | os.PathLike[str]) -> MeshData:
    """Everything in a file, scalars and certificate too. Errors as in ``read``."""
    path = as_path(path)
    with opened(path) as form:
        data = without_unused(checked(contents(form, path)))
        return with_parts(data if form.shared else restore_walls(merged(data)))


def contents(form: Format, path: Path) -> MeshData:
    """What the reader of a format finds in a file, in the unit that the format prescribes."""
    data: MeshData = form.functions.read(path)
    return replace(data, units=Units(form.unit, data.units.force)) if form.unit else data


@contextmanager
def opened(path: Path) -> Iterator[Format]:
    """The format of a file that is read in the block; what goes wrong there is a FileError with its name."""
    check_regular(path)
    form = format_of(path, {**FORMATS, **READ_ONLY})
    if not form.reads:
        text = (
            f"{path}: pcmc writes {path.suffix} files and does not read them; read the surface's .pcmc file"
        )
        raise FileError(text, what=str(path), found=path.suffix)
    try:
        path.open("rb").close()  # the libraries' errors for a missing file differ
        yield form
    except OSError as error:
        raise system_error(path, "read", error) from None
    except UnicodeDecodeError as error:
        text = f"{path}: byte {error.start} is not text; is it a {path.suffix} file?"
        raise FileError(text, what=str(path), where=error.start) from None
    except PcmcError as error:
        raise error.in_file(path, FileError, str(path)) from None
    except MissingExtra:
        raise
    except Exception as error:  # the net under the readers: a file may be wrong in a way that none checks
        raise unreadable(path.suffix, error).in_file(path, FileError, str(path)) from error
