"""One page's draft: the surface it shows, the values it asks for, and the way back.

Only surfaces at rest are shown. Where the values asked for have none, the last one stays, and the certificate
of the attempt says why.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

from ..certificate import Certificate, Verdict, certify
from ..solvers import solve
from ..solvers.result import Progress, Result
from ..surface import Patch, Surface
from ..surface.wall_pressures import with_pressures

AT_REST = (Verdict.STABLE, Verdict.NEUTRAL, Verdict.SADDLE)
FOLLOW: dict[str, Any] = {"iterations": 12, "tolerance": 1e-9}  # while a slider moves
SETTLE: dict[str, Any] = {"iterations": 40, "tolerance": 1e-11}  # when it is let go
GLANCE = 1.0  # seconds that following may take, and as many again for each 50 000 triangles
PATIENCE = 6.0  # seconds that settling may take
SMALLEST = 1.0 / 64.0  # part of the way below which settling is not cut up further
STEPS_KEPT = 200
BYTES_KEPT = 64_000_000

Values = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, eq=False)
class State:
    """What the page is told.

    Attributes
    ----------
    surface, found : the surface to show and its certificate.
    asked : the patches with the values asked for.
    trouble : certificate of the attempt at the values asked for, where it did not come to rest.
    undo, redo : how many steps there are either way.
    superseded : whether newer values came meanwhile, so that this is of no interest.
    """

    surface: Surface
    found: Certificate
    asked: tuple[Patch, ...]
    trouble: Certificate | None
    undo: int
    redo: int
    superseded: bool = False


@dataclass(frozen=True, eq=False)
class Beginning:
    """The surface that every draft begins with, its certificate, and what went wrong with it, if so."""

    surface: Surface
    found: Certificate
    trouble: Certificate | None


def begin(surface: Surface) -> Beginning:
    """Solve a surface, unless it is at rest already; where no solver comes to rest, leave it as it is."""
    found = certify(surface)
    trouble = None if found.verdict in AT_REST else found
    for target in ("stationary", "minimum"):
        if trouble is None:
            break
        result = solve(surface, target=target)
        ended = result.certify()
        if ended.verdict in AT_REST:
            return Beginning(result.surface, ended, None)
        trouble = ended
    return Beginning(surface, found, trouble)


class Draft:
    """A surface that follows its values; every method is safe to call from any thread.

    A newer call ends the work on an older one. ``turn`` is held while there is work to do.
    """

    def __init__(
        self, beginning: Beginning, turn: AbstractContextManager[Any] | None = None
    ) -> None:
        self._lock = threading.Lock()
        self._turn = turn or nullcontext()
        self._asked_for = 0
        self.surface = beginning.surface
        self._found = beginning.found
        self._trouble = beginning.trouble
        self._asked = self.surface.patches
        self._steps = [self.surface]
        self._place = 0

    def state(self) -> State:
        """What there is to show now."""
        with self._lock:
            return self._state()

    def follow(self, values: Values) -> State:
        """Towards these tensions and pressures while a slider moves: as far as two quick attempts lead."""

        def act(stop: Callable[[], bool]) -> None:
            asked = self._wanted(values)
            end = time.monotonic() + GLANCE * (1.0 + asked.m / 50_000)
            way = reach(self.surface, asked, until(stop, end), attempts=2, **FOLLOW)
            if stop():
                return
            if way.found is not None:
                self.surface, self._found, self._trouble = way.surface, way.found, None
            else:
                self._trouble = way.failed

        return self._run(act)

    def settle(self, values: Values) -> State:
        """To these values, in as many steps as it takes; where there is no way, as far as there is.

        What is reached is a step that ``undo`` returns to.
        """

        def act(stop: Callable[[], bool]) -> None:
            asked, end = self._wanted(values), time.monotonic() + PATIENCE
            way = reach(self.surface, asked, until(stop, end), **SETTLE)
            if stop():
                return
            if way.found is not None:
                self._show(way.surface)
            self._trouble = way.failed
            self._keep()

        return self._run(act)

    def stabilise(self) -> State:
        """From a saddle down to a stable shape, if there is one nearby."""

        def act(stop: Callable[[], bool]) -> None:
            end = time.monotonic() + PATIENCE
            result = attempt(self.surface, until(stop, end), target="minimum")
            found = result.certify()
            if stop():
                return
            if found.verdict in AT_REST:
                self.surface, self._found, self._trouble = result.surface, found, None
                self._keep()
            else:
                self._trouble = found

        return self._run(act)

    def undo(self) -> State:
        """A step back; from values that were not reached, back to those that are shown."""
        return self._run(
            lambda stop: self._go(self._place if self._astray else max(self._place - 1, 0))
        )

    def redo(self) -> State:
        """The step that was undone, again."""
        return self._run(lambda stop: self._go(min(self._place + 1, len(self._steps) - 1)))

    def reset(self) -> State:
        """To the beginning, as a step of its own."""

        def act(stop: Callable[[], bool]) -> None:
            self._show(self._steps[0])
            self._asked, self._trouble = self.surface.patches, None
            self._keep()

        return self._run(act)

    # -- below here the lock is held ---------------------------------------------------------------

    def _run(self, act: Callable[[Callable[[], bool]], None]) -> State:
        self._asked_for += 1
        mine = self._asked_for

        def late() -> bool:
            return mine < self._asked_for

        with self._lock, self._turn:
            before = self._asked
            if not late():
                act(late)
            if late():
                self._asked = before
            return self._state(superseded=late())

    def _wanted(self, values: Values) -> Surface:
        """The surface shown, with the values asked for."""
        given = {key: dict(values.get(key) or {}) for key in ("tensions", "pressures")}
        wanted = with_pressures(self.surface, given["tensions"], given["pressures"])
        self._asked = wanted.patches
        return wanted

    def _show(self, surface: Surface) -> None:
        self.surface, self._found = surface, certify(surface)

    def _keep(self) -> None:
        """What is shown becomes the newest step."""
        if self.surface is self._steps[self._place]:
            return
        most = max(4, min(STEPS_KEPT, BYTES_KEPT // self.surface.vertices.nbytes))
        kept = [*self._steps[: self._place + 1], self.surface]
        # the first stays: it is what ``reset`` returns to
        self._steps = kept if len(kept) <= most else [kept[0], *kept[2:]]
        self._place = len(self._steps) - 1

    def _go(self, place: int) -> None:
        self._place = place
        self._show(self._steps[place])
        self._asked, self._trouble = self.surface.patches, None

    @property
    def _astray(self) -> bool:
        """Whether values or surface have left the newest step without becoming one."""
        here = self._steps[self._place]
        return self.surface is not here or self._asked != here.patches

    def _state(self, superseded: bool = False) -> State:
        after = len(self._steps) - 1 - self._place
        return State(
            self.surface, self._found, self._asked, self._trouble, self._place + self._astray, after,
            superseded,
        )  # fmt: skip


def until(stop: Callable[[], bool], end: float) -> Callable[[], bool]:
    """When to stop: as told, or when the monotonic clock shows ``end``."""
    return lambda: stop() or time.monotonic() > end


def attempt(surface: Surface, stop: Callable[[], bool], **options: Any) -> Result:
    """Solve, and stop when told to."""

    def check(_: Progress) -> None:
        if stop():
            raise StopIteration

    return solve(surface, callback=check, **options)


@dataclass(frozen=True, eq=False)
class Reached:
    """How far a way of changing values led: the last surface at rest, and what ended it, if anything did.

    ``found`` is the surface's certificate without modes; None where there was no step at all.
    """

    surface: Surface
    found: Certificate | None
    failed: Certificate | None


def reach(
    start: Surface, asked: Surface, stop: Callable[[], bool], attempts: int = 100, **options: Any
) -> Reached:
    """Follow the equilibrium from ``start`` to the values of ``asked``, in steps halved where one fails."""
    here, found, done, step = start, None, 0.0, 1.0
    failed = None
    for _ in range(attempts):
        ahead = min(1.0, done + step)
        aim = between(start, asked, ahead).moved(here.vertices)
        result = attempt(aim, stop, target="stationary", **options)
        ended = result.certify(modes=0)
        if ended.verdict in AT_REST:
            here, found, done, step = result.surface, ended, ahead, 2.0 * step
            if done == 1.0:
                return Reached(here, found, None)
        else:
            failed = ended if ahead == 1.0 or failed is None else failed
            step = 0.5 * (ahead - done)
        if step < SMALLEST or stop():
            break
    return Reached(here, found, failed)


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
