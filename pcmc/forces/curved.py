"""The force of a curved element under tension α, pressure p and weight w: value, gradient, Hessian block.

An element has the nodes x_i, the shape functions N_i and x(ξ,η) = Σ N_i x_i (``surface.lagrange``). With
subscripts ξ, η for derivatives, g = x_ξ × x_η, J = |g|, ν = g/J and m_i = N_i,η x_ξ - N_i,ξ x_η,

    A = ∫ J               ∂J/∂x_i = ν × m_i,    for ∂g/∂x_i = [m_i]×
    V = ⅓ ∫ ⟨x, g⟩        ∂/∂x_i = ⅓ (N_i g + x × m_i)
    ∫ z dA = ∫ z J        ∂/∂x_i = z ν × m_i + N_i J n

over dξ dη; z is the height of x over Π, whose normal is n, and V is seen from the reference point. Blocks are

    ∂²E/∂i∂j  =  ∫ s ν νᵀ + [q]× + u nᵀ + n vᵀ,    T = α + w z
    s = T ⟨m_i, m_j⟩ / J,    q = (N_i,η N_j,ξ - N_i,ξ N_j,η)(T ν - ⅓ p x) + ⅓ p (N_j m_i - N_i m_j)
    u = w N_j ν × m_i,       v = w N_i ν × m_j

and the *stiffness* is ∫ T₊ ⟨m_i, m_j⟩ / J, T₊ = α + max(w z, 0). Of order 1 these are the formulas of
``triangles``, at one point; there they are written out.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats, Ints, Vector
from ..base.compiled import compiled, inlined
from ..surface.geometry import accumulate, add, cross, cross_sum, dot, norm, point, scaled, sub, vector
from ..surface.lagrange import Shapes
from .elements import Mesh


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
            pull = scaled((alpha + w * z) / J if J > 0.0 else 0.0, g)
            turning, along = sub(pull, scaled(third_p, x)), sub(scaled(w * J, n), scaled(third_p, g))
            for i in range(len(nodes)):
                force = add(cross(turning, _across(shapes, q, i, u, v)), scaled(shapes.value[q, i], along))
                accumulate(out, nodes[i], scaled(dA, force))


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
            g, dg = cross(u, v), cross_sum(du, v, u, dv)
            J = norm(g)
            if J == 0.0:
                continue
            nu, x, dA = scaled(1.0 / J, g), sub(place, origin), shapes.weight[q]
            dJ, T = dot(nu, dg), alpha + w * dot(sub(place, ground), n)
            turning = sub(scaled(T, nu), scaled(third_p, x))
            turned = add(scaled(T / J, sub(dg, scaled(dJ, nu))), scaled(w * dot(n, d), nu))
            turned = sub(turned, scaled(third_p, d))
            along = sub(scaled(w * dJ, n), scaled(third_p, dg))
            for i in range(len(nodes)):
                m, dm = _across(shapes, q, i, u, v), _across(shapes, q, i, du, dv)
                force = add(cross_sum(turned, m, turning, dm), scaled(shapes.value[q, i], along))
                accumulate(change, nodes[i], scaled(dA, force))


@compiled
def fill_block(mesh: Mesh, X: Floats, e: int, hessian: float, stiffness: float, block: Floats) -> None:
    """Write hessian · ∂²E + stiffness · L of element e into block (k,k,3,3), where j ≥ i."""
    shapes, origin, ground, n = mesh.shapes, vector(mesh.origin), vector(mesh.ground), vector(mesh.normal)
    nodes, k = mesh.faces[e], mesh.patch[e]
    alpha, third_p, w = mesh.tension[k], hessian * mesh.pressure[k] / 3.0, mesh.weight[k]
    m, size = np.empty((len(nodes), 3)), len(nodes)
    block[:] = 0.0
    for q in range(len(shapes.weight)):
        N, Nu, Nv, dA = shapes.value[q], shapes.along_u[q], shapes.along_v[q], shapes.weight[q]
        place, (u, v) = _interpolated(X, nodes, N), _tangents(X, nodes, shapes, q)
        g = cross(u, v)
        J = norm(g)
        if J == 0.0:
            continue
        nu, extra = scaled(1.0 / J, g), w * dot(sub(place, ground), n)
        T, soft = dA * hessian * (alpha + extra), dA * stiffness * (alpha + max(extra, 0.0)) / J
        turning = sub(scaled(T, nu), scaled(dA * third_p, sub(place, origin)))
        for i in range(size):
            m[i] = _across(shapes, q, i, u, v)
        for i in range(size):
            for j in range(i, size):
                inner = dot(point(m, i), point(m, j))
                s, rigid, twist = T / J * inner, soft * inner, Nv[i] * Nu[j] - Nu[i] * Nv[j]
                mixed = sub(scaled(N[j], point(m, i)), scaled(N[i], point(m, j)))
                x, y, z = add(scaled(twist, turning), scaled(dA * third_p, mixed))
                B = block[i, j]
                B[0, 0] += s * nu[0] * nu[0] + rigid
                B[1, 1] += s * nu[1] * nu[1] + rigid
                B[2, 2] += s * nu[2] * nu[2] + rigid
                B[0, 1] += s * nu[0] * nu[1] - z
                B[1, 0] += s * nu[0] * nu[1] + z
                B[0, 2] += s * nu[0] * nu[2] + y
                B[2, 0] += s * nu[0] * nu[2] - y
                B[1, 2] += s * nu[1] * nu[2] - x
                B[2, 1] += s * nu[1] * nu[2] + x
                if w != 0.0:
                    down = dA * hessian * w
                    tilt, lean = cross(nu, point(m, i)), cross(nu, point(m, j))
                    for r in range(3):
                        for c in range(3):
                            B[r, c] += down * (N[j] * tilt[r] * n[c] + N[i] * n[r] * lean[c])
