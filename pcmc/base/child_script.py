"""The script of a ``ChildProcess``: it calls functions of files and writes what they return.

It imports the standard library alone, so that a process starts in some hundredths of a second.
"""

from __future__ import annotations

import faulthandler
import io
import os
import pickle
import signal
import sys
import threading
import time
import traceback
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

GIGABYTE = 1 << 30  # bytes that a call may use, besides those asked for
ORPHANED = 1.0  # seconds between two checks that the parent is alive


def load_file(place: str) -> Any:
    """The module in a file, which is loaded when it is first used; its package is not."""
    name = Path(place).stem
    if name not in sys.modules:
        spec = spec_from_file_location(name, place)
        assert spec is not None
        assert spec.loader is not None
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
        sys.modules[name] = module
    return sys.modules[name]


def limit_memory(size: int) -> None:
    """On Linux, refuse memory beyond what there is, a gigabyte and ``size`` bytes."""
    if sys.platform == "linux":
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        most = pages * resource.getpagesize() + GIGABYTE + size
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        resource.setrlimit(resource.RLIMIT_AS, (most if hard < 0 else min(most, hard), hard))


def outlive(parent: int) -> None:
    """End this process and all that it started soon after its parent, also in the middle of a call."""
    while os.getppid() == parent:  # always true on Windows, where the call runs to its end
        time.sleep(ORPHANED)
    os.killpg(0, signal.SIGKILL)


def answer_calls() -> None:
    """Answer until the other side closes: (True, value, ""), or (False, message, traceback)."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)  # what a call prints must not get between the answers
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    faulthandler.enable()
    if hasattr(os, "register_at_fork"):  # what a call forks must neither answer nor hold the pipes open
        nothing, pipes = os.open(os.devnull, os.O_RDWR), (requests.fileno(), answers.fileno())
        os.register_at_fork(after_in_child=lambda: [os.dup2(nothing, pipe, False) for pipe in pipes])
    threading.Thread(target=outlive, args=(os.getppid(),), daemon=True).start()
    try:
        sys.path[:] = pickle.load(requests)
        while True:
            place, function, arguments, memory = pickle.load(requests)
            sys.stdout.flush()
            os.lseek(2, 0, os.SEEK_SET)
            os.ftruncate(2, 0)  # the file then holds the output of this call alone
            try:
                if memory is not None:
                    limit_memory(memory)
                answer = (True, getattr(load_file(place), function)(*arguments), "")
            except Exception as error:
                text = "more memory than there is" if isinstance(error, MemoryError) else str(error)
                answer = (False, text, traceback.format_exc(limit=-3))
            pickle.dump(answer, answers, pickle.HIGHEST_PROTOCOL)
            answers.flush()
    except (EOFError, BrokenPipeError):
        os._exit(0)  # nobody asks any more


if __name__ == "__main__":
    answer_calls()
