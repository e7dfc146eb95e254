"""``meet``, the search for targets: least misfit by Gauss-Newton steps with exact sensitivities and bounds.

The misfit is φ = ‖r‖, r the relative distances of the quantities from the values wanted; every point tried is
a solve from the last solution. Sheets are nearly linear in 1/α, the unknown for a patch under pressure.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import lsq_linear
from scipy.spatial import cKDTree

from ..base import validate
from ..base.arrays import Bools, Floats, Ints
from ..base.errors import OptionError, SurfaceError
from ..base.interrupts import stop_requested
from ..certificate.balance import coarseness, overload
from ..certificate.measures import vertices_up
from ..solvers import solve_once
from ..solvers.result import Progress, Result, Status
from ..surface import Surface, expect_surface
from ..surface.lagrange import expect_flat
from ..surface.values import of_both_sheets
from .outcome import Design, DesignStatus, NoStart
from .sensitivity import slopes
from .steps import StepPlan, Trial
from .targets import Parameter, Target, as_parameters, as_targets, measure

LEAST_CHANGE = 1e-3  # part of an unknown that a step must change to be worth a solve near failing ones
TRIES = 6  # points tried along a step, each nearer, before it is given up
LEAST_GAIN = 1e-6  # part of φ below which a further step is not worth a solve
DAMPING = 1e-6  # of the largest singular value: chooses among steps of equal misfit
PROPORTIONAL = 0.9  # how much less it costs to change all tensions in proportion than a single one
STIFFEN = 1.5  # factor on tensions while the surface given has no equilibrium
STARTS = 7  # solves with stiffer tensions: 1.5⁶ is 11; if that does not help, tension is not the reason
INFLATION = 4.0  # of a solve, which starts near its solution: a surface that grows more runs away
ITERATIONS = 60  # of a solve, for the same reason
SMALL_CHANGE = 0.02  # of an unknown: below it the mesh is not improved, as quantities depend on it a little
ROUNDING = 1e-12  # of an unknown's size: a bound that is nearer is reached


def meet(
    surface: Surface,
    targets: Target | Iterable[Target],
    vary: Parameter | str | Iterable[Parameter | str],
    *,
    tolerance: float = 1e-7,
    solves: int = 40,
    callback: Callable[[pd.Series], object] | None = None,
    **options: Any,
) -> Design:
    """Find tensions and pressures with which the surface at rest meets the targets.

    Parameters
    ----------
    surface : where to start; it need not be at rest.
    targets : one or several, each with a value or limits. An apex above a held point that is the highest
        now is sought by raising the middle of the roof, until that is the highest.
    vary : the parameters, or names of patches for their tensions. All others stay the same.
    tolerance : largest relative misfit of a target that counts as met.
    solves : largest number of solves.
    callback : called with each new row of the history. Raise StopIteration in it to stop with the best
        surface so far, as Ctrl-C does; any other exception passes through.
    options : of the solver, as in ``pcmc.solve`` with ``method="newton"``.

    Returns
    -------
    Design
        If the targets are out of reach, see its ``status``; no exception is raised.

    Raises
    ------
    OptionError : an unknown patch, a target without a value, bad bounds, a quantity that cannot be
        measured.
    NoStart : a SurfaceError; no equilibrium was found to start from, however high the tensions, and why.

    Examples
    --------
    The pyramid's height h obeys α h / √(1 + h²) = p / 3, so h = 0.75 needs α = 5/9:

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> design = meet(pyramid, Target("apex", "roof", 0.75), "roof")
    >>> design.met, round(design.surface.patches[0].tension, 6)
    (True, 0.555556)
    """
    expect_surface(surface)
    expect_flat(surface, "meet")
    aims, parameters = as_targets(targets), as_parameters(vary)
    for target in aims:
        if not target.limits:
            raise OptionError(f"{target.label}: give value, at_most or at_least", what=target.label)
        measure(surface, target)
    for parameter in parameters:
        parameter.check(surface)
    pressed = {name: p for p in parameters if p.kind == "pressure" for name in p.names}
    for name, parameter in pressed.items():
        for sheet in of_both_sheets(surface, {name: 0.0}):
            if (other := pressed.get(sheet, parameter)) is not parameter:
                text = f"{parameter.label} and {other.label}: both sheets of a cushion have one pressure"
                raise OptionError(f"{text}; leave out one", what="vary", found=other.label)
    validate.callback("callback", callback, "a function of a row")
    validate.positive("tolerance", tolerance)
    validate.integer("solves", solves, least=1)
    given = np.array([p.value(surface) for p in parameters])
    limits = np.array([p.bounds(surface) for p in parameters], dtype=float)
    reciprocal = np.array([p.tension_under_pressure(surface) for p in parameters])
    scale = np.array([t.scale(surface) for t in aims])
    options = {"inflation": INFLATION, "iterations": ITERATIONS, **options}
    known = given, limits, reciprocal, scale
    return Search(surface, aims, parameters, *known, tolerance, solves, callback, options).run()


@dataclass(frozen=True, eq=False)
class Search:
    """A search, and the points that it has tried.

    The unknowns x (p,) are tensions, reciprocal tensions, or pressures.
    """

    surface: Surface
    targets: list[Target]
    parameters: list[Parameter]
    given: Floats  # (p,) values of the parameters
    limits: Floats  # (p,2) their bounds
    reciprocal: Bools  # (p,) the tensions of patches under pressure, whose reciprocals are the unknowns
    scale: Floats  # (targets,) what misfits are divided by
    tolerance: float
    most_solves: int
    callback: Callable[[pd.Series], object] | None
    options: dict[str, Any]
    tried: list[Trial] = field(default_factory=list)

    @cached_property
    def bounds(self) -> Floats:
        """(2,p) the lowest and highest unknowns."""
        return np.sort(self.converted(self.limits.T), axis=0)

    @property
    def solves(self) -> int:
        """How many solves there were, overloaded points left out."""
        return sum(isinstance(trial.result, Result) for trial in self.tried)

    @property
    def failure(self) -> str:
        """Why the last point that failed has no equilibrium; empty if none failed."""
        return next((trial.reason for trial in reversed(self.tried) if not trial.aims), "")

    def converted(self, values: Floats) -> Floats:
        """Parameters to unknowns, or back."""
        safe = np.where(self.reciprocal, values, 1.0)
        return np.where(self.reciprocal, 1.0 / safe, values)

    def values(self, x: Floats) -> Floats:
        """The parameters of unknowns; given ones and bounds to the last digit, though 1/(1/49) is not 49."""
        values = self.converted(x)
        for known in (*self.limits.T, self.given):
            values = np.where(x == self.converted(known), known, values)
        return values

    def sizes(self, here: Trial) -> Floats:
        """(p,) the unit for changes of each unknown."""
        return np.maximum(np.abs(here.x), 0.05 * (self.bounds[1] - self.bounds[0]))

    def ahead(self, here: Trial, step: Floats) -> Floats:
        """The unknowns a step ahead, which are at a bound where they are beside it only by rounding."""
        x = here.x + step
        for bound in self.bounds:
            x = np.where(np.abs(x - bound) <= ROUNDING * self.sizes(here), bound, x)
        return x

    def run(self) -> Design:
        """Search to the end; if asked to stop, end with the best so far."""
        try:
            return self.search()
        except (StopIteration, KeyboardInterrupt) as error:
            stop_requested(error)
            at_rest = [trial for trial in self.tried if trial.aims]
            first = [] if at_rest else [self.trial(self.converted(self.given), _unsolved(self.surface))]
            best = min(at_rest or first, key=lambda trial: trial.phi)
            met = at_rest and self.is_met(best)
            return self.design(DesignStatus.MET if met else DesignStatus.STOPPED, best)

    def search(self) -> Design:
        """Step after step to the targets, or as near to them as possible."""
        here, before = self.first_trial(), None
        while True:
            if self.is_met(here):
                return self.design(DesignStatus.MET, here)
            step, misfit = self.gauss_newton(here)
            if here.phi - misfit <= LEAST_GAIN * here.phi:
                end = self.ahead(here, step)
                bounded = ((end <= self.bounds[0]) | (end >= self.bounds[1])).any()
                return self.design(DesignStatus.AT_BOUND if bounded else DesignStatus.CONFLICT, here)
            plan = StepPlan.of(before if here.aims == self.targets else None, here, step)
            if plan.to_fold is not None:
                change = plan.to_fold * (here.jacobian @ plan.step) * self.scale
                return self.design(DesignStatus.AT_FOLD, here, here.quantities + change)
            there = self.line_search(here, plan)
            if isinstance(there, DesignStatus):
                return self.design(there, here)
            here, before = there, here

    def first_trial(self) -> Trial:
        """The first solution; tensions are raised until there is one."""
        x, reason = np.clip(self.converted(self.given), *self.bounds), ""
        while self.solves < min(STARTS, self.most_solves):
            first = self.solve_from(self.surface, x)
            if first is not None:
                return first
            reason = reason or self.failure  # that of the tensions given says most
            stiffer = np.clip(np.where(self.reciprocal, x / STIFFEN, x), *self.bounds)
            if np.array_equal(stiffer, x):
                break
            x = stiffer
        hint = reason or "raise the tensions that do not vary, or the bounds of those that do"
        raise NoStart(f"meet: no equilibrium was found to start from: {hint}", what="surface")

    def solve_from(self, start: Surface, x: Floats, **quality: Any) -> Trial | None:
        """Solve once, from a surface, unless its boundary cannot carry the load.

        None where no equilibrium is found, or where it is at a fold and has no derivatives.
        """
        values: dict[str, dict[str, float]] = {parameter.key: {} for parameter in self.parameters}
        for parameter, value in zip(self.parameters, self.values(x).tolist(), strict=True):
            values[parameter.key] |= dict.fromkeys(parameter.names, value)
        surface = start.retensioned(**values)
        load = overload(surface)
        if load is not None and load.ratio > 1.0 + coarseness(surface):
            self.record(Trial(x, load))
            return None
        result = solve_once(surface, "newton", **{**quality, **self.options})
        trial = self.trial(x, result) if result.converged else Trial(x, result)
        self.record(trial)
        if result.status is Status.STOPPED:
            raise StopIteration
        return self.with_jacobian(trial) if trial.aims else None

    def trial(self, x: Floats, result: Result) -> Trial:
        quantities = np.array([measure(result.surface, t).value for t in self.targets])
        wanted = self.wanted(quantities)
        pairs = enumerate(zip(quantities, wanted, strict=True))
        aims, values = zip(*(self.aimed(result.surface, k, *pair) for k, pair in pairs), strict=True)
        r = (np.array(values) - wanted) / self.scale
        return Trial(x, result, quantities, r, float(np.linalg.norm(r)), list(aims))

    def aimed(self, surface: Surface, number: int, value: float, wanted: float) -> tuple[Target, float]:
        """The quantity that the search changes for a target, and its value: the target's own, as a rule.

        Where the highest point is held and a higher one is wanted, no small change moves it. There it is the
        height over the point of Π farthest from what is held, until another point is the highest.
        """
        target = self.targets[number]
        if target.quantity == "apex" and wanted - value > self.tolerance * self.scale[number]:
            low, held = vertices_up(surface, target.of), surface.pinned | surface.on_ground
            if held[low[-1]] and not held[low].all():
                before = (trial.aims[number] for trial in self.tried if trial.aims)
                aim = next((aim for aim in before if aim is not target), None) or _middle(surface, low, held)
                return aim, measure(surface, aim).value
        return target, value

    def wanted(self, quantities: Floats) -> Floats:
        """(targets,) the wanted values nearest to these."""
        return np.array([t.nearest(q) for t, q in zip(self.targets, quantities, strict=True)])

    def with_jacobian(self, at: Trial) -> Trial | None:
        """The trial with its derivatives; None at a fold."""
        try:
            found = [own for own, *_ in slopes(at.surface, at.aims, self.parameters)]
        except SurfaceError:
            return None
        by_unknown = np.array(found) * np.where(self.reciprocal, -(self.converted(at.x) ** 2), 1.0)
        return replace(at, jacobian=by_unknown * (at.r != 0.0)[:, None] / self.scale[:, None])

    def is_met(self, at: Trial) -> bool:
        return bool(np.abs(at.r).max() <= self.tolerance)

    def gauss_newton(self, here: Trial) -> tuple[Floats, float]:
        """Step of least linearised misfit within bounds, cut to ``trust``; the misfit of the whole step."""
        size = self.sizes(here)
        A = here.jacobian * size
        mu = DAMPING * float(np.linalg.norm(A, 2)) or 1.0
        low, high = (self.bounds - here.x) / size
        high = np.maximum(high, low + 1e-14)
        # of equal steps the one that changes all tensions alike: sheets and walls at a junction stay nearly
        # in balance while their tensions keep their ratios
        alike = np.array([p.kind in ("tension", "cable") for p in self.parameters], dtype=float)
        alike[~self.reciprocal] *= -1.0
        square = max(1.0, float(alike @ alike))
        metric = np.eye(len(alike)) - PROPORTIONAL * np.outer(alike, alike) / square
        damped = np.vstack([A, mu * metric])
        right = np.append(-here.r, np.zeros(len(size)))
        least = lsq_linear(damped, right, bounds=(low, high), method="bvls", tol=1e-14)
        d = np.clip(least.x, low, high)
        misfit = float(np.linalg.norm(here.r + A @ d))
        d *= min(1.0, here.trust / (np.abs(d).max() or 1.0))
        return d * size, misfit

    def line_search(self, here: Trial, plan: StepPlan) -> Trial | DesignStatus:
        """A trial with less misfit along the step, or why there is none."""
        t, longest = plan.first, float((np.abs(plan.step) / self.sizes(here)).max())
        reason = DesignStatus.SOLVES
        for attempt in range(TRIES):
            if self.solves >= self.most_solves:
                return DesignStatus.SOLVES
            x = self.ahead(here, t * plan.step)
            small = (np.abs(x - here.x) < SMALL_CHANGE * self.sizes(here)).all()
            there = self.solve_from(here.surface, x, **({"min_quality": 0.0} if small else {}))
            if there is not None and there.phi < here.phi:
                more = min(1.0, 2.0 * t * longest) if not attempt else 0.0
                return replace(there, trust=max(t * longest, more))
            reason = DesignStatus.AT_FOLD if there is None else DesignStatus.CONFLICT
            t *= 0.3 if there is None else 0.5
            if there is None and t * longest < LEAST_CHANGE:
                break
        return reason

    def record(self, trial: Trial) -> None:
        """Remember a point that was tried, and call the callback with its row."""
        self.tried.append(trial)
        if self.callback is not None:
            self.callback(pd.Series(self.row(trial)))

    def row(self, trial: Trial) -> dict[str, Any]:
        values = dict(zip((p.label for p in self.parameters), self.values(trial.x).tolist(), strict=True))
        found = dict(zip((t.label for t in self.targets), trial.quantities.tolist(), strict=bool(trial.aims)))
        return values | found | {"status": trial.status, "misfit": trial.phi}

    def design(self, status: DesignStatus, here: Trial, limit: Floats | None = None) -> Design:
        """The design that ends here; ``limit`` (targets,) if it is not the quantities here."""
        if limit is None:
            unknown = status in (DesignStatus.SOLVES, DesignStatus.STOPPED)
            limit = np.full_like(here.quantities, math.nan) if unknown else here.quantities
        missed = np.abs(here.r) > self.tolerance
        targets = {
            "value": here.quantities,
            "dimension": [t.dimension for t in self.targets],
            "wanted": self.wanted(here.quantities),
            "misfit": here.r,
            "met": ~missed,
            "limit": np.where(missed, limit, here.quantities),
        }
        parameters = {
            "start": self.given,
            "value": [p.value(here.surface) for p in self.parameters],
            "dimension": [p.dimension for p in self.parameters],
            "low": self.limits[:, 0],
            "high": self.limits[:, 1],
        }
        assert isinstance(here.result, Result)
        aims = pd.DataFrame(targets, index=[t.label for t in self.targets])
        varied = pd.DataFrame(parameters, index=[p.label for p in self.parameters])
        history = pd.DataFrame([self.row(trial) for trial in self.tried])
        reason = self.failure if status is DesignStatus.AT_FOLD else ""
        return Design(status, here.result, aims, varied, self.solves, history, reason)


def _unsolved(surface: Surface) -> Result:
    """The result of a solve that takes no step."""

    def stop(_: Progress) -> None:
        raise StopIteration

    return solve_once(surface, "newton", stop)


def _middle(surface: Surface, vertices: Ints, held: Bools) -> Target:
    """The height over the vertex of these (k,) that is farthest along Π from the held ones of them."""
    place = surface.plane.to_local(surface.vertices)[:, :2]
    free, fixed = vertices[~held[vertices]], vertices[held[vertices]]
    distance = np.asarray(cKDTree(place[fixed]).query(place[free])[0])
    x, y = place[free[distance.argmax()]].tolist()
    return Target("height", (x, y))
