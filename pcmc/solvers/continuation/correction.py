"""Newton's method for a point of a branch: equilibrium and one more equation, solved together.

The unknowns are the positions X and the parameter λ:

    r(X, λ) = B(X)ᵀ ∇E(X; λ) = 0,    g(X, λ) = 0

with g a condition on arclength, volume, height or λ itself. Where λ moves the boundary, derivatives by λ are
total ones. A Newton step solves

    [ J   f ] [ s ]     [ -r ]        J s = dr along s,  f = Bᵀ ∂∇E/∂λ
    [ cᵀ  d ] [ δλ]  =  [ -g ]        c = Bᵀ ∂g/∂X,  d = ∂g/∂λ

by GMRES. J is applied, not assembled: s moves the vertices by Bs, the insides of the sheets follow
their junctions, and the bases B turn (``linearise``). At a fold J is singular; the bordered matrix is not
(``stability.bordered``; Keller 1977 for the arclength). Rooms of prescribed volume add the unknown δ of each
and the equation V(X) = V̄(λ): then s stands for both, and ``Equilibrium.times`` for J.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...base.arrays import Floats
from ...base.tolerances import BRANCH_END, NOISE, ON_BRANCH
from ...stability.bordered import BorderedFactor, solve_preconditioned
from ...stability.factorisation import SingularMatrix
from .state import BranchMesh, BranchState

ITERATIONS = 12  # most Newton steps of a correction
SLOW = 0.8  # ratio of successive residuals; three in a row above it end the correction


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
            raise NotOnBranch(f"a tension would reach 0 at the parameter {at.parameter:g}")
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
