"""What belongs to the whole surface and not to a mesh: an attribute of the first mesh, as plain data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from ..surface import Circle, Guide, HeldCurve, Line, Plane, Room, Surface
from .mesh_arrays import refuse

KEY = "pcmc"


@dataclass(frozen=True)
class Whole:
    """The attribute's values.

    Attributes
    ----------
    plane : Π.
    guides : the lines and circles that vertices slide along.
    planes : the planes besides Π that vertices slide on.
    rooms : rooms of prescribed volume.
    cables : the names of the cables in their order.
    curves : the curves that held vertices were drawn on; their vertices are keys of the meshes.
    """

    plane: Plane = field(default_factory=Plane)
    guides: tuple[Guide, ...] = ()
    planes: tuple[Plane, ...] = ()
    rooms: tuple[Room, ...] = ()
    cables: tuple[str, ...] = ()
    curves: tuple[HeldCurve, ...] = ()

    @classmethod
    def of(cls, surface: Surface) -> Whole:
        """That of a surface."""
        guides = tuple(guide for guide, _ in surface.given_supports.on_line)
        planes = tuple(plane for plane, _ in surface.on_planes)
        cables = tuple(cable.name for cable in surface.cables)
        return cls(surface.plane, guides, planes, surface.rooms, cables, surface.held_curves)

    def plain(self) -> dict[str, Any]:
        """The values as JSON holds them."""
        return {
            "plane": _plain(self.plane),
            "guides": [_plain(guide) for guide in self.guides],
            "planes": [_plain(plane) for plane in self.planes],
            "rooms": [{**asdict(room), "patches": dict(room.patches)} for room in self.rooms],
            "cables": list(self.cables),
            "curves": [curve.plain() for curve in self.curves],
        }


def read_whole(named: Mapping[str, Any]) -> Whole:
    """That of the one mesh that has it; without it Π is z = 0, and there is nothing else."""
    owners = [name for name, mesh in named.items() if KEY in mesh.attributes]
    if not owners:
        return Whole()
    name = owners[0]
    values = named[name].attributes[KEY]
    for other in owners[1:]:
        if named[other].attributes[KEY] != values:
            refuse(KEY, other, f"attributes[{KEY!r}] differs from that of mesh {name!r}; keep one of the two")
    try:
        return Whole(
            Plane(**_tuples(values["plane"])),
            tuple((Circle if "radius" in one else Line)(**_tuples(one)) for one in values.get("guides", ())),
            tuple(Plane(**_tuples(one)) for one in values.get("planes", ())),
            tuple(Room(**one) for one in values.get("rooms", ())),
            tuple(str(one) for one in values.get("cables", ())),
            tuple(map(HeldCurve.from_plain, values.get("curves", ()))),
        )
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:120]
        refuse(KEY, name, f"attributes[{KEY!r}] is damaged ({reason}); without it Π is z = 0")


def _plain(value: Any) -> dict[str, Any]:
    """The fields of a plane, line or circle, with lists for vectors."""
    return {key: list(one) if isinstance(one, tuple) else one for key, one in asdict(value).items()}


def _tuples(values: Mapping[str, Any]) -> dict[str, Any]:
    """The same with tuples for lists."""
    return {
        key: one if isinstance(one, str) or not isinstance(one, Sequence) else tuple(one)
        for key, one in values.items()
    }
