"""Cables, weight, prescribed volumes, sliding planes and mirrors against their closed forms.

- Every closed form on finer and finer meshes: errors and fitted orders.
- A roof on four masts with edge cables; the tension that gives its flat form a sag.
- Tubes of prescribed volume: lengths at which they lose stability. A cap past the fold of its pressure.
- Each term beside Surface Evolver on the same mesh, with its Taylor slopes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

import pcmc
from generators import hypar_roof
from pcmc import Parameter, Target, mirrored, solve
from pcmc.base.arrays import Floats

from ..folder import Folder
from ..gallery.surfaces import bound
from ..orders import slope
from ..study import Study
from . import limits, terms
from .cases import CASES, SAG, TRIPLE_BUBBLE, Case, flat_roof

LEVELS, DRAWN = 4, 1  # meshes of a case; which of them is drawn
ROOF = 6, 12, 24  # squares along an edge of the roof on masts
SAGGING = 4, 8, 16  # of the flat roof whose edges are asked to sag
SIDES = ("south", "east", "north", "west")
DRAWN_AS = {"sag": "height", "lowest point": "height", "rise": "height", "area of a cell": "area"}
PRINTED = 13.128168244333  # area of three bubbles, as it is sometimes printed


def data(folder: Folder, short: bool) -> None:
    """Solve every case on every mesh, and the questions beside them."""
    rows: list[dict[str, Any]] = []
    for case in CASES:
        for level in range(2 if short else LEVELS):
            rows += _solved(folder, case, level)
    folder.write_table("records", pd.DataFrame(rows))
    folder.write_table("roof", roofs(folder, ROOF[: 1 if short else None]))
    folder.write_table("sag", sags(SAGGING[: 1 if short else None]))
    folder.write_table("lengths", limits.lengths(short))
    folder.write_table("branches", limits.branches(short))
    folder.write_table("folds", limits.folds(short))
    folder.write_table("terms", terms.table())


def _solved(folder: Folder, case: Case, level: int) -> list[dict[str, Any]]:
    """A row per quantity of the surface at rest on one mesh."""
    result = solve(case.mesh(level), target="stationary")
    surface, certificate = result.surface, result.certificate
    if level == DRAWN:
        folder.write_mesh(case.name, {"at rest": surface})
    area = certificate.patches.area.sum()
    about = {
        "example": case.name,
        "triangles": surface.m,
        "edge_length": float(area / surface.m * 4.0 / 3.0**0.5) ** 0.5,
        "status": result.status.name.lower(),
        "verdict": certificate.verdict.name.lower(),
        "index": certificate.index,
        "residual": bound(certificate.residual),
    }
    return [
        about | {"quantity": name, "value": round(value, 9), "exact": exact, "error": round(value - exact, 9)}
        for name, (value, exact) in case.values(surface).items()
    ]


def roofs(folder: Folder, meshes: tuple[int, ...]) -> pd.DataFrame:
    """A roof on four masts under a weight of 0.05: a row per cable, and what its supports carry."""
    tables = []
    for squares in meshes:
        result = solve(hypar_roof(squares, weight=0.05))
        certificate = result.certificate
        if squares == meshes[len(meshes) // 2]:
            folder.write_mesh("roof", {"at rest": result.surface})
        columns = ["cable", "tension", "length", "sheet_pull", "cable_pull"]
        tables.append(
            certificate.cables[columns].assign(
                squares=squares,
                gap=certificate.cables.sheet_pull - certificate.cables.cable_pull,
                verdict=certificate.verdict.name.lower(),
                index=certificate.index,
                weight=-certificate.load,
                supports=certificate.support,
            )
        )
    return pd.concat(tables, ignore_index=True).round(8)


def sags(meshes: tuple[int, ...]) -> pd.DataFrame:
    """The tension at which the flat roof's edges sag by 2 over their chord of 10; exact: 7.25."""
    rows = []
    for squares in meshes:
        targets = [Target("sag", side, SAG) for side in SIDES]
        vary = [Parameter(side, "cable") for side in SIDES]
        design = pcmc.meet(flat_roof(squares), targets, vary, tolerance=1e-9)
        missed = float(np.abs(design.targets.value - SAG).max())
        tension = float(design.parameters.value.mean())
        exact = (25.0 + SAG**2) / (2.0 * SAG)
        row = {"squares": squares, "met": design.met, "tension": round(tension, 8), "exact": exact}
        rows.append(row | {"sag_within": bound(max(missed, 1e-9))})
    return pd.DataFrame(rows)


