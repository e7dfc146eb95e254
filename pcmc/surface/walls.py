"""Which patches of a surface are walls: those declared as such, and those that hang below a junction."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.arrays import Bools
from ..base.tolerances import ON


def wall_patches(surface: Any) -> Bools:
    """(k,) bool: the patches that are walls.

    These are the patches with ``wall=True``, and those without pressure that stand between two rooms of
    prescribed volume or hang below a junction of the roof. A patch hangs below a junction where it goes down
    to Π more steeply than two others do, along most of its edges at junctions with a patch that carries
    pressure or weight. Any other patch without pressure is a sail: part of the roof. If no patch carries
    anything, as with soap films, only declared walls are walls.

    >>> from . import Patch, Surface
    >>> X = [[0, 0, 2], [0, 4, 2], [0, 2, 0], [3, 2, 3], [-3, 2, 3]]
    >>> patches = [Patch("wall", 1.0, 0.0), Patch("cushion", 2.0), Patch("sail", 2.0, 0.0)]
    >>> roof = Surface(X, [[0, 1, 2], [1, 0, 3], [0, 1, 4]], [0, 1, 2], patches, fixed=range(5))
    >>> wall_patches(roof).tolist()
    [True, False, False]
    """
    declared = np.array([patch.wall for patch in surface.patches])
    open_ones = surface.auxiliary & ~declared
    carrying = ~surface.auxiliary | (surface.weights != 0.0) & ~declared
    if not open_ones.any() or not carrying.any():
        return declared
    signs = surface.room_signs
    between = (signs > 0.0).any(axis=0) & (signs < 0.0).any(axis=0)
    return declared | open_ones & (between | _hanging(surface, carrying))


def _hanging(surface: Any, carrying: Bools) -> Bools:
    """(k,) bool: which patches go down below two others along most of their edges at junctions."""
    topo, X, count = surface.topology, surface.vertices, len(surface.patches)
    of_roof = np.zeros(len(topo.edges), dtype=bool)
    of_roof[topo.edge_of_face[carrying[surface.patch_of_face]]] = True
    sides = np.flatnonzero((topo.junction_edge & of_roof)[topo.edge_of_face].ravel())
    edge, patch = topo.edge_of_face.ravel()[sides], surface.patch_of_face[sides // 3]
    start, end = X[topo.edges[edge]].transpose(1, 0, 2)
    length = np.linalg.norm(end - start, axis=1)
    along = (end - start) / np.where(length > 0.0, length, 1.0)[:, None]
    inward = X[surface.faces.ravel()[sides]] - start  # to the corner opposite the edge
    inward -= np.einsum("ij,ij->i", inward, along)[:, None] * along
    depth = np.linalg.norm(inward, axis=1)
    away = np.where(surface.plane.height(0.5 * (start + end)) < -ON * surface.size, -1.0, 1.0)
    thick = depth > ON * surface.size  # a wall whose junction rests on Π has no height left
    slope = inward @ np.array(surface.plane.normal) / np.where(thick, depth, 1.0)
    rise = np.where(thick, away * slope, -1.0)
    order = np.lexsort((rise, edge))  # the sheets of an edge side by side, the lowest first
    first = np.searchsorted(edge[order], edge[order])
    below = np.arange(len(order)) - first < topo.valence[edge[order]] - 2
    lower = np.bincount(patch[order], below * length[order], count)
    return np.asarray(2.0 * lower > np.bincount(patch, length, count))
