"""Where a saddle leads: down its unstable mode on both sides, to a minimum, or without end; and back to good
triangles there."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats
from ..base.errors import MissingExtra, SurfaceError
from ..forces.functional import energy_at, patch_areas
from ..forces.pinching import standing_part
from ..meshing.quality import worst_quality
from ..meshing.remeshing import remesh
from ..solvers import solve_once
from ..solvers.attempt import Log, NewtonOptions, NewtonRun
from ..solvers.homotopy import MIN_QUALITY
from ..solvers.result import Result, Status
from ..solvers.state import SolverState
from ..surface import Surface
from .shapes import Shape

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


def with_good_triangles(surface: Surface) -> Surface:
    """An equilibrium; with poor triangles on a new mesh of about as many, if it is there and mmgpy is.

    Along a branch and on a way down vertices move along the normals: far from the start triangles are long.
    """
    part = standing_part(surface)
    if worst_quality(part.surface.vertices, part.quality_faces) >= MIN_QUALITY:
        return surface
    edge = (4.0 / 3.0**0.5 * float(patch_areas(surface).sum()) / surface.m) ** 0.5
    try:
        result = solve_once(remesh(surface, edge), target="stationary")
    except (MissingExtra, SurfaceError):
        return surface
    near = result.converged and Shape.of(result.surface).distance(Shape.of(surface)) <= edge
    return result.surface if near else surface
