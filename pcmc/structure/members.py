"""Members: beams and cables in the place of walls, along edges, around holes; columns and stays at points."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..base import validate
from ..base.arrays import Bools, Floats, mask_of
from ..base.errors import OptionError, unknown
from ..base.units import Units
from ..certificate.forces import Forces
from ..forces.pinching import standing_part
from ..surface import Surface
from ..surface.curves import Curve
from ..surface.geometry import lengths_along, segment_lengths, unit_vectors
from ..surface.pieces import point_text, to_space
from ..surface.topology import EdgeCurve
from .frames import UPRIGHT, bar_axes
from .material import Material, Profile

DRAW, WHOLE = "draw the whole plan, without mirrors", "take the whole roof, whole = true"
KINDS = ("beam", "cable")
ENDS = ("hinged", "clamped")
BESIDE = 0.02  # of the length of edges: so near to a curve their ends are on it
SHORTEST = 1e-6  # of the size: a shorter bar is none
ALIKE = 1e-6  # of a second moment of area: nearer ones are the same
FLAT = 0.02  # least singular value of the directions of bars: nearer to one plane their forces are no answer


@dataclass(frozen=True)
class Member:
    """A beam or a cable of the structural model, along edges of the surface; or a column or a stay.

    Parameters
    ----------
    on : where it is. The name of a wall: the member stands in the place of the wall, along its junction,
        and carries what the wall did. The name of a cable: that cable has this profile and material. A
        Curve: the edges of the boundary along it, seen along Π's normal; these are no support then, but the
        member carries them from end to end, or as a ring. Two points: the beam is a column, the cable a stay,
        from a point that holds the surface alone, (x, y) along Π or (x, y, z), to its foot or anchor.
    profile, material : its cross-section, and an isotropic material.
    kind : "beam", which an arch is, too, or "cable", without bending stiffness; a cable in the place of a
        wall has the tension that balances the sheets best.
    ends : of a beam, where a support holds it: "hinged", free to bend, but not to twist; or "clamped".
    propped : whether columns or a wall below hold a member on a Curve along Π's normal, all along it.
    name : of the member, for tables; by default the name that ``on`` is, or "member".
    strength : stress that a column or a stay may have, force/area; 0 where it is not known.

    >>> Member("wall 1", Profile.tube(0.1, 0.005), Material(2.1e8)).label
    'wall 1'
    """

    on: str | Curve | Sequence[Sequence[float]]
    profile: Profile
    material: Material
    kind: str = "beam"
    ends: str = "hinged"
    propped: bool = False
    name: str = ""
    strength: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.on, str | Curve):
            try:
                points = tuple(tuple(validate.real(value) for value in point) for point in self.on)
            except TypeError:
                points = ()
            if len(points) != 2 or not all(len(p) in (2, 3) and np.isfinite(p).all() for p in points):
                validate.refuse("Member.on", self.on, "the name of a wall or a cable, a Curve, or two points")
            vars(self)["on"] = points
        for name, kind in (("profile", Profile), ("material", Material)):
            if not isinstance(getattr(self, name), kind):
                validate.refuse(f"Member.{name}", getattr(self, name), f"a {name.title()}")
        validate.number("Member.strength", self.strength, least=0.0)
        validate.choice("Member.kind", self.kind, KINDS)
        validate.choice("Member.ends", self.ends, ENDS)
        validate.flag("Member.propped", self.propped)
        if self.material.cloth:
            text = f"member {self.label!r}: its material is a cloth; give it young alone"
            raise OptionError(text, what="Member.material", where=self.label)
        if self.propped and not isinstance(self.on, Curve):
            text = f"member {self.label!r}: propped is for edges of the boundary; leave it out"
            raise OptionError(text, what="Member.propped", where=self.label)

    @property
    def label(self) -> str:
        """Its name, or that of the wall or cable."""
        return self.name or (self.on if isinstance(self.on, str) else "member")

    @property
    def two_points(self) -> Sequence[Sequence[float]]:
        """Of a column or a stay, the point that it holds, and its foot or anchor; of others none."""
        return () if isinstance(self.on, str | Curve) else self.on


@dataclass(frozen=True, eq=False)
class PlacedMember(EdgeCurve):
    """A member where it is: along edges of the surface, or from a vertex that it holds to its foot."""

    name: str  # of the member; with a number where others have the same
    kind: str  # "beam" or "cable" along edges, "column" or "stay" at a point
    member: Member
    points: Floats  # (k,3) of its axis; the first is not repeated where it is closed
    wall: str = ""  # in whose place it is
    forces: tuple[float, float] | None = None  # the least and the largest N at rest, tension above 0

    @property
    def path(self) -> Floats:
        """(b+1,3) its points, the first again at the end where it is closed."""
        return np.vstack([self.points, self.points[:1]]) if self.closed else self.points

    @property
    def length(self) -> float:
        return float(lengths_along(self.path)[-1])

    @property
    def direction(self) -> Floats:
        """(3,) from its first point to its last."""
        return unit_vectors(self.points[-1] - self.points[0])

    def segments(self, up: Floats) -> tuple[Floats, Floats, Floats]:
        """(b,3) where its pieces begin; (b,3,3) rows along each, across, and upright; (b,) lengths."""
        first = np.arange(len(self.path) - 1)
        return self.path[:-1], *bar_axes(self.path, np.stack([first, first + 1], axis=1), up)

    def masses(self, X: Floats) -> Floats:
        """(n,) its mass at the vertices X (n,3): half of each bar's at its ends."""
        half = 0.5 * self.member.profile.area * self.member.material.density * segment_lengths(X, self.pairs)
        return np.asarray(np.bincount(self.pairs.ravel(), np.repeat(half, 2), len(X)), dtype=np.float64)

    def texts(self, units: Units) -> dict[str, str]:
        """What it is, in words and numbers with units, by key.

        >>> mast = Member([[0, 0, 3], [0, 0, 0]], Profile.circle(0.1), Material(2.1e8))
        >>> at = np.zeros(1, dtype=int), False, (), "mast", "column", mast, np.array(mast.on)
        >>> texts = PlacedMember(*at, forces=(-9.0, -9.0)).texts(Units("m", "kN"))
        >>> texts["section"], texts["N at rest"]
        ('circle 0.1 m', '-9 kN')
        """
        profile, length = self.member.profile, units.behind("length")
        ends = " to ".join(dict.fromkeys(f"{N:.4g}" for N in self.forces or ()))
        texts = {"member": self.name, "kind": self.kind, "in the place of": self.wall}
        texts |= {"section": f"{profile.label}{length}"} if profile.shape else {}
        texts |= {"area": f"{profile.area:.4g}{units.behind('area')}"}
        texts |= {"Young's modulus": f"{self.member.material.young:.4g}{units.behind('pressure')}"}
        texts |= {"length": f"{self.length:.4g}{length}", "N at rest": ends and ends + units.behind("force")}
        return {key: text for key, text in texts.items() if text}


