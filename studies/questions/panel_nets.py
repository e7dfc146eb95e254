"""Nets of panels as the panels get smaller: how planar they are, and how far from the surface.

On pieces of Delaunay's surfaces the lines of curvature are meridians and parallels: every panel is planar. On
Example 1 and on roofs from plans there are umbilics, and rims that are no lines of curvature cut the panels.
The mesh gets finer with the panels, so the orders are those of the panels. ``mean_size`` is √(area / panels).
``places`` tells where on the finest net a roof forbids it: umbilics, and panels that are not planar.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from generators import delaunay, two_squares
from pcmc import PanelNet, Surface, panel_net, solve
from pcmc.plan import Divider, Plan

from ..folder import Folder
from ..orders import slope
from ..study import Study
from .structure import Row, rounded

PLANAR = 1e-3  # distance of the diagonals over their length: a panel of glass bends so far
LEFT = 1e-4  # of planarity, and degrees: below it numbers are 0
TRIANGLES = 5  # edges of triangles along the edge of a panel, about
DRAWN = ("Example 1", "two halls", "L-roof")
HALLS = [[0, 0], [12, 0], [12, 8], [0, 8]]
L_SHAPE = [[0, 0], [12, 0], [12, 6], [6, 6], [6, 10], [0, 10]]


def _two_halls(size: float) -> Surface:
    patches = {"west": {"tension": 5.0}, "east": {"tension": 4.5}}
    wall = Divider([[6, 0], [6, 8]], wall=1.5)
    return solve(Plan(HALLS, [wall], edge_length=2.0 * size / TRIANGLES, patches=patches).surface()).surface


def _l_roof(size: float) -> Surface:
    return solve(Plan(L_SHAPE, edge_length=2.0 * size / TRIANGLES, tension=5.0).surface()).surface


SHAPES: dict[str, tuple[Callable[[float], Surface], tuple[float, ...]]] = {
    "unduloid": (lambda size: delaunay(size / TRIANGLES, exact=True), (0.4, 0.28, 0.2)),
    "neck": (lambda size: delaunay(size / TRIANGLES, centre="neck", exact=True), (0.4, 0.28, 0.2)),
    "nodoid": (lambda size: delaunay(size / TRIANGLES, waviness=1.6, exact=True), (0.4, 0.28, 0.2)),
    "Example 1": (
        lambda size: solve(two_squares(int(4.0 * TRIANGLES / size)), target="stationary").surface,
        (0.8, 0.57, 0.4),
    ),
    "two halls": (_two_halls, (1.4, 1.0, 0.7)),
    "L-roof": (_l_roof, (1.4, 1.0, 0.7)),
}


def data(folder: Folder, short: bool) -> None:
    """``records``: a row per shape and size; ``places``: where the finest nets are not as wished; meshes."""
    records: list[Row] = []
    places: list[Row] = []
    for name, (build, sizes) in SHAPES.items():
        for size in sizes[: 1 if short else None]:
            surface = build(size)
            net = panel_net(surface, size, anyway=True)
            row: Row = {"shape": name, "size": size, "triangles": surface.m, **_numbers(net)}
            if name in DRAWN:
                grid = panel_net(surface, size, "quads", anyway=True).panels
                row["grid_planarity"] = float(grid["planarity"].median())
            records.append(row)
        places += [{"shape": name, **place} for place in _places(net)]
        if name in DRAWN:
            folder.write_mesh(_key(name), {f"size {size:g}": surface})
    folder.write_table("records", rounded(records))
    folder.write_table("places", rounded(places))


def _numbers(net: PanelNet) -> Row:
    table, whole = net.panels, net.panels[net.panels["kind"] == "whole"]
    inside = net.nodes.loc[net.nodes["kind"] == "inside", "distance"]
    worst = [_few(float(one["planarity"].max())) for one in (table, whole)]
    kinds = table["kind"].value_counts()
    return {
        "panels": len(table),
        **{kind: int(kinds.get(kind, 0)) for kind in ("whole", "cut", "umbilic")},
        "umbilics": len(net.umbilics),
        "mean_size": float(np.sqrt(table["area"].sum() / len(table))),
        "not_planar": int((table["planarity"] > PLANAR).sum()),
        **dict(zip(("planarity", "planarity_whole"), worst, strict=True)),
        "node_distance": float(inside.max()),
        "panel_distance": float(whole["distance"].median()),
        "panel_distance_largest": float(table["distance"].max()),
        "turned": _few(float(table["turned"].mean())),
        "torsion": _few(float(net.beams["torsion"].max())),
        "covered": net.covered,
    }


def _key(name: str) -> str:
    return name.lower().replace(" ", "_").replace("-", "_")


def _few(value: float) -> float:
    """A number that is 0 where it is what iterations leave."""
    return value if value > LEFT else 0.0


def _places(net: PanelNet) -> list[Row]:
    """The umbilics, and the panels that are not planar."""
    rows: list[Row] = [{"what": "umbilic", **_at(place)} for place in net.umbilics]
    kind, planarity = net.panels["kind"].tolist(), net.panels["planarity"].to_numpy()
    for k in np.flatnonzero(planarity > PLANAR).tolist():
        middle = net.points[net.polygons[k]].mean(axis=0)
        rows.append({"what": f"{kind[k]} panel", **_at(middle), "planarity": float(planarity[k])})
    return rows


def _at(place: Any) -> Row:
    return {axis: round(float(x), 2) for axis, x in zip("xyz", place, strict=True)}


def table(folder: Folder) -> dict[str, float]:
    """``orders``: in the mean size of panels, of the distances of nodes and panels from the surface."""
    records, rows = folder.read_table("records"), []
    measured: dict[str, float] = {}
    for name, given in records.groupby("shape", sort=False):
        key = _key(str(name))
        mean_size, finest = given["mean_size"].to_numpy(), given.iloc[-1]
        columns = ("panel_distance", "node_distance")
        orders = {column: round(slope(mean_size, given[column].to_numpy()).order, 2) for column in columns}
        rows.append({"shape": str(name), **orders})
        measured |= {f"order_{column}_{key}": order for column, order in orders.items()}
        measured |= {f"{column}_{key}": float(finest[column]) for column in ("not_planar", "planarity")}
    folder.write_table("orders", pd.DataFrame(rows))
    return measured


def figure(folder: Folder) -> None:
    """The finest nets of Example 1 and of the roofs, coloured by planarity; distances against the size."""
    from pcmc.plot import lines, panel

    records = folder.read_table("records")
    curves: dict[str, Any] = {}
    for name, given in records.groupby("shape", sort=False):
        sizes, away = (given[column].to_numpy() for column in ("mean_size", "panel_distance"))
        curves[str(name)] = sizes / sizes[0], away / sizes
    ends = np.array([0.4, 1.0])
    curves["order 2 of the distance"] = ends, 0.05 * ends
    look: dict[str, Any] = {"xscale": "log", "yscale": "log", "markers": True}
    look |= {"x": "mean size of panels, over the first", "y": "distance over size"}
    lines(curves, folder.figure("distances"), title="Whole panels from the surface, in the median", **look)
    drawn = [name for name in DRAWN if (folder.path / f"{_key(name)}.pcmc").exists()]
    stages = [next(iter(folder.read_mesh(_key(name)).items())) for name in drawn]
    nets = [panel_net(surface, float(title.split()[1]), anyway=True) for title, surface in stages]
    percent = [100.0 * net.panels["planarity"].to_numpy()[net.mesh.patch_of_face] for net in nets]
    panel(
        [net.mesh for net in nets],
        folder.figure("nets"),
        views="plan",
        scalars=percent,
        titles=drawn,
        label="distance of the diagonals over their length, %",
        limits=(0.0, 1.0),
        cmap="YlGnBu",
        edges=False,
        supports=False,
        one_scale=False,
    )


STUDY = Study(
    "nets",
    "planar quads as they get smaller: planarity, distance from the surface, and where roofs forbid them",
    data,
    table,
    figure,
    parameters={"planar": PLANAR, "triangles": TRIANGLES},
    seconds=90,
    paper=False,
)
