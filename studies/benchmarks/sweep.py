"""How fast sweeps are: the grid of Fig. 16 on one and on two workers, and by the geometric solver.

Wall time of whole sweeps, with the start of the workers and a store on the disk.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from pcmc.sweep import Sweep, run

from ..alpha_grid.geometric import geometric_sweep
from ..alpha_grid.grid import ITERATIONS, TENSIONS, flow_sweep
from .timing import Row, median

FEW, SHORT = TENSIONS[::4], 10  # tensions and iterations of the quick form
REPEATS = 5  # of the flow's sweeps, which take seconds; the geometric solver's are run once
RATIO = 1.7


def sweeps(quick: bool) -> list[Row]:
    """The paper's flow over its grid and the geometric solver over the same, on one and two workers.

    The start of the workers counts in both times, so a short sweep gains less by the second.
    """
    with tempfile.TemporaryDirectory() as folder:
        return _rows(Path(folder) / "mesh", quick)


def _rows(mesh: Path, quick: bool) -> list[Row]:
    tensions = FEW if quick else TENSIONS
    flow = flow_sweep(mesh, SHORT if quick else ITERATIONS, tensions)
    geometric = geometric_sweep(tensions)
    rows = []
    for what, sweep, repeats, most in (
        ("grid of Fig. 16", flow, REPEATS, 60.0),
        ("the same by the geometric solver", geometric, 1, 300.0),
    ):
        one, two = alternating(sweep, 1 if quick else repeats)
        size = f"{len(sweep)} cases"
        rows += [
            Row(f"{what}, 1 worker", one, "s", size),
            Row(f"{what}, 2 workers", two, "s", size, most=None if quick else most),
            Row(f"{what}, 2 workers over 1", one / two, "times", size, least=None if quick else RATIO),
        ]
    start = sweep_seconds(flow_sweep(mesh, 1, tensions[:1]), 1)
    return [*rows, Row("start of a worker, with a case of one iteration", start, "s")]


def alternating(sweep: Sweep, repeats: int) -> tuple[float, float]:
    """Median seconds on one and on two workers, in turn, so that the machine's load affects both."""
    times = [[sweep_seconds(sweep, workers) for workers in (1, 2)] for _ in range(repeats)]
    return median(one for one, _ in times), median(two for _, two in times)


def sweep_seconds(sweep: Sweep, workers: int) -> float:
    """Wall time of a sweep into a new store."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        table = run(sweep, Path(folder) / "cases.sqlite", workers=workers)
        seconds = time.perf_counter() - start
    assert len(table) == len(sweep)
    assert not table.status.isin(["raised", "timed out", "killed"]).any()
    return seconds


SWEEP: list[Callable[[bool], list[Row]]] = [sweeps]
