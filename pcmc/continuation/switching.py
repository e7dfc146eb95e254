"""The points where other branches leave a bifurcation.

At a bifurcation an eigenvalue of J passes 0 with a mode φ, and the branch does not turn. There equilibria
that leave along ±φ are searched for on the planes across φ,

    r(X, λ) = 0,    ⟨φ, X - X*⟩ = ±ε,

with λ free: they have the distance ε along φ, so Newton's method cannot fall back on the known branch,
which passes through X* across φ or at an angle (Keller 1977; Seydel 2010, ch. 5).
"""

from __future__ import annotations

import numpy as np

from ..base.errors import OptionError
from .branch_point import BranchPoint, Tangent, branch_point, soft_modes
from .correction import NotOnBranch, correct, fixed_arclength
from .options import FollowOptions
from .state import BranchMesh, State

NULL = 0.05  # of the next eigenvalue: how far from 0 that of the mode may be
DRIFT = 1e-6  # of the size: mean displacement of a mode of size 1 below which it has no direction
ALONG = 0.5  # cosine between mode and branch from which the branch itself turns: a fold


def leaving(mesh: BranchMesh, parameter: float, options: FollowOptions, row: int) -> list[BranchPoint]:
    """The first point of the branch along φ and of that along -φ, from the bifurcation on a mesh.

    φ has the sign with which the surface rises over Π in the mean; where it does not, the one with which
    it moves along Π's first axis, or its second.

    Raises
    ------
    OptionError
        If no mode has the eigenvalue 0 there, or no other branch is found; ``where`` is ``row``.
    """
    at = State(mesh, mesh.surface.vertices, parameter)
    try:
        values, modes = soft_modes(at, 2)
    except NotOnBranch as reason:
        raise OptionError(f"event {row}: {reason}", what="event", where=row) from None
    if len(values) > 1 and not abs(values[0]) <= NULL * abs(values[1]):
        message = (
            f"no mode turns at event {row}: the eigenvalues nearest 0 are {values[0]:.3g}, {values[1]:.3g}"
        )
        raise OptionError(message, what="event", where=row, found=float(values[0]), expected=0.0)
    weights, scale = at.area_weights, mesh.line.scale
    mode = modes[0] / np.sqrt(np.einsum("v,vi,vi->", weights, modes[0], modes[0]))
    drift = mesh.surface.plane.axes[[2, 0, 1]] @ (weights @ mode)  # over Π, then along it
    clear = np.abs(drift) > DRIFT * weights.sum()
    mode *= np.sign(drift[clear.argmax()]) if clear.any() else 1.0
    return [_off(at, Tangent(sign * mode, 0.0, weights, scale), options, row) for sign in (1.0, -1.0)]


def _off(at: State, mode: Tangent, options: FollowOptions, row: int) -> BranchPoint:
    """The point of the branch at the distance of a step along the mode, or nearer."""
    length, difficulty = min(abs(options.step), options.largest), ""
    while length >= options.smallest:
        ahead = at.step(length * mode.direction, at.parameter)
        try:
            there = correct(ahead, fixed_arclength(ahead, mode.row, 0.0), options.tolerance)
            return branch_point(there, _secant(at, there, mode))
        except NotOnBranch as reason:
            length, difficulty = 0.5 * length, str(reason)
    message = f"no branch was found along the mode that turns at event {row} ({difficulty})"
    raise OptionError(message, what="event", where=row, found=row)


def _secant(start: State, end: State, mode: Tangent) -> Tangent:
    d, change = end.X - start.X, end.parameter - start.parameter
    length = mode.length(d, change)
    return Tangent(d / length, change / length, mode.weights, mode.scale)
