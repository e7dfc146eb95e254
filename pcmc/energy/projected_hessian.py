"""The Hessian in motion-space unknowns, assembled straight into the sparsity pattern of its surface.

With b_i, b_j basis vectors at corners i, j of a triangle of unit normal ν, area A and edges e opposite
the corners, the entry of Bᵀ (∂²E) B is

    α (e_i·e_j)/(4A) (b_i·ν)(b_j·ν)  +  (∓½ α ν ± p x_k / 6) · (b_j × b_i)

(upper sign when j follows i; k the third corner, seen from the point of Π), and the stiffness
Bᵀ (L_α ⊗ I) B, with L_α the cotangent Laplacian, has α (e_i·e_j)/(4A) (b_i·b_j) in its place. A vertex that
slides along a circle adds ⟨κ, ∇E⟩ to its diagonal entry of the former, κ its curvature vector.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats
from ..base.compiled import compiled
from ..surface import Surface
from ..surface.geometry import cross, divided, dot, norm, point, scaled, sub, vector
from . import added_hessians
from .kernels import Mesh
from .motion_space import MotionSpace, VertexClasses
from .pattern import Pattern, pair_place, row_place
from .turning import circle_turning


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
    added_hessians.add_cables(surface, space, pattern, X, hessian, stiffness, data)
    added_hessians.add_weights(surface, classes, space, pattern, X, hessian, stiffness, data)
    if hessian:
        added_hessians.add_flat_pieces(surface, classes, space, pattern, hessian, data)
        rows, factor = circle_turning(surface, space, X)
        data[pattern.indptr[space.start[rows]]] += hessian * (factor * space.basis[rows, 0]).sum(axis=1)
    return data


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
    basis, dimension = space.basis, space.dimension
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
                at = row_place(space, pattern, v, r)
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
                    at = pair_place(space, pattern, v, r, w, s, pattern.offset[f, i])
                    data[at] += value
