"""The mesh of a roof cut along seams, which are geodesics: drawn lines, and strips across each sheet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints, mask_of
from ..base.errors import OptionError
from ..base.libraries import load_library
from ..base.tolerances import ON
from ..meshing.curve_cutting import cut_triangles, refined_round
from ..meshing.quality import edge_lengths
from ..surface import Surface
from ..surface.geometry import (
    angles,
    area_vectors,
    bounding_size,
    file_origin,
    lengths_along,
    segment_lengths,
)
from ..surface.guides import Plane
from ..surface.pieces import point_text
from ..surface.topology import SIDES, Topology, components, edge_places, joined, topology

SNAP = 0.1  # of an edge: a seam that passes a vertex so near goes through it
BESIDE = 0.3  # of an edge: such a seam crosses no other edge of that vertex so near to it
MOST_TRIANGLES = 50_000  # beyond which triangles are not cut into four
MEET = 0.25  # of a strip's width: ends of seams so near to each other, or to where cuts meet, are one
ANGLES = np.radians([0.0, 90.0, *range(1, 90), *range(91, 180)])  # in which the longer side is sought
NARROWER = 0.98  # of the width square to x or y: another direction must do better


@dataclass(frozen=True, eq=False)
class CutMesh:
    """The sheets of a roof, with the edges that are cut."""

    X: Floats  # (n,3)
    F: Ints  # (m,3)
    source: Ints  # (m,) the face of the surface that each triangle is a part of
    cuts: Ints  # (c,2) edges along which the cloth is cut, each row ascending
    seam: Ints  # (c,) the number of the seam on each, -1 for the curves of the roof

    @cached_property
    def topology(self) -> Topology:
        return topology(self.F, np.zeros(len(self.F), dtype=np.int64), len(self.X))

    @cached_property
    def size(self) -> float:
        """Diagonal of the bounding box, length."""
        return bounding_size(self.X)

    @cached_property
    def cut_edge(self) -> Bools:
        """(e,) the edges of the mesh that are cut or have no triangle on their other side."""
        mask = self.topology.valence != 2
        mask[self.topology.edge_numbers(self.cuts)] = True
        return mask

    @property
    def cuts_at(self) -> Ints:
        """(n,) the number of cut edges at each vertex."""
        return np.bincount(self.topology.edges[self.cut_edge].ravel(), minlength=len(self.X))

    @cached_property
    def pieces(self) -> Pieces:
        """The pieces that it falls into, each with vertices of its own."""
        topo = self.topology
        sides = topo.neighbours[~self.cut_edge[topo.edge_of_face.ravel()[topo.neighbours[:, 0]]]]
        # corners of both triangles at the ends of their side, which the second has in the other order
        ends = 3 * (sides // 3)[:, None] + (sides[:, None] + np.array([[1], [2]])) % 3
        ends[..., 1] = ends[:, ::-1, 1]
        label = components(ends.reshape(-1, 2), 3 * len(self.F))
        vertex = np.empty(label.max() + 1, dtype=np.int64)
        vertex[label] = self.F.ravel()
        return Pieces(label.reshape(-1, 3), vertex, components(sides // 3, len(self.F)))

    @property
    def middles(self) -> Floats:
        """(k,3) the middle of the corners of each piece."""
        frame = pd.DataFrame(self.X[self.F].mean(axis=1)).groupby(self.pieces.piece).mean()
        return frame.to_numpy()

    def with_points(self, ends: Ints, points: Floats) -> CutMesh:
        """The mesh with vertices at points (k,3) on different edges (k,2)."""
        number = len(self.X) + np.arange(len(ends))
        X = np.concatenate([self.X, points])
        # where two sides of a triangle are cut, a line leads from one corner, so that the smallest angle is
        # largest: two points of a seam and a corner may lie on a line
        place = edge_places(self.F[:, SIDES], ends)
        two = np.flatnonzero((place >= 0).sum(axis=1) == 2)
        turn = ((place[two] < 0).argmax(axis=1) + 1) % 3  # after the side that is not cut
        roll = (np.arange(3) + turn[:, None]) % 3
        a, b, _ = np.take_along_axis(self.F[two], roll, axis=1).T
        p, q, _ = number[np.take_along_axis(place[two], roll, axis=1)].T
        pairs = np.array([[(q, a, p), (a, b, p)], [(q, a, b), (q, b, p)]]).swapaxes(2, 3)
        from_a, from_b = angles(X[pairs]).min(axis=(1, 3))
        first = np.zeros(len(self.F), dtype=np.int64)
        first[two] = np.where(from_b > from_a, (turn + 1) % 3, turn)
        F, source = cut_triangles(self.F, self.source, ends, number, first)
        split = edge_places(self.cuts, ends)
        halved = split >= 0
        halves = [np.stack([self.cuts[halved, side], number[split[halved]]], axis=1) for side in (0, 1)]
        cuts, seam = np.concatenate([self.cuts[~halved], *halves]), self.seam
        return CutMesh(X, F, source, cuts, np.concatenate([seam[~halved], seam[halved], seam[halved]]))

    def with_vertex(self, point: Floats, faces: Bools) -> tuple[CutMesh, int]:
        """The mesh with a vertex nearest to a point (3,) on chosen faces (m,), and its number."""
        chosen = np.flatnonzero(faces)
        weights, away = nearest_places(self.X[self.F[chosen]], point)
        f = int(away.argmin())
        corners, at = self.F[chosen[f]], weights[f]
        if at.max() >= 1.0 - SNAP:
            return self, int(corners[at.argmax()])
        if at.min() <= SNAP:
            beside = np.delete(np.arange(3), at.argmin())
            place = at[beside] @ self.X[corners[beside]] / at[beside].sum()
            return self.with_points(corners[None, beside], place[None]), len(self.X)
        thirds = np.tile(corners, (3, 1))
        thirds[np.arange(3), np.arange(3)] = len(self.X)
        F = np.concatenate([np.delete(self.F, chosen[f], axis=0), thirds])
        source = np.append(np.delete(self.source, chosen[f]), np.repeat(self.source[chosen[f]], 3))
        X = np.concatenate([self.X, (at @ self.X[corners])[None]])
        return replace(self, X=X, F=F, source=source), len(self.X)

    def with_seam(self, start: int, end: int, number: int, name: str, faces: Bools) -> CutMesh:
        """The mesh cut along a geodesic between two vertices of one piece; OptionError if there is none.
        Where several pieces have both vertices it is one of those with ``faces`` (m,), if there is any."""
        if start == end:
            return self
        first, last = (np.flatnonzero(np.any(v == self.F, axis=1)) for v in (start, end))
        both = np.intersect1d(self.pieces.piece[first], self.pieces.piece[last])
        if not len(both):
            places = " to ".join(point_text(self.X[vertex]) for vertex in (start, end))
            text = f"{name}: from {places} it crosses another seam, a ridge or a cable"
            text += f"{self._crossed(start, end)}; end it there"
            raise OptionError(text, what="seams", where=number)
        if (wanted := np.isin(both, self.pieces.piece[faces])).any():
            both = both[wanted]
        library, found = load_library("potpourri3d", "cloth"), list[tuple[float, Floats, int]]()
        origin = file_origin(self.X, self.size)  # near it the library's lengths keep their digits
        for piece in both.tolist():
            used, local = np.unique(self.pieces.faces[self.pieces.piece == piece], return_inverse=True)
            vertex = self.pieces.vertex[used]
            solver = library.EdgeFlipGeodesicSolver(self.X[vertex] - origin, local.reshape(-1, 3))
            for ends in product(*(np.flatnonzero(vertex == v).tolist() for v in (start, end))):
                path = np.asarray(solver.find_geodesic_path(*ends)) + origin
                found.append((float(lengths_along(path)[-1]), path, piece))
        _, path, piece = min(found, key=lambda one: one[0])
        edges = self.topology.edges[self.topology.edges_of(self.pieces.piece == piece)]
        reach = 0.5 * segment_lengths(self.X, edges) + ON * self.size
        edges = edges[cKDTree(path).query(self.X[edges].mean(axis=1))[0] <= reach]
        place, share = np.empty((len(path), 2), dtype=np.int64), np.empty(len(path))
        for k, point in enumerate(path):
            weights, away = nearest_places(self.X[edges[:, [0, 1, 1]]], point)
            place[k], share[k] = edges[away.argmin()], 1.0 - weights[away.argmin(), 0]
        return self._along(place, share, path, number, name)

    def _crossed(self, start: int, end: int) -> str:
        """Where a cut comes nearest to the line between two vertices, seen from above; not at its ends."""
        cut, line = self.X[np.unique(self.cuts)] - self.X[start], self.X[end] - self.X[start]
        share = cut @ line / (line @ line)
        cut = cut[np.abs(share - 0.5) < 0.49]
        areas, across = area_vectors(self.X[self.F]), np.cross(cut, line)
        above = areas.sum(axis=0)  # seen in space, a dome's points are equally far
        open_sheet = np.linalg.norm(above) > ON * np.linalg.norm(areas)
        away = np.abs(across @ above) if open_sheet else np.linalg.norm(across, axis=1)
        return f" near {point_text(self.X[start] + cut[away.argmin()])}" if len(cut) else ""

    def _along(self, place: Ints, share: Floats, path: Floats, number: int, name: str) -> CutMesh:
        """The mesh with the points of a path as vertices, and the edges between them cut. An inner vertex
        that the path passes closely is moved onto it, which spares triangles without width."""
        X, fixed = self.X.copy(), self.topology.edges[self.cut_edge]
        nearest = np.where(share > 0.5, place[:, 1], place[:, 0])
        gap = np.minimum(share, 1.0 - share)
        met = np.unique(nearest[gap <= SNAP])  # both ends are among these
        crossed = gap > np.where(np.isin(nearest, met), BESIDE, SNAP)
        for vertex in np.setdiff1d(nearest[~crossed], fixed).tolist():
            parts = np.stack([path[:-1], path[1:], path[1:]], axis=1)
            weights, away = nearest_places(parts, X[vertex])
            X[vertex] = weights[away.argmin()] @ parts[away.argmin()]
        new = pd.factorize(place[crossed] @ np.array([len(X), 1]))[0]  # edges by number, as they come
        first = np.unique(new, return_index=True)[1]
        nodes = nearest.copy()
        nodes[crossed] = len(X) + new
        nodes = nodes[np.append(True, np.diff(nodes) != 0)]
        mesh = replace(self, X=X)
        if len(first):
            mesh = mesh.with_points(place[crossed][first], path[crossed][first])
        pairs = np.sort(np.stack([nodes[:-1], nodes[1:]], axis=1), axis=1)
        numbers = mesh.topology.edge_numbers(pairs)
        if (numbers < 0).any():
            text = f"{name}: the triangles are too coarse for it; refine the mesh, or move the seam"
            raise OptionError(text, what="seams", where=number)
        pairs = pairs[~mesh.cut_edge[numbers]]
        cuts = np.concatenate([mesh.cuts, pairs])
        return replace(mesh, cuts=cuts, seam=np.append(mesh.seam, np.full(len(pairs), number)))


class Pieces(NamedTuple):
    """The pieces of a cut mesh: vertices on a cut are there once for each piece beside it."""

    faces: Ints  # (m,3) the triangles of the mesh, of vertices of pieces
    vertex: Ints  # (u,) the vertex of the mesh that each is
    piece: Ints  # (m,) the piece of each triangle


def cut_mesh(surface: Surface, edge_length: float = np.inf) -> CutMesh:
    """The sheets of a roof without its walls, cut along junctions, seams of patches and cables.

    Triangles are cut into four, rounded like the surface, until half of their edges have the ``edge_length``:
    on coarser ones geodesics keep to the gaps between vertices.

    >>> from pcmc import Patch
    >>> corners = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]
    >>> flat = Surface(corners, [[0, 1, 2], [0, 2, 3]], [0, 1], [Patch("a", 1.0), Patch("b", 1.0)],
    ...                fixed=range(4))
    >>> mesh = cut_mesh(flat)
    >>> mesh.cuts.tolist(), mesh.pieces.piece.tolist()
    ([[0, 2]], [0, 1])
    """
    parents = np.arange(surface.m)
    while np.median(edge_lengths(surface)) > edge_length and surface.m <= MOST_TRIANGLES:
        surface, parents = refined_round(surface), np.repeat(parents, 4)
    topo = surface.topology
    cut = topo.junction_edge | topo.seam_edge | topo.one_way_edge
    for cable in surface.cables:
        cut[topo.edge_numbers(cable.edges)] = True
    roof = np.flatnonzero(surface.roof[surface.patch_of_face])
    cuts = topo.edges[cut & mask_of(topo.edge_of_face[roof], len(cut))].astype(np.int64)
    F = surface.faces[roof].astype(np.int64)
    return CutMesh(surface.vertices, F, parents[roof], cuts, np.full(len(cuts), -1))


def nearest_places(P: Floats, point: Floats) -> tuple[Floats, Floats]:
    """(m,3) barycentric coordinates of the places of triangles P (m,3,d) nearest to a point, (m,) how far.

    >>> P = np.array([[[0, 0, 0], [4, 0, 0], [0, 4, 0.0]]])
    >>> [found.tolist() for found in nearest_places(P, np.array([2.0, -3.0, 0.0]))]
    [[[0.5, 0.5, 0.0]], [3.0]]
    """
    u, v, d = P[:, 1] - P[:, 0], P[:, 2] - P[:, 0], point - P[:, 0]
    uu, uv, vv, du, dv = (np.einsum("ij,ij->i", p, q) for p, q in ((u, u), (u, v), (v, v), (d, u), (d, v)))
    det = np.maximum(uu * vv - uv * uv, 1e-300)
    s, t = (vv * du - uv * dv) / det, (uu * dv - uv * du) / det
    tries = np.zeros((4, len(P), 3))
    tries[3] = np.stack([1.0 - s - t, s, t], axis=1)
    for k in range(3):
        start, end = (k + 1) % 3, (k + 2) % 3
        along = P[:, end] - P[:, start]
        share = ((point - P[:, start]) * along).sum(axis=1) / np.maximum((along * along).sum(axis=1), 1e-300)
        tries[k, :, end] = np.clip(share, 0.0, 1.0)
        tries[k, :, start] = 1.0 - tries[k, :, end]
    away = np.linalg.norm(np.einsum("kmi,mij->kmj", tries, P) - point, axis=2)
    away[3, tries[3].min(axis=1) < 0.0] = np.inf
    best, every = away.argmin(axis=0), np.arange(len(P))
    return tries[best, every], away[best, every]


@dataclass(frozen=True, eq=False)
class ClothSheet:
    """A sheet between curves and cables, cut into strips at equal steps of their width."""

    patch: str
    source: Bools  # (m,) its faces of the surface
    along: Floats  # (3,) unit vector of the warp
    across: Floats  # (3,) unit vector; the seams lie near to levels of x · across
    levels: Floats  # (k,) ascending, with both ends: k - 1 strips, seams between


def sheet_axes(P: Floats, plane: Plane, degrees: float | None) -> tuple[Floats, Floats]:
    """Unit vectors (3,) along and across the strips of triangles P (m,3,3), square to their mean normal.
    Along is the direction with this angle from x in the plan; by default the one across which the sheet is
    narrowest."""
    normal, (east, north, _) = area_vectors(P).sum(axis=0), plane.axes
    normal = normal / (np.linalg.norm(normal) or 1.0)
    if degrees is None:
        first = east if np.linalg.norm(np.cross(east, normal)) > 0.1 else north
        first = first - (first @ normal) * normal
        first /= np.linalg.norm(first)
        second = np.cross(normal, first)
        turned = np.cos(ANGLES)[:, None] * second - np.sin(ANGLES)[:, None] * first
        widths = np.ptp(P.reshape(-1, 3) @ turned.T, axis=0)
        widths[:2] *= NARROWER ** np.array([2, 1])
        across = turned[(widths / widths.max()).round(6).argmin()]  # of equal ones the first
    else:
        across = np.cross(normal, np.cos(np.radians(degrees)) * east + np.sin(np.radians(degrees)) * north)
        if np.linalg.norm(across) < 1e-6:
            text = f"direction: {degrees:g} degrees is square to a sheet of the roof; give another"
            raise OptionError(text, what="direction", found=degrees)
        across /= np.linalg.norm(across)
    return np.cross(across, normal), across


def level_ends(mesh: CutMesh, faces: Bools, height: Floats, level: float) -> Iterator[tuple[Floats, Floats]]:
    """The ends (3,) of each line on which height (n,) has a level on chosen faces (m,), between two cuts."""
    topo = mesh.topology
    sides, above = topo.edge_of_face[faces], (height >= level)[topo.edges]
    hit = (above[:, 0] != above[:, 1])[sides]
    links = sides[hit].reshape(-1, 2).astype(np.int64)  # two sides of each triangle, or none
    nodes = np.where(mesh.cut_edge[links], len(topo.edges) + np.arange(links.size).reshape(-1, 2), links)
    names, at, local = np.unique(nodes, return_index=True, return_inverse=True)
    for chain, closed, _ in joined(local.reshape(-1, 2), np.zeros(len(names), dtype=bool), len(names)):
        if not closed:
            a, b = topo.edges[links.ravel()[at[chain[[0, -1]]]]].T
            share = (level - height[a]) / (height[b] - height[a])
            start, end = mesh.X[a] + share[:, None] * (mesh.X[b] - mesh.X[a])
            yield start, end


def with_levels(mesh: CutMesh, sheets: Sequence[ClothSheet]) -> CutMesh:
    """The mesh cut along geodesics between the ends of each sheet's levels. Ends of several sheets meet, and
    those near a point in which cuts meet end there."""
    number = int(mesh.seam.max(initial=-1)) + 1
    before = np.flatnonzero(np.bincount(mesh.cuts.ravel()) > 2).tolist()  # and the ends in other sheets
    for sheet in sheets:
        meet, height = MEET * float(np.diff(sheet.levels).min()), mesh.X @ sheet.across
        own = [level_ends(mesh, sheet.source[mesh.source], height, level) for level in sheet.levels[1:-1]]
        met = list[int]()
        for line in [line for lines in own for line in lines]:  # a geodesic may cross the next level
            for point in line:
                mine = sheet.source[mesh.source]
                others = np.intersect1d(before, mesh.F[mine]).astype(np.int64)
                away = np.linalg.norm(mesh.X[others] - point, axis=1)
                if away.min(initial=np.inf) <= meet:
                    met.append(int(others[away.argmin()]))
                else:
                    mesh, vertex = mesh.with_vertex(point, mine)
                    met.append(vertex)
            mine = sheet.source[mesh.source]
            mesh = mesh.with_seam(met[-2], met[-1], number, f"a seam of {sheet.patch!r}", mine)
            number += 1
        before += met
    return mesh


def with_lines(mesh: CutMesh, lines: Sequence[Floats], plane: Plane) -> CutMesh:
    """The mesh cut along lines, each of points (k,2) in the plan or (k,3), joined by geodesics. An end within
    an edge's length of a cut or a rim is put there. Of two sheets, one over the other, points of the plan are
    on the upper one. OptionError for a point off the roof."""
    first = int(mesh.seam.max(initial=-1)) + 1
    for number, line in enumerate(lines):
        name, previous = f"seam {number + 1}", -1
        for k, point in enumerate(line):
            weights, f, away = _seen(mesh, point, plane)
            reach = float(segment_lengths(mesh.X, mesh.topology.edges[mesh.topology.edge_of_face[f]]).max())
            if away > reach:
                text = f"{name}: its point {point_text(point)} is off the roof, {away:.3g} from it; move it"
                raise OptionError(text, what="seams", found=point.tolist())
            place = weights @ mesh.X[mesh.F[f]]
            if k in (0, len(line) - 1):
                rim = mesh.X[mesh.topology.edges[mesh.cut_edge][:, [0, 1, 1]]]
                on_rim, gap = nearest_places(rim, place)
                if gap.min() <= reach:
                    place = on_rim[gap.argmin()] @ rim[gap.argmin()]
            mesh, vertex = mesh.with_vertex(place, np.ones(len(mesh.F), dtype=bool))
            if k:
                middle, before = 0.5 * (point + line[k - 1]), mesh
                faces = mesh.pieces.piece == mesh.pieces.piece[_seen(mesh, middle, plane)[1]]
                mesh = mesh.with_seam(previous, vertex, first + number, name, faces)
                above = middle if len(middle) == 2 else plane.to_local(middle)[:2]
                beside_cuts = len(middle) == 3 and len(mesh.cuts) > len(before.cuts)  # may lie in a tube
                if not beside_cuts and _seen(before, above, plane)[2] > SNAP * reach:
                    text = f"{name}: from {point_text(line[k - 1])} to {point_text(point)} it leaves the"
                    text += " roof; end it at the rim, or move it"
                    raise OptionError(text, what="seams", where=number)
                more = mesh.cuts_at[: len(before.X)] > before.cuts_at
                more[[previous, vertex]] = False
                if len(met := np.flatnonzero(more & (before.cuts_at > 0))):
                    text = f"{name}: between its points it meets a rim, a ridge, a cable or another seam at"
                    text += f" {point_text(mesh.X[met[0]])}; end it there, or move it"
                    raise OptionError(text, what="seams", where=number)
            previous = vertex
    return mesh


def _seen(mesh: CutMesh, point: Floats, plane: Plane) -> tuple[Floats, int, float]:
    """(3,) the barycentric coordinates of the place nearest to a point of the plan or of space, its triangle,
    the highest of several, and how far it is."""
    seen = mesh.X if len(point) == 3 else plane.to_local(mesh.X)[:, :2]
    weights, away = nearest_places(seen[mesh.F], point)
    height = (weights * plane.height(mesh.X)[mesh.F]).sum(axis=1)
    f = int(np.where(away <= away.min() + ON * mesh.size, height, -np.inf).argmax())
    return weights[f], f, float(away[f])
