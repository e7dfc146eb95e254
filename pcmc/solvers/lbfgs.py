"""NLopt's L-BFGS on the same energy and supports: a standard to set the paper's flow against."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import nlopt
import numpy as np
import pandas as pd

from ..arrays import Floats
from ..surface import Surface
from . import options as check
from .evaluate import Evaluator, Point, extent
from .result import Callback, Progress, Result, Status

COLUMNS = ("evaluation", "energy", "gradient_squared")
NOISE = 1e-13  # of the energy: two energies closer than this are equal in floats


@dataclass(frozen=True)
class LbfgsOptions:
    """What L-BFGS may be told.

    Parameters
    ----------
    tolerance : converged when ‖∇E‖² ≤ tolerance, force²; 0 or None to go on until no step helps.
    evaluations : the most evaluations of E and ∇E; NLopt counts no iterations.
    memory : how many pairs of moves and gradient changes the Hessian is guessed from; 0 lets NLopt
        choose.
    inflation : diverged when the bounding box is more than this many times its first diagonal.
    """

    tolerance: float | None = 1e-8
    evaluations: int = 2000
    memory: int = 10
    inflation: float = 10.0

    def __post_init__(self) -> None:
        if self.tolerance is not None:
            check.number("tolerance", self.tolerance, least=0.0)
        check.whole("evaluations", self.evaluations, least=1)
        check.whole("memory", self.memory)
        check.number("inflation", self.inflation, above=1.0)


class Coordinates:
    """The unknowns of a surface: three for a free vertex, two along Π for a sliding one.

    They are displacements divided by √(4 α), α the largest tension. L-BFGS starts with the step 1,
    here the move -∇E / (4 α): about the longest the stiffest vertex takes (Σ cot is 3.5 on an
    equilateral mesh). Its later steps do not depend on the unit.

    >>> from pcmc import Patch, Surface
    >>> sail = Surface([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]], [0],
    ...                [Patch("sail", 1.0, pressure=0.0)], fixed=[0], on_plane=[1])
    >>> Coordinates(sail).count
    5
    """

    def __init__(self, surface: Surface) -> None:
        self.start = surface.vertices
        self.free = np.flatnonzero(surface.free)
        self.sliding = np.flatnonzero(surface.on_plane)
        # The last two right singular vectors of nᵀ span what is perpendicular to it.
        self.basis = np.linalg.svd(np.array([surface.plane.normal]))[2][1:]
        self.unit = 0.5 / np.sqrt(surface.tensions.max() or 1.0)
        self.count = 3 * len(self.free) + 2 * len(self.sliding)

    def positions(self, s: Floats) -> Floats:
        """X (n,3) of the unknowns s (count,), which are zero at the start."""
        X = self.start.copy()
        moves = self.unit * s
        cut = 3 * len(self.free)
        with np.errstate(all="ignore"):  # beyond the floats: the energy will say so
            X[self.free] += moves[:cut].reshape(-1, 3)
            X[self.sliding] += moves[cut:].reshape(-1, 2) @ self.basis
        return X

    def reduce(self, gradient: Floats) -> Floats:
        """∂E/∂s (count,) of ∇E (n,3)."""
        along = gradient[self.sliding] @ self.basis.T
        return self.unit * np.concatenate([gradient[self.free].ravel(), along.ravel()])


class Stop(Exception):
    """Ends NLopt's run from within the objective, with the status to report."""

    def __init__(self, status: Status) -> None:
        self.status = status


