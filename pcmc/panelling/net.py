"""The net of lines u = 0, ±1, …, v = 0, ±1, … of a sheet, and the panels between them.

The coordinates are linear on each triangle and may jump across edges by z → ±z + c with whole c: lines go on
there. They are followed from triangle to triangle. Hexagons are what is left of the quads if every other edge
along the lines of u is left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..base.compiled import compiled
from ..surface.geometry import cross_2d
from .sheet import SheetMesh

NUDGE = 1e-6  # of a step: a vertex is at least so far from every line
SAME = 1e-6  # of an edge: two lines that end so near to each other end at one node
LATTICE, LOST = -2, -1  # what a line ended at


class Net(NamedTuple):
    """Nodes on the triangles of a sheet, and polygons of nodes, counter-clockwise from outside."""

    face: Ints  # (k,) the triangle that each node lies on
    weights: Floats  # (k,3) of its corners
    side: Ints  # (k,) 3 f + the corner opposite of the boundary edge that the node lies on, or -1
    place: Floats  # (k,) where on that edge, 0..1 as the triangle runs along it
    towards: Ints  # (k,) the node at the other end of the only edge along u, for hexagons, or -1
    start: Ints  # (p+1,) of each polygon in ``corner``
    corner: Ints  # nodes of the polygons, one after the other
    whole: bool  # whether the polygons fill the sheet, none with a hole


class Ends(NamedTuple):
    """Where lines end at the boundary."""

    side: Ints
    place: Floats
    axis: Ints  # 0 for a line u = number, 1 for v
    number: Ints


def nudged(values: Floats, place: Ints, up: Bools | None = None) -> Floats:
    """(m,3) the values (k,) at corners ``place`` (m,3), none nearer to a whole number than ``NUDGE``.

    A boundary that lies on a line is moved inwards, so that the line is the boundary of the panels beside it.
    Values marked ``up`` (k,) are moved upwards.
    """
    line = np.rint(values)
    inward = np.bincount(
        place.ravel(), (values[place].mean(axis=1)[:, None] - line[place]).ravel(), len(values)
    )
    down = inward < 0.0 if up is None else (inward < 0.0) & ~up
    away = line + NUDGE * np.where(down, -1.0, 1.0)
    return np.where(np.abs(values - line) < NUDGE, away, values)[place]


def line_ends(sheet: SheetMesh, at: Floats, hexagons: bool = False) -> Ends:
    """The ends of all lines on the boundary; for hexagons but those of the edges left out."""
    topo = sheet.topology
    rim = np.flatnonzero(topo.boundary_edge[topo.edge_of_face.ravel()])
    parts = []
    for axis in range(2):
        start, end = (at[rim // 3, (rim % 3 + step) % 3, axis] for step in (1, 2))
        first, last = np.ceil(np.minimum(start, end)), np.floor(np.maximum(start, end))
        count = np.maximum(last - first + 1, 0).astype(np.int64)
        rows = np.repeat(np.arange(len(rim)), count)
        number = first[rows] + np.arange(len(rows)) - np.repeat(np.cumsum(count) - count, count)
        place = (number - start[rows]) / (end - start)[rows]
        if hexagons and axis == 0:
            low, high = (at[rim // 3, (rim % 3 + step) % 3, 1][rows] for step in (1, 2))
            kept = (number + np.floor(low + place * (high - low))) % 2 == 0
            rows, number, place = rows[kept], number[kept], place[kept]
        parts.append((rim[rows], place, np.full(len(rows), axis), number.astype(np.int64)))
    return Ends(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def net(sheet: SheetMesh, at: Floats, ends: Ends, more: tuple[Ints, Floats], hexagons: bool = False) -> Net:
    """The net of a sheet with coordinates ``at`` (m,3,2).

    ``more`` are sides and places of further nodes on the boundary, as of the sheets beyond it. Hexagons need
    coordinates that do not jump.
    """
    topo, m = sheet.topology, len(sheet.F)
    opposite, flip, shift = _transitions(sheet, at)
    node_face, node_at, node_start = _lattice(at, opposite, flip, shift)
    count = len(node_face)
    # the boundary's nodes, in order along its loops
    corner = sheet.boundary()[1]
    rim = np.flatnonzero(topo.boundary_edge[topo.edge_of_face.ravel()])
    first = sheet.F.ravel()[3 * (rim // 3) + (rim % 3 + 1) % 3]
    at_corner = rim[corner[first]]
    side = np.concatenate([at_corner, ends.side, more[0]])
    place = np.concatenate([np.zeros(len(at_corner)), ends.place, more[1]])
    line = np.concatenate([np.full(len(at_corner), -1), np.arange(len(ends.side)), np.full(len(more[0]), -1)])
    order = np.lexsort((-line, place, side))
    side, place, line = side[order], place[order], line[order]
    beside = np.append(False, (side[1:] == side[:-1]) & (place[1:] - place[:-1] < SAME))
    beside = beside[: len(side)] & (line < 0)  # a node is already there
    side, place, line = side[~beside], place[~beside], line[~beside]
    rim_count = len(side)
    after = _next_on_rim(sheet, rim, side)
    # half-edges: four of each inner node, one along the boundary and one inwards of each of its nodes
    lines = (ends.side, ends.axis, ends.number, _inwards(at, ends), ends.place)
    target, kind, number = _follow(at, opposite, flip, shift, node_face, node_at, node_start, *lines)
    node_of_line = np.full(len(ends.side) + 1, -1)  # the last one for lines that are lost
    node_of_line[line[line >= 0]] = np.flatnonzero(line >= 0)
    reached = node_of_line[_places(_key(ends.side, ends.axis, ends.number), _key(target, kind, number))]
    along, inwards = 4 * count, 4 * count + rim_count
    slots = np.ones((count, 4), dtype=bool)  # the edges of each inner node that there are
    if hexagons:
        even = node_at.sum(axis=1) % 2 == 0
        slots[:, 1], slots[:, 3] = even, ~even
    there = np.append(slots.ravel(), np.ones(len(ends.side), dtype=bool))
    turn = 4 * target + (number - 1) % 4
    inner = kind == LATTICE
    turn[inner] -= ~there[turn[inner]]  # two edges along v follow one another
    onward = np.where(there, np.where(inner, turn, along + reached), -1)
    lost = bool((there & ~inner & (reached < 0)).any())
    follow = np.full(inwards + rim_count, -1)
    follow[:along] = onward[:along]
    follow[along:inwards] = np.where(line[after] >= 0, inwards, along) + after
    follow[inwards + node_of_line[:-1]] = onward[along:]
    nodes = count + np.arange(rim_count)
    origin = np.concatenate([np.repeat(np.arange(count), 4), nodes, nodes])
    start, loop = _cycles(follow)
    edges = int(there.sum()) // 2 + rim_count
    euler = len(sheet.X) - len(topo.edges) + m
    whole = not lost and count + rim_count - edges + len(start) - 1 == euler
    towards = np.full(count + rim_count, -1)
    if hexagons:
        towards[:count] = np.where(inner, target, count + reached)[
            4 * np.arange(count) + np.where(even, 1, 3)
        ]
    weights = np.zeros((count + rim_count, 3))
    weights[:count] = _barycentric(at[node_face], node_at)
    weights[nodes, (side % 3 + 1) % 3], weights[nodes, (side % 3 + 2) % 3] = 1.0 - place, place
    return Net(
        np.concatenate([node_face, side // 3]),
        weights,
        np.append(np.full(count, -1), side),
        np.append(np.zeros(count), place),
        towards,
        start,
        origin[loop],
        whole,
    )


def _transitions(sheet: SheetMesh, at: Floats) -> tuple[Ints, Floats, Floats]:
    """For each side the side beyond it or -1, and z → flip z + shift to the coordinates there."""
    one, other = sheet.inner_sides
    opposite, flip, shift = np.full(sheet.F.size, -1), np.ones(sheet.F.size), np.zeros((sheet.F.size, 2))
    start, end = (at[one // 3, (one % 3 + step) % 3] for step in (1, 2))
    end_too, start_too = (at[other // 3, (other % 3 + step) % 3] for step in (1, 2))
    same = np.einsum("ij,ij->i", end - start, end_too - start_too) > 0.0
    s = np.where(same, 1.0, -1.0)
    c = np.rint(start_too - s[:, None] * start)
    opposite[one], opposite[other] = other, one
    flip[one] = flip[other] = s
    shift[one], shift[other] = c, -s[:, None] * c
    return opposite, flip, shift


def _next_on_rim(sheet: SheetMesh, rim: Ints, side: Ints) -> Ints:
    """(k,) the node that follows each node of the boundary; they are ordered by side, then along it."""
    corner = sheet.F.ravel()
    begins = np.full(len(sheet.X), -1)
    begins[corner[3 * (rim // 3) + (rim % 3 + 1) % 3]] = rim
    low = np.searchsorted(side, np.arange(corner.size))
    high = np.searchsorted(side, np.arange(corner.size), side="right")
    after = np.arange(len(side)) + 1
    for k in np.flatnonzero(side != np.append(side[1:], -1)):
        at = int(side[k])
        while True:
            at = int(begins[corner[3 * (at // 3) + (at % 3 + 2) % 3]])
            if high[at] > low[at]:
                after[k] = low[at]
                break
    return after


def _inwards(at: Floats, ends: Ends) -> Ints:
    """(k,) ±1: which way along its line each end goes inwards."""
    f, k = ends.side // 3, ends.side % 3
    step = at[f, (k + 2) % 3] - at[f, (k + 1) % 3]
    return np.where(np.where(ends.axis == 0, step[:, 0] > 0.0, step[:, 1] < 0.0), 1, -1)


def _key(side: Ints, axis: Ints, number: Ints) -> Ints:
    """(k,) one number for each end of a line."""
    return np.asarray((2 * side + axis) * 2**24 + number + 2**23)


def _places(keys: Ints, wanted: Ints) -> Ints:
    """(k,) where each wanted key is among the keys; -1 for none."""
    if not len(keys):
        return np.full(len(wanted), -1)
    order = np.argsort(keys, kind="stable")
    place = order[np.minimum(np.searchsorted(keys, wanted, sorter=order), len(keys) - 1)]
    return np.where(keys[place] == wanted, place, -1)


def _barycentric(corners: Floats, point: Floats) -> Floats:
    a, b, c = corners.transpose(1, 0, 2)
    double = cross_2d(b - a, c - a)
    first, second = cross_2d(c - b, point - b) / double, cross_2d(a - c, point - c) / double
    return np.stack([first, second, 1.0 - first - second], axis=1)


@compiled
def _lattice(at: Floats, opposite: Ints, flip: Floats, shift: Floats) -> tuple[Ints, Floats, Ints]:
    """The points with whole coordinates: triangle, coordinates, and the first of each triangle (m+1,)."""
    face, points = [0], [(0.0, 0.0)]
    start = np.zeros(len(at) + 1, dtype=np.int64)
    for f in range(len(at)):
        a, b, c = at[f, 0], at[f, 1], at[f, 2]
        if (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0:
            for i in range(int(np.ceil(at[f, :, 0].min())), int(np.floor(at[f, :, 0].max())) + 1):
                for j in range(int(np.ceil(at[f, :, 1].min())), int(np.floor(at[f, :, 1].max())) + 1):
                    inside = True
                    for k in range(3):
                        inside = inside and _is_left(at, opposite, flip, shift, 3 * f + k, i, j)
                    if inside:
                        face.append(f)
                        points.append((float(i), float(j)))
        start[f + 1] = len(face) - 1
    return np.array(face)[1:], np.array(points)[1:], start


@compiled
def _is_left(at: Floats, opposite: Ints, flip: Floats, shift: Floats, side: int, i: float, j: float) -> bool:
    """Whether a point is on the triangle's side of its side: decided in the first of the two triangles."""
    other = opposite[side]
    mine = other < 0 or side < other
    if not mine:
        i, j = flip[side] * i + shift[side, 0], flip[side] * j + shift[side, 1]
        side = other
    f, k = side // 3, side % 3
    a, b = at[f, (k + 1) % 3], at[f, (k + 2) % 3]
    left = (b[0] - a[0]) * (j - a[1]) - (b[1] - a[1]) * (i - a[0]) >= 0.0
    return left if mine else not left


