"""What sheets pull a line with, and the tension or thrust along the line that balances it without bending.

Sheets of the tensions α pull a line with q = Σ α n per length, n the co-normals from the line into them. So q
is across the line. A line that does not bend carries it by a force N along its tangent t,

    (N t)' + q = N' t + N κ n + q = 0,     so     N' = 0   and   q = -N κ n,   n here the principal normal:

N is the same all along, and q grows with the curvature. A wall of one tension α_w balances q = α_w, so that
a member in its place does not bend exactly if the line is an arc of a circle in the wall's plane, N = ±α_w r.
A line of another shape needs the pull |N| κ(s), which no wall of one tension has, and no wall at all where
the line curves to the other side. A cable of the tension N in the place of the wall finds a shape of its own.
"""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats
from ..surface.geometry import area_vectors, edge_vectors, unit_vectors


def in_planes(P: Floats) -> Floats:
    """(e,3,3) I - ν ν of triangles (e,3,3), ν their normals: a tension of 1 in each of their directions.

    >>> (in_planes(np.array([[[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]])) + 0.0).tolist()
    [[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]]
    """
    normal = unit_vectors(area_vectors(P))
    return np.eye(3) - normal[:, :, None] * normal[:, None]


def corner_forces(P: Floats, tensors: Floats) -> Floats:
    """(e,3,3) the forces of membranes on the corners of their triangles P (e,3,3), from the tensors σ t
    (e,3,3), force per length: -σ t ½ ν × e, with e the side opposite the corner and ν the normal.

    >>> P = np.array([[[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]])
    >>> (corner_forces(P, np.diag([3.0, 0, 0])[None]) + 0.0).tolist()
    [[[3.0, 0.0, 0.0], [-3.0, 0.0, 0.0], [0.0, 0.0, 0.0]]]
    """
    normal = unit_vectors(area_vectors(P))
    return -0.5 * np.einsum("eij,ekj->eki", tensors, np.cross(normal[:, None], edge_vectors(P)))


def turns(P: Floats, closed: bool) -> Floats:
    """(k,3) at each point of a polyline (k,3) the direction of the next edge less that of the one before; at
    ends that of the one edge, outward turned."""
    t = unit_vectors((np.roll(P, -1, axis=0) if closed else P[1:]) - (P if closed else P[:-1]))
    if closed:
        return t - np.roll(t, 1, axis=0)
    return np.vstack([t[:1], np.diff(t, axis=0), -t[-1:]])


def balancing_force(P: Floats, pulls: Floats, closed: bool) -> tuple[float, float]:
    """The force N along a polyline (k,3) that balances the pulls (k,3) at its points best, tension above 0;
    and the share of the pulls that it leaves, 0 for a line that does not bend.

    N minimises Σ |f + N Δt|² over the points between the ends; the share is the root of that over Σ |f|².

    >>> arch = np.array([[-1.0, 0, 0], [0, 0, 1], [1, 0, 0]])
    >>> N, share = balancing_force(arch, np.array([[0.0, 0, 0], [0, 0, 2**0.5], [0, 0, 0]]), closed=False)
    >>> round(N, 6), round(share, 6)
    (1.0, 0.0)
    """
    inner = slice(None) if closed else slice(1, -1)
    turn, f = turns(P, closed)[inner], pulls[inner]
    if not (f.any() and turn.any()):
        return 0.0, float(f.any())
    N = -float((f * turn).sum() / (turn * turn).sum())
    return N, float(np.linalg.norm(f + N * turn) / np.linalg.norm(f))
