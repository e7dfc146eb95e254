"""Surfaces in closed form: energy, area, volume, height, and the shape of each patch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pcmc import Surface
from pcmc.base.arrays import Floats


class Shape(Protocol):
    """What a patch is a part of."""

    def distance(self, points: Floats) -> Floats:
        """(k,) distance of points (k,3) from the shape, length."""


@dataclass(frozen=True)
class Sphere:
    """A sphere: centre (x, y, z) and radius, lengths."""

    centre: tuple[float, float, float]
    radius: float

    @property
    def floor_radius(self) -> float:
        """Radius of its circle on Π (z = 0), length."""
        return float(np.sqrt(self.radius**2 - self.centre[2] ** 2))

    def project(self, points: Floats) -> Floats:
        """(k,2) stereographic projection of points (k,3) on the sphere from its lowest point.

        Angles are preserved; lengths are those of the sphere at its top.
        """
        q = (points - np.array(self.centre)) / self.radius
        return self.radius * 2.0 * q[:, :2] / (1.0 + q[:, 2:])

    def lift(self, projections: Floats) -> Floats:
        """(k,3) points on the sphere with these stereographic projections (k,2).

        >>> Sphere((0.0, 0.0, 1.0), 2.0).lift(np.array([[0.0, 0.0]])).tolist()
        [[0.0, 0.0, 3.0]]
        """
        w = projections / (2.0 * self.radius)
        s = (w**2).sum(axis=1, keepdims=True)
        unit = np.concatenate([2.0 * w, 1.0 - s], axis=1) / (1.0 + s)
        return self.radius * unit + np.array(self.centre)

    def distance(self, points: Floats) -> Floats:
        """(k,) distance of points (k,3) from the sphere, length.

        >>> Sphere((0.0, 0.0, 1.0), 2.0).distance(np.array([[0, 0, 0.0]])).tolist()
        [1.0]
        """
        return np.abs(np.linalg.norm(points - np.array(self.centre), axis=1) - self.radius)


@dataclass(frozen=True)
class UprightPlane:
    """The plane of all points with this x, perpendicular to Π."""

    x: float = 0.0

    def distance(self, points: Floats) -> Floats:
        """(k,) distance of points (k,3) from the plane, length."""
        return np.abs(points[:, 0] - self.x)


@dataclass(frozen=True)
class FlatPlane:
    """The plane through the origin with this unit normal."""

    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def distance(self, points: Floats) -> Floats:
        """(k,) distance of points (k,3) from the plane, length."""
        return np.abs(points @ np.array(self.normal))


@dataclass(frozen=True)
class ExactSolution:
    """A surface in closed form.

    Attributes
    ----------
    energy : E = Σ α A - V, force·length.
    area : A of all patches together, length².
    volume : V under pressure, length³.
    height : of the highest point over Π (or over the lowest point of a closed surface), length.
    shapes : the sphere, plane, surface of revolution or minimal surface that contains each patch, by
        the patch's name.
    index : Morse index of E with the supports of the generator; rigid motions that no support resists
        are not counted. None where no theorem gives it.
    """

    energy: float
    area: float
    volume: float
    height: float
    shapes: Mapping[str, Shape]
    index: int | None = None

    def distance(self, surface: Surface) -> Floats:
        """(n,) distance of each vertex from the shape of its patch, length; the largest of several."""
        largest = np.zeros(surface.n)
        for i, patch in enumerate(surface.patches):
            vertices = np.unique(surface.faces[surface.patch_of_face == i])
            distance = self.shapes[patch.name].distance(surface.vertices[vertices])
            largest[vertices] = np.maximum(largest[vertices], distance)
        return largest
