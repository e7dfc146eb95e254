"""Example 2, Sec. 4.2: two spherical caps. Figs. 11 to 15; Fig. 16 is ``alpha_grid``."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from generators import two_caps
from pcmc import Surface, mean_curvature

from ..folder import Folder
from ..paper import printed
from ..study import Study
from .example import gradient_history, numbers, shapes
from .flow import Case, curvature_table, run_cases

T0, ITERATIONS = 0.01, 1000
EDGE_LENGTH = 1.2  # chosen: the finest upright wall's on which ‖∇E‖² gets below the printed bound
CENTRES = {"large": (-5.0, 0.0, -17.5), "small": (3.0, 0.0, -7.5)}  # of the paper's spheres
OPTIONS = {"t0": T0, "iterations": ITERATIONS}


def cases() -> list[Case]:
    """The flow with both Armijo tests, L-BFGS beside it, and the flow on finer meshes."""
    build, varied = partial(two_caps, EDGE_LENGTH), {"edge_length": EDGE_LENGTH}
    finer = (Case(f"finer-{h:g}", partial(two_caps, h), OPTIONS, {"edge_length": h}) for h in (0.8, 0.6, 0.5))
    return [
        Case("main", build, OPTIONS, varied),
        Case("sufficient", build, OPTIONS | {"armijo": "sufficient"}, varied),
        Case("calibrated", two_caps, OPTIONS),
        Case("lbfgs", build, {"evaluations": 2 * ITERATIONS}, varied, method="lbfgs"),
        *finer,
    ]


def data(folder: Folder, short: bool) -> None:
    """Solve every case."""
    run_cases(folder, cases(), short=short)


def table(folder: Folder) -> dict[str, float]:
    """``curvature`` and ``patches`` tables, and the numbers for the comparison."""
    stages = folder.read_mesh("main")
    folder.write_table("curvature", curvature_table(stages))
    patches = pd.DataFrame([_patch(stages, name) for name in CENTRES])
    folder.write_table("patches", patches)
    found = numbers(folder, "main", stages) | {
        f"{key}_{row['patch']}": row[key]
        for row in patches.to_dict("records")
        for key in row
        if key != "patch"
    }
    records = folder.read_table("records").set_index("case")
    return found | {
        "alpha_wall": stages["initial"].tensions[stages["initial"].patch_index("wall")],
        "t0": T0,
        "calibrated_initial_gradient_squared": records.initial_gradient_squared["calibrated"],
        "calibrated_least_gradient_squared": records.least_gradient_squared["calibrated"],
        "lbfgs_gradient_squared": records.gradient_squared["lbfgs"],
        "forced_steps_sufficient": records.forced_steps["sufficient"],
    }


def _patch(stages: dict[str, Surface], name: str) -> dict[str, float | str]:
    """How a patch lies on its sphere at the start, its curvature then, and how high it gets."""
    start, end = stages["initial"], stages["final"]
    index = start.patch_index(name)
    mine = np.unique(start.faces[start.patch_faces([index])])
    inside = mine[start.topology.interior[mine]]
    return {
        "patch": name,
        "radius": float(np.linalg.norm(start.vertices[inside] - CENTRES[name], axis=1).mean()),
        "initial_curvature": float(np.mean(mean_curvature(start)[inside])),
        "initial_curvature_variational": float(np.mean(mean_curvature(start, "variational")[inside])),
        "target": start.patches[index].target_curvature,
        "alpha": start.patches[index].tension,
        "initial_height": float(start.vertices[mine, 2].max()),
        "final_height": float(end.vertices[mine, 2].max()),
    }


def figure(folder: Folder) -> None:
    """Figs. 11 to 15."""
    pictures = {"initial": ("fig11", "fig12"), "final": ("fig13", "fig14")}
    shapes(folder, "main", pictures, "fig15", printed("example2.gradient_squared"), walls_view=(-165.0, 15.0))
    gradient_history(folder, {"the paper's flow": "main", "L-BFGS": "lbfgs"}, "methods")


STUDY = Study(
    "example2",
    "two spherical caps of different target curvature with a wall between them",
    data,
    table,
    figure,
    parameters={"edge_length": EDGE_LENGTH, **OPTIONS},
    seconds=20,
)
