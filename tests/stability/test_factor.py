"""Sparse factorisation with inertia: every backend against dense linear algebra."""

import gc
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from motion_cases import SURFACES
from nightly import at_night
from refusals import refused
from scipy.sparse import csr_array

from pcmc.base.errors import MissingExtra, OptionError, PcmcError
from pcmc.forces.motion_space import motion_space, vertex_classes
from pcmc.forces.pattern import Pattern, hessian_pattern
from pcmc.forces.second_variation import assemble
from pcmc.stability import factorisation as factor
from pcmc.stability.factorisation import SingularMatrix, factoriser, installed

BACKENDS = [
    pytest.param(name, marks=pytest.mark.skipif(name not in installed(), reason=f"[fast] installs {name}"))
    for name in factor.BACKENDS
]
every_backend = pytest.mark.parametrize("backend", BACKENDS)


def upper(A):
    """The pattern (with every diagonal entry) and values of a symmetric matrix's upper triangle."""
    rows, columns = np.nonzero(np.triu(A) + np.eye(len(A)))
    pattern = csr_array((np.ones(len(rows)), (rows, columns)), shape=A.shape)
    return Pattern(pattern.indptr, pattern.indices, np.empty((0, 3))), A[rows, columns].astype(float)


def random_symmetric(size, seed):
    random = np.random.default_rng(seed)
    A = np.where(random.random((size, size)) < 4 / size, random.standard_normal((size, size)), 0.0)
    return A + A.T + np.diag(3.0 * random.standard_normal(size))


def assembled(name):
    surface = SURFACES[name]()
    classes = vertex_classes(surface)
    space = motion_space(surface, classes, surface.vertices)
    pattern = hessian_pattern(classes, space)
    return pattern, assemble(surface, classes, space, pattern, surface.vertices)


def dense(pattern, data):
    U = pattern.matrix(data).toarray()
    return U + np.triu(U, 1).T


@every_backend
@pytest.mark.parametrize("seed", range(4))
def test_solutions_and_inertia_of_random_matrices(backend, seed):
    A = random_symmetric(60, seed)
    pattern, data = upper(A)
    found = factoriser(pattern, backend).factor(data)
    values = np.linalg.eigvalsh(A)
    assert found.negative == (values < 0).sum()
    assert 0 < found.negative < 60
    right = np.random.default_rng(seed).standard_normal((60, 3))
    scale = np.linalg.cond(A) * 1e-13
    np.testing.assert_allclose(found.solve(right), np.linalg.solve(A, right), atol=scale)
    np.testing.assert_allclose(found.solve(right[:, 0]), np.linalg.solve(A, right[:, 0]), atol=scale)


@every_backend
@pytest.mark.parametrize("name", ["three patches, tilted", "tent", "pyramid"])
def test_solutions_and_inertia_of_hessians(backend, name):
    pattern, data = assembled(name)
    A = dense(pattern, data)
    found = factoriser(pattern, backend).factor(data)
    assert found.negative == (np.linalg.eigvalsh(A) < 0).sum()
    right = np.cos(np.arange(len(A)))
    assert np.linalg.norm(A @ found.solve(right) - right) < 1e-11 * np.linalg.norm(right)


@every_backend
def test_new_values_in_the_same_pattern(backend):
    pattern, data = assembled("three patches")
    solver = factoriser(pattern, backend)
    right = np.ones(pattern.size)
    for scale in (1.0, 2.0, -1.0):
        found = solver.factor(scale * data)
        A = dense(pattern, scale * data)
        assert found.negative == (np.linalg.eigvalsh(A) < 0).sum()
        np.testing.assert_allclose(A @ found.solve(right), right, atol=1e-10)


@every_backend
def test_several_factorisers_live_side_by_side(backend):
    first, second = factoriser(*_one(2.0, backend)), factoriser(*_one(4.0, backend))
    two, four = first.factor(np.array([2.0])), second.factor(np.array([4.0]))
    del second
    assert two.solve(np.array([1.0])) == pytest.approx([0.5])
    assert four.solve(np.array([1.0])) == pytest.approx([0.25])


def _one(value, backend):
    return upper(np.array([[value]]))[0], backend


@every_backend
@pytest.mark.parametrize(
    "A", [np.zeros((3, 3)), np.ones((3, 3)), np.diag([1.0, 0.0, 2.0])], ids=["zero", "rank 1", "row"]
)
def test_a_singular_matrix_is_refused(backend, A):
    pattern, data = upper(A)
    with pytest.raises(SingularMatrix):
        factoriser(pattern, backend).factor(data)


@every_backend
@pytest.mark.parametrize("unit", [1e-20, 1e-8, 1.0, 1e8, 1e20])
def test_what_counts_as_zero_does_not_depend_on_units(backend, unit):
    A = np.diag([4.0, 3.0, 2.0, 5.0]) + 0.5 * (np.eye(4, k=1) + np.eye(4, k=-1))
    A[3] = A[:, 3] = 0.0
    for small, negative in ((1e-11, 0), (-1e-11, 1)):
        A[3, 3] = small
        pattern, data = upper(A)
        found = factoriser(pattern, backend).factor(unit * data)
        assert found.negative == negative
        right = A @ [1.0, 2.0, 3.0, 4.0]
        np.testing.assert_allclose(found.solve(unit * right), [1.0, 2.0, 3.0, 4.0], rtol=1e-12)
    A[3, 3] = 1e-15
    pattern, data = upper(A)
    with pytest.raises(SingularMatrix, match="zero to rounding"):
        assert factoriser(pattern, backend).factor(unit * data).negative == 0


