"""The same surfaces from the same start to rest through several programs: what each takes, and leaves.

- Surface Evolver: 200 steps of conjugate gradients, then Newton steps along the normals, ten with a line
  search and four without; the only one of five scripts tried that brings both coarse surfaces to rest. It is
  made to begin coarse and to refine; here it gets the fine start, as the others do.
- scipy's L-BFGS and NLopt's, on pcmc's energy and gradient in the free coordinates.
- jax_fdm, as a net: cotangent force densities α (cot β + cot γ) / 2 of the edges and the pressure's forces at
  the nodes, both anew from each net (the fixed point of Pinkall and Polthier's minimal surfaces). It is
  asked only where all of the boundary is fixed; junctions between plane supports are no part of it.
- Kratos' form finding: membranes without stiffness, their prestress kept from form to form, and pressures
  that follow them. It ends by its own residual, of the forces in all directions.
- pcmc's geometric solver.

Residual and energy of each end are pcmc's. L-BFGS moves vertices along the surface, too, so it comes to
other triangles and another energy; the closed form tells how far each is from the smooth cap. A program that
is not at rest after ``LIMIT`` seconds, or at its end, is not asked for finer meshes. The last case has no
equilibrium: what counts is what each says.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from generators import spherical_cap, spherical_cap_exact, two_squares
from pcmc import Surface, certify, energy, solve
from pcmc.base.arrays import Floats
from pcmc.forces.functional import energy_and_gradient
from pcmc.solvers import solve_once
from pcmc.solvers.result import Progress
from pcmc.surface.supports import apply_supports

from ..folder import Folder
from ..reference import evolver, kratos
from ..study import Study

LIMIT, LONGEST = 60.0, 150.0  # seconds: of a run, and of one that cannot be stopped at that
FAR = 1e6  # beyond this a surface has run away
REST = 1e-6  # relative residual of a surface at rest; pcmc itself asks for 1e-8
SCRIPT = "U\ng 200\nU\nhessian_normal on\n" + "hessian_seek\n" * 10 + "hessian\n" * 4
SHOW = 'printf "T %.17g\\n", clock - clock_was\nforeach vertex vv do printf "X %.17g %.17g %.17g\\n", x, y, z'
FDM_PYTHON = "JAX_FDM_PYTHON"  # names an interpreter that has jax_fdm; by default this one
FDM_SCRIPT = Path(__file__).parents[1] / "reference" / "jax_fdm_script.py"
CASES: dict[str, Callable[[float], Surface]] = {
    "cap": lambda edge: spherical_cap(edge, alpha=0.6),
    "two squares": lambda squares: two_squares(int(squares), alpha_aux=1.0),
    "no equilibrium": lambda edge: spherical_cap(edge, alpha=0.45),
}
SIZES = {
    "cap": (0.08, 0.025, 0.008, 0.0025),
    "two squares": (15, 48, 152, 492),
    "no equilibrium": (0.08,),
}


EXACT = spherical_cap_exact(alpha=0.6).energy


class End(NamedTuple):
    """How a program ended: seconds, the surface, if it gave one, and what it said of it."""

    seconds: float
    surface: Surface | None
    said: str


def newton(surface: Surface) -> End:
    """pcmc's geometric solver, with further starts where the given one leads to none."""
    begin = time.perf_counter()
    result = solve(surface, target="stationary")
    return End(time.perf_counter() - begin, result.surface, f"{result.status.name}: {result.message}")


def nlopt(surface: Surface) -> End:
    """NLopt's L-BFGS, by pcmc."""
    begin = time.perf_counter()

    def watch(_: Progress) -> None:
        if time.perf_counter() - begin > LIMIT:
            raise StopIteration

    result = solve_once(surface, "lbfgs", watch)
    return End(time.perf_counter() - begin, result.surface, f"{result.status.name}: {result.message}")


def scipy_lbfgs(surface: Surface) -> End:
    """scipy's L-BFGS-B in all coordinates, with the gradient that the supports leave."""
    begin = time.perf_counter()

    def both(x: Floats) -> tuple[float, Floats]:
        value, gradient = energy_and_gradient(surface, x.reshape(-1, 3))
        return value, apply_supports(surface, gradient).ravel()

    def watch(intermediate_result: object) -> None:
        if time.perf_counter() - begin > LIMIT:
            raise StopIteration

    about: dict[str, Any] = {"jac": True, "method": "L-BFGS-B", "callback": watch}
    about["options"] = {"maxiter": 10**6, "maxfun": 10**6, "ftol": 0.0, "gtol": 0.0, "maxcor": 20}
    with np.errstate(all="ignore"):
        found = minimize(both, surface.vertices.ravel(), **about)
    return End(time.perf_counter() - begin, ended(surface, found.x.reshape(-1, 3)), str(found.message))


def ended(surface: Surface, X: Floats) -> Surface | None:
    """The surface with these vertices; None if they have run away."""
    return surface.moved(X) if np.isfinite(X).all() and np.abs(X).max() <= FAR else None


def surface_evolver(surface: Surface) -> End:
    """Surface Evolver, its own clock; it cannot be stopped, but for the whole."""
    try:
        commands = f"clock_was := clock\n{SCRIPT}{SHOW}"
        out = evolver.run(surface, commands, timeout=LONGEST, upright=True)
        X = evolver.numbers(out, "X", 3) + np.array(surface.plane.point)
    except evolver.EvolverError as error:
        return End(np.nan, None, str(error))
    said = "; ".join(dict.fromkeys(re.findall(r"^(?:WARNING|ERROR).*$", out, re.M)))
    end = ended(surface, X)
    if end is None:
        said = said or "nothing, though its surface has run away"
    return End(float(evolver.numbers(out, "T", 1)[0, 0]), end, said)


