"""The values of a surface by name: tensions, pressures, weights, snow, pulls of cables, volumes of rooms;
and which patches are walls.

Those of a wall follow from its neighbours': its pressure is the difference of its two rooms', its snow that
of the snow over them, and its tension must balance theirs. The two sheets of a cushion have one pressure,
and the tension of the lower one is that of the upper one times a factor.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, mask_of
from ..base.errors import SurfaceError
from ..base.tolerances import ON, SAME_PRESSURE
from .images import check_weights, goes_on_above

TRIED = 1000  # triangles of a patch that are looked at for others above them


class ValueKind(NamedTuple):
    """A kind of values: the parts of a surface that have one each, their field, and its dimension."""

    parts: str
    field: str
    dimension: str  # a key of ``POWERS``


KINDS = {
    "tensions": ValueKind("patches", "tension", "tension"),
    "pressures": ValueKind("patches", "pressure", "pressure"),
    "snows": ValueKind("patches", "snow", "pressure"),
    "weights": ValueKind("patches", "weight", "pressure"),
    "cables": ValueKind("cables", "tension", "force"),
    "cable_weights": ValueKind("cables", "weight", "tension"),
    "volumes": ValueKind("rooms", "volume", "volume"),
}
"""The kinds of values, as ``Surface.retensioned`` takes them."""
POWERS = {"force": 0, "tension": -1, "pressure": -2, "volume": 3}  # of a length, beside one of a force
PARTS = {"patches": "patch", "cables": "cable", "rooms": "room"}
BELOW = " below"  # behind the name of a patch: that of a cushion's sheet below it
SHARE = 0.3  # of the smaller tension: the wall's tension above the difference of its neighbours'


def all_values(surface: Any) -> dict[str, dict[str, float]]:
    """The values of a Surface by kind and name, as ``Surface.retensioned`` takes them."""
    return {
        kind: {part.name: getattr(part, field) for part in getattr(surface, parts)}
        for kind, (parts, field, _) in KINDS.items()
    }


def part_values(surface: Any, kind: str) -> Floats:
    """The values of one kind, in the order of the patches, cables or rooms."""
    return np.array([*all_values(surface)[kind].values()], dtype=float)


def part_index(surface: Any, kind: str, name: str) -> int:
    """Index of the patch, cable or room of this name that has a value of this kind."""
    parts = KINDS[kind][0]
    names = [part.name for part in getattr(surface, parts)]
    return names.index(validate.choice(PARTS[parts], name, names))


def with_values(
    surface: Any, given: Mapping[str, Mapping[str, float] | None], walls: Iterable[str]
) -> dict[str, tuple[Any, ...]]:
    """The patches, cables and rooms of a Surface with other values; see ``Surface.retensioned``."""
    changes: dict[str, dict[str, dict[str, Any]]] = {parts: {} for parts in PARTS}
    for kind, values in given.items():
        if not isinstance(values or {}, Mapping):
            validate.refuse(kind, values, "a mapping from names to numbers", error=SurfaceError)
        parts, field, _ = KINDS[kind]
        changes[parts][field] = dict(values or {})
    if isinstance(walls, str) or not isinstance(walls, Iterable):
        validate.refuse("walls", walls, "a sequence of patch names", error=SurfaceError)
    of_patches = changes["patches"]
    of_patches["wall"] = dict.fromkeys(walls, True)
    of_patches["pressure"] = of_both_sheets(surface, of_patches.get("pressure", {}))
    of_patches["tension"] = with_sheets_below(surface, of_patches.get("tension", {}))
    changed = {parts: _replaced(getattr(surface, parts), PARTS[parts], own) for parts, own in changes.items()}
    heavy = (*changed["patches"], *changed["cables"])
    check_weights(heavy, surface.plane, surface.on_planes, surface.vertices, surface.images)
    following: dict[str, dict[str, Any]] = {}
    for field in ("pressure", "snow"):
        both = surface.patches, changed["patches"]
        old, new = (np.array([getattr(patch, field) for patch in patches]) for patches in both)
        change = wall_changes(surface, new - old, {surface.patch_index(name) for name in of_patches[field]})
        pairs = ((surface.patches[k].name, float(old[k] + change[k])) for k in np.flatnonzero(change))
        following[field] = dict(pairs)
    following["wall"] = dict.fromkeys((*following["pressure"], *following["snow"]), True)
    return changed | {"patches": _replaced(changed["patches"], "patch", following)}


def _replaced(
    parts: tuple[Any, ...], part: str, by_field: Mapping[str, Mapping[str, Any]]
) -> tuple[Any, ...]:
    """The parts with other values of their fields; OptionError for an unknown name."""
    changes: dict[str, dict[str, Any]] = {part.name: {} for part in parts}
    for field, by_name in by_field.items():
        for name, value in by_name.items():
            changes[validate.choice(part, name, list(changes))][field] = value
    return tuple(replace(part, **changes[part.name]) if changes[part.name] else part for part in parts)


def rates_of(surface: Any, kind: str, by_name: Mapping[str, float]) -> Floats:
    """The rates of change of the values of one kind, given by name; what is not named follows."""
    following = {"pressures": of_both_sheets, "tensions": with_sheets_below}
    by_name = following[kind](surface, by_name) if kind in following else by_name
    named = {part_index(surface, kind, name): rate for name, rate in by_name.items()}
    rates = np.zeros(len(getattr(surface, KINDS[kind][0])))
    rates[list(named)] = list(named.values())
    return rates + wall_changes(surface, rates, named) if kind in ("pressures", "snows") else rates


def sheets_below(surface: Any) -> dict[str, str]:
    """The lower sheet of each cushion by the name of the upper one: both have one pressure and one rim, so
    the surface has no open edge but at mirrors."""
    patches = {patch.name: patch for patch in surface.patches}
    pairs = ((patch, patches.get(f"{patch.name}{BELOW}")) for patch in surface.patches)
    sheets = {p.name: q.name for p, q in pairs if q is not None and p.pressure == q.pressure}
    return {} if sheets and (surface.topology.boundary_edge & ~surface.mirror_edge).any() else sheets


def in_the_open(surface: Any) -> Bools:
    """(k,) the patches that snow falls on: no walls, and under no other sheet, as the lower one of a cushion.

    The lower sheet is known by its name, too, as both may be flat at the start. Any other patch lies under
    others if most of its triangles, of about a thousand that are tried, have their middles under theirs.

    >>> from . import Patch, Surface
    >>> X = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0.6, 0.6, 1], [0.6, 0.6, -1]]
    >>> faces = [[0, 1, 3], [1, 2, 3], [2, 0, 3], [1, 0, 4], [2, 1, 4], [0, 2, 4]]
    >>> sheets = [Patch("top", 1.0), Patch("bottom", 1.0)]
    >>> in_the_open(Surface(X, faces, [0] * 3 + [1] * 3, sheets, fixed=range(3))).tolist()
    [True, False]
    """
    from scipy.spatial import cKDTree  # here, as few surfaces carry snow

    from .distance import distances

    local, F, patch_of = surface.plane.to_local(surface.vertices), surface.faces, surface.patch_of_face
    plan, middle = local * [1.0, 1.0, 0.0], local[F].mean(axis=1)
    lower = {*sheets_below(surface).values()}
    found: Bools = surface.roof & [patch.name not in lower for patch in surface.patches]
    faces = {k: np.flatnonzero(patch_of == k) for k in np.flatnonzero(surface.roof)}
    trees = {k: cKDTree(middle[own, :2]) for k, own in faces.items() if len(own)}
    for k in trees:
        tried = middle[faces[k][:: 1 + len(faces[k]) // TRIED]]
        covered = np.zeros(len(tried), dtype=bool)
        for other in trees.keys() - {k}:
            above = faces[other]
            higher = middle[above[trees[other].query(tried[:, :2])[1]], 2] > tried[:, 2]
            covered |= higher & (distances(tried * [1.0, 1.0, 0.0], plan, F[above]) <= ON * surface.size)
        found[k] &= covered.mean() <= 0.5
    return found


def of_both_sheets(surface: Any, pressures: Mapping[str, float]) -> dict[str, float]:
    """Pressures, or their rates, by patch: what is given for one sheet of a cushion alone is that of both."""
    both = dict(pressures)
    for above, below in sheets_below(surface).items():
        for name, other in (above, below), (below, above):
            if name in pressures:
                both.setdefault(other, pressures[name])
    return both


def with_sheets_below(surface: Any, tensions: Mapping[str, float]) -> dict[str, float]:
    """Tensions, or their rates, by patch: a cushion's lower sheet that is not named keeps its factor."""
    present = {patch.name: patch.tension for patch in surface.patches}
    both = dict(tensions)
    for above, below in sheets_below(surface).items():
        if present[above] > 0.0 and isinstance(value := tensions.get(above), Real):
            both.setdefault(below, value * present[below] / present[above])
    return both


