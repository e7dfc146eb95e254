"""Distances of points from triangles, and how far one surface is from another."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints, mask_of
from ..base.compiled import compiled
from .geometry import area_vectors, point, to_triangle, vertex_sums


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


def difference(surface: Any, other: Any) -> Floats:
    """(n,) distance of each vertex from another surface, length; positive outside it, along its normals.

    The meshes may differ. Walls are no part of it, except for the vertices of walls.

    >>> from pcmc import Patch, Surface
    >>> corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0.0]])
    >>> flat = Surface(corners, [[0, 1, 2]], [0], [Patch("roof", 1.0)], fixed=[0, 1, 2])
    >>> lower = Surface(corners - [0, 0, 0.5], [[0, 1, 2]], [0], [Patch("roof", 1.0)], fixed=[0, 1, 2])
    >>> difference(flat, lower).tolist(), difference(lower, flat).tolist()
    ([0.5, 0.5, 0.5], [-0.5, -0.5, -0.5])
    """
    roof, other_roof = (s.faces[s.roof[s.patch_of_face]] for s in (surface, other))
    if not (len(roof) and len(other_roof)):
        return _away(surface.vertices, other.vertices, other.faces)
    on_roof = mask_of(roof, surface.n)
    away = np.empty(surface.n)
    for chosen, faces in ((on_roof, other_roof), (~on_roof, other.faces)):  # a wall may be nearer to the roof
        away[chosen] = _away(surface.vertices[chosen], other.vertices, faces)
    return away


def _away(points: Floats, Y: Floats, F: Ints) -> Floats:
    """(k,) signed distance of points (k,3) from the triangles F of vertices Y."""
    if not len(points):
        return np.empty(0)
    away = distances(points, Y, F)
    normal, used = vertex_sums(area_vectors(Y[F]), F, len(Y)), np.unique(F)
    nearest = used[cKDTree(Y[used]).query(points)[1]]
    outside = np.einsum("ij,ij->i", points - Y[nearest], normal[nearest]) >= 0.0
    return np.where(outside, away, -away)


@compiled
def _nearest(points: Floats, X: Floats, F: Ints, start: Ints, candidates: Ints) -> Floats:
    out = np.full(len(points), np.inf)
    for i in range(len(points)):
        p = point(points, i)
        for f in candidates[start[i] : start[i + 1]]:
            a, b, c = point(X, F[f, 0]), point(X, F[f, 1]), point(X, F[f, 2])
            out[i] = min(out[i], to_triangle(p, a, b, c))
    return out
