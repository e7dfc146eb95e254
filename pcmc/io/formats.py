"""The file formats by suffix, and what each can hold."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from ..base.arrays import Floats
from ..base.errors import FileError, unknown
from ..base.files import PathLike
from ..base.units import Units
from ..surface import HeldCurve, Plane, Surface
from .georeference import Georeference

LOST = ("order", "images")


class Format(NamedTuple):
    """What a file format can hold besides the triangles and the patches' names."""

    module: str  # the module here that reads and writes it
    scalars: str = ""  # "" for none, "vertices", or "both" vertices and faces
    reserved: tuple[str, ...] = ()  # names that scalars cannot have
    certificate: bool = False
    colours: bool = False  # of vertices
    shared: bool = False  # whether patches certainly share their vertices: reading needs no merging
    separate: bool = False  # whether it has a mesh per patch, which cannot have triangles without area
    own: tuple[str, ...] = ()  # the parts that it holds in its own way; others are among the metadata
    bare: bool = False  # whether it holds nothing but triangles and names
    loses: tuple[str, ...] = LOST  # the ``PARTS`` that it does not hold
    reads: bool = True  # whether pcmc reads it, too
    besides: tuple[str, ...] = ()  # what it holds besides the surface, as ``write`` takes it
    unit: str = ""  # of length, that the format prescribes; empty if a file may have any, or says none

    @property
    def functions(self) -> Any:
        return import_module(f".{self.module}", __package__)

    def carried(self, surface: Surface, scalars: Mapping[str, Floats]) -> dict[str, Floats]:
        """Those of a surface's scalars that the format holds."""
        sizes = {"": (), "vertices": (surface.n,), "both": (surface.n, surface.m)}[self.scalars]
        return {name: values for name, values in scalars.items() if len(values) in sizes}

    def lost(self, surface: Surface, units: Units) -> list[str]:
        """What of a surface the format does not hold, in words."""
        parts = [PARTS[part] for part in self.loses]
        return [part.words.format(unit=units.length) for part in parts if part.there(surface, units)]


class Content(NamedTuple):
    """What a writer gets besides a surface."""

    metadata: str  # the text of ``metadata_text``
    scalars: Mapping[str, Floats]
    colour: str  # the scalar that colours the vertices, or ""
    certificate: Mapping[str, Any]  # its values by name
    walls: str | None  # the text of ``encode_walls``
    units: Units
    bare: Collection[str]  # the patches whose tension and pressure of 1 stand for none
    members: Sequence[Any]  # as ``structure.drawn_members`` has them
    cable_areas: Mapping[str, float]  # of the cables' sections, by name
    mark: str  # of a part of a roof, and of one that is not in order, such as "NOT CERTIFIED: …"; or ""
    georeference: Georeference | None


PLANES = "planes other than Π that vertices slide on, and mirror planes (fixed in it)"
ROOMS = "volumes of rooms (it has the pressures reached)"
LINES = "lines or circles that vertices slide along (they are fixed in it)"

ORDER = "its curved elements (it has the flat triangles that join their nodes)"
BENT = "the curves that its edges were drawn on (finer meshes guess them)"
IMAGES = "which vertices are images of others (it has the cell alone, with a boundary and without rooms)"


class FormatPart(NamedTuple):
    """A part that not every surface has, and not every format holds."""

    words: str  # that tell of its loss; empty where a program can do without
    since: int  # version of .pcmc
    there: Callable[[Surface, Units], object]  # whether a surface, or its file, has it


def _bent(held: HeldCurve) -> bool:
    return any(len(piece.points) > 2 for piece in held.curve.pieces)


def _elsewhere(plane: Plane) -> bool:
    """Whether heights over it are not the z of a file."""
    return plane.normal != (0.0, 0.0, 1.0) or plane.point[2] != 0.0


PARTS = {
    "weights": FormatPart("weights", 4, lambda surface, _: surface.weights.any()),
    "snow": FormatPart("snow", 5, lambda surface, _: surface.snows.any()),
    "lines": FormatPart(LINES, 6, lambda surface, _: surface.given_supports.on_line),
    "cables": FormatPart("cables", 6, lambda surface, _: surface.cables),
    "cable weights": FormatPart("weights of cables", 8, lambda surface, _: surface.cable_edges.weight.any()),
    "rooms": FormatPart(ROOMS, 6, lambda surface, _: surface.rooms),
    "plane": FormatPart("its plane Π", 1, lambda surface, _: _elsewhere(surface.plane)),
    "planes": FormatPart(PLANES, 6, lambda surface, _: surface.on_planes),
    "curves": FormatPart("", 7, lambda surface, _: surface.held_curves),
    "bent curves": FormatPart(BENT, 7, lambda surface, _: any(map(_bent, surface.held_curves))),
    "order": FormatPart(ORDER, 9, lambda surface, _: surface.order > 1),
    "images": FormatPart(IMAGES, 10, lambda surface, _: surface.periodic),
    "unit": FormatPart("its unit {unit}", 1, lambda _, units: units),
}
TOLD = tuple(name for name, part in PARTS.items() if part.words)
MODEL = ("members", "cable_areas")  # of a structural model
OURS = ("support", "patch")
EVOLVER = Format("evolver", shared=True, loses=("lines", "cable weights", "bent curves", *LOST, "unit"))
FORMATS = {
    ".pcmc": Format("native", "both", certificate=True, shared=True, own=("curves",), loses=()),
    **dict.fromkeys((".fe", ".dmp"), EVOLVER),
    ".obj": Format("obj"),
    ".ply": Format("ply", "both", reserved=(*"xyz", *OURS, "vertex_indices")),
    ".stl": Format("stl", separate=True, bare=True, loses=TOLD),
    **dict.fromkeys((".vtp", ".vtu"), Format("vtk", "both", reserved=OURS, loses=("images",))),
    **dict.fromkeys((".glb", ".gltf"), Format("gltf", "vertices", colours=True, separate=True, unit="m")),
    ".usda": Format("usd", "vertices", colours=True, separate=True, reads=False),
    ".3dm": Format("rhino", separate=True, besides=MODEL, own=("cables",)),
    ".ifc": Format("ifc", certificate=True, separate=True, besides=(*MODEL, "georeference")),
}
"""The formats by suffix."""
METRES = (".glb", ".gltf", ".3dm", ".ifc", ".usda")
"""Formats whose lengths are metres without a unit."""
READ_ONLY = {suffix: Format("repairing") for suffix in (".off", ".3ds", ".dae", ".x3d")}
"""Formats that are read, by MeshLab, but not written."""


def format_of(path: Path, known: Mapping[str, Format]) -> Format:
    suffix = path.suffix.lower()
    if suffix not in known:
        readable = f"{suffix} files are read only; " if suffix in READ_ONLY else ""
        text = f"{path}: {readable}{unknown('suffix', suffix, known)}"
        raise FileError(text, what=str(path), found=suffix, expected=list(known))
    return known[suffix]


def metres_note(files: Iterable[PathLike], unit: str) -> list[str]:
    """That files which are in metres take numbers without a unit as they are.

    >>> metres_note(["hall.obj", "hall.glb"], "")[0].split(";")[0]
    'hall.glb: there is no unit of length, so metres are assumed'
    """
    named = [Path(file).name for file in files if Path(file).suffix.lower() in METRES]
    if unit or not named:
        return []
    text = f"{', '.join(named)}: there is no unit of length, so metres are assumed"
    return [f'{text}; if the numbers are mm, type --units mm, or units = "mm" in a project']
