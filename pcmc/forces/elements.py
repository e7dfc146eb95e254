"""Forces as sums over elements of a few vertices: one value type, summed, applied and assembled once.

A force is one file with a function of a surface and positions X (n,3) that yields ``Elements``; listed in
``functional.FORCES`` it is part of the energy, its gradient, the assembled matrices and their products.

The order of the elements is a parameter: k vertices each, 1 for a point, 2 for an edge, 6 for a quadratic
triangle. The pattern must have all pairs of vertices of an element (``pattern.pattern_of``). Flat triangles
are by far the most: their blocks are made within the loops of ``second_variation``, and not kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from ..base.arrays import Floats, Ints


class Elements(NamedTuple):
    """Elements of k vertices x_0, x_1, … each, at some positions."""

    vertices: Ints  # (e,k)
    value: Floats  # (e,) energy
    gradient: Callable[[], Floats]  # (e,k,3) ∂/∂x_i, computed when asked for like those below
    hessian: Callable[[], Floats]  # (e,k,k,3,3) ∂²/∂x_i∂x_j
    stiffness: Callable[[], Floats] | None = None  # (e,k,k) multiples of 1 in L; None where there are none

    def times(self, factor: Floats) -> Elements:
        """The elements with energies that are ``factor`` (e,) as large, without those of 0."""
        some = slice(None) if factor.all() else np.flatnonzero(factor)
        f, stiffness = factor[some], self.stiffness
        return Elements(
            self.vertices[some],
            f * self.value[some],
            lambda: f[:, None, None] * self.gradient()[some],
            lambda: f[:, None, None, None, None] * self.hessian()[some],
            None if stiffness is None else lambda: f[:, None, None] * stiffness()[some],
        )


def add_values(forces: Iterable[Elements], gradient: Floats | None = None) -> float:
    """The energy of all elements; their gradient is added to ``gradient`` (n,3) if that is given."""
    energy = 0.0
    for force in forces:
        energy += float(force.value.sum())
        if gradient is not None:
            np.add.at(gradient, force.vertices, force.gradient())
    return energy


def add_hessian_products(forces: Iterable[Elements], d: Floats, change: Floats) -> None:
    """Add (∂²E) d to ``change`` (n,3), for a motion d (n,3)."""
    for force in forces:
        each = np.einsum("eijxy,ejy->eix", force.hessian(), d[force.vertices])
        np.add.at(change, force.vertices, each)
