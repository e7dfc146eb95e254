"""Surfaces of revolution about z: their meshes, and what their meridians say of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.integrate import simpson
from scipy.interpolate import CubicSpline
from scipy.linalg import eigvalsh_tridiagonal
from scipy.spatial import cKDTree

from pcmc import Patch, Surface
from pcmc.base.arrays import Floats, Ints

from .builder import Builder
from .exact import ExactSolution

SAMPLES = 4001  # of a meridian, an odd number
SWELL = 1.01  # of the radii: a start that is clearly not the solution, yet near enough to reach it


@dataclass(frozen=True, eq=False)
class Meridian:
    """Radii r and heights z at equal steps of arc length s, the normal to the right of the way.

    The surface of revolution has area 2π ∫ r ds, and the cone from the origin over it the volume
    (2π/3) ∫ (r z' - z r') r ds.
    """

    r: Floats
    z: Floats
    length: float

    @cached_property
    def tangent(self) -> Floats:
        """(k,2) r' and z'."""
        s = np.linspace(0.0, self.length, len(self.r))
        along = np.asarray(CubicSpline(s, np.column_stack([self.r, self.z]))(s, 1))
        return along / np.linalg.norm(along, axis=1)[:, None]

    @property
    def area(self) -> float:
        """A, length²."""
        return float(2.0 * np.pi * simpson(self.r, dx=self.length / (len(self.r) - 1)))

    @property
    def volume(self) -> float:
        """V of the cone from the origin over the surface, length³."""
        rate = (self.r * self.tangent[:, 1] - self.z * self.tangent[:, 0]) * self.r
        return float(2.0 * np.pi / 3.0 * simpson(rate, dx=self.length / (len(self.r) - 1)))

    @property
    def volume_below(self) -> float:
        """∫ z ⟨ν, n⟩ dA = -2π ∫ z r' r ds between the surface and z = 0, length³."""
        rate = -self.z * self.tangent[:, 0] * self.r
        return float(2.0 * np.pi * simpson(rate, dx=self.length / (len(self.r) - 1)))

    def distance(self, points: Floats) -> Floats:
        """(k,) distance of points (k,3) from the surface, length."""
        flat = np.column_stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]])
        nearest = cKDTree(np.column_stack([self.r, self.z])).query(flat)[1]
        off = flat - np.column_stack([self.r, self.z])[nearest]
        tangent = self.tangent[nearest]
        return np.abs(off[:, 0] * tangent[:, 1] - off[:, 1] * tangent[:, 0])

    def index(self, curvature_sum: float) -> int:
        """Morse index where both ends are held and the principal curvatures have this sum (p/α).

        A normal motion φ(s) cos(mθ) changes E by half of α times

            ∫ r φ'² + (m²/r - r |A|²) φ² ds,   |A|² = κ² + (p/α - κ)²,   κ = z'/r.

        The negative eigenvalues of this form, φ = 0 at the ends, are counted for every m.

        >>> straight = Meridian(np.ones(2001), np.linspace(0.0, 6.5, 2001), 6.5)
        >>> straight.index(1.0)
        2
        """
        step = self.length / (len(self.r) - 1)
        r, across = self.r, self.tangent[:, 1] / self.r
        square = across**2 + (curvature_sum - across) ** 2
        between = 0.5 * (r[1:] + r[:-1]) / step**2
        count, m = 0, 0
        while True:
            diagonal = between[1:] + between[:-1] + (m**2 / r - r * square)[1:-1]
            low = -1.0 - 2.0 * float(np.abs(diagonal).max())
            negative = len(
                eigvalsh_tridiagonal(diagonal, -between[1:-1], select="v", select_range=(low, 0.0))
            )
            if negative == 0:
                return count
            count += negative if m == 0 else 2 * negative
            m += 1

    def solution(self, name: str, alpha: float, pressure: float, index: int | None = None) -> ExactSolution:
        """E = αA - pV and the rest, for a patch that is this surface; V counts under pressure only."""
        volume = self.volume if pressure else 0.0
        energy = alpha * self.area - pressure * volume
        count = self.index(pressure / alpha) if index is None else index
        return ExactSolution(energy, self.area, volume, float(self.z.max()), {name: self}, count)


def tube(meridian: Meridian, edge_length: float, patch: Patch, *, neck_slides: bool = False) -> Surface:
    """Rings of vertices along a meridian, equally many in each, turned by half a segment each time.

    Both ends are fixed. With ``neck_slides`` the first ring slides on Π.
    """
    around = max(6, round(2.0 * np.pi * float(meridian.r.max()) / edge_length))
    half_rows = max(1, round(meridian.length / (np.sqrt(3.0) * edge_length)))
    rows = (
        max(1, round(meridian.length * 2.0 / (np.sqrt(3.0) * edge_length))) if neck_slides else 2 * half_rows
    )
    row = np.arange(rows + 1)
    at = np.linspace(0.0, 1.0, len(meridian.r))
    r, z = (np.interp(row / rows, at, values) for values in (meridian.r, meridian.z))
    turn = 2.0 * np.pi * (np.arange(around) + 0.5 * (row % 2)[:, None]) / around
    X = np.stack([r[:, None] * np.cos(turn), r[:, None] * np.sin(turn), z[:, None] + 0.0 * turn], axis=-1)
    mesh = Builder()
    number = mesh.add_points(X).reshape(rows + 1, around)
    mesh.add_faces(_tube_faces(number), 0)
    if neck_slides:
        return mesh.surface([patch], fixed=number[-1], on_plane=number[0])
    return mesh.surface([patch], fixed=number[[0, -1]].ravel())


def _tube_faces(number: Ints) -> Ints:
    """(f,3) triangles between rings of vertices, counter-clockwise from outside."""
    a, b = number[:-1], np.roll(number[:-1], -1, axis=1)
    c, d = number[1:], np.roll(number[1:], -1, axis=1)
    even = (np.arange(len(a)) % 2 == 0)[:, None, None]
    first = np.where(even, np.stack([a, b, c], -1), np.stack([a, b, d], -1))
    second = np.where(even, np.stack([b, d, c], -1), np.stack([a, d, c], -1))
    return np.stack([first, second], axis=2).reshape(-1, 3)


def swollen(surface: Surface) -> Surface:
    """The surface with its free vertices a little farther from the z axis."""
    X = surface.vertices.copy()
    X[~surface.fixed, :2] *= SWELL
    return surface.moved(X)
