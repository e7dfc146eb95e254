"""Merge vertices at one place, so that patches from separate meshes share their junctions."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..surface.geometry import bounding_size

TOLERANCE = 1e-7  # of the size; single precision keeps this much


def coincident(X: Floats, tolerance: float = TOLERANCE) -> tuple[Ints, Ints]:
    """Which vertices to keep, and the index among them of every vertex.

    Vertices closer than ``tolerance`` times the diagonal of the bounding box become one, the first of
    them in order.

    >>> keep, place = coincident(np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1e-9], [0, 1, 0.0]]))
    >>> keep.tolist(), place.tolist()
    ([0, 1, 3], [0, 1, 0, 2])
    """
    n = len(X)
    pairs = cKDTree(X).query_pairs(tolerance * bounding_size(X), output_type="ndarray")
    if not len(pairs):
        return np.arange(n), np.arange(n)
    graph = coo_array((np.ones(len(pairs), dtype=bool), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    group = connected_components(graph, directed=False)[1]
    _, first, inverse = np.unique(group, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[inverse.ravel()]
