"""The parts of a surface that have a name and a load: patches, cables, and rooms of prescribed volume."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Floats, Ints, read_only
from ..base.errors import SurfaceError
from ..base.validate import checked_name
from . import checks
from .lagrange import sides_along
from .topology import Topology, edge_places

Part = TypeVar("Part")
NAMED = 6  # patches, cables or rooms that a summary names


def _check_loads(part: Patch | Cable, hint: str, *keys: str) -> None:
    """Make floats of the tension, with its own ``hint``, and the loads ``keys``, which floats must hold."""
    error, where, most = SurfaceError, part.name, checks.LARGEST
    for key in ("tension", *keys):
        least, why = (0.0, hint) if key == "tension" else (None, "")
        number = validate.number(key, getattr(part, key), least=least, where=where, hint=why, error=error)
        why = "use a larger unit of force"
        validate.number(key, number, least=-most, most=most, where=where, hint=why, error=error)
        if 0.0 < abs(number) < checks.SMALLEST:
            bound = f"≥ {checks.SMALLEST:g}" if number > 0.0 else f"≤ {-checks.SMALLEST:g}"
            validate.refuse(key, number, f"0 or {bound}", where, "use a smaller unit of force", error)
        object.__setattr__(part, key, number)


@dataclass(frozen=True)
class Patch:
    """A part of the surface with one tension and one pressure.

    Parameters
    ----------
    name : unique in its surface; 1 to 100 printable characters, no blank at either end.
    tension : α ≥ 0, force per length. At rest the patch has mean curvature (p - s) / (2 α).
    pressure : p, force per area along the positive normal: the pressure of the air below the patch minus
        that above it. A wall between rooms of pressures p_1 and p_2 has pressure p_1 - p_2, its normal
        pointing from room 1 to room 2; ``pcmc.energy`` describes E for other wall pressures.
    wall : whether the patch is a wall between rooms: its cone is not part of the volume, and it may
        pinch. A patch without pressure and snow that hangs below a junction is a wall, too: see
        ``Surface.walls``.
    weight : w, force per area of the patch, against Π's normal; negative for a lift.
    snow : s, force per area of the plan. It acts as a lower pressure, p - s: see ``Surface.with_snow``. The
        wall between rooms under snow s_1 and s_2 has s_1 - s_2, so that p - s is that of the rooms, too.

    >>> Patch("roof", tension=2.0).target_curvature
    0.25
    """

    name: str
    tension: float
    pressure: float = 1.0
    wall: bool = field(default=False, repr=False)
    weight: float = field(default=0.0, repr=False)
    snow: float = field(default=0.0, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", checked_name("Patch.name", self.name, error=SurfaceError))
        if not isinstance(self.wall, bool | np.bool_):
            validate.refuse("wall", self.wall, "True or False", self.name, error=SurfaceError)
        object.__setattr__(self, "wall", bool(self.wall))
        _check_loads(self, "only a wall may have 0", "pressure", "weight", "snow")
        if self.tension == 0.0 and (self.pressure or self.weight or self.snow):
            if self.pressure:
                hint = f"a patch under pressure {self.pressure:g} must pull;"
                hint += " a wall (pressure=0) may have tension 0"
            else:
                bears = "carries snow" if self.snow else "weighs something"
                hint = f"a patch that {bears} must pull; give it a tension"
            validate.refuse("tension", 0.0, "> 0", self.name, hint, SurfaceError)

    @property
    def auxiliary(self) -> bool:
        """Whether the energy and the solvers treat it as a wall: declared, or without pressure and snow."""
        return self.wall or (self.pressure == 0.0 and self.snow == 0.0)

    @property
    def net_pressure(self) -> float:
        """p - s, force per area: what the shape follows."""
        return self.pressure - self.snow

    @property
    def target_curvature(self) -> float:
        """H̄ = (p - s) / (2 α), 1/length; NaN for a wall without tension, whose shape is arbitrary."""
        return self.net_pressure / (2.0 * self.tension) if self.tension > 0.0 else math.nan


@dataclass(frozen=True, eq=False)
class Cable:
    """A curve of edges with one line tension and weight: E gains τ · length + g · ∫ z ds.

    Parameters
    ----------
    name : unique in its surface; 1 to 100 printable characters, no blank at either end.
    tension : τ ≥ 0, force. A free edge of a flat membrane with tension α is at rest on arcs of radius τ/α.
    edges : (k,2) int, the vertices that each edge joins, in any order.
    weight : g, force per length of the cable, against Π's normal, as of a heavy rope, a gutter or a row of
        lamps; negative for a lift. The cable then pulls with τ + g z at the height z over Π, as a hanging
        rope does: τ is its tension at Π.

    >>> Cable("east", 2.0, [[4, 3], [4, 5]]).edges.tolist()
    [[3, 4], [4, 5]]
    """

    name: str
    tension: float
    edges: Ints
    weight: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", checked_name("Cable.name", self.name, error=SurfaceError))
        _check_loads(self, "", "weight")
        if self.tension == 0.0 and self.weight != 0.0:
            hint = "a cable that weighs something must pull; give it a tension"
            validate.refuse("tension", 0.0, "> 0", self.name, hint, SurfaceError)
        edges = checks.edge_array(self.edges, f"cable {self.name!r}")
        object.__setattr__(self, "edges", read_only(edges))

    @classmethod
    def along(cls, name: str, tension: float, vertices: npt.ArrayLike, closed: bool = False) -> Cable:
        """The cable through a sequence of vertices (k,), each joined to the next.

        >>> Cable.along("ring", 1.0, [2, 0, 1], closed=True).edges.tolist()
        [[0, 1], [0, 2], [1, 2]]
        """
        chain = np.asarray(vertices).tolist()
        chain += chain[:1] * closed
        return cls(name, tension, np.stack([chain[:-1], chain[1:]], axis=1))

    def shared(self, share: float, edges: Ints) -> Cable:
        """A share of the cable, such as the half that a mirror plane leaves of it, on other edges."""
        return replace(self, tension=share * self.tension, weight=share * self.weight, edges=edges)

    def carried(self, number: Ints) -> Cable | None:
        """The cable on the vertices that have these numbers (n,) now; None where no edge of it is left.

        >>> Cable("a", 1.0, [[0, 1], [1, 2]]).carried(np.array([5, 5, 3])).edges.tolist()
        [[3, 5]]
        """
        ends = number[self.edges]
        ends = np.unique(np.sort(ends[ends[:, 0] != ends[:, 1]], axis=1), axis=0)
        return replace(self, edges=ends) if len(ends) else None

    def cut(self, ends: Ints, number: Ints) -> Cable:
        """The cable with the vertices ``number`` (k,) on those of its edges that are among ``ends`` (k,2).

        >>> Cable("a", 1.0, [[0, 1], [1, 2]]).cut(np.array([[0, 1]]), np.array([7])).edges.tolist()
        [[0, 7], [1, 2], [1, 7]]
        """
        place = edge_places(self.edges, ends)
        cut = place >= 0
        middle, old = number[place[cut]], self.edges[cut]
        halves = [np.stack([old[:, k], middle], axis=1) for k in (0, 1)]
        return replace(self, edges=np.concatenate([self.edges[~cut], *halves]))


class CableEdges(NamedTuple):
    """The edges of a surface that pull, with the tension and weight of each."""

    ends: Ints  # (c,2), or (c,p+1) the nodes of sides of curved elements
    tension: Floats  # (c,) force
    weight: Floats  # (c,) force/length


def cable_edges(cables: Sequence[Cable], nodes: Ints | None = None, order: int = 1) -> CableEdges:
    """The edges of all cables whose tension is not 0, or the sides of elements (e,k) that they are.

    >>> cable_edges([Cable("a", 2.0, [[0, 1], [1, 2]]), Cable("b", 0.0, [[2, 3]])]).tension.tolist()
    [2.0, 2.0]
    """
    pulling = [cable for cable in cables if cable.tension > 0.0]
    runs = [c.edges if nodes is None else sides_along(nodes, order, c.edges) for c in pulling]
    ends = np.concatenate([np.empty((0, order + 1), dtype=np.int32), *runs])
    laws = np.array([[cable.tension, cable.weight] for cable in pulling]).reshape(-1, 2).T
    counts = [len(run) for run in runs]
    return CableEdges(read_only(ends), *(read_only(np.repeat(law, counts)) for law in laws))


@dataclass(frozen=True)
class Room:
    """A room whose volume is prescribed instead of its pressure.

    Parameters
    ----------
    name : unique in its surface; 1 to 100 printable characters, no blank at either end.
    patches : mapping from the names of the patches around the room to 1, where the patch's positive normal
        points out of the room, or -1, where it points into it.
    volume : the volume (length³) of the room at rest.

    The pressures of these patches are where a solver starts; it changes them by sign · δ with one δ for each
    room. So a wall between two rooms keeps the difference of their pressures.

    >>> Room("left", {"cap": 1, "wall": -1}, 2.0).patches
    (('cap', 1), ('wall', -1))
    """

    name: str
    patches: tuple[tuple[str, int], ...]
    volume: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", checked_name("Room.name", self.name, error=SurfaceError))
        expected = "a mapping from names of patches to 1 or -1"
        given = self.patches.items() if isinstance(self.patches, Mapping) else self.patches
        pairs = [
            validate.sequence("patches", pair, expected, SurfaceError)
            for pair in validate.sequence("patches", given, expected, SurfaceError)
        ]
        if not pairs or not all(len(pair) == 2 and pair[1] in (1, -1) for pair in pairs):
            validate.refuse("patches", self.patches, expected, self.name, error=SurfaceError)
        object.__setattr__(self, "patches", tuple((str(name), int(sign)) for name, sign in pairs))
        volume = validate.number("volume", self.volume, where=self.name, error=SurfaceError)
        if volume == 0.0:
            validate.refuse("volume", volume, "a number other than 0", self.name, error=SurfaceError)
        object.__setattr__(self, "volume", volume)


def room_signs(rooms: Sequence[Room], patches: Sequence[str]) -> Floats:
    """(r,k) 1 or -1 where a patch bounds a room, by the sense of its normal; 0 elsewhere."""
    signs = np.zeros((len(rooms), len(patches)))
    for row, room in zip(signs, rooms, strict=True):
        for name, sign in room.patches:
            row[patches.index(validate.choice(f"room {room.name!r}: patch", name, list(patches)))] = sign
    return signs


def named_parts(kind: type[Part], what: str, given: Any) -> tuple[Part, ...]:
    """The given parts as a tuple; SurfaceError if one is of another kind, or two have one name."""
    parts: tuple[Any, ...] = tuple(given) if isinstance(given, Iterable) else (None,)
    if not all(isinstance(part, kind) for part in parts):
        validate.refuse(what, given, f"a sequence of {kind.__name__}", error=SurfaceError)
    double = [name for name, times in Counter(part.name for part in parts).items() if times > 1]
    if double:
        message = f"{what}: the name {double[0]!r} is used twice; names must be unique"
        raise SurfaceError(message, what=what, found=double[0])
    return parts


def checked_cables(given: Any, topo: Topology) -> tuple[Cable, ...]:
    """Cables of unique names on edges of a mesh, no edge in two of them."""
    parts = named_parts(Cable, "cables", given)
    taken = np.zeros(len(topo.edges), dtype=bool)
    for cable in parts:
        place, what = topo.edge_numbers(cable.edges), f"cable {cable.name!r}: edges"
        fault, hint = "joins vertices that no edge of the mesh joins", "name the two ends of an edge"
        checks.refuse_rows(what, cable.edges, place < 0, fault, hint)
        hint = "make it one cable with the sum of their tensions"
        checks.refuse_rows(what, cable.edges, taken[place], "carries another cable, too", hint)
        taken[place] = True
    return parts


def checked_rooms(given: Any, patches: Sequence[str]) -> tuple[Room, ...]:
    """Rooms of unique names around patches of these names, their volumes independent of each other."""
    parts = named_parts(Room, "rooms", given)
    signs = room_signs(parts, patches)
    for k in range(1, len(parts) + 1):
        if np.linalg.matrix_rank(signs[:k]) < k:
            name = parts[k - 1].name
            message = f"room {name!r}: its volume is prescribed already, by that of the rooms before it"
            raise SurfaceError(f"{message}; remove it", what="rooms", where=name)
    return parts


def summary(surface: Any) -> str:
    """Of a Surface: size, patches, walls, cables, rooms, supports and heights, a line each."""
    patches = [
        f"{p.name} (tension {p.tension:g}, pressure {p.pressure:g}{f', snow {p.snow:g}' * bool(p.snow)})"
        for p in surface.patches
    ]
    parts = {
        "patches": [patches[k] for k in np.flatnonzero(~surface.walls)],
        "walls": [patches[k] for k in np.flatnonzero(surface.walls)],
        "cables": [
            f"{cable.name} (tension {cable.tension:g}{f', weight {cable.weight:g}' * bool(cable.weight)})"
            for cable in surface.cables
        ],
        "rooms": [f"{room.name} (volume {room.volume:g})" for room in surface.rooms],
        "planes": [str(plane) for plane, _ in surface.on_planes],
    }
    height, fixed = surface.plane.height(surface.vertices), surface.pinned.sum()
    lines = [
        f"Surface of {surface.m} triangles and {surface.n} vertices, {surface.size:.4g} across",
        *(f"  {name}: {listed(texts)}" for name, texts in parts.items() if texts),
        f"  supports: {fixed} vertices fixed, {surface.held.sum() - fixed} sliding",
        f"  heights over the plane: {height.min():.4g} to {height.max():.4g}",
    ]
    return "\n".join(lines)


def listed(texts: Sequence[str]) -> str:
    """The first few, and how many more there are.

    >>> listed("abcdefgh")
    'a, b, c, d, e, f, and 2 more'
    """
    more = f", and {len(texts) - NAMED} more" if len(texts) > NAMED else ""
    return ", ".join(texts[:NAMED]) + more


def image_names(piece: Any, whole: Any) -> dict[str, str]:
    """By the names that only the whole of a Surface has, of its patches and cables, those they are images of.

    >>> from pcmc import Patch, Plane, Surface, mirrored
    >>> side, rope = Plane(normal=(1, 0, 0), mirror=True), [Cable("rope", 1.0, [[1, 2]])]
    >>> half = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], [0, 0],
    ...                [Patch("film", 1.0)], fixed=[1, 2], on_planes={side: [0, 3]}, cables=rope)
    >>> image_names(half, mirrored(half))
    {'rope (2)': 'rope'}
    """
    known, names = ([*(p.name for p in s.patches), *(c.name for c in s.cables)] for s in (piece, whole))
    return {name: name.rpartition(" (")[0] for name in names if name not in known}


def with_images(given: Any, images: Mapping[str, str]) -> Any:
    """A table by names, or a list of names, with those of images, too; anything else is given back.

    >>> with_images({"film": 1.0, "wall": 2.0}, {"film (2)": "film"})
    {'film (2)': 1.0, 'film': 1.0, 'wall': 2.0}
    """
    if isinstance(given, Mapping):
        return {new: given[old] for new, old in images.items() if old in given} | dict(given)
    if isinstance(given, list | tuple):
        return [*given, *(new for new, old in images.items() if old in given and new not in given)]
    return given
