"""The command for sweeps of a project: tables, pictures, stores, what it refuses."""

from __future__ import annotations

import sys

import numpy as np
import pandas as pd
import pytest
from nightly import at_night
from PIL import Image
from refusals import refused
from swept_roof import NUMBERS, TEXT
from tables import same

import pcmc
from pcmc import cli
from pcmc.base.errors import OptionError
from pcmc.project import digest, run, varied
from pcmc.sweep import draw_sweep, read_store
from pcmc.sweep import run as run_sweep
from pcmc.sweep.projects import project_sweep

GRID = ["west.tension=3,3.2", "wall 1.tension=0.5,0.8"]


def test_the_command_makes_a_table(roof, capsys):
    given = ["sweep", "roof.toml", *GRID, "east.tension=3.1", "--csv", "t.csv", "--store", "s"]
    given += ["--workers", "1"]
    assert cli.main([*given, "--all", "--plot", "t.png"]) == 0
    shown = capsys.readouterr().out
    table = pd.read_csv("t.csv")
    assert table["west.tension"].tolist() == [3.0, 3.0, 3.2, 3.2]
    assert table["wall 1.tension"].tolist() == [0.5, 0.8] * 2
    assert set(table["project"]) == {"roof.toml"}
    assert set(table["project_digest"]) == {digest(roof)}
    assert (table["verdict"] == "stable").all()
    assert shown.count("stable") == 4
    assert shown.split()[:3] == ["west.tension", "wall", "1.tension"]
    with Image.open("t.png") as picture:
        assert picture.width == 900
    assert sorted(p.name for p in roof.parent.iterdir()) == ["roof.toml", "s", "t.csv", "t.png"]
    assert cli.main(given) == 0
    short = pd.read_csv("t.csv", index_col="case")
    assert list(short) == ["west.tension", "wall 1.tension", "status", "verdict", *NUMBERS]
    assert (short["rise"] == short[["west.apex", "east.apex"]].max(axis=1)).all()
    start = varied(roof, {"west.tension": 3.0, "wall 1.tension": 0.5, "east.tension": 3.1})[1]
    first = pcmc.solve(start).certificate
    row = short.loc[0]
    assert row["area"] == pytest.approx(first.patches["area"][:2].sum(), rel=1e-9)
    assert row["reaction per length"] == pytest.approx(first.boundaries["per_length_max"].max(), rel=1e-9)


def test_one_varied_number_is_drawn_as_curves_of_the_certified_cases():
    table = pd.DataFrame({"a": [2, 1], "b": [1, 1], "verdict": ["stable", "saddle"], "x.apex": [3.0, 2.0]})
    table["rise"] = table["x.apex"]
    assert draw_sweep(table, ["a", "b"]).shape[2] == 3
    for parameters, verdict in ((["b"], "stable"), (["a"], "saddle")):
        with refused(OptionError, what="plot"):
            draw_sweep(table.assign(verdict=verdict), parameters)


def test_two_varied_numbers_mark_what_is_not_certified_and_what_is_missing(monkeypatch):
    seen = {}
    monkeypatch.setattr("pcmc.plot.heatmap", lambda *table, **rest: seen.update(table=table, **rest))
    rows = {"a": [1, 2, 1], "b": [1, 1, 2], "verdict": ["stable", "degenerate", "neutral"]}
    draw_sweep(pd.DataFrame(rows | {"x.apex": [1.0, 9.0, 2.0], "rise": [1.0, 9.0, 2.0]}), ["a", "b"])
    (rise,) = seen["table"][2].values()
    assert np.array_equal(rise, [[1.0, np.nan], [2.0, np.nan]], equal_nan=True)
    assert next(iter(seen["marks"].values())).tolist() == [[False, True], [False, True]]


@pytest.mark.nightly
def test_a_store_says_how_many_cases_it_keeps(roof, capsys):
    given = ["sweep", "roof.toml", "--workers", "1", "--store", "s", "west.tension=3,3.2"]
    assert cli.main(given) == 0
    assert "are finished" not in capsys.readouterr().out
    assert cli.main([*given[:-1], "west.tension=3,3.2,3.4"]) == 0
    assert "s: 2 cases are finished, 1 to run" in capsys.readouterr().out


