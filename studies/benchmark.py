"""How fast the compiled loops are on this machine, with vectorised numpy beside them.

Each function of ``BENCHMARKS`` returns rows; a new benchmark is a new function and its name there.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from rich.console import Console
from rich.table import Table

from generators import two_squares
from pcmc import Surface
from pcmc.arrays import Floats
from pcmc.energy import energy_and_gradient

SQUARES = 255  # a side: 260 100 triangles in the two patches
REPEATS = 15


@dataclass(frozen=True)
class Row:
    """One line: what was measured, the median of its repeats, and a remark."""

    what: str
    value: float
    unit: str
    remark: str = ""


def energy_rate() -> list[Row]:
    """Triangles per second of energy and gradient together, on one and on two threads."""
    surface = two_squares(SQUARES, alpha_aux=1.0)
    expected = numpy_energy_and_gradient(surface)
    rows, seconds = [], {}
    for workers in (1, 2):
        found = energy_and_gradient(surface, workers=workers)
        assert np.isclose(found[0], expected[0], rtol=1e-12)
        assert np.allclose(found[1], expected[1], atol=1e-12)
        seconds[workers] = median_seconds(partial(energy_and_gradient, surface, workers=workers))
        rows.append(_rate(f"energy and gradient, {workers} thread(s)", surface, seconds[workers]))
    slow = median_seconds(partial(numpy_energy_and_gradient, surface), repeats=5)
    rows.append(_rate("the same in vectorised numpy", surface, slow))
    rows.append(Row("two threads over one", seconds[1] / seconds[2], "times"))
    rows.append(Row("one thread over numpy", slow / seconds[1], "times"))
    return rows


BENCHMARKS: list[Callable[[], list[Row]]] = [energy_rate]


def numpy_energy_and_gradient(surface: Surface) -> tuple[float, Floats]:
    """E and ∇E with the supports applied, in numpy alone: the yardstick, Eqs. (9) to (17)."""
    X = surface.vertices - np.array(surface.plane.point)
    p, q, r = (X[surface.faces[:, k]] for k in range(3))
    cross = np.cross(q - p, r - p)
    length = np.linalg.norm(cross, axis=1)
    normal = cross / length[:, None]
    tension = surface.tensions[surface.patch_of_face]
    pressure = surface.pressures[surface.patch_of_face]
    volume = np.einsum("ij,ij->i", p, np.cross(q, r)) / 6.0
    energy = float(0.5 * tension @ length - pressure @ volume)
    gradient = np.zeros_like(X)
    for corner, (start, end) in enumerate(((q, r), (r, p), (p, q))):
        force = 0.5 * tension[:, None] * np.cross(normal, end - start)
        force -= pressure[:, None] / 6.0 * np.cross(start, end)
        for axis in range(3):
            gradient[:, axis] += np.bincount(
                surface.faces[:, corner], weights=force[:, axis], minlength=surface.n
            )
    gradient[surface.fixed] = 0.0
    gradient[surface.on_plane] = surface.plane.along(gradient[surface.on_plane])
    return energy, gradient


def median_seconds(call: Callable[[], object], repeats: int = REPEATS) -> float:
    """Median wall time of a call, after one that is not counted."""
    call()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def main() -> int:
    """Print every benchmark's rows."""
    console = Console(width=None if sys.stdout.isatty() else 120)
    table = Table("what", "median", "unit", "remark")
    for benchmark in BENCHMARKS:
        for row in benchmark():
            table.add_row(row.what, f"{row.value:.4g}", row.unit, row.remark)
    console.print(table)
    console.print(f"{os.cpu_count()} processors; wall time, medians of repeats")
    return 0


def _rate(what: str, surface: Surface, seconds: float) -> Row:
    remark = f"{surface.m:,} triangles, {1e3 * seconds:.2f} ms"
    return Row(what, surface.m / seconds / 1e6, "million triangles/s", remark)
