"""A finite-element program carries our shapes: CalculiX on structural models of solved surfaces.

Under the form-finding load the model must stay where it is, with the stress α/t in every element and our
reactions at its supports. Then snow comes, which the shape was not found for, and the roof goes down.

Each shape has three meshes. Its membrane is as stiff as two numbers below say: displacements under the
form-finding load are the forces that a mesh leaves along the surface over the stiffness E t.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from generators import bezier_hall, spherical_cap, two_caps
from pcmc import Material, SelfWeight, Snow, StructuralModel, Surface, analyse, certify, project, solve
from pcmc.base.arrays import Floats
from pcmc.certificate.forces import Forces
from pcmc.certificate.supports import boundary_view, support_table
from pcmc.plan import Divider, Plan
from pcmc.structure import StepResults, calculix
from pcmc.surface.geometry import face_areas

from ..folder import Folder
from ..study import Study

Row = dict[str, float | str]
ROOF = Path(__file__).parents[2] / "notebooks" / "roof.toml"
THICKNESS = 2e-4  # of the size
STRAIN = 5e-4  # α / (E t) of the patch of largest tension
SNOW = 0.3  # of the largest pressure
WITHIN = 0.02  # of α/t: a stress nearer counts as α/t
DIGITS = 4


def roof(edge_length: float) -> Surface:
    """The L-shaped roof of the notebooks on a mesh of this edge length."""
    given = project.load(ROOF)
    assert given.plan is not None
    return replace(given.plan, edge_length=edge_length).surface()


SHAPES: dict[str, tuple[Callable[[float], Surface], tuple[float, float, float]]] = {
    "cap": (lambda h: spherical_cap(h, alpha=0.6), (0.2, 0.1, 0.05)),
    "Example 2": (two_caps, (1.2, 0.6, 0.3)),
    "Example 4": (bezier_hall, (12.0, 6.0, 3.0)),
    "L-shaped roof": (roof, (1.4, 0.7, 0.35)),
}
MESHES = ("coarse", "middle", "fine")
DRIFT = (0.8, 0.6, 0.4, 0.3)  # edge lengths of the hall under a drift of snow


def data(folder: Folder, short: bool) -> None:
    """``records``, ``patches`` and ``supports``; the middle meshes with their deflection under snow."""
    calculix.expect_program()
    records: list[Row] = []
    patches: list[Row] = []
    supports: list[Row] = []
    for name, (build, edges) in SHAPES.items():
        for mesh, edge in zip(MESHES, edges[: 1 if short else None], strict=False):
            surface = solve(build(edge), target="stationary").surface
            model = structural_model(surface)
            form, snow = (case.results for case in analyse(model, remedy=False).cases)
            about: Row = {"shape": name, "mesh": mesh, "edge_length": edge, "triangles": surface.m}
            records.append(about | compared(model, form, snow))
            patches += [about | row for row in by_patch(model, form)]
            supports += [about | row for row in by_support(model, form)]
            if mesh == (MESHES[0] if short else MESHES[1]):
                sunk = surface.moved(surface.vertices + np.nan_to_num(snow.displacements))
                folder.write_mesh(name, {"form": surface, "snow": sunk})
    folder.write_table("records", rounded(records))
    folder.write_table("patches", rounded(patches))
    folder.write_table("supports", rounded(supports))
    folder.write_table("drift", rounded([overloaded(edge) for edge in DRIFT[: 1 if short else None]]))


def overloaded(edge: float) -> Row:
    """A hall of two bays under a drift of snow in its valley: the share carried, and that without slack."""
    patches = {name: {"tension": 1.5, "pressure": 0.3} for name in ("west", "east")}
    wall = Divider([[6, 0], [6, 8]], wall=0.6)
    plan = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], [wall], edge_length=edge, patches=patches)
    drift = Snow(0.5, area=[[4, 0], [8, 0], [8, 8], [4, 8]])
    cloth = Material(young=5e5, poisson=0.3, density=1.2)
    model = StructuralModel(solve(plan.surface()).surface, cloth, 0.001, [SelfWeight(), drift])
    snow = analyse(model, remedy=False)["snow"]
    return {"edge_length": edge, "share": snow.share, "taut": snow.taut}


def structural_model(surface: Surface) -> StructuralModel:
    """The surface with the thickness, stiffness and snow of this study."""
    thickness = THICKNESS * surface.size
    young = float(surface.tensions.max()) / (STRAIN * thickness)
    load = SNOW * float(np.abs(surface.pressures).max())
    return StructuralModel(surface, Material(young), thickness, [Snow(load)], anyway=True)


def compared(model: StructuralModel, form: StepResults, snow: StepResults) -> Row:
    """Theirs against ours, relative: displacement, stress, reactions; and the deflection under snow."""
    surface = model.surface
    ours = certify(surface, modes=0).reactions
    off, largest = form.reactions - ours, np.linalg.norm(ours, axis=1).max()
    stress = stress_errors(model, form)
    share = face_areas(surface.vertices[surface.faces[model.faces]])
    share /= share.sum()
    normal = np.array(surface.plane.normal)
    return {
        "verdict": model.certificate.verdict.value.partition(":")[0],
        "displacement": form.largest_displacement / surface.size,
        "stress_rms": float(np.sqrt(share @ (stress**2).mean(axis=1))),
        "stress_largest": float(np.abs(stress).max()),
        "stress_within": float(share @ (np.abs(stress).max(axis=1) <= WITHIN)),
        "reaction_rms": float(np.linalg.norm(off) / np.linalg.norm(ours)),
        "reaction_largest": float(np.linalg.norm(off, axis=1).max() / largest),
        "support_ours": float((ours @ normal).sum()),
        "support_theirs": float((form.reactions @ normal).sum()),
        "snow_deflection": -float(np.nanmin(snow.deflections)),
    }


def stress_errors(model: StructuralModel, form: StepResults) -> Floats:
    """(e,2) the principal stresses of each element over α/t, less 1."""
    return np.asarray(form.principal_stresses[model.faces] / model.prestress[:, None] - 1.0)


def by_patch(model: StructuralModel, form: StepResults) -> list[Row]:
    """Stress over α/t in each patch: its mean over the area, and the least and largest."""
    surface, ratio = model.surface, 1.0 + stress_errors(model, form)
    area = face_areas(surface.vertices[surface.faces[model.faces]])
    rows: list[Row] = []
    for k, patch in enumerate(surface.patches):
        mine = surface.patch_of_face[model.faces] == k
        if mine.any():
            mean = float(area[mine] @ ratio[mine].mean(axis=1) / area[mine].sum())
            low, high = float(ratio[mine].min()), float(ratio[mine].max())
            rows.append({"patch": patch.name, "mean": mean, "least": low, "largest": high})
    return rows


def by_support(model: StructuralModel, form: StepResults) -> list[Row]:
    """The force of each held boundary curve, ours and theirs, and their difference over the larger side."""
    axes = ["reaction_x", "reaction_y", "reaction_z"]
    tables = [
        boundary_view(support_table(Forces.of(model.standing, f)))
        for f in (certify(model.surface, modes=0).reactions, form.reactions)
    ]
    rows: list[Row] = []
    for (_, our), (_, their) in zip(*(table.iterrows() for table in tables), strict=True):
        a, b = our[axes].to_numpy(dtype=float), their[axes].to_numpy(dtype=float)
        row: Row = {"boundary": our["boundary"]}
        row |= {
            f"{side}_{axis}": v
            for side, f in (("ours", a), ("theirs", b))
            for axis, v in zip("xyz", f, strict=True)
        }
        rows.append(row | {"difference": float(np.linalg.norm(a - b) / np.linalg.norm(a))})
    return rows


def rounded(rows: list[Row]) -> pd.DataFrame:
    """Numbers to as many digits as every computer gives alike; forces that are rounding are 0."""

    def few(value: object) -> object:
        if not isinstance(value, float):
            return value
        return 0.0 if abs(value) < 1e-9 else float(f"{value:.{DIGITS}g}")

    return pd.DataFrame([{key: few(value) for key, value in row.items()} for row in rows])


def table(folder: Folder) -> dict[str, float]:
    """``orders``: of the convergence of each comparison as triangles get smaller; and the finest numbers."""
    records = folder.read_table("records")
    keys = ("displacement", "stress_rms", "reaction_rms")
    rows: list[Row] = []
    measured: dict[str, float] = {}
    for name, given in records.groupby("shape", sort=False):
        h = np.log(given.edge_length)
        slopes = {k: float(np.polyfit(h, np.log(given[k]), 1)[0]) if len(given) > 1 else np.nan for k in keys}
        rows.append({"shape": str(name), **{k: round(v, 2) for k, v in slopes.items()}})
        finest = given.iloc[-1]
        short = str(name).replace(" ", "_")
        measured |= {f"{k}_{short}": float(finest[k]) for k in (*keys, "stress_within", "snow_deflection")}
    folder.write_table("orders", pd.DataFrame(rows))
    return measured


def figure(folder: Folder) -> None:
    """The shapes with their deflection under snow, and the convergence of the stress."""
    from pcmc.plot import convergence, panel

    shapes, sunk = [], []
    names = [name for name in SHAPES if name != "cap"]
    for name in names:
        stages = folder.read_mesh(name)
        form = stages["form"]
        sunk.append((stages["snow"].vertices - form.vertices) @ np.array(form.plane.normal) / form.size * 1e3)
        shapes.append(form.moved(form.vertices / form.size))
    panel(
        shapes,
        folder.figure("snow"),
        columns=3,
        titles=names,
        scalars=sunk,
        label="deflection under snow, thousandths of the size",
        edges=False,
        supports=False,
    )
    records = folder.read_table("records")
    curves = {}
    for shape, given in records.groupby("shape", sort=False):
        h = given.edge_length / given.edge_length.max()
        curves[str(shape)] = (h, given.stress_rms)
    convergence(
        curves,
        folder.figure("convergence"),
        x="edge length over that of the coarsest mesh",
        y="stress over α/t less 1, root mean square",
        title="Stress in CalculiX under the form-finding load",
    )


STUDY = Study(
    "structure",
    "CalculiX on the structural models: displacement, stress, reactions; deflection under snow",
    data,
    table,
    figure,
    parameters={"thickness": THICKNESS, "strain": STRAIN, "snow": SNOW},
    seconds=60,
    paper=False,
)
