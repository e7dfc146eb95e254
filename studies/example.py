"""What Examples 2, 3 and 4 have in common: numbers of a run, and the same five pictures."""

from __future__ import annotations

from collections.abc import Mapping

from pcmc import Surface

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
        "iterations": len(E) - 1,
        "share_of_rises": record.energy_rises / max(1, len(E) - 1),
        "energy_fell": E[0] - E[-1],
        "last_tenth_of_fall": (E[-1 - len(E) // 10] - E[-1]) / (E[0] - E[-1]),
        "forced_steps": record.forced_steps,
        "triangles": record.triangles,
    }
    for stage, surface in stages.items():
        of_stage = errors(surface)
        found |= {f"{stage}_{k}": v for k, v in of_stage.items()}
        found[f"{stage}_area"] = external_area(surface)
    for method in METHODS:
        found[f"error_ratio_{method}"] = (
            found[f"final_largest_error_{method}"] / found[f"initial_largest_error_{method}"]
        )
    return found


def shapes(
    folder: Folder,
    case: str,
    pictures: Mapping[str, tuple[str, str]],
    history: str,
) -> None:
    """For each stage its two views and its curvature error, and the history of E."""
