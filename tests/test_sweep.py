"""The sweep engine on this machine: declaration, records, faults of cases, stops."""

import io
import json
import os
import signal
import subprocess
import sys
import threading
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pandas as pd
import pytest
import sweep_cases
from rich.console import Console
from tables import same

import pcmc
from generators import two_squares
from pcmc.errors import FileError, OptionError, SweepError
from pcmc.kernels import threads
from pcmc.sweep import (
    Sweep,
    local,
    provenance,
    read_store,
    run,
    solve_case,
    table,
    write_table,
)
from pcmc.sweep.bar import bar

CHAOS = Sweep(
    "sweep_cases:chaos", {"rate": np.linspace(3.6, 4.0, 4), "seed": (0.1, 0.2, 0.3)}, {"pause": 0.0}
)


# ---- declaration


def test_cases_are_the_product_in_order():
    sweep = Sweep(sweep_cases.echo, {"value": [1, 2.5], "other": ["a", None, [1, {"b": 2}]]})
    assert sweep.case == "sweep_cases:echo"
    assert len(sweep) == 6
    assert list(sweep)[2] == {"value": 1, "other": [1, {"b": 2}]}
    assert list(sweep)[3] == {"value": 2.5, "other": "a"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("sweep_cases:chaos", {"sed": [1.0], "rate": [1.0]}), "'sed'; did you mean 'seed'?"),
        (("sweep_cases:chaos", {"seed": [1.0]}), "needs the parameter 'rate'"),
        (("sweep_cases:chaos", {"seed": [1.0]}, {"rate": 1, "colour": 2}), "parameter 'colour'"),
        (("sweep_cases:chaos", {}), "the grid is empty"),
        (("sweep_cases:chaos", {"seed": []}), r"grid\['seed'\] is empty"),
        (("sweep_cases:chaos", {"seed": 0.5}), "a list of values, found 0.5"),
        (("sweep_cases:chaos", {"seed": "abc"}), "a list of values, found 'abc'"),
        (("sweep_cases:chaos", {"seed": [1, 2, 1]}), "the value 1 twice, at 0 and 2"),
        (
            ("sweep_cases:chaos", {"seed": [1.0, object()]}),
            r"parameter seed\[1\]: expected a number",
        ),
        (("sweep_cases:chaos", {"seed": [{1: 2}]}), r"parameter seed\[0\]: keys must be texts"),
        (("sweep_cases:chaos", {"seed": [1.0]}, {"seed": 2.0}), "in the grid and among the fixed"),
        (("sweep_cases:anything", {"verdict": [1]}), "may not be called 'verdict'"),
        (("sweep_cases:kaos", {"seed": [1.0]}), "'sweep_cases:kaos' cannot be found"),
        (("no_such_module:chaos", {"seed": [1.0]}), "cannot be found"),
        (("sweep_cases", {"seed": [1.0]}), "expected 'package.module:function'"),
        (("sweep_cases:math.pi", {"seed": [1.0]}), "is not a function"),
        (("builtins:iter", {"seed": [1.0]}), "does not say which parameters"),
        ((lambda seed: {}, {"seed": [1.0]}), "cannot be imported by a worker"),
    ],
)
def test_bad_declarations_are_refused(arguments, words):
    with pytest.raises(OptionError, match=words):
        Sweep(*arguments)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"workers": 0}, "workers must be at least 1, found 0"),
        ({"time_limit": 0.0}, "time_limit must be positive"),
        ({"time_limit": float("nan")}, "time_limit must be positive"),
        ({"workers": 2, "scheduler": "tcp://127.0.0.1:1"}, "scheduler and workers exclude"),
    ],
)
def test_bad_options_are_refused(options, words):
    with pytest.raises(OptionError, match=words):
        run(CHAOS, **options)


# ---- the table


def test_table_holds_what_the_cases_say():
    result = run(CHAOS, workers=2)
    assert list(result.columns) == [
        "rate", "seed", "pause", "status", "verdict", "message", "x", "third", "inverse",
    ]  # fmt: skip
    assert result.index.tolist() == list(range(12))
    for row, parameters in zip(result.itertuples(), CHAOS, strict=True):
        expected = sweep_cases.chaos(**parameters)
        assert (row.seed, row.rate) == (parameters["seed"], parameters["rate"])
        assert (row.x, row.third, row.inverse) == tuple(list(expected.values())[1:])
        assert (row.status, row.verdict) == ("finished", expected["verdict"])


def test_any_executor_gives_the_same_table(tmp_path):
    alone = run(CHAOS, tmp_path / "alone.jsonl", workers=1)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as executor:
        same(run(CHAOS, tmp_path / "pool.jsonl", executor=executor), alone)
        same(run(CHAOS, executor=executor), alone)
        assert executor.submit(len, "open").result() == 4
    same(table(read_store(tmp_path / "pool.jsonl")), alone)


