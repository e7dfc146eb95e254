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
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from ..base.arrays import Floats
from ..base.errors import FileError, FileWarning, LostWarning, MissingExtra, PcmcError, SurfaceError, unknown
from ..base.files import atomic_write, check_name, check_regular
from ..base.units import MICROMETRES, Units, length_factor
from ..base.validate import choice
from ..contact.pinching import standing_part
from ..surface import Plane, Surface, expect_surface
from .flat_walls import encode_walls, restore_walls
from .import_warnings import import_warnings
from .libraries import unreadable
from .mesh_data import MeshData, checked, merged, to_surface, without_unused
from .scaling import as_units, converted, scaled_surface


class Solved(Protocol):
    """The result of a solver."""

    @property
    def surface(self) -> Surface:
        """The surface reached."""

    @property
    def certificate(self) -> object:
        """Its certificate."""


@dataclass(frozen=True)
class Format:
    """What a file format can hold besides the triangles and the patches' names.

    Attributes
    ----------
    module : the module here that reads and writes it.
    scalars : "" for none, "vertices", or "both" vertices and faces.
    certificate : whether it holds the certificate.
    colours : whether it holds colours of vertices.
    shared : whether patches certainly share their vertices, so that reading needs no merging.
    separate : whether it has a mesh per patch, which cannot have triangles without area.
    walls : whether such triangles go with a separate format as text.
    lines : whether it holds the lines and circles that vertices slide along.
    cables : whether it holds cables.
    rooms : whether it holds the volumes that rooms prescribe.
    planes : whether it holds planes other than Π that vertices slide on, and mirror planes.
    loses : what it never holds.
    reads : whether pcmc reads it, too.
    unit : the unit of length that the format prescribes; empty if a file may have any, or says none.
    units : whether a file says its units.
    """

    module: str
    scalars: str = ""
    certificate: bool = False
    colours: bool = False
    shared: bool = False
    separate: bool = False
    walls: bool = False
    lines: bool = False
    cables: bool = False
    rooms: bool = False
    planes: bool = False
    loses: tuple[str, ...] = ()
    reads: bool = True
    unit: str = ""
    units: bool = True


