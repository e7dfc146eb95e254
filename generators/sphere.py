"""A closed bubble: the sphere of radius 2α, where unit pressure and tension balance."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Surface
from pcmc.base import validate
from pcmc.base.arrays import Floats, Ints

from .builder import Builder
from .exact import ExactSolution, Sphere

STRETCH = (1.05, 1.0, 0.95)  # clearly not a sphere, yet near enough to find it again
_GOLDEN = 0.5 * (1.0 + 5.0**0.5)


def sphere(edge_length: float = 0.4, *, alpha: float = 1.0, exact: bool = False) -> Surface:
    """A geodesic sphere of radius 2α about the origin, stretched to an ellipsoid; nothing is held.

    An equilibrium of index 1: E falls when the radius grows or shrinks.

    Parameters
    ----------
    edge_length : length.
    alpha : tension of "bubble", force/length.
    exact : leave the vertices on the sphere; otherwise stretch it by 1.05, 1 and 0.95 along the axes.

    >>> surface = sphere(exact=True)
    >>> bool(sphere_exact().distance(surface).max() < 1e-12), surface.free.all()
    (True, np.True_)
    """
    radius = 2.0 * validate.positive("alpha", alpha)
    icosahedron_edge = 2.0 / np.hypot(1.0, _GOLDEN)
    edge_length = validate.positive("edge_length", edge_length)
    frequency = max(1, round(icosahedron_edge * radius / edge_length))
    directions, faces = geodesic(frequency)
    mesh = Builder()
    points = mesh.add_points(radius * directions * (1.0 if exact else np.array(STRETCH)))
    mesh.add_faces(points[faces], 0)
    return mesh.closed_surface([Patch("bubble", alpha)])


def sphere_exact(*, alpha: float = 1.0) -> ExactSolution:
    """Radius 2α: A = 16 π α², V = (32/3) π α³, E = (16/3) π α³; index 1.

    >>> ball = sphere_exact()
    >>> round(ball.energy / np.pi, 12), ball.height
    (5.333333333333, 4.0)
    """
    radius = 2.0 * validate.positive("alpha", alpha)
    area, volume = 4.0 * np.pi * radius**2, 4.0 / 3.0 * np.pi * radius**3
    shapes = {"bubble": Sphere((0.0, 0.0, 0.0), radius)}
    return ExactSolution(alpha * area - volume, area, volume, 2.0 * radius, shapes, 1)


def geodesic(frequency: int) -> tuple[Floats, Ints]:
    """Directions (k,3) and faces (f,3) of an icosahedron with its edges in ``frequency`` parts.

    >>> directions, faces = geodesic(2)
    >>> len(directions), len(faces)
    (42, 80)
    """
    corners, sides = _icosahedron()
    f = frequency
    a, b = (x.ravel() for x in np.meshgrid(np.arange(f + 1), np.arange(f + 1), indexing="ij"))
    inside = a + b <= f
    weights = np.stack([f - a - b, a, b], axis=1)[inside] / f
    number = np.full((f + 2, f + 2), -1)
    number[a[inside], b[inside]] = np.arange(np.count_nonzero(inside))
    i, j = np.nonzero(number[1:, :-1] >= 0)
    upright = np.stack([number[i, j], number[i + 1, j], number[i, j + 1]], axis=1)
    i, j = np.nonzero(number[1:, 1:] >= 0)
    inverted = np.stack([number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]], axis=1)
    tile = np.concatenate([upright, inverted])
    points = np.einsum("wc,scd->swd", weights, corners[sides]).reshape(-1, 3)
    points /= np.linalg.norm(points, axis=1)[:, None]
    faces = (tile + len(weights) * np.arange(len(sides))[:, None, None]).reshape(-1, 3)
    _, first, same = np.unique(points.round(9), axis=0, return_index=True, return_inverse=True)
    return points[first], same.ravel()[faces]


def _icosahedron() -> tuple[Floats, Ints]:
    """Corners (12,3) and faces (20,3), counter-clockwise from outside."""
    rectangle = np.array([[0, s, t * _GOLDEN] for s in (-1, 1) for t in (-1, 1)])
    corners = np.concatenate([np.roll(rectangle, k, axis=1) for k in range(3)])
    near = np.linalg.norm(corners[:, None] - corners, axis=2) < 2.1
    i, j, k = np.nonzero(near[:, :, None] & near[None] & near[:, None])
    triples = np.stack([i, j, k], axis=1)[(i > j) & (j > k)]
    inward = np.linalg.det(corners[triples]) < 0.0
    triples[inward] = triples[inward][:, ::-1]
    return corners, triples
