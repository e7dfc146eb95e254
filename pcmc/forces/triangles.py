"""The force of a triangle under tension α, pressure p and weight w: value and gradient; its Hessian block.

A triangle has corners a, b, c (counter-clockwise seen from its positive side), the edges opposite them
e_a = c - b, e_b = a - c, e_c = b - a, the area A, the unit normal ν = (b - a) × (c - a) / 2A and the mean
height z̄ of its corners over Π, whose normal is n. Seen from the reference point of volumes,

    A           ∂A/∂a = g_a = ½ ν × e_a          (15a)
    V           ∂V/∂a = (b × c) / 6              (15b, with the sign that makes (10b) positive)
    ∫z dA = A z̄     ∂/∂a = z̄ g_a + A n/3

    ∂²E/∂i∂j  =  s ν νᵀ + k 1 + [q]× + u nᵀ + n vᵀ,   T = α + w z̄

with s = T (e_i·e_j) / (4A); q = ∓½ T ν ± p x_k / 6 (upper signs where j follows i, k the third corner; 0 for
i = j); u = w g_i / 3 and v = w g_j / 3. The *stiffness* has only k = T₊ (e_i·e_j) / (4A), with
T₊ = α + max(w z̄, 0). ``second_variation`` has the loops of both.

A sheet of weight w acts like one of tension α + w z, pushed by w n per area: at rest
H = (p - w ⟨ν, n⟩) / (2 (α + w z)). Where α + w z ≤ 0 it is under compression. A triangle without area has no
normal and no area gradient. Every loop releases the interpreter, so that blocks of triangles run on several
threads. Where a patch has a weight, the sums and the gradient are those of ``curved``, of order 1.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.compiled import blocks, compiled, run_blocks
from ..surface import Surface
from ..surface.geometry import accumulate, cross, dot, norm, point, scaled, sub, vector
from .curved import measure_elements
from .elements import Mesh


@compiled
def measure_block(
    mesh: Mesh, X: Floats, first: int, last: int, area: Floats, volume: Floats, gradient: Floats
) -> None:
    """Add the areas, volumes and ∇(αA - pV) of triangles first..last to (k,), (k,) and gradient (n,3).

    A gradient of no rows is left out.
    """
    F, patch, origin = mesh.faces, mesh.patch, vector(mesh.origin)
    current = patch[first]
    alpha, sixth_p = mesh.tension[current], mesh.pressure[current] / 6.0
    area_sum, volume_sum = 0.0, 0.0
    for f in range(first, last):
        if patch[f] != current:
            area[current] += area_sum
            volume[current] += volume_sum / 6.0
            area_sum, volume_sum = 0.0, 0.0
            current = patch[f]
            alpha, sixth_p = mesh.tension[current], mesh.pressure[current] / 6.0
        i, j, k = F[f, 0], F[f, 1], F[f, 2]
        a, b, c = sub(point(X, i), origin), sub(point(X, j), origin), sub(point(X, k), origin)
        e_c, minus_e_b = sub(b, a), sub(c, a)
        normal = cross(e_c, minus_e_b)
        twice_area = norm(normal)
        area_sum += 0.5 * twice_area
        b_cross_c = cross(b, c)
        volume_sum += dot(a, b_cross_c)
        if len(gradient) == 0:
            continue
        half_alpha_nu = scaled(0.5 * alpha / twice_area if twice_area > 0.0 else 0.0, normal)
        e_a = sub(minus_e_b, e_c)
        accumulate(gradient, i, sub(cross(half_alpha_nu, e_a), scaled(sixth_p, b_cross_c)))
        accumulate(gradient, j, sub(cross(minus_e_b, half_alpha_nu), scaled(sixth_p, cross(c, a))))
        accumulate(gradient, k, sub(cross(half_alpha_nu, e_c), scaled(sixth_p, cross(a, b))))
    area[current] += area_sum
    volume[current] += volume_sum / 6.0


def totals_and_gradient(
    mesh: Mesh, X: Floats, workers: int | None = None, sums_alone: bool = False
) -> tuple[Floats, Floats]:
    """A, V and ∫ z dA (3,k) of the k patches, and the gradient (n,3) of Σ αA - pV + w ∫ z dA, in one pass.

    ∫ z dA of flat triangles is 0 where nothing has a weight. Each block sums into arrays of its own, added in
    order: the same number of workers gives the same bytes, and a mesh under two BLOCKs the same bytes on
    every machine.
    """
    parts = len(blocks(len(mesh.faces), workers))
    plain = not (mesh.curved or mesh.weight.any())
    sums = np.zeros((parts, 3, len(mesh.tension)))
    gradient = [np.zeros((0, 3) if sums_alone else X.shape) for _ in range(parts)]

    def work(part: int, first: int, last: int) -> None:
        area, volume, moment = sums[part]
        if plain:
            measure_block(mesh, X, first, last, area, volume, gradient[part])
        else:
            measure_elements(mesh, X, first, last, area, volume, moment, gradient[part])

    run_blocks(work, len(mesh.faces), workers)
    for other in gradient[1:]:
        gradient[0] += other
    return sums.sum(axis=0), gradient[0]


def effective_tensions(surface: Surface, X: Floats, faces: Ints, patch: Ints) -> Floats:
    """(m,) α + w z̄ of triangles (m,3) at X (n,3), force/length; below 0 under compression."""
    tension = surface.tensions[patch]
    if not surface.weights.any():
        return np.asarray(tension)
    return np.asarray(tension + surface.weights[patch] * surface.plane.height(X)[faces].mean(axis=1))


def heavy_triangle_pulls(surface: Surface) -> Floats:
    """(m,) α + w z̄ of the triangles with a weight, force/length; infinite for others. ≤ 0 is compression."""
    pull = effective_tensions(surface, surface.vertices, surface.faces, surface.patch_of_face)
    return np.where(surface.weights[surface.patch_of_face] != 0.0, pull, np.inf)
