"""The benchmarks run and describe themselves; their times are not judged here."""

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from programs import needs_evolver

from generators import spherical_cap_exact, two_squares
from pcmc import hessian
from pcmc.forces.motion_space import motion_space, vertex_classes
from pcmc.sweep import Sweep
from studies.__main__ import main
from studies.alpha_grid.grid import TENSIONS
from studies.benchmarks import explore, height, run, scaling, solver, sweep
from studies.benchmarks.solver import Step
from studies.benchmarks.timing import Row, median, median_seconds, peak_bytes
from studies.folder import Folder
from studies.orders import richardson
from studies.reference import evolver

TIMES = (
    *("build_seconds", "solve_seconds", "solve_processor_seconds", "solve_gigabytes", "solve_peak_gigabytes"),
    *("certify_seconds", "certify_peak_gigabytes", "steps", "residual", "index"),
    *("refined_residual", "refined_peak_gigabytes"),
)
HOME = Path(__file__).resolve().parents[2]


@pytest.fixture
def small(monkeypatch):
    """Every benchmark at its least."""
    monkeypatch.setattr(run, "FEW", 3)
    monkeypatch.setattr(run, "REPEATS", 1)
    monkeypatch.setattr(solver, "QUICK", 4)
    monkeypatch.setattr(solver, "DESIGN", 3)
    monkeypatch.setattr(solver, "SCRIPT_STEPS", 1)
    monkeypatch.setattr(scaling, "FEW", (4, 6, 8))
    monkeypatch.setattr(sweep, "FEW", (4.0,))
    monkeypatch.setattr(sweep, "SHORT", 2)
    monkeypatch.setattr(explore, "STEPS", 3)


@pytest.mark.nightly
def test_the_quick_form_prints_and_writes(small, tmp_path, capsys):
    code = main(["benchmark", "--quick", "--results", str(tmp_path)])
    table = pd.read_csv(tmp_path / "benchmark" / "quick.csv", keep_default_na=False)
    assert list(table.columns) == ["what", "median", "unit", "asked", "met", "remark"]
    assert code == int((table["met"] == "no").any())
    shown = capsys.readouterr().out
    for what in table["what"]:
        assert what.split(",")[0].split(":")[0] in shown
    expected = {"Newton step, superlu", "peak memory", "initial shape to rest"}
    expected |= {"height, extrapolated", "surface and solution", "exponent of time"}
    expected |= {"grid of Fig. 16, 2 workers over 1", "slider followed"}
    expected |= {"pcmc solve roof.toml, with its mesh check"}
    assert expected <= set(table["what"])
    numbers = pd.to_numeric(table["median"], errors="coerce")
    slope = table["what"].str.startswith("exponent")  # of so small surfaces: only noise
    difference = table["what"].str.endswith("difference")  # none is best
    assert (numbers[~slope & ~difference].dropna() > 0.0).all()
    assert (numbers[difference] >= 0.0).all()
    assert table["met"][difference].tolist() == ["yes", "yes"]
    if evolver.available():
        assert numbers.notna().all()
    assert "machine" in json.loads((tmp_path / "benchmark" / "quick.json").read_text())


def test_some_benchmarks_alone_take_the_place_of_their_rows(tmp_path, monkeypatch, capsys):
    def to_height(quick):
        return [Row("height", 2.0, "s"), Row("new pair", 3.0, "times")]

    monkeypatch.setattr(run, "BENCHMARKS", [run.energy_rate, to_height])
    monkeypatch.setattr(run, "NAMES", ("energy rate", "to height", run.GROWTH))
    rows = [("energy", 1.0), ("height", 9.0), ("height", 8.0), ("sweep", 4.0)]
    table = pd.DataFrame(rows, columns=["what", "median"]).assign(unit="s", asked="", met="", remark="")
    Folder(tmp_path / "benchmark").write_table("full", table)
    words = ["benchmark", "--results", str(tmp_path), "--only"]
    assert main([*words, "to height"]) == 0
    found = pd.read_csv(tmp_path / "benchmark" / "full.csv")
    assert found["what"].tolist() == ["energy", "height", "new pair", "sweep"]
    assert found["median"].tolist() == [1.0, 2.0, 3.0, 4.0]
    assert main([*words, "to heigth"]) == 2
    assert "to height" in capsys.readouterr().err


def test_a_step_is_newtons():
    surface = two_squares(4, alpha_aux=1.0)
    space = motion_space(surface, vertex_classes(surface), surface.vertices)
    B = np.stack([space.to_vectors(e).ravel() for e in np.eye(space.size)], axis=1)
    forces = solver.energy_and_gradient(surface, surface.vertices)[1].ravel()
    expected = -B @ np.linalg.solve(B.T @ hessian(surface).toarray() @ B, B.T @ forces)
    for backend in solver.installed():
        step = Step(surface, backend)
        np.testing.assert_allclose(step().ravel(), expected, atol=1e-10 * np.abs(expected).max())
        np.testing.assert_array_equal(step(), step())


@needs_evolver
def test_the_programs_faster_form_has_the_same_energy_and_steps():
    surface = two_squares(4, alpha_aux=1.0)
    for commands in ("", "g 5", "hessian_normal on\nhessian"):
        plain = evolver.energy(surface, commands)
        assert evolver.energy(surface, commands, upright=True) == pytest.approx(plain, rel=1e-12)


def test_without_the_program_the_rows_say_so(small, monkeypatch):
    monkeypatch.setattr(evolver, "PROGRAM", "no-such-program")
    rows = solver.newton_steps(True) + solver.from_start_to_rest(True)
    theirs = [row for row in rows if "no-such-program" in row.what or "script" in row.what]
    assert theirs
    assert all(np.isnan(row.value) for row in theirs)
    assert "evolver is not installed" in theirs[-1].remark


