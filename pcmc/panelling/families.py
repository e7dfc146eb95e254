"""Families of congruent triangles: as few as possible, each within a tolerance.

The edge lengths of a triangle are a point of space. Triangles whose lengths differ by at most the tolerance
are those whose points lie in one cube with sides of that length: families are a cover of points by cubes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..base.compiled import compiled
from ..surface import Surface
from ..surface.geometry import edge_vectors

ALIKE = 0.01  # of the mean edge: panels of a family differ by at most this, where no tolerance is given
MOST_WINDOWS = 256  # places of a cube that are tried for each family
ROUNDS = 60  # of the search for fewer families
WORK = 200_000_000  # triangles × families × rounds: large meshes get fewer rounds
SHARE = 0.25  # of the families that are dissolved in each round
STEPS = 1e6  # in a tolerance: lengths are rounded to a step, so that equal ones are equal
TURNS = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])  # the edges counter-clockwise, from each of them


class Families(NamedTuple):
    """A partition of triangles into families."""

    family: Ints  # (m,) from 0; larger families first
    order: Ints  # (m,3) edge ``order[f, k]`` of triangle f corresponds to edge k of its family
    at_least: int  # no partition has fewer families


def triangle_families(lengths: Floats, tolerance: float, apart: bool = False) -> Families:
    """Families of triangles with edge lengths (m,3), counter-clockwise, length.

    In a family, corresponding edges of every two triangles differ in length by at most ``tolerance``, to a
    millionth of it.
    ``apart``: mirror images count as different, so edges correspond counter-clockwise.

    The families depend on the lengths alone, not on the order of triangles or the edge that each starts with,
    nor on the rounding of equal lengths, as in a roof that is turned or, unless ``apart``, mirrored. Where
    two edges are equal, ``order`` is counter-clockwise: such a triangle is its own mirror image.
    ``at_least`` counts triangles of which no two can share a family.

    >>> triangles = np.array([[3, 4, 5.0], [4, 5, 3.001], [5, 4, 3.0]])
    >>> triangle_families(triangles, 0.01).family.tolist()
    [0, 0, 0]
    >>> triangle_families(triangles, 0.01, apart=True).family.tolist()
    [0, 0, 1]
    """
    lengths, tolerance = np.round(lengths / tolerance * STEPS), STEPS
    orders = np.argsort(lengths, axis=1, kind="stable")[:, None]  # (m,w,3) that are tried: these differ least
    ascending = np.take_along_axis(lengths, orders[:, 0], axis=1)
    for pair in ([0, 1], [1, 2]):  # equal edges, counter-clockwise
        turned = clockwise(orders[:, 0]) & (ascending[:, pair[0]] == ascending[:, pair[1]])
        orders[turned, 0, pair[0]], orders[turned, 0, pair[1]] = orders[turned, 0][:, pair[::-1]].T
    if apart:  # the three turns, the least one first
        turned = lengths[:, TURNS]
        orders = TURNS[np.lexsort((turned[..., 2], turned[..., 1], turned[..., 0]), axis=1)]
    points = np.take_along_axis(lengths[:, None], orders, axis=2)
    rank = np.lexsort(points[:, 0].T[::-1])  # equal triangles are interchangeable
    at_least = _incompatible(points[rank], tolerance)
    family, turn = np.empty((2, len(rank)), dtype=np.int64)
    family[rank], turn[rank] = _cover(points[rank], tolerance, at_least)
    order = orders[np.arange(len(rank)), turn]
    count = np.bincount(family)
    least = np.full((len(count), 3), np.inf)
    np.minimum.at(least, family, np.take_along_axis(lengths, order, axis=1))
    number = np.empty(len(count), dtype=np.int64)  # families of one size by their smallest lengths
    number[np.lexsort((least[:, 2], least[:, 1], least[:, 0], -count))] = np.arange(len(count))
    return Families(number[family], order, at_least)


def clockwise(order: Ints) -> Bools:
    """(m,) whether edges in this order (m,3) run clockwise, where 0, 1, 2 is counter-clockwise."""
    return np.asarray((order[:, 1] - order[:, 0]) % 3 == 2)


def family_of_face(surface: Surface) -> Floats:
    """(m,) the family of congruent panels that each triangle belongs to, from 1; NaN for those of walls.

    Edges of a family differ in length by at most ``ALIKE`` times the mean edge.

    >>> from pcmc import Patch
    >>> corners, faces = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0.0]], [[0, 1, 2], [0, 2, 3]]
    >>> family_of_face(Surface(corners, faces, [0, 0], [Patch("roof", 1.0)], fixed=[0, 1, 2, 3])).tolist()
    [1.0, 1.0]
    """
    roof = surface.roof[surface.patch_of_face]
    family = np.full(surface.m, np.nan)
    if roof.any():
        lengths = np.linalg.norm(edge_vectors(surface.vertices[surface.faces[roof]]), axis=2)
        family[roof] = 1 + triangle_families(lengths, ALIKE * float(lengths.mean())).family
    return family


def _cover(points: Floats, tolerance: float, at_least: int) -> tuple[Ints, Ints]:
    """The family (m,) of each triangle, and its turn (m,), from points (m,w,3) in canonical order. The best
    of several greedy covers is improved by search: families around a random one are dissolved and covered
    anew, along another axis, which is kept if there are no more of them."""
    count, turns, _ = points.shape
    axes = (0, 1, 2) if turns == 1 else (0,)  # turning makes the axes alike
    sweeps = [(axis, side) for axis in axes for side in (1.0, -1.0)]
    found = [_sweep(points, np.arange(count), axis, side, tolerance) for axis, side in sweeps]
    best = min(found, key=lambda cover: int(cover[0].max()))
    random = np.random.default_rng(0)
    for k in range(min(ROUNDS, WORK // (count * int(best[0].max() + 1)))):
        family, turn = best
        size = int(family.max()) + 1
        if size <= at_least:  # no cover has fewer
            break
        placed = points[np.arange(count), turn]
        total = np.stack([np.bincount(family, column) for column in placed.T], axis=1)
        centre = total / np.bincount(family)[:, None]
        distance = np.abs(centre - centre[random.integers(size)]).max(axis=1)
        away = distance > np.sort(distance)[max(1, int(SHARE * random.random() * size))]
        family, turn, new = np.where(away, np.cumsum(away) - 1, -1)[family], turn.copy(), int(away.sum())
        _absorb(points, family, turn, new, tolerance)
        loose = np.flatnonzero(family < 0)
        if len(loose):
            again, turn[loose] = _sweep(points, loose, *sweeps[k % len(sweeps)], tolerance)
            family[loose] = again + new
            new += int(again.max()) + 1
        best = (family, turn) if new <= size else best
    return best


def _sweep(points: Floats, chosen: Ints, axis: int, side: float, tolerance: float) -> tuple[Ints, Ints]:
    """A greedy cover of the chosen triangles, swept along an axis from its lower or upper side."""
    axes = [axis, (axis + 1) % 3, (axis + 2) % 3]
    count, turns = len(chosen), points.shape[1]
    P = side * points[chosen][..., axes].reshape(-1, 3)
    order = np.lexsort(P.T[::-1])
    family, place = _greedy(np.ascontiguousarray(P[order]), order // turns, count, tolerance)
    return family, order[place] % turns


@compiled
def _greedy(P: Floats, owner: Ints, count: int, tolerance: float) -> tuple[Ints, Ints]:
    """Cover triangles by cubes, each around the first point left and where it holds the most points. Points P
    (k,3) ascend along the first axis; ``owner`` is the triangle of each. Returns the cube and the point of
    each triangle."""
    family, place = np.full(count, -1, dtype=np.int64), np.zeros(count, dtype=np.int64)
    cubes = 0
    near, by_height = np.empty(len(P), dtype=np.int64), np.empty(len(P))
    for i in range(len(P)):
        if family[owner[i]] >= 0:
            continue
        size = 0
        for j in range(i, len(P)):
            if P[j, 0] - P[i, 0] > tolerance:
                break
            beside = abs(P[j, 1] - P[i, 1]) <= tolerance and abs(P[j, 2] - P[i, 2]) <= tolerance
            if beside and family[owner[j]] < 0:
                near[size], by_height[size] = j, P[j, 2]
                size += 1
        group = near[:size][np.argsort(by_height[:size], kind="mergesort")]
        low, bottom = _best_window(P, group, i, tolerance)
        for j in group:
            inside = P[j, 1] >= low and P[j, 1] - low <= tolerance
            inside = inside and P[j, 2] >= bottom and P[j, 2] - bottom <= tolerance
            if inside and family[owner[j]] < 0:
                family[owner[j]], place[owner[j]] = cubes, j
        cubes += 1
    return family, place


@compiled
def _best_window(P: Floats, group: Ints, i: int, tolerance: float) -> tuple[float, float]:
    """The lower corner, on axes 1 and 2, of the square around point i with the most points of the group. The
    group ascends along axis 2."""
    lows = np.empty(len(group))
    size = 0
    for j in group:
        if P[j, 1] <= P[i, 1]:
            lows[size] = P[j, 1]
            size += 1
    lows = np.unique(lows[:size])
    step = max(1, len(lows) // MOST_WINDOWS)
    most, best_low, best_bottom = 0, P[i, 1], P[i, 2]
    strip = np.empty(len(group))
    for k in range(len(lows) - 1, -1, -step):
        low, size = lows[k], 0
        for j in group:
            if P[j, 1] >= low and P[j, 1] - low <= tolerance:
                strip[size] = P[j, 2]
                size += 1
        end = 0
        for start in range(size):
            if strip[start] > P[i, 2]:
                break
            while end < size and strip[end] - strip[start] <= tolerance:
                end += 1
            if end - start > most and P[i, 2] - strip[start] <= tolerance:
                most, best_low, best_bottom = end - start, low, strip[start]
    return best_low, best_bottom


@compiled
def _absorb(points: Floats, family: Ints, turn: Ints, count: int, tolerance: float) -> None:
    """Put each triangle without a family into the first family that has room for it, in place."""
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    for f in range(len(points)):
        if family[f] >= 0:
            for d in range(3):
                low[family[f], d] = min(low[family[f], d], points[f, turn[f], d])
                high[family[f], d] = max(high[family[f], d], points[f, turn[f], d])
    for f in range(len(points)):
        if family[f] >= 0:
            continue
        for g in range(count):
            for w in range(points.shape[1]):
                fits = True
                for d in range(3):
                    x = points[f, w, d]
                    fits = fits and max(high[g, d], x) - min(low[g, d], x) <= tolerance
                if fits:
                    family[f], turn[f] = g, w
                    for d in range(3):
                        low[g, d] = min(low[g, d], points[f, w, d])
                        high[g, d] = max(high[g, d], points[f, w, d])
                    break
            if family[f] >= 0:
                break


@compiled
def _incompatible(points: Floats, tolerance: float) -> int:
    """How many triangles are chosen, one after the other, of which no two can share a family."""
    chosen = np.empty(len(points), dtype=np.int64)
    size, first = 0, 0
    for f in range(len(points)):
        while first < size and points[f, 0, 0] - points[chosen[first], 0, 0] > tolerance:
            first += 1  # the smallest edges already differ too much
        alone = True
        for k in range(size - 1, first - 1, -1):
            for w in range(points.shape[1]):
                other = points[chosen[k], w]
                largest = 0.0
                for d in range(3):
                    largest = max(largest, abs(points[f, 0, d] - other[d]))
                alone = alone and largest > tolerance
            if not alone:
                break
        if alone:
            chosen[size] = f
            size += 1
    return size
