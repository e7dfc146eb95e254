"""Curves and tables as pictures."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..base.arrays import Floats
from ..base.errors import OptionError, unknown
from .figure import CURVES, INK, SMALL, TEXT, Image, apart, finish, new, style

if TYPE_CHECKING:
    import pandas as pd

Path = str | os.PathLike[str]
SCALES = ("linear", "log")
MARKERS = "osD^vPX"
MOST = 6  # names in a legend inside the axes


def lines(
    curves: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]],
    path: Path | None = None,
    *,
    x: str = "",
    y: str = "",
    title: str = "",
    xscale: str = "linear",
    yscale: str = "linear",
    markers: bool = False,
    dashes: bool = False,
    levels: Mapping[str, float] | None = None,
    width: int = 900,
    height: int = 560,
) -> Image:
    """Curves y(x) by label, each a pair of arrays; values that are not finite leave a gap.

    On a "log" axis values ≤ 0 leave a gap too. ``x``, ``y`` are the axes' labels. ``dashes`` draws
    curves which lie on each other so that all are seen; ``levels`` are values of y by label, such as
    bounds, drawn across.
    """
    for scale in (xscale, yscale):
        if scale not in SCALES:
            raise OptionError(unknown("scale", scale, SCALES))
    figure, axes = _axes(width, height, title, x, y)
    axes.set_xscale(xscale)
    axes.set_yscale(yscale)
    for k, (label, (xs, ys)) in enumerate(curves.items()):
        px, py = _curve(label, xs, ys, xscale, yscale)
        turn = k // len(CURVES)  # how often the colours have been gone through
        look = (
            apart(k, len(curves))
            if dashes
            else {"linewidth": 1.1, "linestyle": ("-", "--")[turn % 2]}
        )
        marker = MARKERS[(k + turn) % len(MARKERS)] if markers else None
        axes.plot(px, py, color=CURVES[k % len(CURVES)], marker=marker, markersize=2.8, label=label,
                  **look)  # fmt: skip
    for label, level in (levels or {}).items():
        axes.axhline(
            level, color=INK, linewidth=0.9, linestyle=(0, (5, 3)), label=label, zorder=1.5
        )
    if xscale == "log":
        _plain_ticks(axes.xaxis)
    _key(axes, len(curves) + len(levels or {}))
    return finish(figure, path)


def _plain_ticks(axis: Any) -> None:
    """On a logarithmic axis shorter than a decade and a half: round numbers, written out."""
    low, high = axis.get_view_interval()
    if not 0.0 < low < high < 30.0 * low:
        return
    decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.log10(high))
    steps = (1, 1.5, 2, 3, 4, 5, 6, 8) if high < 5.0 * low else (1, 2, 3, 5)
    ticks = [step * decade for decade in decades for step in steps]
    ticks = [tick for tick in ticks if low <= tick <= high]
    axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_ticks([], minor=True)


def histories(
    frames: Mapping[str, pd.DataFrame],
    path: Path | None = None,
    *,
    y: str = "energy",
    x: str | None = None,
    label: str = "",
    title: str = "",
    yscale: str | None = None,
    dashes: bool = False,
    width: int = 900,
    height: int = 560,
) -> Image:
    """Histories of solves by label, one column against another.

    ``y`` is a column of each frame ("energy", "gradient_squared", ...); ``x`` another one, or the
    row number (iteration) when None. The scale is logarithmic unless y has values ≤ 0 or is the
    energy. ``dashes`` as in ``lines``.
    """
    curves = {}
    for name, frame in frames.items():
        for column in (y, x):
            if column is not None and column not in frame.columns:
                raise OptionError(f"history {name!r}: {unknown('column', column, frame.columns)}")
        xs = np.arange(len(frame)) if x is None else frame[x].to_numpy()
        curves[name] = (xs, frame[y].to_numpy())
    positive = all((np.asarray(v)[np.isfinite(v)] > 0.0).all() for _, v in curves.values())
    return lines(
        curves, path, x=(x or "iteration").replace("_", " "), y=label or y.replace("_", " "),
        title=title, yscale=yscale or ("log" if positive and y != "energy" else "linear"),
        dashes=dashes, width=width, height=height,
    )  # fmt: skip


def convergence(
    curves: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]],
    path: Path | None = None,
    *,
    x: str = "edge length",
    y: str = "error",
    title: str = "",
    fit: bool = True,
    width: int = 900,
    height: int = 640,
) -> Image:
    """Errors against edge lengths on logarithmic axes, with the least-squares slope of each."""
    figure, axes = _axes(width, height, title, x, y)
    axes.set_xscale("log")
    axes.set_yscale("log")
    for k, (name, (xs, ys)) in enumerate(curves.items()):
        color, label = CURVES[k % len(CURVES)], name
        px, py = _curve(name, xs, ys, "log", "log")
        known = np.isfinite(py)
        if fit and np.count_nonzero(known) >= 2:
            slope, height_at_1 = np.polyfit(np.log(px[known]), np.log(py[known]), 1)
            ends = np.array([px[known].min(), px[known].max()])
            axes.plot(ends, np.exp(height_at_1) * ends**slope, color=color, linewidth=0.8)
            label = f"{name}: slope {slope:.2f}"
        axes.plot(px, py, color=color, linestyle="none", marker=MARKERS[k % len(MARKERS)],
                  markersize=3.2, label=label)  # fmt: skip
    every = np.unique(np.concatenate([np.asarray(xs, dtype=float) for xs, _ in curves.values()]))
    every = every[np.isfinite(every) & (every > 0.0)]
    if len(every) <= 8:
        axes.xaxis.set_ticks(every, [f"{v:.3g}" for v in every])
        axes.xaxis.set_ticks([], minor=True)
    _key(axes, len(curves))
    return finish(figure, path)


def heatmap(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    tables: Mapping[str, npt.ArrayLike],
    path: Path | None = None,
    *,
    marks: Mapping[str, npt.ArrayLike] | None = None,
    xlabel: str = "",
    ylabel: str = "",
    label: str = "",
    log: bool = False,
    limits: tuple[float, float] | None = None,
    cmap: str = "viridis",
    columns: int = 4,
    width: int = 1200,
) -> Image:
    """Tables of numbers (len(y), len(x)) as coloured squares, a panel per title, one colour scale.

    ``marks`` are (len(y), len(x)) bools per title: an × in these squares (the paper's "diverged" in
    Fig. 16). Values that are not finite, or ≤ 0 when ``log``, stay grey.
    """
    xs, ys = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    shape = (len(ys), len(xs))
    data = {k: _table(f"tables[{k!r}]", v, shape).astype(float) for k, v in tables.items()}
    if not data:
        raise OptionError("heatmap: expected at least one table, found none")
    for name, v in data.items():
        data[name] = np.where(np.isfinite(v) & ((v > 0.0) | (not log)), v, np.nan)
    crosses = {k: _table(f"marks[{k!r}]", v, shape) for k, v in (marks or {}).items()}
    for name in crosses:
        if name not in data:
            raise OptionError(unknown("table", name, data))
    columns = min(columns, len(data))
    rows = -(-len(data) // columns)
    side = (width - 70.0) / columns - 24.0
    tall = side * shape[0] / shape[1]
    total = rows * (tall + 46.0) + 140.0
    figure = new(width, total)
    norm = _norm(np.concatenate([v.ravel() for v in data.values()]), log, limits)
    image = None
    for k, (title, table) in enumerate(data.items()):
        row, column = divmod(k, columns)
        left, top = 70.0 + column * (side + 24.0), 34.0 + row * (tall + 46.0)
        axes = figure.add_axes((left / width, 1 - (top + tall) / total, side / width, tall / total))
        image = axes.imshow(
            table, origin="lower", cmap=_grey_for_nan(cmap), norm=norm, aspect="auto"
        )
        if title in crosses:
            at = np.argwhere(crosses[title])
            for color, heavy in (("white", 1.8), (INK, 0.8)):
                axes.plot(
                    at[:, 1], at[:, 0], "x", color=color, markersize=3.0, markeredgewidth=heavy
                )
        axes.set_title(title, fontsize=TEXT, color=INK, pad=3.0)
        _ticks(axes, xs, ys, first=column == 0, last=k + columns >= len(data))
        axes.set_xlabel(xlabel if k + columns >= len(data) else "", fontsize=SMALL, labelpad=1.5)
        axes.set_ylabel(ylabel if column == 0 else "", fontsize=SMALL, labelpad=1.5)
    place = figure.add_axes((0.3, 58.0 / total, 0.4, 12.0 / total))
    bar = figure.colorbar(image, cax=place, orientation="horizontal")
    bar.ax.tick_params(labelsize=SMALL, width=0.5, length=2.0, pad=1.5)
    bar.set_label(label, size=SMALL, color=INK, labelpad=2.0)
    return finish(figure, path)


def _axes(width: int, height: int, title: str, x: str, y: str) -> tuple[Any, Any]:
    figure = new(width, height)
    top = 44.0 if title else 16.0
    left, foot = 112.0, 84.0
    size = (1 - (left + 20.0) / width, 1 - (foot + top) / height)
    axes = style(figure.add_axes((left / width, foot / height, *size)))
    axes.set_title(title, fontsize=TEXT, color=INK, pad=5.0)
    axes.set_xlabel(x, fontsize=TEXT, color=INK, labelpad=2.5)
    axes.set_ylabel(y, fontsize=TEXT, color=INK, labelpad=2.5)
    return figure, axes


def _key(axes: Any, count: int) -> None:
    """A legend where there is something to tell apart; beside the axes where it would be long."""
    if count > MOST:
        names = axes.legend(fontsize=SMALL, labelcolor=INK, handlelength=2.4, frameon=False,
                            loc="upper left", bbox_to_anchor=(1.0, 1.0))  # fmt: skip
        figure = axes.figure
        beside = names.get_window_extent(figure.canvas.get_renderer()).width / figure.bbox.width
        left, foot, _, height = axes.get_position().bounds
        axes.set_position((left, foot, 0.985 - left - beside, height))
    elif count > 1 or axes.get_legend_handles_labels()[1] not in ([], [""]):
        axes.legend(fontsize=SMALL, labelcolor=INK, handlelength=3.2, facecolor="white",
                    framealpha=0.8, edgecolor="none", borderpad=0.2)  # fmt: skip


def _curve(
    label: str, xs: npt.ArrayLike, ys: npt.ArrayLike, xscale: str, yscale: str
) -> tuple[Floats, Floats]:
    """Float arrays, NaN where an axis cannot show the value."""
    px, py = np.array(xs, dtype=float), np.array(ys, dtype=float)
    if px.ndim != 1 or px.shape != py.shape:
        raise OptionError(
            f"curve {label!r}: expected x and y of one length, found shapes {px.shape}, {py.shape}"
        )
    for values, scale in ((px, xscale), (py, yscale)):
        values[~np.isfinite(values) | ((scale == "log") & (values <= 0.0))] = np.nan
    return px, py


def _table(name: str, values: npt.ArrayLike, shape: tuple[int, int]) -> npt.NDArray[Any]:
    table = np.asarray(values)
    if table.shape != shape:
        raise OptionError(f"{name}: expected shape {shape}, (len(y), len(x)), found {table.shape}")
    return table


def _norm(values: Floats, log: bool, limits: tuple[float, float] | None) -> Any:
    from matplotlib.colors import LogNorm, Normalize

    known = values[np.isfinite(values)]
    low, high = limits or ((known.min(), known.max()) if len(known) else (1.0, 10.0))
    if not low < high:
        low, high = (low / 2.0, low * 2.0) if log else (low - 0.5, low + 0.5)
    return LogNorm(low, high) if log else Normalize(low, high)


def _grey_for_nan(name: str) -> Any:
    from matplotlib import colormaps

    if name not in colormaps:
        raise OptionError(unknown("cmap", name, sorted(colormaps)))
    return colormaps[name].with_extremes(bad="#D9D9D9")


def _ticks(axes: Any, xs: Floats, ys: Floats, first: bool, last: bool) -> None:
    axes.tick_params(labelsize=SMALL, width=0.5, length=2.0, pad=1.5, colors=INK)
    for axis, values, shown in ((axes.xaxis, xs, last), (axes.yaxis, ys, first)):
        step = -(-len(values) // 8)
        places = range(0, len(values), step)
        axis.set_ticks(places, [f"{values[k]:.3g}" if shown else "" for k in places])
    for spine in axes.spines.values():
        spine.set(linewidth=0.5)
