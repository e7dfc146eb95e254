"""The compiled loops over triangles: areas, volumes, energy gradient, Hessian. Arrays only.

A triangle has corners a, b, c (counter-clockwise seen from its positive side), the edges opposite them
e_a = c - b, e_b = a - c, e_c = b - a, the area A and the unit normal ν = (b - a) × (c - a) / 2A. Then

    ∂A/∂a  = ½ ν × e_a                                    (15a)
    ∂²A/∂i∂j = (e_i·e_j)/(4A) ν νᵀ  ± ½ [ν]×              (+ for j two corners after i, - for one)
    ∂V/∂a  = (b × c) / 6                                  (15b, with the sign that makes (10b) positive)
    ∂²V/∂a∂b = -[c]× / 6

Every loop releases the interpreter, so blocks of triangles run on several threads (``blocks``).
A triangle whose area is zero has no normal and contributes no area gradient.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.compiled import blocks, compiled, run_blocks, threads


@compiled
def measure_block(X, F, patch, origin, tension, pressure, first, last, area, volume, G):
    """Add the areas, volumes and E-gradient of triangles first..last to area, volume and G."""
    ox, oy, oz = origin[0], origin[1], origin[2]
    current = patch[first]
    alpha, sixth_p = tension[current], pressure[current] / 6.0
    area_sum, volume_sum = 0.0, 0.0
    for f in range(first, last):
        if patch[f] != current:
            area[current] += area_sum
            volume[current] += volume_sum / 6.0
            area_sum, volume_sum = 0.0, 0.0
            current = patch[f]
            alpha, sixth_p = tension[current], pressure[current] / 6.0
        i, j, k = F[f, 0], F[f, 1], F[f, 2]
        ax, ay, az = X[i, 0] - ox, X[i, 1] - oy, X[i, 2] - oz
        bx, by, bz = X[j, 0] - ox, X[j, 1] - oy, X[j, 2] - oz
        cx, cy, cz = X[k, 0] - ox, X[k, 1] - oy, X[k, 2] - oz
        ux, uy, uz = bx - ax, by - ay, bz - az
        wx, wy, wz = cx - ax, cy - ay, cz - az
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        twice = sqrt(nx * nx + ny * ny + nz * nz)
        area_sum += 0.5 * twice
        px, py, pz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        volume_sum += ax * px + ay * py + az * pz
        s = 0.5 * alpha / twice if twice > 0.0 else 0.0
        nx, ny, nz = s * nx, s * ny, s * nz
        ex, ey, ez = wx - ux, wy - uy, wz - uz
        G[i, 0] += ny * ez - nz * ey - sixth_p * px
        G[i, 1] += nz * ex - nx * ez - sixth_p * py
        G[i, 2] += nx * ey - ny * ex - sixth_p * pz
        # e_b = -w and e_c = u
        G[j, 0] += nz * wy - ny * wz - sixth_p * (cy * az - cz * ay)
        G[j, 1] += nx * wz - nz * wx - sixth_p * (cz * ax - cx * az)
        G[j, 2] += ny * wx - nx * wy - sixth_p * (cx * ay - cy * ax)
        G[k, 0] += ny * uz - nz * uy - sixth_p * (ay * bz - az * by)
        G[k, 1] += nz * ux - nx * uz - sixth_p * (az * bx - ax * bz)
        G[k, 2] += nx * uy - ny * ux - sixth_p * (ax * by - ay * bx)
    area[current] += area_sum
    volume[current] += volume_sum / 6.0


@compiled
def _sum_areas(X, F, patch, origin, first, last, area, volume):
    """The areas and volumes alone, for line searches that need no gradient."""
    ox, oy, oz = origin[0], origin[1], origin[2]
    for f in range(first, last):
        i, j, k = F[f, 0], F[f, 1], F[f, 2]
        ax, ay, az = X[i, 0] - ox, X[i, 1] - oy, X[i, 2] - oz
        bx, by, bz = X[j, 0] - ox, X[j, 1] - oy, X[j, 2] - oz
        cx, cy, cz = X[k, 0] - ox, X[k, 1] - oy, X[k, 2] - oz
        ux, uy, uz = bx - ax, by - ay, bz - az
        wx, wy, wz = cx - ax, cy - ay, cz - az
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        area[patch[f]] += 0.5 * sqrt(nx * nx + ny * ny + nz * nz)
        px, py, pz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        volume[patch[f]] += (ax * px + ay * py + az * pz) / 6.0


@compiled
def hessian_blocks(X, F, patch, origin, tension, pressure, blocks):
    """Fill blocks (m,3,3,3,3): entry (f,i,j) is the 3×3 block ∂²(αA - pV)/∂x_i∂x_j of triangle f."""
    e = np.empty((3, 3))
    x = np.empty((3, 3))
    for f in range(len(F)):
        for i in range(3):
            for d in range(3):
                x[i, d] = X[F[f, i], d] - origin[d]
        for i in range(3):
            for d in range(3):
                e[i, d] = x[(i + 2) % 3, d] - x[(i + 1) % 3, d]
        n = np.cross(e[1], e[2])
        twice = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        alpha, p = tension[patch[f]], pressure[patch[f]]
        for i in range(3):
            for j in range(3):
                g = e[i, 0] * e[j, 0] + e[i, 1] * e[j, 1] + e[i, 2] * e[j, 2]
                for r in range(3):
                    for c in range(3):
                        stiff = 0.5 * alpha * g * n[r] * n[c] / twice**3 if twice > 0.0 else 0.0
                        blocks[f, i, j, r, c] = stiff
            _add_cross(blocks[f, i, (i + 1) % 3], n, -0.5 * alpha / twice if twice > 0.0 else 0.0)
            _add_cross(blocks[f, i, (i + 2) % 3], n, 0.5 * alpha / twice if twice > 0.0 else 0.0)
            _add_cross(blocks[f, i, (i + 1) % 3], x[(i + 2) % 3], p / 6.0)
            _add_cross(blocks[f, i, (i + 2) % 3], x[(i + 1) % 3], -p / 6.0)


@compiled
def _add_cross(block, v, scale):
    """block += scale [v]×, the matrix of v × ·."""
    block[0, 1] -= scale * v[2]
    block[0, 2] += scale * v[1]
    block[1, 0] += scale * v[2]
    block[1, 2] -= scale * v[0]
    block[2, 0] -= scale * v[1]
    block[2, 1] += scale * v[0]


def measure(
    X: Floats,
    F: Ints,
    patch: Ints,
    origin: Floats,
    tension: Floats,
    pressure: Floats,
    workers: int | None = None,
) -> tuple[Floats, Floats, Floats]:
    """Areas (k,), volumes (k,) of the k patches and the gradient (n,3) of Σ αA - pV in one pass.

    Each block sums into arrays of its own, added in order: the same number of workers gives the
    same bytes, and a mesh under two BLOCKs the same bytes on every machine.
    """
    parts = len(blocks(len(F), workers or threads()))
    area, volume = np.zeros((parts, len(tension))), np.zeros((parts, len(tension)))
    gradient = np.zeros((parts, *X.shape))

    def work(part: int, first: int, last: int) -> None:
        measure_block(
            X, F, patch, origin, tension, pressure, first, last,
            area[part], volume[part], gradient[part],
        )  # fmt: skip

    run_blocks(work, len(F), workers)
    for part in range(1, parts):
        gradient[0] += gradient[part]
    return area.sum(axis=0), volume.sum(axis=0), gradient[0]


def areas_and_volumes(
    X: Floats, F: Ints, patch: Ints, origin: Floats, patch_count: int, workers: int | None = None
) -> tuple[Floats, Floats]:
    """Areas (k,) and signed volumes (k,), seen from ``origin``, of the k patches."""
    parts = len(blocks(len(F), workers or threads()))
    area, volume = np.zeros((parts, patch_count)), np.zeros((parts, patch_count))

    def work(part: int, first: int, last: int) -> None:
        _sum_areas(X, F, patch, origin, first, last, area[part], volume[part])

    run_blocks(work, len(F), workers)
    return area.sum(axis=0), volume.sum(axis=0)
