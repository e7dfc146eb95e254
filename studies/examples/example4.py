"""Example 4, Sec. 4.4: a hall of three patches on non-planar boundaries. Figs. 22 to 25."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from generators import bezier_hall
from pcmc import Surface, curvature_error

from ..folder import Folder
from ..paper import printed
from ..study import Study
from .example import numbers, shapes
from .flow import Case, curvature_table, run_cases

T0, ITERATIONS = 0.005, 1000
OPTIONS = {"t0": T0, "iterations": ITERATIONS}
MARKS = (225, 500, 1000)  # iterations at which the paper prints ‖∇E‖²


def cases() -> list[Case]:
    """The flow with both Armijo tests, each watched for its best iteration."""
    return [
        Case("main", bezier_hall, OPTIONS, watched=True),
        Case("sufficient", bezier_hall, OPTIONS | {"armijo": "sufficient"}, watched=True),
    ]


def data(folder: Folder, short: bool) -> None:
    """Solve every case."""
    run_cases(folder, cases(), short=short)


def table(folder: Folder) -> dict[str, float]:
    """``curvature``, ``best`` and ``boundary`` tables, and the numbers for the comparison."""
    meshes = {case.name: folder.read_mesh(case.name) for case in cases()}
    stages = meshes["main"]
    folder.write_table("curvature", curvature_table(stages))
    histories = folder.read_table("histories")
    best = pd.DataFrame([_best(histories, name) for name in meshes])
    folder.write_table("best", best)
    near = _near_boundary(stages)
    folder.write_table("boundary", near)
    start = stages["initial"]
    found = numbers(folder, "main", stages) | _given(start)
    for name in meshes:
        row = best.set_index("case").loc[name]
        suffix = "" if name == "main" else f"_{name}"
        found |= {f"{key}{suffix}": row[key] for key in row.index}
    at = near.set_index("where").mean_error
    return found | {"error_near_boundary": at["boundary"], "error_elsewhere": at["elsewhere"]}


def _given(start: Surface) -> dict[str, float]:
    """What the paper states of the initial shape, measured on ours."""
    width, depth, height = np.ptp(start.vertices, axis=0)
    tension = {patch.name: patch.tension for patch in start.patches}
    return {
        "width": width,
        "depth": depth,
        "height": height,
        "alpha": tension["middle"],
        "alpha_left_wall": tension["left wall"],
        "alpha_right_wall": tension["right wall"],
        "external_patches": sum(not p.auxiliary for p in start.patches),
        "walls": sum(p.auxiliary for p in start.patches),
        "t0": T0,
    }


def _best(histories: pd.DataFrame, case: str) -> dict[str, float | str]:
    """The iteration of least largest error, and ‖∇E‖² there and where the paper prints it."""
    mine = histories[histories.case == case].set_index("iteration")
    best = int(mine.largest_error.to_numpy().argmin())
    squared = mine.gradient_squared
    return {
        "case": case,
        "best_iteration": best,
        "best_largest_error": mine.largest_error[best],
        "best_gradient_squared": squared[best],
        **{f"gradient_squared_{mark}": squared.get(mark, np.nan) for mark in MARKS},
        "least_gradient_squared": squared.min(),
        "largest_error_1000": mine.largest_error.iloc[-1],
    }


def _near_boundary(stages: Mapping[str, Surface]) -> pd.DataFrame:
    """Mean error, at the best iteration, at vertices with an edge to the boundary and elsewhere."""
    surface = stages["best"]
    error = np.abs(curvature_error(surface))
    topology = surface.topology
    near = np.zeros(surface.n, dtype=bool)
    near[topology.edges[topology.on_boundary[topology.edges].any(axis=1)]] = True
    rows = [
        (where, int(np.isfinite(error[mask]).sum()), float(np.nanmean(error[mask])))
        for where, mask in (("boundary", near), ("elsewhere", ~near))
    ]
    return pd.DataFrame(rows, columns=["where", "vertices", "mean_error"])


def figure(folder: Folder) -> None:
    """Figs. 22 to 25."""
    pictures = {"initial": ("fig22", None), "best": ("fig23", "fig24")}
    shapes(
        folder,
        "main",
        pictures,
        "fig25",
        printed("example4.gradient_squared_1000"),
        walls_view=(-120.0, 28.0),
    )


STUDY = Study(
    "example4",
    "a hall of three patches on non-planar Bézier boundaries, with a hole: the best of 1000",
    data,
    table,
    figure,
    parameters=OPTIONS,
    seconds=15,
)
