"""One line of JSON with what formats of plain meshes have no place for: patches, plane, counts."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field

from ..base.errors import FileError
from ..base.units import NO_UNITS, Units
from ..surface import Patch, Plane, Surface


def metadata_text(surface: Surface, units: Units = NO_UNITS) -> str:
    """Patches, plane, counts, and units if there are any, as JSON: a format's comment or metadata."""
    patches = [row_of(patch) for patch in surface.patches]
    plane = surface.plane.point, surface.plane.normal
    values: dict[str, object] = {"patches": patches, "plane": plane, "counts": [surface.n, surface.m]}
    return json.dumps(values | ({"units": astuple(units)} if units else {}))


def row_of(patch: Patch) -> tuple[object, ...]:
    """The fields of a patch in their order; without weight and snow as versions before these wrote them."""
    row = astuple(patch)
    return row if patch.snow else row[:-1] if patch.weight else row[:-2]


@dataclass(frozen=True)
class Metadata:
    """The same read back: patches by name, the plane, numbers of vertices and faces, units."""

    patches: Mapping[str, Patch] = field(default_factory=dict)
    plane: Plane | None = None
    counts: tuple[int, int] | None = None
    units: Units = NO_UNITS

    def named(self, names: Sequence[str]) -> tuple[Patch, ...]:
        """The patches of these names; tension and pressure are 1 where the metadata lack them."""
        return tuple(self.patches.get(name, Patch(name, 1.0)) for name in names)

    def check_counts(self, vertices: int, faces: int) -> None:
        """Raise FileError when the file lacks some of the mesh that was written."""
        if self.counts is not None and self.counts != (vertices, faces):
            written = f"{self.counts[0]} vertices and {self.counts[1]} faces"
            raise FileError(f"cut off or changed: {written} were written; it has {vertices} and {faces}")


def parse_metadata(text: str | None) -> Metadata:
    """The metadata in a text; without a text, empty ones."""
    if text is None:
        return Metadata()
    try:
        values = json.loads(text)
        patches = [Patch(*p) for p in values["patches"]]
        point, normal = map(tuple, values["plane"])
        plane = Plane(point, normal)
        counts = (int(values["counts"][0]), int(values["counts"][1]))
        units = Units(*values.get("units", ()))
    except (ValueError, KeyError, TypeError, IndexError):
        message = f"the pcmc metadata in it are damaged: {text[:60]!r}"
        raise FileError(message, where="metadata", found=text[:60]) from None
    return Metadata({p.name: p for p in patches}, plane, counts, units)