def test_what_a_case_may_answer():
    kinds = ["words", "number", "list", "parameter", "nothing"]
    result = run(Sweep("sweep_cases:answers", {"what": kinds}), workers=1)
    assert result.loc[0, ["status", "verdict", "message", "n", "yes"]].tolist() == [
        "converged", "", "well", 3, True,
    ]  # fmt: skip
    assert result["status"].tolist()[1:] == ["raised"] * 3 + ["finished"]
    assert "a mapping of names to numbers, found 3.0" in result.loc[1, "message"]
    assert "'numbers' of a case's answer: expected a number" in result.loc[2, "message"]
    assert "may not call a number 'what'" in result.loc[3, "message"]
    assert np.isnan(result.loc[4, "n"])


def test_values_come_to_the_case_as_declared(tmp_path):
    values = [1, 1.5, "1", True, None, [1, 2], {"a": 1}]
    result = run(Sweep("sweep_cases:echo", {"value": values}), tmp_path / "s.jsonl", workers=1)
    assert result["type"].tolist() == [type(value).__name__ for value in values]
    assert result["value"].tolist() == values
    same(table(read_store(tmp_path / "s.jsonl")), result)


def test_provenance_is_apart_and_complete(tmp_path):
    run(CHAOS, tmp_path / "s.jsonl", workers=1)
    told = provenance(read_store(tmp_path / "s.jsonl"))
    assert len(told) == 12
    assert (told["wall_time"] > 0.0).all()
    assert {"started", "host", "pid", "python", "numpy", "pcmc"} <= set(told)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_tables_as_files_keep_every_bit(suffix, tmp_path):
    path, result = tmp_path / f"table{suffix}", run(CHAOS, workers=1)
    write_table(path, result)
    back = pd.read_csv(path) if suffix == ".csv" else pd.read_parquet(path)
    for name in ("case", "rate", "x", "third", "inverse"):
        assert back[name].tolist() == result.reset_index()[name].tolist()
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_parquet_writes_mixed_types_as_text(tmp_path):
    frame = table([]).assign(odd=[])
    write_table(tmp_path / "empty.parquet", frame)
    mixed = pd.DataFrame({"odd": [1, "a", None]}).rename_axis("case")
    write_table(tmp_path / "t.parquet", mixed)
    assert pd.read_parquet(tmp_path / "t.parquet")["odd"].fillna("-").tolist() == ["1", "a", "-"]


def test_tables_that_cannot_be_written_are_refused(tmp_path):
    frame = pd.DataFrame({"a": [1]})
    with pytest.raises(FileError, match=r"a table is written as \.csv or \.parquet"):
        write_table(tmp_path / "t.xls", frame)
    with pytest.raises(FileError, match="cannot be written"):
        write_table(tmp_path / "missing" / "t.csv", frame)
    assert list(tmp_path.iterdir()) == []


# ---- cases that misbehave


def test_faults_become_rows_and_the_others_go_on(tmp_path):
    faults = ["raise", "exit", "hang", "stop", "leave a child", "die", "kill", "close", "behave"]
    sweep = Sweep("sweep_cases:misbehave", {"how": faults})
    result = run(sweep, tmp_path / "s.jsonl", workers=3, time_limit=1.0)
    expected = {
        "raise": ("raised", "ArithmeticError: no root\nin sight"),
        "exit": ("raised", "SystemExit: 3"),
        "hang": ("timed out", "stopped at its time limit of 1 s"),
        "stop": ("timed out", "stopped at its time limit of 1 s"),
        "leave a child": ("timed out", "stopped at its time limit of 1 s"),
        "die": ("killed", "ended its worker process (exit code 7)"),
        "kill": ("killed", "ended its worker process (signal SIGKILL)"),
        "behave": ("finished", ""),
    }
    for row in result.itertuples():
        if row.how == "close":
            assert row.status == "killed"
        else:
            assert (row.status, row.message) == expected[row.how]
    assert result["how_it_went"].count() == 1
    told = provenance(read_store(tmp_path / "s.jsonl"))
    assert "in misbehave" in told.loc[0, "output"]  # the traceback
    assert "about to die" in told.loc[5, "output"]
    assert told.loc[2, "wall_time"] >= 1.0


def test_a_case_that_waits_for_one_that_kills_runs_on_another_child(tmp_path):
    sweep = Sweep(sweep_cases.mortal, {"n": range(30)}, {"fatal": 12, "folder": str(tmp_path)})
    found = run(sweep, tmp_path / "cases", workers=1)
    begun = [int(line) for line in (tmp_path / "begun").read_text().split()]
    assert begun == list(range(30))  # each once, in order
    assert found.status.tolist() == ["killed" if n == 12 else "finished" for n in range(30)]
    assert found.pid.nunique() == 2
    (output,) = provenance(read_store(tmp_path / "cases")).output.dropna()
    assert output == "this is case 12\n"  # of its own output only


