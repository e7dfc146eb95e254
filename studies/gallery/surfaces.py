"""Surfaces known in closed form, each with its order of convergence and its Morse index.

- Every generator with a closed form on finer and finer meshes: how far its equilibrium is from the exact
  surface, from its energy and its area, with the fitted orders; and its index beside the known one.
- Where the index changes: cylinders at every multiple of πR, catenoids at their fold, Enneper's surface at
  R = 1 (``gallery_changes``).
- Enneper's wire: the two surfaces of less area that leave Enneper's (``gallery_changes``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

import generators
from generators import catenoid_fold, lens_circle
from generators.exact import ExactSolution
from pcmc import Surface, energy, solve
from pcmc.base.arrays import Floats
from pcmc.forces.functional import patch_areas, volume

from ..folder import Folder
from ..orders import slope
from ..study import Study
from . import changes

ROUNDING = 1e-11  # relative error below which a surface is exact: no order can be fitted
DRAWN = 1  # number of the mesh that is drawn, from the coarsest
DEGREES_120 = {"alpha_top": 1.0, "alpha_bottom": 1.0, "alpha_film": 1.0}


@dataclass(frozen=True)
class Example:
    """A surface of the gallery.

    Attributes
    ----------
    name, title : of the files, and of the picture.
    generator : its name in ``generators``; with ``_exact`` the closed form.
    edge_length : of the coarsest mesh.
    arguments : of both.
    exact : whether the solver starts from exact vertices, where others would lead elsewhere.
    view : of the picture.
    """

    name: str
    title: str
    generator: str
    edge_length: float
    arguments: Mapping[str, Any] = field(default_factory=dict)
    exact: bool = False
    view: str | tuple[float, float] = "diagonal"

    def closed_form(self) -> ExactSolution:
        """Energy, area, volume, shape and index."""
        known: ExactSolution = getattr(generators, f"{self.generator}_exact")(**self.arguments)
        return known

    def start(self, edge_length: float) -> Surface:
        """The mesh that the solver starts from."""
        build = getattr(generators, self.generator)
        start: Surface = build(edge_length, **self.arguments, **({"exact": True} if self.exact else {}))
        return start


EXAMPLES = (
    Example("cylinder", "cylinder", "cylinder", 0.52, {"length": 1.8}, exact=True),
    Example("cylinder_long", "cylinder, L = 3.5πR", "cylinder", 0.52, {"length": 3.5 * np.pi}, exact=True),
    Example("unduloid_bulge", "unduloid, bulge", "delaunay", 0.68),
    Example("unduloid_neck", "unduloid, neck", "delaunay", 0.34, {"centre": "neck", "reach": 0.6}),
    Example("nodoid", "nodoid", "delaunay", 0.68, {"waviness": 1.5}),
    Example("catenoid", "catenoid", "catenoid", 0.2565, {"half_distance": 0.6}),
    Example("catenoid_deep", "deep catenoid", "catenoid", 0.217, {"half_distance": 0.6, "deep": True}),
    Example("cap", "cap", "spherical_cap", 0.2),
    Example("cap_upper", "upper cap", "spherical_cap", 0.2, {"upper": True}, exact=True),
    Example("hemisphere", "hemisphere on Π", "hemisphere", 0.785),
    Example("sphere", "sphere", "sphere", 0.7),
    Example("double_bubble", "double bubble", "double_bubble", 0.8, exact=True),
    Example("triple_bubble", "three bubbles", "triple_bubble", 0.3, exact=True),
    Example("joined_caps", "joined caps", "joined_caps", 1.0),
    Example("lens", "lens, Young's law", "lens", 0.5),
    Example("lens_120", "lens, 120°", "lens", float(np.pi * lens_circle(**DEGREES_120) / 9.0), DEGREES_120),
    Example("tetrahedron", "tetrahedral film", "tetrahedral_film", 0.25),
    Example("schwarz", "Schwarz's D", "skew_quadrilateral", 0.125),
    Example("enneper", "Enneper, R = 0.8", "enneper", 0.194),
    Example("enneper_large", "Enneper, R = 1.3", "enneper", 0.4065, {"radius": 1.3}),
)
LEVELS = 4
EXACT = "tetrahedron"  # flat films: no error to draw


def data(folder: Folder, short: bool) -> None:
    """Solve every example on every mesh; follow the branches on which the index changes."""
    examples = [EXAMPLES[5], EXAMPLES[14], EXAMPLES[16]] if short else EXAMPLES
    rows: list[dict[str, Any]] = []
    for example in examples:
        for level in range(3 if short else LEVELS):
            surface = _solved(example, level, rows)
            if level == DRAWN:
                folder.write_mesh(example.name, {"at rest": surface})
    folder.write_table("records", pd.DataFrame(rows))
    changes.data(folder, short)


def _solved(example: Example, level: int, rows: list[dict[str, Any]]) -> Surface:
    """The equilibrium on a mesh; its row is added."""
    exact = example.closed_form()
    result = solve(example.start(example.edge_length / 2**level), target="stationary")
    surface, certificate = result.surface, result.certificate
    area = float(patch_areas(surface).sum())
    rows.append(
        {
            "example": example.name,
            "triangles": surface.m,
            "edge_length": (area / surface.m * 4.0 / 3.0**0.5) ** 0.5,
            "status": result.status.name.lower(),
            "residual": bound(certificate.residual),
            "distance": exact.distance(_in_place(surface)).max(),
            "energy_error": energy(surface) - exact.energy,
            "area_error": area - exact.area,
            "volume_error": volume(surface) - exact.volume,
            "size": surface.size,
            "energy": exact.energy,
            "index": certificate.index,
            "known_index": exact.index,
        }
    )
    return surface


def bound(residual: float) -> float:
    """A power of ten above the residual: rounding noise differs between machines.

    >>> bound(3e-14)
    1e-13
    """
    return float(10.0 ** np.ceil(np.log10(max(residual, 1e-16))))


def _in_place(surface: Surface) -> Surface:
    """A surface that nothing holds, moved back: its junction to x = 0, and its middle to the origin."""
    if surface.fixed.any() or len(surface.rooms) > 2:  # three bubbles start in place, and no step moves them
        return surface
    X, junctions = surface.vertices, surface.topology.junctions
    if not junctions:
        ring = X[surface.on_plane] if surface.on_plane.any() else X
        return surface.moved(X - ring.mean(axis=0))
    middle = X[junctions[0].vertices].mean(axis=0)
    ring = X[junctions[0].vertices] - middle
    axes = np.linalg.svd(ring)[2]  # along its plane, and the normal
    circle = np.column_stack([2.0 * ring @ axes[:2].T, np.ones(len(ring))])
    middle += np.linalg.lstsq(circle, (ring**2).sum(axis=1))[0][:2] @ axes[:2]
    turn = Rotation.align_vectors([[np.sign(axes[2, 0]), 0.0, 0.0]], [axes[2]])[0]
    return surface.moved(turn.apply(X - middle))


def table(folder: Folder) -> dict[str, float]:
    """``orders``: a row per example; ``changes`` and ``enneper``: where the index changes, and beyond."""
    records = folder.read_table("records")
    rows = [_orders(str(name), mine) for name, mine in records.groupby("example", sort=False)]
    orders = pd.DataFrame(rows)
    folder.write_table("orders", orders)
    fitted = orders.set_index("example")
    measured = {f"order_{name}": float(order) for name, order in fitted.distance_order.items()}
    measured["wrong_indices"] = int((~orders.index_known_and_found).sum())
    return measured | changes.table(folder)


def _orders(name: str, mine: pd.DataFrame) -> dict[str, Any]:
    """The row of an example: errors on the finest mesh, fitted orders with standard errors, indices."""
    h, last = mine.edge_length.to_numpy(), mine.iloc[-1]
    row: dict[str, Any] = {"example": name, "meshes": len(mine), "triangles": last.triangles}
    scales = {"distance": mine["size"], "energy_error": mine.energy.abs(), "area_error": mine["size"] ** 2}
    for key, scale in scales.items():
        error: Floats = (mine[key].abs() / scale).to_numpy(dtype=float)
        fit = slope(h, np.where(error > ROUNDING, error, 0.0))
        row |= {
            key: mine[key].iloc[-1] if error[-1] > ROUNDING else 0.0,
            f"{key.removesuffix('_error')}_order": fit.order,
            f"{key.removesuffix('_error')}_order_error": fit.standard_error,
        }
    known = None if pd.isna(last.known_index) else int(last.known_index)
    indices = mine["index"].fillna(-1).astype(int).unique().tolist()  # -1: not at rest
    agrees = len(indices) == 1 and known in (None, indices[0])
    return row | {"index": indices[-1], "known_index": known, "index_known_and_found": agrees}


def figure(folder: Folder) -> None:
    """All surfaces, their errors, and the changes of index."""
    from pcmc.plot import panel

    from ..figure_panels import curve_panels

    records = folder.read_table("records")
    shown = [example for example in EXAMPLES if (records.example == example.name).any()]
    panel(
        [folder.read_mesh(example.name)["at rest"] for example in shown],
        folder.figure("surfaces"),
        titles=[f"{e.title}: index {_index(records, e.name)}" for e in shown],
        columns=4,
        one_scale=False,
        edges=False,
        width=1200,
        supports=False,
        views=[e.view for e in shown],
    )
    panels = {}
    for example in shown:
        if example.name == EXACT:
            continue
        mine = records[records.example == example.name]
        panels[example.title] = {
            label: (mine.edge_length / mine["size"], mine[key].abs() / scale)
            for label, key, scale in (
                ("distance / size", "distance", mine["size"]),
                ("energy, relative", "energy_error", mine.energy.abs()),
                ("h²: second order", "edge_length", mine["size"] ** 2 / mine.edge_length),
            )
        }
    curve_panels(panels, folder.figure("errors"), columns=5, xlabel="edge length / size", ylabel="error")
    changes.figure(folder)


def _index(records: pd.DataFrame, name: str) -> int:
    return int(records["index"][records.example == name].iloc[-1])


STUDY = Study(
    "gallery",
    "exact surfaces: orders of convergence, Morse indices, where they change, Enneper's three surfaces",
    data,
    table,
    figure,
    parameters={
        "edge_lengths": {example.name: example.edge_length for example in EXAMPLES},
        "levels": LEVELS,
        "catenoid_fold": catenoid_fold(),
        **changes.PARAMETERS,
    },
    seconds=60,
    paper=False,
)
