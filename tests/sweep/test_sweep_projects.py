"""Sweeps over a project file, or a surface, with some of its numbers replaced."""

from __future__ import annotations

import pydoc
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from refusals import refused
from tables import same

import pcmc
from generators import two_squares
from pcmc import cli
from pcmc.base.errors import FileError, OptionError, PcmcError
from pcmc.project import check_varied, designed, digest, run, varied
from pcmc.sweep import draw_sweep, read_store
from pcmc.sweep import run as run_sweep
from pcmc.sweep.projects import column_labels, project_sweep, solve_project

NUMBERS = ["west.apex", "east.apex", "rise", "area", "reaction per length"]
TEXT = """
[plan]
edge_length = 1.5                 # coarse: these are tests
outline = [[0, 0], [6, 0], [6, 4], [0, 4]]
dividers = [{curve = [[3, 0], [3, 4]], wall = 0.8, bottom = "held"}]
holes = [{name = "yard", curve = {circle = {centre = [1.5, 2], radius = 0.4}}}]

[plan.patches]
west = {tension = 3.0, at = [0.5, 0.5]}
east = {tension = 3.0, at = [5, 2]}

[solve]
tolerance = 1e-11
"""


@pytest.fixture
def roof(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "roof.toml").write_text(TEXT, encoding="utf-8")
    return tmp_path / "roof.toml"


# ---- a project with other numbers


def test_numbers_of_the_file_and_of_patches_are_replaced(roof):
    plain, start = varied(roof, {})
    values = {
        "plan.edge_length": 2.0,
        "plan.outline.2.1": 7,
        "plan.holes.yard.curve.circle.radius": 0.5,
        "solve.tolerance": 1e-8,
        "west.tension": 4.0,
        "wall 1.tension": 0.1,
        "east.pressure": 1.25,
    }
    project, surface = varied(roof, values)
    assert (project.plan.edge_length, project.options) == (2.0, {"tolerance": 1e-8})
    assert surface.vertices[:, 0].max() == 7.0
    hole = np.linalg.norm(surface.vertices[:, :2] - [1.5, 2.0], axis=1).min()
    assert hole == pytest.approx(0.5)
    assert surface.m < start.m
    told = {p.name: (p.tension, p.pressure) for p in surface.patches}
    assert told == {"west": (4.0, 1.0), "east": (3.0, 1.25), "wall 1": (0.1, -0.25)}
    again, same_start = varied(roof, {})
    assert again.plan.edge_length == plain.plan.edge_length == 1.5
    assert pcmc.energy(same_start) == pcmc.energy(start)


DRAWN = """
[plan]
edge_length = 1.5
tension = 4.0
outline = [[0, 0], [9, 0], [9, 6], [0, 6]]
dividers = [[[3, -1], [3, 7]], {name = "eye", curve = {arc = [[6, -1], [7, 3], [6, 7]]}}]
holes = [{name = "eye", curve = {circle = {centre = [1.5, 3], radius = 0.5}}}]
supports = [[8, 3, 2]]
points = {crown = [4.5, 3]}
"""


def test_lines_and_points_are_shifted_as_they_are(roof):
    roof.write_text(DRAWN, encoding="utf-8")
    aims = '[targets]\nmeet = [{quantity = "height", of = "crown", value = 1}]\nvary = ["patch 2"]\n'

    plain = varied(roof, {})[0].plan
    shifts = {
        "wall 1.x": 0.5,
        "divider eye.x": -0.25,
        "hole eye.y": 1.0,
        "hole eye.z": 0.75,
        "support 1.z": 1.0,
    }
    roof.write_text(DRAWN + aims, encoding="utf-8")
    project, surface = varied(roof, shifts | {"crown.x": 0.25, "crown.y": -1.0})
    moved = project.plan
    t = np.array([0.0, 0.5, 1.0])
    for before, after, by in (
        (plain.dividers[0].curve, moved.dividers[0].curve, [0.5, 0.0]),
        (plain.dividers[1].curve, moved.dividers[1].curve, [-0.25, 0.0]),
    ):
        np.testing.assert_array_equal(after.at(t), before.at(t) + by)
    assert moved.holes[0].curve.at(0.0).tolist() == [[2.0, 4.0, 0.75]]
    assert moved.supports[0].tolist() == [8.0, 3.0, 3.0]
    assert moved.points == {"crown": (4.75, 2.0)}
    assert project.targets[0].of == (4.75, 2.0)  # the target goes with its point
    assert surface.vertices[surface.fixed, 2].max() == 3.0
    same = varied(roof, dict.fromkeys(shifts, 0.0))[1]
    np.testing.assert_array_equal(same.vertices, varied(roof, {})[1].vertices)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("eye.x", "several lines; type divider eye.x or hole eye.x"),
        ("wal 1.x", "unknown number 'wal 1.x'; did you mean 'divider wall 1.x'"),
        ("wall 1.z", "only its place in plan counts"),
        ("crown.z", "only its place in plan counts"),
    ],
)
def test_a_shift_that_cannot_be_is_refused(roof, name, message):
    roof.write_text(DRAWN, encoding="utf-8")
    with pytest.raises(PcmcError, match=message) as caught:
        project_sweep(roof, {name: [0.0, 0.5]})
    assert str(caught.value).startswith(f"{roof}: ")


