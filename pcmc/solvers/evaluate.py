"""E and ∇E at many positions of one surface, with little overhead around the compiled loop."""

from __future__ import annotations

from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from ..base.arrays import Floats
from ..base.compiled import blocks
from ..base.tolerances import FORCE_ROUNDING
from ..forces import triangles
from ..forces.elements import add_values, energy_mesh
from ..forces.functional import elements, total
from ..forces.motion_space import force_scale
from ..surface import Surface
from ..surface.checks import reachable
from ..surface.geometry import bounding_size
from ..surface.supports import project
from .result import Status


class Point(NamedTuple):
    """Positions X (n,3) with their energy, ∇E (n,3; supports applied) and ‖∇E‖²."""

    X: Floats
    energy: float
    gradient: Floats
    squared: float

    @property
    def finite(self) -> bool:
        """Whether energy and gradient are numbers, and the positions are not too far out for a Surface."""
        return isfinite(self.energy) and isfinite(self.squared) and reachable(self.X)


def converged_below(surface: Surface, tolerance: float | None) -> float:
    """‖∇E‖² up to which a run from a surface has converged, force²; 0 for none.

    The tolerance, times F² where the norm F of the single triangles' forces at the start is below 1, or a
    small surface would be at rest in any shape; at least (FORCE_ROUNDING · F)², which rounding leaves.

    >>> from pcmc import Patch, Surface
    >>> corners, faces = [[0, 0, 0], [2, 0, 0], [0, 2, 0]], [[0, 1, 2]]
    >>> large, small = (Surface(corners, faces, [0], [Patch("a", t)], [0]) for t in (1.0, 1e-3))
    >>> converged_below(large, 1e-8), converged_below(small, 1e-8)
    (1e-08, 4e-14)
    """
    if not tolerance:
        return 0.0
    forces = force_scale(surface, surface, surface.vertices)
    return max(tolerance * min(1.0, forces) ** 2, (FORCE_ROUNDING * forces) ** 2)


class Evaluator:
    """E and ∇E of ``surface`` with its vertices at other positions; ``count`` is the number of calls.

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> evaluate = Evaluator(pyramid)
    >>> point = evaluate(pyramid.vertices)
    >>> round(point.energy, 6), round(point.squared, 6), evaluate.count
    (4.323521, 2.235305, 1)
    """

    def __init__(self, surface: Surface, tolerance: float | None = None, inflation: float = np.inf) -> None:
        self.count, self._tolerance = 0, converged_below(surface, tolerance)
        self._largest = inflation * surface.size
        self._mesh = energy_mesh(surface)
        self._admissible = surface.admissible
        self._surface = surface
        self._more = any(True for _ in elements(surface, surface.vertices))
        self._single = len(blocks(surface.m)) == 1 and not (self._mesh.curved or surface.heavy)

    def row(self, point: Point) -> dict[str, Any]:
        return {"evaluation": self.count, "energy": point.energy, "gradient_squared": point.squared}

    def ending(self, point: Point) -> Status | None:
        """Why to stop at a point, or None."""
        if not point.finite:
            return Status.NON_FINITE
        if point.squared <= self._tolerance:
            return Status.CONVERGED
        return Status.DIVERGED if bounding_size(point.X) > self._largest else None

    def __call__(self, X: Floats) -> Point:
        """E, ∇E and ‖∇E‖² with the vertices at X (n,3); not finite rather than an error."""
        self.count += 1
        if self._single:  # the same sums as ``totals_and_gradient``, without its overhead for threads
            sums, G = np.zeros((3, len(self._mesh.tension))), np.zeros(X.shape)
            triangles.measure_block(self._mesh, X, 0, len(self._mesh.faces), sums[0], sums[1], G)
        else:
            sums, G = triangles.totals_and_gradient(self._mesh, X)
        further = add_values(elements(self._surface, X), G) if self._more else 0.0
        squared = project(self._admissible, G)
        with np.errstate(all="ignore"):
            return Point(X, total(self._mesh, sums) + further, G, squared)
