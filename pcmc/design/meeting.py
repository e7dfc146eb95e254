"""Meeting a goal: which tensions and pressures give a roof the heights, volumes, ... that are wanted.

The misfit φ = ‖r‖, r the relative distances of the quantities from what is wanted, is minimised by
Gauss-Newton steps with exact sensitivities and bounds; every point tried is a solve, started from the last
solution. Sheets are nearly linear in 1/α, so that is what varies for a patch under pressure.

At a fold solutions end: the quantity still changes but the parameter does not, λ_fold - λ ~ (q_fold - q)².
The slopes at two points show it coming: they give the step's right length, and the reachable limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import lsq_linear

from ..arrays import Bools, Floats
from ..balance import load_ratio
from ..certificate import TOLERANCE, Certificate
from ..errors import OptionError, SurfaceError
from ..solvers import options as check
from ..solvers import solve
from ..solvers.result import Result, Status
from ..surface import Surface
from .quantities import Parameter, Target, measure
from .sensitivity import as_parameters, as_targets, sensitivities

LEAST = 1e-3  # part of an unknown that a step must change to be worth a solve near failing ones
CLOSE = 1e-3  # relative gap of the misfit to a fold at which the search ends there
NEARLY = 0.97  # of the parameters' way to a fold is tried next
TRIES = 6  # points tried along a step, ever nearer, before it is given up
GAIN = 1e-6  # part of φ below which a further step is not worth a solve
DAMPING = 1e-6  # of the largest singular value: among equal steps the best by ``_metric`` is taken
ALIKE = (
    0.9  # how much cheaper a change of all tensions in proportion is than one of a single tension
)
STIFFEN = 1.5  # factor on tensions while the surface given has no equilibrium
STARTS = 7  # solves on that way: 1.5⁶ is 11, and what that does not help has another reason
OVERLOAD = (
    1.05  # load over capacity for which no solve is tried (discrete surfaces bear a little over 1)
)
INFLATION = 4.0  # starts are near solutions: growing beyond this is running away
ITERATIONS = 60  # for the same reason
STILL = 0.02  # of an unknown: below it the mesh is left alone, for quantities feel it a little


class Reach(Enum):
    """How a search for targets ended. The value is a sentence."""

    MET = "met: every target is reached"
    AT_BOUND = "out of reach: a bound on the parameters is in the way"
    AT_FOLD = "out of reach: beyond these parameters no equilibrium was found"
    CONFLICT = "out of reach: no values of these parameters meet all targets"
    SOLVES = "not met: stopped at the limit of solves"


@dataclass(frozen=True, eq=False)
class Design:
    """The end of a search for targets. Every value describes exactly ``surface``.

    Attributes
    ----------
    reach : how it ended.
    result : of the solve that gave ``surface``.
    targets : a row per target: ``found``, ``wanted``, relative ``misfit``, ``met``, and ``limit``, the
        nearest reachable value (at a fold, where it is only approached, extrapolated).
    parameters : a row per parameter: ``start``, ``value``, ``low``, ``high``.
    solves : how many surfaces were solved for.
    history : a row per solve: parameters, quantities, status, misfit.
    """

    reach: Reach
    result: Result
    targets: pd.DataFrame
    parameters: pd.DataFrame
    solves: int
    history: pd.DataFrame

    @property
    def met(self) -> bool:
        """Whether every target is met."""
        return self.reach is Reach.MET

    @property
    def surface(self) -> Surface:
        """The surface that meets the targets, or comes nearest."""
        return self.result.surface

    @property
    def certificate(self) -> Certificate:
        """The certificate of ``surface``."""
        return self.result.certificate

    @property
    def message(self) -> str:
        """A sentence, with the nearest reachable value of each target that is not met."""
        text = self.reach.value
        missed = self.targets[~self.targets["met"]]
        for label, row in missed.iterrows():
            text += f"; {label}: wanted {row['wanted']:.6g}, nearest reachable {row['limit']:.6g}"
        if len(missed):
            values = (f"{name} {value:.6g}" for name, value in self.parameters["value"].items())
            text += f" ({', '.join(values)})"
        return text


def meet(
    surface: Surface,
    targets: Sequence[Target],
    vary: Sequence[Parameter | str],
    *,
    tolerance: float = 1e-7,
    solves: int = 40,
    callback: Callable[[pd.Series], object] | None = None,
    **options: Any,
) -> Design:
    """Find tensions and pressures with which the surface at rest meets the targets.

    Parameters
    ----------
    surface : where to start from; it need not be at rest.
    targets : with a value or limits each.
    vary : the parameters, or names of patches for their tensions. All others stay as they are.
    tolerance : a target is met when it is missed by at most this part of its value.
    solves : the most surfaces to solve for.
    callback : called with each new row of the history.
    options : of the solver, as in ``pcmc.solve`` with ``method="newton"``.

    Returns
    -------
    Design
        Targets out of reach are a verdict there, not an exception.

    Raises
    ------
    OptionError : a patch that does not exist, a target without value, bad bounds, a quantity that
        cannot be measured.
    SurfaceError : no equilibrium was found to start from, however high the tensions.

    Examples
    --------
    The pyramid's height h obeys α h / √(1 + h²) = p / 3, so h = 0.75 needs α = 5/9:

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> design = meet(pyramid, [Target("apex", "roof", 0.75)], ["roof"])
    >>> design.met, round(design.surface.patches[0].tension, 6)
    (True, 0.555556)
    """
    aims, parameters = as_targets(targets), as_parameters(vary)
    _check(surface, aims, parameters, tolerance, solves, options)
    return _Search(surface, aims, parameters, tolerance, solves, callback, options).run()


def _check(
    surface: Surface, targets: list[Target], parameters: list[Parameter], tolerance: float,
    solves: int, options: dict[str, Any],
) -> None:  # fmt: skip
    if not isinstance(surface, Surface):
        raise SurfaceError(f"meet: expected a Surface, found {type(surface).__name__}")
    if not targets or not parameters:
        raise OptionError("meet: give at least one target and one parameter that may vary")
    for target in targets:
        if not target.aimed:
            raise OptionError(f"{target.label}: give value, at_most or at_least")
        measure(surface, target)
    check.number("tolerance", tolerance, above=0.0)
    check.whole("solves", solves, least=1)
    if options.get("tolerance", 0.0) > TOLERANCE:
        raise OptionError(f"meet: the solver's tolerance must be at most {TOLERANCE:g}")


@dataclass(frozen=True, eq=False)
class _Point:
    """A solved surface on the way: x unknowns, r misfits, J = ∂r/∂x."""

    x: Floats
    result: Result
    found: Floats
    r: Floats
    phi: float
    jacobian: Floats


class _Search:
    """The search as it stands."""

    def __init__(
        self, surface: Surface, targets: list[Target], parameters: list[Parameter],
        tolerance: float, solves: int, callback: Callable[[pd.Series], object] | None,
        options: dict[str, Any],
    ) -> None:  # fmt: skip
        self.surface, self.targets, self.parameters = surface, targets, parameters
        self.tolerance, self.limit = tolerance, solves
        self.options = {"inflation": INFLATION, "iterations": ITERATIONS, **options}
        bounds = [p.bounds(surface) for p in parameters]
        self.inverse = np.array([_reciprocal(surface, p) for p in parameters])
        self.bounds = np.sort(self.turned(np.array(bounds, dtype=float).T), axis=0)
        self.low_high = bounds
        self.metric = _metric(parameters, self.inverse)
        self.scale = np.array([_scale(surface, t) for t in targets])
        self.trust = 1.0  # the longest step, as a part of the unknowns' sizes
        self.rows: list[dict[str, Any]] = []
        self.callback = callback

    def turned(self, values: Floats) -> Floats:
        """Parameters to unknowns and back: reciprocals where a sheet's tension varies."""
        safe = np.where(self.inverse, values, 1.0)
        return np.where(self.inverse, 1.0 / safe, values)

    def run(self) -> Design:
        here, before = self.start(), None
        while True:
            if self.met(here):
                return self.ended(Reach.MET, here)
            step, hopeless = self.gauss_newton(here)
            if hopeless:
                held = (here.x + step <= self.bounds[0]) | (here.x + step >= self.bounds[1])
                return self.ended(Reach.AT_BOUND if held.any() else Reach.CONFLICT, here)
            way = _Way.of(before, here, step)
            if way.at_fold:
                return self.ended(Reach.AT_FOLD, here, way)
            there, why = self.along(here, way)
            if there is None:
                return self.ended(why, here, way)
            here, before = there, here

    def start(self) -> _Point:
        """The first solution; tensions are raised until there is one."""
        values = np.array([p.of(self.surface) for p in self.parameters])
        x = np.clip(self.turned(values), *self.bounds)
        while len(self.rows) < min(STARTS, self.limit):
            point = self.at(x, None)
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

    def at(self, x: Floats, near: _Point | None) -> _Point | None:
        """The solution with these unknowns, from one nearby; None where none is found."""
        if near is None:
            return self.solved(x, self.surface, {})
        still = bool((np.abs(x - near.x) < STILL * self.sizes(near)).all())
        return self.solved(x, near.result.surface, {"care": 0.0} if still else {})

    def solved(self, x: Floats, start: Surface, care: dict[str, float]) -> _Point | None:
        """Solve once, from a surface."""
        values = self.turned(x).tolist()
        chosen: dict[str, dict[str, float]] = {"tension": {}, "pressure": {}}
        for parameter, value in zip(self.parameters, values, strict=True):
            chosen[parameter.kind][parameter.patch] = value
        trial = start.retensioned(chosen["tension"], chosen["pressure"])
        if load_ratio(trial) > OVERLOAD:
            return None
        result = solve(trial, "newton", **{**care, **self.options})
        if result.status is Status.STOPPED:
            raise KeyboardInterrupt
        point = self.point(x, result) if result.converged else None
        row = dict(zip((p.label for p in self.parameters), values, strict=True))
        if point is not None:
            row |= zip((t.label for t in self.targets), point.found.tolist(), strict=True)
        misfit = math.nan if point is None else point.phi
        self.rows.append({**row, "status": result.status.name.lower(), "misfit": misfit})
        if self.callback is not None:
            self.callback(pd.Series(self.rows[-1]))
        return point

    def point(self, x: Floats, result: Result) -> _Point | None:
        """The point at a solution; None at a fold, where nothing can be said of what is ahead."""
        found = np.array([measure(result.surface, t).value for t in self.targets])
        wanted = np.array([t.nearest(q) for t, q in zip(self.targets, found, strict=True)])
        r = (found - wanted) / self.scale
        try:
            slopes = sensitivities(result.surface, self.targets, self.parameters).to_numpy()
        except SurfaceError:
            return None
        jacobian = slopes * np.where(self.inverse, -(self.turned(x) ** 2), 1.0)
        jacobian = jacobian * (r != 0.0)[:, None] / self.scale[:, None]
        return _Point(x, result, found, r, float(np.linalg.norm(r)), jacobian)

    def met(self, point: _Point) -> bool:
        return bool(np.abs(point.r).max() <= self.tolerance)

    def gauss_newton(self, here: _Point) -> tuple[Floats, bool]:
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

    def along(self, here: _Point, way: _Way) -> tuple[_Point | None, Reach]:
        """A point with less misfit on the way; None, and why, where there is none."""
        t, longest = way.first, float((np.abs(way.step) / self.sizes(here)).max())
        why = Reach.SOLVES
        for attempt in range(TRIES):
            if len(self.rows) >= self.limit:
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

    def sizes(self, here: _Point) -> Floats:
        """(parameters,) what a change of each unknown is measured by."""
        return np.maximum(np.abs(here.x), 0.05 * (self.bounds[1] - self.bounds[0]))

    def ended(self, reach: Reach, here: _Point, way: _Way | None = None) -> Design:
        limit = here.found.copy()
        if way is not None and way.at_fold:
            limit += way.to_limit * (here.jacobian @ way.step) * self.scale
        missed = np.abs(here.r) > self.tolerance
        wanted = [t.nearest(q) for t, q in zip(self.targets, here.found, strict=True)]
        targets = pd.DataFrame(
            {"found": here.found, "wanted": wanted, "misfit": here.r, "met": ~missed,
             "limit": np.where(missed, limit, here.found)},
            index=[t.label for t in self.targets],
        )  # fmt: skip
        parameters = pd.DataFrame(
            {"start": [p.of(self.surface) for p in self.parameters], "value": self.turned(here.x),
             "low": [b[0] for b in self.low_high], "high": [b[1] for b in self.low_high]},
            index=[p.label for p in self.parameters],
        )  # fmt: skip
        history = pd.DataFrame(self.rows)
        return Design(reach, here.result, targets, parameters, len(self.rows), history)


@dataclass(frozen=True, eq=False)
class _Way:
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
    def of(cls, before: _Point | None, here: _Point, step: Floats) -> _Way:
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
