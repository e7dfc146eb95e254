"""Small meshes for the tests of the core; all but the bubbles do not lean on the generators."""

from __future__ import annotations

import numpy as np

import generators
from pcmc import Patch, Plane, Surface, solve

LATTICE = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])  # two sides of an equilateral triangle


def pyramid(tension: float = 1.0, height: float = 1.0, **arguments) -> Surface:
    """Four triangles over a square of side 2; the apex, vertex 4, is free.

    E = 4 α √(1 + h²) - 4 h / 3, stationary at α h / √(1 + h²) = 1/3: h = 1/√8 for α = 1.
    """
    X = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, height]]
    F = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    arguments.setdefault("fixed", range(4))
    return Surface(X, F, [0] * 4, [Patch("roof", tension)], **arguments)


def octahedron(tension: float = 1.0, fixed=(0,)) -> Surface:
    """A closed surface, oriented outwards; its volume is 4/3."""
    X = np.concatenate([np.eye(3), -np.eye(3)])
    F = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    return Surface(X, F, [0] * 8, [Patch("bubble", tension)], fixed=fixed)


def hexagon(rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Lattice points (n,2) int, with LATTICE for their places, and faces (m,3) of a hexagon."""
    at = range(-rings, rings + 1)
    points = [(i, j) for i in at for j in at if abs(i + j) <= rings]
    index = {point: k for k, point in enumerate(points)}
    corners = [[(i, j), (i + 1, j), (i, j + 1)] for i in at for j in at]
    corners += [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i in at for j in at]
    faces = [[index[c] for c in face] for face in corners if all(c in index for c in face)]
    return np.array(points), np.array(faces)


def disc(rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,2) and faces of the unit disc: a hexagon whose rings are circles."""
    points, faces = hexagon(rings)
    flat = points @ LATTICE
    sector = np.floor(np.arctan2(flat[:, 1], flat[:, 0]) / (np.pi / 3) + 1e-9)
    turn = sector * np.pi / 3
    across = (flat[:, 1] * np.cos(turn) - flat[:, 0] * np.sin(turn)) / LATTICE[1, 1]
    ring = np.abs(np.column_stack([points, points.sum(axis=1)])).max(axis=1)
    angle = turn + np.pi / 3 * across / np.maximum(ring, 1)
    return (ring / rings)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]), faces


def cap(rings: int, tension: float = 0.6, radius: float = 1.0) -> Surface:
    """The cap of mean curvature 1/(2 α) over a disc, vertices on the sphere, rim fixed."""
    flat, faces = disc(rings)
    flat = flat * radius
    depth = np.sqrt(4.0 * tension**2 - radius**2)
    square = np.maximum(4.0 * tension**2 - (flat**2).sum(axis=1), depth**2)
    X = np.column_stack([flat, np.sqrt(square) - depth])
    rim = np.isclose(np.hypot(*flat.T), radius)
    return Surface(X, faces, [0] * len(faces), [Patch("cap", tension)], fixed=rim)


def tube(rows: int, around: int, profile, patch: Patch, **supports) -> Surface:
    """A surface of revolution about z, normals outwards; ``profile(t)`` is (r, z) for t (rows + 1,)
    from 0 to 1. Both ends are fixed if no supports are given; the first row is the first vertices.
    """
    row = np.arange(rows + 1)
    r, z = profile(row / rows)
    turn = 2.0 * np.pi * (np.arange(around) + 0.5 * (row % 2)[:, None]) / around
    X = np.stack([r[:, None] * np.cos(turn), r[:, None] * np.sin(turn), z[:, None] + 0 * turn], -1)
    a = np.arange(rows * around).reshape(rows, around)
    b = np.roll(a, -1, axis=1)
    c, d = a + around, b + around
    even = (row[:-1] % 2 == 0)[:, None, None]
    first = np.where(even, np.stack([a, b, c], -1), np.stack([a, b, d], -1))
    second = np.where(even, np.stack([b, d, c], -1), np.stack([a, d, c], -1))
    F = np.stack([first, second], axis=2).reshape(-1, 3)
    n = (rows + 1) * around
    supports = supports or {"fixed": [*range(around), *range(n - around, n)]}
    return Surface(X.reshape(-1, 3), F, [0] * len(F), [patch], **supports)


