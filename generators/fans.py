"""Fans around a vertical line, a wall under every ridge: Example 3 and Fig. 4."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Surface
from pcmc.base import validate
from pcmc.base.arrays import Floats, Ints

from .building import Builder
from .drape import soap_film
from .meshing import fill
from .strips import numbered, strips

MESHES = ("rings", "even", "double", "lattice")


def fans(
    count: int,
    rings: int,
    *,
    name: str,
    alpha: float,
    alpha_aux: float,
    radius: float,
    height: float,
    bulge: float | None,
    mesh: str,
) -> Surface:
    """``count`` equal fans over a disc, and right-triangle walls that share the vertical line.

    The initial fans are soap films between the straight ridges and the rim; or, with a ``bulge``,
    z = height (1 - w) + bulge w (1 - w²) cos² φ with w = r/radius and φ from -π/2 at one ridge of
    a fan to π/2 at the next, a cone for bulge 0.

    Parameters
    ----------
    name : the patches are called by it and a number, the walls "wall 1" and so on.
    rings : rings of triangles from the centre to the rim; radius/rings is the length of an edge.
    mesh : "rings", ring k with k segments in each fan; "even", with as many as make them about as
        long as the rings are wide; "double", with 2 k; "lattice", a triangular lattice fitted in.
    """
    rings = validate.integer("rings", rings, least=2)
    radius, height = validate.positive("radius", radius), validate.positive("height", height)
    if bulge is not None:
        validate.number("bulge", bulge)
    validate.choice("mesh", mesh, MESHES)
    builder = Builder()
    spacing = radius / rings
    levels = max(1, round(height / spacing))
    axis = builder.points(np.linspace([0, 0, 0], [0, 0, height], levels + 1))
    turns = [_rotation(i, count) for i in range(count)]
    share = np.arange(1, rings + 1) / rings
    ridge = np.stack([radius * share, 0.0 * share, height * (1.0 - share)], axis=1)
    ridges = [np.append(axis[-1], builder.points(ridge @ turn)) for turn in turns]

    points, faces, rim_count = _fan(count, rings, mesh)
    z = _bulged(points, count, height, bulge or 0.0)
    z[len(z) - rim_count :] = 0.0  # rounding must not take the rim off Π
    if bulge is None:
        held = np.ones(len(z), dtype=bool)
        held[1 + 2 * rings : len(z) - rim_count] = False
        z = soap_film(radius * points, faces, held, z)
    fan = np.column_stack([radius * points, z])[1 + 2 * rings :]
    rim = [line[-1:] for line in ridges]
    for i, turn in enumerate(turns):
        new = builder.points(fan @ turn)
        numbers = np.concatenate([ridges[i], ridges[(i + 1) % count][1:], new])
        builder.faces(numbers[faces], i)
        rim.append(new[len(new) - rim_count :])
    foot = [
        builder.wall(count + i, line, builder.positions(line) * [1.0, 1.0, 0.0], spacing, axis)
        for i, line in enumerate(ridges)
    ]
    patches = [Patch(f"{name} {i + 1}", alpha) for i in range(count)]
    patches += [Patch(f"wall {i + 1}", alpha_aux, pressure=0.0) for i in range(count)]
    return builder.surface(patches, fixed=np.concatenate(rim), on_plane=np.concatenate(foot))


def _fan(count: int, rings: int, mesh: str) -> tuple[Floats, Ints, int]:
    """The unit fan from angle 0 to 2π/count: points (k,2), faces, and how many points its arc has.

    First the tip, then both ridges from tip to rim, then the inner points, then the arc's.
    """
    angle = 2.0 * np.pi / count
    ring = np.arange(1, rings + 1)
    even = np.maximum(1, np.rint(ring * angle).astype(np.int64))
    if mesh == "lattice":
        return _lattice_fan(angle, rings, int(even[-1]))
    segments = {"rings": ring, "even": even, "double": 2 * ring}[mesh]
    line, step = numbered(segments + 1)
    between = (step > 0) & (step < segments[line])
    theta = angle * (step / segments[line])[between]
    inside = (ring[line[between]] / rings)[:, None] * _directions(theta)
    numbers = np.where(step == 0, 1 + line, 1 + rings + line)
    numbers[between] = 1 + 2 * rings + np.arange(len(inside))
    faces = strips(np.append(0, numbers), np.append(0, segments))
    points = np.concatenate([_edges(rings, angle), inside])
    return points, faces, int(segments[-1]) - 1


def _lattice_fan(angle: float, rings: int, segments: int) -> tuple[Floats, Ints, int]:
    """A fan meshed symmetrically about its bisector, then turned to start at angle 0."""
    half = 0.5 * angle
    back = np.array([[np.cos(half), np.sin(half)], [-np.sin(half), np.cos(half)]])
    edges = _edges(rings, angle)
    one, two = 1 + np.arange(rings), 1 + rings + np.arange(rings)
    theta = half * np.arange(-segments, segments + 1, 2)[1:-1] / segments
    arc = _directions(theta)
    first = edges[one, :1] * [np.cos(half), -np.sin(half)]
    second = first * [1.0, -1.0]
    outline = np.concatenate([edges[:1], first, arc, second[::-1]])
    inner, faces = fill([outline], 1.0 / rings)
    points = np.concatenate([edges, inner @ back, arc @ back])
    new = np.arange(len(edges), len(points))
    numbers = np.concatenate([[0], one, new[len(inner) :], two[::-1], new[: len(inner)]])
    return points, numbers[faces], len(arc)


def _edges(rings: int, angle: float) -> Floats:
    """(1 + 2 rings, 2) the tip and both ridges of the unit fan."""
    share = np.arange(1, rings + 1)[:, None] / rings
    return np.concatenate(
        [np.zeros((1, 2)), share * [1.0, 0.0], share * [np.cos(angle), np.sin(angle)]]
    )


def _directions(theta: Floats) -> Floats:
    return np.stack([np.cos(theta), np.sin(theta)], axis=1)


def _bulged(points: Floats, count: int, height: float, bulge: float) -> Floats:
    """(k,) heights over points of the unit fan: the cone and a bulge that ends at ridges and rim."""
    w = np.linalg.norm(points, axis=1)
    phi = 0.5 * count * np.arctan2(points[:, 1], points[:, 0]) - 0.5 * np.pi
    return height * (1.0 - w) + bulge * w * (1.0 - w**2) * np.cos(phi) ** 2


def _rotation(i: int, count: int) -> Floats:
    """(3,3) turn by i/count of the full circle, for row vectors; exact at quarters."""
    angle = 2.0 * np.pi * i / count
    c, s = (0.0 if abs(v) < 1e-15 else v for v in (np.cos(angle), np.sin(angle)))
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
