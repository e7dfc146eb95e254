"""A process in which VTK, rhino3dm and IfcOpenShell read files: bad ones crash them, or fill the memory.

They believe the counts and offsets in a file. Checking them all beforehand means to parse the file a second
time. So they read elsewhere, with limits of time and, on Linux, of memory. Starting the process takes as long
as importing PyVista here would. It is kept for the next file, and ends with this process.
"""

from __future__ import annotations

import atexit
import os
import pickle
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..base.errors import FileError
from . import reading_script

SECONDS, PACE = 30.0, 1e6  # time limit of a file: this, and one more for so many bytes

_lock = threading.Lock()
_processes: dict[int, ReadingProcess] = {}  # by the process that started it: a fork starts its own


def read_arrays(kind: str, path: Path) -> dict[str, Any]:
    """What the reader of this kind in ``reading_script`` returns.

    FileError if the library refuses the file, crashes or takes too long.
    """
    owner = os.getpid()
    with _lock:
        process = _processes.get(owner)
        if process is None or process.ended:
            process = _processes[owner] = ReadingProcess()
        try:
            outcome, answer = process.read(kind, path)
        except BaseException:  # Ctrl-C: the next file must not get this one's answer
            process.close()
            raise
    if outcome == "failed":
        raise FileError(f"not a readable {path.suffix[1:]} file, or cut off ({answer[:120]})")
    arrays: dict[str, Any] = answer
    return arrays


class ReadingProcess:
    """The process; ``read`` gives it one file at a time."""

    def __init__(self) -> None:
        self.owner = os.getpid()
        self.process = subprocess.Popen(
            [sys.executable, "-P", str(reading_script.__file__)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            # a group of its own: Ctrl-C is for the user's program, which then ends this one
            process_group=0 if os.name == "posix" else None,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        atexit.register(self.close)
        self._begun = False

    @property
    def ended(self) -> bool:
        """Whether the process can read no more files."""
        return self.process.poll() is not None

    def read(self, kind: str, path: Path) -> tuple[str, Any]:
        """("read", arrays), or ("failed", the reason)."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        size = path.stat().st_size
        limit = SECONDS + size / PACE
        timer = threading.Timer(limit, self.process.kill)
        timer.start()
        try:
            if not self._begun:
                self.process.stdin.write(pickle.dumps(sys.path))
                self._begun = True
            self.process.stdin.write(pickle.dumps((kind, str(path.absolute()), size)))
            self.process.stdin.flush()
            answer: tuple[str, Any] = pickle.load(self.process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            late = not timer.is_alive()
            self.close()
            code = self.process.returncode
            return "failed", f"stopped after {limit:.0f} s" if late else f"it ends its reader, code {code}"
        finally:
            timer.cancel()
        return answer

    def close(self) -> None:
        """End the process."""
        if os.getpid() != self.owner:
            return
        atexit.unregister(self.close)
        self.process.kill()
        self.process.wait()
        for stream in filter(None, (self.process.stdin, self.process.stdout)):
            with suppress(OSError):
                stream.close()