def jax_fdm(surface: Surface) -> End:
    """jax_fdm in an interpreter of its own; its time is that of the iterations after the first."""
    if len(surface.patches) > 1 or not np.array_equal(surface.held, surface.fixed):
        return End(np.nan, None, "not asked: a junction between supports in planes")
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "surface.npz"), Path(folder, "answer.npz")
        tension = surface.tensions[surface.patch_of_face]
        pressure = surface.pressures[surface.patch_of_face]
        np.savez(
            source,
            X=surface.vertices,
            F=surface.faces,
            fixed=surface.fixed,
            tension=tension,
            pressure=pressure,
            limit=LIMIT,
            rest=REST,
        )
        command: list[str | Path] = [os.environ.get(FDM_PYTHON, sys.executable), FDM_SCRIPT, source, target]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST)
        except subprocess.TimeoutExpired:
            return End(np.nan, None, f"not ready after {LONGEST:g} s")
        if done.returncode or not target.exists():
            return End(np.nan, None, (done.stderr.strip() or "it stopped").splitlines()[-1])
        found = np.load(target)
        return End(float(found["seconds"]), ended(surface, found["X"]), str(found["said"]))


def kratos_form(surface: Surface) -> End:
    """Kratos' form finding in an interpreter of its own; reading and writing the mesh is not counted."""
    rest = REST * certify(surface, modes=0).scale
    try:
        seconds, X, said = kratos.form(surface, rest, LIMIT, FAR, LONGEST)
    except kratos.KratosError as error:
        return End(np.nan, None, str(error))
    return End(seconds, ended(surface, X), said)


PROGRAMS: dict[str, Callable[[Surface], End]] = {
    "pcmc": newton,
    "Surface Evolver": surface_evolver,
    "NLopt L-BFGS": nlopt,
    "scipy L-BFGS": scipy_lbfgs,
    "jax_fdm": jax_fdm,
    "Kratos": kratos_form,
}


def data(folder: Folder, short: bool) -> None:
    """Every case through every program; all depends on the machine."""
    newton(spherical_cap(0.25))  # compiles
    rows = []
    for case, sizes in SIZES.items():
        asked = list(PROGRAMS)
        for size in sizes[:1] if short else sizes:
            start = CASES[case](size)
            for program in tuple(asked):
                end = PROGRAMS[program](start)
                left = np.inf if end.surface is None else certify(end.surface, modes=0).residual
                value = np.nan if end.surface is None else energy(end.surface)
                rows.append([case, start.m, program, end.seconds, left, value, end.said[:160]])
                if not (left <= REST and end.seconds <= LIMIT):
                    asked.remove(program)
    columns = ["case", "triangles", "program", "seconds", "residual", "energy", "said"]
    folder.write_table("runs_times", pd.DataFrame(rows, columns=columns))


def table(folder: Folder) -> dict[str, float]:
    """How many surfaces with an equilibrium each program brings to rest, and how finely at most."""
    runs = folder.read_table("runs_times")
    runs = runs[runs.case != "no equilibrium"]
    rest = runs[runs.residual <= REST]
    found = rest.groupby("program").triangles.agg(["size", "max"]).reindex(list(PROGRAMS), fill_value=0)
    folder.write_table("at_rest_times", found.rename(columns={"size": "surfaces"}).reset_index())
    return {"surfaces": float(runs.groupby(["case", "triangles"]).ngroups), "cap": EXACT}


def figure(folder: Folder) -> None:
    """Seconds to rest over triangles; a hollow mark where a program is not at rest at its end."""
    from pcmc.plot.figure import SMALL, finish, new, style

    runs = folder.read_table("runs_times")
    cases = [case for case in SIZES if case != "no equilibrium"]
    canvas = new(1000, 420)
    for k, case in enumerate(cases, 1):
        axes = style(canvas.add_subplot(1, len(cases), k))
        for number, program in enumerate(PROGRAMS):
            mine = runs[(runs.case == case) & (runs.program == program) & runs.seconds.notna()]
            if mine.empty:
                continue
            (line,) = axes.plot(
                mine.triangles, mine.seconds, color=f"C{number}", linewidth=1.2, label=program
            )
            rest = mine.residual <= REST
            for chosen, face in ((rest, line.get_color()), (~rest, "white")):
                shown = mine[chosen]
                axes.plot(
                    shown.triangles,
                    shown.seconds,
                    "o",
                    markersize=5,
                    color=line.get_color(),
                    markerfacecolor=face,
                )
        axes.set(xscale="log", yscale="log")
        axes.set_xlabel("triangles", fontsize=SMALL)
        axes.set_ylabel("seconds", fontsize=SMALL)
        axes.set_title(f"{case}: from the start to rest", fontsize=SMALL)
    canvas.axes[0].plot(
        [], [], "o", markersize=5, color="black", markerfacecolor="white", label="not at rest"
    )
    handles, labels = canvas.axes[0].get_legend_handles_labels()
    canvas.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=SMALL, frameon=False)
    finish(canvas, folder.figure("bench"))


STUDY = Study(
    "bench",
    "the same surfaces to rest through other programs, and what each says where there is no equilibrium",
    data,
    table,
    figure,
    parameters={"sizes": SIZES, "limit": LIMIT, "rest": REST},
    seconds=500,
    paper=False,
)
