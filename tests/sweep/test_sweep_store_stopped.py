"""The store of a sweep in use by another, on a full disk, its sweep killed."""

import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import suppress

import pytest
from tables import last_row, same

from pcmc.base.errors import FileError
from pcmc.sweep import Sweep, read_store, run, table
from pcmc.sweep import store as store_module
from pcmc.sweep.store import open_store

SWEEP = Sweep("sweep_cases:chaos", {"rate": [3.7, 3.8, 3.9], "seed": [0.1, 0.2]})
LARGE = Sweep("sweep_cases:chaos", {"rate": [3.6 + 0.005 * i for i in range(80)], "seed": [0.1]})


# ---- two sweeps on one store


def test_two_sweeps_cannot_write_to_one_store(tmp_path):
    path = tmp_path / "folder" / "s.sqlite"
    with open_store(path, SWEEP) as store:
        with pytest.raises(FileError, match="another sweep is writing to it"):
            run(SWEEP, path, workers=1)
        store.append([])  # the lock is taken again after each transaction
        with pytest.raises(FileError, match="another sweep is writing to it"):
            run(SWEEP, path, workers=1)
    assert len(run(SWEEP, path, workers=1)) == 6


def test_no_second_sweep_slips_in_between_two_transactions(tmp_path):
    """The lock is free for an instant after each of them."""
    path, script = (
        tmp_path / "s.sqlite",
        (
            "import sys; from pcmc.sweep.store import open_store\n"
            "from pcmc.base.errors import FileError\n"
            "from tests.sweep.test_sweep_store_stopped import SWEEP\n"
            "print('ready', flush=True)\n"
            "for _ in range(300):\n"
            "    try:\n"
            "        with open_store(sys.argv[1], SWEEP): print('in', flush=True)\n"
            "    except FileError: pass\n"
            "print('done', flush=True)\n"
        ),
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", script, str(path)]
    with (
        open_store(path, SWEEP) as store,
        subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as second,
    ):
        assert second.stdout.readline() == "ready\n"
        while second.poll() is None:
            store.append([])
            time.sleep(0.002)  # a sweep waits longer: PACE
        assert second.stdout.read() == "done\n"


FORKS = """
import os, signal, sys, time
from pcmc.sweep.store import open_store
from tests.sweep.test_sweep_store_stopped import SWEEP
with open_store(sys.argv[1], SWEEP):
    if os.fork() == 0:
        time.sleep(60.0)
        os._exit(0)
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_fork_of_a_killed_sweep_does_not_hold_its_store(tmp_path):
    """The workers of a process pool outlive their parent when it is killed."""
    path, environment = (tmp_path / "s.sqlite", os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)})
    killed = subprocess.Popen(
        [sys.executable, "-c", FORKS, str(path)], env=environment, start_new_session=True
    )
    try:
        assert killed.wait() == -signal.SIGKILL
        assert len(run(SWEEP, path, workers=1)) == 6
    finally:
        os.killpg(killed.pid, signal.SIGKILL)


# ---- a full disk


def full_after(pages):
    """A connection to a database that has room for so many pages."""
    connect = sqlite3.connect

    def limited(*arguments, **options):
        database = connect(*arguments, **options)
        database.execute(f"PRAGMA max_page_count = {pages}")
        return database

    return limited


def test_a_full_disk_stops_the_sweep_with_nothing_lost(monkeypatch, tmp_path):
    path, frame = tmp_path / "s.sqlite", run(LARGE, workers=1)
    monkeypatch.setattr(store_module.sqlite3, "connect", full_after(8))
    monkeypatch.setattr("pcmc.sweep.running.PACE", 0.0)  # a transaction for each record
    with pytest.raises(FileError, match=r"is full.*cases stored before it are safe") as caught:
        run(LARGE, path, workers=2)
    monkeypatch.undo()
    kept = read_store(path)
    assert 0 < len(kept) < 80
    assert caught.value.found == len(kept)
    same(table(kept), frame.loc[[record.case for record in kept]])
    same(run(LARGE, path, workers=1), frame)


def test_a_disk_full_at_the_start_runs_no_case(monkeypatch, tmp_path):
    sweep = Sweep("sweep_cases:noted", {"n": [1]}, {"folder": str(tmp_path), "pause": 0})
    monkeypatch.setattr(store_module.sqlite3, "connect", full_after(1))
    with pytest.raises(FileError, match="is full"):
        run(sweep, tmp_path / "s.sqlite", workers=1)
    assert not (tmp_path / "begun").exists()
    monkeypatch.undo()
    assert len(run(sweep, tmp_path / "s.sqlite", workers=1)) == 1


def test_a_real_limit_on_the_files_size(monkeypatch, tmp_path):
    """The system itself cuts a transaction in the middle."""
    path, frame = tmp_path / "s.sqlite", run(LARGE, workers=1)
    monkeypatch.setattr("pcmc.sweep.running.PACE", 0.0)
    resource = pytest.importorskip("resource")  # Windows has none
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8 * 4096 - 2000, hard))
    try:
        with pytest.raises(FileError, match=r"could not be written.*are safe"):
            run(LARGE, path, workers=1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert 0 < len(read_store(path)) < 80
    same(run(LARGE, path, workers=1), frame)


# ---- the sweep killed

LONG = {"rate": [3.6 + 0.01 * i for i in range(40)], "seed": [0.1, 0.2, 0.3, 0.4, 0.5]}
SCRIPT = """
import sys
from pcmc.sweep import Sweep, run
grid = {"rate": [3.6 + 0.01 * i for i in range(40)], "seed": [0.1, 0.2, 0.3, 0.4, 0.5]}
run(Sweep("sweep_cases:chaos", grid, {"pause": 0.03}), sys.argv[1], workers=2)
"""


def rows(path):
    with suppress(FileError):  # it is not there, or empty
        return len(read_store(path))
    return 0


@pytest.mark.nightly
def test_ten_kills_at_random_instants_change_nothing(tmp_path):
    sweep, path = Sweep("sweep_cases:chaos", LONG, {"pause": 0.03}), tmp_path / "s.sqlite"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    chance, lengths = random.Random(1), []
    for _ in range(10):
        before = rows(path)
        killed = subprocess.Popen([sys.executable, "-c", SCRIPT, str(path)], env=environment)
        while rows(path) <= before:
            assert killed.poll() is None, "the sweep ended before it was killed"
            time.sleep(0.005)
        time.sleep(chance.uniform(0.0, 0.12))
        killed.send_signal(signal.SIGKILL)
        killed.wait()
        lengths.append(len(read_store(path)))
    assert lengths == sorted(lengths)
    assert 10 < lengths[-1] < 200  # every kill came while cases were running
    resumed = run(sweep, path, workers=2)
    same(resumed, run(sweep, workers=2))
    assert last_row(path) == 200  # none was lost, none was written twice
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_workers_leave_when_the_sweep_is_killed(tmp_path):
    script = (
        "import sys; from pcmc.sweep import Sweep, run\n"
        "given = {'folder': sys.argv[1], 'pause': 3600.0}\n"
        "run(Sweep('sweep_cases:holding', {'n': [1, 2]}, given), workers=1, time_limit=None)"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    killed = subprocess.Popen([sys.executable, "-c", script, str(tmp_path)], env=environment)
    held, begun = tmp_path / "held", tmp_path / "begun"
    while not begun.exists():
        assert killed.poll() is None, "the sweep ended before it was killed"
        time.sleep(0.01)
    killed.kill()
    killed.wait()
    fcntl = pytest.importorskip("fcntl")  # Windows has none
    with held.open() as file:
        for _ in range(600):
            with suppress(BlockingIOError):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return
            time.sleep(0.05)
    pytest.fail("a worker outlived its sweep")
