"""Run what README and documentation print: ``python pages.py PAGE ...``, in an empty folder.

The blocks of a page run in order, in one namespace and one folder. Comments that readers do not see say what
a block needs: ``<!-- before ... -->`` has Python to run first, ``<!-- file: NAME -->`` names the file for
the next block (a project is solved, too); ``<!-- not run: REASON -->`` leaves the next block out.
"""

from __future__ import annotations

import re
import shlex
import sys
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pcmc import cli

BLOCK = re.compile(
    r"<!-- (?P<kind>before|file|not run)(?::? (?P<inline>[^\n]*?))?(?:\n(?P<code>.*?)\n)? ?-->"
    r"|^```(?P<language>\w+)\n(?P<text>.*?)^```",
    re.S | re.M,
)
OUTSIDE = ("pip ", "python -m pip ", "python -m studies", "python -m pcmc.compas", "sphinx-build ", "ccx ")


def parts(page: Path) -> Iterator[tuple[int, str, str]]:
    """Line, kind and text of the comments and blocks of a page, in order."""
    source = page.read_text(encoding="utf-8")
    for found in BLOCK.finditer(source):
        line = source[: found.start()].count("\n") + 1
        if found["kind"]:
            yield line, found["kind"], found["code"] or found["inline"] or ""
        else:
            yield line, found["language"], found["text"]


def run_page(page: Path) -> int:
    """Run the page's blocks in the current folder; the number that ran. An AssertionError names the line."""
    names: dict[str, Any] = {"__name__": page.stem}
    file, left_out, count = "", False, 0
    for line, kind, text in parts(page):
        where = f"{page.name}, line {line}"
        if kind == "before":
            exec(compile(text, where, "exec"), names)
        elif kind == "file":
            file = text.strip()
        elif kind == "not run":
            assert text.strip(), f"{where}: no reason"
            left_out = True
        elif left_out:
            left_out = False
        elif kind in ("python", "sh", "toml"):
            count += 1
            if kind == "python":
                exec(compile(text, where, "exec"), names)
            elif kind == "sh":
                run_commands(text, where)
            else:
                run_project(text, file, where)
            file = ""
    return count


def run_commands(text: str, where: str) -> None:
    """Run the lines that begin with ``pcmc``; a line that ends with ``# exit 1`` has to end so."""
    for line in filter(None, map(str.strip, text.splitlines())):
        if line.startswith(OUTSIDE):
            continue
        words = shlex.split(line, comments=True)
        assert words[0] == "pcmc", f"{where}: {line!r} is no command that can be run here"
        if words[1] == "explore":  # would serve until Ctrl-C
            understood(words[2:])
            continue
        code = cli.main(words[1:])
        assert code == (1 if line.endswith("# exit 1") else 0), f"{where}: {line!r} ended with {code}"


def understood(words: list[str]) -> None:
    """Let the command ``explore`` read its arguments."""
    import typer

    from pcmc.cli.app import app

    typer.main.get_command(app).commands["explore"].make_context("explore", words)


def run_project(text: str, file: str, where: str) -> None:
    """Write a project and solve it; of a part of one, compare the keys with those that there are."""
    from pcmc.project import run, sections

    data = tomllib.loads(text)
    if file:
        path = Path(file)
        added = path.exists() and not {"plan", "mesh"} & set(data)
        before = path.read_text(encoding="utf-8") if added else ""
        path.write_text(f"{before}\n{text}", encoding="utf-8")
        outcome = run(path)
        assert outcome.good, f"{where}: {outcome.certificate.verdict}"
        return
    known = {key.name for section in sections() for key in section.keys}
    for section, table in data.items():
        keys = set(table) if isinstance(table, dict) and section != "patches" else set()
        assert {section, *keys} <= known, f"{where}: unknown keys {sorted({section, *keys} - known)}"


def main(pages: list[str]) -> None:
    """Run pages, each in a folder of its own beside the others."""
    import os

    home = Path.cwd()
    for number, name in enumerate(pages):
        page, folder = Path(name).resolve(), home / f"page-{number}"
        folder.mkdir()
        os.chdir(folder)
        begun = time.perf_counter()
        try:
            print(f"{page.name}: {run_page(page)} blocks in {time.perf_counter() - begun:.1f} s", flush=True)
        finally:
            os.chdir(home)


if __name__ == "__main__":
    main(sys.argv[1:])
