"""How good the triangles are: one number each, 1 for equilateral, 0 for degenerate."""

from __future__ import annotations

import numpy as np

from .arrays import Floats
from .surface import Surface


def triangle_quality(X: Floats, F: Floats) -> Floats:
    """q = 4√3 area / Σ edge² (m,), 1 for an equilateral triangle, 0 for a degenerate one.

    >>> triangle_quality(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2]])).round(6)
    array([0.866025])
    """
    sides = X[F[:, [1, 2, 0]]] - X[F]
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return 4.0 * np.sqrt(3.0) * area / np.einsum("fij,fij->f", sides, sides)


def minimum_angle(surface: Surface) -> float:
    """The smallest angle of any triangle, degrees."""
    X, F = surface.vertices, surface.faces
    a, b = X[F[:, [1, 2, 0]]] - X[F], X[F[:, [2, 0, 1]]] - X[F]
    cosine = np.einsum("fij,fij->fi", a, b)
    sine = np.linalg.norm(np.cross(a, b), axis=2)
    return float(np.degrees(np.arctan2(sine, cosine)).min())


def edge_lengths(surface: Surface) -> Floats:
    """(e,) length of each edge, in the order of ``surface.topology.edges``."""
    start, end = surface.topology.edges.T
    return np.linalg.norm(surface.vertices[end] - surface.vertices[start], axis=1)
