"""Libraries that read and write formats, and the process that calls functions for this one and survives them.

VTK, rhino3dm, IfcOpenShell and MeshLab believe the counts and offsets in a file, so bad files crash them, or
fill the memory. So they read in a process of limited time and, on Linux, memory, kept for the next file.
``multiprocessing`` cannot do this: it imports the user's script again in each process, and refuses to start
one from a Dask worker. So the process is a script. If its parent dies, even by SIGKILL, the process ends
within a second, also in the middle of a call (on Windows, at the end of its call).
"""

from __future__ import annotations

import atexit
import logging
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from . import child_script
from .errors import FileError, MissingExtra, PcmcError

OUTPUT = 4000  # characters of a dead process' output that are kept


class ChildError(Exception):
    """A call that failed after some ``seconds``.

    ``output`` is the traceback if the function raised an exception, else the last output of the process;
    ``code`` its exit code if it ended.
    """

    def __init__(self, message: str, output: str, code: int | None, seconds: float) -> None:
        super().__init__(message)
        self.output, self.code, self.seconds = output, code, seconds


class ChildProcess:
    """The process; it makes one call at a time. ``environment`` are variables besides those of this one."""

    def __init__(self, environment: Mapping[str, str] | None = None) -> None:
        self.log = tempfile.TemporaryFile()  # noqa: SIM115 (it lives as long as the process)
        self.process = subprocess.Popen(
            [sys.executable, "-P", str(child_script.__file__)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.log,
            env=os.environ | (environment or {}),
            # a group of its own: Ctrl-C reaches the parent alone, and a kill reaches grandchildren
            process_group=0 if os.name == "posix" else None,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
            | getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        self._begun = False

    def call(
        self, place: Path, function: str, *given: Any, limit: float | None = None, memory: int | None = None
    ) -> Any:
        """What a function in the file ``place`` returns; the file is loaded without its package.

        What is given and returned is pickled. The process is killed after ``limit`` seconds; on
        Linux ``memory`` are the bytes that it may use from then on, besides what it has and a gigabyte.
        ChildError if the function raises an exception, or the process ends. After another exception, such as
        KeyboardInterrupt, close the process: the next call would get this one's answer.
        """
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        begin = time.perf_counter()
        timer = threading.Timer(min(limit or threading.TIMEOUT_MAX, threading.TIMEOUT_MAX), self.kill)
        timer.daemon = True
        timer.start()
        try:
            if not self._begun:
                self.process.stdin.write(pickle.dumps(sys.path))
                self._begun = True
            self.process.stdin.write(pickle.dumps((str(place), function, given, memory)))
            self.process.stdin.flush()
            returned, answer, trace = pickle.load(self.process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            seconds = time.perf_counter() - begin
            self.kill()
            code = self.process.wait()
            length = self.log.seek(0, os.SEEK_END)
            self.log.seek(max(0, length - 4 * OUTPUT))  # bytes: a character has at most 4
            output = self.log.read().decode("utf-8", "replace")
            self.close()
            raise ChildError(f"the process ended, code {code}", output[-OUTPUT:], code, seconds) from None
        finally:
            timer.cancel()
        if not returned:
            raise ChildError(answer, trace, None, time.perf_counter() - begin)
        return answer

    @property
    def alive(self) -> bool:
        """Whether the process can take another call."""
        return self.process.poll() is None

    def kill(self) -> None:
        """Kill the process and all that it started, even if it has ended itself."""
        if os.name == "posix":
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, signal.SIGKILL)
        else:
            self.process.kill()

    def close(self) -> None:
        """Kill the process and free its files."""
        self.kill()
        self.process.wait()
        for stream in filter(None, (self.process.stdin, self.process.stdout, self.log)):
            with suppress(OSError):
                stream.close()


SECONDS, PACE = 30.0, 1e6  # time limit of a file: this, and one more for so many bytes
MEMORY = 100  # bytes for each byte of the file, which may be compressed

SILENT = logging.NullHandler()  # a library's log of a bad file goes to those who ask for it, not to stderr
_lock = threading.Lock()
_processes: dict[int, ChildProcess] = {}  # by the process that started it: a fork starts its own


def load_library(name: str, extra: str = "files") -> Any:
    logging.getLogger(name).addHandler(SILENT)
    try:
        return import_module(name)
    except ImportError:
        raise MissingExtra(name, extra) from None


class _Library:
    """A library that is loaded when something of it is first used; MissingExtra then if it is missing."""

    def __init__(self, name: str, extra: str) -> None:
        self._name, self._extra = name, extra

    def __getattr__(self, name: str) -> Any:
        return getattr(load_library(self._name, self._extra), name)


shapely: Any = _Library("shapely", "plan")
"""For geometry in the plane."""


def require(*names: str, extra: str = "files") -> None:
    """MissingExtra, with the last of these libraries, unless all are installed."""
    if any(find_spec(name) is None for name in names):
        raise MissingExtra(names[-1], extra)


@contextmanager
def translated_errors(kind: str) -> Iterator[None]:
    """Turn whatever a library raises on a bad file into a FileError of one line."""
    try:
        yield
    except (PcmcError, OSError, MissingExtra):
        raise
    except Exception as error:  # libraries raise anything, from KeyError to struct.error
        raise unreadable(kind, error) from None


def unreadable(kind: str, error: Exception) -> FileError:
    """The error in one line, for a file that is not of its kind."""
    text = " ".join(str(error).split())[:120]
    if isinstance(error, MemoryError):
        text = "its numbers ask for more memory than there is"
    reason = f"{type(error).__name__}: {text}" if text else type(error).__name__
    return FileError(f"not a readable {kind} file, or cut off ({reason})")


def read_arrays(script: str, function: str, path: Path) -> dict[str, Any]:
    """The plain values that a function in a script of this package, such as io/reading_scripts.py, returns;
    FileError if the library refuses the file, crashes or takes too long.
    """
    place, size = Path(__file__).parents[1] / script, path.stat().st_size
    limit = SECONDS + size / PACE
    with _lock:
        process = _processes.get(os.getpid())
        if process is None or not process.alive:
            process = _processes[os.getpid()] = ChildProcess()
        try:
            name, memory = str(path.absolute()), MEMORY * size
            arrays: dict[str, Any] = process.call(place, function, name, limit=limit, memory=memory)
            return arrays
        except ChildError as error:
            reason = str(error)
            if error.code is not None:
                late = error.seconds >= limit
                reason = f"stopped after {limit:.0f} s" if late else f"it ends its reader, code {error.code}"
        except BaseException:  # Ctrl-C: the next file must not get this one's answer
            process.close()
            raise
    raise FileError(f"not a readable {path.suffix[1:]} file, or cut off ({reason[:120]})")


@atexit.register
def end_process() -> None:
    process = _processes.pop(os.getpid(), None)
    if process is not None:
        process.close()
