"""Films without pressure in the edges of a regular tetrahedron: of all six, and of four of them."""

from __future__ import annotations

import numpy as np
from scipy.special import ellipk

from pcmc import Patch, Surface
from pcmc.base import validate
from pcmc.base.arrays import Floats, Ints

from .builder import Builder
from .exact import ExactSolution, FlatPlane, Shape
from .grid import cut_squares
from .weierstrass import Complexes, MinimalSurface

CORNERS = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]]) / np.sqrt(8.0)  # edges of length 1
EDGES = [(a, b) for a in range(4) for b in range(a + 1, 4)]
OFF_CENTRE = (0.035, 0.018, -0.028)  # in edges of the tetrahedron: where the films meet at the start


def tetrahedral_film(
    edge_length: float = 0.25, *, side: float = 1.0, alpha: float = 1.0, exact: bool = False
) -> Surface:
    """Six flat films from the edges of a regular tetrahedron to its centre: Plateau's second law.

    Four triple lines meet in the centre at arccos(-1/3) = 109.47°, three films in each at 120°. No
    surface that separates the four faces has less area (Lawlor and Morgan 1994).

    Parameters
    ----------
    edge_length, side : lengths; every side has side / edge_length segments.
    alpha : tension of all films, "film 01" to "film 23", force/length.
    exact : put the vertices on the exact solution; otherwise the centre is moved aside, and the rest
        along with it.

    >>> surface = tetrahedral_film(exact=True)
    >>> bool(tetrahedral_film_exact().distance(surface).max() < 1e-12), len(surface.topology.junctions)
    (True, 4)
    """
    side = validate.positive("side", side)
    n = max(1, round(side / validate.positive("edge_length", edge_length)))
    centre = side * np.array((0.0, 0.0, 0.0) if exact else OFF_CENTRE)
    corners = side * CORNERS
    mesh = Builder()
    middle = mesh.add_points(centre)
    share = (np.arange(1, n + 1) / n)[:, None]
    spokes = [np.append(middle, mesh.add_points(centre + share * (corner - centre))) for corner in corners]
    fixed = [spoke[-1:] for spoke in spokes]
    for patch, (a, b) in enumerate(EDGES):
        number = np.zeros((n + 1, n + 1), dtype=np.int64)  # [i, j]: i/n towards a, j/n towards b
        number[:, 0], number[0, :] = spokes[a], spokes[b]
        i, j = (k + 1 for k in np.nonzero(np.add.outer(np.arange(n), np.arange(n)) < n - 1))
        ways = i[:, None] / n * (corners[a] - centre) + j[:, None] / n * (corners[b] - centre)
        number[i, j] = mesh.add_points(centre + ways)
        mesh.add_faces(_triangle_faces(number), patch)
        fixed.append(number[np.arange(1, n), np.arange(n - 1, 0, -1)])
    films = [Patch(f"film {a}{b}", alpha, pressure=0.0) for a, b in EDGES]
    return mesh.surface(films, fixed=np.concatenate(fixed))


def tetrahedral_film_exact(*, side: float = 1.0, alpha: float = 1.0) -> ExactSolution:
    """A = 3 side² / 2√2; index 0.

    >>> round(tetrahedral_film_exact(side=8**0.5).area / 72**0.5, 12)
    1.0
    """
    side = validate.positive("side", side)
    area = 3.0 * side**2 / 8.0**0.5
    normals = {f"film {a}{b}": np.cross(CORNERS[a], CORNERS[b]) for a, b in EDGES}
    shapes: dict[str, Shape] = {name: FlatPlane(_unit(normal)) for name, normal in normals.items()}
    height = float(side * CORNERS[:, 2].max())
    return ExactSolution(validate.positive("alpha", alpha) * area, area, 0.0, height, shapes, 0)


def _unit(vector: Floats) -> tuple[float, float, float]:
    x, y, z = (vector / np.linalg.norm(vector)).tolist()
    return x, y, z


def _triangle_faces(number: Ints) -> Ints:
    """(n²,3) faces of a triangular lattice, numbered by [i, j] with i + j ≤ n."""
    n = len(number) - 1
    i, j = np.nonzero(np.add.outer(np.arange(n), np.arange(n)) < n)
    upright = np.stack([number[i, j], number[i + 1, j], number[i, j + 1]], axis=1)
    i, j = np.nonzero(np.add.outer(np.arange(n), np.arange(n)) < n - 1)
    inverted = np.stack([number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]], axis=1)
    return np.concatenate([upright, inverted])


