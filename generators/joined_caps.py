"""Two joined caps in closed form: every condition of a P-CMC surface holds exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pcmc import Patch, Surface
from pcmc.base import validate
from pcmc.base.errors import OptionError

from .exact import Exact, Sphere, UprightPlane
from .sphere_pair import Ball, build_pair

RISE = 0.7  # of the exact height: a start that is plainly not the solution, and near enough to it


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
    pair = _Pair.of(alpha_left, alpha_right, alpha_aux, depth)
    left = Ball(-pair.left_offset, -depth, 2.0 * alpha_left)
    right = Ball(pair.right_offset, -depth, 2.0 * alpha_right)
    mesh, fixed, sliding = build_pair(left, right, edge_length, upright=True)
    patches = [
        Patch("left", alpha_left),
        Patch("right", alpha_right),
        Patch("wall", alpha_aux, pressure=0.0),
    ]
    surface = mesh.surface(patches, fixed=fixed, on_plane=sliding)
    return surface if exact else surface.moved(surface.vertices * [1.0, 1.0, RISE])


def joined_caps_exact(
    *,
    alpha_left: float = 4.0,
    alpha_right: float = 3.0,
    alpha_aux: float = 3.0,
    depth: float = 4.5,
) -> Exact:
    """Energy, area, volume and height of the two joined caps, and their spheres.

    Areas follow from Gauss-Bonnet on the sphere, volumes from the divergence theorem.

    >>> round(joined_caps_exact().height, 12), joined_caps_exact().shapes["left"].radius
    (3.5, 8.0)
    """
    pair = _Pair.of(alpha_left, alpha_right, alpha_aux, depth)
    left, left_volume = _half(2.0 * alpha_left, pair.left_offset, depth)
    right, right_volume = _half(2.0 * alpha_right, pair.right_offset, depth)
    wall = _segment(pair.wall_radius, depth)
    volume = left_volume + right_volume
    tops = [pair.wall_radius - depth]
    tops += [2.0 * alpha_left - depth] if pair.left_offset > 0.0 else []
    tops += [2.0 * alpha_right - depth] if pair.right_offset > 0.0 else []
    shapes: dict[str, Sphere | UprightPlane] = {
        "left": Sphere((-pair.left_offset, 0.0, -depth), 2.0 * alpha_left),
        "right": Sphere((pair.right_offset, 0.0, -depth), 2.0 * alpha_right),
        "wall": UprightPlane(),
    }
    energy = alpha_left * left + alpha_right * right + alpha_aux * wall - volume
    return Exact(energy, left + right + wall, volume, max(tops), shapes)


@dataclass(frozen=True)
class _Pair:
    """How far each centre is from the wall, and the radius of the circle both spheres share."""

    left_offset: float
    right_offset: float
    wall_radius: float

    @staticmethod
    def of(alpha_left: float, alpha_right: float, alpha_aux: float, depth: float) -> _Pair:
        validate.positive("depth", depth)
        for name, alpha in (
            ("alpha_left", alpha_left),
            ("alpha_right", alpha_right),
            ("alpha_aux", alpha_aux),
        ):
            validate.positive(name, alpha)
        # offsets add up to 2 α_aux, and both triangles with a radius 2 α share the wall's circle
        offset = alpha_aux + (alpha_left**2 - alpha_right**2) / alpha_aux
        square = 4.0 * alpha_left**2 - offset**2
        if square <= depth**2:
            raise OptionError(
                f"tensions {alpha_left:g}, {alpha_right:g}, {alpha_aux:g} at depth {depth:g}: the"
                " spheres do not meet above the plane; take a smaller depth, or a wall tension"
                " between the difference and the sum of the others"
            )
        return _Pair(offset, 2.0 * alpha_aux - offset, float(np.sqrt(square)))


def _half(radius: float, offset: float, depth: float) -> tuple[float, float]:
    """Area and volume of a ball's part above ``depth`` over its centre and up to ``offset`` beyond.

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
    return float(
        radius**2 * np.arccos(distance / radius) - distance * np.sqrt(radius**2 - distance**2)
    )
