"""The parts of a plan: dividers between patches, holes, patches; made from plain data and checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from ..base import validate
from ..base.errors import OptionError, PcmcError, PlanError, unknown
from ..base.validate import checked_name
from ..meshing.walls import EDGES
from ..surface.curve_data import CURVES, curve
from ..surface.curves import Curve

BOTTOMS = ("sliding", "held", "sloped")
WALL = 'a number, "balanced" or false'  # what a wall's tension may be
BALANCED = "balanced"  # in place of a wall's tension: chosen from those of its neighbours
# how many of its parts a plan may have; its dividers cut it into no more parts than patches
MOST = {"dividers": 1000, "holes": 2000, "cables": 2000, "mirrors": 100, "supports": 10_000, "patches": 2000}


def check_count(key: str, count: int, kind: type[PcmcError] = PlanError) -> None:
    """Refuse more of a plan's parts than ``MOST`` allows, before they take long."""
    if count > MOST[key]:
        fewer = "draw fewer dividers" if key == "patches" else "draw fewer"
        text = f"{key}: {count} are too many for a plan; at most {MOST[key]} are allowed: {fewer}"
        raise kind(text, what=key, found=count, expected=MOST[key])


@dataclass(frozen=True, eq=False)
class Divider:
    """A line between patches, with a wall below it.

    Only its course in plan counts: the height is that of the surface.

    >>> from pcmc.plan import Plan
    >>> bays = [PatchSpec("west", 5.0, at=[1, 1]), PatchSpec("east", 4.0, at=[3, 1])]
    >>> line = Divider([[2, 0], [2, 2]], wall=2.0, name="ridge wall")
    >>> hall = Plan([[0, 0], [4, 0], [4, 2], [0, 2]], [line], patches=bays).surface()
    >>> [(patch.name, patch.tension) for patch in hall.patches]
    [('west', 5.0), ('east', 4.0), ('ridge wall', 2.0)]

    Attributes
    ----------
    curve : the line. Each end is on the outline, a hole or another divider; parts outside the outline
        or inside a hole are left out.
    wall : tension of the wall, force/length, ≥ 0; "balanced", chosen so that the junction balances with room
        to spare: the difference of the neighbours' tensions and 0.3 of the smaller one, less where the wall
        runs into a corner or the roof is flat; false for no wall. Between patches of different pressures
        the wall takes the difference.
    name : of the wall's patch; by default "wall 1", "wall 2", … in order. Where the difference of
        pressure changes along the divider, each part is a patch of its own: "wall 1-1", "wall 1-2".
    bottom : "held" on Π in all directions; "sliding" on Π; or "sloped": held in all directions on the
        surface that the boundary curves span (for boundaries that leave Π). A junction over a sliding
        bottom is held at its ends by the mesh alone: on finer meshes it slips, or the shape is a saddle.
    upright : whether a vertical plane holds the wall and the junction on it, in which they slide; the line
        must be straight. The plane takes the pull across it.
    cable : tension of a cable along the line, force; by default there is none. Without a wall the cable has
        the name of the divider, otherwise "cable 1", "cable 2", … in order. For a cable across one patch,
        give the parts on both sides to that patch with ``at``.
    cable_weight : of that cable, force per length, against Π's normal; ``cable`` is its tension at Π then.
    member : name of the arch, beam or cable that takes the place of the wall in the structural model.
    """

    curve: Any = field(metadata={"kind": "a curve"})
    wall: float | str | None = field(default=BALANCED, metadata={"kind": WALL})
    name: str = ""
    bottom: str = field(default="held", metadata={"kind": BOTTOMS})
    cable: float | None = None
    upright: bool = False
    cable_weight: float = 0.0
    member: str = ""


@dataclass(frozen=True, eq=False)
class Hole:
    """An opening in the plan.

    >>> from pcmc.plan import Plan
    >>> ring = Hole({"circle": {"centre": [3, 3, 1], "radius": 1}}, name="oculus")
    >>> roof = Plan([[0, 0], [6, 0], [6, 6], [0, 6]], holes=[ring], tension=3.0).surface()
    >>> float(roof.vertices[roof.fixed, 2].max())  # its edge is held at the height 1
    1.0

    Attributes
    ----------
    curve : its closed edge.
    edge : the support of the edge: "fixed" at the height of the curve, "sliding" on Π, "free", or "cable":
        free, with a cable along it.
    name : for messages.
    cable : tension of that cable, force.
    cable_weight : of that cable, force per length; ``cable`` is its tension at Π then.
    member : name of the ring that carries a held edge in the structural model.
    """

    curve: Any = field(metadata={"kind": "a curve"})
    edge: str = field(default="fixed", metadata={"kind": EDGES})
    name: str = ""
    cable: float | None = None
    cable_weight: float = 0.0
    member: str = ""


