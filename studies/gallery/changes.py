"""Where the index of an exact surface changes, and the branches that leave Enneper's surface there.

- A cylinder between fixed rings under given pressure: the mode sin(kπz/L) has the second variation
  α ((kπ/L)² - 1/R²), so the index grows at L = kπR. The vertices stay on the cylinder while its length
  changes, under the pressure that keeps this mesh at rest, and each eigenvalue's zero is located. (A branch
  under one pressure would not do at k = 1: there the cylinders cross a branch of unduloids whose bulge
  grows with the length, a crossing that no symmetry of a mesh protects. The mesh's own branch turns just
  before it.)
- A catenoid between rings that move apart: the branch folds at h = 0.6627434 R.
- Enneper's surface as its wire widens: at R = 1 the branch meets two others, mirror images of each other.
  They are followed, and their areas compared.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from generators import (
    catenoid,
    catenoid_fold,
    cylinder,
    enneper,
    enneper_exact,
    enneper_wire,
)
from pcmc import BoundaryMotion, certify, follow, mean_curvature, solve
from pcmc.base.arrays import Floats
from pcmc.meshing.remeshing import remesh
from pcmc.solvers.continuation import Branch

from ..folder import Folder
from ..orders import slope

AROUND = (14, 28, 56, 112)  # segments around a cylinder
WAVES = (1, 2, 3)
RINGS = (21, 41, 82, 164)  # segments around a catenoid
START = 0.5  # half-distance of the catenoid's rings where the branch starts
STEPS = (5, 10, 20, 40)  # rings of triangles of Enneper's surface
NARROW, WIDE = 0.85, 1.25  # radius of Enneper's wire where the branches start and end
COMPARED = (1.2,)  # radii at which the three areas are compared
DIAGRAM, PICTURED = 20, 10  # rings of the meshes of the diagram and of the pictures
JOINTS = (("Enneper", 0), ("Enneper", 1), ("one", 0), ("other", 0))  # branches and indices that meet
WIRES = {"Enneper": "Enneper's surface, a saddle", "one": "less area, stable", "other": "its image"}
PARAMETERS = {
    "around": AROUND,
    "waves": WAVES,
    "rings": RINGS,
    "catenoid_start": START,
    "enneper_rings": STEPS,
    "radii": (NARROW, WIDE),
    "compared": COMPARED,
}


def data(folder: Folder, short: bool) -> None:
    """Locate every change of index on every mesh, and follow Enneper's branches."""
    rows: list[dict[str, Any]] = []
    for around in AROUND[:3] if short else AROUND:
        for k in WAVES:
            found = _cylinder_length(around, k)
            rows.append(_row(_length(k), 2.0 * np.pi / around, found, k * np.pi))
    for around in RINGS[:3] if short else RINGS:
        branch = _catenoids(around)
        rows.append(_row("catenoid, fold", 2.0 * np.pi / around, branch.folds.parameter[0], catenoid_fold()))
        change = branch.events[branch.events.kind == "index"].parameter.iloc[0]
        rows.append(_row("catenoid, index", 2.0 * np.pi / around, change, catenoid_fold()))
    areas: list[dict[str, Any]] = []
    for rings in STEPS[:3] if short else STEPS:
        branch = _ennepers(rings)
        rows.append(_row("Enneper, R = 1", 1.0 / rings, branch.bifurcations.parameter.iloc[0], 1.0))
        _compare(folder, branch, rings, areas)
    folder.write_table("change_records", pd.DataFrame(rows))
    folder.write_table("enneper_areas", pd.DataFrame(areas))


def _length(k: int) -> str:
    return f"cylinder, L = {k if k > 1 else ''}πR"


def _row(name: str, edge_length: float, found: float, theory: float) -> dict[str, Any]:
    return {
        "change": name,
        "edge_length": edge_length,
        "found": found,
        "theory": theory,
        "error": found - theory,
    }


def _cylinder_length(around: int, k: int) -> float:
    """Length at which the k-th eigenvalue of a cylinder of radius 1 passes 0."""
    mesh = cylinder(2.0 * np.pi / around, length=k * np.pi, exact=True)

    def eigenvalue(length: float) -> float:
        stretched = mesh.moved(mesh.vertices * [1.0, 1.0, length / (k * np.pi)])
        pressure = 2.0 * float(np.nanmean(mean_curvature(stretched, method="variational")))
        return float(certify(stretched.retensioned(pressures={"tube": pressure}), modes=k).eigenvalues[k - 1])

    return float(brentq(eigenvalue, 0.9 * k * np.pi, 1.1 * k * np.pi, xtol=1e-9))


