"""Cases that raise, hang, die, print, fork: each is a row, and the others go on."""

import os

import pytest
import sweep_cases
from tables import same

from pcmc.base import libraries as child_process
from pcmc.base.compiled import threads
from pcmc.base.errors import OptionError
from pcmc.sweep import Sweep, case_script, provenance, read_store, run, workers

CHAOS = Sweep("sweep_cases:chaos", {"rate": [3.6, 3.8, 4.0], "seed": [0.1, 0.2, 0.3]})


def test_faults_become_rows_and_the_others_go_on(tmp_path):
    faults = [
        "raise",
        "exit",
        "interrupt",
        "cancel",
        "hang",
        "stop",
        "leave a child",
        "die",
        "kill",
        "close",
        "behave",
    ]
    sweep = Sweep("sweep_cases:misbehave", {"how": faults})
    result = run(sweep, tmp_path / "s.sqlite", workers=3, time_limit=1.0)
    expected = {
        "raise": ("raised", "ArithmeticError: no root\nin sight"),
        "exit": ("raised", "SystemExit: 3"),
        "interrupt": ("raised", "KeyboardInterrupt"),
        "cancel": ("raised", "asyncio.exceptions.CancelledError: late"),
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
    told = provenance(read_store(tmp_path / "s.sqlite"))
    at = faults.index
    assert "in misbehave" in told.loc[at("raise"), "output"]  # the traceback
    assert "about to die" in told.loc[at("die"), "output"]
    assert told.loc[at("hang"), "wall_time"] >= 1.0


@pytest.mark.parametrize("limit", [None, 60.0])
def test_a_fork_that_a_case_makes_answers_nothing(limit):
    """A second answer to one case would be taken for the next one's."""
    result = run(Sweep(sweep_cases.forked, {"n": range(30)}), workers=1, time_limit=limit)
    assert result["square"].tolist() == [n * n for n in range(30)]


def test_a_process_that_outlives_its_case_does_not_hold_up_the_sweep(tmp_path):
    run(Sweep(sweep_cases.daemon, {"n": [1]}), tmp_path / "s.sqlite", workers=1, time_limit=1.0)
    (record,) = read_store(tmp_path / "s.sqlite")
    assert record.status == "timed out"
    assert record.wall_time < 15.0  # the daemon sleeps 20


def test_what_a_failed_case_says_is_kept_in_part(tmp_path):
    sweep = Sweep(sweep_cases.chatter, {"how": ["raise", "die"]})
    result = run(sweep, tmp_path / "s.sqlite", workers=1)
    told = provenance(read_store(tmp_path / "s.sqlite"))
    assert result.loc[0, "message"].startswith("ValueError: xxx")
    assert len(result.loc[0, "message"]) == case_script.OUTPUT
    assert told["output"].str.len().tolist() == [case_script.OUTPUT] * 2
    assert told.loc[1, "output"].endswith("the end €\n")


def test_a_case_that_is_interrupted_does_not_leave_its_answer_to_the_next(monkeypatch):
    """In a process pool Ctrl-C reaches the worker that waits for the case."""

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(child_process.pickle, "load", interrupted)
        with pytest.raises(KeyboardInterrupt):
            workers.run_case("team", "sweep_cases:echo", {"value": 1}, 60.0)
    try:
        outcome = workers.run_case("team", "sweep_cases:echo", {"value": 2}, 60.0)
    finally:
        workers.retire("team")
    assert outcome["numbers"]["back"] == "2"


def test_the_case_after_one_that_kills_runs_in_another_process(tmp_path):
    sweep = Sweep(sweep_cases.mortal, {"n": range(30)}, {"fatal": 12, "folder": str(tmp_path)})
    found = run(sweep, tmp_path / "cases", workers=1)
    begun = [int(line) for line in (tmp_path / "begun").read_text().split()]
    assert begun == list(range(30))  # each once, in order
    assert found.status.tolist() == ["killed" if n == 12 else "finished" for n in range(30)]
    assert found.pid.nunique() == 2
    (output,) = provenance(read_store(tmp_path / "cases")).output.dropna()
    assert output == "this is case 12\n"  # of its own output only


def test_failed_cases_run_again_only_when_asked(tmp_path):
    sweep = Sweep("sweep_cases:misbehave", {"how": ["raise", "behave", "die"]})
    store = tmp_path / "s.sqlite"
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
