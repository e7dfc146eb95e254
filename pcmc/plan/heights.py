"""Initial heights over a plan: a harmonic surface through the boundary, and a dome above it."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints
from ..meshing.planar import signed_areas

RISE = 0.3  # of the radius of the largest circle without supports: a shallow dome
FULLNESS = 0.75  # power of the membrane's height; below 1 the dome is steeper at its edge
SLOPE = 0.8  # largest slope of the dome; steeper ones stretch the triangles
LEAST = 0.15  # of that slope: smallest slope, so that walls have room


def stiffness(points: Floats, triangles: Ints) -> csr_array:
    """(n,n) cotangent matrix L of plane triangles: uᵀ L u = ∫ |∇u|² for u linear on each.

    >>> L = stiffness(np.array([[0, 0], [1, 0], [0, 1.0]]), np.array([[0, 1, 2]]))
    >>> L.toarray().tolist()
    [[1.0, -0.5, -0.5], [-0.5, 0.5, 0.0], [-0.5, 0.0, 0.5]]
    """
    X = points[triangles]
    opposite = X[:, [2, 0, 1]] - X[:, [1, 2, 0]]
    area = signed_areas(points, triangles)
    local = np.einsum("tik,tjk->tij", opposite, opposite) / (4.0 * area[:, None, None])
    row, column = np.repeat(triangles, 3, axis=1), np.tile(triangles, (1, 3))
    n = len(points)
    return csr_array(coo_array((local.ravel(), (row.ravel(), column.ravel())), shape=(n, n)))


def harmonic_heights(points: Floats, triangles: Ints, heights: Floats) -> Floats:
    """(n,) the harmonic function with the given heights; NaN is unknown.

    >>> square = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [1, 1.0]])
    >>> fan = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    >>> harmonic_heights(square, fan, np.array([0, 0, 3, 3, np.nan])).tolist()
    [0.0, 0.0, 3.0, 3.0, 1.5]
    """
    known = ~np.isnan(heights)
    given = np.where(known, heights, 0.0)
    if np.ptp(given[known]) == 0.0:
        return np.full(len(points), given[known][0])
    L = stiffness(points, triangles)
    return _solve(L, -(L @ given), known) + given


def dome(points: Floats, triangles: Ints, held: Bools, rise: float | None = None) -> Floats:
    """(n,) heights of an initial dome: 0 where held, at most ``rise``, never steep at the edge.

    The shape is (u / max u)^0.75 for a membrane under pressure: Δu = -1, u = 0 at held vertices, free
    edges elsewhere. ``rise`` is by default 0.3 of the radius of the largest circle without held
    vertices. The height is between 0.12 and 0.8 times the distance from the held vertices; both
    slopes grow with a larger rise.
    """
    area = np.abs(signed_areas(points, triangles))
    load = np.bincount(triangles.ravel(), np.repeat(area / 3.0, 3), len(points)).astype(float)
    u = np.maximum(_solve(stiffness(points, triangles), load, held), 0.0)
    distance = np.asarray(cKDTree(points[held]).query(points)[0])
    radius = float(distance.max())
    rise = RISE * radius if rise is None else rise
    slope = max(SLOPE, SLOPE / RISE * rise / radius)
    full = rise * (u / u.max()) ** FULLNESS
    return np.clip(full, LEAST * slope * distance, slope * distance)


def _solve(L: csr_array, load: Floats, known: Bools) -> Floats:
    """(n,) u with L u = load at the unknown vertices and u = 0 at the known ones."""
    free = np.flatnonzero(~known)
    u: Floats = np.zeros(len(load))
    if len(free):
        factor = splu(L[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A")
        u[free] = factor.solve(load[free])
    return u
