"""What a closed form knows about its surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pcmc import Surface
from pcmc.base.arrays import Floats


@dataclass(frozen=True)
class Sphere:
    """A sphere: centre (x, y, z) and radius, lengths."""

    centre: tuple[float, float, float]
    radius: float

    def distance(self, points: Floats) -> Floats:
        """(k,) distance of points (k,3) from the sphere, length.

        >>> Sphere((0.0, 0.0, 1.0), 2.0).distance(np.array([[0, 0, 0.0]])).tolist()
        [1.0]
        """
        return np.abs(np.linalg.norm(points - np.array(self.centre), axis=1) - self.radius)


@dataclass(frozen=True)
class UprightPlane:
    """The plane at x, upright on Π."""

    x: float = 0.0

    def distance(self, points: Floats) -> Floats:
        """(k,) distance of points (k,3) from the plane, length."""
        return np.abs(points[:, 0] - self.x)


@dataclass(frozen=True)
class Exact:
    """A surface in closed form.

    Attributes
    ----------
    energy : E = Σ α A - V, force·length.
    area : A of all patches together, length².
    volume : V under pressure, length³.
    height : of the highest point over Π (or over the lowest point of a closed surface), length.
    shapes : the sphere or plane that each patch is a part of, by the patch's name.
    """

    energy: float
    area: float
    volume: float
    height: float
    shapes: Mapping[str, Sphere | UprightPlane]

    def distance(self, surface: Surface) -> Floats:
        """(n,) how far each vertex lies from the shape of its patch, length.

        Where patches meet, the largest of the distances.
        """
        largest = np.zeros(surface.n)
        for i, patch in enumerate(surface.patches):
            used = np.unique(surface.faces[surface.patch_of_face == i])
            apart = self.shapes[patch.name].distance(surface.vertices[used])
            largest[used] = np.maximum(largest[used], apart)
        return largest
