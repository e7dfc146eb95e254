"""How long a designer waits for a command: the whole process, from the shell's prompt to the next one."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from shutil import copy

from .timing import Row, median_seconds

ROOF = Path(__file__).parents[2] / "notebooks" / "roof.toml"
REPEATS = 5
ASKED = 4.0  # s
FORMS = {"until its files are written": ["--no-mesh-check"], "with its mesh check": []}


def command(quick: bool) -> list[Row]:
    """``pcmc solve roof.toml``, which meshes, solves, certifies, writes three files and a picture."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        copy(ROOF, folder)
        for what, options in FORMS.items():
            run = partial(_run, ["solve", ROOF.name, *options], Path(folder))
            seconds = median_seconds(run, 1 if quick else REPEATS)
            rows.append(Row(f"pcmc solve {ROOF.name}, {what}", seconds, "s", "warm", most=ASKED))
    return rows


def _run(arguments: Sequence[str], folder: Path) -> None:
    line = [sys.executable, "-m", "pcmc", *arguments]
    subprocess.run(line, cwd=folder, check=True, capture_output=True)


COMMAND = [command]
