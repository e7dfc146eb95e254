"""The search for targets: least misfit by Gauss-Newton steps with exact sensitivities and bounds.

The misfit is φ = ‖r‖, r the relative distances of the quantities from what is wanted; every point tried
is a solve, started from the last solution. Sheets are nearly linear in 1/α, so that is what varies for a
patch under pressure.

At a fold solutions end: the quantity still changes but the parameter does not, λ_fold - λ ~ (q_fold - q)².
The slopes at two points show it coming: they give the step's right length, and the reachable limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import lsq_linear

from ..base.arrays import Bools, Floats
from ..base.errors import SurfaceError
from ..certificate.balance import coarseness, load_ratio
from ..solvers import solve
from ..solvers.result import Progress, Result, Status
from ..surface import Surface
from ..surface.wall_pressures import with_pressures
from .outcome import Design, Reach
from .quantities import Parameter, Target, measure
from .sensitivity import sensitivities

LEAST = 1e-3  # part of an unknown that a step must change to be worth a solve near failing ones
CLOSE = 1e-3  # relative gap of the misfit to a fold at which the search ends there
NEARLY = 0.97  # of the parameters' way to a fold is tried next
TRIES = 6  # points tried along a step, ever nearer, before it is given up
GAIN = 1e-6  # part of φ below which a further step is not worth a solve
DAMPING = 1e-6  # of the largest singular value: among equal steps the best by ``_metric`` is taken
ALIKE = 0.9  # how much cheaper changing all tensions in proportion is than changing a single one
STIFFEN = 1.5  # factor on tensions while the surface given has no equilibrium
STARTS = 7  # solves on that way: 1.5⁶ is 11, and what that does not help has another reason
INFLATION = 4.0  # starts are near solutions: growing beyond this is running away
ITERATIONS = 60  # for the same reason
STILL = 0.02  # of an unknown: below it the mesh is left alone, for quantities feel it a little
OVERLOADED = "overloaded"  # in place of a solve's status, where none was tried


@dataclass(frozen=True, eq=False)
class Tried:
    """A surface on the way: unknowns x, quantities found, relative misfits r and φ = ‖r‖."""

    x: Floats
    result: Result
    found: Floats
    r: Floats
    phi: float


@dataclass(frozen=True, eq=False)
class Point(Tried):
    """A surface at rest on the way, with J = ∂r/∂x."""

    jacobian: Floats


class Search:
    """The search as it stands. Unknowns x are tensions, their reciprocals, or pressures."""

    def __init__(
        self, surface: Surface, targets: list[Target], parameters: list[Parameter],
        tolerance: float, solves: int, callback: Callable[[pd.Series], object] | None,
        options: dict[str, Any],
    ) -> None:  # fmt: skip
        self.surface, self.targets, self.parameters = surface, targets, parameters
        self.tolerance, self.limit, self.callback = tolerance, solves, callback
        self.options = {"inflation": INFLATION, "iterations": ITERATIONS, **options}
        self.low_high = [p.bounds(surface) for p in parameters]
        self.inverse = np.array([_reciprocal(surface, p) for p in parameters])
        self.bounds = np.sort(self.turned(np.array(self.low_high, dtype=float).T), axis=0)
        self.metric = _metric(parameters, self.inverse)
        self.scale = np.array([_scale(surface, t) for t in targets])
        self.trust = 1.0  # the longest step, as a part of the unknowns' sizes
        self.solves = 0
        self.best: Tried | None = None
        self.rows: list[dict[str, Any]] = []

    def turned(self, values: Floats) -> Floats:
        """Parameters to unknowns and back: reciprocals where a sheet's tension varies."""
        safe = np.where(self.inverse, values, 1.0)
        return np.where(self.inverse, 1.0 / safe, values)

    @property
    def spent(self) -> bool:
        """Whether no further solve is allowed."""
        return self.solves >= self.limit

    def run(self) -> Design:
        """Search to one of the ends; asked to stop, end with the best so far."""
        try:
            return self.search()
        except (StopIteration, KeyboardInterrupt):
            if self.best is None:
                return self.ended(Reach.STOPPED, self.tried(self.first(), _as_it_is(self.surface)))
            return self.ended(Reach.MET if self.met(self.best) else Reach.STOPPED, self.best)

    def search(self) -> Design:
        """Step after step to the targets, or as near to them as can be."""
        here, before = self.start(), None
        while True:
            if self.met(here):
                return self.ended(Reach.MET, here)
            step, hopeless = self.gauss_newton(here)
            if hopeless:
                held = (here.x + step <= self.bounds[0]) | (here.x + step >= self.bounds[1])
                return self.ended(Reach.AT_BOUND if held.any() else Reach.CONFLICT, here)
            way = Way.of(before, here, step)
            if way.at_fold:
                limit = here.found + way.to_limit * (here.jacobian @ way.step) * self.scale
                return self.ended(Reach.AT_FOLD, here, limit)
            there, why = self.along(here, way)
            if there is None:
                return self.ended(why, here)
            here, before = there, here

    # -- points --------------------------------------------------------------------------------

    def first(self) -> Floats:
        """The unknowns of the surface given, within their bounds."""
        values = np.array([p.of(self.surface) for p in self.parameters])
        return np.clip(self.turned(values), *self.bounds)

    def start(self) -> Point:
        """The first solution; tensions are raised until there is one."""
        x, point = self.first(), None
        while self.solves < min(STARTS, self.limit):
            point = self.solved(x, self.surface, {})
            stiffer = np.clip(np.where(self.inverse, x / STIFFEN, x), *self.bounds)
            if point is not None or np.array_equal(stiffer, x):
                break
            x = stiffer
        if point is None:
            raise SurfaceError(
                "meet: no equilibrium was found to start from; raise the tensions that do not vary,"
                " or the bounds of those that do"
            )
        return point

    def at(self, x: Floats, near: Point) -> Point | None:
        """The solution with these unknowns, from one nearby; None where none is found."""
        still = bool((np.abs(x - near.x) < STILL * self.sizes(near)).all())
        return self.solved(x, near.result.surface, {"min_quality": 0.0} if still else {})

    def solved(self, x: Floats, start: Surface, quality: dict[str, float]) -> Point | None:
        """Solve once, from a surface, unless its boundary cannot carry the load.

        None where no equilibrium is found, or at a fold, where nothing can be said of what is ahead.
        """
        trial = self.with_unknowns(start, x)
        if load_ratio(trial) > 1.0 + coarseness(trial):
            self.record(x, OVERLOADED)
            return None
        result = solve(trial, "newton", **{**quality, **self.options})
        self.solves += 1
        tried = self.tried(x, result) if result.converged else None
        if tried is not None and (self.best is None or tried.phi < self.best.phi):
            self.best = tried
        self.record(x, result.status.name.lower(), tried)
        if result.status is Status.STOPPED:
            raise StopIteration
        return None if tried is None else self.point(tried)

    def with_unknowns(self, surface: Surface, x: Floats) -> Surface:
        """The surface with the tensions and pressures that the unknowns stand for."""
        chosen: dict[str, dict[str, float]] = {"tension": {}, "pressure": {}}
        for parameter, value in zip(self.parameters, self.turned(x).tolist(), strict=True):
            chosen[parameter.kind][parameter.patch] = value
        return with_pressures(surface, chosen["tension"], chosen["pressure"])

    def tried(self, x: Floats, result: Result) -> Tried:
        """What a solve has given."""
        found = np.array([measure(result.surface, t).value for t in self.targets])
        wanted = np.array([t.nearest(q) for t, q in zip(self.targets, found, strict=True)])
        r = (found - wanted) / self.scale
        return Tried(x, result, found, r, float(np.linalg.norm(r)))

    def point(self, at: Tried) -> Point | None:
        """With the derivatives; None at a fold."""
        try:
            slopes = sensitivities(at.result.surface, self.targets, self.parameters).to_numpy()
        except SurfaceError:
            return None
        jacobian = slopes * np.where(self.inverse, -(self.turned(at.x) ** 2), 1.0)
        jacobian = jacobian * (at.r != 0.0)[:, None] / self.scale[:, None]
        return Point(at.x, at.result, at.found, at.r, at.phi, jacobian)

    def met(self, at: Tried) -> bool:
        """Whether every target is."""
        return bool(np.abs(at.r).max() <= self.tolerance)

    # -- steps ---------------------------------------------------------------------------------

    def gauss_newton(self, here: Point) -> tuple[Floats, bool]:
        """The step to the least misfit within the bounds, as far as slopes tell; whether it is 0."""
        size = self.sizes(here)
        A = here.jacobian * size
        mu = DAMPING * float(np.linalg.norm(A, 2)) or 1.0
        room = (self.bounds - here.x) / size
        room[1] = np.maximum(room[1], room[0] + 1e-14)
        found = lsq_linear(
            np.vstack([A, mu * self.metric]), np.append(-here.r, np.zeros(len(size))),
            bounds=(room[0], room[1]), method="bvls", tol=1e-14,
        )  # fmt: skip
        d = np.clip(found.x, *room)
        left = float(np.linalg.norm(here.r + A @ d))
        hopeless = here.phi - left <= GAIN * here.phi
        d *= min(1.0, self.trust / (np.abs(d).max() or 1.0))
        return d * size, hopeless

    def along(self, here: Point, way: Way) -> tuple[Point | None, Reach]:
        """A point with less misfit on the way; None, and why, where there is none."""
        t, longest = way.first, float((np.abs(way.step) / self.sizes(here)).max())
        why = Reach.SOLVES
        for attempt in range(TRIES):
            if self.spent:
                return None, Reach.SOLVES
            there = self.at(here.x + t * way.step, here)
            if there is not None and there.phi < here.phi:
                self.trust = max(t * longest, min(1.0, 2.0 * t * longest) if not attempt else 0.0)
                return there, Reach.MET
            why = Reach.AT_FOLD if there is None else Reach.CONFLICT
            t *= 0.3 if there is None else 0.5
            if there is None and t * longest < LEAST:
                break
        return None, why

    def sizes(self, here: Point) -> Floats:
        """(parameters,) what a change of each unknown is measured by."""
        return np.maximum(np.abs(here.x), 0.05 * (self.bounds[1] - self.bounds[0]))

    # -- tables --------------------------------------------------------------------------------

    def record(self, x: Floats, status: str, tried: Tried | None = None) -> None:
        """Write a row of the history, and show it to the callback."""
        row = dict(zip((p.label for p in self.parameters), self.turned(x).tolist(), strict=True))
        if tried is not None:
            row |= zip((t.label for t in self.targets), tried.found.tolist(), strict=True)
        misfit = math.nan if tried is None else tried.phi
        self.rows.append({**row, "status": status, "misfit": misfit})
        if self.callback is not None:
            self.callback(pd.Series(self.rows[-1]))

    def ended(self, reach: Reach, here: Tried, limit: Floats | None = None) -> Design:
        """The design that ends here; ``limit`` (targets,) is what is found here where none is given."""
        if limit is None:
            unknown = reach in (Reach.SOLVES, Reach.STOPPED)
            limit = np.full_like(here.found, math.nan) if unknown else here.found
        missed = np.abs(here.r) > self.tolerance
        wanted = [t.nearest(q) for t, q in zip(self.targets, here.found, strict=True)]
        targets = pd.DataFrame(
            {"found": here.found, "wanted": wanted, "misfit": here.r, "met": ~missed,
             "limit": np.where(missed, limit, here.found)},
            index=[t.label for t in self.targets],
        )  # fmt: skip
        parameters = pd.DataFrame(
            {"start": [p.of(self.surface) for p in self.parameters],
             "value": [p.of(here.result.surface) for p in self.parameters],
             "low": [b[0] for b in self.low_high], "high": [b[1] for b in self.low_high]},
            index=[p.label for p in self.parameters],
        )  # fmt: skip
        history = pd.DataFrame(self.rows)
        return Design(reach, here.result, targets, parameters, self.solves, history)


