"""Projection onto smooth curves through held vertices, the same for all meshes of one surface."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..surface import Surface
from .held_curves import CORNER, arcs_over, held_corners, held_edges
from .refinement import Projection

HALVINGS = 8  # of each edge of a curve that points are projected onto
NEAREST = 3  # pieces of curve that are compared


def onto_held_curves(surface: Surface, corner: float = CORNER, corners: Ints | None = None) -> Projection:
    """A function (k,3) → (k,3) that puts points near a surface's held edges on the smooth curves there.

    The curves are those of ``smooth_midpoints``, with each edge cut into 256. All meshes made with one such
    function, by ``refine``, ``remesh`` or ``check_mesh``, have the same boundary.

    Parameters
    ----------
    corner, corners : as for ``smooth_midpoints``.

    Examples
    --------
    >>> from pcmc import Patch
    >>> angle = 2 * np.pi * np.arange(12) / 12
    >>> rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> disc = Surface([[0, 0, 0], *rim], [[0, k + 1, (k + 1) % 12 + 1] for k in range(12)], [0] * 12,
    ...                [Patch("disc", 1.0)], fixed=range(1, 13))
    >>> float(np.linalg.norm(onto_held_curves(disc)(np.array([[0.95, 0.1, 0.0]]))).round(5))
    1.0
    """
    X, edges = surface.vertices, held_edges(surface)
    corners = np.union1d(held_corners(surface, corner), np.empty(0, int) if corners is None else corners)
    for _ in range(HALVINGS):
        rises, arcs = arcs_over(X, edges, corner, corners)
        middle = X[edges].mean(axis=1) + rises.sum(axis=1) / np.maximum(arcs.sum(axis=1), 1.0)[:, None]
        number = len(X) + np.arange(len(edges))
        X = np.concatenate([X, middle])
        edges = np.concatenate([np.stack([edges[:, 0], number], 1), np.stack([number, edges[:, 1]], 1)])
    start, side = X[edges[:, 0]], X[edges[:, 1]] - X[edges[:, 0]]
    tree = cKDTree(start + 0.5 * side)

    def project(points: Floats) -> Floats:
        if not len(start) or not len(points):
            return points
        near = tree.query(points, k=min(NEAREST, len(start)))[1].reshape(len(points), -1)
        away, along = points[:, None] - start[near], side[near]
        share = np.einsum("pnd,pnd->pn", away, along) / np.einsum("pnd,pnd->pn", along, along)
        foot = start[near] + np.clip(share, 0.0, 1.0)[..., None] * along
        nearest = np.linalg.norm(points[:, None] - foot, axis=2).argmin(axis=1)
        return np.asarray(foot[np.arange(len(points)), nearest])

    return project
