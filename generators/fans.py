"""Fans around a vertical line, a wall under every ridge: Example 3 and Fig. 4."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Surface
from pcmc.arrays import Floats, Ints
from pcmc.errors import OptionError, unknown

from .building import Builder
from .meshing import fill
from .options import positive, whole
from .strips import numbered, strips

MESHES = ("rings", "even", "lattice")


def fans(
    count: int,
    rings: int,
    *,
    name: str,
    alpha: float,
    alpha_aux: float,
    radius: float,
    height: float,
    bulge: float,
    mesh: str,
) -> Surface:
    """``count`` equal fans over a disc, and right-triangle walls that share the vertical line.

    The initial surface is z = height (1 - w) + bulge w (1 - w²) cos² φ with w = r/radius and φ from
    -π/2 at one ridge of a fan to π/2 at the next: straight ridges, and with bulge 0 a cone.

    Parameters
    ----------
    name : the patches are called by it and a number, the walls "wall 1" and so on.
    rings : rings of triangles from the centre to the rim; radius/rings is the length of an edge.
    mesh : "rings", ring k with k segments in each fan; "even", with as many as make them about as
        long as the rings are wide; "lattice", a triangular lattice fitted into the fan.
    """
    rings = whole(rings, "rings", least=2)
    radius, height = positive(radius, "radius"), positive(height, "height")
    if not np.isfinite(bulge):
        raise OptionError(f"bulge must be a finite number, found {bulge!r}")
    if mesh not in MESHES:
        raise OptionError(unknown("mesh", mesh, MESHES))
    builder = Builder()
    spacing = radius / rings
    levels = max(1, round(height / spacing))
    axis = builder.points(np.linspace([0, 0, 0], [0, 0, height], levels + 1))
    turns = [_rotation(i, count) for i in range(count)]
    share = np.arange(1, rings + 1) / rings
    ridge = np.stack([radius * share, 0.0 * share, height * (1.0 - share)], axis=1)
    ridges = [np.append(axis[-1], builder.points(ridge @ turn)) for turn in turns]

    inner, outline, faces = _fan(count, rings, mesh)
    points = np.concatenate([inner, outline]) * radius
    lift = _lift(np.concatenate([inner, outline]), count, height, bulge)
    lift[len(inner) :] = 0.0  # rounding must not take the rim off Π
    rim = [line[-1:] for line in ridges]
    for i, turn in enumerate(turns):
        new = builder.points(np.column_stack([points, lift]) @ turn)
        numbers = np.concatenate([ridges[i], ridges[(i + 1) % count][1:], new])
        builder.faces(numbers[faces], i)
        rim.append(new[len(inner) :])
    foot = [
        builder.wall(count + i, line, builder.positions(line) * [1.0, 1.0, 0.0], spacing, axis)
        for i, line in enumerate(ridges)
    ]
    patches = [Patch(f"{name} {i + 1}", alpha) for i in range(count)]
    patches += [Patch(f"wall {i + 1}", alpha_aux, pressure=0.0) for i in range(count)]
    return builder.surface(patches, fixed=np.concatenate(rim), on_plane=np.concatenate(foot))


def _fan(count: int, rings: int, mesh: str) -> tuple[Floats, Floats, Ints]:
    """The unit fan from angle 0 to 2π/count: inner points, points of its arc, and its faces.

    Faces number the tip 0, the first ridge 1..rings, the second ridge, the inner points, the arc.
    """
    angle = 2.0 * np.pi / count
    ring = np.arange(1, rings + 1)
    segments = ring if mesh == "rings" else np.maximum(1, np.rint(ring * angle).astype(np.int64))
    if mesh == "lattice":
        return _lattice_fan(angle, rings, int(segments[-1]))
    line, step = numbered(segments + 1)
    between = (step > 0) & (step < segments[line])
    theta = angle * (step / segments[line])[between]
    points = (ring[line[between]] / rings)[:, None] * np.stack([np.cos(theta), np.sin(theta)], 1)
    numbers = np.where(step == 0, 1 + line, 1 + rings + line)
    numbers[between] = 1 + 2 * rings + np.arange(len(points))
    middle = np.zeros(rings, dtype=bool)
    faces = strips(np.append(0, numbers), np.append(0, segments), middle)
    arc = line[between] == rings - 1
    return points[~arc], points[arc], faces


def _lattice_fan(angle: float, rings: int, segments: int) -> tuple[Floats, Floats, Ints]:
    """A fan meshed symmetrically about its bisector, then turned to start at angle 0."""
    share = np.arange(1, rings + 1)[:, None] / rings
    half = 0.5 * angle
    first = share * [np.cos(half), -np.sin(half)]
    theta = half * np.arange(-segments, segments + 1, 2)[1:-1] / segments
    arc = np.stack([np.cos(theta), np.sin(theta)], axis=1)
    second = first * [1.0, -1.0]
    outline = np.concatenate([np.zeros((1, 2)), first, arc, second[::-1]])
    inner, faces = fill([outline], 1.0 / rings)
    one, two = 1 + np.arange(rings), 1 + rings + np.arange(rings)
    new = 1 + 2 * rings
    ends = np.cumsum([new, len(inner), len(arc)])
    numbers = np.concatenate(
        [[0], one, np.arange(ends[1], ends[2]), two[::-1], np.arange(new, ends[1])]
    )
    back = np.array([[np.cos(half), np.sin(half)], [-np.sin(half), np.cos(half)]])
    return inner @ back, arc @ back, numbers[faces]


def _lift(points: Floats, count: int, height: float, bulge: float) -> Floats:
    """(k,) initial height over points of the unit fan."""
    w = np.linalg.norm(points, axis=1)
    phi = np.arctan2(points[:, 1], points[:, 0]) * (0.5 * count) - 0.5 * np.pi
    return height * (1.0 - w) + bulge * w * (1.0 - w**2) * np.cos(phi) ** 2


def _rotation(i: int, count: int) -> Floats:
    """(3,3) turn by i/count of the full circle, for row vectors; exact at quarters."""
    angle = 2.0 * np.pi * i / count
    c, s = (0.0 if abs(v) < 1e-15 else v for v in (np.cos(angle), np.sin(angle)))
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
