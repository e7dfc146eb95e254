"""The store of a sweep: cut at any byte, damaged, foreign, on a full disk, its sweep killed."""

import errno
import fcntl
import os
import random
import resource
import signal
import subprocess
import sys
import time
from contextlib import suppress

import pytest
from tables import same

from pcmc.base.errors import FileError, FileWarning
from pcmc.sweep import Sweep, read_store, run, table
from pcmc.sweep import store as store_module
from pcmc.sweep.store import open_store

SWEEP = Sweep("sweep_cases:chaos", {"rate": [3.7, 3.8, 3.9], "seed": [0.1, 0.2]})


@pytest.fixture
def stored(tmp_path):
    """A finished store, its bytes and its table."""
    path = tmp_path / "stored.jsonl"
    frame = run(SWEEP, path, workers=1)
    return path, path.read_bytes(), frame


def test_a_cut_store_keeps_every_whole_line(stored):
    path, data, _ = stored
    first = data.index(b"\n") + 1
    ends = [at + near for at, byte in enumerate(data) if byte == 10 for near in (-1, 0, 1, 2)]
    for cut in {*ends, *range(0, len(data), 29)}:
        path.write_bytes(data[:cut])
        whole = max(data[:cut].count(b"\n") - 1, 0)
        with open_store(path, SWEEP) as store:
            assert len(store.records) == whole
        assert path.stat().st_size == max(data.rfind(b"\n", 0, cut) + 1, first)


def test_a_cut_store_resumes_to_the_same_table(stored):
    path, data, frame = stored
    for cut in [0, 40, data.index(b"\n"), *random.Random(0).sample(range(len(data)), 12)]:
        path.write_bytes(data[:cut])
        seen = []
        same(run(SWEEP, path, workers=2, on_record=seen.append), frame)
        assert len(seen) == 6 - max(data[:cut].count(b"\n") - 1, 0)
        same(table(read_store(path)), frame)


def test_a_store_without_its_last_newlines_can_be_read(stored):
    path, data, _ = stored
    path.write_bytes(data[: data.index(b"\n")])
    assert read_store(path) == []


def test_a_damaged_line_is_told_and_run_again(stored):
    path, data, frame = stored
    lines = data.split(b"\n")
    lines[3] = lines[3].replace(b"0", b"1", 1)
    path.write_bytes(b"\n".join(lines))
    with pytest.warns(FileWarning, match="line 4 is damaged"):
        assert len(read_store(path)) == 5
    seen = []
    with pytest.warns(FileWarning, match="line 4 is damaged"):
        same(run(SWEEP, path, workers=1, on_record=seen.append), frame)
    assert [progress.record.case for progress in seen] == [2]


def test_a_line_of_another_kind_is_told_too(stored):
    """Two stores put together have a header in the middle."""
    path, data, frame = stored
    path.write_bytes(data + data)
    with pytest.warns(FileWarning, match="line 8 is damaged"):
        same(table(read_store(path)), frame)


def test_every_changed_byte_is_noticed(stored):
    _, data, _ = stored
    line = data.split(b"\n")[2]
    assert store_module._parse(line) is not None
    for at in range(len(line)):
        assert store_module._parse(line[:at] + bytes([line[at] ^ 1]) + line[at + 1 :]) is None


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (
            Sweep("sweep_cases:chaos", {"rate": [3.7, 3.8], "seed": [0.1, 0.2]}),
            "its grid has rate=",
        ),
        (
            Sweep("sweep_cases:chaos", {"seed": [0.1, 0.2], "rate": [3.7, 3.8, 3.9]}),
            "its parameters stand in another order",
        ),
        (Sweep("sweep_cases:chaos", SWEEP.grid, {"pause": 0.1}), "its fixed has pause=None"),
        (Sweep("sweep_cases:anything", SWEEP.grid), "its case is 'sweep_cases:chaos'"),
    ],
)
def test_another_sweeps_store_is_refused_and_kept(other, words, stored):
    path, data, _ = stored
    with pytest.raises(FileError, match=f"written for another sweep.*{words}"):
        run(other, path, workers=1)
    assert path.read_bytes() == data


