"""Triangles: the one place where their edges, area vectors, areas and volumes are written down."""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..base.compiled import compiled


@compiled
def area_vectors(X, F):
    """Σ A_T ν_T (n,3) and Σ A_T (n,) over the triangles around each vertex."""
    vector, area = np.zeros(X.shape), np.zeros(len(X))
    for f in range(len(F)):
        i, j, k = F[f, 0], F[f, 1], F[f, 2]
        ux, uy, uz = X[j, 0] - X[i, 0], X[j, 1] - X[i, 1], X[j, 2] - X[i, 2]
        wx, wy, wz = X[k, 0] - X[i, 0], X[k, 1] - X[i, 1], X[k, 2] - X[i, 2]
        nx = 0.5 * (uy * wz - uz * wy)
        ny = 0.5 * (uz * wx - ux * wz)
        nz = 0.5 * (ux * wy - uy * wx)
        a = sqrt(nx * nx + ny * ny + nz * nz)
        for c in range(3):
            v = F[f, c]
            vector[v, 0] += nx
            vector[v, 1] += ny
            vector[v, 2] += nz
            area[v] += a
    return vector, area
