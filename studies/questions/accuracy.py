"""What refinement where it pays saves: error bars against triangles, uniform and adaptive.

Each quantity's error bar is measured by the same mesh check on two ladders of meshes: uniform, every
triangle cut into four from mesh to mesh; and adaptive, as ``pcmc.solve_to_accuracy`` refines for that
quantity. Both start on the same coarse mesh. Two bars are compared: that of the value on the mesh, and
that of the extrapolated value. With linear elements the first one cannot fall faster than 1/triangles, and
a smooth sheet of constant mean curvature is bent alike everywhere: there even triangles are nearly the best
ones, and only what is lost at corners, holes and ends of junctions can be saved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from generators import bezier_hall, two_caps
from pcmc import Surface, check_mesh, solve
from pcmc.accuracy import AccurateResult, MeshCheck, solve_to_accuracy
from pcmc.accuracy.estimator import error_shares, evenness
from pcmc.base.arrays import Floats
from pcmc.meshing.held_curves import onto_held_curves
from pcmc.meshing.refinement import refine
from pcmc.plan import Divider, Hole, PatchSpec, Plan, circle

from ..examples.elevations import with_triangles
from ..figure_panels import graded_mesh
from ..folder import Folder
from ..orders import Order, slope
from ..study import Study

LEVELS = 4  # uniform meshes
MOST = 4_000  # triangles of an adaptive mesh
NEVER = 1e-12  # an accuracy that is not reached, so that the ladder goes on up to MOST
COLUMNS = ["value", "error", "limit", "limit_error", "order"]  # of a mesh check
LADDERS = ("uniform", "adaptive")
SHOWN = ("height", "area", "reaction")  # quantities in the figures
PLACES = {"corner": [3, 3], "north": [5, 20], "east": [20, 8]}  # of the roof's patches
BARS = {"error": "value on the mesh", "limit_error": "extrapolated value"}


def held_caps() -> Surface:
    """Example 2 with the bottom of its wall held: as printed, its corner is held by the mesh alone."""
    surface = printed_caps()
    held = surface.fixed | surface.on_plane
    return Surface(surface.vertices, surface.faces, surface.patch_of_face, surface.patches, fixed=held)


def printed_caps() -> Surface:
    """Example 2, whose wall slides on Π."""
    return two_caps(1.6)


def hall() -> Surface:
    """Example 4 on a coarse mesh."""
    return bezier_hall(14.0)


def roof() -> Surface:
    """The L-shaped roof of the notebooks, bottoms held, on a coarse mesh.

    At this edge length its round courtyard is an octagon, whose vertices turn by 45° and count as corners.
    """
    outline = [[0, 0], [24, 0], [24, 10], [10, 10], [10, 24], [0, 24]]
    middle, ends = [7.5, 7.5], ([10, 10], [0, 9.5096189432], [9.5096189432, 0])
    return Plan(
        outline,
        dividers=[Divider([middle, end], wall=1.0, bottom="held") for end in ends],
        holes=[Hole(circle([17, 5], 2.0), name="courtyard")],
        patches=[PatchSpec(name, 6.0, at=place) for name, place in PLACES.items()],
        edge_length=2.0,
    ).surface()


@dataclass(frozen=True)
class Family:
    """A surface, and the quantities whose error bars are followed."""

    name: str
    title: str
    build: Callable[[], Surface]
    quantities: Sequence[str]


FAMILIES = (
    Family("caps", "Example 2, bottom held", held_caps,
           ("reaction of wall", "height of large", "volume", "area of wall", "lowest eigenvalue")),
    Family("hall", "Example 4", hall,
           ("reaction of left wall", "height of middle", "volume", "area of left wall", "lowest eigenvalue")),
    Family("roof", "L-shaped roof", roof,
           ("reaction of wall 1", "height of north", "volume", "area of wall 1", "lowest eigenvalue")),
)  # fmt: skip
DRAWN = ("roof", "reaction of wall 1")  # whose adaptive mesh is drawn near the re-entrant corner
CORNER = np.array([10.0, 10.0, 0.0])


def data(folder: Folder, short: bool) -> None:
    """``bars``: each bar on each mesh of both ladders; ``printed``: Example 2 as printed."""
    rows = []
    for family in FAMILIES:
        rows += _uniform(family, 2 if short else LEVELS)
        for name in family.quantities[: 1 if short else None]:
            found = adaptive(family, name, 700 if short else MOST)
            rows += _adaptive(family, name, found)
            if (family.name, name) == DRAWN:
                folder.write_mesh("graded", {"at rest": found.surface})
    folder.write_table("bars", pd.DataFrame(rows))
    found = solve_to_accuracy(printed_caps(), "height=1e-2", most_triangles=MOST)
    ending = {"status": found.status.name.lower(), "rounds": len(found.surfaces), "message": found.message}
    folder.write_table("printed", pd.DataFrame([ending]))


def adaptive(family: Family, name: str, most: int) -> AccurateResult:
    """Meshes refined for one quantity, up to ``most`` triangles.

    Their curves are those of the uniform meshes, given as a function: guessed ones are never known as well as
    NEVER asks for.
    """
    start = family.build()
    return solve_to_accuracy(start, {name: NEVER}, most_triangles=most, boundary=onto_held_curves(start))


def _uniform(family: Family, levels: int) -> list[dict[str, Any]]:
    """The bars of all quantities on uniform meshes."""
    surface, rows = family.build(), []
    project = onto_held_curves(surface)
    for _ in range(levels):
        result = solve(surface)
        check = check_mesh(result, boundary=project)
        rows += [_row(family, name, check) for name in family.quantities]
        surface = refine(result.surface, 1, project)
    return rows


def _adaptive(family: Family, name: str, found: AccurateResult) -> list[dict[str, Any]]:
    """The bars of one quantity on the meshes made for it."""
    place = {"family": family.name, "quantity": name, "meshes": "adaptive"}
    rows = found.history[["triangles", "verdict", *COLUMNS]].to_dict("records")
    return [place | {str(key): value for key, value in row.items()} for row in rows]


def _row(family: Family, name: str, check: MeshCheck) -> dict[str, Any]:
    """A quantity on a uniform mesh, and how even its triangles' shares in the error are."""
    quantity, _, of = name.partition(" of ")
    coarse, fine = check.surfaces[:2]
    even = evenness(error_shares(coarse, fine, {(quantity, of): 1.0}))
    place = {"family": family.name, "quantity": name, "meshes": "uniform", "evenness": even}
    numbers = {"triangles": check.surfaces[0].m, "verdict": check.verdict.name.lower()}
    measured = check.row(quantity, of)
    return place | numbers | {column: float(measured[column]) for column in COLUMNS}


