"""Where junctions end: does the surface have a limit there as the mesh is refined, or does the mesh hold it?

Each example is solved on meshes that are graded towards the ends of its junctions, each with half the edge
length there of the one before: ten times with the bottoms of its walls sliding on Π, eight times with them
held; each equilibrium of Fig. 16's grid eight and five times. Where the outline is straight or a circle the
ends slide along it, too: with this natural condition nothing is left for the mesh to hold.
``corner_ladder`` has the theory of the hold and how it is fitted.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd

from generators import two_caps
from pcmc import Surface
from pcmc.solvers import solve_once
from pcmc.sweep import Sweep

from ..alpha_grid.grid import AXES, EDGE_LENGTH
from ..cases import run_sweep
from ..folder import Folder
from ..study import Study
from .cases import BOTTOMS, CASES, DRAWN, ROUND, Case
from .figures import figure
from .ladder import (
    JUMP,
    JUMP_NUMBERS,
    LOST,
    NONE,
    PERSISTS,
    SADDLE,
    SINKS,
    SUPPORTS,
    TURNS,
    climb,
    ends,
    free_ends,
    halved,
    label,
    loss,
    opening,
    polygon_steps,
    rise,
)

LEVELS = {"sliding": 10, "held": 8, "natural": 10}  # of refinement at the ends
GRID_LEVELS = {"sliding": 8, "held": 5}
REACH = 0.15  # of the size: what the first refinement reaches around an end
GRID_REACH = 1.5
SAMPLE = [[1.5, 6.0, 6.0], [4.0, 4.0, 3.0]]  # of the grid, where its equilibria are not at hand
SHIFTS = (0.0, 0.025, 0.05, 0.1, 0.2)  # of the ends, in half widths


def data(folder: Folder, short: bool) -> None:
    """``ladder``, a row per example, support, level; ``jumps``; ``ends``; ``shifted``; ``grid`` (Fig. 16)."""
    rows, at_ends, jumps = [], [], []
    for case in CASES[1::6] if short else CASES:
        initial = case.build()
        for bottom in SUPPORTS:
            if not _applies(initial, bottom):
                continue
            levels = 4 if short else LEVELS[bottom]
            found, reached = climb(initial, levels, REACH * initial.size, bottom, case.project)
            whose = {"case": case.name, "bottom": bottom}
            rows += [whose | row for row in found]
            at_ends += [whose | row for row in _ends(initial, reached[-1], found, levels, bottom)]
            for row in halved(found, reached, bottom, case.project):
                if case.project:
                    row |= polygon_steps(initial, row["level"], REACH * initial.size, bottom)
                jumps.append(whose | row)
            if case.name == DRAWN and bottom == "held":
                folder.write_mesh(DRAWN, {"at rest": reached[-1]})
    folder.write_table("ladder", pd.DataFrame(rows))
    folder.write_table("ends", pd.DataFrame(at_ends))
    folder.write_table("jumps", pd.DataFrame(jumps, columns=["case", "bottom", *JUMP]))
    shifted = [row for case in CASES if _is_straight(case.build()) for row in _shifted_ends(case)]
    folder.write_table("shifted", pd.DataFrame(shifted))
    sweep = Sweep(grid_case, {"tensions": _equilibria(folder, short), "bottom": list(BOTTOMS)})
    found_grid = run_sweep(folder, "grid", sweep)
    triples = pd.DataFrame(
        [v[0] if isinstance(v[0], list) else v for v in found_grid.pop("tensions")], columns=list(AXES)
    )
    columns = ["bottom", "label", "levels", "index", "eigenvalue", "last_eigenvalue", "height", "last_height"]
    folder.write_table("grid", pd.concat([triples, found_grid[columns].reset_index(drop=True)], axis=1))


def _applies(initial: Surface, bottom: str) -> bool:
    """Whether the bottoms of an example can have this support, and its ends a straight or round outline."""
    if bottom == "natural":
        return all(any(along[v] for _, along in free_ends(initial).on_line) for v in ends(initial))
    return bottom == "held" or bool(initial.on_plane.any())


def _is_straight(initial: Surface) -> bool:
    """Whether all ends are on straight parts of the outline."""
    return _applies(initial, "natural") and not free_ends(initial).on_circle


def _shifted_ends(case: Case) -> list[dict[str, Any]]:
    """At rest with the ends fixed at another place of their straight outline: energy, and pull along it.

    The pull is what the surface exerts on its ends, positive away from where they are drawn.
    """
    initial, rows = case.build(), []
    X, half = initial.vertices, float(np.abs(initial.vertices[:, 0]).max())
    for shift in SHIFTS:
        moved = X + np.outer(shift * half * (1.0 - (X[:, 0] / half) ** 2), [1.0, 0.0, 0.0])
        result = solve_once(initial.moved(moved), "newton", target="stationary")
        forces = result.certificate.reactions[ends(initial), 0]
        rows.append(
            {
                "case": case.name,
                "shift": shift,
                "status": result.status.name.lower(),
                "energy": result.energy if result.converged else math.nan,
                "pull": -float(forces.sum()) if result.converged else math.nan,
            }
        )
    return rows


def _ends(
    initial: Surface, reached: Surface, rows: list[dict[str, Any]], levels: int, bottom: str
) -> list[dict[str, Any]]:
    """A row for each end: where it is, what meets there, its label and the fits."""
    last = [row for row in rows if row["status"] == "converged"]
    shared = {"label": label(rows, levels, bottom), "levels": len(last)}
    edge = last[-1]["edge_length"] if last else math.nan
    return [
        {
            "end": int(vertex),
            **{axis: float(initial.vertices[vertex, k]) for k, axis in enumerate("xyz")},
            "opening": opening(initial, int(vertex)),
            "tensions": " ".join(f"{a:g}" for a in _tensions(initial, int(vertex))),
            **shared,
            "theory_c": _theory(initial, int(vertex)),
            **rise(reached, int(vertex), 3.0 * edge, 0.02 * initial.size),
        }
        for vertex in ends(initial)
    ]


def _tensions(surface: Surface, vertex: int) -> list[float]:
    """Of the roofs at an end, then of its wall."""
    patches = np.unique(surface.patch_of_face[(surface.faces == vertex).any(axis=1)])
    return [float(surface.tensions[k]) for k in sorted(patches, key=lambda k: (surface.walls[k], k))]


def _theory(surface: Surface, vertex: int) -> float:
    """c = α_w / (π α) for two roofs of one tension on a straight boundary; NaN elsewhere."""
    one, *others, wall = _tensions(surface, vertex)
    straight = abs(opening(surface, vertex) - 180.0) < 30.0  # the rim of a coarse disc is a polygon
    return wall / (math.pi * one) if straight and others == [one] else math.nan


def _equilibria(folder: Folder, short: bool) -> list[list[float]]:
    """The tensions (wall, large, small) at which ``alpha_grid_geometric`` finds an equilibrium."""
    beside = Folder(folder.path.parent / "alpha_grid_geometric")
    if short or not (beside.path / "finer.csv").is_file():
        return SAMPLE
    return [[float(v) for v in row] for row in beside.read_table("finer")[list(AXES)].to_numpy()]


def grid_case(tensions: list[float], bottom: str) -> dict[str, Any]:
    """Whether the equilibrium at tensions (wall, large, small) of the grid has a limit."""
    named = dict(zip(("wall", "large", "small"), tensions, strict=True))
    initial = two_caps(EDGE_LENGTH).retensioned(named)
    rows, _ = climb(initial, GRID_LEVELS[bottom], GRID_REACH, bottom, ROUND["example2_near"])
    known = [row for row in rows if row["status"] == "converged"] or rows
    return {
        "label": label(rows, GRID_LEVELS[bottom], bottom),
        "levels": len(known) if known is not rows or rows[-1]["status"] == "converged" else 0,
        "index": known[0]["index"],
        "eigenvalue": known[0]["eigenvalue"],
        "last_eigenvalue": known[-1]["eigenvalue"],
        "height": known[0]["height"],
        "last_height": known[-1]["height"],
    }


def table(folder: Folder) -> dict[str, float]:
    """``labels``: each example with its bottoms sliding and held, the loss of hold, and the limit."""
    ladder, at_ends, grid = (folder.read_table(name) for name in ("ladder", "ends", "grid"))
    rows = []
    for (name, bottom), mine in ladder.groupby(["case", "bottom"], sort=False):
        here = at_ends[(at_ends.case == name) & (at_ends.bottom == bottom)]
        known = mine[mine.status == "converged"]
        rows.append(
            {
                "case": name,
                "bottom": bottom,
                "opening": here.opening.mean(),
                "tensions": here.tensions.iloc[0],
                "label": here.label.iloc[0],
                "levels": len(known),
                "index": known["index"].iloc[0],
                "last_index": known["index"].iloc[-1],
                "eigenvalue": known.eigenvalue.iloc[0],
                "last_eigenvalue": known.eigenvalue.iloc[-1],
                **loss(known.to_dict("records"), here.rest.mean()),
                "c": here.c.mean(),
                "c_margin": here.c_margin.max(),
                "theory_c": here.theory_c.mean(),
                "rest": here.rest.mean(),
                "edge_at_rest": known.edge_length[known.pinched > 0].max(),
            }
        )
    labels = pd.DataFrame(rows)
    folder.write_table("labels", labels)
    counts = grid.groupby(["bottom", "label"]).size().rename("cases").reset_index()
    folder.write_table("grid_counts", counts)
    found = {
        f"grid_{row['bottom']}_{_short(row['label'])}": float(row["cases"])
        for row in counts.to_dict("records")
    }
    for row in folder.read_table("jumps").to_dict("records"):
        found |= {f"{row['case']}_{row['bottom']}_jump_{key}": float(row[key]) for key in JUMP_NUMBERS}
    for row in labels.to_dict("records"):
        found[f"{row['case']}_{row['bottom']}_levels"] = float(row["levels"])
        found[f"{row['case']}_{row['bottom']}_limit"] = float(row["limit"])
    return {key: value for key, value in found.items() if math.isfinite(value)}


def _short(name: str) -> str:
    short = {PERSISTS: "limit", SADDLE: "saddle", TURNS: "turns", LOST: "lost", SINKS: "sinks", NONE: "none"}
    return short[name]


STUDY = Study(
    "corners",
    "ends of junctions: which have a limit as the mesh gets finer, and which the mesh holds",
    data,
    table,
    figure,
    parameters={"levels": LEVELS, "grid_levels": GRID_LEVELS, "edge_length": EDGE_LENGTH},
    seconds=150,
    paper=False,
)
