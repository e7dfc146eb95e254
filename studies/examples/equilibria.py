"""The examples' true equilibria by the geometric solver, and the error that is seen in them.

At an exactly stationary vertex the variational curvature is the target, and Meyer's, which the
paper uses, falls short of it because the vertex's star is not flat. That shortfall is the least
error that any flow can show for long.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pandas as pd

from generators import bezier_hall, four_fans, two_caps, two_squares
from pcmc import Surface, check_mesh, gradient, solve

from ..folder import Folder
from ..study import Study
from .flow import errors

EXAMPLES: dict[str, Callable[[], Surface]] = {
    "example1": two_squares,
    "example2": two_caps,
    "example3": four_fans,
    "example4": bezier_hall,
}
ON_FINER = {  # what the mesh check finds, in a title
    "persists": "so on finer meshes",
    "changes": "other on finer meshes",
    "held by mesh": "held by its mesh",
}


def data(folder: Folder, short: bool) -> None:
    """Solve each example's default mesh; a saddle is as good an equilibrium as a minimum here."""
    rows = []
    for name, build in EXAMPLES.items():
        start = build()
        options: dict[str, Any] = {"iterations": 5} if short else {}
        result = solve(start, "newton", target="stationary", **options)
        certificate = result.certify(modes=0)
        on_finer = "" if short else check_mesh(result).verdict.name.lower()
        rows.append(
            {
                "example": name,
                "triangles": start.m,
                "status": result.status.name.lower(),
                "verdict": certificate.verdict.name.lower(),
                "mesh_verdict": on_finer.replace("_", " "),
                "index": -1 if certificate.index is None else certificate.index,
                "energy": result.energy,
                "gradient_squared": float((gradient(result.surface) ** 2).sum()),
                **errors(result.surface),
            }
        )
        folder.write_mesh(name, {"initial": start, "final": result.surface})
    folder.write_table("records", pd.DataFrame(rows))


def table(folder: Folder) -> dict[str, float]:
    """Largest errors by both definitions."""
    records = folder.read_table("records").set_index("example")
    return {
        f"{key}_{name}": records[f"largest_error_{key}"][name]
        for name in EXAMPLES
        for key in ("cotangent", "variational")
    }


def figure(folder: Folder) -> None:
    """The README's picture: Examples 4, 3 and 2, each drawn to the same size, with both verdicts."""
    from pcmc.plot import panel

    records = folder.read_table("records").set_index("example")
    said = records.verdict + ": " + records.mesh_verdict.map(ON_FINER).fillna("not checked")
    shapes, titles = [], []
    for name in ("example4", "example3", "example2"):
        surface = folder.read_mesh(name)["final"]
        shapes.append(surface.moved(surface.vertices / surface.size))
        titles.append(f"Example {name.removeprefix('example')}, {said[name]}")
    panel(shapes, folder.figure("shapes"), columns=3, supports=False, edges=False, titles=titles)


STUDY = Study(
    "equilibria",
    "the examples' true equilibria, and the error that the paper's measure sees in them",
    data,
    table,
    figure,
    parameters={"method": "newton", "target": "stationary"},
    seconds=15,
)