def table(folder: Folder) -> dict[str, float]:
    """``savings``: triangles for the same bar; ``orders``: of the bars and the errors in 1/√triangles."""
    bars = folder.read_table("bars")
    savings: list[dict[str, Any]] = []
    orders: list[dict[str, Any]] = []
    for (family, name), mine in bars.groupby(["family", "quantity"], sort=False):
        uniform, adaptive = (mine[mine.meshes == kind] for kind in LADDERS)
        if not len(adaptive):  # in a short run
            continue
        place, best = {"family": family, "quantity": name}, _best_limit(mine)
        for kind, rows in zip(LADDERS, (uniform, adaptive), strict=True):
            orders.append(place | {"meshes": kind} | _orders(rows, best))
        for bar, of in BARS.items():
            savings.append(place | {"bar_of": of} | _saving(uniform, adaptive, bar))
    folder.write_table("savings", pd.DataFrame(savings))
    folder.write_table("orders", pd.DataFrame(orders))
    on_mesh = [row for row in savings if row["bar_of"] == BARS["error"]]
    return {
        "bars": float(len(savings)),
        "bars_worse": float(sum(row["saving"] < 1.0 for row in savings)),
        "least_saving": min(row["saving"] for row in savings),
        "bars_on_mesh": float(len(on_mesh)),
        "above_estimate": float(sum(row["saving"] > row["estimated"] for row in on_mesh)),
        "most_over_estimate": max(row["saving"] / row["estimated"] for row in on_mesh),
    } | {
        "_".join(str(row[key]).replace(" ", "_") for key in ("family", "quantity", "bar_of")): row["saving"]
        for row in savings
    }


def _best_limit(rows: pd.DataFrame) -> float:
    """The extrapolated value with the smallest bar."""
    known = rows[np.isfinite(rows.limit_error)]
    return float(known.limit.to_numpy()[known.limit_error.argmin()]) if len(known) else float("nan")


