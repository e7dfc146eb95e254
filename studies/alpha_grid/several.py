"""How many equilibria the cells of Fig. 16 have, and their indices.

For the wall of Example 2 (tension 4) every cell in which an equilibrium is found from the initial shape is
searched along the branch in pressure. What is found there is solved once more with each triangle cut in four.
The mesh of the grid is coarse: an equilibrium that is lost on finer triangles, or has another index there, is
the mesh's own. Surface Evolver counts the negative eigenvalues of each.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from pcmc import Surface, find_equilibria
from pcmc.base.errors import SurfaceError
from pcmc.equilibria import shape_distance
from pcmc.forces.functional import patch_areas
from pcmc.meshing.refinement import refine
from pcmc.solvers import solve_once

from ..folder import Folder
from ..reference import evolver
from ..study import Study
from .branches import PATCHES, balanced, equilibrium, initial
from .grid import AXES, EDGE_LENGTH, TENSIONS

WALL, SPAN = 4.0, (0.7, 1.3)  # the tension of the wall; of the pressure, as a share
SHORT = (4.0, 5.0)  # tensions of the patches in a short run


def data(folder: Folder, short: bool) -> None:
    """``records``: a row for each equilibrium of each cell; ``failed``: what of the searches did not work."""
    rows: list[dict[str, Any]] = []
    failed: list[dict[str, Any]] = []
    for large in SHORT if short else TENSIONS:
        for small in SHORT if short else TENSIONS:
            cell = np.array([WALL, large, small])
            if not (balanced(cell) and equilibrium(cell, EDGE_LENGTH).converged):
                continue
            named = dict(zip(AXES, cell.tolist(), strict=True))
            start = initial(EDGE_LENGTH).retensioned(dict(zip(PATCHES, cell.tolist(), strict=True)))
            found = find_equilibria(start, "pressure", starts=0, span=SPAN)
            for number, one in enumerate(found.found, 1):
                index, height = _finer(one.surface)
                rows.append(
                    named
                    | {
                        "number": number,
                        "index": one.index,
                        "evolver": evolver.inertia(one.surface).negative if evolver.available() else -1,
                        "energy": one.energy,
                        "height": one.height,
                        "quality": one.certificate.quality,
                        "resting": len(one.certificate.pinched),
                        "finer_index": index,
                        "finer_height": height,
                        "found": one.found,
                    }
                )
            failed += [named | {"failed": sentence} for sentence in found.failed]
    folder.write_table("records", pd.DataFrame(rows))
    folder.write_table("failed", pd.DataFrame(failed, columns=[*AXES, "failed"]))


def _finer(surface: Surface) -> tuple[int, float]:
    """Index and height with each triangle cut in four; -1 and NaN where that leads away, or to none."""
    try:
        result = solve_once(refine(surface), target="stationary")
    except SurfaceError:  # a wall that lies on Π has no triangles to cut
        return -1, np.nan
    edge = (4.0 / 3.0**0.5 * patch_areas(surface).sum() / surface.m) ** 0.5
    if not result.converged or shape_distance(surface, result.surface) > edge:
        return -1, np.nan
    index = result.certificate.index
    return -1 if index is None else index, float(surface.plane.height(result.surface.vertices).max())


def table(folder: Folder) -> dict[str, float]:
    """``cells``: how many equilibria each cell has, by index, and how many finer triangles keep."""
    records = folder.read_table("records")
    kept = records["index"] == records.finer_index
    records = records.assign(minima=records["index"] == 0, saddles=records["index"] > 0, kept=kept)
    counts = records.groupby(list(AXES))[["minima", "saddles", "kept"]].sum().reset_index()
    folder.write_table("cells", counts)
    every = counts.minima + counts.saddles
    return {
        "cells": float(len(counts)),
        "several": float((every > 1).sum()),
        "several_kept": float((counts.kept > 1).sum()),
        "equilibria": float(len(records)),
        "saddles": float(records.saddles.sum()),
        "kept": float(records.kept.sum()),
        "indices_as_evolver": float((records["index"] == records.evolver).sum()),
    }


def figure(folder: Folder) -> None:
    """The height of each equilibrium; hollow where finer triangles do not keep it."""
    from pcmc.plot.figure import SMALL, finish, new, style

    records = folder.read_table("records")
    canvas = new(900, 380)
    axes = style(canvas.add_subplot())
    names = []
    for k, (cell, mine) in enumerate(records.groupby(list(AXES))):
        names.append(f"{cell[1]:g}, {cell[2]:g}")
        for row in mine.to_dict("records"):
            colour = "C0" if row["index"] == 0 else "C3"
            face = colour if row["index"] == row["finer_index"] else "none"
            axes.plot(k, row["height"], "o", color=colour, markerfacecolor=face, markersize=7)
    for colour, face, label in (("C0", "C0", "minimum"), ("C3", "C3", "saddle"),
                                ("black", "white", "not so on finer triangles")):  # fmt: skip
        axes.plot([], [], "o", color=colour, markerfacecolor=face, label=label)
    axes.set_xticks(range(len(names)), names)
    axes.set_xlabel("tensions of the larger and the smaller patch", fontsize=SMALL)
    axes.set_ylabel("height", fontsize=SMALL)
    axes.legend(fontsize=SMALL, frameon=False)
    finish(canvas, folder.figure("cells"))


STUDY = Study(
    "alpha_grid_equilibria",
    "cells of Fig. 16 with more than one equilibrium, with their indices",
    data,
    table,
    figure,
    parameters={"wall": WALL, "span": SPAN, "edge_length": EDGE_LENGTH},
    seconds=180,
    paper=False,
)