class Objective:
    """What NLopt calls: measures, records, and keeps the best point for the end."""

    def __init__(self, surface: Surface, options: LbfgsOptions, callback: Callback | None) -> None:
        self.surface, self.options, self.callback = surface, options, callback
        self.coordinates = Coordinates(surface)
        self.evaluate = Evaluator(surface)
        self.rows: list[tuple[Any, ...]] = []
        self.best: Point | None = None
        self.raised: BaseException | None = None
        self.halt: Callable[[], object] = lambda: None

    def __call__(self, s: Floats, out: Floats) -> float:
        """E at s, ∂E/∂s into ``out``.

        NLopt may call again after it was told to stop, and must not see an exception then.
        """
        if self.raised is not None:
            return math.nan
        try:
            point = self.visit(self.coordinates.positions(s))
        except BaseException as error:
            self.raised = error
            self.halt()
            return math.nan
        if out.size:
            out[:] = self.coordinates.reduce(point.gradient)
        return point.energy

    def visit(self, X: Floats) -> Point:
        """Measure and record one point; Stop when it is the last."""
        point = self.evaluate(X)
        converged = point.squared <= (self.options.tolerance or 0.0)
        if point.finite or not self.rows:
            self.rows.append((self.evaluate.count, point.energy, point.squared))
            if self.best is None or converged or _better(point, self.best):
                self.best = point
        if not point.finite:
            raise Stop(Status.NON_FINITE)
        if self.callback is not None:
            named = dict(zip(COLUMNS, self.rows[-1], strict=True))
            self.callback(Progress(len(self.rows), lambda: self.surface.moved(X), named))
        if converged:
            raise Stop(Status.CONVERGED)
        if extent(X) > self.options.inflation * self.surface.size:
            raise Stop(Status.DIVERGED)
        return point


def lbfgs(
    surface: Surface, options: LbfgsOptions | None = None, callback: Callback | None = None
) -> Result:
    """Minimise E over the free coordinates with NLopt's LD_LBFGS (Nocedal 1980; Luksan's code).

    The same energy and supports as the paper's flow. NLopt shows its evaluations only, not which of
    them end an iteration, so the history has a row for each, the line search's trials among them.

    Returns
    -------
    Result
        The surface of least energy seen. ``history``: ``evaluation``, ``energy``,
        ``gradient_squared``; its last row is the returned surface, measured once more where the
        last trial was not the best. Status STALLED when NLopt's line search finds no step, which
        it reports as an error without words.

    Examples
    --------
    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> lbfgs(pyramid).message
    'lbfgs: converged: the residual is below its tolerance'
    """
    objective = Objective(surface, options or LbfgsOptions(), callback)
    status = _run(objective)
    best, rows = objective.best, objective.rows
    if best is None:  # interrupted before the first point was measured
        best = objective.evaluate(surface.vertices)
    if not rows or rows[-1][1:] != (best.energy, best.squared):
        best = objective.evaluate(best.X)
        rows.append((objective.evaluate.count, best.energy, best.squared))
    return Result(
        surface=surface.moved(best.X),
        status=status,
        method="lbfgs",
        energy=best.energy,
        iterations=len(rows),
        evaluations=objective.evaluate.count,
        history=pd.DataFrame(rows, columns=list(COLUMNS)),
    )


def _run(objective: Objective) -> Status:
    """Hand the objective to NLopt; why it stopped, in our words."""
    options, unknowns = objective.options, objective.coordinates.count
    if unknowns == 0:
        return Status.CONVERGED
    optimizer = nlopt.opt(nlopt.LD_LBFGS, unknowns)
    optimizer.set_min_objective(objective)
    optimizer.set_maxeval(options.evaluations)
    optimizer.set_vector_storage(options.memory)
    objective.halt = optimizer.force_stop
    try:
        optimizer.optimize(np.zeros(unknowns))
    except KeyboardInterrupt:
        return Status.STOPPED
    except Exception:  # NLopt's failures are not of one family and have no words; its code decides
        if objective.raised is None and optimizer.last_optimize_result() > 0:
            raise
    finally:
        objective.halt = lambda: None  # each held the other where no garbage collector looks
    if objective.raised is not None:
        return _status(objective.raised)
    limit = optimizer.last_optimize_result() == nlopt.MAXEVAL_REACHED
    return Status.ITERATION_LIMIT if limit else Status.STALLED


def _status(raised: BaseException) -> Status:
    """The status that ended the run; an exception of the callback's own is raised again."""
    if isinstance(raised, Stop):
        return raised.status
    if isinstance(raised, StopIteration | KeyboardInterrupt):
        return Status.STOPPED
    raise raised


def _better(new: Point, best: Point) -> bool:
    """Less energy, or as much within the noise of floats and less force."""
    noise = NOISE * abs(best.energy)
    if abs(new.energy - best.energy) > noise:
        return new.energy < best.energy
    return new.squared < best.squared