def three_patches(rings: int = 3, plane: Plane | None = None) -> Surface:
    """Fig. 4: three roofs over a hexagon on the plane, three walls that share a vertical line.

    With ``rings`` = 3 or more it has every one of the seven kinds of vertex of Sec. 2.3.
    """
    plane = plane or Plane()
    points, roof = hexagon(rings)
    flat = points @ LATTICE
    ring = np.abs(np.column_stack([points, points.sum(axis=1)])).max(axis=1)
    middle = flat[roof].mean(axis=1)
    sector = np.floor(np.arctan2(middle[:, 1], middle[:, 0]) / (2.0 * np.pi / 3)).astype(int) % 3
    X, faces, patch = [*np.column_stack([flat, 0.5 * (rings - ring)])], roof.tolist(), [*sector]

    place = {tuple(point): k for k, point in enumerate(points)}
    node: dict[tuple[int, int, int], int] = {}  # by direction, step outwards, level upwards
    for wall, (i, j) in enumerate([(1, 0), (-1, 1), (0, -1)]):  # at 0°, 120°, 240°
        for step in range(rings + 1):
            top, levels = place[i * step, j * step], rings - step
            for level in range(levels):
                if step == 0 and wall > 0:
                    node[wall, 0, level] = node[0, 0, level]
                else:
                    node[wall, step, level] = len(X)
                    X.append(X[top] * [1.0, 1.0, level / levels])
            node[wall, step, levels] = top
        for step in range(rings):
            for level in range(rings - step):
                a, b = node[wall, step, level], node[wall, step, level + 1]
                c = node[wall, step + 1, level]
                faces.append([a, c, b])
                if level + 1 < rings - step:
                    faces.append([c, node[wall, step + 1, level + 1], b])
        patch += [3 + wall] * rings**2
    bottom = {index for (_, step, level), index in node.items() if level == 0 and step < rings}

    frame = np.vstack([np.linalg.svd(np.array([plane.normal]))[2][1:], plane.normal])
    frame[0] *= np.linalg.det(frame)
    roofs = [Patch(f"roof{k}", 2.0 + 0.5 * k) for k in range(3)]
    walls = [Patch(f"wall{k}", 0.7 + 0.2 * k, pressure=0.0) for k in range(3)]
    return Surface(
        np.array(X) @ frame + plane.point,
        faces,
        patch,
        [*roofs, *walls],
        fixed=np.flatnonzero(ring == rings),
        on_plane=bottom,
        plane=plane,
    )


def shaken(surface: Surface, amount: float = 0.05, seed: int = 0) -> Surface:
    """Every vertex moved at random as far as its support lets it, so that nothing is special."""
    moves = amount * np.random.default_rng(seed).standard_normal((surface.n, 3))
    moves[surface.fixed] = 0.0
    moves[surface.on_plane] = surface.plane.along(moves[surface.on_plane])
    return surface.moved(surface.vertices + moves)


def generic() -> Surface:
    """Fig. 4 on a tilted plane away from the origin, shaken: nothing vanishes by symmetry."""
    return shaken(three_patches(3, Plane((1, 2, 3), (1, -2, 2))))


def rotation(seed: int) -> np.ndarray:
    """A random rotation matrix (3,3)."""
    Q, R = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q * np.sign(np.linalg.det(Q))


def placed(surface: Surface, R: np.ndarray, shift: np.ndarray) -> Surface:
    """The surface turned by ``R`` (3,3) and moved by ``shift`` (3,), its Π with it."""
    plane = Plane(R @ surface.plane.point + shift, R @ surface.plane.normal)
    return surface.rebuilt(vertices=surface.vertices @ R.T + shift, plane=plane)


def length(points, closed=False):
    """Of a line through points, or of a closed one."""
    ends = np.append(points, points[:1], axis=0) if closed else points
    return float(np.linalg.norm(np.diff(ends, axis=0), axis=1).sum())


def bubbles(distance: float, size: float = 1.0) -> Surface:
    """Two caps of radius 1 side by side at rest, each over a circle of its own; near ones cut each other."""
    one = generators.spherical_cap(0.25)
    X = np.concatenate([one.vertices, one.vertices + np.array([distance, 0.0, 0.0])]) * size
    faces = np.concatenate([one.faces, one.faces + one.n])
    patches = [Patch(name, one.patches[0].tension * size) for name in ("west", "east")]
    fixed = np.tile(one.fixed, 2)
    return solve(Surface(X, faces, np.repeat([0, 1], one.m), patches, fixed=fixed)).surface
