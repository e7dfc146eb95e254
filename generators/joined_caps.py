"""Two joined caps in closed form; every condition of a P-CMC surface holds exactly."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Surface
from pcmc.base import validate
from pcmc.base.errors import OptionError

from .exact import ExactSolution, Shape, Sphere, UprightPlane
from .sphere_pair import balanced_offsets, build_pair

RISE = 0.7  # of the exact height: a start that is clearly not the solution, yet near enough to reach it


def joined_caps(
    edge_length: float = 0.5,
    *,
    alpha_left: float = 4.0,
    alpha_right: float = 3.0,
    alpha_aux: float = 3.0,
    depth: float = 4.5,
    exact: bool = False,
) -> Surface:
    """Two caps over arcs on Π and the wall x = 0 between them, lower at first than at rest.

    At rest the caps are parts of spheres of radius 2 α_left and 2 α_right with their centres at the
    same depth below Π and 2 α_aux apart: `joined_caps_exact`. (4, 3, 3) at depth 4.5 is stable,
    (4, 3, 2) at 4 close to neutral, (4, 4, 1) at 5 a saddle.

    Parameters
    ----------
    edge_length : length.
    alpha_left, alpha_right, alpha_aux : tension of the patches "left", "right" and "wall".
    depth : of both centres below Π, length.
    exact : put the vertices on the exact solution; otherwise heights are 0.7 of it.

    >>> surface = joined_caps(1.0, exact=True)
    >>> bool(joined_caps_exact().distance(surface).max() < 1e-12)
    True
    """
    edge_length = validate.positive("edge_length", edge_length)
    left, right = _spheres(alpha_left, alpha_right, alpha_aux, depth)
    mesh, fixed, sliding = build_pair(left, right, edge_length, upright=True)
    patches = [Patch("left", alpha_left), Patch("right", alpha_right), Patch("wall", alpha_aux, pressure=0.0)]
    surface = mesh.surface(patches, fixed=fixed, on_plane=sliding)
    return surface if exact else surface.moved(surface.vertices * [1.0, 1.0, RISE])


def joined_caps_exact(
    *, alpha_left: float = 4.0, alpha_right: float = 3.0, alpha_aux: float = 3.0, depth: float = 4.5
) -> ExactSolution:
    """Energy, area, volume and height of the two joined caps, and their spheres.

    Areas follow from Gauss-Bonnet on the sphere, volumes from the divergence theorem.

    >>> round(joined_caps_exact().height, 12), joined_caps_exact().shapes["left"].radius
    (3.5, 8.0)
    """
    spheres = _spheres(alpha_left, alpha_right, alpha_aux, depth)
    offsets = -spheres[0].centre[0], spheres[1].centre[0]
    wall_radius = float(np.sqrt(spheres[0].radius ** 2 - offsets[0] ** 2))
    (left, left_volume), (right, right_volume) = (
        _part(sphere.radius, offset, depth) for sphere, offset in zip(spheres, offsets, strict=True)
    )
    wall, volume = _segment(wall_radius, depth), left_volume + right_volume
    tops = [s.radius - depth for s, offset in zip(spheres, offsets, strict=True) if offset > 0.0]
    shapes: dict[str, Shape] = {
        "left": spheres[0],
        "right": spheres[1],
        "wall": UprightPlane(),
    }
    energy = alpha_left * left + alpha_right * right + alpha_aux * wall - volume
    height = max(wall_radius - depth, *tops)
    return ExactSolution(energy, left + right + wall, volume, height, shapes)


def _spheres(alpha_left: float, alpha_right: float, alpha_aux: float, depth: float) -> tuple[Sphere, Sphere]:
    """The spheres of both caps; the wall is at x = 0."""
    validate.positive("depth", depth)
    validate.positive("alpha_left", alpha_left)
    validate.positive("alpha_right", alpha_right)
    validate.positive("alpha_aux", alpha_aux)
    (left, right), square = balanced_offsets(alpha_left, alpha_right, alpha_aux)
    if square <= depth**2:
        raise OptionError(
            f"tensions {alpha_left:g}, {alpha_right:g}, {alpha_aux:g} at depth {depth:g}: the"
            " spheres do not meet above the plane; take a smaller depth, or a wall tension"
            " between the difference and the sum of the others",
            what="depth",
            found=depth,
            expected=float(np.sqrt(max(square, 0.0))),
        )
    return (Sphere((-left, 0.0, -depth), 2.0 * alpha_left), Sphere((right, 0.0, -depth), 2.0 * alpha_right))


def _part(radius: float, offset: float, depth: float) -> tuple[float, float]:
    """Area and volume of the part of a ball higher than ``depth`` over its centre, up to x = ``offset``.

    Gauss-Bonnet: A/r² = 2π - Σ turning angles - Σ ∫ geodesic curvature. Both edges are circles; one
    at distance d from the centre has geodesic curvature d/(r √(r² - d²)), positive if it bulges.
    """
    floor_radius = float(np.sqrt(radius**2 - depth**2))
    wall_radius = float(np.sqrt(radius**2 - offset**2))
    corner = float(np.sqrt(radius**2 - depth**2 - offset**2))
    floor_angle = 2.0 * float(np.arctan2(corner, offset))  # of the floor's circle that is cut away
    wall_angle = 2.0 * float(np.arctan2(corner, depth))
    floor_turn = depth / radius * (2.0 * np.pi - floor_angle)
    wall_turn = -offset / radius * wall_angle
    turning = float(np.arccos(depth * offset / (floor_radius * wall_radius)))
    area = radius**2 * (2.0 * np.pi - floor_turn - wall_turn - 2.0 * turning)
    floor = np.pi * floor_radius**2 - _segment(floor_radius, offset)
    volume = (radius * area - depth * floor + offset * _segment(wall_radius, depth)) / 3.0
    return area, float(volume)


def _segment(radius: float, distance: float) -> float:
    """Area of the part of a disc beyond a chord at a signed distance from its middle, length²."""
    return float(radius**2 * np.arccos(distance / radius) - distance * np.sqrt(radius**2 - distance**2))
