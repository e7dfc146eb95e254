"""How far the examples depend on their meshes, and whether the mesh check's error bars are honest.

- ``examples``: the table of the mesh check for every example of the paper, the closed forms and the
  L-shaped roof of the notebooks, with verdicts and what the check costs.
- ``closed_forms``: the same for closed forms on many meshes, beside the exact values. The true error lies
  inside a bar, or it does not; and a bar is so many times as wide as the true error.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from generators import (
    bezier_hall,
    double_bubble,
    four_fans,
    joined_caps,
    spherical_cap,
    three_patches,
    two_caps,
    two_squares,
)
from pcmc import MeshCheck, Surface, check_mesh, project, solve
from pcmc.solvers.result import Result

from ..folder import Folder
from ..gallery.closed_forms import Case, cases
from ..study import Study

ROOF = Path(__file__).parents[2] / "notebooks" / "roof.toml"
EXAMPLES: dict[str, Callable[[], Surface]] = {
    "Example 1, wall 1": lambda: two_squares(alpha_aux=1.0),
    "Example 1, wall 2": two_squares,
    "Example 1, wall 3": lambda: two_squares(alpha_aux=3.0),
    "Example 1, wall 2, 16 squares": lambda: two_squares(16),
    "Example 2": two_caps,
    "Example 2, edge 1.2": lambda: two_caps(1.2),
    "Example 2, α small 3.2": lambda: two_caps(alpha_small=3.2),
    "Example 3": four_fans,
    "Example 4": bezier_hall,
    "Fig. 4": three_patches,
    "double bubble": double_bubble,
    "cap": spherical_cap,
    "joined caps": joined_caps,
}
SHORT = ("Example 1, wall 1", "cap")
COLUMNS = ("value", "error", "limit", "limit_error", "order")
EXACT = 1e-8  # of the value: a smaller true error is none
WIDE = 5.0  # times the true error: a wider bar is too wide


def data(folder: Folder, short: bool) -> None:
    """``examples``, ``verdicts``; ``closed_forms``; ``times`` of the solve and of the check."""
    rows, verdicts, times = [], [], []
    for name, result, check, seconds in _checked(short):
        rows.append(check.table.assign(example=name))
        verdicts.append(
            {
                "example": name,
                "triangles": result.surface.m,
                "verdict": check.verdict.name.lower().replace("_", " "),
                "detail": check.detail,
                "advice": check.advice,
            }
        )
        cost = {"solve": seconds[0], "check": seconds[1], "ratio": seconds[1] / seconds[0]}
        times.append({"example": name, **cost})
    folder.write_table("examples", _rounded(pd.concat(rows).iloc[:, [7, 0, 1, 2, 3, 4, 5, 6]]))
    folder.write_table("verdicts", pd.DataFrame(verdicts))
    folder.write_table("times", pd.DataFrame(times))
    folder.write_table("closed_forms", pd.DataFrame(_closed_forms(short)))


def _checked(short: bool) -> Iterator[tuple[str, Result, MeshCheck, tuple[float, float]]]:
    """Each example at rest, its check, and the processor time of both."""
    check_mesh(solve(two_squares(3, alpha_aux=1.0)))  # loads compiled code
    for name, build in EXAMPLES.items():
        if short and name not in SHORT:
            continue
        start, begin = build(), time.process_time()
        result = solve(start, target="stationary")
        result.certificate  # noqa: B018 — the solve's part, as for the command
        middle = time.process_time()
        yield name, result, check_mesh(result), (middle - begin, time.process_time() - middle)
    roof = project.load(ROOF)
    start, begin = project.surface_of(roof), time.process_time()
    outcome = project.solve_project(roof, start)
    middle = time.process_time()
    check = outcome.check_mesh()
    assert check is not None
    yield "L-shaped roof", outcome.solved, check, (middle - begin, time.process_time() - middle)


def _rounded(table: pd.DataFrame) -> pd.DataFrame:
    """Bars with two digits, orders with three; values that are rounding alone as 0."""
    table = table.copy()
    for value, bar in (("value", "error"), ("limit", "limit_error")):
        table[value] = table[value].where(table[value].abs() > table[bar].where(table[bar] < 1e-6, 0.0), 0.0)
        table[bar] = [float(f"{x:.1e}") for x in table[bar]]
    table["order"] = table["order"].round(2)
    return table


def _closed_forms(short: bool) -> list[dict[str, Any]]:
    """A row for each quantity with an exact value of each closed form that is at rest on its mesh."""
    rows: list[dict[str, Any]] = []
    seen = set()
    for case in cases():
        if short and case.family in seen:
            continue
        seen.add(case.family)
        rows += rows_of(case)
    return rows


def rows_of(case: Case) -> list[dict[str, Any]]:
    """A row for each quantity with an exact value; one alone where the case is not at rest on its mesh."""
    result = solve(case.start(), target="stationary")
    head: dict[str, Any] = {"family": case.family, "case": case.name, "triangles": result.surface.m}
    if result.certificate.index is None:
        return [{**head, "verdict": "not at rest"}]
    check = check_mesh(result, corners=case.corners)
    head["verdict"] = check.verdict.name.lower().replace("_", " ")
    return [
        head | {"quantity": quantity, "of": of, "exact": exact} | dict(check.row(quantity, of)[list(COLUMNS)])
        for (quantity, of), exact in case.exact.items()
    ]


def table(folder: Folder) -> dict[str, float]:
    """``coverage``: by family, and of all; the shares of bars that hold the true error, and their widths."""
    records, whole = coverage(folder)
    verdicts = folder.read_table("verdicts")["verdict"].value_counts()
    at_rest = records[records["quantity"].notna()]
    return {
        **{key: float(value) for key, value in whole.items() if key != "family"},
        "closed_forms": float(len(records[["family", "case"]].drop_duplicates())),
        "not_at_rest": float((records["verdict"] == "not at rest").sum()),
        "closed_forms_persisting": float(
            at_rest.groupby(["family", "case"])["verdict"].first().eq("persists").mean()
        ),
        **{f"examples_{str(name).replace(' ', '_')}": float(count) for name, count in verdicts.items()},
    }


def coverage(folder: Folder) -> tuple[pd.DataFrame, dict[str, Any]]:
    """All records of closed forms, and the last row of the table that this writes: all families together."""
    records = folder.read_table("closed_forms")
    known = records[records["quantity"].notna()].copy()
    for value, bar, name in (("value", "error", "true"), ("limit", "limit_error", "limit_true")):
        known[name] = (known[value] - known["exact"]).abs()
        known[f"{name}_width"] = known[bar] / known[name]
    known = known[known["true"] > EXACT * known["exact"].abs()]
    rows = [_coverage(name, part) for name, part in known.groupby("family", sort=False)]
    whole = _coverage("all", known)
    folder.write_table("coverage", pd.DataFrame([*rows, whole]))
    return records, whole


def _coverage(family: object, part: pd.DataFrame) -> dict[str, Any]:
    """Of one family: bars on this mesh's value first, then the bars of the limit.

    Widths are multiples of the bar's own true error, which may happen to be next to nothing; shares are the
    bars of limits over the true error of the value on the mesh.
    """
    bounded = np.isfinite(part["error"])
    row: dict[str, Any] = {"family": family, "quantities": len(part), "no_limit": int((~bounded).sum())}
    row["held_by_mesh"] = int((part["verdict"] == "held by mesh").sum())
    row["inside"] = float((part["true"] <= part["error"]).mean())
    row["inside_bounded"] = float((part["true"] <= part["error"])[bounded].mean())
    part = part[bounded]
    for name, key in (("true_width", "width"), ("limit_true_width", "limit_width")):
        row[f"{key}_median"] = float(part[name].median())
        row[f"{key}_95"] = float(part[name].quantile(0.95))
        row[f"{key}_largest"] = float(part[name].max())
        row[f"{key}_over_5"] = float((part[name] > WIDE).mean())
    share = part["limit_error"] / part["true"]
    row["limit_share_median"], row["limit_share_95"] = float(share.median()), float(share.quantile(0.95))
    row["limit_inside"] = float((part["limit_true"] <= part["limit_error"]).mean())
    row["gain"] = float((part["true"] / part["limit_true"]).median())
    return row


def figure(folder: Folder) -> None:
    """True errors against their bars: on this mesh, and in the limit."""
    from pcmc.plot.curves import MARKERS, label_axes
    from pcmc.plot.figure import CURVES, INK, SMALL, TEXT, finish, new, style

    records = folder.read_table("closed_forms")
    records = records[records["quantity"].notna() & np.isfinite(records["error"])]
    picture = new(1500, 900, pad=8.0)
    panels = picture.subplots(1, 2, sharey=True)
    kinds = (("value", "error", "the value on this mesh"), ("limit", "limit_error", "the limit"))
    ends = np.array([1e-7, 1.0])
    for axes, (value, bar, title) in zip(panels, kinds, strict=True):
        style(axes)
        size = records["exact"].abs()
        true, width = (records[value] - records["exact"]).abs() / size, records[bar] / size
        for k, (family, part) in enumerate(records.groupby("family", sort=False)):
            look = {"color": CURVES[k % len(CURVES)], "linestyle": "none", "markeredgewidth": 0.0}
            marker = MARKERS[(k + k // len(CURVES)) % len(MARKERS)]
            sizes = {"markersize": 2.6, "alpha": 0.55}
            axes.plot(width[part.index], true[part.index], marker=marker, label=family, **look, **sizes)
        axes.fill_between(ends, ends, 1.0, color="#B2182B", alpha=0.08, linewidth=0.0)
        axes.text(3e-7, 0.1, "outside the bar", fontsize=SMALL, color="#B2182B")
        dashed = {"color": INK, "linewidth": 0.9, "linestyle": (0, (5, 3))}
        axes.plot(ends, ends, color=INK, linewidth=0.9, label="error = bar")
        axes.plot(ends, ends / WIDE, label=f"error = bar / {WIDE:g}", **dashed)
        axes.set(xscale="log", yscale="log", xlim=ends, ylim=(1e-8, 1.0))
        axes.set_title(title, fontsize=TEXT, color=INK)
        label_axes(axes, "error bar / exact value", "true error / exact value")
        axes.label_outer()
    handles, labels = panels[0].get_legend_handles_labels()
    legend = picture.legend(
        handles, labels, loc="outside lower center", ncols=6, fontsize=SMALL, frameon=False, labelcolor=INK
    )
    for handle in legend.legend_handles:
        handle.set_alpha(1.0)
    finish(picture, folder.figure("coverage"))


STUDY = Study(
    "mesh_check",
    "the mesh check of every example, and the coverage of its error bars on closed forms",
    data,
    table,
    figure,
    parameters={"examples": list(EXAMPLES), "meshes": 3},
    seconds=90,
    paper=False,
)
