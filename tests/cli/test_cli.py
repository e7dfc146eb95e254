"""The command: what it does, says and returns."""

from __future__ import annotations

from importlib.metadata import version

import numpy as np
import pandas as pd
import pytest
from small_project import SMALL

import pcmc
from generators import two_squares
from pcmc import cli
from pcmc.base.units import NO_UNITS
from pcmc.io import load
from pcmc.project import designing

COMMANDS = [
    "solve",
    "certify",
    "remesh",
    "convert",
    "plot",
    "repair",
    "plan",
    "structure",
    "panels",
    "draw",
    "equilibria",
    "sweep",
    "explore",
    "cache",
]


@pytest.fixture
def solved(folder, capsys):
    assert cli.main(["solve", "roof.toml"]) == 0
    capsys.readouterr()
    return folder


def test_without_a_command_the_help_is_printed(capsys):
    assert cli.main(["--help"]) == 0
    help_page = capsys.readouterr()
    assert cli.main([]) == 2
    assert capsys.readouterr() == help_page
    assert "pcmc solve roof.toml" in help_page.out
    assert not help_page.err


def test_help_shows_every_command(capsys):
    assert cli.main(["--help"]) == 0
    out = capsys.readouterr().out
    assert all(f"  {name} " in out for name in COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_help_shows_an_example(name, capsys):
    assert cli.main([name, "--help"]) == 0
    out = capsys.readouterr().out
    assert f"    pcmc {name} " in out
    assert "\x1b" not in out
    assert "─" not in out


def test_solve_a_project(folder, capsys):
    assert cli.main(["solve", "roof.toml", "--picture", "roof.png"]) == 0
    out, err = capsys.readouterr()
    assert "stable: at rest" in out
    assert "written: roof.pcmc, roof.obj, roof.png" in out
    assert err == ""
    assert sorted(p.name for p in folder.iterdir()) == ["roof.obj", "roof.pcmc", "roof.png", "roof.toml"]


def test_solve_a_surface_with_other_tensions(solved, capsys):
    assert cli.main(["solve", "roof.pcmc", "--tension", "9", "--tension", "roof=3", "-o", "b.pcmc"]) == 0
    low, high = pcmc.read("b.pcmc"), pcmc.read("roof.pcmc")
    assert low.patches[0].tension == 3.0
    assert low.vertices[:, 2].max() < high.vertices[:, 2].max()
    assert cli.main(
        ["solve", "b.pcmc", "--pressure", "roof=1.5", "--method", "lbfgs", "--no-mesh-check"]
    ) in (0, 1)
    assert "lbfgs: " in capsys.readouterr().out


def test_not_certified_is_1_and_writes_nothing_unless_asked(folder, capsys):
    arguments = ["solve", "roof.toml", "--tension", "0.3", "-o", "x.obj"]
    assert cli.main(arguments) == 1
    assert "nothing written" in capsys.readouterr().out
    assert not (folder / "x.obj").exists()
    assert cli.main([*arguments, "--allow-uncertified"]) == 1
    assert (folder / "x.obj").exists()


def test_certify(solved, capsys):
    assert cli.main(["certify", "roof.pcmc"]) == 0
    assert "Morse index" in capsys.readouterr().out
    assert cli.main(["certify", "roof.pcmc", "--tension", "2.5"]) == 1
    assert "not converged" in capsys.readouterr().out


def test_remesh_solves_again(solved, capsys):
    assert cli.main(["remesh", "roof.pcmc", "--edge-length", "0.5", "-o", "fine.pcmc"]) == 0
    assert pcmc.certify(pcmc.read("fine.pcmc")).certified
    assert pcmc.read("fine.pcmc").m > 2 * pcmc.read("roof.pcmc").m
    assert cli.main(["remesh", "roof.pcmc", "--edge-length", "0.5", "--no-solve", "-o", "f.ply"]) == 0
    assert "not solved" in capsys.readouterr().out


def test_remesh_writes_the_whole_roof_that_a_project_asks_for(folder):
    half = SMALL.replace("patches =", "mirrors = [[[4, 0], [4, 3]]]\npatches =") + "whole = true\n"
    (folder / "half.toml").write_text(half)
    for more in ([], ["--no-solve"]):
        assert cli.main(["remesh", "half.toml", "--edge-length", "0.8", "-o", "x.pcmc", *more]) == 0
        assert np.ptp(pcmc.read("x.pcmc").vertices[:, 0]) == pytest.approx(8.0)


def test_the_terminal_says_that_a_roof_is_a_part(folder, capsys):
    (folder / "half.toml").write_text(SMALL.replace("patches =", "mirrors = [[[4, 0], [4, 3]]]\npatches ="))
    assert cli.main(["solve", "half.toml", "--no-mesh-check"]) == 0
    first, *_ = capsys.readouterr().out.splitlines()
    assert "triangles, part of a roof that goes on behind its mirror planes; newton: converged" in first
    model = ["structure", "half.toml", "-o", "half.inp", "--thickness", "0.001", "--young", "1e6"]
    assert cli.main(model) == 0
    assert "part of a roof that goes on behind its mirror planes" in capsys.readouterr().out.splitlines()


def test_convert_and_plot(solved, capsys):
    assert cli.main(["convert", "roof.pcmc", "roof.ply"]) == 0
    assert pcmc.read("roof.ply").m == pcmc.read("roof.pcmc").m
    assert cli.main(["convert", "roof.pcmc", "roof.glb", "--colour", "error"]) == 0
    assert b'"scalar":"error"' in (solved / "roof.glb").read_bytes()
    assert cli.main(["convert", "roof.pcmc", "roof.ifc"]) == 0
    assert "IFCLABEL('stable')" in (solved / "roof.ifc").read_text()
    capsys.readouterr()
    assert cli.main(["convert", "roof.pcmc", "roof.glb", "--colour", "eror"]) == 2
    assert "unknown colour 'eror'; did you mean 'error'?" in capsys.readouterr().err
    for more in (
        ["--colour", "error"],
        ["--view", "30,20", "--color", "curvature"],
        ["--colour", "reactions"],
        [],
    ):
        (solved / "p.png").unlink(missing_ok=True)
        assert cli.main(["plot", "roof.pcmc", "p.png", *more]) == 0
        assert (solved / "p.png").read_bytes().startswith(b"\x89PNG")


def test_tensions_that_cannot_balance_are_told_before_solving(folder, capsys, monkeypatch):
    pcmc.write("two.pcmc", two_squares(4, alpha_aux=1.0))
    said = []
    solve_project = designing.solve_project

    def hear(*given):
        said.append(capsys.readouterr().err)
        return solve_project(*given)

    monkeypatch.setattr(designing, "solve_project", hear)
    assert cli.main(["solve", "two.pcmc", "--tension", "left=4"]) == 1
    assert "note: the tensions at the junction left | right | wall cannot balance: 4 > " in said[0]
    assert "unless the junction rests on the plane; solving anyway" in said[0]
    assert "no equilibrium" in capsys.readouterr().out
    assert cli.main(["solve", "two.pcmc", "--tension", "wall=9"]) == 0  # the wall comes down
    assert said[1] == ""


def test_sweep(folder, capsys):
    given = ["sweep", "generators:two_squares", "alpha_aux=0.5,1", "--workers", "1", "--csv", "t.csv"]
    assert cli.main([*given, "--store", "s.sqlite"]) == 0
    assert pd.read_csv("t.csv")["alpha_aux"].tolist() == [0.5, 1.0]
    assert cli.main([*given, "--store", "s.sqlite"]) == 0  # nothing is left to do
    assert "stable" in capsys.readouterr().out


@pytest.mark.nightly
def test_a_sweep_of_roofs_that_are_not_at_rest_is_1(folder):
    given = ["sweep", "generators:two_squares", "alpha_aux=0.5,1", "--workers", "1"]
    assert cli.main([*given, "--method", "nesterov", "iterations=2"]) == 1


def test_explore_serves_a_file_and_an_example(solved, monkeypatch):
    seen = []
    monkeypatch.setattr("pcmc.cli.files.start", lambda *given, watch: (*given, watch))
    monkeypatch.setattr("pcmc.cli.files.open_and_wait", lambda given, page: seen.append((*given, page)))
    assert cli.main(["explore", "roof.pcmc", "--no-browser"]) == 0
    assert cli.main(["explore", "--example", "two_squares", "--set", "alpha_aux=1", "--port", "8"]) == 0
    assert cli.main(["explore", "roof.pcmc", "--watch"]) == 0
    assert seen[0][1:] == ("127.0.0.1", 0, None, False)
    assert (seen[0][0].title, seen[0][0].outcome.units) == ("roof.pcmc", NO_UNITS)
    assert seen[1][1:] == ("127.0.0.1", 8, None, True)
    assert seen[1][0].name == "two_squares"
    assert seen[1][0].surface.patches
    assert seen[2][3]().surface.m == seen[0][0].surface.m  # reads the file again


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["slove"], "No such command"),
        (["solve"], "Missing argument"),
        (["solve", "none.obj"], "none.obj: cannot be read"),
        (["solve", "none.toml"], "none.toml: cannot be read"),
        (["solve", "roof.toml", "-o", "x.obk"], "did you mean '.obj'"),
        (["solve", "roof"], "known: .toml, .pcmc"),
        (["solve", "."], ".: is no regular file but a folder"),
        (["certify", "roof.txt"], "known: .toml, .pcmc"),
        (["solve", "roof.toml", "-o", "roof.png"], "a picture has its own option"),
        (["solve", "roof.toml", "--picture", "roof.obj"], "roof.obj: the suffix of a picture is .png"),
        (["convert", "roof.toml", "roof.png"], "roof.png: unknown suffix"),
        (["remesh", "roof.toml", "--edge-length", "1", "-o", "x.png"], "x.png: unknown suffix"),
        (["solve", "roof.toml", "--folder", "roof.toml/new"], "roof.toml is a file"),
        (["solve", "roof.toml", "--tension", "1e300"], "use a larger unit of force"),
        (["plot", "roof.toml", "x.png", "--view", "nan,3"], "two angles"),
        (["solve", "roof.toml", "--method", "newtn"], "did you mean 'newton'"),
        (["solve", "roof.toml", "--target", "minimal"], "minimum"),
        (["solve", "roof.toml", "--tension", "rof=1"], "did you mean 'roof'"),
        (["solve", "roof.toml", "--tension", "roof=x"], "--tension: expected NAME=NUMBER"),
        (["remesh", "roof.toml", "--edge-length", "-1", "-o", "x.obj"], "edge_length"),
        (["convert", "roof.toml", "away/x.obj"], "there is no folder away"),
        (["plot", "roof.toml", "x.jpg"], ".png"),
        (["plot", "roof.toml", "x.png", "--colour", "eror"], "did you mean 'error'"),
        (["sweep", "generators:two_squares", "alpha_aux"], "expected NAME=VALUE"),
        (["sweep", "generators:two_squares", "alpha_aux=1,"], "expected NAME=VALUE"),
        (["sweep", "generators:two_square", "alpha_aux=1,2"], "cannot be found"),
        (["sweep", "generators:two_squares", "alpa=1,2"], "unknown parameter"),
        (["sweep", "generators:two_squares", "alpha_aux=1,2", "--csv", "x.txt"], ".csv or .parquet"),
        (["sweep", "generators:two_squares", "alpha_aux=1,2", "--csv", "no/x.csv"], "no folder"),
        (["sweep", "generators:two_squares", "alpha_aux=1,2", "--retry-failed"], "name their --store"),
        (["solve", "roof.toml", "--folder", "roof.toml"], "needs a folder"),
        (["plot", "roof.toml", "away/x.png"], "there is no folder away"),
        (["plot", "roof.toml", "x.png", "--view", "1,2,3"], "unknown view"),
        (["explore"], "give a file or --example"),
        (["explore", "--example", "two_squares", "--watch"], "--watch needs a file"),
        (["explore", "--example", "two_square"], "did you mean 'two_squares'"),
        (["explore", "--example", "no.such:thing"], "--example no.such:thing: No module"),
        (["explore", "--example", "two_squares", "--set", "a=1"], "'a'"),
        (
            ["explore", "--example", "two_squares", "--set", "alpha_aux=1,2"],
            "--set alpha_aux: give one value",
        ),
        (["explore", "roof.toml", "--set", "alpha_aux=1"], "--set needs an --example"),
        (["explore", "--example", "two_squares", "--start"], "--start needs a file"),
        (["solve", "roof.toml", "--tension", "roof=1", "--tension", "roof=2"], "roof is given twice"),
        (["solve", "roof.toml", "--tension", "1", "--tension", "2"], "a bare value is given twice"),
        (["report", "roof.toml", "-o", "a.pdf", "--output=b.pdf"], "--output is given twice; keep one"),
        (["certify", "roof.toml", "--cache", "--no-cache"], "--cache is given twice; keep one"),
        (["solve", "roof.toml", "--accuracy", "height=1", "--accuracy", "height=2"], "height is given twice"),
        (["solve", "roof.toml", "--accuracy-of", "limit"], "accuracy_of: counts only with an accuracy"),
        (["solve", "roof.toml", "--most-triangles", "9"], "most_triangles: counts only with an accuracy"),
        (
            ["solve", "roof.toml", "--folder", "new", "-o", "x.obj"],
            "--folder: roof.toml writes nothing there",
        ),
        (["panels", "roof.toml", "--tolerance", "1", "--cost", "1,2"], "give --change, too"),
        (["panels", "roof.toml", "--tolerance", "1", "--change", "1", "--cost", "nan,2"], "--cost: expected"),
        (["panels", "roof.toml", "--pattern", "quads", "--size", "1", "--sheet", "B3"], "unknown sheet"),
        (["pattern", "roof.toml", "--width", "1", "-o", "cloth.pdf", "--sheet", "B3"], "unknown sheet"),
        (
            ["panels", "roof.toml", "--pattern", "planar-quads", "--size", "1", "--direction", "3"],
            "direction: is of a grid in plan",
        ),
    ],
)
def test_bad_input_is_2_in_one_line(folder, capsys, arguments, message):
    assert cli.main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("pcmc: error: ")
    assert err.count("\n") == 1
    assert message in err
    assert [p.name for p in folder.iterdir()] == ["roof.toml"]


