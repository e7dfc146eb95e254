"""The bound of the factors' backward error: true, and large wherever diagonal pivoting has failed."""

import flint
import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from pcmc.stability.backward_error import backward_error


def factors(A: np.ndarray):
    return splu(csc_array(A), "NATURAL", 0.0, options={"SymmetricMode": True})


def adversarial(count: int = 300):
    """Symmetric 3×3 matrices with diagonals of 1e-25 to 1e-8: elimination without exchanges fails on many."""
    rng = np.random.default_rng(0)
    for _ in range(count):
        A = rng.normal(size=(3, 3))
        A = A + A.T
        A[np.diag_indices(3)] = 10.0 ** rng.uniform(-25, -8, 3) * rng.choice([-1, 1], 3)
        yield A


def test_every_wrong_inertia_is_refused():
    wrong = 0
    for A in adversarial():
        lu, values = factors(A), np.linalg.eigvalsh(A)
        assert np.array_equal(lu.perm_r, lu.perm_c)
        if (lu.U.diagonal() < 0).sum() != (values < 0).sum():
            wrong += 1
            assert backward_error(lu.L, lu.U) > np.abs(values).min()
    assert wrong > 50


def test_the_bound_holds_in_exact_arithmetic():
    exact = np.vectorize(lambda x: flint.fmpq(*float(x).as_integer_ratio()), otypes=[object])
    rng = np.random.default_rng(1)
    for size in (2, 5, 12):
        A = rng.normal(size=(size, size)) * (rng.random((size, size)) < 0.6)
        A = A + A.T + np.diag(rng.normal(size=size))
        lu = factors(A)
        L, D = exact(lu.L.toarray()), np.diag(exact(lu.U.diagonal()))
        left = exact(A[np.ix_(np.argsort(lu.perm_r), np.argsort(lu.perm_c))]) - L @ D @ L.T
        rows = [sum(abs(x) for x in row) for row in left]
        norm = float(max(rows))
        bound = backward_error(lu.L, lu.U)
        assert norm <= bound < 1e-12 * (1 + np.abs(lu.U.data).max() ** 2)


def test_factors_that_are_not_symmetric_count():
    """L U may be exact and L D Lᵀ another matrix: here they differ by 0.1 beside the diagonal."""
    lower, upper = csc_array([[1.0, 0.0], [0.5, 1.0]]), csc_array([[2.0, 1.1], [0.0, 3.0]])
    assert backward_error(lower, upper) >= 0.1
