"""Fig. 16: ‖∇E‖² after 200 iterations of the paper's flow over the three tensions of Example 2."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from generators import two_caps
from pcmc.sweep import Sweep

from ..cases import run_sweep
from ..examples.flow import SHORT_ITERATIONS
from ..examples.flow_case import flow_case
from ..folder import Folder, write_bytes
from ..study import Study

TENSIONS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 12.0, 16.0)
ITERATIONS, EDGE_LENGTH = 200, 1.2
CONVERGED = 1.0  # ‖∇E‖² after 200 iterations below which a case counts as well converged
FAILED = ("diverged", "non_finite")
AXES = ("alpha_wall", "alpha_large", "alpha_small")


def flow_grid(folder: Folder, short: bool) -> pd.DataFrame:
    """A row for each triple of tensions, and their times in ``records_times``."""
    columns = ["status", "iterations_taken", "gradient_squared", "energy", "forced_steps"]
    mesh = folder.path / "build" / "initial.pickle"
    sweep = flow_sweep(mesh, SHORT_ITERATIONS if short else ITERATIONS, TENSIONS)
    return run_sweep(folder, "records", sweep, scratch=[mesh])[[*AXES, *columns]]


def flow_sweep(mesh: Path, iterations: int, tensions: Sequence[float]) -> Sweep:
    """The paper's flow at each triple of some tensions, from Example 2's initial shape."""
    write_bytes(mesh, pickle.dumps(two_caps(EDGE_LENGTH)))
    return Sweep(flow_case, dict.fromkeys(AXES, tensions), {"mesh": str(mesh), "iterations": iterations})


def data(folder: Folder, short: bool) -> None:
    """The paper's measure for each triple of tensions."""
    folder.write_table("records", flow_grid(folder, short))


def table(folder: Folder) -> dict[str, float]:
    """``by_wall`` and ``by_ratio``: how many cases converged or failed, the measure's median."""
    records = folder.read_table("records")
    records["failed"] = records.status.isin(FAILED)
    records["converged"] = ~records.failed & (records.gradient_squared < CONVERGED)
    records["log"] = np.log10(records.gradient_squared.where(~records.failed))
    records["ratio"] = (records.alpha_small / records.alpha_large).round(6)
    folder.write_table("by_wall", _summary(records, "alpha_wall"))
    folder.write_table("by_ratio", _summary(records, "ratio"))
    ratio, wall = records.ratio, records.alpha_wall
    classes = {
        "equal": ratio == 1.0,
        "slightly_smaller": (ratio >= 0.6) & (ratio < 1.0),
        "slightly_larger": (ratio > 1.0) & (ratio <= 1.7),
        "alike": (ratio >= 0.6) & (ratio <= 1.7),
        "too_different": (ratio < 0.6) | (ratio > 1.7),
        "wall_small": wall <= 2.0,
        "wall_large": wall >= 8.0,
    }
    classes |= {f"{name}_at_4": classes[name] & (wall == 4.0) for name in ("equal", "slightly_smaller")}
    measured = {name: float(records.converged[mask].mean()) for name, mask in classes.items()}
    low = (records.alpha_large <= 2.0) | (records.alpha_small <= 2.0)
    return measured | {
        "cases": len(records),
        "iterations": records.iterations_taken.max(),
        "converged": float(records.converged.sum()),
        "failed_low": float(records.failed[low].mean()),
        "failed_high": float(records.failed[~low].mean()),
    }


def _summary(records: pd.DataFrame, by: str) -> pd.DataFrame:
    groups = records.groupby(by)
    summary = {
        "cases": groups.size(),
        "converged": groups.converged.sum(),
        "failed": groups.failed.sum(),
        "median_log": groups.log.median(),
    }
    return pd.DataFrame(summary).reset_index()


def figure(folder: Folder) -> None:
    """Fig. 16: a panel for each wall tension, colour the measure's logarithm, × where it failed."""
    from pcmc.plot import heatmap

    records = folder.read_table("records")
    records["failed"] = records.status.isin(FAILED)
    values, marks = {}, {}
    for wall, mine in records.groupby("alpha_wall"):
        table = mine.pivot(index="alpha_small", columns="alpha_large")
        failed = table.failed.to_numpy().astype(bool)
        name = f"α of the wall = {wall:g}"
        values[name] = np.where(failed, np.nan, table.gradient_squared.to_numpy())
        marks[name] = failed
    heatmap(
        TENSIONS,
        TENSIONS,
        values,
        folder.figure("fig16"),
        marks=marks,
        log=True,
        xlabel="α of the larger patch",
        ylabel="α of the smaller patch",
        columns=5,
        label=f"‖∇E‖² after {ITERATIONS} iterations; × diverged",
    )


STUDY = Study(
    "alpha_grid",
    "Fig. 16: where the flow converges over the three tensions of Example 2, 1000 cases",
    data,
    table,
    figure,
    parameters={"tensions": TENSIONS, "iterations": ITERATIONS, "edge_length": EDGE_LENGTH},
    seconds=20,
)
