"""Strips of cloth sewn together again: CalculiX blows them up, and the roof must come back.

Each strip is cut flat, compensated for α/t, and sewn to its neighbours along seams that are equally long. In
the sewn membrane the unstressed state of every triangle is the flat, compensated one, so it carries the
cloth's own stresses where it stands on the roof. The form-finding pressure acts, and CalculiX finds where it
comes to rest. What is left is what the strips could not follow: the strain of a flat strip on a curved roof,
about K w² / 24 for the width w. So the way back to the shape, and the stress off α/t, vanish as w².

The law of the cloth is linear: with J = R U the map from the cut triangle to the roof, its membrane forces
are N = E t / (1 - ν²) ((1 - ν) ε + ν tr ε I) with ε = U - I, turned by R. On the same mesh the row of "no
strips", α/t everywhere, tells what the mesh itself leaves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from generators import spherical_cap
from pcmc import CuttingPattern, Material, StructuralModel, Surface, cutting_pattern, solve
from pcmc.base.arrays import Floats
from pcmc.plan import Plan
from pcmc.structure import StepResults, calculix, read_results, write_structure
from pcmc.structure.calculix import NotConverged
from pcmc.structure.inp import POINTS
from pcmc.surface.geometry import area_vectors, face_areas, vertex_sums
from pcmc.surface.topology import topology

from ..folder import Folder
from ..orders import slope
from ..study import Study
from .structure import Row, rounded

EXTENSION = 0.01  # of the cloth under α
POISSON = 0.3
THICKNESS = 2e-4  # of the size
STRESSES = "*INITIAL CONDITIONS, TYPE=STRESS\n"


RECTANGLE = [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]]
L_SHAPE = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.4], [1.4, 1.4], [1.4, 3.0], [0.0, 3.0]]
CORNERED, CORNER = "L-roof", np.array([1.4, 1.4, 0.0])  # the re-entrant corner of the plan
NEAR = 0.1  # of the size, around that corner

# the shapes and the numbers of strips across them; orders need three
SHAPES: dict[str, tuple[Callable[[], Surface], Sequence[int]]] = {
    "cap": (lambda: spherical_cap(0.05, alpha=0.8), (5, 8, 13)),
    "cap of wide strips": (lambda: spherical_cap(0.05, alpha=0.8), (3,)),
    "near hemisphere": (lambda: spherical_cap(0.05, alpha=0.55), (5, 8)),
    "rectangle": (lambda: Plan(RECTANGLE, edge_length=0.08, tension=1.6).surface(), (5, 8, 13)),
    "cushion": (lambda: Plan(RECTANGLE, edge_length=0.1, tension=1.6, cushion=1.5).surface(), (5, 8, 11)),
    CORNERED: (lambda: Plan(L_SHAPE, edge_length=0.08, tension=1.6).surface(), (5, 8, 13)),
}


def data(folder: Folder, short: bool) -> None:
    """``records``: a row per shape and number of strips."""
    calculix.expect_program()
    records: list[Row] = []
    for name, (build, counts) in SHAPES.items():
        roof = solve(build()).surface
        alpha = float(roof.tensions.max())
        stiffness = (1.0 - POISSON) * alpha / EXTENSION
        options: dict[str, Any] = {"stiffness": (stiffness, stiffness), "poisson": POISSON}
        for count in counts[: 1 if short else None]:
            pattern = cutting_pattern(roof, strips=count, anyway=True, **options)
            sewn, cut = sewn_together(pattern)
            model = membrane(sewn, stiffness)
            row: Row = {"shape": name, "strips": count, "triangles": sewn.m}
            row |= {"width": float(pattern.table["width"].mean()) / sewn.size}
            row |= {"strain": float(pattern.table["strain_rms"].max()) / 100.0}
            plain = blown_up(model, None)
            try:
                blown = blown_up(model, cloth_forces(sewn, cut, stiffness))
            except NotConverged:
                records.append(row | {"at_rest": False})
                continue
            row |= {"at_rest": True, "moved": compared(model, blown, plain.displacements)["shape"]}
            both, mesh = compared(model, blown), compared(model, plain)
            row |= {f"with_mesh_{key}": value for key, value in both.items() if key == "shape"}
            row |= {key: value for key, value in both.items() if key != "shape"}
            row |= {f"mesh_{key}": mesh[key] for key in ("shape", "stress_rms")}
            if name == CORNERED:
                away = compared(model, blown, plain.displacements, CORNER)
                row |= {f"away_{key}": away[key] for key in ("shape", "stress_mean", "stress_rms")}
            records.append(row)
    folder.write_table("records", rounded(records))


def sewn_together(pattern: CuttingPattern) -> tuple[Surface, Floats]:
    """The strips joined where their vertices lie on each other, and the cut corners (m,3,2) of the faces."""
    roof = np.concatenate([strip.roof for strip in pattern.strips])
    first = np.cumsum([0, *(len(strip.roof) for strip in pattern.strips)])
    faces = np.concatenate([s.faces + k for s, k in zip(pattern.strips, first[:-1], strict=True)])
    cut = np.concatenate([strip.cut[strip.faces] for strip in pattern.strips])
    _, kept, number = np.unique(roof.round(9), axis=0, return_index=True, return_inverse=True)
    whole, names = pattern.surface, [patch.name for patch in pattern.surface.patches]
    patch = np.repeat([names.index(s.patch) for s in pattern.strips], [len(s.faces) for s in pattern.strips])
    X, F = roof[kept], number.ravel()[faces]
    topo = topology(F, patch, len(X))
    rim = np.isin(np.arange(len(X)), topo.edges[topo.curve_edge])
    return Surface(X, F, patch, whole.patches, fixed=rim, plane=whole.plane), cut


def membrane(sewn: Surface, stiffness: float) -> StructuralModel:
    """The sewn roof as a membrane with the cloth's stiffness E t."""
    thickness = THICKNESS * sewn.size
    return StructuralModel(sewn, Material(stiffness / thickness, POISSON), thickness, anyway=True)


