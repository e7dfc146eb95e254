"""A connected part of one patch, with its own numbers of vertices and triangles; its principal directions and
umbilics.

On a sheet of constant mean curvature the traceless part of the shape operator is a holomorphic quadratic
differential. Its square root is the gradient of coordinates whose level lines are lines of
curvature; its zeros are the umbilics, each of index -1/2 or a multiple of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array, eye_array

from ..base.arrays import Bools, Floats, Ints
from ..surface import Surface
from ..surface.geometry import area_vectors, unit_vectors, vertex_sums
from ..surface.topology import POINT, EdgeCurve, Topology, components, topology

LEAST_POINTS = 18  # around a vertex, to fit the nine coefficients of a cubic
RANK = 1e-10  # smaller singular values, as shares of the largest, are none: regular grids have too few places
MOST_RINGS = 4  # of neighbours that are taken together
KINK = np.cos(np.radians(35.0))  # a boundary that turns by more has a corner


@dataclass(frozen=True, eq=False)
class SheetMesh:
    """A connected part of one patch, oriented, with its own numbers of vertices."""

    X: Floats  # (n,3)
    F: Ints  # (m,3)
    vertex: Ints  # (n,) their numbers in the surface
    point: Bools  # (n,) where curves of the surface end or meet

    @cached_property
    def topology(self) -> Topology:
        """Edges of the sheet."""
        return topology(self.F, np.zeros(len(self.F), dtype=np.int64), len(self.X))

    @cached_property
    def normals(self) -> Floats:
        """(n,3) unit normals at the vertices."""
        total = vertex_sums(area_vectors(self.X[self.F]), self.F, len(self.X))
        return unit_vectors(total)

    def boundary(self) -> tuple[tuple[EdgeCurve, ...], Bools]:
        """The boundary's curves between its corners, and the corners (n,)."""
        topo = self.topology
        rim = np.flatnonzero(topo.boundary_edge[topo.edge_of_face.ravel()])
        start, end = self.F[rim // 3, (rim % 3 + 1) % 3], self.F[rim // 3, (rim % 3 + 2) % 3]
        along = unit_vectors(self.X[end] - self.X[start])
        leaving, arriving = np.zeros_like(self.X), np.zeros_like(self.X)
        leaving[start], arriving[end] = along, along
        on_rim = np.zeros(len(self.X), dtype=bool)
        on_rim[start] = True
        corner = on_rim & (self.point | (np.einsum("ij,ij->i", leaving, arriving) < KINK))
        return topo.chains(np.stack([start, end], axis=1), corner), corner


def sheets_of(surface: Surface) -> list[tuple[int, Ints, SheetMesh]]:
    """The connected parts of the patches that are no walls: patch, triangles in the surface, sheet."""
    topo = surface.topology
    found: list[tuple[int, Ints, SheetMesh]] = []
    beside = topo.neighbours // 3
    same = np.ptp(surface.patch_of_face[beside].astype(np.int64), axis=1) == 0
    part = components(beside[same], surface.m)
    for number in range(int(part.max(initial=-1)) + 1):
        faces = np.flatnonzero(part == number)
        patch = int(surface.patch_of_face[faces[0]])
        if surface.roof[patch]:
            vertex, F = np.unique(surface.faces[faces], return_inverse=True)
            point = topo.vertex_kind[vertex] == POINT
            sheet = SheetMesh(surface.vertices[vertex], F.reshape(-1, 3).astype(np.int64), vertex, point)
            found.append((patch, faces, sheet))
    return found


class Directions(NamedTuple):
    """The principal directions of each triangle, as complex numbers in its frame.

    ``w`` = (κ₁ - κ₂)/2 e^{2iφ}, with φ the angle of the direction of κ₁ from the first vector of the frame.
    """

    frame: Floats  # (m,2,3) orthonormal vectors in each triangle's plane, counter-clockwise from outside
    w: Floats  # (m,) complex, 1/length
    tensors: Floats  # (n,3,3) shape operators at the vertices, 1/length


def principal_directions(X: Floats, F: Ints) -> Directions:
    """The principal directions of a sheet's triangles F (m,3), from cubics fitted around vertices X (n,3).

    On a cylinder of radius 2, κ₁ - κ₂ is 1/2 and the directions are those of the axis and around it.

    >>> angle, height = (g.ravel() for g in np.meshgrid(np.linspace(0, 0.5, 6), np.linspace(0, 1, 6)))
    >>> X = np.column_stack([2 * np.cos(angle), 2 * np.sin(angle), height])
    >>> sides = [[k, k + 1, k + 6, k + 7] for k in range(29) if k % 6 < 5]
    >>> F = np.array(sides)[:, [[0, 1, 2], [1, 3, 2]]].reshape(-1, 3)
    >>> np.abs(2 * principal_directions(X, F).w).round(1).max().item()
    0.5
    """
    tensors = shape_operators(X, F)
    P = X[F]
    first = unit_vectors(P[:, 1] - P[:, 0])
    frame = np.stack([first, np.cross(unit_vectors(area_vectors(P)), first)], axis=1)
    T = np.einsum("fai,fij,fbj->fab", frame, tensors[F].mean(axis=1), frame)
    return Directions(frame, 0.5 * (T[:, 0, 0] - T[:, 1, 1]) + 1j * T[:, 0, 1], tensors)


def shape_operators(X: Floats, F: Ints) -> Floats:
    """(n,3,3) symmetric: the curvature II(a, b) = aᵀTb of tangent vectors at each vertex, 1/length.

    Positive where the sheet bends away from its outside. From a cubic over the tangent plane, fitted to the
    vertices of two rings, or of more where they are few; of order 2 in the edge length.
    """
    n = len(X)
    pairs = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    rows, columns = np.concatenate([pairs, pairs[:, ::-1]]).T
    near = csr_array(coo_array((np.ones(len(rows)), (rows, columns)), shape=(n, n))) + eye_array(n)
    rings = csr_array(near @ near)
    for _ in range(MOST_RINGS - 2):
        few = np.diff(rings.indptr) <= LEAST_POINTS
        if few.any():
            pick = csr_array((few.astype(float), (np.arange(n), np.arange(n))), shape=(n, n))
            rings = csr_array(rings + pick @ rings @ near)
    normal = unit_vectors(vertex_sums(area_vectors(X[F]), F, n))
    tensors = np.empty((n, 3, 3))
    for count in np.unique(np.diff(rings.indptr)):  # those with as many neighbours at once
        at = np.flatnonzero(np.diff(rings.indptr) == count)
        around = rings.indices[rings.indptr[at, None] + np.arange(count)]
        tensors[at] = _fitted(X[around] - X[at, None], normal[at])
    return tensors


def _fitted(d: Floats, N: Floats) -> Floats:
    """(k,3,3) shape operators at vertices with normals N (k,3), from the ways d (k,c,3) to neighbours."""
    k = np.abs(N).argmin(axis=1)
    e = unit_vectors(np.eye(3)[k] - np.take_along_axis(N, k[:, None], axis=1) * N)
    frame = np.stack([e, np.cross(N, e), N], axis=1)
    reach = np.linalg.norm(d, axis=2).max(axis=1)
    x, y, z = np.einsum("kci,kai->akc", d, frame) / reach[:, None]
    terms = [x, y, 0.5 * x * x, x * y, 0.5 * y * y, x**3, x * x * y, x * y * y, y**3]
    A = np.stack(terms[: 9 if d.shape[1] > 12 else 5], axis=2)
    c = np.einsum("ktc,kc->tk", np.linalg.pinv(A, RANK), z)
    D = np.linalg.pinv(frame[:, :2] + c[:2].T[:, :, None] * N[:, None])  # of tangents
    second = (c[[[2, 3], [3, 4]]] / (reach * np.sqrt(1.0 + c[0] ** 2 + c[1] ** 2))).transpose(2, 0, 1)
    return np.asarray(-D @ second @ D.swapaxes(1, 2))
