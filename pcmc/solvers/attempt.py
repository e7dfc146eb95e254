"""One attempt of the geometric solver on one mesh: which step comes next, and when to end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.errors import OptionError
from ..base.tolerances import AT_REST, COLLAPSED, NOISE, POOR, ROUNDED_REST, SHRUNK
from ..base.validate import check_options, choice, integer, limited, number
from ..forces.functional import patch_areas
from ..forces.loose_parts import patch_residuals
from ..meshing.quality import worst_quality
from ..stability.equilibrium import SecondVariation
from ..stability.modes import clear_of_zero
from ..surface import Surface
from ..surface.geometry import bounding_size
from ..surface.lagrange import known_order
from .result import Callback, Progress, Status, until_stopped
from .state import SolverState
from .steps import Stepper

TARGETS = ("minimum", "stationary")
DESCENTS = 5  # smooth steps after a Newton step that did not help
PATIENCE = 8  # steps without halving the residual, once it is that small
DOWN = ("shifted", "saddle")  # kinds of steps where the second variation is indefinite
SLOW_DESCENT_STEPS = (3, 30)  # that hardly lower E: when a saddle that slips is accepted, when any
NEAR_SADDLE = 1e-3  # residual near a saddle
SURE = 0.1  # of the residual at rest: below it, what rounding may leave is worth no further step
MIN_ENERGY_DROP = 1e-6  # of Σ α A: by less E is hardly lowered in these steps


@dataclass(frozen=True)
class NewtonOptions:
    """Options of the geometric solver.

    Parameters
    ----------
    tolerance : converged when ‖Bᵀ∇E‖ ≤ tolerance × the norm of the single triangles' forces, or when it
        is below 1e-10 of that norm and rounding lets no step lower it further; or, in each patch too,
        below 1e-9 and what rounding of the coordinates leaves of it (ε |X| over the mean edge), as in
        those of a survey.
    iterations : the most steps of any kind, on each level and in each attempt. ``pcmc.solve`` ends its search
        where one takes as many as were asked for: with ``iterations=1`` there is one step in all.
    target : ``"minimum"`` leaves saddles; ``"stationary"`` converges to them.
    levels : number of 1→4 refinements; the surface is solved before the first and after each.
    min_quality : vertices are redistributed along the shape while the worst triangle has less quality.
    inflation : diverged when the bounding box is more than this many times its first diagonal.
    backend : factorisation, ``"pardiso"`` or ``"superlu"``; by default the fastest here.
    order : of the elements of the result: flat triangles are solved first, on all levels, and then, as
        elements of order 2, 4 or 8, once more; by default the order of the surface. Where a wall comes to
        rest on Π, they stay flat.
    """

    tolerance: float = limited(1e-12, number, above=0.0)
    iterations: int = limited(200, integer)
    target: str = limited("minimum", choice, known=TARGETS)
    levels: int = limited(0, integer)
    min_quality: float = limited(0.45, number, least=0.0, below=1.0)
    inflation: float = limited(10.0, number, above=1.0)
    backend: str | None = None
    order: int | None = None

    def __post_init__(self) -> None:
        check_options(self)
        if self.order is not None:
            known_order(self.order, OptionError)


@dataclass
class Log:
    """What all attempts of a solve share: the callback, and the counts of their work."""

    callback: Callback | None
    evaluations: int = 0
    factorisations: int = 0


class NewtonRun:
    """One run of steps on one mesh; with ``held``, walls with held bottoms can pinch.

    ``rows`` are its history, after those of the runs ``before``; ``status`` is why it ended.
    """

    def __init__(
        self,
        surface: Surface,
        options: NewtonOptions,
        log: Log,
        level: int,
        before: Sequence[dict[str, Any]] = (),
        smooth_steps: int = 0,
        held: bool = False,
    ) -> None:
        self.options, self.log, self.level, self.rows = options, log, level, list(before)
        self.held = held
        self.state = SolverState(surface, options.min_quality, held, options.backend)
        self.stepper = Stepper(self.state, options.target == "minimum")
        self.status, self.note = Status.ITERATION_LIMIT, ""  # the note goes into the result's message
        self.first_quality = self.state.quality
        self._shown = self.state.at.X, self.state.version  # as in the last row
        # how many steps down from a saddle may hardly lower E, if a minimum is sought
        self.patience = float(SLOW_DESCENT_STEPS[0]) if options.target == "minimum" else np.inf
        self._steps = 0
        self._descent: list[float] = []  # E after each step of the present way down from a saddle
        self.before_descent = self._shown  # where that way began
        self.clear: SecondVariation | None = None  # at rest, if it is clear of zero
        self._restart(smooth_steps)

    def _restart(self, smooth_steps: int = 0) -> None:
        """Measure progress from here."""
        self.smooth_steps = smooth_steps  # to take before the next Newton step
        self.stuck = False  # by the last step: none lowers the residual or the energy
        self.best, self.steps_since_best = self.state.at.residual, 0  # since it was last halved

    def run(self) -> NewtonRun:
        """Step until the end, or on from there; ``status`` then gives the reason."""
        self.status = until_stopped(self._iterate, Status.STOPPED)
        if self.status is Status.STOPPED:  # perhaps in the middle of a step
            X, version = self._shown
            self.state.go_to(X if version == self.state.version else self.state.at.X)
        self.log.evaluations += self.state.evaluations
        self.log.factorisations += self.stepper.factorisations
        self.state.evaluations = self.stepper.factorisations = 0
        if self.status is not Status.SADDLE:  # from which a run may go on
            self.stepper.free()
        return self

    def _iterate(self) -> Status:
        state = self.state
        for step in range(self._steps, self.options.iterations + 1):
            self._steps = step + 1
            self._shown = state.at.X, state.version
            self._add_row()
            if self._at_rest():
                if not self._leave_rest():
                    return Status.STALLED if state.at.excess_pull.any() else Status.CONVERGED
                self._restart()
            elif self.stuck or step == self.options.iterations:
                if state.quality < min(POOR, 0.5 * self.first_quality):  # which explains it
                    return Status.DEGENERATE
                return Status.STALLED if self.stuck else Status.ITERATION_LIMIT
            else:
                if state.maintain_mesh():
                    self.stepper.second = None
                self._step()
            status = self._ended() or (Status.SADDLE if self._descends_slowly() else None)
            if status is not None:
                self._add_row()
                return status
        return Status.ITERATION_LIMIT

    def _add_row(self) -> None:
        state = self.state
        row = {
            "iteration": len(self.rows),
            "level": self.level,
            "step": self.stepper.kind,
            "evaluation": self.log.evaluations + state.evaluations,
            "factorisation": self.log.factorisations + self.stepper.factorisations,
            "energy": state.energy,
            "gradient_squared": float((state.at.gradient**2).sum()),
            "residual": state.at.residual,
            "quality": worst_quality(state.at.X, state.at.surface.faces),
            "resting": int(state.resting.sum()),
        }
        self.rows.append(row)
        if self.log.callback is not None:
            self.log.callback(Progress(len(self.rows) - 1, state.result_surface, row))

    def _step(self) -> None:
        """Along the lowest mode of a saddle that is near, or Newton's, or a smooth one."""
        stepper = self.stepper
        if stepper.saddle_near() and stepper.leave_saddle():
            self.smooth_steps = 0
        elif self.smooth_steps == 0 and stepper.newton():
            pass
        elif stepper.descend():
            self.smooth_steps = (self.smooth_steps or DESCENTS) - 1
        elif self.smooth_steps > 0 and stepper.newton():
            self.smooth_steps = 0
        else:
            self.stuck = True
        self.steps_since_best += 1
        if self.state.at.residual < 0.5 * self.best:
            self.best, self.steps_since_best = self.state.at.residual, 0

    def _at_rest(self) -> bool:
        """Whether the residual is below the tolerance, or as low as rounding lets it become."""
        at, rounding = self.state.at, self.state.rounding
        if at.residual <= self.options.tolerance:
            return True
        if self.stuck or self.steps_since_best > PATIENCE:
            return at.residual <= max(ROUNDED_REST, NOISE * rounding)
        least = min(rounding, SURE * AT_REST)
        if at.residual > least:
            return False
        own = patch_residuals(at.shape, at.classes, at.unbalanced)  # weak ones hide in the residual
        return bool(own.max() <= least)

    def _leave_rest(self) -> bool:
        """Leave a saddle if a minimum is sought, or lift a resting junction; False if neither is due."""
        if self.options.target == "minimum":
            self.clear = clear_of_zero(self.state.at)
            self.stepper.factorisations += self.clear is not None
            if self.clear is None and self.stepper.leave_saddle(self.state.at):
                return True
        if not self.state.resting.any():
            return False
        self.clear = None
        self.stepper.free()  # at rest no factor is needed, and after a release another
        if self.state.lift_overpulled() or self.state.update_walls():
            self.stepper.kind = "release"
            return True
        return False

    def _descends_slowly(self) -> bool:
        """Whether ``patience`` steps down from a saddle hardly lowered E: often they only spoil triangles."""
        state = self.state
        down = self.stepper.kind in DOWN and state.at.residual <= NEAR_SADDLE
        if self.patience == np.inf or not down:
            self._descent, self.before_descent = [], (state.at.X, state.version)
            return False
        self._descent.append(state.energy)
        if len(self._descent) <= self.patience:
            return False
        scale = float(state.at.surface.tensions @ patch_areas(state.at.shape))
        return self._descent[-int(self.patience) - 1] - state.energy < MIN_ENERGY_DROP * scale

    def surface_before_descent(self) -> Surface:
        """The whole surface where the present way down from a saddle began."""
        X, version = self.before_descent
        return self.state.result_surface(X if version == self.state.version else None)

    def _ended(self) -> Status | None:
        """Why no further step makes sense, or None."""
        state, inflation = self.state, self.options.inflation
        if not np.isfinite(state.energy):
            return Status.NON_FINITE
        collapsed = state.quality < COLLAPSED
        extent = bounding_size(state.at.X) / state.size
        # triangles of a surface that inflates may collapse on the way
        if extent > inflation or (collapsed and extent > np.sqrt(inflation)):
            return Status.DIVERGED
        if extent < SHRUNK:
            return Status.VANISHED
        return Status.DEGENERATE if collapsed else None
