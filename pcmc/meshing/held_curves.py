"""Smooth curves through held vertices: where the new vertices of a finer mesh belong.

A mesh stands for a curved boundary by a polygon. A finer mesh whose new vertices lie on the polygon's sides
is a mesh of another boundary; here they are put on a smooth curve through the polygon's corners.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..surface import Surface
from .refinement import CORNER, held_midpoints

STRAIGHT = 1e-9  # of the length of an edge: smaller rises of an arc over it count as none


def smooth_midpoints(surface: Surface, corner: float = CORNER, corners: Ints | None = None) -> Floats:
    """(k,3) places for the new held vertices of ``refine(surface)``, on smooth curves.

    Over each held edge stand two arcs, each through its ends and through the next vertex of the curve on
    one side. The new vertex lies half way between the middles of both arcs; beside a corner there is one
    arc, between two corners none. On circles and straight lines this is exact, whatever the lengths of
    the edges; on smooth curves its error is of order 4 for even edges, of order 3 for uneven ones.

    Parameters
    ----------
    corner : angle in degrees. A vertex where two held edges turn by more is a corner. Where several held
        edges meet, the two that turn least go on into each other.
    corners : vertices that are corners in any case.

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
    edges = held_edges(surface)
    rises, arcs = arcs_over(surface.vertices, edges, corner, corners)
    middle = surface.vertices[edges].mean(axis=1)
    return middle + rises.sum(axis=1) / np.maximum(arcs.sum(axis=1), 1.0)[:, None]


def curve_doubt(surface: Surface, corner: float = CORNER, corners: Ints | None = None) -> float:
    """How far ``smooth_midpoints`` may be from the curve that was meant, over the rises of the arcs.

    With r, s the rises of the two arcs over an edge, this is the mean of |r - s|² / |r + s|² over the held
    edges, weighted by |r + s|. It is 0 on circles and straight lines; on others it falls as the square of
    the edge length, as the error of ``smooth_midpoints`` does.

    >>> from pcmc import Patch
    >>> angle = 2 * np.pi * np.arange(24) / 24
    >>> rim = np.stack([2 * np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> plate = Surface([[0, 0, 0], *rim], [[0, k + 1, (k + 1) % 24 + 1] for k in range(24)], [0] * 24,
    ...                 [Patch("plate", 1.0)], fixed=range(1, 25))
    >>> round(curve_doubt(plate), 3)
    0.037
    """
    rises, arcs = arcs_over(surface.vertices, held_edges(surface), corner, corners)
    both = rises[arcs.all(axis=1)]
    total, apart = (np.linalg.norm(both[:, 0] + sign * both[:, 1], axis=1) for sign in (1.0, -1.0))
    share = np.divide(apart, total, out=np.ones_like(apart), where=total > apart)
    share[apart == 0.0] = 0.0
    return float(np.average(share**2, weights=total)) if total.any() else 0.0


def held_corners(surface: Surface, corner: float = CORNER) -> Ints:
    """Vertices (k,) of held edges at which none of these goes on into another one.

    On a finer mesh curves turn less at them. So that they stay corners there, keep their numbers.
    """
    edges = held_edges(surface)
    edge, end, _ = _continuations(surface.vertices, edges, corner)
    return np.setdiff1d(edges, edges[edge, end])


def held_edges(surface: Surface) -> Ints:
    """(e,2) the edges whose new vertices are held, but on no curve that was drawn."""
    guessed = held_midpoints(surface)[0] & ~surface.edges_on_curves.drawn
    return np.asarray(surface.topology.edges[guessed])


def arcs_over(X: Floats, edges: Ints, corner: float, corners: Ints | None) -> tuple[Floats, Bools]:
    """The rises (e,2,3) of the arcs over held edges (e,2), and which of the two there are (e,2)."""
    rises, arcs = np.zeros((len(edges), 2, 3)), np.zeros((len(edges), 2), dtype=bool)
    edge, end, beyond = _continuations(X, edges, corner)
    if corners is not None:
        smooth = ~np.isin(edges[edge, end], corners)
        edge, end, beyond = edge[smooth], end[smooth], beyond[smooth]
    rises[edge, end] = _rises(X, edges[edge], beyond)
    arcs[edge, end] = True
    return rises, arcs


def _continuations(X: Floats, edges: Ints, corner: float) -> tuple[Ints, Ints, Ints]:
    """Edges (c,) that go on beyond one of their ends, which end, and the next vertex of the curve there."""
    vertex, other = edges.ravel(), edges[:, ::-1].ravel()
    order = np.argsort(vertex, kind="stable")
    vertex, other = vertex[order], other[order]
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
    return order[going_on] // 2, order[going_on] % 2, other[partner[going_on]]


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
