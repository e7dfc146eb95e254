"""The same surfaces from the same start to rest through several programs: what each takes, and leaves.

- Surface Evolver: 200 steps of conjugate gradients, then Newton steps along the normals, ten with a line
  search and four without; the only one of five scripts tried that brings both coarse surfaces to rest. If it
  does not here, 20 steps of descent and the same Newton steps, which do with more of the prescribed volumes.
  It is made to begin coarse and to refine; here it gets the fine start, as the others do.
- scipy's L-BFGS and NLopt's, on pcmc's energy and gradient in the free coordinates. Where volumes are
  prescribed scipy's has E - p (V - V̄) + ½ k (V - V̄)², with p set anew at the end of each run.
- jax_fdm, as a net: cotangent force densities α (cot β + cot γ) / 2 of the edges and the pressure's forces at
  the nodes, both anew from each net (the fixed point of Pinkall and Polthier's minimal surfaces). It is
  asked only where all of the boundary is fixed; junctions between plane supports are no part of it.
- Kratos' form finding: membranes without stiffness, their prestress kept from form to form, and pressures
  that follow them. It ends by its own residual, of the forces in all directions.
- pcmc's geometric solver.

Residual and energy of each end are pcmc's. L-BFGS moves vertices along the surface, too, so it comes to
other triangles and another energy; the closed form tells how far each is from the smooth surface. At the rim
of a drop Surface Evolver's normals are not quite pcmc's, so at rest by its own it has forces left by pcmc's.
A program that is not near rest at its end, or not ready after ``LIMIT`` seconds, is not asked for finer
meshes. Where there is no equilibrium, what counts is what each says. ``bench_cases`` has the surfaces.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from generators import spherical_cap
from pcmc import Surface, certify, energy, solve
from pcmc.base.arrays import Floats
from pcmc.base.errors import PcmcError
from pcmc.forces.functional import energy_and_gradient, patch_areas
from pcmc.forces.rooms import prescribed_volumes, room_volume_gradients, room_volumes, with_room_pressures
from pcmc.solvers import solve_once
from pcmc.solvers.result import Progress
from pcmc.stability.equilibrium import Equilibrium
from pcmc.surface.supports import apply_supports

from ..benchmarks.run import machine
from ..folder import Folder
from ..reference import evolver, kratos
from ..study import Study
from .bench_cases import CASES, Case

LIMIT, LONGEST = 60.0, 100.0  # seconds: of a run, and of one that cannot be stopped at that
FAR = 1e3  # beyond this a surface has run away
REST, NEAR = 1e-6, 1e-4  # relative residual of a surface at rest, and near it; pcmc asks for 1e-8
NEWTON = "hessian_normal on\n" + "hessian_seek\n" * 10 + "hessian\n" * 4
SCRIPTS = f"U\ng 200\nU\n{NEWTON}", f"g 20\n{NEWTON}"
ROUNDS, HARDER = 12, 100.0  # of scipy's prescribed volumes; k over α A / V²
SHOW = 'printf "T %.17g\\n", clock - clock_was\nforeach vertex vv do printf "X %.17g %.17g %.17g\\n", x, y, z'
FDM_PYTHON = "JAX_FDM_PYTHON"  # names an interpreter that has jax_fdm; by default this one
FDM_SCRIPT = Path(__file__).parents[1] / "reference" / "jax_fdm_script.py"


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

    try:
        result = solve_once(surface, "lbfgs", watch)
    except PcmcError as error:
        return End(np.nan, None, f"not asked: {error}")
    return End(time.perf_counter() - begin, result.surface, f"{result.status.name}: {result.message}")


def scipy_lbfgs(surface: Surface) -> End:
    """scipy's L-BFGS-B in all coordinates, with the gradient that the supports leave."""
    begin, pressures, X = time.perf_counter(), np.zeros(len(surface.rooms)), surface.vertices
    wanted = prescribed_volumes(surface)
    stiffness = HARDER * float(surface.tensions @ patch_areas(surface)) / wanted**2

    def both(x: Floats) -> tuple[float, Floats]:
        X = x.reshape(-1, 3)
        value, gradient = energy_and_gradient(surface, X)
        if surface.rooms:
            excess = room_volumes(surface, X) - wanted
            push = stiffness * excess - pressures
            value += float(((0.5 * stiffness * excess) - pressures) @ excess)
            gradient = gradient + np.tensordot(push, room_volume_gradients(surface, X), axes=1)
        return value, apply_supports(surface, gradient).ravel()

    def watch(intermediate_result: object) -> None:
        if time.perf_counter() - begin > LIMIT:
            raise StopIteration

    about: dict[str, Any] = {"jac": True, "method": "L-BFGS-B", "callback": watch}
    about["options"] = {"maxiter": 10**6, "maxfun": 10**6, "ftol": 0.0, "gtol": 0.0, "maxcor": 20}
    said = ""
    with np.errstate(all="ignore"):
        for _ in range(ROUNDS if surface.rooms else 1):
            found = minimize(both, X.ravel(), **about)
            X, said = found.x.reshape(-1, 3), str(found.message)
            if time.perf_counter() - begin > LIMIT or ended(surface, X) is None:
                break
            pressures = pressures - stiffness * (room_volumes(surface, X) - wanted)
    return End(time.perf_counter() - begin, ended(surface, X), said)