def test_a_surface_is_swept_too_by_any_method(roof, capsys):
    run(roof)
    pcmc.write("roof.ply", varied(roof, {})[1])
    given = ["sweep", "roof.ply", "west.tension=3,4", "--workers", "1", "--csv", "t.csv", "--all"]
    assert cli.main([*given, "--method", "lbfgs"]) in (0, 1)
    table = pd.read_csv("t.csv")
    assert set(table["method"]) == {"lbfgs"}
    assert table["message"].str.startswith("lbfgs: ").all()
    assert cli.main(["sweep", "roof.ply", "plan.edge_length=1,2"]) == 2
    assert "unknown number 'plan.edge_length'" in capsys.readouterr().err


@pytest.mark.parametrize(
    "given", [["solve", "roof.toml"], *at_night(["sweep", "roof.toml", "east.tension=3", "--workers", "1"])]
)
def test_options_that_another_method_leaves_out_are_named(roof, capsys, given):
    roof.write_text(TEXT + "order = 2\n", encoding="utf-8")
    left = "roof.toml: method lbfgs solves without the file's options of newton: tolerance = 1e-11, order = 2"
    cli.main([*given, "--method", "lbfgs"])
    assert capsys.readouterr().err.count(left) == 1
    cli.main([*given, "--method", "newton"])
    assert left not in capsys.readouterr().err


def test_an_accuracy_that_is_missed_is_1(roof):
    roof.write_text(TEXT + "accuracy = {height = 1e-9}\nmost_triangles = 9\n", encoding="utf-8")
    assert cli.main(["sweep", "roof.toml", "east.tension=3", "--workers", "1", "--csv", "t.csv"]) == 1
    assert pd.read_csv("t.csv")["accuracy_reached"].tolist() == [False]


@pytest.mark.nightly
def test_a_target_that_is_missed_is_1(roof):
    aim = '[targets]\nmeet = [{quantity = "apex", of = "west", value = 9}]\nvary = ["west"]\n'
    roof.write_text(TEXT + aim, encoding="utf-8")
    assert cli.main(["sweep", "roof.toml", "east.tension=3,3.1", "--csv", "t.csv"]) == 1
    assert not pd.read_csv("t.csv")["targets_met"].any()


@pytest.mark.nightly
def test_a_stopped_sweep_goes_on_where_it_was(roof, capsys):
    grid = {"west.tension": [3, 3.2], "wall 1.tension": [0.5, 0.8]}

    def stop(state):
        raise StopIteration

    short = run_sweep(project_sweep("roof.toml", grid), "s.sqlite", workers=1, on_record=stop)
    assert len(short) == 1
    done = read_store("s.sqlite")[0]
    assert cli.main(["sweep", "./roof.toml", *GRID, "--store", "s.sqlite", "--csv", "t.csv"]) == 0
    records = read_store("s.sqlite")
    assert records[0] == done  # not run again
    assert len(records) == 4
    assert cli.main(["sweep", "roof.toml", *GRID, "--csv", "u.csv"]) == 0
    same(pd.read_csv("t.csv"), pd.read_csv("u.csv"))


def test_the_store_of_another_project_is_refused_and_kept(roof, capsys):
    given = ["sweep", "roof.toml", "west.tension=3", "--store", "s.sqlite", "--workers", "1"]
    assert cli.main(given) == 0
    kept = (roof.parent / "s.sqlite").read_bytes()
    roof.write_text(TEXT.replace("0.8", "0.81"), encoding="utf-8")
    capsys.readouterr()
    assert cli.main(given) == 2
    err = capsys.readouterr().err
    assert "s.sqlite: written for another sweep (its fixed 'project_digest' is " in err
    assert (roof.parent / "s.sqlite").read_bytes() == kept


def test_the_store_of_a_generator_that_has_changed_is_refused(roof, capsys, monkeypatch):
    code = "import generators\ndef hall(alpha):\n    return generators.two_squares({}, alpha_aux=alpha)\n"
    module = roof.with_name("own_hall.py")
    module.write_text(code.format(2))
    monkeypatch.syspath_prepend(roof.parent)
    given = ["sweep", "own_hall:hall", "alpha=1", "--store", "s.sqlite", "--workers", "1"]
    assert cli.main(given) == 0
    module.write_text(code.format(3))
    capsys.readouterr()
    assert cli.main(given) == 2
    assert "s.sqlite: written for another sweep (its fixed 'generator_digest' is " in capsys.readouterr().err