def _orders(rows: pd.DataFrame, limit: float) -> dict[str, float]:
    """Orders in 1/√triangles of the distance from the best limit, without the first mesh, and of the bar."""
    h = 1.0 / np.sqrt(rows.triangles.to_numpy(dtype=float))
    found: dict[str, Order] = {
        "error": slope(h[1:], np.abs(rows.value.to_numpy(dtype=float) - limit)[1:]),
        "bar": slope(h[1:], rows.error.to_numpy(dtype=float)[1:]),
    }
    return {f"{what}_{key}": value for what, fit in found.items() for key, value in _fit(fit).items()}


def _fit(fit: Order) -> dict[str, float]:
    return {"order": fit.order, "standard_error": fit.standard_error}


def _saving(uniform: pd.DataFrame, adaptive: pd.DataFrame, bar: str) -> dict[str, float]:
    """Triangles at the smallest bar that both ladders reach, between meshes by interpolation.

    ``estimated`` is what linear elements save if all shares η of the error become equal: m Σ η / (Σ √η)² on
    the finest uniform mesh. It is an estimate for the value on the mesh, no bound: bars are estimates, too.
    """
    level = max(rows[bar][np.isfinite(rows[bar])].min() for rows in (uniform, adaptive))
    many, few = (_triangles_at(rows, bar, level) for rows in (uniform, adaptive))
    estimated = 1.0 / float(uniform.evenness.iloc[-1])
    return {"bar": level, "uniform": many, "adaptive": few, "saving": many / few, "estimated": estimated}


def _triangles_at(rows: pd.DataFrame, bar: str, level: float) -> float:
    """Triangles at which the bar first comes down to a level: a straight line in both logarithms."""
    known = rows[np.isfinite(rows[bar])]
    m, bars = known.triangles.to_numpy(dtype=float), known[bar].to_numpy(dtype=float)
    k = int(np.argmax(bars <= level))
    if k == 0:
        return float(m[0])
    share = np.log(bars[k - 1] / level) / np.log(bars[k - 1] / bars[k])
    return float(m[k - 1] * (m[k] / m[k - 1]) ** share)


def figure(folder: Folder) -> None:
    """The bars against triangles, and the mesh at the re-entrant corner."""
    from pcmc.plot import lines

    bars = folder.read_table("bars")
    for family in FAMILIES:
        for bar, of in BARS.items():
            curves: dict[str, tuple[Floats, Floats]] = {}
            for name in (n for n in family.quantities if n.startswith(SHOWN)):
                both = bars[(bars.family == family.name) & (bars.quantity == name)]
                for kind, mine in both.groupby("meshes", sort=False):
                    relative = mine[bar].to_numpy() / abs(_best_limit(both))
                    curves[f"{name}, {kind}"] = (mine.triangles.to_numpy(), relative)
            lines(
                curves,
                folder.figure(f"{family.name}-{'mesh' if bar == 'error' else 'limit'}"),
                x="triangles",
                y="error bar / limit",
                title=f"{family.title}: error bar of the {of}",
                xscale="log",
                yscale="log",
                markers=True,
            )
    surface = folder.read_mesh("graded")["at rest"]
    parts = [_near(surface, surface.size / share) for share in (1, 8, 64)]
    titles = ("made for the reaction of a wall", "re-entrant corner, 8 times as large", "64 times as large")
    graded_mesh(parts, folder.figure("graded"), titles)


def _near(surface: Surface, reach: float) -> Surface:
    """The roofs' triangles with a vertex this near to the re-entrant corner, seen from above."""
    roof = ~surface.walls[surface.patch_of_face]
    away = np.linalg.norm((surface.vertices - CORNER)[:, :2], axis=1)
    near = roof & (away[surface.faces].min(axis=1) <= reach)
    return with_triangles(surface, near)


STUDY = Study(
    "accuracy",
    "refinement where it pays: error bars against triangles, uniform and adaptive",
    data,
    table,
    figure,
    parameters={
        "levels": LEVELS,
        "most_triangles": MOST,
        "quantities": {f.name: f.quantities for f in FAMILIES},
    },
    seconds=120,
    paper=False,
)
