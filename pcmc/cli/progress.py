"""Progress on stderr, if that is a terminal that can redraw a line."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def working() -> Iterator[Callable[[str], None]]:
    """A function that shows the name of the current step."""
    if not _live():
        yield lambda step: None
        return
    from rich import progress
    from rich.console import Console

    columns = (
        progress.BarColumn(20),
        progress.TimeElapsedColumn(),
        progress.TextColumn("{task.description}", markup=False),
    )
    with progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)
        yield lambda step: bar.update(task, description=step)


@contextmanager
def sweeping() -> Iterator[Any]:
    """The progress bar of a sweep; None if there is no terminal."""
    from ..sweep.bar import bar

    if not _live():
        yield None
        return
    from rich.console import Console

    with bar(Console(stderr=True)) as draw:
        yield draw


def _live() -> bool:
    return sys.stderr is not None and sys.stderr.isatty() and os.environ.get("TERM") != "dumb"
