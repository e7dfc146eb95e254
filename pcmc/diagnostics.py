"""Whether derivatives are right: the remainder of Taylor's formula falls with the next power of the step.

    E(X + h v) - E(X) - h ⟨∇E, v⟩                    = O(h²)
    E(X + h v) - E(X) - h ⟨∇E, v⟩ - ½ h² ⟨v, ∂²E v⟩  = O(h³)

So a force that is new is checked by two lines. Imports ``forces`` and the subpackages below it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .base.arrays import Floats
from .base.tolerances import DIFFERENCE_ROUNDING
from .forces.functional import energy_and_gradient, energy_at
from .forces.second_variation import hessian
from .surface import Surface, expect_surface
from .surface.geometry import segment_lengths

STEPS: Floats = 0.5 ** np.arange(5.0, 10.0)
WITHIN = 0.15  # of the order: a slope that counts as right


@dataclass(frozen=True, eq=False)
class TaylorTest:
    """Remainders of Taylor's formula at some steps, and the order at which they vanish.

    >>> print(TaylorTest(np.array([0.5, 0.25]), np.array([0.4, 0.2]), order=2, slope=1.0))
    wrong: the remainder falls as h^1.00, where h^2 is expected
    """

    steps: Floats
    remainders: Floats
    order: int  # that they have if the derivatives are right
    slope: float  # that they have; infinite where nothing remains but rounding

    @property
    def passed(self) -> bool:
        """Whether they vanish at that order or faster."""
        return self.slope > self.order - WITHIN

    def __str__(self) -> str:
        verdict = "right" if self.passed else "wrong"
        return f"{verdict}: the remainder falls as h^{self.slope:.2f}, where h^{self.order} is expected"


def taylor(
    value: Callable[[Floats], float], X: Floats, move: Floats, first: Floats, second: Any = None
) -> TaylorTest:
    """The test of a function of positions X (n,3) along a move (n,3), with its gradient (n,3) there.

    ``second`` is its Hessian (3n,3n), to be tested too; None tests the gradient alone.

    >>> X, v = np.array([[1.0, 2.0, 3.0]]), np.array([[0.1, 0.0, 0.2]])
    >>> cube = lambda X: float((X**3).sum())
    >>> print(taylor(cube, X, v, 3 * X**2, np.diag(6 * X.ravel())))
    right: the remainder falls as h^3.00, where h^3 is expected
    >>> taylor(cube, X, v, 3.01 * X**2).passed
    False
    """
    start = value(X)
    remainders = np.array([value(X + h * move) - start for h in STEPS]) - STEPS * float((first * move).sum())
    if second is not None:
        remainders -= 0.5 * STEPS**2 * float(move.ravel() @ (second @ move.ravel()))
    seen = np.abs(remainders) > DIFFERENCE_ROUNDING * abs(start)
    slope = np.inf
    if seen.sum() > 1:
        slope = float(np.polyfit(np.log(STEPS[seen]), np.log(np.abs(remainders[seen])), 1)[0])
    return TaylorTest(STEPS, remainders, 2 if second is None else 3, slope)


def check_gradient(surface: Surface, seed: int = 0) -> TaylorTest:
    """Taylor's test of ∇E at a surface, supports not applied, along random moves of its vertices.

    >>> from pcmc import Patch
    >>> corners = [[1, 0, 0], [0, 1, 0], [-1, -1, 0], [0, 0, 1]]
    >>> tent = Surface(corners, [[0, 1, 3], [1, 2, 3], [2, 0, 3]], [0] * 3, [Patch("roof", 1.0)], fixed=[0])
    >>> check_gradient(tent).passed, check_hessian(tent).passed
    (True, True)
    """
    expect_surface(surface)
    first = energy_and_gradient(surface, supports=False)[1]
    return taylor(lambda X: energy_at(surface, X), surface.vertices, _move(surface, seed), first)


def check_hessian(surface: Surface, seed: int = 0) -> TaylorTest:
    """Taylor's test of ∂²E, in the same way; see ``check_gradient``.

    >>> from pcmc import Patch
    >>> corners = [[0, 0, 1], [1, 0, 1], [0, 1, 2]]
    >>> triangle = Surface(corners, [[0, 1, 2]], [0], [Patch("roof", 2.0)], fixed=[0])
    >>> round(check_hessian(triangle).slope, 1)  # what remains is of third order
    3.0
    """
    expect_surface(surface)
    first, second = energy_and_gradient(surface, supports=False)[1], hessian(surface)
    return taylor(lambda X: energy_at(surface, X), surface.vertices, _move(surface, seed), first, second)


def _move(surface: Surface, seed: int) -> Floats:
    """(n,3) random moves, of a tenth of a mean edge."""
    edge = float(segment_lengths(surface.vertices, surface.topology.sides).mean())
    moves = 0.1 * edge * np.random.default_rng(seed).standard_normal((surface.n, 3))
    return np.asarray(surface.spread(moves))
