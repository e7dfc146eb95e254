"""What the shell starts as ``pcmc``: Ctrl-C ends it in one line from its first moment to its last.

To import pcmc takes a good part of a second, and whatever lies in the package is imported after it. So
this is installed beside it, as ``pcmc_command``, and needs nothing.
"""

from __future__ import annotations

import os
import signal
import sys


def main() -> int:
    """Run the command; its exit code, as of ``pcmc.cli.main``."""
    ours = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # nohup has it ignored
    if ours:
        signal.signal(signal.SIGINT, _end)  # libraries half imported may lose an exception
    from pcmc.cli import main as run

    try:
        if ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        return run()
    except KeyboardInterrupt:
        return _stopped()
    finally:
        if ours:
            signal.signal(signal.SIGINT, _end)  # until Python has ended


def _stopped() -> int:
    print("pcmc: stopped", file=sys.stderr, flush=True)
    return 130


def _end(*_: object) -> None:
    os._exit(_stopped())
