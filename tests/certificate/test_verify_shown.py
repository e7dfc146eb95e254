"""Where a theorem is shown: command, project, report, and page."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
import shapes
from small_project import WITH_UNITS

import pcmc
from pcmc import Theorem, cli, project, solve
from pcmc.base.units import Units
from pcmc.explore.session import Session, solved_start
from pcmc.report import words

PROVED = "proved: an exact equilibrium of this mesh is within"


@pytest.fixture
def roof(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pcmc.write("roof.pcmc", solve(shapes.cap(3)).surface)
    pcmc.write("start.pcmc", shapes.cap(3).moved(1.01 * shapes.cap(3).vertices))
    return tmp_path


def test_certify_prints_the_theorem_or_why_there_is_none(roof, capsys):
    assert cli.main(["certify", "roof.pcmc", "--verify"]) == 0
    assert PROVED in capsys.readouterr().out
    assert cli.main(["certify", "roof.pcmc"]) == 0
    assert "proved" not in capsys.readouterr().out
    cli.main(["certify", "start.pcmc", "--verify"])
    assert "not proved: it is not at rest" in capsys.readouterr().out
    assert cli.main(["solve", "start.pcmc", "--verify", "--no-mesh-check"]) == 0
    assert PROVED in capsys.readouterr().out


def test_a_project_asks_for_it(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hall.toml").write_text(WITH_UNITS + "[solve]\nverify = true\nmesh_check = false\n")
    assert cli.main(["solve", "hall.toml"]) == 0
    assert PROVED in capsys.readouterr().out
    outcome = project.run("hall.toml")
    assert outcome.theorem.proved
    assert outcome.theorem is replace(outcome, files=()).theorem


def test_a_roof_too_heavy_for_its_span_has_short_words(tmp_path, capsys, monkeypatch):
    """No theorem, no verdict on the whole, no compression of a shape that ran away; a remedy that holds."""
    monkeypatch.chdir(tmp_path)
    text = """[plan]
edge_length = 1.5
outline = [[0, 0], [9, 0], [9, 8], [0, 8]]
mirrors = [[[9, 0], [9, 8]]]
tension = 6.0
weight = 3.0
[solve]
verify = true
mesh_check = false
[output]
files = ["barrel.pcmc"]
whole = true
"""
    Path("barrel.toml").write_text(text)
    assert cli.main(["solve", "barrel.toml"]) == 1
    said = capsys.readouterr().out
    assert said.count("the branch of equilibria folds at") == 1
    assert not any(word in said for word in ("proved:", "compression", "the whole roof"))
    tension = re.search(r"\[plan\] tension = (\S+)", said)[1]
    Path("barrel.toml").write_text(text.replace("tension = 6.0", f"tension = {tension}"))
    assert cli.main(["solve", "barrel.toml"]) == 0
    assert "the whole roof" in capsys.readouterr().out


def test_words_have_units():
    theorem = Theorem(True, radius=1.3e-9, unique_within=2e-4, index=0, gap=0.066)
    assert theorem.brief(Units("m", "kN")) == "proved: index 0, within 1.3e-09 m"
    text = theorem.text(Units("m", "kN"))
    assert "1.3e-09 m of its vertices" in text
    assert "within 0.066 kN/m of zero" in text
    assert str(Theorem(False, "it is not at rest")) == "not proved: it is not at rest"
    assert repr(theorem) == str(theorem)


def test_the_report_has_a_line():
    surface = solve(shapes.cap(3)).surface
    sentences = words.verdict_sentences(pcmc.certify(surface), theorem=pcmc.verify(surface))
    assert any(sentence.startswith("P" + PROVED[1:]) for sentence in sentences)


def test_the_page_asks_for_what_is_shown():
    session = Session(solved_start(shapes.cap(3)))
    assert session.verify().index == 0
