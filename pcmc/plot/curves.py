"""Curves, tables and bifurcation diagrams as pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import OptionError, unknown
from ..base.files import PathLike
from .colours import color_bar, color_map
from .figure import CURVES, INK, SMALL, TEXT, finish, fit_height, grid, new, overlap_style, style
from .scene import Image

SCALES = ("linear", "log")
MARKERS = "osD^vPX"
EVENT_MARKERS = {"fold": "o", "index": "D", "contact": "x"}
MEANINGS = {"fold": "fold", "index": "change of index", "contact": "change of contact"}
LEGEND_INSIDE = 6  # labels at most; a longer legend is beside the axes
WIDEST_BESIDE = 0.4  # of a figure's width: a wider legend stays inside the axes


def lines(
    curves: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]],
    path: PathLike | None = None,
    *,
    x: str = "",
    y: str = "",
    title: str = "",
    xscale: str = "linear",
    yscale: str = "linear",
    markers: bool = False,
    dashes: bool = False,
    levels: Mapping[str, float] | None = None,
    fits: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]] | None = None,
    width: int = 900,
    height: int = 560,
) -> Image:
    """Curves y(x) by label, each a pair of arrays; values that are not finite leave a gap.

    On a "log" axis values ≤ 0 leave a gap too. ``x``, ``y`` are the axes' labels. With ``dashes``
    curves that lie on each other all stay visible; ``levels`` are values of y by label, such as
    bounds, drawn as horizontal lines. A curve whose label is in ``fits`` is drawn as points, and its fit as
    a line of its colour.

    >>> lines({"rise": ([1.0, 2.0, 3.0], [2.0, 1.2, 0.9])}, x="tension", width=300, height=200).shape
    (200, 300, 3)
    """
    for scale in (xscale, yscale):
        validate.choice("scale", scale, SCALES)
    figure, axes = new_axes(width, height, title, x, y, xscale, yscale)
    fits = fits or {}
    for k, (label, curve) in enumerate(curves.items()):
        color = CURVES[k % len(CURVES)]
        turn = k // len(CURVES)  # how many times all colours are used already
        plain = {"linewidth": 1.1, "linestyle": "" if label in fits else ("-", "--")[turn % 2]}
        look = overlap_style(k, len(curves)) if dashes else plain
        look |= {"color": color, "marker": MARKERS[(k + turn) % len(MARKERS)] if markers else None}
        axes.plot(*_curve(label, *curve, xscale, yscale), markersize=2.8, label=label, **look)
        if label in fits:
            axes.plot(*_curve(label, *fits[label], xscale, yscale), color=color, linewidth=1.1)
    for label, level in (levels or {}).items():
        axes.axhline(level, color=INK, linewidth=0.9, linestyle=(0, (5, 3)), label=label, zorder=1.5)
    for scale, axis in ((xscale, axes.xaxis), (yscale, axes.yaxis)):
        if scale == "log":
            _plain_ticks(axis)
    add_legend(axes, len(curves) + len(levels or {}))
    return finish(figure, path)


def _plain_ticks(axis: Any) -> None:
    """On a logarithmic axis shorter than two decades: round numbers in plain notation."""
    low, high = axis.get_view_interval()
    if not 1e-4 < low < high < 100.0 * low:
        return
    decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.log10(high))
    few = (1, 2, 3, 5) if high < 30.0 * low else (1, 2, 5)
    steps = (1, 1.5, 2, 3, 4, 5, 6, 8) if high < 5.0 * low else few
    ticks = [step * decade for decade in decades for step in steps if low <= step * decade <= high]
    axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_ticks([], minor=True)


def histories(
    frames: Mapping[str, pd.DataFrame],
    path: PathLike | None = None,
    *,
    y: str = "energy",
    x: str | None = None,
    label: str = "",
    yscale: str | None = None,
    **options: Any,
) -> Image:
    """Histories of solves by label, one column against another.

    ``y`` is a column of each frame ("energy", "gradient_squared", ...); ``x`` another one, or the
    row number (iteration) when None. The scale is logarithmic unless y has values ≤ 0 or is the
    energy. ``options`` are those of ``lines``: title, dashes, width, height.

    >>> import pandas as pd
    >>> solve = pd.DataFrame({"energy": [3.0, 2.0, 1.5], "residual": [1.0, 1e-3, 1e-9]})
    >>> histories({"a solve": solve}, y="residual", width=300, height=200).shape
    (200, 300, 3)
    """
    curves = {}
    for name, frame in frames.items():
        for column in (y, x):
            if column is not None and column not in frame.columns:
                message = f"history {name!r}: {unknown('column', column, frame.columns)}"
                raise OptionError(message, what="history", where=name, found=column)
        xs = np.arange(len(frame)) if x is None else frame[x].to_numpy()
        curves[name] = (xs, frame[y].to_numpy())
    positive = all((np.asarray(v)[np.isfinite(v)] > 0.0).all() for _, v in curves.values())
    scale = yscale or ("log" if positive and y != "energy" else "linear")
    along, up = (x or "iteration").replace("_", " "), label or y.replace("_", " ")
    return lines(curves, path, x=along, y=up, yscale=scale, **options)


def convergence(
    curves: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]],
    path: PathLike | None = None,
    *,
    x: str = "edge length",
    y: str = "error",
    title: str = "",
    fit: bool = True,
    width: int = 900,
    height: int = 640,
) -> Image:
    """Errors against edge lengths on logarithmic axes, with the least-squares slope of each.

    >>> convergence({"energy": ([0.4, 0.2, 0.1], [0.16, 0.04, 0.01])}, width=300, height=200).shape
    (200, 300, 3)
    """
    figure, axes = new_axes(width, height, title, x, y, "log", "log")
    for k, (name, (xs, ys)) in enumerate(curves.items()):
        color, label = CURVES[k % len(CURVES)], name
        px, py = _curve(name, xs, ys, "log", "log")
        known = np.isfinite(py)
        if fit and np.count_nonzero(known) >= 2:
            slope, height_at_1 = np.polyfit(np.log(px[known]), np.log(py[known]), 1)
            ends = np.array([px[known].min(), px[known].max()])
            axes.plot(ends, np.exp(height_at_1) * ends**slope, color=color, linewidth=0.8)
            label = f"{name}: slope {slope:.2f}"
        axes.plot(px, py, MARKERS[k % len(MARKERS)], color=color, markersize=3.2, label=label)
    every = np.unique(np.concatenate([np.asarray(xs, dtype=float) for xs, _ in curves.values()]))
    every = every[np.isfinite(every) & (every > 0.0)]
    if len(every) <= 8:
        axes.xaxis.set_ticks(every, [f"{v:.3g}" for v in every])
        axes.xaxis.set_ticks([], minor=True)
    else:
        _plain_ticks(axes.xaxis)
    _plain_ticks(axes.yaxis)
    add_legend(axes, len(curves))
    return finish(figure, path)


def heatmap(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    tables: Mapping[str, npt.ArrayLike],
    path: PathLike | None = None,
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

    >>> heatmap([1.0, 2.0], [3.0, 4.0], {"rise": [[1.0, 0.8], [0.9, np.nan]]}, width=300).shape[1:]
    (300, 3)
    """
    xs, ys = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    shape = (len(ys), len(xs))
    given = {k: v.astype(float) for k, v in _tables("tables", tables, shape).items()}
    if not given:
        validate.refuse("tables", 0, "at least one table")
    data = {k: np.where(np.isfinite(v) & ((v > 0.0) | (not log)), v, np.nan) for k, v in given.items()}
    crosses = _tables("marks", marks or {}, shape)
    for name in crosses.keys() - data.keys():
        raise OptionError(unknown("table", name, data), what="marks", where=name)
    columns = min(columns, len(data))
    ratio = shape[0] / shape[1]
    figure = new(width, width * ratio * -(-len(data) // columns) / columns + 200.0, pad=6.0)
    from matplotlib.colors import LogNorm, Normalize  # as ``new`` has found it installed

    panels = grid(figure, len(data), columns)
    known = np.concatenate([table[np.isfinite(table)] for table in data.values()])
    low, high = limits or ((known.min(), known.max()) if len(known) else (1.0, 10.0))
    if not low < high:
        low, high = (low / 2.0, low * 2.0) if log else (low - 0.5, low + 0.5)
    norm = (LogNorm if log else Normalize)(low, high)
    grey_for_nan = color_map(cmap).with_extremes(bad="#D9D9D9")
    for k, (axes, (title, table)) in enumerate(zip(panels, data.items(), strict=True)):
        image = axes.imshow(table, origin="lower", cmap=grey_for_nan, norm=norm, aspect="auto")
        if title in crosses:
            at = np.argwhere(crosses[title])
            for color, heavy in (("white", 1.8), (INK, 0.8)):
                axes.plot(at[:, 1], at[:, 0], "x", color=color, markersize=3.0, markeredgewidth=heavy)
        axes.set_title(title, fontsize=TEXT, color=INK, pad=3.0)
        first, last = k % columns == 0, k + columns >= len(data)
        table_ticks(axes, xs if last else (), ys if first else (), shape)
        axes.set_xlabel(xlabel if last else "", fontsize=SMALL, labelpad=1.5)
        axes.set_ylabel(ylabel if first else "", fontsize=SMALL, labelpad=1.5)
    color_bar(figure, image, panels, label)
    fit_height(figure, dict.fromkeys(panels[::columns], ratio))
    return finish(figure, path)


def diagram(
    branches: Mapping[str, Any],
    path: PathLike | None = None,
    *,
    x: str = "parameter",
    y: str = "height",
    xlabel: str = "",
    ylabel: str = "",
    title: str = "",
    width: int = 900,
    height: int = 640,
) -> Image:
    """Branches of ``pcmc.follow`` by label: columns y against x, solid where stable, dashed where not.

    Folds, changes of index and changes of contact are marked.
    """
    figure, axes = new_axes(width, height, title, xlabel or x, ylabel or y)
    add_legend(axes, len(branches) + add_branches(axes, branches, x, y))
    return finish(figure, path)


def add_branches(axes: Any, branches: Mapping[str, Any], x: str, y: str) -> int:
    """Draw branches on axes as ``diagram`` does; the number of kinds of events among them."""
    marked: set[str] = set()
    for k, (label, branch) in enumerate(branches.items()):
        for column in (x, y):
            if column not in branch.events.columns:
                known = branch.events.columns.intersection(branch.points.columns, sort=False)
                message = f"branch {label!r}: {unknown('column', column, known)}"
                raise OptionError(message, what="branches", where=label, found=column)
        color = CURVES[k % len(CURVES)]
        for number, (stable, piece) in enumerate(branch.pieces(x, y)):
            look = {"linewidth": 1.1, "linestyle": "-" if stable else "--", "label": "" if number else label}
            axes.plot(*piece.T, color=color, **look)
        for kind, rows in branch.events.groupby("kind", sort=False):
            text = "" if kind in marked else MEANINGS[str(kind)]
            marked.add(str(kind))
            # a fold shows around and behind the change of index that it often is
            size, layer = (6.4, 2.5) if kind == "fold" else (3.6, 3.0)
            look = {"markersize": size, "zorder": layer, "markerfacecolor": "white", "markeredgewidth": 0.8}
            axes.plot(rows[x], rows[y], EVENT_MARKERS[str(kind)], color=color, label=text, **look)
    return len(marked)


def new_axes(width: int, height: int, title: str, x: str, y: str, *scales: str) -> tuple[Any, Any]:
    figure = new(width, height, pad=8.0)
    axes = style(figure.subplots())
    axes.set(**dict(zip(("xscale", "yscale"), scales, strict=False)))
    axes.set_title(title, fontsize=TEXT, color=INK, pad=5.0)
    label_axes(axes, x, y)
    return figure, axes


def label_axes(axes: Any, x: str, y: str) -> None:
    axes.set_xlabel(x, fontsize=TEXT, color=INK, labelpad=2.5)
    axes.set_ylabel(y, fontsize=TEXT, color=INK, labelpad=2.5)


def add_legend(axes: Any, count: int) -> None:
    """A legend of the curves, where there are several; beside the axes if it is long, or would cover one and
    leaves them room."""
    text = {"fontsize": SMALL, "labelcolor": INK}
    if count <= LEGEND_INSIDE:
        if count <= 1 and axes.get_legend_handles_labels()[1] in ([], [""]):
            return
        box = {"facecolor": "white", "framealpha": 0.8, "edgecolor": "none", "borderpad": 0.2}
        legend = axes.legend(handlelength=3.2, **box, **text)
        axes.figure.draw_without_rendering()
        inside, paths = legend.get_window_extent(), (line.get_path() for line in axes.lines)
        drawn = (path.transformed(line.get_transform()) for path, line in zip(paths, axes.lines, strict=True))
        wide = inside.width > WIDEST_BESIDE * axes.figure.bbox.width
        if wide or not any(path.intersects_bbox(inside, filled=False) for path in drawn):
            return
        legend.remove()
    axes.figure.legend(handlelength=2.4, frameon=False, loc="outside right upper", **text)


def table_ticks(
    axes: Any, xs: Sequence[float] | Floats, ys: Sequence[float] | Floats, shape: tuple[int, int]
) -> None:
    """At most eight ticks a side on a table of this shape, with these values; without values, bare."""
    axes.tick_params(labelsize=SMALL, width=0.5, length=2.0, pad=1.5, colors=INK)
    for axis, values, count in ((axes.xaxis, xs, shape[1]), (axes.yaxis, ys, shape[0])):
        places = range(0, count, -(-count // 8))
        axis.set_ticks(places, [f"{values[k]:.3g}" if len(values) else "" for k in places])
    for spine in axes.spines.values():
        spine.set(linewidth=0.5)


def _curve(
    label: str, xs: npt.ArrayLike, ys: npt.ArrayLike, xscale: str, yscale: str
) -> tuple[Floats, Floats]:
    """Float arrays, NaN where an axis cannot show the value."""
    px, py = np.array(xs, dtype=float), np.array(ys, dtype=float)
    if px.ndim != 1 or px.shape != py.shape:
        validate.refuse("curves", (px.shape, py.shape), "x and y of one length", where=label)
    for values, scale in ((px, xscale), (py, yscale)):
        values[~np.isfinite(values) | ((scale == "log") & (values <= 0.0))] = np.nan
    return px, py


def _tables(what: str, given: Mapping[str, npt.ArrayLike], shape: tuple[int, int]) -> dict[str, Any]:
    tables = {title: np.asarray(values) for title, values in given.items()}
    for title, table in tables.items():
        if table.shape != shape:
            validate.refuse(what, table.shape, f"shape {shape}, (len(y), len(x))", where=title)
    return tables