def test_what_counts_with_a_plan_alone_is_refused_for_a_mesh(solved, capsys):
    assert cli.main(["solve", "roof.pcmc", "--span-ratio", "4"]) == 2
    assert "--span-ratio: is for a plan, and here is a mesh; give --rise or --apex" in capsys.readouterr().err


def test_a_named_value_counts_whether_the_bare_one_comes_before_or_after(folder):
    pcmc.write("two.pcmc", two_squares(2, alpha_aux=1.0))
    for k, given in enumerate((["left=9", "8"], ["8", "left=9"])):
        tensions = [word for value in given for word in ("--tension", value)]
        assert cli.main(["convert", "two.pcmc", f"{k}.pcmc", *tensions]) == 0
        found = {patch.name: patch.tension for patch in pcmc.read(f"{k}.pcmc").patches}
        assert (found["left"], found["right"]) == (9.0, 8.0)


def test_what_a_project_asks_for_is_told_by_certify_and_remesh_too(folder, capsys):
    asked = 'margin = ["snow"]\nverify = true\nmesh_check = true\n'
    (folder / "roof.toml").write_text(SMALL.replace("[solve]\n", f"[solve]\n{asked}"))
    for command in (["certify", "roof.toml"], ["remesh", "roof.toml", "--edge-length", "0.8", "-o", "x.ply"]):
        assert cli.main(command) == 0
        out = capsys.readouterr().out
        assert all(text in out for text in ("margin: ", "proved: ", "finer meshes have the same surface"))


