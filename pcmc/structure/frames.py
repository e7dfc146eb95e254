"""Frames of straight bars with bending, and the force along a line that balances what sheets pull it with.

At rest there is no CalculiX; in its cases it expands a beam to a brick, without forces of sections. A bar
from a to b has twelve coordinates: the displacements and turns of both ends. In its axes (x along it, z
upright, y across) its stiffness K is that of Euler and Bernoulli: E A/L along it, G J/L in torsion, and in
each of the planes of bending, with the displacements w and the slopes φ,

    E I/L³ [[12, 6 L, -12, 6 L], [6 L, 4 L², -6 L, 2 L²], [-12, -6 L, 12, -6 L], [6 L, 2 L², -6 L, 4 L²]].

With loads at the ends of bars alone its forces at the ends are exact. A force N along it adds, with the same
cubics between the ends, the stiffness G(N) (Przemieniecki 1968): N (I + I')/(A L) in torsion, and in bending

    N/(30 L) [[36, 3 L, -36, 3 L], [3 L, 4 L², -3 L, -L²], [-36, -3 L, 36, -3 L], [3 L, -L², -3 L, 4 L²]].

Sheets of the tensions α pull a line with q = Σ α n per length, n the co-normals from the line into them. So q
is across the line. A line that does not bend carries it by a force N along its tangent t,

    (N t)' + q = N' t + N κ n + q = 0,     so     N' = 0   and   q = -N κ n,   n here the principal normal:

N is the same all along, and q grows with the curvature. A wall of one tension α_w balances q = α_w, so a
member in its place does not bend exactly if the line is an arc of a circle in the wall's plane, N = ±α_w r.
Another line needs the pull |N| κ(s), which no wall of one tension has, and no wall at all where it curves to
the other side. A cable of the tension N in the place of the wall finds a shape of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import null_space
from scipy.sparse import block_array, coo_array, csr_array
from scipy.sparse.linalg import LinearOperator, eigs, splu

from ..base.arrays import Floats, Ints
from ..surface.geometry import CORNER, area_vectors, edge_vectors, end_tangent, unit_vectors
from ..surface.topology import components

STRAIGHT = 1e-6  # sine of the largest turn of a line below which it is straight
UPRIGHT = 1e-6  # sine of the angle to the upright below which a bar stands: its z is another direction
EXACT = 1e-10  # of the factor at which bars buckle
NEVER = 1e4  # factor from which it is rounding, as of a ring in tension, and they do not buckle
LOOSE = 1e-9  # a rigid motion that supports hold less than so moves freely
BENDING = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]], dtype=float)
PULLED = np.array([[36, 3, -36, 3], [3, 4, -3, -1], [-36, -3, 36, -3], [3, -1, -3, 4]], dtype=float)


@dataclass(frozen=True, eq=False)
class BarFrame:
    """Bars between points, rigidly joined there, and what holds the points."""

    points: Floats  # (n,3)
    bars: Ints  # (b,2) the points at their ends
    stiffness: Floats  # (b,4) E A, E I in the upright plane, E I across, G J
    holds: Floats  # (r,6n) directions in which nothing moves: displacement and turn of each point
    up: Floats  # (3,) the direction that is upright

    def solved(self, forces: Floats, longer: Floats | float = 0.0) -> FrameForces:
        """Under forces (n,3) on the points, with bars that are ``longer`` (b,), in their length, when free.
        Where a part is not held, what is out of balance is left out."""
        n, (factor, scale), push = len(self.points), self._factor, self.stiffness[:, 0] * longer
        forces, along = forces.copy(), push[:, None] * self.axes[0][:, 0]
        np.add.at(forces, self.bars, np.stack([-along, along], axis=1))
        load = np.pad(np.pad(forces, ((0, 0), (0, 3))).ravel(), (0, factor.shape[0] - 6 * n))
        u, held, _ = np.split(factor.solve(load), [6 * n, 6 * n + len(self.holds)])
        ends = np.einsum("bij,bjk,bk->bi", self._own, self._turn, u[self._place])
        ends[:, [0, 6]] += np.outer(push, [1.0, -1.0])
        reactions = -scale * (self.holds.T @ held).reshape(n, 6)
        return FrameForces(self, u.reshape(n, 6)[:, :3], ends, reactions[:, :3], reactions[:, 3:])

    def buckling(self, N: Floats) -> float:
        """The factor on forces N (b,) along the bars, tension above 0, at which these buckle, loads keeping
        their directions: the least λ > 0 with (K + λ G(N)) u = 0 for a motion u that is free; else inf,
        and above 1e4, where it is rounding.

        A column of two bars with hinged ends, to 0.7 % of π² E I/L²:

        >>> X, up = np.array([[0.0, 0, 0], [0, 0, 1], [0, 0, 2]]), np.eye(3)[2]
        >>> held = np.eye(18)[[0, 1, 2, 5, 12, 13]]
        >>> column = BarFrame(X, np.array([[0, 1], [1, 2]]), np.tile([1e6, 4.0, 4.0, 3.0], (2, 1)), held, up)
        >>> round(column.buckling(np.array([-1.0, -1.0])) / np.pi**2, 3)
        1.008
        """
        if not (N < 0.0).any() or len(self.holds) == self.holds.shape[1]:  # nothing is free
            return np.inf
        label = components(self.bars, len(self.points))
        mine = np.isin(label, label[self.bars[N < 0.0]])
        if not mine.all():  # other parts of the frame are not asked
            bars, holds = mine[self.bars[:, 0]], self.holds[:, np.repeat(mine, 6)]
            ends, held = (np.cumsum(mine) - 1)[self.bars[bars]], holds[holds.any(axis=1)]
            return BarFrame(self.points[mine], ends, self.stiffness[bars], held, self.up).buckling(N[bars])
        (EA, EI, across, _), L, n = self.stiffness.T, self.axes[1], 6 * len(self.points)
        bent = N / (30 * L)
        G = self._assembled(_blocks(L, 0.0 * N, bent, bent, N * (EI + across) / (EA * L), PULLED))
        factor = self._factor[0]

        def answer(u: Floats) -> Floats:  # the largest eigenvalue of -K⁻¹ G is 1/λ
            return np.asarray(factor.solve(np.pad(-(G @ u.ravel()), (0, factor.shape[0] - n)))[:n])

        start = np.random.default_rng(0).standard_normal(n)  # no mode is square to it, as to an even vector
        most = float(eigs(LinearOperator((n, n), answer), 1, which="LR", v0=start, tol=EXACT)[0][0].real)
        return 1.0 / most if most > 1.0 / NEVER else np.inf

    @cached_property
    def axes(self) -> tuple[Floats, Floats]:
        """(b,3,3) and (b,): ``bar_axes``."""
        return bar_axes(self.points, self.bars, self.up)

    @cached_property
    def _turn(self) -> Floats:
        """(b,12,12) from the coordinates of space to those of the bars."""
        return np.einsum("pq,bij->bpiqj", np.eye(4), self.axes[0]).reshape(-1, 12, 12)

    @cached_property
    def _place(self) -> Ints:
        """(b,12) the places of their coordinates in a vector 6n."""
        return np.asarray((6 * self.bars[:, :, None] + np.arange(6)).reshape(-1, 12))

    @cached_property
    def _own(self) -> Floats:
        """(b,12,12) the stiffness of bars in their axes."""
        (EA, EI, across, GJ), L = self.stiffness.T, self.axes[1]
        return _blocks(L, EA / L, EI / L**3, across / L**3, GJ / L, BENDING)

    def _assembled(self, own: Floats) -> csr_array:
        """(6n,6n) the sum of matrices (b,12,12) in the bars' axes."""
        K, size = self._turn.transpose(0, 2, 1) @ own @ self._turn, 6 * len(self.points)
        rows, columns = np.repeat(self._place, 12, axis=1).ravel(), np.tile(self._place, (1, 12)).ravel()
        return csr_array(coo_array((K.ravel(), (rows, columns)), shape=(size, size)))

    @cached_property
    def _factor(self) -> tuple[Any, float]:
        """The factors of K with what is held and the rigid motions of parts that nothing holds; the scale of
        these rows."""
        n, label, motions = len(self.points), components(self.bars, len(self.points)), list[Floats]()
        for part in np.unique(label[self.bars]):
            mine = label == part
            arms, still = self.points - self.points[mine].mean(axis=0), np.zeros_like(self.points)
            for axis in np.eye(3):
                shift, turn = [still + axis, still], [np.cross(axis, arms), still + axis]
                both = np.hstack(shift), np.hstack(turn) / np.abs(arms[mine]).max()
                motions += [(motion * mine[:, None]).ravel() for motion in both]
        R = np.array(motions).T
        free = null_space(self.holds @ R, rcond=LOOSE) if len(self.holds) else np.eye(R.shape[1])
        loose = np.linalg.qr(R @ free)[0].T if free.shape[1] else np.zeros((0, 6 * n))
        K = self._assembled(self._own)
        scale = float(K.diagonal().mean())
        held = csr_array(scale * np.vstack([self.holds, loose]))
        return splu(block_array([[K, held.T], [held, None]], format="csc")), scale


