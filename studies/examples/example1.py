"""Example 1, Sec. 4.1: two square patches. Figs. 6 to 10."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from generators import two_squares
from pcmc import Surface, mean_curvature, solve
from pcmc.solvers.result import Progress

from ..folder import Folder
from ..study import Study
from .elevations import draw_elevations
from .example import energy_history, error_percent, error_scale
from .flow import PAPER, SHORT_ITERATIONS, Case, curvature_table, junction_top, run_cases, turn

T0, T0_HISTORIES, ITERATIONS = 0.005, 0.05, 300
WALLS = (0.0, 1.0, 2.0, 3.0)  # Fig. 7b to 7e
COARSE, FINE = 4, 8
STANDS = 0.05  # a wall lower than this, over an initial height of 1, is not seen
EARLY = 60  # iterations in which momentum makes E oscillate in Fig. 10
SOON = 30  # iterations after which the lines of Fig. 10 are compared
LAST = 100  # iterations over which the wall's bouncing is measured
STANDING = {  # momentum, diagonals of the runs that follow the wall of α 3
    "with momentum": (True, "symmetric"),
    "without": (False, "symmetric"),
    "with momentum, diagonals the other way": (True, "parallel"),
}
VARIANTS = {  # Fig. 10: the lines and their names
    "proposed": (True, True),
    "no-line-search": (True, False),
    "no-momentum": (False, True),
    "neither": (False, False),
}


def cases() -> list[Case]:
    """Fig. 7's four walls on both meshes with both Armijo tests, and Fig. 10's four variants."""
    listed = []
    for n, diagonals, wall, armijo in [
        *((COARSE, "symmetric", wall, "printed") for wall in WALLS),
        *((FINE, "symmetric", wall, "printed") for wall in WALLS),
        *((COARSE, "parallel", wall, "printed") for wall in WALLS),
        *((COARSE, "symmetric", wall, "sufficient") for wall in WALLS),
        (FINE, "parallel", 2.0, "printed"),
    ]:
        name = f"wall{wall:g}-n{n}-{diagonals}-{armijo}"
        options = {"t0": T0, "iterations": ITERATIONS, "armijo": armijo}
        listed.append(_case(name, n, diagonals, wall, options))
    for armijo in ("printed", "sufficient"):
        for variant, (momentum, line_search) in VARIANTS.items():
            switches = {"momentum": momentum, "line_search": line_search, "armijo": armijo}
            options = {"t0": T0_HISTORIES, "iterations": ITERATIONS, **switches}
            listed.append(_case(f"fig10-{variant}-{armijo}", COARSE, "symmetric", 2.0, options))
    return listed


def _case(name: str, n: int, diagonals: str, wall: float, options: dict[str, Any]) -> Case:
    build = partial(two_squares, n, alpha_aux=wall, diagonals=diagonals)
    return Case(name, build, options, {"n": n, "diagonals": diagonals, "alpha_aux": wall})


def data(folder: Folder, short: bool) -> None:
    """Solve every case, and follow the wall of α 3, which does not stand for long."""
    run_cases(folder, cases(), short=short)
    folder.write_table("standing", _standing(SHORT_ITERATIONS if short else ITERATIONS))


def _standing(iterations: int) -> pd.DataFrame:
    """The height of the wall of α 3 after each iteration, a run for each of ``STANDING``."""
    tables = []
    for run, (momentum, diagonals) in STANDING.items():
        start = two_squares(COARSE, alpha_aux=WALLS[-1], diagonals=diagonals)
        heights = _heights(start, momentum, iterations)
        columns = {"run": run, "iteration": range(len(heights)), "height": heights}
        tables.append(pd.DataFrame(columns))
    return pd.concat(tables, ignore_index=True)


def _heights(start: Surface, momentum: bool, iterations: int) -> list[float]:
    """The junction's height at the start and after each iteration."""
    junction = start.topology.on_junction
    heights = [start.vertices[junction, 2].max()]

    def note(progress: Progress) -> None:
        heights.append(progress.surface().vertices[junction, 2].max())

    options: dict[str, Any] = {**PAPER, "t0": T0, "tolerance": None, "momentum": momentum}
    solve(start, "nesterov", note, iterations=iterations, **options)
    return heights


