"""Loose parts: the connected parts of a surface, and the islands of a patch. Each must be at rest by itself.

A small or weak part has small forces. Beside those of the rest they would not be seen.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats, Ints
from ..surface import Surface
from ..surface.geometry import bounding_size, squared_sides
from ..surface.topology import SHEET, Topology, components
from .motion_space import VertexClasses, force_scale, squared_forces


def relative_forces(surface: Surface, classes: VertexClasses, X: Floats, left: Floats) -> float:
    """The norm of the forces left (n,3) over that of the triangles' own, in the worst connected part."""
    parts = surface.topology.components
    if not surface.topology.in_parts:
        return float(np.linalg.norm(left)) / force_scale(surface, classes, X)
    part_of = parts[np.append(classes.faces[:, 0], surface.cable_edges.ends[:, 0])]
    own = squared_forces(surface, classes, X)
    return float(np.sqrt(ratios(left, parts, own, part_of).max(initial=0.0)))


def rounding_left(surface: Surface, classes: VertexClasses, X: Floats) -> float:
    """What rounding of the coordinates alone leaves of ``relative_forces``, about: ε |X| / e.

    |X| is the largest coordinate and e the mean edge, root mean square, of the part with the shortest ones.

    >>> from pcmc import Patch
    >>> from pcmc.forces.motion_space import vertex_classes
    >>> near = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("a", 1.0)], fixed=[0])
    >>> far = near.moved(near.vertices + 1e9)
    >>> rounding_left(far, vertex_classes(far), far.vertices) < 3e-7
    True
    """
    parts = surface.topology.components[classes.faces[:, 0]]
    squares = np.bincount(parts, squared_sides(X, classes.faces))
    counts = np.bincount(parts)
    edges = np.sqrt(squares[counts > 0] / (3.0 * counts[counts > 0]))
    shortest = edges[edges > 0.0].min(initial=np.inf)
    return float(np.finfo(float).eps * np.abs(X).max(initial=0.0) / shortest)


def part_size(surface: Surface) -> float:
    """The diagonal of the largest connected part's bounding box, length; how far parts are apart is no size.

    >>> from pcmc import Patch
    >>> X = [[0, 0, 0], [3, 0, 0], [0, 4, 0], [90, 0, 0], [91, 0, 0], [90, 1, 0]]
    >>> part_size(Surface(X, [[0, 1, 2], [3, 4, 5]], [0, 0], [Patch("a", 1.0)], fixed=range(6)))
    5.0
    """
    parts = surface.topology.components
    return max(bounding_size(surface.vertices[parts == k]) for k in np.unique(parts))


def patch_residuals(surface: Surface, classes: VertexClasses, left: Floats) -> Floats:
    """(patches,) the forces left (n,3) inside each patch over the norm of its own triangles' forces.

    Of a patch with several islands, the worst one counts.
    """
    island = islands(surface.topology)[classes.active]
    own = squared_forces(surface, classes, surface.vertices)[: len(island)]
    island_of_vertex = np.zeros(surface.n, dtype=np.int64)
    island_of_vertex[classes.topology.faces] = island[:, None]
    inside = left * (classes.kind == SHEET)[:, None]
    out = np.zeros(len(surface.patches))
    np.maximum.at(out, classes.patch_of_face, ratios(inside, island_of_vertex, own, island)[island])
    return np.sqrt(out)


def ratios(left: Floats, part: Ints, own: Floats, part_of_face: Ints) -> Floats:
    """(k,) Σ left² of the vertices in each part over Σ own of its faces; 0 without faces that pull."""
    count = 1 + max(int(part.max(initial=0)), int(part_of_face.max(initial=0)))
    total = np.bincount(part, np.einsum("ij,ij->i", left, left), count)
    scale = np.bincount(part_of_face, own, count)
    return np.asarray(np.divide(total, scale, out=np.zeros(count), where=scale > 0.0))


def islands(topo: Topology) -> Ints:
    """(m,) the island of each face: faces of one patch that hang together by edges.

    >>> from pcmc.surface.topology import topology
    >>> faces = np.array([[0, 1, 2], [2, 1, 3], [2, 3, 4], [5, 6, 7]])
    >>> islands(topology(faces, np.array([0, 0, 1, 0]), 8)).tolist()
    [0, 0, 1, 2]
    """
    patch = np.repeat(topo.patch_of_face.astype(np.int64), 3)
    key = topo.edge_of_face.ravel() * (patch.max() + 1) + patch
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    return components(np.stack([order[same], order[same + 1]], axis=1) // 3, len(topo.faces))
