"""The session of one page: the surface it shows, the values it asks for, and the steps to undo.

A session shows only surfaces at rest. If there is none for the values asked for, the last one stays, and the
certificate of the failed attempt gives the reason.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from itertools import count
from typing import Any, TypeVar

from .. import existence
from ..accuracy import MeshCheck, check_mesh
from ..base.errors import OptionError
from ..base.units import NO_UNITS, Units
from ..certificate import Certificate, certify
from ..design import Parameter, Target, meet
from ..margins import Margin, margin
from ..meshing.remeshing import remesh
from ..project.values import values_of
from ..solvers import solve
from ..solvers.result import Callback, Progress
from ..surface import Patch, Surface
from ..surface.geometry import segment_lengths
from ..verification import Theorem, verify
from .following import AT_REST, Values, attempt, reach, until, wanted
from .own_way import OwnWay
from .variants import MOST_VARIANTS, Variant

FOLLOW: dict[str, Any] = {"iterations": 12, "tolerance": 1e-9}  # while a slider moves
SETTLE: dict[str, Any] = {"iterations": 40, "tolerance": 1e-11}  # when it is let go
FOLLOW_SECONDS = 1.0  # time limit of following, and as much again for each 50 000 triangles
SETTLE_SECONDS = 6.0  # time limit of settling
MOST_STEPS = 200  # to undo
MOST_BYTES = 64_000_000  # of vertices in these steps

Found = TypeVar("Found")
Aims = tuple[tuple[Target, ...], tuple[Parameter, ...]]


@dataclass(frozen=True, eq=False)
class State:
    """The surface of a session and all that the page shows about it.

    Attributes
    ----------
    surface, certificate : the surface to show and its certificate.
    wanted : a surface with the values asked for.
    failure : certificate of the attempt at the values asked for, if it did not come to rest.
    undo, redo : how many steps there are either way.
    superseded : whether newer values have arrived meanwhile, so that the page ignores this state.
    message : how the search for targets ended; empty after other acts.
    met : whether it met them, with a surface at rest.
    number : of the state; a later one is greater.
    note : how the values were reached where following did not lead there; else empty.
    variants : those kept; ``compared`` is the number of the one compared with, or None.
    aims : the targets met last, with what they vary, or None.
    """

    surface: Surface
    certificate: Certificate
    wanted: Surface
    failure: Certificate | None = None
    undo: int = 0
    redo: int = 0
    superseded: bool = False
    message: str = ""
    met: bool = False
    number: int = 0
    note: str = ""
    variants: tuple[Variant, ...] = ()
    compared: int | None = None
    aims: Aims | None = None

    @property
    def asked(self) -> tuple[Patch, ...]:
        """The patches with the values asked for."""
        return self.wanted.patches


def never() -> bool:
    """False."""
    return False


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
            return State(result.surface, ended, result.surface)
        failure = ended
    return State(surface, certificate, surface, failure)


class Session:
    """A surface that follows its values; every method is safe to call from any thread.

    Calls are answered in the order in which they come, and none is dropped: but a move (to other values, to
    targets, to new triangles) ends early when a newer move, or an act that shows another surface, has come
    after it. Each move holds ``turn`` while it works, a mesh check ``checks``. ``own_way`` is what the
    project behind the surface does where following leads nowhere.
    """

    def __init__(
        self,
        start: State,
        turn: AbstractContextManager[Any] | None = None,
        units: Units = NO_UNITS,
        own_way: OwnWay | None = None,
        checks: AbstractContextManager[Any] | None = None,
    ) -> None:
        self._order, self._turn = threading.Condition(), turn or nullcontext()
        self._checks = checks or nullcontext()
        self._arrived = self._served = self._newest = self._states = 0
        self._units = units
        self._own_way = (own_way or OwnWay()).giving(start.surface)
        self.surface, self._certificate = start.surface, start.certificate
        self._wanted, self._failure = start.wanted, start.failure
        self._start = self.surface
        self._steps, self._place = [self.surface], 0
        self._message, self._met, self._note = "", False, ""
        self._compared: int | None = None
        self.variants: list[Variant] = []
        self.aims: Aims | None = None
        self.progress = ""  # of the search for targets

    def state(self) -> State:
        """The present state."""
        return self._run(lambda stop: None)

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

        return self._run(act, moves=True)

    def settle(self, values: Values) -> State:
        """Move to these values, or as close as possible, in as many steps as needed.

        The surface reached is a step that ``undo`` returns to.
        """

        def act(stop: Callable[[], bool]) -> None:
            asked, end = self._with_values(values), time.monotonic() + SETTLE_SECONDS
            settled = self._own_way.settle(self.surface, asked, stop, end, self._report, **SETTLE)
            if stop():
                return
            way, self._note, self._own_way = settled
            if self._note and way.failed is None:
                self._wanted = way.surface
            if way.certificate is not None:
                self._show(way.surface)
            self._failure = way.failed
            self._add_step()

        return self._run(act, moves=True)

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

        return self._run(act, moves=True)

    def remesh(self) -> State:
        """New triangles of the mean size for the surface shown, and from there to the values asked for."""

        def act(stop: Callable[[], bool]) -> None:
            asked, end = values_of(self._wanted), time.monotonic() + 2.0 * SETTLE_SECONDS
            mean = segment_lengths(self.surface.vertices, self.surface.topology.edges).mean()
            result = attempt(remesh(self.surface, float(mean)), until(stop, end), **SETTLE)
            if stop():
                return
            if result.certificate.verdict not in AT_REST:
                self._failure = result.certificate
                return
            self._go_on_with(result.surface)
            self._wanted = wanted(self.surface, asked)
            if values_of(self.surface) != asked:
                way = reach(self.surface, self._wanted, until(stop, end), **SETTLE)
                if way.certificate is not None:
                    self._show(way.surface)
                self._failure = way.failed
                self._add_step()

        return self._run(act, moves=True)

    def meet(
        self, targets: tuple[Target, ...], vary: tuple[Parameter, ...], gone: Callable[[], bool] = never
    ) -> State:
        """Move to values that meet the targets; if there are none, ``message`` says why.

        The search ends when ``gone``: its page was closed.
        """

        def act(stop: Callable[[], bool]) -> None:
            solves = count(1)

            def check(_: object) -> None:
                self.progress = f"{next(solves)} solves"
                if stop() or gone():
                    raise StopIteration

            try:
                design = meet(self.surface, targets, vary, callback=check)
            finally:
                self.progress = ""
            if stop():
                return
            certificate = design.certificate
            self._message = design.text(self._units)
            self._met = design.met and certificate.verdict in AT_REST
            if self._met:
                self._show(design.surface)
                self._wanted, self._failure = design.surface, None
                self.aims = targets, vary
                self._add_step()
            elif design.met:
                self._message += f"; but {certificate.verdict.value}; {certificate.detail}"

        return self._run(act, moves=True)

    def keep(self, name: str) -> State:
        """Keep the surface shown as a variant; one of the same name is replaced."""

        def act(stop: Callable[[], bool]) -> None:
            names = [variant.name for variant in self.variants]
            variant = Variant(name, self.surface, certify(self.surface))
            if name in names:
                self.variants[names.index(name)] = variant
            elif len(names) >= MOST_VARIANTS:
                text = f"there are {MOST_VARIANTS} variants; remove one first"
                raise OptionError(text, what="variants", found=len(names))
            else:
                self.variants.append(variant)

        return self._run(act)

    def forget(self, number: int) -> State:
        """Remove a variant."""

        def act(stop: Callable[[], bool]) -> None:
            self._variant(number)
            del self.variants[number]
            if self._compared is not None and self._compared >= number:
                self._compared = None if self._compared == number else self._compared - 1

        return self._run(act)

    def recall(self, number: int) -> State:
        """Show a variant again, as a new step."""

        def act(stop: Callable[[], bool]) -> None:
            self._go_on_with(self._variant(number).surface)

        return self._run(act, ends=True)

    def compare(self, number: int | None) -> State:
        """Compare the surface shown with a variant, or with none."""

        def act(stop: Callable[[], bool]) -> None:
            if number is not None:
                self._variant(number)
            self._compared = number

        return self._run(act)

    def renew(self, start: State, units: Units = NO_UNITS, own_way: OwnWay | None = None) -> State:
        """Show another start, as a new step: the file behind the page was saved."""

        def act(stop: Callable[[], bool]) -> None:
            self._start, self._units, self.aims = start.surface, units, None
            self._own_way = (own_way or self._own_way).giving(start.surface)
            self.surface, self._certificate = start.surface, start.certificate
            self._wanted, self._failure = start.wanted, start.failure
            self._add_step()

        return self._run(act, ends=True)

    def stop(self) -> State:
        """End the work under way."""
        return self._run(lambda stop: None, ends=True)

    def check_mesh(self, gone: Callable[[], bool] = never) -> MeshCheck | None:
        """The mesh check of the surface shown; None if the page shows another one, or is closed, before."""
        return self._look(lambda shown, check: check_mesh(shown, callback=check), gone)

    def margin(self, what: str, gone: Callable[[], bool] = never) -> Margin | None:
        """How far the surface shown is from the edge; None as of ``check_mesh``."""
        return self._look(lambda shown, check: margin(shown, what, callback=check), gone)

    def _look(self, at: Callable[[Surface, Callback], Found], gone: Callable[[], bool]) -> Found | None:
        """What is found about the surface shown; None if the page shows another one, or is closed, before."""
        shown = self.surface

        def check(_: Progress) -> None:
            if self.surface is not shown or gone():
                raise StopIteration

        with self._checks:
            try:
                return at(shown, check)
            except KeyboardInterrupt:
                return None

    def verify(self) -> Theorem:
        """What is proved of the surface shown."""
        with self._checks:
            return verify(self.surface)

    def undo(self) -> State:
        """One step back; if the values asked for were not reached, back to those of the surface shown."""

        def act(stop: Callable[[], bool]) -> None:
            self._go(self._place if self._has_unsaved_changes else max(self._place - 1, 0))

        return self._run(act, ends=True)

    def redo(self) -> State:
        """Repeat the step that was undone."""
        return self._run(lambda stop: self._go(min(self._place + 1, len(self._steps) - 1)), ends=True)

    def reset(self) -> State:
        """Return to the start, as a new step."""
        return self._run(lambda stop: self._go_on_with(self._start), ends=True)

    # -- below here it is a call's turn -----------------------------------------------------------------

    def _run(
        self, act: Callable[[Callable[[], bool]], None], moves: bool = False, ends: bool = False
    ) -> State:
        """Do an act after those before it; one that ``moves`` or ``ends`` moves ends moves before it."""
        with self._order:
            mine = self._arrived
            self._arrived += 1
            if moves or ends:
                self._newest = mine
            self._order.wait_for(lambda: self._served == mine)

        def late() -> bool:
            return moves and self._newest > mine

        try:
            with self._turn if moves else nullcontext():
                before = self._wanted
                self._message, self._met, self._note = "", False, ""
                if not late():
                    act(late)
                if late():
                    self._wanted = before
                return self._state(superseded=late())
        finally:
            with self._order:
                self._served += 1
                self._order.notify_all()

    def _with_values(self, values: Values) -> Surface:
        """The surface shown, with the values asked for."""
        self._wanted = wanted(self.surface, values)
        return self._wanted

    def _report(self, words: str) -> None:
        """What the work under way does now."""
        self.progress = words

    def _show(self, surface: Surface) -> None:
        self.surface, self._certificate = surface, certify(surface)

    def _go_on_with(self, surface: Surface) -> None:
        """Show a surface as the newest step."""
        self._show(surface)
        self._wanted, self._failure = surface, None
        self._add_step()

    def _variant(self, number: int) -> Variant:
        if not 0 <= number < len(self.variants):
            raise OptionError(f"there is no variant {number + 1}", what="number", found=number)
        return self.variants[number]

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
        self._wanted, self._failure = self.surface, None

    @property
    def _has_unsaved_changes(self) -> bool:
        """Whether values or surface differ from the newest step."""
        here = self._steps[self._place]
        return self.surface is not here or values_of(self._wanted) != values_of(here)

    def _state(self, superseded: bool = False) -> State:
        self._states += 1
        after = len(self._steps) - 1 - self._place
        before = self._place + self._has_unsaved_changes
        return State(
            self.surface,
            self._certificate,
            self._wanted,
            self._failure,
            before,
            after,
            superseded,
            self._message,
            self._met,
            self._states,
            self._note,
            tuple(self.variants),
            self._compared,
            self.aims,
        )