@every_backend
@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_numbers_that_are_not_finite_are_refused(backend, wrong):
    pattern, data = upper(np.eye(3))
    data[1] = wrong
    with pytest.raises(SingularMatrix, match="entries that are not finite"):
        factoriser(pattern, backend).factor(data)


@every_backend
def test_a_matrix_without_rows(backend):
    pattern, data = upper(np.eye(0))
    found = factoriser(pattern, backend).factor(data)
    assert found.negative == 0
    assert found.solve(np.empty(0)).shape == (0,)


@every_backend
@pytest.mark.parametrize("used", [*at_night(False), True])
def test_memory_is_given_back_with_the_factoriser(backend, used, monkeypatch):
    pattern, data = upper(np.eye(50))
    phases, run = list[int](), factor._Memory.run

    def recorded(memory, phase, *given):
        phases.append(phase)
        return run(memory, phase, *given)

    monkeypatch.setattr(factor._Memory, "run", recorded)
    for _ in range(20):
        solver = factoriser(pattern, backend)
        if used:
            solver.factor(data)
        del solver
    gc.collect()  # an error in the library's clean-up would show as a warning here
    assert phases.count(-1) == (20 if used and backend == "pardiso" else 0)


def negative_exactly(A):
    """Negative eigenvalues of a 3×3 matrix in fractions: Descartes' rule is exact, as all roots are real."""
    (a, b, c), (_, d, e), (_, _, f) = [[Fraction(float(x)) for x in row] for row in A]
    minors = a * d - b * b + a * f - c * c + d * f - e * e
    determinant = a * (d * f - e * e) - b * (b * f - e * c) + c * (b * e - d * c)
    signs = [x > 0 for x in (1, a + d + f, minors, determinant) if x]
    return sum(one != other for one, other in pairwise(signs))


@every_backend
@pytest.mark.parametrize("coupling", [*at_night(1.0, 1e-3), 1e-6])
def test_tiny_pivots_do_not_change_the_inertia_in_silence(backend, coupling):
    """Elimination with the first diagonal entry as pivot loses what the other two rows have in common."""
    random = np.random.default_rng(7)
    refusals = 0
    for _ in range(300):
        A = np.triu(random.standard_normal((3, 3)), 1)
        A[1, 2] *= coupling
        A = A + A.T + np.diag(random.standard_normal(3) * 10.0 ** random.uniform(-20, -8, 3))
        pattern, data = upper(A)
        try:
            assert factoriser(pattern, backend).factor(data).negative == negative_exactly(A)
        except SingularMatrix:
            refusals += 1
    assert refusals == 0


@pytest.mark.parametrize("seed", range(5))
def test_tiny_pivots_among_many_rows(seed):
    A = random_symmetric(60, seed)
    A[np.diag_indices(60)] *= 10.0 ** np.random.default_rng(seed).uniform(-18, 0, 60)
    pattern, data = upper(A)
    assert factoriser(pattern, "superlu").factor(data).negative == (np.linalg.eigvalsh(A) < 0).sum()


@every_backend
def test_a_matrix_that_is_singular_to_rounding_is_refused(backend):
    """One eigenvalue is 1e-17: no factorisation in double precision shows its sign."""
    Q = np.linalg.qr(np.random.default_rng(2).standard_normal((6, 6)))[0]
    A = Q @ np.diag([1.0, -2.0, 3.0, 0.5, 1e-17, 4.0]) @ Q.T
    pattern, data = upper(0.5 * (A + A.T))
    with pytest.raises(SingularMatrix):
        _ = factoriser(pattern, backend).factor(data).negative


@every_backend
def test_an_old_factor_solves_its_own_matrix_or_refuses(backend):
    pattern, data = assembled("three patches")
    solver, right = factoriser(pattern, backend), np.ones(pattern.size)
    old = solver.factor(data)
    expected = old.solve(right)
    new = solver.factor(3.0 * data)
    if backend == "superlu":
        np.testing.assert_array_equal(old.solve(right), expected)
    else:
        with pytest.raises(PcmcError, match="out of date: its factoriser has made another"):
            old.solve(right)
    np.testing.assert_allclose(new.solve(right), expected / 3.0, rtol=1e-9)


def test_superlu_counts_also_where_a_zero_pivot_forces_a_row_exchange():
    pattern, data = upper(np.array([[0.0, 1.0], [1.0, 0.0]]))
    found = factoriser(pattern, "superlu").factor(data)
    np.testing.assert_allclose(found.solve(np.array([2.0, 3.0])), [3.0, 2.0])
    assert found.negative == 1


def test_unknown_and_missing_backends(monkeypatch):
    pattern, _ = upper(np.eye(2))
    with refused(OptionError, what="backend", found="superl", expected=factor.BACKENDS):
        factoriser(pattern, "superl")
    monkeypatch.setattr(factor, "installed", lambda: ("superlu",))
    with pytest.raises(MissingExtra, match=r"pypardiso is not installed.*pcmc-surfaces\[fast\]"):
        factoriser(pattern, "pardiso")
    assert factoriser(pattern).factor(np.ones(2)).negative == 0


def test_the_fastest_backend_comes_first(monkeypatch):
    assert installed()[-1] == "superlu"
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert factor.installed.__wrapped__() == ("superlu",)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: object())
    assert factor.installed.__wrapped__() == factor.BACKENDS
