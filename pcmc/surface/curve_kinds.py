"""The kinds of curves that a roof is drawn with: ridges, rims and wall lines."""

from __future__ import annotations

from collections.abc import Iterator

from .surface import Surface
from .topology import Curve

RIDGE, RIM, WALL = "RIDGE", "RIM", "WALL"


def curves_by_kind(surface: Surface) -> Iterator[tuple[str, Curve]]:
    """Each curve with its kind, by the sheets at it that are no walls: two or more, one, or none.

    >>> from .surface import Patch
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> [(kind, len(curve.vertices)) for kind, curve in curves_by_kind(square)]
    [('RIM', 4)]
    """
    for curve in (*surface.topology.junctions, *surface.topology.boundary_loops):
        roofs = sum(not surface.walls[k] for k in curve.sheets)
        yield (WALL, RIM, RIDGE)[min(roofs, 2)], curve