def _catenoids(around: int) -> Branch:
    """From a wide neck to the fold, as the rings move apart."""
    start = solve(catenoid(2.0 * np.pi / around, half_distance=START)).surface
    x, y, z = start.vertices[start.fixed].T
    apart = BoundaryMotion(lambda h: np.stack([x, y, np.sign(z) * h], axis=1), START)
    return follow(start, apart, step=0.05, folds=1)


def _ennepers(rings: int) -> Branch:
    """Enneper's surface as its wire widens."""
    edge = (NARROW + NARROW**3 / 3.0) / rings
    start = solve(enneper(edge, radius=NARROW), target="stationary").surface
    angles = 2.0 * np.pi * np.arange(8 * rings) / (8 * rings)
    wire = BoundaryMotion(lambda radius: enneper_wire(radius, angles), NARROW)
    return follow(start, wire, WIDE, step=0.05)


def _compare(folder: Folder, branch: Branch, rings: int, areas: list[dict[str, Any]]) -> None:
    """The three areas at the compared radii; on the diagram's mesh the branches and the surfaces, too.

    Vertices move along the normals only, and the two surfaces are far from Enneper's: triangles become
    long. So areas are compared on new meshes of about as many triangles.
    """
    for radius in COMPARED:
        two = branch.switch(stop=radius)
        for name, other in (("Enneper", _at(branch, radius)), ("one", two[0]), ("other", two[1])):
            last = other.points.iloc[-1]
            edge = float((4.0 / 3.0**0.5 * last.energy / other.last.m) ** 0.5)
            result = solve(remesh(other.last, edge), target="stationary")
            areas.append(
                {
                    "rings": rings,
                    "radius": radius,
                    "surface": name,
                    "enneper": enneper_exact(radius=radius).area,
                    "area_followed": last.energy,
                    "area": result.energy,
                    "index": result.certificate.index,
                    "middle": other.last.vertices[0, 2],
                    "triangles": result.surface.m,
                    "quality_followed": last.quality,
                    "quality": result.certificate.quality,
                }
            )
            if rings == PICTURED and radius == COMPARED[-1]:
                folder.write_mesh(f"wire-{name}", {f"R = {radius:g}": result.surface})
    if rings == DIAGRAM:
        ends = zip(("one", "other"), branch.switch(stop=WIDE, step=0.005), strict=True)
        followed = [_points(name, other) for name, other in ends]
        own = _points("Enneper", branch)
        event = branch.bifurcations.iloc[0]
        at = {"parameter": event.parameter, "energy": event.energy, "middle": 0.0}
        joints = [at | {"branch": name, "index": k} for name, k in JOINTS]
        every = pd.concat([own, *followed, pd.DataFrame(joints)])
        folder.write_table("enneper_points", every.sort_values(["branch", "index", "parameter"]))


def _points(name: str, branch: Branch) -> pd.DataFrame:
    """The points of a branch with the height of the surface's middle, its first vertex."""
    middle = [branch.surfaces[row].vertices[0, 2] for row in branch.points.index]
    return branch.points[["parameter", "energy", "index"]].assign(branch=name, middle=middle)


def _at(branch: Branch, radius: float) -> Branch:
    """Enneper's branch again, up to a radius."""
    return follow(branch.surfaces[0], branch.parameter, radius, step=0.05)


def table(folder: Folder) -> dict[str, float]:
    """``changes``: each change of index with its order and its limit; ``enneper``: the three areas."""
    records = folder.read_table("change_records")
    changes = pd.DataFrame([_limit(str(name), mine) for name, mine in records.groupby("change", sort=False)])
    folder.write_table("changes", changes)
    areas = folder.read_table("enneper_areas")
    compared = pd.DataFrame(
        [
            {
                "radius": radius,
                "surface": name,
                "index": int(mine["index"].iloc[-1]),
                "exact": mine.enneper.iloc[-1] if name == "Enneper" else np.nan,
                **_extrapolated(1.0 / mine.rings.to_numpy(), mine.area.to_numpy()),
            }
            for (radius, name), mine in areas.groupby(["radius", "surface"], sort=False)
        ]
    )
    folder.write_table("enneper", compared)
    found = changes.set_index("change")
    measured = {}
    for key, name in (("catenoid_fold", "catenoid, fold"), ("enneper_bifurcation", "Enneper, R = 1")):
        measured[key], measured[f"{key}_order"] = found.limit[name], found.order[name]
    for k in WAVES:
        measured[f"cylinder_{k}"] = found.limit[_length(k)] / np.pi
    for row in compared.itertuples():
        measured[f"area_{row.surface}_{row.radius:g}"] = float(str(row.limit))
    return measured


