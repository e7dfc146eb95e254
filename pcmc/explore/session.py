"""The session of one page: the surface it shows, the values it asks for, and the steps to undo.

A session shows only surfaces at rest. If there is none for the values asked for, the last one stays, and the
certificate of the failed attempt gives the reason.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

from .. import existence
from ..accuracy import MeshCheck, check_mesh
from ..certificate import Certificate, Verdict, certify
from ..solvers import solve
from ..solvers.result import Progress, Result
from ..surface import Patch, Surface
from ..surface.wall_pressures import with_pressures

AT_REST = (Verdict.STABLE, Verdict.NEUTRAL, Verdict.SADDLE)
FOLLOW: dict[str, Any] = {"iterations": 12, "tolerance": 1e-9}  # while a slider moves
SETTLE: dict[str, Any] = {"iterations": 40, "tolerance": 1e-11}  # when it is let go
FOLLOW_SECONDS = 1.0  # time limit of following, and as much again for each 50 000 triangles
SETTLE_SECONDS = 6.0  # time limit of settling
SMALLEST_STEP = 1.0 / 64.0  # part of the way; settling takes no smaller step
MOST_STEPS = 200  # to undo
MOST_BYTES = 64_000_000  # of vertices in these steps

Values = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, eq=False)
class State:
    """The surface of a session and all that the page says about it.

    Attributes
    ----------
    surface, certificate : the surface to show and its certificate.
    asked : the patches with the values asked for.
    failure : certificate of the attempt at the values asked for, if it did not come to rest.
    undo, redo : how many steps there are either way.
    superseded : whether newer values have arrived meanwhile, so that the page ignores this state.
    """

    surface: Surface
    certificate: Certificate
    asked: tuple[Patch, ...]
    failure: Certificate | None = None
    undo: int = 0
    redo: int = 0
    superseded: bool = False


def solved_start(surface: Surface) -> State:
    """Solve a surface, unless it is at rest already; if no solver converges, return it unchanged."""
    certificate = certify(surface)
    failure = None if certificate.verdict in AT_REST else certificate
    for solver, target in ((solve, "stationary"), (existence.solve, "minimum")):
        if failure is None:
            break
        result = solver(surface, target=target)
        ended = result.certify()
        if ended.verdict in AT_REST:
            return State(result.surface, ended, result.surface.patches)
        failure = ended
    return State(surface, certificate, surface.patches, failure)


class Session:
    """A surface that follows its values; every method is safe to call from any thread.

    A newer call ends the work on an older one. Each call holds ``turn`` while it works.
    """

    def __init__(self, start: State, turn: AbstractContextManager[Any] | None = None) -> None:
        self._lock, self._turn = threading.Lock(), turn or nullcontext()
        self._requests = 0
        self.surface, self._certificate = start.surface, start.certificate
        self._asked, self._failure = start.asked, start.failure
        self._steps, self._place = [self.surface], 0

    def state(self) -> State:
        """The present state."""
        with self._lock:
            return self._state()

    def follow(self, values: Values) -> State:
        """Move towards these values while a slider moves: as far as two quick attempts lead."""

        def act(stop: Callable[[], bool]) -> None:
            asked = self._with_values(values)
            end = time.monotonic() + FOLLOW_SECONDS * (1.0 + asked.m / 50_000)
            way = reach(self.surface, asked, until(stop, end), attempts=2, **FOLLOW)
            if stop():
                return
            if way.certificate is not None:
                self.surface, self._certificate, self._failure = way.surface, way.certificate, None
            else:
                self._failure = way.failed

        return self._run(act)

    def settle(self, values: Values) -> State:
        """Move to these values, or as close as possible, in as many steps as needed.

        The surface reached is a step that ``undo`` returns to.
        """

        def act(stop: Callable[[], bool]) -> None:
            asked, end = self._with_values(values), time.monotonic() + SETTLE_SECONDS
            way = reach(self.surface, asked, until(stop, end), **SETTLE)
            if stop():
                return
            if way.certificate is not None:
                self._show(way.surface)
            self._failure = way.failed
            self._add_step()

        return self._run(act)

    def stabilise(self) -> State:
        """Move from a saddle to a stable shape, if there is one nearby."""

        def act(stop: Callable[[], bool]) -> None:
            end = time.monotonic() + SETTLE_SECONDS
            result = attempt(self.surface, until(stop, end), target="minimum")
            certificate = result.certify()
            if stop():
                return
            if certificate.verdict in AT_REST:
                self.surface, self._certificate, self._failure = result.surface, certificate, None
                self._add_step()
            else:
                self._failure = certificate

        return self._run(act)

    def check_mesh(self) -> MeshCheck | None:
        """The mesh check of the surface shown; None if the page shows another one before it ends."""
        checked = self.surface

        def check(_: Progress) -> None:
            if self.surface is not checked:
                raise StopIteration

        with self._turn:
            try:
                return check_mesh(checked, callback=check)
            except KeyboardInterrupt:
                return None

    def undo(self) -> State:
        """One step back; if the values asked for were not reached, back to those of the surface shown."""
        return self._run(
            lambda stop: self._go(self._place if self._has_unsaved_changes else max(self._place - 1, 0))
        )

    def redo(self) -> State:
        """Repeat the step that was undone."""
        return self._run(lambda stop: self._go(min(self._place + 1, len(self._steps) - 1)))

    def reset(self) -> State:
        """Return to the start, as a new step."""

        def act(stop: Callable[[], bool]) -> None:
            self._show(self._steps[0])
            self._asked, self._failure = self.surface.patches, None
            self._add_step()

        return self._run(act)

    # -- below here the lock is held ---------------------------------------------------------------

    def _run(self, act: Callable[[Callable[[], bool]], None]) -> State:
        self._requests += 1
        mine = self._requests

        def late() -> bool:
            return mine < self._requests

        with self._lock, self._turn:
            before = self._asked
            if not late():
                act(late)
            if late():
                self._asked = before
            return self._state(superseded=late())

    def _with_values(self, values: Values) -> Surface:
        """The surface shown, with the values asked for."""
        given = {key: dict(values.get(key) or {}) for key in ("tensions", "pressures")}
        wanted = with_pressures(self.surface, given["tensions"], given["pressures"])
        self._asked = wanted.patches
        return wanted

    def _show(self, surface: Surface) -> None:
        self.surface, self._certificate = surface, certify(surface)

    def _add_step(self) -> None:
        """The surface shown becomes the newest step."""
        if self.surface is self._steps[self._place]:
            return
        most = max(4, min(MOST_STEPS, MOST_BYTES // self.surface.vertices.nbytes))
        steps = [*self._steps[: self._place + 1], self.surface]
        # the first stays: it is what ``reset`` returns to
        self._steps = steps if len(steps) <= most else [steps[0], *steps[2:]]
        self._place = len(self._steps) - 1

    def _go(self, place: int) -> None:
        self._place = place
        self._show(self._steps[place])
        self._asked, self._failure = self.surface.patches, None

    @property
    def _has_unsaved_changes(self) -> bool:
        """Whether values or surface differ from the newest step."""
        here = self._steps[self._place]
        return self.surface is not here or self._asked != here.patches

    def _state(self, superseded: bool = False) -> State:
        after = len(self._steps) - 1 - self._place
        before = self._place + self._has_unsaved_changes
        return State(self.surface, self._certificate, self._asked, self._failure, before, after, superseded)


def until(stop: Callable[[], bool], end: float) -> Callable[[], bool]:
    """True when ``stop`` is, or when the monotonic clock has passed ``end``."""
    return lambda: stop() or time.monotonic() > end


def attempt(surface: Surface, stop: Callable[[], bool], **options: Any) -> Result:
    """Solve, and end early when ``stop`` becomes true."""

    def check(_: Progress) -> None:
        if stop():
            raise StopIteration

    return solve(surface, callback=check, **options)


@dataclass(frozen=True, eq=False)
class Reached:
    """The last surface at rest on the way to other values, and the failed attempt after it, if any.

    ``certificate`` is the surface's, without modes; None if there was no step at all.
    """

    surface: Surface
    certificate: Certificate | None
    failed: Certificate | None


def reach(
    start: Surface, asked: Surface, stop: Callable[[], bool], attempts: int = 100, **options: Any
) -> Reached:
    """Follow the equilibrium from ``start`` to the values of ``asked``; a step that fails is halved."""
    here, certificate, done, step = start, None, 0.0, 1.0
    failed = None
    for _ in range(attempts):
        ahead = min(1.0, done + step)
        aim = between(start, asked, ahead).moved(here.vertices)
        result = attempt(aim, stop, target="stationary", **options)
        ended = result.certify(modes=0)
        if ended.verdict in AT_REST:
            here, certificate, done, step = result.surface, ended, ahead, 2.0 * step
            if done == 1.0:
                return Reached(here, certificate, None)
        else:
            failed = ended if ahead == 1.0 or failed is None else failed
            step = 0.5 * (ahead - done)
        if step < SMALLEST_STEP or stop():
            break
    return Reached(here, certificate, failed)


def between(start: Surface, end: Surface, part: float) -> Surface:
    """``start`` with its tensions and pressures moved a part of the way to those of ``end``."""
    if part >= 1.0:
        tensions, pressures = end.tensions, end.pressures  # to the last digit
    else:
        tensions = (1.0 - part) * start.tensions + part * end.tensions
        pressures = (1.0 - part) * start.pressures + part * end.pressures
    names = [p.name for p in start.patches]
    return start.retensioned(
        dict(zip(names, tensions.tolist(), strict=True)),
        dict(zip(names, pressures.tolist(), strict=True)),
        [p.name for p in end.patches if p.wall],
    )
