"""Smooth curves through held vertices: where the new vertices of a finer mesh belong.

A mesh stands for a curved boundary by a polygon. A finer mesh whose new vertices lie on the polygon's sides
is a mesh of another boundary; here they are put on a smooth curve through the polygon's corners.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..surface import Surface
from .refinement import Projection, held_midpoints

CORNER = 40.0  # degrees: where held edges turn by more, the curve has a corner
HALVINGS = 8  # of each edge of a curve that points are projected onto
STRAIGHT = 1e-9  # of the length of an edge: smaller rises of an arc over it count as none


def smooth_midpoints(surface: Surface, corner: float = CORNER) -> Floats:
    """(k,3) places for the new held vertices of ``refine(surface)``, on smooth curves.

    Over each held edge stand two arcs, each through its ends and through the next vertex of the curve on
    one side. The new vertex lies half way between the middles of both arcs; beside a corner there is one
    arc, between two corners none. On circles and straight lines this is exact, whatever the lengths of
    the edges; on smooth curves its error is of order 4 for even edges, of order 3 for uneven ones.

    Parameters
    ----------
    corner : angle in degrees. A vertex where two held edges turn by more is a corner. Where several held
        edges meet, the two that turn least go on into each other.

    Examples
    --------
    >>> from pcmc import Patch
    >>> angle = 2 * np.pi * np.arange(12) / 12
    >>> rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> disc = Surface([[0, 0, 0], *rim], [[0, k + 1, (k + 1) % 12 + 1] for k in range(12)], [0] * 12,
    ...                [Patch("disc", 1.0)], fixed=range(1, 13))
    >>> np.linalg.norm(smooth_midpoints(disc), axis=1).round(12).tolist() == [1.0] * 12
    True
    """
    edges = surface.topology.edges[held_midpoints(surface)[0]]
    return _smooth_middles(surface.vertices, edges, corner)


def onto_held_curves(surface: Surface, corner: float = CORNER) -> Projection:
    """A function (k,3) → (k,3) that puts points near a surface's held edges on the smooth curves there.

    The curves of ``smooth_midpoints``, each edge cut into 256. All meshes made with one such function,
    by ``refine``, ``remesh`` or ``check_mesh``, have the same boundary.

    Examples
    --------
    >>> angle = 2 * np.pi * np.arange(12) / 12
    >>> rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> from pcmc import Patch
    >>> disc = Surface([[0, 0, 0], *rim], [[0, k + 1, (k + 1) % 12 + 1] for k in range(12)], [0] * 12,
    ...                [Patch("disc", 1.0)], fixed=range(1, 13))
    >>> float(np.linalg.norm(onto_held_curves(disc)(np.array([[0.95, 0.1, 0.0]]))).round(5))
    1.0
    """
    X, edges = surface.vertices, surface.topology.edges[held_midpoints(surface)[0]]
    if not len(edges):
        return lambda points: points
    for _ in range(HALVINGS):
        number = len(X) + np.arange(len(edges))
        X = np.concatenate([X, _smooth_middles(X, edges, corner)])
        edges = np.concatenate([np.stack([edges[:, 0], number], 1), np.stack([number, edges[:, 1]], 1)])
    start, side = X[edges[:, 0]], X[edges[:, 1]] - X[edges[:, 0]]
    tree = cKDTree(start + 0.5 * side)

    def project(points: Floats) -> Floats:
        near = tree.query(points, k=min(3, len(start)))[1].reshape(len(points), -1)
        away = points[:, None] - start[near]
        share = np.einsum("pnd,pnd->pn", away, side[near]) / np.einsum("pnd,pnd->pn", side[near], side[near])
        foot = start[near] + np.clip(share, 0.0, 1.0)[..., None] * side[near]
        nearest = np.linalg.norm(points[:, None] - foot, axis=2).argmin(axis=1)
        return np.asarray(foot[np.arange(len(points)), nearest])

    return project


def _smooth_middles(X: Floats, edges: Ints, corner: float) -> Floats:
    """(k,3) the middles of edges (k,2), moved onto the arcs over them."""
    middle = 0.5 * (X[edges[:, 0]] + X[edges[:, 1]])
    rise, arcs = np.zeros_like(middle), np.zeros(len(edges))
    edge, beyond = _continuations(X, edges, corner)
    np.add.at(rise, edge, _rises(X, edges[edge], beyond))
    np.add.at(arcs, edge, 1.0)
    return middle + rise / np.maximum(arcs, 1.0)[:, None]


def _continuations(X: Floats, edges: Ints, corner: float) -> tuple[Ints, Ints]:
    """Edges that go on beyond one of their ends, and the next vertex (c,) of the curve there."""
    vertex, other = edges.ravel(), edges[:, ::-1].ravel()
    order = np.argsort(vertex, kind="stable")
    vertex, other, edge = vertex[order], other[order], np.repeat(np.arange(len(edges)), 2)[order]
    out = X[other] - X[vertex]
    length = np.linalg.norm(out, axis=1)
    out /= np.where(length > 0.0, length, 1.0)[:, None]
    best, partner = np.full(len(vertex), np.cos(np.radians(corner))), np.full(len(vertex), -1)
    most = int(np.bincount(vertex).max(initial=0))
    for step in range(1, most):  # the n-th next half edge in the order, where it is at the same vertex
        first = np.flatnonzero(vertex[:-step] == vertex[step:])
        cosine = -np.einsum("ij,ij->i", out[first], out[first + step])
        for one, two in ((first, first + step), (first + step, first)):
            better = cosine > best[one]
            best[one[better]], partner[one[better]] = cosine[better], two[better]
    going_on = np.flatnonzero(partner >= 0)
    going_on = going_on[partner[partner[going_on]] == going_on]
    return edge[going_on], other[partner[going_on]]


def _rises(X: Floats, edges: Ints, beyond: Ints) -> Floats:
    """(c,3) from the middle of each edge to that of the arc through its ends and a vertex beyond one.

    With a, b the edge's ends, c the third point, ℓ = |b - a|: the circle has the curvature
    κ = 2 |(b - a) × (c - a)| / (|b - a| |c - b| |a - c|), the arc the height (1 - √(1 - κ²ℓ²/4)) / κ.
    """
    a, b, c = X[edges[:, 0]], X[edges[:, 1]], X[beyond]
    side = b - a
    length = np.linalg.norm(side, axis=1)
    inward = c - a - (np.einsum("ij,ij->i", c - a, side) / length**2)[:, None] * side
    depth = np.linalg.norm(inward, axis=1)
    curvature = 2.0 * depth / (np.linalg.norm(c - b, axis=1) * np.linalg.norm(c - a, axis=1))
    half = 0.5 * curvature * length
    height = 0.5 * length * half / (1.0 + np.sqrt(np.maximum(1.0 - half**2, 0.0)))
    height[height < STRAIGHT * length] = 0.0
    return -(height / np.where(depth > 0.0, depth, 1.0))[:, None] * inward
