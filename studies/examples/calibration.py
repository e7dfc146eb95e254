"""How near the initial ‖∇E‖² of each mesh family comes to the printed one, at each resolution."""

from __future__ import annotations

from dataclasses import asdict

import pandas as pd

from generators.calibration import EDGES_2, EDGES_4, RINGS_3, candidates

from ..folder import Folder
from ..study import Study


def data(folder: Folder, short: bool) -> None:
    """Build every mesh of the declared lists and measure it."""
    meshes = candidates(["example3"] if short else ("example2", "example3", "example4"))
    rows = [asdict(candidate) | {"ratio": candidate.ratio} for candidate in meshes]
    folder.write_table("records", pd.DataFrame(rows))


def table(folder: Folder) -> dict[str, float]:
    """``nearest``: of each family the resolution that comes nearest; numbers of the nearest of all."""
    records = folder.read_table("records")
    records["off"] = (records.ratio - 1.0).abs()
    nearest = records.sort_values(["example", "off"]).groupby(["example", "family"]).head(1)
    folder.write_table("nearest", nearest.drop(columns="off"))
    best = nearest.groupby("example").first()
    return {
        f"{key}_{example}": row[key]
        for example, row in best.iterrows()
        for key in ("squared_gradient", "ratio", "resolution")
    }


def figure(folder: Folder) -> None:
    """For each example ‖∇E‖² over the printed value against the number of triangles."""
    from pcmc.plot import lines

    for example, mine in folder.read_table("records").groupby("example"):
        curves = {
            str(family): (rows.triangles.to_numpy(), rows.ratio.to_numpy())
            for family, rows in mine.groupby("family")
        }
        lines(
            curves,
            folder.figure(str(example)),
            x="triangles",
            y="initial ‖∇E‖² / printed",
            title=f"Example {str(example).removeprefix('example')}: the initial shape's ‖∇E‖²",
            levels={"printed": 1.0},
            xscale="log",
            yscale="log",
            markers=True,
        )


STUDY = Study(
    "calibration",
    "how near the initial ‖∇E‖² of each mesh family comes to the printed one",
    data,
    table,
    figure,
    parameters={"edge_lengths_2": EDGES_2, "rings_3": RINGS_3, "edge_lengths_4": EDGES_4},
    seconds=15,
)
