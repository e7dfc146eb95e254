"""Principal directions of a sheet, and its umbilics.

On a sheet of constant mean curvature the traceless part of the shape operator is a holomorphic quadratic
differential. Its square root is the gradient of coordinates whose level lines are lines of
curvature; its zeros are the umbilics, each of index -1/2 or a multiple of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array, eye_array

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled
from ..surface.geometry import area_vectors, vertex_sums

LEAST_POINTS = 18  # around a vertex, to fit the nine coefficients of a cubic
MOST_RINGS = 4  # of neighbours that are taken together


class Directions(NamedTuple):
    """The principal directions of each triangle, as complex numbers in its frame.

    ``w`` = (κ₁ - κ₂)/2 e^{2iφ}, with φ the angle of the direction of κ₁ from the first vector of the frame.
    """

    frame: Floats  # (m,2,3) orthonormal vectors in each triangle's plane, counter-clockwise from outside
    w: Floats  # (m,) complex, 1/length
    tensors: Floats  # (n,3,3) shape operators at the vertices, 1/length


def principal_directions(X: Floats, F: Ints) -> Directions:
    """The principal directions of a sheet's triangles F (m,3), from cubics fitted around vertices X (n,3).

    On a cylinder of radius 2, κ₁ - κ₂ is 1/2 and the directions are those of the axis and around it.

    >>> angle, height = (g.ravel() for g in np.meshgrid(np.linspace(0, 0.5, 6), np.linspace(0, 1, 6)))
    >>> X = np.column_stack([2 * np.cos(angle), 2 * np.sin(angle), height])
    >>> sides = [[k, k + 1, k + 6, k + 7] for k in range(29) if k % 6 < 5]
    >>> F = np.array(sides)[:, [[0, 1, 2], [1, 3, 2]]].reshape(-1, 3)
    >>> np.abs(2 * principal_directions(X, F).w).round(1).max().item()
    0.5
    """
    tensors = shape_operators(X, F)
    P = X[F]
    first = P[:, 1] - P[:, 0]
    first = first / np.linalg.norm(first, axis=1)[:, None]
    normal = area_vectors(P)
    normal = normal / np.linalg.norm(normal, axis=1)[:, None]
    frame = np.stack([first, np.cross(normal, first)], axis=1)
    T = np.einsum("fai,fij,fbj->fab", frame, tensors[F].mean(axis=1), frame)
    return Directions(frame, 0.5 * (T[:, 0, 0] - T[:, 1, 1]) + 1j * T[:, 0, 1], tensors)


def shape_operators(X: Floats, F: Ints) -> Floats:
    """(n,3,3) symmetric: the curvature II(a, b) = aᵀTb of tangent vectors at each vertex, 1/length.

    Positive where the sheet bends away from its outside. From a cubic over the tangent plane, fitted to the
    vertices of two rings, or of more where they are few; of order 2 in the edge length.
    """
    n = len(X)
    pairs = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    rows, columns = np.concatenate([pairs, pairs[:, ::-1]]).T
    near = csr_array(coo_array((np.ones(len(rows)), (rows, columns)), shape=(n, n))) + eye_array(n)
    rings = csr_array(near @ near)
    for _ in range(MOST_RINGS - 2):
        few = np.diff(rings.indptr) <= LEAST_POINTS
        if few.any():
            pick = csr_array((few.astype(float), (np.arange(n), np.arange(n))), shape=(n, n))
            rings = csr_array(rings + pick @ rings @ near)
    normal = vertex_sums(area_vectors(X[F]), F, n)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return np.asarray(_fitted(X, normal, rings.indptr.astype(np.int64), rings.indices.astype(np.int64)))


@compiled
def _fitted(X: Floats, normal: Floats, start: Ints, around: Ints) -> Floats:
    out = np.zeros((len(X), 3, 3))
    for i in range(len(X)):
        N = normal[i]
        k = np.argmin(np.abs(N))
        e = np.zeros(3)
        e[k] = 1.0
        e -= N[k] * N
        e /= np.sqrt((e * e).sum())
        f = np.array([N[1] * e[2] - N[2] * e[1], N[2] * e[0] - N[0] * e[2], N[0] * e[1] - N[1] * e[0]])
        count = start[i + 1] - start[i]
        A, b = np.zeros((count, 9)), np.zeros(count)
        reach = 0.0
        for r in range(count):
            d = X[around[start[i] + r]] - X[i]
            reach = max(reach, np.sqrt((d * d).sum()))
        for r in range(count):
            d = (X[around[start[i] + r]] - X[i]) / reach
            x, y = (d * e).sum(), (d * f).sum()
            b[r] = (d * N).sum()
            A[r] = np.array([x, y, 0.5 * x * x, x * y, 0.5 * y * y, x**3, x * x * y, x * y * y, y**3])
        terms = 9 if count > 12 else 5
        c = np.linalg.lstsq(np.ascontiguousarray(A[:, :terms]), b)[0]
        rise = np.sqrt(1.0 + c[0] ** 2 + c[1] ** 2)
        J = np.stack((e + c[0] * N, f + c[1] * N))  # tangents, rows
        D = np.linalg.inv(J @ J.T) @ J
        second = np.array([[c[2], c[3]], [c[3], c[4]]]) / (rise * reach)
        out[i] = -(D.T @ second @ D)
    return out