def test_another_versions_store_is_refused_and_kept(stored, monkeypatch):
    path, data, _ = stored
    monkeypatch.setattr(store_module, "version", lambda package: "99.0")
    with pytest.raises(FileError, match=r"written by pcmc .*, this is pcmc 99\.0"):
        run(SWEEP, path, workers=1)
    monkeypatch.undo()
    monkeypatch.setattr(store_module, "FORMAT", 99)
    for use in (lambda: run(SWEEP, path, workers=1), lambda: read_store(path)):
        with pytest.raises(FileError, match="store format 1, this is format 99"):
            use()
    assert path.read_bytes() == data


@pytest.mark.parametrize("text", [b"a,b\n1,2\n", b"{}\n", b"\xff\xfe", b'{"pcmc sweep": 1}\n'])
def test_a_file_that_is_no_store_is_refused_and_kept(text, tmp_path):
    path = tmp_path / "mine.csv"
    path.write_bytes(text)
    for use in (lambda: run(SWEEP, path, workers=1), lambda: read_store(path)):
        with pytest.raises(FileError, match="line 1 is not the header of a sweep's store"):
            use()
    assert path.read_bytes() == text


def test_paths_that_cannot_be_opened(tmp_path):
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(FileError, match="cannot be opened for writing"):
        run(SWEEP, tmp_path / "file" / "s.jsonl", workers=1)
    with pytest.raises(FileError, match=r"cannot be opened \(File name too long\)"):
        run(SWEEP, tmp_path / ("x" * 300), workers=1)
    with pytest.raises(FileError, match="is no regular file"):
        run(SWEEP, "a\0b", workers=1)
    with pytest.raises(FileError, match="cannot be read"):
        read_store(tmp_path / "missing.jsonl")


def test_folders_pipes_and_devices_are_no_stores(tmp_path):
    """A device may be read without end, a pipe waits for somebody to write."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (tmp_path, pipe, "/dev/zero"):
        for use in (
            lambda path=path: run(SWEEP, path, workers=1),
            lambda path=path: read_store(path),
        ):
            with pytest.raises(FileError, match="is no regular file"):
                use()


def test_two_sweeps_cannot_write_to_one_store(tmp_path):
    path = tmp_path / "folder" / "s.jsonl"
    with open_store(path, SWEEP), pytest.raises(FileError, match="another sweep is writing to it"):
        run(SWEEP, path, workers=1)
    assert len(run(SWEEP, path, workers=1)) == 6


def test_a_disk_without_locks_is_told(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", refuse)
    with pytest.raises(FileError, match=r"cannot be locked \(No locks available\)"):
        run(SWEEP, tmp_path / "s.jsonl", workers=1)


FORKS = """
import os, signal, sys, time
from pcmc.sweep.store import open_store
from test_sweep_store import SWEEP
with open_store(sys.argv[1], SWEEP):
    if os.fork() == 0:
        time.sleep(60.0)
        os._exit(0)
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_fork_of_a_killed_sweep_does_not_hold_its_store(tmp_path):
    """The workers of a process pool outlive their parent when it is killed."""
    path, environment = tmp_path / "s.jsonl", os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    killed = subprocess.Popen(
        [sys.executable, "-c", FORKS, str(path)], env=environment, start_new_session=True
    )
    try:
        assert killed.wait() == -signal.SIGKILL
        assert len(run(SWEEP, path, workers=1)) == 6
    finally:
        os.killpg(killed.pid, signal.SIGKILL)


# ---- a full disk


def test_a_full_disk_stops_the_sweep_with_nothing_lost(stored, monkeypatch, tmp_path):
    _, data, frame = stored
    path, write, room = tmp_path / "s.jsonl", os.write, len(data) // 2

    def write_while_there_is_room(descriptor, data):
        free = room - os.fstat(descriptor).st_size
        if free <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(descriptor, data[:free])

    monkeypatch.setattr(store_module.os, "write", write_while_there_is_room)
    with pytest.raises(
        FileError, match=r"No space left on device.*cases stored before it are safe"
    ):
        run(SWEEP, path, workers=2)
    monkeypatch.undo()
    kept = read_store(path)
    assert 0 < len(kept) < 6
    assert path.read_bytes().endswith(b"\n")
    same(table(kept), frame.loc[[record.case for record in kept]])
    same(run(SWEEP, path, workers=1), frame)


