"""A patch over a disc, part of the sphere of radius 2α: the simplest surface in closed form."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Surface
from pcmc.base import validate
from pcmc.base.errors import OptionError

from .builder import Builder
from .exact import ExactSolution, Sphere
from .ring_mesh import cap_directions, ring_mesh


def spherical_cap(
    edge_length: float = 0.1,
    *,
    radius: float = 1.0,
    alpha: float = 0.6,
    height: float | None = None,
    upper: bool = False,
    exact: bool = False,
) -> Surface:
    """A patch with a fixed circle on Π, as a dome whose height is not that of the equilibrium.

    Its equilibrium, for α ≥ radius/2, is ``spherical_cap_exact``.

    Parameters
    ----------
    edge_length, radius : lengths; there are radius / edge_length rings, ring k of 6 k segments.
    alpha : tension of "cap", force/length.
    height : of the initial dome, a part of a sphere; 0.3 radius unless given. It may exceed the
        radius: more than a hemisphere.
    upper : with ``exact``, the higher of the two equilibria, more than a hemisphere.
    exact : put the vertices on the exact solution.

    Raises
    ------
    OptionError
        With ``exact`` if α < radius/2: there is no solution.

    >>> surface = spherical_cap(0.25, exact=True)
    >>> bool(abs(surface.vertices[0, 2] - spherical_cap_exact().height) < 1e-12)
    True
    """
    edge_length = validate.positive("edge_length", edge_length)
    radius = validate.positive("radius", radius)
    if exact:
        height = spherical_cap_exact(radius=radius, alpha=alpha, upper=upper).height
    dome = 0.3 * radius if height is None else validate.positive("height", height)
    ball = (radius**2 + dome**2) / (2.0 * dome)
    opening = 2.0 * np.arctan2(dome, radius)  # from the pole to the rim, seen from the centre
    rings = max(2, round(radius / edge_length))
    net = ring_mesh(6 * np.arange(1, rings + 1))
    points = ball * cap_directions(net, opening) + [0.0, 0.0, dome - ball]
    rim = np.arange(len(points) - 6 * rings, len(points))
    points[rim, 2] = 0.0
    mesh = Builder()
    mesh.add_faces(mesh.add_points(points)[net.faces], 0)
    return mesh.surface([Patch("cap", alpha)], fixed=rim)


def spherical_cap_exact(*, radius: float = 1.0, alpha: float = 0.6, upper: bool = False) -> ExactSolution:
    """The sphere of radius 2α through the circle: height h = 2α ∓ √(4α² - radius²).

    A = 4π α h and V = π h² (6α - h) / 3. The lower cap (-) is stable; the upper one, with ``upper``,
    has index 1. They meet at the hemisphere, α = radius/2.

    >>> cap = spherical_cap_exact()
    >>> round(cap.energy, 10), round(cap.height, 10)
    (1.5039191689, 0.5366750419)
    """
    radius = validate.positive("radius", radius)
    alpha = validate.positive("alpha", alpha)
    if 2.0 * alpha < radius:
        raise OptionError(
            f"alpha must be at least radius/2 = {radius / 2:g}, found {alpha:g}: below the"
            " hemisphere's tension a cap has no equilibrium",
            what="alpha",
            found=alpha,
            expected=radius / 2,
        )
    h = 2.0 * alpha + (1.0 if upper else -1.0) * float(np.sqrt(4.0 * alpha**2 - radius**2))
    area = 4.0 * np.pi * alpha * h
    volume = np.pi * h**2 * (6.0 * alpha - h) / 3.0
    ball = Sphere((0.0, 0.0, h - 2.0 * alpha), 2.0 * alpha)
    return ExactSolution(alpha * area - volume, area, volume, h, {"cap": ball}, int(upper))
