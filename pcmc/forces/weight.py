"""Self-weight: the part Σ w ∫ z dA of E, with z the height over Π, and its gradient.

Over a flat triangle of area A and corners at heights z_a, z_b, z_c the integral is A z̄, z̄ = (z_a+z_b+z_c)/3.
With n the normal of Π and g_i = ∂A/∂i,

    ∂(A z̄)/∂i = z̄ g_i + A n/3

So a sheet of weight w acts like one of tension α + w z, pushed by w n per area: at rest

    H = (p - w ⟨ν, n⟩) / (2 (α + w z))

from δ∫z dA = ∫ (2 H z + ⟨ν, n⟩) φ dA for a displacement φ along the normal ν. Where α + w z ≤ 0 the sheet is
under compression. Nothing is computed where no patch weighs anything.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..base.compiled import compiled
from ..surface import Surface
from ..surface.geometry import accumulate, add, cross, dot, norm, point, scaled, sub, vector


def add_weights(surface: Surface, X: Floats, gradient: Floats | None = None) -> float:
    """Σ w ∫ z dA at X (n,3), force·length; its gradient is added to ``gradient`` (n,3) if that is given.

    >>> from pcmc import Patch
    >>> table = Surface([[0, 0, 2], [1, 0, 2], [0, 1, 2]], [[0, 1, 2]], [0],
    ...                 [Patch("a", 1.0, weight=3.0)], fixed=[0])
    >>> add_weights(table, table.vertices)
    3.0
    """
    if not surface.weights.any():
        return 0.0
    moment = moments(surface, X, surface.weights, gradient)
    return float((surface.weights * moment).sum())


def moments(surface: Surface, X: Floats, weights: Floats, gradient: Floats | None = None) -> Floats:
    """(k,) ∫ z dA of each patch, length³; the gradient of Σ w ∫ z dA is added to ``gradient`` (n,3)."""
    moment = np.zeros(len(surface.patches))
    out = np.empty((0, 3)) if gradient is None else gradient
    _measure(surface.faces, surface.patch_of_face, X, weights, *_plane(surface), moment, out)
    return moment


def effective_tensions(surface: Surface, X: Floats, faces: Ints, patch: Ints) -> Floats:
    """(m,) α + w z̄ of triangles (m,3) at X (n,3), force/length; below 0 under compression."""
    tension = surface.tensions[patch]
    if not surface.weights.any():
        return np.asarray(tension)
    return np.asarray(tension + surface.weights[patch] * surface.plane.height(X)[faces].mean(axis=1))


def compressed(surface: Surface) -> Bools:
    """(m,) triangles with a weight where α + w z̄ ≤ 0."""
    pull = effective_tensions(surface, surface.vertices, surface.faces, surface.patch_of_face)
    return np.asarray((surface.weights[surface.patch_of_face] != 0.0) & (pull <= 0.0))


def _plane(surface: Surface) -> tuple[Floats, Floats]:
    return np.array(surface.plane.point), np.array(surface.plane.normal)


@compiled
def _measure(
    F: Ints, patch: Ints, X: Floats, weight: Floats, at: Floats, normal: Floats, moment: Floats, out: Floats
) -> None:
    origin, n = vector(at), vector(normal)
    for f in range(len(F)):
        a, b, c = point(X, F[f, 0]), point(X, F[f, 1]), point(X, F[f, 2])
        twice = cross(sub(b, a), sub(c, a))
        twice_area = norm(twice)
        mean = dot(sub(scaled(1.0 / 3.0, add(add(a, b), c)), origin), n)
        moment[patch[f]] += 0.5 * twice_area * mean
        w = weight[patch[f]]
        if len(out) == 0 or w == 0.0 or twice_area == 0.0:
            continue
        half_nu = scaled(0.5 * w * mean / twice_area, twice)
        down = scaled(w * twice_area / 6.0, n)
        accumulate(out, F[f, 0], add(cross(half_nu, sub(c, b)), down))
        accumulate(out, F[f, 1], add(cross(half_nu, sub(a, c)), down))
        accumulate(out, F[f, 2], add(cross(half_nu, sub(b, a)), down))
