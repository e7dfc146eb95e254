"""Triangles: the one place where their edges, area vectors, areas, angles and sizes are written down.

A triangle has corners a, b, c, counter-clockwise seen from its positive side. Edge k is opposite corner
k: c - b, a - c, b - a. Its area vector is A ν = ½ (b - a) × (c - a), of length A along the normal ν.

Two layers say the same. Compiled loops take three-vectors as tuples of floats: ``point``, ``cross``,
``dot`` and the others are inlined. Elsewhere whole arrays are taken at once: functions of ``P``
(…,m,3,3) take the corners of m triangles, ``X[F]`` for vertices X (n,3) and faces F (m,3).

Numba caches each loop with the file that holds it: after a change of this file's compiled functions,
delete the cached loops of the others (``__pycache__/*.nb?``).
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled, inlined

Vector = tuple[float, float, float]


@inlined
def point(X: Floats, i: int) -> Vector:
    """Row i of X (n,3)."""
    return X[i, 0], X[i, 1], X[i, 2]


@inlined
def vector(a: Floats) -> Vector:
    """An array (3,) as a three-vector."""
    return a[0], a[1], a[2]


@inlined
def add(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def sub(a: Vector, b: Vector) -> Vector:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def scaled(s: float, a: Vector) -> Vector:
    """s a."""
    return s * a[0], s * a[1], s * a[2]


@inlined
def divided(a: Vector, s: float) -> Vector:
    """a / s."""
    return a[0] / s, a[1] / s, a[2] / s


@inlined
def dot(a: Vector, b: Vector) -> float:
    """⟨a, b⟩."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a: Vector, b: Vector) -> Vector:
    """a × b.

    >>> cross((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    (0.0, 0.0, 1.0)
    """
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def cross_sum(a: Vector, b: Vector, c: Vector, d: Vector) -> Vector:
    """a × b + c × d, as the product rule has it."""
    return (
        a[1] * b[2] - a[2] * b[1] + c[1] * d[2] - c[2] * d[1],
        a[2] * b[0] - a[0] * b[2] + c[2] * d[0] - c[0] * d[2],
        a[0] * b[1] - a[1] * b[0] + c[0] * d[1] - c[1] * d[0],
    )


@inlined
def norm(a: Vector) -> float:
    """|a|."""
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@inlined
def accumulate(out: Floats, i: int, a: Vector) -> None:
    """Add a to row i of out (n,3)."""
    out[i, 0] += a[0]
    out[i, 1] += a[1]
    out[i, 2] += a[2]


@compiled
def vertex_area_vectors(X: Floats, F: Ints) -> tuple[Floats, Floats]:
    """Σ A_T ν_T (n,3) and Σ A_T (n,) over the triangles around each vertex."""
    total, area = np.zeros(X.shape), np.zeros(len(X))
    for f in range(len(F)):
        a, b, c = point(X, F[f, 0]), point(X, F[f, 1]), point(X, F[f, 2])
        area_vector = scaled(0.5, cross(sub(b, a), sub(c, a)))
        face_area = norm(area_vector)
        for k in range(3):
            accumulate(total, F[f, k], area_vector)
            area[F[f, k]] += face_area
    return total, area
