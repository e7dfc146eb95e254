"""The comparison with the paper on the screen."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from rich.console import Console
from rich.table import Table

from .report import FIGURES, HEADS, comparison_cells, figure_cells, given_sentence
from .runner import Outcome

COLOURS = {"reproduced": "green", "near": "yellow", "conditionally reproduced": "yellow"}


def show(comparison: pd.DataFrame, figures: pd.DataFrame, console: Console) -> None:
    """Print the figures, then the paper's statements, then its numbers."""
    table = Table(*FIGURES)
    for number, shows, name, claims, reason in figure_cells(figures):
        table.add_row(number, shows, _coloured(name), claims, reason)
    console.print(table)
    for kind, head in HEADS.items():
        table = Table(*head)
        for row in comparison_cells(comparison, kind):
            table.add_row(*row[:-1], _coloured(row[-1]))
        console.print(table)
    console.print(given_sentence(comparison))


def show_outcomes(outcomes: Sequence[Outcome], console: Console) -> None:
    """Print a row per study: its time, or why it failed."""
    table = Table("study", "seconds", "outcome")
    for outcome in outcomes:
        end = f"[red]failed:[/red] {outcome.error}" if outcome.error else "[green]done[/green]"
        table.add_row(outcome.study, f"{outcome.seconds:.1f}", end)
    console.print(table)


def _coloured(word: str) -> str:
    colour = COLOURS.get(word, "red")
    return f"[{colour}]{word}[/{colour}]"
