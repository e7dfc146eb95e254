"""Explore: each kind of project is opened, moved, aimed at a target, saved, and opened again."""

from __future__ import annotations

import tomllib

import pytest

from pcmc.explore import saving
from pcmc.explore.roof import read_roof
from pcmc.project.values import differences, values_of

HALL = "[plan]\nedge_length = 1.0  # coarse\noutline = [[0, 0], [12, 0], [12, 6], [0, 6]]\n"
CUT = "dividers = [[[6, 0], [6, 6]]]\n"
PATCHES = "[plan.patches]\nwest = {tension = 5.0}\neast = {tension = 5.0, pressure = 1}\n"
OUTPUT = "[output]\nfiles = ['hall.obj', 'out.glb']\nreport = 'hall-report.pdf'\n"
SAIL = """units = "m"
[plan]
edge_length = 1.0
outline = [[0, 0], [8, 0], [8, 8], [0, 8]]
edge = "cable"
cable = 9.0
supports = [[0, 0, 4], [8, 0, 0], [8, 8, 4], [0, 8, 0]]
tension = 1.0
pressure = 0.0
"""
MIRROR = "mirrors = [[[6, 0], [6, 6]]]\n"
TEXTS = {
    "patches": f"units = 'm'\n{HALL}{CUT}{PATCHES}{OUTPUT}",
    "one tension": f"{HALL}tension = 5.0\nsnow = 0.25\n{CUT}",
    "rise": f"{HALL}rise = 1.4\n{CUT}",
    "drawing": 'units = "m"\n[plan]\ndrawing = "hall.dxf"\nedge_length = 1.0\n',
    "sail": SAIL,
    "half": f"{HALL.replace('[12, 0], [12, 6]', '[6, 0], [6, 6]')}{MIRROR}tension = 4.0\n",
}
MOVED = {  # what is changed: a slider's kind, and the name of its patch or cable
    "patches": ("tensions", "east"),
    "one tension": ("tensions", "patch 2"),
    "rise": ("tensions", "patch 1"),
    "drawing": ("tensions", "north"),
    "sail": ("cables", "cable 2"),
    "half": ("pressures", "patch 1"),
}


def written(kind, folder):
    """The file of a project of a kind."""
    if kind == "drawing":
        draw(folder / "hall.dxf")
    path = folder / "hall.toml"
    path.write_text(TEXTS[kind])
    return path


def draw(path):
    """A hall of three parts: one wall is a single line that another one cuts in two."""
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new()
    space = drawing.modelspace()
    space.add_lwpolyline([(0, 0), (12, 0), (12, 6), (0, 6)], close=True, dxfattribs={"layer": "outline"})
    for line in (((6, 0), (6, 6)), ((9, 0), (9, 6))):
        space.add_line(*line, dxfattribs={"layer": "divider ridge"})
    for name, x, y in (("north", 3, 4), ("south", 10, 2)):
        space.add_text(f"{name} = 5", dxfattribs={"layer": "patch", "insert": (x, y)})
    drawing.units = 6
    drawing.saveas(path)


def changed(surface, kind, name, factor=1.1):
    """The surface with one value a little larger."""
    values = {kind: {name: factor * values_of(surface)[kind][name]}}
    return surface.retensioned(**values)


@pytest.mark.parametrize("kind", TEXTS)
def test_every_kind_of_project_is_saved_with_the_values_of_the_surface(kind, tmp_path):
    roof = read_roof(written(kind, tmp_path), start_shape=True)
    text, _, left = saving.project_with(roof, roof.surface)
    assert not left
    if kind != "rise":
        assert text == TEXTS[kind]  # nothing was changed
    surface = changed(roof.surface, *MOVED[kind])
    path, _ = saving.save(roof, surface, "other.toml", False)
    assert not differences(read_roof(path, start_shape=True).surface, surface)
    if kind == "one tension":
        plan = tomllib.loads(path.read_text())["plan"]
        assert (plan["snow"], plan["patches"]) == (
            0.25,
            {"patch 1": {"tension": 5.0}, "patch 2": {"tension": 5.5}},
        )
    if kind == "patches":
        output = tomllib.loads(path.read_text())["output"]
        assert output == {"files": ["other.obj", "other-out.glb"], "report": "other-report.pdf"}
        assert "edge_length = 1.0  # coarse" in path.read_text()
