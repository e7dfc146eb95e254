"""Periodic surfaces in a cell: Schwarz' P and D, the gyroid, the foams of Kelvin and of Weaire and Phelan."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import Voronoi, cKDTree
from scipy.special import ellipk

from pcmc import Patch, Room, Surface, images_in
from pcmc.base import validate
from pcmc.base.arrays import Floats, Ints

BODY, FACE = 0.5 * (1.0 - 2.0 * np.eye(3)), 0.5 * (1.0 - np.eye(3))  # centred cubic lattices of side 1
LATTICES = {"P": np.eye(3), "D": FACE, "G": BODY}
A15 = np.array([[0, 0, 0], [2, 2, 2], [1, 0, 2], [3, 0, 2], [2, 1, 0], [2, 3, 0], [0, 2, 1], [0, 2, 3]]) / 4.0
SHIFTS = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
STEPS = 8  # of Newton's method to the level set: it converges quadratically


def minimal_cell(kind: str = "P", levels: int = 1, *, side: float = 1.0, alpha: float = 1.0) -> Surface:
    """Schwarz' P or D surface or the gyroid G, periodic, in the smallest cell that keeps its two sides apart.

    Eight hexagons around the points where the surface is flat; their corners are where its normal is along an
    axis, four hexagons at each. The start lies on the level set that is near the minimal surface (von
    Schnering and Nesper, Z. Phys. B 83, 1991). A cube of this side has one cell of P, two of G (body-centred)
    and four of D (face-centred). All are saddles of area: solve with ``target="stationary"``.

    Parameters
    ----------
    kind : "P", "D" or "G".
    levels : how often the 48 triangles are cut into four, ≥ 1.
    side : of the cube, length.
    alpha : tension of "film", force/length.

    >>> cell = minimal_cell("G")
    >>> cell.m, cell.topology.boundary_edge.any()
    (192, np.False_)
    """
    validate.choice("kind", kind, tuple(LATTICES))
    levels = validate.integer("levels", levels, least=1)
    side, alpha = validate.positive("side", side), validate.positive("alpha", alpha)
    grid = np.stack(np.meshgrid(*[np.arange(8) / 8.0] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    value, slope = _level(kind, grid)
    slopes = np.sort(np.abs(slope), axis=1)
    on = np.abs(value) < 1e-9
    flat, axial = on & (np.ptp(slopes, axis=1) < 1e-9) & (slopes[:, 2] > 1e-9), on & (slopes[:, 1] < 1e-9)
    lattice = LATTICES[kind]
    flat[images_in(grid, lattice)[:, 0]] = False
    centres = grid[flat]
    corners = (grid[axial][:, None] + SHIFTS).reshape(-1, 3)
    around = corners[cKDTree(corners).query(centres, k=6)[1]] - centres[:, None]
    normal = _level(kind, centres)[1]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    first = around[:, 0] - np.einsum("ij,ij->i", around[:, 0], normal)[:, None] * normal
    second = np.cross(normal, first)
    angle = np.arctan2(np.einsum("ikd,id->ik", around, second), np.einsum("ikd,id->ik", around, first))
    rim = centres[:, None] + np.take_along_axis(around, np.argsort(angle, axis=1)[..., None], axis=1)
    middle = np.broadcast_to(centres[:, None], rim.shape)
    triangles = np.stack([middle, rim, np.roll(rim, -1, axis=1)], axis=2).reshape(-1, 3, 3)
    for _ in range(levels):
        triangles = _quartered(triangles)
        triangles = _on_level_set(kind, triangles.reshape(-1, 3)).reshape(-1, 3, 3)
    patch = np.zeros(len(triangles), dtype=int)
    return _periodic(side * triangles, patch, [Patch("film", alpha, pressure=0.0)], side * lattice)


def minimal_cell_area(kind: str = "P", side: float = 1.0) -> float:
    """The area of Schwarz' P or D surface or the gyroid G in a cube of this side, length².

    With the complete elliptic integrals K = K(1/2) and K' = K(√3/2) it is 3 K / K' of P, 3 K' / K of D, and
    the mean of both of G: the three are isometric, and their cells differ in size by known factors.

    >>> [round(minimal_cell_area(kind), 6) for kind in "PDG"]
    [2.345103, 3.837785, 3.091444]
    """
    validate.choice("kind", kind, tuple(LATTICES))
    ratio = float(ellipk(0.25) / ellipk(0.75))
    return 3.0 * side**2 * {"P": ratio, "D": 1.0 / ratio, "G": 0.5 * (ratio + 1.0 / ratio)}[kind]


def kelvin_foam(levels: int = 2, *, side: float = 1.0, alpha: float = 1.0) -> Surface:
    """Kelvin's foam: one truncated octahedron in its body-centred cell, whose films meet by threes.

    There are two in a cube of this side. As there is one bubble in the cell, which it fills, the volume of
    each is given by the cell, and all pressures are the same.

    Parameters
    ----------
    levels : how often the triangles around the middle of each face are cut into four.
    side : of the cube, length.
    alpha : tension of each film, force/length.

    >>> kelvin_foam(0).m
    36
    """
    return _foam(np.zeros((1, 3)), BODY, levels, side, alpha)


def weaire_phelan_foam(levels: int = 2, *, side: float = 1.0, alpha: float = 1.0) -> Surface:
    """The foam of Weaire and Phelan (Phil. Mag. Lett. 69, 1994): eight bubbles of equal volume in a cube.

    The start are the Voronoi cells of the points of A15, which differ a little in volume. The volumes of all
    but the last bubble are prescribed; that of the last follows, and pressures are counted from its own.

    Parameters
    ----------
    levels : how often the triangles around the middle of each face are cut into four.
    side : of the cube, length.
    alpha : tension of each film, force/length.

    >>> foam = weaire_phelan_foam(0)
    >>> foam.m, len(foam.rooms), round(foam.rooms[0].volume, 3)
    (276, 7, 0.125)
    """
    return _foam(A15, np.eye(3), levels, side, alpha)


def _foam(points: Floats, lattice: Floats, levels: int, side: float, alpha: float) -> Surface:
    """The faces between the Voronoi cells of points (k,3) and their translated copies, each a patch."""
    levels = validate.integer("levels", levels, least=0)
    side, alpha = validate.positive("side", side), validate.positive("alpha", alpha)
    shifts = np.stack(np.meshgrid(*[np.arange(-2, 3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    shifts = shifts[np.lexsort((*shifts.T, np.abs(shifts).sum(axis=1)))]
    every, k = (points + (shifts @ lattice)[:, None]).reshape(-1, 3), len(points)
    cells = Voronoi(every)
    triangles, pairs = list[Floats](), list[tuple[int, int]]()
    for (one, other), corners in cells.ridge_dict.items():
        one, other = sorted((one, other), key=lambda i: (i >= k, i % k))
        way = tuple(shifts[other // k])
        if one >= k or -1 in corners or (one % k, way) > (other % k, tuple(-shifts[other // k])):
            continue
        rim = cells.vertices[corners]
        rim = rim if _turns(rim, every[other] - every[one]) else rim[::-1]
        middle = np.broadcast_to(rim.mean(axis=0), rim.shape)
        triangles.append(np.stack([middle, rim, np.roll(rim, -1, axis=0)], axis=1))
        pairs.append((one, other % k))
    patch = np.repeat(np.arange(len(pairs)), [len(part) for part in triangles])
    cut = np.concatenate(triangles)
    for _ in range(levels):
        cut, patch = _quartered(cut), np.repeat(patch, 4)
    names = [f"{one + 1}|{other + 1} {number}" for number, (one, other) in enumerate(pairs, 1)]
    volume, rooms = side**3 * float(np.linalg.det(lattice)) / k, list[Room]()
    for cell in range(k - 1):
        signs = [int(one == cell) - int(other == cell) for one, other in pairs]
        own = tuple((name, sign) for name, sign in zip(names, signs, strict=True) if sign)
        rooms.append(Room(f"bubble {cell + 1}", own, volume))
    patches = [Patch(name, alpha, pressure=0.0) for name in names]
    return _periodic(side * cut, patch, patches, side * lattice, rooms)


def _turns(rim: Floats, normal: Floats) -> bool:
    """Whether a convex polygon (k,3) runs counter-clockwise seen from where the normal points to."""
    return bool(np.cross(rim[1] - rim[0], rim[2] - rim[1]) @ normal > 0.0)


def _quartered(triangles: Floats) -> Floats:
    """Corners (4m,3,3) of triangles (m,3,3) cut at the middles of their sides."""
    a, b, c = triangles.transpose(1, 0, 2)
    bc, ca, ab = 0.5 * (b + c), 0.5 * (c + a), 0.5 * (a + b)
    return np.stack([a, ab, ca, b, bc, ab, c, ca, bc, bc, ca, ab], axis=1).reshape(-1, 3, 3)


def _periodic(
    triangles: Floats, patch: Ints, patches: Sequence[Patch], lattice: Floats, rooms: Sequence[Room] = ()
) -> Surface:
    """The periodic surface of triangles (m,3,3): corners at one place are one vertex."""
    corners = triangles.reshape(-1, 3)
    near = cKDTree(corners).query_ball_point(corners, 1e-9 * np.abs(lattice).max(), return_sorted=True)
    first, faces = np.unique([group[0] for group in near], return_inverse=True)
    X = corners[first]
    images = images_in(X, lattice)
    return Surface(X, faces.reshape(-1, 3), patch, tuple(patches), rooms=tuple(rooms), images=images)


def _level(kind: str, X: Floats) -> tuple[Floats, Floats]:
    """The level set's function (k,) at points (k,3) of the cube of side 1, and its gradient (k,3)."""
    turn = 2.0 * np.pi
    (a, b, c), (u, v, w) = np.cos(turn * X).T, np.sin(turn * X).T
    if kind == "P":
        return a + b + c, -turn * np.stack([u, v, w], axis=1)
    if kind == "G":
        slope = [a * b - w * u, b * c - u * v, c * a - v * w]
        return u * b + v * c + w * a, turn * np.stack(slope, axis=1)
    slope = [-u * b * c - a * v * w, -a * v * c - u * b * w, -a * b * w - u * v * c]
    return a * b * c - u * v * w, turn * np.stack(slope, axis=1)


def _on_level_set(kind: str, X: Floats) -> Floats:
    """Points (k,3) moved along the gradient to where the function is zero."""
    for _ in range(STEPS):
        value, slope = _level(kind, X)
        X = X - (value / np.einsum("ij,ij->i", slope, slope))[:, None] * slope
    return X