def test_a_disk_that_fails_later_stops_the_sweep(stored, monkeypatch, tmp_path):
    """Some file systems find room for a line only when it is forced to the disk."""
    path, force = tmp_path / "s.jsonl", os.fsync

    def fail(descriptor):
        raise OSError(errno.EDQUOT, os.strerror(errno.EDQUOT))

    monkeypatch.setattr(store_module, "FORCE_EVERY", 0.0)
    monkeypatch.setattr(store_module.os, "fsync", fail)
    with pytest.raises(FileError, match=r"quota exceeded.* 0 cases stored before it are safe"):
        run(SWEEP, path, workers=1)
    monkeypatch.setattr(store_module.os, "fsync", force)
    same(run(SWEEP, path, workers=1), stored[2])


@pytest.mark.parametrize(("every", "forced"), [(0.0, 6), (3600.0, 1)])
def test_every_record_is_forced_to_the_disk_in_the_end(
    every, forced, stored, monkeypatch, tmp_path
):
    path, force, sizes = tmp_path / "s.jsonl", os.fsync, []
    monkeypatch.setattr(store_module, "FORCE_EVERY", every)
    monkeypatch.setattr(
        store_module.os, "fsync", lambda d: (force(d), sizes.append(os.fstat(d).st_size))
    )
    with store_module.open_store(path, SWEEP) as store:
        for record in read_store(stored[0]):
            store.append(record)
    assert len(sizes) == forced
    assert sizes[-1] == path.stat().st_size


def test_a_disk_full_at_the_header_runs_no_case(monkeypatch, tmp_path):
    def refuse(descriptor, data):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    sweep = Sweep("sweep_cases:noted", {"n": [1]}, {"folder": str(tmp_path), "pause": 0})
    monkeypatch.setattr(store_module.os, "write", refuse)
    with pytest.raises(FileError, match="No space left on device"):
        run(sweep, tmp_path / "s.jsonl", workers=1)
    assert not (tmp_path / "begun").exists()


def test_a_real_limit_on_the_files_size(tmp_path, stored):
    """The system itself cuts a record in the middle."""
    _, data, frame = stored
    path = tmp_path / "s.jsonl"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(data) // 2, hard))
    try:
        with pytest.raises(FileError, match=r"File too large.*are safe"):
            run(SWEEP, path, workers=1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert 0 < len(read_store(path)) < 6
    same(run(SWEEP, path, workers=1), frame)


# ---- the sweep killed

LONG = {"rate": [3.6 + 0.01 * i for i in range(40)], "seed": [0.1, 0.2, 0.3, 0.4, 0.5]}
SCRIPT = """
import sys
from pcmc.sweep import Sweep, run
grid = {"rate": [3.6 + 0.01 * i for i in range(40)], "seed": [0.1, 0.2, 0.3, 0.4, 0.5]}
run(Sweep("sweep_cases:chaos", grid, {"pause": 0.03}), sys.argv[1], workers=2)
"""


@pytest.mark.slow
def test_ten_kills_at_random_instants_change_nothing(tmp_path):
    sweep, path = Sweep("sweep_cases:chaos", LONG, {"pause": 0.03}), tmp_path / "s.jsonl"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    chance, lengths = random.Random(1), []
    for _ in range(10):
        before = path.stat().st_size if path.exists() else 0
        killed = subprocess.Popen([sys.executable, "-c", SCRIPT, str(path)], env=environment)
        while not path.exists() or path.stat().st_size <= before:
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
    cases = [
        record["case"] for record in map(store_module._parse, path.read_bytes().splitlines()[1:])
    ]
    assert sorted(cases) == list(range(200))  # none lost, none run again


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
    with held.open() as file:
        for _ in range(600):
            with suppress(BlockingIOError):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return
            time.sleep(0.05)
    pytest.fail("a worker outlived its sweep")
