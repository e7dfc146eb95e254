"""Minimal surfaces in Weierstrass's form, and the point of them next to a given one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from pcmc.base.arrays import Floats

Complexes = npt.NDArray[np.inexact]
STEPS = 12  # of Gauss and Newton's iteration
LONGEST = 0.02  # of a step in the parameter


@dataclass(frozen=True, eq=False)
class MinimalSurface:
    """X(w) = Re ∫ φ dw with φ·φ = 0: w = u + iv are conformal parameters, and X is harmonic.

    Attributes
    ----------
    position : X (k,3) at parameters w (k,).
    tangent : φ = X_u - i X_v (k,3) at w.
    samples : parameters all over the surface, from which the nearest point is searched.
    """

    position: Callable[[Complexes], Floats]
    tangent: Callable[[Complexes], Complexes]
    samples: Complexes

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.position(self.samples))

    def project(self, points: Floats) -> Floats:
        """(k,3) the points of the surface next to points (k,3)."""
        w = self.samples[self._tree.query(points)[1]]
        for _ in range(STEPS):
            with np.errstate(divide="ignore", invalid="ignore"):  # φ may be infinite at a corner
                phi = self.tangent(w)
                square = 0.5 * (np.abs(phi) ** 2).sum(axis=1)  # |X_u|² = |X_v|²
                step = (np.conj(phi) * (points - self.position(w))).sum(axis=1) / square
            step = np.where(np.isfinite(step), step, 0.0)
            w = w + step * np.minimum(1.0, LONGEST / np.maximum(np.abs(step), LONGEST))
        return self.position(w)

    def distance(self, points: Floats) -> Floats:
        """(k,) distance of points (k,3) from the surface, length."""
        return np.asarray(np.linalg.norm(points - self.project(points), axis=1))
