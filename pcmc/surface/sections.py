"""The lines that a roof is drawn with: sections by a plane, and its ridges, rims and wall lines."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import NamedTuple

import numpy as np

from ..base.arrays import Floats
from .images import expect_no_images
from .surface import Surface
from .topology import EdgeCurve, joined

RIDGE, RIM, WALL, MIRROR = "RIDGE", "RIM", "WALL", "MIRROR"  # the kinds of curves


class Polyline(NamedTuple):
    """Points (k,3) in order, whether the last is joined to the first, and the patch they lie on."""

    points: Floats
    closed: bool
    patch: int


def section(surface: Surface, point: Floats, normal: Floats) -> list[Polyline]:
    """The lines in which a plane cuts each patch of a surface.

    A vertex on the plane counts as above it. So every triangle that the plane cuts has two sides that it
    cuts, and a rim that lies in the plane is cut nowhere. Each point is exact on its edge:
    x = a + t (b - a) with t = h_a / (h_a - h_b), h the heights above the plane.

    >>> from pcmc import Patch
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 2]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> (line,) = section(roof, np.array([0, 0, 1.0]), np.array([0, 0, 1.0]))
    >>> line.closed, np.abs(line.points[:, :2]).tolist()
    (True, [[0.5, 0.5], [0.5, 0.5], [0.5, 0.5], [0.5, 0.5]])
    """
    expect_no_images(surface, "a section")
    topo, X = surface.topology, surface.vertices
    height = (X - point) @ normal
    above = height >= 0.0
    first, second = topo.edges.T
    cut = above[first] != above[second]
    share = np.zeros(len(cut))
    share[cut] = height[first[cut]] / (height[first[cut]] - height[second[cut]])
    at = X[first] + share[:, None] * (X[second] - X[first])
    lines = []
    for patch in range(len(surface.patches)):
        sides = topo.edge_of_face[surface.patch_of_face == patch]
        crossing = cut[sides]
        links = sides[crossing.any(axis=1)][crossing[crossing.any(axis=1)]].reshape(-1, 2)
        nodes, local = np.unique(links, return_inverse=True)
        nowhere = np.zeros(len(nodes), dtype=bool)
        for chain, closed, _ in joined(local.reshape(-1, 2), nowhere, len(nodes)):
            points = at[nodes[chain]]  # the same one twice where the plane goes through a vertex
            new = (points != np.roll(points, 1, axis=0)).any(axis=1)
            new[0] |= not closed
            if new.sum() > 1:
                lines.append(Polyline(points[new], closed, patch))
    return lines


def curves_by_kind(surface: Surface, without: Collection[str] = ()) -> Iterator[tuple[str, EdgeCurve]]:
    """Each curve with its kind, by the sheets at it that are no walls: two or more, one, or none; but for
    those of the walls ``without`` alone. In a mirror plane, where the roof goes on, a curve is no rim.

    >>> from pcmc import Patch
    >>> square = Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> [(kind, len(curve.vertices)) for kind, curve in curves_by_kind(square)]
    [('RIM', 4)]
    """
    topo, mirror = surface.topology, surface.mirror_edge
    outer = topo.curves_among(topo.boundary_edge & ~mirror) if mirror.any() else topo.boundary_loops
    curves = [(curve, False) for curve in (*topo.junctions, *outer)]
    for curve, cut in [*curves, *((curve, True) for curve in topo.curves_among(mirror))]:
        roofs = sum(not surface.walls[k] for k in curve.sheets)
        if roofs or not {surface.patches[k].name for k in curve.sheets} <= {*without}:
            yield MIRROR if cut else (WALL, RIM, RIDGE)[min(roofs, 2)], curve
