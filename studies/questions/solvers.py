"""The paper's flow, its variants, L-BFGS and the geometric solver side by side, on finer meshes.

What is compared is the force left in the directions that change the shape, ‖Bᵀ∇E‖ over the norm of the
single triangles' forces: 0 at an equilibrium, whatever the triangles look like. ‖∇E‖², which the paper
prints, also holds forces along the surface, which only say how well the triangles are shaped. Sizes are
modest and the flow stops at the paper's 1000 iterations, L-BFGS at 2000 evaluations, so that all of it
takes about a minute. Times are processor times of one thread.

Example 1 has a wall of α 1: with the paper's 2 it is a saddle on fine meshes. The geometric solver has two
targets. "stationary" comes to the nearest equilibrium, a minimum or a saddle, as the flow would from a
symmetric start. "minimum", its default, looks for a minimum below a saddle; in Example 3 it finds none and
returns the saddle under that name.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from generators import bezier_hall, four_fans, two_caps, two_squares
from pcmc import Surface, certify
from pcmc.solvers import solve_once
from pcmc.solvers.result import Progress

from ..examples.flow import NOISE_RESIDUAL, PAPER, SHORT_ITERATIONS, Case, errors, forced_steps, start_of
from ..figure_panels import curve_panels
from ..folder import Folder
from ..study import Study

ITERATIONS, EVALUATIONS = 1000, 2000
SAMPLES = 24  # of each run, evenly on a logarithmic scale
REST = 1e-10  # relative residual below which a run counts as done
ALPHA_AUX = 1.0  # of Example 1's wall
GEOMETRIC = 'geometric solver, target "stationary"'
DEFAULT = 'geometric solver, target "minimum"'


@dataclass(frozen=True)
class Example:
    """An example at several sizes, and the flow's first step t0 that the paper uses for it."""

    name: str
    title: str
    build: Callable[[Any], Surface]
    sizes: Sequence[float]
    t0: float


EXAMPLES = (
    Example("example1", "Example 1", partial(two_squares, alpha_aux=ALPHA_AUX), (4, 8, 16, 32), 0.005),
    Example("example2", "Example 2", two_caps, (1.2, 0.8, 0.6, 0.4), 0.01),
    Example("example3", "Example 3", four_fans, (7, 10, 14, 28), 0.01),
    Example("example4", "Example 4", bezier_hall, (10.0, 7.0, 5.0, 3.6), 0.005),
)
FLOW: dict[str, Any] = {**PAPER, "tolerance": None, "iterations": ITERATIONS}
METHODS: dict[str, tuple[str, dict[str, Any]]] = {
    "the paper's flow": ("nesterov", FLOW),
    "without momentum": ("nesterov", FLOW | {"momentum": False}),
    "without line search": ("nesterov", FLOW | {"line_search": False}),
    "with sufficient decrease": ("nesterov", FLOW | {"armijo": "sufficient"}),
    "L-BFGS": ("lbfgs", {"tolerance": None, "evaluations": EVALUATIONS}),
    GEOMETRIC: ("newton", {"target": "stationary"}),
    DEFAULT: ("newton", {"target": "minimum"}),
}


class Samples:
    """A callback that keeps the surface after each of some iterations, and when that was.

    Its own time is not counted.
    """

    def __init__(self, limit: int) -> None:
        chosen = np.unique(np.geomspace(1, limit, SAMPLES).round().astype(int))
        self.wanted = {0, *chosen.tolist()}
        self.rows: list[tuple[int, int, float, Surface]] = []
        self.begin, self.own = time.process_time(), 0.0

    def __call__(self, progress: Progress) -> None:
        if progress.iteration in self.wanted:
            now = time.process_time()
            evaluation = int(progress.row["evaluation"])
            self.rows.append(
                (progress.iteration, evaluation, now - self.begin - self.own, progress.surface())
            )
            self.own += time.process_time() - now


def data(folder: Folder, short: bool) -> None:
    """``records`` and ``histories``; what depends on the machine is in ``times``, ``history_times``."""
    records, histories, times, clocks = [], [], [], []
    for label in METHODS:  # loads compiled code, so that no run is timed with it
        _run(two_squares(3, alpha_aux=ALPHA_AUX), label, 0.005, short=True)
    for example in EXAMPLES:
        for size in example.sizes[: 1 if short else None]:
            # rounded: a run that does not converge amplifies the last digit of its start
            start = start_of(Case(example.name, partial(example.build, size), {}))
            for label in METHODS:
                case = {"example": example.name, "size": size, "triangles": start.m, "method": label}
                record, history, seconds = _run(start, label, example.t0, short)
                records.append(case | record)
                times.append(case | {"seconds": seconds})
                named = pd.DataFrame([case] * len(history))
                clocks.append(named.assign(seconds=history.seconds.to_numpy()))
                numbers = history.drop(columns="seconds").reset_index(drop=True)
                histories.append(pd.concat([named, numbers], axis=1))
    folder.write_table("records", pd.DataFrame(records))
    folder.write_table("histories", pd.concat(histories, ignore_index=True))
    folder.write_table("times", pd.DataFrame(times))
    folder.write_table("history_times", pd.concat(clocks, ignore_index=True))


