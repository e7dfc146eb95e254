"""A connected part of one patch, and coordinates u, v of it whose level lines are lines of curvature.

With κ₁ - κ₂ the difference of the principal curvatures and e₁, e₂ their directions,

    ∇u = √((κ₁ - κ₂)/2) e₁,    ∇v = √((κ₁ - κ₂)/2) e₂

are gradients where the mean curvature is constant: u + iv is the integral of the square root of the Hopf
differential, and conformal; its zeros are the umbilics, each of index -1/2 or a multiple of it. u and v are
solved for in the least-squares sense, on the sheet cut open from each umbilic to the boundary. Across a cut
z = u + iv becomes ±z + c. So that lines meet there, c is made whole numbers; umbilics come into the middle of
a cell, which then has six sides; and curves that are lines of curvature, such as ridges over plane walls
(Joachimsthal), become lines of the net.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import block_array, coo_array, csc_array, csr_array, diags_array, eye_array, vstack
from scipy.sparse.csgraph import breadth_first_order
from scipy.sparse.linalg import splu

from ..base.arrays import Bools, Floats, Ints, block_rows, mask_of
from ..base.errors import OptionError
from ..forces.motion_space import perpendicular
from ..surface import Surface
from ..surface.geometry import angles, area_vectors, face_areas, unit_vectors, vertex_sums
from ..surface.topology import POINT, EdgeCurve, Topology, components, one_sided_copies, topology

LEAST_POINTS = 18  # around a vertex, to fit the nine coefficients of a cubic
RANK = 1e-10  # smaller singular values, as shares of the largest, are none: regular grids have too few places
MOST_RINGS = 4  # of neighbours that are taken together
KINK = np.cos(np.radians(35.0))  # a boundary that turns by more has a corner
NUDGE = 1e-6  # of a step: a vertex is at least so far from every line
ALIGNED = np.radians(10.0)  # from a principal direction, on half of a curve that is a line of curvature
ROUND = 0.05  # of the mean curvature: where (κ₁ - κ₂)/2 is smaller on half of a sheet, it is part of a sphere
FLAT = 1e-6  # curvature times size
STRETCHES, SHIFTS = np.linspace(0.8, 1.25, 46), np.arange(0.0, 1.0, 0.025)  # of lines, that are tried
SOFT = 1e-9  # added to the diagonal, as some conditions follow from others and make the matrix singular


@dataclass(frozen=True, eq=False)
class SheetMesh:
    """A connected part of one patch, oriented, with its own numbers of vertices."""

    X: Floats  # (n,3)
    F: Ints  # (m,3)
    vertex: Ints  # (n,) their numbers in the surface
    point: Bools  # (n,) where curves of the surface end or meet

    @cached_property
    def topology(self) -> Topology:
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
        turns = np.einsum("ij,ij->i", leaving, arriving) < KINK
        corner = mask_of(start, len(self.X)) & (self.point | turns)
        return topo.chains(np.stack([start, end], axis=1), corner), corner


def sheets_of(surface: Surface) -> list[tuple[int, Ints, SheetMesh]]:
    """The connected parts of the patches that are no walls: patch, triangles in the surface, sheet."""
    topo, found = surface.topology, list[tuple[int, Ints, SheetMesh]]()
    beside = topo.neighbours // 3
    part = components(beside[np.equal(*surface.patch_of_face[beside].T)], surface.m)
    for faces in (np.flatnonzero(part == number) for number in np.unique(part)):
        patch = int(surface.patch_of_face[faces[0]])
        if surface.roof[patch]:
            vertex, F = np.unique(surface.faces[faces], return_inverse=True)
            point = topo.vertex_kind[vertex] == POINT
            sheet = SheetMesh(surface.vertices[vertex], F.reshape(-1, 3).astype(np.int64), vertex, point)
            found.append((patch, faces, sheet))
    return found


def principal_directions(X: Floats, F: Ints) -> tuple[Floats, Floats, Floats]:
    """Of a sheet's triangles F (m,3) the frames (m,2,3), orthonormal vectors in the plane; the principal
    directions as complex numbers in these, w = (κ₁ - κ₂)/2 e^{2iφ} (m,), φ the angle of that of κ₁ from the
    first vector; and ``shape_operators`` (n,3,3).

    On a cylinder of radius 2, κ₁ - κ₂ is 1/2 and the directions are those of the axis and around it.

    >>> angle, height = (g.ravel() for g in np.meshgrid(np.linspace(0, 0.5, 6), np.linspace(0, 1, 6)))
    >>> X = np.column_stack([2 * np.cos(angle), 2 * np.sin(angle), height])
    >>> sides = [[k, k + 1, k + 6, k + 7] for k in range(29) if k % 6 < 5]
    >>> F = np.array(sides)[:, [[0, 1, 2], [1, 3, 2]]].reshape(-1, 3)
    >>> np.abs(2 * principal_directions(X, F)[1]).round(1).max().item()
    0.5
    """
    tensors = shape_operators(X, F)
    P = X[F]
    first = unit_vectors(P[:, 1] - P[:, 0])
    frame = np.stack([first, np.cross(unit_vectors(area_vectors(P)), first)], axis=1)
    T = np.einsum("fai,fij,fbj->fab", frame, tensors[F].mean(axis=1), frame)
    return frame, 0.5 * (T[:, 0, 0] - T[:, 1, 1]) + 1j * T[:, 0, 1], tensors


def shape_operators(X: Floats, F: Ints) -> Floats:
    """(n,3,3) symmetric: the curvature II(a, b) = aᵀTb of tangent vectors at each vertex, 1/length. Positive
    where the sheet bends away from its outside. From a cubic over the tangent plane, fitted to the vertices
    of two rings, or of more where they are few; of order 2 in the edge length."""
    n, m = len(X), len(F)
    on = csr_array((np.ones(3 * m), F.ravel(), 3 * np.arange(m + 1)), shape=(m, n))
    near = csr_array(on.T @ on)  # a vertex and its neighbours
    rings = csr_array(near @ near)
    for _ in range(MOST_RINGS - 2):
        few = np.diff(rings.indptr) <= LEAST_POINTS
        if few.any():
            pick = csr_array((few.astype(float), (np.arange(n), np.arange(n))), shape=(n, n))
            rings = csr_array(rings + pick @ rings @ near)
    normal = unit_vectors(vertex_sums(area_vectors(X[F]), F, n))
    frame, tensors = np.stack([*perpendicular(normal), normal], axis=1), np.empty((n, 3, 3))
    for count in np.unique(np.diff(rings.indptr)):  # those with as many neighbours at once
        at = np.flatnonzero(np.diff(rings.indptr) == count)
        d = X[rings.indices[rings.indptr[at, None] + np.arange(count)]] - X[at, None]
        reach = np.linalg.norm(d, axis=2).max(axis=1)
        x, y, z = np.einsum("kci,kai->akc", d, frame[at]) / reach[:, None]
        terms = [x, y, 0.5 * x * x, x * y, 0.5 * y * y, x**3, x * x * y, x * y * y, y**3]
        A = np.stack(terms[: 9 if count > 12 else 5], axis=2)
        c = np.einsum("ktc,kc->tk", np.linalg.pinv(A, RANK), z)
        D = np.linalg.pinv(frame[at, :2] + c[:2].T[:, :, None] * normal[at, None])  # of tangents
        second = (c[[[2, 3], [3, 4]]] / (reach * np.sqrt(1.0 + c[0] ** 2 + c[1] ** 2))).transpose(2, 0, 1)
        tensors[at] = -D @ second @ D.swapaxes(1, 2)
    return tensors


def curvature_coordinates(sheet: SheetMesh, size: float, name: str) -> tuple[Floats, Ints, Bools, Floats]:
    """The coordinates of a sheet; panels have about the ``size``, length. (m,3,2) u, v at the corners of
    triangles: whole numbers on lines of the net; the vertices that are umbilics; (n,) those on curves that
    are lines; (m,) degrees of the lines from the principal directions."""
    frame, w, tensors = principal_directions(sheet.X, sheet.F)
    mean = float(np.median(np.abs(np.trace(tensors, axis1=1, axis2=2)))) / 2.0
    if np.median(np.abs(w)) < max(ROUND * mean, FLAT / size):
        what = "is part of a sphere" if mean * size > FLAT else "is flat"
        text = f"patch {name!r} {what}: every point is an umbilic; choose pattern 'quads' and a direction"
        raise OptionError(text, what="pattern", found="planar-quads", expected="quads")
    return _OpenSheet(sheet, frame, w).coordinates(size)


class _OpenSheet:
    """A sheet cut open, so that the directions have one sign all over it."""

    def __init__(self, sheet: SheetMesh, frame: Floats, w: Floats) -> None:
        self.sheet, self.frame, m = sheet, frame, len(sheet.F)
        one, other = sheet.topology.neighbours.T
        self.f, self.g = f, g = one // 3, other // 3
        # the corners of f at the ends a, b of each inner edge, as f runs along it, and those of g there
        steps = (f, one, 1), (f, one, 2), (g, other, 2), (g, other, 1)
        self.ends = np.stack([3 * face + (side + step) % 3 for face, side, step in steps], axis=1)
        self.a, self.b = sheet.F.ravel()[self.ends[:, :2]].T
        root, along = np.sqrt(w), sheet.X[self.b] - sheet.X[self.a]
        seen_f, seen_g = (root[face] * np.conj(_complex(self.frame[face], along)) for face in (f, g))
        same = (seen_g * np.conj(seen_f)).real > 0.0
        # at each inner vertex the index of the directions, a multiple of 1/2, from their turn at its edges
        X, F, turn = sheet.X, sheet.F, np.angle((seen_g / seen_f) ** 2) / 2.0
        total = 2.0 * np.pi - np.bincount(F.ravel(), np.radians(angles(X[F])).ravel(), len(X))
        total += np.bincount(self.b, turn, len(X)) - np.bincount(self.a, turn, len(X))
        self.index = np.where(sheet.topology.on_boundary, 0.0, np.rint(total / np.pi) / 2.0)
        self.cut = self._cuts()
        whole = np.delete(np.arange(len(f)), self.cut)
        label = one_sided_copies(f[whole], g[whole], ~same[whole], m)
        sign = np.where(label[:m] < label[m:], 1.0, -1.0)
        self.root = root * sign
        self.flip = np.where(same, 1.0, -1.0) * sign[f] * sign[g]  # of z from f to g
        shared = self.ends[whole][:, [0, 2, 1, 3]].reshape(-1, 2)
        self.place = components(shared, 3 * m).astype(np.int64)  # of corners: open vertices
        self.count = int(self.place.max()) + 1
        self.pin = self._rows(np.zeros((1, 1), dtype=np.int64), np.ones(1))  # of the first open vertex
        P = X[F]
        self.area = face_areas(P)
        slopes = [0.5j * _complex(self.frame, P[:, k - 1] - P[:, k - 2]) / self.area for k in range(3)]
        slope = np.stack(slopes, axis=1).view(float).reshape(m, 3, 2, 1)  # of the function that is 1 there
        self.gradient = block_rows(slope, self.place.reshape(-1, 3), self.count)

    def _rows(self, places: Ints, values: Floats) -> csr_array:
        """The matrix with the values (r,k) in columns ``places`` (r,k) of open vertices."""
        return block_rows(np.broadcast_to(values, places.shape)[:, :, None, None], places, self.count)

    def _cuts(self) -> Ints:
        """The inner edges that are cut: paths from umbilics to the boundary, and between its loops."""
        m, n, centre = len(self.sheet.F), len(self.sheet.X), self.sheet.X[self.sheet.F].mean(axis=1)
        link = coo_array((np.ones(len(self.f)), (self.f, self.g)), shape=(m, m)).tocsr()
        start = int(np.linalg.norm(centre - centre.mean(axis=0), axis=1).argmin())
        before = breadth_first_order(link, start, directed=False)[1]
        cut = (before[self.f] != self.g) & (before[self.g] != self.f)
        kept = self.sheet.topology.on_boundary | (self.index != 0.0)
        while True:
            degree = np.bincount(np.append(self.a[cut], self.b[cut]), minlength=n)
            loose = (degree == 1) & ~kept
            ends = cut & (loose[self.a] | loose[self.b])
            if not ends.any():
                return np.flatnonzero(cut)
            cut &= ~ends

    def coordinates(self, size: float) -> tuple[Floats, Ints, Bools, Floats]:
        """Solve freely, choose the lattice, then hold umbilics, aligned curves and the cuts on it."""
        place, corners, flip = self.place, self.ends[self.cut][:, ::-1], self.flip[self.cut]
        lines = [[c for c in self.sheet.boundary()[0] if self._along(c) == axis] for axis in range(2)]
        # across a cut edge the difference along it is the same up to the sign
        one = np.ones(len(flip))
        shared = self._rows(place[corners], np.stack([one, -one, -flip, flip], axis=1))
        level = [[self._rows(place[self._corners(c)], np.array([1.0, -1.0])) for c in own] for own in lines]
        common = [vstack([shared, *rows]) for rows in level]
        parts = [self.root, 1j * self.root]
        free = [self._solve(part, rows) for part, rows in zip(parts, common, strict=True)]
        image = (free[0] + 1j * free[1])[place].reshape(-1, 3)
        covered = 0.5 * (np.conj(image[:, 1] - image[:, 0]) * (image[:, 2] - image[:, 0])).imag
        step = size * np.sqrt(np.abs(covered).sum() / self.area.sum())
        umbilics = np.flatnonzero(self.index)
        corner_of = np.zeros(len(self.sheet.X), dtype=np.int64)
        corner_of[self.sheet.F.ravel()] = np.arange(place.size)
        solved, chains = list[Floats](), self._chains()
        flip, pairs = self.flip[chains], place[self.ends[chains][:, [2, 0]]]
        jumps = self._rows(pairs, np.stack([np.ones(len(flip)), -flip], axis=1))  # c of z → ±z + c
        for axis in range(2):
            on = place[corner_of[np.append(umbilics, [c.vertices[0] for c in lines[axis]]).astype(np.int64)]]
            rest = np.where(np.arange(len(on)) < len(umbilics), 0.5, 0.0)
            periods = (jumps @ free[axis])[flip > 0.0]
            stretch, shift = _lattice(free[axis][on] / step, rest, periods / step)
            scale = 1.0 / (step * stretch)
            value = free[axis] * scale + shift
            held, to = self._rows(on[:, None], np.ones(1)), np.rint(value[on] - rest) + rest
            if not len(on):
                middle = np.average(value[place].reshape(-1, 3).mean(axis=1), weights=self.area)
                held, to = self.pin, value[:1] - middle + 0.5
            value = self._solve(scale * parts[axis], common[axis], held, to)
            for k in range(len(chains)):  # one after the other: some follow from those before
                held, to = vstack([held, jumps[[k]]]), np.append(to, np.rint(jumps[[k]] @ value))
                value = self._solve(scale * parts[axis], common[axis], held, to)
            solved.append(value)
        on_cut, at = np.bincount(place[corners.ravel()], minlength=self.count) > 0, []
        on_line = np.zeros(len(self.sheet.X), dtype=bool)
        for value, mine in zip(solved, lines, strict=True):
            up = on_cut.copy()
            for curve in mine:
                up[place[self._corners(curve)]], on_line[curve.vertices] = False, True
            at.append(nudged(value, place.reshape(-1, 3), up))
        slope = self.gradient @ solved[0]
        turned = np.abs(np.angle((slope[::2] + 1j * slope[1::2]) / self.root, deg=True))
        return np.stack(at, axis=2), umbilics, on_line, turned

    def _solve(
        self, part: Any, common: csr_array, held: csr_array | None = None, to: Floats | None = None
    ) -> Floats:
        """(count,) f with the gradient ``part`` (m,) in the mean, common @ f = 0 and held @ f = to."""
        held, to = (self.pin, np.zeros(1)) if held is None or to is None else (held, to)
        weighted = self.gradient.T @ diags_array(np.repeat(self.area, 2))
        target = np.stack([part.real, part.imag], axis=1).ravel()
        C, d = vstack([common, held]), np.append(np.zeros(common.shape[0]), to)
        system = block_array([[weighted @ self.gradient, C.T], [C, -SOFT * eye_array(len(d))]])
        return np.asarray(splu(csc_array(system)).solve(np.append(weighted @ target, d))[: self.count])

    def _corners(self, curve: EdgeCurve) -> Ints:
        """(k,2) the corners of triangles at the end and start of each edge of a boundary curve."""
        topo = self.sheet.topology
        sides = np.unique(topo.edge_of_face, return_index=True)[1]  # one of each edge
        side = sides[topo.edge_numbers(curve.pairs)]
        return np.asarray(3 * (side // 3)[:, None] + (side[:, None] + [2, 1]) % 3)

    def _along(self, curve: EdgeCurve) -> int:
        """0 if u is constant along a curve, 1 if v is, -1 if it is no line of curvature."""
        corners = self._corners(curve)
        step, face = np.diff(self.sheet.X[self.sheet.F.ravel()[corners]], axis=1)[:, 0], corners[:, 0] // 3
        seen = self.root[face] * np.conj(_complex(self.frame[face], step))
        off = np.abs(np.angle(seen**2)) / 2.0  # from u's gradient; π/2 where u is constant
        middle = [float(np.median(np.pi / 2 - off)), float(np.median(off))]
        return int(np.argmin(middle)) if min(middle) < ALIGNED else -1

    def _chains(self) -> Ints:
        """One cut edge of each path of cuts between umbilics, branches and the boundary."""
        n = len(self.sheet.X)
        ends = np.stack([self.a[self.cut], self.b[self.cut]], axis=1)
        degree = np.bincount(ends.ravel(), minlength=n)
        stop = (degree != 2) | (self.index != 0.0) | self.sheet.topology.on_boundary
        label = np.where(stop[ends], n + 2 * np.arange(len(ends))[:, None] + [0, 1], ends)
        return self.cut[np.unique(components(label, n + 2 * len(ends))[label[:, 0]], return_index=True)[1]]


def _lattice(position: Floats, rest: Floats, periods: Floats) -> tuple[float, float]:
    """The stretch of steps and the shift that bring positions to whole numbers plus ``rest``, and periods to
    whole numbers, as nearly as can be."""
    stretch = STRETCHES[np.argsort(np.abs(np.log(STRETCHES)))][:, None]
    shift = (SHIFTS if len(position) else SHIFTS[:1])[:, None]
    off = position / stretch[:, None] + shift - rest  # (stretches,shifts,k)
    error = ((off - np.rint(off)) ** 2).sum(axis=2) + 1e-3 * np.log(stretch) ** 2
    error += ((periods / stretch - np.rint(periods / stretch)) ** 2).sum(axis=1, keepdims=True)
    best = np.unravel_index(error.argmin(), error.shape)
    return float(stretch[best[0], 0]), float(shift[best[1], 0])


def _complex(frame: Floats, vectors: Floats) -> Any:
    """(m,) vectors (m,3) as complex numbers in frames (m,2,3)."""
    x, y = np.einsum("fai,fi->af", frame, vectors)
    return x + 1j * y


def nudged(values: Floats, place: Ints, up: Bools | None = None) -> Floats:
    """(m,3) the values (k,) at corners ``place`` (m,3), none nearer to a whole number than ``NUDGE``. A
    boundary that lies on a line is moved inwards, so that the line is the boundary of the panels beside it.
    Values marked ``up`` (k,) are moved upwards."""
    line = np.rint(values)
    away = values[place].mean(axis=1)[:, None] - line[place]
    inward = np.bincount(place.ravel(), away.ravel(), len(values))
    down = inward < 0.0 if up is None else (inward < 0.0) & ~up
    away = line + NUDGE * np.where(down, -1.0, 1.0)
    return np.where(np.abs(values - line) < NUDGE, away, values)[place]
