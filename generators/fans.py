"""Fans around a vertical line, a wall under each ridge: Example 3 (Figs. 17-21) and Fig. 4."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Surface
from pcmc.base import validate
from pcmc.base.arrays import Floats, Ints

from .builder import Builder
from .membranes import soap_film
from .meshing import fill
from .strips import number_within_groups, strips

MESHES = ("rings", "even", "double", "lattice")


def four_fans(
    rings: int = 13,
    *,
    alpha: float = 10.0,
    alpha_aux: float = 3.0,
    radius: float = 20.0,
    height: float = 8.0,
    bulge: float | None = None,
    mesh: str = "lattice",
) -> Surface:
    """Four quarter discs and four right-triangle walls under the ridges between them.

    The rim is fixed and the walls' feet slide on Π. The paper gives neither its mesh nor the height
    of its initial fans. Soap films over 13 rings of the lattice have ‖∇E‖² = 7949, 0.7 % from the
    printed 7893.633, and the paper's flow falls below 0.005 there, as printed, before it rises again;
    "rings" at 14 have 7892, and the flow stays above 0.03 (``generators.calibration``).

    Parameters
    ----------
    rings : rings of triangles from the centre to the rim; radius/rings is the length of an edge.
    alpha, alpha_aux : tension of "fan 1" .. "fan 4" and of "wall 1" .. "wall 4".
    radius, height : the base and the height of the walls, lengths.
    bulge : None for initial fans that are soap films between ridges and rim; or the height of their
        bulge over a cone, length, negative for a sag.
    mesh : segments of ring k in each fan: "rings", k; "double", 2 k; "even", segments about as long as
        the rings are wide; or "lattice", a triangular lattice fitted in.

    Returns
    -------
    Surface
        The lattice's angles are at least 33°; the walls' tips have the 21.8° of their triangle.

    >>> surface = four_fans(rings=5)
    >>> surface.patches[0].name, surface.patches[-1].name, surface.patches[0].target_curvature
    ('fan 1', 'wall 4', 0.05)
    """
    return _fans(
        4,
        rings,
        name="fan",
        alpha=alpha,
        alpha_aux=alpha_aux,
        radius=radius,
        height=height,
        bulge=bulge,
        mesh=mesh,
    )


def three_patches(
    rings: int = 8,
    *,
    alpha: float = 6.0,
    alpha_aux: float = 2.0,
    radius: float = 10.0,
    height: float = 4.0,
    bulge: float | None = None,
    mesh: str = "lattice",
) -> Surface:
    """Three sectors of a disc and three right-triangle walls under the ridges between them.

    The figure gives no numbers; with these the walls are nearly as high at rest as initially.
    The rim is fixed and the walls' feet slide on Π (z = 0).

    Parameters
    ----------
    rings : rings of triangles from the centre to the rim; radius/rings is the length of an edge.
    alpha, alpha_aux : tension of "patch 1" .. "patch 3" and of "wall 1" .. "wall 3".
    radius, height : the base and the height of the walls, lengths.
    bulge, mesh : as in ``four_fans``.

    >>> surface = three_patches()
    >>> [len(curve.sheets) for curve in surface.topology.junctions]
    [3, 3, 3, 3]
    """
    return _fans(
        3,
        rings,
        name="patch",
        alpha=alpha,
        alpha_aux=alpha_aux,
        radius=radius,
        height=height,
        bulge=bulge,
        mesh=mesh,
    )


def _fans(
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
    a fan to π/2 at the next; a cone for bulge 0.
    """
    rings = validate.integer("rings", rings, least=2)
    radius = validate.positive("radius", radius)
    height = validate.positive("height", height)
    if bulge is not None:
        validate.number("bulge", bulge)
    validate.choice("mesh", mesh, MESHES)
    builder = Builder()
    spacing = radius / rings
    levels = max(1, round(height / spacing))
    axis = builder.add_points(np.linspace([0, 0, 0], [0, 0, height], levels + 1))
    turns = [_rotation(i, count) for i in range(count)]
    share = np.arange(1, rings + 1) / rings
    ridge = np.stack([radius * share, 0.0 * share, height * (1.0 - share)], axis=1)
    ridges = [np.append(axis[-1], builder.add_points(ridge @ turn)) for turn in turns]

    points, faces, rim_count = _fan(count, rings, mesh)
    z = _bulged(points, count, height, bulge or 0.0)
    z[len(z) - rim_count :] = 0.0  # rounding must not move the rim off Π
    if bulge is None:
        held = np.ones(len(z), dtype=bool)
        held[1 + 2 * rings : len(z) - rim_count] = False
        z = soap_film(radius * points, faces, held, z)
    fan = np.column_stack([radius * points, z])[1 + 2 * rings :]
    rim = [line[-1:] for line in ridges]
    for i, turn in enumerate(turns):
        new = builder.add_points(fan @ turn)
        numbers = np.concatenate([ridges[i], ridges[(i + 1) % count][1:], new])
        builder.add_faces(numbers[faces], i)
        rim.append(new[len(new) - rim_count :])
    foot = [
        builder.add_wall(count + i, line, builder.positions(line) * [1.0, 1.0, 0.0], spacing, axis)
        for i, line in enumerate(ridges)
    ]
    patches = [Patch(f"{name} {i + 1}", alpha) for i in range(count)]
    patches += [Patch(f"wall {i + 1}", alpha_aux, pressure=0.0) for i in range(count)]
    return builder.surface(patches, fixed=np.concatenate(rim), on_plane=np.concatenate(foot))


def _fan(count: int, rings: int, mesh: str) -> tuple[Floats, Ints, int]:
    """The unit fan from angle 0 to 2π/count: points (k,2), faces, and how many points its arc has.

    In this order: the tip, both ridges from tip to rim, the inner points, the points of the arc.
    """
    angle = 2.0 * np.pi / count
    ring = np.arange(1, rings + 1)
    even = np.maximum(1, np.rint(ring * angle).astype(np.int64))
    if mesh == "lattice":
        return _lattice_fan(angle, rings, int(even[-1]))
    segments = {"rings": ring, "even": even, "double": 2 * ring}[mesh]
    line, step = number_within_groups(segments + 1)
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
