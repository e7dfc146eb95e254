"""Runs of the paper's flow, and what is recorded of each: shared by the studies of its examples."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from pcmc import Surface, curvature_error, gradient, mean_curvature, solve, target_curvature
from pcmc.base.arrays import Floats, Ints
from pcmc.forces.curvature import METHODS
from pcmc.forces.functional import patch_areas, weighted
from pcmc.meshing.quality import minimum_angle, triangle_quality
from pcmc.solvers.result import Progress

from ..folder import Folder
from .flow_case import PAPER

SHORT_ITERATIONS = 12
DECIMALS = 6  # of the positions from which a flow starts, in the paper's units
NOISE = 1e-9  # a smaller relative curvature error is rounding; tables hold this bound in its place
NOISE_RESIDUAL = 1e-10  # the same of a relative residual


@dataclass(frozen=True)
class Case:
    """One run: a surface to start from, options of the method, columns that say what was varied.

    ``watched`` measures the largest error after each iteration and keeps the best surface.
    """

    name: str
    build: Callable[[], Surface]
    options: Mapping[str, Any]
    varied: Mapping[str, Any] = field(default_factory=dict)
    method: str = "nesterov"
    watched: bool = False


def start_of(case: Case) -> Surface:
    """The case's initial shape, rounded to DECIMALS.

    Some shapes come from a linear solver, whose last digit depends on the processor. The flow amplifies
    it: without rounding, Example 4 differs in its first digit after 225 iterations.
    """
    surface = case.build()
    return surface.moved(surface.vertices.round(DECIMALS))


def run_cases(folder: Folder, cases: Sequence[Case], *, short: bool = False) -> None:
    """Solve each case; write ``records``, ``histories`` and each mesh, initial and final."""
    records, histories = [], []
    for case in cases:
        start = start_of(case)
        options = settings(case, short)
        watch = Watch(start) if case.watched else None
        result = solve(start, case.method, watch, **options)
        columns = {"case": case.name, "method": case.method, **case.varied, **options}
        records.append({**columns, **describe(start), **ending(result)})
        stages, history = {"initial": start, "final": result.surface}, result.history
        if watch is not None:
            stages["best"] = watch.best
            history = history.assign(largest_error=watch.errors[: len(history)])
        histories.append(history.assign(case=case.name))
        folder.write_mesh(case.name, stages)
    folder.write_table("records", pd.DataFrame(records))
    folder.write_table("histories", pd.concat(histories, ignore_index=True))


class Watch:
    """A callback that notes the largest curvature error after each iteration, as the paper does.

    The error is Meyer's, at the interior vertices of the patches under pressure.
    """

    def __init__(self, start: Surface) -> None:
        self.best, self.errors = start, [largest_error(start)]

    def __call__(self, progress: Progress) -> None:
        surface = progress.surface()
        error = largest_error(surface)
        if error < min(self.errors):
            self.best = surface
        self.errors.append(error)


def largest_error(surface: Surface) -> float:
    """Largest |H - H̄| / H̄ with the cotangent H; infinite where a triangle has collapsed."""
    error = np.abs(curvature_error(surface))[measured_vertices(surface)]
    return float(np.where(np.isnan(error), np.inf, error).max())


def measured_vertices(surface: Surface) -> Ints:
    """Numbers of the vertices inside a patch under pressure."""
    target = target_curvature(surface)
    return np.flatnonzero(np.isfinite(target) & (target != 0.0))


def settings(case: Case, short: bool = False) -> dict[str, Any]:
    """The case's options over the paper's; no tolerance, the flow stops by its iterations."""
    paper = PAPER if case.method == "nesterov" else {}
    options: dict[str, Any] = {**paper, "tolerance": None, **case.options}
    limit = "iterations" if case.method == "nesterov" else "evaluations"
    return options | {limit: min(SHORT_ITERATIONS, options[limit])} if short else options


def describe(surface: Surface) -> dict[str, Any]:
    """The size of a mesh, its worst angle, and ‖∇E‖² where it stands."""
    return {
        "vertices": surface.n,
        "triangles": surface.m,
        "initial_minimum_angle": minimum_angle(surface),
        "initial_gradient_squared": float((gradient(surface) ** 2).sum()),
    }


def ending(result: Any) -> dict[str, Any]:
    """How a run ended, where ‖∇E‖² was least on its way, and the steps that were forced.

    A step is forced when it is taken although it fails the line search's test.
    """
    surface, history = result.surface, result.history
    return {
        "status": result.status.name.lower(),
        "energy": result.energy,
        "gradient_squared": float(history.gradient_squared.iloc[-1]),
        "least_gradient_squared": float(history.gradient_squared.min()),
        "at_row": int(history.gradient_squared.to_numpy().argmin()),
        "evaluations": result.evaluations,
        "forced_steps": forced_steps(history),
        "energy_rises": rises(history.energy),
        "minimum_quality": float(triangle_quality(surface.vertices, surface.faces).min()),
        **errors(surface),
    }


def forced_steps(history: pd.DataFrame) -> int:
    """How many steps the flow took although the line search's test failed for all of them."""
    held = history.get("armijo_held")
    return 0 if held is None else int((~held.fillna(True).astype(bool)).sum())


