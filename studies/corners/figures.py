"""The figures of the study of junctions' ends: the loss of hold with its fits, the grid, a graded mesh."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd

from pcmc import Surface
from pcmc.base.arrays import Floats

from ..alpha_grid.grid import TENSIONS
from ..examples.elevations import with_triangles
from ..figure_panels import category_panels, eigenvalue_panels, graded_mesh
from ..folder import Folder
from .cases import BOTTOMS, CASES, DRAWN
from .ladder import CATEGORIES, SUPPORTS, ends, law

COLORS = dict(
    zip(CATEGORIES, ("#08519C", "#CC79A7", "#F4A582", "#D6604D", "#FFF2AE", "#E6E6E6"), strict=True)
)
NO_CASE = "no equilibrium in the grid"
NAMES = {"sliding": "ends fixed", "held": "held", "natural": "ends slide too"}


def figure(folder: Folder) -> None:
    """The loss of hold with its fits, the crest's rise beside the theory, the grid, a graded mesh."""
    ladder = folder.read_table("ladder")
    sizes = {case.name: case.build() for case in CASES if (ladder.case == case.name).any()}
    curves = {}
    for case in CASES:
        for bottom in SUPPORTS:
            mine = ladder[(ladder.case == case.name) & (ladder.bottom == bottom)]
            mine = mine[mine.status == "converged"]
            if bottom == "natural" and len(mine):  # on coarse meshes the polygon of the outline adds modes
                mine = mine[mine["index"] == mine["index"].iloc[-1]]
            mine = mine.sort_values("edge_length")  # where the wall rests, levels do not halve it
            if len(mine) > 1:
                initial = sizes[case.name]
                unit = initial.size**2 / initial.tensions.max()
                curves[f"{case.title}, {NAMES[bottom]}"] = (
                    mine.edge_length / initial.size,
                    mine.eigenvalue * unit,
                )
    for name, supports in (("loss", ("sliding", "natural")), ("held", ("held",))):
        shown = {NAMES[support] for support in supports}
        panels: dict[str, dict[str, Any]] = {}
        for key, curve in curves.items():
            title, _, support = key.rpartition(", ")
            if support in shown:
                panels.setdefault(title, {})["bottoms held" if support == "held" else support] = curve
        eigenvalue_panels(panels, folder.figure(name))
    _draw_fits(folder, ladder)
    _draw_grid(folder)
    _draw_mesh(folder)


def _draw_fits(folder: Folder, ladder: pd.DataFrame) -> None:
    """The eigenvalues of sliding bottoms as long as nothing rests, in units of the first; and the law."""
    from pcmc.plot import lines

    labels = folder.read_table("labels")
    free = ladder[(ladder.bottom == "sliding") & (ladder.pinched == 0) & (ladder.status == "converged")]
    curves: dict[str, Any] = {}
    fitted: dict[str, Any] = {}
    for case in CASES:
        mine = free[free.case == case.name]
        fits = labels[(labels.case == case.name) & (labels.bottom == "sliding")]
        if not len(fits) or not math.isfinite(fits.limit.iloc[0]):
            continue
        found, unit = fits.iloc[0], abs(mine.eigenvalue.iloc[0])
        first, last = -np.log(mine.edge_length.to_numpy()[[2, 1 + int(found.fitted)]])
        depth = np.linspace(first, last, 50)
        values = law(depth, found.limit, found.loss, found["shift"], found["last"])
        title = f"{case.title}: {found.limit:.2g} ± {found.limit_margin:.1g}"
        curves[title] = (mine.edge_length, mine.eigenvalue / unit)
        fitted[title] = (np.exp(-depth), values / unit)
    lines(
        curves,
        folder.figure("fits"),
        x="edge length at the end, in the numbers of the example",
        y="lowest eigenvalue, first mesh: ±1",
        xscale="log",
        markers=True,
        fits=fitted,
        title="The logarithmic loss of hold: fitted limits with 95 % intervals, force/length³",
    )


def _draw_grid(folder: Folder) -> None:
    grid = folder.read_table("grid")
    marks = folder.read_table("grid").assign(found=True)
    for bottom in BOTTOMS:
        mine = marks[marks.bottom == bottom]
        tables = {}
        for wall in sorted(grid.alpha_wall.unique()):
            square = np.full((len(TENSIONS), len(TENSIONS)), NO_CASE, dtype=object)
            for row in mine[mine.alpha_wall == wall].itertuples():
                square[TENSIONS.index(row.alpha_small), TENSIONS.index(row.alpha_large)] = row.label
            tables[f"α of the wall = {wall:g}"] = square
        shown = {name: color for name, color in COLORS.items() if (mine.label == name).any()}
        category_panels(
            TENSIONS,
            TENSIONS,
            tables,
            shown | {NO_CASE: "#F7F7F7"},
            folder.figure(f"grid-{bottom}"),
            marks={},
            xlabel="α of the larger patch",
            ylabel="α of the smaller patch",
            columns=5,
        )


def _draw_mesh(folder: Folder) -> None:
    """A graded mesh, whole and near one end, eight times and sixty-four times as large."""
    surface = folder.read_mesh(DRAWN)["at rest"]
    place = surface.vertices[ends(surface)[0]]
    parts = [_near(surface, place, surface.size / share) for share in (1, 8, 64)]
    titles = ("Fig. 4, held bottoms", "an end, 8 times as large", "64 times as large")
    graded_mesh(parts, folder.figure("graded"), titles)


def _near(surface: Surface, place: Floats, reach: float) -> Surface:
    """The roofs' triangles within a distance of a place."""
    roof = ~surface.walls[surface.patch_of_face]
    near = roof & (np.linalg.norm(surface.vertices[surface.faces] - place, axis=2).max(axis=1) <= reach)
    return with_triangles(surface, near)
