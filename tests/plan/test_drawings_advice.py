"""Drawings that are easily misunderstood: their place, unit and size, and what is chosen for them."""

from __future__ import annotations

import re

import drawn
import pytest
from drawn import BOX, drawing
from ezdxf import units
from refusals import refused

from pcmc import cli, project
from pcmc.advice.advice import chosen_values
from pcmc.base.errors import FileError, FileWarning
from pcmc.plan.edges import cable_for
from pcmc.plan.proposal import _rounded
from pcmc.surface.curves import polyline

SEAM = ("line", "divider seam", (5, 0), (5, 6))


def test_a_project_that_cannot_refer_to_its_drawing_is_not_written(tmp_path, capsys):
    file = drawing(tmp_path)
    (tmp_path / "other").mkdir()
    elsewhere = tmp_path / "other" / "hall.toml"
    with refused(FileError, what=str(elsewhere), found=str(file)):
        project.planning.drawing_reference(file, elsewhere)
    assert cli.main(["plan", str(file), "-o", str(elsewhere), "--refer"]) == 2
    assert not elsewhere.exists()
    line = re.search(r"pcmc (plan \S+ -o (\S+) --refer)", capsys.readouterr().err)
    assert cli.main(line[1].split()) == 0
    assert project.build(line[2]).m > 100
    above = tmp_path / "above.toml"
    (tmp_path / "cad").mkdir()
    drawing(tmp_path / "cad")
    assert cli.main(["plan", str(tmp_path / "cad" / file.name), "-o", str(above), "--refer"]) == 0
    assert project.build(above).m > 100


def test_tensions_and_walls_that_are_chosen_for_a_drawing_are_printed(tmp_path):
    file = drawing(tmp_path, SEAM)
    path = tmp_path / "hall.toml"

    def chosen(plan):
        path.write_text(f'[plan]\ndrawing = "{file.name}"\n{plan}')
        loaded = project.load(path)
        surface = project.surface_of(loaded)
        return chosen_values(loaded.plan, loaded.chosen.text, surface, surface), loaded

    (text,), loaded = chosen('[plan.patches]\n"patch 1" = {tension = 9}\n')
    tension, wall = loaded.plan.patches[1].tension, loaded.plan.dividers[0].wall
    assert f"tension {tension:g} for 'patch 2'; wall {wall:g} for 'seam'; edges of" in text
    assert '[[plan.dividers]] name = "seam", wall = ...' in text
    (text,), _ = chosen("edge_length = 1\ntension = 5\n")
    assert "tension" not in text.split("(")[0]
    assert "edges" not in text
    assert chosen('edge_length = 1\ntension = 5\n[[plan.dividers]]\nname = "seam"\nwall = 2\n')[0] == []
    (text,), _ = chosen('edge_length = 1\ntension = 5\n[[plan.dividers]]\nname = "seam"\nwall = "balanced"\n')
    assert text.startswith("walls balanced with their neighbours: 'seam'")


def test_chosen_walls_are_those_of_the_tensions_in_the_file(tmp_path, capsys):
    """The wall of 1.8 balances 5 with 4.5: it is not "balanced" beside 6, nor is one that is typed."""
    path = tmp_path / "hall.toml"
    outline, divider = "[[0, 0], [12, 0], [12, 8], [0, 8]]", "{curve = [[6, 0], [6, 8]]}"
    plan = f"outline = {outline}\ndividers = [{divider}]\nedge_length = 1.5\n"
    path.write_text(f"[plan]\n{plan}patches = {{west = {{tension = 5}}, east = {{tension = 4.5}}}}\n")

    def printed(*given):
        cli.main(["solve", str(path), "--no-mesh-check", "--no-cache", *given])
        return capsys.readouterr().out

    assert "walls balanced with their neighbours: 'wall 1' 1.8" in printed()
    assert "walls that balance the tensions of the file: 'wall 1' 1.8" in printed("--tension", "west=6")
    assert "walls" not in printed("--tension", "wall 1=2.5").split("stable")[0]


def test_a_sail_with_slender_corners_gets_cables_that_fit_in_them(tmp_path, capsys):
    """At 1.5 α × the size, arcs of radius 15 needed 47° of a corner of 45°: no sail was at rest."""
    masts = [("point", "mast", place) for place in ((0, 0, 1), (10, 0, 4), (10, 10, 1))]
    edge = ("lwpolyline", "outline", [(0, 0), (10, 0), (10, 10), (0, 0)])
    assert cli.main(["solve", str(drawing(tmp_path, edge, *masts, outline=False)), "--no-mesh-check"]) == 0
    assert "stable" in capsys.readouterr().out


