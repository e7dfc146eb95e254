"""NLopt's L-BFGS on the same energy and supports, to compare with the paper's flow."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import nlopt
import numpy as np

from ..base.arrays import Floats
from ..base.tolerances import COLLAPSED
from ..base.validate import check_options, integer, limited, number
from ..meshing.quality import worst_quality
from ..surface import Surface
from .evaluate import Evaluator, Point
from .result import Callback, Progress, Result, Status, until_stopped

ORDINARY = 20  # powers of two from 1: NLopt's fixed numbers do no harm within
COLLAPSES = (
    "its triangles collapse, as that lowers E, which depends on where vertices lie along the surface, too;"
    " method='newton' moves them across it only"
)
SAME_ENERGY = 1e-13  # of the energy: two energies closer than this are equal in floats


@dataclass(frozen=True)
class LbfgsOptions:
    """Options of L-BFGS.

    Parameters
    ----------
    tolerance : converged when ‖∇E‖² ≤ tolerance, force²; 0 to go on until no step helps. Where
        all forces are small it is taken relative to them; see ``converged_below``.
    evaluations : the most evaluations of E and ∇E; NLopt counts no iterations.
    memory : number of pairs of moves and gradient changes that approximate the Hessian; 0 lets NLopt choose.
    inflation : diverged when the bounding box is more than this many times its first diagonal.
    """

    tolerance: float | None = limited(1e-8, number, least=0.0)
    evaluations: int = limited(2000, integer, least=1)
    memory: int = limited(10, integer, most=1000)
    inflation: float = limited(10.0, number, above=1.0)
    __post_init__ = check_options


class Coordinates:
    """The unknowns of a surface: three for a free vertex, two along its plane for a sliding one.

    They are displacements divided by √(4 α), α the largest tension. L-BFGS starts with the step 1, here
    -∇E / (4 α): about the longest the stiffest vertex takes (Σ cot is 3.5 on an equilateral mesh). NLopt
    bounds its steps by fixed numbers, so where size · √α is far from 1, they are in a power of two near it.

    >>> from pcmc import Patch, Surface
    >>> sail = Surface([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]], [0],
    ...                [Patch("sail", 1.0, pressure=0.0)], fixed=[0], on_plane=[1])
    >>> Coordinates(sail).count
    5
    """

    def __init__(self, surface: Surface) -> None:
        self.start = surface.vertices
        self.free = np.flatnonzero(surface.free)
        # The last two right singular vectors of nᵀ span what is perpendicular to it.
        self.sliding = [
            (np.flatnonzero(mask), np.linalg.svd(np.array([plane.normal]))[2][1:])
            for plane, mask in surface.sliding
        ]
        stiffness = np.sqrt(surface.tensions.max() or 1.0)
        self.unit = 0.5 / stiffness
        exponent = math.frexp(surface.size * stiffness)[1]
        self.scale = math.ldexp(1.0, exponent) if abs(exponent) > ORDINARY else 1.0
        self.count = 3 * len(self.free) + 2 * sum(len(vertices) for vertices, _ in self.sliding)

    def positions(self, s: Floats) -> Floats:
        """X (n,3) of the unknowns s (count,), which are zero at the start."""
        X = self.start.copy()
        moves = (self.unit * self.scale) * s
        cut = 3 * len(self.free)
        with np.errstate(all="ignore"):  # after an overflow the energy is not finite
            X[self.free] += moves[:cut].reshape(-1, 3)
            for vertices, basis in self.sliding:
                end = cut + 2 * len(vertices)
                X[vertices] += moves[cut:end].reshape(-1, 2) @ basis
                cut = end
        return X

    def reduce(self, gradient: Floats) -> Floats:
        """∂E/∂s (count,) of ∇E (n,3), in units of scale²."""
        along = [(gradient[vertices] @ basis.T).ravel() for vertices, basis in self.sliding]
        return (self.unit / self.scale) * np.concatenate([gradient[self.free].ravel(), *along])


class Objective:
    """The function that NLopt calls. It measures, records, and remembers the best point."""

    def __init__(self, surface: Surface, options: LbfgsOptions, callback: Callback | None) -> None:
        self.surface, self.options, self.callback = surface, options, callback
        self.coordinates = Coordinates(surface)
        self.evaluate = Evaluator(surface, options.tolerance, options.inflation)
        self.rows: list[dict[str, Any]] = []  # of the history
        self.best: Point | None = None  # of least energy; the converged one if there is one
        self.status: Status | None = None  # why the last point ends the run
        self.raised: BaseException | None = None  # by the callback, until NLopt has returned
        self.halt: Callable[[], object] = lambda: None  # makes NLopt stop

    def __call__(self, s: Floats, out: Floats) -> float:
        """E at s, ∂E/∂s into ``out``; NLopt may call again after ``halt``, and must see no exception."""
        if self.status is None and self.raised is None:
            try:
                point = self.visit(self.coordinates.positions(s))
            except BaseException as error:
                self.raised = error
        if self.status is not None or self.raised is not None:
            self.halt()
            return math.nan
        if out.size:
            out[:] = self.coordinates.reduce(point.gradient)
        return point.energy / self.coordinates.scale**2

    def visit(self, X: Floats) -> Point:
        """Measure and record one point, and set the status if it is the last."""
        point = self.evaluate(X)
        self.status = self.evaluate.ending(point)
        if point.finite or not self.rows:
            self.rows.append(self.evaluate.row(point))
            best = self.best or point  # the one of less energy, or of the same to rounding and less force
            other = abs(point.energy - best.energy) > SAME_ENERGY * abs(best.energy)
            better = point.energy < best.energy if other else point.squared < best.squared
            self.best = point if better or self.status is Status.CONVERGED else best
        if self.status is None and self.evaluate.count >= self.options.evaluations:
            self.status = Status.ITERATION_LIMIT  # NLopt's own limit waits for a step
        if self.callback is not None and point.finite:
            self.callback(Progress(len(self.rows), lambda: self.surface.moved(X), self.rows[-1]))
        return point

    def minimize(self) -> Status:
        """Run NLopt; why it stopped."""
        if self.coordinates.count == 0:
            return Status.CONVERGED
        optimizer = nlopt.opt(nlopt.LD_LBFGS, self.coordinates.count)
        optimizer.set_min_objective(self)
        optimizer.set_vector_storage(self.options.memory)
        self.halt = optimizer.force_stop
        try:
            optimizer.optimize(np.zeros(self.coordinates.count))
        except Exception:  # NLopt's exceptions have no common base and no message: use its result code
            if self.status is self.raised is None and optimizer.last_optimize_result() > 0:
                raise
        finally:
            # NLopt holds a reference to the objective that the garbage collector does not see:
            # remove the objective's references to NLopt and to the exception's frames
            self.halt = lambda: None
            raised, self.raised = self.raised, None
        if raised is not None:
            raise raised
        return self.status or Status.STALLED


def lbfgs(surface: Surface, options: LbfgsOptions | None = None, callback: Callback | None = None) -> Result:
    """Minimise E over the free coordinates with NLopt's LD_LBFGS (Nocedal 1980; Luksan's code).

    The ``history`` (``evaluation``, ``energy``, ``gradient_squared``) has a row for each evaluation, trials
    of the line search included: NLopt shows no more. The result is the surface of least energy seen, measured
    once more where the last trial was not the best. Status STALLED when NLopt's line search finds no step:
    on most roofs with walls or uneven triangles, as E falls without end where triangles collapse.

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> lbfgs(pyramid).message
    'lbfgs: converged: the residual is below its tolerance'
    """
    objective = Objective(surface, options or LbfgsOptions(), callback)
    status = until_stopped(objective.minimize, Status.STOPPED)
    evaluate, best, rows = objective.evaluate, objective.best, objective.rows
    if best is None or (rows[-1]["energy"], rows[-1]["gradient_squared"]) != (best.energy, best.squared):
        best = evaluate(surface.vertices if best is None else best.X)
        rows.append(evaluate.row(best))
    end, status = surface.moved(best.X), objective.status or status
    before, after = (worst_quality(one.vertices, one.faces) for one in (surface, end))
    note = COLLAPSES if status is not Status.CONVERGED and after < COLLAPSED <= before else ""
    return Result(end, status, "lbfgs", best.energy, len(rows), evaluate.count, rows, note)