def _limit(name: str, mine: pd.DataFrame) -> dict[str, Any]:
    """A change of index: on the finest mesh and extrapolated, its order fitted to the known errors."""
    h, found = mine.edge_length.to_numpy(), mine.found.to_numpy()
    fit = slope(h, np.abs(mine.error.to_numpy()))
    theory = mine.theory.iloc[-1]
    limit = _extrapolated(h, found)
    return {
        "change": name,
        "theory": theory,
        "meshes": len(mine),
        "finest": found[-1],
        "finest_error": found[-1] - theory,
        "order": fit.order,
        "order_error": fit.standard_error,
        "limit": limit["limit"],
        "limit_error": limit["limit"] - theory,
    }


def _extrapolated(h: Floats, values: Floats) -> dict[str, float]:
    """The finest value, its limit by the observed order of the last three meshes, and that order."""
    order = float(np.log2((values[-3] - values[-2]) / (values[-2] - values[-1])))
    ratio = (h[-2] / h[-1]) ** 2
    return {
        "finest": values[-1],
        "observed_order": order,
        "limit": values[-1] + (values[-1] - values[-2]) / (ratio - 1.0),
    }


def figure(folder: Folder) -> None:
    """Errors of the located changes, Enneper's bifurcation diagram, and its three surfaces."""
    from pcmc.plot import convergence, panel

    records = folder.read_table("change_records")
    convergence(
        {
            str(name): (mine.edge_length, mine.error.abs())
            for name, mine in records.groupby("change", sort=False)
            if name != "catenoid, index"
        },
        folder.figure("changes"),
        title="Where the index changes: error against the edge length",
    )
    stages = {name: folder.read_mesh(f"wire-{name}") for name in WIRES}
    panel(
        [surface for stage in stages.values() for surface in stage.values()],
        folder.figure("enneper_surfaces"),
        titles=[f"{WIRES[name]}: {at}" for name, stage in stages.items() for at in stage],
        columns=3,
        supports=False,
    )
    _diagram(folder)


def _diagram(folder: Folder) -> None:
    """The height of the middle, and the area less Enneper's, against the radius of the wire."""
    from pcmc.plot.figure import CURVES, INK, SMALL, TEXT, finish, new, style

    points = folder.read_table("enneper_points")
    areas = [enneper_exact(radius=radius).area for radius in points.parameter]
    points = points.assign(less=points.energy - areas)
    looks = {
        ("Enneper", 0): ("Enneper's surface, stable", CURVES[0], "-"),
        ("Enneper", 1): ("Enneper's surface, a saddle", CURVES[0], "--"),
        ("one", 0): ("less area, stable", CURVES[1], "-"),
        ("other", 0): ("its image, stable", CURVES[2], "-"),
    }
    figure = new(1200, 560, pad=8.0)
    left, right = (style(axes) for axes in figure.subplots(1, 2))
    for (name, index), (label, color, dash) in looks.items():
        mine = points[(points.branch == name) & (points["index"] == index)]
        left.plot(mine.parameter, mine.middle, color=color, linestyle=dash, linewidth=1.1, label=label)
        shown = "--" if name == "other" else dash  # both have one area
        right.plot(mine.parameter, mine.less, color=color, linestyle=shown, linewidth=1.1)
    for axes, label in ((left, "height of the middle"), (right, "area - π (R² + R⁴ + R⁶/3)")):
        axes.axvline(1.0, color=INK, linewidth=0.6, linestyle=":")
        axes.set_xlabel("radius R of the wire", fontsize=TEXT, color=INK)
        axes.set_ylabel(label, fontsize=TEXT, color=INK)
    left.legend(fontsize=SMALL, frameon=False, labelcolor=INK, loc="lower left", handlelength=2.6)
    title = f"Enneper's wire: a pitchfork at R = 1 (mesh of {DIAGRAM} rings)"
    figure.suptitle(title, fontsize=TEXT, color=INK)
    finish(figure, folder.figure("enneper"))
