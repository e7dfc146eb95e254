"""Two spheres cut where they meet and at Π, with the wall below: Example 2, joined caps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pcmc.base.arrays import Floats, Ints
from pcmc.base.errors import OptionError

from .building import Builder
from .meshing import fill

LEFT, RIGHT, WALL = range(3)


@dataclass(frozen=True)
class Ball:
    """A sphere with its centre in the plane y = 0, at (x, 0, z); lengths."""

    x: float
    z: float
    radius: float

    @property
    def floor_radius(self) -> float:
        """Radius of its circle on Π (z = 0), length."""
        return float(np.sqrt(self.radius**2 - self.z**2))

    def flat(self, points: Floats) -> Floats:
        """(k,2) stereographic picture of points (k,3) on the sphere, seen from its lowest point.

        Angles stay, lengths are those of the sphere at its top.
        """
        q = (points - [self.x, 0.0, self.z]) / self.radius
        return self.radius * 2.0 * q[:, :2] / (1.0 + q[:, 2:])

    def lifted(self, pictures: Floats) -> Floats:
        """(k,3) points on the sphere of the pictures (k,2)."""
        w = pictures / (2.0 * self.radius)
        s = (w**2).sum(axis=1, keepdims=True)
        unit = np.concatenate([2.0 * w, 1.0 - s], axis=1) / (1.0 + s)
        return self.radius * unit + [self.x, 0.0, self.z]


@dataclass(frozen=True)
class Meeting:
    """The circle in which two balls meet: middle, radius, its highest direction, and the angle from
    there to where it crosses Π."""

    middle: Floats
    radius: float
    up: Floats
    angle: float

    def points(self, segments: int) -> Floats:
        """(segments + 1, 3) points of the arc above Π, from -y to +y, ends exactly on Π."""
        phi = self.angle * np.arange(-segments, segments + 1, 2) / segments
        arc = np.outer(np.cos(phi), self.up) + np.outer(np.sin(phi), [0.0, 1.0, 0.0])
        arc = self.middle + self.radius * arc
        arc[[0, -1], 2] = 0.0
        return arc


def meeting(left: Ball, right: Ball) -> Meeting:
    """Where two balls meet above Π.

    >>> circle = meeting(Ball(-5.0, -17.5, 18.5), Ball(3.0, -7.5, 8.5))
    >>> circle.points(2).round(4).tolist()
    [[0.25, -2.9047, 0.0], [-0.2121, 0.0, 0.3697], [0.25, 2.9047, 0.0]]
    """
    across = np.array([right.x - left.x, 0.0, right.z - left.z])
    length = float(np.linalg.norm(across))
    across /= length if length > 0.0 else 1.0
    share = (length**2 + left.radius**2 - right.radius**2) / (2.0 * length) if length > 0.0 else 0.0
    square = left.radius**2 - share**2
    middle = np.array([left.x, 0.0, left.z]) + share * across
    up = np.array([-across[2], 0.0, across[0]])
    if not (length > 0.0 and square > 0.0 and up[2] > 0.0 and abs(middle[2]) < square**0.5 * up[2]):
        raise OptionError(
            f"the spheres of radius {left.radius:g} and {right.radius:g} do not meet in an arc that"
            " stands on the plane z = 0; bring their centres nearer to each other or to the plane"
        )
    radius = float(np.sqrt(square))
    return Meeting(middle, radius, up, float(np.arccos(-middle[2] / (radius * up[2]))))


def build_pair(
    left: Ball, right: Ball, edge_length: float, upright: bool
) -> tuple[Builder, Ints, Ints]:
    """The mesh of both caps and their wall, its fixed vertices and its sliding ones.

    ``upright`` walls drop to Π; the others stay in the plane of the circle where the spheres meet.
    """
    circle = meeting(left, right)
    mesh = Builder()
    arc = circle.points(_segments(2.0 * circle.angle * circle.radius, edge_length))
    junction = mesh.points(arc)
    fixed = [junction[[0, -1]]]
    for patch, ball, sign in ((LEFT, left, -1.0), (RIGHT, right, 1.0)):
        rim = np.concatenate([junction, mesh.points(_floor_arc(ball, arc[-1], sign, edge_length))])
        fixed.append(rim[len(junction) :])
        pictures = ball.flat(mesh.positions(rim))
        # the picture of a length grows from the top to the rim: meet half way
        lowest = 0.5 * (1.0 + (mesh.positions(rim)[:, 2].min() - ball.z) / ball.radius)
        inner, faces = fill([pictures], edge_length / np.sqrt(min(1.0, lowest)))
        numbers = np.concatenate([rim, mesh.points(ball.lifted(inner))])
        mesh.faces(numbers[faces], patch)
    foot = arc * [1.0, 1.0, 0.0]
    if not upright:
        foot[:, 0] = arc[0, 0]
    sliding = mesh.wall(WALL, junction, foot, edge_length)
    return mesh, np.concatenate(fixed), sliding


def _floor_arc(ball: Ball, corner: Floats, sign: float, edge_length: float) -> Floats:
    """The ball's circle on Π from the corner at +y round to the one at -y, ends left out."""
    # angles count from the far side, so that both halves are mirror images to the last bit
    half = np.arctan2(corner[1], sign * (corner[0] - ball.x))
    segments = _segments(2.0 * half * ball.floor_radius, edge_length)
    turn = half * np.arange(segments, -segments - 1, -2)[1:-1] / segments
    x = ball.x + sign * ball.floor_radius * np.cos(turn)
    return np.stack([x, ball.floor_radius * np.sin(turn), 0.0 * turn], axis=1)


def _segments(length: float, edge_length: float) -> int:
    return max(2, round(length / edge_length))
