"""The README is true: its code runs, its commands are CI's, its tables are the results'."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from studies.readme import up_to_date

HOME = Path(__file__).resolve().parent.parent
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


def test_tables_are_up_to_date_with_the_results():
    assert up_to_date(README, HOME / "results") == README, "run: python -m studies readme"


def test_every_picture_and_folder_named_is_there():
    pictures = re.findall(r"!\[[^]]*\]\(([^)]+)\)", README)
    folders = re.findall(r"^\| `(\w+/)`", README, re.MULTILINE)
    assert pictures
    assert len(folders) >= 5
    for name in pictures + folders:
        assert (HOME / name).exists(), name
