"""Surfaces from files and to files, by suffix: a file here per format.

Gives ``read``, ``write`` and ``load``. May import ``meshing`` and the rooms below it.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.arrays import Floats
from ..base.errors import FileError, FileWarning, LostWarning, MissingExtra, PcmcError, unknown
from ..base.files import atomic_write, check_name, check_regular
from ..base.units import MICROMETRES, Units, length_factor
from ..base.validate import choice
from ..contact.pinching import standing_part
from ..surface import Plane, Surface
from .flat_walls import encode_walls, restore_walls
from .import_warnings import import_warnings
from .libraries import unreadable
from .mesh_data import MeshData, checked, merged, to_surface, without_unused
from .scaling import as_units, converted, scaled_surface


@dataclass(frozen=True)
class Format:
    """What a file format can hold besides the triangles and the patches' names.

    Attributes
    ----------
    module : the module here that reads and writes it.
    scalars : "" for none, "vertices", or "both" vertices and faces.
    certificate : whether it holds the certificate.
    shared : whether patches certainly share their vertices, so that reading needs no merging.
    separate : whether it has a mesh per patch, which cannot have triangles without area.
    walls : whether such triangles go with a separate format as text.
    lines : whether it holds the lines and circles that vertices slide along.
    loses : what it never holds.
    unit : the unit of length that the format prescribes; empty if a file may have any, or says none.
    units : whether a file says its units.
    """

    module: str
    scalars: str = ""
    certificate: bool = False
    shared: bool = False
    separate: bool = False
    walls: bool = False
    lines: bool = False
    loses: tuple[str, ...] = ()
    unit: str = ""
    units: bool = True


FORMATS = {
    ".pcmc": Format("native", scalars="both", certificate=True, shared=True, lines=True),
    ".fe": Format("evolver", shared=True, units=False),
    ".dmp": Format("evolver", shared=True, units=False),
    ".obj": Format("obj"),
    ".ply": Format("ply", scalars="both"),
    ".stl": Format("stl", separate=True, loses=("supports", "tensions", "pressures"), units=False),
    ".vtp": Format("vtk", scalars="both"),
    ".vtu": Format("vtk", scalars="both"),
    ".glb": Format("gltf", scalars="vertices", separate=True, walls=True, unit="m"),
    ".gltf": Format("gltf", scalars="vertices", separate=True, walls=True, unit="m"),
    ".3dm": Format("rhino", separate=True, walls=True),
}
"""The formats by suffix."""

NO_SUPPORTS = (
    "no supports in the file: its boundary is taken as fixed; tensions and pressures are 1 unless given"
)


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


def read_bare(path: str | os.PathLike[str]) -> tuple[Surface, MeshData]:
    """The Surface in a file, in the file's own units, and all its data; a note if it has no supports."""
    data = load(path)
    return _surface(path, data, ()), data


def _surface(path: str | os.PathLike[str], data: MeshData, given: tuple[Any, ...]) -> Surface:
    """The Surface of a file's data; warns of all that was changed."""
    try:
        surface = to_surface(data, *given)
    except PcmcError as error:
        raise _in_file(path, error, type(error)) from None
    notes = (*data.notes, *import_warnings(data))
    if not given and data.support is None:
        notes = (*notes, NO_SUPPORTS)
    if notes:
        warnings.warn(f"{os.fspath(path)}: {'; '.join(notes)}", FileWarning, stacklevel=3)
    return surface


def load(path: str | os.PathLike[str]) -> MeshData:
    """Everything in a file, scalars and certificate too. Errors as in ``read``."""
    path = Path(path)
    check_regular(path)
    form = _format(path)
    try:
        path.open("rb").close()  # the libraries' errors for a missing file differ
        data = without_unused(checked(import_module(f".{form.module}", __name__).read(path)))
        if form.unit:
            data = replace(data, units=Units(form.unit, data.units.force))
        if form.shared:
            return data
        return restore_walls(merged(data))
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror or error})", what=str(path)) from None
    except UnicodeDecodeError as error:
        text = f"{path}: byte {error.start} is not text; is it a {path.suffix} file?"
        raise FileError(text, what=str(path), where=error.start) from None
    except PcmcError as error:
        raise _in_file(path, error, FileError) from None
    except MissingExtra:
        raise
    except Exception as error:  # the net under the readers: a file may be wrong in a way that none checks
        raise _in_file(path, unreadable(path.suffix, error), FileError) from error


