"""Figures of many small panels: curves side by side, and squares of categories."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Curves = Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]]
MARK: dict[str, Any] = {"color": "#222222", "markersize": 2.6, "markeredgewidth": 0.7}


def curve_panels(
    panels: Mapping[str, Curves],
    path: Path,
    *,
    columns: int,
    xlabel: str,
    ylabel: str,
    width: int = 1200,
    height: int = 250,
) -> None:
    """Curves y(x) by label in panels by title, logarithmic axes, one scale, one legend below.

    Where curves lie on each other, all of them are seen.
    """
    from pcmc.plot.figure import CURVES, INK, SMALL, TEXT, apart, finish, new, style

    rows = math.ceil(len(panels) / columns)
    top, left, foot, gap = 34.0, 96.0, 104.0, 62.0
    total = top + rows * (height + gap) + foot
    side = (width - left) / columns - 18.0
    figure = new(width, total)
    across, up = (
        _range([pair[k] for curves in panels.values() for pair in curves.values()]) for k in (0, 1)
    )
    labels = list(dict.fromkeys(label for curves in panels.values() for label in curves))
    looks = {label: {"color": CURVES[k % len(CURVES)], **apart(k, len(labels))}
             for k, label in enumerate(labels)}  # fmt: skip
    for k, (title, curves) in enumerate(panels.items()):
        row, column = divmod(k, columns)
        x0, y1 = left + column * (side + 18.0), top + row * (height + gap) + height
        place = (x0 / width, 1.0 - y1 / total, side / width, height / total)
        axes = style(figure.add_axes(place))
        axes.set(xscale="log", yscale="log", xlim=across, ylim=up)
        for label, (x, y) in curves.items():
            axes.plot(x, y, **looks[label])
        axes.tick_params(labelsize=SMALL - 0.8, pad=1.0)
        axes.set_title(title, fontsize=SMALL, color=INK, pad=2.5)
        if column:
            axes.set_yticklabels([])
        else:
            axes.set_ylabel(ylabel, fontsize=SMALL, color=INK, labelpad=2.0)
        if k + columns >= len(panels):
            axes.set_xlabel(xlabel, fontsize=SMALL, color=INK, labelpad=1.5)
    _legend(figure, {}, TEXT, columns=3, lines=looks)
    finish(figure, path)


def _range(arrays: Sequence[npt.ArrayLike]) -> tuple[float, float]:
    """Of all positive values, with a margin."""
    values = np.concatenate([np.asarray(array, dtype=float) for array in arrays])
    values = values[np.isfinite(values) & (values > 0.0)]
    return float(values.min() / 2.0), float(values.max() * 2.0)


def category_panels(
    x: Sequence[float],
    y: Sequence[float],
    tables: Mapping[str, npt.NDArray[Any]],
    categories: Mapping[str, str],
    path: Path,
    *,
    marks: Mapping[str, tuple[str, Mapping[str, npt.NDArray[np.bool_]]]],
    xlabel: str,
    ylabel: str,
    columns: int = 4,
    width: int = 1200,
) -> None:
    """Tables (len(y), len(x)) of category names as coloured squares, with marks on some.

    ``categories`` has the colour of each, in the legend's order; ``marks`` by meaning the symbol and
    where it stands.
    """
    from matplotlib.colors import ListedColormap

    from pcmc.plot.figure import INK, SMALL, TEXT, finish, new

    names = list(categories)
    colors = ListedColormap(list(categories.values()))
    rows = math.ceil(len(tables) / columns)
    side = (width - 70.0) / columns - 24.0
    total = rows * (side + 46.0) + 60.0 + 28.0 * math.ceil((len(names) + len(marks)) / 3)
    figure = new(width, total)
    for k, (title, table) in enumerate(tables.items()):
        row, column = divmod(k, columns)
        x0, y1 = 70.0 + column * (side + 24.0), 34.0 + row * (side + 46.0) + side
        axes = figure.add_axes((x0 / width, 1.0 - y1 / total, side / width, side / total))
        numbers = np.vectorize(names.index, otypes=[int])(table)
        axes.imshow(
            numbers, origin="lower", cmap=colors, vmin=-0.5, vmax=len(names) - 0.5, aspect="auto"
        )
        for symbol, where in marks.values():
            at = np.argwhere(where[title])
            axes.plot(at[:, 1], at[:, 0], symbol, **MARK)
        axes.set_title(title, fontsize=TEXT, color=INK, pad=3.0)
        axes.tick_params(labelsize=SMALL, width=0.5, length=2.0, pad=1.5, colors=INK)
        last, first = k + columns >= len(tables), column == 0
        for axis, values, shown in ((axes.xaxis, x, last), (axes.yaxis, y, first)):
            places = range(0, len(values), math.ceil(len(values) / 8))
            axis.set_ticks(places, [f"{values[i]:g}" if shown else "" for i in places])
        axes.set_xlabel(xlabel if last else "", fontsize=SMALL, labelpad=1.5)
        axes.set_ylabel(ylabel if first else "", fontsize=SMALL, labelpad=1.5)
        for spine in axes.spines.values():
            spine.set(linewidth=0.5)
    symbols = {meaning: symbol for meaning, (symbol, _) in marks.items()}
    _legend(figure, categories, TEXT, columns=3, symbols=symbols)
    finish(figure, path)


def _legend(
    figure: Any,
    colors: Mapping[str, str],
    size: float,
    columns: int = 4,
    symbols: Mapping[str, str] | None = None,
    lines: Mapping[str, Mapping[str, Any]] | None = None,
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    from pcmc.plot.figure import INK

    drawn: list[Any] = [Patch(facecolor=color, label=label) for label, color in colors.items()]
    drawn += [
        Line2D([], [], linestyle="", marker=symbol, label=label, **MARK)
        for label, symbol in (symbols or {}).items()
    ]
    drawn += [Line2D([], [], label=label, **look) for label, look in (lines or {}).items()]
    figure.legend(
        handles=drawn,
        loc="lower center", ncols=columns, fontsize=size, frameon=False, labelcolor=INK,
        handlelength=3.0 if lines else 1.2, handleheight=0.8, borderaxespad=0.4,
    )  # fmt: skip
