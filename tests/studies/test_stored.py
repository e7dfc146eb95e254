"""Which stored results come from other code, and which numbers a new run does not give again."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from nightly import night_but
from rich.console import Console

from pcmc.base.errors import PcmcError
from studies import code
from studies.__main__ import main
from studies.code import code_at, code_of, files_of
from studies.folder import Folder, write_json
from studies.registry import STUDIES
from studies.runner import Outcome
from studies.stored import ages, between, check, differences, differing
from studies.study import git, perform
from tests.studies.tiny_study import tiny_study

RESULTS = Path(__file__).parents[2] / "results"
EQUILIBRIA = STUDIES["equilibria"]


def age(study, results):
    return ages([study], results)[study.name]


def forget():
    """What is read once is kept."""
    for cached in (value for value in vars(code).values() if hasattr(value, "cache_clear")):
        cached.cache_clear()


@pytest.fixture
def written(tmp_path, monkeypatch):
    """A checkout of three packages: ``write`` gives a file its text, ``files`` has the hashes of a study."""
    monkeypatch.setattr(code, "HOME", tmp_path)

    class Checkout:
        def write(self, name, text):
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")

        def files(self):
            forget()
            return files_of("studies.study_of_x")

    checkout = Checkout()
    checkout.write("pcmc/__init__.py", "if TYPE_CHECKING:\n    from .forces.area import area as measured\n")
    checkout.write("pcmc/forces/__init__.py", "")
    checkout.write("pcmc/forces/area.py", "def area(x):\n    return x * x\n")
    checkout.write("pcmc/plot.py", "def draw(): ...\n")
    checkout.write("studies/__init__.py", "")
    checkout.write(
        "studies/study_of_x.py",
        "from pcmc import measured\nfrom pcmc.plot import draw\n\nSIZE = 3\n\n\n"
        "def data():\n    return _of(SIZE)\n\n\ndef _of(x):\n    return measured(x)\n\n\n"
        "def figure():\n    draw()\n",
    )
    yield checkout
    forget()


def test_what_data_reaches_counts_and_what_draws_does_not(written):
    before = written.files()
    assert list(before) == ["pcmc/forces/area.py", "studies/study_of_x.py"]
    written.write("pcmc/plot.py", "def draw(): return 1\n")
    assert written.files() == before
    text = (code.HOME / "studies/study_of_x.py").read_text(encoding="utf-8")
    written.write("studies/study_of_x.py", text.replace("draw()", "draw(), draw()"))
    assert written.files() == before
    written.write("studies/study_of_x.py", text.replace("SIZE = 3", "SIZE = 4"))
    assert written.files()["studies/study_of_x.py"] != before["studies/study_of_x.py"]


def test_of_a_module_only_what_is_used_counts_and_what_runs_on_import(written):
    area = "def area(x):\n    return double(x) / 2.0\n\n\ndef double(x):\n    return 2.0 * x * x\n"
    written.write("pcmc/forces/area.py", area)
    before = written.files()
    written.write("pcmc/forces/area.py", area + "\n\ndef volume(x):\n    return x**3\n\n\nSIZE = 4\n")
    assert written.files() == before
    written.write("pcmc/forces/area.py", area + "\n\nprint(area)\n")
    assert written.files() != before
    written.write("pcmc/forces/area.py", area.replace("2.0 * x", "3.0 * x"))
    assert written.files() != before


def test_a_module_handed_on_counts_whole_and_a_part_of_it_alone(written):
    written.write("pcmc/forces/area.py", "from . import sums\n\n\ndef area(x):\n    return sums.two(x)\n")
    sums = "def two(x):\n    return 2 * x\n\n\ndef three(x):\n    return 3 * x\n"
    written.write("pcmc/forces/sums.py", sums)
    before = written.files()
    assert "pcmc/forces/sums.py" in before
    written.write("pcmc/forces/sums.py", sums.replace("3 * x", "4 * x"))
    assert written.files() == before
    written.write("pcmc/forces/area.py", "from . import sums\n\n\ndef area(x):\n    return vars(sums)\n")
    whole = written.files()
    written.write("pcmc/forces/sums.py", sums)
    assert written.files() != whole


def test_a_name_that_becomes_public_is_no_other_code(written):
    text = "def area(x):\n    return _double(x) / 2\n\n\ndef _double(x):\n    return 2 * x\n"
    written.write("pcmc/forces/area.py", text)
    before = written.files()
    written.write("pcmc/forces/area.py", text.replace("_double", "double"))
    assert written.files() == before


@pytest.mark.nightly
def test_the_code_of_a_commit_is_compared_by_the_rules_of_today(tmp_path):
    """The provenance's own hashes stand in where git does not know the commit, or there were changes."""
    commit = git("rev-parse", "HEAD")
    if not commit:
        pytest.skip("not a checkout of git: there is no commit whose code could be compared")
    module = EQUILIBRIA.data.__module__
    found = code_at(commit, [module, "studies.gone"])
    assert found["studies.gone"] == {}
    assert "studies/examples/equilibria.py" in found[module]
    path = tmp_path / "equilibria" / "provenance.json"
    write_json(path, {"commit": commit, "uncommitted_changes": False, "code": {"pcmc/forces": "0"}})
    assert age(EQUILIBRIA, tmp_path).changed == differing(found[module], code_of(module))
    write_json(path, {"commit": commit, "uncommitted_changes": True, "code": code_of(module)})
    assert age(EQUILIBRIA, tmp_path).changed == ()


