"""The comparison with the paper: files, the screen, and the README's own tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.table import Table

from pcmc.errors import FileError

from .folder import Folder, write_bytes
from .paper import compare, read_measured
from .runner import Outcome

BEGIN, END = "<!-- comparison: begin -->", "<!-- comparison: end -->"
COLOURS = {"reproduced": "green", "near": "yellow", "conditionally reproduced": "yellow"}


def write_comparison(results: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """``comparison.csv`` and ``figures.csv`` in ``results``, from what the studies measured."""
    comparison, figures = compare(read_measured(results))
    Folder(results).write_table("comparison", comparison)
    Folder(results).write_table("figures", figures)
    return comparison, figures


def show(comparison: pd.DataFrame, figures: pd.DataFrame, console: Console) -> None:
    """Both tables on the screen, the comparison last."""
    table = Table("figure", "what it shows", "label", "reason")
    for number, shows, name, reason in _figure_cells(figures):
        table.add_row(number, shows, _coloured(name), reason)
    console.print(table)
    table = Table("what the paper says", "where", "paper", "ours", "difference", "verdict")
    for row in _cells(comparison):
        table.add_row(*row[:-1], _coloured(row[-1]))
    console.print(table)


def show_outcomes(outcomes: Sequence[Outcome], console: Console) -> None:
    """A row per study: its time, or why it failed."""
    table = Table("study", "seconds", "outcome")
    for outcome in outcomes:
        end = f"[red]failed:[/red] {outcome.error}" if outcome.error else "[green]done[/green]"
        table.add_row(outcome.study, f"{outcome.seconds:.1f}", end)
    console.print(table)


def readme_block(results: Path) -> str:
    """The tables as Markdown, between their markers."""
    folder = Folder(results)
    comparison = folder.read_table("comparison")
    figures = folder.read_table("figures")
    head = ["What the paper says", "Where", "Paper", "Ours", "Difference", "Verdict"]
    lines = [BEGIN, "", *_markdown(head, _cells(comparison)), ""]
    head = ["Figure", "What it shows", "Label", "Reason"]
    lines += [*_markdown(head, _figure_cells(figures)), "", END]
    return "\n".join(lines)


def with_block(readme: str, block: str) -> str:
    """The README's text with what stands between the markers replaced."""
    before, begin, rest = readme.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise FileError(
            f"README.md: expected the markers {BEGIN} and {END}, one of them is missing"
        )
    return before + block + after


def write_readme(readme: Path, results: Path) -> None:
    """Bring the README's tables up to date with ``results``."""
    text = with_block(readme.read_text(encoding="utf-8"), readme_block(results))
    write_bytes(readme, text.encode())


def _cells(comparison: pd.DataFrame) -> list[list[str]]:
    """A row of words for each claim; a claim between two of our own numbers has no printed one."""
    cells = []
    for row in comparison.to_dict("records"):
        equal = row["relation"] == "="
        bound = "" if equal else f"{row['relation']} "
        paper = f"{bound}{row['paper']:.7g}{'' if row['printed'] else ' (ours)'}"
        difference = f"{row['difference']:+.3g}" if equal else ""
        ours = f"{row['ours']:.6g}"
        cells.append([row["what"], row["where"], paper, ours, difference, row["verdict"]])
    return cells


def _figure_cells(figures: pd.DataFrame) -> list[list[str]]:
    columns = figures[["figure", "shows", "label", "reason"]].fillna("").astype(str)
    return [list(row) for row in columns.itertuples(index=False)]


def _markdown(head: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(str(c).replace("|", "\\|") for c in line) + " |" for line in lines]


def _coloured(word: str) -> str:
    colour = COLOURS.get(word, "red")
    return f"[{colour}]{word}[/{colour}]"
