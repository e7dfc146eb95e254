"""The force of a cable's weight g per length: the part Σ g ℓ z̄ of E; gradient and Hessian block.

z̄ is the height of an edge's middle over Π, whose normal is n; ℓ and t are as in ``cables``. With σ = -1 at
the end a and 1 at b,

    ∂/∂x_i = g (½ ℓ n + σ_i z̄ t),     ∂²/∂x_i∂x_j = g (½ σ_j n tᵀ + ½ σ_i t nᵀ + σ_i σ_j z̄ (1 - t tᵀ) / ℓ)

and L has (g z̄)₊/ℓ. So a cable of weight g pulls with τ + g z: in its plane, where nothing else acts, it hangs
in the catenary z + τ/g = c cosh(x/c). Where τ + g z ≤ 0 it is under compression.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..base.arrays import Floats, Ints
from ..surface import Surface
from .cables import ENDS, PAIRS, across, directions, inverse
from .elements import Elements


def elements(surface: Surface, X: Floats) -> Iterator[Elements]:
    """Σ g ℓ z̄ at X (n,3).

    >>> from pcmc import Cable, Patch
    >>> high = Surface([[0, 0, 3], [4, 0, 3], [0, 3, 3]], [[0, 1, 2]], [0], [Patch("a", 1.0)], [0],
    ...                cables=[Cable("edge", 2.0, [[1, 2]], weight=0.5)])
    >>> [load] = elements(high, high.vertices)
    >>> load.value.tolist(), load.gradient()[0, 0].round(9).tolist()
    ([7.5], [1.2, -0.9, 1.25])
    """
    ends, _, weight = surface.cable_edges
    if weight.any():
        yield moments(surface, X, ends, weight)


def moments(surface: Surface, X: Floats, ends: Ints, weight: Floats) -> Elements:
    """Σ g ℓ z̄ over edges (c,2) of weights (c,) at X (n,3)."""
    n, (t, length) = np.array(surface.plane.normal), directions(X, ends)
    z = surface.plane.height(X)[ends].mean(axis=1)

    def gradient() -> Floats:
        return np.asarray(0.5 * length[:, None, None] * n + (z[:, None] * ENDS)[:, :, None] * t[:, None])

    def hessian() -> Floats:
        bend = PAIRS[..., None, None] * ((z * inverse(length))[:, None, None] * across(t))[:, None, None]
        lean = 0.5 * n[:, None] * t[:, None, :]
        tilt = np.einsum("j,exy->ejxy", ENDS, lean)[:, None]
        return np.asarray(bend + tilt + np.einsum("i,eyx->eixy", ENDS, lean)[:, :, None])

    def stiffness() -> Floats:
        return np.asarray((np.where(weight * z > 0.0, z, 0.0) * inverse(length))[:, None, None] * PAIRS)

    return Elements(ends, length * z, gradient, hessian, stiffness).times(weight)
