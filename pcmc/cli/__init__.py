"""The ``pcmc`` command: arguments, messages, exit codes.

This file imports nothing heavy, so that ``main`` handles Ctrl-C before numpy and scipy are imported.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress

OK, NOT_CERTIFIED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130  # exit codes
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # of glibc's malloc.h


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command. The shell's ``pcmc`` calls this; ``arguments`` are by default ``sys.argv[1:]``.

    Returns the exit code. 0: the result is certified, or a command that certifies nothing has succeeded;
    1: the result is not certified; 2: bad input, or no command at all, which prints the help; 130: stopped
    by Ctrl-C.

    >>> main(["certify", "roof.obk"])
    2
    """
    default = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # nohup ignores it
    own_process = arguments is None and default
    if arguments is None:
        keep_freed_memory()
    if own_process:
        signal.signal(signal.SIGINT, _exit)  # a library that is half imported may lose an exception
        gc.disable()  # until all is imported; what lives to the end is not worth searching
    from .running import run_command

    try:
        if own_process:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        return run_command(sys.argv[1:] if arguments is None else list(arguments))
    except KeyboardInterrupt:
        return _stopped()
    finally:
        if own_process:
            signal.signal(signal.SIGINT, _exit)  # until Python has ended
            gc.freeze()  # and it ends without a last search


def keep_freed_memory() -> None:
    """Let large arrays reuse the memory of those before, which Linux would take back and clear each time."""
    if sys.platform == "linux":
        import ctypes

        with suppress(AttributeError):  # of glibc alone
            set_option = ctypes.CDLL(None).mallopt
            # before 2.35 it refuses the first; the second alone would map every array anew
            set_option(M_MMAP_THRESHOLD, 2**31 - 1) and set_option(M_TRIM_THRESHOLD, -1)


def _stopped() -> int:
    print("pcmc: stopped", file=sys.stderr, flush=True)
    return INTERRUPTED


def _exit(*_: object) -> None:
    os._exit(_stopped())
