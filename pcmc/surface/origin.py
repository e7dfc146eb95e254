"""The points that volumes and coordinates are measured from, for surfaces far from zero."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..base.arrays import Bools, Floats
from ..curves.plane import Plane
from .supports import common_point
from .topology import Topology

FAR = 30.0  # sizes of the surface: farther away, differences of coordinates and volumes lose three digits


def uncancelled_pressures(topo: Topology, pressure: Floats, masks: Sequence[Bools]) -> Floats:
    """(e,) the sum of the pressures at each edge that is not held, force/area.

    A triangle's pressure (m,) counts with the sense in which the triangle runs along the edge. An edge is
    held if one of the (n,) ``masks`` has both its ends. Where all sums are zero, no force depends on the
    point that volumes are seen from.
    """
    left = np.bincount(topo.edge_of_face.ravel(), (pressure[:, None] * topo.sense).ravel(), len(topo.edges))
    held = np.any([mask[topo.edges].all(axis=1) for mask in masks], axis=0)
    rounding = 1e-12 * np.abs(pressure).max(initial=0.0)
    return np.where(held | (np.abs(left) <= rounding), 0.0, left)


def volume_origin(X: Floats, size: float, planes: Sequence[Plane], sliding: bool) -> Floats:
    """(3,) the point that volumes are seen from: that of Π, the first plane.

    Far from that point, as in survey coordinates, volumes would lose their digits. There the origin is the
    point of Π below the middle of the surface, so that a volume over Π does not depend on where it is
    drawn; or the middle itself, if that is far above Π and nothing is ``sliding`` on Π. It is moved along Π
    to lie on as many of the other planes as possible: these then add nothing to volumes (``flat_pieces``).

    >>> survey = np.array([[1000.0, 0, 0], [1001, 0, 0], [1000, 1, 1]])
    >>> volume_origin(survey, 1.7, [Plane()], sliding=True).round(3).tolist()
    [1000.333, 0.333, 0.0]
    """
    plane, others = planes[0], planes[1:]
    point, middle = np.array(plane.point), X.mean(axis=0)
    if np.linalg.norm(middle - point) > FAR * size:
        height = float(plane.height(middle))
        if sliding or abs(height) <= FAR * size:
            middle = middle - height * np.array(plane.normal)
        point = middle
    return np.asarray(common_point(point, planes) if others else point)


def file_origin(X: Floats, size: float) -> Floats:
    """(3,) the point that coordinates with seven digits are measured from: zero, or whole numbers near.

    >>> file_origin(np.array([[1000.0, 0, 0], [1001, 0, 0], [1000, 1, 1]]), 1.7).tolist()
    [1000.0, 0.0, 0.0]
    """
    middle = X.mean(axis=0)
    return np.round(middle) if np.linalg.norm(middle) > FAR * size else np.zeros(3)
