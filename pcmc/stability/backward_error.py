"""How far SuperLU's factors L and U may be from the matrix: a bound that rounding cannot break.

Diagonal pivoting is fast and may fail in silence: a tiny pivot makes large factors, and the signs of the
pivots are then those of another matrix: of L D Lᵀ with D = diag(U), and

    A - L D Lᵀ  =  (A - L U)  +  L (U - D Lᵀ).

- Elimination in floating point, whatever the order of its sums, gives |A - L U|_ij ≤ γ_k (|L||U|)_ij with
  γ_k = k u / (1 - k u), u = 2⁻⁵³ and k the number of roundings on the way to an entry (Higham, Accuracy
  and Stability of Numerical Algorithms, 2nd ed., Theorem 9.3). The sum for entry (i,j) has at most as many
  products as column j of U has entries; 3 more for the reciprocal of the pivot, the product with it and
  the last subtraction.
- U and D Lᵀ would be equal without rounding. Their difference is computed; 2u (|U| + |D Lᵀ|) covers its
  rounding.
- A product that underflows is off by less than 2⁻¹⁰⁷⁴, in units of the pivot that it is divided by.

Both A and L D Lᵀ are symmetric, so the 2-norm of their difference is at most its largest row sum.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, csr_array

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled

Entries = tuple[Ints, Ints, Floats]  # of a sparse matrix: where each row or column begins, numbers, values
ROUNDING = 2.0**-53  # u: relative error of one operation
UNDERFLOW = float(np.finfo(float).tiny)  # 2⁻¹⁰²²: far more than one product loses to underflow


def backward_error(lower: csc_array, upper: csc_array) -> float:
    """An upper bound of ‖A - L D Lᵀ‖₂, D = diag(U), for the factors L U of a symmetric matrix A.

    ``lower`` and ``upper`` are those of SuperLU with row and column exchanges alike, A taken with these
    exchanges. If it is below the distance of A's spectrum from zero, D has as many negative entries as A has
    negative eigenvalues. Infinite where L or U is not finite.

    >>> from scipy.sparse.linalg import splu
    >>> def bound(a):
    ...     lu = splu(csc_array([[a, 1.0], [1.0, 0.0]]), "NATURAL", 0.0, options={"SymmetricMode": True})
    ...     return backward_error(lu.L, lu.U)
    >>> bound(1.0) < 1e-14, bound(1e-20) > 1.0  # the pivots 1e-20 and -1e20 tell nothing
    (True, True)
    """
    n = upper.shape[0]
    rows = csr_array(upper)
    rows.sort_indices()
    lower.sort_indices()
    if not (np.isfinite(rows.data).all() and np.isfinite(lower.data).all()):
        return np.inf
    terms = np.diff(upper.indptr) + 3.0
    gamma = terms * ROUNDING / (1.0 - terms * ROUNDING)
    sums, pivot = np.zeros(n), upper.diagonal()
    with np.errstate(over="ignore"):
        entries = [(part.indptr, part.indices, part.data) for part in (rows, lower)]
        _row_sums(entries[0], entries[1], gamma, sums)
        # all terms are positive: sums of n of them in three stages are off by γ_3n, relative
        lost = n * UNDERFLOW * (1.0 + np.abs(pivot).max(initial=0.0))
        return float((sums.max(initial=0.0) + lost) * (1.0 + 8.0 * (n + 8) * ROUNDING))


@compiled
def _row_sums(upper: Entries, lower: Entries, gamma: Floats, out: Floats) -> None:
    """out = |L| w, w_j = Σ_i γ_i |u_ji| + |u_ji - d_j l_ij| + rounding; indices sorted."""
    (u_start, u_column, u), (l_start, l_row, l) = upper, lower
    for j in range(len(out)):
        a, b, weight = u_start[j], l_start[j], 0.0
        pivot = u[a] if a < u_start[j + 1] and u_column[a] == j else 0.0
        while a < u_start[j + 1] or b < l_start[j + 1]:
            at_u = u_column[a] if a < u_start[j + 1] else len(out)
            at_l = l_row[b] if b < l_start[j + 1] else len(out)
            of_u, of_l = 0.0, 0.0
            if at_u <= at_l:
                of_u = u[a]
                a += 1
            if at_l <= at_u:
                of_l = pivot * l[b]
                b += 1
            weight += gamma[min(at_u, at_l)] * abs(of_u) + abs(of_u - of_l)
            weight += 2.0 * ROUNDING * (abs(of_u) + abs(of_l))
        for b in range(l_start[j], l_start[j + 1]):
            out[l_row[b]] += abs(l[b]) * weight