def table(folder: Folder) -> dict[str, float]:
    """``curvature``, ``junction`` and ``fig10`` tables, and the numbers for the comparison."""
    meshes = {case.name: folder.read_mesh(case.name) for case in cases()}
    shapes = {name: stages["final"] for name, stages in meshes.items() if not name.startswith("fig10")}
    start = meshes[_main(2.0)]["initial"]
    folder.write_table("curvature", curvature_table({"initial": start} | shapes))
    junction = pd.DataFrame([{"case": name, **_junction(s)} for name, s in shapes.items()])
    folder.write_table("junction", junction)
    fig10 = _fig10(folder.read_table("histories"))
    folder.write_table("fig10", fig10)
    records = folder.read_table("records").set_index("case")
    return (
        _standing_numbers(folder.read_table("standing"))
        | _given(start, records)
        | _shape_numbers(junction.set_index("case"), records)
        | _numbers10(fig10)
    )


def _standing_numbers(standing: pd.DataFrame) -> dict[str, float]:
    """Until which iteration the wall of α 3 stands, and how low it gets in the last ones."""
    tall = (standing.height > STANDS).groupby(standing.run).cummin()
    until = standing[tall].groupby("run").iteration.max()
    symmetric, still, parallel = STANDING
    least = standing[standing.run == parallel].height.iloc[-LAST:].min()
    return {
        "stands_until": until[symmetric],
        "stands_until_without_momentum": until[still],
        "least_height_3_parallel": least,
        "iterations_of_least_height": LAST,
    }


def _given(start: Surface, records: pd.DataFrame) -> dict[str, float]:
    """What the paper states of the initial shape and of its runs, measured on ours."""
    roof = start.patch_faces([0])
    X = start.vertices[np.unique(start.faces[roof])]
    across = np.unique(X[:, 0].round(9))
    return {
        "target": start.patches[0].target_curvature,
        "alpha": start.patches[0].tension,
        "side": float(np.ptp(X[:, 0])),
        "squares": len(across) - 1,
        "square": float(np.diff(across).max()),
        "height": float(start.vertices[junction_top(start), 2]),
        **{key: records[key][_main(2.0)] for key in (*PAPER, "t0", "iterations")},
        **{
            f"{key}_histories": records[key]["fig10-proposed-printed"]
            for key in ("t0", "alpha_aux", "iterations")
        },
    }


def _junction(surface: Surface) -> dict[str, float]:
    """The junction's middle: its height, the turn of the tangent there, and what balance asks."""
    middle = junction_top(surface)
    ratio = surface.tensions[2] / (2.0 * surface.tensions[0])
    return {
        "alpha_aux": surface.tensions[2],
        "height": float(surface.vertices[middle, 2]),
        "turn": turn(surface, middle, ("left", "right")),
        "turn_of_balance": float(2.0 * np.degrees(np.arcsin(ratio))),
    }


def _shape_numbers(junction: pd.DataFrame, records: pd.DataFrame) -> dict[str, float]:
    measured = {}
    for wall in WALLS:
        measured[f"turn_{wall:g}"] = junction.turn[_main(wall)]
        measured[f"height_{wall:g}"] = junction.height[_main(wall)]
        measured[f"gradient_squared_{wall:g}"] = records.gradient_squared[_main(wall)]
    for method in ("cotangent", "variational"):
        for name, n in (("coarse", COARSE), ("fine", FINE)):
            measured[f"largest_{method}_{name}"] = records[f"largest_error_{method}"][_main(2.0, n)]
            measured[f"mean_{method}_{name}"] = records[f"mean_error_{method}"][_main(2.0, n)]
    parallel = [f"wall{wall:g}-n{COARSE}-parallel-printed" for wall in WALLS]
    other = [junction.turn[name] for name in parallel]
    measured["height_3_parallel"] = junction.height[parallel[-1]]
    measured["elements_fine_over_coarse"] = (
        records.triangles[_main(2.0, FINE)] / records.triangles[_main(2.0)]
    )
    measured["least_turn_step_parallel"] = min(b - a for a, b in pairwise(other))
    return measured


