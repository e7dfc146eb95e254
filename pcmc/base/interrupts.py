"""When Ctrl-C takes effect: libraries written in C may lose it, misreport it, or crash."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

ENDINGS = ("SIGINT", "SIGTERM", "SIGHUP")  # the last is not on every system


@contextmanager
def defer_interrupts() -> Iterator[None]:
    """Ctrl-C within the block raises KeyboardInterrupt when the block ends.

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
    with interrupts_handled(lambda number, _: pressed.append(number)):
        yield
    if pressed:
        raise KeyboardInterrupt


@contextmanager
def termination_as_interrupt() -> Iterator[None]:
    """Treat SIGTERM and SIGHUP like Ctrl-C within the block, so that temporary files are removed."""
    with interrupts_handled(signal.default_int_handler, instead_of=signal.SIG_DFL):
        yield


@contextmanager
def interrupts_handled(handler: Any, instead_of: Any = signal.default_int_handler) -> Iterator[None]:
    """Replace a handler by another in the block. Only the main thread may set handlers."""
    main = threading.current_thread() is threading.main_thread()
    known = [getattr(signal, name) for name in ENDINGS if hasattr(signal, name)]
    replaced = [number for number in known if main and signal.getsignal(number) == instead_of]
    for number in replaced:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number in replaced:
            signal.signal(number, instead_of)