def _run(start: Surface, label: str, t0: float, short: bool) -> tuple[dict[str, Any], pd.DataFrame, float]:
    """How a run ended, samples of its way, and its processor time."""
    method, options = METHODS[label]
    options: dict[str, Any] = options | ({"t0": t0} if method == "nesterov" else {})
    limit = {"nesterov": "iterations", "lbfgs": "evaluations"}.get(method)
    if short and limit:
        options |= {limit: SHORT_ITERATIONS}
    samples = Samples(options[limit] if limit else 200)
    result = solve_once(start, method, samples, **options)
    seconds = time.process_time() - samples.begin - samples.own
    final = result.surface
    found = result.certify(modes=0)
    history = pd.DataFrame(
        [(i, e, t, certify(surface, modes=0).residual) for i, e, t, surface in samples.rows]
        + [(result.iterations, result.evaluations, seconds, found.residual)],
        columns=["iteration", "evaluation", "seconds", "residual"],
    ).drop_duplicates("evaluation", keep="last")
    record = {
        "status": result.status.name.lower(),
        "verdict": found.verdict.name.lower(),
        "detail": found.detail,
        "iterations": result.iterations,
        "evaluations": result.evaluations,
        "factorisations": int(result.history.get("factorisation", pd.Series([0])).iloc[-1]),
        "forced_steps": forced_steps(result.history),
        "residual": float(np.maximum(found.residual, NOISE_RESIDUAL)),
        "gradient_squared": float(result.history.gradient_squared.iloc[-1]),
        "energy": result.energy,
        **errors(final),
        "quality": found.quality,
        "walls_quality": found.walls_quality,
    }
    return record, history, seconds


def _counts(words: pd.Series[str]) -> str:
    """Of each word how many there are, the most frequent first."""
    return ", ".join(f"{n} {word}".replace("_", " ") for word, n in words.value_counts().items())


def table(folder: Folder) -> dict[str, float]:
    """``summary``: of each method, how many runs came to rest, as what, and the worst triangles."""
    records = folder.read_table("records")
    records["at_rest"] = records.residual <= REST
    groups = records.groupby("method", sort=False)
    summary = pd.DataFrame(
        {
            "runs": groups.size(),
            "at_rest": groups.at_rest.sum(),
            "stable": groups.verdict.agg(lambda v: (v == "stable").sum()),
            "saddles": groups.verdict.agg(lambda v: (v == "saddle").sum()),
            "verdicts": groups.verdict.agg(_counts),
            "largest_residual": groups.residual.max(),
            "median_residual": groups.residual.median(),
            "worst_quality": groups.quality.min(),
            "median_largest_error_cotangent": groups.largest_error_cotangent.median(),
            "median_largest_error_variational": groups.largest_error_variational.median(),
            "median_evaluations": groups.evaluations.median(),
            "most_factorisations": groups.factorisations.max(),
        }
    ).reset_index()
    folder.write_table("summary", summary)
    found = {
        "meshes": float(records.groupby("example").triangles.nunique().max()),
        "examples": float(records.example.nunique()),
        "wall_of_example1": ALPHA_AUX,
        "examples_with_saddles": float(records.example[records.verdict == "saddle"].nunique()),
    }
    for key, label in (
        ("flow", "the paper's flow"),
        ("lbfgs", "L-BFGS"),
        ("newton", GEOMETRIC),
        ("newton_minimum", DEFAULT),
    ):
        (row,) = summary[summary.method == label].to_dict("records")
        for column in ("runs", "at_rest", "stable", "saddles", "largest_residual", "worst_quality"):
            found[f"{column}_{key}"] = float(row[column])
    return found


def figure(folder: Folder) -> None:
    """Residual against evaluations and against time, a row of panels for each example."""
    seconds = folder.read_table("history_times").seconds
    frame = folder.read_table("histories").assign(seconds=seconds)
    for name, column, label in (
        ("evaluations", "evaluation", "evaluations of E and ∇E"),
        ("time", "seconds", "processor time, s"),
    ):
        panels = {
            f"{example.title}, {mine.triangles.iloc[0]} triangles": _curves(mine, column)
            for example in EXAMPLES
            for _, mine in frame[frame.example == example.name].groupby("triangles")
        }
        columns = max(1, frame.groupby("example").triangles.nunique().max())
        curve_panels(
            panels,
            folder.figure(f"residual-{name}"),
            columns=int(columns),
            xlabel=label,
            ylabel="relative residual",
        )


def _curves(mine: pd.DataFrame, column: str) -> Mapping[str, tuple[Any, Any]]:
    """By method; the residual is drawn no lower than where rounding sets in."""
    return {
        str(label): (one[column].clip(lower=1e-4), one.residual.clip(lower=1e-15))
        for label, one in mine.groupby("method", sort=False)
    }


STUDY = Study(
    "solvers",
    "the paper's flow, its variants, L-BFGS and the geometric solver on Examples 1 to 4",
    data,
    table,
    figure,
    parameters={
        "sizes": {example.name: list(example.sizes) for example in EXAMPLES},
        "iterations": ITERATIONS,
        "evaluations": EVALUATIONS,
        "alpha_aux_example1": ALPHA_AUX,
    },
    seconds=60,
    paper=False,
    timed=True,
)
