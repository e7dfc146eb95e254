"""Plane triangle meshes with given vertices and edges: a lattice, Delaunay, relaxation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import Delaunay, QhullError, cKDTree

from ..base import validate
from ..base.arrays import Bools, Floats, Ints, mask_of
from ..base.errors import OptionError, SurfaceError
from ..base.tolerances import ON
from ..surface.geometry import angles, cross_2d, in_edges, segment_lengths, vertex_sums
from ..surface.topology import SIDES, components, edge_places
from .quality import improve_angles

CLEARANCE = 0.62  # of the edge length: distance of free points from the segments
CROWDED = 0.6  # of the edge length: free points nearer to another point are removed
GOOD_ANGLE = 30.0  # degrees; sharper triangles get more points
ROUNDS = 12  # of relaxation
OUTSIDE = -1


@dataclass(frozen=True, eq=False)
class PlanarMesh:
    """A conforming triangle mesh in the plane."""

    points: Floats  # (n,2); the given points come first, unchanged
    triangles: Ints  # (t,3) counter-clockwise
    region: Ints  # (t,) from 0: the region of each triangle; segments separate regions


def triangulate(
    points: Floats, segments: Ints, edge_length: float, holes: Sequence[Sequence[float]] = ()
) -> PlanarMesh:
    """Nearly equilateral triangles in the area that the segments enclose.

    A triangular lattice fills the area. A Delaunay triangulation constrained to the segments connects
    the points. In each round of relaxation the free points move to the area-weighted mean of the
    centroids of their triangles (centroidal patch triangulation, Chen and Holst, 2011); every fourth
    round instead removes points that crowd, or adds circumcentres of large or sharp triangles.

    The given points do not move, and no segment is split. Segments should be about ``edge_length``
    long; near shorter ones the triangles are smaller.

    Parameters
    ----------
    points, segments : (k,2) required vertices; (s,2) required edges between them, which meet at ends alone.
    holes : a point (x, y) inside each region to leave out.

    Raises
    ------
    OptionError : ``edge_length`` is not positive, or the point of a hole is outside.
    SurfaceError : points coincide, segments cross, or they enclose no area.

    >>> corners = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2.0]])
    >>> sides = np.stack([np.arange(6), (np.arange(6) + 1) % 6], axis=1)
    >>> mesh = triangulate(corners, sides, 1.0)
    >>> float(signed_areas(mesh.points, mesh.triangles).sum())
    3.0
    """
    given, segments = np.asarray(points, dtype=float), np.asarray(segments, dtype=np.int64)
    validate.positive("edge_length", edge_length)
    # in edge lengths from a corner, without the last digits: the same mesh in all units and places
    origin = given.min(axis=0, initial=np.inf)
    fixed, inside_holes = (in_edges(a - origin, edge_length) for a in (given, np.reshape(holes, (-1, 2))))
    if near := cKDTree(fixed).query_pairs(ON):
        i, j = min(near)
        problem = f"points {i} and {j} coincide at {given[i].tolist()}; merge them"
        raise SurfaceError(problem, what="points", where=(i, j))
    if len(segments) < 3:
        problem = f"segments: at least 3 are needed to enclose an area, found {len(segments)}"
        raise SurfaceError(problem, what="segments", found=len(segments), expected=3)
    spacing = np.ones(len(fixed))  # at each point its shortest segment
    np.minimum.at(spacing, segments.ravel(), np.repeat(segment_lengths(fixed, segments), 2))
    everything = np.concatenate([fixed, _lattice(fixed, segments)])
    mesh = _inside(everything, segments, inside_holes, given)
    for step in range(ROUNDS):
        X, T = mesh.points, mesh.triangles
        if step % 4 == 0 and step < ROUNDS - 4:
            wanted = _wanted(X, fixed, spacing)
            X = X[_spaced_out(X, CROWDED * wanted, len(fixed))]
            if len(X) == len(mesh.points):
                X = np.concatenate([X, _additions(mesh, segments, fixed, spacing)])
        else:
            area = np.abs(signed_areas(X, T))[:, None]
            sums = vertex_sums(np.hstack([area * X[T].mean(axis=1), area]), T, len(X))[len(fixed) :]
            X = np.concatenate([fixed, sums[:, :2] / sums[:, 2:]])
        mesh = _inside(X, segments, inside_holes, given)
    movable = np.arange(len(mesh.points)) >= len(fixed)
    flat = np.column_stack([mesh.points, np.zeros(len(mesh.points))])
    better = improve_angles(flat, mesh.triangles, movable, GOOD_ANGLE)[:, :2]
    return replace(mesh, points=np.concatenate([given, origin + edge_length * better[len(given) :]]))


def signed_areas(points: Floats, triangles: Ints) -> Floats:
    """(t,) areas, positive for counter-clockwise triangles."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return 0.5 * cross_2d(b - a, c - a)


