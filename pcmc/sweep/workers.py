"""Who runs the cases: processes of this machine, a given executor, or a Dask cluster.

Each calls ``run_case``, which gives the case to a process of its own and waits, so that it survives whatever
the case does: Python's own pool breaks when a worker dies, and cannot stop a task that hangs. Processes are
kept between the cases of one sweep, so that a case is imported and compiled once.
"""

from __future__ import annotations

import os
import platform
import re
import signal
import threading
import uuid
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ..base import validate
from ..base.errors import OptionError, SweepError
from ..base.libraries import ChildError, ChildProcess, require
from . import case_script
from .case_script import version

Submit = Callable[[Mapping[str, Any]], "Future[dict[str, Any]]"]

OWN_VERSION = version("pcmc")
CONNECT = 10.0  # seconds a scheduler has to answer, and then to show a worker
GRACE = 2.0  # seconds that a process may exceed its time limit before it is killed from outside
THREADS = [f"{library}_NUM_THREADS" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA", "NUMEXPR")]
ONE_THREAD = dict.fromkeys([*THREADS, "VECLIB_MAXIMUM_THREADS", "PCMC_THREADS"], "1")
SCRIPT = Path(case_script.__file__)
SIGNALS = {-number: f"signal {number.name}" for number in signal.Signals if number}  # by exit code


def failed_outcome(status: str, message: str, seconds: float, about: dict[str, Any]) -> dict[str, Any]:
    """The fields of a Record, from ``status`` on, of a case that gave no answer."""
    words = {"status": status, "verdict": "", "message": message}
    return {**words, "numbers": {}, "wall_time": seconds, "provenance": about}


class Team:
    """The processes that one sweep has started from this process, the ``busy`` and the ``idle`` ones."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.busy: set[ChildProcess] = set()
        self.idle: list[ChildProcess] = []
        self.closed = False

    @contextmanager
    def process(self, case: str) -> Iterator[ChildProcess]:
        """An idle process, or a new one; it is kept for the next case while it is alive."""
        with self.lock:
            while self.idle and not self.idle[-1].alive:
                self.idle.pop().close()
            new = not self.idle
            if new and self.closed:
                raise SweepError("the sweep has ended")
            process = ChildProcess(ONE_THREAD) if new else self.idle.pop()
            self.busy.add(process)
        try:
            if new:
                process.call(SCRIPT, "import_case", case)
            yield process
        except ChildError as error:  # of the load: a case that fails is an answer
            process.close()
            problem = f"a worker on {platform.node()} cannot load the case {case!r};"
            problem += f" install its package where the workers run:\n{error.output.strip()}"
            raise SweepError(problem, what=case, where=platform.node()) from None
        except BaseException:  # Ctrl-C in a process pool: the next case must not get this one's answer
            process.close()
            raise
        finally:
            with self.lock:
                self.busy.remove(process)
                if process.alive and not self.closed:
                    self.idle.append(process)
                else:
                    process.close()

    def close_idle(self) -> None:
        """End the processes that run no case."""
        with self.lock:
            while self.idle:
                self.idle.pop().close()

    def close(self) -> None:
        """End all processes. The threads that wait for a case free its process."""
        self.close_idle()
        with self.lock:
            self.closed = True
            for process in self.busy:
                process.kill()


# Here and not in an object: an executor's task is a function with plain arguments, and must find its team.
_teams: dict[str, Team] = {}
_lock = threading.Lock()


def run_case(team: str, case: str, parameters: Mapping[str, Any], time_limit: float | None) -> dict[str, Any]:
    """The fields of a Record, from ``status`` on, of a case run in a process of ``team``, a sweep's own name.

    SweepError if the function cannot be imported here.
    """
    with _lock:
        if team not in _teams:
            for other in _teams.values():
                other.close_idle()
            _teams[team] = Team()
        mine = _teams[team]
    limit = None if time_limit is None else time_limit + GRACE  # for a process that cannot end itself
    with mine.process(case) as process:
        started = datetime.now(UTC).isoformat(timespec="milliseconds")
        try:
            task = case, parameters, time_limit
            return process.call(SCRIPT, "answer_case", *task, limit=limit)
        except ChildError as death:
            code = death.code or 0
            cause = SIGNALS.get(code, f"{'signal' if code < 0 else 'exit code'} {abs(code)}")
            status, message = "killed", f"ended its worker process ({cause})"
            if time_limit is not None and death.seconds >= time_limit:
                status, message = "timed out", f"stopped at its time limit of {time_limit:g} s"
            about = {"output": death.output, "host": platform.node(), "pid": process.process.pid}
            return failed_outcome(status, message, death.seconds, about | {"started": started})


def retire(team: str) -> None:
    """End all processes of ``team`` that were started from this process, also those that run a case."""
    with _lock:
        mine = _teams.setdefault(team, Team())
    mine.close()


@dataclass(frozen=True)
class Workers:
    """Who runs cases, one of the first three or all processors, and for how many seconds a case at most."""

    executor: Executor | None
    scheduler: str | None
    workers: int | None
    time_limit: float | None

    def __post_init__(self) -> None:
        names = [name for name in ("executor", "scheduler", "workers") if getattr(self, name) is not None]
        if len(names) > 1:
            text = f"{' and '.join(names)} exclude each other; give one of them"
            raise OptionError(text, what=names[0], found=tuple(names))
        if not isinstance(self.executor, Executor | None):
            validate.refuse("executor", self.executor, "one of concurrent.futures")
        if not isinstance(self.scheduler, str | None):
            validate.refuse("scheduler", self.scheduler, "'tcp://host:8786'")
        if self.workers is not None:
            validate.integer("workers", self.workers, least=1)
        if self.time_limit is not None:
            what = "time_limit (seconds; None for no limit)"
            validate.number(what, self.time_limit, above=0.0, below=threading.TIMEOUT_MAX)

    @contextmanager
    def opened(self, case: str) -> Iterator[Submit]:
        """A function that has a case run, given its parameters. At the end, the case processes are ended."""
        team, limit = uuid.uuid4().hex, self.time_limit
        if self.scheduler is not None:
            with _cluster(team, self.scheduler) as cluster:
                yield lambda parameters: cluster.submit(run_case, team, case, parameters, limit)
            return
        mine = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        pool = self.executor or ThreadPoolExecutor(self.workers or mine)  # the processors that it may use
        try:
            yield lambda parameters: pool.submit(run_case, team, case, parameters, limit)
        finally:
            retire(team)
            if self.executor is None:
                pool.shutdown()


@contextmanager
def _cluster(team: str, address: str) -> Iterator[Executor]:
    """An executor on the workers of a Dask scheduler."""
    if not re.fullmatch(r"((tcp|tls|ucx|wss?)://)?[^/]+:\d+/?", address):
        validate.refuse("scheduler", address, "'tcp://host:8786'")
    require("distributed", extra="distributed")
    from distributed import Client

    try:
        client = Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        text = f"no Dask scheduler answers at {address!r} ({error}); start one with: dask scheduler"
        raise SweepError(text, what="scheduler", found=address) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=CONNECT)
        except TimeoutError as error:
            text = f"the Dask scheduler at {address!r} has no workers; start one with: dask worker {address}"
            raise SweepError(text, what="scheduler", found=address) from error
        try:
            yield client.get_executor(pure=False)
        finally:
            if client.status == "running":
                with suppress(Exception):  # a worker that has gone has taken its processes along
                    client.run(retire, team, on_error="ignore")
