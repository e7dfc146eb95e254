"""The studies: whole files, studies that fail, and the command line."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from nightly import at_night
from refusals import refused
from rich.console import Console

from generators import two_squares
from pcmc.base.errors import FileError, OptionError
from studies.__main__ import main
from studies.folder import Folder, mesh_hash
from studies.paper import read_measured
from studies.registry import STUDIES, chosen
from studies.runner import OFF, THREADS, environment, run_all
from studies.study import SOURCES, git, perform
from studies.worker import main as work
from tests.studies.tiny_study import tiny_study

HOME = Path(__file__).resolve().parents[2]


# ------------------------------------------------------------------------------------ folder


def test_table_comes_back_and_has_the_same_bytes_twice(tmp_path):
    frame = pd.DataFrame({"name": ["a", "b"], "x": [1 / 3, math.nan]})
    for name in ("one", "two"):
        Folder(tmp_path).write_table(name, frame)
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "two.csv").read_bytes()
    back = Folder(tmp_path).read_table("one")
    assert back.name.tolist() == ["a", "b"]
    assert back.x[0] == pytest.approx(1 / 3, abs=1e-10)
    assert math.isnan(back.x[1])


def test_mesh_comes_back_with_a_stage_that_has_collapsed(tmp_path):
    start = two_squares(3, alpha_aux=0.0)
    flat = start.vertices.copy()
    flat[:, 2] = 0.0
    Folder(tmp_path).write_mesh("m", {"initial": start, "final": start.moved(flat)})
    back = Folder(tmp_path).read_mesh("m")
    assert list(back) == ["initial", "final"]
    assert np.array_equal(back["final"].vertices, flat)
    for name in ("faces", "patch_of_face", "fixed", "on_plane"):
        assert np.array_equal(getattr(back["initial"], name), getattr(start, name))
    assert back["initial"].patches == start.patches
    assert back["initial"].plane == start.plane
    hashes = Folder(tmp_path).mesh_hashes()
    assert hashes == {"m initial": mesh_hash(start), "m final": mesh_hash(start.moved(flat))}
    assert len(set(hashes.values())) == 2


def test_large_figures_shrink_and_small_ones_stay_as_all_of_a_short_run(tmp_path):
    from PIL import Image

    noise = np.random.default_rng(1).integers(0, 255, (200, 200, 3), dtype=np.uint8)

    def figure(folder):
        Image.fromarray(noise).save(folder.figure("large"))
        Image.fromarray(noise[:50, :50]).save(folder.figure("small"))

    sizes = {}
    for short in (True, False):
        perform(tiny_study(figure=figure), tmp_path, short=short, steps=["figure"])
        sizes[short] = {p.stem: p.stat().st_size for p in (tmp_path / "tiny").glob("*.png")}
    assert sizes[False]["large"] < 0.5 * sizes[True]["large"]
    assert sizes[False]["small"] == sizes[True]["small"]


def test_shrunken_figures_keep_rare_colours(tmp_path, monkeypatch):
    from PIL import Image

    monkeypatch.setattr("studies.folder.LARGE", 10_000)
    rows, columns = np.mgrid[0:100, 0:150]
    rng = np.random.default_rng(1)
    picture = np.stack([rows, columns, 200 + rng.integers(0, 50, rows.shape)], axis=2).astype(np.uint8)
    picture[10:16, 10:16] = rare = (238, 136, 102)  # as in a legend
    folder = Folder(tmp_path)
    Image.fromarray(picture).save(folder.figure("a"))
    folder.shrink_figures()
    with Image.open(folder.figure("a")) as small:
        assert small.mode == "P"
        found = np.asarray(small.convert("RGB")).astype(int)
    assert np.abs(found[10:16, 10:16] - rare).max() < 20
    assert np.abs(found - picture).max() < 40


def test_missing_file_says_which_study_writes_it(tmp_path):
    with pytest.raises(FileError, match=r"python -m studies run example9"):
        Folder(tmp_path / "example9").read_table("records")


# ------------------------------------------------------------------------------------ steps


def test_changes_of_the_package_count_as_uncommitted_too():
    """Only those of studies/ did, where git is asked."""
    known = git("ls-files", "--full-name", "--", *SOURCES).splitlines()
    assert {"pcmc/__init__.py", "generators/__init__.py", "studies/study.py"} <= {*known} or not known


def test_steps_are_taken_in_order_and_the_provenance_is_apart_from_the_numbers(tmp_path):
    steps = []
    perform(tiny_study(), tmp_path, announce=steps.append)
    assert steps == ["data", "table", "figure"]
    assert read_measured(tmp_path) == {"tiny.x": 2.0}
    provenance = json.loads((tmp_path / "tiny" / "provenance.json").read_text())
    assert provenance["parameters"] == {"a": 1}
    assert {"python", "numpy", "numba"} <= set(provenance["versions"])
    assert set(provenance["seconds"]) == set(steps)


def test_a_study_that_fails_leaves_no_numbers_of_an_earlier_run(tmp_path):
    perform(tiny_study(), tmp_path)
    with pytest.raises(OptionError):
        perform(tiny_study(fail="data"), tmp_path)
    assert read_measured(tmp_path) == {}


def test_new_data_takes_the_meshes_of_an_earlier_run_away(tmp_path):
    perform(tiny_study(), tmp_path)
    stale = tmp_path / "tiny" / "stale.pcmc"
    stale.touch()
    perform(tiny_study(), tmp_path, steps=["figure"])
    assert stale.exists()
    perform(tiny_study(), tmp_path, steps=["data", "table"])
    assert not stale.exists()


def test_table_alone_uses_the_records_that_are_there(tmp_path):
    perform(tiny_study(), tmp_path, short=True)
    perform(tiny_study(fail="data"), tmp_path, steps=["table"])
    assert read_measured(tmp_path) == {"tiny.x": 1.0}


WORKER = """
import sys, time
name = sys.argv[1]
print("data", flush=True)
if name == "error": sys.exit("the mesh is gone")
if name == "crash": import os; os.abort()
if name == "sleep": time.sleep(60)
print("table", flush=True)
"""


def _run(tmp_path, names):
    script = tmp_path / "worker.py"
    script.write_text(WORKER)
    studies = [tiny_study(name) for name in names]
    quiet = Console(quiet=True)
    return run_all(studies, tmp_path, quiet, worker=(sys.executable, str(script)))


def test_a_failing_or_crashing_study_is_an_outcome_and_the_others_go_on(tmp_path):
    outcomes = _run(tmp_path, ["error", "good", "crash", "fine"])
    assert [o.study for o in outcomes] == ["error", "good", "crash", "fine"]
    assert outcomes[0].error == "the mesh is gone"
    assert "code" in outcomes[2].error or "abort" in outcomes[2].error.lower()
    assert outcomes[1].error == outcomes[3].error == ""


def test_a_process_rounds_as_on_every_processor_unless_its_times_count(monkeypatch):
    script = "import numpy as np; print(np.show_config(mode='dicts')['SIMD Extensions'].get('found', []))"
    tiny = tiny_study()
    common = environment(tiny)
    found = subprocess.run([sys.executable, "-c", script], env=common, capture_output=True, check=True)
    assert found.stdout.strip() == b"[]"
    timed = environment(replace(tiny, timed=True))
    assert timed == os.environ | dict.fromkeys(THREADS, "1")
    config = {"SIMD Extensions": {"baseline": ["X86_V2"]}}  # of a processor that has no more
    monkeypatch.setattr("numpy.show_config", lambda mode: config)
    monkeypatch.setenv(OFF, "X86_V4")
    assert environment(tiny)[OFF] == "X86_V4"
    monkeypatch.delenv(OFF)
    assert OFF not in environment(tiny)


def test_interrupt_ends_the_processes_under_way(tmp_path):
    def interrupt(*_):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 0.5)
    start = time.perf_counter()
    try:
        with pytest.raises(KeyboardInterrupt):
            _run(tmp_path, ["sleep", "sleep", "sleep"])
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert time.perf_counter() - start < 20.0


# ------------------------------------------------------------------------------ command line


def test_list_names_every_study(capsys):
    assert main(["list"]) == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name in STUDIES)


def test_unknown_study_is_answered_with_the_nearest(capsys):
    assert main(["run", "exampel1"]) == 2
    assert "did you mean 'example1'" in capsys.readouterr().err
    with refused(OptionError, what="study", found="nothing"):
        chosen(["nothing"])


def test_worker_says_in_one_line_what_it_lacks(tmp_path, capsys):
    assert work(["example1", "--results", str(tmp_path), "--steps", "table"]) == 1
    assert len(capsys.readouterr().err.splitlines()) == 1


@pytest.mark.parametrize("study", ["example1", *at_night("alpha_grid")])
def test_the_same_run_twice_gives_the_same_bytes_in_every_table(study, tmp_path):
    for name in ("one", "two"):
        perform(STUDIES[study], tmp_path / name, short=True, steps=["data", "table"])
    written = [p for p in (tmp_path / "one").rglob("*.csv") if not p.stem.endswith("times")]
    tables = sorted(p.relative_to(tmp_path / "one") for p in written)
    assert len(tables) > 2
    for table in tables:
        assert (tmp_path / "one" / table).read_bytes() == (tmp_path / "two" / table).read_bytes()


@pytest.mark.nightly
def test_command_runs_from_anywhere_and_ends_with_the_comparison(tmp_path):
    command = [sys.executable, "-m", "studies", "run", "example3", "--short", "--results"]
    environment = os.environ | {"PYTHONPATH": str(HOME), "COLUMNS": "200"}
    done = subprocess.run(
        [*command, str(tmp_path / "r")],
        cwd=tmp_path,
        env=environment,
        text=True,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "What the paper prints" in done.stdout
    assert (tmp_path / "r" / "comparison.csv").is_file()
    assert (tmp_path / "r" / "example3" / "fig19.png").stat().st_size > 1000
    left = [p.name for p in (tmp_path / "r").rglob("*") if p.name.startswith(".")]
    assert left == []
