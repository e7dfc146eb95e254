"""The README is true: its code runs, its commands are CI's, its tables are the results'."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from nightly import at_night

import pcmc
from pcmc import cli
from pcmc.project import run
from studies.readme import up_to_date
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


@pytest.mark.parametrize("command", COMMANDS, ids=["reproduce", "pytest"])
def test_commands_are_the_readmes_and_the_continuous_integrations(command):
    assert f"```sh\n{command}\n```" in README
    script = (HOME / ".ci" / "run").read_text(encoding="utf-8")
    assert [part for part in command.split(" && ") if part not in script] == []


@pytest.mark.parametrize("leave_out", [" --margin pressure", *at_night("")])
def test_commands_of_the_table_run_in_order_on_the_project_above(leave_out, tmp_path, monkeypatch, capsys):
    project = re.search(r"```toml\n(.*?)```", README, re.DOTALL)[1]
    (tmp_path / "roof.toml").write_text(project, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PCMC_CACHE", str(tmp_path / "cache"))
    lines = re.findall(r"^\| `pcmc ([^`]+)` \|", README, re.MULTILINE)
    words = "solve certify remesh convert plot sweep panels draw structure report explore"
    assert [line.split()[0] for line in lines] == words.split(" ")
    for line in lines[:-1]:
        given = shlex.split(line.replace(leave_out, ""))
        given += ["--workers", "1"] * (leave_out != "" and given[0] == "sweep")  # one process, not two
        assert cli.main(given) == 0, capsys.readouterr().err
    files = ["roof.pcmc", "fine.pcmc", "roof.3dm", "error.png", "walls.csv"]
    for name in (*files, "panels.csv", "sheets.dxf", "roof.inp", "report.pdf"):
        assert (tmp_path / name).stat().st_size > 0


def test_the_first_roof_and_the_project_persist(tmp_path):
    """No roof is called stable here that only its mesh holds."""
    names = {}
    exec(compile(BLOCKS[0], "README.md", "exec"), names)
    assert pcmc.check_mesh(names["roof"]).verdict is pcmc.MeshVerdict.PERSISTS
    project = re.search(r"```toml\n(.*?)```", README, re.DOTALL)[1]
    (tmp_path / "roof.toml").write_text(project, encoding="utf-8")
    outcome = run(tmp_path / "roof.toml")
    assert outcome.good
    assert pcmc.check_mesh(outcome.surface).verdict is pcmc.MeshVerdict.PERSISTS


def test_the_python_is_six_lines_without_the_checkouts_folders():
    (code,) = BLOCKS
    assert len([line for line in code.splitlines() if line]) <= 6
    assert not re.search(r"generators|studies", code)


def test_summary_and_report_are_up_to_date_with_the_results():
    assert up_to_date(README, HOME / "results") == README, "run: python -m studies readme"
    written = (HOME / "results" / "REPORT.md").read_text(encoding="utf-8")
    assert report(HOME / "results") == written, "run: python -m studies readme"


def test_it_is_short():
    lines = README.splitlines()
    assert len(lines) <= 120
    assert [line for line in lines if len(line) > 120] == []


def test_every_picture_and_folder_named_is_there():
    pictures = re.findall(r"!\[[^]]*\]\(([^)]+)\)", README)
    links = re.findall(r"[^!]\[[^]]*\]\(([^)#]+)\)", README)
    pictures += [link for link in links if not link.startswith("http") and link]
    folders = re.findall(r"`(\w+/)`", README)
    assert {"docs/pictures/from_drawing.png", "docs/pictures/page.png"} <= set(pictures)
    assert {"pcmc/", "generators/", "studies/", "results/"} == set(folders)
    for name in pictures + folders:
        assert (HOME / name).exists(), name