@dataclass(frozen=True, eq=False)
class FrameForces:
    """What a frame does under its loads."""

    frame: BarFrame
    displacements: Floats  # (n,3) length
    ends: Floats  # (b,12) forces and moments on the ends of each bar, in its axes
    reactions: Floats  # (n,3) forces of the supports on the frame
    moments: Floats  # (n,3) their moments

    def within(self, chain: Ints, closed: bool = False) -> tuple[Floats, Ints]:
        """(k,6) along bars (c,), each from where the one before ends, at their points: N, tension above 0;
        the shear forces upright and across; the torque; the moments upright, above 0 with tension below, and
        across; and (k,) the points 0 to c, of a closed line the first again at its end. V = dM/ds. Moments
        are those at the points, about the bars' axes; the other forces jump there, as loads do: they are on
        the line between the middles of the two bars. A point has two rows, one for each side, where the line
        has a corner, other bars meet it, or a support holds it. There and at ends forces are on the line
        through the two nearest middles, and moments about the axes of the ``end_tangent``."""
        frame, axes, count = self.frame, self.frame.axes[0][chain], len(self.frame.points)
        holds = frame.holds.reshape(-1, count, 6)[:, :, :3].any(axis=2).sum(axis=0)
        ends = ((np.bincount(frame.bars.ravel(), minlength=count) > 2) | (holds > 1))[frame.bars[chain, 0]]
        cosines = np.einsum("bij,bij->bi", axes, np.roll(axes, 1, axis=0))
        ends |= cosines.min(axis=1) < np.cos(np.radians(CORNER))
        ends[0] |= not closed
        if not ends.any():
            rows = self._along(chain, True)
            return np.vstack([rows, rows[:1]]), np.arange(len(chain) + 1)
        first, order = int(ends.argmax()), np.arange(len(chain))
        runs = np.split(np.roll(order, -first), np.flatnonzero(np.roll(ends, -first))[1:])
        rows = np.vstack([self._along(chain[run]) for run in runs])
        at = np.concatenate([np.append(run, run[-1] + 1) for run in runs])
        return np.roll(rows, -at.argmin(), axis=0), np.roll(at, -at.argmin())

    def _along(self, chain: Ints, closed: bool = False) -> Floats:
        """(k,6) the same along a line without corners, at its c points if it is closed, else c + 1."""
        columns, signs = [0, 2, 1, 3, 4, 5], [1.0, -1.0, -1.0, 1.0, -1.0, 1.0]
        first, last = -self.ends[chain, :6][:, columns] * signs, self.ends[chain, 6:][:, columns] * signs
        middle, before, after = 0.5 * (first + last)[:, :4], last[:, 4:], first[:, 4:]
        axes, length, flip = *(of[chain] for of in self.frame.axes), np.array(signs[3:])
        if closed:
            middle, before = np.vstack([middle[-1:], middle]), np.roll(before, 1, axis=0)
            length = np.append(length[-1:], length)
        else:
            middle = np.pad(middle, ((1, 1), (0, 0)), mode="reflect", reflect_type="odd")
            for at, moments, two in ((0, first[0, 3:], slice(2)), (-1, last[-1, 3:], slice(None, -3, -1))):
                there = axes_along(end_tangent(axes[two, 0], length[two])[None], self.frame.up)[0]
                moments[:] = flip * (there @ axes[at].T @ (flip * moments))
            before, after = np.vstack([after[:1], before]), np.vstack([after, before[-1:]])
            length = np.pad(length, 1, mode="reflect")
        share = (length[:-1] / (length[:-1] + length[1:]))[:, None]
        before, after = np.hstack([middle[:-1], before]), np.hstack([middle[1:], after])
        return before + share * (after - before)


