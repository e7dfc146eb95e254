"""A straight line that vertices slide along."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Floats, Vector
from ..base.errors import SurfaceError


@dataclass(frozen=True)
class Line:
    """The straight line through ``point`` along the unit vector ``direction`` (normalised on the way in).

    >>> Line((0, 0, 1), (0, 3, 0)).direction
    (0.0, 1.0, 0.0)
    """

    point: Vector
    direction: Vector

    def __post_init__(self) -> None:
        for key in ("point", "direction"):
            vector = validate.vector(f"Line.{key}", getattr(self, key), error=SurfaceError)
            object.__setattr__(self, key, vector)
        length = math.hypot(*self.direction)
        if not 0.0 < length < math.inf:
            expected = "a vector of positive length"
            validate.refuse("Line.direction", self.direction, expected, error=SurfaceError)
        object.__setattr__(self, "direction", tuple(c / length for c in self.direction))

    def place(self, points: npt.ArrayLike) -> Floats:
        """(…) how far along the line points (…,3) are, length.

        >>> Line((1, 0, 0), (1, 0, 0)).place([3, 4, 0]).item()
        2.0
        """
        return (np.asarray(points, dtype=float) - np.array(self.point)) @ np.array(self.direction)

    def nearest(self, points: npt.ArrayLike) -> Floats:
        """(…,3) the points of the line nearest to points (…,3).

        >>> Line((1, 0, 0), (1, 0, 0)).nearest([3, 4, 0]).tolist()
        [3.0, 0.0, 0.0]
        """
        point = np.array(self.point)
        return np.asarray(point + self.along(np.asarray(points, dtype=float) - point))

    def distance(self, points: npt.ArrayLike) -> Floats:
        """(…) the distance of points (…,3) from the line.

        >>> Line((1, 0, 0), (1, 0, 0)).distance([3, 4, 0]).item()
        4.0
        """
        away = np.asarray(points, dtype=float) - self.nearest(points)
        return np.asarray(np.linalg.norm(away, axis=-1))

    def along(self, vectors: Floats, points: Floats | None = None) -> Floats:
        """(…,3) the components of vectors (…,3) along the line, the same at all points: ⟨v, t⟩ t."""
        direction = np.array(self.direction)
        return np.asarray((vectors @ direction)[..., None] * direction)