def lines_on(surface: Surface, members: Sequence[Member]) -> tuple[PlacedMember, ...]:
    """The lines of members on a surface, but for those of its own cables; OptionError for a member that is on
    no edge, on a wall that rests on Π, where another one is, or upright with a section that is not alike in
    both directions, and for a wall that ends at one with a member.

    >>> from pcmc.plan import Plan
    >>> hall = Plan([[0, 0], [4, 0], [4, 2], [0, 2]], [[[2, 0], [2, 2]]], edge_length=0.5, tension=2.0)
    >>> steel = Member("wall 1", Profile.tube(0.2, 0.01), Material(2.1e8))
    >>> [line] = lines_on(hall.surface(), [steel])
    >>> line.name, len(line.vertices), line.closed
    ('wall 1', 5, False)
    """
    lines, taken = list[PlacedMember](), np.zeros(len(surface.topology.edges), dtype=bool)
    cut, own = _mirrored(surface), [cable.name for cable in surface.cables]
    on_cables = [str(one.on) for one in members if one.on in own]
    for name in (name for name in own if on_cables.count(name) > 1):
        text = f"members: {name!r} has several; leave out all but one of them"
        raise OptionError(text, what="members", where=name)
    for member in (one for one in members if not (one.two_points or one.on in own)):
        for line in _lines_of(surface, member):
            edges = surface.topology.edge_numbers(line.pairs)
            problem = "runs where another one does; leave one of them out" if taken[edges].any() else ""
            (high, wide), t = member.profile.moments, unit_vectors(np.diff(line.path, axis=0))
            stands = np.linalg.norm(np.cross(surface.plane.normal, t), axis=1) <= UPRIGHT
            if line.kind == "beam" and stands.any() and abs(high - wide) > ALIKE * high:
                problem = "stands upright, where a section has no height; give it one that is alike all round"
            if cut[line.vertices].any():
                problem = f"meets a mirror plane; {WHOLE if line.wall else DRAW}"
            if problem:
                raise OptionError(f"member {line.name!r} {problem}", what="members", where=line.name)
            taken[edges] = True
            lines.append(line)
    labels = [line.name for line in lines]
    lines = [replace(line, name=_numbered(labels, k)) for k, line in enumerate(lines)]
    # a wall that ends at one with a member: nothing would hold its edge there
    replaced = {line.wall for line in lines}
    gone = np.array([patch.name in replaced for patch in surface.patches])
    of_edge, patch = surface.topology.edge_of_face, surface.patch_of_face
    ending = (surface.walls & ~gone)[patch]
    for edge in np.intersect1d(of_edge[gone[patch]], of_edge[ending])[:1]:
        at = (of_edge == edge).any(axis=1)
        one, other = (surface.patches[patch[at & side][0]].name for side in (gone[patch], ending))
        text = f"wall {other!r} ends at {one!r}, which has a member; give both one, or none"
        raise OptionError(text, what="members", where=one)
    return tuple(lines)