@dataclass(frozen=True, eq=False)
class CableLine:
    """A part of the outline or of a hole that is free and carries a cable, whatever ``edge`` is elsewhere.

    >>> from pcmc.plan import Plan
    >>> front = CableLine([[0, 0], [6, 0]], tension=9.0, name="front")
    >>> sail = Plan([[0, 0], [6, 0], [6, 6], [0, 6]], cables=[front], tension=1.0, pressure=0.0).surface()
    >>> [(cable.name, cable.tension) for cable in sail.cables]
    [('front', 9.0)]

    Attributes
    ----------
    curve : along the outline or the hole.
    tension : of the cable, force, ≥ 0. A flat edge of a membrane of tension α is at rest on an arc of
        radius tension / α.
    name : of the cable; by default "cable 1", "cable 2", … in order. A cable ends where the edge is held;
        several of one name are numbered: "east-1", "east-2".
    weight : of the cable, force per length, against Π's normal: it pulls with tension + weight · z at the
        height z over Π.
    """

    curve: Any = field(metadata={"kind": "a curve"})
    tension: float
    name: str = ""
    weight: float = 0.0


@dataclass(frozen=True)
class RoomData:
    """A room under several patches whose volume is given; its pressure is a result.

    Attributes
    ----------
    patches : names of the patches over it.
    volume : between them, their walls and Π, length³; negative for patches that hang below Π.
    """

    patches: tuple[str, ...]
    volume: float


@dataclass(frozen=True)
class PatchSpec:
    """A patch of the plan.

    >>> from pcmc.plan import Plan
    >>> roof = PatchSpec("roof", 3.0, pressure=1.0, weight=0.1)
    >>> Plan([[0, 0], [4, 0], [4, 4], [0, 4]], patches=[roof]).surface().weights.tolist()
    [0.1]

    Attributes
    ----------
    name : of the patch.
    tension : α, force/length.
    pressure : p, force/area.
    weight : of the patch, force per area of the patch, against Π's normal; negative for a lift.
    snow : s, force per area of the plan; by default that of the plan or file. A load s on the plan area has
        the potential s V, so it acts as a lower pressure, p - s; ``pressure`` stays that of the air.
    volume : of the room under the patch, between its walls, length³, instead of a pressure, which is then a
        result. A patch with a negative volume hangs below Π.
    at : a point [x, y] inside the patch, or a point in each of its parts. If no patch has one, the
        patches are given to the parts from left to right (by centroid).
    """

    name: str
    tension: float
    pressure: float = 1.0
    at: Any = field(default=None, metadata={"kind": "a point [x, y] or a list of points"})
    weight: float = 0.0
    snow: float | None = None
    volume: float | None = None

    def __post_init__(self) -> None:
        for key in ("weight", "snow", "volume"):
            if getattr(self, key) is not None:
                validate.number(key, getattr(self, key), where=self.name)
        if self.at is None:
            return
        try:
            points = np.atleast_2d(np.asarray(self.at, dtype=float))
        except (TypeError, ValueError, OverflowError):
            points = np.empty((0, 0))
        if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
            validate.refuse("at", self.at, "a point [x, y] or a list of points", self.name)


def curve_of(spec: Any, what: str, closed: bool = False) -> Curve:
    """A Curve from plain data; ``what`` names it in errors."""
    if isinstance(spec, list) and len(spec) in (2, 3) and all(isinstance(x, int | float) for x in spec):
        message = f"{what}: {spec} is a point; a curve has two or more, [[x, y], [x, y]]"
        message += ", and a list of curves is [[[x, y], [x, y]], ...]"
        raise OptionError(message, what=what, found=spec)
    try:
        return curve(spec, closed=closed)
    except OptionError as error:
        raise error.in_file(what, what=what) from None