# ---- four edges: a piece of Schwarz's D surface ------------------------------------------------------

WIRE = np.array([[1, 0, 1], [0, 1, -1], [-1, 0, 1], [0, -1, -1]]) * [0.5, 0.5, 8**-0.5]  # edges of length 1


def skew_quadrilateral(
    edge_length: float = 0.1, *, side: float = 1.0, alpha: float = 1.0, exact: bool = False
) -> Surface:
    """The minimal surface in four edges of a regular tetrahedron: a piece of Schwarz's D surface.

    The first minimal surface found in a given wire (Riemann 1860, Schwarz 1865). It is a graph over a
    square, so it is the only one, and stable (Radó 1930).

    Parameters
    ----------
    edge_length, side : lengths; every side has about side / edge_length segments, an even number.
    alpha : tension of "film", force/length.
    exact : put the vertices on the minimal surface; otherwise they are on the hyperbolic paraboloid
        in the same edges.

    >>> surface = skew_quadrilateral(0.25, exact=True)
    >>> bool(skew_quadrilateral_exact().distance(surface).max() < 1e-9)
    True
    """
    side = validate.positive("side", side)
    half = max(1, round(0.5 * side / validate.positive("edge_length", edge_length)))
    n = 2 * half
    u, v = np.meshgrid(np.linspace(0.0, 1.0, n + 1), np.linspace(0.0, 1.0, n + 1), indexing="ij")
    weights = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=-1).reshape(-1, 4)
    mesh = Builder()
    number = mesh.add_points(side * weights @ WIRE).reshape(n + 1, n + 1)
    low = np.arange(n) < half
    mesh.add_faces(cut_squares(number, low[:, None] != low), 0)  # diagonals cut the corners off
    rim = np.concatenate([number[0], number[-1], number[1:-1, 0], number[1:-1, -1]])
    surface = mesh.surface([Patch("film", alpha, pressure=0.0)], fixed=rim)
    if not exact:
        return surface
    X = surface.vertices.copy()
    X[surface.free] = _schwarz(side).project(X[surface.free])
    return surface.moved(X)


def skew_quadrilateral_exact(*, side: float = 1.0, alpha: float = 1.0) -> ExactSolution:
    """A = side² K(√3/2) / 2K(1/2), K the complete elliptic integral of a modulus; index 0.

    >>> round(skew_quadrilateral_exact().area, 13)
    0.6396307855855
    """
    side = validate.positive("side", side)
    area = float(side**2 * ellipk(0.75) / (2.0 * ellipk(0.25)))
    shapes = {"film": _schwarz(side)}
    height = float(side * WIRE[0, 2])
    return ExactSolution(validate.positive("alpha", alpha) * area, area, 0.0, height, shapes, 0)


def _schwarz(side: float) -> MinimalSurface:
    """φ = k (1 - w², i (1 + w²), 2w) / √(1 - 14 w⁴ + w⁸) over a face of the cube, seen on the sphere."""
    nodes, weights = np.polynomial.legendre.leggauss(48)
    nodes, weights = 0.5 * (nodes + 1.0), 0.5 * weights

    def tangent(w: Complexes) -> Complexes:
        root = np.sqrt(1.0 - 14.0 * w**4 + w**8)
        return np.stack([1.0 - w**2, 1j * (1.0 + w**2), 2.0 * w], axis=-1) / root[..., None]

    def position(w: Complexes) -> Floats:
        # along ω = w (1 - q²), which removes the root's zero at the corners
        steps = tangent(w[:, None] * (1.0 - nodes**2)) * (w[:, None] * 2.0 * nodes * weights)[..., None]
        return np.real(steps.sum(axis=1))

    corner = complex(np.sqrt(2.0 - np.sqrt(3.0)))
    scale = side * WIRE[0, 0] / float(position(np.array([corner]))[0, 0])
    t = np.sin(0.5 * np.pi * np.linspace(-1.0, 1.0, 81))  # close together near the corners
    x, y = (grid.ravel() for grid in np.meshgrid(t, t))
    ray = np.stack([(x - y), (x + y), np.full_like(x, np.sqrt(2.0))])
    ray /= np.linalg.norm(ray, axis=0)
    samples = (ray[0] + 1j * ray[1]) / (1.0 + ray[2])
    return MinimalSurface(lambda w: scale * position(w), lambda w: scale * tangent(w), samples)