def test_comments_and_docstrings_do_not_change_a_hash_and_a_sign_does(written):
    before = written.files()
    words = '"""Of a square."""\n\n\ndef area(x):\n    """Its area."""\n    return x*x  # length squared\n'
    written.write("pcmc/forces/area.py", words)
    assert written.files() == before
    written.write("pcmc/forces/area.py", "def area(x):\n    return -x * x\n")
    assert written.files() != before


@pytest.mark.parametrize("name", night_but(STUDIES, "equilibria"))
def test_every_study_rests_on_the_surface_and_none_on_pictures(name):
    found = code_of(STUDIES[name].data.__module__)
    assert {"pcmc/surface", "generators"} & set(found)
    assert "pcmc/plot" not in found
    assert any(part.startswith("studies/") for part in found)


def test_a_result_is_stale_when_a_part_of_its_code_is_other(tmp_path):
    assert age(EQUILIBRIA, tmp_path) is None
    path = tmp_path / "equilibria" / "provenance.json"
    now = code_of(EQUILIBRIA.data.__module__)
    write_json(path, {"commit": "", "code": now})
    assert str(age(EQUILIBRIA, tmp_path)).startswith("up to date")
    write_json(path, {"commit": "", "code": now | {"pcmc/forces": "0"}})
    assert str(age(EQUILIBRIA, tmp_path)).startswith("stale: other code in pcmc/forces")
    write_json(path, {"commit": ""})
    assert "no hashes" in str(age(EQUILIBRIA, tmp_path))


