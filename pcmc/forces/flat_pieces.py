"""Flat pieces on the planes that boundaries slide on: with them the volume of a patch is enclosed.

V_i is the volume of the cones from ``Surface.origin`` o to the triangles. Where the boundary slides on a
plane through o, the side of the cones lies in that plane and carries nothing. On another plane k it does not,
and a flat piece between the boundary and a point c of plane k, its apex, is added. With the sides a → b of
triangles on the boundary in plane k, all positions seen from o,

    V = -(1/6) Σ ⟨c, a × b⟩,    ∂V/∂a = (1/6) c × b,    ∂V/∂b = -(1/6) c × a,    ∂²V/∂a∂b = (1/6) [c]×

Other curves between two vertices of plane k may rise from it like an arch; only in mirror planes they count,
too. Where the boundary leaves plane k for a plane j, the piece ends along the line that both have in common.
c is chosen on as many of these lines as possible, and then as near to o as possible. On others, with c' the
point of the line nearest to o, V += ∓(1/6) ⟨c, v × c'⟩ =: ⟨n, v⟩ for the vertex v there (- at the head of the
last side, + at the tail of the first), so ∂V/∂v = n. It all costs nothing where every plane passes through o.

Where a surface is periodic, the cones of neighbours across its seam are seen from places that are a
translation apart, and the force on a vertex would depend on o. Each side a → b of a triangle is shifted by s
from where the edge's first triangle has it; a piece with c = s takes it back there. With the shift u of the
triangle's corner from the vertex that it is an image of, and the shifts w and w' of the ends of the first
triangles' sides before and after that corner, n = -(1/6) (w - w') × u: at every vertex the forces then add up
to those of its closed star. The volume of what wraps around a cell is counted up to a constant.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..base.arrays import Bools, Floats, Ints, kept_with_owner
from ..base.errors import SurfaceError
from ..base.tolerances import ON, PARALLEL, SAME_PLACE
from ..surface import Plane, Surface
from ..surface.checks import lying
from ..surface.lagrange import expect_flat
from ..surface.supports import common_point
from .elements import Elements


class FlatPieces(NamedTuple):
    """Sides of triangles and ends of boundaries that the flat pieces start from."""

    face: Ints  # (h,) the triangle of each side a → b
    corner: Ints  # (h,) its corner a; the next one is b
    apex: Floats  # (h,3) c, seen from the origin
    end: Ints  # (e,) vertices where the boundary leaves a plane for another
    end_patch: Ints  # (e,) the patch there
    normal: Floats  # (e,3) n

    def __bool__(self) -> bool:
        return len(self.face) > 0


EMPTY, FLAT = np.empty(0, dtype=np.int64), np.empty((0, 3))
NONE = FlatPieces(EMPTY, EMPTY, FLAT, EMPTY, EMPTY, FLAT)


def volumes(surface: Surface, X: Floats, factors: Floats | None = None) -> list[tuple[Ints, Elements]]:
    """The volumes of the flat pieces, by sides and by ends, and the patch of each; vertices at X (n,3).

    They are multiplied by ``factors`` (k,) of the patches; pieces whose factor is 0 are left out.
    """
    if not (pieces := flat_pieces(surface)):
        return []
    factors = np.ones(len(surface.patches)) if factors is None else factors
    patches = surface.patch_of_face[pieces.face], pieces.end_patch
    seen, vertex = X - surface.origin, surface.original
    of_side, of_end = (factors[patch] for patch in patches)
    used, last = np.flatnonzero(of_side), np.flatnonzero(of_end)
    face, corner = pieces.face[used, None], pieces.corner[used, None]
    ends, c = surface.faces[face, np.add(corner, [0, 1]) % 3], of_side[used, None] * pieces.apex[used]
    a, b = seen[ends[:, 0]], seen[ends[:, 1]]

    def hessian() -> Floats:
        skew = np.cross(c[:, None] / 6.0, np.eye(3)).swapaxes(1, 2)  # [c]×/6
        nothing = 0.0 * skew
        return np.stack([np.stack(row, axis=1) for row in ((nothing, skew), (-skew, nothing))], axis=1)

    def gradient() -> Floats:
        return np.stack([np.cross(c, b), -np.cross(c, a)], axis=1) / 6.0

    sides = Elements(vertex[ends], -np.einsum("ij,ij->i", c, np.cross(a, b)) / 6.0, gradient, hessian)
    end, normal = pieces.end[last], of_end[last, None] * pieces.normal[last]
    at_ends, zero = np.einsum("ij,ij->i", normal, seen[end]), np.zeros((len(end), 1, 1, 3, 3))
    points = Elements(vertex[end[:, None]], at_ends, lambda: normal[:, None], lambda: zero)
    return [(patches[0][used], sides), (patches[1][last], points)]


def elements(surface: Surface, X: Floats, pressures: Floats | None = None) -> Iterator[Elements]:
    """-Σ p V of the flat pieces, with the surface's net pressures or others (k,)."""
    p = surface.net_pressures if pressures is None else pressures
    return (pieces for _, pieces in volumes(surface, X, -p))


