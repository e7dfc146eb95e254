"""How many different panels a roof needs: families against tolerance, before and after the optimiser.

Tolerances and changes of shape are in parts of the mean edge length. ``least`` is a bound from below: no
sorting of the same panels into families has fewer.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd

from generators import bezier_hall, four_fans, two_caps, two_squares
from pcmc import FewerFamilies, Surface, fewer_families, panels, project, solve
from pcmc.surface.geometry import segment_lengths

from ..folder import Folder
from ..study import Study

ROOF = Path(__file__).parents[2] / "notebooks" / "roof.toml"
TOLERANCES = (0.003, 0.01, 0.03, 0.1)  # of the mean edge
CHANGE = 0.05  # of the mean edge
COMPARED = 0.01  # the tolerance at which vertices also leave the equilibrium
SHORT = ("Example 1",)
SHORT_ROUNDS, ROUNDS = 2, 24
ROOF_NAME = "L-shaped roof"


def _solved_roof() -> Surface:
    roof = project.load(ROOF)
    return project.solve_project(roof, project.surface_of(roof)).surface


def _solved(build: Callable[[], Surface]) -> Callable[[], Surface]:
    return lambda: solve(build(), target="stationary").surface


EXAMPLES: dict[str, Callable[[], Surface]] = {
    "Example 1": _solved(lambda: two_squares(8)),
    "Example 2": _solved(two_caps),
    "Example 3": _solved(four_fans),
    "Example 4": _solved(bezier_hall),
    ROOF_NAME: _solved_roof,
}


def data(folder: Folder, short: bool) -> None:
    """``families``: a row per example, tolerance and way; meshes of the roof before and after."""
    rows = []
    for name, build in EXAMPLES.items():
        if short and name not in SHORT:
            continue
        surface = build()
        edge = float(segment_lengths(surface.vertices, surface.topology.edges).mean())
        for part in TOLERANCES[1:2] if short else TOLERANCES:
            ways = (True, False) if part == COMPARED else (True,)
            for at_rest in ways:
                result = fewer_families(
                    surface,
                    part * edge,
                    CHANGE * edge,
                    at_rest=at_rest,
                    anyway=True,  # Example 3 is a saddle
                    rounds=SHORT_ROUNDS if short else ROUNDS,
                )
                rows.append({"example": name, "tolerance": part, "at_rest": at_rest} | _numbers(result, edge))
                if part == COMPARED and at_rest and name in (ROOF_NAME, *SHORT):
                    stages = {"before": surface, "after": result.surface}
                    folder.write_mesh(name.lower().replace(" ", "-"), stages)
    folder.write_table("families", pd.DataFrame(rows))


def _numbers(result: FewerFamilies, edge: float) -> dict[str, Any]:
    """The counts, and what the motion costs; lengths in mean edges, with three digits."""
    row: dict[str, Any] = {"panels": len(result.before.panels)}
    for stage, schedule in (("before", result.before), ("after", result.after)):
        row |= {stage: schedule.count, f"least_{stage}": schedule.at_least}
    for stage, certificate in (("before", result.before.certificate), ("after", result.after.certificate)):
        row[f"verdict_{stage}"] = certificate.verdict.name.lower()
        # up to here it is rounding, which differs from machine to machine
        row[f"residual_{stage}"] = _rounded(certificate.residual, 1e-9)
        row[f"curvature_error_{stage}"] = _rounded(certificate.curvature_error, 1e-7)
    return row | {"change": _rounded(result.change / edge), "moved": _rounded(result.moved / edge)}


def _rounded(value: float, least: float = 0.0) -> float:
    return float(f"{value:.2e}") if value > least else 0.0


def table(folder: Folder) -> dict[str, float]:
    """The share of families that is left, over all examples, by tolerance; and what leaving rest costs."""
    records = folder.read_table("families")
    records["left"] = records["after"] / records["before"]
    rest, loose = records[records["at_rest"]], records[~records["at_rest"]]
    worst = (rest["before"] / rest["least_before"]).max()
    measured = {f"left_{part:g}": float(group["left"].median()) for part, group in rest.groupby("tolerance")}
    return {
        **measured,
        "before_over_least": float(worst),
        "same_verdict_after": float((rest["verdict_after"] == rest["verdict_before"]).mean()),
        "stable_after": float((rest["verdict_after"] == "stable").mean()),
        "below_least_before": float((rest["after"] < rest["least_before"]).mean()),
        "loose_left": float(loose["left"].median()),
        "loose_curvature_error": float(loose["curvature_error_after"].max()),
        "loose_residual": float(loose["residual_after"].max()),
    }


def figure(folder: Folder) -> None:
    """Families against tolerance; the roof's panels in the colours of their families."""
    from pcmc.plot import panel

    from ..figure_panels import curve_panels

    records = folder.read_table("families")
    records = records[records["at_rest"]]
    curves = {
        f"{name}, {mine['panels'].iloc[0]} panels": {
            "before": (mine["tolerance"], mine["before"]),
            "before, the least that any sorting has": (mine["tolerance"], mine["least_before"]),
            "after the optimiser": (mine["tolerance"], mine["after"]),
        }
        for name, mine in records.groupby("example", sort=False)
    }
    path, xlabel = folder.figure("families"), "tolerance / mean edge"
    ylabel = "families of panels"
    curve_panels(curves, path, columns=3, xlabel=xlabel, ylabel=ylabel, height=330, ticks=TOLERANCES)
    for path in folder.meshes():
        stages = folder.read_mesh(path.stem)
        surfaces = list(stages.values())
        edge = float(segment_lengths(surfaces[0].vertices, surfaces[0].topology.edges).mean())
        schedules = [panels(surface, COMPARED * edge, anyway=True) for surface in surfaces]
        panel(
            surfaces,
            folder.figure(path.stem),
            views="plan",
            scalars=[schedule.family_of_face for schedule in schedules],
            titles=[f"{stage}: {one.count} families" for stage, one in zip(stages, schedules, strict=True)],
            patches=sorted(set(schedules[0].panels["patch"])),
            label=f"family, the largest first; within {COMPARED:g} of the mean edge",
            cmap="turbo",
            limits=(1.0, float(max(2, *(schedule.count for schedule in schedules)))),
            edges=True,
            supports=False,
        )


STUDY = Study(
    "panels",
    "how many different panels the roofs need, before and after the optimiser",
    data,
    table,
    figure,
    parameters={"tolerances": list(TOLERANCES), "change": CHANGE, "rounds": ROUNDS},
    seconds=90,
    paper=False,
)
