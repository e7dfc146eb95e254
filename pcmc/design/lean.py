"""The lean of a wall as a target, with its exact derivative."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Ints
from ..base.errors import OptionError
from ..certificate.tables import lean_sines
from ..surface import Surface
from ..surface.geometry import area_vectors
from .measurement import Branches, Measurement, largest


def lean(surface: Surface, of: str | None) -> Measurement:
    """Largest angle of a wall's triangles from the vertical of Π, degrees; of all walls if ``of`` is None.

    θ = arcsin |s|, s = ⟨ν, n⟩, ν = N / |N|; N = (b - a) × (c - a) changes by da × (b - c) with the corner a,
    so ∂s/∂a = (b - c) × (n - s ν) / |N|. The largest of all θ and -θ: where walls are upright it has a kink.
    """
    walls = [surface.patch_index(of)] if of is not None else np.flatnonzero(surface.walls).tolist()
    for wall in walls:
        if not surface.walls[wall]:
            text = f"lean of {of}: that patch is under pressure; a wall can lean"
            raise OptionError(text, what="of", found=of)
    if not walls:
        raise OptionError("lean: the surface has no walls", what="of", found=of)
    sines = np.where(np.isin(surface.patch_of_face, walls), lean_sines(surface), 0.0)
    signs = np.repeat([1.0, -1.0], surface.m)
    own = np.flatnonzero(np.tile(np.isin(surface.patch_of_face, walls), 2))

    def branches(near: Ints) -> Branches:
        sign, face = signs[own[near]], own[near] % surface.m
        s, corners = sines[face][:, None], surface.vertices[surface.faces[face]]
        normal = 2.0 * area_vectors(corners)
        length = np.linalg.norm(normal, axis=1)[:, None]
        across = (np.array(surface.plane.normal) - s * normal / length) / length
        rate = np.degrees(sign[:, None] / np.sqrt(np.maximum(1.0 - s * s, 1e-12)))
        sides = np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1)
        slopes = rate[:, :, None] * np.cross(sides, across[:, None])
        return Branches.of(surface.faces[face], slopes, surface.n)

    return largest(np.degrees(np.arcsin(np.clip(signs * np.tile(sines, 2), -1.0, 1.0)))[own], 90.0, branches)
