"""``Plan``: a roof given by the lines of its plan."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import toml
from ..base.errors import OptionError
from ..base.validate import checked_name
from ..meshing.walls import EDGES
from ..surface import Plane, Surface
from ..surface.curves import Curve
from ..surface.parts import listed
from . import parts
from .build import build_surface
from .draft import part_count
from .parts import check_keys

CURVES = {"kind": "a list of curves or tables"}  # of keys


@dataclass(frozen=True, eq=False, repr=False)
class Plan:
    """A roof given by the lines of its plan.

    Curves are Curves or their plain data (see ``curve``); patches are a mapping or PatchSpecs.

    Attributes
    ----------
    outline : a closed curve; it may leave Π, but its course in plan must not cross itself.
    dividers : lines between patches: Dividers, or curves (with walls whose tension is chosen).
    holes : openings: Holes, or curves (with fixed edges).
    patches : the parts into which the dividers cut the plan: by name, the attributes of each. Without them
        ``tension`` holds for every part.
    edge_length : of the triangles, length; in a project by default so that there are about 1500, or more if
        a part or a hole is small. Edges on lines are nearly as long. Corners, crossings and the points where
        a curve is farthest along x or y are vertices; between two of them edges are equal.
    edge : the support of the outline: "fixed"; "sliding" on Π, where the roof is at rest if it meets Π
        at a right angle; "cable": free between ``supports``, with a cable along it; or "free", where the
        tension has nothing to pull against.
    supports : points [x, y] or [x, y, z], such as masts, and curves along which vertices are fixed. A curve
        on the outline or a hole fixes that part of it, which carries no cable; one inside a patch is fixed
        where it is drawn. On a free edge or a cable the height z of a support is that of the edge there;
        between supports the edge starts straight.
    plane : Π. Points [x, y] are on it, from its point, along the x axis laid on it and across; points
        [x, y, z] are in space.
    rise : height of the initial surface above the one that the boundary spans, length; by default
        0.3 of the radius of the largest circle without supports.
    points : points [x, y] by name; each becomes a vertex, or names the support there; targets can name it.
    tension : α of all patches, instead of ``patches``, force/length.
    pressure, weight : of all patches, with ``tension``: force per area along the normal, and per area against
        Π's normal.
    snow : s, force per area of the plan, on all patches that have none of their own. A load s on the plan
        area has the potential s V, so it acts as a lower pressure, p - s; ``pressure`` stays that of the air.
    cable : tension of the cables along the outline, with ``edge = "cable"``, force. Each stretch between
        supports is a cable: "cable 1", "cable 2", … in order.
    cable_weight : of these cables, force per length, against Π's normal; ``cable`` is then their tension at
        Π.
    cables : parts of the outline and of holes that are free and carry a cable of their own: CableLines.
    mirrors : straight lines, each two points, along edges of the outline: the plan is one half of a
        symmetric roof, or a quarter, and goes on behind these edges as its mirror image.
    rooms : rooms under several patches whose volume is given, instead of their pressure: by name, their
        ``patches`` and ``volume``. For a room under one patch give that patch a ``volume``.
    cushion : a factor: there is a second sheet below, held at the same rim, which has the pressure of the
        first one and its tension times this factor; 1 for its mirror image in a level rim, more for a
        flatter sheet. Each patch NAME has one there called "NAME below".

    Raises
    ------
    OptionError : for a value that an attribute may not have.
    MissingExtra : from ``surface``, without the library shapely.
    PlanError : from ``surface``, if the lines do not divide the plan properly; names the line.

    Warns
    -----
    PlanWarning : from ``surface``, if an edge is free and has no cable.

    Examples
    --------
    >>> plan = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], [[[4, 0], [4, 4]]], edge_length=0.5,
    ...             patches={"west": {"tension": 2.0}, "east": {"tension": 2.5}})
    >>> [p.name for p in plan.surface().patches]
    ['west', 'east', 'wall 1']

    A sail on four masts:

    >>> masts = [[0, 0, 4], [10, 0, 0], [10, 10, 4], [0, 10, 0]]
    >>> sail = Plan([[0, 0], [10, 0], [10, 10], [0, 10]], edge="cable", cable=9.0, supports=masts,
    ...             tension=1.0, pressure=0.0).surface()
    >>> [cable.name for cable in sail.cables], int(sail.fixed.sum())
    (['cable 1', 'cable 2', 'cable 3', 'cable 4'], 4)
    """

    outline: Any = field(metadata={"kind": "a curve"})
    dividers: Sequence[Any] = field(default=(), metadata=CURVES)
    holes: Sequence[Any] = field(default=(), metadata=CURVES)
    patches: Any = field(default=(), metadata={"kind": "a table"})
    edge_length: float = 1.0
    edge: str = field(default="fixed", metadata={"kind": EDGES})
    supports: Sequence[Any] = field(default=(), metadata={"kind": "a list of points and curves"})
    plane: Plane = field(default_factory=Plane)
    rise: float | None = None
    tension: float | None = None
    pressure: float = 1.0
    weight: float = 0.0
    snow: float = 0.0
    cable: float | None = None
    cable_weight: float = 0.0
    cables: Sequence[Any] = field(default=(), metadata={"kind": "a list of tables"})
    mirrors: Sequence[Any] = field(default=(), metadata=CURVES)
    rooms: Any = field(default=(), metadata={"kind": "a table"})
    points: Any = field(default_factory=dict, metadata={"kind": "a table"})
    cushion: float | None = None

    def __post_init__(self) -> None:
        for key in parts.MOST:
            parts.check_count(key, len(validate.sequence(key, getattr(self, key))), OptionError)
        parsed: dict[str, Any] = {"outline": parts.curve_of(self.outline, "outline", closed=True)}
        makers = {"dividers": parts.divider_of, "holes": parts.hole_of, "supports": parts.support_from}
        for key, maker in (makers | {"cables": parts.cable_of, "mirrors": parts.mirror_of}).items():
            parsed[key] = tuple(maker(spec, number) for number, spec in enumerate(getattr(self, key), 1))
        parsed |= {"patches": parts.patches_of(self.patches), "points": parts.points_of(self.points)}
        parsed["rooms"] = parts.rooms_of(self.rooms, parsed["patches"], self.patches)
        validate.choice("edge of the outline", self.edge, EDGES)
        parsed |= parts.edge_cable(self, "the outline")
        for key, value in parsed.items():
            object.__setattr__(self, key, value)
        for key in ("pressure", "weight", "snow"):
            validate.number(key, getattr(self, key))
        for key in ("edge_length", "rise", "cushion"):
            if key == "edge_length" or getattr(self, key) is not None:
                validate.positive(key, getattr(self, key))
        if self.patches and self.tension is not None:
            problem = f"the plan has tension = {validate.shown(self.tension)} and patches with their own"
            raise OptionError(f"{problem}; leave out one of them", what="tension", found=self.tension)
        if not self.patches and self.tension is None:
            problem = "a plan needs a tension, such as tension = 4.0 (in a project rise = 2.0 finds one), or"
            raise OptionError(f"{problem} patches, each with its own", what="tension")
        for key, usual in (("pressure", 1.0), ("weight", 0.0)) if self.patches else ():
            if getattr(self, key) != usual:
                problem = f"{key} = {getattr(self, key):g} of all patches needs tension = of all patches;"
                raise OptionError(f"{problem} give it to each of the patches", what=key)
        if self.snow and self.patches and all(patch.snow is not None for patch in self.patches):
            problem = f"snow = {self.snow:g} of the plan counts for nothing, as each patch has its own; leave"
            raise OptionError(f"{problem} it out, here or of a patch", what="snow", found=self.snow)
        names = [d.name for d in self.dividers if d.wall is not None] + [p.name for p in self.patches]
        names += [d.name for d in self.dividers if d.wall is None and d.cable is not None]
        names += dict.fromkeys(c.name for c in self.cables if c.name)
        for what, texts in (("name", names), ("points", self.points), ("rooms", self.rooms)):
            for text in texts:
                checked_name(what, text)
        for name, times in Counter(names).items():
            if times > 1:
                problem = f"the name {name!r} is used twice; each patch, wall and cable needs its own"
                raise OptionError(problem, what="name", found=name)

    def __repr__(self) -> str:
        """Size, outline, patches, dividers and holes, a line each."""
        width, depth = np.ptp(self.outline.at(self.outline.dense), axis=0)[:2].tolist()
        patches, dividers = list[str](), list[str]()
        for p in self.patches:
            load = f"pressure {p.pressure:g}" if p.volume is None else f"volume {p.volume:g}"
            snow = f", snow {p.snow:g}" if p.snow else ""
            patches.append(f"{p.name} (tension {p.tension:g}, {load}{snow})")
        for d in self.dividers:
            wall = f"wall {d.wall:g}" if isinstance(d.wall, int | float) else d.wall and f"wall {d.wall}"
            cable = None if d.cable is None else f"cable {d.cable:g}"
            dividers.append(f"{d.name} ({', '.join(filter(None, (wall, cable))) or 'no wall'})")
        texts = {
            "patches": patches or [f"all (tension {self.tension:g})"],
            "dividers": dividers,
            "holes": [f"{hole.name.removeprefix('hole ')} ({hole.edge})" for hole in self.holes],
            "cables": [f"{line.name or 'cable'} (tension {line.tension:g})" for line in self.cables],
            "rooms": [f"{name} (volume {room.volume:g})" for name, room in self.rooms.items()],
            "points": list(self.points),
        }
        edge = self.edge if self.cable is None else f"{self.edge} of tension {self.cable:g}"
        if self.supports:
            curves = sum(isinstance(support, Curve) for support in self.supports)
            edge += f"; {len(self.supports) - curves} points and {curves} curves are held"
        edge += f"; mirror images beyond {len(self.mirrors)} edges" if self.mirrors else ""
        lines = [f"Plan of {width:.4g} × {depth:.4g}, edge length {self.edge_length:g}", f"  outline: {edge}"]
        return "\n".join([*lines, *(f"  {name}: {listed(items)}" for name, items in texts.items() if items)])

    def surface(self) -> Surface:
        """The mesh of the plan at its initial height, with its walls and supports."""
        return build_surface(self)


@dataclass
class Chosen:
    """What neither a project nor its drawing says: tensions of patches, walls and cables, edge length."""

    tensions: dict[str, float] = field(default_factory=dict)
    walls: dict[str, float] = field(default_factory=dict)
    edge_length: float | None = None
    cables: dict[str, float] = field(default_factory=dict)  # that of the outline has no name

    @property
    def text(self) -> str:
        """All of it in a line, with what to type to choose; empty if nothing was proposed.

        >>> Chosen({"nave": 5.4}, {"chancel": 1.6}).text.split(" (")[0]
        "chosen for what the project leaves open: tension 5.4 for 'nave'; wall 1.6 for 'chancel'"
        """
        named = next(iter(self.cables), "")  # the outline's cable has none
        cable = "[[plan.cables]] name = {}, tension = ..." if named else "cable = ... under [plan]"
        kinds = {
            "tension": (self.tensions, "{} = {{tension = ...}} under [plan.patches]"),
            "wall": (self.walls, "[[plan.dividers]] name = {}, wall = ..."),
            "cable": (self.cables, cable),
        }
        parts, keys = [], []
        for what, (values, key) in kinds.items():
            groups: dict[float, list[str]] = {}  # the names of each value
            for name, value in values.items():
                groups.setdefault(value, []).append(repr(name) if name else "the outline")
            parts += [f"{what} {value:g} for {', '.join(names)}" for value, names in groups.items()]
            keys += [key.format(toml(name)) for name in list(values)[:1]]
        if self.edge_length is not None:
            parts.append(f"edges of {self.edge_length:g}")
            keys.append("edge_length = ... under [plan]")
        text = f"chosen for what the project leaves open: {'; '.join(parts)} (to change: {'; '.join(keys)})"
        return text if parts else ""


def patch_names(plan: Plan) -> tuple[str, ...]:
    """The names of a plan's patches without walls, in order; nothing is meshed.

    Without ``patches`` they are "patch 1", "patch 2", …, one for each part between the dividers, whose lines
    must fit together then: errors as from ``Plan.surface``.

    >>> patch_names(Plan([[0, 0], [8, 0], [8, 4], [0, 4]], [[[4, 0], [4, 4]]], tension=2.0))
    ('patch 1', 'patch 2')
    """
    if plan.patches:
        return tuple(patch.name for patch in plan.patches)
    return tuple(f"patch {k + 1}" for k in range(part_count(plan)))


def plan_from(data: Mapping[str, Any]) -> Plan:
    """A Plan from plain data, such as a table of a project file; keys are Plan's attributes.

    >>> plan_from({"outline": [[0, 0], [4, 0], [0, 3]], "edge_length": 0.5, "tension": 2.0}).edge
    'fixed'
    """
    values = dict(data)
    check_keys(values, Plan, "plan")
    if "outline" not in values:
        raise OptionError("a plan needs an outline, or a drawing that has one", what="outline")
    if isinstance(values.get("plane"), Mapping):
        check_keys(values["plane"], Plane, "plane")
        values["plane"] = Plane(**values["plane"])
    return Plan(**values)
