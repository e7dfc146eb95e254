"""The inertia of a matrix from pivots on its diagonal, guarded: a tiny pivot may make signs wrong in silence.

SuperLU keeps pivots on the diagonal and gives P A Pᵀ ≈ L U. The signs of D = diag(U) are the inertia of
L D Lᵀ (Sylvester), which rounding sets far apart from A where a pivot is small beside its column. Both have
the same inertia if no matrix between them is singular: with M = I - A (L D Lᵀ)⁻¹ the matrices
(I - t M) L D Lᵀ, t from 0 to 1, are regular while ‖M‖ < 1. That is, if refinement by L D Lᵀ converges.

``M b`` for b with standard normal entries costs one pass over L, one over Lᵀ and a product with A. If
‖M‖ ≥ 1, then ‖M b‖ ≥ |g|, g the part of b along the strongest input of M, a standard normal number: the
chance that ‖M b‖ < 1e-6 all the same is 8e-7. Where one b does not pass, eight with ‖M b‖ < 0.05 must:
chance 6e-12. The vectors are always the same. This is a guard; a theorem is what ``pcmc.verify`` gives.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled

ZERO = 1e-13  # of the largest entry: a pivot below is zero to rounding
TRIALS = ((1, 1e-6), (8, 0.05))  # vectors b, and the largest ‖M b‖ that passes
GROWTH = 1e4  # entries of a column of L from which its pivot is too small
MOST = 32  # pivots that are strengthened at once
CLOSE = 1e-9  # of the largest: a smaller eigenvalue of the correction has no certain sign


class SingularMatrix(ArithmeticError):
    """A pivot is zero: the matrix has no factorisation, or none that shows its inertia."""


def count_negative(matrix: csc_array, lu: Any, factorise: Callable[[csc_array], Any]) -> int:
    """Number of negative eigenvalues of a symmetric matrix A with the factors ``lu``, made by ``factorise``.

    Where its pivots are refused, those too small are strengthened: B = A + C Σ Cᵀ with C = (√|δ_i| e_i)
    and Σ = diag(sign δ_i), |δ_i| twice the sum of row i, so that its pivot dominates. Haynsworth's rule on
    [[B, C], [Cᵀ, Σ]], whose Schur complements are A and Σ - CᵀB⁻¹C, takes that back:
    neg A = neg B + neg(Σ - CᵀB⁻¹C) - neg Σ.

    SingularMatrix if the inertia cannot be told, also with stronger pivots.

    >>> from scipy.sparse.linalg import splu
    >>> def factorise(matrix):
    ...     return splu(matrix, "NATURAL", 0.0, options={"SymmetricMode": True})
    >>> matrix = csc_array([[1e-20, 1.0, 1.0], [1.0, 2.0, 0.0], [1.0, 0.0, -1.0]])  # pivots 1e-20, -1e20, 0
    >>> count_negative(matrix, factorise(matrix), factorise)
    1
    """
    reason = _doubt(matrix, lu)
    if not reason:
        return int(np.count_nonzero(lu.U.diagonal() < 0.0))
    weak, now = np.empty(0, dtype=np.int64), lu
    for _ in range(3):  # a pivot may turn out too small only after others before it are stronger
        largest = np.abs(now.L).max(axis=0).toarray().ravel()  # far more than the pivot, or it was exchanged
        small = (largest[now.perm_c] > GROWTH) | (now.perm_r != now.perm_c)
        weak = np.union1d(weak, np.flatnonzero(small))
        if not 0 < len(weak) <= MOST:
            break
        entries = matrix[:, weak].toarray()
        sign = np.where(entries[weak, np.arange(len(weak))] < 0.0, -1.0, 1.0)
        delta = 2.0 * sign * np.abs(entries).sum(axis=0)
        stronger = csc_array(matrix + csc_array((delta, (weak, weak)), matrix.shape))
        try:
            now = factorise(stronger)
        except RuntimeError:
            break
        if not _doubt(stronger, now):
            columns = np.zeros((now.shape[0], len(weak)))
            columns[weak, np.arange(len(weak))] = np.sqrt(np.abs(delta))
            small = np.diag(np.sign(delta)) - columns.T @ now.solve(columns)
            values = np.linalg.eigvalsh(0.5 * (small + small.T))
            if np.abs(values).min() <= CLOSE * max(1.0, np.abs(values).max()):
                raise SingularMatrix(reason)
            of_b, of_small, of_sigma = (int((x < 0.0).sum()) for x in (now.U.diagonal(), values, delta))
            return of_b + of_small - of_sigma
    raise SingularMatrix(reason)


def _doubt(matrix: csc_array, lu: Any) -> str:
    """Why the signs of the pivots may not be the inertia of the matrix; empty if they are."""
    if not np.array_equal(lu.perm_r, lu.perm_c):
        return "a zero pivot forced a row exchange, so the inertia is unknown"
    pivots = lu.U.diagonal()
    if zero := int(np.count_nonzero(np.abs(pivots) < ZERO * np.abs(matrix.data).max(initial=0.0))):
        return f"{zero} pivots are zero to rounding"
    random, y = np.random.default_rng(1), np.empty(matrix.shape[0])
    for count, most in TRIALS:
        left = []
        for b in random.standard_normal((count, len(y))):
            y[lu.perm_c] = b
            _solve(lu.L.indptr, lu.L.indices, lu.L.data, pivots, y)
            left.append(np.linalg.norm(b - matrix @ y[lu.perm_c]))
        if np.max(left) < most:
            return ""
    return f"small pivots have spoiled the factors (refinement leaves {np.max(left):.0e}): inertia unknown"


@compiled
def _solve(start: Ints, row: Ints, entry: Floats, pivots: Floats, x: Floats) -> None:
    """Make of x (N,) the solution y of L D Lᵀ y = x, L with its unit diagonal by columns."""
    for j in range(len(x)):
        value = x[j]
        for p in range(start[j], start[j + 1]):
            x[row[p]] -= entry[p] * value
        x[j] = value
    for j in range(len(x) - 1, -1, -1):
        value = x[j] / pivots[j]
        x[j] = 0.0
        for p in range(start[j], start[j + 1]):
            value -= entry[p] * x[row[p]]
        x[j] = value
