"""Coordinates on the plane Π and heights above it."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats
from ..surface import Plane


def to_local(points: Floats, plane: Plane) -> Floats:
    """(n,3) coordinates on Π and heights above it, of plane (n,2) or space points (n,3)."""
    if points.shape[-1] == 2:
        return np.concatenate([points, np.zeros((*points.shape[:-1], 1))], axis=-1)
    return plane.to_local(points)


def to_space(local: Floats, plane: Plane) -> Floats:
    """(n,3) positions of points given by coordinates on Π and height."""
    return local @ plane.axes + np.array(plane.point)
