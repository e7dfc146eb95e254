"""Who runs the cases: processes of this machine, a given executor, or a Dask cluster."""

from __future__ import annotations

import os
import re
import uuid
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from typing import Any

from ..base.errors import MissingExtra, OptionError, SweepError
from .case_process import retire, run_case
from .case_script import version

Submit = Callable[[Mapping[str, Any]], "Future[dict[str, Any]]"]

OWN_VERSION = version("pcmc")
CONNECT = 10.0  # seconds a scheduler has to answer, and then to show a worker


@contextmanager
def open_workers(
    case: str, time_limit: float | None, executor: Executor | None, scheduler: str | None, workers: int | None
) -> Iterator[Submit]:
    """A function that has a case run, given its parameters. At the end, the case processes are ended."""
    team = uuid.uuid4().hex
    if scheduler is not None:
        with _cluster(team, scheduler) as cluster:
            yield lambda parameters: cluster.submit(run_case, team, case, parameters, time_limit)
        return
    mine = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    pool = executor or ThreadPoolExecutor(workers or mine)  # the processors this process may use
    try:
        yield lambda parameters: pool.submit(run_case, team, case, parameters, time_limit)
    finally:
        retire(team)
        if executor is None:
            pool.shutdown()


@contextmanager
def _cluster(team: str, address: str) -> Iterator[Executor]:
    """An executor on the workers of a Dask scheduler, each with the same version of pcmc."""
    if not re.fullmatch(r"((tcp|tls|ucx|wss?)://)?[^/]+:\d+/?", address):
        text = f"scheduler: expected 'tcp://host:8786', found {address!r}"
        raise OptionError(text, what="scheduler", found=address, expected="tcp://host:8786")
    try:
        from distributed import Client
    except ImportError:
        raise MissingExtra("distributed", "distributed") from None
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
        for worker, found in client.run(version, "pcmc", on_error="return").items():
            if found != OWN_VERSION:
                text = f"the Dask worker {worker} has pcmc {found}, this is pcmc {OWN_VERSION}; install"
                text += " the same version there"
                raise SweepError(text, what="pcmc", where=worker, found=found, expected=OWN_VERSION)
        try:
            yield client.get_executor(pure=False)
        finally:
            if client.status == "running":
                with suppress(Exception):  # a worker that has gone has taken its processes along
                    client.run(retire, team, on_error="ignore")
