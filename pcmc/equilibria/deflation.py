"""Deflated Newton: Newton's method that keeps away from the equilibria already known.

At an equilibrium the factor  1 + (σ/D)²  has a pole, D the distance of the shapes (``shapes``). So the zeros
of  M r,  r = Bᵀ∇E and M the product of these factors over all known ones, are the other equilibria (Farrell,
Birkisson and Funke 2015). The Newton step of M r is that of r times a number,

    d = - c B J⁻¹ r,    c = 1 / (1 - m),    m the derivative of log M along the step of r,

which turns back (c < 0) where that would lead to a known one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..base.tolerances import COLLAPSED
from ..solvers import solve_once
from ..solvers.homotopy import MIN_QUALITY
from ..solvers.result import Result
from ..solvers.state import SolverState
from ..solvers.steps import LENGTHS, Stepper
from ..stability.factorisation import SingularMatrix
from ..surface import Surface
from .shapes import Shape

WIDTH = 0.3  # σ, of the size
LONGEST = 0.1  # of the size: the most that a step moves a vertex
STEPS = 40  # at most
DIFFERENCE = 1e-4  # of a step: where the derivative along it is taken
NEAR = 1e-3  # residual from which Newton's method alone goes on


def deflated_newton(start: Surface, known: Sequence[Shape]) -> Result | None:
    """The equilibrium that deflated Newton finds from a start; None if it finds none.

    It may be one of those known: where the way to the last steps is Newton's own.
    """
    try:
        state = SolverState(start, MIN_QUALITY)
        stepper = Stepper(state, minimum=False)
        for _ in range(STEPS):
            if not np.isfinite(state.energy) or state.quality < COLLAPSED:
                return None
            if state.at.residual < NEAR:
                break
            stepper.drop_outdated()
            second = stepper.factorise()
            if second is None:
                return None
            d, pressures, _ = stepper.direction(second)
            shapes = (Shape(state.at.X + t * d, state.at.classes.faces) for t in (0.0, DIFFERENCE))
            here, ahead = (_repulsion(shape, known, state.size) for shape in shapes)
            slope = (ahead - here) / DIFFERENCE
            share = 1.0 / (1.0 - slope) if abs(1.0 - slope) > DIFFERENCE else 1.0 / DIFFERENCE
            most = LONGEST * state.size / float(np.linalg.norm(d, axis=1).max())
            share = float(np.clip(share, -most, most))
            for t in (share * length for length in LENGTHS):
                X, down = state.displaced(t * d)
                if not state.spoils_triangles(X):
                    state.change_pressures(t * pressures)
                    state.move(X, down)
                    break
            else:
                return None
            state.maintain_mesh()
        else:
            return None
    except SingularMatrix:
        return None
    result = solve_once(state.result_surface(), target="stationary")
    return result if result.converged else None


def _repulsion(shape: Shape, known: Sequence[Shape], size: float) -> float:
    """log M."""
    least = 1e-9 * size  # where a start is one of those known
    far = np.array([max(shape.distance(other), least) for other in known])
    return float(np.log1p((WIDTH * size / far) ** 2).sum())