def add_plane_volumes(surface: Surface, X: Floats, sums: Floats) -> Floats:
    """The volumes (k,) with the flat pieces of each patch added, in place; vertices at X (n,3)."""
    for patch, pieces in volumes(surface, X):
        sums += np.bincount(patch, pieces.value, len(sums))
    return sums


def ground(surface: Surface) -> Bools:
    """(n,) vertices held on Π: those that slide there, and fixed ones that lie on it."""
    low = lying(surface.plane.height(surface.vertices), surface.vertices)
    return surface.given_supports.on_plane | (surface.fixed & low)


@kept_with_owner
def flat_pieces(surface: Surface) -> FlatPieces:
    """The flat pieces of a surface, computed once; ``NONE`` where all planes pass through its origin."""
    if surface.periodic:
        return _seam_pieces(surface)
    if not surface.on_planes:
        return NONE
    masks = [(surface.plane, ground(surface)), *surface.on_planes]
    topo, origin = surface.topology, surface.origin
    distance = np.array([-float(plane.height(origin)) for plane, _ in masks])
    rounding = SAME_PLACE * (surface.size + float(np.abs(origin).max()))
    taken = np.zeros(len(topo.edges), dtype=bool)
    for k in np.flatnonzero(np.abs(distance) <= rounding):
        taken = taken | masks[k][1][topo.edges].all(axis=1)
    columns = []
    for k in np.flatnonzero(np.abs(distance) > rounding):
        plane, mask = masks[k]
        along = topo.curve_edge if plane.mirror else topo.boundary_edge
        chosen = mask[topo.edges].all(axis=1) & along & ~taken
        taken = taken | chosen
        others = [other for number, other in enumerate(masks) if number != k]
        touching = [other for other, there in others if (there & mask).any()]
        apex = common_point(origin + distance[k] * np.array(plane.normal), [plane, *touching]) - origin
        face, opposite = np.nonzero(chosen[topo.edge_of_face])
        side = face, (opposite + 1) % 3
        columns.append((*side, np.tile(apex, (len(face), 1)), *_ends(surface, *side, apex, plane, others)))
    if not sum(len(column[0]) for column in columns):
        return NONE
    expect_flat(surface, "boundaries that slide on planes through no common point")
    return FlatPieces(*(np.concatenate(column) for column in zip(*columns, strict=True)))


def _seam_pieces(surface: Surface) -> FlatPieces:
    """The pieces along the seams of a periodic surface."""
    topo, F = surface.topology, surface.faces
    if surface.uncancelled.any():
        text = "a pressure that does not cancel at a free edge of a periodic surface; fix that edge, let it"
        raise SurfaceError(f"{text} slide on the plane, or take the pressure away", what="images")
    shift = surface.vertices[F] - surface.vertices[topo.faces]
    start = shift[:, [1, 2, 0]]  # of the sides opposite the corners
    of_edges = (surface.vertices[topo.sides] - surface.vertices[topo.edges])[topo.edge_of_face]
    ascends = (topo.sense > 0)[..., None, None]
    at_start, at_end = np.moveaxis(np.where(ascends, of_edges, of_edges[:, :, ::-1]), 2, 0)
    apex, tiny = start - at_start, ON * surface.size
    face, opposite = np.nonzero(np.linalg.norm(apex, axis=2) > tiny)
    normal = -np.cross(at_end[:, [1, 2, 0]] - at_start[:, [2, 0, 1]], shift) / 6.0
    ends = np.nonzero(np.linalg.norm(normal, axis=2) > tiny**2)
    apex, normal = apex[face, opposite], normal[ends]
    return FlatPieces(face, (opposite + 1) % 3, apex, F[ends], surface.patch_of_face[ends[0]], normal)


def _ends(
    surface: Surface, face: Ints, corner: Ints, apex: Floats, own: Plane, others: list[tuple[Plane, Bools]]
) -> tuple[Ints, Ints, Floats]:
    """Where the boundary of a patch leaves the plane for another one: vertex, patch, and the normal there."""
    k, origin = len(surface.patches), surface.origin
    tail, head = surface.faces[face, corner], surface.faces[face, (corner + 1) % 3]
    key = np.concatenate([head, tail]).astype(np.int64) * k + np.tile(surface.patch_of_face[face], 2)
    places, inverse = np.unique(key, return_inverse=True)
    count = np.bincount(inverse, np.repeat([1.0, -1.0], len(face)), len(places))
    vertex, patch = places // k, places % k
    normal, done = np.zeros((len(places), 3)), count == 0.0
    for plane, mask in others:
        here = ~done & mask[vertex]
        if here.any() and abs(plane.height(origin + apex)) <= SAME_PLACE * surface.size:
            done |= here  # the piece's last side lies in that plane, too
        normals = np.array([own.normal, plane.normal])
        if not here.any() or np.linalg.norm(np.cross(*normals)) <= PARALLEL:
            continue
        away = -np.array([own.height(origin), plane.height(origin)])
        normal[here] = -count[here, None] / 6.0 * np.cross(np.linalg.lstsq(normals, away)[0], apex)
        done |= here
    used = normal.any(axis=1)
    return vertex[used], patch[used], normal[used]
