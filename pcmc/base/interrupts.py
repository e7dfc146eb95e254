"""Ctrl-C at a time that suits: libraries written in C lose it, report it as something else, or crash."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

ENDINGS = ("SIGINT", "SIGTERM", "SIGHUP")  # the last is not on every system


@contextmanager
def defer_interrupts() -> Iterator[None]:
    """Ctrl-C within the block is answered when it ends.

    >>> try:
    ...     with defer_interrupts():
    ...         signal.raise_signal(signal.SIGINT)
    ...         print("all of it")
    ... except KeyboardInterrupt:
    ...     print("and then the end")
    all of it
    and then the end
    """
    pressed: list[int] = []
    with _handled(lambda number, _: pressed.append(number), instead_of=signal.default_int_handler):
        yield
    if pressed:
        raise KeyboardInterrupt


@contextmanager
def termination_as_interrupt() -> Iterator[None]:
    """Within the block the program is ended like by Ctrl-C where its terminal is closed or it is told to
    end: files begun are cleared away."""
    with _handled(signal.default_int_handler, instead_of=signal.SIG_DFL):
        yield


@contextmanager
def _handled(handler: Any, instead_of: Any) -> Iterator[None]:
    """A handler in place of another, where that one is set; only the main thread may set any."""
    main = threading.current_thread() is threading.main_thread()
    known = [getattr(signal, name) for name in ENDINGS if hasattr(signal, name)]
    mine = [number for number in known if main and signal.getsignal(number) == instead_of]
    for number in mine:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number in mine:
            signal.signal(number, instead_of)
