"""Nearly equilateral triangles inside plane outlines; the vertices of the outlines do not move.

The examples of the paper use these meshes and not those of ``pcmc.plan``: the result of a flow depends on
its mesh, and changes to the mesher of plans must not change the reproduced numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.spatial import Delaunay, cKDTree

from pcmc.base.arrays import Bools, Floats, Ints
from pcmc.base.errors import OptionError
from pcmc.surface.geometry import cross_2d

CLEARANCE = 0.65  # of the spacing: distance of the lattice from the outlines
SWEEPS, RELAXATIONS = 4, 5  # triangulations, and steps on each; more do not improve the mesh
REACH = 1.05  # of the spacing: shorter edges push their ends apart
STEP = 0.1  # of the length that an edge lacks, for each of its triangles; 0.2 oscillates


def fill(outlines: Sequence[Floats], spacing: float) -> tuple[Floats, Ints]:
    """Interior points and faces of the region inside ``outlines``.

    A triangular lattice fills the region at some distance from the outlines. In each of a few
    sweeps, short edges push their ends apart, and a new Delaunay triangulation connects the points.

    Parameters
    ----------
    outlines : closed polygons (k,2), the outer one first, then the holes; either direction. Their
        segments should be about as long as ``spacing``.
    spacing : edge length.

    Returns
    -------
    points : (i,2) the interior points.
    faces : (f,3), counter-clockwise; numbers below Σ k are the outlines' points in the order given,
        the others the interior points.

    Raises
    ------
    OptionError
        If a side of an outline is not an edge of the triangulation: the segments are too long where
        outlines are close to each other.

    >>> square = np.array([[0, 0], [1, 0], [2, 0], [2, 1], [2, 2], [1, 2], [0, 2], [0, 1.0]])
    >>> points, faces = fill([square], 1.0)
    >>> len(points), len(faces)
    (1, 8)
    """
    rim = np.concatenate(outlines)
    sides = _sides([len(outline) for outline in outlines])
    region = _Region(rim, sides)
    points = _lattice(rim, spacing)
    points = points[region.contains(points)]
    points = points[_distance(points, rim, sides) > CLEARANCE * spacing]
    for _ in range(SWEEPS):
        points = _relaxed(rim, points, region.triangulate(points), spacing)
    faces = region.triangulate(points)
    _require_sides(faces, sides, rim)
    return points, faces


class _Region:
    """The inside of the outlines, as the triangles of their own Delaunay triangulation."""

    def __init__(self, rim: Floats, sides: Ints) -> None:
        self.rim = rim
        self.coarse: Any = Delaunay(rim)
        centroids = rim[self.coarse.simplices].mean(axis=1)
        self.inside = np.append(_ray_crossings(centroids, rim, sides) % 2 == 1, False)

    def contains(self, points: Floats) -> Bools:
        """(k,) bool."""
        return self.inside[self.coarse.find_simplex(points)]

    def triangulate(self, points: Floats) -> Ints:
        """Counter-clockwise Delaunay faces of rim and points that lie inside."""
        both = np.concatenate([self.rim, points])
        faces = Delaunay(both).simplices.astype(np.int64)
        corner, u, v = both[faces[:, 0]], both[faces[:, 1]], both[faces[:, 2]]
        turn = cross_2d(u - corner, v - corner)
        faces[turn < 0] = faces[turn < 0][:, ::-1]
        return faces[self.contains(both[faces].mean(axis=1))]


def _sides(lengths: Sequence[int]) -> Ints:
    """(k,2) numbers of the ends of every side of closed polygons stored one after the other."""
    start = np.repeat(np.cumsum(lengths) - lengths, lengths)
    number = np.arange(sum(lengths))
    after = start + (number - start + 1) % np.repeat(lengths, lengths)
    return np.stack([number, after], axis=1, dtype=np.int64)


def _lattice(rim: Floats, spacing: float) -> Floats:
    """Points of a triangular lattice, symmetric about the middle of the box around the rim."""
    middle = 0.5 * (rim.min(axis=0) + rim.max(axis=0))
    half = 0.5 * np.ptp(rim, axis=0)
    step = np.array([spacing, 0.5 * np.sqrt(3.0) * spacing])
    i, j = (np.arange(-k, k + 1) for k in np.ceil(half / step).astype(int) + 1)
    x, y = np.meshgrid(i, j, indexing="ij")
    points = np.stack([x + 0.5 * (y % 2), y], axis=-1).reshape(-1, 2) * step
    return middle + points


def _ray_crossings(points: Floats, rim: Floats, sides: Ints) -> Ints:
    """Number of sides that a ray to the right of each point crosses; odd inside."""
    counts = np.zeros(len(points), dtype=np.int64)
    for part in np.array_split(np.arange(len(points)), 1 + len(points) * len(sides) // 10**7):
        x, y = points[part].T[:, :, None]
        (ax, ay), (bx, by) = rim[sides[:, 0]].T, rim[sides[:, 1]].T
        spans = (ay > y) != (by > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            right = x < ax + (y - ay) * (bx - ax) / (by - ay)
        counts[part] = np.count_nonzero(spans & right, axis=1)
    return counts


def _distance(points: Floats, rim: Floats, sides: Ints) -> Floats:
    """(k,) distance to the nearest of the two sides at the nearest rim vertex."""
    nearest = cKDTree(rim).query(points)[1]
    at = np.argsort(sides.T.ravel(), kind="stable").reshape(-1, 2) % len(sides)
    distance = np.full(len(points), np.inf)
    for side in at[nearest].T:
        start, end = rim[sides[side, 0]], rim[sides[side, 1]]
        along = end - start
        share = ((points - start) * along).sum(axis=1) / (along**2).sum(axis=1)
        foot = start + np.clip(share, 0.0, 1.0)[:, None] * along
        distance = np.minimum(distance, np.linalg.norm(points - foot, axis=1))
    return distance


def _relaxed(rim: Floats, points: Floats, faces: Ints, spacing: float) -> Floats:
    """The interior points after short edges have pushed their ends apart; the rim does not move."""
    both = np.concatenate([rim, points])
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    side = np.tile(np.arange(len(sides)), 2)
    signs = np.repeat([STEP, -STEP], len(sides))
    ends = coo_array((signs, (sides.T.ravel(), side)), shape=(len(both), len(sides))).tocsr()
    for _ in range(RELAXATIONS):
        apart = both[sides[:, 0]] - both[sides[:, 1]]
        length = np.linalg.norm(apart, axis=1)
        short = np.maximum(REACH * spacing - length, 0.0)
        both[len(rim) :] += (ends @ (apart * (short / length)[:, None]))[len(rim) :]
    return both[len(rim) :]


def _require_sides(faces: Ints, sides: Ints, rim: Floats) -> None:
    n = int(faces.max()) + 1
    pairs = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    wanted = np.sort(sides, axis=1)
    lost = np.flatnonzero(~np.isin(wanted @ [n, 1], pairs @ [n, 1]))
    if len(lost):
        point = rim[sides[lost[0], 0]].round(6).tolist()
        raise OptionError(
            f"the side of the outline at {point} is not an edge of the triangulation ({len(lost)} such"
            " sides): its segments are too long there; use a smaller edge length",
            what="outlines",
            where=tuple(point),
        )
