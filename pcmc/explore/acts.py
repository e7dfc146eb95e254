"""The order of a session's acts: answered as they were sent, one at a time; newer ones end moves."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from functools import wraps
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .session import Session, SessionState


OVERTAKEN = 1.0  # seconds that an act waits for one that its page sent before it, on another connection
Turn = tuple[str, int]  # a page, and the number of its act


def act(
    moves: bool = False, ends: bool = False
) -> Callable[[Callable[..., SessionState]], Callable[..., SessionState]]:
    """A method that makes a state of the present one, done after the acts before it.

    One that ``moves``, or ``ends`` moves, ends those before it: their ``stop`` becomes true.
    """

    def made(method: Callable[..., SessionState]) -> Callable[..., SessionState]:
        @wraps(method)
        def run(self: Session, *given: Any, turn: Turn | None = None, **named: Any) -> SessionState:
            with self.order:
                if turn is not None:
                    page, number = turn
                    self.order.wait_for(lambda: self.turns.get(page, 0) >= number, OVERTAKEN)
                    self.turns[page] = max(number + 1, self.turns.get(page, 0))
                    self.order.notify_all()
                mine = self.arrived
                self.arrived += 1
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
