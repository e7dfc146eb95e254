"""Triangles: the one place where their edges, area vectors, areas, angles and sizes are written down.

A triangle has corners a, b, c, counter-clockwise seen from its positive side. Edge k is opposite corner
k: c - b, a - c, b - a. Its area vector is A ν = ½ (b - a) × (c - a), of length A along the normal ν.

There are two layers. Compiled loops use three-vectors, tuples of floats, with inlined operations: ``point``,
``cross``, ``dot`` and others. All other code uses whole arrays: a function of ``P`` (…,m,3,3) takes the
corners of m triangles, ``X[F]`` for vertices X (n,3) and faces F (m,3).
"""

from __future__ import annotations

from math import sqrt

import numpy as np
import numpy.typing as npt

from ..base.arrays import Floats, Ints, Vector
from ..base.compiled import compiled, inlined
from ..base.tolerances import FAR

CORNER = 40.0  # degrees: where held edges turn by more, their line has a corner


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
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def sub(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def scaled(s: float, a: Vector) -> Vector:
    return s * a[0], s * a[1], s * a[2]


@inlined
def divided(a: Vector, s: float) -> Vector:
    return a[0] / s, a[1] / s, a[2] / s


@inlined
def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a: Vector, b: Vector) -> Vector:
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
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@inlined
def accumulate(out: Floats, i: int, a: Vector) -> None:
    """Add a to row i of out (n,3)."""
    out[i, 0] += a[0]
    out[i, 1] += a[1]
    out[i, 2] += a[2]


@compiled
def vertex_area_vectors(X: Floats, F: Ints, rows: Ints | None = None) -> tuple[Floats, Floats]:
    """Σ A_T ν_T (n,3) and Σ A_T (n,) over the triangles around each vertex.

    The sums of a triangle's corners F (m,3) are in ``rows`` (m,3), those of the vertices that they are images
    of; by default their own.
    """
    rows = F if rows is None else rows
    total, area = np.zeros(X.shape), np.zeros(len(X))
    for f in range(len(F)):
        a, b, c = point(X, F[f, 0]), point(X, F[f, 1]), point(X, F[f, 2])
        area_vector = scaled(0.5, cross(sub(b, a), sub(c, a)))
        face_area = norm(area_vector)
        for k in range(3):
            v = rows[f, k]
            accumulate(total, v, area_vector)
            area[v] += face_area
    return total, area


@compiled
def squared_sides(X: Floats, F: Ints) -> Floats:
    """(m,) the squared lengths of each triangle's sides, added up, length².

    >>> squared_sides(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2]])).tolist()
    [4.0]
    """
    out = np.empty(len(F))
    for f in range(len(F)):
        a, b, c = point(X, F[f, 0]), point(X, F[f, 1]), point(X, F[f, 2])
        u, v, w = sub(c, b), sub(a, c), sub(b, a)
        out[f] = dot(u, u) + dot(v, v) + dot(w, w)
    return out


@compiled
def bounding_size(X: Floats) -> float:
    """Diagonal of the bounding box of points (n,d), length; 0 for none.

    >>> bounding_size(np.array([[0.0, 0.0, 1.0], [3.0, 4.0, 1.0]]))
    5.0
    """
    total = 0.0
    for d in range(X.shape[1] if len(X) else 0):
        low = high = X[0, d]
        for v in range(len(X)):
            low, high = min(low, X[v, d]), max(high, X[v, d])
        total += (high - low) ** 2
    return sqrt(total)


def file_origin(X: Floats, size: float) -> Floats:
    """(d,) the point from which far coordinates (n,d) are measured: zero, or whole numbers near.

    >>> file_origin(np.array([[1000.0, 0, 0], [1001, 0, 0], [1000, 1, 1]]), 1.7).tolist()
    [1000.0, 0.0, 0.0]
    """
    middle = X.mean(axis=0)
    return np.round(middle) if np.linalg.norm(middle) > FAR * size else np.zeros_like(middle)


def in_edges(lengths: npt.ArrayLike, edge_length: float) -> Floats:
    """Lengths (…) in edge lengths, to 30 binary digits: what is rounded in other units decides nothing.

    >>> in_edges([0.7, 2.1], 0.2).tolist(), in_edges([700.0, 2100.0], 200.0).tolist()
    ([3.5, 10.5], [3.5, 10.5])
    """
    return np.ldexp(np.rint(np.ldexp(np.asarray(lengths) / edge_length, 30)), -30)


def lengths_along(points: Floats) -> Floats:
    """(k,) the length of the polyline through points (k,d) up to each of them.

    >>> lengths_along(np.array([[0, 0], [3, 4], [3, 5]])).tolist()
    [0.0, 5.0, 6.0]
    """
    return np.append(0.0, np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum())


