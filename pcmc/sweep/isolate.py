"""Run a case in a process of its own, so that whatever it does, its caller lives and can say so.

Every executor runs the same task, ``run_case``, which hands the case to a child process and waits.
A case that hangs or dies takes its child along and nothing else, be the caller a thread of this
process, a worker of a process pool, or a Dask worker on another machine. (Python's process pool
breaks as a whole when a worker dies and cannot end a task that hangs; a Dask worker is a daemon,
which may not have children by ``multiprocessing``. A child started as a script knows neither.)

Children are kept between the cases of one sweep, so that a case is imported and compiled once. They
belong to a *team*, a name that one sweep draws for itself. A child whose parent dies, however
suddenly, leaves within a second, in the middle of a case too (on Windows, at the case's end).
"""

from __future__ import annotations

import math
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
from datetime import UTC, datetime
from typing import Any

from ..base.errors import SweepError
from . import child as child_script

GRACE = 2.0  # seconds a child may overrun its time limit before it is killed from outside
ONE_THREAD = {
    f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA", "NUMEXPR")
} | {"VECLIB_MAXIMUM_THREADS": "1", "PCMC_THREADS": "1"}


class Child:
    """A process that runs one case function, a case at a time, on one thread."""

    def __init__(self) -> None:
        self.log = tempfile.TemporaryFile()  # noqa: SIM115 (it lives as long as the child)
        self.process = subprocess.Popen(
            [sys.executable, "-P", str(child_script.__file__)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.log,
            env=os.environ | ONE_THREAD,
            # a group of its own: Ctrl-C reaches the sweep alone, and a kill reaches grandchildren
            process_group=0 if os.name == "posix" else None,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
        )
        # the child itself ends at a time limit; this is for one that cannot
        self._deadline, self._closed = math.inf, threading.Event()
        threading.Thread(target=self._watch, daemon=True).start()

    def load(self, case: str) -> None:
        """Have the child import the case function; SweepError if it cannot."""
        try:
            self._tell((sys.path, case))
            kind, text = self._hear()
        except (EOFError, OSError, pickle.UnpicklingError):
            kind, text = "failed", self._end()[1]
        if kind == "failed":
            raise SweepError(
                f"a worker on {child_script.platform.node()} cannot load the case {case!r};"
                f" install its package where the workers run:\n{text.strip()}"
            )

    def send(self, parameters: Mapping[str, Any], time_limit: float | None) -> None:
        """Hand the child a case, which it runs after those it was given before."""
        with suppress(OSError):  # it has ended, and ``receive`` says how
            self._tell((parameters, time_limit))

    def receive(self, time_limit: float | None) -> dict[str, Any]:
        """The outcome of the first case without one: the fields of a record from ``status`` on."""
        started, begin = datetime.now(UTC), time.perf_counter()
        if time_limit is not None:
            self._deadline = begin + time_limit + GRACE
        try:
            outcome: dict[str, Any] = self._hear()
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
                    "host": child_script.platform.node(),
                    "pid": self.process.pid,
                },
            }
        finally:
            self._deadline = math.inf

    @property
    def alive(self) -> bool:
        """Whether the process can take another case."""
        return self.process.poll() is None

    @property
    def ended(self) -> bool:
        """Whether ``receive`` has met its end; ``alive`` looks whether it has come since."""
        return self.process.returncode is not None

    def kill(self) -> None:
        """End the process and what it started, whatever they do and even if it has ended itself."""
        if os.name == "posix":
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, signal.SIGKILL)
        else:
            self.process.kill()

    def close(self) -> None:
        """End the process and free its files."""
        self._closed.set()
        self.kill()
        self.process.wait()
        for stream in filter(None, (self.process.stdin, self.process.stdout, self.log)):
            with suppress(OSError):
                stream.close()

    def _tell(self, message: object) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(pickle.dumps(message))
        self.process.stdin.flush()

    def _hear(self) -> Any:
        assert self.process.stdout is not None
        return pickle.load(self.process.stdout)

    def _watch(self) -> None:
        """Kill a child that overran: one that is stopped, or whose own children hold its pipe."""
        while not self._closed.wait(GRACE / 4):
            if time.perf_counter() > self._deadline:
                self.kill()

    def _end(self) -> tuple[int, str]:
        self.kill()
        code = self.process.wait()
        length = self.log.seek(0, os.SEEK_END)
        self.log.seek(max(0, length - 4 * child_script.OUTPUT))  # bytes: a character has at most 4
        output = self.log.read().decode("utf-8", "replace")
        return code, output[-child_script.OUTPUT :]


def _cause(code: int) -> str:
    """What an exit code says.

    >>> _cause(-9), _cause(3)
    ('signal SIGKILL', 'exit code 3')
    """
    with suppress(ValueError):
        return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
    return f"signal {-code}"


class Team:
    """The children that one sweep has in this process."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.all: list[Child] = []
        self.idle: list[Child] = []
        self.closed = False

    def borrow(self, case: str) -> Child:
        """An idle child, or a new one."""
        with self.lock:
            while self.idle:
                child = self.idle.pop()
                if child.alive:
                    return child
                self._drop(child)
            if self.closed:
                raise SweepError("the sweep has ended")
            child = Child()
            self.all.append(child)
        try:
            child.load(case)
        except SweepError:
            self.give_back(child)
            raise
        return child

    def give_back(self, child: Child) -> None:
        """Keep the child for the next case if it lives."""
        with self.lock:
            if child.alive and not self.closed:
                self.idle.append(child)
            else:
                self._drop(child)

    def close_idle(self) -> None:
        """End the children that do nothing."""
        with self.lock:
            while self.idle:
                self._drop(self.idle.pop())

    def close(self) -> None:
        """End all children; those at work are freed by the threads that wait for them."""
        self.close_idle()
        with self.lock:
            self.closed = True
            for child in self.all:
                child.kill()

    def _drop(self, child: Child) -> None:
        child.close()
        self.all.remove(child)


# Kept per process, because an executor's task is a bare function and must find its children.
_teams: dict[str, Team] = {}
_lock = threading.Lock()


def run_case(
    team: str, case: str, parameters: Mapping[str, Any], time_limit: float | None
) -> dict[str, Any]:
    """Run one case in a child process of ``team`` and return its outcome.

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
    child = mine.borrow(case)
    try:
        child.send(parameters, time_limit)
        return child.receive(time_limit)
    except BaseException:  # Ctrl-C in a process pool: the next case must not get this one's answer
        child.close()
        raise
    finally:
        mine.give_back(child)


def retire(team: str) -> None:
    """End all children of ``team`` in this process, those at work too."""
    with _lock:
        mine = _teams.setdefault(team, Team())
    mine.close()
