"""Run the cases of a sweep that are not stored yet, on any executor; return the table of all."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from ..base import validate
from ..base.errors import OptionError, SweepError
from .executors import OWN_VERSION, Submit, open_pool
from .grid import Sweep
from .store import FORCE_EVERY, Record, open_store
from .table import table

if TYPE_CHECKING:
    import pandas as pd

LONGEST = threading.TIMEOUT_MAX  # seconds that a time limit may have


@dataclass(frozen=True)
class Progress:
    """What ``on_record`` is shown after each case.

    Attributes
    ----------
    record : the case just stored.
    done, total : cases stored, cases in all.
    counts : how many cases have each verdict (the status, where a case gave no verdict).
    seconds_left : estimate from the pace of this run.
    """

    record: Record
    done: int
    total: int
    counts: dict[str, int]
    seconds_left: float


def run(
    sweep: Sweep,
    store: str | os.PathLike[str] | None = None,
    *,
    executor: Executor | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    time_limit: float | None = 600.0,
    retry_failed: bool = False,
    on_record: Callable[[Progress], object] | None = None,
) -> pd.DataFrame:
    """Run every case of the sweep that its store does not hold yet.

    Each case runs on one thread in a child process of the worker it is given to. A case that
    raises, exceeds the time limit or kills its process becomes a row that says so; the others
    go on.

    Parameters
    ----------
    sweep : the cases.
    store : file that each record is written to as soon as it is there. Run the same sweep with the
        same file again after a crash, and it goes on from there. None: keep records in memory only.
    executor : where to run; left open at the end. Processes of it finish the cases they have begun,
        after Ctrl-C too. Default: ``workers`` local processes.
    scheduler : address of a Dask scheduler whose workers run the cases: ``"tcp://127.0.0.1:8786"``.
    workers : local processes; default one for each processor.
    time_limit : seconds a case may take; None for no limit.
    retry_failed : run stored cases that failed once more.
    on_record : called after each stored case. Raise StopIteration to stop as Ctrl-C does; any other
        exception passes through.

    Returns
    -------
    DataFrame : one row per case (see ``table``). After Ctrl-C, which ends local workers at once,
        only the cases stored so far: fewer rows than ``len(sweep)``.

    Raises
    ------
    OptionError, FileError, SweepError, MissingExtra : before any case is run, for bad options, a
        store of another sweep or version, a scheduler that does not answer, no ``distributed``.
    FileError : a record cannot be written. SweepError : the executor broke or a worker cannot load
        the case. All cases stored before stay stored.

    Examples
    --------
    >>> halves = Sweep("pcmc.sweep.examples:ratio", {"over": [1, 2, 3]}, {"under": 2})
    >>> run(halves, workers=1)[["over", "status", "value"]]
          over    status  value
    case
    0        1  finished    0.5
    1        2  finished    1.0
    2        3  finished    1.5
    """
    _check_options(executor, scheduler, workers, time_limit, on_record)
    with ExitStack() as stack:
        kept = None if store is None else stack.enter_context(open_store(store, sweep))
        records = {} if kept is None else dict(kept.records)
        todo = {
            number: parameters
            for number, parameters in enumerate(sweep)
            if number not in records or (retry_failed and records[number].failed)
        }
        if todo:
            finished = SimpleQueue[Future[dict[str, Any]] | None]()
            stack.enter_context(_interrupts(lambda: finished.put(None)))
            pool = open_pool(sweep.case, time_limit, executor, scheduler, workers)
            submit = stack.enter_context(pool)
            pending = stack.enter_context(_submitted(submit, todo, finished))
            progress = _progress(records, todo, len(sweep))
            idle = (lambda: None) if kept is None else kept.force
            while pending and (future := _next(finished, idle)) is not None:
                number = pending.pop(future)
                record = Record(number, todo[number], **_outcome(future))
                if kept is not None:
                    kept.append(record)
                records[number] = record
                try:
                    if on_record is not None:
                        on_record(progress(record))
                except StopIteration:
                    break
    return table(records.values())


def _check_options(
    executor: Executor | None,
    scheduler: str | None,
    workers: int | None,
    time_limit: float | None,
    on_record: object,
) -> None:
    given = {"executor": executor, "scheduler": scheduler, "workers": workers}
    names = [name for name, value in given.items() if value is not None]
    if len(names) > 1:
        raise OptionError(f"{' and '.join(names)} exclude each other; give one of them")
    if executor is not None and not isinstance(executor, Executor):
        raise OptionError(f"executor: expected one of concurrent.futures, found {executor!r:.80}")
    if scheduler is not None and not isinstance(scheduler, str):
        raise OptionError(f"scheduler: expected 'tcp://host:8786', found {scheduler!r:.80}")
    if on_record is not None and not callable(on_record):
        raise OptionError(f"on_record: expected a function of a Progress, found {on_record!r:.80}")
    if workers is not None:
        validate.integer("workers", workers, least=1)
    if time_limit is not None:
        validate.number(
            "time_limit (seconds; None for no limit)", time_limit, above=0.0, below=LONGEST
        )


def _progress(
    records: dict[int, Record], todo: dict[int, Any], total: int
) -> Callable[[Record], Progress]:
    """A function that counts each new record in and tells how far the sweep is."""
    counts = Counter(r.verdict or r.status for n, r in records.items() if n not in todo)
    before, begin = total - len(todo), time.perf_counter()

    def count(record: Record) -> Progress:
        counts[record.verdict or record.status] += 1
        done = counts.total()
        pace = (time.perf_counter() - begin) / (done - before)
        return Progress(record, done, total, dict(counts), pace * (total - done))

    return count


@contextmanager
def _submitted(
    submit: Submit,
    todo: dict[int, dict[str, Any]],
    finished: SimpleQueue[Any],
) -> Iterator[dict[Future[dict[str, Any]], int]]:
    """Give all cases to the pool; futures come out of ``finished``; those left are cancelled."""
    pending: dict[Future[dict[str, Any]], int] = {}
    try:
        for number, parameters in todo.items():
            try:
                future = submit(parameters)
            except RuntimeError as error:  # shut down, or broken
                raise SweepError(
                    f"the executor takes no cases ({error}); give a new one"
                ) from error
            pending[future] = number
            future.add_done_callback(finished.put)
        yield pending
    finally:
        for future in pending:
            future.cancel()


def _next(finished: SimpleQueue[Any], idle: Callable[[], None]) -> Future[dict[str, Any]] | None:
    """The next finished future, or None to stop; ``idle`` is called while there is none."""
    while True:
        with suppress(Empty):  # Windows tells of Ctrl-C only between waits
            future: Future[dict[str, Any]] | None = finished.get(timeout=FORCE_EVERY)
            return future
        idle()


def _outcome(future: Future[dict[str, Any]]) -> dict[str, Any]:
    """What a case came to; SweepError if the executor, not the case, failed."""
    try:
        return _of_this_version(future.result())
    except SweepError:
        raise
    except (Exception, CancelledError) as error:
        text = f"{type(error).__name__}: {error}".removesuffix(": ")
        if type(error).__name__ == "KilledWorker":  # Dask's, after some tries on several workers
            return {
                "status": "killed",
                "verdict": "",
                "message": "ended its Dask worker, several times",
                "numbers": {},
                "wall_time": float("nan"),
                "provenance": {"output": text},
            }
        raise SweepError(
            f"the executor failed ({text}); the cases stored so far are safe: run the same sweep"
            " again to go on from there"
        ) from error


def _of_this_version(outcome: dict[str, Any]) -> dict[str, Any]:
    """The outcome; SweepError if another pcmc gave it, on a worker that came late or is not Dask's."""
    about = outcome["provenance"]
    found = about.get("pcmc", OWN_VERSION)  # a case that ended its process does not say
    if found != OWN_VERSION:
        raise SweepError(
            f"a worker on {about['host']} has pcmc {found}, this is pcmc {OWN_VERSION}; install the"
            " same version there and run the same sweep again to go on from the cases stored"
        )
    return outcome


@contextmanager
def _interrupts(stop: Callable[[], None]) -> Iterator[None]:
    """Have Ctrl-C call ``stop`` instead of raising in the middle of a write."""
    if (
        threading.current_thread() is not threading.main_thread()
        or signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    ):
        yield
        return
    signal.signal(signal.SIGINT, lambda *_: stop())
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
