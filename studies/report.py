"""The comparison with the paper: files and the screen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.table import Table

from .folder import Folder
from .paper import HOLDS, compare, read_measured
from .runner import Outcome

HEADS = {
    "sentence": ["What the paper says", "Where", "To hold", "Ours", "Verdict"],
    "number": ["What the paper prints", "Where", "Paper", "Ours", "Difference", "Verdict"],
}
FIGURES = ["Figure", "What it shows", "Label", "Claims that hold", "Why not more"]
COLOURS = {"reproduced": "green", "near": "yellow", "conditionally reproduced": "yellow"}


def write_comparison(results: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """``comparison.csv`` and ``figures.csv`` in ``results``, from what the studies measured."""
    comparison, figures = compare(read_measured(results))
    Folder(results).write_table("comparison", comparison)
    Folder(results).write_table("figures", figures)
    return comparison, figures


def show(comparison: pd.DataFrame, figures: pd.DataFrame, console: Console) -> None:
    """The figures, then the comparison: sentences, and last the printed numbers."""
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
    """A row per study: its time, or why it failed."""
    table = Table("study", "seconds", "outcome")
    for outcome in outcomes:
        end = f"[red]failed:[/red] {outcome.error}" if outcome.error else "[green]done[/green]"
        table.add_row(outcome.study, f"{outcome.seconds:.1f}", end)
    console.print(table)


def given_sentence(comparison: pd.DataFrame) -> str:
    """How many of the paper's inputs (tensions, lengths, steps) the studies use as printed."""
    given = comparison[comparison.kind == "input"]
    differ = given[given.verdict != HOLDS].what.tolist()
    rest = f"; not so: {', '.join(differ)}" if differ else ""
    used = len(given) - len(differ)
    return f"{used} of the {len(given)} inputs that the paper prints are used as printed{rest}."


def comparison_cells(comparison: pd.DataFrame, kind: str) -> list[list[str]]:
    """A row of words for each claim of a kind."""
    cells = []
    for row in comparison[comparison.kind == kind].to_dict("records"):
        equal = row["relation"] == "="
        paper = f"{'' if equal else row['relation'] + ' '}{row['paper']:.7g}"
        ours = f"{row['ours']:.6g}"
        known = equal and math.isfinite(row["difference"])
        difference = [f"{row['difference']:+.3g}" if known else ""] if kind == "number" else []
        if kind == "sentence":
            paper, ours = f"{row['relation']} {row['paper']:.4g}", f"{row['ours']:.4g}"
        cells.append([row["what"], row["where"], paper, ours, *difference, row["verdict"]])
    return cells


def figure_cells(figures: pd.DataFrame) -> list[list[str]]:
    columns = figures[["figure", "shows", "label", "claims", "reason"]].fillna("").astype(str)
    return [list(row) for row in columns.itertuples(index=False)]


def _coloured(word: str) -> str:
    colour = COLOURS.get(word, "red")
    return f"[{colour}]{word}[/{colour}]"
