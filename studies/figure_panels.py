"""Figures of many small panels: curves side by side, squares of categories, a mesh and its parts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from pcmc import Surface

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
    ticks: Sequence[float] = (),
    looks: Mapping[str, Mapping[str, Any]] | None = None,
) -> None:
    """Curves y(x) by label in panels by title, logarithmic axes, one scale, one legend below.

    Curves that lie on each other all stay visible, unless their ``looks`` are given by label. With ``ticks``
    along x both axes have plain numbers.
    """
    from matplotlib.ticker import FuncFormatter, NullLocator

    from pcmc.plot.figure import CURVES, INK, SMALL, TEXT, finish, grid, new, overlap_style, style

    rows = math.ceil(len(panels) / columns)
    figure = new(width, rows * (height + 62.0) + 138.0, pad=8.0)
    axes = grid(figure, len(panels), columns, sharex=True, sharey=True)
    across, up = (_range([pair[k] for curves in panels.values() for pair in curves.values()]) for k in (0, 1))
    labels = list(dict.fromkeys(label for curves in panels.values() for label in curves))
    looks = looks or {
        label: {"color": CURVES[k % len(CURVES)], **overlap_style(k, len(labels))}
        for k, label in enumerate(labels)
    }
    for k, (place, (title, curves)) in enumerate(zip(axes, panels.items(), strict=True)):
        style(place)
        place.set(xscale="log", yscale="log", xlim=across, ylim=up)
        for label, (x, y) in curves.items():
            place.plot(x, y, **looks[label])
        last = k + columns >= len(panels)
        if ticks:
            place.xaxis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
            place.xaxis.set_minor_locator(NullLocator())
            place.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        place.tick_params(labelsize=SMALL - 0.8, pad=1.0, labelbottom=True)
        place.set_title(title, fontsize=SMALL, color=INK, pad=2.5)
        place.set_ylabel("" if k % columns else ylabel, fontsize=SMALL, color=INK, labelpad=2.0)
        place.set_xlabel(xlabel if last else "", fontsize=SMALL, color=INK, labelpad=1.5)
    _legend(figure, {}, TEXT, columns=3, lines={label: looks[label] for label in labels})
    finish(figure, path)


def eigenvalue_panels(panels: Mapping[str, Curves], path: Path) -> None:
    """Lowest eigenvalues by label against the edge length, in panels by title, each with its own scale.

    A dashed line is at 0, below which an equilibrium is a saddle.
    """
    from matplotlib.ticker import LogLocator

    from pcmc.plot.figure import CURVES, INK, SMALL, TEXT, finish, grid, new, style

    columns = 4
    figure = new(1500, 370.0 * math.ceil(len(panels) / columns) + 60.0, pad=8.0)
    axes = grid(figure, len(panels), columns, sharex=True)
    labels = list(dict.fromkeys(label for curves in panels.values() for label in curves))
    looks: dict[str, dict[str, Any]] = {
        label: {"color": CURVES[k], "marker": "os"[k % 2], "markersize": 2.6, "linewidth": 1.0}
        for k, label in enumerate(labels)
    }
    for k, (place, (title, curves)) in enumerate(zip(axes, panels.items(), strict=True)):
        style(place)
        place.set_xscale("log")
        for label, (x, y) in curves.items():
            place.plot(x, y, **looks[label])
        values = np.concatenate([[0.0], *(np.asarray(y, dtype=float) for _, y in curves.values())])
        room = 0.1 * float(np.ptp(values))
        place.set_ylim(float(values.min()) - room, float(values.max()) + room)
        place.axhline(0.0, color=INK, linewidth=0.8, linestyle=(0, (5, 3)), zorder=1.5)
        place.xaxis.set_major_locator(LogLocator(numticks=5))
        place.tick_params(labelsize=SMALL - 0.8, pad=1.0, labelbottom=True)
        place.set_title(title, fontsize=SMALL, color=INK, pad=2.5)
        place.set_ylabel("" if k % columns else "lowest eigenvalue, α/size²", fontsize=SMALL, color=INK)
        below = k + columns >= len(panels)
        place.set_xlabel("edge length at the end / size" if below else "", fontsize=SMALL, color=INK)
    looks["below: a saddle"] = {"color": INK, "linewidth": 0.8, "linestyle": (0, (5, 3))}
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
    its cells.
    """
    from matplotlib.colors import ListedColormap

    from pcmc.plot.curves import table_ticks
    from pcmc.plot.figure import INK, SMALL, TEXT, finish, fit_height, grid, new

    names = list(categories)
    colors = ListedColormap(list(categories.values()))
    rows = math.ceil(len(tables) / columns)
    figure = new(width, rows * width / columns + 120.0, pad=6.0)
    axes = grid(figure, len(tables), columns)
    for k, (place, (title, table)) in enumerate(zip(axes, tables.items(), strict=True)):
        numbers = np.vectorize(names.index, otypes=[int])(table)
        place.imshow(numbers, origin="lower", cmap=colors, vmin=-0.5, vmax=len(names) - 0.5, aspect="auto")
        for symbol, where in marks.values():
            at = np.argwhere(where[title])
            place.plot(at[:, 1], at[:, 0], symbol, **MARK)
        place.set_title(title, fontsize=TEXT, color=INK, pad=3.0)
        first, last = k % columns == 0, k + columns >= len(tables)
        table_ticks(place, x if last else (), y if first else (), table.shape)
        place.set_xlabel(xlabel if last else "", fontsize=SMALL, labelpad=1.5)
        place.set_ylabel(ylabel if first else "", fontsize=SMALL, labelpad=1.5)
    symbols = {meaning: symbol for meaning, (symbol, _) in marks.items()}
    _legend(figure, categories, TEXT, columns=3, symbols=symbols)
    fit_height(figure, dict.fromkeys(axes[::columns], 1.0))
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
        loc="outside lower center",
        ncols=columns,
        fontsize=size,
        frameon=False,
        labelcolor=INK,
        handlelength=3.0 if lines else 1.2,
        handleheight=0.8,
        borderaxespad=0.4,
    )


def graded_mesh(parts: Sequence[Surface], path: Path, titles: Sequence[str]) -> None:
    """A mesh seen from above, as a whole and in smaller and smaller parts, each as large as the others."""
    from pcmc.plot import panel

    panel(
        parts,
        path,
        views="plan",
        one_scale=False,
        edges=True,
        supports=False,
        columns=3,
        titles=titles,
    )
