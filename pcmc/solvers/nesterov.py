"""The paper's flow: descent with Nesterov momentum and an Armijo line search, (23)-(25)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..base.arrays import Floats
from ..base.errors import OptionError
from ..base.validate import check_options, choice, flag, integer, limited, number
from ..surface import Surface
from .evaluate import Evaluator, Point
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
    momentum : whether to take it; without it, plain descent (23), γ = 0.
    line_search : whether to shorten steps; without it, t0 always. The history still shows whether that passes
        the test.
    armijo : ``"printed"``, Eq. (25) as printed, E(Q) ≤ E(Y) + ξ t ‖∇E(Q)‖², which lets E rise; or
        ``"sufficient"``, the standard test of the source cited there, E(Q) ≤ E(Y) - ξ t ‖∇E(Y)‖².
        Here Y = P + γ d and Q = Y - t ∇E(Y).
    tolerance : converged when ‖∇E‖² ≤ tolerance, force²; 0 to run all iterations. Where all
        forces are small it is taken relative to them; see ``converged_below``.
    iterations : the most iterations.
    inflation : diverged when the bounding box is more than this many times its first diagonal.
    """

    t0: float = limited(0.01, number, above=0.0)
    gamma: float = limited(0.9, number, least=0.0, below=1.0)
    xi: float = limited(0.2, number, least=0.0)
    tau: float = limited(0.5, number, above=0.0, below=1.0)
    floor_power: int = limited(5, integer)
    momentum: bool = limited(True, flag)
    line_search: bool = limited(True, flag)
    armijo: str = limited("printed", choice, known=("printed", "sufficient"))
    tolerance: float | None = limited(1e-8, number, least=0.0)
    iterations: int = limited(1000, integer)
    inflation: float = limited(10.0, number, above=1.0)

    def __post_init__(self) -> None:
        check_options(self)
        for switch, names in (("momentum", ["gamma"]), ("line_search", ["tau", "floor_power"])):
            for name in () if getattr(self, switch) else names:
                if getattr(self, name) != getattr(NesterovOptions, name):
                    text = f"{name}: counts only with {switch} = true; leave it out"
                    raise OptionError(text, what=name, found=getattr(self, name))


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

    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> pyramid = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                   [Patch("roof", 1.0)], fixed=range(4))
    >>> result = nesterov(pyramid, NesterovOptions(t0=0.1, tolerance=1e-20))
    >>> result.converged, result.surface.vertices[4].round(6).tolist()  # 4 h / √(1 + h²) = 4 / 3
    (True, [0.0, 0.0, 0.353553])
    """
    options = options or NesterovOptions()
    evaluate = Evaluator(surface, options.tolerance, options.inflation)
    start = evaluate(surface.vertices)
    move = Move(0, start, np.zeros_like(start.X), np.nan, True)
    rows: list[dict[str, Any]] = []

    def add_row(of: Move) -> None:
        search = {"t": of.t, "armijo_held": of.passed}
        rows.append({"iteration": of.iteration, **evaluate.row(of.point), **search})

    def run() -> Status:
        nonlocal move
        while (status := evaluate.ending(move.point)) is None:
            if move.iteration >= options.iterations:
                return Status.ITERATION_LIMIT
            new = _iterate(move, evaluate, options)
            if not new.point.finite:
                return Status.NON_FINITE
            add_row(new)
            move = new
            if callback is not None:
                callback(Progress(new.iteration, partial(surface.moved, new.point.X), rows[-1]))
        return status

    add_row(move)
    status = until_stopped(run, Status.STOPPED)
    end, status = surface.moved(move.point.X), evaluate.ending(move.point) or status
    del rows[move.iteration + 1 :]  # Ctrl-C may come between a row and its move
    return Result(end, status, "nesterov", move.point.energy, move.iteration, evaluate.count, rows)


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
        margin = new.squared if options.armijo == "printed" else -ahead.squared
        passed = new.energy <= ahead.energy + options.xi * t * margin
        if passed or not options.line_search:
            break
    return Move(move.iteration + 1, new, d, t, passed)
