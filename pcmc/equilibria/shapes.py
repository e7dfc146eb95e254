"""The distance between two shapes, whatever the place of their vertices along them.

Vertices that slide along a surface do not change it. So a vertex is compared with the nearest point of the
other surface, not with the vertex of its number.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import SurfaceError
from ..forces.pinching import standing_part
from ..surface import Surface, expect_surface
from ..surface.distance import distances
from ..surface.geometry import edge_vectors, vertex_area_vectors

SAME = 0.25  # of the mean edge: two shapes nowhere farther apart are one, as far as the mesh can tell
# Caps of three rings and Enneper's surface of five, at rest with other triangles after other ways, are up to
# 0.14 and 0.2 edges apart. Means do not tell: a wall that leans is a small part of its roof.


@dataclass(frozen=True, eq=False)
class Shape:
    """A surface as a set of points: triangles F (m,3) with corners X (n,3)."""

    X: Floats
    F: Ints

    @classmethod
    def of(cls, surface: Surface) -> Shape:
        """That of the part of a surface that stands."""
        part = standing_part(surface)
        return cls(part.surface.vertices, part.classes.faces)

    @cached_property
    def area(self) -> Floats:
        """(n,) the area around each vertex."""
        return vertex_area_vectors(self.X, self.F)[1]

    @cached_property
    def edge(self) -> float:
        """The mean length of the triangles' edges."""
        return float(np.linalg.norm(edge_vectors(self.X[self.F]), axis=-1).mean())

    def same_as(self, other: Shape) -> bool:
        """Whether both are one shape, as far as their meshes can tell."""
        pairs = ((self, other), (other, self))
        farthest = max(distances(one.X[np.unique(one.F)], its.X, its.F).max() for one, its in pairs)
        return bool(farthest <= SAME * max(self.edge, other.edge))

    def distance(self, other: Shape) -> float:
        """The root mean square distance of each surface's points from the other, by area, both ways."""
        pairs = ((self, other), (other, self))
        squares = [np.average(distances(one.X, its.X, its.F) ** 2, weights=one.area) for one, its in pairs]
        return float(np.sqrt(np.mean(squares)))


def shape_distance(one: Surface, other: Surface) -> float:
    """The root mean square distance of each of two surfaces from the other, by area, both ways, length.

    0 for two meshes of one flat shape; of second order in the edge length for two of one curved shape.

    >>> from pcmc import Patch
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> one, other = (Surface(square, faces, [0, 0], [Patch("film", 1.0)], fixed=[0])
    ...               for faces in ([[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]))
    >>> shape_distance(one, other)
    0.0
    >>> round(shape_distance(one, one.moved(one.vertices + [0.0, 0.0, 0.5])), 12)
    0.5
    """
    for name, surface in (("one", one), ("other", other)):
        expect_surface(surface)
        if not Shape.of(surface).area.any():
            raise SurfaceError(f"shape_distance: surface {name!r} has no area", what=name, found=0.0)
    return Shape.of(one).distance(Shape.of(other))
