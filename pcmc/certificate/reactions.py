"""The forces of the supports."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats
from ..contact.pinching import standing_part
from ..energy import kernels
from ..energy.functional import add_cables_and_weights, apply_supports
from ..surface import Surface
from ..surface.geometry import area_vectors, segment_lengths, vertex_sums
from ..surface.supports import symmetric_part


def held_lengths(surface: Surface) -> Floats:
    """(n,) half the length of the boundary edges at each vertex that are held at both ends, length.

    In a mirror plane nothing is held.
    """
    ends = surface.topology.edges[surface.topology.boundary_edge & ~surface.mirror_edge]
    ends = ends[surface.held[ends].all(axis=1)]
    half = 0.5 * segment_lengths(surface.vertices, ends)
    return np.asarray(np.bincount(ends.ravel(), np.repeat(half, 2), surface.n), dtype=float)


def reactions(surface: Surface) -> Floats:
    """(n,3) forces of the supports: the whole force where fixed, its part normal to the plane where sliding.

    In a mirror plane this part is the pull of the image.

    The force at a vertex is Σ α ∂A - ⅓ Σ p A_T ν_T, with a third of each triangle's pressure, and the
    forces of cables and weights. At a boundary this is not ∇E: there the volume is that of a cone to the
    point of Π, whose side moves with the boundary but is under no pressure.
    """
    X, F = surface.vertices, surface.faces
    zero = np.zeros(len(surface.patches))
    forces = kernels.measure(kernels.energy_mesh(surface, pressure=zero), X)[2]
    add_cables_and_weights(surface, X, forces)
    third = area_vectors(X[F]) / 3.0
    forces -= vertex_sums(third * surface.net_pressures[surface.patch_of_face, None], F, surface.n)
    return forces - apply_supports(surface, forces.copy())


def reactions_per_length(surface: Surface, forces: Floats | None = None) -> Floats:
    """(n,3) the reactions over the length of held boundary at each vertex; NaN where there is none.

    Each end of a held boundary edge gets half of its length. ``forces`` (n,3) are by default the
    reactions of the part of the surface that stands. The pull of images in mirror planes is left out.

    >>> from pcmc import Patch
    >>> square = Surface([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], [[0, 1, 2], [2, 3, 0]],
    ...                  [0, 0], [Patch("floor", 1.0)], fixed=range(4))
    >>> (3 * reactions_per_length(square)).round(9)[1].tolist()  # tension -1, 1; a third of p A = 2
    [-1.5, 1.5, -1.0]
    """
    share = held_lengths(surface)[:, None]
    if forces is None:
        forces = reactions(standing_part(surface).surface)
    forces = symmetric_part(surface.on_planes, forces.copy())
    return np.divide(forces, share, out=np.full((surface.n, 3), np.nan), where=share > 0.0)
