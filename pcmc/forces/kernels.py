"""The compiled loops over triangles for areas, volumes and the energy's gradient. Arrays only.

A triangle has corners a, b, c (counter-clockwise seen from its positive side), the edges opposite them
e_a = c - b, e_b = a - c, e_c = b - a, the area A and the unit normal ν = (b - a) × (c - a) / 2A. Then

    ∂A/∂a = ½ ν × e_a      (15a)
    ∂V/∂a = (b × c) / 6    (15b, with the sign that makes (10b) positive)

Every loop releases the interpreter, so blocks of triangles run on several threads (``blocks``).
A triangle whose area is zero has no normal and contributes no area gradient.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base.arrays import Floats, Ints, read_only
from ..base.compiled import blocks, compiled, run_blocks, threads
from ..surface import Surface
from ..surface.geometry import accumulate, cross, dot, norm, point, scaled, sub, vector


class Mesh(NamedTuple):
    """Faces with the weights of their energy, as one argument of compiled loops; positions are another.

    Attributes
    ----------
    faces, patch : (m,3) and (m,) int: corners, and the patch of each triangle.
    origin : (3,) the reference point that volumes are seen from.
    tension, pressure, weight : (k,) α, p and w of each patch.
    ground, normal : (3,) a point of Π and its normal: weights act along it.
    """

    faces: Ints
    patch: Ints
    origin: Floats
    tension: Floats
    pressure: Floats
    weight: Floats
    ground: Floats
    normal: Floats


def energy_mesh(surface: Surface, tension: Floats | None = None, pressure: Floats | None = None) -> Mesh:
    """All triangles of a surface, with its own tensions and pressures (k,) or with others."""
    tension = surface.tensions if tension is None else read_only(tension)
    pressure = surface.net_pressures if pressure is None else read_only(pressure)
    plane = np.array(surface.plane.point), np.array(surface.plane.normal)
    return Mesh(
        surface.faces, surface.patch_of_face, surface.origin, tension, pressure, surface.weights, *plane
    )


@compiled
def measure_block(
    mesh: Mesh, X: Floats, first: int, last: int, area: Floats, volume: Floats, gradient: Floats
) -> None:
    """Add the areas, volumes and ∇E of triangles first..last to area (k,), volume (k,), gradient (n,3)."""
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
        half_alpha_nu = scaled(0.5 * alpha / twice_area if twice_area > 0.0 else 0.0, normal)
        e_a = sub(minus_e_b, e_c)
        accumulate(gradient, i, sub(cross(half_alpha_nu, e_a), scaled(sixth_p, b_cross_c)))
        accumulate(gradient, j, sub(cross(minus_e_b, half_alpha_nu), scaled(sixth_p, cross(c, a))))
        accumulate(gradient, k, sub(cross(half_alpha_nu, e_c), scaled(sixth_p, cross(a, b))))
    area[current] += area_sum
    volume[current] += volume_sum / 6.0


@compiled
def _measure_areas(mesh: Mesh, X: Floats, first: int, last: int, area: Floats, volume: Floats) -> None:
    """The areas and volumes alone, for line searches that need no gradient."""
    F, patch, origin = mesh.faces, mesh.patch, vector(mesh.origin)
    for f in range(first, last):
        i, j, k = F[f, 0], F[f, 1], F[f, 2]
        a, b, c = sub(point(X, i), origin), sub(point(X, j), origin), sub(point(X, k), origin)
        area[patch[f]] += 0.5 * norm(cross(sub(b, a), sub(c, a)))
        volume[patch[f]] += dot(a, cross(b, c)) / 6.0


def measure(mesh: Mesh, X: Floats, workers: int | None = None) -> tuple[Floats, Floats, Floats]:
    """Areas (k,), volumes (k,) of the k patches and the gradient (n,3) of Σ αA - pV in one pass.

    Each block sums into arrays of its own, added in order: the same number of workers gives the
    same bytes, and a mesh under two BLOCKs the same bytes on every machine.
    """
    parts = len(blocks(len(mesh.faces), workers or threads()))
    area, volume = np.zeros((2, parts, len(mesh.tension)))
    gradient = np.zeros((parts, *X.shape))

    def work(part: int, first: int, last: int) -> None:
        measure_block(mesh, X, first, last, area[part], volume[part], gradient[part])

    run_blocks(work, len(mesh.faces), workers)
    for part in range(1, parts):
        gradient[0] += gradient[part]
    return area.sum(axis=0), volume.sum(axis=0), gradient[0]


def areas_and_volumes(mesh: Mesh, X: Floats, workers: int | None = None) -> tuple[Floats, Floats]:
    """Areas (k,) and signed volumes (k,), seen from the mesh's origin, of the k patches."""
    parts = len(blocks(len(mesh.faces), workers or threads()))
    area, volume = np.zeros((2, parts, len(mesh.tension)))

    def work(part: int, first: int, last: int) -> None:
        _measure_areas(mesh, X, first, last, area[part], volume[part])

    run_blocks(work, len(mesh.faces), workers)
    return area.sum(axis=0), volume.sum(axis=0)
