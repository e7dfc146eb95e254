"""The columns of a sweep that a reader wants first."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import OptionError

if TYPE_CHECKING:
    import os

    import pandas as pd

    from ..plot.figure import Image

FIRST = ("status", "verdict", "mesh_verdict", "targets_met")
LAST = ("rise", "roof_area", "largest_reaction")
RISE = "rise of the certified cases (×: not certified)"
GOOD = ("stable", "neutral")


def short_table(table: pd.DataFrame, parameters: Sequence[str]) -> pd.DataFrame:
    """The parameters, how each case ended, the apex of each patch, rise, area, and largest reaction.

    Lengths and forces are in the surface's units: the apex is the greatest height of a patch over Π, the rise
    that of the highest apex over the lowest support, the largest reaction one per length (force/length).

    >>> import pandas as pd
    >>> frame = pd.DataFrame({"a": [1.0], "verdict": ["stable"], "residual": [1e-12], "west.apex": [2.0]})
    >>> list(short_table(frame, ["a"]))
    ['a', 'verdict', 'west.apex']
    """
    apexes = [name for name in table if str(name).endswith(".apex")]
    wanted = dict.fromkeys([*parameters, *FIRST, *apexes, *LAST])
    return table[[name for name in wanted if name in table]]


def draw_sweep(
    table: pd.DataFrame, parameters: Sequence[str], path: str | os.PathLike[str] | None = None
) -> Image:
    """A picture of a sweep: apexes over one varied number, or the rise over two, × where not certified.

    Raises
    ------
    OptionError : if not one or two numbers vary, or no case has a shape.
    """
    from ..plot import heatmap, lines

    varied = [name for name in parameters if table[name].nunique() > 1]
    if len(varied) not in (1, 2) or not all(table[name].dtype.kind in "if" for name in varied):
        text = f"a sweep is drawn over one or two varied numbers, and {len(varied)} vary here"
        raise OptionError(
            f"{text}: {', '.join(varied) or 'none'}; fix the others", what="plot", found=len(varied)
        )
    apexes = [str(name) for name in table if str(name).endswith(".apex")]
    if "rise" not in table or not table["rise"].notna().any():
        raise OptionError("no case of this sweep has a shape to draw", what="plot", found=0)
    good = table["verdict"].isin(GOOD)
    if len(varied) == 1:
        x = table[varied[0]].to_numpy(float)
        order = np.argsort(x)
        heights = {a.removesuffix(".apex"): np.where(good, table[a], np.nan) for a in apexes}
        curves = {name: (x[order], y[order]) for name, y in heights.items() if np.isfinite(y).any()}
        if not curves:
            raise OptionError("no case of this sweep is certified; see its table", what="plot", found=0)
        return lines(curves, path, x=varied[0], y="apex", markers=True)
    across, up = varied
    rise = table.assign(rise=table["rise"].where(good)).pivot_table("rise", up, across, dropna=False)
    lost = (~good).groupby([table[up], table[across]]).any().unstack(fill_value=True)
    marks = {RISE: lost.reindex(index=rise.index, columns=rise.columns, fill_value=True).to_numpy(bool)}
    tables = {RISE: rise.to_numpy(float)}
    xs, ys = rise.columns.to_numpy(float), rise.index.to_numpy(float)
    return heatmap(xs, ys, tables, path, marks=marks, xlabel=across, ylabel=up, width=900)
