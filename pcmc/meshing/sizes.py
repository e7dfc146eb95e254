"""Size fields: the edge length wanted at each vertex, and how an edge is cut by it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..base.errors import OptionError
from ..surface.geometry import segment_lengths


@dataclass(frozen=True, eq=False)
class SizeField:
    """Wanted edge lengths at points; elsewhere that of the nearest one holds."""

    points: Floats
    size: Floats

    def at(self, X: Floats) -> Floats:
        """(k,) the edge lengths wanted at positions (k,3)."""
        if self.size.min() == self.size.max():
            return np.full(len(X), self.size[0])
        return self.size[cKDTree(self.points).query(X)[1]]


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
        expected, found = f"a number, or an array of shape ({n},)", f"shape {np.shape(size)}"
        message = f"edge_length: expected {expected}, found {found}"
        raise OptionError(message, what="edge_length", found=np.shape(size), expected=(n,))
    wrong = np.flatnonzero(~(np.isfinite(size) & (size > 0.0)))
    if len(wrong):
        vertex, value = int(wrong[0]), float(size[wrong[0]])
        expected = "a finite number > 0"
        message = f"edge_length of vertex {vertex}: expected {expected}, found {value}"
        raise OptionError(message, what="edge_length", where=vertex, found=value, expected=expected)
    return size


def limit_growth(X: Floats, edges: Ints, size: Floats, growth: float) -> Floats:
    """(n,) the largest sizes ≤ ``size`` that grow by at most ``growth`` - 1 per length along the edges.

    h_i = min over j of size_j + (growth - 1) d_ij, with d_ij the distance along edges: the shortest ways
    from an extra vertex that is size_j away from vertex j.

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
    """How many edges fit on a way of this length whose wanted edge length runs linearly from start to end.

    The integral of ds / h is length · log(end / start) / (end - start), and length / h for a constant h.

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


def equilateral_area(size: Floats) -> Floats:
    """(m,) area of equilateral triangles with sides ``size`` (m,), length²."""
    return np.asarray(math.sqrt(3.0) / 4.0 * size**2)


def triangles_for(areas: Floats, size: Floats) -> float:
    """How many equilateral triangles of side ``size`` cover triangles of these areas; both (m,).

    >>> round(triangles_for(np.array([1.0]), np.array([0.1])))
    231
    """
    return float((areas / equilateral_area(size)).sum())
