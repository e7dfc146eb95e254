"""Bordered systems: rooms of prescribed volume, or the parameter of a branch, beside an equilibrium.

J, the derivative of the forces, is applied and not assembled; a factorisation of A = Bᵀ(∂²E)B in its place
preconditions GMRES. Where J is singular, as at a fold, the bordered matrix is not (Govaerts 2000, ch. 3).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from ..base.arrays import Floats
from .factorisation import TINY, Factor, Linear, SingularMatrix

CLOSE = 1e-12  # cosine of Q and A⁻¹Q: below, rounding may have chosen its sign


class BorderedFactor:
    """The inverse of [[A, P], [Q, D]], P (N,k), Q (k,N), by that of A and the Schur complement D - Q A⁻¹ P.

    It exists where A is singular along P alone. Near there the factor of A loses digits, and the inverse is a
    preconditioner.

    >>> P = np.array([[1.0], [0.0]])
    >>> inner = lambda right: (right.T / [2.0, -1.0]).T
    >>> BorderedFactor(inner, -P, P.T).solve(np.array([0.0, 1.0, 3.0])).tolist()
    [3.0, -1.0, 6.0]
    """

    def __init__(self, inner: Linear, columns: Floats, rows: Floats, corner: float = 0.0) -> None:
        self._inner, self._rows, self._behind = inner, rows, inner(columns)
        self.schur = corner - rows @ self._behind  # (k,k)

    @cached_property
    def _small(self) -> Floats:
        return np.asarray(np.linalg.pinv(self.schur), dtype=np.float64)

    def solve(self, right: Floats) -> Floats:
        """(s, μ) (N+k,) with A s + P μ and Q s + D μ as given in ``right``, or several of them (N+k,j)."""
        size = len(self._behind)
        s = self._inner(right[:size])
        multipliers = self._small @ (right[size:] - self._rows @ s)
        return np.concatenate([s - self._behind @ multipliers, multipliers])


def across(inner: Linear, Q: Floats) -> Linear:
    """The inverse of A across columns Q (N,k): y with A y - b in their span, and Qᵀ y = 0."""
    if not Q.shape[1]:
        return inner
    behind = inner(Q)

    def solve(right: Floats) -> Floats:
        y = inner(right)
        return np.asarray(y - behind @ np.linalg.solve(Q.T @ behind, Q.T @ y))

    return solve


def solve_preconditioned(
    times: Linear, inverse: Linear, right: Floats, accuracy: float, *, restart: int, cycles: int = 1
) -> tuple[Floats, list[float]]:
    """z with ``times(z)`` = right (N,) to a relative accuracy, by GMRES, and the residual after each step:
    that of ``inverse(times(z))``, over the norm of ``right``."""
    residuals: list[float] = []
    shape = len(right), len(right)
    z, _ = gmres(
        LinearOperator(shape, times, dtype=float),
        right,
        M=LinearOperator(shape, inverse, dtype=float),
        rtol=accuracy,
        restart=restart,
        maxiter=cycles,
        callback=residuals.append,
        callback_type="pr_norm",
    )
    return z, residuals


def negatives_without(factor: Factor, columns: Floats) -> int:
    """Negative eigenvalues on the complement of the columns (N,k).

    Haynsworth: the bordered matrix [[A, Q], [Qᵀ, 0]] has the inertia of A restricted to the
    complement plus (k, k), and that of A plus that of -QᵀA⁻¹Q. SingularMatrix if rounding hides one of these.
    """
    k = columns.shape[1]
    if not k:
        return factor.negative
    solved = factor.solve(columns)
    # a rigid motion costs nothing, so its entries are far larger than those of a volume
    size = np.sqrt(np.linalg.norm(solved, axis=0)) + TINY
    small = (columns.T @ solved) / np.outer(size, size)
    values = np.linalg.eigvalsh(0.5 * (small + small.T))
    if not np.abs(values).min() > CLOSE:
        raise SingularMatrix("the second variation is singular among the motions that keep the volumes")
    return factor.negative + int((values > 0.0).sum()) - k
