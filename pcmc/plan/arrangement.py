"""The lines of a plan cut where they meet, and divided into edges."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import compress, pairwise

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..base.errors import PlanError
from ..base.libraries import shapely
from ..surface.pieces import point_text
from ..surface.topology import components
from .lines import SNAP, Cut, Kind, LineTree, PlanLine, check_holes, check_line, overlap


@dataclass(frozen=True, eq=False)
class Chain:
    """Vertices (k,) along a line between cuts or corners; ``at`` (k,): parameters, of a ring also beyond."""

    line: int
    vertices: Ints
    at: Floats

    @property
    def edges(self) -> Ints:
        """(k-1,2) from vertex to vertex."""
        return np.stack([self.vertices[:-1], self.vertices[1:]], axis=1)


@dataclass(frozen=True, eq=False)
class Arrangement:
    """Points and chains of all lines."""

    points: Floats  # (n,2) coordinates on Π
    heights: Floats  # (n,) above Π; NaN at points that are on dividers only, whose height is free
    chains: tuple[Chain, ...]  # of each line, in order along it
    required: Ints  # (p,) the vertex of each required point

    def along(self, line: int) -> Sequence[Chain]:
        """The chains of a line."""
        return [chain for chain in self.chains if chain.line == line]


def arrange(
    lines: Sequence[PlanLine], edge_length: float, required_points: Floats, cut_points: Floats
) -> Arrangement:
    """Cut the lines, the outline first, at corners and where they meet, and divide them into edges.

    ``required_points`` (p,3) are vertices, on a line if one passes there; at ``cut_points`` (q,2) lines are
    cut, too. PlanError if an outline or hole is open or crosses itself, a hole is not inside the outline,
    lines run along each other, or a divider ends inside a patch or is all outside; ``what`` is the line.
    """
    snap = SNAP * edge_length
    for line in lines:
        check_line(line)
    check_holes(lines)
    cuts: list[Cut] = []
    for k, line in enumerate(lines):
        ends = [] if line.curve.closed else [0.0, float(len(line.curve.pieces))]
        cuts += [[(k, t)] for t in (*ends, *line.curve.corners.tolist())]
    tree = LineTree(lines)
    corners = np.concatenate([line.curve.at(line.curve.corners)[:, :2] for line in lines])
    cuts += [*tree.crossings(), *_ends(tree, snap), *tree.at(corners, snap)]  # a corner may touch a line
    xy = required_points[:, :2]
    passing = tree.at(xy, snap)
    for point, places, within in zip(xy, passing, shapely.contains_xy(tree.area, xy), strict=True):
        if not places and not within:
            problem = f"the support or point at {point_text(point)} is outside the plan or in a hole"
            raise PlanError(problem, what="supports", where=tuple(point.tolist()))
    cuts += [*tree.at(cut_points, snap), *passing]
    nodes, of_cut, along_lines = _nodes(lines, cuts, snap)
    chains, points = _chains(lines, nodes, along_lines, edge_length)
    chains = _inside_plan(tree, chains, points[:, :2], edge_length)
    vertex = of_cut[len(cuts) - len(passing) :]
    alone = np.flatnonzero([not places for places in passing])  # points on no line, supports first
    near: Ints = np.zeros((0, 2), dtype=np.int64)
    if len(alone):
        near = cKDTree(required_points[alone, :2]).query_pairs(snap, output_type="ndarray")
    for at, (low, high) in zip(alone[near[:, 0]], required_points[alone[near], 2], strict=True):
        if abs(high - low) > snap:  # False without a height of its own
            place = required_points[at, :2]
            problem = f"two supports at {point_text(place)} have the heights {low:.6g} and {high:.6g}"
            raise PlanError(f"{problem}: leave one out", what="supports", where=tuple(place.tolist()))
    own = components(near, len(alone))  # one vertex for those nearer than ``snap``
    vertex[alone] = len(points) + own
    points = np.concatenate([points, required_points[alone[np.unique(own, return_index=True)[1]]]])
    used = np.unique(np.concatenate([vertex, *(chain.vertices for chain in chains)]))
    chains = [replace(chain, vertices=np.searchsorted(used, chain.vertices)) for chain in chains]
    return Arrangement(points[used, :2], points[used, 2], tuple(chains), np.searchsorted(used, vertex))


def hole_points(drawn: Arrangement, lines: Sequence[PlanLine]) -> list[tuple[float, float]]:
    """A point inside each hole, as its edges enclose it."""
    holes = [number for number, line in enumerate(lines) if line.kind is Kind.HOLE]
    rims = [np.concatenate([chain.vertices[:-1] for chain in drawn.along(hole)]) for hole in holes]
    points = [shapely.Polygon(drawn.points[rim]).representative_point() for rim in rims]
    return [(point.x, point.y) for point in points]


def _ends(tree: LineTree, snap: float) -> Iterator[Cut]:
    """Dividers end on other lines or outside the plan; supports may end anywhere."""
    loose = [k for k, line in enumerate(tree.lines) if not (line.curve.closed or line.bounds)]
    ends = [(k, t) for k in loose for t in (0.0, float(len(tree.lines[k].curve.pieces)))]
    at = np.array([tree.lines[k].curve.at(t)[0, :2] for k, t in ends]).reshape(-1, 2)
    within = shapely.contains_xy(tree.area, at)
    for end, xy, places, inner in zip(ends, at, tree.at(at, snap), within, strict=True):
        one, passing = tree.lines[end[0]], [place for place in places if place[0] != end[0]]
        if one.kind is Kind.DIVIDER and not passing and inner:
            others = [other for other in tree.lines if other is not one]
            gap, line = min((float(other.nearest(xy[None])[1][0]), other.name) for other in others)
            where = f"{line} is nearest, {gap:.3g} away: let it end there"
            if gap * SNAP > snap:  # by more than an edge: it was to go on, and the nearest may lie behind it
                along = xy - one.xy[1 if end[1] == 0.0 else -2]
                far = xy + along / np.linalg.norm(along) * 2.0 * np.ptp(tree.lines[0].xy, axis=0).sum()
                ahead = shapely.intersection(shapely.LineString([xy, far]), [other.shape for other in others])
                away = shapely.distance(shapely.Point(xy), ahead)  # NaN where it meets none
                gap, line = float(np.nanmin(away)), others[np.nanargmin(away)].name
                where = f"straight on, {line} is {gap:.3g} away: extend the divider to it"
            text = f"ends at {point_text(xy)} without reaching another line; {where}"
            raise one.error(text, tuple(xy.tolist()), gap)
        yield [end, *passing]


LineNodes = list[tuple[float, int]]  # parameters and nodes along a line


def _nodes(
    lines: Sequence[PlanLine], cuts: Sequence[Cut], snap: float
) -> tuple[Floats, Ints, list[LineNodes]]:
    """The vertices where lines meet, one for those nearer than ``snap``: their points (k,3) with heights, the
    vertex of each cut, -1 for none, and the nodes along each line; a closed one returns to its first."""
    along_lines: list[LineNodes] = [[] for _ in lines]
    line, t = np.reshape([place for cut in cuts for place in cut], (-1, 2)).T
    line, of_cut = line.astype(np.int64), np.full(len(cuts), -1)
    if not len(line):
        return np.zeros((0, 3)), of_cut, along_lines
    where = np.empty((len(line), 3))
    for number in np.unique(line):
        where[line == number] = lines[number].curve.at(t[line == number])
    near = cKDTree(where[:, :2]).query_pairs(snap, output_type="ndarray")
    count = np.array([len(cut) for cut in cuts])
    first = np.cumsum(count) - count
    same = np.stack([np.repeat(first, count), np.arange(len(line))], axis=1)
    node = components(np.concatenate([near, same]), len(line))
    of_cut[count > 0] = node[first[count > 0]]
    kind = np.array([lines[i].kind for i in line])
    order = np.lexsort((kind, node))
    leader = order[np.unique(node[order], return_index=True)[1]]
    points = where[leader]
    points[kind[leader] == Kind.DIVIDER, 2] = np.nan
    for k in np.lexsort((node, t)).tolist():
        along = along_lines[line[k]]
        if not along or along[-1][1] != node[k]:
            along.append((float(t[k]), int(node[k])))
    for one, along in zip(lines, along_lines, strict=True):
        if one.curve.closed and along:
            if len(along) > 1 and along[0][1] == along[-1][1]:
                along.pop()
            along.append((along[0][0] + len(one.curve.pieces), along[0][1]))
    return points, of_cut, along_lines


def _chains(
    lines: Sequence[PlanLine], nodes: Floats, along_lines: Sequence[LineNodes], edge_length: float
) -> tuple[list[Chain], Floats]:
    """Each line's chains from node to node; the points (n,3) of the nodes, and of the chains between."""
    chains, direct = list[Chain](), set[tuple[int, int]]()
    new, n = [nodes], len(nodes)
    given = set(np.flatnonzero(~np.isnan(nodes[:, 2])).tolist())
    for number, (one, along) in enumerate(zip(lines, along_lines, strict=True)):
        curve, divides = one.curve, one.kind is Kind.DIVIDER
        known = [1.0, 1.0, np.nan if divides else 1.0]
        if not along:  # a closed line that meets nothing
            start = float(curve.extremes[0]) if len(curve.extremes) else 0.0
            new.append(curve.at(start) * known)
            along, n = [(start, n), (start + len(curve.pieces), n)], n + 1
        for (low, first), (high, last) in pairwise(along):
            inner = curve.between(low, high, edge_length)
            ends = (min(first, last), max(first, last))
            # a second chord between the same nodes needs a point, and so does a divider between given
            # heights: a wall below a single edge would have no room
            if not len(inner) and (ends in direct or (divides and given.issuperset(ends))):
                inner = curve.middle(low, high)
            if not len(inner):
                direct.add(ends)
            new.append(curve.at(inner) * known)
            at = np.concatenate([[low], inner + len(curve.pieces) * (inner < low), [high]])
            chains.append(Chain(number, np.array([first, *range(n, n + len(inner)), last]), at))
            n += len(inner)
    return chains, np.concatenate(new)


