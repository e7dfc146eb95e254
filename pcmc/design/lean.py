"""The lean of a wall as a target, with its exact derivative."""

from __future__ import annotations

import numpy as np

from ..base.errors import OptionError
from ..certificate.leaning import lean_sines
from ..surface import Surface
from ..surface.geometry import area_vectors
from .measurement import Measurement


def lean(surface: Surface, of: str | None) -> Measurement:
    """Largest angle of a wall's triangles from the vertical of Π, degrees; of all walls if ``of`` is None.

    θ = arcsin |s|, s = ⟨ν, n⟩, ν = N / |N|; N = (b - a) × (c - a) changes by da × (b - c) with the corner a,
    so ∂s/∂a = (b - c) × (n - s ν) / |N|.
    """
    walls = [surface.patch_index(of)] if of is not None else np.flatnonzero(surface.walls).tolist()
    for wall in walls:
        if not surface.walls[wall]:
            text = f"lean of {of}: that patch is under pressure; a wall can lean"
            raise OptionError(text, what="of", found=of)
    if not walls:
        raise OptionError("lean: the surface has no walls", what="of", found=of)
    sines = np.where(np.isin(surface.patch_of_face, walls), lean_sines(surface), 0.0)
    face = int(np.abs(sines).argmax())
    s, normal = float(sines[face]), 2.0 * area_vectors(surface.vertices[surface.faces[face]])
    length = float(np.linalg.norm(normal))
    across = (np.array(surface.plane.normal) - s * normal / length) / length
    rate = np.degrees(np.sign(s) / np.sqrt(max(1.0 - s * s, 1e-12)))
    slope, corners = np.zeros_like(surface.vertices), surface.faces[face]
    for k, vertex in enumerate(corners):
        b, c = surface.vertices[corners[(k + 1) % 3]], surface.vertices[corners[(k + 2) % 3]]
        slope[vertex] = rate * np.cross(b - c, across)
    return Measurement(float(np.degrees(np.arcsin(min(1.0, abs(s))))), slope)