@dataclass(frozen=True, eq=False)
class Way:
    """The way ahead from a point, and how it bends.

    With g = dt/dφ linear in φ, as slopes here and at the point before give it, and
    ρ = φ (g_before/g - 1) / (φ_before - φ): the misfit vanishes after 1 - ρ/2 of the way that the
    slope alone tells; where ρ > 1 there is a fold after 1/(2ρ) of it, and φ/ρ less misfit.

    Attributes
    ----------
    step : the Gauss-Newton step, t = 1.
    first : t to try first.
    to_limit : φ/ρ over the slope: linear in t, quantities have the values of the fold there.
    at_fold : whether the fold is so near that it is not worth a further solve.
    """

    step: Floats
    first: float = 1.0
    to_limit: float = 0.0
    at_fold: bool = False

    @classmethod
    def of(cls, before: Point | None, here: Point, step: Floats) -> Way:
        if before is None or not before.phi > here.phi:
            return cls(step)
        run = here.x - before.x
        cosine = run @ step / (np.linalg.norm(run) * np.linalg.norm(step))
        slope, slope_before = (-float(p.r @ p.jacobian @ step) / p.phi for p in (here, before))
        if cosine < 0.9 or slope <= 0.0 or slope_before <= 0.0:
            return cls(step)
        full = here.phi / slope
        bend = here.phi * (slope / slope_before - 1.0) / (before.phi - here.phi)
        if bend <= 1.0:
            return cls(step, min(1.0, full * (1.0 - 0.5 * bend)) if bend > 0.0 else 1.0)
        gap = here.phi / bend
        return cls(step, min(1.0, NEARLY * 0.5 * full / bend), gap / slope, gap < CLOSE)