def write(
    path: str | os.PathLike[str],
    surface: Surface,
    *,
    scalars: Mapping[str, Floats] | None = None,
    certificate: object | None = None,
    units: Units | str | None = None,
) -> None:
    """Write a surface as the suffix says; the file appears whole or not at all.

    A wall below a junction on Π has triangles without area. Formats with a mesh per patch (.stl, .glb,
    .gltf, .3dm) leave them out; .glb, .gltf and .3dm hold these walls as text, and ``read`` puts them
    back. From .stl, and if another program changed the surface, the junction comes back sliding on Π.

    Parameters
    ----------
    path : the file; ``pcmc.io.FORMATS`` lists the suffixes.
    scalars : (n,) or (m,) arrays by name (curvature, error, ...), for formats that hold them.
    certificate : a Certificate, or values by name, for the format that holds it (.pcmc).
    units : of the surface: a unit of length such as "mm", or ``pcmc.base.units.Units`` with that of forces.
        The file says them. .glb and .gltf are in metres, as glTF prescribes: the surface is converted
        (scalars are not). Without a unit the numbers are written as they are, in .3dm as metres.

    Warns
    -----
    LostWarning : once, naming what the format cannot carry.
    FileWarning : if the coordinates are written relative to another origin (.stl).
    """
    path = Path(path)
    check_name(path)
    form = _format(path)
    for patch in surface.patches:
        if "\n" in patch.name or "\r" in patch.name:
            text = f"{path}: the patch name {patch.name!r} contains a line break; rename the patch"
            raise FileError(text, what=str(path), where="patches", found=patch.name)
    scalars = {name: _scalar(surface, name, value) for name, value in (scalars or {}).items()}
    sizes = {"": (), "vertices": (surface.n,), "both": (surface.n, surface.m)}[form.scalars]
    units = as_units(units)
    lost = [name for name, scalar in scalars.items() if len(scalar) not in sizes]
    if certificate is not None and not form.certificate:
        lost.append("certificate")
    if surface.on_line and not form.lines:
        lost.append("lines or circles that vertices slide along (they are fixed in it)")
    if units and not form.units:
        lost.append(f"its unit {units.length}")
    if units and form.unit:
        surface = scaled_surface(surface, length_factor(units.length, form.unit))
        units = Units(form.unit, units.force)
    shown, walls = surface, None
    if form.separate:
        shown = standing_part(surface).surface
        if shown.m < surface.m and form.walls:
            walls = encode_walls(surface, shown)
        elif shown.m < surface.m:
            lost.append(f"{surface.m - shown.m} triangles of walls without height")
    values = _values(certificate)
    try:
        module = import_module(f".{form.module}", __name__)
        content = {"scalars": scalars, "certificate": values, "walls": walls, "units": units}
        with atomic_write(path) as temporary:
            note = module.write(temporary, shown, **content)
    except OSError as error:
        raise FileError(f"{path}: cannot be written ({error.strerror or error})", what=str(path)) from None
    except PcmcError as error:
        raise _in_file(path, error, FileError) from None
    if lost:
        text = f"{path}: a {path.suffix} file cannot carry {', '.join([*lost, *form.loses])}; left out"
        warnings.warn(text, LostWarning, stacklevel=2)
    if note:
        warnings.warn(f"{path}: {note}", FileWarning, stacklevel=2)


def _in_file(path: str | os.PathLike[str], error: PcmcError, kind: type[PcmcError]) -> PcmcError:
    """The error with the file's name in front, as one of this kind."""
    what = os.fspath(path) if kind is FileError else error.what
    text = f"{os.fspath(path)}: {error}"
    return kind(text, what=what, where=error.where, found=error.found, expected=error.expected)


def _format(path: Path) -> Format:
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        text = f"{path}: {unknown('suffix', suffix, FORMATS)}"
        raise FileError(text, what=str(path), found=suffix, expected=list(FORMATS))
    return FORMATS[suffix]


def _values(certificate: Any) -> Mapping[str, Any]:
    """The certificate's public values by name."""
    if certificate is None or isinstance(certificate, Mapping):
        return certificate or {}
    if not is_dataclass(certificate):
        found = type(certificate).__name__
        raise FileError(
            f"certificate: expected a Certificate, found {found}", what="certificate", found=found
        )
    shown = [f.name for f in fields(certificate) if f.repr and not f.name.startswith("_")]
    return {name: getattr(certificate, name) for name in shown}


def _scalar(surface: Surface, name: str, value: npt.ArrayLike) -> Floats:
    array = np.asarray(value, dtype=float)
    if array.shape not in ((surface.n,), (surface.m,)):
        shapes = f"({surface.n},) for vertices or ({surface.m},) for faces"
        text = f"scalars[{name!r}]: expected shape {shapes}, found {array.shape}"
        raise FileError(text, what="scalars", where=name, found=array.shape)
    return array
