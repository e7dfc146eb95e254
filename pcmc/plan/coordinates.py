"""Coordinates on the plane Π and heights above it."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats
from ..surface import Plane


def frame(plane: Plane) -> Floats:
    """(3,3) rows: two unit vectors along Π and its normal. The identity for the standard Π."""
    normal = np.array(plane.normal)
    axis = np.eye(3)[1 if abs(normal[0]) > 0.9 else 0]
    first = axis - (axis @ normal) * normal
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    return np.stack([first, second, normal])


def to_local(points: Floats, plane: Plane) -> Floats:
    """(n,3) coordinates on Π and heights above it, of plane (n,2) or space points (n,3)."""
    if points.shape[-1] == 2:
        return np.concatenate([points, np.zeros((*points.shape[:-1], 1))], axis=-1)
    return (points - np.array(plane.point)) @ frame(plane).T


def to_space(local: Floats, plane: Plane) -> Floats:
    """(n,3) positions of points given by coordinates on Π and height."""
    return local @ frame(plane) + np.array(plane.point)
