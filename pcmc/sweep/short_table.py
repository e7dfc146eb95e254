"""The columns of a sweep that a reader wants first."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import OptionError
from ..base.units import Units

if TYPE_CHECKING:
    import os

    import pandas as pd

    from ..plot.figure import Image

FIRST = ("status", "verdict", "mesh_verdict", "targets_met")
LAST = ("rise", "roof_area", "largest_reaction")
RISE = "rise of the certified cases (×: not certified)"
GOOD = ("stable", "neutral")
UNIT_OF = dict.fromkeys(("apex", "rise", "edge_length", "near_curves", "radius"), "length")
UNIT_OF |= {"roof_area": "area", "largest_reaction": "tension", "volume": "volume", "cable": "force"}
UNIT_OF |= {"tension": "tension", "wall": "tension", "pressure": "pressure", "snow": "pressure"}
UNIT_OF |= {"weight": "pressure"}
"""The kind of unit of a column, by the last word of its name."""


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


def with_units(names: Iterable[str], units: Units, cables: Container[str] = ()) -> dict[str, str]:
    """The names of numbers with their units in brackets, as far as these are known.

    Parameters
    ----------
    units : of the project or surface; nothing is added without one.
    cables : names whose tension is a force.

    >>> list(with_units(["west.tension", "hem.tension", "verdict"], Units("m", "kN"), ["hem"]).values())
    ['west.tension [kN/m]', 'hem.tension [kN]']
    """
    if not units:
        return {}
    shown = {}
    for name in names:
        stem, _, quantity = name.rpartition(".")
        kind = "force" if quantity == "tension" and stem in cables else UNIT_OF.get(quantity)
        if kind is not None:
            shown[name] = f"{name} [{units.behind(kind).strip()}]"
    return shown


def draw_sweep(
    table: pd.DataFrame,
    parameters: Sequence[str],
    path: str | os.PathLike[str] | None = None,
    labels: Mapping[str, str] | None = None,
) -> Image:
    """A picture of a sweep: apexes over one varied number, or the rise over two, × where not certified.

    ``labels`` are the names of columns as they are shown, such as ``with_units`` gives.

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
    shown = labels or {}
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
        first = next(iter(curves))
        unit = shown.get(f"{first}.apex", "").removeprefix(f"{first}.apex")
        return lines(curves, path, x=shown.get(varied[0], varied[0]), y=f"apex{unit}", markers=True)
    across, up = varied
    rise = table.assign(rise=table["rise"].where(good)).pivot_table("rise", up, across, dropna=False)
    lost = (~good).groupby([table[up], table[across]]).any().unstack(fill_value=True)
    marks = {RISE: lost.reindex(index=rise.index, columns=rise.columns, fill_value=True).to_numpy(bool)}
    tables = {RISE: rise.to_numpy(float)}
    xs, ys = rise.columns.to_numpy(float), rise.index.to_numpy(float)
    across, up = (shown.get(name, name) for name in varied)
    label = shown.get("rise", "")
    return heatmap(xs, ys, tables, path, marks=marks, xlabel=across, ylabel=up, label=label, width=900)