@pytest.mark.parametrize(("brief", "most"), [(60.0, 2), (0.0, 1)])
def test_only_short_cases_wait_in_a_childs_pipe(brief, most, monkeypatch):
    given = [0]

    class Counted(local.Child):
        def send(self, *arguments):
            given.append(given[-1] + 1)
            super().send(*arguments)

        def receive(self, *arguments):
            outcome = super().receive(*arguments)
            given.append(given[-1] - 1)
            return outcome

    monkeypatch.setattr(local, "Child", Counted)
    monkeypatch.setattr(local, "BRIEF", brief)
    with ThreadPoolExecutor(1) as plain:
        same(run(CHAOS, workers=1), run(CHAOS, executor=plain))
    assert max(given) == most
    assert given[-1] == 0


def test_failed_cases_run_again_only_when_asked(tmp_path):
    sweep = Sweep("sweep_cases:misbehave", {"how": ["raise", "behave", "die"]})
    store = tmp_path / "s.jsonl"
    first = run(sweep, store, workers=1)
    seen = []
    same(run(sweep, store, workers=1, on_record=seen.append), first)
    assert seen == []
    same(run(sweep, store, workers=1, on_record=seen.append, retry_failed=True), first)
    assert [progress.record.case for progress in seen] == [0, 2]
    assert seen[-1].counts == {"finished": 1, "raised": 1, "killed": 1}


def test_a_case_gets_one_thread_and_a_kept_process(monkeypatch):
    result = run(Sweep("sweep_cases:surroundings", {"n": [1, 2, 3]}), workers=1)
    assert (result.filter(like="THREADS") == 1).all(axis=None)
    assert result["pid"].nunique() == 1
    assert result.loc[0, "pid"] != os.getpid()
    monkeypatch.setenv("PCMC_THREADS", "1")
    assert threads() == 1
    monkeypatch.setenv("PCMC_THREADS", "none")
    with pytest.raises(OptionError, match="PCMC_THREADS: expected a whole number"):
        threads()


def test_no_process_is_left():
    result = run(Sweep("sweep_cases:surroundings", {"n": [1, 2, 3]}), workers=2)
    for pid in result["pid"]:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


# ---- stops and breaks


def test_progress_counts_verdicts():
    seen = []
    result = run(CHAOS, workers=1, on_record=seen.append)
    assert [progress.done for progress in seen] == list(range(1, 13))
    assert seen[-1].counts == result["verdict"].value_counts().to_dict()
    assert (seen[-1].total, seen[-1].seconds_left) == (12, 0.0)
    assert seen[0].seconds_left > 0.0


def stop_after(count, do):
    def on_record(progress):
        if progress.done == count:
            do()

    return on_record


def raise_stop():
    raise StopIteration


@pytest.mark.parametrize("stop", [raise_stop, lambda: os.kill(os.getpid(), signal.SIGINT)])
def test_a_stop_returns_what_is_done_and_resumes(stop, tmp_path):
    sweep = Sweep("sweep_cases:noted", {"n": range(8)}, {"folder": str(tmp_path), "pause": 0.05})
    store = tmp_path / "s.jsonl"
    part = run(sweep, store, workers=2, on_record=stop_after(3, stop))
    assert 3 <= len(part) < 8
    same(table(read_store(store)), part)
    pids = {int(line.split()[1]) for line in (tmp_path / "begun").read_text().splitlines()}
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
    whole = run(sweep, store, workers=2)
    assert whole["square"].tolist() == [n * n for n in range(8)]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_ctrl_c_does_not_wait_for_a_hanging_case():
    timer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    sweep = Sweep("sweep_cases:misbehave", {"how": ["hang"]})
    assert run(sweep, workers=1, time_limit=30.0).empty


def test_an_error_in_the_callback_passes_through(tmp_path):
    def on_record(progress):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        run(CHAOS, tmp_path / "s.jsonl", workers=1, on_record=on_record)
    assert len(read_store(tmp_path / "s.jsonl")) == 1


