"""Coordinates u, v of a sheet whose level lines are lines of curvature.

With κ₁ - κ₂ the difference of the principal curvatures and e₁, e₂ their directions,

    ∇u = √((κ₁ - κ₂)/2) e₁,    ∇v = √((κ₁ - κ₂)/2) e₂

are gradients where the mean curvature is constant: u + iv is the integral of the square root of the Hopf
differential, and conformal. They are solved for in the least-squares sense, on the sheet cut open from each
umbilic to the boundary. Across a cut z = u + iv becomes ±z + c. So that lines meet there, c is made whole
numbers; umbilics come into the middle of a cell, which then has six sides; and curves that are lines of
curvature, such as ridges over plane walls (Joachimsthal), become lines of the net.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import block_array, coo_array, csc_array, csr_array, diags_array, eye_array
from scipy.sparse.csgraph import breadth_first_order
from scipy.sparse.linalg import splu

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import OptionError
from ..surface.geometry import face_areas
from ..surface.topology import EdgeCurve, Topology, components
from .directions import Directions, principal_directions
from .net import nudged
from .sheet import SheetMesh

ALIGNED = np.radians(10.0)  # a curve is a line of curvature if half of it is within this of the directions
ROUND = 0.05  # of the mean curvature: a sheet is part of a sphere if (κ₁ - κ₂)/2 is smaller on half of it
FLAT = 1e-6  # curvature times size
STRETCHES, SHIFTS = np.linspace(0.8, 1.25, 46), np.arange(0.0, 1.0, 0.025)  # of the lattice, that are tried


@dataclass(frozen=True, eq=False)
class NetCoordinates:
    """Coordinates u, v at the corners of a sheet's triangles; lines of the net are whole numbers."""

    at: Floats  # (m,3,2)
    umbilics: Ints  # vertices
    index: Floats  # of each, -1/2 or a multiple of it
    aligned: tuple[EdgeCurve, ...]  # curves that are lines of the net
    turned: Floats  # (m,) angle between the lines and the principal directions, radians


def curvature_coordinates(sheet: SheetMesh, size: float, name: str) -> NetCoordinates:
    """The coordinates of a sheet; panels have about the ``size``, length."""
    topo = sheet.topology
    directions = principal_directions(sheet.X, sheet.F)
    mean = float(np.median(np.abs(np.trace(directions.tensors, axis1=1, axis2=2)))) / 2.0
    apart = float(np.median(np.abs(directions.w)))
    if apart < max(ROUND * mean, FLAT / size):
        what = "is part of a sphere" if mean * size > FLAT else "is flat"
        text = f"patch {name!r} {what}: every point is an umbilic; choose pattern 'quads' and a direction"
        raise OptionError(text, what="pattern", found="planar-quads", expected="quads")
    open_sheet = _OpenSheet(sheet, topo, directions)
    return open_sheet.coordinates(size, name)


