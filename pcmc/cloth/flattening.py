"""Strips of cloth laid flat with the least strain, the two sides of every seam equally long."""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy.sparse import csr_array, vstack
from scipy.sparse.linalg import splu

from ..base.arrays import Floats, Ints, block_rows
from ..surface.geometry import edge_vectors, face_areas, segment_lengths

SEAM_WEIGHT = 1e3  # of a seam's misfit beside the strain: squared, so that seams are equal to about 1e-9
ROUNDS, SMALL_STEP = 50, 1e-10  # of the descent; a last step, in the size
FOLDED = 1e6  # the strain of a triangle laid on its back
SHORTEST = 1e-4  # part of a step that is still tried


def flattened(
    X: Floats, F: Ints, strip: Ints, seams: Ints, stretch: Floats, start: Floats | None = None
) -> tuple[Floats, Floats]:
    """Strips F (m,3) with vertices X (u,3) laid flat: points (u,2), as they are before compensation; and the
    least and largest principal strain of the cloth in each triangle on the roof (m,2).

    With J the map from a triangle of the roof to the flat one, E = ½ (JᵀJ - I) and the cut lengths l of the
    sides of a seam, which is L long on the roof, the sum Σ A |E|² + W² Σ L² ((l₁² - l₂²) / 2L²)² is least:
    Gauss-Newton steps from a conformal map. So strips in which a strain cannot be avoided share it, and the
    sides of a seam are equally long whatever the strips beside them.

    Parameters
    ----------
    strip : (u,) the strip of each vertex.
    seams : (2,s,2) edges; those of one half are sewn to those of the other.
    stretch : (u,2) cut length over flat length along x, the warp, and along y, for each vertex.
    start : (u,2) points to begin with; one point of each strip and a direction stay as they are.

    >>> X = np.array([[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0.0]])
    >>> F, none = np.array([[0, 1, 2], [0, 2, 3]]), np.empty((2, 0, 2), dtype=int)
    >>> flat, strain = flattened(X, F, np.zeros(4, dtype=int), none, np.ones((4, 2)))
    >>> flat.round(9).tolist(), bool(abs(strain).max() < 1e-9)
    ([[0.0, 0.0], [1.8, -2.4], [5.0, 0.0], [3.2, 2.4]], True)
    """
    pins, places = _pins(X, strip)
    gradient, root = _gradients(X[F]), np.sqrt(face_areas(X[F]))
    y = _conformal(F, gradient, root, pins, places, len(X)) if start is None else start
    free = np.ones(2 * len(X), dtype=bool)
    free[pins] = False
    free[pins[2::4]] = True  # the second point may move along x
    lengths = segment_lengths(X, seams[0])
    misfit = partial(
        _misfit, F=F, gradient=gradient, root=root, seams=seams, lengths=lengths, stretch=stretch
    )
    residual, jacobian = misfit(y)
    size = float(np.ptp(X, axis=0).max())
    for _ in range(ROUNDS):
        step = np.zeros(len(free))
        step[free] = _least_squares(jacobian[:, free], -residual)
        part, before = 1.0, float(residual @ residual)
        while True:
            moved = y + part * step.reshape(-1, 2)
            residual, jacobian = misfit(moved)
            if residual @ residual <= before or part < SHORTEST:
                break
            part *= 0.5
        y = moved
        if np.abs(part * step).max() <= SMALL_STEP * size:
            break
    J = _jacobians(y, F, gradient)
    sigma = np.linalg.svd(J)[1]
    sigma[np.linalg.det(J) <= 0.0, 1] = 1.0 / (1.0 + FOLDED)  # laid on its back
    return y, 1.0 / sigma - 1.0