@pytest.mark.parametrize("size", [0.01, 1.0, 1000.0])
def test_a_project_without_edge_length_gets_the_mesh_that_its_drawing_would(tmp_path, size):
    """Edges of 1, whatever the unit, made three triangles of a small plan and millions of one in mm."""
    path = tmp_path / "hall.toml"
    path.write_text(
        f"[plan]\noutline = [[0, 0], [{10 * size}, 0], [{10 * size}, {6 * size}], [0, {6 * size}]]\n"
        f"holes = [{{circle = {{centre = [{7 * size}, {3 * size}], radius = {size}}}}}]\n"
        f"dividers = [[[{4 * size}, 0], [{4 * size}, {7 * size}]]]\ntension = {5 * size}\n"
    )
    loaded = project.load(path)
    assert 1300 < project.surface_of(loaded).m < 2500
    assert f"edges of {loaded.plan.edge_length:g} (to change: edge_length" in loaded.chosen.text
    if size == 1.0:
        calls = [("circle", "hole", (7, 3), 1.0), ("line", "divider", (4, 0), (4, 6))]
        assert project.load(drawing(tmp_path, *calls)).plan.edge_length == loaded.plan.edge_length


@pytest.mark.parametrize(
    ("unit", "scale", "note"),
    [
        (units.M, 1000.0, "10 km long; is the drawing in mm? Its unit is m"),
        (units.MM, 0.001, "0.01 mm long; check its unit, which is mm"),
        (units.MM, 1.0, "10 mm long; is the drawing in m? Its unit is mm"),
        (units.M, 99.0, ""),
        (units.MM, 1000.0, ""),
    ],
)
def test_a_plan_of_an_unlikely_size_is_noted(tmp_path, unit, scale, note, recwarn):
    document, space = drawn.new(unit)
    space.add_lwpolyline([(scale * x, scale * y) for x, y in BOX], close=True, dxfattribs=drawn.on("outline"))
    document.saveas(tmp_path / "hall.dxf")
    project.load(tmp_path / "hall.dxf")
    printed = " ".join(str(warning.message) for warning in recwarn)
    assert (note in printed) if note else not printed


def test_the_unit_named_for_a_plan_of_an_unlikely_size_is_right(tmp_path):
    path = tmp_path / "hall.toml"
    text = (
        "{}[plan]\nedge_length = 800\ntension = 5e3\noutline = [[0, 0], [12e3, 0], [12e3, 6e3], [0, 6e3]]\n"
    )
    path.write_text(text.format('units = "m"\n'))
    with pytest.warns(FileWarning, match="12 km long") as caught:
        project.load(path)
    line = re.search(r"type (units = .*)", str(caught[0].message))[1]
    for first in (f"{line}\n", ""):
        path.write_text(text.format(first))
        project.load(path)  # a warning would be an error


def test_metres_are_assumed_for_a_drawing_without_a_unit(tmp_path, capsys):
    file = drawing(tmp_path, unit=0)
    assert cli.main(["solve", str(file), "-o", str(tmp_path / "hall.glb"), "--no-mesh-check"]) == 0
    assert "hall.glb: there is no unit of length, so metres are assumed" in capsys.readouterr().out
    assert cli.main(["solve", str(file), "-o", str(tmp_path / "hall.obj"), "--no-mesh-check"]) == 0
    assert "metres are" not in capsys.readouterr().out


def test_points_of_patches_have_few_digits():
    assert _rounded(8.9e-16, 2.0) == 0.0
    assert str(_rounded(-1e-20, 0.3)) == "0.0"
    for radius in (0.002, 3.0, 450.0):
        value = 1234.56789 * radius
        assert abs(_rounded(value, radius) - value) <= 0.05 * radius
        assert len(repr(_rounded(value, radius))) <= 8


def test_a_cable_is_chosen_for_masts_at_one_point():
    """They make no corner, slender or not."""
    square = polyline([[0, 0], [10, 0], [10, 10], [0, 10]], closed=True)
    assert cable_for(square, 2.0, [[0, 0]] * 3) == cable_for(square, 2.0, ()) == 30.0