def bar_axes(X: Floats, bars: Ints, up: Floats) -> tuple[Floats, Floats]:
    """(b,3,3) rows: along each bar (b,2) on X (n,3), across, upright; and (b,) its length.

    >>> axes, length = bar_axes(np.array([[0.0, 0, 0], [2, 0, 0]]), np.array([[0, 1]]), np.eye(3)[2])
    >>> axes[0].tolist(), length.tolist()
    ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [2.0])
    """
    along = X[bars[:, 1]] - X[bars[:, 0]]
    length = np.linalg.norm(along, axis=1)
    return axes_along(along / length[:, None], up), length


def axes_along(along: Floats, up: Floats) -> Floats:
    """(b,3,3) rows: directions (b,3), across, upright; all of length 1.

    >>> axes_along(np.eye(3)[:1], np.eye(3)[2])[0].tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    across = np.cross(up, along)
    stands = np.linalg.norm(across, axis=1) <= UPRIGHT
    across[stands] = np.cross(np.eye(3)[np.abs(up).argmin()], along[stands])
    across = unit_vectors(across)
    return np.stack([along, across, np.cross(along, across)], axis=1)


def _blocks(L: Floats, along: Floats, up: Floats, across: Floats, twist: Floats, unit: Floats) -> Floats:
    """(b,12,12) matrices of bars in their axes, with factors (b,) of ``unit`` in the planes of bending."""
    K = np.zeros((len(L), 12, 12))
    for at, value in ((0, along), (3, twist)):
        K[:, at, at] = K[:, at + 6, at + 6] = value
        K[:, at, at + 6] = K[:, at + 6, at] = -value
    for factor, place, slope in ((up, [2, 4, 8, 10], -L), (across, [1, 5, 7, 11], L)):
        lengths = np.stack([np.ones_like(L), slope, np.ones_like(L), slope], axis=1)
        block = factor[:, None, None] * unit * lengths[:, :, None] * lengths[:, None, :]
        K[:, np.array(place)[:, None], place] += block
    return K


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
    if not f.any() or np.abs(turn).max() < STRAIGHT:
        return 0.0, float(f.any())
    N = -float((f * turn).sum() / (turn * turn).sum())
    return N, float(np.linalg.norm(f + N * turn) / np.linalg.norm(f))
