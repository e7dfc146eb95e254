"""The volume between a patch and Π, and its gradient.

With z the height over Π, n its normal, and ν the normal of a triangle T = (a, b, c), on which z is linear,

    V_i = ∫ z ⟨ν, n⟩ dA = Σ_T z̄_T A_T ⟨ν_T, n⟩,   z̄_T = ⅓ (z_a + z_b + z_c)
    ∂V_T/∂a = ⅓ A_T ⟨ν_T, n⟩ n + ½ z̄_T n × (c - b)

It counts the prisms between the triangles and Π: positive where the patch looks away from Π, negative where
it overhangs. The sum over all patches under pressure is the volume enclosed where the boundary lies on Π or
on vertical planes. Proof: with x seen from a point of Π, z n - x/3 = ⅓ curl(z n × x), so V is the cones of
the energy and ⅓ ∮ z ⟨n × x, dl⟩ along the edges of the patches. Patches that share a curve run along it in
opposite directions, on Π z = 0, and a flat piece on a vertical plane has no part along n.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats
from ..surface import Surface
from ..surface.geometry import area_vectors


def volumes_below(surface: Surface) -> Floats:
    """(k,) the volume V_i between each patch and Π, length³.

    >>> from pcmc import Patch
    >>> X = [[0, 0, 5], [1, 0, 5], [0, 1, 8]]
    >>> lid = Surface(X, [[0, 1, 2]], [0], [Patch("lid", 1.0)], fixed=[0, 1, 2])
    >>> volumes_below(lid).tolist()  # the mean height 6 over a triangle of area ½
    [3.0]
    """
    corners = surface.vertices[surface.faces]
    height = surface.plane.height(corners).mean(axis=1)
    each = height * (area_vectors(corners) @ np.array(surface.plane.normal))
    return np.asarray(np.bincount(surface.patch_of_face, each, len(surface.patches)), dtype=float)


def volume_below(surface: Surface) -> float:
    """The volume under the roof: Σ V_i over all patches that are no walls."""
    return float(volumes_below(surface)[surface.roof].sum())


def volume_below_gradient(surface: Surface, factors: Floats) -> Floats:
    """(n,3) Σ f_i ∂V_i/∂X with the factors f (k,), supports not applied, length².

    >>> from pcmc import Patch
    >>> X = [[0, 0, 5], [1, 0, 5], [0, 1, 8]]
    >>> lid = Surface(X, [[0, 1, 2]], [0], [Patch("lid", 1.0)], fixed=[0, 1, 2])
    >>> gradient = volume_below_gradient(lid, np.ones(1))
    >>> gradient[:, 2].sum().round(12).tolist()  # the area below the lid, for a motion along n
    0.5
    """
    F, normal = surface.faces, np.array(surface.plane.normal)
    corners = surface.vertices[F]
    factor = factors[surface.patch_of_face]
    height = factor * surface.plane.height(corners).mean(axis=1)
    raised = (factor * (area_vectors(corners) @ normal) / 3.0)[:, None] * normal
    gradient = np.zeros_like(surface.vertices)
    for a in range(3):
        opposite = corners[:, a - 1] - corners[:, a - 2]
        np.add.at(gradient, F[:, a], raised + 0.5 * height[:, None] * np.cross(normal, opposite))
    return gradient
