"""Surfaces with everything a motion space distinguishes, small enough for dense algebra."""

import numpy as np
from cable_cases import heavy_net, net
from shapes import octahedron, pyramid, shaken, three_patches
from tents import tent

from generators import double_bubble, two_squares
from pcmc import Patch, Plane, Surface

TILTED = Plane((0.3, -0.2, 0.5), (1.0, -2.0, 4.0))


def seam() -> Surface:
    """Two roofs of one tension and pressure that meet along y = 0 with nothing between them."""
    flat = np.array([[x, y, 0.1 * (4 - x * x) * (1 - y * y)] for y in (-1, 0, 1) for x in range(-2, 3)])
    flat[:, 2] += 0.02 * np.cos(np.arange(15))
    F = [[5 * j + i, 5 * j + i + 1, 5 * j + i + 6] for j in (0, 1) for i in range(4)]
    F += [[5 * j + i, 5 * j + i + 6, 5 * j + i + 5] for j in (0, 1) for i in range(4)]
    side = [j for _ in range(2) for j in (0, 1) for _ in range(4)]
    held = [*range(5), *range(10, 15)]
    return Surface(flat, F, side, [Patch("south", 2.0), Patch("north", 2.0)], fixed=held)


def against() -> Surface:
    """Two films without pressure, one sheet, whose faces run against each other."""
    surface = seam()
    faces = surface.faces.copy()
    faces[surface.patch_of_face == 1] = faces[surface.patch_of_face == 1][:, ::-1]
    films = [Patch("south", 2.0, pressure=0.0), Patch("north", 2.0, pressure=0.0)]
    return Surface(surface.vertices, faces, surface.patch_of_face, films, fixed=surface.fixed)


def touching() -> Surface:
    """Two roofs that share nothing but their tops, one upside down."""
    X = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0.2, 0.1, 0.4]]
    F = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    lid = np.where(F == 4, 4, F + 5)[:, ::-1]
    X += [[1.3, 1, 1], [-1, 1.2, 1], [-0.8, -1, 0.9], [1, -1, 1]]
    return Surface(
        X,
        [*F, *lid],
        [0] * 4 + [1] * 4,
        [Patch("floor", 1.3), Patch("lid", 1.3)],
        fixed=[0, 1, 2, 3, 5, 6, 7, 8],
    )


SURFACES = {
    "pyramid": lambda: pyramid(1.3),
    "closed": lambda: shaken(octahedron(0.7)),
    "tent": tent,
    "tent under three pressures": lambda: tent(pressures=(1.0, -0.4, 0.3)),
    "three patches": lambda: shaken(three_patches()),
    "three patches, tilted": lambda: shaken(three_patches(plane=TILTED)),
    "wall without tension": lambda: shaken(two_squares(3, alpha_aux=0.0)),
    "seam": seam,
    "faces against each other": against,
    "touching": touching,
    "cables and weights": net,
    "cables with weights": heavy_net,
    "bubbles": lambda: shaken(double_bubble(1.2)),
}
