"""Example 1: two square patches with a wall under their common side (Figs. 6-10)."""

from __future__ import annotations

import numpy as np

from pcmc import Patch, Surface
from pcmc.base import validate
from pcmc.base.arrays import Floats, Ints

from .builder import Builder
from .grid import cut_squares

LEFT, RIGHT, WALL = range(3)
DIAGONALS = ("symmetric", "parallel")


def two_squares(
    n: int = 4,
    *,
    alpha: float = 2.0,
    alpha_aux: float = 2.0,
    side: float = 4.0,
    height: float = 1.0,
    diagonals: str = "symmetric",
) -> Surface:
    """Two squares side by side on Π (z = 0) and the wall under the side they share (x = 0).

    The outline is fixed, the wall's foot slides on Π. The initial height is ``height`` in the
    middle of the junction and falls to 0 at the outline: height (1 - (x/side)²)(1 - (2y/side)²).

    Parameters
    ----------
    n : squares along each side of a patch; the paper has 4, and 8 in Fig. 9b.
    alpha, alpha_aux : tension of the patches "left" and "right", and of the "wall"; force/length.
    side, height : length of a square's side and initial height, length.
    diagonals : "symmetric", each quarter's diagonals pointing to its patch's centre, so that no
        corner of the outline is cut off by a triangle that cannot move, and the two patches mirror
        images; or "parallel", all one way.

    Returns
    -------
    Surface
        4 n² triangles in the two patches; every angle at least 33° for n ≥ 3.

    >>> surface = two_squares()
    >>> surface.n, surface.m, float(surface.vertices[:, 2].max())
    (48, 70, 1.0)
    """
    n = validate.integer("n", n, least=2)
    side = validate.positive("side", side)
    height = validate.positive("height", height)
    validate.choice("diagonals", diagonals, DIAGONALS)
    mesh = Builder()
    number = mesh.add_points(_roof(n, side, height)).reshape(2 * n + 1, n + 1)
    faces = _squares(number, n, diagonals)
    mesh.add_faces(faces[: len(faces) // 2], LEFT)
    mesh.add_faces(faces[len(faces) // 2 :], RIGHT)
    foot = mesh.add_wall(WALL, number[n], mesh.positions(number[n]) * [1.0, 1.0, 0.0], side / n)
    return mesh.surface(
        (Patch("left", alpha), Patch("right", alpha), Patch("wall", alpha_aux, pressure=0.0)),
        fixed=np.concatenate([number[0], number[-1], number[:, 0], number[:, -1]]),
        on_plane=foot,
    )


def _roof(n: int, side: float, height: float) -> Floats:
    """((2n+1)(n+1),3) vertices of both squares, y running fastest."""
    x, y = np.meshgrid(np.arange(-n, n + 1) / n, np.arange(-n, n + 1, 2) / n, indexing="ij")
    z = height * (1.0 - x**2) * (1.0 - y**2)
    return np.stack([side * x, 0.5 * side * y, z], axis=-1).reshape(-1, 3)


def _squares(number: Ints, n: int, diagonals: str) -> Ints:
    """(4n²,3) faces: every square cut along one diagonal."""
    i, j = np.indices((2 * n, n))
    if diagonals == "parallel":
        return cut_squares(number, np.ones(i.shape, dtype=bool))
    left = (2 * i + 1 < n) == (2 * j + 1 < n)
    return cut_squares(number, np.where(i < n, left, ~left[::-1]))