def cloth_forces(sewn: Surface, cut: Floats, stiffness: float) -> Floats:
    """(m,3,3) membrane forces of the cloth where it stands on the roof, force/length."""
    P = sewn.vertices[sewn.faces]
    flat = np.stack([cut[:, 1] - cut[:, 0], cut[:, 2] - cut[:, 0]], axis=2)
    roof = np.stack([P[:, 1] - P[:, 0], P[:, 2] - P[:, 0]], axis=2)
    J = roof @ np.linalg.inv(flat)  # (m,3,2)
    left, sigma, right = np.linalg.svd(J, full_matrices=False)
    turn = left @ right
    strain = right.transpose(0, 2, 1) @ (sigma[:, :, None] * right) - np.eye(2)
    trace = np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    N = stiffness / (1.0 - POISSON**2) * ((1.0 - POISSON) * strain + POISSON * trace)
    return np.asarray(turn @ N @ turn.transpose(0, 2, 1))


def blown_up(model: StructuralModel, forces: Floats | None) -> StepResults:
    """The membrane at rest under the form-finding pressure, from these forces (m,3,3), or from α."""
    with calculix.folder_for_input() as path:
        write_structure(path, model)
        if forces is not None:
            stress = forces[model.faces] / model.thicknesses[0]
            values = stress[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()
            lines = [
                f"{face + 1},{point}," + ",".join(f"{value:.12e}" for value in row) + "\n"
                for face, row in zip(model.faces.tolist(), values, strict=True)
                for point in range(1, POINTS + 1)
            ]
            head, stresses, rest = path.read_text(encoding="utf-8").partition(STRESSES)
            after = rest[rest.index("*") :]
            path.write_text(f"{head}{stresses}{''.join(lines)}{after}", encoding="utf-8", newline="\n")
        calculix.run_file(path)
        return read_results(path.with_suffix(".dat"), model)[0]


def compared(
    model: StructuralModel, form: StepResults, still: Floats | float = 0.0, corner: Floats | None = None
) -> Row:
    """How far the membrane is from ``still`` (n,3) along its normals, over the size; its stress over α/t.

    With a ``corner`` (3,), only farther from it than ``NEAR`` of the size."""
    surface, faces = model.surface, model.surface.faces[model.faces]
    normal = vertex_sums(area_vectors(surface.vertices[surface.faces]), surface.faces, surface.n)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    off = np.abs(((form.displacements - still) * normal).sum(axis=1))
    alpha = surface.tensions[surface.patch_of_face[model.faces]]
    ratio = form.principal_stresses[model.faces] * model.thicknesses[0] / alpha[:, None]
    area = face_areas(surface.vertices[faces])
    if corner is not None:
        far = np.linalg.norm(surface.vertices - corner, axis=1) > NEAR * surface.size
        off, ratio, area = off[far], ratio[far[faces].all(axis=1)], area[far[faces].all(axis=1)]
    share = area / area.sum()
    return {
        "shape": float(off.max()) / surface.size,
        "stress_mean": float(share @ ratio.mean(axis=1)) - 1.0,
        "stress_rms": float(np.sqrt(share @ ((ratio - 1.0) ** 2).mean(axis=1))),
        "stress_least": float(ratio.min()),
        "stress_largest": float(ratio.max()),
    }


def _series(records: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """The shapes with three numbers of strips and more."""
    shapes = records.groupby("shape", sort=False)
    return ((str(name), given) for name, given in shapes if len(given) > 2)


def table(folder: Folder) -> dict[str, float]:
    """``orders``: in the width of the strips, of the strain, the way back to the shape and the stress."""
    records = folder.read_table("records")
    rows: list[Row] = []
    measured: dict[str, float] = {}
    for name, given in _series(records):
        width = given["width"].to_numpy()
        keys = {"strain": "strain", "moved": "moved", "stress": "stress_rms"}
        keys |= {"away_moved": "away_shape", "away_stress": "away_stress_rms"} if name == CORNERED else {}
        orders = {key: slope(width, given[column].to_numpy()).order for key, column in keys.items()}
        rows.append({"shape": name, **{key: round(order, 2) for key, order in orders.items()}})
        finest = given.iloc[-1]
        key_name = name.replace("-", "_")
        measured |= {f"order_{key}_{key_name}": round(order, 2) for key, order in orders.items()}
        for key in ("width", "strain", "moved", "stress_mean", "stress_rms"):
            measured[f"{key}_{key_name}"] = float(finest[key])
        measured[f"moved_widest_{key_name}"] = float(given.iloc[0]["moved"])
    folder.write_table("orders", pd.DataFrame(rows))
    return measured


def figure(folder: Folder) -> None:
    """How shape and stress come back as strips get narrower."""
    from pcmc.plot import lines

    records, ends = folder.read_table("records"), np.array([0.045, 0.15])
    for what, column, away, off in (
        ("shape", "moved", "away_shape", "distance over the size"),
        ("stress", "stress_rms", "away_stress_rms", "rms of the difference from α/t, over α/t"),
    ):
        curves: dict[str, Any] = {}
        for name, given in _series(records):
            curves[name] = given["width"], given[column]
            if name == CORNERED:
                curves[f"{name}, away from its corner"] = given["width"], given[away]
        curves["order 2"] = ends, 0.5 * curves["cap"][1].iloc[0] * (ends / ends[1]) ** 2
        look: dict[str, Any] = {"x": "mean width of the strips, over the size", "y": off}
        look |= {"xscale": "log", "yscale": "log", "markers": True}
        lines(
            curves, folder.figure(f"sewn-{what}"), title=f"The {what} of strips sewn together again", **look
        )


STUDY = Study(
    "cloth",
    "strips of cloth, cut flat and sewn together again, in CalculiX: shape and stress come back",
    data,
    table,
    figure,
    parameters={"extension": EXTENSION, "poisson": POISSON, "thickness": THICKNESS},
    seconds=500,
    paper=False,
)
