"""The sparsity pattern of matrices over motion-space unknowns, and the place of an entry in it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array, triu

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled, inlined
from ..surface import Surface
from .motion_space import MotionSpace, VertexClasses


class Pattern(NamedTuple):
    """Upper triangle (CSR) of a symmetric matrix over motion-space unknowns, and the way into it."""

    indptr: Ints  # CSR structure of the upper triangle, diagonal first in each row
    indices: Ints
    # (m,3) for corner pairs (0,1), (1,2), (2,0) of each active face, where the columns of the later vertex
    # begin in the rows of the earlier one, counted after its diagonal block
    offset: Ints = np.empty((0, 3), dtype=np.int32)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.indptr) - 1

    def matrix(self, data: Floats) -> csr_array:
        """The upper triangle as a scipy array."""
        return csr_array((data, self.indices, self.indptr), shape=(self.size, self.size))

    def symmetric(self, data: Floats) -> csr_array:
        """The whole matrix as a scipy array."""
        upper = self.matrix(data)
        return csr_array(upper + triu(upper, k=1).T)


def hessian_pattern(of: VertexClasses | Surface, space: MotionSpace) -> Pattern:
    """Sparsity of Bᵀ (∂²E) B: it depends on the elements and on the dimensions of the motion space."""
    if of.nodes.shape[1] > 3:
        return pattern_of(of.nodes, space)
    pattern, offset = _pattern(of.topology.edges, space)
    # edge (i,j) opposite corner k: pairs (0,1), (1,2), (2,0) are opposite corners 2, 0, 1
    return pattern._replace(offset=np.ascontiguousarray(offset[of.topology.edge_of_face[:, [2, 0, 1]]]))


def pattern_of(elements: Ints, space: MotionSpace) -> Pattern:
    """Sparsity for elements of k vertices each (e,k)."""
    first, second = np.triu_indices(elements.shape[1], 1)
    one, other, n = elements[:, first].ravel(), elements[:, second].ravel(), len(space.dimension)
    pairs = np.unique(np.minimum(one, other).astype(np.int64) * n + np.maximum(one, other))
    return _pattern(np.stack([pairs // n, pairs % n], axis=1), space)[0]


def _pattern(pairs: Ints, space: MotionSpace) -> tuple[Pattern, Ints]:
    """The pattern of pairs (e,2) of vertices, in order, and the offset (e,) of each in it."""
    low, high = pairs.T.astype(np.int64)
    first = np.searchsorted(low, np.arange(len(space.dimension) + 1))
    width = space.dimension[high]
    before = np.concatenate([[0], np.cumsum(width)])
    offset = (before[:-1] - before[first[low]]).astype(np.int32)
    beyond = before[first[1:]] - before[first[:-1]]
    return Pattern(*_fill_pattern(space, first, high, beyond)), offset


@inlined
def row_place(space: MotionSpace, pattern: Pattern, v: int, r: int) -> int:
    """Where the values of row (v, r) would begin if they began in column (v, 0): add s for column (v, s)."""
    return pattern.indptr[space.start[v] + r] - r


@inlined
def pair_place(space: MotionSpace, pattern: Pattern, v: int, r: int, w: int, s: int, offset: int) -> int:
    """The place of the entry of (v, r) and (w, s), two corners of a triangle; ``offset`` is the pair's."""
    if v < w:
        return pattern.indptr[space.start[v] + r] + space.dimension[v] - r + offset + s
    return pattern.indptr[space.start[w] + s] + space.dimension[w] - s + offset + r


@compiled
def _fill_pattern(space: MotionSpace, first: Ints, high: Ints, beyond: Ints) -> tuple[Ints, Ints]:
    dimension, start = space.dimension, space.start
    indptr = np.zeros(start[-1] + 1, dtype=np.int32)
    for v in range(len(dimension)):
        for r in range(dimension[v]):
            row = start[v] + r
            indptr[row + 1] = indptr[row] + dimension[v] - r + beyond[v]
    indices = np.empty(indptr[-1], dtype=np.int32)
    for v in range(len(dimension)):
        for r in range(dimension[v]):
            at = indptr[start[v] + r]
            for c in range(r, dimension[v]):
                indices[at] = start[v] + c
                at += 1
            for edge in range(first[v], first[v + 1]):
                w = high[edge]
                for c in range(dimension[w]):
                    indices[at] = start[w] + c
                    at += 1
    return indptr, indices
