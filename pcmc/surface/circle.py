"""A circle that vertices slide along."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Floats, Vector
from ..base.errors import SurfaceError
from .line import Line


@dataclass(frozen=True)
class Circle:
    """The circle around ``centre`` in the plane across the unit ``normal`` (normalised on the way in).

    Its tangent at the point x is t = n × (x - c) / |n × (x - c)|: counter-clockwise seen from the side that
    the normal n points to.

    >>> Circle((0, 0, 1), (0, 0, 2), 3).normal
    (0.0, 0.0, 1.0)
    """

    centre: Vector
    normal: Vector
    radius: float

    def __post_init__(self) -> None:
        for key in ("centre", "normal"):
            vector = validate.vector(f"Circle.{key}", getattr(self, key), error=SurfaceError)
            object.__setattr__(self, key, vector)
        length = math.hypot(*self.normal)
        if not 0.0 < length < math.inf:
            expected = "a vector of positive length"
            validate.refuse("Circle.normal", self.normal, expected, error=SurfaceError)
        object.__setattr__(self, "normal", tuple(c / length for c in self.normal))
        radius = validate.number("Circle.radius", self.radius, above=0.0, error=SurfaceError)
        object.__setattr__(self, "radius", radius)

    def place(self, points: npt.ArrayLike) -> Floats:
        """(…) how far along the circle points (…,3) are, from -πr to πr, length.

        >>> quarter = Circle((0, 0, 0), (0, 0, 1), 2).place([[0, 2, 0], [2, 0, 0]])
        >>> float(abs(np.ptp(quarter) - np.pi))
        0.0
        """
        first, second = self._axes()
        away = np.asarray(points, dtype=float) - np.array(self.centre)
        return np.asarray(self.radius * np.arctan2(away @ second, away @ first))

    def nearest(self, points: npt.ArrayLike) -> Floats:
        """(…,3) the points of the circle nearest to points (…,3); NaN for its centre.

        >>> Circle((0, 0, 1), (0, 0, 1), 2).nearest([5, 0, 3]).tolist()
        [2.0, 0.0, 1.0]
        """
        outward = self._across(np.asarray(points, dtype=float) - np.array(self.centre))
        length = np.linalg.norm(outward, axis=-1, keepdims=True)
        with np.errstate(invalid="ignore"):
            return np.asarray(np.array(self.centre) + self.radius * (outward / length))

    def distance(self, points: npt.ArrayLike) -> Floats:
        """(…) the distance of points (…,3) from the circle.

        >>> Circle((0, 0, 0), (0, 0, 1), 2).distance([5, 0, 4]).item()
        5.0
        """
        away = np.asarray(points, dtype=float) - np.array(self.centre)
        outward = np.linalg.norm(self._across(away), axis=-1) - self.radius
        return np.asarray(np.hypot(outward, away @ np.array(self.normal)))

    def directions(self, points: Floats) -> Floats:
        """(…,3) the unit tangents t at points (…,3)."""
        tangent = np.cross(np.array(self.normal), points - np.array(self.centre))
        return np.asarray(tangent / np.linalg.norm(tangent, axis=-1, keepdims=True))

    def along(self, vectors: Floats, points: Floats) -> Floats:
        """(…,3) the components of vectors (…,3) along the circle at points (…,3): ⟨v, t⟩ t."""
        tangent = self.directions(points)
        return np.asarray((vectors * tangent).sum(axis=-1, keepdims=True) * tangent)

    def turning(self, points: Floats, forces: Floats) -> Floats:
        """(…,3) the gradient of ⟨f, t(x)⟩ at points x (…,3) for forces f (…,3): the tangent turns.

        A motion d turns it by Dt[d] = (n × d - t ⟨t, n × d⟩) / |n × (x - c)|; on the circle Dt[t] is the
        curvature vector (c - x) / r².
        """
        normal = np.array(self.normal)
        reach = np.linalg.norm(np.cross(normal, points - np.array(self.centre)), axis=-1, keepdims=True)
        return np.asarray(np.cross(forces - self.along(forces, points), normal) / reach)

    def _across(self, vectors: Floats) -> Floats:
        """(…,3) the components of vectors (…,3) in the circle's plane."""
        normal = np.array(self.normal)
        return np.asarray(vectors - (vectors @ normal)[..., None] * normal)

    def _axes(self) -> tuple[Floats, Floats]:
        """Two unit vectors that span the circle's plane."""
        normal = np.array(self.normal)
        first = self._across(np.eye(3)[np.abs(normal).argmin()])
        first /= np.linalg.norm(first)
        return first, np.cross(normal, first)


Guide = Line | Circle  # what a vertex can slide along
