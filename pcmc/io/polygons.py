"""Polygons to triangles, by a fan from the corner that makes the best ones."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import FileError
from ..meshing.quality import triangle_quality
from ..surface.geometry import area_vectors


def triangulate(X: Floats, corners: Ints, counts: Ints) -> tuple[Ints, Ints, tuple[str, ...]]:
    """Triangles (m,3), the polygon each comes from (m,), and a note if any was cut.

    ``corners`` lists the vertex indices of polygon after polygon, ``counts`` how many each has. The
    order of the polygons is kept. A polygon of k corners becomes the fan of k - 2 triangles whose
    worst one is best, which for a quad is the better diagonal.

    >>> X = np.array([[0, 0, 0], [2, 0, 0], [3, 1, 0], [1, 1, 0.0]])
    >>> triangulate(X, np.array([0, 1, 2, 3]), np.array([4]))[0].tolist()
    [[1, 2, 3], [1, 3, 0]]
    """
    few = np.flatnonzero(counts < 3)
    if len(few):
        raise FileError(
            f"face {few[0] + 1} has {counts[few[0]]} corners; a face needs three or more"
        )
    if (counts == 3).all():
        return corners.reshape(-1, 3), np.arange(len(counts)), ()
    start = np.cumsum(counts) - counts
    triangles, origin = [], []
    for k in np.unique(counts):
        chosen = np.flatnonzero(counts == k)
        polygon = corners[start[chosen][:, None] + np.arange(k)]
        triangles.append(_best_fans(X, polygon, chosen).reshape(-1, 3))
        origin.append(np.repeat(chosen, k - 2))
    source = np.concatenate(origin)
    order = np.argsort(source, kind="stable")
    return np.concatenate(triangles)[order], source[order], (_note(counts),)


def _best_fans(X: Floats, polygon: Ints, number: Ints) -> Ints:
    """(p,k-2,3) the fan of each polygon (p,k) whose smallest signed quality is largest."""
    k = polygon.shape[1]
    if k == 3:
        return polygon[:, None, :]
    relative = X[polygon] - X[polygon[:, :1]]
    vector_area = np.cross(relative, np.roll(relative, -1, axis=1)).sum(axis=1)
    fans = np.stack([_fan(np.roll(polygon, -s, axis=1)) for s in range(k)])
    side = np.sign(np.einsum("sptd,pd->spt", area_vectors(X[fans]), vector_area))
    quality = triangle_quality(X, fans.reshape(-1, 3)).reshape(side.shape)
    worst = (side * quality).min(axis=2)
    best = worst.argmax(axis=0)
    bad = np.flatnonzero(worst.max(axis=0) <= 0.0)
    if len(bad):
        raise FileError(
            f"face {number[bad[0]] + 1} is a polygon of {k} corners that no fan of triangles fills;"
            " cut it into triangles in the program that wrote it"
        )
    return fans[best, np.arange(len(polygon))]


def _fan(polygon: Ints) -> Ints:
    k = polygon.shape[1]
    first = np.repeat(polygon[:, :1], k - 2, axis=1)
    return np.stack([first, polygon[:, 1:-1], polygon[:, 2:]], axis=2)


def _note(counts: Ints) -> str:
    quads, more = np.count_nonzero(counts == 4), np.count_nonzero(counts > 4)
    parts = [f"{quads} quads" if quads else "", f"{more} polygons" if more else ""]
    return f"{' and '.join(filter(None, parts))} were cut into triangles"
