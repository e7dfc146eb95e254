"""Whether the mesh check's bars hold on shapes unlike those of mesh_check, and how sharp they are.

- ``closed_forms``: for closed forms unlike those of the study ``mesh_check``, and for plans with re-entrant
  corners, the value, the limit, both bars and the exact value. For the plans that is the limit of a mesh
  that gets finer towards the corners, whose own bar is far smaller than those here.
- ``coverage``: by family, the share of bars that hold the true error; the median, the 95th percentile and
  the largest of their widths, as a multiple of the true error.
- ``accuracy``: by family, searches with ``solve_to_accuracy`` that say REACHED, and the true error then.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from pcmc import Surface, check_mesh, solve, solve_to_accuracy
from pcmc.meshing.local_refinement import refine_near
from pcmc.plan import Plan, arc, join, polyline

from ..folder import Folder
from ..gallery.closed_forms import Case
from ..questions.mesh_check import coverage, figure, rows_of
from ..study import Study
from . import forms as coverage_forms

QUANTITIES = (
    ("height", "patch 1"),
    ("area", "patch 1"),
    ("volume", ""),
    ("energy", ""),
    ("lowest eigenvalue", ""),
)
FINE = 0.13  # edge length of a reference away from its corners
LEVELS = 8  # of refinement at the corners
SEARCHED = {"area": 2e-3}  # of the exact value: the accuracy asked of solve_to_accuracy


def data(folder: Folder, short: bool) -> None:
    """``closed_forms``, ``accuracy``."""
    rows: list[dict[str, Any]] = []
    reached: list[dict[str, Any]] = []
    seen = set()
    for case in (*coverage_forms.cases(), *_plans(short)):
        if case.family not in seen:
            reached += _reached(case)
        if not (short and case.family in seen):
            rows += rows_of(case)
        seen.add(case.family)
    folder.write_table("closed_forms", pd.DataFrame(rows))
    folder.write_table("accuracy", pd.DataFrame(reached))


def _reached(case: Case) -> Iterator[dict[str, Any]]:
    """A search for each quantity of SEARCHED, for the value on the mesh and for the limit."""
    for quantity, share in SEARCHED.items():
        if (goal := next((goal for goal in case.exact if goal[0] == quantity), None)) is None:
            continue
        wanted = share * abs(case.exact[goal])
        for kind, value in (("mesh", "value"), ("limit", "limit")):
            name = " of ".join(filter(None, goal))
            found = solve_to_accuracy(
                case.start(),
                {name: wanted},
                accuracy_of=kind,
                corners=case.corners,
                most_triangles=20_000,
                target="stationary",
            )
            true = float("nan") if found.values.empty else abs(found.values[value].iloc[0] - case.exact[goal])
            yield {
                "family": case.family,
                "case": case.name,
                "quantity": name,
                "accuracy_of": kind,
                "status": found.status.name.lower(),
                "triangles": found.surface.m,
                "wanted": wanted,
                "true_error": true,
            }


# ---- plans with re-entrant corners ---------------------------------------------------------------


def _ell(alpha: float, edge: float) -> Surface:
    outline = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]
    return Plan(outline, tension=alpha, edge_length=edge).surface()


def _keyhole(alpha: float, edge: float) -> Surface:
    """A disc of radius 1 with a stem of half-width 0.35 and a corner of 249.5° at each of its sides."""
    a, c = 0.35, float(np.sqrt(1.0 - 0.35**2))
    round_part = arc([a, -c], [0.0, 1.0], [-a, -c])
    outline = join(round_part, polyline([[-a, -c], [-a, -2.0], [a, -2.0], [a, -c]]))
    return Plan(outline, tension=alpha, edge_length=edge).surface()


NOTCHES = {
    "L plan": [[1.0, 1.0, 0.0]],
    "keyhole plan": [[s * 0.35, -np.sqrt(1.0 - 0.35**2), 0.0] for s in (1, -1)],
}
PLANS: dict[str, Callable[[float, float], Surface]] = {"L plan": _ell, "keyhole plan": _keyhole}


def _plans(short: bool) -> Iterator[Case]:
    for family, build in PLANS.items():
        for alpha in (1.0,) if short else (1.0, 1.5, 4.0):
            exact = _reference(build(alpha, 0.3 if short else FINE), NOTCHES[family])
            for edge in (0.45, 0.35, 0.25, 0.18):
                start = partial(build, alpha, edge)
                yield Case(family, f"α {alpha:g}, edge {edge:g}", start, exact)


def _reference(start: Surface, corners: list[list[float]]) -> dict[tuple[str, str], float]:
    """Limits on three meshes with edges at the corners 2^-LEVELS times as long as elsewhere."""
    graded = refine_near(solve(start).surface, corners, LEVELS, 0.35)
    check = check_mesh(solve(graded))
    rows = {goal: check.row(*goal) for goal in QUANTITIES}
    return {goal: float(row.limit) for goal, row in rows.items()}


def table(folder: Folder) -> dict[str, float]:
    """``coverage``; the numbers of all families together, and of the worst."""
    records, whole = coverage(folder)
    families = folder.read_table("coverage").iloc[:-1]
    reached = folder.read_table("accuracy")
    reached = reached[reached["status"] == "reached"]
    return {
        **{key: float(value) for key, value in whole.items() if key != "family"},
        "cases": float(len(records[["family", "case"]].drop_duplicates())),
        "families": float(len(families)),
        "worst_family_inside": float(families["inside_bounded"].min()),
        "worst_family_limit_inside": float(families["limit_inside"].min()),
        "reached": float(len(reached)),
        "reached_and_true": float((reached["true_error"] <= reached["wanted"]).mean()),
    }


STUDY = Study(
    "coverage",
    "whether the mesh check's error bars hold in every one of 13 further families, and how sharp they are",
    data,
    table,
    figure,
    parameters={"fine": FINE, "levels": LEVELS},
    seconds=300,
    paper=False,
)
