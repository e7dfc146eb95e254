"""The comparison with the paper as files: two tables and ``REPORT.md``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from .examples.flow import NOISE, NOISE_RESIDUAL
from .folder import Folder, write_bytes
from .paper import HOLDS, compare, read_measured

HEADS = {
    "sentence": ["What the paper says", "Where", "Holds if", "Ours", "Verdict"],
    "number": ["What the paper prints", "Where", "Paper", "Ours", "Difference", "Verdict"],
}
FIGURES = ["Figure", "What it shows", "Label", "Claims that hold", "Why not fully"]

HEADER = """\
# The paper beside this package

`python -m studies reproduce` writes this file. Do not edit it.

Each thing that the paper's text says or prints about a figure is a claim, compared with what we measure.
`studies/paper.toml` lists all claims with their tolerances; `studies/paper.py` holds these rules:

- **reproduced**: every claim about the figure holds.
- **conditionally reproduced**: a claim holds only under the condition given beside it (another reading of
  the paper, or another mesh), or a number that depends on an unpublished mesh is near, or part of what
  the figure shows is not in the text.
- **not reproduced**: a claim fails.

A number is **near** within 5 % for ‖∇E‖² of an initial shape, 2 % for its mean curvature, a fifth for
Example 4's best iteration, and a half for its errors and ‖∇E‖² on the way. The paper's inputs and our
additions do not count for a label. We did not compare the pictures themselves."""

SOLVERS = """\
The study `solvers` runs each method from the same start on Examples 1 to 4, on four meshes each, from
coarse to fine. It uses the paper's tensions, except for a wall of 1 in Example 1, where 2 is a saddle on
fine meshes. Residuals and errors are relative. With `target="stationary"` the geometric solver reaches
equilibrium every time; on Example 3 that is a saddle. With the default, `target="minimum"`, it leaves the
saddles and descends until triangles collapse; the verdict then names the worst triangle."""

SPEED = """\
Surface Evolver solves the same mesh of Example 1, and the same cap, in the same run. `python -m studies
benchmark` writes this table, and `benchmark/scaling.csv` and `scaling.png`, which show how time and memory
grow with the number of triangles. Unlike all others here, they differ from run to run."""


def write_comparison(results: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Write ``comparison.csv``, ``figures.csv`` and ``REPORT.md`` from what the studies measured."""
    comparison, figures = compare(read_measured(results))
    Folder(results).write_table("comparison", comparison)
    Folder(results).write_table("figures", figures)
    write_report(results)
    return comparison, figures


def write_report(results: Path) -> None:
    """Write ``REPORT.md`` from the tables in ``results``."""
    write_bytes(results / "REPORT.md", report(results).encode())


def report(results: Path) -> str:
    """The text of ``REPORT.md``; a section is left out if its study has not run."""
    comparison = Folder(results).read_table("comparison")
    figures = Folder(results).read_table("figures")
    sections = {
        "Figures": table(FIGURES, figure_cells(figures)),
        "Printed numbers": [
            *table(HEADS["number"], comparison_cells(comparison, "number")),
            "",
            given_sentence(comparison),
        ],
        "Statements": table(HEADS["sentence"], comparison_cells(comparison, "sentence")),
    }
    if (results / "solvers" / "summary.csv").is_file():
        sections["Solvers"] = [SOLVERS, "", *solver_table(results)]
    if (results / "benchmark" / "full.csv").is_file():
        sections["Speed"] = [SPEED, "", *speed_table(results)]
    parts = ["\n".join([f"## {title}", "", *lines]) for title, lines in sections.items()]
    return "\n\n".join([HEADER, *parts]) + "\n"


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


def solver_table(results: Path) -> list[str]:
    """How each method ends in the study ``solvers``, over all examples and resolutions."""
    rows = Folder(results / "solvers").read_table("summary").to_dict("records")
    head = [
        "Method",
        "At rest",
        "Verdicts",
        "Largest residual",
        "Largest curvature error, median",
        "Worst triangle",
        "Evaluations, median",
    ]
    cells = [
        [
            row["method"],
            f"{row['at_rest']} of {row['runs']}",
            row["verdicts"],
            _bounded(row["largest_residual"], NOISE_RESIDUAL),
            _bounded(row["median_largest_error_variational"], NOISE),
            f"{row['worst_quality']:.2g}",
            f"{row['median_evaluations']:.0f}",
        ]
        for row in rows
    ]
    return table(head, cells)


def speed_table(results: Path) -> list[str]:
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


def _bounded(value: float, bound: float) -> str:
    return f"≤ {bound:.0e}" if value <= bound else f"{value:.1e}"
