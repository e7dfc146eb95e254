"""Frames of straight bars with bending: displacements and forces within the bars, linear in the loads.

Each bar from a to b has twelve coordinates: the displacements and turns of both ends. In its axes (x along
it, z upright, y across) its stiffness is that of Euler and Bernoulli: E A / L along it, G J / L in torsion,
and in each of the planes of bending, with the displacements w and the slopes φ of both ends,

    E I / L³ [[12, 6 L, -12, 6 L], [6 L, 4 L², -6 L, 2 L²], [-12, -6 L, 12, -6 L], [6 L, 2 L², -6 L, 4 L²]].

With loads at the ends of bars alone its forces at the ends are exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space
from scipy.sparse import block_array, coo_array, csr_array
from scipy.sparse.linalg import splu

from ..base.arrays import Floats, Ints
from ..surface.topology import components

UPRIGHT = 1e-6  # sine of the angle to the upright below which a bar stands: its z is another direction
LOOSE = 1e-9  # a rigid motion that supports hold less than so moves freely


@dataclass(frozen=True, eq=False)
class BarFrame:
    """Bars between points, rigidly joined there, and what holds the points."""

    points: Floats  # (n,3)
    bars: Ints  # (b,2) the points at their ends
    stiffness: Floats  # (b,4) E A, E I in the upright plane, E I across, G J
    holds: Floats  # (r,6n) directions in which nothing moves: displacement and turn of each point
    up: Floats  # (3,) the direction that is upright

    def solved(self, forces: Floats) -> FrameForces:
        """Under forces (n,3) on the points. Where a part is not held, what is out of balance is left out."""
        n, B = len(self.points), self.stiffness
        axes, length = bar_axes(self.points, self.bars, self.up)
        local = _local(B, length)
        turn = np.zeros((len(B), 12, 12))
        for k in range(4):
            turn[:, 3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = axes
        K = turn.transpose(0, 2, 1) @ local @ turn
        place = (6 * self.bars[:, :, None] + np.arange(6)).reshape(-1, 12)
        rows, columns = np.repeat(place, 12, axis=1).ravel(), np.tile(place, (1, 12)).ravel()
        whole = csr_array(coo_array((K.ravel(), (rows, columns)), shape=(6 * n, 6 * n)))
        scale = float(whole.diagonal().mean())
        loose = self._rigid_motions()
        held = csr_array(scale * np.vstack([self.holds, loose]))
        system = block_array([[whole, held.T], [held, None]], format="csc")
        load = np.concatenate([np.pad(forces, ((0, 0), (0, 3))).ravel(), np.zeros(held.shape[0])])
        found = splu(system).solve(load)
        u = found[: 6 * n]
        ends = np.einsum("bij,bjk,bk->bi", local, turn, u[place])
        reactions = -scale * (self.holds.T @ found[6 * n : 6 * n + len(self.holds)]).reshape(n, 6)
        u = u.reshape(n, 6)
        return FrameForces(u[:, :3], ends, reactions[:, :3], reactions[:, 3:])

    def _rigid_motions(self) -> Floats:
        """(k,6n) the motions of parts as rigid bodies that nothing holds, as rows."""
        n = len(self.points)
        label = components(self.bars, n)
        motions = []
        for part in np.unique(label[self.bars]):
            mine = label == part
            arms = self.points - self.points[mine].mean(axis=0)
            size = float(np.abs(arms[mine]).max())
            for axis in np.eye(3):
                still = np.zeros_like(self.points)
                motions += [
                    np.hstack([still + axis, still]) * mine[:, None],
                    np.hstack([np.cross(axis, arms), still + axis]) / size * mine[:, None],
                ]
        R = np.array([motion.ravel() for motion in motions]).T
        free = null_space(self.holds @ R, rcond=LOOSE) if len(self.holds) else np.eye(R.shape[1])
        return np.asarray(np.linalg.qr(R @ free)[0].T if free.shape[1] else np.zeros((0, 6 * n)))


@dataclass(frozen=True, eq=False)
class FrameForces:
    """What a frame does under its loads."""

    displacements: Floats  # (n,3) length
    ends: Floats  # (b,12) forces and moments on the ends of each bar, in its axes
    reactions: Floats  # (n,3) forces of the supports on the frame
    moments: Floats  # (n,3) their moments

    def within(self, chain: Ints, closed: bool = False) -> Floats:
        """(k,6) along bars (c,), each from where the one before ends, at their k points: N, tension above 0;
        the shear forces upright and across; the torque; the moments upright, above 0 with tension below, and
        across. V = dM/ds.

        Moments are those at the points; the other forces jump there, as loads do: the mean is taken, and at
        ends the line through the two nearest bars.
        """
        columns, signs = [0, 2, 1, 3, 4, 5], [1.0, -1.0, -1.0, 1.0, -1.0, 1.0]
        first, last = -self.ends[chain, :6][:, columns] * signs, self.ends[chain, 6:][:, columns] * signs
        middle = 0.5 * (first + last)
        if closed:
            before = np.roll(middle, 1, axis=0), np.roll(last, 1, axis=0)
            return np.hstack([0.5 * (before[0] + middle)[:, :4], 0.5 * (before[1] + first)[:, 4:]])
        far = middle[1:] if len(middle) > 1 else middle
        ends = 1.5 * middle[:1] - 0.5 * far[:1], 1.5 * middle[-1:] - 0.5 * middle[-2:][:1]
        forces = np.vstack([ends[0], 0.5 * (middle[:-1] + middle[1:]), ends[1]])
        moments = np.vstack([first[:1], 0.5 * (last[:-1] + first[1:]), last[-1:]])
        return np.hstack([forces[:, :4], moments[:, 4:]])


def bar_axes(X: Floats, bars: Ints, up: Floats) -> tuple[Floats, Floats]:
    """(b,3,3) rows: along each bar (b,2) on X (n,3), across, upright; and (b,) its length.

    >>> axes, length = bar_axes(np.array([[0.0, 0, 0], [2, 0, 0]]), np.array([[0, 1]]), np.eye(3)[2])
    >>> axes[0].tolist(), length.tolist()
    ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [2.0])
    """
    along = X[bars[:, 1]] - X[bars[:, 0]]
    length = np.linalg.norm(along, axis=1)
    along = along / length[:, None]
    across = np.cross(up, along)
    stands = np.linalg.norm(across, axis=1) <= UPRIGHT
    across[stands] = np.cross(np.eye(3)[np.abs(up).argmin()], along[stands])
    across /= np.linalg.norm(across, axis=1)[:, None]
    return np.stack([along, across, np.cross(along, across)], axis=1), length


def _local(B: Floats, L: Floats) -> Floats:
    """(b,12,12) the stiffness of bars in their axes."""
    K = np.zeros((len(B), 12, 12))
    for at, value in ((0, B[:, 0] / L), (3, B[:, 3] / L)):
        K[:, at, at] = K[:, at + 6, at + 6] = value
        K[:, at, at + 6] = K[:, at + 6, at] = -value
    unit = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]], dtype=float)
    for inertia, place, slope in ((B[:, 1], [2, 4, 8, 10], -1.0), (B[:, 2], [1, 5, 7, 11], 1.0)):
        lengths = np.stack([np.ones_like(L), slope * L, np.ones_like(L), slope * L], axis=1)
        block = (inertia / L**3)[:, None, None] * unit * lengths[:, :, None] * lengths[:, None, :]
        K[:, np.array(place)[:, None], place] += block
    return K
