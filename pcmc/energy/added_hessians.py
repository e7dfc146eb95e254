"""What weights, cables and flat pieces add to the Hessian in motion-space unknowns.

Each function adds its part of hessian · Bᵀ(∂²E)B + stiffness · Bᵀ L B to the values of a ``Pattern``; the
formulas are those of ``weight``, ``cables`` and ``plane_pieces``. The stiffness of a sheet of weight w is the
cotangent Laplacian with the tension max(w z̄, 0), and that of an edge of a cable is τ/ℓ.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled
from ..surface import Surface
from ..surface.cable import CableEdges
from ..surface.geometry import Vector, add, cross, dot, norm, point, scaled, sub, vector
from .flat_pieces import flat_pieces
from .kernels import Mesh
from .motion_space import MotionSpace, VertexClasses
from .pattern import Pattern, pair_place, row_place


def add_weights(
    surface: Surface,
    classes: VertexClasses,
    space: MotionSpace,
    pattern: Pattern,
    X: Floats,
    hessian: float,
    stiffness: float,
    data: Floats,
) -> None:
    """Add the part of Σ w ∫ z dA at X (n,3)."""
    if surface.weights.any():
        plane = surface.plane
        heavy = classes.mesh(surface)._replace(tension=surface.weights, origin=np.array(plane.point))
        _add_weights(heavy, np.array(plane.normal), X, space, pattern, hessian, stiffness, data)


def add_cables(
    surface: Surface,
    space: MotionSpace,
    pattern: Pattern,
    X: Floats,
    hessian: float,
    stiffness: float,
    data: Floats,
) -> None:
    """Add the part of Σ τ ℓ at X (n,3)."""
    if len(surface.cable_edges.ends):
        _add_cables(surface.cable_edges, X, space, pattern, hessian, stiffness, data)


def add_flat_pieces(
    surface: Surface,
    classes: VertexClasses,
    space: MotionSpace,
    pattern: Pattern,
    hessian: float,
    data: Floats,
) -> None:
    """Add the part of the pressure on the flat pieces that close volumes on sliding planes."""
    pieces = flat_pieces(surface)
    if pieces:
        pressure = surface.net_pressures[surface.patch_of_face[pieces.face]]
        pressed = classes.active[pieces.face] & (pressure != 0.0)
        number = np.cumsum(classes.active) - 1
        sides = np.column_stack([number[pieces.face[pressed]], pieces.corner[pressed]])
        weight = hessian * pressure[pressed] / 6.0
        _add_flat_pieces(classes.faces, sides, -weight[:, None] * pieces.apex[pressed], space, pattern, data)


@compiled
def _entry(
    weight: float,
    mean: float,
    bending: float,
    nu: Vector,
    after: float,
    n: Vector,
    g_i: Vector,
    g_j: Vector,
    b_i: Vector,
    b_j: Vector,
) -> float:
    """⟨b_i, w ∂²(A z̄)/∂i∂j b_j⟩; ``bending`` is (e_i·e_j)/(4A), ``after`` 1 if j follows i, 0 if it is i."""
    curved = bending * dot(b_i, nu) * dot(b_j, nu) - 0.5 * after * dot(nu, cross(b_j, b_i))
    slope = dot(b_i, g_i) * dot(n, b_j) + dot(b_i, n) * dot(g_j, b_j)
    return weight * (mean * curved + slope / 3.0)


@compiled
def _add_weights(
    mesh: Mesh,
    normal: Floats,
    X: Floats,
    space: MotionSpace,
    pattern: Pattern,
    hessian: float,
    stiffness: float,
    data: Floats,
) -> None:
    """``mesh`` has the weights as its tensions, and Π's point as its origin."""
    F, origin, n = mesh.faces, vector(mesh.origin), vector(normal)
    basis, dimension = space.basis, space.dimension
    for f in range(len(F)):
        weight = mesh.tension[mesh.patch[f]]
        if weight == 0.0:
            continue
        a, b, c = point(X, F[f, 0]), point(X, F[f, 1]), point(X, F[f, 2])
        edge = (sub(c, b), sub(a, c), sub(b, a))
        twice = cross(edge[1], edge[2])
        length = norm(twice)
        if length == 0.0:
            continue
        nu = scaled(1.0 / length, twice)
        mean = dot(sub(scaled(1.0 / 3.0, add(add(a, b), c)), origin), n)
        half = scaled(0.5, nu)
        g = (cross(half, edge[0]), cross(half, edge[1]), cross(half, edge[2]))
        added = stiffness * max(weight * mean, 0.0) * 0.5 / length
        for i in range(3):
            j = (i + 1) % 3
            v, w = F[f, i], F[f, j]
            square, product = dot(edge[i], edge[i]), dot(edge[i], edge[j])
            for r in range(dimension[v]):
                b_r = vector(basis[v, r])
                at = row_place(space, pattern, v, r)
                for s in range(r, dimension[v]):
                    b_s = vector(basis[v, s])
                    value = _entry(weight, mean, 0.5 * square / length, nu, 0.0, n, g[i], g[i], b_r, b_s)
                    data[at + s] += hessian * value + added * square * dot(b_r, b_s)
                for s in range(dimension[w]):
                    b_s = vector(basis[w, s])
                    value = _entry(weight, mean, 0.5 * product / length, nu, 1.0, n, g[i], g[j], b_r, b_s)
                    at_w = pair_place(space, pattern, v, r, w, s, pattern.offset[f, i])
                    data[at_w] += hessian * value + added * product * dot(b_r, b_s)


