"""The Hessian in motion-space unknowns, assembled straight into a kept sparsity pattern.

With b_i, b_j basis vectors at corners i, j of a triangle of unit normal ν, area A and edges e opposite
the corners, the entry of Bᵀ (∂²E) B is

    α (e_i·e_j)/(4A) (b_i·ν)(b_j·ν)  +  (∓½ α ν ± p x_k / 6) · (b_j × b_i)

(upper sign when j follows i; k the third corner, seen from the point of Π), and the stiffness
Bᵀ (L_α ⊗ I) B, with L_α the cotangent Laplacian, has α (e_i·e_j)/(4A) (b_i·b_j) in its place.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from scipy.sparse import csr_array

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled
from ..surface import Surface
from .motion_space import MotionSpace, VertexClasses


@dataclass(frozen=True, eq=False)
class Pattern:
    """Upper triangle (CSR) of a symmetric matrix over motion-space unknowns, and the way into it.

    Attributes
    ----------
    indptr, indices : CSR structure of the upper triangle, diagonal first in each row.
    offset : (m,3) int: for corner pairs (0,1), (1,2), (2,0) of each active face, where the columns
        of the later vertex begin in the rows of the earlier one, counted after its diagonal block.
    """

    indptr: Ints
    indices: Ints
    offset: Ints

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.indptr) - 1

    def matrix(self, data: Floats) -> csr_array:
        """The upper triangle as a scipy array."""
        return csr_array((data, self.indices, self.indptr), shape=(self.size, self.size))


def hessian_pattern(classes: VertexClasses, space: MotionSpace) -> Pattern:
    """Sparsity of Bᵀ (∂²E) B: it depends on the faces and on the dimensions of the motion space."""
    low, high = classes.topology.edges.T.astype(np.int64)
    dimension, start = space.dimension, space.start
    first = np.searchsorted(low, np.arange(len(dimension) + 1))
    width = dimension[high]
    before = np.concatenate([[0], np.cumsum(width)])
    edge_offset = before[:-1] - before[first[low]]
    beyond = before[first[1:]] - before[first[:-1]]
    indptr, indices = _fill_pattern(dimension, start, first, high, beyond)
    # edge (i,j) opposite corner k: pairs (0,1), (1,2), (2,0) are opposite corners 2, 0, 1
    offset = edge_offset[classes.topology.edge_of_face[:, [2, 0, 1]]]
    return Pattern(indptr, indices, np.ascontiguousarray(offset.astype(np.int32)))


def assemble(
    surface: Surface,
    classes: VertexClasses,
    space: MotionSpace,
    pattern: Pattern,
    X: Floats,
    hessian: float = 1.0,
    stiffness: float = 0.0,
) -> Floats:
    """Values of hessian · Bᵀ(∂²E)B + stiffness · Bᵀ(L_α⊗I)B in the kept pattern."""
    data = np.zeros(len(pattern.indices))
    _assemble(
        X, classes.faces, classes.patch_of_face, surface.origin, surface.tensions,
        surface.pressures, space.basis, space.dimension, space.start, pattern.indptr, pattern.offset,
        hessian, stiffness, data,
    )  # fmt: skip
    return data


@compiled
def _fill_pattern(
    dimension: Ints, start: Ints, first: Ints, high: Ints, beyond: Ints
) -> tuple[Ints, Ints]:
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


@compiled
def _assemble(
    X: Floats, F: Ints, patch: Ints, origin: Floats, tension: Floats, pressure: Floats,
    basis: Floats, dimension: Ints, start: Ints, indptr: Ints, offset: Ints, hessian: float,
    stiffness: float, data: Floats,
) -> None:  # fmt: skip
    x = np.empty((3, 3))
    e = np.empty((3, 3))
    nu = np.empty(3)
    q = np.empty(3)
    for f in range(len(F)):
        alpha, p = tension[patch[f]], pressure[patch[f]]
        for i in range(3):
            for d in range(3):
                x[i, d] = X[F[f, i], d] - origin[d]
        for i in range(3):
            for d in range(3):
                e[i, d] = x[(i + 2) % 3, d] - x[(i + 1) % 3, d]
        nu[0] = e[1, 1] * e[2, 2] - e[1, 2] * e[2, 1]
        nu[1] = e[1, 2] * e[2, 0] - e[1, 0] * e[2, 2]
        nu[2] = e[1, 0] * e[2, 1] - e[1, 1] * e[2, 0]
        twice = sqrt(nu[0] * nu[0] + nu[1] * nu[1] + nu[2] * nu[2])
        scale = 1.0 / twice if twice > 0.0 else 0.0
        for d in range(3):
            nu[d] *= scale
        for i in range(3):
            v = F[f, i]
            weight = 0.5 * alpha * scale * (e[i, 0] ** 2 + e[i, 1] ** 2 + e[i, 2] ** 2)
            for r in range(dimension[v]):
                at = indptr[start[v] + r] - r
                b = basis[v, r]
                along = b[0] * nu[0] + b[1] * nu[1] + b[2] * nu[2]
                for c in range(r, dimension[v]):
                    a = basis[v, c]
                    across = a[0] * nu[0] + a[1] * nu[1] + a[2] * nu[2]
                    value = hessian * weight * along * across
                    if c == r:
                        value += stiffness * weight
                    data[at + c] += value
            j = (i + 1) % 3
            k = (i + 2) % 3
            w = F[f, j]
            if dimension[v] == 0 or dimension[w] == 0:
                continue
            weight = 0.5 * alpha * scale
            weight *= e[i, 0] * e[j, 0] + e[i, 1] * e[j, 1] + e[i, 2] * e[j, 2]
            for d in range(3):
                q[d] = -0.5 * alpha * nu[d] + p * x[k, d] / 6.0
            for r in range(dimension[v]):
                b = basis[v, r]
                along = b[0] * nu[0] + b[1] * nu[1] + b[2] * nu[2]
                for c in range(dimension[w]):
                    a = basis[w, c]
                    across = a[0] * nu[0] + a[1] * nu[1] + a[2] * nu[2]
                    dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
                    # q · (a × b), the skew part
                    skew = (
                        q[0] * (a[1] * b[2] - a[2] * b[1])
                        + q[1] * (a[2] * b[0] - a[0] * b[2])
                        + q[2] * (a[0] * b[1] - a[1] * b[0])
                    )
                    value = hessian * (weight * along * across + skew) + stiffness * weight * dot
                    if v < w:
                        at = indptr[start[v] + r] + dimension[v] - r + offset[f, i] + c
                    else:
                        at = indptr[start[w] + c] + dimension[w] - c + offset[f, i] + r
                    data[at] += value
