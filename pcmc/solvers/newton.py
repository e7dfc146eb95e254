"""The geometric solver: Bᵀ∇E = 0 in the motion space, to rounding, on any refinement.

Each iteration tries a Newton step on the residual r = Bᵀ∇E, whose frames B turn with the surface: its
derivative is applied (``linearise``) and inverted by GMRES on a factorisation of Bᵀ(∂²E)B, which is kept
while it still contracts. Where a minimum is sought and the matrix is indefinite, it is shifted; near a
saddle the lowest mode leads on. Where a step overshoots or spoils triangles, smooth descent steps come
first. In between vertices are spread along the shape as long as triangles are poor, and junctions that
come down to Π are set to rest there. A way may run past a shallow minimum, or a step too far, until
triangles collapse. Then the run starts once more: towards any stationary point, which is kept if it is a
minimum where one was asked for; or, if that is what has failed, with smooth steps first.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..base import validate
from ..base.errors import SurfaceError
from ..certificate.certificate import certify
from ..meshing.quality import worst_quality
from ..meshing.refinement import refine
from ..surface import Surface
from ..surface.geometry import bounding_size
from .result import Callback, Progress, Result, Status
from .state import State
from .steps import Stepper

TARGETS = ("minimum", "stationary")
DESCENTS = 5  # smooth steps after a Newton step that did not help
PATIENCE = 8  # steps without halving the residual, once it is that small
ROUNDED = 1e-10  # relative residual that counts as rest where rounding lets no step improve it
COLLAPSED = 1e-3  # triangle quality at which the run ends
POOR = 0.15  # triangle quality that explains why no step helps
SHRUNK = 5e-2  # of its first size: a surface that nothing holds has vanished
LOST = (Status.DEGENERATE, Status.STALLED)


@dataclass(frozen=True)
class NewtonOptions:
    """What the geometric solver may be told.

    Parameters
    ----------
    tolerance : converged when ‖Bᵀ∇E‖ ≤ tolerance × the norm of the single triangles' forces, or when
        rounding lets no step improve on 1e-10 of it.
    iterations : the most steps of any kind, on each level and in each attempt.
    target : ``"minimum"`` leaves saddles; ``"stationary"`` converges to them.
    levels : solve here, refine 1→4 this many times, and finish on each.
    min_quality : triangles are spread while the worst has less than this quality, or half the initial one.
    inflation : diverged when the bounding box is more than this many times its first diagonal.
    backend : factorisation, ``"pardiso"`` or ``"superlu"``; None for the fastest here.
    """

    tolerance: float = 1e-12
    iterations: int = 200
    target: str = "minimum"
    levels: int = 0
    min_quality: float = 0.45
    inflation: float = 10.0
    backend: str | None = None

    def __post_init__(self) -> None:
        validate.number("tolerance", self.tolerance, above=0.0)
        validate.integer("iterations", self.iterations)
        validate.choice("target", self.target, TARGETS)
        validate.integer("levels", self.levels)
        validate.number("min_quality", self.min_quality, least=0.0, below=1.0)
        validate.number("inflation", self.inflation, above=1.0)


@dataclass
class _Log:
    """The history of all levels, and the counts of those that are finished."""

    callback: Callback | None
    rows: list[dict[str, Any]] = field(default_factory=list)
    evaluations: int = 0
    factorisations: int = 0
    note: str = ""

    def row(self, state: State, stepper: Stepper, level: int) -> None:
        row = {
            "iteration": len(self.rows),
            "level": level,
            "step": stepper.kind,
            "evaluation": self.evaluations + state.evaluations,
            "factorisation": self.factorisations + stepper.factorisations,
            "energy": state.energy,
            "gradient_squared": float((state.gradient**2).sum()),
            "residual": state.relative,
            "quality": worst_quality(state.X, state.surface.faces),
            "resting": int(state.rests.sum()),
        }
        self.rows.append(row)
        if self.callback is not None:
            self.callback(Progress(len(self.rows) - 1, state.result_surface, row))


def newton(
    surface: Surface, options: NewtonOptions | None = None, callback: Callback | None = None
) -> Result:
    """Solve with the geometric solver; see ``pcmc.solve``."""
    options = options or NewtonOptions()
    _refuse_loose_parts(surface)
    log = _Log(callback)
    for level in range(options.levels + 1):
        state, status = _finish(surface, options, log, level)
        if status is not Status.CONVERGED or level == options.levels:
            break
        surface = refine(state.result_surface())
    return Result(
        surface=state.result_surface(),
        status=status,
        method="newton",
        energy=state.energy,
        iterations=len(log.rows) - 1,
        evaluations=log.evaluations,
        rows=log.rows,
        note=log.note,
    )


def _finish(
    surface: Surface, options: NewtonOptions, log: _Log, level: int
) -> tuple[State, Status]:
    """Solve on one mesh; where the way is lost, once more from the same start on another way."""
    state, status = _attempt(surface, options, log, level)
    if status not in LOST:
        return state, status
    rows = len(log.rows)
    downwards = options.target == "minimum"
    other, found = _attempt(
        surface, replace(options, target="stationary"), log, level, 0 if downwards else DESCENTS
    )
    if found is Status.STOPPED and other.relative < state.relative:
        return other, found
    if found is Status.CONVERGED and other.worst >= POOR:
        index = certify(other.result_surface(), modes=0).index if downwards else 0
        if index == 0:
            return other, found
        log.note = f"a saddle of index {index} is near: target='stationary' returns it"
    del log.rows[rows:]
    return state, found if found is Status.STOPPED else status


def _attempt(
    surface: Surface, options: NewtonOptions, log: _Log, level: int, smooth: int = 0
) -> tuple[State, Status]:
    state = State(surface, options.min_quality)
    stepper = Stepper(state, options.target == "minimum", options.backend)
    status = _run(state, stepper, options, log, level, smooth)
    log.evaluations += state.evaluations
    log.factorisations += stepper.factorisations
    return state, status


def _run(
    state: State, stepper: Stepper, options: NewtonOptions, log: _Log, level: int, smooth: int
) -> Status:
    """Step until one of the ends; ``smooth`` steps of descent come first."""
    start = state.worst
    wait, since, lowest = smooth, 0, state.relative
    shown = state.X, state.version
    try:
        for step in range(options.iterations + 1):
            shown = state.X, state.version
            log.row(state, stepper, level)
            rounded = state.relative <= ROUNDED and (wait < 0 or since > PATIENCE)
            if state.relative <= options.tolerance or rounded:
                if not _go_on(state, stepper, options):
                    return Status.STALLED if state.overpull().any() else Status.CONVERGED
                wait, since, lowest = 0, 0, state.relative
            elif wait < 0:
                return _lost(state, start, Status.STALLED)
            elif step == options.iterations:
                return _lost(state, start, Status.ITERATION_LIMIT)
            else:
                if state.maintain_mesh():
                    stepper.drop_factor()
                wait = _step(state, stepper, wait)
                since += 1
                if state.relative < 0.5 * lowest:
                    since, lowest = 0, state.relative
            ended = _ended(state, options)
            if ended is not None:
                log.row(state, stepper, level)
                return ended
    except StopIteration:
        return Status.STOPPED
    except KeyboardInterrupt:  # perhaps in the middle of a step
        state.go_back(*shown)
        return Status.STOPPED
    return Status.ITERATION_LIMIT


def _ended(state: State, options: NewtonOptions) -> Status | None:
    """Why no further step makes sense, if so."""
    if not np.isfinite(state.energy):
        return Status.NON_FINITE
    collapsed = state.worst < COLLAPSED
    extent = bounding_size(state.X) / state.size
    # a mesh that inflates may collapse on its way out
    if extent > options.inflation or (collapsed and extent > np.sqrt(options.inflation)):
        return Status.DIVERGED
    if extent < SHRUNK:
        return Status.VANISHED
    return Status.DEGENERATE if collapsed else None


def _lost(state: State, start: float, status: Status) -> Status:
    """The status, or that triangles have collapsed where that explains it."""
    return Status.DEGENERATE if state.worst < min(POOR, 0.5 * start) else status


def _go_on(state: State, stepper: Stepper, options: NewtonOptions) -> bool:
    """At rest: whether a saddle is left or a resting junction lifted, so that it is not the end."""
    if options.target == "minimum" and stepper.leave_saddle():
        return True
    if state.rests.any() and (state.release() or state.seen_anew()):
        stepper.kind = "release"
        return True
    return False


def _step(state: State, stepper: Stepper, wait: int) -> int:
    """One step; how many smooth steps to take before the next Newton step, -1 where none helps."""
    if stepper.saddle_near() and stepper.leave_saddle():
        return 0
    if wait == 0 and stepper.newton():
        return 0
    if stepper.descend():
        return (wait or DESCENTS) - 1
    return 0 if wait > 0 and stepper.newton() else -1


def _refuse_loose_parts(surface: Surface) -> None:
    """A part with an open edge that no support holds flies away: name it."""
    topo = surface.topology
    held = np.zeros(topo.components.max() + 1, dtype=bool)
    held[topo.components[surface.fixed | surface.on_plane]] = True
    open_edge = np.zeros_like(held)
    open_edge[topo.components[topo.edges[topo.boundary_edge, 0]]] = True
    loose = np.flatnonzero(open_edge & ~held)
    if len(loose):
        vertex = int(np.flatnonzero(topo.components == loose[0])[0])
        face = int(np.flatnonzero((surface.faces == vertex).any(axis=1))[0])
        name = surface.patches[surface.patch_of_face[face]].name
        raise SurfaceError(
            f"the part of the surface around vertex {vertex} (patch {name!r}) has an open boundary"
            " and no support; hold it with fixed= or on_plane=, or remove it"
        )
