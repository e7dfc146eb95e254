"""The README's summary of the comparison with the paper."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from pcmc.base.errors import FileError

from .folder import Folder, write_bytes
from .paper import HOLDS, NEAR
from .report import HEADS, comparison_cells, headline, of_the_paper, table, write_report

ROWS = 5


def write_readme(readme: Path, results: Path) -> None:
    """Bring the README's summary and ``REPORT.md`` up to date with the tables in ``results``."""
    write_report(results)
    text = up_to_date(readme.read_text(encoding="utf-8"), results)
    write_bytes(readme, text.encode())


def up_to_date(readme: str, results: Path) -> str:
    """The README's text with its summary made anew."""
    folder = Folder(results)
    comparison, figures = folder.read_table("comparison"), folder.read_table("figures")
    lines = [
        *table(HEADS["number"], comparison_cells(summary(comparison), "number")),
        "",
        headline(comparison, figures),
    ]
    return with_block(readme, "summary", lines)


def summary(comparison: pd.DataFrame) -> pd.DataFrame:
    """Some of the numbers that the paper prints: all that fail first, then in the paper's order."""
    printed = of_the_paper(comparison, "number")
    agrees = printed.verdict.isin([HOLDS, NEAR])
    return printed.loc[agrees.sort_values(kind="stable").index[:ROWS].sort_values()]


def with_block(readme: str, name: str, lines: Sequence[str]) -> str:
    """The text with new lines between the markers of a block."""
    first, last = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before, begin, rest = readme.partition(first)
    _, end, after = rest.partition(last)
    if not (begin and end):
        raise FileError(
            f"README.md: a marker is missing; write {first} and {last}",
            what="README.md",
            expected=f"{first} ... {last}",
        )
    return "\n".join([before + first, "", *lines, "", last + after])