def wall_patches(surface: Any) -> Bools:
    """(k,) bool: the patches that are walls.

    These are the patches with ``wall=True``, and those without pressure that stand between two rooms of
    prescribed volume or hang below a junction of the roof. A patch hangs below a junction where it goes down
    to Π more steeply than two others do, along most of its edges at junctions with a patch that carries
    pressure or weight. Any other patch without pressure is a sail: part of the roof. If no patch carries
    anything, as with soap films, or if the surface goes on above itself, as a foam does, only declared walls
    are walls.

    >>> from . import Patch, Surface
    >>> X = [[0, 0, 2], [0, 4, 2], [0, 2, 0], [3, 2, 3], [-3, 2, 3]]
    >>> patches = [Patch("wall", 1.0, 0.0), Patch("cushion", 2.0), Patch("sail", 2.0, 0.0)]
    >>> roof = Surface(X, [[0, 1, 2], [1, 0, 3], [0, 1, 4]], [0, 1, 2], patches, fixed=range(5))
    >>> wall_patches(roof).tolist()
    [True, False, False]
    """
    declared = np.array([patch.wall for patch in surface.patches])
    open_ones = surface.auxiliary & ~declared
    carrying = ~surface.auxiliary | (surface.weights != 0.0) & ~declared
    if goes_on_above(surface) or not open_ones.any() or not carrying.any():
        return declared
    signs = surface.room_signs
    between = (signs > 0.0).any(axis=0) & (signs < 0.0).any(axis=0)
    # those that go down below two others along most of their edges at junctions
    topo, X, count = surface.topology, surface.vertices, len(surface.patches)
    of_roof = mask_of(topo.edge_of_face[carrying[surface.patch_of_face]], len(topo.edges))
    sides = np.flatnonzero((topo.junction_edge & of_roof)[topo.edge_of_face].ravel())
    edge, patch = topo.edge_of_face.ravel()[sides], surface.patch_of_face[sides // 3]
    start, end = X[topo.edges[edge]].transpose(1, 0, 2)
    length = np.linalg.norm(end - start, axis=1)
    along = (end - start) / np.where(length > 0.0, length, 1.0)[:, None]
    inward = X[surface.faces.ravel()[sides]] - start  # to the corner opposite the edge
    inward -= np.einsum("ij,ij->i", inward, along)[:, None] * along
    depth = np.linalg.norm(inward, axis=1)
    away = np.where(surface.plane.height(0.5 * (start + end)) < -ON * surface.size, -1.0, 1.0)
    thick = depth > ON * surface.size  # a wall whose junction rests on Π has no height left
    slope = inward @ np.array(surface.plane.normal) / np.where(thick, depth, 1.0)
    rise = np.where(thick, away * slope, -1.0)
    order = np.lexsort((rise, edge))  # the sheets of an edge side by side, the lowest first
    first = np.searchsorted(edge[order], edge[order])
    below = np.arange(len(order)) - first < topo.valence[edge[order]] - 2
    lower = np.bincount(patch[order], below * length[order], count)
    return declared | open_ones & (between | (2.0 * lower > np.bincount(patch, length, count)))


def wall_changes(surface: Any, change: Floats, named: Collection[int] = ()) -> Floats:
    """(k,) changes of the walls' pressures, or snow, that follow from those ``change`` (k,) of the patches'.

    The changes cancel along the edges where one wall meets two sheets. They are 0 for the walls in
    ``named``, and for a wall that stands between different rooms along its length.
    """
    follow = np.zeros(len(surface.patches))
    if not change.any() or len(named) == len(follow):
        return follow
    wall = surface.walls.copy()
    wall[list(named)] = False
    if not wall.any():
        return follow
    topo = surface.topology
    edge, sense = topo.edge_of_face.ravel(), topo.sense.ravel()
    patch = np.repeat(surface.patch_of_face, 3)
    of_wall, count = wall[patch], len(topo.edges)
    net = np.bincount(edge[~of_wall], (change[patch] * sense)[~of_wall], count)
    sheets = np.bincount(edge[~of_wall], minlength=count)
    walls = np.bincount(edge[of_wall], minlength=count)
    top = of_wall & (walls[edge] == 1) & (sheets[edge] == 2)
    wanted = -net[edge[top]] * sense[top]
    least, most = np.full((2, len(follow)), [[np.inf], [-np.inf]])
    np.minimum.at(least, patch[top], wanted)
    np.maximum.at(most, patch[top], wanted)
    rounding = SAME_PRESSURE * np.abs(change).max()
    one = np.isfinite(least) & (most - least <= rounding) & (np.abs(most) > rounding)
    follow[one] = most[one]
    return follow


def balanced_wall(neighbours: Sequence[Sequence[float]], most: float = math.inf) -> float:
    """A tension for a wall: the difference of its neighbours' tensions and 0.3 of the smallest one.

    A junction balances where the wall's tension is between the difference and the sum of the others'. Two
    digits, or more where two would leave too little of that room.

    Parameters
    ----------
    neighbours : for each part of the wall the tensions of the patches beside it, force/length; the part that
        needs most counts, as far as all of them balance.
    most : the most by which the wall may exceed the difference, force/length.

    >>> balanced_wall([(5.0, 4.0)]), balanced_wall([(100.0, 1.0)]), balanced_wall([(3.0,)])
    (2.2, 99.3, 0.9)
    """
    parts = [tensions for tensions in neighbours if tensions]
    if not parts:
        return 0.0
    low = max(max(t) - min(t) for t in parts)
    high = min(sum(t) if len(t) > 1 else math.inf for t in parts)
    wanted = max(max(t) - min(t) + min(SHARE * min(t), most) for t in parts)
    if low < high < math.inf:
        wanted = min(wanted, 0.5 * (low + high))
    spare = wanted - low
    rounded = (float(f"{wanted:.{digits}g}") for digits in range(2, 17))
    return next((value for value in rounded if abs(value - wanted) <= 0.2 * spare), wanted)
