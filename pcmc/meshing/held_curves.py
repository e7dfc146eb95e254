"""Smooth curves through held vertices: where the new vertices of a finer mesh belong.

A mesh stands for a curved boundary by a polygon. A finer mesh whose new vertices lie on the polygon's sides
is a mesh of another boundary; here they are put on a smooth curve through the polygon's corners.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints
from ..surface import Surface
from ..surface.geometry import CORNER
from .refinement import Projection, held_midpoints

HALVINGS = 8  # of each edge of a curve that points are projected onto
NEAREST = 3  # pieces of curve that are compared
STRAIGHT = 1e-9  # of the length of an edge: smaller rises of an arc over it count as none
COARSE = 80.0  # degrees: a smooth curve of few vertices turns by up to so much at one
SHARPER = 5.0  # times the turns beside it: where a curve turns by more at a vertex, that is a corner


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

    >>> from pcmc import Patch
    >>> angle = 2 * np.pi * np.arange(12) / 12
    >>> rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> disc = Surface([[0, 0, 0], *rim], [[0, k + 1, (k + 1) % 12 + 1] for k in range(12)], [0] * 12,
    ...                [Patch("disc", 1.0)], fixed=range(1, 13))
    >>> np.linalg.norm(smooth_midpoints(disc), axis=1).round(12).tolist() == [1.0] * 12
    True
    """
    X, edges = surface.vertices, held_edges(surface)
    return _middles(X, edges, *_arcs_over(X, edges, corner, corners))


def doubted_midpoints(surface: Surface, corners: Ints | None = None) -> list[Floats]:
    """(k,3) other places for the same vertices, about as far from those as the curve that was meant may be.

    Each lies nearer to the middle of its edge, or farther from it. With r, s the rises of the two arcs over
    an edge, r the smaller one, it moves by (r - s) |r - s| / |r + s|: of second order beside the rise, as is
    the error; but not beyond r, which it reaches where s is three times as high, as there may be a corner.
    Beside a corner that is known there is one arc, with the curvature at the edge's other end in place of its
    middle: an error of first order, half of what the arcs over the next edge differ by, to the scale of the
    edges; where that has no two arcs, all of the rise. Where a curve turns by more than CORNER, but not much
    more than at the next vertices on both sides, the corner itself is a guess: further places are those
    without such corners. Empty where nothing moves: on circles and lines.

    Parameters
    ----------
    corners : vertices that are known to be corners.

    >>> from pcmc import Patch
    >>> angle = 2 * np.pi * np.arange(24) / 24
    >>> rim = np.stack([2 * np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> plate = Surface([[0, 0, 0], *rim], [[0, k + 1, (k + 1) % 24 + 1] for k in range(24)], [0] * 24,
    ...                 [Patch("plate", 1.0)], fixed=range(1, 25))
    >>> [float(np.abs(np.hypot(*(x[:, :2] / [2, 1]).T) - 1).max().round(5))
    ...  for x in (smooth_midpoints(plate), *doubted_midpoints(plate))]
    [0.00067, 0.00104]
    """
    X, edges = surface.vertices, held_edges(surface)
    rises, arcs = _arcs_over(X, edges, CORNER, corners)
    two, one = arcs.all(axis=1), arcs[:, 0] != arcs[:, 1]
    square = ((X[edges[:, 1]] - X[edges[:, 0]]) ** 2).sum(axis=1)
    apart, heights = rises[:, 1] - rises[:, 0], np.linalg.norm(rises, axis=2)
    size, total = np.linalg.norm(apart, axis=1), np.linalg.norm(rises.sum(axis=1), axis=1)
    share = np.divide(size, total, out=np.full_like(size, 0.5), where=total > 2.0 * size)
    share = two * np.copysign(share, heights[:, 0] - heights[:, 1])
    moves = share[:, None] * apart
    change = np.full_like(X, np.nan)  # of s - r from a vertex on, over length²
    for end, sign in ((0, 1.0), (1, -1.0)):
        change[edges[two, end]] = sign * apart[two] / square[two, None]
    guess = -0.5 * square[one, None] * change[edges[one, arcs[one].argmax(axis=1)]]
    moves[one] = np.where(np.isnan(guess), -rises[one].sum(axis=1), guess)
    places = _middles(X, edges, rises, arcs)
    known = np.empty(0, int) if corners is None else corners
    smooth = np.setdiff1d(_doubtful_corners(X, edges), known)
    others = np.union1d(np.setdiff1d(held_corners(surface), smooth), known)
    without = _middles(X, edges, *_arcs_over(X, edges, COARSE, others)) - places
    without[~np.isin(edges, smooth).any(axis=1)] = 0.0
    return [places + m for m in (moves, without) if np.any((m**2).sum(axis=1) > STRAIGHT**2 * square)]


