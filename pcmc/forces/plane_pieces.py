"""Volumes closed by flat pieces on sliding planes: what they add to E and its gradient.

With c the apex of a piece, seen from the surface's origin like all positions, and a → b a side on its plane,

    V  = -(1/6) ⟨c, a × b⟩ + ⟨n, v⟩
    ∂V/∂a = (1/6) c × b,   ∂V/∂b = -(1/6) c × a,   ∂V/∂v = n

where v are the ends of the boundary on that plane; see ``flat_pieces``. All of it costs nothing where
every plane passes through the origin: mirror planes through one point of Π, for instance.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats, Ints
from ..surface import Surface
from .flat_pieces import FlatPieces, flat_pieces


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


def _sides(surface: Surface, pieces: FlatPieces) -> tuple[Ints, Ints]:
    """The vertices a and b (h,) of the sides."""
    face, corner = pieces.face, pieces.corner
    return surface.faces[face, corner], surface.faces[face, (corner + 1) % 3]
