"""Cases and combinations of a project: the command, its tables, the report, and mistakes."""

import re

import pytest
from printed import words_of
from programs import needs_ccx
from starts import spherical_cap
from structures import model_of, pyramid
from under_load import ALPHA

import pcmc
from pcmc import cli
from pcmc.structure import analyse, calculix

PROJECT = """
units = "m"
force = "kN"
[plan]
edge_length = 1.0
outline = [[0, 0], [4, 0], [4, 3], [0, 3]]
patches = {roof = {tension = 4.0}}
[structure]
young = 1e5
thickness = 0.001
snow = 0.3
combinations = {uls = {snow = 1.5, windy = 0.9}}
[[structure.zones]]
case = "windy"
wind = 0.5
area = [[0, 0], [2, 0], [2, 3], [0, 3]]
"""


@needs_ccx
def test_the_command_runs_the_cases_and_writes_tables(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "roof.toml").write_text(PROJECT)
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp", "--run"]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"uls +100 %", printed)
    names = {path.name for path in tmp_path.iterdir()}
    assert names >= {"roof.inp", "roof-cases.csv", "roof-patches.csv", "roof-supports.csv", "roof-cases.png"}
    assert "roof-cables.csv" not in names
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp", "--run", "--snow", "9.0"]) == 0
    assert "snow: it hangs up to" in capsys.readouterr().out


@needs_ccx
@pytest.mark.nightly
def test_the_command_ends_with_1_for_a_case_that_is_not_carried(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    pcmc.write("cap.pcmc", pcmc.solve(spherical_cap(0.2, alpha=ALPHA)).surface)
    given = ["--young", "1e4", "--thickness", "0.001", "--snow", "2.0"]
    assert cli.main(["structure", "cap.pcmc", "-o", "cap.inp", "--run", *given]) == 1
    assert "tried: with" in capsys.readouterr().out


@needs_ccx
def test_cases_are_run_without_a_file_and_one_that_is_not_carried_ends_with_1(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    pcmc.write("cap.pcmc", pcmc.solve(spherical_cap(0.3, alpha=ALPHA)).surface)
    text = 'mesh = "cap.pcmc"\n[structure]\nyoung = 1e4\nthickness = 0.001\nsnow = 2.0\nrun = true\n'
    (tmp_path / "cap.toml").write_text(text)
    assert cli.main(["solve", "cap.toml", "--no-mesh-check"]) == 1
    assert "tried: with" in capsys.readouterr().out


@needs_ccx
def test_a_project_has_the_cases_in_its_report(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    output = '[output]\nstructure = "roof.inp"\nreport = "roof.pdf"\n'
    (tmp_path / "roof.toml").write_text(PROJECT.replace("snow = 0.3", "snow = 0.3\nrun = true") + output)
    outcome = pcmc.project.run("roof.toml")
    assert {"roof-cases.csv", "roof-cases.png"} <= {path.name for path in outcome.files}
    assert outcome.analysis()["uls"].carried
    assert "Under load" in "".join(words_of(tmp_path / "roof.pdf"))


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("windy = 0.9", "windi = 0.9"),
        ("young = 1e5\n", ""),
        ("wind = 0.5", "wind = 0.5\nsnow = 0.1"),
        ("snow = 0.3", "snow = 0.3\ngas = {ambiance = 1.0}"),
        ("snow = 0.3", "snow = 0.3\npatches = {rof = {young = 1.0}}"),
        ("snow = 0.3", 'snow = 0.3\nrun = "yes"'),
    ],
)
def test_a_project_with_a_mistake_is_refused_in_one_line(before, after, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert before in PROJECT
    (tmp_path / "roof.toml").write_text(PROJECT.replace(before, after))
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_without_the_program_one_line_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(calculix, "PROGRAM", "no-such-program")
    monkeypatch.setattr("pcmc.project.designed", None)  # it is refused before solving
    (tmp_path / "roof.toml").write_text(PROJECT)
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp", "--run"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "apt install calculix-ccx" in error
    with pytest.raises(calculix.CalculixError, match="calculix-ccx"):
        analyse(model_of(pyramid()))
