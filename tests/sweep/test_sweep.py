"""The sweep engine on this machine: its table, its progress, stops and breaks."""

import io
import json
import os
import signal
import sqlite3
import threading
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import closing
from multiprocessing import get_context

import numpy as np
import pandas as pd
import pytest
import sweep_cases
from rich.console import Console
from tables import same

from pcmc.base.errors import FileError, SweepError
from pcmc.cli.reports import sweeping
from pcmc.sweep import Sweep, provenance, read_store, run, running, table, write_table

CHAOS = Sweep(
    "sweep_cases:chaos", {"rate": np.linspace(3.6, 4.0, 4), "seed": (0.1, 0.2, 0.3)}, {"pause": 0.0}
)


# ---- the table


def test_table_holds_what_the_cases_say():
    result = run(CHAOS, workers=2)
    assert list(result.columns) == [
        "rate",
        "seed",
        "pause",
        "status",
        "verdict",
        "message",
        "x",
        "third",
        "inverse",
    ]
    assert result.index.tolist() == list(range(12))
    for row, parameters in zip(result.itertuples(), CHAOS, strict=True):
        expected = sweep_cases.chaos(**parameters)
        assert (row.seed, row.rate) == (parameters["seed"], parameters["rate"])
        assert (row.x, row.third, row.inverse) == tuple(list(expected.values())[1:])
        assert (row.status, row.verdict) == ("finished", expected["verdict"])


def test_any_executor_gives_the_same_table(tmp_path):
    alone = run(CHAOS, tmp_path / "alone.sqlite", workers=1)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as executor:
        same(run(CHAOS, tmp_path / "pool.sqlite", executor=executor), alone)
        same(run(CHAOS, executor=executor), alone)
        assert executor.submit(len, "open").result() == 4
    same(table(read_store(tmp_path / "pool.sqlite")), alone)


def test_what_a_case_may_answer():
    kinds = ["words", "number", "list", "parameter", "nothing", "huge", "half a character"]
    result = run(Sweep("sweep_cases:answers", {"what": kinds}), workers=1)
    assert result.loc[0, ["status", "verdict", "message", "n", "yes"]].tolist() == [
        "converged",
        "",
        "well",
        3,
        True,
    ]
    assert result["status"].tolist()[1:] == ["raised"] * 3 + ["finished", "raised", "raised"]
    assert "a mapping of names to numbers, found 3.0" in result.loc[1, "message"]
    assert "'numbers' of a case's answer: expected a number" in result.loc[2, "message"]
    assert "may not call a number 'what'" in result.loc[3, "message"]
    assert np.isnan(result.loc[4, "n"])
    assert "'n' of a case's answer: expected a number in the range" in result.loc[5, "message"]
    assert "'s' of a case's answer: expected a text without lone" in result.loc[6, "message"]


def test_values_come_to_the_case_as_declared(tmp_path):
    values = [1, 1.5, "1", True, None, [1, 2], {"a": 1}]
    result = run(Sweep("sweep_cases:echo", {"value": values}), tmp_path / "s.sqlite", workers=1)
    assert result["type"].tolist() == [type(value).__name__ for value in values]
    assert result["value"].tolist() == values
    same(table(read_store(tmp_path / "s.sqlite")), result)


def test_provenance_is_apart_and_complete(tmp_path):
    run(CHAOS, tmp_path / "s.sqlite", workers=1)
    told = provenance(read_store(tmp_path / "s.sqlite"))
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
    mixed = pd.DataFrame({"odd": [1, "a", None], "long": [10**30, 1, 2]}).rename_axis("case")
    write_table(tmp_path / "t.parquet", mixed)
    back = pd.read_parquet(tmp_path / "t.parquet")
    assert back["odd"].fillna("-").tolist() == ["1", "a", "-"]
    assert back["long"].tolist() == [str(10**30), "1", "2"]


def test_tables_that_cannot_be_written_are_refused(tmp_path):
    frame = pd.DataFrame({"a": [1]})
    with pytest.raises(FileError, match=r"the suffix of a table is \.csv or \.parquet"):
        write_table(tmp_path / "t.xls", frame)
    with pytest.raises(FileError, match="cannot be written"):
        write_table(tmp_path / "missing" / "t.csv", frame)
    assert list(tmp_path.iterdir()) == []


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
    store = tmp_path / "s.sqlite"
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
        run(CHAOS, tmp_path / "s.sqlite", workers=1, on_record=on_record)
    assert len(read_store(tmp_path / "s.sqlite")) == 1


def test_a_worker_that_cannot_load_the_case_stops_the_sweep(monkeypatch, tmp_path):
    (tmp_path / "here_only.py").write_text(
        "import sys\nif not hasattr(sys, 'ps0'): raise ImportError('not on this machine')\n"
        "def case(n): return {}\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("sys.ps0", 1, raising=False)
    with pytest.raises(SweepError, match=r"cannot load the case.*\n(.*\n)*.*not on this"):
        run(Sweep("here_only:case", {"n": [1, 2]}), workers=1)


def test_a_worker_of_another_version_stops_the_sweep(monkeypatch, tmp_path):
    monkeypatch.setattr(running, "OWN_VERSION", "99.0")
    with pytest.raises(SweepError, match=r"has pcmc .*, this is pcmc 99\.0; install the same"):
        run(CHAOS, tmp_path / "s.sqlite", workers=1)
    assert read_store(tmp_path / "s.sqlite") == []


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
        run(sweep, tmp_path / "s.sqlite", executor=executor)
    assert run(sweep, tmp_path / "s.sqlite", workers=1)["square"].tolist() == [0, 1, 4, 9]
    with pytest.raises(SweepError, match="takes no cases"):
        run(sweep, executor=executor)  # it has been shut down


def test_the_bar_shows_counts():
    console = Console(file=io.StringIO(), record=True, width=100)
    with sweeping(console) as draw:
        run(CHAOS, workers=1, on_record=draw)
    text = console.export_text()
    assert "12/12" in text
    assert "high" in text
    assert "0:00 left" in text


def test_any_program_can_read_the_store(tmp_path):
    result = run(CHAOS, tmp_path / "s.sqlite", workers=2)
    with closing(sqlite3.connect(tmp_path / "s.sqlite")) as database:
        ((declaration,),) = database.execute("SELECT declaration FROM sweep")
        rows = database.execute("SELECT parameters, json_extract(record, '$.verdict') FROM cases").fetchall()
    assert json.loads(declaration) == {
        "case": "sweep_cases:chaos",
        "grid": dict(CHAOS.grid),
        "fixed": {"pause": 0.0},
    }
    verdicts = {(p["rate"], p["seed"]): v for p, v in ((json.loads(p), v) for p, v in rows)}
    assert [verdicts[row.rate, row.seed] for row in result.itertuples()] == list(result["verdict"])
