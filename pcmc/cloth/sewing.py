"""A cut mesh as cloth: its strips in order, laid flat, sewn, and the seams between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..base.arrays import Floats, Ints, cached_array
from ..forces.triangles import effective_tensions
from ..surface import Surface
from ..surface.geometry import face_areas
from ..surface.supports import mirror_edges
from .cut_mesh import ON, CutMesh
from .flattening import flattened
from .layout import ClothSheet, sheet_axes
from .settings import CuttingOptions
from .strips import Seam, Side

KINDS = ("seam", "junction", "mirror", "rim")  # in the order of their numbers


class StripSides(NamedTuple):
    """The sides of triangles along cuts, sorted by edge."""

    edge: Ints  # (b,) of the mesh
    ends: Ints  # (b,2) vertices of pieces, first the lower one in the mesh
    forward: Ints  # (b,) whether the triangle runs along it so
    strip: Ints  # (b,)


@dataclass(frozen=True, eq=False)
class Cloth:
    """A cut mesh with its strips in order."""

    surface: Surface
    mesh: CutMesh
    strip_of_face: Ints  # (m,) from 0
    sheet: Ints  # (k,) of each strip, -1 for none
    along: Sequence[Floats | None]  # (k) the direction (3,) of each strip's warp, None for its longer side

    @classmethod
    def of(
        cls, surface: Surface, mesh: CutMesh, sheets: Sequence[ClothSheet], options: CuttingOptions
    ) -> Cloth:
        """Strips in the order of their patches, then of their places across the sheet."""
        piece = mesh.pieces.piece
        count = int(piece.max()) + 1
        first = np.zeros(count, dtype=np.int64)
        first[piece[::-1]] = np.arange(len(piece))[::-1]
        centre = mesh.X[mesh.F].mean(axis=1)
        middle = np.stack([np.bincount(piece, c) / np.bincount(piece) for c in centre.T], axis=1)
        sheet, place = np.full(count, -1), middle[:, 0].copy()
        for s, one in enumerate(sheets):
            mine = one.source[mesh.source[first]]
            sheet[mine], place[mine] = s, middle[mine] @ one.across
        order = np.lexsort((place.round(9), sheet, surface.patch_of_face[mesh.source[first]]))
        rank = np.empty(count, dtype=np.int64)
        rank[order] = np.arange(count)
        along: list[Floats | None] = [sheets[s].along if s >= 0 else None for s in sheet[order].tolist()]
        for k in np.flatnonzero(sheet[order] < 0).tolist():  # beside drawn seams
            name = surface.patches[surface.patch_of_face[mesh.source[first[order[k]]]]].name
            if (degrees := options.of_patch("direction", name)) is not None:
                along[k] = sheet_axes(mesh.X[mesh.F[piece == order[k]]], surface.plane, degrees)[0]
        return cls(surface, mesh, rank[piece], sheet[order], along)

    @cached_array
    def strip_of_vertex(self) -> Ints:
        """(u,) the strip of each vertex of a piece."""
        strip = np.empty(len(self.mesh.pieces.vertex), dtype=np.int64)
        strip[self.mesh.pieces.faces] = self.strip_of_face[:, None]
        return strip

    @cached_array
    def X(self) -> Floats:
        """(u,3) places of the vertices of pieces on the roof."""
        return self.mesh.X[self.mesh.pieces.vertex]

    @cached_array
    def local(self) -> Ints:
        """(u,) the number of each vertex of a piece in its strip."""
        order = np.argsort(self.strip_of_vertex, kind="stable")
        count = np.bincount(self.strip_of_vertex)
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order)) - np.repeat(np.cumsum(count) - count, count)
        return place

    @cached_property
    def names(self) -> list[str]:
        """(k) of the patch of each strip."""
        patch = np.empty(len(self.sheet), dtype=np.int64)
        patch[self.strip_of_face] = self.surface.patch_of_face[self.mesh.source]
        return [self.surface.patches[p].name for p in patch]

    @cached_array
    def tensions(self) -> Floats:
        """(k,) the mean tension of each strip, force/length."""
        s, source = self.surface, self.mesh.source
        pulls = effective_tensions(s, s.vertices, s.faces, s.patch_of_face)[source]
        area = face_areas(self.mesh.X[self.mesh.F])
        return np.bincount(self.strip_of_face, area * pulls) / np.bincount(self.strip_of_face, area)

    @cached_property
    def sides(self) -> StripSides:
        """The sides of triangles along cuts and rims."""
        edge = self.mesh.topology.edge_of_face.ravel()
        chosen = np.flatnonzero(self.mesh.cut_edge[edge])
        chosen = chosen[np.argsort(edge[chosen], kind="stable")]
        start, end = (3 * (chosen // 3) + (chosen % 3 + step) % 3 for step in (1, 2))
        corner, own = self.mesh.F.ravel(), self.mesh.pieces.faces.ravel()
        forward = corner[start] < corner[end]
        low, high = np.where(forward, start, end), np.where(forward, end, start)
        ends = np.stack([own[low], own[high]], axis=1)
        return StripSides(edge[chosen], ends, forward, self.strip_of_face[chosen // 3])

    @cached_array
    def seam_of_edge(self) -> Ints:
        """(e,) the number of the seam on each edge of the mesh, -1 for rims, junctions and edges within."""
        seam = np.full(len(self.mesh.topology.edges), -1)
        seam[self.mesh.topology.edge_numbers(self.mesh.cuts)] = self.mesh.seam
        return seam

    @cached_array
    def mirror_of_edge(self) -> Ints:
        """(e,) the mirror plane that each edge of the mesh is in, to be sewn to its image, from 1; else 0."""
        found, X, near = np.zeros(len(self.mesh.topology.edges), dtype=int), self.mesh.X, ON * self.mesh.size
        for number, (plane, _) in enumerate(self.surface.on_planes, 1):
            found[mirror_edges([(plane, abs(plane.height(X)) <= near)], self.mesh.topology)] = number
        return found

    def outlines(self, strip: int) -> list[Ints]:
        """The outlines of a strip: its vertices in the order of its triangles, the longest first."""
        mine, found = self.sides.strip == strip, []
        ends, forward = self.local[self.sides.ends[mine]], self.sides.forward[mine, None]
        after = dict(np.where(forward, ends, ends[:, ::-1]).tolist())
        while after:
            loop = [next(iter(after))]
            while (following := after.pop(loop[-1])) != loop[0]:
                loop.append(following)
            found.append(np.array(loop))
        return sorted(found, key=len, reverse=True)

    def laid_flat(self) -> Floats:
        """(u,2) each strip alone, with its warp along x."""
        F, alone = self.mesh.pieces.faces, np.empty((2, 0, 2), dtype=np.int64)
        flat = flattened(self.X, F, self.strip_of_vertex, alone, np.ones((len(self.X), 2)))[0]
        points, angles = flat.copy(), np.radians(np.arange(0.0, 180.0, 0.5))
        for k, along in enumerate(self.along):
            mine, faces = self.strip_of_vertex == k, F[self.strip_of_face == k]
            if along is None:  # the direction across which it is narrowest
                c, s = np.cos(angles), np.sin(angles)
                narrow = np.ptp(flat[mine] @ np.stack([-s, c]), axis=0).argmin()
                c, s = c[narrow], s[narrow]
            else:
                P, Q = self.X[faces], flat[faces]
                edges, flat_edges = P[:, 1:] - P[:, :1], Q[:, 1:] - Q[:, :1]
                # along = share · edges, and a part normal to the triangle
                share = np.linalg.solve(edges @ edges.transpose(0, 2, 1), (edges @ along)[:, :, None])
                warp = (face_areas(P)[:, None] * (share * flat_edges).sum(axis=1)).sum(axis=0)
                c, s = warp / (np.linalg.norm(warp) or 1.0)
            points[mine] = flat[mine] @ np.array([[c, -s], [s, c]])
        return points

    def sewn(self, points: Floats, stretch: Sequence[tuple[float, float]]) -> tuple[Floats, Floats]:
        """The strips with sides of seams that are equally long once they are cut; see ``flattened``."""
        sides = self.sides
        first = np.searchsorted(sides.edge, sides.edge)  # the side that all others at an edge are sewn to
        others = np.flatnonzero(first != np.arange(len(first)))
        seams = sides.ends[np.stack([first[others], others])]
        by_vertex = np.array(stretch)[self.strip_of_vertex]
        return flattened(self.X, self.mesh.pieces.faces, self.strip_of_vertex, seams, by_vertex, points)


def seams_of(cloth: Cloth) -> list[Seam]:
    """Cut edges joined to seams: those with the same strips beside them, drawn as one line."""
    topo, sides = cloth.mesh.topology, cloth.sides
    start = np.flatnonzero(np.append(True, np.diff(sides.edge) > 0))
    keys: dict[tuple[Any, ...], list[int]] = {}
    for edge, strips in zip(sides.edge[start].tolist(), np.split(sides.strip, start[1:]), strict=True):
        key = tuple(sorted(strips.tolist())), int(cloth.seam_of_edge[edge]), int(cloth.mirror_of_edge[edge])
        keys.setdefault(key, []).append(edge)
    seams: list[Seam] = []
    for (beside, number, mirror), edges in keys.items():
        mask = np.zeros(len(topo.edges), dtype=bool)
        mask[edges] = True
        alone = "mirror" if mirror else "rim"
        kind = alone if len(beside) == 1 else "seam" if number >= 0 else "junction"
        for curve in topo.curves_among(mask):
            at = np.searchsorted(sides.edge, topo.edge_numbers(curve.pairs))[:, None] + np.arange(len(beside))
            onward = (curve.pairs[:, 0] < curve.pairs[:, 1])[:, None]
            strip, left = sides.strip[at], sides.forward[at] == onward
            ends = cloth.local[np.where(onward[..., None], sides.ends[at], sides.ends[at, ::-1])]
            order = (2 * strip + left).argsort(axis=1)  # the same sides in each column
            strip, left = (np.take_along_axis(values, order, axis=1)[0].tolist() for values in (strip, left))
            ends = np.take_along_axis(ends, order[..., None], axis=1).transpose(1, 0, 2)
            both = [Side(k + 1, rows, forward) for k, rows, forward in zip(strip, ends, left, strict=True)]
            vertices = np.append(curve.pairs[:, 0], curve.pairs[-1, 1])
            seams.append(Seam(0, kind, cloth.mesh.X[vertices], both))
    seams.sort(key=lambda s: (KINDS.index(s.kind), [side.strip for side in s.sides]))
    return [replace(seam, number=k) for k, seam in enumerate(seams, 1)]