def test_the_file_is_read_once_and_meshed_for_names_alone(roof, monkeypatch):
    counts = {"read": 0, "meshed": 0}
    for place, name in (("tomllib.loads", "read"), ("pcmc.plan.Plan.surface", "meshed")):
        original = pydoc.locate(place)

        def counted(*given, original=original, name=name, **rest):
            counts[name] += 1
            return original(*given, **rest)

        monkeypatch.setattr(place, counted)
    check_varied(roof, {"plan.edge_length": [1.0, 2.0], "wall 1.x": [0.0, 0.1], "plan.snow": [0.0, 0.1]})
    assert counts == {"read": 1, "meshed": 0}
    check_varied(roof, {"west.tension": [1.0, 2.0, 3.0], "wall 1.tension": [0.5, 1.0]})
    assert counts == {"read": 2, "meshed": 1}
    varied(roof, {"west.tension": 3.0, "plan.edge_length": 1.2})
    assert counts == {"read": 3, "meshed": 2}


def test_numbers_that_the_file_leaves_out_vary_too(roof):
    values = {"plan.rise": 0.7, "plan.patches.west.snow": 0.2, "plan.dividers.1.cable": 2.0}
    project = varied(roof, values | {"solve.iterations": 7})[0]
    plan = project.plan
    assert (plan.rise, plan.patches[0].snow, plan.dividers[0].cable) == (0.7, 0.2, 2.0)
    assert project.options["iterations"] == 7


def test_a_case_is_what_the_project_with_these_numbers_gives(roof):
    case = solve_project("roof.toml", digest(roof), **{"west.tension": 3.2, "wall 1.tension": 0.5})
    text = TEXT.replace("west = {tension = 3.0", "west = {tension = 3.2").replace("0.8", "0.5")
    roof.write_text(text, encoding="utf-8")
    alone = run(roof)
    assert case["verdict"] == "stable"
    assert case["energy"] == pytest.approx(pcmc.energy(alone.surface), rel=1e-12)
    assert case["west.tension_reached"] == 3.2


HALF = """
[plan]
edge_length = 1.5
tension = 4.0
outline = [[0, 0], [6, 0], [6, 4], [0, 4]]
mirrors = [[[6, 0], [6, 4]]]
"""


@pytest.mark.parametrize(
    ("output", "extent"), [("[output]\nwhole = true\n", "whole"), ("", "part between mirrors")]
)
def test_a_case_has_the_figures_of_the_roof_that_the_project_shows(roof, output, extent):
    roof.write_text(HALF + output, encoding="utf-8")
    case = solve_project("roof.toml", digest(roof))
    outcome = designed(roof, use_cache=False)
    assert case["extent"] == extent
    for figure in outcome.figures:
        name = f"{figure.of}.{figure.quantity}" if figure.of else figure.quantity
        assert case[name] == pytest.approx(figure.value, rel=1e-9), name
    assert (case["area"] > 40.0) == bool(output)
    assert case["volume"] == pytest.approx(outcome.shown.certificate.volume, rel=1e-9)


def test_cells_are_empty_where_nothing_is_at_rest(roof, capsys):
    given = ["sweep", "roof.toml", "east.tension=0.2,3", "--csv", "t.csv", "--workers", "1"]
    assert cli.main([*given, "--all"]) == 1
    shown = capsys.readouterr().out.splitlines()
    assert "NaN" not in "".join(shown)
    table = pd.read_csv("t.csv", index_col="case")
    assert table["verdict"].eq("stable").tolist() == [False, True]
    numbers = table.select_dtypes("number")
    kept = {"triangles", "iterations_taken", "evaluations_made", "gradient_squared", "residual", "load_ratio"}
    assert set(numbers.columns[numbers.loc[0].notna()]) == kept | {"east.tension"}
    assert table.loc[1, NUMBERS].notna().all()


