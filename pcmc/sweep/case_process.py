"""Run a case in a process of its own, so that its caller survives whatever the case does.

Every executor runs the same task, ``run_case``, which gives the case to a process and waits. A case that
hangs or dies ends its own process and nothing else: its caller is a thread of the sweep, a worker of a
process pool, or a Dask worker on another machine. Python's process pool cannot do this: it breaks as a whole
when a worker dies, and it cannot stop a task that hangs. ``multiprocessing`` cannot either: it imports the
user's script again in each process, and refuses to start one from a Dask worker. So the process is a script.

Processes are kept between the cases of one sweep, so that a case is imported and compiled once. If the
parent of a process dies, even by SIGKILL, the process ends within a second, also in the middle of a case
(on Windows, at the end of its case).
"""

from __future__ import annotations

import math
import os
import pickle
import platform
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any

from ..base.errors import SweepError
from . import case_script

GRACE = 2.0  # seconds that a process may exceed its time limit before it is killed from outside
ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA", "NUMEXPR")} | {
    "VECLIB_MAXIMUM_THREADS": "1",
    "PCMC_THREADS": "1",
}


class CaseProcess:
    """A process that runs one case function, a case at a time, on one thread."""

    def __init__(self) -> None:
        self.log = tempfile.TemporaryFile()  # noqa: SIM115 (it lives as long as the process)
        self.process = subprocess.Popen(
            [sys.executable, "-P", str(case_script.__file__)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.log,
            env=os.environ | ONE_THREAD,
            # a group of its own: Ctrl-C reaches the sweep alone, and a kill reaches grandchildren
            process_group=0 if os.name == "posix" else None,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
        )
        # the process itself ends at a time limit; this is for one that cannot
        self._deadline, self._closed = math.inf, threading.Event()
        threading.Thread(target=self._watch, daemon=True).start()

    def load(self, case: str) -> None:
        """Import the case function; SweepError if the process cannot."""
        try:
            self._send((sys.path, case))
            kind, text = self._receive()
        except (EOFError, OSError, pickle.UnpicklingError):
            kind, text = "failed", self._end()[1]
        if kind == "failed":
            problem = f"a worker on {platform.node()} cannot load the case {case!r};"
            problem += f" install its package where the workers run:\n{text.strip()}"
            raise SweepError(problem, what=case, where=platform.node())

    def run(self, parameters: Mapping[str, Any], time_limit: float | None) -> dict[str, Any]:
        """Run one case; the fields of its record from ``status`` on."""
        started, begin = datetime.now(UTC), time.perf_counter()
        if time_limit is not None:
            self._deadline = begin + time_limit + GRACE
        try:
            self._send((parameters, time_limit))
            outcome: dict[str, Any] = self._receive()
            return outcome
        except (EOFError, OSError, pickle.UnpicklingError):
            elapsed = time.perf_counter() - begin
            code, output = self._end()
            timed_out = time_limit is not None and elapsed >= time_limit
            return {
                "status": "timed out" if timed_out else "killed",
                "verdict": "",
                "message": (
                    f"stopped at its time limit of {time_limit:g} s"
                    if timed_out
                    else f"ended its worker process ({_cause(code)})"
                ),
                "numbers": {},
                "wall_time": elapsed,
                "provenance": {
                    "started": started.isoformat(timespec="milliseconds"),
                    "output": output,
                    "host": platform.node(),
                    "pid": self.process.pid,
                },
            }
        finally:
            self._deadline = math.inf

    @property
    def alive(self) -> bool:
        """Whether the process can take another case."""
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
        self._closed.set()
        self.kill()
        self.process.wait()
        for stream in filter(None, (self.process.stdin, self.process.stdout, self.log)):
            with suppress(OSError):
                stream.close()

    def _send(self, message: object) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(pickle.dumps(message))
        self.process.stdin.flush()

    def _receive(self) -> Any:
        assert self.process.stdout is not None
        return pickle.load(self.process.stdout)

    def _watch(self) -> None:
        """Kill a process past its deadline: one that is stopped, or whose children hold its pipe open."""
        while not self._closed.wait(GRACE / 4):
            if time.perf_counter() > self._deadline:
                self.kill()

    def _end(self) -> tuple[int, str]:
        """Exit code and last output."""
        self.kill()
        code = self.process.wait()
        length = self.log.seek(0, os.SEEK_END)
        self.log.seek(max(0, length - 4 * case_script.OUTPUT))  # bytes: a character has at most 4
        output = self.log.read().decode("utf-8", "replace")
        return code, output[-case_script.OUTPUT :]


def _cause(code: int) -> str:
    """An exit code in words.

    >>> _cause(-9), _cause(3)
    ('signal SIGKILL', 'exit code 3')
    """
    with suppress(ValueError):
        return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
    return f"signal {-code}"


class Team:
    """The processes that one sweep has started from this process."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.all: list[CaseProcess] = []
        self.idle: list[CaseProcess] = []
        self.closed = False

    def borrow(self, case: str) -> CaseProcess:
        """An idle process, or a new one."""
        with self.lock:
            while self.idle:
                process = self.idle.pop()
                if process.alive:
                    return process
                self._drop(process)
            if self.closed:
                raise SweepError("the sweep has ended")
            process = CaseProcess()
            self.all.append(process)
        try:
            process.load(case)
        except SweepError:
            self.give_back(process)
            raise
        return process

    def give_back(self, process: CaseProcess) -> None:
        """Keep the process for the next case if it is alive."""
        with self.lock:
            if process.alive and not self.closed:
                self.idle.append(process)
            else:
                self._drop(process)

    def close_idle(self) -> None:
        """End the processes that run no case."""
        with self.lock:
            while self.idle:
                self._drop(self.idle.pop())

    def close(self) -> None:
        """End all processes. The threads that wait for a case free its process."""
        self.close_idle()
        with self.lock:
            self.closed = True
            for process in self.all:
                process.kill()

    def _drop(self, process: CaseProcess) -> None:
        process.close()
        self.all.remove(process)


# Here and not in an object: an executor's task is a function with plain arguments, and must find its team.
_teams: dict[str, Team] = {}
_lock = threading.Lock()


def run_case(team: str, case: str, parameters: Mapping[str, Any], time_limit: float | None) -> dict[str, Any]:
    """Run one case in a process of ``team``, a name that belongs to one sweep.

    Returns
    -------
    dict : the fields of a Record from ``status`` on.

    Raises
    ------
    SweepError : the case function cannot be imported here.
    """
    with _lock:
        if team not in _teams:
            for other in _teams.values():
                other.close_idle()
            _teams[team] = Team()
        mine = _teams[team]
    process = mine.borrow(case)
    try:
        return process.run(parameters, time_limit)
    except BaseException:  # Ctrl-C in a process pool: the next case must not get this one's answer
        process.close()
        raise
    finally:
        mine.give_back(process)


def retire(team: str) -> None:
    """End all processes of ``team`` that were started from this process, also those that run a case."""
    with _lock:
        mine = _teams.setdefault(team, Team())
    mine.close()