def divider_of(spec: Any, number: int) -> Divider:
    """A Divider from a mapping of its attributes or a curve; ``number`` counts from 1."""
    what = f"divider {number}"
    part = _part_of(Divider, spec, what)
    validate.choice(f"bottom of {what}", part.bottom, BOTTOMS)
    if isinstance(part.wall, str):
        validate.choice(f"wall of {what}", part.wall, (BALANCED,))
    elif part.wall is not None and part.wall is not False:
        validate.number("wall", part.wall, least=0.0, where=what)
    checked_name(f"{what}.name", part.name, empty=True)
    if not isinstance(part.upright, bool):
        validate.refuse("upright", part.upright, "True or False", what)
    line, cable = curve_of(part.curve, what), _cable(part, what)
    wall, kind = (None, "divider") if part.wall is None or part.wall is False else (part.wall, "wall")
    if wall is None and part.bottom != Divider.bottom:
        message = f"{what}: bottom = {part.bottom!r} is of a wall, and here is none; leave it out"
        raise OptionError(message, what="bottom", where=what, found=part.bottom)
    return replace(part, curve=line, wall=wall, name=part.name or f"{kind} {number}", **cable)


def hole_of(spec: Any, number: int) -> Hole:
    """A Hole from a mapping of its attributes or a curve; ``number`` counts from 1."""
    what = f"hole {number}"
    part = _part_of(Hole, spec, what)
    validate.choice(f"edge of {what}", part.edge, EDGES)
    name = hole_label(part.name) if checked_name(f"{what}.name", part.name, empty=True) else what
    return replace(part, curve=curve_of(part.curve, what, closed=True), name=name, **edge_cable(part, name))


def hole_label(name: str) -> str:
    """The name of a hole in messages; that of a hole which has one already stays.

    >>> hole_label("oculus"), hole_label("hole 'oculus'")
    ("hole 'oculus'", "hole 'oculus'")
    """
    return name if name.startswith("hole ") else f"hole {name!r}"


def edge_cable(part: Any, what: str) -> dict[str, Any]:
    """The cable along the edge of a plan or a hole; refused without ``edge = "cable"``, missing with it."""
    if part.edge == "cable" and part.cable is None:
        message = f'{what}: edge = "cable" needs the tension of the cable, such as cable = 10.0'
        raise OptionError(message, what="cable", where=what, found=part.edge)
    if part.edge != "cable" and part.cable is not None:
        message = (
            f"{what}: cable = {validate.shown(part.cable)} is of a free edge, and this one is {part.edge};"
        )
        message += ' type edge = "cable" beside it, or leave it out'
        raise OptionError(message, what="edge", where=what, found=part.cable, expected="cable")
    return _cable(part, what)


def _cable(part: Any, what: str) -> dict[str, Any]:
    given, weight = part.cable, validate.number("cable_weight", part.cable_weight, where=what)
    cable = None if given is None else validate.number("cable", given, least=0.0, where=what)
    if weight and not cable:
        message = f"{what}: cable_weight = {weight:g} needs a cable that pulls; give its tension, cable ="
        raise OptionError(message, what="cable_weight", where=what, found=weight)
    return {"cable": cable, "cable_weight": weight}


def cable_of(spec: Any, number: int) -> CableLine:
    """A CableLine from a mapping of its attributes; ``number`` counts from 1."""
    what = f"cable {number}"
    if isinstance(spec, Mapping):
        check_keys(spec, CableLine, what, ("a curve", "a tension"), what)
        spec = CableLine(**spec)
    if not isinstance(spec, CableLine):
        raise OptionError(f"{what}: expected a curve with a tension, found {spec!r}", what=what, found=spec)
    checked_name(f"{what}.name", spec.name, empty=True)
    tension = validate.number("tension", spec.tension, least=0.0, where=spec.name or what)
    weight = validate.number("weight", spec.weight, where=spec.name or what)
    return CableLine(curve_of(spec.curve, cable_label(spec, number)), tension, spec.name, weight)


def cable_label(cable: CableLine, number: int) -> str:
    """The name of a cable line in messages; ``number`` counts from 1."""
    return f"cable {cable.name!r}" if cable.name else f"cable {number}"


def mirror_of(spec: Any, number: int) -> Curve:
    """The straight line of a mirror; ``number`` counts from 1."""
    what = f"mirror {number}"
    line = curve_of(spec, what)
    straight = len(line.pieces) == 1 and not line.pieces[0].sweep and len(line.pieces[0].points) == 2
    if not straight or not line.length > 0.0:
        message = f"{what} must be a straight line, two points [[x, y], [x, y]], found {spec!r}"
        raise OptionError(message, what=what, found=spec)
    return line


