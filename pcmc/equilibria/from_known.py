"""Equilibria from others that are known: around them, down from saddles, and between minima.

Deflated Newton keeps away from the known ones. At an equilibrium the factor  1 + (σ/D)²  has a pole, D the
distance of the shapes (``shapes``). So the zeros of  M r,  r = Bᵀ∇E and M the product of these factors over
all known ones, are the other equilibria (Farrell, Birkisson and Funke 2015). The Newton step of M r is that
of r times a number,

    d = - c B J⁻¹ r,    c = 1 / (1 - m),    m the derivative of log M along the step of r,

which turns back (c < 0) where that would lead to a known one.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from ..base.arrays import Floats
from ..base.errors import MissingExtra, SurfaceError
from ..base.tolerances import COLLAPSED
from ..forces.functional import energy_at, patch_areas
from ..forces.loose_parts import part_size
from ..forces.pinching import standing_part
from ..meshing.quality import worst_quality
from ..meshing.remeshing import remesh
from ..solvers import solve_once
from ..solvers.attempt import Log, NewtonOptions, NewtonRun
from ..solvers.homotopy import MIN_QUALITY
from ..solvers.result import Result, Status, unless_stopped
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
FIRST = 0.02  # of the size: the largest displacement of the first step off a saddle
HALVINGS = 6  # of it, until the energy is lower there
SMOOTH = 30  # steps of smooth descent before Newton's: these go down where they begin, and do not leap
IMAGES = 9  # between two minima, on the straight way from one to the other


def deflated_newton(start: Surface, known: Sequence[Shape]) -> Result | None:
    """The equilibrium that deflated Newton finds from a start; None if it finds none.

    It may be one of those known: where the way to the last steps is Newton's own.
    """
    with suppress(SingularMatrix):
        state = SolverState(start, MIN_QUALITY)
        stepper = Stepper(state, minimum=False)
        for _ in range(STEPS):
            if not np.isfinite(state.energy) or state.quality < COLLAPSED:
                break
            if state.at.residual < NEAR:
                return _stationary(state.result_surface())
            if not _deflated_step(state, stepper, known):
                break
            state.maintain_mesh()
    return None


def _stationary(start: Surface) -> Result | None:
    result = unless_stopped(solve_once(start, target="stationary"))
    return result if result.converged else None


def _deflated_step(state: SolverState, stepper: Stepper, known: Sequence[Shape]) -> bool:
    """One step, shortened until it keeps the triangles; False if none does."""
    stepper.drop_outdated()
    second = stepper.factorise()
    if second is None:
        return False
    d, pressures, _ = stepper.direction(second)

    def log_factors(t: float) -> float:  # log M, a part t of the step ahead
        shape, least = Shape(state.at.X + t * d, state.at.classes.faces), 1e-9 * state.size
        far = np.array([max(shape.distance(other), least) for other in known])  # 0 where it is one of these
        return float(np.log1p((WIDTH * state.size / far) ** 2).sum())

    slope = (log_factors(DIFFERENCE) - log_factors(0.0)) / DIFFERENCE
    share = 1.0 / (1.0 - slope) if abs(1.0 - slope) > DIFFERENCE else 1.0 / DIFFERENCE
    most = LONGEST * state.size / float(np.linalg.norm(d, axis=1).max())
    share = float(np.clip(share, -most, most))
    for t in (share * length for length in LENGTHS):
        X, down = state.displaced(t * d)
        if not state.spoils_triangles(X):
            state.change_pressures(t * pressures)
            state.move(X, down)
            return True
    return False


def way_down(saddle: Surface, mode: Floats) -> tuple[Surface, Status]:
    """The end of the way down from a saddle along a mode (n,3), with its sign; CONVERGED at a minimum."""
    state = SolverState(saddle, 0.0)
    unit = mode * (FIRST * part_size(saddle) / np.linalg.norm(mode, axis=1).max())
    for t in 0.5 ** np.arange(HALVINGS):
        X = state.keep_volumes(state.displaced(t * unit)[0])
        if state.energy_at(X) < state.energy and not state.spoils_triangles(X):
            run = NewtonRun(state.result_surface(X), NewtonOptions(), Log(None), 0, smooth_steps=SMOOTH).run()
            return run.state.result_surface(), run.status
    return saddle, Status.STALLED


def pass_between(one: Surface, other: Surface) -> Result | None:
    """The stationary surface near the highest on the straight way between two minima; None without one.

    Both have the same mesh. Where the way does not rise, nothing is between them.
    """
    shares = np.linspace(0.0, 1.0, IMAGES + 2)
    ways = [(1.0 - t) * one.vertices + t * other.vertices for t in shares]
    highest = int(np.argmax([energy_at(one, X) for X in ways]))
    return None if highest in (0, len(ways) - 1) else _stationary(one.moved(ways[highest]))


def with_good_triangles(surface: Surface) -> Surface:
    """An equilibrium; with poor triangles on a new mesh of about as many, if it is there and mmgpy is.

    Along a branch and on a way down vertices move along the normals: far from the start triangles are long.
    """
    part = standing_part(surface)
    if worst_quality(part.surface.vertices, part.quality_faces) >= MIN_QUALITY:
        return surface
    edge = (4.0 / 3.0**0.5 * float(patch_areas(surface).sum()) / surface.m) ** 0.5
    with suppress(MissingExtra, SurfaceError):
        result = _stationary(remesh(surface, edge))
        if result is not None and Shape.of(result.surface).distance(Shape.of(surface)) <= edge:
            return result.surface
    return surface
