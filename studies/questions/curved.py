"""How soon an energy is known to how many digits: flat and curved elements, with Surface Evolver beside them.

Every run begins with the same flat mesh, solves it, and where its elements are curved bends them and solves
them. Ours stops at a residual of REST. The program takes Newton steps; its time is that until its energy is
within REST of the last one, and reading is not counted. Its nodes on curved boundaries, and those that
``elevate`` places beside them, start where ours do. Both are processor times of one thread.

The roof over an L has no closed form. Its reference is the energy of elements of order 8 on a mesh with
edges 2^-LEVELS times as long at the re-entrant corner as elsewhere. In linear theory its height grows as
r^(2/3) from the corner, and on even meshes no element has a better order than 4/3. Closer to the corner than
about 1e-4 the surface is steep and overhangs, and finer triangles collapse.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from generators import (
    delaunay,
    delaunay_exact,
    double_bubble,
    double_bubble_exact,
    joined_caps,
    joined_caps_exact,
    spherical_cap,
    spherical_cap_exact,
)
from generators.exact import ExactSolution
from pcmc import Surface
from pcmc.accuracy.extrapolation import extrapolate
from pcmc.meshing.elevation import elevate, flat_places
from pcmc.meshing.local_refinement import refine_near
from pcmc.meshing.refinement import Projection, refine
from pcmc.plan import Plan
from pcmc.solvers import solve

from ..figure_panels import curve_panels
from ..folder import Folder
from ..orders import slope
from ..reference import evolver
from ..study import Study
from .refinement import FAMILIES

REST = 1e-10
LEVELS, REACH = 8, 0.35  # of refinement at the corner of the L, and what the first reaches
REFERENCE = 0.3  # edge length of its reference away from the corner
CORNER = [[1.0, 1.0, 0.0]]
FLAT, BENT = 6, 4  # Newton steps that the program is given, before and after it bends the triangles
ACCURACIES = 10.0 ** -np.arange(3, 11)
NESTED = 3  # meshes that are extrapolated from
# how many times finer than the coarsest mesh
OURS = {
    "flat": (1, 2, 4, 8),
    "extrapolated": (1, 2, 4),
    "order 2": (1, 2, 4),
    "order 4": (1, 2),
    "order 8": (0.5, 1),
}
THEIRS = {
    "linear": (1, 2, 4, 8),
    "quadratic": (1, 2, 4),
    "lagrange 4": (1, 2),
    "lagrange 8": (0.5,),
}
GRADED = {2: (2, 4, 8), 4: (2, 3, 4)}  # meshes of the L by order, uniform and graded


@dataclass(frozen=True)
class Case:
    """A surface on meshes of any edge length.

    Attributes
    ----------
    build : the start on a mesh of an edge length.
    edge : of the coarsest mesh.
    exact : the closed form; None for the L.
    project : puts nodes on its round boundary.
    upright : whether the program may take volumes as ∫ z dA, which is faster.
    before : the program's steps before Newton's.
    """

    name: str
    title: str
    build: Callable[[float], Surface]
    edge: float
    exact: Callable[[], ExactSolution] | None
    project: Projection | None = None
    upright: bool = False
    before: str = ""


def _onto_rings(points: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Points near the rings of the unduloid on them."""
    rings = delaunay(0.6, exact=True)
    on = points.copy()
    on[:, :2] *= np.hypot(*rings.vertices[rings.fixed][0, :2]) / np.hypot(*points.T[:2])[:, None]
    return on


def ell(edge: float) -> Surface:
    """A roof over an L."""
    return Plan([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], tension=1.0, edge_length=edge).surface()


ROUND = {family.name: family.rounded for family in FAMILIES}
CASES = (
    Case("cap", "cap", spherical_cap, 0.25, spherical_cap_exact, ROUND["cap"], upright=True),
    Case("unduloid", "unduloid", delaunay, 0.6, delaunay_exact, _onto_rings),
    Case(
        "joined_caps",
        "two caps",
        joined_caps,
        1.4,
        joined_caps_exact,
        ROUND["joined_caps"],
        True,
        "g 5\n" + 8 * "hessian_seek\n",
    ),
    Case("double_bubble", "double bubble", double_bubble, 1.0, double_bubble_exact),
    Case("ell", "roof over an L", ell, 0.25, None, upright=True),
)