@compiled
def _add_cables(
    cables: CableEdges,
    X: Floats,
    space: MotionSpace,
    pattern: Pattern,
    hessian: float,
    stiffness: float,
    data: Floats,
) -> None:
    basis, dimension, start = space.basis, space.dimension, space.start
    indptr, indices = pattern.indptr, pattern.indices
    for e in range(len(cables.ends)):
        i, j = min(cables.ends[e, 0], cables.ends[e, 1]), max(cables.ends[e, 0], cables.ends[e, 1])
        side = sub(point(X, j), point(X, i))
        length = norm(side)
        if length == 0.0:
            continue
        t, k = scaled(1.0 / length, side), cables.tension[e] / length
        for v in (i, j):
            for r in range(dimension[v]):
                at = row_place(space, pattern, v, r)
                for s in range(r, dimension[v]):
                    b, c = vector(basis[v, r]), vector(basis[v, s])
                    product = dot(b, c)
                    turning = product - dot(b, t) * dot(c, t)
                    data[at + s] += k * (hessian * turning + stiffness * product)
        if dimension[j] == 0:
            continue
        for r in range(dimension[i]):
            row = start[i] + r
            low, high = indptr[row], indptr[row + 1]
            at = low + np.searchsorted(indices[low:high], start[j])
            for s in range(dimension[j]):
                b, c = vector(basis[i, r]), vector(basis[j, s])
                product = dot(b, c)
                turning = product - dot(b, t) * dot(c, t)
                data[at + s] -= k * (hessian * turning + stiffness * product)


@compiled
def _add_flat_pieces(
    F: Ints, sides: Ints, q: Floats, space: MotionSpace, pattern: Pattern, data: Floats
) -> None:
    """Add -p ⟨b_a, [c]× b_b⟩ / 6 = ⟨q, b_b × b_a⟩, q = -p c / 6, for each side: its face and first corner."""
    basis, dimension = space.basis, space.dimension
    for e in range(len(sides)):
        f, i = sides[e, 0], sides[e, 1]
        v, w = F[f, i], F[f, (i + 1) % 3]
        for r in range(dimension[v]):
            for s in range(dimension[w]):
                at = pair_place(space, pattern, v, r, w, s, pattern.offset[f, i])
                data[at] += dot(vector(q[e]), cross(vector(basis[w, s]), vector(basis[v, r])))
