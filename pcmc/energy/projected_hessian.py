"""The Hessian in motion-space unknowns, assembled straight into the sparsity pattern of its surface.

With b_i, b_j basis vectors at corners i, j of a triangle of unit normal ν, area A and edges e opposite
the corners, the entry of Bᵀ (∂²E) B is

    α (e_i·e_j)/(4A) (b_i·ν)(b_j·ν)  +  (∓½ α ν ± p x_k / 6) · (b_j × b_i)

(upper sign when j follows i; k the third corner, seen from the point of Π), and the stiffness
Bᵀ (L_α ⊗ I) B, with L_α the cotangent Laplacian, has α (e_i·e_j)/(4A) (b_i·b_j) in its place. A vertex that
slides along a circle adds ⟨κ, ∇E⟩ to its diagonal entry of the former, κ its curvature vector.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled
from ..surface import Surface
from ..surface.geometry import cross, divided, dot, norm, point, scaled, sub, vector
from .cables import assemble_cables
from .kernels import Mesh
from .motion_space import MotionSpace, VertexClasses
from .plane_pieces import add_plane_hessian
from .turning import circle_turning
from .weight import assemble_weights


class Pattern(NamedTuple):
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
    first = np.searchsorted(low, np.arange(len(space.dimension) + 1))
    width = space.dimension[high]
    before = np.concatenate([[0], np.cumsum(width)])
    edge_offset = before[:-1] - before[first[low]]
    beyond = before[first[1:]] - before[first[:-1]]
    indptr, indices = _fill_pattern(space, first, high, beyond)
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
    """Values of hessian · Bᵀ(∂²E)B + stiffness · Bᵀ(L_α⊗I)B in the pattern.

    Cables add τ/ℓ to the stiffness of their edges, weights the cotangents of a tension w z where z > 0.
    """
    data = np.zeros(len(pattern.indices))
    _assemble(classes.mesh(surface), X, space, pattern, hessian, stiffness, data)
    ends, tension = surface.cable_edges
    if len(ends):
        assemble_cables(X, ends, tension, *space, pattern.indptr, pattern.indices, hessian, stiffness, data)
    if surface.weights.any():
        faces, patch = classes.faces, classes.patch_of_face
        into = pattern.indptr, pattern.offset
        assemble_weights(surface, faces, patch, X, *space, *into, hessian, stiffness, data)
    if hessian:
        add_plane_hessian(surface, classes, space, pattern.indptr, pattern.offset, hessian, data)
        rows, factor = circle_turning(surface, space, X)
        data[pattern.indptr[space.start[rows]]] += hessian * (factor * space.basis[rows, 0]).sum(axis=1)
    return data


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


@compiled
def _assemble(
    mesh: Mesh,
    X: Floats,
    space: MotionSpace,
    pattern: Pattern,
    hessian: float,
    stiffness: float,
    data: Floats,
) -> None:
    F, origin = mesh.faces, vector(mesh.origin)
    basis, dimension, start = space.basis, space.dimension, space.start
    indptr, offset = pattern.indptr, pattern.offset
    for f in range(len(F)):
        alpha, p = mesh.tension[mesh.patch[f]], mesh.pressure[mesh.patch[f]]
        a = sub(point(X, F[f, 0]), origin)
        b = sub(point(X, F[f, 1]), origin)
        c = sub(point(X, F[f, 2]), origin)
        corner, edge = (a, b, c), (sub(c, b), sub(a, c), sub(b, a))
        normal = cross(edge[1], edge[2])
        twice_area = norm(normal)
        scale = 1.0 / twice_area if twice_area > 0.0 else 0.0
        nu = scaled(scale, normal)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            v, w = F[f, i], F[f, j]
            weight = 0.5 * alpha * scale * dot(edge[i], edge[i])
            for r in range(dimension[v]):
                b_r = vector(basis[v, r])
                at = indptr[start[v] + r] - r
                for s in range(r, dimension[v]):
                    b_s = vector(basis[v, s])
                    value = hessian * weight * dot(b_r, nu) * dot(b_s, nu)
                    if r == s:
                        value += stiffness * weight
                    data[at + s] += value
            weight = 0.5 * alpha * scale * dot(edge[i], edge[j])
            q = sub(divided(scaled(p, corner[k]), 6.0), scaled(0.5 * alpha, nu))
            for r in range(dimension[v]):
                b_i = vector(basis[v, r])
                for s in range(dimension[w]):
                    b_j = vector(basis[w, s])
                    bending = weight * dot(b_i, nu) * dot(b_j, nu)
                    skew = dot(q, cross(b_j, b_i))
                    value = hessian * (bending + skew) + stiffness * weight * dot(b_j, b_i)
                    if v < w:
                        at = indptr[start[v] + r] + dimension[v] - r + offset[f, i] + s
                    else:
                        at = indptr[start[w] + s] + dimension[w] - s + offset[f, i] + r
                    data[at] += value