def test_the_command_names_what_to_run_again(tmp_path, capsys):
    assert main(["stale", "--results", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "no result" in said
    assert "python -m studies run example1 example2" in said


@pytest.fixture
def small(tmp_path, monkeypatch):
    """A study of two numbers and a table of two rows; ``store`` stores other values, and checks."""
    records = pd.DataFrame({"case": ["a", "b"], "energy": [1.0, 2.0], "verdict": ["stable", "saddle"]})

    def data(folder, short):
        folder.write_table("records", records)
        folder.write_table("times", pd.DataFrame({"seconds": [1.0]}))

    def run_here(studies, results, console, steps):
        perform(study, results, steps=steps)
        return [Outcome(study.name, 0.0)]

    study = replace(EQUILIBRIA, data=data, table=lambda folder: {"x": 1.0, "y": 2.0})
    monkeypatch.setattr("studies.runner.run_all", run_here)
    monkeypatch.setattr("studies.study.provenance", lambda *_: {})
    folder = Folder(tmp_path / "equilibria")

    def store(y=2.0, **columns):
        keys = ["equilibria.x", "equilibria.y"]
        folder.write_table("measured", pd.DataFrame({"key": keys, "value": [1.0, y]}))
        folder.write_table("records", records.assign(**columns))
        folder.write_table("times", pd.DataFrame({"seconds": [2.0]}))
        return main(["check", "equilibria", "--results", str(tmp_path)])

    return store


@pytest.mark.parametrize(
    ("stored", "line"),
    [
        (
            {"y": 2.00001},
            "measured.csv: value, 1 of 2 rows, most in row 3 (equilibria.y): stored 2.00001, now 2",
        ),
        (
            {"energy": [1.0, 2.1]},
            "records.csv: energy, 1 of 2 rows, most in row 3 (b): stored 2.1, now 2",
        ),
        (
            {"verdict": ["saddle", "saddle"]},
            "records.csv: verdict, 1 of 2 rows, most in row 2 (a): stored saddle, now stable",
        ),
        ({"more": [1, 2]}, "records.csv: more: only stored"),
    ],
)
def test_a_new_run_is_compared_cell_by_cell(stored, line, small, capsys):
    assert small() == 0
    assert capsys.readouterr().out == "equilibria: every number is as stored\n"
    assert small(**stored) == 1
    assert capsys.readouterr().out == f"equilibria/{line}\n"


def test_tables_rows_and_keys_that_only_one_run_has_are_said(tmp_path):
    old, new = Folder(tmp_path / "old"), Folder(tmp_path / "new")
    rows = pd.DataFrame({"key": ["a.x", "a.y"], "value": [1.0, 2.0]})
    old.write_table("measured", rows)
    new.write_table("measured", rows[1:])
    old.write_table("gone", rows)
    old.write_table("rows", rows[["value"]])
    new.write_table("rows", rows[["value"]][1:])
    assert differences(old.path, new.path) == [
        "old/gone.csv: only stored",
        "old/measured.csv: value, 1 of 2 rows, most in row 2 (a.x): stored 1, now nan",
        "old/rows.csv: stored 2 rows, now 1",
    ]


@pytest.mark.parametrize(("stored", "same"), [(1.0 + 0.9e-6, True), (1.0 + 1.1e-6, False)])
def test_rounding_is_no_difference_and_more_is(stored, same):
    assert (between(pd.DataFrame({"x": [stored]}), pd.DataFrame({"x": [1.0]})) == []) is same
    assert between(pd.DataFrame({"x": [0.9e-9]}), pd.DataFrame({"x": [-0.05e-9]})) == []


WORKER = """
import sys
from pathlib import Path
study = Path(sys.argv[3]) / sys.argv[1]
if not (study.parent / "corners" / "grid.csv").is_file(): sys.exit("no corners")
study.mkdir()
(study / "measured.csv").write_text("key,value")
"""


def test_a_check_finds_what_the_study_reads_of_others(tmp_path):
    script = tmp_path / "worker.py"
    script.write_text(WORKER)
    quiet, worker = Console(quiet=True), (sys.executable, str(script))
    assert check(tiny_study(), RESULTS, quiet, worker=worker) == ["tiny/measured.csv: only now"]
    with pytest.raises(PcmcError, match="tiny: no corners"):
        check(tiny_study(), tmp_path, quiet, worker=worker)


def test_continuous_integration_computes_a_stored_result_again():
    script = (RESULTS.parent / ".ci" / "run").read_text(encoding="utf-8")
    assert "python -m studies check equilibria" in script
    assert (RESULTS / "equilibria" / "measured.csv").is_file()


def test_every_stored_result_knows_its_commit_and_its_code():
    for study in STUDIES.values():
        stored = json.loads((RESULTS / study.name / "provenance.json").read_text(encoding="utf-8"))
        assert len(stored["commit"]) == 40
        assert stored["code"], study.name


@pytest.mark.nightly
def test_equilibria_are_as_stored():
    assert check(EQUILIBRIA, RESULTS, Console(quiet=True)) == []