def data(folder: Folder, short: bool) -> None:
    """``records``: the error of each run; ``times``: its seconds; ``graded``: the L, uniform and graded."""
    records: list[dict[str, Any]] = []
    for case in CASES[:1] if short else CASES:
        exact = case.exact().energy if case.exact else reference(short)
        ours = {elements: partial(_ours, case, elements) for elements in OURS}
        theirs = {elements: partial(_theirs, case, elements) for elements in THEIRS}
        for program, runs, sizes in (("pcmc", ours, OURS), (evolver.PROGRAM, theirs, THEIRS)):
            if program == evolver.PROGRAM and not evolver.available():
                continue
            for elements, run in runs.items():
                if program == "pcmc" and not short:
                    run(case.edge)  # loads compiled code
                for finer in sizes[elements][: 1 if short else None]:
                    triangles, energy, seconds = run(case.edge / finer)
                    about = {"case": case.name, "program": program, "elements": elements, "finer": finer}
                    error = {"triangles": triangles, "error": abs(energy / exact - 1.0)}
                    records.append(about | error | {"seconds": seconds})
    table = pd.DataFrame(records)
    folder.write_table("records", table.drop(columns="seconds"))
    folder.write_table("times", table.drop(columns="error"))
    folder.write_table("graded", pd.DataFrame(_graded_rows(short)))


def _ours(case: Case, elements: str, edge: float) -> tuple[int, float, float]:
    """Triangles, energy and seconds of a run; no energy where it does not come to rest."""
    start, kind = case.build(edge), elements.split()[-1]
    begin, energies = time.process_time(), []
    for mesh in range(NESTED if kind == "extrapolated" else 1):
        result = solve(start, "newton", target="stationary", tolerance=REST)
        if kind.isdigit():
            bent = elevate(result.surface, int(kind), case.project)
            result = solve(bent, "newton", target="stationary", tolerance=REST)
        energies.append(result.energy if result.converged else np.nan)
        if mesh < NESTED - 1 and kind == "extrapolated":
            start = refine(result.surface, 1, case.project)
    energy = energies[-1]
    if len(energies) > 1:
        energy = float(extrapolate(np.array(energies)[:, None], np.array([REST])).limit[0])
    return start.m, energy, time.process_time() - begin


def _theirs(case: Case, elements: str, edge: float) -> tuple[int, float, float]:
    """The same of the program; no energy where its steps do not settle."""
    start = case.build(edge)
    show = 'printf "S {} %.17g %.17g\\n", total_energy, clock - begun\n'
    steps = (show + "hessian\n") * FLAT + show
    commands = "hessian_normal on\nbegun := clock\n" + case.before + steps.format(*[0] * (FLAT + 1))
    if elements != "linear":
        order = int(elements.split()[-1]) if " " in elements else 2
        commands += f"{elements}\n" + _bend(case, start, elements, order)
        commands += ((show + "hessian\n") * BENT + show).format(*[1] * (BENT + 1))
    out = evolver.run(start, commands, 900.0, case.upright).replace("(NaN)", "nan")
    answers = evolver.numbers(out, "S", 3)
    seconds = 0.0
    for stage in np.unique(answers[:, 0]):
        energy, clock = answers[answers[:, 0] == stage, 1:].T
        near = np.abs(energy[:-1] - energy[1:]) <= REST * np.abs(energy[1:])
        if not near.any():
            return start.m, np.nan, np.nan
        seconds += clock[near.argmax()] - (clock[0] if stage else 0.0)
    return start.m, float(energy[near.argmax()]), float(seconds)


def _bend(case: Case, start: Surface, elements: str, order: int) -> str:
    """Commands that move the program's new nodes as ``elevate`` moves ours, by their places on the start."""
    if case.project is None:
        return ""
    bent = elevate(start, order, case.project)
    flat = flat_places(bent, bent.vertices)
    moves = bent.vertices - flat
    show = '\nforeach vertex vv do printf "V %d %.17g %.17g %.17g\\n", vv.id, vv.x, vv.y, vv.z'
    nodes = evolver.numbers(evolver.run(start, elements + show), "V", 4)
    away, own = cKDTree(flat - start.origin).query(nodes[:, 1:])
    assert np.max(away) < 1e-9 * start.size
    text = ""
    for number, move in zip(nodes[:, 0].astype(int), moves[own], strict=True):
        for axis, change in zip("xyz", move.tolist(), strict=True):
            text += f"vertex[{number}].{axis} += {change!r}\n" if abs(change) > 1e-14 else ""
    return text


def graded(edge: float, levels: int) -> Surface:
    """The roof over an L of flat triangles at rest, with edges 2^-levels times as long at its corner."""
    flat = solve(ell(edge), target="stationary").surface
    return solve(refine_near(flat, CORNER, levels, REACH), target="stationary").surface if levels else flat


@cache
def reference(short: bool) -> float:
    """The energy of the roof over an L."""
    bent = elevate(graded(REFERENCE, 1 if short else LEVELS), 2 if short else 8)
    result = solve(bent, target="stationary", tolerance=REST)
    assert result.converged
    return result.energy


