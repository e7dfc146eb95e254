"""The README is true: its code runs, its commands are CI's, its tables are the results'."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest
from nightly import at_night

from pcmc import cli
from pcmc.project import build, run
from studies.folder import Folder
from studies.readme import of_the_paper, summary, up_to_date
from studies.report import report

HOME = Path(__file__).resolve().parents[2]
README = (HOME / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
COMMANDS = (
    'python -m pip install -c constraints.txt -e ".[all]" && python -m studies reproduce',
    'python -m pip install -c constraints.txt -e ".[all]" && python -m pytest',
)


@pytest.mark.parametrize("code", BLOCKS, ids=lambda code: code.splitlines()[0])
def test_code_runs_and_converges(code, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {"__name__": "readme"})
    assert "newton: converged" in capsys.readouterr().out


def test_there_is_code_to_run():
    assert len(BLOCKS) >= 2


@pytest.mark.parametrize("command", COMMANDS, ids=["reproduce", "pytest"])
def test_commands_are_the_readmes_and_the_continuous_integrations(command):
    assert f"```sh\n{command}\n```" in README
    assert command in (HOME / ".ci" / "run").read_text(encoding="utf-8")


@pytest.mark.parametrize("leave_out", [" --margin pressure", *at_night("")])
def test_commands_of_the_table_run_in_order(leave_out, tmp_path, monkeypatch, capsys):
    shutil.copy(HOME / "notebooks" / "roof.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PCMC_CACHE", str(tmp_path / "cache"))
    lines = re.findall(r"^\| `pcmc ([^`]+)` \|", README, re.MULTILINE)
    assert [line.split()[0] for line in lines] == [
        "solve",
        "certify",
        "remesh",
        "convert",
        "plot",
        "sweep",
        "panels",
        "draw",
        "structure",
        "report",
        "explore",
    ]
    for line in lines[:-1]:
        assert cli.main(shlex.split(line.replace(leave_out, ""))) == 0, capsys.readouterr().err
    files = ["roof.pcmc", "fine.pcmc", "roof.3dm", "error.png", "walls.csv"]
    for name in (*files, "panels.csv", "sheets.dxf", "roof.inp", "report.pdf"):
        assert (tmp_path / name).stat().st_size > 0


def test_the_sections_added_to_the_project_give_what_they_say(tmp_path):
    added = re.search(r"```toml\n(.*?)```", README, re.DOTALL)[1]
    roof = (HOME / "notebooks" / "roof.toml").read_text(encoding="utf-8")
    (tmp_path / "roof.toml").write_text(roof + added, encoding="utf-8")
    plain, outcome = build(tmp_path / "roof.toml"), run(tmp_path / "roof.toml")
    surface = outcome.surface
    assert outcome.good
    assert surface.m > 2 * plain.m
    corner = surface.faces[surface.patch_of_face == surface.patch_index("corner")]
    assert surface.vertices[corner, 2].max() == pytest.approx(2.5, abs=1e-6)


def test_summary_and_report_are_up_to_date_with_the_results():
    assert up_to_date(README, HOME / "results") == README, "run: python -m studies readme"
    written = (HOME / "results" / "REPORT.md").read_text(encoding="utf-8")
    assert report(HOME / "results") == written, "run: python -m studies readme"


def test_the_summary_has_five_rows_and_hides_no_number_that_differs():
    comparison = Folder(HOME / "results").read_table("comparison")
    shown = summary(comparison)
    assert len(shown) == 5
    own = of_the_paper(comparison, "number")
    assert set(own[own.verdict == "differs"].what) <= set(shown.what)


def test_it_is_short():
    assert len(README.splitlines()) < 160


def test_every_picture_and_folder_named_is_there():
    pictures = re.findall(r"!\[[^]]*\]\(([^)]+)\)", README)
    links = re.findall(r"[^!]\[[^]]*\]\(([^)#]+)\)", README)
    assert {link for link in links if link.endswith(".ipynb")} == {
        f"notebooks/{path.name}" for path in (HOME / "notebooks").glob("*.ipynb")
    }
    pictures += [link for link in links if not link.startswith("http") and link]
    folders = re.findall(r"`(\w+/)`", README)
    assert "results/equilibria/shapes.png" in pictures
    assert {"pcmc/", "generators/", "studies/", "results/"} == set(folders)
    for name in pictures + folders:
        assert (HOME / name).exists(), name