def _least_squares(J: csr_array, right: Floats) -> Floats:
    """The x with the least |J x - right|."""
    factor = splu((J.T @ J).tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    return np.asarray(factor.solve(J.T @ right))


def _pins(X: Floats, strip: Ints) -> tuple[Ints, Floats]:
    """(4 k,) for each strip the places in a vector 2 u of x, y, x, y of two far points; their values."""
    pins, places = [], []
    order = np.argsort(strip, kind="stable")
    for mine in np.split(order, np.flatnonzero(np.diff(strip[order])) + 1):
        first = mine[np.linalg.norm(X[mine] - X[mine].mean(axis=0), axis=1).argmax()]
        away = np.linalg.norm(X[mine] - X[first], axis=1)
        ends = sorted((first, mine[away.argmax()]))
        pins += [2 * ends[0], 2 * ends[0] + 1, 2 * ends[1], 2 * ends[1] + 1]
        places += [0.0, 0.0, away.max(), 0.0]
    return np.array(pins), np.array(places)


def _gradients(P: Floats) -> Floats:
    """(m,2,3) the gradient of a linear function in each triangle from its values at the corners."""
    a, b = edge_vectors(P)[:, 2], -edge_vectors(P)[:, 1]
    length = np.linalg.norm(a, axis=1)
    x = np.einsum("ij,ij->i", a, b) / length
    y = 2.0 * face_areas(P) / length
    D = np.zeros((len(P), 2, 3))
    D[:, 0, 1], D[:, 0, 0] = 1.0 / length, -1.0 / length
    D[:, 1, 2], D[:, 1, 1] = 1.0 / y, -x / (length * y)
    D[:, 1, 0] = -D[:, 1, 1:].sum(axis=1)
    return D


def _jacobians(y: Floats, F: Ints, gradient: Floats) -> Floats:
    """(m,2,2) the map from each triangle of the roof to the flat one."""
    return np.einsum("mci,mjc->mij", y[F], gradient)


def _conformal(F: Ints, gradient: Floats, root: Floats, pins: Ints, places: Floats, count: int) -> Floats:
    """(u,2) the map with the least Σ A ((xₛ - yₜ)² + (xₜ + yₛ)²) that takes the pins to their places."""
    (g, h), w = gradient.transpose(1, 0, 2), root[:, None]
    rows = np.stack([np.stack([w * g, -w * h], axis=2), np.stack([w * h, w * g], axis=2)], axis=2)
    A = block_rows(rows, F, count)
    y, free = np.zeros(2 * count), np.ones(2 * count, dtype=bool)
    y[pins], free[pins] = places, False
    y[free] = _least_squares(A[:, free], -(A @ y))
    return y.reshape(-1, 2)


def _misfit(
    y: Floats, F: Ints, gradient: Floats, root: Floats, seams: Ints, lengths: Floats, stretch: Floats
) -> tuple[Floats, csr_array]:
    """The residual whose squares are summed, and its Jacobian: 3 rows by triangle, one by edge of a seam."""
    J = _jacobians(y, F, gradient)
    E = 0.5 * (np.einsum("mki,mkj->mij", J, J) - np.eye(2))
    strain = np.stack([E[:, 0, 0], E[:, 1, 1], np.sqrt(2.0) * E[:, 0, 1]], axis=1) * root[:, None]
    # dE_ij = ½ (dJ_ki J_kj + J_ki dJ_kj), dJ_ki = dy_ck gradient_ic
    half = 0.5 * np.einsum("mic,mkj->mcijk", gradient, J)
    rate = half + half.transpose(0, 1, 3, 2, 4)
    rows = np.stack([rate[:, :, 0, 0], rate[:, :, 1, 1], np.sqrt(2.0) * rate[:, :, 0, 1]], axis=2)
    rows *= root[:, None, None, None]
    cut = stretch[seams[..., 0]] * (y[seams[..., 1]] - y[seams[..., 0]])  # (2,s,2)
    weight = SEAM_WEIGHT / lengths
    squares = 0.5 * (cut * cut).sum(axis=2)
    slopes = weight[:, None] * cut * stretch[seams[..., 0]] * np.array([1.0, -1.0])[:, None, None]
    ends = np.stack([-slopes[0], slopes[0], -slopes[1], slopes[1]], axis=1)[:, :, None]
    sewn = block_rows(ends, np.concatenate([*seams], axis=1), len(y))
    residual = np.append(strain, weight * (squares[0] - squares[1]))
    return residual, vstack([block_rows(rows, F, len(y)), sewn]).tocsr()
