"""The paper's flow: descent with Nesterov momentum and an Armijo line search, (23)-(25)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..base import validate
from ..base.arrays import Floats
from ..surface import Surface
from ..surface.geometry import bounding_size
from .evaluate import Evaluator, Point, converged_below
from .result import Callback, Progress, Result, Status, until_stopped


@dataclass(frozen=True)
class NesterovOptions:
    """Options of the flow; the paper's values are the defaults.

    Parameters
    ----------
    t0 : first and largest step t of each line search, length/force; the paper uses 0.005 to 0.05.
    gamma : γ in [0, 1), the part of the last move that is added to the next (24a).
    xi : ξ ≥ 0 of the Armijo test (25).
    tau : τ in (0, 1), each trial step is τ times the last.
    floor_power : the smallest trial step is t0 τ^floor_power; it is taken even if it fails the test.
    momentum : False for plain descent (23), γ = 0.
    line_search : False to take t0 always; the history still shows whether it passes the test.
    armijo : ``"printed"``, Eq. (25) as printed, E(Q) ≤ E(Y) + ξ t ‖∇E(Q)‖², which lets E rise; or
        ``"sufficient"``, the standard test of the source cited there, E(Q) ≤ E(Y) - ξ t ‖∇E(Y)‖².
        Here Y = P + γ d and Q = Y - t ∇E(Y).
    tolerance : converged when ‖∇E‖² ≤ tolerance, force²; 0 or None to run all iterations. Where all
        forces are small it is taken relative to them; see ``converged_below``.
    iterations : the most iterations.
    inflation : diverged when the bounding box is more than this many times its first diagonal.
    """

    t0: float = 0.01
    gamma: float = 0.9
    xi: float = 0.2
    tau: float = 0.5
    floor_power: int = 5
    momentum: bool = True
    line_search: bool = True
    armijo: str = "printed"
    tolerance: float | None = 1e-8
    iterations: int = 1000
    inflation: float = 10.0

    def __post_init__(self) -> None:
        validate.number("t0", self.t0, above=0.0)
        validate.number("gamma", self.gamma, least=0.0, below=1.0)
        validate.number("xi", self.xi, least=0.0)
        validate.number("tau", self.tau, above=0.0, below=1.0)
        validate.integer("floor_power", self.floor_power)
        validate.flag("momentum", self.momentum)
        validate.flag("line_search", self.line_search)
        validate.choice("armijo", self.armijo, ("printed", "sufficient"))
        if self.tolerance is not None:
            validate.number("tolerance", self.tolerance, least=0.0)
        validate.integer("iterations", self.iterations)
        validate.number("inflation", self.inflation, above=1.0)


class Move(NamedTuple):
    """The flow after ``iteration`` moves: the point, the last move d, its step t, whether t passed (25)."""

    iteration: int
    point: Point
    d: Floats
    t: float
    passed: bool


def nesterov(
    surface: Surface, options: NesterovOptions | None = None, callback: Callback | None = None
) -> Result:
    """Follow the paper's flow from the given surface.

        d ← γ d - t ∇E(P + γ d)                                       (24a)
        P ← P + d                                                     (24b)

    with the largest t of t0, t0 τ, …, t0 τ^floor_power that passes the Armijo test (25), or the
    smallest of them. Every vertex moves in all the directions its support allows, so the triangles
    may degrade while E falls.

    The ``history`` has a row per iteration, row 0 the surface as given: ``iteration``, ``evaluation`` (of E
    and ∇E together, so far), ``energy``, ``gradient_squared``, ``t`` (NaN in row 0) and ``armijo_held``
    (False where the floor was taken although it failed).

    Examples
    --------
    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> result = nesterov(pyramid, NesterovOptions(t0=0.1, tolerance=1e-20))
    >>> result.converged, result.surface.vertices[4].round(6).tolist()  # 4 h / √(1 + h²) = 4 / 3
    (True, [0.0, 0.0, 0.353553])
    """
    flow = _Flow(surface, options or NesterovOptions(), callback)
    status = until_stopped(flow.run)
    move = flow.move
    return Result(
        surface=surface.moved(move.point.X),
        status=flow.ending() or status,
        method="nesterov",
        energy=move.point.energy,
        iterations=move.iteration,
        evaluations=flow.evaluate.count,
        # Ctrl-C may come between a row and its move; the history ends with the surface returned
        rows=flow.rows[: move.iteration + 1],
    )


class _Flow:
    """The flow from one surface: the last move, and the history up to it."""

    def __init__(self, surface: Surface, options: NesterovOptions, callback: Callback | None) -> None:
        self.surface, self.options, self.callback = surface, options, callback
        self.evaluate = Evaluator(surface)
        self.tolerance = converged_below(surface, self.options.tolerance)
        start = self.evaluate(surface.vertices)
        self.move = Move(0, start, np.zeros_like(start.X), np.nan, True)
        self.rows = [self.row(self.move)]

    def run(self) -> Status:
        """Move until the flow ends."""
        while (status := self.ending()) is None:
            if self.move.iteration >= self.options.iterations:
                return Status.ITERATION_LIMIT
            new = _iterate(self.move, self.evaluate, self.options)
            if not new.point.finite:
                return Status.NON_FINITE
            self.rows.append(self.row(new))
            self.move = new
            if self.callback is not None:
                surface = partial(self.surface.moved, new.point.X)
                self.callback(Progress(new.iteration, surface, self.rows[-1]))
        return status

    def ending(self) -> Status | None:
        """Why to stop at the point reached, or None."""
        point = self.move.point
        if not point.finite:
            return Status.NON_FINITE
        if point.squared <= self.tolerance:
            return Status.CONVERGED
        if bounding_size(point.X) > self.options.inflation * self.surface.size:
            return Status.DIVERGED
        return None

    def row(self, move: Move) -> dict[str, Any]:
        """The row of the history for a move."""
        return {
            "iteration": move.iteration,
            "evaluation": self.evaluate.count,
            "energy": move.point.energy,
            "gradient_squared": move.point.squared,
            "t": move.t,
            "armijo_held": move.passed,
        }


def _iterate(move: Move, evaluate: Evaluator, options: NesterovOptions) -> Move:
    """One iteration: look ahead along the last move, then search for t, Eqs. (24), (25)."""
    ahead, drift = move.point, 0.0 * move.d
    if options.momentum and move.iteration > 0:
        drift = options.gamma * move.d
        ahead = evaluate(move.point.X + drift)
    for power in range(options.floor_power + 1):
        t = options.t0 * options.tau**power
        with np.errstate(all="ignore"):  # an overflow becomes a status, not a warning
            d = drift - t * ahead.gradient
            new = evaluate(move.point.X + d)
        if options.armijo == "printed":
            bound = ahead.energy + options.xi * t * new.squared
        else:
            bound = ahead.energy - options.xi * t * ahead.squared
        passed = new.energy <= bound
        if passed or not options.line_search:
            break
    return Move(move.iteration + 1, new, d, t, passed)
