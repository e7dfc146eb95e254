"""A small surface that has everything a file must carry."""

import numpy as np

from pcmc import Cable, Circle, Line, Patch, Plane, Surface
from pcmc.surface import Room


def tent(names=("west side", "east", "wall"), pressures=(1.0, 0.5, 0.5), tilted=True) -> Surface:
    """Two slopes and a wall of two rows on a tilted Π away from the origin, jittered.

    All three tensions differ, 6 vertices are fixed and 2 slide. The wall carries the difference of
    the pressures on its two sides, so that they balance along the ridge.
    """
    X = [[0, 0, 0], [0, 4, 0], [0, 1, 1], [0, 3, 1], [0, 1, 0], [0, 3, 0],
         [-1, 0, 0], [-1, 4, 0], [1, 0, 0], [1, 4, 0]]  # fmt: skip
    west = [[0, 2, 6], [2, 3, 6], [3, 7, 6], [3, 1, 7]]
    east = [[0, 8, 2], [2, 8, 3], [3, 8, 9], [3, 9, 1]]
    wall = [[0, 4, 2], [4, 5, 2], [5, 3, 2], [5, 1, 3]]
    jitter = np.random.default_rng(5).normal(scale=0.1, size=(10, 3)) * [1, 1, 0]
    X = np.array(X, dtype=float) + jitter
    plane = Plane()
    if tilted:
        axis = np.array([2.0, -1.0, 3.0]) / np.sqrt(14.0)
        angle = 0.7
        K = np.cross(np.eye(3), axis)
        rotation = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
        point = np.array([3.0, -2.0, 1.5])
        X = X @ rotation.T + point
        plane = Plane(tuple(point), tuple(rotation[:, 2]))
    return Surface(
        X,
        west + east + wall,
        [0] * 4 + [1] * 4 + [2] * 4,
        [Patch(*p) for p in zip(names, (3.0, 2.1, 0.7), pressures, strict=True)],
        fixed=[0, 1, 6, 7, 8, 9],
        on_plane=[4, 5],
        plane=plane,
    )


def everything(names=("west", "east"), more=("ridge", "hall", "mirror 1")) -> Surface:
    """Half a roof with all that a surface may have besides walls, and names for its patches and other parts.

    West carries weight, east snow; a cable runs between them, and a room is below both. The left edge is
    fixed; the right one slides on a mirror plane, the lower one along a line, the upper one along a circle.
    """
    x, y = (part.ravel() for part in np.meshgrid(np.arange(7.0), np.arange(5.0), indexing="ij"))
    X = np.column_stack([x, 0.25 * y * np.sqrt(25.0 - (x - 3.0) ** 2), 0.1 * x * y * (4.0 - y)])
    a = (5 * np.arange(6)[:, None] + np.arange(4)).ravel()
    F = np.concatenate([np.stack([a, a + 5, a + 6], axis=1), np.stack([a, a + 6, a + 1], axis=1)])
    inner = (x > 0.0) & (x < 6.0)
    ridge = np.flatnonzero(x == 3.0)
    line, arc = Line((0, 0, 0), (1, 0, 0)), Circle((3, 0, 0), (0, 0, 1), 5)
    return Surface(
        X,
        F,
        (np.tile(a, 2) >= 15).astype(int),
        [Patch(names[0], 3.0, weight=0.02), Patch(names[1], 2.5, 1.1, snow=0.125)],
        fixed=(x == 0.0) | ((x == 6.0) & (y == 4.0)),
        on_plane=(x == 6.0) & (y == 0.0),
        on_line={line: inner & (y == 0.0), arc: inner & (y == 4.0)},
        on_planes={Plane((6, 0, 0), (1, 0, 0), more[2], mirror=True): x == 6.0},
        cables=[Cable.along(more[0], 0.5, ridge)],
        rooms=[Room(more[1], dict.fromkeys(names, 1), 7.0)],
    )
