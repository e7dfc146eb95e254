"""The middles of edges for a finer mesh, also in walls that have pinched."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats, Ints
from ..surface import Surface
from .pinching import standing_part, under_low


def midpoints(surface: Surface, edges: Ints) -> Floats:
    """(k,3) the middles of edges (k,2), for a finer mesh.

    A wall's edge may lead from a resting junction to a standing vertex. Its middle is placed in its row
    below the middle of the top edge: rows that coincide where the junction rests part again beside it.
    """
    start, end = edges.T
    X = surface.vertices
    middle = 0.5 * (X[start] + X[end])
    part = standing_part(surface)
    walls, rows, resting = part.walls, part.walls.rows, part.resting
    if not resting.any():
        return middle
    top, direction, drop = X.copy(), np.zeros_like(X), np.zeros_like(X)
    top[rows.vertices] = rows.top_places(X)
    direction[rows.vertices] = rows.directions(surface)
    of_held = walls.foot >= 0
    of_held[rows.vertices] = rows.feet[:, 0] >= 0
    drop[walls.held] = X[walls.held] - X[walls.foot[walls.held]]
    drop[rows.vertices] = rows.drops(X)
    down = resting.copy()
    down[rows.vertices] = under_low(rows, resting | walls.corner)
    of_wall = resting | walls.top_free
    of_wall[rows.vertices] = True
    rising = of_wall[start] & of_wall[end] & (down[start] != down[end])
    rising &= ~(surface.fixed[start] & surface.fixed[end])
    start, end = edges[rising].T
    place = 0.5 * (top[start] + top[end])
    height = surface.plane.height(place)[:, None]
    on_sliding = place + 0.5 * height * (direction[start] + direction[end])
    share = np.zeros(surface.n)
    share[rows.vertices] = 1.0 - rows.relative_height
    below = 0.25 * (share[start] + share[end])[:, None] * (drop[start] + drop[end])
    middle[rising] = np.where(of_held[start, None], place - below, on_sliding)
    return middle
