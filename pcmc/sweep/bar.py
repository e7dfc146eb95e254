"""A progress bar for a sweep: cases done, their verdicts, time left."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from typing import TYPE_CHECKING, Any

from ..base.errors import MissingExtra
from .running import Progress

if TYPE_CHECKING:
    from rich.console import Console


@contextmanager
def bar(console: Console | None = None) -> Iterator[Callable[[Progress], None]]:
    """An ``on_record`` that draws a bar: ``with bar() as draw: run(sweep, on_record=draw)``.

    Parameters
    ----------
    console : where to draw; default the terminal.

    Raises
    ------
    MissingExtra : rich is not installed.
    """
    try:
        from rich import progress as rich
        from rich.table import Column
    except ImportError:
        raise MissingExtra("rich", "cli") from None
    columns: tuple[Any, ...] = (
        rich.BarColumn(20),
        rich.MofNCompleteColumn(table_column=Column(no_wrap=True, min_width=9)),
        rich.TextColumn("{task.fields[left]} left", table_column=Column(min_width=10)),
        rich.TextColumn(
            "{task.description}",
            markup=False,
            table_column=Column(ratio=1, no_wrap=True, overflow="ellipsis"),
        ),
    )
    with rich.Progress(*columns, console=console, expand=True) as drawn:
        task = drawn.add_task("", total=None, left="?")

        def draw(state: Progress) -> None:
            counts = sorted(state.counts.items(), key=lambda item: (-item[1], item[0]))
            drawn.update(
                task,
                total=state.total,
                completed=state.done,
                left=str(timedelta(seconds=round(state.seconds_left))),
                description=" · ".join(f"{verdict} {count}" for verdict, count in counts),
            )

        yield draw