def locate(mesh: PlanarMesh, points: Floats) -> Ints:
    """(p,) a triangle that contains each of points (p,2), the first of several, or -1."""
    triangle = np.full(len(points), OUTSIDE)
    if not len(points):
        return triangle
    corner = mesh.points[mesh.triangles]
    side, x = corner[:, [1, 2, 0]] - corner, corner[..., 0]
    slack, order = 1e-12 * np.einsum("tij,tij->t", side, side).max(initial=0.0), np.argsort(points[:, 0])
    # only the triangles above and below a point are tried
    first = np.searchsorted(points[order, 0], x.min(axis=1) - ON * np.ptp(x))
    count = np.searchsorted(points[order, 0], x.max(axis=1) + ON * np.ptp(x), side="right") - first
    tried = np.repeat(np.arange(len(corner)), count)
    place = order[np.arange(len(tried)) + np.repeat(first - np.cumsum(count) + count, count)]
    hit = (cross_2d(side[tried], points[place][:, None] - corner[tried]) >= -slack).all(axis=1)
    triangle[place[hit][::-1]] = tried[hit][::-1]
    return triangle


def _lattice(points: Floats, segments: Ints) -> Floats:
    """(p,2) lattice points clear of the segments, symmetric about the middle of the bounding box."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    step = np.array([1.0, np.sqrt(0.75)])
    i, j = (np.arange(-k, k + 1) for k in np.ceil(0.5 * np.ptp(points, axis=0) / step).astype(int))
    column, row = (a.ravel() for a in np.meshgrid(i, j, indexing="ij"))
    lattice = middle + step * np.stack([column + 0.5 * (row % 2), row], axis=1)
    return lattice[_clear(lattice, points, segments, np.ones(len(points)))]


def _clear(candidates: Floats, points: Floats, segments: Ints, clearance: Floats) -> Bools:
    """(p,) whether candidates (p,2) are far enough from the given points and segments."""
    reach = np.concatenate([clearance, clearance[segments].min(axis=1)])
    places = np.concatenate([points, points[segments].mean(axis=1)])
    distance, nearest = cKDTree(places).query(candidates.reshape(-1, 2))
    return np.asarray(distance >= CLEARANCE * reach[nearest])


def _inside(points: Floats, segments: Ints, holes: Floats, given: Floats) -> PlanarMesh:
    """The Delaunay triangulation with every segment an edge, inside the outline and outside the holes; points
    used elsewhere only go. Segments separate the parts of it; a part with a side that no other triangle has
    is outside."""
    try:
        T: Ints = Delaunay(points).simplices.astype(np.int64)
    except QhullError:
        raise SurfaceError("the points lie on one line and enclose no area", what="points") from None
    area = signed_areas(points, T)
    T[area < 0] = T[area < 0][:, ::-1]
    missing = segments[edge_places(segments, T[:, SIDES].reshape(-1, 2)) < 0].tolist()
    for a, b in missing:
        T = _with_segment(points, T, a, b, given)
    if missing:  # one put in may have taken another away
        for a, b in segments[edge_places(segments, T[:, SIDES].reshape(-1, 2)) < 0].tolist():
            raise _crossing(given, a, b)
    sides = T[:, SIDES].reshape(-1, 2)
    free = edge_places(sides, segments) < 0
    pairs = twins(sides.min(axis=1) * len(points) + sides.max(axis=1))
    part = components(pairs[free[pairs[:, 0]]] // 3, len(T))
    free[pairs] = False
    outer = np.unique(part[np.flatnonzero(free) // 3])
    located = locate(PlanarMesh(points, T, part), holes)
    for place, triangle in enumerate(located):
        if triangle == OUTSIDE or part[triangle] in outer:
            problem = f"the point of hole {place} lies outside the outline"
            raise OptionError(problem, what="holes", where=place)
    kept = ~np.isin(part, [*outer, *part[located]])
    if not kept.any():
        raise SurfaceError("the segments enclose no area; close the outline", what="segments")
    used = mask_of(T[kept], len(points))
    used[: len(given)] = True
    region = np.unique(part[kept], return_inverse=True)[1]
    return PlanarMesh(points[used], (np.cumsum(used) - 1)[T[kept]], region)


def twins(key: Ints) -> Ints:
    """(k,2) the places of each key that occurs exactly twice."""
    order = np.argsort(key, kind="stable")
    ends = np.flatnonzero(np.diff(key[order], prepend=np.nan, append=np.nan))  # NaN is no key
    first = ends[:-1][np.diff(ends) == 2]
    return order[np.stack([first, first + 1], axis=1)]


def _crossing(given: Floats, a: int, b: int) -> SurfaceError:
    problem = f"segment {given[a].tolist()} - {given[b].tolist()} crosses another segment or passes through"
    return SurfaceError(f"{problem} a point; split it there", what="segments", where=(a, b))


def _with_segment(X: Floats, T: Ints, a: int, b: int, given: Floats) -> Ints:
    """The triangulation with edge (a, b); the triangles that it crosses are replaced (Anglada, 1997)."""
    E, along = T[:, SIDES], X[b] - X[a]
    u, v = X[E[..., 0]], X[E[..., 1]]
    apart = cross_2d(along, u - X[a]) * cross_2d(along, v - X[a]) < 0
    apart &= cross_2d(v - u, X[a] - u) * cross_2d(v - u, X[b] - u) < 0
    crossed = (apart & ~np.isin(E, [a, b]).any(axis=2)).any(axis=1)
    cavity = set(map(tuple, E[crossed].reshape(-1, 2).tolist()))
    follow: dict[int, int] = {p: q for p, q in cavity if (q, p) not in cavity}
    new: list[tuple[int, int, int]] = []
    for start, end in ((b, a), (a, b)):  # each side's rim, counter-clockwise, without its ends
        rim, at = list[int](), follow.get(start)
        while at is not None and at != end and len(rim) <= len(follow):
            rim.append(at)
            at = follow.get(at)
        if at != end or not rim:
            raise _crossing(given, a, b)
        new += _delaunay_below(X, end, start, rim[::-1])
    return np.concatenate([T[~crossed], np.array(new, dtype=np.int64)])


def _delaunay_below(X: Floats, a: int, b: int, rim: list[int]) -> list[tuple[int, int, int]]:
    """Delaunay triangles between edge (a, b) and the vertices of the rim to its left, a to b. The apex over
    (a, b) is the vertex that sees it under the largest angle: its circle is empty."""
    if not rim:
        return []
    u, v = X[a] - X[rim], X[b] - X[rim]
    apex = int(np.argmax(np.arctan2(cross_2d(u, v), (u * v).sum(axis=1))))
    c = rim[apex]
    left, right = _delaunay_below(X, a, c, rim[:apex]), _delaunay_below(X, c, b, rim[apex + 1 :])
    return [(a, b, c), *left, *right]


def _wanted(points: Floats, fixed: Floats, spacing: Floats) -> Floats:
    """(p,) edge length wanted at each point: that of the nearest given point, growing with distance."""
    distance, nearest = cKDTree(fixed).query(points)
    return np.minimum(1.0, spacing[nearest] + 0.3 * distance)


def _additions(mesh: PlanarMesh, segments: Ints, fixed: Floats, spacing: Floats) -> Floats:
    """(p,2) circumcentres of triangles that are too large or too sharp, apart from each other."""
    X, T = mesh.points, mesh.triangles
    a = X[T[:, 0]]
    u, v = X[T[:, 1]] - a, X[T[:, 2]] - a
    twice, uu, vv = 2.0 * cross_2d(u, v), (u**2).sum(axis=1), (v**2).sum(axis=1)
    offset = np.stack([v[:, 1] * uu - u[:, 1] * vv, u[:, 0] * vv - v[:, 0] * uu], axis=1)
    flat = np.abs(twice) <= 1e-12 * (uu + vv)
    centre = a + offset / np.where(flat, 1.0, twice)[:, None]
    radius = np.linalg.norm(centre - a, axis=1)
    wanted = _wanted(X[T].mean(axis=1), fixed, spacing)
    sharp = angles(X[T]).min(axis=1) < GOOD_ANGLE
    chosen = np.flatnonzero(~flat & ((radius > wanted) | (sharp & (radius > 0.8 * wanted))))
    order = chosen[np.argsort(-radius[chosen] / wanted[chosen], kind="stable")]
    place, need = centre[order], 0.7 * wanted[order]
    clear = (cKDTree(X).query(place)[0] >= need) & _clear(place, fixed, segments, spacing)
    return place[clear][_spaced_out(place[clear], need[clear])]


def _spaced_out(points: Floats, need: Floats, given: int = 0) -> Bools:
    """(p,) a choice of points, earlier ones first: pairs are not nearer than both points need. The first
    ``given`` points are always chosen."""
    chosen = np.ones(len(points), dtype=bool)
    if len(points) > 1:
        pairs = cKDTree(points).query_pairs(float(need.max()), output_type="ndarray")
        close = pairs[segment_lengths(points, pairs) < need[pairs].min(axis=1)]
        for i, j in close[np.lexsort(close.T[::-1])]:
            if chosen[i] and j >= given:
                chosen[j] = False
    return chosen
