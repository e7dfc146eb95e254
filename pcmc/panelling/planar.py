"""Planar polygons: how planar they are, how they are made so, and beams between node axes without torsion."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse import csc_array, csr_array, eye_array, vstack
from scipy.sparse.linalg import splu

from ..base.arrays import Bools, Floats, Ints, block_rows
from ..surface.geometry import cross_2d, unit_vectors

STEPS = 25  # of Gauss-Newton
FLAT = 1e-7  # of the mean edge: the motion of a step at which it ends
HOLD, DAMPING = 5e-4, 1e-3  # of the way from the first place, and of each step; planarity has weight 1
WARPED = 1e-2  # the planarity of polygons that are not made planar
BENT = np.sin(np.radians(1.0))  # a corner that turns inwards by less is straight
NEAR_NORMAL = 1e-3  # weight of an axis' distance from the normal; parallel edges have weight 1


def by_corners(start: Ints, corner: Ints) -> Iterator[tuple[Ints, Ints]]:
    """The polygons with 3, 4, … corners: their numbers (p,) and nodes (p,k)."""
    count = np.diff(start)
    for k in np.unique(count):
        chosen = np.flatnonzero(count == k)
        yield chosen, corner[start[chosen][:, None] + np.arange(k)]


def before(start: Ints) -> Ints:
    """(k,) the place of the corner before each corner, around its polygon.

    >>> before(np.array([0, 3, 7])).tolist()
    [2, 0, 1, 6, 3, 4, 5]
    """
    places = np.arange(start[-1]) - 1
    places[start[:-1]] = start[1:] - 1
    return places


def middles(P: Floats, start: Ints, corner: Ints) -> Floats:
    """(p,3) the means of the corners of polygons."""
    return np.add.reduceat(P[corner], start[:-1]) / np.diff(start)[:, None]


def polygon_areas(P: Floats, start: Ints, corner: Ints) -> Floats:
    """(p,) areas of polygons of nodes P (n,3), length²; of a warped one, seen along its mean normal.

    >>> P = np.array([[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0.0]])
    >>> polygon_areas(P, np.array([0, 4]), np.arange(4)).tolist()
    [6.0]
    """
    Q = P[corner] - np.repeat(P[corner[start[:-1]]], np.diff(start), axis=0)
    return 0.5 * np.linalg.norm(np.add.reduceat(np.cross(Q[before(start)], Q), start[:-1]), axis=1)


def planarity(P: Floats, start: Ints, corner: Ints) -> Floats:
    """(p,) of polygons of nodes P (n,3): 0 if planar.

    The distance between the diagonals of a quad over their mean length; with more corners, the range of the
    corners' heights over the plane of best fit, over the mean length of the diagonals.

    >>> P = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.2]])
    >>> planarity(P, np.array([0, 4]), np.arange(4)).round(4).tolist()
    [0.0697]
    """
    out = np.zeros(len(start) - 1)
    for chosen, nodes in by_corners(start, corner):
        Q, k = P[nodes], nodes.shape[1]
        if k == 4:
            one, other = Q[:, 2] - Q[:, 0], Q[:, 3] - Q[:, 1]
            normal = np.cross(one, other)
            gap = np.abs(np.einsum("pi,pi->p", normal, Q[:, 1] - Q[:, 0])) / np.linalg.norm(normal, axis=1)
            out[chosen] = 2.0 * gap / (np.linalg.norm(one, axis=1) + np.linalg.norm(other, axis=1))
        elif k > 4:
            height = _planes(Q)[1]
            i, j = np.triu_indices(k, 2)
            i, j = i[(i > 0) | (j < k - 1)], j[(i > 0) | (j < k - 1)]
            out[chosen] = np.ptp(height, axis=1) / np.linalg.norm(Q[:, i] - Q[:, j], axis=2).mean(axis=1)
    return out


def convex(P: Floats, start: Ints, corner: Ints) -> Bools:
    """(p,) whether each polygon of nodes P (n,3) turns the same way at every corner, to a degree.

    >>> P = np.array([[0, 0, 0], [1, 0, 0], [0.2, 0.2, 0], [0, 1, 0.0]])
    >>> convex(P, np.array([0, 4]), np.arange(4)).tolist()
    [False]
    """
    out = np.ones(len(start) - 1, dtype=bool)
    for chosen, nodes in by_corners(start, corner):
        side = unit_vectors(np.roll(P[nodes], -1, axis=1) - P[nodes])
        turn = np.cross(np.roll(side, 1, axis=1), side)
        mean = unit_vectors(turn.sum(axis=1))
        out[chosen] = (np.einsum("pki,pi->pk", turn, mean) > -BENT).all(axis=1)
    return out


def laid_flat_polygons(P: Floats, start: Ints, corner: Ints) -> tuple[list[Floats], Floats]:
    """Each polygon (k,2) in its plane of best fit, outside up, its longest edge level; and the largest
    distance of a corner from that plane (p,), length.

    >>> P = np.array([[0, 0, 1], [0, 4, 1], [0, 4, 3], [0, 0, 3.0]])
    >>> flat, warp = laid_flat_polygons(P, np.array([0, 4]), np.arange(4))
    >>> (flat[0].round(9) + 0.0).tolist(), warp.round(9).tolist()
    ([[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]], [0.0])
    """
    flat: list[Floats] = [np.empty(0)] * (len(start) - 1)
    warp = np.zeros(len(flat))
    for chosen, nodes in by_corners(start, corner):
        _, height, place = _planes(P[nodes])
        warp[chosen] = np.abs(height).max(axis=1)
        place[..., 1] *= np.sign(cross_2d(place, np.roll(place, -1, axis=1)).sum(axis=1))[:, None]
        for k, Q in zip(chosen.tolist(), place, strict=True):
            sides = np.roll(Q, -1, axis=0) - Q
            first = int(np.linalg.norm(sides, axis=1).argmax())
            x, y = sides[first] / np.linalg.norm(sides[first])
            flat[k] = (Q - Q[first]) @ np.array([[x, -y], [y, x]])
    return flat, warp


def planarised(P: Floats, start: Ints, corner: Ints, moves: Bools) -> Floats:
    """Nodes P (n,3) moved until the polygons are planar; only those in the mask (n,) move. First as far as
    the nodes stay near their places. Polygons that are still ``WARPED`` are then left: they would draw others
    far away. The rest is made planar to ``FLAT``."""
    near, count = _gauss_newton(P, start, corner, moves, HOLD), np.diff(start)
    rest = planarity(near, start, corner) < WARPED
    begins = np.append(0, np.cumsum(count[rest]))
    return _gauss_newton(near, begins, corner[np.repeat(rest, count)], moves, 0.0)


def _gauss_newton(P: Floats, start: Ints, corner: Ints, moves: Bools, hold: float) -> Floats:
    """The least of Σ|r|² + hold |P - P₀|². With z the heights of a polygon's corners over its plane of best
    fit, r is the part of z that no other plane takes up, and its derivative exact where z = 0."""
    n, first_place, size = len(P), P, np.linalg.norm(P[corner[1:]] - P[corner[:-1]], axis=1).mean()
    free = np.flatnonzero(np.repeat(moves, 3))
    for _ in range(STEPS):
        rows, residuals = [], []
        for _, nodes in (group for group in by_corners(start, corner) if group[1].shape[1] > 3):
            normal, height, flat = _planes(P[nodes])
            A = np.concatenate([np.ones((*nodes.shape, 1)), flat], axis=2)
            rest = np.eye(nodes.shape[1]) - A @ np.linalg.pinv(A)
            residuals.append(np.einsum("pij,pj->pi", rest, height).ravel())
            rows.append(block_rows(rest.transpose(0, 2, 1)[..., None] * normal[:, None, None], nodes, n))
        if not rows:
            return P
        J = csr_array(vstack(rows))[:, free]
        slope = J.T @ np.concatenate(residuals) + hold * (P - first_place).ravel()[free]
        step = np.zeros(3 * n)
        step[free] = -splu(csc_array(J.T @ J + (hold + DAMPING) * eye_array(len(free)))).solve(slope)
        P = P + step.reshape(-1, 3)
        if np.abs(step).max() < FLAT * size:
            break
    return P


def torsion_free_axes(P: Floats, edges: Ints, normals: Floats) -> Floats:
    """(n,3) an axis of each node, so that P + d·axis has edges as parallel to those of P as can be. Where
    they are parallel, the beam between two nodes is plane: it has no torsion. The least squares of (a_j -
    a_i) × e over the edges, with e their unit vectors, near the unit ``normals`` (n,3)."""
    e = unit_vectors(P[edges[:, 1]] - P[edges[:, 0]])
    across = np.cross(np.eye(3), e[:, None]).transpose(0, 2, 1)  # times a is a × e
    M = block_rows(np.stack([-across, across], axis=1), edges, len(P))
    system = csc_array(M.T @ M + NEAR_NORMAL * eye_array(3 * len(P)))
    return np.asarray(splu(system).solve(NEAR_NORMAL * normals.ravel())).reshape(-1, 3)


def torsion(P: Floats, edges: Ints, axes: Floats) -> Floats:
    """(e,) degrees: the angle between the planes through an edge and the axes at its ends.

    >>> P, axes = np.array([[0, 0, 0], [1, 0, 0.0]]), np.array([[0, 0, 1], [0, 1, 1.0]])
    >>> torsion(P, np.array([[0, 1]]), axes).round(9).tolist()
    [45.0]
    """
    e = P[edges[:, 1]] - P[edges[:, 0]]
    one, other = (np.cross(e, axes[edges[:, end]]) for end in range(2))
    sine = np.linalg.norm(np.cross(one, other), axis=1)
    return np.asarray(np.degrees(np.arctan2(sine, np.einsum("ij,ij->i", one, other))))


def _planes(Q: Floats) -> tuple[Floats, Floats, Floats]:
    """Of polygons (p,k,3): the unit normals of the planes of best fit, heights over them, places in them."""
    centred = Q - Q.mean(axis=1, keepdims=True)
    axes = np.linalg.svd(centred, full_matrices=True)[2]
    normal = axes[:, 2]
    return normal, np.einsum("pki,pi->pk", centred, normal), np.einsum("pki,pai->pka", centred, axes[:, :2])
