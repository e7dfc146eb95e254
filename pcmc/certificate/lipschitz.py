"""How fast the second variation changes with the shape: bounds of third derivatives, triangle by triangle.

Unknowns c of one triangle move its corners by d_i = Σ c_ir b_ir. With the edges e_i, the area vector
m = (x_1 - x_0) × (x_2 - x_0), ν = m/|m|, P = 1 - ν νᵀ and A = |m|/2,

    Dm[d] = -Σ d_i × e_i,     D²m[d,d] = 2 Σ_{i<j} d_i × d_j (cyclic),     D³m = 0
    D²A[d,d]   = ½ (|P Dm|²/|m| + ⟨ν, D²m⟩)
    D³A[d,d,d] = (3/2) (⟨P Dm, D²m⟩/|m| - |P Dm|² ⟨ν, Dm⟩/|m|²)

from D ν = P Dm/|m|. With |Dm| ≤ Q |c|, |⟨ν, Dm⟩| ≤ M |c|, |D²m| ≤ W |c|² and |m| ≥ μ,

    |D²A| ≤ ½ (Q²/μ + W),    |D³A| ≤ (3/2) (Q W/μ + Q² M/μ²).

Here Q² = Σ |b_ir × e_i|², M² = Σ ⟨ν, b_ir × e_i⟩² (Cauchy-Schwarz), and W² = 2 Σ |b × b'|² over pairs of
vectors at different corners (a quadratic form is at most the Frobenius norm of its matrix). For unit normals
b ≈ ν both M and W are small: a sheet bends, it hardly stretches. For any b, |D²m| ≤ √3 |d|², as
2|Σ d_i × d_j| is four times the area of a triangle with the corners d_i, largest for an equilateral one.
While the corners move by at most R, an edge changes by 2R at most, m by ε = 2R (|e_1| + |e_2|) + 4R², and ν
by 2ε/|m|; μ = |m| - ε.

Further parts of E, by the product rule where z̄ is the mean height, |Dz̄[d]| ≤ |d|/√3:

    pressure:  |D³V| = |det(d_0, d_1, d_2)| ≤ |c|³/√27
    weight:    |D³(z̄A)| ≤ |z̄| |D³A| + √3 |D²A|
    cable:     |D³ℓ| = 3 |P δ|² |⟨t, δ⟩|/ℓ² ≤ 6 M/ℓ²,   δ = d_1 - d_0,  |δ|² ≤ 2|c|²,  M² = Σ ⟨t, b_ir⟩²

The norm of a symmetric trilinear form is that of its cubic form (Banach), so with these numbers L_T

    |⟨x, (A(s) - A(s')) x⟩| ≤ Σ_T L_T |s_T - s'_T| |x_T|² ≤ |s - s'| max_v (Σ_{T ∋ v} L_T) |x|².
"""

from __future__ import annotations

from math import inf, sqrt

import numpy as np

from ..base.arrays import Floats
from ..base.compiled import compiled
from ..forces.motion_space import MotionSpace
from ..surface.geometry import add, cross, dot, norm, point, scaled, sub, vector
from .balls import SAFE
from .enclosures import MeshArrays

ROUNDING = 1.0 + 1e-9  # on bounds of positive terms: far more than the rounding of some hundred operations
BLUR = 1e-13  # of the coordinates: far more than the rounding of differences of them and their products


@compiled
def lipschitz(items: MeshArrays, space: MotionSpace, R: float, more: float) -> tuple[float, Floats, float]:
    """L while vertices move by at most R and pressures by ``more``; (n,) bounds of |∂∇E_v/∂d|; a height.

    The second is for motions in all directions, the third the least height of a triangle, length. L is
    infinite where a triangle may lose its area.
    """
    F, n = items.faces, vector(items.normal)
    dimension = np.append(space.dimension, np.zeros(len(items.X), np.int64))
    third, second, height = np.zeros(len(items.X)), np.zeros(len(items.X)), inf
    for f in range(len(F)):
        a, b, c = point(items.X, F[f, 0]), point(items.X, F[f, 1]), point(items.X, F[f, 2])
        far = norm(sub(a, vector(items.origin))) + norm(sub(b, a)) + norm(sub(c, a)) + 4.0 * R
        alpha, w, p = abs(items.tension[f]), abs(items.weight[f]), abs(items.pressure[f]) + more
        of_third, of_second = p / sqrt(27.0), p * far / 3.0
        if alpha > 0.0 or w > 0.0:
            edge = (sub(c, b), sub(a, c), sub(b, a))
            size = (norm(edge[0]), norm(edge[1]), norm(edge[2]))
            m = cross(edge[1], edge[2])
            length = norm(m)
            r = R + BLUR * (abs(a[0]) + abs(a[1]) + abs(a[2]) + far)
            change = 2.0 * r * (size[1] + size[2]) + 4.0 * r * r
            mu = length - change
            if not mu > 0.5 * length:
                return inf, second, 0.0
            height = min(height, length / max(size[0], max(size[1], size[2])))
            nu, turn = scaled(1.0 / length, m), 2.0 * change / length + BLUR
            Q2, M2, W2 = 0.0, 0.0, 0.0
            for i in range(3):
                v, w_ = F[f, i], F[f, (i + 1) % 3]
                for k in range(dimension[v]):
                    u = vector(space.basis[v, k])
                    swept = cross(u, edge[i])
                    reach = norm(swept) + 2.0 * r
                    Q2 += reach * reach
                    M2 += (abs(dot(nu, swept)) + turn * reach + 2.0 * r) ** 2
                    for l in range(dimension[w_]):
                        W2 += 2.0 * (norm(cross(u, vector(space.basis[w_, l]))) + BLUR) ** 2
            Q, M, W = sqrt(Q2), sqrt(M2), min(sqrt(W2), sqrt(3.0) * ROUNDING)
            tension = alpha
            if w > 0.0:
                mean = dot(sub(scaled(1.0 / 3.0, add(add(a, b), c)), vector(items.point)), n)
                tension += w * (abs(mean) + r)
            bent = 0.5 * (Q2 / mu + W)
            of_third += tension * 1.5 * (Q * W / mu + Q2 * M / mu**2) + w * sqrt(3.0) * bent
            square = size[0] ** 2 + size[1] ** 2 + size[2] ** 2 + 12.0 * r * (sum(size) + 3.0 * r)
            of_second += tension * 0.5 * (square / mu + sqrt(3.0)) + w * sqrt(square / 3.0)
        for i in range(3):
            third[F[f, i]] += of_third
            second[F[f, i]] += of_second
    for e in range(len(items.ends)):
        i, j = items.ends[e, 0], items.ends[e, 1]
        side = sub(point(items.X, j), point(items.X, i))
        length = norm(side)
        r = R + BLUR * (norm(point(items.X, i)) + length)
        if not length > 4.0 * r:
            return inf, second, 0.0
        t, M2 = scaled(1.0 / length, side), 0.0
        for v in (i, j):
            for k in range(dimension[v]):
                M2 += (abs(dot(t, vector(space.basis[v, k]))) + 4.0 * r / length) ** 2
        for v in (i, j):
            third[v] += items.pull[e] * 6.0 * sqrt(M2) / (length - 2.0 * r) ** 2
            second[v] += items.pull[e] * 2.0 / (length - 2.0 * r)
    return third.max() * ROUNDING, second * ROUNDING, height * (2.0 - SAFE)
