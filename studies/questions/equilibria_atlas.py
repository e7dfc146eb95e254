"""Every equilibrium of surfaces in closed form, with their indices, energies and barriers, on several meshes.

- Over a circle stand two caps of one sphere; the barrier out of the small one is E(large) - E(small).
- Between two rings hang two catenoids; the wide one breaks into two discs over the deep one. The branch
  leads to the deep one with long triangles at its neck, and it is solved again on a new mesh. These meshes
  are no family, so errors fall with the edge length, but not with one order, and change sign on the finest.
- In Enneper's wire of radius 1.2 hang three surfaces; Enneper's is the pass between the two others.
- Two unduloids leave the cylinder at L = 2πR and lean back over the shorter cylinder of length 6 R.
- Two caps over unit circles share a volume. Beyond hemispheres equal ones are the pass between two pairs of a
  small and a large cap, whose heights h and 1/h belong to one sphere.
- In Example 3 of the paper, with weaker walls, those of one diameter lean to either side.

Surface Evolver counts the negative eigenvalues of each on the same mesh, and has its energy, before and after
a Newton step of its own: that leaves an equilibrium where it is, a saddle, too.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from generators import (
    catenoid,
    catenoid_exact,
    cylinder,
    cylinder_exact,
    enneper,
    enneper_exact,
    four_fans,
    spherical_cap,
    spherical_cap_exact,
)
from pcmc import BoundaryMotion, Direction, Equilibria, Surface, find_equilibria, solve
from pcmc.equilibria import FoundEquilibrium

from ..folder import Folder
from ..orders import slope
from ..reference import evolver
from ..study import Study
from .bifurcations import file_name, two_caps

LENGTH, WIRE = 6.0, 1.2  # of the cylinder; radius of Enneper's wire
VOLUME = 8.0  # of two caps; of hemispheres 4π/3
WALLS = {"wall 1": 0.99, "wall 2": 1.5, "wall 3": 0.99, "wall 4": 1.5}  # tensions in Example 3
NEWTON = "hessian_normal on\nhessian\n"
EDGES = {  # of the meshes of each case; the last is drawn
    "caps": (0.25, 0.125, 0.0833),
    "catenoids": (0.35, 0.175, 0.0875, 0.0583),
    "Enneper": (0.3, 0.15),
    "cylinder": (2.0 * np.pi / 14, 2.0 * np.pi / 28),
    "two caps": (0.25, 0.125, 0.0833),
    "Example 3": (20.0 / 7,),
}


def _caps_of_volume() -> dict[int, float]:
    """Areas of two caps that have the volume together: of a small and a large one, and of equal ones."""

    def volume(h: float) -> float:
        return np.pi * h * (3.0 + h * h) / 6.0

    unequal = float(brentq(lambda h: volume(h) + volume(1.0 / h) - VOLUME, 0.1, 1.0))
    equal = float(brentq(lambda h: 2.0 * volume(h) - VOLUME, 0.1, 3.0))
    return {0: np.pi * (2.0 + unequal**2 + unequal**-2), 1: 2.0 * np.pi * (1.0 + equal**2)}


EXACT: dict[str, dict[int, float]] = {  # energies by index
    "caps": {0: spherical_cap_exact().energy, 1: spherical_cap_exact(upper=True).energy},
    "catenoids": {0: catenoid_exact().energy, 1: catenoid_exact(deep=True).energy},
    "Enneper": {1: enneper_exact(radius=WIRE).area},
    "cylinder": {1: cylinder_exact(length=LENGTH).energy},
    "two caps": _caps_of_volume(),
    "Example 3": {},
}


def _rings(film: Surface, start: float) -> BoundaryMotion:
    """Two rings about the origin, λ the height of the upper one."""
    x, y, z = film.vertices[film.fixed].T
    return BoundaryMotion(lambda h: np.stack([x, y, np.sign(z) * h], axis=1), start)


def _caps(edge: float) -> Equilibria:
    return find_equilibria(spherical_cap(edge), starts=2)


def _catenoids(edge: float) -> Equilibria:
    film = catenoid(edge)
    return find_equilibria(film, _rings(film, 0.5), starts=0)


def _enneper(edge: float) -> Equilibria:
    return find_equilibria(solve(enneper(edge, radius=WIRE), target="stationary"), (), starts=0)


def _cylinder(edge: float) -> Equilibria:
    tube = cylinder(edge, length=LENGTH, exact=True)
    tube = solve(tube.moved(tube.vertices - [0.0, 0.0, 0.5 * LENGTH]), target="stationary").surface
    return find_equilibria(tube, _rings(tube, 0.5 * LENGTH), starts=0, span=(2.9, 3.3))


def _two_caps(edge: float) -> Equilibria:
    caps = solve(two_caps(edge, VOLUME, VOLUME), target="stationary")
    return find_equilibria(caps, "volume", starts=0, span=(0.5, 1.1))


def _walls(edge: float) -> Equilibria:
    roof = solve(four_fans(round(20.0 / edge)).retensioned(WALLS), target="stationary")
    one_diameter = Direction({"wall 1": 1.0, "wall 3": 1.0})
    return find_equilibria(roof, one_diameter, starts=0, span=(0.6, 2.3))


SEARCHES: dict[str, Callable[[float], Equilibria]] = {
    "caps": _caps,
    "catenoids": _catenoids,
    "Enneper": _enneper,
    "cylinder": _cylinder,
    "two caps": _two_caps,
    "Example 3": _walls,
}


def _by_evolver(one: FoundEquilibrium) -> tuple[float, float]:
    """How far the program's energy is from ours, relative, as it is and after a Newton step of its own."""
    if not evolver.available():
        return np.nan, np.nan
    as_is, after = (evolver.energy(one.surface, steps) for steps in ("", NEWTON))
    return abs(as_is / one.energy - 1.0), abs(after / one.energy - 1.0)


