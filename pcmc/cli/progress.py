"""Progress on stderr, if that is a terminal that can redraw a line."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console


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
def sweeping(console: Console | None = None) -> Iterator[Callable[[Any], None] | None]:
    """A function of a sweep's Progress that draws cases, time left and verdicts; None without a terminal."""
    if console is None and not _live():
        yield None
        return
    from rich import progress
    from rich.console import Console
    from rich.table import Column

    rest = Column(ratio=1, no_wrap=True, overflow="ellipsis")
    columns = (
        progress.BarColumn(20),
        progress.MofNCompleteColumn(table_column=Column(no_wrap=True, min_width=9)),
        progress.TextColumn("{task.fields[left]} left", table_column=Column(min_width=12)),
        progress.TextColumn("{task.description}", markup=False, table_column=rest),
    )
    with progress.Progress(*columns, console=console or Console(stderr=True), expand=True) as bar:
        task = bar.add_task("", total=None, left="?")

        def draw(state: Any) -> None:
            counts = sorted(state.counts.items(), key=lambda item: (-item[1], item[0]))
            text = " · ".join(f"{verdict} {count}" for verdict, count in counts)
            left = timedelta(seconds=round(state.seconds_left))
            bar.update(task, total=state.total, completed=state.done, left=str(left), description=text)

        yield draw


def _live() -> bool:
    return sys.stderr is not None and sys.stderr.isatty() and os.environ.get("TERM") != "dumb"
