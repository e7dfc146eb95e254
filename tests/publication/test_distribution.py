"""What is installed: the package alone, under its own name, with types that a user's checker sees."""

from __future__ import annotations

import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

HOME = Path(__file__).resolve().parents[2]
SCRIPT = """\
import pcmc

roof = pcmc.Surface([[0.0, 0.0, 0.0]], [[0, 1, 2]], [0], [pcmc.Patch("roof", tension="high")])
rise: str = pcmc.energy(roof)
reveal_type(pcmc.solve(roof).surface)
"""


def environment():
    """Ours without the paths by which Python or a type checker would find this checkout."""
    return {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "MYPYPATH")}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of this checkout; it is built beside a copy, so that the checkout stays clean."""
    folder = tmp_path_factory.mktemp("wheel")
    tracked = ["pyproject.toml", "README.md", "LICENSE", "pcmc", "generators", "studies"]
    (folder / "checkout").mkdir()
    subprocess.run(["cp", "-r", *tracked, folder / "checkout"], cwd=HOME, check=True)
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", folder]
    subprocess.run([*command, folder / "checkout"], check=True, capture_output=True)
    (path,) = folder.glob("pcmc_surfaces-*.whl")
    return path


@pytest.mark.nightly
def test_the_wheel_holds_the_package_alone(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"pcmc"}
    missing = [
        path.relative_to(HOME).as_posix()
        for path in (HOME / "pcmc").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
        if path.relative_to(HOME).as_posix() not in names
    ]
    assert missing == []


@pytest.mark.nightly
def test_a_users_type_checker_sees_the_types(wheel, tmp_path):
    venv.create(tmp_path / "user", symlinks=True)
    (python,) = tmp_path.glob("user/*/python")
    (site,) = tmp_path.glob("user/lib/python*/site-packages")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    (tmp_path / "script.py").write_text(SCRIPT, encoding="utf-8")
    command = [sys.executable, "-m", "pyrefly", "check", "--preset", "default", "--output-format", "min-text"]
    found = subprocess.run(
        [*command, "--python-interpreter-path", python, "script.py"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env=environment(),
    )
    (third, fourth, revealed) = (
        [line for line in found.stdout.splitlines() if f"script.py:{k}:" in line] for k in (3, 4, 5)
    )
    assert any("is not assignable to parameter `tension` with type `float`" in line for line in third)
    assert any("`float` is not assignable to `str`" in line for line in fourth)
    assert any("revealed type: Surface" in line for line in revealed)