def _inside_plan(tree: LineTree, chains: list[Chain], points: Floats, edge_length: float) -> list[Chain]:
    """The chains inside the plan; the parts of lines outside or in holes are left out."""
    lines = tree.lines
    kept = np.array([lines[chain.line].bounds for chain in chains])
    inner = np.flatnonzero(~kept)
    middles = [chains[k].edges[len(chains[k].vertices) // 2 - 1] for k in inner]
    middle = points[np.reshape(middles, (-1, 2)).astype(int)].mean(axis=1)
    kept[inner] = shapely.contains_xy(tree.area, middle)
    inner, middle = inner[kept[inner]], middle[kept[inner]]
    for number, xy, places in zip(inner, middle, tree.at(middle, SNAP * edge_length), strict=True):
        one = chains[number].line
        along = [other for other, _ in places if other != one]
        if along:
            raise overlap(lines[one], lines[along[0]], f"near {point_text(xy)}")
    chains = list(compress(chains, kept))
    if gone := set(range(len(lines))) - {chain.line for chain in chains}:
        raise lines[min(gone)].error("is outside the plan or in a hole")
    # lines may cross only because their bends are replaced by straight edges
    ends = points[np.concatenate([chain.edges for chain in chains])]
    owner = [chain.line for chain in chains for _ in chain.edges]
    edges = shapely.linestrings(ends)
    i, j = shapely.STRtree(edges).query(edges, predicate="crosses")
    if len(i):
        first, second = lines[owner[i[0]]].name, lines[owner[j[0]]].name
        problem = f"with edges of length {edge_length:g}, {first} and {second} cross near"
        problem += f" {point_text(ends[i[0]].mean(axis=0))}; use a smaller edge_length"
        raise PlanError(problem, what=first, found=second)
    return chains
