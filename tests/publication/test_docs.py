"""The recipes of the documentation work as they are printed."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

import pcmc
from generators import spherical_cap
from pcmc.plan.strokes import MEANINGS
from pcmc.project import reference, sections

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_branches_of_the_explanation_fold_and_split():
    text = (DOCS / "explanation" / "branches.md").read_text(encoding="utf-8")
    names = {}
    for code in re.findall(r"```python\n(.*?)```", text, re.S):
        exec(compile(code, "branches.md", "exec"), names)
    assert abs(names["branch"].bifurcations.parameter.iloc[0] - 1.0) < 0.02
    assert names["one"].points.energy.iloc[-1] < names["branch"].points.energy.iloc[-1]


def test_the_page_of_keys_has_every_key_of_every_section():
    parts = reference().split("\n## ")
    for section, part in zip(sections(), parts, strict=True):
        assert section.name in part.splitlines()[0]
        assert [key.name for key in section.keys if f"| `{key.name}` |" not in part] == []


def test_meshes_for_compas_are_made_as_the_how_to_says():
    pytest.importorskip("compas")
    text = (DOCS / "how-to" / "compas.md").read_text(encoding="utf-8")
    names = {}
    exec(compile(re.findall(r"```python\n(.*?)```", text, re.S)[1], "compas.md", "exec"), names)
    assert names["result"].converged


def test_a_glb_is_coloured_as_the_how_to_says(tmp_path, monkeypatch):
    pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)
    text = (DOCS / "how-to" / "files.md").read_text(encoding="utf-8")
    code = next(one for one in re.findall(r"```python\n(.*?)```", text, re.S) if "colour=" in one)
    exec(compile(code, "files.md", "exec"), {"pcmc": pcmc, "roof": spherical_cap(4)})
    assert (tmp_path / "roof.glb").stat().st_size > 1000


def test_the_list_of_rooms_is_that_of_the_folders_and_of_their_order():
    listed = [room for line in pcmc.__doc__.split("\n") if line[25:27] == "  " for room in line[:25].split()]
    listed = [room for room in listed if not room.startswith("=")]
    folders = {path.parent.name for path in DOCS.parent.glob("pcmc/*/__init__.py")}
    assert set(listed) == folders
    settings = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))
    (layers,) = (
        c["layers"] for c in settings["tool"]["importlinter"]["contracts"] if len(c.get("layers", ())) > 9
    )
    floor = {room.strip("() "): k for k, layer in enumerate(reversed(layers)) for room in layer.split("|")}
    assert set(floor) - {"diagnostics"} == folders  # a file, and no folder
    floors = [floor[room] for room in listed]
    assert floors == sorted(floors)


def test_the_drawings_in_the_picture_of_layers_are_certified(tmp_path, monkeypatch):
    """And every layer that a drawing may have is in the table of the page."""
    monkeypatch.syspath_prepend(DOCS)
    layers = pytest.importorskip("drawing_layers")
    assert [outcome.good for outcome in layers.roofs()] == [True, True]
    page = (DOCS / "how-to" / "from-a-drawing.md").read_text(encoding="utf-8")
    assert [name for name in MEANINGS if f"`{name}`" not in page] == []
