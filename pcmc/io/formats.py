"""The file formats by suffix, and what each can hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from ..base.errors import FileError, unknown
from ..base.units import Units
from ..surface import Surface


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

    @property
    def functions(self) -> Any:
        """The module that reads and writes the format."""
        return import_module(f".{self.module}", __package__)

    def lost(self, surface: Surface, units: Units) -> list[str]:
        """What of a surface the format cannot hold, in words."""
        parts = (
            (surface.weights.any() and "tensions" in self.loses, "weights"),
            (surface.snows.any() and "tensions" in self.loses, "snow"),
            (
                surface.given_supports.on_line and not self.lines,
                "lines or circles that vertices slide along (they are fixed in it)",
            ),
            (surface.cables and not self.cables, "cables"),
            (surface.rooms and not self.rooms, "volumes of rooms (it has the pressures reached)"),
            (
                surface.on_planes and not self.planes,
                "planes other than Π that vertices slide on, and mirror planes (fixed in it)",
            ),
            (units and not self.units, f"its unit {units.length}"),
        )
        return [text for missing, text in parts if missing]


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


def format_of(path: Path, known: Mapping[str, Format]) -> Format:
    """The format of a path by its suffix."""
    suffix = path.suffix.lower()
    if suffix not in known:
        readable = f"{suffix} files are read only; " if suffix in READ_ONLY else ""
        text = f"{path}: {readable}{unknown('suffix', suffix, known)}"
        raise FileError(text, what=str(path), found=suffix, expected=list(known))
    return known[suffix]