def _as_it_is(surface: Surface) -> Result:
    """The result of a solve that takes no step."""

    def stop(_: Progress) -> None:
        raise StopIteration

    return solve(surface, "newton", stop)


def _metric(parameters: Sequence[Parameter], inverse: Bools) -> Floats:
    """(p,p) of which steps among equals is shortest: one that changes all tensions alike.

    Sheets and walls that pull at a junction stay nearly in balance while their tensions keep their
    ratios; where only some of them change, the junction moves away.
    """
    alike = np.array([p.kind == "tension" for p in parameters]) * np.where(inverse, 1.0, -1.0)
    return np.eye(len(alike)) - ALIKE * np.outer(alike, alike) / max(1.0, float(alike @ alike))


def _reciprocal(surface: Surface, parameter: Parameter) -> bool:
    loaded = surface.patches[surface.patch_index(parameter.patch)].pressure != 0.0
    return loaded and parameter.kind == "tension"


def _scale(surface: Surface, target: Target) -> float:
    """By what a misfit is divided: the value wanted, or where that is 0 what is natural."""
    given = (target.value, target.at_most, target.at_least)
    largest = max(abs(v) for v in given if v is not None)
    natural = {
        "volume": surface.size**3, "area": surface.size**2, "curvature": 1.0 / surface.size,
        "reaction": float(surface.tensions.max()),
    }  # fmt: skip
    return largest or natural.get(target.quantity, surface.size)
