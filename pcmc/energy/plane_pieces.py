"""Volumes closed by flat pieces on sliding planes: what they add to E, its gradient and its Hessian.

With c the apex of a piece, seen from the surface's origin like all positions, and a → b a side on its plane,

    V  = -(1/6) ⟨c, a × b⟩ + ⟨n, v⟩
    ∂V/∂a = (1/6) c × b,   ∂V/∂b = -(1/6) c × a,   ∂V/∂v = n,   ∂²V/∂a∂b = (1/6) [c]×

where v are the ends of the boundary on that plane; see ``flat_pieces``. All of it costs nothing where
every plane passes through the origin: mirror planes through one point of Π, for instance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..base.arrays import Floats, Ints
from ..surface import Surface
from .flat_pieces import FlatPieces, flat_pieces

if TYPE_CHECKING:
    from scipy.sparse import csr_array


def add_plane_volumes(surface: Surface, X: Floats, volumes: Floats) -> Floats:
    """The volumes (k,) with the flat pieces of each patch added, in place; vertices at X (n,3)."""
    pieces = flat_pieces(surface)
    if pieces:
        a, b = _sides(surface, pieces)
        X = X - surface.origin
        each = -np.einsum("ij,ij->i", pieces.apex, np.cross(X[a], X[b])) / 6.0
        volumes += np.bincount(surface.patch_of_face[pieces.face], each, len(volumes))
        at_ends = np.einsum("ij,ij->i", pieces.normal, X[pieces.end])
        volumes += np.bincount(pieces.end_patch, at_ends, len(volumes))
    return volumes


def add_plane_forces(surface: Surface, pressures: Floats, X: Floats, gradient: Floats) -> Floats:
    """The gradient (n,3) with -Σ p ∂V of the flat pieces added, in place; pressures (k,)."""
    pieces = flat_pieces(surface)
    if pieces:
        a, b = _sides(surface, pieces)
        X = X - surface.origin
        p = pressures[surface.patch_of_face[pieces.face], None] / 6.0
        np.subtract.at(gradient, a, p * np.cross(pieces.apex, X[b]))
        np.add.at(gradient, b, p * np.cross(pieces.apex, X[a]))
        np.subtract.at(gradient, pieces.end, pressures[pieces.end_patch, None] * pieces.normal)
    return gradient


def add_plane_turns(surface: Surface, D: Floats, change: Floats) -> Floats:
    """(∂²E) D with the flat pieces' part added to change (n,3), in place; D (n,3) a motion."""
    pieces = flat_pieces(surface)
    if pieces:
        a, b = _sides(surface, pieces)
        p = surface.net_pressures[surface.patch_of_face[pieces.face], None] / 6.0
        np.subtract.at(change, a, p * np.cross(pieces.apex, D[b]))
        np.add.at(change, b, p * np.cross(pieces.apex, D[a]))
    return change


def plane_hessian(surface: Surface) -> csr_array:
    """-Σ p ∂²V of the flat pieces, sparse symmetric (3n,3n); unknown 3v + d is coordinate d of v."""
    from scipy.sparse import coo_array, csr_array

    pieces = flat_pieces(surface)
    a, b = _sides(surface, pieces)
    sixth_p = surface.net_pressures[surface.patch_of_face[pieces.face]] / 6.0
    columns = np.cross(pieces.apex[:, None, :], np.eye(3))  # c × e_s
    blocks = -sixth_p[:, None, None] * columns.transpose(0, 2, 1)
    rows = np.broadcast_to(3 * a[:, None, None] + np.arange(3)[:, None], blocks.shape)
    across = np.broadcast_to(3 * b[:, None, None] + np.arange(3), blocks.shape)
    shape = (3 * surface.n, 3 * surface.n)
    half = csr_array(coo_array((blocks.ravel(), (rows.ravel(), across.ravel())), shape=shape))
    return half + half.T


def _sides(surface: Surface, pieces: FlatPieces) -> tuple[Ints, Ints]:
    """The vertices a and b (h,) of the sides."""
    face, corner = pieces.face, pieces.corner
    return surface.faces[face, corner], surface.faces[face, (corner + 1) % 3]
