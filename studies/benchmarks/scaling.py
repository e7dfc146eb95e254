"""How time and memory grow with the number of triangles, up to ten millions.

Example 1 with a wall tension of 1, from its initial shape to rest, then its certificate; and once more
through one refinement: half the squares a side come to rest, are cut 1→4, and come to rest again. Every run
has a process of its own that has loaded the compiled code before; memory is what comes on top. glibc gives
arrays of more than 32 MB back to the system at once, which then clears their pages for the next: through one
refinement each size runs once more with freed memory kept, as the command keeps it.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pandas as pd

from generators import two_squares
from pcmc import certify, solve
from pcmc.cli import keep_freed_memory
from pcmc.stability.factorisation import installed

from ..folder import Folder
from ..orders import Order, slope
from .timing import Row, peak_bytes

SIDES = (61, 122, 245, 491, 961, 1520)  # squares a side, for 16 000 to 10 000 000 triangles
FEW = (4, 8, 16)  # of the quick form
SLOW_SIDES = SIDES[:3]  # where MKL is not installed
REPEATED = 2_000_000  # triangles up to which there are three runs
AT_REST = 1e-10  # relative residual
GIGABYTES, EXPONENT, GROWTH = 24.0, 1.15, 1.3  # asked; the last of the time per triangle beside a million
COLUMNS = {
    "surface and solution": "solve_seconds",
    "through one refinement": "refined_seconds",
    "the same, memory kept": "kept_seconds",
    "certificate": "certify_seconds",
}
FITTED = (
    "solve_seconds",
    "refined_seconds",
    "kept_seconds",
    "solve_processor_seconds",
    "solve_gigabytes",
    "certify_seconds",
)


def measure(quick: bool) -> pd.DataFrame:
    """A row per size: times and peaks of memory of the solution and of the certificate."""
    fast = installed()[0] == "pardiso"
    sides = FEW if quick else SIDES if fast else SLOW_SIDES
    most = 1 if quick else 3
    return pd.DataFrame([_one_size(side, most) for side in sides])


def _one_size(squares: int, most: int) -> dict[str, float]:
    """A row: medians of ``most`` runs of one size, or of one run where it is large."""
    row = _medians(_run, squares, most) | _medians(_through_refinement, squares, most)
    kept = _medians(_through_refinement, squares, most, keep=True)
    return row | {"kept_seconds": kept["refined_seconds"]}


def _medians(
    run: Callable[[int], dict[str, float]], squares: int, most: int, keep: bool = False
) -> dict[str, float]:
    """Medians of runs of one size; a new process for each, which keeps freed memory where asked."""
    runs = list[dict[str, float]]()
    while not runs or (len(runs) < most and next(iter(runs[0].values())) <= REPEATED):
        with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
            if keep:
                pool.submit(keep_freed_memory).result()
            runs.append(pool.submit(_alone, run, squares).result())
    return {key: float(np.median([each[key] for each in runs])) for key in runs[0]}


def _alone(run: Callable[[int], dict[str, float]], squares: int) -> dict[str, float]:
    """One run, after a small one that loads compiled code; memory over that as well as the whole peak."""
    run(8)
    loaded = peak_bytes() / 1e9
    row = run(squares)
    peaks = [key for key in row if key.endswith("_peak_gigabytes")]
    return row | {key.replace("_peak", ""): row[key] - loaded for key in peaks}


def _through_refinement(squares: int) -> dict[str, float]:
    """A coarse surface built and solved on both levels: triangles of the fine one, seconds, peak."""
    wall = time.perf_counter()
    result = solve(two_squares(squares // 2, alpha_aux=1.0), levels=1, target="stationary", tolerance=AT_REST)
    seconds = time.perf_counter() - wall
    assert result.converged, result.message
    return {
        "refined_triangles": float(result.surface.m),
        "refined_seconds": seconds,
        "refined_residual": float(result.rows[-1]["residual"]),
        "refined_peak_gigabytes": peak_bytes() / 1e9,
    }


def _run(squares: int) -> dict[str, float]:
    """One surface built, solved and certified: seconds of each, peaks so far."""
    wall, processor = time.perf_counter(), time.process_time()
    surface = two_squares(squares, alpha_aux=1.0)
    built = time.perf_counter()
    result = solve(surface, target="stationary", tolerance=AT_REST)
    rested = time.perf_counter()
    row = {
        "triangles": float(surface.m),
        "build_seconds": built - wall,
        "solve_seconds": rested - wall,  # with the surface, from nothing to rest
        "solve_processor_seconds": time.process_time() - processor,
        "steps": float(result.iterations),
        "residual": float(result.rows[-1]["residual"]),
        "solve_peak_gigabytes": peak_bytes() / 1e9,
    }
    assert result.converged, result.message
    reached = result.surface
    del surface, result
    begin = time.perf_counter()
    certificate = certify(reached)
    return row | {
        "certify_seconds": time.perf_counter() - begin,
        "certify_peak_gigabytes": peak_bytes() / 1e9,
        "index": float(-1 if certificate.index is None else certificate.index),
    }


def exponents(table: pd.DataFrame) -> dict[str, Order]:
    """The exponent of each fitted quantity: the slope of its logarithm over that of the triangles."""
    values = {key: table[key].to_numpy(dtype=float) for key in table}
    size = dict.fromkeys(("refined_seconds", "kept_seconds"), values["refined_triangles"])
    return {key: slope(size.get(key, values["triangles"]), values[key]) for key in FITTED}


def rows(table: pd.DataFrame, quick: bool) -> list[Row]:
    """What is asked of the largest size and of the exponents, and the answers."""
    largest = table.iloc[table.triangles.argmax()]
    bound = not quick and installed()[0] == "pardiso"
    size = f"{largest.triangles:,.0f} triangles"
    sizes = f"{len(table)} sizes, {table.triangles.min():,.0f} to {table.triangles.max():,.0f} triangles"
    fitted = {
        key: (order.order, f"{sizes}; standard error {order.standard_error:.2g}")
        for key, order in exponents(table).items()
    }
    most = EXPONENT if bound else None
    growth = _growth(table, "triangles", "solve_seconds")
    refined, kept = (_growth(table, "refined_triangles", f"{way}_seconds") for way in ("refined", "kept"))
    start = f"{size}, {largest.steps:.0f} steps to a relative residual of {largest.residual:.1e}"
    return [
        Row("surface and solution", largest.solve_seconds, "s", start),
        Row("time per triangle", *growth),
        Row(
            "the same through one refinement",
            largest.refined_seconds,
            "s",
            f"{largest.refined_triangles:,.0f} triangles, relative residual {largest.refined_residual:.1e}",
        ),
        Row("time per triangle through one refinement", *refined),
        Row("the same, freed memory kept", largest.kept_seconds, "s", "as the command keeps it"),
        Row("time per triangle, freed memory kept", *kept, most=GROWTH if bound else None),
        Row("of this the surface", largest.build_seconds, "s", size),
        Row("the same, processor", largest.solve_processor_seconds, "s", size),
        Row(
            "peak memory of the solution",
            largest.solve_peak_gigabytes,
            "GB",
            f"{size}, imports included",
            most=GIGABYTES if bound else None,
        ),
        Row("certificate", largest.certify_seconds, "s", f"{size}, index {largest['index']:.0f}"),
        Row(
            "peak memory with certificate",
            largest.certify_peak_gigabytes,
            "GB",
            f"{size}, imports included",
            most=GIGABYTES if bound else None,
        ),
        Row("exponent of time", *_at(fitted["solve_seconds"]), most=most),
        Row("exponent of time through one refinement", *_at(fitted["refined_seconds"])),
        Row("exponent of processor time", *_at(fitted["solve_processor_seconds"])),
        Row("exponent of memory", *_at(fitted["solve_gigabytes"]), most=most),
        Row("exponent of the certificate's time", *_at(fitted["certify_seconds"])),
    ]


def _growth(table: pd.DataFrame, triangles: str, seconds: str) -> tuple[float, str, str]:
    """The time per triangle of the largest size over that of the one next to a million."""
    sizes, each = table[triangles], table[seconds] / table[triangles]
    most, million = sizes.argmax(), (sizes - 1e6).abs().argmin()
    return (
        float(each[most] / each[million]),
        "times",
        f"{sizes[most]:,.0f} triangles over {sizes[million]:,.0f}",
    )


def _at(fitted: tuple[float, str]) -> tuple[float, str, str]:
    return fitted[0], "", fitted[1]


def draw(table: pd.DataFrame, folder: Folder) -> None:
    """Time and memory against triangles, each on its own axes, with their slopes."""
    from matplotlib.ticker import FuncFormatter, NullLocator

    from pcmc.plot.curves import label_axes
    from pcmc.plot.figure import CURVES, INK, SMALL, TEXT, finish, new, style

    picture = new(1300, 560, pad=8.0)
    panels = (
        ("seconds", COLUMNS),
        ("gigabytes", {"memory of the solution": "solve_gigabytes"}),
    )
    size = table.triangles.to_numpy(dtype=float)
    for axes, (unit, columns) in zip(picture.subplots(1, 2), panels, strict=True):
        style(axes)
        axes.set(xscale="log", yscale="log")
        for k, (name, column) in enumerate(columns.items()):
            values = table[column].to_numpy(dtype=float)
            slope, height = np.polyfit(np.log(size), np.log(values), 1)
            color = CURVES[k if unit == "seconds" else 4]
            axes.plot(size, np.exp(height) * size**slope, color=color, linewidth=0.8)
            axes.plot(
                size, values, "o^vs"[k], color=color, markersize=3.2, label=f"{name}: slope {slope:.2f}"
            )
        axes.xaxis.set_ticks(size, [f"{_round(m)}" for m in size])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        label_axes(axes, "triangles", unit)
        axes.legend(fontsize=SMALL, frameon=False, labelcolor=INK)
    picture.suptitle("Example 1 from its initial shape to rest", fontsize=TEXT, color=INK)
    finish(picture, folder.figure("scaling"))


def _round(triangles: float) -> str:
    """A number of triangles in thousands, or in millions, M.

    >>> _round(64496), _round(4001924)
    ('64 000', '4 M')
    """
    return f"{triangles / 1e6:.0f} M" if triangles >= 1e6 else f"{triangles / 1e3:.0f} 000"
