"""Periodic surfaces in a cell: areas, orders and index, beside exact and printed values and Surface Evolver.

- Schwarz' P and D surfaces and the gyroid in their smallest cells, whose areas have a closed form. Ross 1992
  showed that P and D are stable where the volumes on both sides are kept. With the volumes free there is one
  way down.
- Kelvin's foam and that of Weaire and Phelan: the area of a bubble over volume^(2/3), printed as 5.306 and
  5.288.

``from_program`` is how far the area of the second mesh is from Surface Evolver's, in the torus of the cell,
after it took a Newton step of its own: relative to the area.

``free`` has cells whose size is free: that of Schwarz P under a suction of 1, where its energy c s² and
-s³ have a maximum together at s = 2c/3, and Kelvin's foam, whose box begins with sides of 1.1, 1 and 1/1.1
and keeps its volume: ``away`` is how far it ends from a cube.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from generators import kelvin_foam, minimal_cell, minimal_cell_area, weaire_phelan_foam
from pcmc import Patch, Room, Surface, certify, free_cell, solve
from pcmc.forces.functional import patch_areas
from pcmc.surface.images import lattice_of

from ..folder import Folder
from ..orders import limit_order, richardson, slope
from ..reference import evolver
from ..study import Study

BOX = np.diag([1.1, 1.0, 1.0 / 1.1])
SIDE = 2.0 / 3.0 * minimal_cell_area("P")
DRAWN = 1  # number of the mesh that is drawn and that Surface Evolver has, from the coarsest
PROGRAM = 'm 0\ng\nhessian_normal\nhessian\nprintf "A %.17g\\n", total_area'


@dataclass(frozen=True)
class Cell:
    """A periodic surface.

    Attributes
    ----------
    build : its start by level.
    levels : of its meshes.
    known : its normalised area: of a minimal surface in a cube of side 1, exact; of a foam that of a bubble
        over volume^(2/3), as printed.
    bubbles : in a cell; 0 for minimal surfaces.
    """

    name: str
    title: str
    build: Callable[[int], Surface]
    levels: tuple[int, ...]
    known: float
    bubbles: int = 0

    def normalised(self, surface: Surface) -> float:
        """The area of a surface, as ``known`` counts it."""
        volume, area = abs(float(np.linalg.det(lattice_of(surface)))), float(patch_areas(surface).sum())
        if not self.bubbles:
            return area / volume  # as many cells make up the cube
        return 2.0 * area / self.bubbles / (volume / self.bubbles) ** (2.0 / 3.0)


def _minimal(kind: str) -> Callable[[int], Surface]:
    return lambda level: minimal_cell(kind, level)


CELLS = (
    *(
        Cell(name, title, _minimal(kind), (1, 2, 3, 4), minimal_cell_area(kind))
        for name, title, kind in (
            ("schwarz_p", "Schwarz P", "P"),
            ("schwarz_d", "Schwarz D", "D"),
            ("gyroid", "gyroid", "G"),
        )
    ),
    Cell("kelvin", "Kelvin", kelvin_foam, (1, 2, 3, 4), 5.306, 1),
    Cell("weaire_phelan", "Weaire and Phelan", weaire_phelan_foam, (0, 1, 2, 3), 5.288, 8),
)


def data(folder: Folder, short: bool) -> None:
    """``records``: each cell on each mesh; the mesh that is drawn."""
    records: list[dict[str, Any]] = []
    for cell in CELLS:
        for number, level in enumerate(cell.levels[:3] if short else cell.levels):
            result = solve(cell.build(level), target="stationary")
            surface, found = result.surface, result.certificate
            row = {
                "cell": cell.name,
                "level": level,
                "triangles": surface.m,
                "status": result.status.name.lower(),
                "verdict": found.verdict.name.lower(),
                "residual": found.residual,
                "quality": found.quality,
                "area": cell.normalised(surface),
                "index": -1 if found.index is None else found.index,
                "index_at_volumes": -1 if found.index is None else found.index,
                "pressure_range": float(np.ptp(found.rooms["pressure"])) if surface.rooms else 0.0,
                "from_program": np.nan,
            }
            if not cell.bubbles:
                row["index_at_volumes"] = _index_at_volumes(surface) if number == DRAWN else -1
            if number == DRAWN:
                folder.write_mesh(cell.name, {"solved": surface})
                if evolver.available():
                    text = evolver.torus_datafile(surface)
                    area = float(evolver.numbers(evolver.run_datafile(text, PROGRAM), "A", 1)[-1, 0])
                    row["from_program"] = abs(float(patch_areas(surface).sum()) / area - 1.0)
            records.append(row)
    folder.write_table("records", pd.DataFrame(records))
    folder.write_table("free", pd.DataFrame([_free(*which) for which in _free_cells(short)]))


def _free_cells(short: bool) -> list[tuple[Cell, int]]:
    cells = [cell for cell in CELLS if cell.name in ("schwarz_p", "kelvin")]
    return [(cell, level) for cell in cells for level in cell.levels[: 3 if short else None]]


def _free(cell: Cell, level: int) -> dict[str, Any]:
    """A row of ``free``."""
    start = cell.build(level)
    if cell.bubbles:
        found = free_cell(start.rebuilt(vertices=start.vertices @ BOX))
        away = float(np.abs(BOX @ found.stretch - np.eye(3)).max())
    else:
        found = free_cell(start, -1.0, free="size")
        away = abs(float(found.stretch[0, 0]) / SIDE - 1.0)
    row = {"cell": cell.name, "level": level, "triangles": start.m, "area": cell.normalised(found.surface)}
    return row | {"away": away, "ways_down": found.ways_down, "solves": found.solves}


def _index_at_volumes(surface: Surface) -> int:
    """The index of a minimal surface among motions that keep the volumes on both sides."""
    half = 0.5 * abs(float(np.linalg.det(lattice_of(surface))))
    held = surface.rebuilt(rooms=[Room("inside", (("film", 1),), half)])
    index = certify(solve(held).surface).index
    return -1 if index is None else index


def table(folder: Folder) -> dict[str, float]:
    """``areas``: a row per cell with the limit of its area and the order it comes to that with."""
    records = folder.read_table("records")
    rows: list[dict[str, Any]] = []
    for cell in CELLS:
        mine = records[(records.cell == cell.name) & (records.status == "converged")]
        h, areas = 0.5 ** mine.level.to_numpy(float), mine.area.to_numpy()
        order = limit_order(h, areas) if cell.bubbles else slope(h, np.abs(areas - cell.known))
        limit = richardson(areas[-3:], (2, 4))
        rows.append(
            {
                "cell": cell.name,
                "triangles": int(mine.triangles.max()),
                "area": areas[-1],
                "limit": limit,
                "known": cell.known,
                "difference": limit - cell.known,
                "order": order.order,
                "standard_error": order.standard_error,
                "index": int(mine["index"].iloc[-1]),
                "index_at_volumes": int(mine.index_at_volumes.max()),
                "pressure_range": float(mine.pressure_range.iloc[-1]),
                "from_program": float(mine.from_program.max()),
            }
        )
    frame = pd.DataFrame(rows)
    folder.write_table("areas", frame)
    free = folder.read_table("free")
    side, box = (free[free.cell == name] for name in ("schwarz_p", "kelvin"))
    foam = frame[frame.cell.isin([cell.name for cell in CELLS if cell.bubbles])]
    minimal = frame.drop(foam.index)
    return {
        **{f"{key}_{row['cell']}": float(row[key]) for row in rows for key in ("limit", "order", "index")},
        **{f"index_at_volumes_{row['cell']}": float(row["index_at_volumes"]) for row in rows},
        "largest_difference_minimal": float(minimal.difference.abs().max()),
        "largest_difference_foams": float(foam.difference.abs().max()),
        "largest_difference_program": float(frame.from_program.max()),
        "pressure_weaire_phelan": float(foam.pressure_range.max()),
        "order_side": slope(0.5 ** side.level.to_numpy(float), side.away.to_numpy()).order,
        "side": float(side.away.iloc[-1]),
        "limit_free_kelvin": richardson(box.area.to_numpy()[-3:], (2, 4)),
        "away_from_cube": float(box.away.iloc[-1]),
        "ways_down_kelvin": float(box.ways_down.max()),
        "not_converged": float((records.status != "converged").sum()),
    }


def figure(folder: Folder) -> None:
    """A cube of each minimal surface, a bubble of Kelvin's foam, and the eight of Weaire and Phelan's."""
    from pcmc.plot import panel

    shown = [_shown(cell, folder.read_mesh(cell.name)["solved"]) for cell in CELLS]
    path, titles = folder.figure("cells"), [cell.title for cell in CELLS]
    panel(shown, path, views="diagonal", one_scale=False, supports=False, columns=3, titles=titles, width=960)


def _shown(cell: Cell, surface: Surface) -> Surface:
    """Copies of its hexagons in the cube, or of its films around the bubble at the origin; or the cell."""
    if cell.bubbles > 1:
        return surface
    T = lattice_of(surface)
    shifts = (np.argwhere(np.ones((7, 7, 7))) - 3.0) @ T
    groups = np.repeat(np.arange(8), surface.m // 8) if not cell.bubbles else surface.patch_of_face
    places, faces = list[Any](), list[Any]()
    for group in range(groups.max() + 1):
        own = surface.vertices[surface.faces[groups == group]]
        middle = own.mean(axis=(0, 1)) + shifts
        if cell.bubbles:  # between the origin and its nearest image
            there = np.linalg.norm(middle, axis=1)
            inside = there < there.min() + 1e-6
        else:
            inside = ((middle > -1e-6) & (middle < 1.0 - 1e-6)).all(axis=1)
        places += [own + shift for shift in shifts[inside]]
        faces += [len(own)] * int(inside.sum())
    corners = np.concatenate(places).reshape(-1, 3)
    _, first, number = np.unique(corners.round(6), axis=0, return_index=True, return_inverse=True)
    F, patch = number.reshape(-1, 3), np.repeat(np.arange(len(faces)) * bool(cell.bubbles), faces)
    films = tuple(Patch(f"film {k + 1}", 1.0, 0.0) for k in range(patch.max() + 1))
    return Surface(corners[first], F, patch, films, fixed=np.ones(len(first), dtype=bool))


STUDY = Study(
    "cells",
    "Schwarz P, D, the gyroid, Kelvin's foam and Weaire and Phelan's in their cells: area and index",
    data,
    table,
    figure,
    parameters={cell.name: {"levels": list(cell.levels)} for cell in CELLS},
    seconds=40,
    paper=False,
)
