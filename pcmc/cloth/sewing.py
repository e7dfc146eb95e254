"""A cut mesh as cloth: strips in order, laid flat with the least strain, with seams of equally long sides."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.sparse import csr_array, vstack
from scipy.sparse.linalg import splu
from scipy.spatial import ConvexHull

from ..base.arrays import Bools, Floats, Ints, block_rows, cached_array, mask_of
from ..base.tolerances import ON
from ..forces.triangles import effective_tensions
from ..surface import Surface
from ..surface.geometry import area_vectors, edge_vectors, face_areas, segment_lengths, unit_vectors
from ..surface.supports import mirror_edges
from .cut_mesh import ClothSheet, CutMesh, sheet_axes
from .settings import CuttingOptions
from .strips import Seam, Side

KINDS = ("seam", "junction", "mirror", "rim")  # in the order of their numbers
SEAM_WEIGHT = 1e3  # of a seam's misfit beside the strain: squared, so that seams are equal to about 1e-9
ROUNDS, SMALL_STEP = 50, 1e-10  # of the descent; a last step, in the size, and a strain that is none
FOLDED = 1e6  # the strain of a triangle laid on its back
NARROWER, ASKEW = 0.02, 0.1  # of a strip's width, for a warp square to x; sine of the angle to x that is best
SHORTEST = 1e-4  # part of a step that is still tried


class StripSides(NamedTuple):
    """The sides of triangles along cuts, sorted by edge."""

    edge: Ints  # (b,) of the mesh
    ends: Ints  # (b,2) vertices of pieces, first the lower one in the mesh
    forward: Bools  # (b,) whether the triangle runs along it so
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
        source = mesh.source[np.unique(piece, return_index=True)[1]]  # a face of each piece
        middle, sheet = mesh.middles, np.full(len(source), -1)
        place = middle[:, 0].copy()
        for s, one in enumerate(sheets):
            mine = one.source[source]
            sheet[mine], place[mine] = s, middle[mine] @ one.across
        x, y = ((values / mesh.size).round(6) for values in (place, middle[:, 1]))
        order = np.lexsort((y, x, sheet, surface.patch_of_face[source]))
        along: list[Floats | None] = [sheets[s].along if s >= 0 else None for s in sheet[order].tolist()]
        for k in np.flatnonzero(sheet[order] < 0).tolist():  # beside drawn seams
            name = surface.patches[surface.patch_of_face[source[order[k]]]].name
            if (degrees := options.of_patch("direction", name)) is not None:
                along[k] = sheet_axes(mesh.X[mesh.F[piece == order[k]]], surface.plane, degrees)[0]
        return cls(surface, mesh, np.argsort(order)[piece], sheet[order], along)

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
        return pd.Series(self.strip_of_vertex).groupby(self.strip_of_vertex).cumcount().to_numpy()

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
        edge = self.mesh.topology.edge_of_face.ravel()
        chosen = np.flatnonzero(self.mesh.cut_edge[edge])
        chosen = chosen[np.argsort(edge[chosen], kind="stable")]
        sides = 3 * (chosen // 3)[:, None] + (chosen[:, None] + [1, 2]) % 3
        forward = np.diff(self.mesh.F.ravel()[sides], axis=1)[:, 0] > 0
        ends = self.mesh.pieces.faces.ravel()[np.where(forward[:, None], sides, sides[:, ::-1])]
        return StripSides(edge[chosen], ends, forward, self.strip_of_face[chosen // 3])

    @cached_array
    def seam_of_edge(self) -> Ints:
        """(e,) the number of the seam on each edge of the mesh, -1 for rims, junctions and edges within."""
        seam = np.full(len(self.mesh.topology.edges), -1)
        seam[self.mesh.topology.edge_numbers(self.mesh.cuts)] = self.mesh.seam
        return seam

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
        points = flat.copy()
        for k, along in enumerate(self.along):
            mine, faces = self.strip_of_vertex == k, F[self.strip_of_face == k]
            edges, flat_edges = (at[faces][:, 1:] - at[faces][:, :1] for at in (self.X, flat))
            # along = share · edges, and a part normal to the triangle; by default x of the plan
            direction = self.surface.plane.axes[0] if along is None else along
            share = np.linalg.solve(edges @ edges.transpose(0, 2, 1), (edges @ direction)[:, :, None])
            warp = face_areas(self.X[faces]) @ (share * flat_edges).sum(axis=1)
            c, s = warp / (np.linalg.norm(warp) or 1.0)
            if along is None:  # the side of its hull across which it is narrowest
                hull = flat[mine][ConvexHull(flat[mine]).vertices]
                sides = unit_vectors(np.roll(hull, -1, axis=0) - hull)
                widths = np.ptp(hull @ np.stack([-sides[:, 1], sides[:, 0]]), axis=0)
                # of about equal ones that nearest to x, of those at 45 degrees the one before 90
                off_x = sides @ (np.array([-s, c]) - ASKEW * np.array([c, s]))
                c, s = sides[(widths * (1.0 + NARROWER * off_x**2)).argmin()]
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
    mesh, topo, sides = cloth.mesh, cloth.mesh.topology, cloth.sides
    mirrors = np.zeros(len(topo.edges), dtype=int)  # that each edge is in, to be sewn to its image, from 1
    for k, (plane, _) in enumerate(cloth.surface.on_planes, 1):
        mirrors[mirror_edges([(plane, abs(plane.height(mesh.X)) <= ON * mesh.size)], topo)] = k
    start = np.flatnonzero(np.append(True, np.diff(sides.edge) > 0))
    keys = defaultdict[tuple[Any, ...], list[int]](list)
    for edge, strips in zip(sides.edge[start].tolist(), np.split(sides.strip, start[1:]), strict=True):
        keys[tuple(sorted(strips.tolist())), cloth.seam_of_edge[edge], mirrors[edge]].append(edge)
    seams: list[Seam] = []
    for (beside, number, mirror), edges in keys.items():
        alone = "mirror" if mirror else "rim"
        kind = alone if len(beside) == 1 else "seam" if number >= 0 else "junction"
        for curve in topo.curves_among(mask_of(edges, len(topo.edges))):
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


def flattened(
    X: Floats, F: Ints, strip: Ints, seams: Ints, stretch: Floats, start: Floats | None = None
) -> tuple[Floats, Floats]:
    """Strips F (m,3) with vertices X (u,3) laid flat: points (u,2), as they are before compensation; and the
    least and largest principal strain of the cloth in each triangle on the roof (m,2).

    With J the map from a triangle of the roof to the flat one, E = ½ (JᵀJ - I) and the cut lengths l of the
    sides of a seam, which is L long on the roof, the sum Σ A |E|² + W² Σ L² ((l₁² - l₂²) / 2L²)² is least:
    Gauss-Newton steps from a conformal map. So strips in which a strain cannot be avoided share it, and the
    sides of a seam are equally long whatever the strips beside them.

    Parameters
    ----------
    strip : (u,) the strip of each vertex.
    seams : (2,s,2) edges; those of one half are sewn to those of the other.
    stretch : (u,2) cut length over flat length along x, the warp, and along y, for each vertex.
    start : (u,2) points to begin with; one point of each strip and a direction stay as they are.

    >>> X = np.array([[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0.0]])
    >>> F, none = np.array([[0, 1, 2], [0, 2, 3]]), np.empty((2, 0, 2), dtype=int)
    >>> flat, strain = flattened(X, F, np.zeros(4, dtype=int), none, np.ones((4, 2)))
    >>> flat.round(9).tolist(), bool(abs(strain).max() < 1e-9)
    ([[0.0, 0.0], [1.8, -2.4], [5.0, 0.0], [3.2, 2.4]], True)
    """
    pins, places = _pins(X, strip)
    gradient, root, lengths = _gradients(X[F]), np.sqrt(face_areas(X[F])), segment_lengths(X, seams[0])
    free = ~mask_of(pins, 2 * len(X))
    y = start
    if y is None:  # the map with the least Σ A ((xₛ - yₜ)² + (xₜ + yₛ)²) that takes the pins to their places
        (g, h), w = gradient.transpose(1, 0, 2), root[:, None]
        rows = np.stack([np.stack([w * g, -w * h], axis=2), np.stack([w * h, w * g], axis=2)], axis=2)
        A, flat = block_rows(rows, F, len(X)), np.zeros(2 * len(X))
        flat[pins] = places
        flat[free] = _least_squares(A[:, free], -(A @ flat))
        y = flat.reshape(-1, 2)
    free[pins[2::4]] = True  # the second point may move along x
    about = F, gradient, root, seams, lengths, stretch
    residual, jacobian = _misfit(y, *about)
    size = float(np.ptp(X, axis=0).max())
    for _ in range(ROUNDS):
        step = np.zeros(len(free))
        step[free] = _least_squares(jacobian[:, free], -residual)
        part, before = 1.0, float(residual @ residual)
        while True:
            moved = y + part * step.reshape(-1, 2)
            residual, jacobian = _misfit(moved, *about)
            if residual @ residual <= before or part < SHORTEST:
                break
            part *= 0.5
        y = moved
        if np.abs(part * step).max() <= SMALL_STEP * size:
            break
    J = _jacobians(y, F, gradient)
    sigma = np.linalg.svd(J)[1]
    sigma[np.linalg.det(J) <= 0.0, 1] = 1.0 / (1.0 + FOLDED)  # laid on its back
    strain = 1.0 / sigma - 1.0
    strain[np.abs(strain) <= SMALL_STEP] = 0.0
    return y, strain


def _least_squares(J: csr_array, right: Floats) -> Floats:
    """The x with the least |J x - right|."""
    factor = splu((J.T @ J).tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    return np.asarray(factor.solve(J.T @ right))


def _pins(X: Floats, strip: Ints) -> tuple[Ints, Floats]:
    """(4 k,) for each strip the places in a vector 2 u of x, y, x, y of two far points; their values."""
    pins, places = list[int](), list[float]()
    for mine in (np.flatnonzero(strip == k) for k in np.unique(strip)):
        away = np.linalg.norm(X[mine] - X[mine].mean(axis=0), axis=1)
        first = mine[(away / away.max()).round(6).argmax()]  # of equal ones not that of rounding
        away = np.linalg.norm(X[mine] - X[first], axis=1)
        second = mine[(away / away.max()).round(6).argmax()]
        pins += [2 * end + axis for end in sorted((first, second)) for axis in (0, 1)]
        places += [0.0, 0.0, away.max(), 0.0]
    return np.array(pins), np.array(places)


def _gradients(P: Floats) -> Floats:
    """(m,2,3) the gradient of a linear function in each triangle from its values at the corners."""
    along, normal = edge_vectors(P)[:, 2], area_vectors(P)
    frame = unit_vectors(np.stack([along, np.cross(normal, along)], axis=1))
    turned = np.cross(normal[:, None], edge_vectors(P))
    return frame @ (turned / (2.0 * face_areas(P) ** 2)[:, None, None]).transpose(0, 2, 1)


def _jacobians(y: Floats, F: Ints, gradient: Floats) -> Floats:
    """(m,2,2) the map from each triangle of the roof to the flat one."""
    return np.einsum("mci,mjc->mij", y[F], gradient)


def _misfit(
    y: Floats, F: Ints, gradient: Floats, root: Floats, seams: Ints, lengths: Floats, stretch: Floats
) -> tuple[Floats, csr_array]:
    """The residual whose squares are summed, and its Jacobian: 3 rows by triangle, one by edge of a seam."""
    J = _jacobians(y, F, gradient)
    E = 0.5 * (np.einsum("mki,mkj->mij", J, J) - np.eye(2))
    strain = np.stack([E[:, 0, 0], E[:, 1, 1], np.sqrt(2.0) * E[:, 0, 1]], axis=1) * root[:, None]
    # dE_ij = ½ (dJ_ki J_kj + J_ki dJ_kj), dJ_ki = dy_ck gradient_ic
    half = 0.5 * np.einsum("mic,mkj->mcijk", gradient, J)
    rate = half + half.transpose(0, 1, 3, 2, 4)
    rows = np.stack([rate[:, :, 0, 0], rate[:, :, 1, 1], np.sqrt(2.0) * rate[:, :, 0, 1]], axis=2)
    rows *= root[:, None, None, None]
    cut = stretch[seams[..., 0]] * (y[seams[..., 1]] - y[seams[..., 0]])  # (2,s,2)
    weight = SEAM_WEIGHT / lengths
    squares = 0.5 * (cut * cut).sum(axis=2)
    slopes = weight[:, None] * cut * stretch[seams[..., 0]] * np.array([1.0, -1.0])[:, None, None]
    ends = np.stack([-slopes[0], slopes[0], -slopes[1], slopes[1]], axis=1)[:, :, None]
    sewn = block_rows(ends, np.concatenate([*seams], axis=1), len(y))
    residual = np.append(strain, weight * (squares[0] - squares[1]))
    return residual, vstack([block_rows(rows, F, len(y)), sewn]).tocsr()
