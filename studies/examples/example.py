"""What Examples 2, 3 and 4 have in common: numbers of a run, and the same five pictures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pcmc import Surface, curvature_error
from pcmc.base.arrays import Floats
from pcmc.forces.curvature import METHODS

from ..folder import Folder
from .flow import errors, external_area

ENLARGED = 0.12  # the part of E's range that an inset shows
EVEN = 0.01  # a smaller relative spread of errors shows as one colour


def error_percent(surface: Surface) -> Floats:
    """(n,) size of the relative curvature error, %; NaN where there is no mean curvature."""
    return 100.0 * np.abs(curvature_error(surface))


def error_scale(*surfaces: Surface) -> dict[str, Any]:
    """How ``error_percent`` is coloured: from 0, the palest, to the largest of all surfaces."""
    largest = max(float(np.nanmax(error_percent(surface))) for surface in surfaces)
    label = "|H − H̄| / H̄, % (none on boundaries and junctions)"
    return {"label": label, "cmap": "YlGnBu", "limits": (0.0, largest)}


def numbers(folder: Folder, case: str, stages: Mapping[str, Surface]) -> dict[str, float]:
    """Of a case: ‖∇E‖² at both ends, errors at each stage, and how smoothly E fell."""
    record = folder.read_table("records").set_index("case").loc[case]
    history = folder.read_table("histories")
    E = history.energy[history.case == case].to_numpy()
    measured: dict[str, Any] = {
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
        measured |= {f"{stage}_{key}": value for key, value in errors(surface).items()}
        measured[f"{stage}_area"] = external_area(surface)
    for method in METHODS:
        measured[f"error_ratio_{method}"] = (
            measured[f"final_largest_error_{method}"] / measured[f"initial_largest_error_{method}"]
        )
    return measured


def shapes(
    folder: Folder,
    case: str,
    pictures: Mapping[str, tuple[str, str | None]],
    history: str,
    bound: float,
    walls_view: str | tuple[float, float] = "diagonal",
) -> None:
    """For each stage its views, its walls alone and its curvature error, and the history.

    ``pictures``: by stage the figure of its shape and, if there is one, the figure of its error; ``bound`` is
    the ‖∇E‖² that the paper prints at the end.
    """
    from pcmc.plot import draw, panel

    stages = folder.read_mesh(case)
    for stage, (shape, error) in pictures.items():
        surface = stages[stage]
        roofs, walls = ([p.name for p in surface.patches if p.auxiliary is x] for x in (False, True))
        panel(
            [surface] * 4,
            folder.figure(shape),
            views=["diagonal", "elevation", "plan", walls_view],
            titles=["(a) diagonal view", "(b) elevation view", "plan", "the walls alone, larger"],
            patches=[None, None, None, walls],
            columns=2,
            one_scale=False,
            legend=True,
            width=1150,
        )
        if error is not None:
            draw(
                surface,
                folder.figure(error),
                view="plan",
                scalars=error_percent(surface),
                patches=roofs,
                width=800,
                legend=True,
                title=_even(surface),
                **error_scale(surface),
            )
    flow_history(folder, case, history, bound)


def _even(surface: Surface) -> str:
    """The range of the errors where they are nearly the same: such a picture shows one colour."""
    error = error_percent(surface)
    low, high = float(np.nanmin(error)), float(np.nanmax(error))
    return f"nearly one value everywhere: {low:.1f} to {high:.1f} %" if high - low < EVEN * high else ""


def flow_history(folder: Folder, case: str, name: str, bound: float) -> None:
    """E less its end and ‖∇E‖² over the iterations, both on logarithmic axes.

    ``bound`` is the ‖∇E‖² that the paper prints at the end. The end of E is its least, and is not drawn.
    """
    from pcmc.plot.curves import add_legend, label_axes
    from pcmc.plot.figure import CURVES, INK, finish, new, style

    table = folder.read_table("histories")
    mine = table[table.case == case]
    energy = mine.energy.to_numpy()
    left = energy - energy.min()
    picture = new(1500, 620, pad=8.0)
    curves = (
        (left, f"E − {energy.min():.6g}, its least", CURVES[0]),
        (mine.gradient_squared.to_numpy(), "‖∇E‖²", CURVES[1]),
    )
    for axes, (values, label, color) in zip(picture.subplots(1, 2), curves, strict=True):
        style(axes)
        shown = np.where(values > 0.0, values, np.nan)
        axes.plot(mine.iteration, shown, color=color, linewidth=1.1, label="the paper's flow")
        axes.set_yscale("log")
        label_axes(axes, "iteration", label)
    axes.axhline(bound, color=INK, linewidth=0.9, linestyle=(0, (5, 3)), label="printed at the end")
    add_legend(axes, 2)
    finish(picture, folder.figure(name))


def energy_history(folder: Folder, cases: Mapping[str, str], name: str, title: str) -> None:
    """E against the iteration for cases by their names in the picture, and its lowest part enlarged."""
    from pcmc.plot.curves import add_legend, new_axes
    from pcmc.plot.figure import CURVES, SMALL, finish, overlap_style, style

    table = folder.read_table("histories")
    frames = {label: table[table.case == case] for label, case in cases.items()}
    picture, axes = new_axes(1200, 720, title, "iteration", "energy E")
    part = style(axes.inset_axes((0.3, 0.3, 0.68, 0.45)))
    for k, (label, frame) in enumerate(frames.items()):
        look = {"color": CURVES[k]} | overlap_style(k, len(frames))
        for place in (axes, part):
            place.plot(frame.iteration, frame.energy, label=label, **look)
    low = min(frame.energy.min() for frame in frames.values())
    high = max(frame.energy.max() for frame in frames.values())
    part.set_ylim(low - 0.1 * ENLARGED * (high - low), low + ENLARGED * (high - low))
    part.set_title("enlarged", fontsize=SMALL, pad=2.0)
    axes.indicate_inset_zoom(part, edgecolor="#808080", linewidth=0.6)
    add_legend(axes, len(frames))
    finish(picture, folder.figure(name))


def gradient_history(folder: Folder, cases: Mapping[str, str], name: str) -> None:
    """‖∇E‖² against the evaluation: the axis on which different methods can be compared."""
    from pcmc.plot import histories

    table = folder.read_table("histories")
    frames = {label: table[table.case == case] for label, case in cases.items()}
    histories(frames, folder.figure(name), x="evaluation", y="gradient_squared", label="‖∇E‖²")