def test_any_quantity_is_shown_and_drawn(roof, capsys, monkeypatch):
    drawn = {}
    monkeypatch.setattr("pcmc.plot.lines", lambda curves, path, **rest: drawn.update(rest, curves=curves))
    roof.write_text(f'units = "m"\nforce = "kN"\n{TEXT}', encoding="utf-8")
    given = ["sweep", "roof.toml", "wall 1.x=0,0.5", "--workers", "1", "--csv", "t.csv", "--plot", "t.png"]
    assert cli.main([*given, "--show", "volume", "--show", "west.area", "--show", "sag"]) == 0
    shown = capsys.readouterr().out.splitlines()
    for label in ("wall 1.x [m]", "west.volume [m³]", "volume [m³]", "west.area [m²]"):
        assert label in shown[0]
    assert "rise" not in shown[0]
    assert shown[-1] == "no case has sag"
    table = pd.read_csv("t.csv", index_col="case")
    assert list(table) == [
        "wall 1.x",
        "status",
        "verdict",
        "west.volume",
        "east.volume",
        "volume",
        "west.area",
    ]
    assert table["west.volume"].diff()[1] > 0.2  # the wall has moved to the east
    assert (drawn["y"], set(drawn["curves"])) == ("volume [m³]", {"west", "east", "roof"})
    assert cli.main([*given, "--show", "west.volum"]) == 2
    assert "did you mean 'volume'" in capsys.readouterr().err


def test_targets_and_remeshing_are_the_projects(roof):
    aim = '[targets]\nmeet = [{quantity = "apex", of = "west", value = 0.3}]\nvary = ["west"]\n'
    roof.write_text(TEXT + aim + "[remesh]\nedge_length = 0.9\n", encoding="utf-8")
    case = solve_project("roof.toml", digest(roof), **{"east.tension": 3.1})
    assert case["targets_met"] is True
    assert case["triangles"] > 1.5 * varied(roof, {})[1].m


def test_the_digest_is_of_what_the_file_says(roof, tmp_path):
    first = digest(roof)
    roof.write_bytes(TEXT.replace("\n", "\r\n").encode())  # as an editor on Windows leaves it
    assert digest(roof) == first
    roof.write_text(TEXT.replace("0.8", "0.81"), encoding="utf-8")
    assert digest(roof) != first
    surface = two_squares(2)
    pcmc.write(tmp_path / "a.pcmc", surface)
    pcmc.write(tmp_path / "b.pcmc", surface.retensioned({"left": 9.0}))
    pcmc.write(tmp_path / "c.pcmc", surface.moved(surface.vertices * (1.0 + 1e-15)))
    wall = [replace(patch, wall=True) for patch in surface.patches]
    pcmc.write(tmp_path / "d.pcmc", surface.rebuilt(patches=wall))
    assert len({digest(tmp_path / f"{name}.pcmc") for name in "abcd"}) == 4


BAD = [
    ("wst.tension", 2.0, "unknown number 'wst.tension'; did you mean 'west.tension'"),
    ("west.tensoin", 2.0, "did you mean 'west.tension'"),
    ("plan.edge_lenght", 2.0, "did you mean 'plan.edge_length'"),
    ("plan.outlin.2.1", 2.0, "did you mean 'plan.outline.2.1'"),
    ("plan.holes.1.curve.circle.radius", 2.0, "did you mean 'plan.holes.yard.curve"),
    ("plan.outline.5.1", 2.0, "unknown number"),
    ("plan.edge", 2.0, "unknown number"),
    ("plan.edge_length", -1, "edge_length: expected a finite number > 0, found -1"),
    ("plan.edge_length", "x", "must be a finite number, found 'x'"),
    ("plan.edge_length", True, "must be a finite number, found True"),
    ("west.tension", float("nan"), "west.tension must be a finite number, found nan"),
    ("west.tension", -2.0, "tension of 'west': expected a finite number ≥ 0"),
    ("solve.tolerance", -1.0, "tolerance"),
]


@pytest.mark.parametrize(("name", "value", "message"), BAD, ids=[f"{n}={v}" for n, v, _ in BAD])
def test_bad_names_and_values_are_refused_before_any_case(roof, name, value, message):
    good = {"east.tension": [3.0, 4.0]}
    with pytest.raises(PcmcError, match=message) as caught:
        project_sweep(roof, good, {name: value})
    assert str(caught.value).startswith(f"{roof}: ")
    with pytest.raises(PcmcError, match=message):
        project_sweep(roof, good | {name: [value, 1.0]})


def test_a_name_that_is_none_is_refused_by_a_case_too(roof):
    with pytest.raises(OptionError, match=r"unknown number 'edge'"):
        varied(roof, {"edge": 1.0})
    with pytest.raises(OptionError, match=r"unknown number 'wst.tension'; did you mean 'west.tension'"):
        varied(roof, {"wst.tension": 1.0})


