"""Where a saddle leads: down its unstable mode on both sides, to a minimum, or without end."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats
from ..forces.functional import energy_at
from ..solvers import solve_once
from ..solvers.attempt import Log, NewtonOptions, NewtonRun
from ..solvers.result import Result, Status
from ..solvers.state import SolverState
from ..surface import Surface

FIRST = 0.02  # of the size: the largest displacement of the first step off a saddle
HALVINGS = 6  # of it, until the energy is lower there
SMOOTH = 30  # steps of smooth descent before Newton's: these go down where they begin, and do not leap
IMAGES = 9  # between two minima, on the straight way from one to the other


def way_down(saddle: Surface, mode: Floats) -> tuple[Surface, Status]:
    """The end of the way down from a saddle along a mode (n,3), with its sign; CONVERGED at a minimum."""
    state = SolverState(saddle, 0.0)
    unit = mode * (FIRST * saddle.size / np.linalg.norm(mode, axis=1).max())
    for t in 0.5 ** np.arange(HALVINGS):
        X, _ = state.displaced(t * unit)
        X = state.keep_volumes(X)
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
    if highest in (0, len(ways) - 1):
        return None
    result = solve_once(one.moved(ways[highest]), target="stationary")
    return result if result.converged else None