def test_a_mesh_check_of_what_is_not_at_rest_is_left_out_with_a_word(folder, capsys):
    for command in (
        ["certify", "roof.toml", "--start", "--meshes", "2"],
        ["solve", "roof.toml", "--mesh-check"],
    ):
        tension = ["--tension", "0.3"]  # less than any roof needs
        assert cli.main([*command, *tension]) == 1
        assert "no mesh check: the surface is not at rest" in capsys.readouterr().out


def test_the_version(capsys):
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out == f"pcmc {version('pcmc-surfaces')}\n"


@pytest.mark.nightly
def test_why_cases_of_a_sweep_failed_is_said_once(folder, capsys):
    given = ["sweep", "generators:two_squares", "alpha_aux=1,a,b", "n=2", "--workers", "1"]
    assert cli.main(given) == 1
    out = capsys.readouterr().out
    assert out.count("raised") == 4
    assert "\ncase 1: raised: " in out
    assert "'a'" in out.split("case 1: ")[1]


def test_notes_are_one_line(solved, capsys):
    (solved / "q.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n", encoding="utf-8")
    assert cli.main(["convert", "q.obj", "q.ply"]) == 0
    err = capsys.readouterr().err
    assert err.startswith("pcmc: note: q.obj: ")
    assert err.count("\n") == 1


def test_what_a_file_says_of_its_surface_is_carried_over(solved, capsys):
    before = load("roof.pcmc")
    assert set(before.scalars) == {"mean curvature", "error", "reaction"}
    assert cli.main(["convert", "roof.pcmc", "b.pcmc"]) == 0
    after = load("b.pcmc")
    for name, values in before.scalars.items():
        np.testing.assert_array_equal(after.scalars[name], values)
    assert after.certificate["verdict"] == "stable"
    capsys.readouterr()
    assert cli.main(["convert", "roof.pcmc", "b.vtp"]) == 0
    assert "cannot carry certificate" in capsys.readouterr().err
    assert set(load("b.vtp").scalars) == set(before.scalars)
    assert cli.main(["convert", "roof.pcmc", "c.pcmc", "--tension", "3"]) == 0
    assert not load("c.pcmc").scalars  # they are those of other tensions