def bars_on(
    surface: Surface, members: Sequence[Member], lines: Sequence[PlacedMember]
) -> tuple[PlacedMember, ...]:
    """The columns and stays at points of supports and at ends of the ``lines`` of beams; OptionError for one
    at another point, for a stay inside the roof, and where statics alone does not find their forces.

    >>> from pcmc.plan import Plan
    >>> corners = [[0, 0, 4], [10, 0, 0], [10, 10, 4], [0, 10, 0]]
    >>> sail = Plan([[0, 0], [10, 0], [10, 10], [0, 10]], edge="cable", cable=9.0, supports=corners,
    ...             tension=1.0, pressure=0.0).surface()
    >>> mast = Member([[0, 0], [-1, -1]], Profile.tube(0.2, 0.01), Material(2.1e8), name="mast")
    >>> [bar] = bars_on(sail, [mast], ())
    >>> bar.kind, bar.points.tolist()
    ('column', [[0.0, 0.0, 4.0], [-1.0, -1.0, 0.0]])
    """
    given = [member for member in members if member.two_points]
    if not given:
        return ()
    X, plane, topo, bars = surface.vertices, surface.plane, surface.topology, list[PlacedMember]()
    alone, mirrored = Forces.of(surface).single, _mirrored(surface)
    for line in lines:
        if line.member.kind == "beam":
            alone[[v for v, _ in line.ends if surface.fixed[v]]] = True
    points, near = np.flatnonzero(alone), BESIDE * float(np.median(segment_lengths(X, topo.edges)))
    labels = [line.member.label for line in lines] + [member.label for member in given]
    for k, member in enumerate(given, len(lines)):
        name = _numbered(labels, k)
        top, foot = (to_space(np.array([*p, 0.0]), plane) if len(p) == 2 else p for p in member.two_points)
        away = plane.to_local(X[points]) - plane.to_local(np.array([top]))
        here, at, problem = points[np.hypot(*away[:, :2].T) <= near], point_text(np.array(top)), ""
        if not len(here):
            known = ", ".join(point_text(X[v]) for v in points[:6]) or "none"
            problem = f"no support of one point is at {at}; there are: {known}"
        elif mirrored[here[0]]:
            problem = f"it stands in a mirror plane; {DRAW}"
        elif member.kind == "cable" and not topo.on_boundary[here[0]]:
            problem = f"a stay from {at}, inside the roof, would pierce it; take a point of its edge"
        elif np.linalg.norm(foot - X[here[0]]) <= SHORTEST * surface.size:
            problem = f"its foot is the point {at} that it holds; give another one"
        if problem:
            raise OptionError(f"member {name!r}: {problem}", what="members", where=name)
        kind = "column" if member.kind == "beam" else "stay"
        bars.append(PlacedMember(here[:1], False, (), name, kind, member, np.array([X[here[0]], foot])))
    for own in at_points(bars).values():
        if np.linalg.matrix_rank([bar.direction for bar in own], tol=FLAT) < len(own):
            names, at = ", ".join(bar.name for bar in own), point_text(own[0].points[0])
            text = f"members {names} meet at {at}: statics finds the forces of three bars, not in one plane,"
            text += " or of two, not in one line; leave one out"
            raise OptionError(text, what="members", where=own[0].name)
    return tuple(bars)