def ended(surface: Surface, X: Floats) -> Surface | None:
    """The surface with these vertices, its rooms' pressures those that leave the least forces; None if it
    has run away."""
    if not (np.isfinite(X).all() and np.abs(X).max() <= FAR):
        return None
    end = surface.moved(X)
    if not end.rooms:
        return end
    at = Equilibrium.of(end)
    pressures = np.linalg.lstsq(at.volume_columns, at.forces)[0]
    return with_room_pressures(end, np.asarray(pressures, dtype=np.float64))


def surface_evolver(surface: Surface) -> End:
    """Surface Evolver, its own clock; it cannot be stopped, but for the whole."""
    end = End(np.nan, None, "")
    for script in SCRIPTS:
        end = _evolved(surface, script)
        at_rest = end.surface is not None and certify(end.surface, modes=0).residual <= REST
        if at_rest or "did not finish" in end.said:
            break
    return end


def _evolved(surface: Surface, script: str) -> End:
    try:
        commands = f"clock_was := clock\n{script}{SHOW}"
        out = evolver.run(surface, commands, timeout=LONGEST, upright=not surface.rooms)
        X = evolver.numbers(out, "X", 3) + surface.origin
    except evolver.EvolverError as error:
        return End(np.nan, None, str(error))
    said = "; ".join(dict.fromkeys(re.findall(r"^(?:WARNING|ERROR).*$", out, re.M)))
    end = ended(surface, X)
    if end is None:
        said = said or "nothing, though its surface has run away"
    return End(float(evolver.numbers(out, "T", 1)[0, 0]), end, said)


def jax_fdm(surface: Surface) -> End:
    """jax_fdm in an interpreter of its own; its time is that of the iterations after the first."""
    if surface.rooms or len(surface.patches) > 1 or not np.array_equal(surface.held, surface.fixed):
        what = "prescribed volumes" if surface.rooms else "a junction between supports in planes"
        return End(np.nan, None, f"not asked: {what}")
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
    if surface.rooms:
        return End(np.nan, None, "not asked: prescribed volumes")
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


def through(program: Callable[[Surface], End], case: Case, start: Surface) -> tuple[End, float]:
    """How a program ends that goes from a start through the volumes of a case, and the residual there."""
    seconds, surface = 0.0, start
    for volume in (None, *case.volumes):
        if volume is not None:
            surface = surface.rebuilt(rooms=[replace(surface.rooms[0], volume=volume)])
        end = program(surface)
        seconds += end.seconds
        left = np.inf if end.surface is None else certify(end.surface, modes=0).residual
        if end.surface is None or left > NEAR or seconds > LIMIT:
            break
        surface = end.surface
    return end._replace(seconds=seconds), left