def rises(energy: pd.Series[float]) -> int:
    """In how many iterations E went up by more than rounding."""
    step = np.diff(energy.to_numpy())
    return int(np.count_nonzero(step > 1e-12 * np.abs(energy.to_numpy()[1:])))


def errors(surface: Surface) -> dict[str, float]:
    """Largest and mean |H - H̄| / H̄ inside the patches under pressure, by both definitions.

    Each at least NOISE, so that a table of exact equilibria is the same on every machine.
    """
    numbers = {}
    for method in METHODS:
        error = np.abs(curvature_error(surface, method))
        numbers[f"largest_error_{method}"] = float(np.maximum(NOISE, np.nanmax(error)))
        numbers[f"mean_error_{method}"] = float(np.maximum(NOISE, np.nanmean(error)))
    return numbers


def curvature_table(surfaces: Mapping[str, Surface]) -> pd.DataFrame:
    """A row per vertex inside a patch under pressure: H by both definitions, H̄, and the errors."""
    tables = []
    for name, surface in surfaces.items():
        target, rows = target_curvature(surface), measured_vertices(surface)
        x, y, z = surface.vertices[rows].T
        columns: dict[str, Any] = {"mesh": name, "vertex": rows, "x": x, "y": y, "z": z}
        columns["target"] = target[rows]
        for method in METHODS:
            columns[method] = mean_curvature(surface, method)[rows]
            columns[f"error_{method}"] = columns[method] / target[rows] - 1.0
        tables.append(pd.DataFrame(columns))
    return pd.concat(tables, ignore_index=True)


def conormals(surface: Surface, patch: str) -> Floats:
    """(n,3) area gradient of one patch at every vertex (17a): on its edge the outward co-normal."""
    tension = np.zeros(len(surface.patches))
    tension[surface.patch_index(patch)] = 1.0
    return weighted(surface, tension)[1]


def turn(surface: Surface, vertex: int, patches: tuple[str, str]) -> float:
    """By how many degrees the tangent turns up from one patch to the other at a junction vertex.

    Positive in a valley, 0 where they join smoothly, negative on a ridge. Balance, Eq. (7), asks
    for 2 arcsin(α_aux / 2 α) between patches of equal α; on a mesh the curvature of the triangles
    beside the vertex takes its part from that.
    """
    one, other = (conormals(surface, patch)[vertex] for patch in patches)
    cosine = -one @ other / np.linalg.norm(one) / np.linalg.norm(other)
    valley = -np.sign((one + other) @ np.array(surface.plane.normal))
    return float(valley * np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def junction_top(surface: Surface) -> int:
    """The highest vertex where three or more sheets meet; of equals the one nearest the middle."""
    junction = np.flatnonzero(surface.topology.on_junction)
    X = surface.vertices[junction]
    across = np.linalg.norm(surface.plane.along(X - X.mean(axis=0)), axis=1)
    return int(junction[np.lexsort((across, -surface.plane.height(X).round(9)))[0]])


def external_area(surface: Surface) -> float:
    """Area of the patches under pressure, length²."""
    return float(patch_areas(surface)[surface.pressures != 0.0].sum())
