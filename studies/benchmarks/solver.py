"""How fast the geometric solver is, with Surface Evolver measured on the same mesh in the same run.

Example 1 with a wall tension of 1. Ours is wall time, the program's its own clock of processor time.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from generators import two_squares
from pcmc import Surface, certify, solve
from pcmc.base.arrays import Floats
from pcmc.forces.functional import energy_and_gradient
from pcmc.forces.motion_space import VertexClasses, motion_space, vertex_classes
from pcmc.forces.pattern import Pattern, hessian_pattern
from pcmc.forces.second_variation import assemble
from pcmc.stability.factorisation import Factoriser, factoriser, installed

from ..reference import evolver
from .pieces import pieces
from .timing import Row, median, median_seconds, peak_bytes

QUARTER_MILLION, MILLION = 245, 492  # squares a side, for 260 000 and 1 050 000 triangles
DESIGN, QUICK = 15, 32  # for 1 000 and 4 400
SCRIPT_STEPS = 6  # Newton steps that the program is given after its 20 gradient steps
NEWTON = "hessian_normal on"
AT_REST = 1e-10  # relative residual
ALPHA_CHANGE = 1.02


def example(squares: int) -> Surface:
    """Example 1 as it starts, α_aux = 1."""
    return two_squares(squares, alpha_aux=1.0)


@dataclass
class Step:
    """One Newton step of ours on a surface: gradient, frames, assembly, factorisation and solution."""

    surface: Surface
    backend: str
    classes: VertexClasses = field(init=False)
    pattern: Pattern = field(init=False)
    factoriser: Factoriser = field(init=False)

    def __post_init__(self) -> None:
        self.classes = vertex_classes(self.surface)
        space = motion_space(self.surface, self.classes, self.surface.vertices)
        self.pattern = hessian_pattern(self.classes, space)
        self.factoriser = factoriser(self.pattern, self.backend)

    def __call__(self) -> Floats:
        X = self.surface.vertices
        _, gradient = energy_and_gradient(self.surface, X)
        space = motion_space(self.surface, self.classes, X)
        data = assemble(self.surface, self.classes, space, self.pattern, X)
        return space.to_vectors(-self.factoriser.factor(data).solve(space.to_coordinates(gradient)))


def newton_steps(quick: bool) -> list[Row]:
    """A Newton step of each backend and of the program, at the initial shape."""
    if quick:
        return _steps_at(QUICK, {"pardiso": None, "superlu": None}, repeats=3)
    rows = _steps_at(QUARTER_MILLION, {"pardiso": 6.0, "superlu": 1.5}, repeats=5)
    return rows + _steps_at(MILLION, {"pardiso": 8.0}, repeats=3)


def _steps_at(squares: int, asked: dict[str, float | None], repeats: int) -> list[Row]:
    surface = example(squares)
    size = f"{surface.m:,} triangles"
    theirs = _their_step(surface, min(repeats, 3))
    rows = [Row(f"Newton step, {evolver.PROGRAM}", theirs, "s", size)]
    for backend, least in asked.items():
        if backend not in installed():
            rows.append(Row(f"Newton step, {backend}", np.nan, "s", "not installed"))
            continue
        start = time.perf_counter()
        step = Step(surface, backend)
        step()
        first = time.perf_counter() - start
        ours = median_seconds(step, repeats)
        remark = f"{size}; pattern and symbolic analysis, once: {first - ours:.2g} s"
        rows.append(Row(f"Newton step, {backend}", ours, "s", remark))
        rows.append(Row(f"{evolver.PROGRAM} over {backend}", theirs / ours, "times", size, least))
    return rows


def _their_step(surface: Surface, repeats: int) -> float:
    if not evolver.available():
        return np.nan
    return median(evolver.seconds(surface, "hessian", before=NEWTON, repeat=repeats, upright=True))


def from_start_to_rest(quick: bool) -> list[Row]:
    """From the initial shape to a relative residual of 1e-10, beside the program's script."""
    surface = example(QUICK if quick else QUARTER_MILLION)

    def ours() -> None:
        result = solve(surface, target="stationary", tolerance=AT_REST)
        assert result.converged

    seconds = median_seconds(ours, repeats=3)
    size = f"{surface.m:,} triangles"
    rows = [Row("initial shape to rest", seconds, "s", f"{size}, relative residual {AT_REST:g}")]
    if not evolver.available():
        return [*rows, Row("the same by its script", np.nan, "s", "evolver is not installed")]
    theirs, left = _their_script(surface)
    script = f"g 20; {NEWTON}; {SCRIPT_STEPS} hessian"
    end = f"residual {left:.1e}" + ("" if left < 1e-8 else ": it has not converged")
    rows.append(Row(f"{evolver.PROGRAM}: {script}", theirs, "s", f"{size}, {end}"))
    least = None if quick else 5.0
    same = size if left < 1e-8 else f"{size}; no comparison, it has not converged"
    return [*rows, Row("its script over ours", theirs / seconds, "times", same, least)]


def _their_script(surface: Surface) -> tuple[float, float]:
    """Seconds of the program's script, and the relative residual it ends with."""
    steps = f"{NEWTON}\n" + "hessian\n" * SCRIPT_STEPS
    seconds = float(evolver.seconds(surface, "g 20\n" + steps, upright=True)[0])
    reached = surface.moved(evolver.positions(surface, "g 20\n" + steps, upright=True))
    return seconds, certify(reached, modes=0).residual


def peak_memory(quick: bool) -> list[Row]:
    """The most memory a process holds that solves the largest mesh from its initial shape."""
    squares = QUICK if quick else MILLION
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        triangles, seconds, peak = pool.submit(_solve_and_weigh, squares).result()
    remark = f"{triangles:,} triangles, {installed()[0]}, imports included, {seconds:.1f} s"
    return [Row("peak memory", peak / 1e9, "GB", remark, most=None if quick else 2.0)]


def _solve_and_weigh(squares: int) -> tuple[int, float, float]:
    start = time.perf_counter()
    surface = example(squares)
    assert solve(surface, target="stationary", tolerance=AT_REST).converged
    return surface.m, time.perf_counter() - start, peak_bytes()


def redesign(quick: bool) -> list[Row]:
    """A design of a thousand triangles solved again after its tension has changed by 2 %."""
    start = solve(example(DESIGN)).surface
    changed = start.retensioned({"left": 2.0 * ALPHA_CHANGE, "right": 2.0 * ALPHA_CHANGE})
    assert solve(changed).converged
    seconds = median_seconds(lambda: solve(changed), repeats=15)
    remark = f"{start.m:,} triangles, α from 2 to {2.0 * ALPHA_CHANGE:g}"
    return [Row("solving a changed design again", 1e3 * seconds, "ms", remark, most=50.0)]


SOLVER: list[Callable[[bool], list[Row]]] = [redesign, newton_steps, from_start_to_rest, pieces, peak_memory]
