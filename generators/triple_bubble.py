"""Three equal bubbles around a common edge, in closed form."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Room, Surface
from pcmc.base import validate
from pcmc.base.arrays import Floats, Ints

from .builder import Builder
from .exact import ExactSolution, FlatPlane, Shape, Sphere
from .sphere import STRETCH
from .strips import strips

AXIS = 1.0 / np.sqrt(3.0)  # distance of each centre from the common edge, over the radius
HALF = np.sqrt(2.0 / 3.0)  # half the length of the common edge, over the radius
TURN = 2.0 * np.pi / 3.0


def triple_bubble(
    edge_length: float = 0.3, *, volume: float = 1.0, alpha: float = 1.0, exact: bool = False
) -> Surface:
    """Three bubbles of prescribed volume and the three flat films between them; nothing is held.

    All six patches have one tension. Each bubble is part of a sphere; the three centres are one radius
    apart, and the films meet at 120° in an edge on the z axis, which ends at tetrahedral points.

    Parameters
    ----------
    edge_length : length.
    volume : of each of the rooms "1", "2", "3", length³.
    alpha : tension of the patches "bubble 1" to "bubble 3" and "film 12", "film 23", "film 31".
    exact : put the vertices on the exact solution; otherwise it is stretched by 1.05, 1 and 0.95
        along the axes.

    >>> surface = triple_bubble(exact=True)
    >>> bool(triple_bubble_exact().distance(surface).max() < 1e-12), len(surface.rooms)
    (True, 3)
    """
    edge_length = validate.positive("edge_length", edge_length)
    radius = _radius(validate.positive("volume", volume))
    pressure = 2.0 * validate.positive("alpha", alpha) / radius
    rows = max(6, 2 * round(1.8 * radius / edge_length))  # along a rim, 4 radii long
    across = max(1, round(3.3 * radius / edge_length))  # around a bubble, where it is widest
    mesh = Builder()
    poles = mesh.add_points([[0.0, 0.0, HALF * radius], [0.0, 0.0, -HALF * radius]])
    heights = HALF * (1.0 - 2.0 * np.arange(1, rows) / rows)
    edge = mesh.add_points(radius * np.outer(heights, [0.0, 0.0, 1.0]))
    place = np.pi * np.arange(1, rows) / rows
    rims = [mesh.add_points(radius * _arcs(place, np.full(rows - 1, TURN / 2.0), k)) for k in range(3)]
    for k in range(3):
        turns = _segments(across, rows)
        number, share = _inside(turns)
        points = radius * _arcs(place[number], TURN * (share - 0.5), k)
        _fill(mesh, poles, rims[k - 1], points, rims[k], turns, k)
    for k in range(3):
        steps = _segments(max(1, round(0.35 * across)), rows)
        number, share = _inside(steps)
        ends = mesh.positions(edge)[number], mesh.positions(rims[k])[number]
        points = (1.0 - share)[:, None] * ends[0] + share[:, None] * ends[1]
        _fill(mesh, poles, edge, points, rims[k], steps, 3 + k, flipped=True)
    names = ["1", "2", "3"]
    patches = [Patch(f"bubble {name}", alpha, pressure) for name in names]
    films = [f"film {names[k]}{names[(k + 1) % 3]}" for k in range(3)]
    patches += [Patch(film, alpha, pressure=0.0) for film in films]
    rooms = [
        Room(names[k], ((f"bubble {names[k]}", 1), (films[k], 1), (films[k - 1], -1)), volume)
        for k in range(3)
    ]
    surface = mesh.closed_surface(patches, rooms)
    return surface if exact else surface.moved(surface.vertices * STRETCH)


def triple_bubble_exact(*, volume: float = 1.0, alpha: float = 1.0) -> ExactSolution:
    """Spheres of radius R whose centres are R apart and R/√3 from the common edge.

    A bubble's volume is ∫∫ ½ s² dz dθ along the arcs of its sphere in the half-planes at θ, |θ| ≤ 60°, with s
    the distance from the common edge. At rest α A = 3/2 · Σ p V, p = 2α/R: homotheties change neither. At
    volumes 1, A = 13.128168244433. At prescribed volumes the index is 0.

    >>> round(triple_bubble_exact().area, 9)
    13.128168244
    """
    radius = _radius(validate.positive("volume", volume))
    pressure = 2.0 * alpha / radius
    area = 4.5 * pressure * volume / alpha
    shapes: dict[str, Shape] = {}
    for k, name in enumerate(("1", "2", "3")):
        angle = k * TURN
        centre = AXIS * radius * np.array([np.cos(angle), np.sin(angle), 0.0])
        shapes[f"bubble {name}"] = Sphere((float(centre[0]), float(centre[1]), 0.0), radius)
        normal = angle + TURN / 2.0 + np.pi / 2.0
        shapes[f"film {name}{k % 3 + 2 if k < 2 else 1}"] = FlatPlane(
            (float(np.cos(normal)), float(np.sin(normal)), 0.0)
        )
    return ExactSolution(alpha * area - 3.0 * pressure * volume, area, 3.0 * volume, 2.0 * radius, shapes, 0)


def _radius(volume: float) -> float:
    """R of bubbles of this volume."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    theta = TURN / 2.0 * nodes
    half = np.sqrt(1.0 - (AXIS * np.sin(theta)) ** 2)
    opening = np.pi - np.arcsin(HALF / half)
    phi = np.outer(nodes, opening)
    s = AXIS * np.cos(theta) + half * np.cos(phi)
    slices = weights @ (0.5 * s**2 * half * np.cos(phi)) * opening
    unit = float(TURN / 2.0 * weights @ slices)
    return float((volume / unit) ** (1.0 / 3.0))


def _arcs(place: Floats, theta: Floats, k: int) -> Floats:
    """Points (p,3) of bubble k: on the arc in the half-plane at θ, at ``place`` from 0 to π along it."""
    half = np.sqrt(1.0 - (AXIS * np.sin(theta)) ** 2)
    opening = np.pi - np.arcsin(HALF / half)
    phi = opening * (1.0 - 2.0 * place / np.pi)
    s, z, angle = AXIS * np.cos(theta) + half * np.cos(phi), half * np.sin(phi), theta + k * TURN
    return np.stack([s * np.cos(angle), s * np.sin(angle), z], axis=1)


def _segments(most: int, rows: int) -> Ints:
    """(rows-1,) segments of each row: one at the poles and more towards the middle."""
    row = np.arange(1, rows)
    return np.minimum(most, np.minimum(row, rows - row))


def _inside(segments: Ints) -> tuple[Ints, Floats]:
    """The row and the share of the way along it of each point between the rows' ends."""
    number = np.repeat(np.arange(len(segments)), segments - 1)
    step = np.concatenate([np.arange(1, count) for count in segments])
    return number, step / segments[number]


def _fill(
    mesh: Builder,
    poles: Ints,
    first: Ints,
    inside: Floats,
    last: Ints,
    segments: Ints,
    patch: int,
    flipped: bool = False,
) -> None:
    """Add a patch of rows from the vertices ``first`` to ``last``, between the two poles."""
    between = np.split(mesh.add_points(inside), np.cumsum(segments - 1)[:-1])
    rows = [np.concatenate([[a], numbers, [b]]) for a, numbers, b in zip(first, between, last, strict=True)]
    lines = np.concatenate([poles[:1], *rows, poles[1:]])
    faces = strips(lines, np.concatenate([[0], segments, [0]]))
    mesh.add_faces(faces[:, ::-1] if flipped else faces, patch)
