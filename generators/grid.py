"""Square grids of triangles, with diagonals that lead into the corners."""

from __future__ import annotations

import numpy as np

from pcmc.base.arrays import Ints


def grid_faces(columns: int, rows: int) -> Ints:
    """(2 columns·rows,3) triangles of a grid whose vertex (i,j) has the number i (rows + 1) + j.

    They are counter-clockwise with i to the right and j up. In each quarter of the grid the diagonals lead
    towards its corner, so that no triangle has two sides on the boundary.

    >>> grid_faces(2, 1).tolist()
    [[0, 2, 3], [0, 3, 1], [2, 4, 3], [3, 4, 5]]
    """
    i, j = (k.ravel() for k in np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij"))
    a = i * (rows + 1) + j
    b, c, d = a + rows + 1, a + rows + 2, a + 1
    rising = (2 * i + 1 <= columns) == (2 * j + 1 <= rows)
    first = np.where(rising[:, None], np.stack([a, b, c], 1), np.stack([a, b, d], 1))
    second = np.where(rising[:, None], np.stack([a, c, d], 1), np.stack([d, b, c], 1))
    return np.stack([first, second], axis=1).reshape(-1, 3)
