"""Elements of any order: six vertices each, as of quadratic triangles, by the functions of all forces."""

import numpy as np
import pytest

from pcmc.diagnostics import taylor
from pcmc.forces.elements import Elements, add_hessian_products, add_values
from pcmc.forces.motion_space import MotionSpace
from pcmc.forces.pattern import pattern_of
from pcmc.forces.second_variation import add_blocks

SIX = np.array([[0, 1, 2, 3, 4, 5], [2, 1, 6, 7, 8, 4], [6, 1, 9, 10, 11, 7]])
X = np.random.default_rng(2).standard_normal((12, 3))
WEIGHTS = np.cos(np.arange(6.0))


def toy(X):
    """½ |Σ w_i x_i|⁴ per element: all six vertices of each are coupled."""
    s = np.einsum("i,eix->ex", WEIGHTS, X[SIX])
    square = np.einsum("ex,ex->e", s, s)

    def hessian():
        inner = 2.0 * square[:, None, None] * np.eye(3) + 4.0 * s[:, :, None] * s[:, None, :]
        return np.einsum("i,j,exy->eijxy", WEIGHTS, WEIGHTS, inner)

    gradient = np.einsum("i,ex->eix", WEIGHTS, 2.0 * square[:, None] * s)
    stiffness = np.broadcast_to(np.outer(WEIGHTS, WEIGHTS), (len(SIX), 6, 6))
    return Elements(SIX, 0.5 * square**2, lambda: gradient, hessian, lambda: stiffness)


def assembled(basis, dimension, hessian=1.0, stiffness=0.0):
    space = MotionSpace.of(basis, dimension)
    pattern = pattern_of(SIX, space)
    data = np.zeros(len(pattern.indices))
    add_blocks([toy(X)], space, pattern, hessian, stiffness, data)
    return pattern.symmetric(data).toarray()


ALL = np.tile(np.eye(3), (12, 1, 1)), np.full(12, 3)


def test_taylor_slopes_of_what_is_summed_and_assembled():
    gradient, move = np.zeros_like(X), 0.1 * np.sin(np.arange(36.0)).reshape(12, 3)
    assert add_values([toy(X)], gradient) == pytest.approx(toy(X).value.sum())
    for second, order in ((None, 2.0), (assembled(*ALL), 3.0)):
        test = taylor(lambda Y: add_values([toy(Y)]), X, move, gradient, second)
        assert test.slope == pytest.approx(order, abs=0.05)


def test_products_are_those_of_the_assembled_matrix():
    d, change = np.cos(np.arange(36.0)).reshape(12, 3), np.zeros_like(X)
    add_hessian_products([toy(X)], d, change)
    np.testing.assert_allclose(change.ravel(), assembled(*ALL) @ d.ravel(), rtol=1e-12, atol=1e-12)


def test_projected_into_a_motion_space_and_with_a_stiffness():
    rng = np.random.default_rng(5)
    dimension = rng.integers(0, 4, 12)
    basis = np.linalg.qr(rng.standard_normal((12, 3, 3)))[0] * (np.arange(3) < dimension[:, None])[..., None]
    B = np.stack([MotionSpace.of(basis, dimension).to_vectors(e).ravel() for e in np.eye(dimension.sum())], 1)
    expected = B.T @ assembled(*ALL, 0.7, 0.3) @ B
    np.testing.assert_allclose(assembled(basis, dimension, 0.7, 0.3), expected, rtol=0, atol=1e-12)


def test_a_pair_that_the_pattern_does_not_have_is_refused():
    space = MotionSpace.of(*ALL)
    pattern = pattern_of(SIX[:2], space)
    with pytest.raises(LookupError, match="no pair of the pattern"):
        add_blocks([toy(X)], space, pattern, 1.0, 0.0, np.zeros(len(pattern.indices)))
