"""The force of a cable's weight g per length: the part Σ g ∫ z ds of E; gradient and Hessian block.

z is the height over Π, whose normal is n; x, N_i and t along an edge are as in ``cables``. Then

    ∂/∂x_i = g ∫ N_i |x'| n + N_i' z t
    ∂²/∂x_i∂x_j = g ∫ N_i N_j' n tᵀ + N_i' N_j t nᵀ + N_i' N_j' z (1 - t tᵀ) / |x'|

over 0..1, and L has ∫ (g z)₊ N_i' N_j' / |x'|. Of a straight edge z is the height of its middle, N = ½. So
a cable of weight g pulls with τ + g z: in its plane, where nothing else acts, it hangs in the catenary
z + τ/g = c cosh(x/c). Where τ + g z ≤ 0 it is under compression.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..base.arrays import Floats, Ints
from ..surface import Surface
from ..surface.lagrange import side_shapes
from .cables import across, along, inverse
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
    nodes, _, weight = surface.cable_sides
    if weight.any():
        yield height_integrals(surface, X, nodes, weight)


def height_integrals(surface: Surface, X: Floats, nodes: Ints, weight: Floats) -> Elements:
    """Σ g ∫ z ds over edges of nodes (c,p+1) and weights (c,) at X (n,3)."""
    n, (N, slope, dt) = np.array(surface.plane.normal), side_shapes(nodes.shape[1] - 1)
    t, speed = along(X, nodes)
    z = surface.plane.height(N @ X[nodes])

    def gradient() -> Floats:
        fall = np.einsum("qi,cq->ci", N, dt * speed)[..., None] * n
        return np.asarray(fall + np.einsum("qi,cqx->cix", slope, (dt * z)[..., None] * t))

    def hessian() -> Floats:
        bend = (dt * z * inverse(speed))[..., None, None] * across(t)
        lean = np.einsum("qi,qj,x,cqy->cijxy", N, slope, n, dt[:, None] * t)
        bent = np.einsum("qi,qj,cqxy->cijxy", slope, slope, bend)
        return np.asarray(bent + lean + lean.transpose(0, 2, 1, 4, 3))

    def stiffness() -> Floats:
        pull = np.where(weight[:, None] * z > 0.0, dt * z, 0.0) * inverse(speed)
        return np.asarray(np.einsum("qi,qj,cq->cij", slope, slope, pull))

    return Elements(nodes, (dt * z * speed).sum(axis=1), gradient, hessian, stiffness).times(weight)
