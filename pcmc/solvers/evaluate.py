"""E and ∇E at many positions of one surface, with little around the compiled loop."""

from __future__ import annotations

from math import isfinite, sqrt
from typing import NamedTuple

import numpy as np

from ..base.arrays import Bools, Floats
from ..base.compiled import blocks, compiled, threads
from ..energy import kernels
from ..energy.functional import total
from ..surface import Surface


class Point(NamedTuple):
    """Positions X (n,3) with their energy, ∇E (n,3; supports applied) and ‖∇E‖²."""

    X: Floats
    energy: float
    gradient: Floats
    squared: float

    @property
    def finite(self) -> bool:
        """Whether energy and gradient are numbers; then the positions are, too."""
        return isfinite(self.energy) and isfinite(self.squared)


class Evaluator:
    """Calls to it measure E and ∇E of ``surface`` elsewhere; ``count`` says how many were made.

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> evaluate = Evaluator(pyramid)
    >>> point = evaluate(pyramid.vertices)
    >>> round(point.energy, 6), round(point.squared, 6), evaluate.count
    (4.323521, 2.235305, 1)
    """

    def __init__(self, surface: Surface) -> None:
        self.count = 0
        self._mesh = surface.faces, surface.patch_of_face, surface.origin
        self._weights = surface.tensions, surface.pressures
        self._supports = surface.fixed, surface.on_plane, np.array(surface.plane.normal)
        self._single = len(blocks(surface.m, threads())) == 1

    def __call__(self, X: Floats) -> Point:
        """E, ∇E and ‖∇E‖² with the vertices at X (n,3); not finite rather than an error."""
        self.count += 1
        tension, pressure = self._weights
        if self._single:  # the same sums as kernels.measure, without what it spends on threads
            area, volume, G = np.zeros_like(tension), np.zeros_like(tension), np.zeros(X.shape)
            m = len(self._mesh[0])
            kernels.measure_block(X, *self._mesh, tension, pressure, 0, m, area, volume, G)
        else:
            area, volume, G = kernels.measure(X, *self._mesh, tension, pressure)
        squared = _hold(G, *self._supports)
        with np.errstate(all="ignore"):
            return Point(X, total(tension, area, pressure, volume), G, squared)


@compiled
def _hold(G: Floats, fixed: Bools, sliding: Bools, normal: Floats) -> float:
    """Take from G (n,3) what the supports carry, Eq. (19), in place; return its squared sum."""
    squared = 0.0
    for v in range(len(G)):
        if fixed[v]:
            G[v, 0] = G[v, 1] = G[v, 2] = 0.0
        elif sliding[v]:
            along = G[v, 0] * normal[0] + G[v, 1] * normal[1] + G[v, 2] * normal[2]
            for c in range(3):
                G[v, c] -= along * normal[c]
        squared += G[v, 0] ** 2 + G[v, 1] ** 2 + G[v, 2] ** 2
    return squared


@compiled
def extent(X: Floats) -> float:
    """Diagonal of the bounding box of X (n,3), length."""
    total = 0.0
    for c in range(3):
        low = high = X[0, c]
        for v in range(len(X)):
            low, high = min(low, X[v, c]), max(high, X[v, c])
        total += (high - low) ** 2
    return sqrt(total)
