"""Surfaces with everything a motion space distinguishes, small enough for dense algebra."""

import numpy as np
from shapes import octahedron, pyramid, shaken, three_patches
from tents import tent

from generators import double_bubble, two_squares
from pcmc import Patch, Plane, Surface

TILTED = Plane((0.3, -0.2, 0.5), (1.0, -2.0, 4.0))


def seam() -> Surface:
    """Two roofs of one tension and pressure that meet along y = 0 with nothing between them."""
    flat = np.array(
        [[x, y, 0.1 * (4 - x * x) * (1 - y * y)] for y in (-1, 0, 1) for x in range(-2, 3)]
    )
    flat[:, 2] += 0.02 * np.cos(np.arange(15))
    F = [[5 * j + i, 5 * j + i + 1, 5 * j + i + 6] for j in (0, 1) for i in range(4)]
    F += [[5 * j + i, 5 * j + i + 6, 5 * j + i + 5] for j in (0, 1) for i in range(4)]
    side = [j for _ in range(2) for j in (0, 1) for _ in range(4)]
    held = [*range(5), *range(10, 15)]
    return Surface(flat, F, side, [Patch("south", 2.0), Patch("north", 2.0)], fixed=held)


SURFACES = {
    "pyramid": lambda: pyramid(1.3),
    "closed": lambda: shaken(octahedron(0.7)),
    "tent": tent,
    "tent under three pressures": lambda: tent(pressures=(1.0, -0.4, 0.3)),
    "three patches": lambda: shaken(three_patches()),
    "three patches, tilted": lambda: shaken(three_patches(plane=TILTED)),
    "wall without tension": lambda: shaken(two_squares(3, alpha_aux=0.0)),
    "seam": seam,
    "bubbles": lambda: shaken(double_bubble(1.2)),
}
