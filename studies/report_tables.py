"""The tables of ``REPORT.md``, as lines of Markdown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from .examples.flow import NOISE, NOISE_RESIDUAL
from .folder import Folder
from .paper import HOLDS

JUMPS = {  # columns of its table
    "slid": "Vertices moved by",
    "step_before": "Step before",
    "step": "Step of E",
    "step_halved": "Triangles cut into four",
    "polygon_step_before": "On the polygon: step before",
    "polygon_step": "On the polygon: step",
}


def jump_table(results: Path) -> list[str]:
    """The steps of the energy that ``corners`` looks into."""
    head = ["Example", "Bottoms", "Level", "Solved anew", *JUMPS.values()]
    rows = Folder(results / "corners").read_table("jumps").to_dict("records")
    cells = [
        [
            row["case"],
            row["bottom"],
            row["level"],
            "yes" if row["anew"] else "no",
            *(f"{row[key]:.2g}".replace("nan", "") for key in JUMPS),
        ]
        for row in rows
    ]
    return table(head, cells)


def comparison_cells(comparison: pd.DataFrame, kind: str) -> list[list[str]]:
    """A row of words for each claim of a kind."""
    cells = []
    shown = comparison.fillna({"chosen": "", "threshold": ""})
    for row in shown[shown.kind == kind].to_dict("records"):
        equal = row["relation"] == "="
        paper = f"{'' if equal else row['relation'] + ' '}{row['paper']:.7g}"
        ours = f"{row['ours']:.6g}"
        known = equal and math.isfinite(row["difference"])
        difference = [f"{row['difference']:+.3g}" if known else ""] if kind == "number" else []
        if kind == "sentence":
            paper, ours = f"{row['relation']} {row['paper']:.4g}", f"{row['ours']:.4g}"
            paper += " (ours)" if row["threshold"] == "ours" else ""
        so = f"; {row['chosen']} is chosen so" if row["chosen"] and row["verdict"] == HOLDS else ""
        cells.append([row["what"], row["where"], paper, ours, *difference, row["verdict"] + so])
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


def bench_table(results: Path) -> list[str]:
    """How each program of the bench ended."""
    runs = Folder(results / "bench").read_table("runs_times").fillna({"said": ""})
    cells = [
        [
            *(run.case, f"{run.triangles:,}", run.program, f"{run.seconds:.3g}", f"{run.residual:.1e}"),
            *(f"{run.error:.1e}".replace("nan", ""), run.said),
        ]
        for run in runs.itertuples()
        if not str(run.said).startswith("not asked")
    ]
    ran = Folder(results / "bench").read_table("programs_times")
    versions = "; ".join(f"{name}: {found}" for name, found in zip(ran.program, ran.version, strict=True))
    head = ["Surface", "Triangles", "Program", "s", "Residual", "Energy off", "It says"]
    return [*table(head, cells), "", f"{versions}."]


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    """A Markdown table.

    >>> table(["a", "b"], [[1, "x | y"]])[2]
    '| 1 | x \\\\| y |'
    """
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(str(c).replace("|", "\\|") for c in line) + " |" for line in lines]


def _bounded(value: float, bound: float) -> str:
    return f"≤ {bound:.0e}" if value <= bound else f"{value:.1e}"
