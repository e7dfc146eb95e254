"""A point of a branch: equilibrium and one more equation, its tangent, its index, and where others leave.

The unknowns are the positions X and the parameter λ:

    r(X, λ) = B(X)ᵀ ∇E(X; λ) = 0,    g(X, λ) = 0

with g a condition on arclength, volume, height or λ itself. Where λ moves the boundary, derivatives by λ are
total ones. A step of Newton's method solves

    [ J   f ] [ s ]     [ -r ]        J s = dr along s,  f = Bᵀ ∂∇E/∂λ
    [ cᵀ  d ] [ δλ]  =  [ -g ]        c = Bᵀ ∂g/∂X,  d = ∂g/∂λ

by GMRES. J is applied, not assembled: s moves the vertices by Bs, the insides of the sheets follow
their junctions, and the bases B turn (``linearise``). At a fold J is singular; the bordered matrix is not
(``stability.bordered``; Keller 1977 for the arclength). Rooms of prescribed volume add the unknown δ of each
and the equation V(X) = V̄(λ): then s stands for both, and ``Equilibrium.times`` for J.

At a bifurcation an eigenvalue of J passes 0 with a mode φ, and the branch does not turn. Equilibria that
leave along ±φ are searched for with r(X, λ) = 0 and ⟨φ, X - X*⟩ = ±ε, λ free: at the distance ε along φ
Newton's method cannot fall back on the known branch (Keller 1977; Seydel 2010, ch. 5).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...base.arrays import Floats
from ...base.errors import OptionError
from ...base.tolerances import BRANCH_END, NOISE, NULL_MODE, ON_BRANCH
from ...stability.bordered import BorderedFactor, solve_preconditioned
from ...stability.factorisation import SingularMatrix
from ...stability.modes import lowest
from .options import FollowOptions
from .state import BranchMesh, BranchState

ITERATIONS = 12  # most Newton steps of a correction
SLOW = 0.8  # ratio of successive residuals; three in a row above it end the correction
TANGENT_ACCURACY = 1e-6  # relative, to which the tangent's linear system is solved
DRIFT = 1e-6  # of the size: mean displacement of a mode of size 1 below which it has no direction
ALONG = 0.5  # cosine between mode and branch from which the branch itself turns: a fold


class NotOnBranch(ArithmeticError):
    """No point of the branch was found there; the message says why."""


class MeshCollapsed(NotOnBranch):
    """Triangles collapse or turn over on the way."""


class ContactChanged(NotOnBranch):
    """The contact of a wall with Π may change near this state."""

    def __init__(self, near: BranchState) -> None:
        super().__init__("the contact of a wall with the plane changes")
        self.near = near


@dataclass(frozen=True, eq=False)
class Constraint:
    """The equation g(X, λ) = 0 beside equilibrium: g, of order 1, with ∂g/∂X (n,3) and ∂g/∂λ.

    ``parameter`` : λ, if the equation gives it: then it has that value to the last digit.
    """

    value: Callable[[BranchState], float]
    gradient: Callable[[BranchState], Floats]
    rate: float
    parameter: float | None = None


def fixed_parameter(parameter: float, scale: float) -> Constraint:
    return Constraint(
        lambda at: (at.parameter - parameter) / scale, lambda at: np.zeros_like(at.X), 1.0 / scale, parameter
    )


def fixed_arclength(near: BranchState, row: Floats, rate: float) -> Constraint:
    """⟨row, X - X₀⟩ + rate (λ - λ₀) = 0, pseudo-arclength: across the tangent form at a state."""
    return Constraint(
        lambda at: float((row * (at.X - near.X)).sum()) + rate * (at.parameter - near.parameter),
        lambda _: row,
        rate,
    )


def fixed_volume(mesh: BranchMesh, volume: float) -> Constraint:
    unit = mesh.size**3
    return Constraint(lambda at: (at.volume - volume) / unit, lambda at: at.volume_gradient / unit, 0.0)


def fixed_height(mesh: BranchMesh, vertex: int, height: float) -> Constraint:
    """The height of one vertex over Π is given."""
    plane, unit = mesh.surface.plane, mesh.size
    row = np.zeros((mesh.surface.n, 3))
    row[vertex] = np.array(plane.normal) / unit
    return Constraint(lambda at: float(plane.height(at.X[vertex]) - height) / unit, lambda _: row, 0.0)


class BorderedMatrix:
    """The matrix [[J, f], [cᵀ, d]] at a state, with A factorised.

    The last row is ⟨row, motion⟩ + rate δλ, with what follows the boundary, in a ``unit`` like the others.
    """

    def __init__(self, at: BranchState, row: Floats, rate: float) -> None:
        self.at, self.row = at, row
        self.rate = rate if at.carried is None else rate + float((row * at.carried).sum())
        try:
            self.second = at.rest.factorised(soften=False)
        except SingularMatrix as error:
            raise NotOnBranch(f"the Hessian has no factorisation ({error})") from None
        size = float(np.linalg.norm(at.parameter_derivative)) or 1.0
        self.unit = size / float(np.linalg.norm(row) + abs(rate))

    def solve(self, right: Floats, last: float, accuracy: float) -> tuple[Floats, float]:
        """(s, δλ) with  J s + f δλ = right (N+r,),  ⟨row, motion⟩ + rate δλ = last."""
        at, unit = self.at, self.unit
        c = np.append(at.rest.space.to_coordinates(self.row), np.zeros(len(right) - at.rest.space.size))
        f = at.parameter_derivative[:, None]
        inverse = BorderedFactor(self.second.bordered, f, unit * c[None], unit * self.rate)
        if not np.isfinite(inverse.schur).all() or not inverse.schur.any():
            raise NotOnBranch("the bordered matrix is singular: branches meet here")
        right = np.append(right, last * unit)
        z, _ = solve_preconditioned(self._times, inverse.solve, right, accuracy, restart=20, cycles=2)
        return z[:-1], float(z[-1])

    def _times(self, z: Floats) -> Floats:
        """The matrix times a vector (N+r+1,)."""
        at, size = self.at, self.at.rest.space.size
        d = at.moved(at.motion(z[:size])) - at.aligned
        along = float((self.row * d).sum())
        change = at.rest.times(d, z[size:-1]) + at.parameter_derivative * z[-1]
        return np.append(change, self.unit * (along + self.rate * z[-1]))


def correct(start: BranchState, constraint: Constraint, tolerance: float) -> BranchState:
    """The point of the branch near a state that meets the constraint too; NotOnBranch where there is none."""
    mesh, at, asked = start.mesh, start, constraint.parameter
    if asked is not None and asked != start.parameter:
        at = start.step(np.zeros_like(start.X), asked, start.iterations)
    last, slow = np.inf, 0
    for iteration in range(1, ITERATIONS + 2):
        if not mesh.line.allows(at.parameter):
            what = "volume would be" if "volumes" in mesh.line.rates else "tension would reach"
            raise NotOnBranch(f"a {what} 0 at the parameter {at.parameter:g}")
        if iteration > 1 and at.quality < BRANCH_END:
            raise MeshCollapsed("triangles collapse")
        if iteration > 1 and mesh.reaches_plane(at.X).any():
            raise ContactChanged(start)  # beyond Π the walls' forces mislead Newton's method
        g = constraint.value(at)
        if at.rest.residual <= tolerance and abs(g) <= ON_BRANCH:
            return at
        error = at.rest.residual + abs(g)
        slow = 0 if error < SLOW * last else slow + 1
        if slow >= 3 and at.rest.residual <= NOISE * mesh.rounding and abs(g) <= ON_BRANCH:
            return at
        if slow >= 3 or not np.isfinite(at.rest.residual + g):
            break
        last = error
        matrix = BorderedMatrix(at, constraint.gradient(at), constraint.rate)
        s, change = matrix.solve(-at.rest.defects, -g, 1e-3)
        size = at.rest.space.size
        step = at.motion(s[:size], change)
        if not np.abs(step).max() < mesh.size:
            break
        value = at.parameter + change if asked is None else asked
        at = at.step(step, value, iteration, s[size:])
    raise NotOnBranch(f"Newton's method does not converge (residual {at.rest.residual:.1e})")


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
