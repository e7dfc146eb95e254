"""A point of a branch with its tangent, its index and its lowest eigenvalues; and where other branches leave.

At a bifurcation an eigenvalue of J passes 0 with a mode φ, and the branch does not turn. Equilibria that
leave along ±φ are searched for with r(X, λ) = 0 and ⟨φ, X - X*⟩ = ±ε, λ free: at the distance ε along φ
Newton's method cannot fall back on the known branch (Keller 1977; Seydel 2010, ch. 5).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...base.arrays import Floats
from ...base.errors import OptionError
from ...base.tolerances import NULL_MODE
from ...stability.factorisation import SingularMatrix
from ...stability.modes import lowest
from .correction import BorderedMatrix, NotOnBranch, correct, fixed_arclength
from .options import FollowOptions
from .state import BranchMesh, BranchState

TANGENT_ACCURACY = 1e-6  # relative, to which the tangent's linear system is solved
DRIFT = 1e-6  # of the size: mean displacement of a mode of size 1 below which it has no direction
ALONG = 0.5  # cosine between mode and branch from which the branch itself turns: a fold


@dataclass(frozen=True, eq=False)
class Tangent:
    """dX/ds and dλ/ds along a branch, in the metric  ds² = Σ weights |dX|² + (dλ/scale)²."""

    direction: Floats  # (n,3) dX/ds
    slope: float  # dλ/ds
    weights: Floats  # (n,) 1/length²: the first part of ds² is the mean square displacement over size²
    scale: float  # size of λ

    @classmethod
    def along(cls, d: Floats, change: float, weights: Floats, scale: float) -> tuple[Tangent, float]:
        """That of a displacement d (n,3) and a change of λ together; and their length in the metric."""
        length = cls(d, change, weights, scale).length(d, change)
        return cls(d / length, change / length, weights, scale), length

    @property
    def row(self) -> Floats:
        """(n,3) the tangent as a linear form on displacements."""
        return self.weights[:, None] * self.direction

    @property
    def rate(self) -> float:
        """Its entry for changes of λ."""
        return self.slope / self.scale**2

    def length(self, d: Floats, change: float) -> float:
        """Length of a displacement d (n,3) and a change of λ together, in the metric."""
        square = self.weights @ np.einsum("ij,ij->i", d, d)
        return float(np.sqrt(square + (change / self.scale) ** 2))

    def on(self, old: BranchState, new: BranchState) -> Tangent:
        """The tangent on another mesh: each vertex takes it from the nearest one of the old mesh."""
        nearest = cKDTree(old.X).query(new.X)[1]
        return Tangent(self.direction[nearest], self.slope, new.area_weights, self.scale)


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """A point of the branch."""

    state: BranchState
    tangent: Tangent
    eigenvalues: Floats  # all negative ones and at least one more, ascending, force/length³
    index: int  # the number of negative ones
    room_rates: Floats  # (r,) the derivatives of the rooms' pressures by arclength


def branch_point(at: BranchState, before: Tangent | float) -> BranchPoint:
    """The point of the branch at a state on it, its tangent as one nearby or with this sign of dλ/ds."""
    scale = at.mesh.line.scale
    if isinstance(before, Tangent):
        matrix, sense = BorderedMatrix(at, before.row, before.rate), 1.0
    else:
        matrix, sense = BorderedMatrix(at, np.zeros_like(at.X), 1.0 / scale**2), before
    s, slope = matrix.solve(np.zeros(len(at.rest.defects)), sense, TANGENT_ACCURACY)
    size = at.rest.space.size
    tangent, length = Tangent.along(at.motion(s[:size], slope), slope, at.area_weights, scale)
    rates = at.rest.volume_units * s[size:] / length
    with _counted():
        values = lowest(matrix.second, matrix.second.negative + 2)[0]
        values = values if len(values) else np.array([np.inf])  # nothing moves at these volumes
        return BranchPoint(at, tangent, values, matrix.second.negative, rates)


@contextmanager
def _counted() -> Iterator[None]:
    """Where rounding hides the eigenvalues, there is no point of the branch: one beside it will do."""
    try:
        yield
    except SingularMatrix as error:
        raise NotOnBranch(f"the second variation has no eigenvalues that can be told ({error})") from None


def soft_modes(at: BranchState, count: int) -> tuple[Floats, Floats]:
    """The ``count`` eigenvalues (k,) nearest zero, nearest first, and their motions (k,n,3)."""
    with _counted():
        second = at.rest.factorised(soften=False)
        every, fields = lowest(second, second.negative + count + 1)
    nearest = np.argsort(np.abs(every))[:count]
    return every[nearest], np.array([at.motion(at.rest.space.to_coordinates(fields[i])) for i in nearest])


def along_branch(at: BranchPoint, count: int) -> float:
    """Cosine between the tangent and the ``count`` softest modes, in the metric of arclength."""
    tangent = at.tangent
    modes = soft_modes(at.state, count)[1]
    squares = np.einsum("v,kvi,kvi->k", tangent.weights, modes, modes)
    return float(np.linalg.norm(np.einsum("vi,kvi->k", tangent.row, modes) / np.sqrt(squares)))


def leaving(mesh: BranchMesh, parameter: float, options: FollowOptions, row: int) -> list[BranchPoint]:
    """The first point of the branch along φ and of that along -φ, from the bifurcation on a mesh.

    With φ the surface rises over Π in the mean or, if it does not, moves along Π's first axis, or its second.
    OptionError if no mode has the eigenvalue 0 there, or no other branch is found.
    """
    at = BranchState(mesh, mesh.surface.vertices, parameter)
    try:
        values, modes = soft_modes(at, 2)
    except NotOnBranch as reason:
        raise OptionError(f"event {row}: {reason}", what="event", where=row) from None
    if len(values) > 1 and not abs(values[0]) <= NULL_MODE * abs(values[1]):
        nearest = f"the eigenvalues nearest 0 are {values[0]:.3g}, {values[1]:.3g}"
        message = f"no mode turns at event {row}: {nearest}"
        raise OptionError(message, what="event", where=row, found=float(values[0]), expected=0.0)
    weights, scale = at.area_weights, mesh.line.scale
    mode = modes[0] / np.sqrt(np.einsum("v,vi,vi->", weights, modes[0], modes[0]))
    drift = mesh.surface.plane.axes[[2, 0, 1]] @ (weights @ mode)  # over Π, then along it
    clear = np.abs(drift) > DRIFT * weights.sum()
    mode *= np.sign(drift[clear.argmax()]) if clear.any() else 1.0
    return [_off(at, Tangent(sign * mode, 0.0, weights, scale), options, row) for sign in (1.0, -1.0)]


def _off(at: BranchState, mode: Tangent, options: FollowOptions, row: int) -> BranchPoint:
    """The point of the branch at the distance of a step along the mode, or nearer."""
    length, difficulty = min(abs(options.step), options.largest), ""
    while length >= options.smallest:
        ahead = at.step(length * mode.direction, at.parameter)
        try:
            there = correct(ahead, fixed_arclength(ahead, mode.row, 0.0), options.tolerance)
            d, change = there.X - at.X, there.parameter - at.parameter
            return branch_point(there, Tangent.along(d, change, mode.weights, mode.scale)[0])
        except NotOnBranch as reason:
            length, difficulty = 0.5 * length, str(reason)
    message = f"no branch was found along the mode that turns at event {row} ({difficulty})"
    raise OptionError(message, what="event", where=row, found=row)
