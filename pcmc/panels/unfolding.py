"""Triangles laid flat, and the angles between those that share an edge."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ..base.arrays import Floats, Ints
from ..surface.geometry import area_vectors, edge_vectors


def unfolded(P: Floats) -> Floats:
    """(m,3,2) triangles with corners P (m,3,3) laid flat, their outside up: congruent, length.

    The longest edge lies on the x axis and starts at the origin; the third corner is above it.

    >>> unfolded(np.array([[[0, 0, 1], [0, 0, 5], [0, 3, 1.0]]])).round(12).tolist()
    [[[3.2, 2.4], [0.0, 0.0], [5.0, 0.0]]]
    """
    edges = edge_vectors(P)
    lengths = np.linalg.norm(edges, axis=2)
    every, apex = np.arange(len(P)), lengths.argmax(axis=1)
    first, second = (apex + 1) % 3, (apex + 2) % 3
    base = lengths[every, apex]
    along = edges[every, apex] / base[:, None]
    flat = np.zeros((len(P), 3, 2))
    flat[every, second, 0] = base
    flat[every, apex, 0] = np.einsum("ij,ij->i", P[every, apex] - P[every, first], along)
    flat[every, apex, 1] = 2.0 * np.linalg.norm(area_vectors(P), axis=1) / base
    return flat


def joints(X: Floats, F: Ints, edge_of_face: Ints) -> pd.DataFrame:
    """A row for each pair of triangles that are neighbours at an edge, and for each edge of a single one.

    Columns: ``edge``; ``first``, ``second``, rows of F (-1 for none); ``dihedral``, the angle between the two
    on the inner side of the first, degrees: 180 where they are flat, less at a ridge, more at a valley. Where
    k > 2 triangles meet, the edge has k rows, in turn around it.

    >>> X = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, -1.0]])
    >>> joints(X, np.array([[0, 1, 2], [1, 0, 3]]), np.array([[1, 2, 0], [3, 4, 0]])).dihedral.tolist()
    [135.0, nan, nan, nan, nan]
    """
    sides = edge_of_face.ravel()
    order = np.argsort(sides, kind="stable")
    edge = sides[order]
    start = np.flatnonzero(np.append(True, edge[1:] != edge[:-1]))
    count = np.diff(np.append(start, len(edge)))
    lead = np.repeat(start, count)  # the first triangle at each edge: angles are seen from it
    inward, normal = _frames(X[F], order)
    angle = np.arctan2(
        -np.einsum("ij,ij->i", inward, normal[lead]), np.einsum("ij,ij->i", inward, inward[lead])
    )
    angle = np.degrees(angle) % 360.0
    angle[start] = 0.0
    turn = np.lexsort((angle, edge))
    edge, face, angle = edge[turn], order[turn] // 3, angle[turn]
    after = np.arange(len(edge)) + 1
    last = start + count - 1
    after[last] = start
    between = (angle[after] - angle) % 360.0
    between[count.repeat(count) == 1] = np.nan
    second = np.where(np.isnan(between), -1, face[after])
    once = np.ones(len(edge), dtype=bool)
    once[last[count == 2]] = False  # two triangles are one pair
    table = pd.DataFrame({"edge": edge, "first": face, "second": second, "dihedral": between})
    return table[once].reset_index(drop=True)


def _frames(P: Floats, sides: Ints) -> tuple[Floats, Floats]:
    """Unit vectors (k,3) of sides 3 f + j: into the triangle, across its edge j; and its normal."""
    face, side = sides // 3, sides % 3
    along = edge_vectors(P)[face, side]
    normal = area_vectors(P)[face]
    inward = np.cross(normal, along)
    return tuple(v / np.maximum(np.linalg.norm(v, axis=1), 1e-300)[:, None] for v in (inward, normal))
