"""A Python process that calls functions for this one, which so survives whatever they do.

``multiprocessing`` cannot do this: it imports the user's script again in each process, and refuses to start
one from a Dask worker. So the process is a script. If its parent dies, even by SIGKILL, the process ends
within a second, also in the middle of a call (on Windows, at the end of its call).
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from . import child_script

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
        self,
        place: Path,
        function: str,
        *arguments: Any,
        limit: float | None = None,
        memory: int | None = None,
    ) -> Any:
        """What a function in the file ``place`` returns; the file is loaded without its package.

        The arguments and the value returned are pickled. The process is killed after ``limit`` seconds; on
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
            self.process.stdin.write(pickle.dumps((str(place), function, arguments, memory)))
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
