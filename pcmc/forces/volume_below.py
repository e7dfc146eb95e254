"""The volume between a patch and Π, and its gradient.

With z the height over Π, n its normal, ν that of the patch, and g = x_ξ × x_η and m_i as in ``curved``,

    V_i = ∫ z ⟨ν, n⟩ dA = Σ_T ∫ z ⟨g, n⟩ dξ dη,    ∂V_T/∂x_i = ∫ N_i ⟨g, n⟩ n + z n × m_i dξ dη

over the elements T. Of a flat triangle (a, b, c) these are z̄ A ⟨ν, n⟩, with the mean height z̄ of its corners,
and ⅓ A ⟨ν, n⟩ n + ½ z̄ n × (c - b).

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
from ..surface.images import goes_on_above
from .elements import Points, energy_mesh


def volumes_below(surface: Surface) -> Floats:
    """(k,) the volume V_i between each patch and Π, length³; NaN where a periodic surface leaves Π.

    >>> from pcmc import Patch
    >>> X = [[0, 0, 5], [1, 0, 5], [0, 1, 8]]
    >>> lid = Surface(X, [[0, 1, 2]], [0], [Patch("lid", 1.0)], fixed=[0, 1, 2])
    >>> volumes_below(lid).tolist()  # the mean height 6 over a triangle of area ½
    [3.0]
    """
    if goes_on_above(surface):
        return np.full(len(surface.patches), np.nan)
    mesh = energy_mesh(surface)
    at = Points.of(mesh, surface.vertices)
    each = (surface.plane.height(at.place) * (at.area @ mesh.normal)).sum(axis=1)
    return np.asarray(np.bincount(mesh.patch, each, len(surface.patches)), dtype=float)


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
    mesh, gradient = energy_mesh(surface), np.zeros_like(surface.vertices)
    at, (N, Nu, Nv, weight) = Points.of(mesh, surface.vertices), mesh.shapes
    factor, normal = factors[mesh.patch][:, None], mesh.normal
    raised = (factor * (at.area @ normal)) @ N
    high = (factor * weight * surface.plane.height(at.place))[..., None]
    across = np.einsum("qk,eqd->ekd", Nv, high * at.along_u) - np.einsum("qk,eqd->ekd", Nu, high * at.along_v)
    np.add.at(gradient, mesh.faces, raised[..., None] * normal + np.cross(normal, across))
    return gradient
