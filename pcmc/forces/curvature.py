"""Mean curvature at the vertices by two definitions, its target, and the error between them.

Positive where the patch bulges towards its positive side (the paper's (2) has the opposite sign in the
formulas, and positive printed values).
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, kept_with_owner, read_only
from ..surface import Surface, expect_surface
from ..surface.geometry import vertex_area_vectors
from ..surface.supports import symmetric_part
from .functional import weighted
from .motion_space import normal_vectors, vertex_classes

Method = Literal["cotangent", "variational"]
NO_SHARE = 1e-2  # of the area around a node: its shape function integrates to next to nothing
METHODS: tuple[Method, ...] = ("cotangent", "variational")


def mean_curvature(surface: Surface, method: Method = "cotangent") -> Floats:
    """H (n,), 1/length; NaN on junctions, boundaries, cables and supports, and where sheets touch: no single
    sheet has a curvature there.

    With ∇A the area gradient (15a) and ∇V = ⅓ Σ A_T ν_T the volume gradient of the vertex:

    - ``"cotangent"``: |∇A| / (2 A_b) with A_b = ⅓ Σ A_T, the Laplace-Beltrami value of Meyer et al.
      (2002) with the barycentric area, as in the paper's Figs. 8-24. At an exactly stationary vertex
      it is H̄ |Σ A_T ν_T| / Σ A_T ≤ H̄: it sees that the star is not flat.
    - ``"variational"``: ⟨∇A, ∇V⟩ / (2 ⟨∇V, ∇V⟩), exactly H̄ at a stationary vertex.

    At a node of curved elements the part of ∇V = ∫ N_i ν dA along the node's normal replaces A_b and ∇V.
    Where it nearly vanishes, as at the corners of elements of order 2, the value is NaN.

    >>> from pcmc import Patch, Surface
    >>> pyramid = Surface([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]],
    ...     [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4, [Patch("roof", 1.0)], fixed=range(4))
    >>> mean_curvature(pyramid).round(6).tolist()
    [nan, nan, nan, nan, 0.75]
    >>> mean_curvature(pyramid, "variational").round(6).tolist()
    [nan, nan, nan, nan, 1.06066]
    """
    expect_surface(surface)
    validate.choice("method", method, METHODS)
    return _mean_curvatures(surface)[METHODS.index(method)].copy()


@kept_with_owner
def _mean_curvatures(surface: Surface) -> tuple[Floats, Floats]:
    """H (n,) by each of ``METHODS``."""
    area_gradient = weighted(surface, np.ones(len(surface.patches)))[1]
    area_vector, star_area = vertex_area_vectors(surface.vertices, surface.faces, surface.topology.faces)
    if surface.order > 1:
        normal = normal_vectors(surface, vertex_classes(surface), surface.vertices)
        symmetric_part(surface.on_planes, normal)
        normal /= np.where(normal.any(axis=1), np.linalg.norm(normal, axis=1), 1.0)[:, None]
        share = 3.0 * np.einsum("ij,ij->i", weighted(surface, 0.0, -1.0)[1], normal)
        share[np.abs(share) < NO_SHARE * star_area] = np.nan
        area_vector, star_area = share[:, None] * normal, np.abs(share)
    symmetric_part(surface.on_planes, area_gradient)
    area_vector = symmetric_part(surface.on_planes, area_vector)
    along = np.einsum("ij,ij->i", area_gradient, area_vector)
    with np.errstate(divide="ignore", invalid="ignore"):
        cotangent = np.copysign(np.linalg.norm(area_gradient, axis=1), along) / (2.0 * star_area / 3.0)
        variational = 1.5 * along / np.einsum("ij,ij->i", area_vector, area_vector)
    outside = ~_within_one_sheet(surface)
    cotangent[outside] = variational[outside] = np.nan
    return read_only(surface.spread(cotangent)), read_only(surface.spread(variational))


def target_curvature(surface: Surface) -> Floats:
    """H̄ (n,) of the sheet each vertex lies in; NaN where ``mean_curvature`` is.

    H̄ = p / (2 α), p net of snow, and with a weight H̄ = (p - w ⟨ν, n⟩) / (2 (α + w z)) at the vertex's
    height z over Π and its normal ν. A mesh at rest has the latter up to the square of its edge length.

    >>> from pcmc import Patch
    >>> angle = 2 * np.pi * np.arange(6) / 6
    >>> corners = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> fan = [[k, (k + 1) % 6, 6] for k in range(6)]
    >>> roof = Surface([*corners, [0, 0, 0.3]], fan, [0] * 6, [Patch("roof", 2.0, 1.0)], fixed=range(6))
    >>> float(target_curvature(roof)[6])
    0.25
    """
    expect_surface(surface)
    return _target_and_scale(surface)[0]


def _target_and_scale(surface: Surface) -> tuple[Floats, Floats]:
    """H̄ (n,), and what errors of H are relative to: H̄ itself, or (|p| + |w|) / (2 |α + w z|)."""
    patch = np.zeros(surface.n, dtype=np.int64)
    patch[surface.faces] = surface.patch_of_face[:, None]
    target = np.array([p.target_curvature for p in surface.patches])[patch]
    scale, weight, press = target, surface.weights[patch], surface.net_pressures[patch]
    if (heavy := weight != 0.0).any():
        vector = vertex_area_vectors(surface.vertices, surface.faces, surface.topology.faces)[0]
        vector = surface.spread(vector)
        length = np.linalg.norm(vector, axis=1)
        upright = (vector @ np.array(surface.plane.normal)) / np.where(length > 0.0, length, 1.0)
        pull = surface.tensions[patch] + weight * surface.plane.height(surface.vertices)
        twice = 2.0 * np.where(pull == 0.0, np.nan, pull)
        target = np.where(heavy, (press - weight * upright) / twice, target)
        scale = np.where(heavy, (np.abs(press) + np.abs(weight)) / np.abs(twice), target)
    target[~_within_one_sheet(surface)] = np.nan
    return target, scale


def curvature_error(surface: Surface, method: Method = "cotangent") -> Floats:
    """(H - H̄) / H̄ (n,) at the interior vertices of patches under pressure, NaN elsewhere.

    Relative, with sign: 0.01 is one percent too curved. Walls, whose target is zero, have no
    relative error; ``mean_curvature`` itself is their error. With a weight the error is relative to
    (|p| + |w|) / (2 |α + w z|), as H̄ itself may vanish somewhere.

    >>> from pcmc import Patch, solve
    >>> angle = 2 * np.pi * np.arange(6) / 6
    >>> corners = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> fan = [[k, (k + 1) % 6, 6] for k in range(6)]
    >>> roof = Surface([*corners, [0, 0, 0.3]], fan, [0] * 6, [Patch("roof", 2.0, 1.0)], fixed=range(6))
    >>> bool(abs(curvature_error(solve(roof).surface, "variational")[6]) < 1e-9)  # at rest
    True
    """
    H, (target, scale) = mean_curvature(surface, method), _target_and_scale(surface)
    return np.divide(H - target, scale, out=np.full(surface.n, np.nan), where=scale != 0.0)


def _within_one_sheet(surface: Surface) -> Bools:
    """(n,) vertices off boundaries, junctions, cables and supports, and where sheets do not just touch.

    The boundary in a mirror plane is none. Any other support takes what the sheet pulls there, such as the
    plane of an upright wall or a mast inside.
    """
    topo = surface.topology
    inside = ~surface.supported
    inside[topo.edges[topo.curve_edge & ~surface.mirror_edge]] = False
    inside[surface.cable_edges.ends] = False
    return surface.spread(inside & (topo.fans == 1))
