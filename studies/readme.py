"""The README's tables, each between markers of its name, from what the studies wrote."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pcmc.base.errors import FileError

from .folder import Folder, write_bytes
from .report import FIGURES, HEADS, comparison_cells, figure_cells, given_sentence


def write_readme(readme: Path, results: Path) -> None:
    """Bring the README's tables up to date with ``results``."""
    text = up_to_date(readme.read_text(encoding="utf-8"), results)
    write_bytes(readme, text.encode())


def up_to_date(readme: str, results: Path) -> str:
    """The README's text with all its tables made anew."""
    for name, lines in (
        ("comparison", comparison(results)), ("solvers", solvers(results)), ("speed", speed(results)),
    ):  # fmt: skip
        readme = with_block(readme, name, lines)
    return readme


def with_block(readme: str, name: str, lines: Sequence[str]) -> str:
    """The text with what stands between the markers of a table replaced."""
    first, last = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before, begin, rest = readme.partition(first)
    _, end, after = rest.partition(last)
    if not (begin and end):
        raise FileError(f"README.md: expected the markers {first} and {last}, one is missing")
    return "\n".join([before + first, "", *lines, "", last + after])


def comparison(results: Path) -> list[str]:
    """What the paper prints and says beside our numbers; the sentences folded away."""
    folder = Folder(results)
    found, figures = folder.read_table("comparison"), folder.read_table("figures")
    numbers, sentences = (
        table(HEADS[kind], comparison_cells(found, kind)) for kind in ("number", "sentence")
    )
    return [
        *numbers, "", given_sentence(found), "",
        *table(FIGURES, figure_cells(figures)), "",
        "<details><summary>What the paper says in words, measured</summary>", "", *sentences, "",
        "</details>",
    ]  # fmt: skip


def solvers(results: Path) -> list[str]:
    """How each method ends on all the examples and resolutions of the study ``solvers``."""
    rows = Folder(results / "solvers").read_table("summary").to_dict("records")
    head = ["Method", "At rest", "Verdicts", "Largest residual", "Largest curvature error, median",
            "Worst triangle", "Evaluations, median"]  # fmt: skip
    cells = [
        [
            row["method"],
            f"{row['at_rest']} of {row['runs']}",
            row["verdicts"],
            f"{row['largest_residual']:.1e}",
            f"{row['median_largest_error_variational']:.1e}",
            f"{row['worst_quality']:.2g}",
            f"{row['median_evaluations']:.0f}",
        ]
        for row in rows
    ]
    return table(head, cells)


def speed(results: Path) -> list[str]:
    """The benchmark's medians, with what was asked of them."""
    rows = Folder(results / "benchmark").read_table("full")
    text = rows[["what", "unit", "asked", "met", "remark"]].fillna("").astype(str)
    cells = [
        [line.what, f"{median:.4g} {line.unit}", line.asked, line.met, line.remark]
        for line, median in zip(text.itertuples(), rows["median"], strict=True)
    ]
    return table(["What", "Median", "Asked", "Met", ""], cells)


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    """A Markdown table.

    >>> table(["a", "b"], [[1, "x | y"]])[2]
    '| 1 | x \\\\| y |'
    """
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(str(c).replace("|", "\\|") for c in line) + " |" for line in lines]
