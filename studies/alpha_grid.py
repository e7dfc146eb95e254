"""Fig. 16: ‖∇E‖² after 200 iterations of the paper's flow over the three tensions of Example 2."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from generators import two_caps
from pcmc import solve

from .flow import PAPER, SHORT_ITERATIONS, forced_steps
from .folder import Folder
from .study import Study

TENSIONS = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0)
ITERATIONS, T0, EDGE_LENGTH = 200, 0.01, 1.2
FAILED = ("diverged", "non_finite")


def data(folder: Folder, short: bool) -> None:
    """One record for each triple of tensions."""
    start = two_caps(EDGE_LENGTH)
    options: dict[str, Any] = {**PAPER, "t0": T0, "tolerance": None}
    options["iterations"] = SHORT_ITERATIONS if short else ITERATIONS
    rows = []
    for wall, large, small in product(TENSIONS, TENSIONS, TENSIONS):
        surface = start.retensioned({"wall": wall, "large": large, "small": small})
        result = solve(surface, "nesterov", **options)
        rows.append(
            {
                "alpha_wall": wall,
                "alpha_large": large,
                "alpha_small": small,
                "status": result.status.name.lower(),
                "iterations": result.iterations,
                "gradient_squared": float(result.history.gradient_squared.iloc[-1]),
                "energy": result.energy,
                "forced_steps": forced_steps(result.history),
            }
        )
    folder.write_table("records", pd.DataFrame(rows))


def table(folder: Folder) -> dict[str, float]:
    """``by_wall`` and ``by_ratio``: how often it diverged, the median of the measure elsewhere."""
    records = folder.read_table("records")
    records["failed"] = records.status.isin(FAILED)
    records["log"] = np.log10(records.gradient_squared.where(~records.failed))
    records["ratio"] = records.alpha_small / records.alpha_large
    by_wall = _summary(records, "alpha_wall")
    sound = records[(records.alpha_large >= 4.0) & (records.alpha_small >= 4.0)]
    by_ratio = _summary(sound, "ratio")
    folder.write_table("by_wall", by_wall)
    folder.write_table("by_ratio", by_ratio)
    ratio = by_ratio.set_index("ratio").median_log
    low = records[(records.alpha_large <= 2.0) | (records.alpha_small <= 1.0)]
    high = records.drop(low.index)
    return {
        "cases": len(records),
        "wall_small": by_wall.median_log.iloc[0],
        "wall_large": by_wall.median_log.iloc[-1],
        "small_slightly_smaller": ratio[0.5],
        "equal": ratio[1.0],
        "small_slightly_larger": ratio[2.0],
        "too_different": float(ratio[[0.25, 4.0]].mean()),
        "alike": float(ratio[[0.5, 1.0, 2.0]].mean()),
        "failed_low": float(low.failed.mean()),
        "failed_high": float(high.failed.mean()),
    }


def _summary(records: pd.DataFrame, by: str) -> pd.DataFrame:
    groups = records.groupby(by)
    summary = {
        "cases": groups.size(),
        "failed": groups.failed.sum(),
        "median_log": groups.log.median(),
    }
    return pd.DataFrame(summary).reset_index()


def figure(folder: Folder) -> None:
    """Fig. 16: a panel for each wall tension, colour the measure's logarithm, × where it failed."""


STUDY = Study(
    "alpha_grid",
    "Fig. 16 on a first grid: where the flow converges over the three tensions of Example 2",
    data,
    table,
    figure,
    parameters={"tensions": TENSIONS, "iterations": ITERATIONS, "edge_length": EDGE_LENGTH},
    seconds=20,
)
