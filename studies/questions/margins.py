"""How far every example is from the edge: the factor on a load or a tension up to which it stays stable.

- ``margins``: a row per example and load: the factor (or the value, of what is 0), its bar from a mesh of
  halved edges, what ends it, what moves there, and where a closed form is known that number.
- ``times`` of each.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from generators import (
    barrel,
    bezier_hall,
    catenoid,
    four_fans,
    hypar_roof,
    joined_caps,
    spherical_cap,
    three_patches,
    two_caps,
    two_squares,
)
from generators.catenary import FOLD
from pcmc import Surface, margin, project, solve
from pcmc.base.errors import PcmcError

from ..folder import Folder
from ..study import Study

ROOF = Path(__file__).parents[2] / "notebooks" / "roof.toml"


def l_roof() -> Surface:
    """The L-shaped roof of the notebooks."""
    return project.surface_of(project.load(ROOF))


EXAMPLES: dict[str, tuple[Callable[[], Surface], tuple[str, ...]]] = {
    "cap, α 0.75": (partial(spherical_cap, alpha=0.75), ("pressure", "tension", "snow")),
    "hanging strip": (
        partial(barrel, 16, pressure=0.0, weight=1.0, rise=-0.2),
        ("weight", "tension"),
    ),
    "film between rings": (catenoid, ("pressure",)),
    "flat roof with cables": (partial(hypar_roof, 8, height=0.0), ("cable",)),
    "Example 1, wall 1": (partial(two_squares, 8, alpha_aux=1.0), ("pressure", "wall")),
    "Example 1, wall 2": (partial(two_squares, 8), ("pressure", "wall")),
    "Example 2, edge 1.2": (partial(two_caps, 1.2), ("pressure", "wall")),
    "joined caps": (partial(joined_caps, 0.5), ("pressure", "wall")),
    "Example 3, walls 1.5": (partial(four_fans, 7, alpha_aux=1.5), ("pressure", "wall 1")),
    "Example 3, walls 3": (partial(four_fans, 7), ("pressure",)),
    "Fig. 4": (three_patches, ("pressure",)),
    "Example 4, edge 5": (partial(bezier_hall, 5.0), ("pressure",)),
    "L-shaped roof": (l_roof, ("pressure",)),
}
EXACT = {
    ("cap, α 0.75", "pressure"): 1.5,
    ("cap, α 0.75", "tension"): 2.0 / 3.0,
    ("cap, α 0.75", "snow"): 2.5,
    ("hanging strip", "weight"): 2.0 * FOLD / np.cosh(FOLD),
    ("hanging strip", "tension"): 0.5 * np.cosh(FOLD) / FOLD,
}
SHORT = ("hanging strip",)


def data(folder: Folder, short: bool) -> None:
    """``margins`` and ``times``."""
    rows, times = [], []
    for name, (build, wanted) in EXAMPLES.items():
        if short and name not in SHORT:
            continue
        result = solve(build(), target="stationary")
        for what in wanted:
            begin = time.process_time()
            rows.append({"example": name, "varied": what, "triangles": result.surface.m})
            try:
                found = margin(result, what)
            except PcmcError as error:
                rows[-1] |= {"ends_by": "refused", "sentence": str(error)}
                continue
            number = found.value if np.isnan(found.factor) else found.factor
            rows[-1] |= {
                "margin": number,
                "bar": found.bar,
                "limit": found.limit,
                "limit_bar": found.limit_bar,
                "exact": EXACT.get((name, what), np.nan),
                "index": found.index,
                "ends_by": found.ends_by.name.lower(),
                "where": found.where,
                "sentence": found.text(),
            }
            times.append({"example": name, "varied": what, "seconds": time.process_time() - begin})
    folder.write_table("margins", pd.DataFrame(rows))
    folder.write_table("times", pd.DataFrame(times))


def table(folder: Folder) -> dict[str, float]:
    """How many margins there are, how many end by what, and how many bars hold the closed form."""
    rows = folder.read_table("margins")
    known = rows[rows["exact"].notna()]
    held = (known["margin"] - known["exact"]).abs() <= known["bar"]
    return {
        "margins": float(len(rows)),
        "with_bar": float(np.isfinite(rows["bar"]).sum()),
        "closed_forms": float(len(known)),
        "closed_forms_held": float(held.sum()),
        **{str(end): float(count) for end, count in rows["ends_by"].value_counts().items()},
    }


def figure(folder: Folder) -> None:
    """Each factor with its bar, coloured by what ends it."""
    from pcmc.plot.figure import CURVES, INK, SMALL, TEXT, finish, new, style

    rows = folder.read_table("margins")
    rows = rows[rows["margin"].notna()].iloc[::-1].reset_index(drop=True)
    picture = new(1200, 120 + 34 * len(rows), pad=8.0)
    axes = picture.subplots()
    style(axes)
    for k, (end, part) in enumerate(rows.groupby("ends_by", sort=True)):
        bars = np.minimum(part["bar"].where(np.isfinite(part["bar"]), 0.0), 0.95 * part["margin"])
        axes.errorbar(
            part["margin"],
            part.index,
            xerr=bars,
            fmt="o",
            markersize=5,
            capsize=3,
            color=CURVES[k % len(CURVES)],
            label=str(end).replace("_", " "),
        )
    exact = rows[rows["exact"].notna()]
    axes.plot(exact["exact"], exact.index, "|", color=INK, markersize=14, label="closed form")
    axes.axvline(1.0, color=INK, linewidth=0.9, linestyle=(0, (5, 3)))
    axes.set(xscale="log", ylim=(-0.7, len(rows) - 0.3))
    names = (rows["example"] + ": " + rows["varied"]).tolist()
    axes.set_yticks(range(len(rows)), names, fontsize=SMALL)
    ticks = [0.1, 0.2, 0.5, 1, 2, 5, 10]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks], fontsize=SMALL)
    axes.minorticks_off()
    axes.set_xlabel("times the present value (of what is 0: the value)", fontsize=TEXT, color=INK)
    handles, labels = axes.get_legend_handles_labels()
    picture.legend(handles, labels, loc="outside right upper", fontsize=SMALL, frameon=False, labelcolor=INK)
    finish(picture, folder.figure("margins"))


STUDY = Study(
    "margins",
    "how far every example is from the edge of its stability, and what ends it",
    data,
    table,
    figure,
    parameters={"examples": list(EXAMPLES), "meshes": 2, "most": 10.0},
    seconds=300,
    paper=False,
)
