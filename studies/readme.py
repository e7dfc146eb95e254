"""The README's summary of the comparison with the paper."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from pcmc.base.errors import FileError

from .folder import Folder, write_bytes
from .paper import CONDITIONAL, HOLDS, NEAR, NOT, OWN, REPRODUCED
from .report import write_report

WIDTH = 120  # of a line of the README


def write_readme(readme: Path, results: Path) -> None:
    """Bring the README's summary and ``REPORT.md`` up to date with the tables in ``results``."""
    write_report(results)
    text = up_to_date(readme.read_text(encoding="utf-8"), results)
    write_bytes(readme, text.encode())


def up_to_date(readme: str, results: Path) -> str:
    """The README's text with its summary made anew."""
    folder = Folder(results)
    comparison, figures = folder.read_table("comparison"), folder.read_table("figures")
    return with_block(readme, "summary", textwrap.wrap(counts(comparison, figures), WIDTH))


def counts(comparison: pd.DataFrame, figures: pd.DataFrame) -> str:
    """One sentence: how many figures, numbers, statements and inputs are reproduced."""
    figure = [int((figures.label == label).sum()) for label in (REPRODUCED, CONDITIONAL, NOT)]
    numbers, sentences, inputs = (
        of_the_paper(comparison, kind).verdict for kind in ("number", "sentence", "input")
    )
    hold, near = int((numbers == HOLDS).sum()), int((numbers == NEAR).sum())
    return (
        f"Of the paper's {len(figures)} figures, {figure[0]} is reproduced, {figure[1]} are reproduced"
        f" conditionally and {figure[2]} is not; of its {len(numbers)} printed numbers, {hold} hold,"
        f" {near} are near and {len(numbers) - hold - near} differ; {(sentences == HOLDS).sum()} of its"
        f" {len(sentences)} statements hold; {(inputs == HOLDS).sum()} of its {len(inputs)} inputs are"
        " used as printed."
    )


def of_the_paper(comparison: pd.DataFrame, kind: str) -> pd.DataFrame:
    """The paper's own claims of a kind, without our additions."""
    return comparison[(comparison.kind == kind) & ~comparison["where"].str.endswith(OWN)]


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
