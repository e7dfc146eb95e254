"""What a wall that runs into a corner of the outline may pull there."""

from __future__ import annotations

import math

import numpy as np
import shapely

from ..curves.curves import Curve
from .lines import Line

WEDGE = 1.5  # edges from a corner, where the width of the sheets there is taken
CORNER_SHARE = 0.6  # of what those sheets carry
NARROW = 0.82  # sine of the angle, 55 degrees, below which a sheet in a corner counts as narrow


def most_in_corners(curve: Curve, outline: Line, edge_length: float, pressure: float = 1.0) -> float:
    """The most by which a wall may exceed the difference of its neighbours, where it runs into a corner.

    There the sheets on both sides get narrow, and carry the wall only as long as its tension is less than
    p w, with w their width, which is taken an edge and a half from the corner; 0.6 of that leaves room.
    Infinite where both sides are wide.
    """
    corners, near = outline.corners, 1e-3 * outline.curve.length
    most = math.inf
    for one in () if curve.closed else (curve, curve.reversed()):
        away = one.at(one.parameter(np.array([0.0, WEDGE * edge_length])))[:, :2]
        if not len(corners) or np.linalg.norm(corners - away[0], axis=1).min() > near:
            continue
        width = float(outline.tree.query_nearest(shapely.Point(away[1]), return_distance=True)[1][0])
        if width < NARROW * WEDGE * edge_length:
            most = min(most, CORNER_SHARE * pressure * width)
    return most