def data(folder: Folder, short: bool) -> None:
    """Every case through every program; all depends on the machine."""
    newton(spherical_cap(0.25))  # compiles
    rows = []
    for name, case in CASES.items():
        asked = list(PROGRAMS)
        for size in case.sizes[:1] if short else case.sizes:
            start = case.build(size)
            for program in tuple(asked):
                end, left = through(PROGRAMS[program], case, start)
                value = np.nan if end.surface is None else held_energy(end.surface)
                error = value / case.exact - 1.0
                rows.append([name, start.m, program, end.seconds, left, value, error, end.said[:160]])
                if not (left <= NEAR and end.seconds <= LIMIT):
                    asked.remove(program)
    programs = pd.DataFrame(versions().items(), columns=["program", "version"])
    folder.write_table("programs_times", programs)
    columns = ["case", "triangles", "program", "seconds", "residual", "energy", "error", "said"]
    folder.write_table("runs_times", pd.DataFrame(rows, columns=columns))


def versions() -> dict[str, str]:
    """What ran, and on which machine."""
    apart = {"jax_fdm": (FDM_PYTHON, "jax_fdm"), "Kratos": (kratos.PYTHON, "KratosMultiphysics")}
    found = {"machine": machine(), "Surface Evolver": evolver.version()}
    for name, library in (("NLopt L-BFGS", "nlopt"), ("scipy L-BFGS", "scipy")):
        found[name] = f"{library} {metadata.version(library)}"
    for name, (variable, library) in apart.items():
        ask = f"from importlib.metadata import version; print(version({library!r}))"
        command = [os.environ.get(variable, sys.executable), "-c", ask]
        done = subprocess.run(command, capture_output=True, text=True)
        found[name] = f"{library} {done.stdout.strip()}" if done.returncode == 0 else "not installed"
    return found


def held_energy(surface: Surface) -> float:
    """E, or Σ α A where volumes are prescribed instead of pressures."""
    return float(surface.tensions @ patch_areas(surface)) if surface.rooms else energy(surface)


def table(folder: Folder) -> dict[str, float]:
    """How many surfaces with an equilibrium each program brings to rest, and how finely at most."""
    runs = folder.read_table("runs_times")
    runs = runs[runs.case.isin([name for name, case in CASES.items() if case.exists])]
    rest = runs[runs.residual <= REST]
    found = rest.groupby("program").triangles.agg(["size", "max"]).reindex(list(PROGRAMS), fill_value=0)
    folder.write_table("at_rest_times", found.rename(columns={"size": "surfaces"}).reset_index())
    return {"surfaces": float(runs.groupby(["case", "triangles"]).ngroups), "cap": CASES["cap"].exact}


def figure(folder: Folder) -> None:
    """Seconds to rest over triangles; a hollow mark where a program is not at rest at its end."""
    from pcmc.plot.figure import SMALL, finish, new, style

    runs = folder.read_table("runs_times")
    cases = [name for name, case in CASES.items() if case.exists]
    canvas = new(1200, 640)
    for k, case in enumerate(cases, 1):
        axes = style(canvas.add_subplot(len(cases) // 4, 4, k))
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
        if k % 4 == 1:
            axes.set_ylabel("seconds", fontsize=SMALL)
        axes.set_title(case, fontsize=SMALL)
    canvas.axes[0].plot(
        [], [], "o", markersize=5, color="black", markerfacecolor="white", label="not at rest"
    )
    handles, labels = canvas.axes[0].get_legend_handles_labels()
    canvas.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=SMALL, frameon=False)
    finish(canvas, folder.figure("bench"))


STUDY = Study(
    "bench",
    "the same surfaces to rest through other programs, and what each says where there is no equilibrium",
    data,
    table,
    figure,
    parameters={"sizes": {name: case.sizes for name, case in CASES.items()}, "limit": LIMIT, "rest": REST},
    seconds=500,
    paper=False,
    timed=True,
)
