"""Distances of points from triangles: how far one shape is from another."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled, inlined
from ..surface.geometry import Vector, add, cross, dot, norm, point, scaled, sub


def distances(points: Floats, X: Floats, F: Ints) -> Floats:
    """(k,) distance of points (k,3) from the nearest of the triangles F (m,3) of vertices X (n,3), length.

    >>> X = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0.0]])
    >>> distances(np.array([[1, 1, 2], [-3, -4, 0.0]]), X, np.array([[0, 1, 2]])).tolist()
    [2.0, 5.0]
    """
    corners = X[F]
    centre = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centre[:, None], axis=2).max()
    tree = cKDTree(centre)
    nearest = tree.query(points)[0]
    lists = tree.query_ball_point(points, nearest + reach)  # no other triangle can be nearer
    start = np.append(0, np.cumsum([len(one) for one in lists]))
    return np.asarray(_nearest(points, X, F, start, np.concatenate(lists).astype(np.int64)))


@compiled
def _nearest(points: Floats, X: Floats, F: Ints, start: Ints, candidates: Ints) -> Floats:
    out = np.full(len(points), np.inf)
    for i in range(len(points)):
        p = point(points, i)
        for f in candidates[start[i] : start[i + 1]]:
            a, b, c = point(X, F[f, 0]), point(X, F[f, 1]), point(X, F[f, 2])
            out[i] = min(out[i], _distance(p, a, b, c))
    return out


@inlined
def _distance(p: Vector, a: Vector, b: Vector, c: Vector) -> float:
    """From the triangle's plane if the point is above the triangle, else from its nearest side."""
    normal = cross(sub(b, a), sub(c, a))
    first = dot(cross(sub(b, a), sub(p, a)), normal)
    second = dot(cross(sub(c, b), sub(p, b)), normal)
    third = dot(cross(sub(a, c), sub(p, c)), normal)
    if first >= 0.0 and second >= 0.0 and third >= 0.0 and norm(normal) > 0.0:
        return abs(dot(sub(p, a), normal)) / norm(normal)
    return min(_from_side(p, a, b), min(_from_side(p, b, c), _from_side(p, c, a)))


@inlined
def _from_side(p: Vector, a: Vector, b: Vector) -> float:
    side, to = sub(b, a), sub(p, a)
    squared = dot(side, side)
    share = min(max(dot(to, side) / squared, 0.0), 1.0) if squared > 0.0 else 0.0
    return norm(sub(p, add(a, scaled(share, side))))
