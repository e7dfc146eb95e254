"""Enneper's minimal surface in its own boundary, Enneper's wire."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Surface
from pcmc.base import validate
from pcmc.base.arrays import Floats

from .builder import Builder
from .exact import ExactSolution
from .ring_mesh import ring_mesh
from .weierstrass import Complexes, MinimalSurface

SQUEEZE = 0.97  # of the heights: a start that is clearly not the solution, yet as symmetric
WIDEST = np.sqrt(3.0)  # there the wire crosses itself


def enneper(
    edge_length: float = 0.15, *, radius: float = 0.8, alpha: float = 1.0, exact: bool = False
) -> Surface:
    """The part |w| ≤ R of Enneper's surface, its boundary fixed:

        X(w) = Re (w - w³/3, i (w + w³/3), w²),    area π (R² + R⁴ + R⁶/3)

    Its Gauss map is w itself, and R = 1 a hemisphere: up to there it is stable and the only surface of
    the disc's type in this wire (Ruchert 1981). At R = 1 the branch has a pitchfork; beyond, Enneper's
    surface has index 1, and two mirror images with less area leave it (Nitsche 1978; Beeson and Tromba
    1984). The mesh has the symmetry that maps one to the other: a quarter turn with z → -z.

    Parameters
    ----------
    edge_length : length.
    radius : R < √3, where the wire begins to cross itself; the parameter w has no unit.
    alpha : tension of "film", force/length.
    exact : put the vertices on Enneper's surface; otherwise the heights of the free ones are 0.97 of it.

    >>> surface = enneper(exact=True)
    >>> bool(enneper_exact().distance(surface).max() < 1e-12)
    True
    """
    R = validate.number("radius", radius, above=0.0, below=float(WIDEST))
    length = R + R**3 / 3.0
    rings = max(2, round(length / validate.positive("edge_length", edge_length)))
    net = ring_mesh(8 * np.arange(1, rings + 1))
    # rings at equal steps along the meridians: r + r³/3 = share · length
    share = np.linspace(0.0, length, rings + 1)
    r = 2.0 * np.sinh(np.arcsinh(1.5 * share) / 3.0)
    w = r[np.rint(net.radius * rings).astype(int)] * np.exp(1j * net.angle)
    rim = np.arange(len(w) - 8 * rings, len(w))
    mesh = Builder()
    mesh.add_faces(mesh.add_points(_position(w))[net.faces], 0)
    surface = mesh.surface([Patch("film", alpha, pressure=0.0)], fixed=rim)
    if exact:
        return surface
    X = surface.vertices.copy()
    X[surface.free, 2] *= SQUEEZE
    return surface.moved(X)


def enneper_exact(*, radius: float = 0.8, alpha: float = 1.0) -> ExactSolution:
    """A = π (R² + R⁴ + R⁶/3); index 0 up to R = 1, then 1.

    >>> found = enneper_exact(radius=1.0)
    >>> round(found.area / np.pi, 12), found.index, enneper_exact(radius=1.1).index
    (2.333333333333, 0, 1)
    """
    R = validate.number("radius", radius, above=0.0, below=float(WIDEST))
    area = np.pi * (R**2 + R**4 + R**6 / 3.0)
    steps = np.linspace(0.0, R, 60)
    samples = (steps[:, None] * np.exp(2j * np.pi * np.arange(240) / 240)).ravel()
    shapes = {"film": MinimalSurface(_position, _tangent, samples)}
    return ExactSolution(validate.positive("alpha", alpha) * area, area, 0.0, R**2, shapes, int(R > 1.0))


def enneper_wire(radius: float, angles: Floats) -> Floats:
    """(k,3) points X(R e^{iθ}) of Enneper's wire at angles θ (k,), radians.

    >>> enneper_wire(1.0, np.array([0.0, 0.5 * np.pi])).round(12).tolist()
    [[0.666666666667, 0.0, 1.0], [0.0, -0.666666666667, -1.0]]
    """
    return _position(radius * np.exp(1j * np.asarray(angles)))


def _position(w: Complexes) -> Floats:
    return np.real(np.stack([w - w**3 / 3.0, 1j * (w + w**3 / 3.0), w**2], axis=-1))


def _tangent(w: Complexes) -> Complexes:
    return np.stack([1.0 - w**2, 1j * (1.0 + w**2), 2.0 * w], axis=-1)