class _OpenSheet:
    """A sheet cut open, so that the directions have one sign all over it."""

    def __init__(self, sheet: SheetMesh, topo: Topology, directions: Directions) -> None:
        self.sheet, self.topo, self.directions = sheet, topo, directions
        X, F = sheet.X, sheet.F
        one, other = sheet.inner_sides
        self.f, self.g, kf, kg = one // 3, other // 3, one % 3, other % 3
        # the edge from a to b as f runs along it; g runs from b to a
        self.fa, self.fb = 3 * self.f + (kf + 1) % 3, 3 * self.f + (kf + 2) % 3
        self.ga, self.gb = 3 * self.g + (kg + 2) % 3, 3 * self.g + (kg + 1) % 3
        self.a, self.b = F.ravel()[self.fa], F.ravel()[self.fb]
        root = np.sqrt(directions.w)
        along = X[self.b] - X[self.a]
        seen_f, seen_g = (
            root[face] * np.conj(_complex(directions.frame[face], along)) for face in (self.f, self.g)
        )
        turn = np.angle((seen_g / seen_f) ** 2) / 2.0  # of the line from f to g, against the edge
        same = (seen_g * np.conj(seen_f)).real > 0.0
        self.index = self._index(turn)
        cut = self._cuts()
        # one sign along a tree of faces that no cut crosses
        sign = self._signs(same, ~cut)
        self.root = root * sign
        self.flip = np.where(same, 1.0, -1.0) * sign[self.f] * sign[self.g]  # of z from f to g
        joined = np.concatenate(
            [np.stack([self.fa, self.ga], 1)[~cut], np.stack([self.fb, self.gb], 1)[~cut]]
        )
        self.place = components(joined, 3 * len(F)).astype(np.int64)  # of corners: vertices of the open sheet
        self.count = int(self.place.max()) + 1
        self.cut = np.flatnonzero(cut)
        self._operators()

    def _index(self, turn: Floats) -> Floats:
        """(n,) the index of the field of directions at each inner vertex, a multiple of 1/2."""
        X, F = self.sheet.X, self.sheet.F
        corners = X[F]
        out = np.roll(corners, -1, axis=1) - corners
        back = np.roll(corners, 1, axis=1) - corners
        angle = np.arctan2(np.linalg.norm(np.cross(out, back), axis=2), np.einsum("fki,fki->fk", out, back))
        total = 2.0 * np.pi - np.bincount(F.ravel(), angle.ravel(), minlength=len(X))
        total += np.bincount(self.b, turn, minlength=len(X)) - np.bincount(self.a, turn, minlength=len(X))
        inside = ~self.topo.on_boundary
        return np.where(inside, np.rint(total / np.pi) / 2.0, 0.0)

    def _cuts(self) -> Bools:
        """Which of the inner edges are cut: paths from umbilics to the boundary, and between its loops."""
        m, n = len(self.sheet.F), len(self.sheet.X)
        link = csr_array(coo_array((np.ones(len(self.f)), (self.f, self.g)), shape=(m, m)))
        centre = self.sheet.X[self.sheet.F].mean(axis=1)
        start = int(np.linalg.norm(centre - centre.mean(axis=0), axis=1).argmin())
        before = breadth_first_order(link, start, directed=False)[1]
        cut = (before[self.f] != self.g) & (before[self.g] != self.f)
        kept = self.topo.on_boundary | (self.index != 0.0)
        while True:
            degree = np.bincount(self.a[cut], minlength=n) + np.bincount(self.b[cut], minlength=n)
            loose = (degree == 1) & ~kept
            ends = cut & (loose[self.a] | loose[self.b])
            if not ends.any():
                break
            cut &= ~ends
        return cut

    def _signs(self, same: Bools, open_: Bools) -> Floats:
        """(m,) ±1 so that the directions of neighbours agree where no cut is between them."""
        m = len(self.sheet.F)
        f, g, same = self.f[open_], self.g[open_], same[open_]
        one, other = (
            np.concatenate([f, f + m]),
            np.where(np.append(same, same), np.append(g, g + m), np.append(g + m, g)),
        )
        label = components(np.stack([one, other], axis=1), 2 * m)
        return np.where(label[:m] < label[m:], 1.0, -1.0)

    def _operators(self) -> None:
        """The gradient in each triangle's frame, the areas, and what u and v on both sides of cuts share."""
        sheet, (frame, _, _) = self.sheet, self.directions
        P = sheet.X[sheet.F]
        area = face_areas(P)
        rows, columns, values = [], [], []
        for k in range(3):
            edge = _complex(frame, P[:, k - 1] - P[:, k - 2])  # opposite corner k, counter-clockwise
            slope = 1j * edge / (2.0 * area)
            for part, value in enumerate((slope.real, slope.imag)):
                rows.append(2 * np.arange(len(P)) + part)
                columns.append(self.place[3 * np.arange(len(P)) + k])
                values.append(value)
        shape = (2 * len(P), self.count)
        gradient = coo_array(
            (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape
        )
        self.gradient, self.area = csr_array(gradient), area

    def coordinates(self, size: float, name: str) -> NetCoordinates:
        """Solve freely, choose the lattice, then hold umbilics, aligned curves and the cuts on it."""
        curves, _ = self.sheet.boundary()
        along = [self._along(curve) for curve in curves]  # 0 where u is constant, 1 for v, -1 for none
        common = [self._shared(), self._shared()]
        for curve, axis in zip(curves, along, strict=True):
            if axis >= 0:
                common[axis].append(self._constant(curve))
        parts = [self.root, 1j * self.root]
        free = [self._solve(part, rows, []) for part, rows in zip(parts, common, strict=True)]
        z = free[0] + 1j * free[1]
        image = z[self.place].reshape(-1, 3)
        covered = 0.5 * (np.conj(image[:, 1] - image[:, 0]) * (image[:, 2] - image[:, 0])).imag
        step = size * np.sqrt(np.abs(covered).sum() / self.area.sum())
        umbilics = np.flatnonzero(self.index)
        corner_of = np.zeros(len(self.sheet.X), dtype=np.int64)
        corner_of[self.sheet.F.ravel()] = np.arange(self.sheet.F.size)
        at_umbilics = self.place[corner_of[umbilics]]
        solved = []
        for axis in range(2):
            ends = [
                self.place[corner_of[c.vertices[0]]] for c, a in zip(curves, along, strict=True) if a == axis
            ]
            place = np.concatenate([at_umbilics, np.array(ends, dtype=np.int64)])
            rest = np.append(np.full(len(umbilics), 0.5), np.zeros(len(ends)))
            chains = self._chains()
            jump = [self._jump(e, free[axis]) for e in chains]
            stretch, shift = _lattice(
                free[axis][place] / step, rest, np.array(jump) / step, self.flip[chains]
            )
            scale = 1.0 / (step * stretch)
            value = free[axis] * scale + shift
            held = [
                (_row(self.count, [p], [1.0]), np.rint(value[p] - r) + r)
                for p, r in zip(place, rest, strict=True)
            ]
            if not held:
                middle = np.average(value[self.place].reshape(-1, 3).mean(axis=1), weights=self.area)
                held = [(_row(self.count, [0], [1.0]), value[0] - middle + 0.5)]
            value = self._solve(scale * parts[axis], common[axis], held)
            for e in chains:  # one after the other: some follow from those before
                row = _row(self.count, [self.place[self.ga[e]], self.place[self.fa[e]]], [1.0, -self.flip[e]])
                held.append((row, float(np.rint(self._jump(e, value)))))
                value = self._solve(scale * parts[axis], common[axis], held)
            solved.append(value)
        place = self.place.reshape(-1, 3)
        at = np.stack([nudged(solved[k], place, self._on_cut(curves, along, k)) for k in range(2)], axis=2)
        slope = self.gradient @ solved[0]
        turned = np.angle((slope[::2] + 1j * slope[1::2]) / self.root)
        aligned = tuple(c for c, a in zip(curves, along, strict=True) if a >= 0)
        return NetCoordinates(at, umbilics, self.index[umbilics], aligned, turned)

    def _solve(self, part: Any, common: list[csr_array], held: list[tuple[csr_array, float]]) -> Floats:
        """(count,) the function with the gradient ``part`` (m,) in the mean, under linear conditions."""
        weight = np.repeat(self.area, 2)
        target = np.stack([part.real, part.imag], axis=1).ravel()
        stiff = self.gradient.T @ diags_array(weight) @ self.gradient
        rows = [*common, *(row for row, _ in held)] or []
        if not held:
            rows = [*rows, _row(self.count, [0], [1.0])]
        C = csr_array(np.zeros((0, self.count))) if not rows else _stacked(rows)
        d = np.zeros(C.shape[0])
        if held:
            d[-len(held) :] = [value for _, value in held]
        system = csc_array(block_array([[stiff, C.T], [C, -1e-9 * eye_array(C.shape[0])]]))
        solution = splu(system).solve(np.concatenate([self.gradient.T @ (weight * target), d]))
        return np.asarray(solution[: self.count])

    def _shared(self) -> list[csr_array]:
        """Across each cut edge the difference along it is the same up to the sign."""
        e = self.cut
        if not len(e):
            return []
        places = [self.place[corner[e]] for corner in (self.gb, self.ga, self.fb, self.fa)]
        values = [np.ones(len(e)), -np.ones(len(e)), -self.flip[e], self.flip[e]]
        rows = np.tile(np.arange(len(e)), 4)
        data = (np.concatenate(values), (rows, np.concatenate(places)))
        return [csr_array(coo_array(data, shape=(len(e), self.count)))]

    def _constant(self, curve: EdgeCurve) -> csr_array:
        """A function is constant along a curve of the boundary."""
        _, start, end = self._sides(curve)
        k = len(start)
        data = (
            np.append(np.ones(k), -np.ones(k)),
            (np.tile(np.arange(k), 2), self.place[np.append(end, start)]),
        )
        return csr_array(coo_array(data, shape=(k, self.count)))

    def _sides(self, curve: EdgeCurve) -> tuple[Ints, Ints, Ints]:
        """The triangles along a boundary curve, and their corners at the start and end of each edge."""
        edge = self.topo.edge_numbers(curve.pairs)
        sides = self.topo.edge_of_face.ravel()
        where = np.full(len(self.topo.edges), -1)
        where[sides] = np.arange(len(sides))
        side = where[edge]
        face, k = side // 3, side % 3
        return face, 3 * face + (k + 1) % 3, 3 * face + (k + 2) % 3

    def _on_cut(self, curves: tuple[EdgeCurve, ...], along: list[int], axis: int) -> Bools:
        """(count,) the vertices of cuts but for those on curves that are lines of the axis."""
        mask = np.zeros(self.count, dtype=bool)
        corners = (corner[self.cut] for corner in (self.fa, self.fb, self.ga, self.gb))
        mask[self.place[np.concatenate(list(corners))]] = True
        for curve, one in zip(curves, along, strict=True):
            if one == axis:
                mask[self.place[np.concatenate(self._sides(curve)[1:])]] = False
        return mask

    def _along(self, curve: EdgeCurve) -> int:
        """0 if u is constant along a curve, 1 if v is, -1 if it is no line of curvature."""
        face, start, end = self._sides(curve)
        corner = self.sheet.F.ravel()
        step = self.sheet.X[corner[end]] - self.sheet.X[corner[start]]
        seen = self.root[face] * np.conj(_complex(self.directions.frame[face], step))
        off = np.abs(np.angle(seen**2)) / 2.0  # from u's gradient; π/2 where u is constant
        middle = [float(np.median(np.pi / 2 - off)), float(np.median(off))]
        return int(np.argmin(middle)) if min(middle) < ALIGNED else -1

    def _chains(self) -> Ints:
        """One cut edge of each path of cuts between umbilics, branches and the boundary."""
        if not len(self.cut):
            return np.empty(0, dtype=np.int64)
        n = len(self.sheet.X)
        ends = np.stack([self.a[self.cut], self.b[self.cut]], axis=1)
        degree = np.bincount(ends.ravel(), minlength=n)
        stop = (degree != 2) | (self.index != 0.0) | self.topo.on_boundary
        label = np.where(stop[ends], n + 2 * np.arange(len(ends))[:, None] + [0, 1], ends)
        return self.cut[np.unique(components(label, n + 2 * len(ends))[label[:, 0]], return_index=True)[1]]

    def _jump(self, e: int, value: Floats) -> float:
        """c of z → ±z + c across a cut edge."""
        return float(value[self.place[self.ga[e]]] - self.flip[e] * value[self.place[self.fa[e]]])


def _lattice(position: Floats, rest: Floats, jump: Floats, flip: Floats) -> tuple[float, float]:
    """The stretch of steps and the shift that bring positions to whole numbers plus ``rest``, jumps too."""
    periods = jump[flip > 0.0]
    best = (np.inf, 1.0, 0.0)
    for stretch in STRETCHES[np.argsort(np.abs(np.log(STRETCHES)))]:
        for shift in SHIFTS if len(position) else (0.0,):
            off = np.append(position / stretch + shift - rest, periods / stretch)
            error = float(((off - np.rint(off)) ** 2).sum()) + 1e-3 * np.log(stretch) ** 2
            if error < best[0]:
                best = (error, float(stretch), float(shift))
    return best[1], best[2]


def _row(width: int, columns: list[int], values: list[float]) -> csr_array:
    return csr_array(coo_array((values, ([0] * len(columns), columns)), shape=(1, width)))


def _stacked(rows: list[csr_array]) -> csr_array:
    return csr_array(block_array([[row] for row in rows]))


def _complex(frame: Floats, vectors: Floats) -> Any:
    """(m,) vectors (m,3) as complex numbers in frames (m,2,3)."""
    x, y = np.einsum("fai,fi->af", frame, vectors)
    return x + 1j * y
