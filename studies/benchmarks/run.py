"""How fast everything is on this machine: the compiled loops here, solver and sweeps beside.

Each function of ``BENCHMARKS`` returns rows, of small cases if asked to be quick; a new benchmark is a
new function and its name there.
"""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table

from generators import two_squares
from pcmc import Surface
from pcmc.base.arrays import Floats
from pcmc.base.errors import OptionError, unknown
from pcmc.forces.functional import energy_and_gradient

from ..folder import Folder, write_json
from . import scaling
from .command import COMMAND
from .explore import EXPLORE
from .height import HEIGHT
from .solver import SOLVER
from .sweep import SWEEP
from .timing import Row, median_seconds

SQUARES, FEW = 255, 64  # a side: 260 100 triangles in the two patches, or 16 384
REPEATS = 15
COLUMNS = ("what", "median", "unit", "asked", "met", "remark")


def energy_rate(quick: bool) -> list[Row]:
    """Triangles per second of energy and gradient together, on one and on two threads."""
    surface = two_squares(FEW if quick else SQUARES, alpha_aux=1.0)
    expected = numpy_energy_and_gradient(surface)
    rows, seconds = [], {}
    for workers in (1, 2):
        found = energy_and_gradient(surface, workers=workers)
        assert np.isclose(found[0], expected[0], rtol=1e-12)
        assert np.allclose(found[1], expected[1], atol=1e-12)
        seconds[workers] = median_seconds(partial(energy_and_gradient, surface, workers=workers), REPEATS)
        rows.append(_rate(f"energy and gradient, {workers} thread(s)", surface, seconds[workers]))
    slow = median_seconds(partial(numpy_energy_and_gradient, surface), repeats=5)
    rows.append(_rate("the same in vectorised numpy", surface, slow))
    rows.append(Row("two threads over one", seconds[1] / seconds[2], "times"))
    rows.append(Row("one thread over numpy", slow / seconds[1], "times"))
    return rows


BENCHMARKS: list[Callable[[bool], list[Row]]] = [energy_rate, *SOLVER, *HEIGHT, *SWEEP, *EXPLORE, *COMMAND]
GROWTH = "growth of cost"
NAMES = (*(each.__name__.replace("_", " ") for each in BENCHMARKS), GROWTH)


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


def main(results: Path, quick: bool = False, only: Sequence[str] = ()) -> int:
    """Print every benchmark's rows and write them to ``results / "benchmark"``; 1 if one is missed.

    ``only`` names some benchmarks: their rows take the place of those in the table.
    """
    console = Console(width=None if sys.stdout.isatty() else 140)
    console.print(f"{machine()}; wall time, medians of repeats")
    folder, name = Folder(results / "benchmark"), "quick" if quick else "full"
    rows = []
    for title in only or NAMES:
        if title not in NAMES:
            raise OptionError(
                unknown("benchmark", title, NAMES), what="benchmark", found=title, expected=NAMES
            )
        benchmark = partial(growth, folder) if title == GROWTH else BENCHMARKS[NAMES.index(title)]
        found = benchmark(quick)
        shown = Table(*COLUMNS, title=title)
        for row in found:
            shown.add_row(row.what, f"{row.value:.4g}", row.unit, row.asked, row.met, row.remark)
        console.print(shown)
        rows += [[row.what, row.value, row.unit, row.asked, row.met, row.remark] for row in found]
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    if only:
        table = renewed(folder.read_table(name), table)
    folder.write_table(name, table)
    write_json(folder.path / f"{name}.json", {"machine": machine()} | ({"only": list(only)} if only else {}))
    return int((table["met"] == "no").any())


def renewed(table: pd.DataFrame, found: pd.DataFrame) -> pd.DataFrame:
    """The table with the rows found in place of those of the same names; rows of new names go beside them.

    >>> old = pd.DataFrame({"what": ["a", "b", "c"], "median": [1, 2, 3]})
    >>> renewed(old, pd.DataFrame({"what": ["b", "b2"], "median": [4, 5]})).what.tolist()
    ['a', 'b', 'b2', 'c']
    """
    old = table["what"].isin(found["what"]).to_numpy()
    place = int(old.argmax()) if old.any() else len(table)
    rest = table[~old]
    before = place - int(old[:place].sum())
    return pd.concat([rest[:before], found, rest[before:]], ignore_index=True)


def growth(folder: Folder, quick: bool) -> list[Row]:
    """How time and memory grow with the triangles; also a table and a figure of their own."""
    table = scaling.measure(quick)
    folder.write_table("quick-scaling" if quick else "scaling", table)
    if not quick:
        scaling.draw(table, folder)
    return scaling.rows(table, quick)


def machine() -> str:
    """Processor, how many, and how busy they are: what times depend on."""
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    name = platform.machine()
    try:
        with open("/proc/cpuinfo") as file:
            name = next(line.split(":")[1].strip() for line in file if "model name" in line)
    except (OSError, StopIteration):
        pass
    return f"{os.cpu_count()} × {name}{load}"


def _rate(what: str, surface: Surface, seconds: float) -> Row:
    remark = f"{surface.m:,} triangles, {1e3 * seconds:.2f} ms"
    return Row(what, surface.m / seconds / 1e6, "million triangles/s", remark)
