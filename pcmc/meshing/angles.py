"""The few worst triangles of a mesh, made better by moving single vertices along the surface."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..surface.geometry import angles, area_vectors

SWEEPS = 12
MOST = 400  # vertices a sweep: this is for leftovers, not for whole meshes
TURNS = 2.0 * np.pi * np.arange(8) / 8.0
REACHES = (0.02, 0.06, 0.15)  # of the longest edge of the star


def improve_angles(X: Floats, F: Ints, movable: Bools, goal: float) -> Floats:
    """Vertices (n,3) with fewer angles below ``goal`` degrees.

    Each movable vertex of a triangle below the goal tries places around it in the plane of its star
    and takes the one where the star's smallest angle is largest; nothing else moves, and no star's
    smallest angle gets smaller.

    >>> square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.9, 0.5, 0]])
    >>> fan = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    >>> free = np.array([False, False, False, False, True])
    >>> moved = improve_angles(square, fan, free, goal=40.0)
    >>> bool(angles(moved[fan]).min() > 38.0 > angles(square[fan]).min())
    True
    """
    X = X.copy()
    order = np.argsort(F.ravel(), kind="stable")
    first = np.searchsorted(F.ravel()[order], np.arange(len(X) + 1))
    for _ in range(SWEEPS):
        smallest = angles(X[F]).min(axis=1)
        bad = np.flatnonzero(smallest < goal)
        vertices = F[bad[np.argsort(smallest[bad], kind="stable")]].ravel()
        vertices = vertices[np.sort(np.unique(vertices, return_index=True)[1])]
        moved = [
            _improve(X, F[order[first[v] : first[v + 1]] // 3], int(v))
            for v in vertices[movable[vertices]][:MOST]
        ]
        if not any(moved):
            break
    return X


def _improve(X: Floats, star: Ints, v: int) -> bool:
    """Move vertex v to the best of the places around it; whether it moved."""
    corner = X[star]
    normal = area_vectors(corner).sum(axis=0)
    first = X[star[0][star[0] != v][0]] - X[v]
    first = first - (first @ normal) / (normal @ normal) * normal
    length = np.linalg.norm(first)
    if not length > 0.0:
        return False
    second = np.cross(normal / np.linalg.norm(normal), first / length)
    reach = np.linalg.norm(corner - X[v], axis=2).max()
    around = np.cos(TURNS)[:, None] * (first / length) + np.sin(TURNS)[:, None] * second
    places = X[v] + np.concatenate([np.zeros((1, 3)), *(reach * r * around for r in REACHES)])
    ring = np.where((star == v)[None, :, :, None], places[:, None, None, :], corner[None])
    upright = area_vectors(ring) @ normal > 0.0
    value = np.where(upright.all(axis=1), angles(ring).min(axis=(1, 2)), -1.0)
    best = int(np.argmax(value))
    if value[best] <= value[0] + 1e-6:
        return False
    X[v] = places[best]
    return True
