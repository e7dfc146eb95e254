"""Size fields: the edge length wanted at each vertex, and how an edge is cut by it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..base.errors import OptionError
from ..surface.geometry import segment_lengths


def sizes_at(X: Floats, points: Floats, size: Floats) -> Floats:
    """(k,) the edge lengths wanted at X (k,3), each as at the nearest of ``points``, where it is ``size``."""
    if size.min() == size.max():
        return np.full(len(X), size[0])
    return np.asarray(size[cKDTree(points).query(X)[1]])


def check_sizes(edge_length: npt.ArrayLike, n: int) -> Floats:
    """(n,) an edge length per vertex, all finite and > 0.

    >>> check_sizes([0.5, -1.0], 2)
    Traceback (most recent call last):
    pcmc.base.errors.OptionError: edge_length of vertex 1: expected a finite number > 0, found -1.0
    """
    try:
        size = np.asarray(edge_length, dtype=float)
    except (TypeError, ValueError):
        size = np.empty(0)
    if size.shape != (n,):
        message = f"edge_length: expected a number, or an array of shape ({n},), found shape {size.shape}"
        raise OptionError(message, what="edge_length", found=size.shape, expected=(n,))
    wrong = np.flatnonzero(~(np.isfinite(size) & (size > 0.0)))
    if len(wrong):
        vertex, value, expected = int(wrong[0]), float(size[wrong[0]]), "a finite number > 0"
        message = f"edge_length of vertex {vertex}: expected {expected}, found {value}"
        raise OptionError(message, what="edge_length", where=vertex, found=value, expected=expected)
    return size


def limit_growth(X: Floats, edges: Ints, size: Floats, growth: float) -> Floats:
    """(n,) the largest sizes ≤ ``size`` that grow by at most ``growth`` - 1 per length along the edges.

    h_i = min over j of size_j + (growth - 1) d_ij: the shortest ways from a vertex more, size_j away from j.

    >>> X = np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0.0]])
    >>> limit_growth(X, np.array([[0, 1], [1, 2]]), np.array([0.1, 9.0, 9.0]), 1.5).tolist()
    [0.1, 0.6, 1.6]
    """
    n = len(X)
    rise = (growth - 1.0) * segment_lengths(X, edges)
    start = np.concatenate([edges[:, 0], np.full(n, n)])
    end = np.concatenate([edges[:, 1], np.arange(n)])
    weight = np.concatenate([rise, size])
    graph: Any = coo_array((weight, (start, end)), shape=(n + 1, n + 1)).tocsr()
    return np.asarray(dijkstra(graph, directed=False, indices=[n])[0, :n])


def edges_between(length: Floats, start: Floats, end: Floats) -> Floats:
    """How many edges fit on a way whose wanted edge length h runs linearly from start to end: ∫ ds / h.

    >>> edges_between(np.array([3.0, 3.0]), np.array([1.0, 1.0]), np.array([1.0, 4.0])).round(6).tolist()
    [3.0, 1.386294]
    """
    ratio = end / start
    near = np.abs(ratio - 1.0) < 1e-9
    mean = np.where(near, 1.0, (ratio - 1.0) / np.where(near, 1.0, np.log(ratio)))
    return np.asarray(length / (start * mean))


def place_between(part: Floats, start: Floats, end: Floats) -> Floats:
    """Share of the way after which ``part`` of its edges lie; see ``edges_between``.

    >>> place_between(np.array([0.5, 0.5]), np.array([1.0, 1.0]), np.array([1.0, 4.0])).round(6).tolist()
    [0.5, 0.333333]
    """
    ratio = end / start
    near = np.abs(ratio - 1.0) < 1e-9
    bent = np.expm1(part * np.log(ratio)) / np.where(near, 1.0, ratio - 1.0)
    return np.where(near, part, bent)


def triangles_for(areas: Floats, size: Floats) -> Floats:
    """(m,) how many equilateral triangles of side ``size`` (m,) cover triangles of these areas (m,).

    >>> triangles_for(np.array([1.0]), np.array([0.1])).round().tolist()
    [231.0]
    """
    return np.asarray(areas / (math.sqrt(3.0) / 4.0 * size**2))
