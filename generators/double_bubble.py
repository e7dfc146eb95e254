"""Fig. 1: two closed bubbles with a disc between them, in closed form."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Room, Surface
from pcmc.base import validate
from pcmc.base.arrays import Floats, Ints
from pcmc.base.errors import OptionError

from .builder import Builder
from .exact import ExactSolution, Shape, Sphere, UprightPlane
from .ring_mesh import cap_directions, disc_points, even_segments, ring_mesh
from .sphere import STRETCH
from .sphere_pair import balanced_offsets

LEFT, RIGHT, WALL = range(3)


def double_bubble(
    edge_length: float = 0.4,
    *,
    alpha_left: float = 1.0,
    alpha_right: float = 1.0,
    alpha_aux: float = 1.0,
    volumes: tuple[float, float] | None = None,
    exact: bool = False,
) -> Surface:
    """Two bubbles under the same unit pressure and the flat disc x = 0 they share; nothing is held.

    At rest they are parts of spheres of radius 2 α_left and 2 α_right, their centres 2 α_aux apart
    on the x axis: `double_bubble_exact`.

    Parameters
    ----------
    edge_length : length.
    alpha_left, alpha_right, alpha_aux : tension of the patches "left", "right" and "wall".
    volumes : prescribed for the rooms "left" and "right", length³. Then the bubbles start with these volumes
        together, and their pressures are results.
    exact : put the vertices on the exact solution; otherwise it is stretched by 1.05, 1 and 0.95
        along the axes.

    >>> surface = double_bubble(exact=True)
    >>> bool(double_bubble_exact().distance(surface).max() < 1e-12)
    True
    """
    edge_length, scale = validate.positive("edge_length", edge_length), 1.0
    if volumes is not None:
        free = double_bubble_exact(alpha_left=alpha_left, alpha_right=alpha_right, alpha_aux=alpha_aux)
        scale = float((sum(validate.positive("volumes", v) for v in volumes) / free.volume) ** (1.0 / 3.0))
        edge_length /= scale
    offsets, rim_radius = _offsets(alpha_left, alpha_right, alpha_aux)
    count = int(even_segments(np.array([rim_radius]), edge_length)[0])
    around = 2.0 * np.pi * np.arange(count) / count
    mesh = Builder()
    ring = np.stack([0.0 * around, np.cos(around), np.sin(around)], axis=1)
    rim = mesh.add_points(rim_radius * ring)
    for patch, alpha, sign in ((LEFT, alpha_left, -1.0), (RIGHT, alpha_right, 1.0)):
        opening = np.pi - float(np.arctan2(rim_radius, offsets[patch]))
        points, faces = _bubble(2.0 * alpha, opening, count, edge_length)
        points[:, 0] = sign * (points[:, 0] + offsets[patch])
        _glue(mesh, points, faces[:, :: int(sign)], rim, patch)
    rings = max(1, round(rim_radius / edge_length))
    net = ring_mesh(_segments(rim_radius * np.arange(1, rings + 1) / rings, count, edge_length))
    disc = rim_radius * disc_points(net)
    _glue(mesh, np.column_stack([0.0 * net.angle, disc]), net.faces, rim, WALL)
    patches = [
        Patch("left", alpha_left, 1.0 / scale),
        Patch("right", alpha_right, 1.0 / scale),
        Patch("wall", alpha_aux, pressure=0.0),
    ]
    sides = ((("left", 1), ("wall", 1)), (("right", 1), ("wall", -1)))
    rooms = [Room(signs[0][0], signs, v) for signs, v in zip(sides, volumes or (), strict=False)]
    surface = mesh.closed_surface(patches, rooms)
    stretch = scale * (1.0 if exact else np.array(STRETCH))
    return surface.moved(surface.vertices * stretch)


def double_bubble_exact(
    *, alpha_left: float = 1.0, alpha_right: float = 1.0, alpha_aux: float = 1.0
) -> ExactSolution:
    """Two spheres without the caps that the disc cuts off.

    A = 2π r (r + d) and V = π (r + d)² (2r - d)/3 for each, with r = 2α its radius and d the
    distance of its centre from the disc, negative when it lies in the other bubble. For equal
    tensions the index is 2: at given volumes the double bubble is the minimum (Hutchings, Morgan,
    Ritoré and Ros 2002), and its least area is a concave function of the two volumes (Hutchings 1997).

    >>> bubbles = double_bubble_exact()
    >>> round(bubbles.area / np.pi, 12), round(bubbles.volume / np.pi, 12), bubbles.height
    (27.0, 18.0, 4.0)
    """
    offsets, rim_radius = _offsets(alpha_left, alpha_right, alpha_aux)
    r = np.array([2.0 * alpha_left, 2.0 * alpha_right])
    d = np.array(offsets)
    areas = 2.0 * np.pi * r * (r + d)
    volume = float((np.pi / 3.0 * (r + d) ** 2 * (2.0 * r - d)).sum())
    wall = np.pi * rim_radius**2
    energy = float(0.5 * r @ areas + alpha_aux * wall - volume)
    shapes: dict[str, Shape] = {
        "left": Sphere((-offsets[LEFT], 0.0, 0.0), 2.0 * alpha_left),
        "right": Sphere((offsets[RIGHT], 0.0, 0.0), 2.0 * alpha_right),
        "wall": UprightPlane(),
    }
    index = 2 if alpha_left == alpha_right == alpha_aux else None
    widest = max([rim_radius, *r[d > 0.0].tolist()])
    return ExactSolution(energy, float(areas.sum() + wall), volume, 2.0 * widest, shapes, index)


def _offsets(alpha_left: float, alpha_right: float, alpha_aux: float) -> tuple[tuple[float, float], float]:
    """Distance of each centre from the disc, and the disc's radius."""
    left = validate.positive("alpha_left", alpha_left)
    right = validate.positive("alpha_right", alpha_right)
    wall = validate.positive("alpha_aux", alpha_aux)
    offsets, square = balanced_offsets(left, right, wall)
    if square <= 0.0:
        raise OptionError(
            f"tensions {left:g}, {right:g}, {wall:g} cannot balance at a junction: each must be"
            " less than the sum of the others",
            what="alpha_aux",
            found=wall,
            expected=(abs(left - right), left + right),
        )
    return offsets, float(np.sqrt(square))


def _bubble(radius: float, opening: float, count: int, edge_length: float) -> tuple[Floats, Ints]:
    """A cap about +x whose rim has ``count`` vertices; they come last."""
    rings = max(2, round(radius * opening / edge_length))
    theta = opening * np.arange(1, rings + 1) / rings
    net = ring_mesh(_segments(radius * np.sin(theta), count, edge_length))
    return radius * cap_directions(net, opening)[:, [2, 0, 1]], net.faces


def _segments(radii: Floats, count: int, edge_length: float) -> Ints:
    segments = even_segments(radii, edge_length)
    segments[-1] = count
    return segments


def _glue(mesh: Builder, points: Floats, faces: Ints, rim: Ints, patch: int) -> None:
    """Add a piece whose last points are the rim's."""
    numbers = np.concatenate([mesh.add_points(points[: -len(rim)]), rim])
    mesh.add_faces(numbers[faces], patch)