def test_bad_methods_and_projects_are_refused(roof):
    with pytest.raises(OptionError, match="did you mean 'newton'"):
        project_sweep(roof, {"west.tension": [3.0, 4.0]}, method="newtn")
    with pytest.raises(FileError, match=r"none\.toml: cannot be read"):
        project_sweep("none.toml", {"west.tension": [3.0, 4.0]})


# ---- the command


GRID = ["west.tension=3,3.2", "wall 1.tension=0.5,0.8"]


def test_the_command_makes_a_table(roof, capsys):
    given = ["sweep", "roof.toml", *GRID, "east.tension=3.1", "--csv", "t.csv"]
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
    assert sorted(p.name for p in roof.parent.iterdir()) == ["roof.toml", "t.csv", "t.png"]
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
    given = ["sweep", "roof.toml", *GRID[:1], "--store", "s.sqlite", "--workers", "1"]
    assert cli.main(given) == 0
    kept = (roof.parent / "s.sqlite").read_bytes()
    roof.write_text(TEXT.replace("0.8", "0.81"), encoding="utf-8")
    capsys.readouterr()
    assert cli.main(given) == 2
    err = capsys.readouterr().err
    assert "s.sqlite: written for another sweep (its fixed 'project_digest' is " in err
    assert (roof.parent / "s.sqlite").read_bytes() == kept


def test_ctrl_c_before_the_first_case_writes_no_table(roof, capsys, monkeypatch):
    monkeypatch.setattr("pcmc.sweep.running._batches", lambda *_: iter(()))
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
    monkeypatch.setattr("pcmc.cli.sweeping.find_spec", lambda name: None)
    assert cli.main(["sweep", "roof.toml", *GRID[:1], "--csv", "t.parquet", "--store", "s"]) == 2
    assert "pcmc-surfaces[files]" in capsys.readouterr().err
    assert [p.name for p in roof.parent.iterdir()] == ["roof.toml"]


def test_a_project_changed_while_it_is_swept_is_noticed(roof):
    sweep = project_sweep("roof.toml", {"west.tension": [3.0, 3.2]})
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


AIMED = """
[targets]
meet = [{quantity = "apex", of = "west", value = 1.0}]
vary = ["west"]
"""


@pytest.mark.parametrize("name", ["west.tension", "plan.patches.west.tension"])
def test_a_number_that_the_targets_find_is_not_swept(roof, name):
    roof.write_text(TEXT + AIMED, encoding="utf-8")
    with refused(OptionError, what=name, where="tension of west"):
        project_sweep("roof.toml", {name: [3, 4]})
    assert len(project_sweep("roof.toml", {"east.tension": [3, 4]})) == 2
    plain = TEXT.split("[plan.patches]")[0].replace("[plan]", "[plan]\ntension = 3.0")
    roof.write_text(plain + AIMED.replace("west", "patch 1"), encoding="utf-8")
    with refused(OptionError, what="plan.tension"):
        project_sweep("roof.toml", {"plan.tension": [3, 4]})


def test_a_tension_that_the_rise_of_a_mesh_finds_is_not_swept(roof):
    pcmc.write("roof.obj", varied(roof, {})[1])
    text = '[mesh]\nfile = "roof.obj"\nrise = 1.0\n[mesh.patches.east]\nweight = 0.1\n'
    roof.write_text(text, encoding="utf-8")
    for name in ("west.tension", "mesh.tension", "mesh.patches.east.tension"):
        with pytest.raises(PcmcError, match="is found by the search"):
            project_sweep("roof.toml", {name: [3, 4]})
    others = {"mesh.patches.east.weight": [0.1, 0.2], "mesh.rise": [1.0, 1.1]}
    assert len(project_sweep("roof.toml", others)) == 4


def test_the_tension_of_a_cable_is_a_force_also_where_nothing_is_at_rest(roof):
    text = 'units = "m"\nforce = "kN"\n[plan]\nedge = "cable"\ncable = 9.0\ntension = 1.0\npressure = 0.0\n'
    text += "outline = [[0, 0], [9, 0], [9, 9], [0, 9]]\nsupports = [[0, 0], [9, 0], [9, 9], [0, 9]]\n"
    text += 'cables = [{name = "hem", tension = 4.0, curve = [[0, 0], [9, 0]]}]\n'
    roof.write_text(text, encoding="utf-8")
    names = ["cable 1.tension", "hem.tension", "plan.cables.hem.tension", "plan.cable", "patch 1.tension"]
    labels = column_labels(roof, [*names, "support 1.z", "verdict"])
    assert [label.rpartition(" ")[2] for label in labels.values()] == [*["[kN]"] * 4, "[kN/m]", "[m]"]


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
