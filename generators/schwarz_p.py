"""Schwarz' primitive surface, as its piece between the mirror planes of an eighth of the cubic cell."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Plane, Surface
from pcmc.base import validate
from pcmc.base.arrays import Floats

from .ring_mesh import ring_mesh

AREA = (
    2.345102884044  # in the unit cubic cell (Schwarz 1865; Gandy and Klinowski, Chem. Phys. Lett. 322, 2000)
)
CORNERS = 0.25 * np.array([[1, 0, 2], [0, 1, 2], [0, 2, 1], [1, 2, 0], [2, 1, 0], [2, 0, 1]])
STEPS = 8  # of Newton's method to the level set: it converges quadratically from the hexagon


def schwarz_p(rings: int = 6, *, size: float = 1.0, alpha: float = 1.0) -> Surface:
    """The part of Schwarz' P surface in [0, size/2]³, a hexagon whose sides slide on the six mirror planes.

    Eight of them, the images in the planes x = 0, y = 0 and z = 0, make up a cubic cell, with a surface of
    area 2.345102884044 size². The start is the level set cos 2πx + cos 2πy + cos 2πz = 0, which is near. With
    these mirror planes the surface is a saddle of area: solve with ``target="stationary"``.

    Parameters
    ----------
    rings : rings of triangles from the middle of the hexagon to its sides.
    size : side of the cubic cell, length.
    alpha : tension of "film", force/length.

    >>> piece = schwarz_p()
    >>> piece.m, [plane.name for plane, _ in piece.on_planes]
    (216, ['x = 0', 'x = 1/2', 'y = 0', 'y = 1/2', 'z = 0', 'z = 1/2'])
    """
    rings = validate.integer("rings", rings, least=2)
    size, alpha = validate.positive("size", size), validate.positive("alpha", alpha)
    net = ring_mesh(6 * np.arange(1, rings + 1))
    turn = net.angle / (np.pi / 3.0)
    sector = np.rint(np.floor(turn + 1e-9)).astype(int)
    share = (turn - sector)[:, None]
    side = (1.0 - share) * CORNERS[sector % 6] + share * CORNERS[(sector + 1) % 6]
    X = _on_level_set(0.25 + net.radius[:, None] * (side - 0.25))
    planes = {}
    for axis, name in enumerate("xyz"):
        for place, text in ((0.0, "0"), (0.5, "1/2")):
            there = np.abs(X[:, axis] - place) < 1e-9
            X[there, axis] = place
            point, normal = size * place * np.eye(3)[axis], np.eye(3)[axis]
            planes[Plane(tuple(point), tuple(normal), f"{name} = {text}", mirror=True)] = there
    patch = np.zeros(len(net.faces), dtype=int)
    return Surface(
        size * X, net.faces, patch, (Patch("film", alpha, pressure=0.0),), on_planes=tuple(planes.items())
    )


def _on_level_set(X: Floats) -> Floats:
    """Points (k,3) moved along the gradient of Σ cos 2πx to where it is zero; a mirror plane keeps them."""
    for _ in range(STEPS):
        value = np.cos(2.0 * np.pi * X).sum(axis=1)
        slope = -2.0 * np.pi * np.sin(2.0 * np.pi * X)
        X = X - (value / np.einsum("ij,ij->i", slope, slope))[:, None] * slope
    return X
