"""A process in which VTK, rhino3dm and IfcOpenShell read files: bad ones crash them, or fill the memory.

They believe the counts and offsets in a file. Checking them all beforehand means to parse the file a second
time. So they read elsewhere, with limits of time and, on Linux, of memory. Starting the process takes as long
as importing PyVista here would. It is kept for the next file, and ends with this process.
"""

from __future__ import annotations

import atexit
import os
import threading
from pathlib import Path
from typing import Any

from ..base.child_process import ChildError, ChildProcess
from ..base.errors import FileError

SECONDS, PACE = 30.0, 1e6  # time limit of a file: this, and one more for so many bytes
MEMORY = 100  # bytes for each byte of the file, which may be compressed

_lock = threading.Lock()
_processes: dict[int, ChildProcess] = {}  # by the process that started it: a fork starts its own


def read_arrays(script: str, function: str, path: Path) -> dict[str, Any]:
    """The plain values that a function in a script of this package, such as io/reading_meshes.py, returns.

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
    """End the process that reads for this one."""
    process = _processes.pop(os.getpid(), None)
    if process is not None:
        process.close()
