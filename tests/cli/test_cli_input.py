"""Wrong input is quoted as it was typed, and messages are readable on a poor terminal."""

from __future__ import annotations

import io
import re
import sys

import pytest
from small_project import SMALL

from generators import two_squares
from pcmc import cli, write

REMESH = ["remesh", "roof.toml", "-o", "x.obj", "--edge-length"]
SWEEP = ["sweep", "roof.toml", "roof.tension=2,3"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([*REMESH, "abc"], "'--edge-length': expected a number, found 'abc'"),
        ([*REMESH, "1", "--near-curves", "0,5"], "'--near-curves': expected a number, found '0,5'"),
        ([*REMESH, "1", "--chord="], "'--chord': expected a number, found ''"),
        (["explore", "--port", "80a"], "'--port': expected a whole number, found '80a'"),
        ([*SWEEP, "--workers", "2.5"], "'--workers': expected a whole number, found '2.5'"),
        ([*SWEEP, "--time-limit", "1m"], "'--time-limit': expected a number, found '1m'"),
        (["solve", "roof.toml", "--tension", "=4"], "expected NAME=NUMBER or NUMBER, found '=4'"),
        (["solve", "roof.toml", "--pressure", "nan"], "--pressure: expected NAME=NUMBER"),
        (["solve", "roof.toml", "--units", "km"], "unknown --units 'km'"),
        (["repair", "a.obj", "-o", "b.obj", "--units", "km"], "unknown --units 'km'"),
    ],
)
def test_a_number_that_is_none_is_shown_with_its_option(folder, capsys, arguments, message):
    assert cli.main(arguments) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert message in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["panels", "roof.toml", "--tolerance", "0.1", "--view", "plan"], "--view: is of the picture"),
        (["pattern", "roof.toml", "--width", "2", "--view", "plan"], "--view: is of the picture"),
        ([*SWEEP, "--all"], "--all: is of the table in a file"),
        (["equilibria", "roof.toml", "--axis", "energy"], "--axis: is of the diagram"),
        (["equilibria", "roof.toml", "--starts", "0", "--seed", "4"], "--seed: is of random starts"),
        (["certify", "roof.toml", "--margin", "foo"], "'foo'"),
        (["certify", "roof.toml", "--margin", "pressure", "--margin", "tension of roo"], "'tension of roo'"),
    ],
)
def test_an_option_that_counts_for_nothing_is_refused_before_the_work(
    folder, capsys, monkeypatch, arguments, message
):
    for place in ("project.designing.solve_project", "sweep.run", "equilibria.find_equilibria"):
        monkeypatch.setattr(f"pcmc.{place}", None)
    assert cli.main(arguments) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert message in err


@pytest.mark.parametrize("command", [["certify"], ["convert"], ["explore"]])
def test_a_surface_has_no_start_shape(folder, capsys, command):
    write("roof.pcmc", two_squares())
    files = ["roof.pcmc", *["b.pcmc"] * (command == ["convert"])]
    assert cli.main([*command, *files, "--start"]) == 2
    assert "--start: roof.pcmc is a surface" in capsys.readouterr().err


def test_an_edge_length_that_cannot_be_is_explained_in_one_line(folder, capsys):
    assert cli.main([*REMESH, "1e-9"]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert re.search(r"edge_length = 1e-09 would make about .* triangles, .*; use [\d.]+ or more", err)
    for more in (["--no-solve"], []):
        assert cli.main([*REMESH, "50", *more]) == 0
        assert "the edge length 50 is not reached; the longest edge is " in capsys.readouterr().out
    project = SMALL.split("[output]")[0]
    (folder / "twice.toml").write_text(project + "[remesh]\nedge_length = 50\n", encoding="utf-8")
    assert cli.main(["solve", "twice.toml", "--no-mesh-check"]) == 0
    assert "the edge length 50 is not reached" in capsys.readouterr().out


def test_the_help_named_is_that_of_the_command(folder, capsys):
    assert cli.main(["remesh", "roof.toml", "--edge", "1"]) == 2
    assert "(see pcmc remesh --help)" in capsys.readouterr().err
    assert cli.main(["slove"]) == 2
    assert "(see pcmc --help)" in capsys.readouterr().err


def test_met_targets_are_told_with_the_tensions_that_meet_them(folder, capsys):
    aim = '[targets]\nmeet = [{quantity = "apex", of = "roof", value = 1.0}]\nvary = ["roof"]\n'
    (folder / "high.toml").write_text(SMALL.split("[output]")[0] + aim, encoding="utf-8")
    assert cli.main(["solve", "high.toml"]) == 0
    out = capsys.readouterr().out
    assert "apex of roof 1, with tension of roof 1." in out


def test_a_new_mesh_that_is_not_certified_is_not_written_and_that_is_said(folder, capsys):
    low = SMALL.replace("tension = 2.0", "tension = 0.2")
    (folder / "low.toml").write_text(low, encoding="utf-8")
    assert cli.main(["remesh", "low.toml", "--edge-length", "0.9", "-o", "x.obj"]) == 1
    assert "nothing written (use --no-solve" in capsys.readouterr().out
    assert not (folder / "x.obj").exists()


@pytest.mark.parametrize("errors", ["strict", "surrogateescape"])  # the second in the locale C
def test_letters_that_the_locale_lacks_are_escaped(folder, monkeypatch, errors):
    (folder / "roof.toml").write_text(SMALL.replace("roof =", '"Nordflügel" ='), encoding="utf-8")
    shown = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(shown, encoding="ascii", errors=errors))
    cli.main(["certify", "roof.toml"])
    sys.stdout.flush()
    assert b"Nordfl\\xfcgel" in shown.getvalue()


def test_signs_that_the_locale_lacks_are_written_as_one_types_them(folder, monkeypatch):
    (folder / "roof.toml").write_text('units = "m"\n' + SMALL, encoding="utf-8")
    shown = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(shown, encoding="ascii"))
    assert cli.main(["certify", "roof.toml"]) == 0
    sys.stdout.flush()
    assert b"pressures in force/m^2" in shown.getvalue()
    assert b"\\x" not in shown.getvalue()


def test_without_stderr_it_works_all_the_same(folder, monkeypatch, capsys):
    monkeypatch.setattr(sys, "stderr", None)  # as where the shell closes it: pcmc ... 2>&-
    assert cli.main(["solve", "roof.toml"]) == 0
    assert "stable" in capsys.readouterr().out
    assert cli.main(["solve", "rof.toml"]) == 2
    assert capsys.readouterr().out == ""


def test_without_stdout_it_works_all_the_same(folder, monkeypatch, capsys):
    assert cli.main(["solve", "roof.toml", "--no-mesh-check"]) == 0
    capsys.readouterr()
    monkeypatch.setattr(sys, "stdout", None)  # as where the shell closes it: pcmc ... >&-
    assert cli.main(["certify", "roof.pcmc", "--meshes", "2", "--margin", "snow"]) == 0
    assert cli.main(["solve", "roof.toml"]) == 0
    assert capsys.readouterr().err == ""


def test_names_of_files_that_the_locale_cannot_read_are_printed_as_they_are(folder, monkeypatch):
    shown, name = io.BytesIO(), "rööf.pcmc".encode().decode("ascii", "surrogateescape")  # so in the locale C
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(shown, encoding="ascii", errors="surrogateescape"))
    monkeypatch.setattr("pcmc.project.designing.write_all", lambda *_: [name])
    assert cli.main(["solve", "roof.toml", "--no-mesh-check"]) == 0
    sys.stdout.flush()
    assert "written: rööf.pcmc".encode() in shown.getvalue()