def _graded_rows(short: bool) -> Iterator[dict[str, Any]]:
    """The L on even and on graded meshes, by order."""
    for order, sizes in GRADED.items():
        for levels in (0, 1 if short else LEVELS):
            for finer in sizes[: 1 if short else None]:
                bent = elevate(graded(2.0 * REFERENCE / finer, levels), order)
                result = solve(bent, target="stationary", tolerance=REST)
                yield {
                    "order": order,
                    "levels": levels,
                    "finer": finer,
                    "triangles": bent.m // order**2,
                    "status": result.status.name.lower(),
                    "error": abs(result.energy / reference(short) - 1.0),
                }


def table(folder: Folder) -> dict[str, float]:
    """``orders`` of errors; ``ahead_times``: the seconds of the cheapest run that is as accurate."""
    records, times = folder.read_table("records"), folder.read_table("times")
    rows: list[dict[str, Any]] = []
    for (case, elements), mine in records[records.program == "pcmc"].groupby(
        ["case", "elements"], sort=False
    ):
        rows.append({"case": case, "meshes": "even", "elements": elements, **_order(mine)})
    corner = folder.read_table("graded")
    for (order, levels), mine in corner.groupby(["order", "levels"], sort=False):
        about = {"case": "ell at its corner", "meshes": "graded" if levels else "even"}
        rows.append(about | {"elements": f"order {order}", **_order(mine)})
    orders = pd.DataFrame(rows)
    folder.write_table("orders", orders)
    runs = records.merge(times)
    ahead = [
        _cheapest(runs[runs.case == case.name], case, accuracy) for case in CASES for accuracy in ACCURACIES
    ]
    folder.write_table("ahead_times", pd.DataFrame([row for row in ahead if row]))
    return {
        f"order_{row['case']}_{row['meshes']}_{row['elements']}".replace(" ", "_"): row["order"]
        for row in rows
        if np.isfinite(row["order"])
    }


def _order(rows: pd.DataFrame) -> dict[str, float]:
    """Of the error in 1/√triangles."""
    found = slope(rows.triangles.to_numpy(dtype=float) ** -0.5, rows.error.to_numpy(dtype=float))
    return {"order": found.order, "standard_error": found.standard_error, "least": float(rows.error.min())}


def _cheapest(runs: pd.DataFrame, case: Case, accuracy: float) -> dict[str, Any]:
    """The quickest runs of both programs with at most this error, and theirs over ours; empty without any."""
    row: dict[str, Any] = {"case": case.name, "accuracy": accuracy}
    for program in ("pcmc", evolver.PROGRAM):
        enough = runs[(runs.program == program) & (runs.error <= accuracy)]
        best = enough.nsmallest(1, "seconds")
        row |= {program: float(best.seconds.min()), f"{program}_elements": "".join(best.elements)}
    if len(runs) == 0 or (np.isnan(row["pcmc"]) and np.isnan(row[evolver.PROGRAM])):
        return {}
    return row | {"theirs_over_ours": row[evolver.PROGRAM] / row["pcmc"]}


def figure(folder: Folder) -> None:
    """Errors against seconds."""
    from pcmc.plot.figure import CURVES

    runs = folder.read_table("records").merge(folder.read_table("times"))
    runs = runs[np.isfinite(runs.error)]
    names: dict[Any, str] = {"pcmc": "", evolver.PROGRAM: "Evolver, "}
    panels = {
        case.title: {
            f"{names[program]}{elements}": (mine.seconds.to_numpy(), mine.error.clip(lower=1e-15).to_numpy())
            for (program, elements), mine in runs[runs.case == case.name].groupby(
                ["program", "elements"], sort=False
            )
        }
        for case in CASES
        if case.name in set(runs.case)
    }
    dots = {"marker": "o", "markersize": 3.0, "linewidth": 1.1}
    theirs = {"linestyle": "--", "markerfacecolor": "white"}
    colours = dict(zip((*OURS, *THEIRS), (0, 1, 2, 3, 4, 0, 2, 3, 4), strict=True))
    looks = {
        names[program] + elements: {"color": CURVES[colours[elements]], **dots, **more}
        for program, sizes, more in (("pcmc", OURS, {}), (evolver.PROGRAM, THEIRS, theirs))
        for elements in sizes
    }
    curve_panels(
        panels,
        folder.figure("error-seconds"),
        columns=2,
        xlabel="processor time, s",
        ylabel="relative error of the energy",
        looks=looks,
    )


STUDY = Study(
    "curved",
    "how soon energies are known to 3 to 10 digits: flat and curved elements, beside Surface Evolver's",
    data,
    table,
    figure,
    parameters={
        "ours": OURS,
        "theirs": THEIRS,
        "graded": {str(k): v for k, v in GRADED.items()},
        "rest": REST,
    },
    seconds=150,
    paper=False,
    timed=True,
)