def segment_lengths(X: Floats, ends: Ints) -> Floats:
    """(e,) lengths of the segments between vertices ``ends`` (e,2)."""
    return np.asarray(np.linalg.norm(X[ends[:, 1]] - X[ends[:, 0]], axis=1))


def unit_vectors(v: Floats) -> Floats:
    """(…,d) vectors of length 1 along vectors (…,d), none of them zero.

    >>> unit_vectors(np.array([[0.0, 3.0, 4.0]])).tolist()
    [[0.0, 0.6, 0.8]]
    """
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def end_tangent(t: Floats, lengths: Floats) -> Floats:
    """(3,) the tangent at the end of a polyline, of length 1, from the directions t (k,3) and lengths (k,) of
    its last edge and the one before, if there is one: the first turns on by its share of their bend, if
    that is no corner.

    >>> end_tangent(np.array([[1.0, 0, 0], [0.8, -0.6, 0]]), np.array([1.0, 2.0])).round(3).tolist()
    [0.983, 0.184, 0.0]
    """
    if t[0] @ t[-1] < np.cos(np.radians(CORNER)):
        return t[0]
    return unit_vectors(t[0] + (t[0] - t[-1]) * lengths[0] / lengths.sum())


def edge_vectors(P: Floats) -> Floats:
    """(…,m,3,3) edges of triangles; edge k is opposite corner k.

    >>> edge_vectors(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])).tolist()
    [[-1.0, 1.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]
    """
    return np.roll(P, 1, axis=-2) - np.roll(P, -1, axis=-2)


def area_vectors(P: Floats) -> Floats:
    """(…,m,3) A ν of triangles: the area along the normal, length².

    >>> area_vectors(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])).tolist()
    [0.0, 0.0, 0.5]
    """
    a, b, c = P[..., 0, :], P[..., 1, :], P[..., 2, :]
    return np.asarray(0.5 * np.cross(b - a, c - a))


def face_areas(P: Floats) -> Floats:
    """(…,m) areas of triangles, length²."""
    return np.asarray(np.linalg.norm(area_vectors(P), axis=-1))


def angles(P: Floats) -> Floats:
    """(…,m,3) angles of triangles at their corners, degrees, to 1e-6; P (…,m,3,2) or (…,m,3,3).

    >>> angles(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])).round(9).tolist()
    [90.0, 45.0, 45.0]
    """
    a, b = np.roll(P, -1, axis=-2) - P, np.roll(P, 1, axis=-2) - P
    cosine = (a * b).sum(axis=-1)
    both = (a * a).sum(axis=-1) * (b * b).sum(axis=-1)
    turned = np.arctan2(np.sqrt(np.maximum(both - cosine**2, 0.0)), cosine)
    return np.asarray(np.degrees(turned), dtype=np.float64)


def vertex_sums(values: Floats, F: Ints, n: int) -> Floats:
    """(n,c) at each vertex the sum of values (m,c) of the faces around it, or (m,3,c) of their corners."""
    if values.ndim == 2:
        values = np.repeat(values[:, None], 3, axis=1)
    columns = values.reshape(-1, values.shape[2]).T
    sums = np.stack([np.bincount(F.ravel(), column, n) for column in columns], axis=1)
    return sums.astype(np.float64, copy=False)


def cross_2d(u: Floats, v: Floats) -> Floats:
    """(…) u × v of plane vectors (…,2): the area of their parallelogram, positive counter-clockwise."""
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


@inlined
def to_triangle(p: Vector, a: Vector, b: Vector, c: Vector) -> float:
    """The distance of p from a triangle: from its plane where p is above it, else from its nearest side."""
    normal = cross(sub(b, a), sub(c, a))
    first = dot(cross(sub(b, a), sub(p, a)), normal)
    second = dot(cross(sub(c, b), sub(p, b)), normal)
    third = dot(cross(sub(a, c), sub(p, c)), normal)
    if first >= 0.0 and second >= 0.0 and third >= 0.0 and norm(normal) > 0.0:
        return abs(dot(sub(p, a), normal)) / norm(normal)
    return min(_to_side(p, a, b), min(_to_side(p, b, c), _to_side(p, c, a)))


@inlined
def _to_side(p: Vector, a: Vector, b: Vector) -> float:
    side, to = sub(b, a), sub(p, a)
    squared = dot(side, side)
    share = min(max(dot(to, side) / squared, 0.0), 1.0) if squared > 0.0 else 0.0
    return norm(sub(p, add(a, scaled(share, side))))
