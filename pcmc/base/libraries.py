"""Libraries that read and write formats: imported on demand, their errors translated.

VTK, rhino3dm, IfcOpenShell and MeshLab believe the counts and offsets in a file, so bad files crash them, or
fill the memory. So they read in a process of limited time and, on Linux, memory, kept for the next file.
"""

from __future__ import annotations

import atexit
import logging
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from .child_process import ChildError, ChildProcess
from .errors import FileError, MissingExtra, PcmcError

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
            arrays: dict[str, Any] = process.call(
                place, function, str(path.absolute()), limit=limit, memory=MEMORY * size
            )
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