def test_ctrl_c_before_the_first_case_writes_no_table(roof, capsys, monkeypatch):
    monkeypatch.setattr("pcmc.sweep.running._batches", lambda *_: (batch for batch in ()))
    given = ["sweep", "roof.toml", *GRID[:1], "--csv", "t.csv", "--workers", "1"]
    assert cli.main(given) == 130
    assert capsys.readouterr().out == ""
    assert not (roof.parent / "t.csv").exists()


@pytest.mark.nightly
def test_time_limit_and_failed_cases_again(roof, capsys):
    given = ["sweep", "roof.toml", "west.tension=3,3.2", "--store", "s.sqlite", "--workers", "1"]
    assert cli.main([*given, "--time-limit", "0.001"]) == 1
    assert "timed out: stopped at its time limit of 0.001 s" in capsys.readouterr().out
    assert cli.main(given) == 1
    assert cli.main([*given, "--retry-failed"]) == 0


def test_a_table_without_its_library_is_refused_before_any_case(roof, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert cli.main(["sweep", "roof.toml", *GRID[:1], "--csv", "t.parquet", "--store", "s"]) == 2
    assert "pcmc-surfaces[files]" in capsys.readouterr().err
    assert [p.name for p in roof.parent.iterdir()] == ["roof.toml"]


def test_a_project_changed_while_it_is_swept_is_noticed(roof):
    sweep = project_sweep("roof.toml", {"west.tension": [3.0]})
    roof.write_text(TEXT.replace("0.8", "0.81"), encoding="utf-8")
    table = run_sweep(sweep, workers=1)
    assert set(table["status"]) == {"raised"}
    assert table["message"].str.contains("has changed since the sweep was begun").all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["roof.toml", "wst.tension=1,2"], "did you mean 'west.tension'"),
        (["roof.toml", "wst.tension=3"], "did you mean 'west.tension'"),
        (["roof.toml", "west.tension=3,4", "--plot", "t.gif"], "t.gif: the suffix of a picture is"),
        (["roof.toml", "west.tension=3,4", "west.tension=5"], "west.tension is given twice"),
        (["roof.tml", "west.tension=3,4"], "roof.tml: expected a project"),
        (["none.toml", "west.tension=3,4"], "none.toml: cannot be read"),
        (["none.obj", "west.tension=3,4"], "none.obj: cannot be read"),
        (["roof.toml", "west.tension=3,4", "--store", "."], "is a folder"),
        (["roof.toml", "west.tension=3,4", "--time-limit", "inf"], "time_limit (seconds;"),
        (["roof.toml", "west.tension=3,4", "--store", "./t.csv", "--csv", "t.csv"], "name two files"),
        (["roof.toml", "west.tension=3,4", "--store", "no/s"], "there is no folder"),
    ],
)
def test_bad_input_is_2_in_one_line(roof, capsys, arguments, message):
    assert cli.main(["sweep", *arguments]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert message in err
    assert [p.name for p in roof.parent.iterdir()] == ["roof.toml"]


def test_the_table_and_the_picture_of_a_sweep_have_the_units_of_the_project(roof, capsys, monkeypatch):
    seen = {}
    monkeypatch.setattr("pcmc.plot.lines", lambda *curves, **rest: seen.update(rest))
    roof.write_text(f'units = "m"\nforce = "kN"\n{TEXT}', encoding="utf-8")
    given = [
        "sweep",
        "roof.toml",
        "west.tension=3,3.2",
        "--workers",
        "1",
        "--csv",
        "t.csv",
        "--plot",
        "t.png",
    ]
    assert cli.main(given) == 0
    header = capsys.readouterr().out.splitlines()[0]
    for label in ("west.tension [kN/m]", "west.apex [m]", "area [m²]", "reaction per length [kN/m]"):
        assert label in header
    assert (seen["x"], seen["y"]) == ("west.tension [kN/m]", "apex [m]")
    assert next(iter(pd.read_csv("t.csv", index_col="case"))) == "west.tension"
