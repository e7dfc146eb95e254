"""Bifurcation diagrams: branches of equilibria, their folds and changes of stability."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..base.arrays import Floats
from ..base.errors import OptionError, unknown
from .curves import add_legend, new_axes
from .figure import CURVES, Image, finish

if TYPE_CHECKING:
    from ..continuation import Branch

MARKERS = {"fold": "o", "index": "D", "contact": "x"}
MEANINGS = {"fold": "fold", "index": "change of index", "contact": "change of contact"}


def diagram(
    branches: Mapping[str, Branch],
    path: str | os.PathLike[str] | None = None,
    *,
    x: str = "parameter",
    y: str = "height",
    xlabel: str = "",
    ylabel: str = "",
    title: str = "",
    width: int = 900,
    height: int = 640,
) -> Image:
    """Branches by label: columns y against x, solid where stable (index 0), dashed where not.

    Folds, changes of index and changes of contact are marked.
    """
    figure, axes = new_axes(width, height, title, xlabel or x, ylabel or y)
    marked: set[str] = set()
    for k, (label, branch) in enumerate(branches.items()):
        for column in (x, y):
            if column not in branch.events.columns:
                known = branch.events.columns.intersection(branch.points.columns, sort=False)
                message = f"branch {label!r}: {unknown('column', column, known)}"
                raise OptionError(message, what="branches", where=label, found=column)
        color = CURVES[k % len(CURVES)]
        named = label
        for stable, (px, py) in _pieces(branch, x, y):
            axes.plot(px, py, color=color, linewidth=1.1, linestyle="-" if stable else "--", label=named)
            named = ""
        for kind, rows in branch.events.groupby("kind", sort=False):
            text = "" if kind in marked else MEANINGS[str(kind)]
            marked.add(str(kind))
            look = {"markersize": 3.6, "markerfacecolor": "white", "markeredgewidth": 0.8}
            axes.plot(rows[x], rows[y], MARKERS[str(kind)], color=color, label=text, **look)
    add_legend(axes, len(branches) + len(marked))
    return finish(figure, path)


def _pieces(branch: Branch, x: str, y: str) -> list[tuple[bool, tuple[Floats, Floats]]]:
    """The branch cut where its stability changes; events are points of it too."""
    columns = ["arclength", x, y]
    events = branch.events[columns].assign(index=branch.events.index_after)
    every = np.concatenate([branch.points[[*columns, "index"]].to_numpy(float), events.to_numpy(float)])
    every = every[np.argsort(every[:, 0], kind="stable")]
    stable = every[:, 3] == 0.0
    cuts = np.flatnonzero(stable[1:] != stable[:-1]) + 1
    ends = zip([0, *cuts], [*cuts, len(every)], strict=True)
    return [(bool(stable[i]), (every[i : k + 1, 1], every[i : k + 1, 2])) for i, k in ends]