FORMATS = {
    ".pcmc": Format(
        "native",
        scalars="both",
        certificate=True,
        shared=True,
        lines=True,
        planes=True,
        cables=True,
        rooms=True,
    ),
    ".fe": Format("evolver", shared=True, units=False, planes=True, cables=True, rooms=True),
    ".dmp": Format("evolver", shared=True, units=False, planes=True, cables=True, rooms=True),
    ".obj": Format("obj"),
    ".ply": Format("ply", scalars="both"),
    ".stl": Format("stl", separate=True, loses=("supports", "tensions", "pressures"), units=False),
    ".vtp": Format("vtk", scalars="both"),
    ".vtu": Format("vtk", scalars="both"),
    ".glb": Format("gltf", scalars="vertices", colours=True, separate=True, walls=True, unit="m"),
    ".gltf": Format("gltf", scalars="vertices", colours=True, separate=True, walls=True, unit="m"),
    ".usda": Format("usd", scalars="vertices", colours=True, separate=True, walls=True, reads=False),
    ".3dm": Format("rhino", separate=True, walls=True),
    ".ifc": Format("ifc", certificate=True, separate=True, walls=True),
}
"""The formats by suffix."""
READ_ONLY = {suffix: Format("meshlab") for suffix in (".off", ".3ds", ".dae", ".x3d")}
"""Formats that are read, by MeshLab, but not written."""

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
        raised = _in_file(path, error, type(error))
        if isinstance(error, SurfaceError):
            raised.args = (f"{raised}; or try: pcmc repair {os.fspath(path)} -o clean.obj",)
        raise raised from None
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
    form = _format(path, {**FORMATS, **READ_ONLY})
    if not form.reads:
        text = (
            f"{path}: pcmc writes {path.suffix} files and does not read them; read the surface's .pcmc file"
        )
        raise FileError(text, what=str(path), found=path.suffix)
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
    surface: Surface | Solved,
    *,
    scalars: Mapping[str, Floats] | None = None,
    certificate: object | None = None,
    colour: str = "",
    units: Units | str | None = None,
) -> None:
    """Write a surface as the suffix says; the file appears whole or not at all.

    A wall below a junction on Π has triangles without area. Formats with a mesh per patch (.stl, .glb,
    .gltf, .3dm, .ifc, .usda) leave them out; all but .stl hold these walls as text, and ``read`` puts them
    back. From .stl, and if another program changed the surface, the junction comes back sliding on Π.

    Parameters
    ----------
    path : the file; ``pcmc.io.FORMATS`` lists the suffixes.
    surface : a Surface, or the result of a solver; formats that hold a certificate then get the result's.
    scalars : (n,) or (m,) arrays by name (curvature, error, ...), for formats that hold them.
    certificate : a Certificate, or values by name, for the formats that hold it (.pcmc, .ifc).
    colour : the name in ``scalars`` of an (n,) array that colours the vertices, for formats that hold
        colours (.glb, .gltf, .usda). Without it each patch has a colour.
    units : of the surface: a unit of length such as "mm", or ``pcmc.base.units.Units`` with that of forces.
        The file says them. .glb and .gltf are in metres, as glTF prescribes: the surface is converted
        (scalars are not). Without a unit the numbers stay, and .3dm, .ifc and .usda files are in metres.

    Warns
    -----
    LostWarning : once, naming what the format cannot carry.
    FileWarning : if the coordinates are written relative to another origin (.stl).
    """
    path = Path(path)
    check_name(path)
    form = _format(path, FORMATS)
    surface, certificate = _unpacked(surface, certificate, form)
    for patch in surface.patches:
        if "\n" in patch.name or "\r" in patch.name:
            text = f"{path}: the patch name {patch.name!r} contains a line break; rename the patch"
            raise FileError(text, what=str(path), where="patches", found=patch.name)
    scalars = {name: _scalar(surface, name, value) for name, value in (scalars or {}).items()}
    sizes = {"": (), "vertices": (surface.n,), "both": (surface.n, surface.m)}[form.scalars]
    units = as_units(units)
    lost = [name for name, scalar in scalars.items() if len(scalar) not in sizes]
    if colour:
        choice("colour", colour, [name for name, scalar in scalars.items() if len(scalar) == surface.n])
        if not form.colours:
            lost.append(f"colours of {colour!r}")
    if certificate is not None and not form.certificate:
        lost.append("certificate")
    if surface.given_supports.on_line and not form.lines:
        lost.append("lines or circles that vertices slide along (they are fixed in it)")
    if surface.weights.any() and "tensions" in form.loses:
        lost.append("weights")
    if surface.cables and not form.cables:
        lost.append("cables")
    if surface.rooms and not form.rooms:
        lost.append("volumes of rooms (it has the pressures reached)")
    if surface.on_planes and not form.planes:
        lost.append("planes other than Π that vertices slide on, and mirror planes (fixed in it)")
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
        content: dict[str, Any] = {"scalars": scalars, "colour": colour, "certificate": values}
        content |= {"walls": walls, "units": units}
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


def _unpacked(given: Surface | Solved, certificate: object, form: Format) -> tuple[Surface, object]:
    """The surface, and the certificate of a solver's result if the format holds it and none is given."""
    surface: Any = given if isinstance(given, Surface) else getattr(given, "surface", given)
    expect_surface(surface)
    if surface is not given and form.certificate and certificate is None:
        certificate = getattr(given, "certificate", None)
    return surface, certificate


def _in_file(path: str | os.PathLike[str], error: PcmcError, kind: type[PcmcError]) -> PcmcError:
    """The error with the file's name in front, as one of this kind."""
    what = os.fspath(path) if kind is FileError else error.what
    text = f"{os.fspath(path)}: {error}"
    return kind(text, what=what, where=error.where, found=error.found, expected=error.expected)


def _format(path: Path, known: Mapping[str, Format]) -> Format:
    suffix = path.suffix.lower()
    if suffix not in known:
        readable = f"{suffix} files are read only; " if suffix in READ_ONLY else ""
        text = f"{path}: {readable}{unknown('suffix', suffix, known)}"
        raise FileError(text, what=str(path), found=suffix, expected=list(known))
    return known[suffix]


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
