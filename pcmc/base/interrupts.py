"""When Ctrl-C takes effect: libraries written in C may lose it, misreport it, or crash. And when to stop."""

from __future__ import annotations

import dis
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


def stop_requested(error: BaseException) -> None:
    """Accept a StopIteration that a ``raise`` statement asked for, and Ctrl-C; refuse others.

    That of ``next()`` of an empty iterator, or of a ``__next__``, is a mistake in a callback: RuntimeError as
    in generators (PEP 479). The instruction at which the innermost frame has stopped tells them apart.

    >>> def stop():
    ...     raise StopIteration
    >>> for callback in (stop, lambda: next(iter([]))):
    ...     try:
    ...         callback()
    ...     except StopIteration as error:
    ...         stop_requested(error)
    Traceback (most recent call last):
    ...
    RuntimeError: StopIteration out of next(), in <lambda>, where nothing asked to stop; raise it to stop
    """
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    if trace is None or not isinstance(error, StopIteration):
        return
    code = trace.tb_frame.f_code
    if code.co_code[trace.tb_lasti] != dis.opmap["RAISE_VARARGS"] or code.co_name == "__next__":
        what = f"StopIteration out of next(), in {code.co_name}"
        raise RuntimeError(f"{what}, where nothing asked to stop; raise it to stop") from error


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
