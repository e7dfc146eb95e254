"""The public checks of derivatives pass for every force, and fail for a wrong one."""

import numpy as np
import pytest

import pcmc
from generators import bezier_hall, two_squares
from pcmc import Cable, Patch, Surface

X = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0.2], [1, -1, 0], [0, 0.1, 1]]
NET = Surface(
    X,
    [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
    [0] * 4,
    [Patch("heavy", 2.0, 0.7, weight=0.3, snow=0.1)],
    fixed=[0, 1],
    cables=[Cable("ridge", 1.5, [[0, 4], [4, 2]])],
)


@pytest.mark.parametrize("surface", [two_squares(4), bezier_hall(), NET], ids=["squares", "hall", "net"])
def test_the_derivatives_of_every_force_are_right(surface):
    gradient, hessian = pcmc.diagnostics.check_gradient(surface), pcmc.diagnostics.check_hessian(surface)
    assert gradient.passed
    assert hessian.passed
    assert (gradient.order, hessian.order) == (2, 3)
    assert gradient.slope == pytest.approx(2.0, abs=0.1)


def test_a_wrong_gradient_is_found(monkeypatch):
    right = pcmc.diagnostics.energy_and_gradient

    def wrong(*given, **options):
        value, gradient = right(*given, **options)
        return value, gradient * (1.0 + 1e-3 * np.arange(3))

    monkeypatch.setattr(pcmc.diagnostics, "energy_and_gradient", wrong)
    for check in (pcmc.diagnostics.check_gradient, pcmc.diagnostics.check_hessian):
        found = check(NET)
        assert not found.passed
        assert str(found).startswith("wrong")
