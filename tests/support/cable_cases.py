"""Surfaces with cables and weights, for tests of what they share with all others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from shapes import shaken

from generators.grid import grid_faces
from pcmc import Cable, Patch, Plane, Surface


def net(pressures: tuple[float, float] = (0.5, 0.2), weights: tuple[float, float] = (0.7, -0.3)) -> Surface:
    """Two patches over a square on a tilted Π, cables on a free edge, inside a patch and between."""
    side = np.linspace(0.0, 2.0, 5)
    X = np.array([[x, y, 1.0 + 0.2 * x * y] for x in side for y in side])
    faces = grid_faces(4, 4)
    patch = (X[faces].mean(axis=1)[:, 0] > 1.0).astype(int)
    number = np.arange(25).reshape(5, 5)
    surface = Surface(
        X,
        faces,
        patch,
        [Patch("a", 1.0, pressures[0], weight=weights[0]), Patch("b", 1.5, pressures[1], weight=weights[1])],
        fixed=number[[0, 0, -1, -1], [0, -1, 0, -1]],
        plane=Plane((0.1, 0.2, 0.3), (0.2, -0.1, 1.0)),
        cables=[
            Cable.along("edge", 2.0, number[0]),
            Cable.along("ridge", 1.0, number[1:4, 1]),
            Cable.along("between", 0.5, number[2]),
        ],
    )
    return shaken(surface)


def heavy_net() -> Surface:
    """The same with weights on the cables, one of them upwards."""
    weights = (0.3, -0.2, 0.5)
    return replace(net(), cables=[replace(c, weight=g) for c, g in zip(net().cables, weights, strict=True)])


def hanging(columns, weight=1.0):
    """A rope between (±1, 0, 1) in an upright sheet, which pulls as much from above as from below."""
    x, z = np.meshgrid(np.linspace(-1.0, 1.0, columns + 1), np.arange(3.0), indexing="ij")
    X = np.stack([x.ravel(), 0.0 * x.ravel(), z.ravel()], axis=1)
    rim = (np.abs(X[:, 0]) == 1.0) | (X[:, 2] != 1.0)
    rope = Cable.along("rope", 1.0, np.flatnonzero(X[:, 2] == 1.0))
    faces = grid_faces(columns, 2)
    return Surface(
        X,
        faces,
        np.zeros(len(faces), dtype=int),
        [Patch("sheet", 1.0, 0.0)],
        fixed=rim,
        cables=[replace(rope, weight=weight)],
    )
