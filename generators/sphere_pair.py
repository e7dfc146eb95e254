"""Two spheres cut where they meet and at Π, with the wall below: Example 2 and the joined caps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pcmc.base.arrays import Floats, Ints
from pcmc.base.errors import OptionError

from .builder import Builder
from .exact import Sphere
from .meshing import fill

LEFT, RIGHT, WALL = range(3)


@dataclass(frozen=True)
class Arc:
    """The part above Π of the circle in which two spheres meet.

    Attributes
    ----------
    middle, radius : of the circle.
    up : unit vector from the middle to the highest point.
    angle : from there to where the circle crosses Π, radians.
    """

    middle: Floats
    radius: float
    up: Floats
    angle: float

    def points(self, segments: int) -> Floats:
        """(segments + 1, 3) points of the arc, from -y to +y, ends exactly on Π."""
        phi = self.angle * np.arange(-segments, segments + 1, 2) / segments
        arc = np.outer(np.cos(phi), self.up) + np.outer(np.sin(phi), [0.0, 1.0, 0.0])
        arc = self.middle + self.radius * arc
        arc[[0, -1], 2] = 0.0
        return arc


def intersection(left: Sphere, right: Sphere) -> Arc:
    """Where two spheres with their centres in the plane y = 0 meet above Π.

    >>> arc = intersection(Sphere((-5.0, 0.0, -17.5), 18.5), Sphere((3.0, 0.0, -7.5), 8.5))
    >>> arc.points(2).round(4).tolist()
    [[0.25, -2.9047, 0.0], [-0.2121, 0.0, 0.3697], [0.25, 2.9047, 0.0]]
    """
    across = np.subtract(right.centre, left.centre)
    length = float(np.linalg.norm(across))
    across /= length if length > 0.0 else 1.0
    share = (length**2 + left.radius**2 - right.radius**2) / (2.0 * length) if length > 0.0 else 0.0
    square = left.radius**2 - share**2
    middle = np.array(left.centre) + share * across
    up = np.array([-across[2], 0.0, across[0]])
    if not (length > 0.0 and square > 0.0 and up[2] > 0.0 and abs(middle[2]) < square**0.5 * up[2]):
        raise OptionError(
            f"the spheres of radius {left.radius:g} and {right.radius:g} do not meet in an arc that"
            " stands on the plane z = 0; bring their centres nearer to each other or to the plane",
            what="spheres",
            found=(left, right),
        )
    radius = float(np.sqrt(square))
    return Arc(middle, radius, up, float(np.arccos(-middle[2] / (radius * up[2]))))


def balanced_offsets(
    alpha_left: float, alpha_right: float, alpha_wall: float
) -> tuple[tuple[float, float], float]:
    """Distances from the wall of the centres of two spheres in balance, and the squared rim radius.

    The spheres have radius 2 α and the wall between is plane. Forces balance where the distances add
    up to 2 α_wall; both spheres contain the rim of the wall. The square is ≤ 0 where there is none.

    >>> balanced_offsets(1.0, 1.0, 1.0)
    ((1.0, 1.0), 3.0)
    """
    offset = alpha_wall + (alpha_left**2 - alpha_right**2) / alpha_wall
    return (offset, 2.0 * alpha_wall - offset), 4.0 * alpha_left**2 - offset**2


def build_pair(
    left: Sphere, right: Sphere, edge_length: float, upright: bool
) -> tuple[Builder, Ints, Ints]:
    """The mesh of both caps and their wall, its fixed vertices and its sliding ones.

    ``upright`` walls drop to Π; the others stay in the plane of the circle where the spheres meet.
    """
    arc = intersection(left, right)
    mesh = Builder()
    top = arc.points(_segments(2.0 * arc.angle * arc.radius, edge_length))
    junction = mesh.add_points(top)
    fixed = [junction[[0, -1]]]
    for patch, sphere, sign in ((LEFT, left, -1.0), (RIGHT, right, 1.0)):
        floor = mesh.add_points(_floor_arc(sphere, top[-1], sign, edge_length))
        fixed.append(floor)
        rim = np.concatenate([junction, floor])
        # projected lengths grow from the top to the rim: take the mean
        lowest = mesh.positions(rim)[:, 2].min()
        shrinking = 0.5 * (1.0 + (lowest - sphere.centre[2]) / sphere.radius)
        outline = sphere.project(mesh.positions(rim))
        inner, faces = fill([outline], edge_length / np.sqrt(min(1.0, shrinking)))
        numbers = np.concatenate([rim, mesh.add_points(sphere.lift(inner))])
        mesh.add_faces(numbers[faces], patch)
    foot = top * [1.0, 1.0, 0.0]
    if not upright:
        foot[:, 0] = top[0, 0]
    sliding = mesh.add_wall(WALL, junction, foot, edge_length)
    return mesh, np.concatenate(fixed), sliding


def _floor_arc(sphere: Sphere, corner: Floats, sign: float, edge_length: float) -> Floats:
    """The sphere's circle on Π from the corner at +y round to the one at -y, without its ends."""
    # angles count from the far side, so that both halves are mirror images to the last bit
    x, radius = sphere.centre[0], sphere.floor_radius
    half = np.arctan2(corner[1], sign * (corner[0] - x))
    segments = _segments(2.0 * half * radius, edge_length)
    turn = half * np.arange(segments, -segments - 1, -2)[1:-1] / segments
    return np.stack([x + sign * radius * np.cos(turn), radius * np.sin(turn), 0.0 * turn], axis=1)


def _segments(length: float, edge_length: float) -> int:
    return max(2, round(length / edge_length))