def _fig10(histories: pd.DataFrame) -> pd.DataFrame:
    """For each line of Fig. 10: E at a few iterations, its fall in the second half, its rises."""
    rows = []
    for name, history in histories[histories.case.str.startswith("fig10")].groupby("case"):
        E = history.energy.to_numpy()
        up = np.maximum(np.diff(E), 0.0)
        half = len(E) // 2
        rows.append(
            {
                "case": name,
                "energy_30": E[min(SOON, len(E) - 1)],
                "energy_half": E[half],
                "energy_end": E[-1],
                "fall_in_second_half": E[half] - E[-1],
                "rises": int(np.count_nonzero(up > 1e-12 * abs(E[0]))),
                "total_rise": up.sum(),
                "early_rise": up[:EARLY].sum(),
                "forced_steps": int((~history.armijo_held.astype(bool)).sum()),
                "gradient_squared_end": history.gradient_squared.iloc[-1],
            }
        )
    return pd.DataFrame(rows)


def _numbers10(fig10: pd.DataFrame) -> dict[str, float]:
    lines = fig10.set_index("case")
    kept = ["energy_30", "energy_end", "fall_in_second_half", "total_rise", "early_rise", "forced_steps"]
    sufficient: Any = lines.loc["fig10-proposed-sufficient"]
    iterations = {"iterations_of_energy_30": SOON, "iterations_of_early_rise": EARLY}
    rises = {f"fig10_sufficient_{key}": sufficient[key] for key in ("total_rise", "early_rise")}
    return (
        iterations
        | rises
        | {
            f"fig10_{variant.replace('-', '_')}_{key}": lines[key][f"fig10-{variant}-printed"]
            for variant in VARIANTS
            for key in kept
        }
    )


def _main(wall: float, n: int = COARSE) -> str:
    """The case the paper shows."""
    return f"wall{wall:g}-n{n}-symmetric-printed"


def figure(folder: Folder) -> None:
    """Figs. 6 to 10."""
    from pcmc.plot import draw, lines, panel

    meshes = {wall: folder.read_mesh(_main(wall)) for wall in WALLS}
    start, end = meshes[2.0]["initial"], meshes[2.0]["final"]
    for surface, name in ((start, "fig06"), (end, "fig08")):
        numbers = mean_curvature(surface)
        draw(surface, folder.figure(name), numbers=numbers, patches=["left", "right"], legend=True)
    titles = (f"({letter}) α of the wall {wall:g}" for letter, wall in zip("bcde", WALLS, strict=True))
    finals = (stages["final"] for stages in meshes.values())
    shapes = {"(a) initial shape": start} | dict(zip(titles, finals, strict=True))
    draw_elevations(shapes, folder.figure("fig07"), top=1.2)
    standing = folder.read_table("standing")
    heights = {str(run): (mine.iteration, mine.height) for run, mine in standing.groupby("run", sort=False)}
    lines(
        heights,
        folder.figure("fig07-wall"),
        x="iteration",
        y="height of the wall",
        title="Example 1, wall of α 3: its middle sinks to the ground and bounces",
    )
    pair = [end, folder.read_mesh(_main(2.0, FINE))["final"]]
    panel(
        pair,
        folder.figure("fig09"),
        views="plan",
        titles=["(a) coarse mesh", "(b) fine mesh"],
        scalars=[error_percent(s) for s in pair],
        patches=["left", "right"],
        legend=True,
        **error_scale(*pair),
    )
    for test, name, what in (
        ("printed", "fig10", "Eq. (25) as printed: the line search changes nothing"),
        ("sufficient", "fig10-sufficient", "sufficient decrease instead: a late jump does not come"),
    ):
        named = {v.replace("-", " "): f"fig10-{v}-{test}" for v in VARIANTS}
        energy_history(folder, named, name, title=f"Example 1, {what}")


STUDY = Study(
    "example1",
    "two square patches: walls of four tensions, coarse and fine, momentum and line search",
    data,
    table,
    figure,
    parameters={"t0": T0, "t0_histories": T0_HISTORIES, "iterations": ITERATIONS, "walls": WALLS},
    seconds=20,
)