@compiled
def _follow(
    at: Floats,
    opposite: Ints,
    flip: Floats,
    shift: Floats,
    node_face: Ints,
    node_at: Floats,
    node_start: Ints,
    end_side: Ints,
    end_axis: Ints,
    end_number: Ints,
    end_way: Ints,
    end_place: Floats,
) -> tuple[Ints, Ints, Ints]:
    """Where the line ends that leaves each node in each direction, and then each end of a line inwards.

    (target, kind, number): a node, LATTICE, and the direction 0..3 (u, v, -u, -v) back from there; or a side
    of the boundary, the axis of the line, and its number.
    """
    nodes = len(node_face)
    total = 4 * nodes + len(end_side)
    target, kind, number = (
        np.zeros(total, np.int64),
        np.full(total, LOST, np.int64),
        np.zeros(total, np.int64),
    )
    for h in range(total):
        if h < 4 * nodes:
            f, entry = node_face[h // 4], -1
            axis = 1 - (h % 4) % 2  # along u the line is one of v
            way = 1 if h % 4 < 2 else -1
            line, goal = node_at[h // 4, axis], node_at[h // 4, 1 - axis] + way
        else:
            e = h - 4 * nodes
            f, entry, axis, way = end_side[e] // 3, end_side[e] % 3, end_axis[e], end_way[e]
            line = float(end_number[e])
            a, b = at[f, (entry + 1) % 3, 1 - axis], at[f, (entry + 2) % 3, 1 - axis]
            goal = np.floor(a + end_place[e] * (b - a)) + (1.0 if way > 0 else 0.0)
        for _ in range(3 * len(at)):
            for k in range(node_start[f], node_start[f + 1]):
                if node_at[k, axis] == line and node_at[k, 1 - axis] == goal:
                    target[h], kind[h] = k, LATTICE
                    back = (1 if way < 0 else 3) if axis == 0 else (0 if way < 0 else 2)
                    number[h] = back
            if kind[h] == LATTICE:
                break
            out, far = -1, -np.inf
            for k in range(3):
                a, b = at[f, (k + 1) % 3], at[f, (k + 2) % 3]
                if k != entry and (a[axis] > line) != (b[axis] > line):
                    share = (line - a[axis]) / (b[axis] - a[axis])
                    reach = way * (a[1 - axis] + share * (b[1 - axis] - a[1 - axis]))
                    if reach > far:
                        out, far = k, reach
            if out < 0:
                break
            side = 3 * f + out
            if opposite[side] < 0:
                target[h], kind[h], number[h] = side, axis, int(line)
                break
            line, goal = flip[side] * line + shift[side, axis], flip[side] * goal + shift[side, 1 - axis]
            way = int(flip[side]) * way
            f, entry = opposite[side] // 3, opposite[side] % 3
    return target, kind, number


@compiled
def _cycles(follow: Ints) -> tuple[Ints, Ints]:
    """The cycles of half-edges: the first place of each (p+1,), and the half-edges in order."""
    seen = follow < 0
    start, loop = [0], [0]
    for h in range(len(follow)):
        at = h
        while not seen[at]:
            seen[at] = True
            loop.append(at)
            at = follow[at]
        if len(loop) - 1 > start[-1]:
            start.append(len(loop) - 1)
    return np.array(start), np.array(loop)[1:]