def test_a_worker_that_cannot_load_the_case_stops_the_sweep(monkeypatch, tmp_path):
    (tmp_path / "here_only.py").write_text(
        "import sys\nif not hasattr(sys, 'ps0'): raise ImportError('not on this machine')\n"
        "def case(n): return {}\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("sys.ps0", 1, raising=False)
    with pytest.raises(SweepError, match=r"cannot load the case.*\n(.*\n)*.*not on this"):
        run(Sweep("here_only:case", {"n": [1, 2]}), workers=1)


def test_an_executor_that_breaks_stops_the_sweep(tmp_path):
    class Broken(ThreadPoolExecutor):
        def submit(self, function, /, *args, **keywords):
            future = super().submit(function, *args, **keywords)
            if args[2]["n"] == 2:
                future = Future()
                future.set_exception(OSError("line cut"))
            return future

    sweep = Sweep("sweep_cases:noted", {"n": range(4)}, {"folder": str(tmp_path), "pause": 0})
    with Broken(1) as executor, pytest.raises(SweepError, match="OSError: line cut"):
        run(sweep, tmp_path / "s.jsonl", executor=executor)
    assert run(sweep, tmp_path / "s.jsonl", workers=1)["square"].tolist() == [0, 1, 4, 9]
    with pytest.raises(SweepError, match="takes no cases"):
        run(sweep, executor=executor)  # it has been shut down


def test_the_bar_shows_counts():
    console = Console(file=io.StringIO(), record=True, width=100)
    with bar(console) as draw:
        run(CHAOS, workers=1, on_record=draw)
    text = console.export_text()
    assert "12/12" in text
    assert "high" in text
    assert "0:00 left" in text


def test_the_store_is_lines_of_json(tmp_path):
    run(CHAOS, tmp_path / "s.jsonl", workers=2)
    header, *lines = [json.loads(line) for line in (tmp_path / "s.jsonl").read_text().splitlines()]
    assert header["case"] == "sweep_cases:chaos"
    assert header["fixed"] == {"pause": 0.0}
    assert sorted(line["case"] for line in lines) == list(range(12))


# ---- the case that solves


def test_solve_case_gives_the_solvers_and_the_surfaces_numbers():
    values = solve_case("generators:two_squares", "lbfgs", n=4, alpha_aux=1.0, tolerance=1e-6)
    assert values["status"] == "converged"
    assert values["gradient_squared"] <= 1e-6
    result = pcmc.solve(two_squares(4, alpha_aux=1.0), "lbfgs", tolerance=1e-6)
    assert values["energy"] == result.energy
    assert values["triangles"] == result.surface.m
    assert values["verdict"] == result.certificate.verdict.name.lower().replace("_", " ")
    assert values["residual"] == result.certificate.residual
    assert values["right.area"] == result.certificate.patches["area"][1]
    assert values["boundary 0.length"] == result.certificate.boundaries["length"][0]


def with_volume(volume):
    """A generator that calls a parameter as the certificate calls a number."""
    return two_squares(4, alpha=volume)


def test_solve_case_renames_a_number_that_a_parameter_has_the_name_of():
    values = solve_case("test_sweep:with_volume", "nesterov", volume=2.0, iterations=0)
    assert "volume" not in values
    assert values["volume_reached"] == pcmc.certify(two_squares(4, alpha=2.0)).volume


def test_solve_case_in_a_sweep():
    grid = {"alpha": [1.0, 2.0], "iterations": [3, 1000]}
    fixed = {"generator": "generators:two_squares", "method": "nesterov", "n": 4}
    result = run(Sweep(solve_case, grid, fixed), workers=1)
    assert result["status"].tolist()[::2] == ["iteration limit"] * 2
    assert result["iterations_taken"].tolist()[::2] == [3, 3]
    assert result["energy"].is_unique


@pytest.mark.parametrize(
    ("fixed", "words"),
    [
        ({"generator": "generators:two_square"}, "'generators:two_square' cannot be found"),
        ({"generator": "generators:two_squares", "method": "newtn"}, "did you mean 'newton'"),
        (
            {"generator": "generators:two_squares", "alpha_au": 3},
            "'alpha_au'; did you mean 'alpha_aux'",
        ),
        ({"generator": "generators:two_squares", "gama": 3}, "'gama'; did you mean 'gamma'"),
        ({"generator": "generators:two_squares", "gamma": -1.0}, "gamma: expected"),
        ({}, "needs the parameter 'generator'"),
    ],
)
def test_solve_case_refuses_unknown_names_before_any_case(fixed, words):
    with pytest.raises(OptionError, match=words):
        Sweep("pcmc.sweep:solve_case", {"alpha": [1.0]}, {"method": "nesterov"} | fixed)


POSTPONED = """
import sys
import numpy
from pcmc.sweep.child import postpone
postpone("numpy.f2py")
postpone("numpy.no_such_part")
postpone("no_such_package.part")
import scipy.linalg
print("numpy.f2py.crackfortran" in sys.modules)
print(callable(numpy.f2py.run_main), "numpy.f2py.crackfortran" in sys.modules)
"""


def test_what_no_case_needs_is_imported_when_it_is_used():
    found = subprocess.run(
        [sys.executable, "-c", POSTPONED], capture_output=True, text=True, check=True
    )
    assert found.stdout.split() == ["False", "True", "True"]
