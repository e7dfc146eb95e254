"""Sections: where a plane cuts the triangles, joined to polylines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base.arrays import Floats, Ints
from ..surface import Surface
from ..surface.topology import components


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
        for chain, closed in chains(links):
            points = without_repeats(at[chain], closed)
            if len(points) > 1:
                lines.append(Polyline(points, closed, patch))
    return lines


def chains(links: Ints) -> list[tuple[Ints, bool]]:
    """Links (k,2) between numbered nodes, at most two at a node, joined: nodes in order, and whether closed.

    >>> [(nodes.tolist(), closed) for nodes, closed in chains(np.array([[5, 3], [3, 9], [1, 2]]))]
    [([1, 2], False), ([5, 3, 9], False)]
    """
    if not len(links):
        return []
    nodes, local = np.unique(links, return_inverse=True)
    local = local.reshape(-1, 2)
    beside: list[list[int]] = [[] for _ in nodes]
    for one, other in local.tolist():
        beside[one].append(other)
        beside[other].append(one)
    label = components(local, len(nodes))
    degree = np.array([len(each) for each in beside])
    joined = []
    for part in range(label.max() + 1):
        members = np.flatnonzero(label == part)
        ends = members[degree[members] == 1]
        start = int(ends[0] if len(ends) else members[0])
        path, before = [start], -1
        while True:
            ahead = [node for node in beside[path[-1]] if node != before]
            if not ahead or ahead[0] == start:
                break
            before = path[-1]
            path.append(ahead[0])
        joined.append((nodes[path], not len(ends)))
    return joined


def without_repeats(points: Floats, closed: bool) -> Floats:
    """The points without those that repeat the one before: the plane goes through a vertex there."""
    before = np.roll(points, 1, axis=0)
    new = (points != before).any(axis=1)
    if not closed:
        new[0] = True
    return points[new]
