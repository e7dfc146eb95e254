"""The README's summary of the comparison with the paper."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path

from pcmc.base.errors import FileError

from .folder import Folder, write_bytes
from .report import headline, write_comparison

WIDTH = 120  # of a line of the README


def write_readme(readme: Path, results: Path) -> None:
    """Bring the README's summary, ``REPORT.md`` and the comparison up to date with ``results``."""
    write_comparison(results)
    text = up_to_date(readme.read_text(encoding="utf-8"), results)
    write_bytes(readme, text.encode())


def up_to_date(readme: str, results: Path) -> str:
    """The README's text with its summary made anew."""
    folder = Folder(results)
    comparison, figures = folder.read_table("comparison"), folder.read_table("figures")
    return with_block(readme, "summary", textwrap.wrap(headline(comparison, figures), WIDTH))


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
