"""Uneven meshes of squares, discs and charts, for the study ``coverage``. Their seeds are fixed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial import Delaunay

from generators.grid import cut_squares
from pcmc import Patch, Surface
from pcmc.base.arrays import Bools, Floats, Ints

Chart = Callable[[Floats, Floats], Floats]  # u, v in [0, 1] to points (n,3)


def sheet(chart: Chart, columns: int, rows: int, patch: Patch, jitter: float = 0.0, seed: int = 0) -> Surface:
    """A chart of the unit square on a grid, its outline fixed; vertices are moved by ``jitter`` squares."""
    u, v, faces, edge = grid(columns, rows, jitter, seed)
    return one_patch(chart(u, v), faces, patch, edge)


def one_patch(X: Floats, faces: Ints, patch: Patch, held: Bools, **supports: Any) -> Surface:
    """A surface of one patch."""
    return Surface(X, faces, np.zeros(len(faces), dtype=np.int64), (patch,), fixed=held, **supports)


def grid(columns: int, rows: int, jitter: float, seed: int) -> tuple[Floats, Floats, Ints, Bools]:
    """u and v of a grid's vertices, its triangles, and which vertices are on its outline.

    Squares are cut at random if vertices are moved; at the corners so that both triangles have a free side.
    """
    rng = np.random.default_rng(seed)
    i, j = np.indices((columns + 1, rows + 1))
    u, v = i + jitter * rng.uniform(-0.5, 0.5, i.shape), j + jitter * rng.uniform(-0.5, 0.5, i.shape)
    u[0], u[-1], v[:, 0], v[:, -1] = 0.0, columns, 0.0, rows
    falling = (i[1:, 1:] + j[1:, 1:]) % 2 == 0
    if jitter:
        falling = rng.random((columns, rows)) < 0.5
    falling[0, 0] = falling[-1, -1] = False
    falling[0, -1] = falling[-1, 0] = True
    faces = cut_squares(np.arange(i.size).reshape(i.shape), ~falling)
    edge = (i == 0) | (j == 0) | (i == columns) | (j == rows)
    return u.ravel() / columns, v.ravel() / rows, faces, edge.ravel()


def disc(edge_length: float, seed: int) -> tuple[Floats, Ints, Bools]:
    """Points (n,2) of the unit disc at random distances, Delaunay's triangles, and which are on its rim."""
    rng = np.random.default_rng(seed)
    count = max(10, round(2.0 * np.pi / edge_length))
    angle = 2.0 * np.pi * (np.arange(count) + rng.uniform(-0.25, 0.25, count)) / count
    points = [np.stack([np.cos(angle), np.sin(angle)], axis=1)]
    steps = np.arange(-1.0, 1.0 + edge_length, edge_length)
    x, y = np.meshgrid(steps, steps * np.sqrt(0.75))
    x[::2] += 0.5 * edge_length
    inner = np.stack([x.ravel(), y.ravel()], axis=1) + rng.uniform(-0.25, 0.25, (x.size, 2)) * edge_length
    points.append(inner[np.hypot(*inner.T) < 1.0 - 0.6 * edge_length])
    plan = np.concatenate(points)
    faces = Delaunay(plan).simplices.astype(np.int64)
    a, b, c = plan[faces].transpose(1, 0, 2)
    turned = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] < 0.0
    faces[turned] = faces[turned][:, ::-1]
    return plan, faces, np.arange(len(plan)) < count