def rooms_of(spec: Any, patches: Sequence[PatchSpec], given: Any = ()) -> dict[str, RoomData]:
    """The rooms with a volume: those of single patches, and those given by name.

    ``given`` are the patches as plain data, whose pressures are refused there."""
    rooms = {a.name: RoomData((a.name,), a.volume) for a in patches if a.volume is not None}
    if not isinstance(spec, Mapping | None) and not (isinstance(spec, tuple) and not spec):
        validate.refuse("rooms", spec, "a mapping from names to patches and a volume")
    known = [patch.name for patch in patches]
    for name, room in dict(spec or {}).items():
        values = vars(room) if isinstance(room, RoomData) else room
        check_keys(values, RoomData, f"room {name!r}", ("patches", "volume"), name)
        volume = validate.number("volume", values["volume"], where=name)
        over = tuple(validate.choice(f"room {name!r}: patch", p, known) for p in values["patches"])
        if rooms.setdefault(name, RoomData(over, volume)) != RoomData(over, volume):
            raise OptionError(f"room {name!r} has two volumes; give one", what="volume", where=name)
    owner: dict[str, str] = {}
    for name, part in ((name, part) for name, room in rooms.items() for part in room.patches):
        if owner.setdefault(part, name) != name:
            message = f"patch {part!r} is in the rooms {owner[part]!r} and {name!r}; leave it out of one"
            raise OptionError(message, what="rooms", where=part)
    for name in given if isinstance(given, Mapping) else ():
        if name in owner and "pressure" in given[name]:
            message = f"patch {name!r} has a volume and a pressure; give one: the pressure follows from the"
            raise OptionError(f"{message} volume", what="volume", where=name)
    return rooms


def _part_of(kind: Any, spec: Any, what: str) -> Any:
    if isinstance(spec, Mapping) and "curve" in spec:
        check_keys(spec, kind, what)
        return kind(**spec)
    own = {entry.name for entry in fields(kind)}.intersection(spec) if isinstance(spec, Mapping) else ()
    if own:
        shape = next((key for key in spec if key in CURVES), "polyline")
        message = f"{what}: beside {sorted(own)[0]!r} its curve is a key, too: curve = {{{shape} = ...}}"
        raise OptionError(message, what="curve", where=what, found=list(spec))
    return spec if isinstance(spec, kind) else kind(spec)


def patches_of(spec: Any) -> tuple[PatchSpec, ...]:
    """The patches of a mapping from names to their attributes, or of a sequence."""
    if not isinstance(spec, Mapping):
        if not all(isinstance(one, PatchSpec) for one in spec):
            validate.refuse("patches", spec, "PatchSpecs, or a mapping from names to their attributes")
        return tuple(spec)
    for name, values in spec.items():
        check_keys(values, PatchSpec, f"patch {name!r}", ("a tension",), name)
    return tuple(PatchSpec(name, **values) for name, values in spec.items())


def support_from(spec: Any, number: int) -> Any:
    """A point (2,) or (3,), or a Curve; ``number`` counts from 1."""
    if isinstance(spec, Sequence | np.ndarray) and len(spec) in (2, 3) and np.ndim(spec) == 1:
        point = np.array(spec, dtype=float)
        if not np.isfinite(point).all():
            raise OptionError(f"support {number}: {point.tolist()} is not finite", what=f"support {number}")
        return point
    return curve_of(spec, f"support {number}")


def points_of(spec: Any) -> dict[str, tuple[float, float]]:
    """Named points of the plan, by name."""
    if not isinstance(spec, Mapping):
        validate.refuse("points", spec, "a table of names and points [x, y]")
    points: dict[str, Any] = {}
    for name, point in spec.items():
        if not isinstance(point, Sequence | np.ndarray) or isinstance(point, str) or len(point) != 2:
            validate.refuse("points", point, "a point [x, y]", name)
        points[name] = tuple(validate.number(k, v, where=name) for k, v in zip("xy", point, strict=True))
    return points


def check_keys(values: Any, kind: Any, what: str, needs: Sequence[str] = (), where: str = "") -> None:
    """Refuse a mapping with a key that is no attribute of ``kind``, or without one that it needs."""
    if not isinstance(values, Mapping):
        raise OptionError(f"{what}: expected a table, found {values!r}", what=what, found=values)
    known = tuple(f.name for f in fields(kind))
    for key in values:
        if key not in known:
            raise OptionError(unknown(f"{what} key", key, known), what=what, where=key, expected=known)
    for need in needs:
        key = need.removeprefix("a ")
        if key not in values:
            raise OptionError(f"{what} needs {need}", what=key, where=where)
