"""The force of a curved element under tension α, pressure p and weight w: value, gradient, Hessian block.

An element has the nodes x_i, the shape functions N_i and x(ξ,η) = Σ N_i x_i (``surface.lagrange``). With
subscripts ξ, η for derivatives, g = x_ξ × x_η, J = |g|, ν = g/J and m_i = N_i,η x_ξ - N_i,ξ x_η,

    A = ∫ J               ∂J/∂x_i = ν × m_i,    for ∂g/∂x_i = [m_i]×
    V = ⅓ ∫ ⟨x, g⟩        ∂/∂x_i = ⅓ (N_i g + x × m_i)
    ∫ z dA = ∫ z J        ∂/∂x_i = z ν × m_i + N_i J n

over dξ dη; z is the height of x over Π, whose normal is n, and V is seen from the reference point. So the
forces of an element come from two vectors at each point of it, and their changes along d from those of these:

    ∂E/∂x_i = ∫ a × m_i + N_i b,    a = T ν - ⅓ p x,    b = w J n - ⅓ p g,    T = α + w z
    δa = T (δg - δJ ν) / J + w ⟨n, d⟩ ν - ⅓ p d,    δb = w δJ n - ⅓ p δg,    δJ = ⟨ν, δg⟩

where δg = d_ξ × x_η + x_ξ × d_η, of node j m_j × d. The *stiffness* is ∫ T₊ ⟨m_i, m_j⟩ / J, T₊ = α +
max(w z, 0). Of order 1 these are the formulas of ``triangles``, at one point; there they are written out.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats, Ints, Vector
from ..base.compiled import compiled, inlined
from ..surface.geometry import accumulate, add, cross, cross_sum, dot, norm, point, scaled, sub, vector
from ..surface.lagrange import Shapes
from .elements import Mesh

UNITS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@inlined
def _interpolated(X: Floats, nodes: Ints, shape: Floats) -> Vector:
    """Σ N_i x_i."""
    total = (0.0, 0.0, 0.0)
    for i in range(len(nodes)):
        total = add(total, scaled(shape[i], point(X, nodes[i])))
    return total


@inlined
def _tangents(X: Floats, nodes: Ints, shapes: Shapes, q: int) -> tuple[Vector, Vector]:
    """x_ξ and x_η at quadrature point q."""
    return _interpolated(X, nodes, shapes.along_u[q]), _interpolated(X, nodes, shapes.along_v[q])


@inlined
def _across(shapes: Shapes, q: int, i: int, u: Vector, v: Vector) -> Vector:
    """m_i = N_i,η x_ξ - N_i,ξ x_η."""
    return sub(scaled(shapes.along_v[q, i], u), scaled(shapes.along_u[q, i], v))


@compiled
def measure_elements(
    mesh: Mesh, X: Floats, first: int, last: int, area: Floats, volume: Floats, moment: Floats, out: Floats
) -> None:
    """Add A, V and ∫ z dA of elements first..last to (k,) each, and ∇(αA - pV + w ∫ z dA) to ``out`` (n,3).

    An ``out`` of no rows is left out.
    """
    shapes, origin, ground, n = mesh.shapes, vector(mesh.origin), vector(mesh.ground), vector(mesh.normal)
    for e in range(first, last):
        nodes, k = mesh.faces[e], mesh.patch[e]
        alpha, third_p, w = mesh.tension[k], mesh.pressure[k] / 3.0, mesh.weight[k]
        for q in range(len(shapes.weight)):
            place, (u, v) = _interpolated(X, nodes, shapes.value[q]), _tangents(X, nodes, shapes, q)
            g = cross(u, v)
            J, z, x, dA = norm(g), dot(sub(place, ground), n), sub(place, origin), shapes.weight[q]
            area[k] += dA * J
            volume[k] += dA * dot(x, g) / 3.0
            moment[k] += dA * z * J
            if len(out) == 0:
                continue
            a = sub(scaled((alpha + w * z) / J if J > 0.0 else 0.0, g), scaled(third_p, x))
            b = sub(scaled(w * J, n), scaled(third_p, g))
            for i in range(len(nodes)):
                force = add(cross(a, _across(shapes, q, i, u, v)), scaled(shapes.value[q, i], b))
                accumulate(out, nodes[i], scaled(dA, force))


@inlined
def _changes(
    T: float, third_p: float, w: float, n: Vector, g: Vector, d: Vector, dg: Vector
) -> tuple[Vector, Vector]:
    """δa and δb."""
    J = norm(g)
    nu = scaled(1.0 / J, g)
    dJ = dot(nu, dg)
    da = add(scaled(T / J, sub(dg, scaled(dJ, nu))), scaled(w * dot(n, d), nu))
    return sub(da, scaled(third_p, d)), sub(scaled(w * dJ, n), scaled(third_p, dg))


@compiled
def add_element_products(mesh: Mesh, X: Floats, D: Floats, change: Floats) -> None:
    """Add (∂²E) d to change (n,3): how the gradient of ``measure_elements`` changes with X along D."""
    shapes, origin, ground, n = mesh.shapes, vector(mesh.origin), vector(mesh.ground), vector(mesh.normal)
    for e in range(len(mesh.faces)):
        nodes, k = mesh.faces[e], mesh.patch[e]
        alpha, third_p, w = mesh.tension[k], mesh.pressure[k] / 3.0, mesh.weight[k]
        for q in range(len(shapes.weight)):
            place, (u, v) = _interpolated(X, nodes, shapes.value[q]), _tangents(X, nodes, shapes, q)
            d, (du, dv) = _interpolated(D, nodes, shapes.value[q]), _tangents(D, nodes, shapes, q)
            g, T = cross(u, v), alpha + w * dot(sub(place, ground), n)
            J = norm(g)
            if J == 0.0:
                continue
            a = sub(scaled(T / J, g), scaled(third_p, sub(place, origin)))
            da, db = _changes(T, third_p, w, n, g, d, cross_sum(du, v, u, dv))
            for i in range(len(nodes)):
                m, dm = _across(shapes, q, i, u, v), _across(shapes, q, i, du, dv)
                force = add(cross_sum(da, m, a, dm), scaled(shapes.value[q, i], db))
                accumulate(change, nodes[i], scaled(shapes.weight[q], force))


@compiled
def fill_block(mesh: Mesh, X: Floats, e: int, hessian: float, stiffness: float, block: Floats) -> None:
    """Write hessian · ∂²E + stiffness · L of element e into block (k,k,3,3), where j ≥ i."""
    shapes, origin, ground, n = mesh.shapes, vector(mesh.origin), vector(mesh.ground), vector(mesh.normal)
    nodes, k = mesh.faces[e], mesh.patch[e]
    alpha, third_p, w = mesh.tension[k], mesh.pressure[k] / 3.0, mesh.weight[k]
    m, size = np.empty((len(nodes), 3)), len(nodes)
    block[:] = 0.0
    for q in range(len(shapes.weight)):
        N, Nu, Nv, dA = shapes.value[q], shapes.along_u[q], shapes.along_v[q], shapes.weight[q]
        place, (u, v) = _interpolated(X, nodes, N), _tangents(X, nodes, shapes, q)
        g, extra = cross(u, v), w * dot(sub(place, ground), n)
        J, T = norm(g), alpha + extra
        if J == 0.0:
            continue
        a = sub(scaled(T / J, g), scaled(third_p, sub(place, origin)))
        for j in range(size):
            m[j] = _across(shapes, q, j, u, v)
            for c in range(3):
                unit = UNITS[c]
                da, db = _changes(T, third_p, w, n, g, scaled(N[j], unit), cross(point(m, j), unit))
                for i in range(j + 1):
                    dm = scaled(Nv[i] * Nu[j] - Nu[i] * Nv[j], unit)
                    force = add(cross_sum(da, point(m, i), a, dm), scaled(N[i], db))
                    accumulate(block[i, j].T, c, scaled(dA * hessian, force))
                    soft = (alpha + max(extra, 0.0)) / J * dot(point(m, i), point(m, j))
                    block[i, j, c, c] += dA * stiffness * soft
