"""A symmetric matrix bordered by the gradients of prescribed volumes."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats
from .factorisation import Factor


class BorderedFactor:
    """The inverse of [[A, -C], [Cᵀ, 0]], A factorised, C (N,r): by the Schur complement Cᵀ A⁻¹ C.

    It exists where A is singular along C alone, as at a fold in the pressure. Near there the factor of A
    loses digits, and the inverse is a preconditioner.

    Examples
    --------
    >>> from pcmc.forces.pattern import Pattern
    >>> from pcmc.stability.factorisation import factoriser
    >>> pattern = Pattern(np.array([0, 1, 2]), np.array([0, 1]), np.empty((0, 3)))
    >>> factor = factoriser(pattern, "superlu").factor(np.array([2.0, -1.0]))
    >>> BorderedFactor(factor, np.array([[1.0], [0.0]])).solve(np.array([0.0, 1.0, 3.0])).tolist()
    [3.0, -1.0, 6.0]
    """

    def __init__(self, factor: Factor, columns: Floats) -> None:
        self._factor, self._columns = factor, columns
        self._behind = factor.solve(columns)
        self._schur = np.linalg.pinv(columns.T @ self._behind)

    def solve(self, right: Floats) -> Floats:
        """(s, μ) (N+r,) with A s - C μ and Cᵀ s as given in ``right`` (N+r,)."""
        size = len(self._columns)
        s = self._factor.solve(right[:size])
        multipliers = self._schur @ (right[size:] - self._columns.T @ s)
        return np.append(s + self._behind @ multipliers, multipliers)
