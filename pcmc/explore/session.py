"""The session of one page: the surface it shows, the values it asks for, and the steps to undo.

A session shows only surfaces at rest. If there is none for the values asked for, the last one stays, and the
certificate of the failed attempt gives the reason. Its acts are answered as they were sent, one at a time.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from functools import cached_property, partial, wraps
from itertools import count
from typing import Any

from ..accuracy import Margin, MeshCheck, check_mesh, margin
from ..base.errors import OptionError
from ..base.units import NO_UNITS, Units
from ..certificate import Certificate, certify
from ..certificate.quantities import figures
from ..certificate.theorem import Theorem, verify
from ..design import meet
from ..equilibria import Equilibria, find_equilibria
from ..meshing.remeshing import remesh
from ..project.values import changeable_values
from ..solvers import solve, solve_once
from ..surface import Surface
from ..surface.geometry import segment_lengths
from .following import AT_REST, ProjectFallback, Reached, Stop, Values, reach, solve_until, until, wanted
from .roof import Aims, Targets, Varied

FOLLOW: dict[str, Any] = {"iterations": 12, "tolerance": 1e-9}  # while a slider moves
SETTLE: dict[str, Any] = {"iterations": 40, "tolerance": 1e-11}  # when it is let go
FOLLOW_SECONDS = 1.0  # time limit of following, and as much again for each 50 000 triangles
SETTLE_SECONDS = 6.0  # time limit of settling
MOST_STEPS = 200  # to undo
MOST_BYTES = 64_000_000  # of vertices in these steps
MOST_VARIANTS = 20
OVERTAKEN = 1.0  # seconds that an act waits for one that its page sent before it, on another connection
Check = Callable[[object], None]  # tells a step; raises StopIteration once the page shows another surface
Advised = Callable[[MeshCheck, Check], MeshCheck]  # with what to type


@dataclass(frozen=True, eq=False)
class Variant:
    """A surface that is kept, with its name and certificate."""

    name: str
    surface: Surface
    certificate: Certificate

    @cached_property
    def data(self) -> dict[str, Any]:
        return {"name": self.name, "figures": figures_data(self.surface, self.certificate)}


def figures_data(surface: Surface, certificate: Certificate) -> list[dict[str, Any]]:
    """The key figures of a surface as plain data: quantity, of, owner, dimension and value of each."""
    return [row._asdict() | {"dimension": row.dimension} for row in figures(surface, certificate)]


@dataclass(frozen=True, eq=False)
class SessionState:
    """The surface of a session and all that the page shows about it; each act gives a new one."""

    surface: Surface
    certificate: Certificate
    wanted: Surface  # with the values asked for
    failure: Certificate | None = None  # of the attempt at the values asked for, if it did not come to rest
    steps: tuple[Surface, ...] = ()  # that ``undo`` and ``redo`` lead to; the first is that of ``reset``
    place: int = 0  # of the step shown last
    variants: tuple[Variant, ...] = ()
    compared: int | None = None  # the number of the variant compared with
    aims: Aims | None = None  # the targets met last, with what they vary
    message: str = ""  # how the search for targets ended; empty after other acts
    met: bool = False  # whether it met them, with a surface at rest
    note: str = ""  # how the values were reached where following did not lead there
    number: int = 0  # a later state has a greater one
    superseded: bool = False  # newer values have arrived meanwhile, so that the page ignores this state

    @property
    def undo(self) -> int:
        """The number of steps back; one more if values or surface differ from the newest step."""
        step = self.steps[self.place]
        same = self.surface is step and changeable_values(self.wanted) == changeable_values(step)
        return self.place + (not same)

    @property
    def redo(self) -> int:
        """The number of steps that were undone."""
        return len(self.steps) - 1 - self.place

    def asking(self, values: Values) -> SessionState:
        return replace(self, wanted=wanted(self.surface, values))

    def showing(self, surface: Surface, certificate: Certificate | None = None) -> SessionState:
        """Another surface, with the values that it has; only the start may not be at rest."""
        ended = certificate or certify(surface)
        failure = None if ended.verdict in AT_REST else ended
        return replace(self, surface=surface, certificate=ended, wanted=surface, failure=failure)

    def following(self, way: Reached, certificate: Certificate | None) -> SessionState:
        """The last surface at rest on the way to the values asked for."""
        if way.certificate is None:
            return replace(self, failure=way.failed)
        return replace(self.showing(way.surface, certificate), wanted=self.wanted, failure=way.failed)

    def stepped(self) -> SessionState:
        """The surface shown is the newest step."""
        if self.surface is self.steps[self.place]:
            return self
        most = max(4, min(MOST_STEPS, MOST_BYTES // self.surface.vertices.nbytes))
        steps = (*self.steps[: self.place + 1], self.surface)
        steps = steps if len(steps) <= most else (steps[0], *steps[2:])
        return replace(self, steps=steps, place=len(steps) - 1)

    def at(self, place: int) -> SessionState:
        """Back or forth to a step."""
        return replace(self.showing(self.steps[place]), place=place)

    def variant(self, number: int) -> Variant:
        if not 0 <= number < len(self.variants):
            raise OptionError(f"there is no variant {number + 1}", what="number", found=number)
        return self.variants[number]


def solved_start(surface: Surface) -> SessionState:
    """Solve a surface, unless it is at rest already; if no solver converges, return it unchanged."""
    certificate = ended = certify(surface)
    if certificate.verdict in AT_REST:
        return SessionState(surface, certificate, surface)
    for solver, target in ((solve_once, "stationary"), (solve, "minimum")):
        result = solver(surface, target=target)
        ended = result.certify()
        if ended.verdict in AT_REST:
            return SessionState(result.surface, ended, result.surface)
    return SessionState(surface, certificate, surface, failure=ended)


Turn = tuple[str, int]  # a page, and the number of its act
Act = Callable[..., SessionState]


def act(moves: bool = False, ends: bool = False) -> Callable[[Act], Act]:
    """A method that makes a state of the present one, done after the acts before it.

    One that ``moves``, or ``ends`` moves, ends those before it: their ``stop`` becomes true.
    """

    def made(method: Act) -> Act:
        @wraps(method)
        def run(self: Session, *given: Any, turn: Turn | None = None, **named: Any) -> SessionState:
            with self.order:
                if turn is not None:
                    page, number = turn
                    self.order.wait_for(lambda: self.turns.get(page, 0) >= number, OVERTAKEN)
                    self.turns[page] = max(number + 1, self.turns.get(page, 0))
                    self.order.notify_all()
                mine, self.arrived = self.arrived, self.arrived + 1
                if moves or ends:
                    self.newest = mine
                self.order.wait_for(lambda: self.served == mine)

            def late() -> bool:
                return moves and self.newest > mine

            try:
                with self.turn if moves else nullcontext():
                    fresh: dict[str, Any] = {"message": "", "met": False, "note": "", "superseded": False}
                    before = replace(self.now, number=self.now.number + 1, **fresh)
                    self.now = before if late() else method(self, before, late, *given, **named)
                    if late():
                        self.now = replace(self.now, wanted=before.wanted, superseded=True)
                    return self.now
            finally:
                with self.order:
                    self.served += 1
                    self.order.notify_all()

        return run

    return made


@dataclass
class Session:
    """A surface that follows its values; every method is safe to call from any thread.

    Calls are answered in the order in which they come, and none is dropped; but a move ends early when a
    newer one, or an act that shows another surface, has come after it.
    """

    start: SessionState
    turn: AbstractContextManager[Any] = field(default_factory=nullcontext)  # held by each move while it works
    units: Units = NO_UNITS
    fallback: ProjectFallback = field(default_factory=ProjectFallback)  # of the project behind the surface
    checks: AbstractContextManager[Any] = field(default_factory=nullcontext)  # held by each mesh check
    progress: str = ""  # of the search for targets or equilibria
    found: Equilibria | None = None  # by the last search

    def __post_init__(self) -> None:
        self.order = threading.Condition()
        self.arrived = self.served = self.newest = 0  # numbers of acts
        self.turns: dict[str, int] = {}  # by page, the number of the act that it sends next
        self.fallback = self.fallback.with_walls(self.start.surface)
        self.now = replace(self.start, steps=(self.start.surface,))

    @property
    def surface(self) -> Surface:
        return self.now.surface

    @act()
    def state(self, state: SessionState, stop: Stop) -> SessionState:
        return state

    @act(moves=True)
    def follow(self, state: SessionState, stop: Stop, values: Values) -> SessionState:
        """Move towards these values while a slider moves: as far as two quick attempts lead."""
        state = state.asking(values)
        late = until(stop, FOLLOW_SECONDS * (1.0 + state.wanted.m / 50_000))
        way = reach(state.surface, state.wanted, late, attempts=2, **FOLLOW)
        failed = way.failed if way.certificate is None else None
        return state if stop() else state.following(way._replace(failed=failed), way.certificate)

    @act(moves=True)
    def settle(self, state: SessionState, stop: Stop, values: Values) -> SessionState:
        """Move to these values, or as close as possible; the surface reached is a step of ``undo``."""
        state, progress = state.asking(values), partial(setattr, self, "progress")
        settled = self.fallback.settle(state.surface, state.wanted, stop, SETTLE_SECONDS, progress, **SETTLE)
        if stop():
            return state
        way, note, self.fallback = settled
        new = replace(state.following(way, None), note=note)
        return (replace(new, wanted=way.surface) if note and way.failed is None else new).stepped()

    @act(moves=True)
    def stabilise(self, state: SessionState, stop: Stop) -> SessionState:
        """Move from a saddle to a stable shape, if there is one nearby."""
        result = solve_until(state.surface, until(stop, SETTLE_SECONDS), target="minimum")
        ended = result.certify()
        if stop():
            return state
        if ended.verdict not in AT_REST:
            return replace(state, failure=ended)
        return replace(state.showing(result.surface, ended), wanted=state.wanted).stepped()

    @act(moves=True)
    def remesh(self, state: SessionState, stop: Stop) -> SessionState:
        """New triangles of the mean size for the surface shown, and from there to the values asked for."""
        asked, late = changeable_values(state.wanted), until(stop, 2.0 * SETTLE_SECONDS)
        mean = segment_lengths(state.surface.vertices, state.surface.topology.edges).mean()
        result = solve_until(remesh(state.surface, float(mean)), late, **SETTLE)
        if stop():
            return state
        if result.certificate.verdict not in AT_REST:
            return replace(state, failure=result.certificate)
        state = state.showing(result.surface).stepped().asking(asked)
        if changeable_values(state.surface) != asked:
            way = reach(state.surface, state.wanted, late, **SETTLE)
            state = state.following(way, None).stepped()
        return state

    @act(moves=True)
    def meet(
        self, state: SessionState, stop: Stop, targets: Targets, vary: Varied, gone: Stop = lambda: False
    ) -> SessionState:
        """Move to values that meet the targets; ``message`` says why not. ``gone``: the page is closed."""
        solves = count(1)

        def check(_: object) -> None:
            self.progress = f"{next(solves)} solves"
            if stop() or gone():
                raise StopIteration

        try:
            design = meet(state.surface, targets, vary, callback=check)
        finally:
            self.progress = ""
        if stop():
            return state
        ended, message = design.certificate, design.text(self.units)
        if design.met and ended.verdict in AT_REST:
            state = replace(state.showing(design.surface), aims=(targets, vary), met=True).stepped()
        elif design.met:
            message += f"; but {ended.verdict.value}; {ended.detail}"
        return replace(state, message=message)

    @act()
    def keep(self, state: SessionState, stop: Stop, name: str) -> SessionState:
        """Keep the surface shown as a variant; one of the same name is replaced."""
        kept = {variant.name: variant for variant in state.variants}
        if name not in kept and len(kept) >= MOST_VARIANTS:
            text = f"there are {len(kept)} variants; remove one first"
            raise OptionError(text, what="variants", found=len(kept))
        kept[name] = Variant(name, state.surface, certify(state.surface))
        return replace(state, variants=tuple(kept.values()))

    @act()
    def forget(self, state: SessionState, stop: Stop, number: int) -> SessionState:
        gone, compared = state.variant(number), state.compared
        if compared is not None and compared >= number:
            compared = None if compared == number else compared - 1
        rest = tuple(variant for variant in state.variants if variant is not gone)
        return replace(state, variants=rest, compared=compared)

    @act(ends=True)
    def recall(self, state: SessionState, stop: Stop, number: int) -> SessionState:
        """Show a variant again, as a new step."""
        return state.showing(state.variant(number).surface).stepped()

    @act(ends=True)
    def visit(self, state: SessionState, stop: Stop, number: int) -> SessionState:
        """Show one of the surfaces of the last search, at its own values, as a new step."""
        surfaces = self.found.surfaces if self.found is not None else ()
        if not 0 <= number < len(surfaces):
            raise OptionError(f"no search has found a surface {number + 1}", what="number", found=number)
        return state.showing(surfaces[number]).stepped()

    @act()
    def compare(self, state: SessionState, stop: Stop, number: int | None = None) -> SessionState:
        """Compare the surface shown with a variant, or with none."""
        if number is not None:
            state.variant(number)
        return replace(state, compared=number)

    @act(ends=True)
    def renew(
        self, state: SessionState, stop: Stop, start: SessionState, units: Units, fallback: ProjectFallback
    ) -> SessionState:
        """Show another start, as a new step: the file behind the page was saved."""
        self.start, self.units, self.found = start, units, None
        self.fallback = fallback.with_walls(start.surface)
        return replace(state.showing(start.surface, start.certificate), aims=None).stepped()

    @act(ends=True)
    def stop(self, state: SessionState, stop: Stop) -> SessionState:
        """End the work under way."""
        return state

    @act(ends=True)
    def undo(self, state: SessionState, stop: Stop) -> SessionState:
        """One step back; if the values asked for were not reached, back to those of the surface shown."""
        return state.at(max(state.undo - 1, 0))

    @act(ends=True)
    def redo(self, state: SessionState, stop: Stop) -> SessionState:
        """Repeat the step that was undone."""
        return state.at(min(state.place + 1, len(state.steps) - 1))

    @act(ends=True)
    def reset(self, state: SessionState, stop: Stop) -> SessionState:
        """Return to the start, as a new step."""
        return state.showing(self.start.surface).stepped()

    def check_mesh(self, gone: Stop = lambda: False, advised: Advised = lambda c, _: c) -> MeshCheck | None:
        """The mesh check of the surface shown, ``advised``; None if the page closes or shows another."""
        return self._look(lambda shown, check: advised(check_mesh(shown, callback=check), check), gone)

    def margin(self, what: str, gone: Stop = lambda: False) -> Margin | None:
        """How far the surface shown is from the edge; None as for ``check_mesh``."""
        return self._look(lambda shown, check: margin(shown, what, callback=check), gone)

    def equilibria(self, what: str, gone: Stop = lambda: False) -> Equilibria | None:
        """The equilibria at the values shown, by branches in one of these; None as for ``check_mesh``."""
        found = self._look(lambda shown, check: find_equilibria(shown, what, callback=check), gone)
        if found is not None and not found.stopped:
            self.found = found
            return found
        return None

    def verify(self) -> Theorem:
        """What is proved of the surface shown."""
        with self.checks:
            return verify(self.surface)

    def _look(self, at: Callable[[Surface, Check], Any], gone: Stop) -> Any:
        shown = self.surface

        def check(step: object) -> None:
            self.progress = step if isinstance(step, str) else self.progress
            if self.surface is not shown or gone():
                raise StopIteration

        with self.checks:
            try:
                return at(shown, check)
            except (KeyboardInterrupt, StopIteration):
                return None
            finally:
                self.progress = ""