def test_without_the_fast_backend_the_rows_say_so(small, monkeypatch):
    monkeypatch.setattr(solver, "installed", lambda: ("superlu",))
    rows = {row.what: row for row in solver.newton_steps(True)}
    assert rows["Newton step, pardiso"].remark == "not installed"
    assert rows["Newton step, superlu"].value > 0.0


def test_sweeps_are_timed_whole_and_in_turn(monkeypatch):
    asked = []

    def seconds(sweep, workers):
        asked.append((sweep.case.split(":")[1], len(sweep), workers))
        return {1: 19.0, 2: 10.0}[workers]

    monkeypatch.setattr(sweep, "sweep_seconds", seconds)
    rows = sweep.sweeps(False)
    size = len(TENSIONS) ** 3
    assert size >= 512
    flow, geometric = ([(case, size, k) for k in (1, 2)] for case in ("flow_case", "solve_case"))
    assert asked == flow * sweep.REPEATS + geometric + [("flow_case", 1, 1)]
    assert [row.asked for row in rows] == ["", "≤ 60", "≥ 1.7", "", "≤ 300", "≥ 1.7", ""]
    assert [row.value for row in rows if "over" in row.what] == [pytest.approx(1.9)] * 2
    assert [row.asked for row in sweep.sweeps(True)] == [""] * 7


def test_the_caps_height_is_extrapolated_at_its_orders():
    exact = spherical_cap_exact().height
    heights = height.our_heights(height.RINGS, height.MESHES)
    once = heights[1:] + np.diff(heights) / 3.0
    error = [np.abs(heights - exact), np.abs(once - exact)]
    assert np.log2(error[0][:-1] / error[0][1:]) == pytest.approx([2.0, 2.0], abs=0.07)
    assert np.log2(error[1][0] / error[1][1]) == pytest.approx(3.0, abs=0.15)
    assert abs(richardson(heights, height.ORDERS) - exact) < height.ERROR


@needs_evolver
def test_the_programs_cap_follows_its_circle():
    exact = spherical_cap_exact().height
    for elements, order, close in (("linear", 2.0, 2e-3), ("quadratic", 3.2, 8e-6)):
        heights, clock = height.ladder(elements, 4, 1, steps=2)
        error = np.abs(heights - exact)
        assert np.log2(error[0] / error[1]) == pytest.approx(order, abs=0.1)
        assert error[1] < close
        assert clock[0] <= clock[1]


def test_the_growth_of_cost_is_a_slope():
    triangles = np.array([1e4, 1e6, 1e7])
    table = pd.DataFrame({"triangles": triangles} | dict.fromkeys(TIMES, 0.5))
    table = table.assign(solve_seconds=1e-6 * triangles**1.1, solve_gigabytes=1e-9 * triangles**1.2)
    table = table.assign(refined_triangles=triangles, refined_seconds=1e-6 * triangles**1.2)
    table = table.assign(kept_seconds=1e-6 * triangles**1.05)
    rows = {row.what: row for row in scaling.rows(table, quick=False)}
    assert rows["exponent of time"].value == pytest.approx(1.1)
    assert rows["exponent of memory"].value == pytest.approx(1.2)
    assert rows["surface and solution"].value == pytest.approx(1e-6 * 1e7**1.1)
    assert rows["time per triangle"].value == pytest.approx(10**0.1)
    assert rows["exponent of time through one refinement"].value == pytest.approx(1.2)
    assert rows["time per triangle through one refinement"].value == pytest.approx(10**0.2)
    assert rows["time per triangle, freed memory kept"].value == pytest.approx(10**0.05)
    if solver.installed()[0] == "pardiso":
        assert (rows["exponent of time"].met, rows["exponent of memory"].met) == ("yes", "no")


def test_the_flows_workers_wait_for_no_large_library():
    code = "import sys, studies.examples.flow_case; print({'pandas', 'scipy.optimize'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True).stdout == b"set()\n"


def test_a_case_that_fails_spoils_a_sweeps_time():
    halves = Sweep("pcmc.sweep.examples:ratio", {"over": [1, 2]}, {"under": 2})
    assert sweep.sweep_seconds(halves, 1) > 0.0
    with pytest.raises(AssertionError):
        sweep.sweep_seconds(Sweep(halves.case, halves.grid, {"under": 0}), 1)


def test_rows_know_what_is_asked(monkeypatch):
    assert Row("a", 2.0, "s").met == Row("a", 2.0, "s").asked == ""
    assert Row("a", 2.0, "s", least=2.0).met == "yes"
    assert Row("a", 1.9, "s", least=2.0).met == "no"
    assert Row("a", 1.9, "s", most=2.0).asked == "≤ 2"
    assert Row("a", np.nan, "s", most=2.0).met == ""
    assert median([3.0, 1.0, 2.0]) == 2.0
    calls = []
    clock = iter([0.0, 1.0, 1.0, 4.0, 4.0, 6.0, 6.0, 6.5])  # of 1, 3, 2 and 0.5 s
    monkeypatch.setattr("studies.benchmarks.timing.time", SimpleNamespace(perf_counter=lambda: next(clock)))
    assert median_seconds(lambda: calls.append(1), 4) == 1.5
    assert len(calls) == 5  # the first is not counted


def test_memory_of_this_process_is_known():
    assert 1e7 < peak_bytes() < 1e12


def test_memory_of_a_child_does_not_hold_its_parents():
    held = np.ones(25_000_000)  # 200 MB
    code = "from studies.benchmarks.timing import peak_bytes; print(peak_bytes())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=HOME)
    assert not float(done.stdout) > 0.75 * held.nbytes  # NaN where the system does not tell
