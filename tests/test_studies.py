"""The studies: whole files, rules of comparison, studies that fail, and the command line."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from refusals import refused
from rich.console import Console

from generators import four_fans, spherical_cap, two_caps, two_squares
from generators.calibration import PRINTED
from pcmc import curvature_error, solve
from pcmc.base.errors import FileError, OptionError
from pcmc.energy.functional import energy_and_gradient
from studies import example1
from studies.__main__ import main
from studies.benchmark import numpy_energy_and_gradient
from studies.flow import NOISE, Case, errors, start_of, turn
from studies.folder import Folder, mesh_hash
from studies.mesh_search import GROUPS, groups, holders
from studies.paper import (
    CONDITIONAL,
    NOT,
    REPRODUCED,
    Claim,
    Figure,
    compare,
    judge,
    label,
    paper,
    printed,
    read_measured,
)
from studies.readme import with_block
from studies.registry import STUDIES, chosen
from studies.runner import run_all
from studies.study import Study, perform
from studies.worker import main as work

HOME = Path(__file__).resolve().parent.parent
RESULTS = HOME / "results"


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


def test_large_figures_shrink_and_small_ones_stay(tmp_path):
    from PIL import Image

    noise = np.random.default_rng(1).integers(0, 255, (300, 300, 3), dtype=np.uint8)
    folder = Folder(tmp_path)
    Image.fromarray(noise).save(folder.figure("large"))
    Image.fromarray(noise[:50, :50]).save(folder.figure("small"))
    before = {p.stem: p.stat().st_size for p in tmp_path.glob("*.png")}
    folder.shrink_figures()
    after = {p.stem: p.stat().st_size for p in tmp_path.glob("*.png")}
    assert after["large"] < 0.5 * before["large"]
    assert after["small"] == before["small"]


def test_shrunken_figures_keep_rare_colours(tmp_path):
    from PIL import Image

    rows, columns = np.mgrid[0:600, 0:900]
    rng = np.random.default_rng(1)
    picture = np.stack([rows // 3, columns // 4, 200 + rng.integers(0, 50, rows.shape)], axis=2).astype(
        np.uint8
    )
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


# ------------------------------------------------------------------------------ comparison


@pytest.mark.parametrize(
    ("relation", "ours", "verdict"),
    [
        ("=", 2.04, "reproduced"),
        ("=", 2.3, "near"),
        ("=", 3.0, "differs"),
        ("<", 1.99, "reproduced"),
        ("<", 2.0, "near"),
        ("<", 9.0, "differs"),
        (">", 2.01, "reproduced"),
        (">", 0.1, "differs"),
        ("=", math.nan, "not measured"),
    ],
)
def test_verdict_of_a_printed_number(relation, ours, verdict):
    claim = Claim("a", "Sec. 1", "s.a", 2.0, relation, tolerance=0.05, near=0.2)
    assert judge(claim, {"s.a": ours}).verdict == verdict


def test_claim_between_two_of_our_numbers():
    claim = Claim("smaller", "Sec. 1", "s.fine", "s.coarse", "<")
    assert judge(claim, {"s.fine": 1.0, "s.coarse": 2.0}).verdict == "reproduced"
    assert judge(claim, {"s.fine": 2.0, "s.coarse": 1.0}).verdict == "differs"
    assert judge(claim, {"s.fine": 2.0}).verdict == "not measured"


def test_label_of_a_figure_follows_from_the_papers_claims():
    first = Claim("Ex. 1: first", "Sec. 1", "s.a", 1.0, tolerance=0.1, near=0.5, figures=("1",))
    second = Claim(
        "Ex. 1: second",
        "Sec. 1",
        "s.b",
        2.0,
        "<",
        figures=("1",),
        instead="s.c",
        fails="b is {ours}, printed {paper}; otherwise {instead}",
    )
    third = Claim("Ex. 1: third", "Sec. 1", "s.c", 2.0, "<", figures=("1",), own=True)
    side = Claim("Ex. 1: side", "Sec. 1", "s.d", 4.0, figures=("1",), given=True)
    failed = "b is 3, printed 2; otherwise "

    def labelled(a=1.0, b=1.0, c=1.0, d=4.0, unknown=""):
        measured = {"s.a": a, "s.b": b, "s.c": c, "s.d": d}
        findings = [judge(claim, measured) for claim in (first, second, third, side)]
        return label(Figure("1", "a shape", "s", unknown), findings)

    assert labelled() == (REPRODUCED, "2 of 2", "")
    assert labelled(c=9.0) == (REPRODUCED, "2 of 2", "")  # ours, and no claim of the paper's
    assert labelled(unknown="its scale") == (CONDITIONAL, "2 of 2", "its scale")
    assert labelled(b=3.0) == (CONDITIONAL, "1 of 2", failed + "1")
    assert labelled(b=3.0, c=9.0) == (NOT, "1 of 2", failed + "nan")
    near = "first: ours 1.4, printed 1 (+40.0%)"
    assert labelled(a=1.4) == (CONDITIONAL, "1 of 2, 1 near", near)
    assert labelled(a=1.4, b=3.0)[2] == f"{near}; {failed}1"
    assert labelled(a=9.0) == (NOT, "1 of 2", "first: ours 9, printed 1 (+800.0%)")
    assert labelled(d=5.0) == (NOT, "2 of 2", "side: ours 5, printed 4 (+25.0%)")
    assert label(Figure("1", "a shape", "s"), [])[0] == NOT
    assert label(Figure("1", "", "s", "all"), [judge(side, {"s.d": 4.0})])[1] == "inputs only"


def test_reasons_say_what_is_measured():
    bound = judge(Claim("Ex. 1: flat", "", "s.a", 0.5, "<", bound=True), {"s.a": 0.7})
    assert bound.reason() == "flat: ours 0.7, to hold it must be < 0.5"
    printed = judge(Claim("Ex. 1: rest", "", "s.a", 0.5, "<"), {"s.a": 0.7})
    assert printed.reason() == "rest: ours 0.7, printed < 0.5"


def test_no_claim_says_the_same_as_another_or_leans_on_the_one_before():
    claims, _ = paper()
    says = [claim.says.partition(": ")[2] for claim in claims]
    leaning = ("and ", "so ", "the same ")
    assert not [s for s in says if s.startswith(leaning) or " there" in s]
    assert len({claim.says for claim in claims}) == len(claims)


def test_every_figure_of_the_examples_rests_on_claims_of_a_study_that_exists():
    claims, figures = paper()
    assert [f.number for f in figures] == [str(k) for k in range(6, 26)]
    for figure in figures:
        assert figure.study in STUDIES
        assert any(figure.number in claim.figures for claim in claims), figure
    for claim in claims:
        for key in (claim.ours, claim.paper):
            assert not isinstance(key, str) or key.split(".")[0] in STUDIES


def test_numbers_printed_for_initial_shapes_are_the_same_wherever_they_stand():
    assert {name: printed(f"{name}.initial_gradient_squared") for name in PRINTED} == PRINTED
    with refused(FileError, found="example1.turn_2"):
        printed("example1.turn_2")


def test_paper_file_with_a_wrong_relation_or_key_is_refused(tmp_path):
    entry = '[[figure]]\nnumber="1"\nshows="x"\nstudy="s"\n[[claim]]\nsays="a"\nwhere="b"\nours="s.c"\n'
    bad = tmp_path / "bad.toml"
    for line, where, found in (
        ('paper=1\nrelation="~"', "relation", "~"),
        ('paper=1\nfigures=["7"]', "figures", "7"),
        ("paper=1\nnearly=3", "a", None),
        ('paper=1\ninstead="s.d"', "instead", "s.d"),
        ('paper=1\nfails="{theirs}"', "fails", "{theirs}"),
    ):
        bad.write_text(entry + line)
        paper.cache_clear()
        with refused(FileError, what=str(bad), where=where, found=found):
            paper(bad)


def test_comparison_in_results_is_what_the_measured_numbers_give(tmp_path):
    comparison, figures = compare(read_measured(RESULTS))
    for name, table in (("comparison", comparison), ("figures", figures)):
        Folder(tmp_path).write_table(name, table)
        new, kept = ((f / f"{name}.csv").read_text() for f in (tmp_path, RESULTS))
        assert new == kept, "run: python -m studies reproduce"
    assert not (comparison.verdict == "not measured").any()


def test_results_are_small():
    files = [path for path in RESULTS.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) < 30e6
    assert max(path.stat().st_size for path in files if path.suffix == ".png") <= 150_000


# ------------------------------------------------------------------------------------ steps


def _study(name="tiny", fail=""):
    def data(folder, short):
        if fail == "data":
            raise OptionError("no data")
        folder.write_table("records", pd.DataFrame({"x": [1.0 if short else 2.0]}))

    def table(folder):
        return {"x": folder.read_table("records").x[0]}

    return Study(name, "a test", data, table, lambda folder: None, parameters={"a": 1})


def test_steps_are_taken_in_order_and_the_provenance_is_apart_from_the_numbers(tmp_path):
    steps = []
    perform(_study(), tmp_path, announce=steps.append)
    assert steps == ["data", "table", "figure"]
    assert read_measured(tmp_path) == {"tiny.x": 2.0}
    provenance = json.loads((tmp_path / "tiny" / "provenance.json").read_text())
    assert provenance["parameters"] == {"a": 1}
    assert {"python", "numpy", "numba"} <= set(provenance["versions"])
    assert set(provenance["seconds"]) == set(steps)


def test_a_study_that_fails_leaves_no_numbers_of_an_earlier_run(tmp_path):
    perform(_study(), tmp_path)
    with pytest.raises(OptionError):
        perform(_study(fail="data"), tmp_path)
    assert read_measured(tmp_path) == {}


def test_new_data_takes_the_meshes_of_an_earlier_run_away(tmp_path):
    perform(_study(), tmp_path)
    stale = tmp_path / "tiny" / "stale.pcmc"
    stale.touch()
    perform(_study(), tmp_path, steps=["figure"])
    assert stale.exists()
    perform(_study(), tmp_path, steps=["data", "table"])
    assert not stale.exists()


def test_table_alone_uses_the_records_that_are_there(tmp_path):
    perform(_study(), tmp_path, short=True)
    perform(_study(fail="data"), tmp_path, steps=["table"])
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
    studies = [_study(name) for name in names]
    quiet = Console(quiet=True)
    return run_all(studies, tmp_path, quiet, worker=(sys.executable, str(script)))


def test_a_failing_or_crashing_study_is_an_outcome_and_the_others_go_on(tmp_path):
    outcomes = _run(tmp_path, ["error", "good", "crash", "fine"])
    assert [o.study for o in outcomes] == ["error", "good", "crash", "fine"]
    assert outcomes[0].error == "the mesh is gone"
    assert "code" in outcomes[2].error or "abort" in outcomes[2].error.lower()
    assert outcomes[1].error == outcomes[3].error == ""


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


def test_the_same_run_twice_gives_the_same_bytes_in_every_table(tmp_path):
    for name in ("one", "two"):
        for study in chosen(["example1", "alpha_grid"]):
            perform(study, tmp_path / name, short=True, steps=["data", "table"])
    written = [p for p in (tmp_path / "one").rglob("*.csv") if not p.stem.endswith("times")]
    tables = sorted(p.relative_to(tmp_path / "one") for p in written)
    assert len(tables) > 5
    for table in tables:
        assert (tmp_path / "one" / table).read_bytes() == (tmp_path / "two" / table).read_bytes()


@pytest.mark.slow
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


# ------------------------------------------------------------------- what the studies measure


@pytest.mark.parametrize("surface", [two_squares(5), two_caps(1.2)], ids=["squares", "caps"])
def test_numpy_yardstick_agrees_with_the_compiled_loop(surface):
    mine, theirs = numpy_energy_and_gradient(surface), energy_and_gradient(surface)
    assert mine[0] == pytest.approx(theirs[0], rel=1e-13)
    assert np.allclose(mine[1], theirs[1], atol=1e-13 * np.abs(theirs[1]).max())


def test_turn_between_two_flat_sheets_is_their_angle():
    surface = two_squares(4, height=1.0)
    X = surface.vertices.copy()
    X[:, 2] *= 0.0
    roof = np.unique(surface.faces[surface.patch_faces([0, 1])])
    X[roof, 2] = 1.0 + np.abs(X[roof, 0]) * math.tan(math.radians(20.0))
    middle = int(np.argmin(np.linalg.norm(X - [0.0, 0.0, 1.0], axis=1)))
    assert turn(surface.moved(X), middle, ("left", "right")) == pytest.approx(40.0)
    X[roof, 2] = 1.0 - np.abs(X[roof, 0]) * math.tan(math.radians(20.0))
    assert turn(surface.moved(X), middle, ("left", "right")) == pytest.approx(-40.0)


def test_a_wall_stands_until_it_first_comes_down_however_it_bounces():
    heights = {run: [1.0, 0.5, 0.04, 0.3, 0.2] for run in example1.STANDING}
    *_, other = heights
    heights[other] = [1.0, 0.9, 0.8, 0.7, 0.6]
    tables = [
        pd.DataFrame({"run": run, "iteration": range(5), "height": column}) for run, column in heights.items()
    ]
    assert example1._standing_numbers(pd.concat(tables, ignore_index=True)) == {
        "stands_until": 1,
        "stands_until_without_momentum": 1,
        "least_height_3_parallel": 0.6,
    }


def test_a_flow_starts_from_the_same_bits_whatever_the_last_digits_of_a_linear_solver():
    surface = four_fans(5)
    noise = 1e-12 * np.random.default_rng(1).standard_normal((surface.n, 3))
    cases = [
        Case("a", lambda X=X: surface.moved(X), {}) for X in (surface.vertices, surface.vertices + noise)
    ]
    one, other = (start_of(case).vertices for case in cases)
    assert not np.array_equal(surface.vertices, surface.vertices + noise)
    assert np.array_equal(one, other)
    np.testing.assert_allclose(one, surface.vertices, rtol=0.0, atol=1e-6)


def test_errors_below_rounding_are_written_as_a_bound_and_others_as_they_are():
    exact = errors(solve(spherical_cap(0.3), tolerance=1e-13).surface)
    assert exact["largest_error_variational"] == exact["mean_error_variational"] == NOISE
    assert exact["largest_error_cotangent"] > 1e-4
    flat = spherical_cap(0.3)
    assert errors(flat)["largest_error_variational"] == np.nanmax(
        np.abs(curvature_error(flat, "variational"))
    )


def test_every_vertex_that_can_move_is_in_one_group_and_the_shares_add_to_one():
    surface = two_caps(1.2)
    masks = groups(surface)
    assert tuple(masks) == GROUPS
    assert np.array_equal(sum(m.astype(int) for m in masks.values()), (~surface.fixed).astype(int))
    shares = holders(surface)
    assert sum(shares[f"share {g}"] for g in GROUPS) == pytest.approx(1.0)


def test_template_keeps_what_is_around_the_markers():
    text = "before\n<!-- comparison: begin -->old<!-- comparison: end -->\nafter"
    wanted = "before\n<!-- comparison: begin -->\n\nNEW\n\n<!-- comparison: end -->\nafter"
    assert with_block(text, "comparison", ["NEW"]) == wanted
    assert with_block(wanted, "comparison", ["NEW"]) == wanted
    with refused(FileError, what="README.md"):
        with_block("no markers", "comparison", ["NEW"])
