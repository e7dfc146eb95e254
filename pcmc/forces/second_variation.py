"""The second variation of E: one block for each pair of corners, and the two ways in which blocks are used.

For corners i and j of an element, ∂²E/∂x_i∂x_j is the 3×3 matrix

    s t tᵀ + k 1 + [q]× + u nᵀ + n vᵀ

- triangle with normal ν, area A, edges e opposite its corners, pressure p, and tension T = α + w z̄ at its
  mean height z̄ over Π: s = T (e_i·e_j) / (4A) with t = ν; q = ∓½ T ν ± p x_k / 6 (upper signs where j follows
  i, k the third corner, seen from the reference point; 0 for i = j); under a weight w also u = w g_i / 3 and
  v = w g_j / 3 with g_i = ½ ν × e_i, n the normal of Π;
- edge of a cable with tension τ, length ℓ, direction t: k = τ/ℓ and s = -τ/ℓ for i = j, the negatives for
  i ≠ j;
- side of a flat piece that closes a volume on a plane, with the apex c: q = -p c / 6;
- vertex that slides along a circle with curvature vector κ: ⟨κ, ∇E⟩ along its tangent.

The *stiffness* L has only k: T₊ (e_i·e_j) / (4A) with T₊ = α + max(w z̄, 0) for triangles, ±τ/ℓ for edges.
``assemble`` projects hessian · ∂²E + stiffness · L into the motion space; ``add_products`` multiplies ∂²E by
a motion.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled, inlined
from ..surface import Surface, expect_surface
from ..surface.geometry import Vector, accumulate, add, cross, dot, norm, point, scaled, sub, vector
from ..surface.parts import CableEdges
from ..surface.topology import Topology
from .flat_pieces import flat_pieces
from .kernels import Mesh, energy_mesh
from .motion_space import MotionSpace, VertexClasses
from .pattern import Pattern, hessian_pattern, pair_place, row_place
from .turning import circle_turning

if TYPE_CHECKING:
    from scipy.sparse import csr_array


class Block(NamedTuple):
    """s t tᵀ + k 1."""

    s: float
    t: Vector
    k: float


class Tilt(NamedTuple):
    """u nᵀ + n vᵀ."""

    u: Vector
    v: Vector
    n: Vector


class Triangle(NamedTuple):
    """A triangle and the forces on it, with the factors ``hessian`` and ``stiffness`` in them.

    Attributes
    ----------
    corner, edge : three vectors each, seen from the reference point; edge i is opposite corner i.
    nu : unit normal; zero if there is no area.
    s, k : T / (4A) and T₊ / (4A). half_pull : ½ T ν. sixth_p, sixth_w : p / 6 and w / 6.
    """

    corner: tuple[Vector, Vector, Vector]
    edge: tuple[Vector, Vector, Vector]
    nu: Vector
    s: float
    k: float
    half_pull: Vector
    sixth_p: float
    sixth_w: float


@inlined
def _triangle(mesh: Mesh, X: Floats, f: int, hessian: float, stiffness: float) -> Triangle:
    F, origin, patch = mesh.faces, vector(mesh.origin), mesh.patch[f]
    a, b, c = sub(point(X, F[f, 0]), origin), sub(point(X, F[f, 1]), origin), sub(point(X, F[f, 2]), origin)
    edge = (sub(c, b), sub(a, c), sub(b, a))
    normal = cross(edge[1], edge[2])
    twice_area = norm(normal)
    scale = 1.0 / twice_area if twice_area > 0.0 else 0.0
    alpha, weight, nu, extra = mesh.tension[patch], mesh.weight[patch], scaled(scale, normal), 0.0
    if weight != 0.0:
        middle = add(scaled(1.0 / 3.0, add(add(a, b), c)), origin)
        extra = weight * dot(sub(middle, vector(mesh.ground)), vector(mesh.normal))
    half = 0.5 * hessian * (alpha + extra)
    spread = 0.5 * stiffness * (alpha + max(extra, 0.0)) * scale
    sixth = hessian / 6.0
    return Triangle(
        (a, b, c),
        edge,
        nu,
        half * scale,
        spread,
        scaled(half, nu),
        sixth * mesh.pressure[patch],
        sixth * weight,
    )


@inlined
def _block(t: Triangle, i: int, j: int) -> Block:
    cosine = dot(t.edge[i], t.edge[j])
    return Block(t.s * cosine, t.nu, t.k * cosine)


@inlined
def _skew(t: Triangle, k: int) -> Vector:
    """q for a corner and the one that follows; k is the third."""
    return sub(scaled(t.sixth_p, t.corner[k]), t.half_pull)


@inlined
def _tilt(t: Triangle, n: Vector, i: int, j: int) -> Tilt:
    return Tilt(scaled(t.sixth_w, cross(t.nu, t.edge[i])), scaled(t.sixth_w, cross(t.nu, t.edge[j])), n)


@inlined
def _cable_block(cables: CableEdges, X: Floats, e: int, hessian: float, stiffness: float) -> Block:
    """Of an end with itself; that of both ends with each other is the negative."""
    side = sub(point(X, cables.ends[e, 1]), point(X, cables.ends[e, 0]))
    length = norm(side)
    scale = 1.0 / length if length > 0.0 else 0.0
    pull = cables.tension[e] * scale
    return Block(-hessian * pull, scaled(scale, side), (hessian + stiffness) * pull)


@inlined
def _times(b: Block, q: Vector | None, tilt: Tilt | None, y: Vector) -> Vector:
    """(s t tᵀ + k 1 + [q]× + u nᵀ + n vᵀ) y; None for q and tilt leaves them out."""
    out = add(scaled(b.s * dot(b.t, y), b.t), scaled(b.k, y))
    if q is not None:
        out = add(out, cross(q, y))
    if tilt is not None:
        out = add(out, add(scaled(dot(tilt.n, y), tilt.u), scaled(dot(tilt.v, y), tilt.n)))
    return out


@inlined
def _add_diagonal(
    space: MotionSpace, pattern: Pattern, v: int, b: Block, tilt: Tilt | None, data: Floats
) -> None:
    """Add Bᵀ block B of a vertex with itself."""
    for r in range(space.dimension[v]):
        at = row_place(space, pattern, v, r)
        column = _times(b, None, tilt, vector(space.basis[v, r]))
        for s in range(r, space.dimension[v]):
            data[at + s] += dot(vector(space.basis[v, s]), column)


@inlined
def _add_pair(
    space: MotionSpace,
    pattern: Pattern,
    v: int,
    w: int,
    offset: int,
    b: Block,
    q: Vector | None,
    tilt: Tilt | None,
    data: Floats,
) -> None:
    """Add Bᵀ block B of vertex v with w, two ends of an edge with this offset in the pattern."""
    for s in range(space.dimension[w]):
        column = _times(b, q, tilt, vector(space.basis[w, s]))
        for r in range(space.dimension[v]):
            at = pair_place(space, pattern, v, r, w, s, offset)
            data[at] += dot(vector(space.basis[v, r]), column)


def hessian(surface: Surface) -> csr_array:
    """∂²E/∂X², sparse symmetric (3n,3n), supports not applied; unknown 3v + d is coordinate d of v.

    >>> from pcmc import Patch, Surface
    >>> flat = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("t", 1.0)], fixed=[0])
    >>> H = hessian(flat.retensioned(pressures={"t": 0.0}))  # A is homogeneous of degree 2: H X = ∇A
    >>> (H @ flat.vertices.ravel()).reshape(3, 3).round(12).tolist()
    [[-0.5, -0.5, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0]]
    """
    expect_surface(surface)
    every = MotionSpace.of(np.tile(np.eye(3), (surface.n, 1, 1)), np.full(surface.n, 3))
    pattern = hessian_pattern(surface, every)
    data = _assembled(surface, surface.topology, energy_mesh(surface), every, pattern, surface.vertices)
    return pattern.symmetric(data)


def assemble(
    surface: Surface,
    classes: VertexClasses,
    space: MotionSpace,
    pattern: Pattern,
    X: Floats,
    hessian: float = 1.0,
    stiffness: float = 0.0,
) -> Floats:
    """Values of hessian · Bᵀ(∂²E)B + stiffness · BᵀLB in the pattern."""
    mesh, topo = classes.mesh(surface), classes.topology
    data = _assembled(surface, topo, mesh, space, pattern, X, hessian, stiffness)
    if hessian:
        rows, factor = circle_turning(surface, space, X)
        data[pattern.indptr[space.start[rows]]] += hessian * (factor * space.basis[rows, 0]).sum(axis=1)
    return data


def add_products(surface: Surface, mesh: Mesh, X: Floats, d: Floats, change: Floats) -> Floats:
    """(∂²E) d added to ``change`` (n,3), in place, for a motion d (n,3); ``mesh`` has the triangles."""
    _add_triangle_products(mesh, X, d, change)
    _add_cable_products(surface.cable_edges, X, d, change)
    if flat_pieces(surface):
        ends, q = _flat_sides(surface, mesh.pressure)
        np.add.at(change, ends[:, 0], np.cross(q, d[ends[:, 1]]))
        np.subtract.at(change, ends[:, 1], np.cross(q, d[ends[:, 0]]))
    return change


def _assembled(
    surface: Surface,
    topo: Topology,
    mesh: Mesh,
    space: MotionSpace,
    pattern: Pattern,
    X: Floats,
    hessian: float = 1.0,
    stiffness: float = 0.0,
) -> Floats:
    data = np.zeros(len(pattern.indices))
    _assemble_triangles(mesh, X, space, pattern, hessian, stiffness, data)
    cables = surface.cable_edges
    if len(cables.ends):
        offset = pattern.edge_offset[topo.edge_numbers(cables.ends)]
        _assemble_cables(cables, offset, X, space, pattern, hessian, stiffness, data)
    if hessian and flat_pieces(surface):
        ends, q = _flat_sides(surface, mesh.pressure)
        offset = pattern.edge_offset[topo.edge_numbers(ends)]
        _assemble_sides(ends, offset, hessian * q, space, pattern, data)
    return data


def _flat_sides(surface: Surface, pressure: Floats) -> tuple[Ints, Floats]:
    """The sides a → b (h,2) of flat pieces under pressure, and q (h,3) of their blocks."""
    pieces = flat_pieces(surface)
    p = pressure[surface.patch_of_face[pieces.face]]
    face, corner = pieces.face[p != 0.0], pieces.corner[p != 0.0]
    ends = np.stack([surface.faces[face, corner], surface.faces[face, (corner + 1) % 3]], axis=1)
    return ends, -p[p != 0.0, None] / 6.0 * pieces.apex[p != 0.0]


@compiled
def _assemble_triangles(
    mesh: Mesh,
    X: Floats,
    space: MotionSpace,
    pattern: Pattern,
    hessian: float,
    stiffness: float,
    data: Floats,
) -> None:
    F, n = mesh.faces, vector(mesh.normal)
    for f in range(len(F)):
        t = _triangle(mesh, X, f, hessian, stiffness)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            v, w, offset = F[f, i], F[f, j], pattern.offset[f, i]
            alone, pair, q = _block(t, i, i), _block(t, i, j), _skew(t, k)
            if t.sixth_w == 0.0:
                _add_diagonal(space, pattern, v, alone, None, data)
                _add_pair(space, pattern, v, w, offset, pair, q, None, data)
            else:
                _add_diagonal(space, pattern, v, alone, _tilt(t, n, i, i), data)
                _add_pair(space, pattern, v, w, offset, pair, q, _tilt(t, n, i, j), data)


@compiled
def _assemble_cables(
    cables: CableEdges,
    offset: Ints,
    X: Floats,
    space: MotionSpace,
    pattern: Pattern,
    hessian: float,
    stiffness: float,
    data: Floats,
) -> None:
    for e in range(len(cables.ends)):
        v, w = cables.ends[e, 0], cables.ends[e, 1]
        block = _cable_block(cables, X, e, hessian, stiffness)
        _add_diagonal(space, pattern, v, block, None, data)
        _add_diagonal(space, pattern, w, block, None, data)
        across = Block(-block.s, block.t, -block.k)
        _add_pair(space, pattern, v, w, offset[e], across, None, None, data)


@compiled
def _assemble_sides(
    ends: Ints, offset: Ints, q: Floats, space: MotionSpace, pattern: Pattern, data: Floats
) -> None:
    nothing = (0.0, 0.0, 0.0)
    for e in range(len(ends)):
        block = Block(0.0, nothing, 0.0)
        _add_pair(space, pattern, ends[e, 0], ends[e, 1], offset[e], block, vector(q[e]), None, data)


@compiled
def _add_triangle_products(mesh: Mesh, X: Floats, D: Floats, change: Floats) -> None:
    F, n = mesh.faces, vector(mesh.normal)
    for f in range(len(F)):
        t = _triangle(mesh, X, f, 1.0, 0.0)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            v, w = F[f, i], F[f, j]
            d, e, q = point(D, v), point(D, w), _skew(t, k)
            alone, pair, back = _block(t, i, i), _block(t, i, j), scaled(-1.0, q)
            if t.sixth_w == 0.0:
                at_v = add(_times(alone, None, None, d), _times(pair, q, None, e))
                at_w = _times(pair, back, None, d)
            else:
                at_v = _times(alone, None, _tilt(t, n, i, i), d)
                at_v = add(at_v, _times(pair, q, _tilt(t, n, i, j), e))
                at_w = _times(pair, back, _tilt(t, n, j, i), d)
            accumulate(change, v, at_v)
            accumulate(change, w, at_w)


@compiled
def _add_cable_products(cables: CableEdges, X: Floats, D: Floats, change: Floats) -> None:
    for e in range(len(cables.ends)):
        v, w = cables.ends[e, 0], cables.ends[e, 1]
        pull = _times(_cable_block(cables, X, e, 1.0, 0.0), None, None, sub(point(D, w), point(D, v)))
        accumulate(change, w, pull)
        accumulate(change, v, scaled(-1.0, pull))
