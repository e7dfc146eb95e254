"""A sweep on a real Dask cluster: a scheduler and two workers, processes that talk over TCP."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time

import pytest
from tables import last_row, same

from pcmc.base.errors import OptionError, SweepError
from pcmc.sweep import Sweep, read_store, run, table
from pcmc.sweep import workers as workers_module

GRID = {"rate": [3.6 + 0.02 * i for i in range(15)], "seed": [0.1, 0.2, 0.3]}
SWEEP = Sweep("sweep_cases:chaos", GRID, {"pause": 0.02})


class Cluster:
    """Processes of a Dask cluster on the loopback."""

    def __init__(self, folder):
        self.file, self.processes = folder / "scheduler.json", []
        self.environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        self.start("scheduler", "--host", "127.0.0.1", "--port", "0")
        self.address = json.loads(wait_for(self.read_address))["address"]

    def read_address(self):
        return self.file.exists() and self.file.read_text()

    def start(self, kind, *options):
        command = [sys.executable, "-m", "distributed.cli.dask_" + kind, "--no-dashboard"]
        command += ["--scheduler-file", str(self.file), *options]
        process = subprocess.Popen(command, env=self.environment, stderr=subprocess.DEVNULL)
        self.processes.append(process)
        return process

    def start_worker(self, name):
        return self.start("worker", "--nthreads", "1", "--no-nanny", "--name", name)

    def stop(self):
        for process in self.processes:
            process.kill()
            process.wait()


def wait_for(look):
    for _ in range(600):
        if found := look():
            return found
        time.sleep(0.05)
    pytest.fail("the cluster does not start")


@pytest.fixture
def cluster(tmp_path):
    made = Cluster(tmp_path)
    yield made
    made.stop()


def test_a_cluster_gives_the_same_table_even_if_a_worker_is_killed(cluster, tmp_path):
    workers = [cluster.start_worker(name) for name in ("one", "two")]
    local = run(SWEEP, workers=2)
    same(run(SWEEP, tmp_path / "whole.sqlite", scheduler=cluster.address), local)
    pids = {record.provenance["pid"] for record in read_store(tmp_path / "whole.sqlite")}
    assert len(pids) == 2  # both worked

    def kill_one(progress):
        if progress.done == 15:
            workers[0].send_signal(signal.SIGKILL)

    path = tmp_path / "killed.sqlite"
    same(run(SWEEP, path, scheduler=cluster.address, on_record=kill_one), local)
    same(table(read_store(path)), local)
    assert last_row(path) == 45  # no case twice


@pytest.mark.nightly
def test_cases_that_misbehave_on_a_cluster(cluster):
    cluster.start_worker("one")
    sweep = Sweep("sweep_cases:misbehave", {"how": ["raise", "hang", "kill", "behave"]})
    result = run(sweep, scheduler=cluster.address, time_limit=1.0)
    assert result["status"].tolist() == ["raised", "timed out", "killed", "finished"]
    same(result, run(sweep, workers=2, time_limit=1.0))


@pytest.mark.nightly
def test_a_scheduler_that_goes_away_stops_the_sweep(cluster, tmp_path):
    cluster.start_worker("one")

    def kill_scheduler(progress):
        if progress.done == 5:
            cluster.processes[0].kill()

    with pytest.raises(SweepError, match="run the same sweep again"):
        run(SWEEP, tmp_path / "s.sqlite", scheduler=cluster.address, on_record=kill_scheduler)
    assert 5 <= len(read_store(tmp_path / "s.sqlite")) < 45
    same(run(SWEEP, tmp_path / "s.sqlite", workers=2), run(SWEEP, workers=2))


@pytest.mark.nightly
def test_ctrl_c_ends_the_cases_on_the_cluster(cluster, tmp_path):
    cluster.start_worker("one")
    sweep = Sweep("sweep_cases:holding", {"n": [1, 2]}, {"folder": str(tmp_path), "pause": 3600.0})

    def interrupt():
        wait_for((tmp_path / "begun").exists)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    assert run(sweep, scheduler=cluster.address).empty
    assert wait_for(lambda: free(tmp_path / "held"))


def free(path):
    fcntl = pytest.importorskip("fcntl")  # Windows has none
    with path.open() as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
    return True


@pytest.mark.nightly
def test_clusters_that_cannot_be_used(cluster, monkeypatch):
    monkeypatch.setattr(workers_module, "CONNECT", 1.0)
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{unused.getsockname()[1]}"
        with pytest.raises(SweepError, match="no Dask scheduler answers at"):
            run(SWEEP, scheduler=address)
    with pytest.raises(OptionError, match=r"expected 'tcp://host:8786', found 'nonsense'"):
        run(SWEEP, scheduler="nonsense")
    with pytest.raises(SweepError, match=r"has no workers; start one with: dask worker tcp://"):
        run(SWEEP, scheduler=cluster.address)
    cluster.start_worker("one")
    monkeypatch.setattr(workers_module, "CONNECT", 30.0)
    monkeypatch.setattr("pcmc.sweep.running.OWN_VERSION", "99.0")
    with pytest.raises(SweepError, match=r"has pcmc .*, this is pcmc 99\.0; install the same"):
        run(SWEEP, scheduler=cluster.address)