def data(folder: Folder, short: bool) -> None:
    """Search on each mesh; the surfaces of the first mesh are kept for the figure."""
    rows: list[dict[str, Any]] = []
    turns: list[dict[str, Any]] = []
    for case, search in SEARCHES.items():
        for edge in EDGES[case][:1] if short else EDGES[case]:
            found = search(edge)
            for k, one in enumerate(found.found, 1):
                barrier = min((b.energy for b in found.barriers if b.start == k), default=np.nan)
                ends = ", ".join(b.end or f"to {b.to}" for b in found.barriers if b.start == k)
                same, after = _by_evolver(one)
                inertia = evolver.inertia(one.surface).negative if evolver.available() else -1
                rows.append(
                    {
                        "case": case,
                        "edge_length": edge,
                        "number": k,
                        "index": one.index,
                        "evolver": inertia,
                        "evolver_energy": same,
                        "evolver_step": after,
                        "triangles": one.surface.m,
                        "quality": one.certificate.quality,
                        "energy": one.energy,
                        "exact": EXACT[case].get(one.index, np.nan),
                        "barrier": barrier,
                        "beyond": ends,
                    }
                )
            for branches in found.branches.values():
                first = branches[0]
                places = first.folds if first.bifurcations.empty else first.bifurcations
                place = float(places.parameter.iloc[0]) if len(places) else np.nan
                place *= VOLUME if case == "two caps" else 1.0
                turns.append({"case": case, "edge_length": edge, "place": place})
            if edge == EDGES[case][0]:
                for k, one in enumerate(found.found, 1):
                    folder.write_mesh(file_name(f"{case}-{k}"), {"at rest": one.surface})
    folder.write_table("records", pd.DataFrame(rows))
    folder.write_table("places", pd.DataFrame(turns))


def _key(case: str, what: str) -> str:
    return f"{case}_{what}".lower().replace(" ", "_")


def table(folder: Folder) -> dict[str, float]:
    """Numbers of equilibria, agreement with Evolver, barriers with order, and where branches turn."""
    records, places = folder.read_table("records"), folder.read_table("places")
    measured = {
        "equilibria": float(len(records)),
        "saddles": float((records["index"] > 0).sum()),
        "indices_as_evolver": float((records["index"] == records.evolver).sum()),
        "evolver_energy": float(records.evolver_energy.max()),
        "evolver_step": float(records.evolver_step.max()),
    }
    rows = []
    for case, exact in EXACT.items():
        mine = records[(records.case == case) & (records["index"] == 0) & (records.number == 1)]
        measured[_key(case, "count")] = float(records[records.case == case].number.max())
        if {0, 1} <= exact.keys() and len(mine) > 2:
            error = mine.barrier.to_numpy() - (exact[1] - exact[0])
            h = mine.edge_length.to_numpy()
            ratio, fit = (h[-2] / h[-1]) ** 2, slope(h, np.abs(error))
            row = {
                "case": case,
                "barrier": exact[1] - exact[0],
                "finest": mine.barrier.iloc[-1],
                "limit": mine.barrier.iloc[-1] + (error[-1] - error[-2]) / (ratio - 1.0),
                "order": fit.order,
                "order_error": fit.standard_error,
            }
            rows.append(row)
            for key in ("barrier", "finest", "limit", "order"):
                measured[_key(case, key)] = float(row[key])
    folder.write_table("barriers", pd.DataFrame(rows))
    for case in EDGES:
        mine = places[places.case == case]
        if mine.empty:
            continue
        place, h = mine.place.to_numpy(), mine.edge_length.to_numpy()
        measured[_key(case, "place")] = float(place[-1])
        if len(place) > 1:
            limit = place[-1] + (place[-1] - place[-2]) / ((h[-2] / h[-1]) ** 2 - 1.0)
            measured[_key(case, "place_limit")] = float(limit)
    return measured


def figure(folder: Folder) -> None:
    """The atlas: every equilibrium of the coarsest mesh, with its index."""
    from pcmc.plot import panel

    records = folder.read_table("records")
    shapes, titles = [], []
    for case in EDGES:
        mine = records[records.case == case]
        mine = mine[mine.edge_length == mine.edge_length.max()]
        for row in mine.to_dict("records"):
            shapes.append(folder.read_mesh(file_name(f"{case}-{row['number']}"))["at rest"])
            titles.append(f"{case} {row['number']}: index {row['index']}")
    panel(
        shapes, folder.figure("atlas"), columns=4, titles=titles, supports=False, one_scale=False, width=820
    )


STUDY = Study(
    "equilibria_atlas",
    "every equilibrium of surfaces in closed form, and the barriers between them",
    data,
    table,
    figure,
    parameters={"edges": EDGES, "length": LENGTH, "wire": WIRE, "volume": VOLUME, "walls": WALLS},
    seconds=190,
    paper=False,
)
