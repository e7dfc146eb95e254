"""The second variation of E: blocks of elements assembled, projected into the motion space and applied.

For nodes i and j of an element, ∂²E/∂x_i∂x_j is the 3×3 matrix of ``triangles`` or ``curved``, or given by
each of the other forces (``elements``); a vertex that slides along a circle adds ⟨κ, ∇E⟩ along its tangent
(``circle_curvatures``). The *stiffness* L has only multiples of 1. ``assemble`` projects
hessian · ∂²E + stiffness · L into the motion space; ``hessian_product`` multiplies ∂²E by a motion.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from ..base.arrays import Floats, Ints, Vector, read_only
from ..base.compiled import compiled, inlined, sum_blocks
from ..surface import Surface, expect_surface
from ..surface.geometry import accumulate, add, cross, cross_sum, dot, norm, point, scaled, sub, vector
from .curved import add_element_products, fill_block
from .elements import Elements, Mesh, add_hessian_products, energy_mesh
from .functional import elements, energy_and_gradient
from .motion_space import MotionSpace, VertexClasses
from .pattern import Pattern, hessian_pattern, pair_place, row_place

if TYPE_CHECKING:
    from scipy.sparse import csr_array


def hessian(surface: Surface) -> csr_array:
    """∂²E/∂X², sparse symmetric (3n,3n), supports not applied; unknown 3v + d is coordinate d of v.

    Images of vertices move with these: their own rows and columns are empty.

    >>> from pcmc import Patch, Surface
    >>> flat = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("t", 1.0)], fixed=[0])
    >>> H = hessian(flat.retensioned(pressures={"t": 0.0}))  # A is homogeneous of degree 2: H X = ∇A
    >>> (H @ flat.vertices.ravel()).reshape(3, 3).round(12).tolist()
    [[-0.5, -0.5, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0]]
    """
    expect_surface(surface)
    every = MotionSpace.of(np.tile(np.eye(3), (surface.n, 1, 1)), np.full(surface.n, 3))
    pattern = hessian_pattern(surface, every)
    return pattern.symmetric(assemble(surface, None, every, pattern, surface.vertices))


def assemble(
    surface: Surface,
    classes: VertexClasses | None,
    space: MotionSpace,
    pattern: Pattern,
    X: Floats,
    hessian: float = 1.0,
    stiffness: float = 0.0,
) -> Floats:
    """Values of hessian · Bᵀ(∂²E)B + stiffness · BᵀLB in the pattern; without classes of all elements."""
    mesh = energy_mesh(surface) if classes is None else classes.mesh(surface)
    fill = _assemble_curved if mesh.curved else _assemble_triangles

    def work(first: int, last: int, data: Floats) -> None:
        some = pattern._replace(offset=pattern.offset[first:last])
        fill(mesh.part(first, last), read_only(X.view()), space, some, hessian, stiffness, data)

    data: Floats = sum_blocks(work, len(mesh.faces), pattern.indices.shape)
    add_blocks(elements(surface, X), space, pattern, hessian, stiffness, data)
    if hessian:
        rows, factor = circle_curvatures(surface, space, X)
        data[pattern.indptr[space.start[rows]]] += hessian * (factor * space.basis[rows, 0]).sum(axis=1)
    return data


def circle_curvatures(surface: Surface, space: MotionSpace, X: Floats) -> tuple[Ints, Floats]:
    """The vertices (k,) that move along circles, and (k,3) the gradient of ⟨t, ∇E⟩ by the tangent t alone.

    The force along a circle is ⟨t, ∇E⟩. Along a motion d it changes by ⟨t, (∂²E) d⟩ + ⟨Dt[d], ∇E⟩. Unlike at
    free vertices the second part does not vanish at rest, where ∇E is the force that the circle carries. For
    d = t it is ⟨κ, ∇E⟩, κ the curvature vector, and so part of the second variation. ∇E is taken without
    supports at X (n,3), and not computed where nothing slides along a circle.
    """
    rows = [np.flatnonzero(along & (space.dimension == 1)) for _, along in surface.on_circle]
    if not sum(map(len, rows)):
        return np.empty(0, dtype=np.int64), np.empty((0, 3))
    forces = energy_and_gradient(surface, X, supports=False)[1]
    circles = [circle for circle, _ in surface.on_circle]
    factors = [circle.turning(X[row], forces[row]) for circle, row in zip(circles, rows, strict=True)]
    return np.concatenate(rows), np.concatenate(factors)


def hessian_product(surface: Surface, mesh: Mesh, X: Floats, d: Floats) -> Floats:
    """(∂²E) d (n,3) for a motion d (n,3); ``mesh`` has the elements."""
    add_products = add_element_products if mesh.curved else _add_triangle_products

    def work(first: int, last: int, change: Floats) -> None:
        add_products(mesh.part(first, last), X, d, change)

    change: Floats = sum_blocks(work, len(mesh.faces), X.shape)
    add_hessian_products(elements(surface, X), d, change)
    return change


@compiled
def _assemble_triangles(
    mesh: Mesh, X: Floats, space: MotionSpace, pattern: Pattern, hessian: float, stiffness: float, out: Floats
) -> None:
    """The letters are those of ``triangles``, with the factors ``hessian`` and ``stiffness`` in them."""
    F, rows, origin, n = mesh.faces, mesh.rows, vector(mesh.origin), vector(mesh.normal)
    for f in range(len(F)):
        x = (sub(point(X, F[f, 0]), origin), sub(point(X, F[f, 1]), origin), sub(point(X, F[f, 2]), origin))
        edge = (sub(x[2], x[1]), sub(x[0], x[2]), sub(x[1], x[0]))
        normal, patch, raised = cross(edge[1], edge[2]), mesh.patch[f], 0.0
        twice_area, alpha, w = norm(normal), mesh.tension[patch], mesh.weight[patch]
        scale = 1.0 / twice_area if twice_area > 0.0 else 0.0
        if w != 0.0:
            middle = add(scaled(1.0 / 3.0, add(add(x[0], x[1]), x[2])), origin)
            raised = w * dot(sub(middle, vector(mesh.ground)), n)
        nu, half_T, sixth = scaled(scale, normal), 0.5 * hessian * (alpha + raised), hessian / 6.0
        k, sixth_nu = 0.5 * stiffness * (alpha + max(raised, 0.0)) * scale, scaled(sixth * w, nu)
        for i in range(3):
            j, third = (i + 1) % 3, (i + 2) % 3
            v, w_, offset = rows[f, i], rows[f, j], pattern.offset[f, i]
            along, across = dot(edge[i], edge[i]), dot(edge[i], edge[j])
            q = sub(scaled(sixth * mesh.pressure[patch], x[third]), scaled(half_T, nu))
            u, tilt = cross(sixth_nu, edge[i]), cross(sixth_nu, edge[j])
            for r in range(space.dimension[v]):
                at, b = row_place(space, pattern, v, r), vector(space.basis[v, r])
                column = _stretched(half_T * scale * along, k * along, nu, b)
                if w != 0.0:
                    column = add(column, add(scaled(dot(n, b), u), scaled(dot(u, b), n)))
                for s in range(r, space.dimension[v]):
                    out[at + s] += dot(vector(space.basis[v, s]), column)
            for s in range(space.dimension[w_]):
                b = vector(space.basis[w_, s])
                column = add(_stretched(half_T * scale * across, k * across, nu, b), cross(q, b))
                if w != 0.0:
                    column = add(column, add(scaled(dot(n, b), u), scaled(dot(tilt, b), n)))
                for r in range(space.dimension[v]):
                    at = pair_place(space, pattern, v, r, w_, s, offset)
                    out[at] += dot(vector(space.basis[v, r]), column)


@inlined
def _stretched(s: float, k: float, nu: Vector, b: Vector) -> Vector:
    """(s ν νᵀ + k 1) b."""
    return add(scaled(s * dot(nu, b), nu), scaled(k, b))


@compiled
def _assemble_curved(
    mesh: Mesh, X: Floats, space: MotionSpace, pattern: Pattern, hessian: float, stiffness: float, out: Floats
) -> None:
    size = mesh.faces.shape[1]
    block = np.empty((size, size, 3, 3))
    for e in range(len(mesh.faces)):
        fill_block(mesh, X, e, hessian, stiffness, block)
        for i in range(size):
            for j in range(i, size):
                v, w = mesh.rows[e, i], mesh.rows[e, j]
                if v <= w:
                    _add_projected(block[i, j], v, w, space, pattern, out)
                else:
                    _add_projected(block[i, j].T, w, v, space, pattern, out)


def add_blocks(
    forces: Iterable[Elements],
    space: MotionSpace,
    pattern: Pattern,
    hessian: float,
    stiffness: float,
    data: Floats,
) -> None:
    """Add hessian · Bᵀ(∂²E)B + stiffness · BᵀLB to the values ``data`` of the pattern."""
    for force in forces:
        if not hessian and force.stiffness is None:
            continue
        blocks = np.ascontiguousarray(hessian * force.hessian())
        if stiffness and force.stiffness is not None:
            blocks += stiffness * force.stiffness()[..., None, None] * np.eye(3)
        _assemble_blocks(np.array(force.vertices, dtype=np.int64), blocks, space, pattern, data)


@compiled
def _assemble_blocks(
    vertices: Ints, blocks: Floats, space: MotionSpace, pattern: Pattern, data: Floats
) -> None:
    for e in range(len(vertices)):
        for i in range(vertices.shape[1]):
            for j in range(vertices.shape[1]):
                if vertices[e, i] <= vertices[e, j]:
                    _add_projected(blocks[e, i, j], vertices[e, i], vertices[e, j], space, pattern, data)


@compiled
def _add_projected(block: Floats, v: int, w: int, space: MotionSpace, pattern: Pattern, data: Floats) -> None:
    """Add Bᵀ block B of vertices v ≤ w, two of one element, to the values of the pattern."""
    dimension, start, indptr = space.dimension, space.start, pattern.indptr
    if dimension[w] == 0:
        return
    for r in range(dimension[v]):
        at, b = row_place(space, pattern, v, r), vector(space.basis[v, r])
        row = dot(b, vector(block[:, 0])), dot(b, vector(block[:, 1])), dot(b, vector(block[:, 2]))
        if v != w:
            first, last = indptr[start[v] + r], indptr[start[v] + r + 1]
            at = first + np.searchsorted(pattern.indices[first:last], start[w])
            if at == last or pattern.indices[at] != start[w]:
                raise LookupError("two vertices of an element are no pair of the pattern")
        for s in range(r if v == w else 0, dimension[w]):
            data[at + s] += dot(row, vector(space.basis[w, s]))


@compiled
def _add_triangle_products(mesh: Mesh, X: Floats, D: Floats, change: Floats) -> None:
    """Add (∂²E) d to change (n,3): how ∇E of ``measure_block`` changes along D."""
    F, rows, n = mesh.faces, mesh.rows, vector(mesh.normal)
    origin, ground = vector(mesh.origin), vector(mesh.ground)
    for f in range(len(F)):
        i, j, k, patch = F[f, 0], F[f, 1], F[f, 2], mesh.patch[f]
        a, b, c = sub(point(X, i), origin), sub(point(X, j), origin), sub(point(X, k), origin)
        da, db, dc = point(D, i), point(D, j), point(D, k)
        u, v, du, dv = sub(b, a), sub(c, a), sub(db, da), sub(dc, da)
        normal, change_of_normal = cross(u, v), cross_sum(du, v, u, dv)
        twice_area = norm(normal)
        scale = 1.0 / twice_area if twice_area > 0.0 else 0.0
        nu = scaled(scale, normal)
        growth = dot(nu, change_of_normal)  # of twice the area
        half, turn, w = 0.5 * mesh.tension[patch], 0.0, mesh.weight[patch]
        if w != 0.0:
            middle = add(scaled(1.0 / 3.0, add(add(a, b), c)), origin)
            half += 0.5 * w * dot(sub(middle, ground), n)
            turn = w / 6.0 * dot(add(add(da, db), dc), n)
        # ½ T ν and its change; the force on a is their product with e_a, less p/6 b × c, and w A n / 3
        pull = scaled(half, nu)
        dpull = add(scaled(half * scale, change_of_normal), scaled(turn - half * scale * growth, nu))
        sixth_p, down = -mesh.pressure[patch] / 6.0, scaled(w / 6.0 * growth, n)
        e, de = sub(v, u), sub(dv, du)
        on_a = add(cross_sum(dpull, e, pull, de), scaled(sixth_p, cross_sum(db, c, b, dc)))
        on_b = add(cross_sum(v, dpull, dv, pull), scaled(sixth_p, cross_sum(dc, a, c, da)))
        on_c = add(cross_sum(dpull, u, pull, du), scaled(sixth_p, cross_sum(da, b, a, db)))
        accumulate(change, rows[f, 0], add(on_a, down))
        accumulate(change, rows[f, 1], add(on_b, down))
        accumulate(change, rows[f, 2], add(on_c, down))
