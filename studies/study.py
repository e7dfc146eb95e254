"""What a study is, and the three steps that run one: data, table, figure."""

from __future__ import annotations

import platform
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import pandas as pd

from .code import code_of
from .folder import Folder, write_json

STEPS = ("data", "table", "figure")
SOURCES = (":/*.py", ":/*.toml")  # of the whole checkout
LIBRARIES = ("pcmc-surfaces", "numpy", "scipy", "numba", "pandas", "nlopt")


@dataclass(frozen=True)
class Study:
    """One example or question.

    Attributes
    ----------
    name, about : its name on the command line, and the question that it answers, in one line.
    data : ``data(folder, short)`` solves and writes records and meshes; ``short`` asks for the
        least work that still passes through every line.
    table : ``table(folder)`` reads records, writes tables, and returns the numbers that are
        compared with the paper's, by name.
    figure : ``figure(folder)`` reads tables and meshes and draws.
    parameters : what was chosen, for the provenance file.
    seconds : about how long it takes, so that long studies start first.
    paper : whether ``reproduce`` runs it.
    timed : whether seconds are its answer, so that it may use all that the processor has.
    """

    name: str
    about: str
    data: Callable[[Folder, bool], None]
    table: Callable[[Folder], Mapping[str, float]]
    figure: Callable[[Folder], None]
    parameters: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 5.0
    paper: bool = True
    timed: bool = False


def perform(
    study: Study,
    results: Path,
    *,
    short: bool = False,
    steps: Sequence[str] = STEPS,
    announce: Callable[[str], None] = lambda step: None,
) -> None:
    """Run the steps of a study in ``results / study.name`` and write its provenance.

    ``announce`` is called with each step before it starts. The measured numbers of an earlier run are
    deleted first, and before new data its meshes too. So a study that fails leaves no old ones behind.
    """
    folder = Folder(results / study.name)
    seconds = {}
    if "data" in steps or "table" in steps:
        (folder.path / "measured.csv").unlink(missing_ok=True)
    if "data" in steps:
        for mesh in folder.meshes():
            mesh.unlink()
    for step in (s for s in STEPS if s in steps):
        announce(step)
        start = time.perf_counter()
        if step == "data":
            study.data(folder, short)
        elif step == "table":
            measured = study.table(folder)
            rows = [(f"{study.name}.{key}", float(value)) for key, value in measured.items()]
            folder.write_table("measured", pd.DataFrame(rows, columns=["key", "value"]))
        else:
            study.figure(folder)
            if not short:  # whose pictures nobody keeps
                folder.shrink_figures()
        seconds[step] = round(time.perf_counter() - start, 2)
    if "data" in steps:
        write_json(folder.path / "provenance.json", provenance(study, folder, short, seconds))


def provenance(study: Study, folder: Folder, short: bool, seconds: Mapping[str, float]) -> dict[str, Any]:
    """What the numbers came from, apart from the numbers."""
    return {
        "study": study.name,
        "commit": git("rev-parse", "HEAD"),
        "uncommitted_changes": bool(git("status", "--porcelain", "--", *SOURCES)),
        "code": None if short else code_of(study.data.__module__),
        "short": short,
        "parameters": dict(study.parameters),
        "meshes": folder.mesh_hashes(),
        "versions": {"python": platform.python_version()} | {n: _version(n) for n in LIBRARIES},
        "system": f"{platform.system()} {platform.machine()}",
        "seconds": dict(seconds),
    }


def git(*words: str) -> str:
    """What git answers about the checkout this file is in; empty where there is none."""
    command = ["git", "-C", str(Path(__file__).parent), *words]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def _version(library: str) -> str:
    try:
        return version(library)
    except PackageNotFoundError:
        return "not installed"
