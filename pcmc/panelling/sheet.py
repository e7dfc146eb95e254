"""A connected part of one patch, with its own numbers of vertices and triangles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..surface import Surface
from ..surface.geometry import area_vectors, vertex_sums
from ..surface.topology import POINT, EdgeCurve, Topology, components, topology

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
        return np.asarray(total / np.linalg.norm(total, axis=1)[:, None])

    @property
    def inner_sides(self) -> tuple[Ints, Ints]:
        """The two sides of each inner edge: 3 f + the corner of triangle f opposite."""
        sides = self.topology.edge_of_face.ravel()
        inner = np.flatnonzero(self.topology.valence[sides] == 2)
        pairs = inner[np.argsort(sides[inner], kind="stable")].reshape(-1, 2)
        return pairs[:, 0], pairs[:, 1]

    def boundary(self) -> tuple[tuple[EdgeCurve, ...], Bools]:
        """The boundary's curves between its corners, and the corners (n,)."""
        topo = self.topology
        rim = np.flatnonzero(topo.boundary_edge[topo.edge_of_face.ravel()])
        start, end = self.F[rim // 3, (rim % 3 + 1) % 3], self.F[rim // 3, (rim % 3 + 2) % 3]
        along = self.X[end] - self.X[start]
        along /= np.linalg.norm(along, axis=1)[:, None]
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
    inner = np.flatnonzero(topo.valence[topo.edge_of_face.ravel()] == 2)
    one, other = inner[np.argsort(topo.edge_of_face.ravel()[inner], kind="stable")].reshape(-1, 2).T // 3
    same = surface.patch_of_face[one] == surface.patch_of_face[other]
    part = components(np.stack([one[same], other[same]], axis=1), surface.m)
    for number in range(int(part.max(initial=-1)) + 1):
        faces = np.flatnonzero(part == number)
        patch = int(surface.patch_of_face[faces[0]])
        if surface.roof[patch]:
            vertex, F = np.unique(surface.faces[faces], return_inverse=True)
            point = topo.vertex_kind[vertex] == POINT
            sheet = SheetMesh(surface.vertices[vertex], F.reshape(-1, 3).astype(np.int64), vertex, point)
            found.append((patch, faces, sheet))
    return found
