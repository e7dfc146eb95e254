"""Periodic surfaces for tests: a tube, a bay of a vault, films on four lines, a honeycomb; other images."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np

import pcmc
from pcmc import Patch, Plane, Room, Surface


def tube(length: float, around: int = 24, radius: float = 1.0, rooms: bool = True) -> Surface:
    """A tube about the z axis of triangles nearly equilateral, periodic along it, in its balance α = p R."""
    rows = max(3, round(length / (2.0 * np.pi * radius / around * 0.75**0.5)))
    rows += rows % 2
    angle = 2.0 * np.pi * (np.arange(around)[None] + 0.5 * (np.arange(rows + 1)[:, None] % 2)) / around
    z = np.broadcast_to(length * np.arange(rows + 1)[:, None] / rows, angle.shape)
    X = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=2).reshape(-1, 3)
    number = np.arange(len(X)).reshape(rows + 1, around)
    faces = []
    for row in range(rows):
        a, b = number[row], np.roll(number[row], -1)
        c, d = number[row + 1], np.roll(number[row + 1], -1)
        if row % 2 == 0:
            faces += [np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1)]
        else:
            faces += [np.stack([a, d, c], axis=1), np.stack([a, b, d], axis=1)]
    F = np.concatenate(faces)
    area = 0.5 * around * radius**2 * np.sin(2.0 * np.pi / around)
    own = [Room("inside", {"tube": 1}, area * length)] if rooms else []
    patches = [Patch("tube", 1.0, pressure=1.0 / radius)]
    images = pcmc.images_in(X, [[0, 0, length]])
    return Surface(X, F, np.zeros(len(F), dtype=int), patches, rooms=own, images=images)


def bay(n: int, mirrors: bool = False, **values: float) -> Surface:
    """A bay of a vault without end along x, over 0 ≤ y ≤ 1; or the same between mirror planes."""
    grid = (
        np.stack(np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij"), axis=-1).reshape(-1, 2) / n
    )
    X = np.column_stack([grid, 0.3 * grid[:, 1] * (1.0 - grid[:, 1])])
    corner = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (
        part.ravel() for part in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:])
    )
    odd = (np.add.outer(np.arange(n), np.arange(n)) % 2).ravel().astype(bool)
    first = np.where(odd[:, None], np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    second = np.where(odd[:, None], np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    F = np.concatenate([first, second])
    fixed = (grid[:, 1] == 0.0) | (grid[:, 1] == 1.0)
    given = {"tension": 1.0, "pressure": 1.0} | values
    if mirrors:
        planes = {Plane((x, 0, 0), (1, 0, 0), f"x = {x}", mirror=True): grid[:, 0] == x for x in (0.0, 1.0)}
        return Surface(X, F, np.zeros(len(F), dtype=int), [Patch("vault", **given)], fixed, on_planes=planes)
    images = pcmc.images_in(X, [[1, 0, 0]])
    return Surface(X, F, np.zeros(len(F), dtype=int), [Patch("vault", **given)], fixed, images=images)


def scattered(surface: Surface, lattice, seed: int = 0) -> Surface:
    """The same surface with each triangle moved by a translation of the lattice (d,3), so that almost all its
    vertices have images."""
    rng = np.random.default_rng(seed)
    corners = surface.vertices[surface.faces]
    corners = corners + (rng.integers(-1, 2, (surface.m, len(lattice))) @ np.asarray(lattice))[:, None]
    key = np.round(corners.reshape(-1, 3) * 1e9).astype(np.int64)
    _, first, faces = np.unique(key, axis=0, return_index=True, return_inverse=True)
    X = corners.reshape(-1, 3)[first]
    images = pcmc.images_in(X, lattice)
    parts = surface.patch_of_face, surface.patches
    return Surface(X, faces.reshape(-1, 3), *parts, rooms=surface.rooms, images=images)


CORNERS = {"south-west": (-1, -1), "north-west": (-1, 1), "north-east": (1, 1), "south-east": (1, -1)}


def steiner_films(width: float, depth: float) -> Surface:
    """Films between two plates and four lines at the corners of a rectangle; the middle one is along x."""
    lines = [0.5 * np.array([width, depth]) * place for place in CORNERS.values()]
    places = [*lines, np.array([-0.2, 0.0]), np.array([0.2, 0.0])]
    ways = [(0, 4), (1, 4), (2, 5), (3, 5), (4, 5)]
    X, faces, patch = list[list[float]](), list[list[int]](), list[int]()
    number = dict[tuple[float, ...], int]()

    def column(point: np.ndarray) -> int:
        key = tuple(point.round(9))
        if key not in number:
            number[key] = len(X)
            X.extend([*point, height] for height in (0.0, 0.25, 0.5, 0.75, 1.0))
        return number[key]

    for label, (start, end) in enumerate(ways):
        steps = 2 if label == 4 else 4
        line = [places[start] + (places[end] - places[start]) * k / steps for k in range(steps + 1)]
        for p, q in pairwise(line):
            i, j = column(p), column(q)
            for k in range(4):
                faces += [[i + k, j + k, j + k + 1], [i + k, j + k + 1, i + k + 1]]
                patch += [label, label]
    Z = np.array(X)
    fixed = np.isclose(np.abs(Z[:, 0]), width / 2) & np.isclose(np.abs(Z[:, 1]), depth / 2)
    patches = [Patch(name, 1.0, 0.0) for name in [*CORNERS, "middle"]]
    return Surface(Z, faces, patch, patches, fixed=fixed, images=pcmc.images_in(Z, [[0, 0, 1]]))


def honeycomb(u, v, corner=None, side: int = 2) -> Surface:
    """side² prismatic bubbles of height 1 at the points of a lattice u, v in the plane, periodic in all ways.

    The films "a", "b" and "c" of each bubble lead from a corner P, by default in the middle of the bubbles at
    0, u and v, to u + v - P, v - P and u - P. The volumes of all bubbles but the last are prescribed.
    """
    u, v = np.asarray(u, dtype=float), np.asarray(v, dtype=float)
    P = (u + v) / 3.0 if corner is None else corner
    kinds = {"a": (u + v - P, (0, 1), (1, 0)), "b": (v - P, (0, 0), (0, 1)), "c": (u - P, (1, 0), (0, 0))}
    shares, heights = np.linspace(0.0, 1.0, 4), np.linspace(0.0, 1.0, 5)
    corners, patch, names, signs = list[np.ndarray](), list[int](), list[str](), list[np.ndarray]()
    for i, j in np.ndindex(side, side):
        for kind, (end, left, right) in kinds.items():
            way = P + shares[:, None] * (end - P) + i * u + j * v
            for (p, q), (low, high) in product(pairwise(way), pairwise(heights)):
                a, b, c, d = ([*p, low], [*q, low], [*q, high], [*p, high])
                corners.append(np.array([[a, b, c], [a, c, d]]))
                patch += [len(names)] * 2
            sign = np.zeros((side, side), dtype=int)  # the normal leads to the right of the way
            for step, (k, l) in ((1, left), (-1, right)):
                sign[(i + k) % side, (j + l) % side] += step
            names.append(f"{kind}{i}{j}")
            signs.append(sign.ravel())
    places = np.concatenate(corners).reshape(-1, 3)
    _, first, faces = np.unique(np.round(places * 1e9), axis=0, return_index=True, return_inverse=True)
    volume = float(abs(u[0] * v[1] - u[1] * v[0]))
    rooms = [
        Room(f"bubble {k + 1}", {name: int(s) for name, s in zip(names, row, strict=True) if s}, volume)
        for k, row in enumerate(np.array(signs).T[:-1])
    ]
    images = pcmc.images_in(places[first], [[*(side * u), 0.0], [*(side * v), 0.0], [0.0, 0.0, 1.0]])
    films = [Patch(name, 1.0, 0.0) for name in names]
    return Surface(places[first], faces.reshape(-1, 3), patch, films, rooms=rooms, images=images)


def honeycomb_energy(u, v) -> float:
    """The area of the films of one bubble: of the shortest net that joins a triangle's corners 0, u, v."""
    u, v = np.asarray(u, dtype=float), np.asarray(v, dtype=float)
    area = 0.5 * abs(u[0] * v[1] - u[1] * v[0])
    return float(np.sqrt(0.5 * (u @ u + v @ v + (u - v) @ (u - v)) + 2.0 * 3.0**0.5 * area))
