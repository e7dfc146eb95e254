"""The comparison with the paper: files, the screen, and the README's own tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.table import Table

from pcmc.errors import FileError

from .folder import Folder, write_bytes
from .paper import HOLDS, compare, read_measured
from .runner import Outcome

BEGIN, END = "<!-- comparison: begin -->", "<!-- comparison: end -->"
HEADS = {
    "sentence": ["What the paper says", "Where", "To hold", "Ours", "Verdict"],
    "number": ["What the paper prints", "Where", "Paper", "Ours", "Difference", "Verdict"],
}
COLOURS = {"reproduced": "green", "near": "yellow", "conditionally reproduced": "yellow"}


def write_comparison(results: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """``comparison.csv`` and ``figures.csv`` in ``results``, from what the studies measured."""
    comparison, figures = compare(read_measured(results))
    Folder(results).write_table("comparison", comparison)
    Folder(results).write_table("figures", figures)
    return comparison, figures


def show(comparison: pd.DataFrame, figures: pd.DataFrame, console: Console) -> None:
    """The figures, then the comparison: sentences, and last the printed numbers."""
    table = Table("figure", "what it shows", "label", "reason")
    for number, shows, name, reason in _figure_cells(figures):
        table.add_row(number, shows, _coloured(name), reason)
    console.print(table)
    for kind, head in HEADS.items():
        table = Table(*head)
        for row in _cells(comparison, kind):
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


def readme_block(results: Path) -> str:
    """The tables as Markdown, between their markers; the sentences folded away."""
    folder = Folder(results)
    comparison, figures = folder.read_table("comparison"), folder.read_table("figures")
    numbers, sentences = (
        _markdown(head, _cells(comparison, kind))
        for kind, head in (("number", HEADS["number"]), ("sentence", HEADS["sentence"]))
    )
    head = ["Figure", "What it shows", "Label", "Reason"]
    lines = [BEGIN, "", *numbers, "", given_sentence(comparison), ""]
    lines += [*_markdown(head, _figure_cells(figures)), ""]
    lines += ["<details><summary>What the paper says in words, measured</summary>", "", *sentences]
    return "\n".join([*lines, "", "</details>", "", END])


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


def given_sentence(comparison: pd.DataFrame) -> str:
    """How many of the paper's inputs (tensions, lengths, steps) the studies use as printed."""
    given = comparison[comparison.kind == "input"]
    differ = given[given.verdict != HOLDS].what.tolist()
    rest = f"; not so: {', '.join(differ)}" if differ else ""
    used = len(given) - len(differ)
    return f"{used} of the {len(given)} inputs that the paper prints are used as printed{rest}."


def _cells(comparison: pd.DataFrame, kind: str) -> list[list[str]]:
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


def _figure_cells(figures: pd.DataFrame) -> list[list[str]]:
    columns = figures[["figure", "shows", "label", "reason"]].fillna("").astype(str)
    return [list(row) for row in columns.itertuples(index=False)]


def _markdown(head: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(str(c).replace("|", "\\|") for c in line) + " |" for line in lines]


def _coloured(word: str) -> str:
    colour = COLOURS.get(word, "red")
    return f"[{colour}]{word}[/{colour}]"
