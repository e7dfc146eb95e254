"""The workers of this machine: a thread for each child process, which keeps its child busy.

Between two cases a processor falls asleep, and to wake it takes about a millisecond: long beside a case
of five. So while cases are short the next one waits in the child's pipe already. If the child ends
before it comes to that one, another child gets it.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping
from concurrent.futures import Future
from typing import Any, NamedTuple

from ..base.errors import SweepError
from .isolate import Child

BRIEF = 0.1  # seconds; after a case that took longer the next is given when it has ended
Outcome = dict[str, Any]


class Task(NamedTuple):
    """A case to run, and where its outcome goes."""

    parameters: Mapping[str, Any]
    future: Future[Outcome]


class LocalPool:
    """Up to ``workers`` child processes, started as cases come; all ended by ``close``."""

    def __init__(self, case: str, workers: int, time_limit: float | None) -> None:
        self._case, self._workers, self._time_limit = case, workers, time_limit
        self._waiting: deque[Task] = deque()
        self._threads: list[threading.Thread] = []
        self._children: list[Child] = []
        self._closed = False
        self._change = threading.Condition()

    def submit(self, parameters: Mapping[str, Any]) -> Future[Outcome]:
        """Have a case run; the future of its outcome, the fields of a record from ``status`` on."""
        task = Task(parameters, Future())
        with self._change:
            self._waiting.append(task)
            if len(self._threads) < self._workers:
                self._threads.append(threading.Thread(target=self._work, daemon=True))
                self._threads[-1].start()
            self._change.notify()
        return task.future

    def close(self) -> None:
        """End all children, those at work too."""
        with self._change:
            self._closed = True
            for child in self._children:
                child.kill()
            self._change.notify_all()
        for thread in self._threads:
            thread.join()

    def _work(self) -> None:
        """Have one child after another run cases until the pool is closed."""
        while (task := self._take()) is not None:
            try:
                child = self._hire()
            except Exception as error:
                task.future.set_exception(error)
                continue
            try:
                self._employ(child, task)
            finally:
                self._dismiss(child)

    def _hire(self) -> Child:
        child = Child()
        with self._change:
            self._children.append(child)
            if self._closed:
                child.kill()
        try:
            child.load(self._case)
        except SweepError:
            self._dismiss(child)
            raise
        return child

    def _dismiss(self, child: Child) -> None:
        with self._change:
            self._children.remove(child)
        child.close()

    def _employ(self, child: Child, task: Task | None) -> None:
        """Give one child cases until it ends or the pool is closed."""
        given: deque[Task] = deque()
        brief = False
        while given or task is not None:
            if task is not None:
                child.send(task.parameters, self._time_limit)
                given.append(task)
            ahead = self._take(wait=False) if brief and len(given) == 1 else None
            if ahead is not None:
                child.send(ahead.parameters, self._time_limit)
                given.append(ahead)
            outcome = child.receive(self._time_limit)
            given.popleft().future.set_result(outcome)
            # one that has answered may die of the next case before it is looked at: ``receive`` says so
            if child.ended or not (given or child.alive):
                break
            brief = outcome["wall_time"] < BRIEF
            task = None if given else self._take()
        with self._change:
            self._waiting.extendleft(reversed(given))  # it never came to them
            self._change.notify()

    def _take(self, wait: bool = True) -> Task | None:
        """The next case, or None when the pool is closed; without waiting, also when none is left."""
        with self._change:
            while not self._closed:
                if not self._waiting:
                    if not wait:
                        return None
                    self._change.wait()
                    continue
                task = self._waiting.popleft()
                # one that comes back from a child that ended is running already
                if task.future.running() or task.future.set_running_or_notify_cancel():
                    return task
            return None