def table(folder: Folder) -> dict[str, float]:
    """``orders``: a row per quantity and question, with its error on the finest mesh and its order."""
    records = folder.read_table("records")
    rows = [
        {
            "what": f"{name}, {quantity}",
            "status": mine.status.iloc[-1],
            "verdict": mine.verdict.iloc[-1],
            "index": mine["index"].iloc[-1],
            **_order(mine.edge_length, mine.value, mine.exact),
        }
        for (name, quantity), mine in records.groupby(["example", "quantity"], sort=False)
    ]
    sag, roof = folder.read_table("sag"), folder.read_table("roof")
    rows.append({"what": "edges, tension of a sag", **_order(1.0 / sag.squares, sag.tension, sag.exact)})
    south = roof[roof.cable == "south"]
    pulls = _order(1.0 / south.squares, south.sheet_pull, south.cable_pull)
    last = {"verdict": south.verdict.iloc[-1], "index": south["index"].iloc[-1]}
    rows.append({"what": "roof on masts, sheet against cable", **last, **pulls})
    for between, mine in folder.read_table("lengths").groupby("between", sort=False):
        rows.append(
            {"what": f"tube between {between}, length", **_order(mine.edge_length, mine.length, mine.theory)}
        )
    folds = folder.read_table("folds")
    for what, exact in (("volume", limits.HEMISPHERE), ("pressure", 2.0 * limits.ALPHA)):
        rows.append({"what": f"cap's fold, {what}", **_order(folds.edge_length, folds[what], exact)})
    orders = pd.DataFrame(rows)
    folder.write_table("orders", orders)
    compared = folder.read_table("terms")
    measured = {f"order {what}": float(order) for what, order in orders.set_index("what").order.items()}
    return measured | {
        "largest_energy_difference": compared.energy_within.max(),
        "largest_gradient_difference": compared.gradient_within.max(),
        "largest_volume_difference": compared.volume_within.max(),
        "three_bubbles_area": TRIPLE_BUBBLE,
        "three_bubbles_area_less_printed": TRIPLE_BUBBLE - PRINTED,
        "largest_index_on_branch": float(folder.read_table("branches")["index"].max()),
    }


def _order(h: Any, value: Any, exact: Any) -> dict[str, float]:
    """Value and error on the finest mesh, and the fitted order with its standard error."""
    h, value = np.asarray(h, dtype=float), np.asarray(value, dtype=float)
    exact = np.broadcast_to(np.asarray(exact, dtype=float), value.shape)
    error: Floats = np.abs(value - exact)
    fit = slope(h, error)
    return {
        "meshes": len(h),
        "value": value[-1],
        "exact": exact[-1],
        "error": value[-1] - exact[-1],
        "order": fit.order,
        "order_error": fit.standard_error,
    }


def figure(folder: Folder) -> None:
    """The surfaces, their errors, the cap's pressure against its volume."""
    from pcmc.plot import lines, panel

    from ..figure_panels import curve_panels

    records = folder.read_table("records")
    titles = {case.name: case.title for case in CASES} | {"roof": "roof on four masts"}
    shapes = {name: folder.read_mesh(name)["at rest"] for name in titles}
    shapes["schwarz_p"] = mirrored(shapes["schwarz_p"], ["x = 0", "y = 0", "z = 0"])
    panel(
        list(shapes.values()),
        folder.figure("surfaces"),
        titles=list(titles.values()),
        columns=3,
        one_scale=False,
        edges=False,
        width=1200,
        supports=False,
    )
    panels = {}
    for case in CASES:
        mine = records[records.example == case.name]
        curves = {
            DRAWN_AS.get(str(name), str(name)): (of.edge_length.to_numpy(), of.error.abs().to_numpy())
            for name, of in mine.groupby("quantity", sort=False)
        }
        h = np.unique(mine.edge_length)
        panels[case.title] = curves | {"h²: second order": (h, 0.1 * h**2)}
    curve_panels(panels, folder.figure("errors"), columns=4, xlabel="edge length", ylabel="error")
    branches = folder.read_table("branches")
    volumes = np.linspace(*limits.VOLUMES, 200)
    curves = {"exact": (volumes, limits.cap_pressure(volumes))}
    for edge_length, mine in branches.groupby("edge_length", sort=False):
        curves[f"edge length {edge_length:g}"] = (mine.volume.to_numpy(), mine.pressure.to_numpy())
    lines(
        curves,
        folder.figure("fold"),
        x="prescribed volume V",
        y="pressure p",
        title="A cap over the unit disc, α = 0.6: stable all along, past the largest pressure",
        dashes=True,
    )


STUDY = Study(
    "forces",
    "cables, weight, volumes, sliding planes, mirrors: closed forms, orders, the reference program",
    data,
    table,
    figure,
    parameters={"fineness": {case.name: case.fineness for case in CASES}, "levels": LEVELS, "sag": SAG},
    seconds=45,
    paper=False,
)
