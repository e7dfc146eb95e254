"""What Examples 2, 3 and 4 have in common: numbers of a run, and the same five pictures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pcmc import Surface, curvature_error

from .flow import METHODS, errors, external_area
from .folder import Folder


def numbers(folder: Folder, case: str, stages: Mapping[str, Surface]) -> dict[str, float]:
    """Of a case: ‖∇E‖² at both ends, errors at each stage, and how smoothly E fell."""
    record = folder.read_table("records").set_index("case").loc[case]
    history = folder.read_table("histories")
    E = history.energy[history.case == case].to_numpy()
    found = {
        "initial_gradient_squared": record.initial_gradient_squared,
        "gradient_squared": record.gradient_squared,
        "least_gradient_squared": record.least_gradient_squared,
        "at_iteration": record.at_row,
        "iterations": len(E) - 1,
        "share_of_rises": record.energy_rises / max(1, len(E) - 1),
        "total_rise": np.maximum(np.diff(E), 0.0).sum() / (E[0] - E[-1]),
        "energy_fell": E[0] - E[-1],
        "last_tenth_of_fall": (E[-1 - len(E) // 10] - E[-1]) / (E[0] - E[-1]),
        "forced_steps": record.forced_steps,
        "triangles": record.triangles,
    }
    for stage, surface in stages.items():
        found |= {f"{stage}_{key}": value for key, value in errors(surface).items()}
        found[f"{stage}_area"] = external_area(surface)
    for method in METHODS:
        found[f"error_ratio_{method}"] = (
            found[f"final_largest_error_{method}"] / found[f"initial_largest_error_{method}"]
        )
    return found


def shapes(
    folder: Folder,
    case: str,
    pictures: Mapping[str, tuple[str, str | None]],
    history: str,
) -> None:
    """For each stage its two views and its curvature error, and the history of E.

    ``pictures``: by stage the figure of its shape and, if there is one, the figure of its error.
    """
    from pcmc.plot import draw, panel

    stages = folder.read_mesh(case)
    for stage, (shape, error) in pictures.items():
        surface = stages[stage]
        titles = ["(a) diagonal view", "(b) elevation view"]
        panel(
            [surface, surface], folder.figure(shape), views=["diagonal", "elevation"],
            titles=titles, legend=True,
        )  # fmt: skip
        if error is not None:
            percent = 100.0 * curvature_error(surface)
            draw(
                surface, folder.figure(error), view="plan", scalars=percent, label="error, %",
                width=800,
            )  # fmt: skip
    energy_history(folder, {"proposed method": case}, history)


def energy_history(folder: Folder, cases: Mapping[str, str], name: str) -> None:
    """E against the iteration for cases by their names in the picture."""
    from pcmc.plot import histories

    table = folder.read_table("histories")
    frames = {label: table[table.case == case] for label, case in cases.items()}
    histories(frames, folder.figure(name), x="iteration", label="energy E")


def gradient_history(folder: Folder, cases: Mapping[str, str], name: str) -> None:
    """‖∇E‖² against the evaluation: the axis on which different methods can be compared."""
    from pcmc.plot import histories

    table = folder.read_table("histories")
    frames = {label: table[table.case == case] for label, case in cases.items()}
    histories(frames, folder.figure(name), x="evaluation", y="gradient_squared", label="‖∇E‖²")
