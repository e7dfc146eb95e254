"""Flat pieces on the planes that boundaries slide on: with them the volume of a patch is enclosed.

V_i is the volume of the cones from ``Surface.origin`` o to the triangles. Where the boundary slides on a
plane through o, the side of the cones lies in that plane and carries nothing. On another plane k it does not,
and a flat piece between the boundary and a point c of plane k is added, as seen from o:

    V_i += -(1/6) Σ ⟨c, a × b⟩

over the sides a → b of triangles on the boundary in plane k, all positions seen from o. Other curves between
two vertices of plane k may rise from it like an arch; only in mirror planes they count, too. Where the
boundary leaves plane k for a plane j, the piece ends along the line that both have in common. c is chosen on
as many of these lines as possible, and then as near to o as possible. On others, with c' the point of the
line nearest to o,
V_i += ∓(1/6) ⟨c, v × c'⟩ for the vertex v there (- at the head of the last side, + at the tail of the first).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..surface import Plane, Surface
from ..surface.checks import lying
from ..surface.supports import common_point

MEETS = 1e-9  # sine of an angle up to which two planes count as parallel


class FlatPieces(NamedTuple):
    """Sides of triangles and ends of boundaries that the flat pieces start from.

    Attributes
    ----------
    face, corner : (h,) int: the side a → b from corner ``corner`` of triangle ``face`` to the next one.
    apex : (h,3) c of its plane, seen from the origin.
    end, end_patch : (e,) int: vertices where the boundary leaves a plane for another, and the patch.
    normal : (e,3) the vector whose product with v, seen from the origin, is the volume of the corner.
    """

    face: Ints
    corner: Ints
    apex: Floats
    end: Ints
    end_patch: Ints
    normal: Floats

    def __bool__(self) -> bool:
        return len(self.face) > 0


EMPTY, FLAT = np.empty(0, dtype=np.int64), np.empty((0, 3))
NONE = FlatPieces(EMPTY, EMPTY, FLAT, EMPTY, EMPTY, FLAT)


def ground(surface: Surface) -> Bools:
    """(n,) vertices held on Π: those that slide there, and fixed ones that lie on it."""
    low = lying(surface.plane.height(surface.vertices), surface.vertices)
    return surface.given_supports.on_plane | (surface.fixed & low)


def flat_pieces(surface: Surface) -> FlatPieces:
    """The flat pieces of a surface, computed once; ``NONE`` where all planes pass through its origin."""
    if not surface.on_planes:
        return NONE
    pieces: FlatPieces | None = vars(surface).get("flat_pieces")
    if pieces is None:
        pieces = vars(surface)["flat_pieces"] = _flat_pieces(surface)
    return pieces


def _flat_pieces(surface: Surface) -> FlatPieces:
    masks = [(surface.plane, ground(surface)), *surface.on_planes]
    topo, origin = surface.topology, surface.origin
    distance = np.array([-float(plane.height(origin)) for plane, _ in masks])
    rounding = 1e-12 * (surface.size + float(np.abs(origin).max()))
    away = np.flatnonzero(np.abs(distance) > rounding)
    taken = np.zeros(len(topo.edges), dtype=bool)
    for k in np.flatnonzero(np.abs(distance) <= rounding):
        taken = taken | masks[k][1][topo.edges].all(axis=1)
    sides, ends = [], []
    for k in away:
        plane, mask = masks[k]
        along = topo.curve_edge if plane.mirror else topo.boundary_edge
        chosen = mask[topo.edges].all(axis=1) & along & ~taken
        taken = taken | chosen
        others = [other for number, other in enumerate(masks) if number != k]
        touching = [other for other, there in others if (there & mask).any()]
        apex = common_point(origin + distance[k] * np.array(plane.normal), [plane, *touching]) - origin
        side = _sides(surface, chosen, apex)
        sides.append(side)
        ends.append(_ends(surface, side, (plane, mask), others))
    if not sum(len(side[0]) for side in sides):
        return NONE
    parts = [np.concatenate(column) for column in (*zip(*sides, strict=True), *zip(*ends, strict=True))]
    return FlatPieces(*parts)


def _sides(surface: Surface, chosen: Bools, apex: Floats) -> tuple[Ints, Ints, Floats]:
    """The sides of triangles at the chosen edges (e,): face, first corner, and the apex of each."""
    face, opposite = np.nonzero(chosen[surface.topology.edge_of_face])
    return face, (opposite + 1) % 3, np.broadcast_to(apex, (len(face), 3))


def _ends(
    surface: Surface,
    sides: tuple[Ints, Ints, Floats],
    own: tuple[Plane, Bools],
    others: Sequence[tuple[Plane, Bools]],
) -> tuple[Ints, Ints, Floats]:
    """Where the boundary of a patch leaves the plane for another one: vertex, patch, and the normal there."""
    face, corner, apex = sides
    k, origin = len(surface.patches), surface.origin
    tail, head = surface.faces[face, corner], surface.faces[face, (corner + 1) % 3]
    key = np.concatenate([head, tail]).astype(np.int64) * k + np.tile(surface.patch_of_face[face], 2)
    places, inverse = np.unique(key, return_inverse=True)
    count = np.bincount(inverse, np.repeat([1.0, -1.0], len(face)), len(places))
    vertex, patch = places // k, places % k
    normal, done = np.zeros((len(places), 3)), count == 0.0
    for plane, mask in others:
        here = ~done & mask[vertex]
        if here.any() and abs(plane.height(origin + apex[0])) <= 1e-12 * surface.size:
            done |= here  # the piece's last side lies in that plane, too
        normals = np.array([own[0].normal, plane.normal])
        if not here.any() or np.linalg.norm(np.cross(*normals)) <= MEETS:
            continue
        away = -np.array([own[0].height(origin), plane.height(origin)])
        corner_point = np.linalg.lstsq(normals, away, rcond=None)[0]
        normal[here] = -count[here, None] / 6.0 * np.cross(corner_point, apex[0])
        done |= here
    used = normal.any(axis=1)
    return vertex[used], patch[used], normal[used]