def _numbered(labels: Sequence[str], k: int) -> str:
    """The label k, with a number where others are the same."""
    same = labels.count(labels[k]) > 1
    return f"{labels[k]}-{labels[: k + 1].count(labels[k])}" if same else labels[k]


def at_points(bars: Iterable[PlacedMember]) -> dict[int, list[PlacedMember]]:
    """The columns and stays at each vertex."""
    found = defaultdict[int, list[PlacedMember]](list)
    for bar in bars:
        found[int(bar.vertices[0])].append(bar)
    return found


def _mirrored(surface: Surface) -> Bools:
    """(n,) the vertices in mirror planes."""
    masks = [mask for plane, mask in surface.on_planes if plane.mirror]
    return np.any([np.zeros(surface.n, dtype=bool), *masks], axis=0)


def _lines_of(surface: Surface, member: Member) -> Iterator[PlacedMember]:
    """The lines of a member: one for each curve of edges."""
    if isinstance(member.on, Curve):
        found = [("", _along(surface, member.on))]
        if not found[0][1].any():
            text = f"member {member.label!r}: no edge of the boundary runs along its curve; draw it along one"
            raise OptionError(text, what="members", where=member.label)
    else:
        every = [(k, surface.patches[k].name) for k in np.flatnonzero(surface.walls).tolist()]
        number = "" if any(member.on == name for _, name in every) else r"(-\d+)?"  # of a divider's parts
        parts = re.compile(re.escape(str(member.on)) + number + r"( \(\d+\))?")
        walls = [(name, k) for k, name in every if parts.fullmatch(name)]
        if not walls:
            known = [name for _, name in every]
            text = unknown("wall or cable", member.on, [*known, *(cable.name for cable in surface.cables)])
            if member.on in [patch.name for patch in surface.patches]:
                text = f"{member.on!r} is no wall; it stands in the place of one"
            text = f"member {member.label!r}: {text}; a divider needs a wall to have a member"
            raise OptionError(text, what="members", found=member.on)
        found = [(name, _top(surface, k)) for name, k in walls]
    curves = [(wall, curve) for wall, edges in found for curve in surface.topology.curves_among(edges)]
    for wall, curve in curves:
        about = member.label, member.kind, member, surface.vertices[curve.vertices], wall
        yield PlacedMember(curve.vertices, curve.closed, curve.sheets, *about)


def _top(surface: Surface, wall: int) -> Bools:
    """(e,) the edges of a wall where sheets of the roof meet; OptionError where it rests on Π."""
    topo, mine = surface.topology, surface.patch_of_face == wall
    roof = topo.edge_of_face[surface.roof[surface.patch_of_face]]
    sheets = np.bincount(roof.ravel(), minlength=len(topo.edges))
    top: Bools = mask_of(topo.edge_of_face[mine], len(topo.edges)) & (sheets >= 2)
    name, standing = surface.patches[wall].name, standing_part(surface)
    if not top.any() or (standing.surface.patch_of_face == wall).sum() < mine.sum():
        text = f"member on {name!r}: its junction rests on Π, all or in parts, where it has nothing to carry"
        raise OptionError(f"{text}; leave the member out, or raise the junction", what="members", where=name)
    return top


def _along(surface: Surface, curve: Curve) -> Bools:
    """(e,) the edges of the boundary along a curve, seen along Π's normal."""
    chosen = surface.topology.boundary_edge & ~surface.mirror_edge
    rim = surface.topology.edges[chosen]
    if len(rim):
        step = BESIDE * float(segment_lengths(surface.vertices, rim).min())
        line = curve.local(surface.plane).samples(step)[:, :2]
        ends = surface.plane.to_local(surface.vertices[rim])[..., :2]
        chosen[chosen] = (np.asarray(cKDTree(line).query(ends)[0]) <= step).all(axis=1)
    return chosen
