"""Two drawings with every layer, and the roofs that they become."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path
from typing import Any

CANOPY: dict[str, Any] = {  # layer: the points of its line, or one point
    "outline": [(0, 0), (12, 0), (12, 8), (0, 8), (0, 0)],
    "support": [(0, 8, 4), (12, 8, 4)],
    "mast a": (0, 0, 2.5),
    "mast b": (12, 0, 2.5),
    "cable front": [(0, 0), (12, 0)],
    "free": [(0, 0), (0, 8)],
    "cable ridge": [(6, 0), (6, 8)],
}
HALL: dict[str, Any] = {
    "outline": [(0, 0), (16, 0), (16, 7), (0, 7), (0, 0)],
    "mirror": [(0, 0), (16, 0)],
    "upright gable": [(6, 0), (6, 7)],
    "divider": [(11, 0), (11, 7)],
    "patch foyer": (3, 3.4),
    "patch hall": (8.5, 3.4),
    "patch bar": (13.5, 3.4),
}


def drawn(layers: dict[str, Any], path: Path) -> Path:
    """Write a drawing in metres with these layers."""
    import ezdxf

    document = ezdxf.new(units=ezdxf.units.M)
    space = document.modelspace()
    for layer, points in layers.items():
        if isinstance(points, tuple):
            space.add_point(points, dxfattribs={"layer": layer})
        else:
            space.add_polyline3d(points, dxfattribs={"layer": layer})
    document.saveas(path)
    return path


def roofs() -> list[Any]:
    """The outcomes of both drawings."""
    from pcmc.project import load, run_project

    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        files = [drawn(layers, Path(folder) / f"{k}.dxf") for k, layers in enumerate((CANOPY, HALL))]
        return [run_project(load(file)) for file in files]


def picture(path: Path) -> None:
    """Write the picture: on the left the drawings with their layers, on the right the roofs."""
    import matplotlib.pyplot as plt
    import numpy as np

    from pcmc.plot import draw

    figure, axes = plt.subplots(2, 2, figsize=(10, 6.4), layout="constrained", width_ratios=[1, 1.1])
    for (left, right), layers, outcome in zip(axes, (CANOPY, HALL), roofs(), strict=True):
        for number, (layer, points) in enumerate(layers.items()):
            P = np.atleast_2d(np.array([(*p, 0)[:3] for p in np.atleast_2d(points)], dtype=float))
            colour = "black" if layer == "outline" else f"C{number}"
            name = layer.split()[0]
            style = {"mast": "^", "patch": "x"}.get(name, "-")
            left.plot(*P[:, :2].T, style, color=colour, lw=1.5 if name == "outline" else 3, clip_on=False)
            x, y = P[:2, :2].mean(axis=0)
            if layer == "outline":
                x, y = P[:, 0].max(), P[:, 1].mean()
            height = f", z = {P[0, 2]:g}" if P[0, 2] else ""
            beside = (len(P) == 2 and P[0, 0] == P[1, 0]) or layer == "outline"
            below = name != "patch" and y == 0.0
            left.annotate(
                layer + height,
                (x, y),
                xytext=(4, 0) if beside else (0, -16) if below else (0, 5),
                textcoords="offset points",
                color=colour,
                fontsize=9,
                ha="left" if beside else "center",
                va="center" if beside else "bottom",
                rotation=90 if beside else 0,
            )
        left.set_aspect("equal")
        left.margins(0.06)
        right.imshow(draw(outcome.shown.surface))
        for axis in (left, right):
            axis.set_axis_off()
    figure.savefig(path, dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    picture(Path("drawing_layers.png"))
