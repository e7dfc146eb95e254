"""The lines of a plan cut where they meet, and divided into edges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import PlanError
from .curves import Curve
from .lines import (
    SNAP,
    Drawn,
    Kind,
    Line,
    check_holes,
    check_line,
    crossing,
    inside,
    lines_at,
    overlap,
    point_text,
)


@dataclass(frozen=True, eq=False)
class Chain:
    """Vertices (k,) along a line from one meeting or corner to the next; first = last if it is closed."""

    line: int
    vertices: Ints


@dataclass(frozen=True, eq=False)
class Arrangement:
    """Points, edges and chains of all lines.

    Attributes
    ----------
    points : (n,2) coordinates on Π.
    heights : (n,) above Π; NaN at points that are on dividers only, whose height is free.
    chains : of each line, in order along it.
    spots : (p,) the vertex of each required point.
    """

    points: Floats
    heights: Floats
    chains: tuple[Chain, ...]
    spots: Ints

    @property
    def segments(self) -> Ints:
        """(s,2) the edges of all chains."""
        return np.concatenate(
            [np.stack([c.vertices[:-1], c.vertices[1:]], axis=1) for c in self.chains]
        )


def arrange(
    lines: Sequence[Line],
    edge_length: float,
    spots: Floats | None = None,
    stops: Floats | None = None,
) -> Arrangement:
    """Cut the lines at corners and where they meet, and divide them into edges.

    Parameters
    ----------
    lines : the outline first; then holes, dividers, supports, in any order.
    edge_length : of the edges, about; shorter if corners or meetings are close together.
    spots : (p,3) required points: on a line if one passes there, otherwise single vertices.
    stops : (q,2) points at which the lines through them are cut.

    Raises
    ------
    PlanError
        If an outline or hole is open or crosses itself, a hole is not inside the outline, lines run
        along each other, or a divider ends inside a patch or is all outside. ``what`` is the line.
    """
    drawn = [Drawn(line) for line in lines]
    snap = SNAP * edge_length
    for one in drawn:
        check_line(one)
    check_holes(drawn)
    meetings = _Meetings()
    for k, one in enumerate(drawn):
        ends = [] if one.curve.closed else [0.0, float(len(one.curve.pieces))]
        for t in [*ends, *one.curve.corners.tolist()]:
            meetings.add([(k, t)])
    _find_crossings(drawn, meetings)
    _find_ends(drawn, meetings, snap)
    spots = np.zeros((0, 3)) if spots is None else spots
    passing = [lines_at(drawn, xy, snap) for xy in spots[:, :2]]
    contains = inside(drawn)
    for xy, places in zip(spots[:, :2], passing, strict=True):
        if not places and not contains(xy):
            raise PlanError(
                f"the support at {point_text(xy)} is outside the plan or in a hole",
                what="supports",
                where=tuple(xy.tolist()),
            )
    for xy in np.zeros((0, 2)) if stops is None else stops:
        meetings.add(lines_at(drawn, xy, snap))
    number = np.array([meetings.add(places) for places in passing], dtype=np.int64)
    alone = np.array([not places for places in passing], dtype=bool)
    node, points, heights = _nodes(drawn, meetings, snap)
    chains, points, heights = _chains(drawn, meetings, node, points, heights, edge_length)
    chains = _inside_plan(drawn, chains, points, edge_length)
    vertex = np.empty(len(spots), dtype=np.int64)
    vertex[~alone] = node[number[~alone]]
    vertex[alone] = len(points) + np.arange(alone.sum())
    points = np.concatenate([points, spots[alone, :2]])
    heights = np.concatenate([heights, spots[alone, 2]])
    return _compact(Arrangement(points, heights, tuple(chains), vertex))


def hole_points(drawn: Arrangement, lines: Sequence[Line]) -> list[tuple[float, float]]:
    """A point inside each hole, as its edges enclose it."""
    points = []
    for number, line in enumerate(lines):
        if line.kind is Kind.HOLE:
            rim = np.concatenate([c.vertices[:-1] for c in drawn.chains if c.line == number])
            inside = shapely.Polygon(drawn.points[rim]).representative_point()
            points.append((inside.x, inside.y))
    return points


@dataclass
class _Meetings:
    """Places on lines that become vertices, and the pairs of them that are the same vertex."""

    line: list[int] = field(default_factory=list)
    t: list[float] = field(default_factory=list)
    same: list[tuple[int, int]] = field(default_factory=list)

    def add(self, places: Sequence[tuple[int, float]]) -> int:
        """Add places that are one vertex; returns the number of the first."""
        first = len(self.line)
        for line, t in places:
            self.same.append((first, len(self.line)))
            self.line.append(line)
            self.t.append(t)
        return first


def _find_crossings(drawn: Sequence[Drawn], meetings: _Meetings) -> None:
    for j, two in enumerate(drawn):
        for i, one in enumerate(drawn[:j]):
            if one.line.bounds and two.line.bounds:
                continue
            for part in shapely.get_parts(one.shape.intersection(two.shape)):
                if part.is_empty:
                    continue
                if part.geom_type != "Point":
                    start, end = np.array(part.coords)[[0, -1]]
                    raise overlap(two, one, f"from {point_text(start)} to {point_text(end)}")
                xy = np.array(part.coords)[0]
                s, t = crossing(one, one.nearest(xy)[0], two, two.nearest(xy)[0])
                meetings.add([(i, s), (j, t)])


def _find_ends(drawn: Sequence[Drawn], meetings: _Meetings, snap: float) -> None:
    """Dividers end on other lines or outside the plan; supports may end anywhere."""
    contains = inside(drawn)
    for number, one in enumerate(drawn):
        if one.curve.closed or one.line.bounds:
            continue
        for t in (0.0, float(len(one.curve.pieces))):
            xy = one.curve.at(t)[0, :2]
            passing = lines_at(drawn, xy, snap, leave_out=number)
            if one.kind is Kind.DIVIDER and not passing and contains(xy):
                gaps = [(other.nearest(xy)[1], other) for other in drawn if other is not one]
                gap, other = min(gaps, key=lambda pair: pair[0])
                problem = (
                    f"ends at {point_text(xy)} without reaching another line; {other.name} is nearest,"
                    f" {gap:.3g} away: extend the divider to it"
                )
                raise one.error(problem, tuple(xy.tolist()), gap)
            meetings.add([(number, t), *passing])


def _nodes(drawn: Sequence[Drawn], meetings: _Meetings, snap: float) -> tuple[Ints, Floats, Floats]:
    """The node of each meeting; positions and heights of the nodes."""
    line, t = np.array(meetings.line, dtype=np.int64), np.array(meetings.t)
    if not len(line):
        return line, np.zeros((0, 2)), np.zeros(0)
    where = np.concatenate([drawn[i].curve.at(t[k]) for k, i in enumerate(line)])
    near = cKDTree(where[:, :2]).query_pairs(snap, output_type="ndarray")
    pairs = np.concatenate([near, np.array(meetings.same, dtype=np.int64)])
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(line), len(line)))
    count, node = connected_components(graph, directed=False)
    kind = np.array([drawn[i].kind for i in line])
    order = np.lexsort((np.arange(len(line)), kind, node))
    leader = order[np.searchsorted(node[order], np.arange(count))]
    heights = np.where(kind[leader] == Kind.DIVIDER, np.nan, where[leader, 2])
    return node, where[leader, :2], heights


def _chains(
    drawn: Sequence[Drawn],
    meetings: _Meetings,
    node: Ints,
    points: Floats,
    heights: Floats,
    edge_length: float,
) -> tuple[list[Chain], Floats, Floats]:
    """Each line's chains from node to node, with new points along them."""
    line, t = np.array(meetings.line, dtype=np.int64), np.array(meetings.t)
    chains: list[Chain] = []
    new, new_heights, n = [points], [heights], len(points)
    direct: set[tuple[int, int]] = set()
    for number, one in enumerate(drawn):
        stops = _stops(t[line == number], node[line == number], one.curve)
        if not stops:  # a closed line that meets nothing
            start = one.curve.at([0.0])[0]
            new.append(start[None, :2])
            new_heights.append(_heights(one, start[None]))
            stops, n = [(0.0, n), (float(len(one.curve.pieces)), n)], n + 1
        for (low, first), (high, last) in pairwise(stops):
            inner = one.curve.between(low, high, edge_length)
            ends = (min(first, last), max(first, last))
            # a second chord between the same nodes, or a divider between supports, needs a point
            stiff = one.kind is Kind.DIVIDER and _on_edges(heights, first, last)
            if not len(inner) and (stiff or ends in direct):
                inner = one.curve.between(low, high, one.curve.length / 1e6)
                inner = inner[[len(inner) // 2]]
            if not len(inner):
                direct.add(ends)
            where = one.curve.at(inner) if len(inner) else np.zeros((0, 3))
            new.append(where[:, :2])
            new_heights.append(_heights(one, where))
            chains.append(Chain(number, np.array([first, *range(n, n + len(where)), last])))
            n += len(where)
    return chains, np.concatenate(new), np.concatenate(new_heights)


def _on_edges(heights: Floats, first: int, last: int) -> bool:
    """Whether both nodes have a given height: a wall below a single edge would have no room."""
    return max(first, last) < len(heights) and not np.isnan(heights[[first, last]]).any()


def _stops(t: Floats, node: Ints, curve: Curve) -> list[tuple[float, int]]:
    """Nodes along a line in order, without repetition; a closed line returns to its first."""
    order = np.lexsort((node, t))
    stops = [(float(t[k]), int(node[k])) for k in order]
    stops = [stop for k, stop in enumerate(stops) if k == 0 or stop[1] != stops[k - 1][1]]
    if curve.closed and stops:
        if len(stops) > 1 and stops[0][1] == stops[-1][1]:
            stops.pop()
        stops.append((stops[0][0] + len(curve.pieces), stops[0][1]))
    return stops


def _heights(one: Drawn, where: Floats) -> Floats:
    return np.full(len(where), np.nan) if one.kind is Kind.DIVIDER else where[:, 2]


def _inside_plan(
    drawn: Sequence[Drawn], chains: list[Chain], points: Floats, edge_length: float
) -> list[Chain]:
    """The chains inside the plan; the parts of lines outside or in holes are left out."""
    contains = inside(drawn)
    kept = []
    for chain in chains:
        place = len(chain.vertices) // 2
        middle = points[chain.vertices[place - 1 : place + 1]].mean(axis=0)
        one = drawn[chain.line]
        if not (one.line.bounds or contains(middle)):
            continue
        if not one.line.bounds:
            along = lines_at(drawn, middle, SNAP * edge_length, leave_out=chain.line)
            if along:
                raise overlap(one, drawn[along[0][0]], f"near {point_text(middle)}")
        kept.append(chain)
    gone = set(range(len(drawn))) - {chain.line for chain in kept}
    if gone:
        raise drawn[min(gone)].error("is outside the plan or in a hole")
    _check_chords(drawn, kept, points, edge_length)
    return kept


def _check_chords(
    drawn: Sequence[Drawn], chains: Sequence[Chain], points: Floats, edge_length: float
) -> None:
    """Refuse lines that cross only because their bends are replaced by straight edges."""
    ends = np.concatenate([np.stack([c.vertices[:-1], c.vertices[1:]], axis=1) for c in chains])
    owner = np.repeat([c.line for c in chains], [len(c.vertices) - 1 for c in chains])
    edges = shapely.linestrings(points[ends])
    i, j = shapely.STRtree(edges).query(edges, predicate="crosses")
    if len(i):
        first, second = owner[i[0]], owner[j[0]]
        raise PlanError(
            f"with edges of length {edge_length:g}, {drawn[first].name} and {drawn[second].name}"
            f" cross near {point_text(points[ends[i[0]]].mean(axis=0))}; use a smaller edge_length",
            what=drawn[first].name,
            found=drawn[second].name,
        )


def _compact(a: Arrangement) -> Arrangement:
    """The arrangement without unused points."""
    used: Bools = np.zeros(len(a.points), dtype=bool)
    for chain in a.chains:
        used[chain.vertices] = True
    used[a.spots] = True
    number = np.cumsum(used) - 1
    chains = tuple(Chain(chain.line, number[chain.vertices]) for chain in a.chains)
    return Arrangement(a.points[used], a.heights[used], chains, number[a.spots])
