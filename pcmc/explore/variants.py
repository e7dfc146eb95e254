"""Variants of a roof: the figures of each, and how far one shape is from another."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..base.errors import OptionError
from ..certificate import Certificate
from ..design import Target
from ..design.targets import measure
from ..panels.distance import distances
from ..quantities import Figure, figures
from ..surface import Surface
from ..surface.geometry import area_vectors, vertex_sums

MOST_VARIANTS = 20


@dataclass(frozen=True, eq=False)
class Variant:
    """A surface that is kept, with its name and certificate."""

    name: str
    surface: Surface
    certificate: Certificate

    @cached_property
    def figures(self) -> list[dict[str, Any]]:
        """Its key figures."""
        return figures_data(self.surface, self.certificate)


def figures_data(surface: Surface, certificate: Certificate) -> list[dict[str, Any]]:
    """The key figures of a surface as plain data: quantity, of, owner, dimension and value of each."""
    rows = figures(surface, certificate)
    for cable in surface.cables:
        for quantity in ("length", "sag"):
            with suppress(OptionError):  # a closed cable has no sag
                value = measure(surface, Target(quantity, cable.name)).value
                rows.append(Figure(quantity, cable.name, "cable", value))
    return [row._asdict() | {"dimension": row.dimension} for row in rows]


def difference(surface: Surface, other: Surface) -> Floats:
    """(n,) distance of each vertex from another surface, length; positive outside it, along its normals.

    The meshes may differ. Walls are no part of it, except for the vertices of walls.

    >>> from pcmc import Patch
    >>> corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0.0]])
    >>> flat = Surface(corners, [[0, 1, 2]], [0], [Patch("roof", 1.0)], fixed=[0, 1, 2])
    >>> lower = Surface(corners - [0, 0, 0.5], [[0, 1, 2]], [0], [Patch("roof", 1.0)], fixed=[0, 1, 2])
    >>> difference(flat, lower).tolist(), difference(lower, flat).tolist()
    ([0.5, 0.5, 0.5], [-0.5, -0.5, -0.5])
    """
    roof, other_roof = (s.faces[s.roof[s.patch_of_face]] for s in (surface, other))
    if not (len(roof) and len(other_roof)):
        return _away(surface.vertices, other.vertices, other.faces)
    on_roof = np.zeros(surface.n, dtype=bool)
    on_roof[roof] = True
    away = np.empty(surface.n)
    away[on_roof] = _away(surface.vertices[on_roof], other.vertices, other_roof)  # a wall may be nearer
    away[~on_roof] = _away(surface.vertices[~on_roof], other.vertices, other.faces)
    return away


def _away(points: Floats, Y: Floats, F: Ints) -> Floats:
    """(k,) signed distance of points (k,3) from the triangles F of vertices Y."""
    if not len(points):
        return np.empty(0)
    away = distances(points, Y, F)
    normal, used = vertex_sums(area_vectors(Y[F]), F, len(Y)), np.unique(F)
    nearest = used[cKDTree(Y[used]).query(points)[1]]
    outside = np.einsum("ij,ij->i", points - Y[nearest], normal[nearest]) >= 0.0
    return np.where(outside, away, -away)