def onto_held_curves(surface: Surface, corners: Ints | None = None) -> Projection:
    """A function (k,3) → (k,3) that puts points near a surface's held edges on the smooth curves there.

    The curves are those of ``smooth_midpoints``, as are ``corners``, with each edge cut into 256. All meshes
    made with one such function, by ``refine``, ``remesh`` or ``check_mesh``, have the same boundary.

    >>> from pcmc import Patch
    >>> angle = 2 * np.pi * np.arange(12) / 12
    >>> rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> disc = Surface([[0, 0, 0], *rim], [[0, k + 1, (k + 1) % 12 + 1] for k in range(12)], [0] * 12,
    ...                [Patch("disc", 1.0)], fixed=range(1, 13))
    >>> float(np.linalg.norm(onto_held_curves(disc)(np.array([[0.95, 0.1, 0.0]]))).round(5))
    1.0
    """
    X, edges = surface.vertices, held_edges(surface)
    corners = np.union1d(held_corners(surface), np.empty(0, int) if corners is None else corners)
    for _ in range(HALVINGS):
        number = len(X) + np.arange(len(edges))
        X = np.concatenate([X, _middles(X, edges, *_arcs_over(X, edges, CORNER, corners))])
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


def held_corners(surface: Surface) -> Ints:
    """Vertices (k,) of held edges at which none of these goes on into another one.

    On a finer mesh curves turn less at them. So that they stay corners there, keep their numbers.
    """
    edges = held_edges(surface)
    edge, end, *_ = _continuations(surface.vertices, edges, CORNER)
    return np.setdiff1d(edges, edges[edge, end])


def held_edges(surface: Surface) -> Ints:
    """(e,2) the edges whose new vertices are held, but on no curve that was drawn."""
    guessed = held_midpoints(surface)[0] & ~surface.edges_on_curves.drawn
    return np.asarray(surface.topology.edges[guessed])


def _arcs_over(X: Floats, edges: Ints, corner: float, corners: Ints | None) -> tuple[Floats, Bools]:
    """The rises (e,2,3) of the arcs over held edges (e,2), and which of the two there are (e,2).

    With a, b an edge's ends, c the next vertex of the curve beyond one, ℓ = |b - a|: the circle has the
    curvature κ = 2 |(b - a) × (c - a)| / (ℓ |c - b| |a - c|), the arc the height (1 - √(1 - κ²ℓ²/4)) / κ.
    """
    rises, arcs = np.zeros((len(edges), 2, 3)), np.zeros((len(edges), 2), dtype=bool)
    edge, end, beyond, _ = _continuations(X, edges, corner)
    if corners is not None:
        smooth = ~np.isin(edges[edge, end], corners)
        edge, end, beyond = edge[smooth], end[smooth], beyond[smooth]
    a, b, c = *X[edges[edge].T], X[beyond]
    side = b - a
    length = np.linalg.norm(side, axis=1)
    inward = c - a - (np.einsum("ij,ij->i", c - a, side) / length**2)[:, None] * side
    depth = np.linalg.norm(inward, axis=1)
    curvature = 2.0 * depth / (np.linalg.norm(c - b, axis=1) * np.linalg.norm(c - a, axis=1))
    half = 0.5 * curvature * length
    height = 0.5 * length * half / (1.0 + np.sqrt(np.maximum(1.0 - half**2, 0.0)))
    height[height < STRAIGHT * length] = 0.0
    rises[edge, end] = -(height / np.where(depth > 0.0, depth, 1.0))[:, None] * inward
    arcs[edge, end] = True
    return rises, arcs


def _doubtful_corners(X: Floats, edges: Ints) -> Ints:
    """Vertices (k,) that are guessed to be corners, but may be on a smooth curve of long edges (e,2)."""
    edge, end, _, turn = _continuations(X, edges, COARSE)
    turns, vertex, beside = np.zeros((len(edges), 2)), edges[edge, end], np.full(len(X), np.inf)
    turns[edge, end] = turn
    np.minimum.at(beside, vertex, turns[edge, 1 - end])
    return np.unique(vertex[(turn > CORNER) & (turn <= SHARPER * beside[vertex])])


def _middles(X: Floats, edges: Ints, rises: Floats, arcs: Bools) -> Floats:
    """(e,3) half way between the middles of the arcs over edges (e,2)."""
    return np.asarray(X[edges].mean(axis=1) + rises.sum(axis=1) / np.maximum(arcs.sum(axis=1), 1.0)[:, None])


def _continuations(X: Floats, edges: Ints, corner: float) -> tuple[Ints, Ints, Ints, Floats]:
    """Edges (c,) that go on beyond an end, which end, the curve's next vertex there, its turn in degrees."""
    order = np.argsort(edges.ravel(), kind="stable")
    vertex, other = edges.ravel()[order], edges[:, ::-1].ravel()[order]
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
    turn = np.degrees(np.arccos(np.minimum(best[going_on], 1.0)))
    return order[going_on] // 2, order[going_on] % 2, other[partner[going_on]], turn
