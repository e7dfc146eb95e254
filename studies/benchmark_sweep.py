"""How fast sweeps are: the grid of Fig. 16 on one and on two workers, and by the geometric solver.

Wall time of whole sweeps, with the start of the workers and a store on the disk.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from pcmc.sweep import Sweep, run

from .alpha_grid import ITERATIONS, TENSIONS, flow_sweep
from .alpha_grid_geometric import geometric_sweep
from .timing import Row, median

FEW, SHORT = TENSIONS[::3], 10  # tensions and iterations of the quick form
REPEATS = 3


def sweeps(quick: bool) -> list[Row]:
    """The paper's flow over its grid on one and on two workers; the geometric solver on two."""
    tensions = FEW if quick else TENSIONS
    flow = flow_sweep(SHORT if quick else ITERATIONS, tensions)
    times: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(1 if quick else REPEATS):
        for workers in times:  # in turn, so that a change of the machine's load meets both
            times[workers].append(sweep_seconds(flow, workers))
    size = f"{len(flow)} cases, {flow.fixed['iterations']} iterations each"
    seconds = {workers: median(found) for workers, found in times.items()}
    geometric = geometric_sweep(tensions)
    return [
        Row("grid of Fig. 16, 1 worker", seconds[1], "s", size),
        Row("grid of Fig. 16, 2 workers", seconds[2], "s", size, most=None if quick else 60.0),
        Row("2 workers over 1", seconds[1] / seconds[2], "times", size,
            least=None if quick else 1.7),
        Row("the same grid by the geometric solver, 2 workers", sweep_seconds(geometric, 2), "s",
            f"{len(geometric)} cases", most=None if quick else 300.0),
    ]  # fmt: skip


def sweep_seconds(sweep: Sweep, workers: int) -> float:
    """Wall time of a sweep into a new store."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        table = run(sweep, Path(folder) / "cases.jsonl", workers=workers)
        seconds = time.perf_counter() - start
    assert len(table) == len(sweep)
    assert not table.status.isin(["raised", "timed out", "killed"]).any()
    return seconds


SWEEP: list[Callable[[bool], list[Row]]] = [sweeps]
