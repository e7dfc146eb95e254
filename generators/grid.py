"""Square grids of triangles."""

from __future__ import annotations

import numpy as np

from pcmc.base.arrays import Bools, Ints


def grid_faces(columns: int, rows: int) -> Ints:
    """(2 columns·rows,3) triangles of a grid whose vertex (i,j) has the number i (rows + 1) + j.

    They are counter-clockwise with i to the right and j up. In each quarter of the grid the diagonals lead
    towards its corner, so that no triangle has two sides on the boundary.

    >>> grid_faces(2, 1).tolist()
    [[0, 2, 3], [0, 3, 1], [2, 4, 3], [4, 5, 3]]
    """
    i, j = np.indices((columns, rows))
    rising = (2 * i + 1 <= columns) == (2 * j + 1 <= rows)
    return cut_squares(np.arange((columns + 1) * (rows + 1)).reshape(columns + 1, rows + 1), rising)


def cut_squares(number: Ints, rising: Bools) -> Ints:
    """(2cr,3) triangles of a grid of c x r squares, each cut along one diagonal.

    Parameters
    ----------
    number : (c+1,r+1) the vertex at (i,j); triangles are counter-clockwise with i to the right and j up.
    rising : (c,r) whether the diagonal of square (i,j) leads from vertex (i,j) to (i+1,j+1).

    >>> cut_squares(np.array([[0, 1], [2, 3]]), np.array([[True]])).tolist()
    [[0, 2, 3], [0, 3, 1]]
    """
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    first = np.where(rising[..., None], np.stack([a, b, c], -1), np.stack([a, b, d], -1))
    second = np.where(rising[..., None], np.stack([a, c, d], -1), np.stack([b, c, d], -1))
    return np.stack([first, second], axis=2).reshape(-1, 3)
