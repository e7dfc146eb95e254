"""Run the cases of a sweep that are not stored yet, on any executor; return the table of all."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Generator
from concurrent.futures import Executor, Future
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from ..base import validate
from ..base.errors import SweepError
from ..base.files import PathLike
from ..base.interrupts import interrupts_handled, stop_requested
from .grid import Sweep
from .store import Record, open_store
from .tables import table
from .workers import OWN_VERSION, Submit, Workers, failed_outcome

if TYPE_CHECKING:
    import pandas as pd

PACE = 0.05  # seconds between two transactions: each costs some milliseconds


@dataclass(frozen=True)
class SweepProgress:
    """The state of a sweep, passed to ``on_record`` after each case."""

    record: Record  # just stored
    done: int  # cases stored
    total: int  # cases in all
    counts: dict[str, int]  # how many cases have each verdict (the status, where a case gave no verdict)
    seconds_left: float  # estimate from the pace of this run


def run(
    sweep: Sweep,
    store: PathLike | None = None,
    *,
    executor: Executor | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    time_limit: float | None = 600.0,
    retry_failed: bool = False,
    on_record: Callable[[SweepProgress], object] | None = None,
    on_resume: Callable[[int, int], object] | None = None,
) -> pd.DataFrame:
    """Run every case of the sweep that its store does not hold yet; a row per case (see ``table``).

    Each case runs on one thread, in a process of its own. A case that raises, exceeds the time limit or
    kills its process becomes a row with that status; the others go on. After Ctrl-C the table has the cases
    stored so far.

    Parameters
    ----------
    store : file for the records, an SQLite database; None keeps them in memory. The same sweep with the same
        file runs only the missing cases: after a crash, or with more values in the grid. With fewer values
        the other records stay in the file.
    executor : runs the cases; it is not shut down, and finishes what it has begun, also after Ctrl-C.
    scheduler : address of a Dask scheduler whose workers run the cases: ``"tcp://127.0.0.1:8786"``.
    workers : number of local processes; default one for each processor.
    time_limit : per case, in seconds; None for no limit.
    retry_failed : run the stored cases that failed again.
    on_record : called with a SweepProgress after each stored case. Raise StopIteration to stop as Ctrl-C
        does; any other exception passes through.
    on_resume : called once, before any case runs, with how many cases the store holds and how many remain.

    Raises
    ------
    OptionError, FileError, SweepError, MissingExtra : before any case runs: for a bad option, a store of
        another sweep or version, a scheduler that does not answer, or if ``distributed`` is missing.
    FileError, SweepError : a record cannot be written; the executor broke, or a worker cannot load the case
        function. The cases stored before stay stored.

    >>> halves = Sweep("pcmc.sweep.examples:ratio", {"over": [1, 2, 3]}, {"under": 2})
    >>> run(halves, workers=1)[["over", "status", "value"]]
          over    status  value
    case
    0        1  finished    0.5
    1        2  finished    1.0
    2        3  finished    1.5
    """
    crew = Workers(executor, scheduler, workers, time_limit)
    for name, called in (("on_record", on_record), ("on_resume", on_resume)):
        validate.callback(name, called, "a function")
    with ExitStack() as stack:
        stored = None if store is None else stack.enter_context(open_store(store, sweep))
        records = {} if stored is None else dict(stored.records)
        kept = {number for number, record in records.items() if not (retry_failed and record.failed)}
        todo = {number: parameters for number, parameters in enumerate(sweep) if number not in kept}
        if on_resume is not None:
            on_resume(len(sweep) - len(todo), len(todo))
        if todo:
            finished = SimpleQueue[Future[dict[str, Any]] | None]()
            # Ctrl-C comes out of the queue, not in the middle of a write
            stack.enter_context(interrupts_handled(lambda *_: finished.put(None)))
            submit = stack.enter_context(crew.opened(sweep.case))
            counts = Counter(r.verdict or r.status for n, r in records.items() if n not in todo)
            before, begin = counts.total(), time.perf_counter()
            for futures in stack.enter_context(closing(_batches(submit, todo, finished))):
                new: list[Record] = []
                try:
                    for future, number in futures:
                        new.append(Record(number, todo[number], **_outcome(future)))
                finally:
                    if stored is not None and new:
                        stored.append(new)
                records |= {record.case: record for record in new}
                try:
                    for record in new:
                        counts[record.verdict or record.status] += 1
                        done, total = counts.total(), len(sweep)
                        left = (total - done) * (time.perf_counter() - begin) / (done - before)
                        if on_record is not None:
                            on_record(SweepProgress(record, done, total, dict(counts), left))
                except StopIteration as error:
                    stop_requested(error)
                    break
    return table(records.values())


def _batches(
    submit: Submit, todo: dict[int, dict[str, Any]], finished: SimpleQueue[Any]
) -> Generator[list[tuple[Future[dict[str, Any]], int]], None, None]:
    """Submit all cases; those that come out of ``finished``, with their numbers, until Ctrl-C puts None in.

    A batch is one transaction of the store. It comes at once, but no sooner than PACE after the last. At the
    end the cases that are left are cancelled.
    """
    pending: dict[Future[dict[str, Any]], int] = {}
    try:
        for number, parameters in todo.items():
            try:
                future = submit(parameters)
            except RuntimeError as error:  # shut down, or broken
                text = f"the executor takes no cases ({error}); give a new one"
                raise SweepError(text, what="executor") from error
            pending[future] = number
            future.add_done_callback(finished.put)
        due, stopped = 0.0, False
        while pending and not stopped:
            batch: list[tuple[Future[dict[str, Any]], int]] = []
            while pending and not stopped and not (batch and time.monotonic() >= due):
                with suppress(Empty):  # on Windows, Ctrl-C arrives only between two waits
                    future = finished.get(timeout=max(due - time.monotonic(), 0.0) if batch else PACE)
                    stopped = future is None
                    if not stopped:
                        batch.append((future, pending.pop(future)))
            if batch:
                yield batch
            due = time.monotonic() + PACE
    finally:
        for future in pending:
            future.cancel()


def _outcome(future: Future[dict[str, Any]]) -> dict[str, Any]:
    """The fields of a case's record; SweepError if the executor failed, or a worker has another pcmc."""
    try:
        outcome = future.result()
    except SweepError:
        raise
    except Exception as error:
        text = f"{type(error).__name__}: {error}".removesuffix(": ")
        if type(error).__name__ == "KilledWorker":  # Dask's, after some tries on several workers
            message = "ended its Dask worker, several times"
            return failed_outcome("killed", message, float("nan"), {"output": text})
        problem = f"the executor failed ({text}); the cases stored so far are safe: run the same sweep"
        problem += " again to go on from there"
        raise SweepError(problem, what="executor", found=text) from error
    about = outcome["provenance"]
    found = about.get("pcmc", OWN_VERSION)  # a case that ended its process does not say
    if found != OWN_VERSION:
        text = f"a worker on {about['host']} has pcmc {found}, this is pcmc {OWN_VERSION}; install the"
        text += " same version there and run the same sweep again to go on from the cases stored"
        raise SweepError(text, what="pcmc", where=about["host"], found=found, expected=OWN_VERSION)
    return outcome
