"""Plans from drawings: layers, gaps, exact curves, and one command from start to end."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from unittest import mock

import drawn
import numpy as np
import pytest
from drawn import BOX, drawing
from nightly import at_night
from refusals import refused

import pcmc
from pcmc import cli, project
from pcmc.base.errors import FileError, FileWarning, OptionError, PlanError
from pcmc.base.libraries import read_arrays
from pcmc.plan import plan_from, strokes
from pcmc.plan.drawing import read_drawing
from pcmc.plan.proposal import ABOVE_LEAST, least_tension, proposed
from pcmc.surface.curve_data import curve_data

rhino3dm = pytest.importorskip("rhino3dm")
shapely = pytest.importorskip("shapely")


@pytest.mark.parametrize(
    ("name", "patches", "least"), [("nave", 3, 1.2), ("pavilion", 1, 3.0), ("flower", 5, 1.2)]
)
def test_from_a_drawing_to_a_certified_roof_in_one_command(tmp_path, capsys, name, patches, least):
    file = getattr(drawn, name)(tmp_path / f"{name}.dxf")
    roof = tmp_path / "roof.3dm"
    assert cli.main(["solve", str(file), "-o", str(roof), "--no-mesh-check"]) == 0
    printed = capsys.readouterr()
    assert "stable" in printed.out
    surface = pcmc.read(roof)
    loaded = [patch for patch in surface.patches if not patch.auxiliary]
    assert len(loaded) == patches
    assert surface.vertices[:, 2].max() > least
    assert pcmc.certify(surface).certified


def test_the_l_shape_and_its_written_project_give_the_same_roof(tmp_path):
    file = drawn.corner(tmp_path / "corner.dxf")
    text, _ = project.project_text(file)
    (tmp_path / "roof.toml").write_text(text)
    one, two = (project.load(path) for path in (file, tmp_path / "roof.toml"))
    first, second = (project.surface_of(p) for p in (one, two))
    assert [p.name for p in first.patches] == [p.name for p in second.patches]
    np.testing.assert_allclose(first.vertices, second.vertices, atol=1e-8)
    assert pcmc.certify(pcmc.solve(first).surface).certified


def test_a_project_that_refers_to_its_drawing_follows_it(tmp_path):
    file = drawn.nave(tmp_path / "nave.dxf")
    path = tmp_path / "roof.toml"
    path.write_text(
        '[plan]\ndrawing = "nave.dxf"\nedge_length = 1.0\n[plan.patches]\napse = {tension = 9.0}\n'
        '[[plan.dividers]]\nname = "chancel"\nwall = 4.5\n'
    )
    assert project.drawn.files_of(path) == [path, file]
    before = project.digest(path)
    with pytest.warns(FileWarning, match="annotation"):
        loaded = project.load(path)
    surface = project.surface_of(loaded)
    tension = {patch.name: patch.tension for patch in surface.patches}
    assert (tension["apse"], tension["chancel"], loaded.plan.edge_length) == (9.0, 4.5, 1.0)
    assert tension["east"] == tension["west"] != 9.0
    drawn.nave(file, scale=2.0)
    assert project.digest(path) != before
    with pytest.warns(FileWarning):
        assert project.build(path).size > 1.9 * surface.size


@pytest.mark.parametrize(("unit", "code", "metres"), [("in", 1, 0.0254), ("ft", 2, 0.3048)])
def test_feet_and_inches_of_a_drawing_are_converted(tmp_path, unit, code, metres):
    read = read_drawing(drawn.nave(tmp_path / "nave.dxf", unit=code), "m")
    assert (read.unit, read.units) == (unit, "m")
    assert read.outline.length == pytest.approx(metres * (8.0 + 2 * 18.0 + 4.0 * np.pi), rel=1e-4)


def test_millimetres_and_metres_give_the_same_plan(tmp_path):
    metres = read_drawing(drawn.nave(tmp_path / "m.dxf"))
    small = drawn.nave(tmp_path / "mm.dxf", scale=1000.0, unit=4)
    same, own = read_drawing(small, "m"), read_drawing(small)
    assert (metres.unit, same.unit, same.units, own.units) == ("m", "mm", "m", "mm")
    assert same.notes[0] == "lengths converted from mm to m (1 mm = 0.001 m)"
    assert own.outline.length == pytest.approx(1000.0 * metres.outline.length, rel=1e-12)
    values = [proposed(plan) for plan in (metres, same)]
    assert values[0]["patches"].keys() == values[1]["patches"].keys()
    assert values[0]["edge_length"] == values[1]["edge_length"]


def test_small_gaps_are_closed_and_said_and_arcs_stay_arcs(tmp_path):
    plan = read_drawing(drawn.nave(tmp_path / "nave.dxf", gap=0.01))
    assert plan.outline.closed
    assert "1 gap closed, up to 0.01 long" in plan.notes[0]
    assert f"up to {plan.gap:.3g}" in plan.notes[0]
    whole = read_drawing(drawn.nave(tmp_path / "whole.dxf"))
    for one in (plan, whole):
        (half,) = [piece for piece in one.outline.pieces if piece.sweep]
        assert np.linalg.norm(half.points[1]) == pytest.approx(4.0, rel=1e-12)
    with refused(PlanError, what="layer 'OUTLINE'") as caught:
        read_drawing(tmp_path / "nave.dxf", gap=0.001)
    assert caught.value.found == pytest.approx(0.01)
    assert len(caught.value.where) == 2
    with refused(OptionError, what="gap", found=1e-320):
        read_drawing(tmp_path / "nave.dxf", gap=1e-320)
    with refused(OptionError, what="gap", found=1e3):
        read_drawing(tmp_path / "nave.dxf", gap=1e3)


def test_ends_of_dividers_that_just_miss_their_line_are_moved_to_it(tmp_path):
    file = drawing(tmp_path, ("line", "divider a", (5, 0.006), (5, 6.004)))
    plan = read_drawing(file)
    np.testing.assert_allclose(plan.dividers["a"].at([0.0, 1.0]), [[5, 0], [5, 6]], atol=1e-9)
    assert "2 ends of dividers moved by up to 0.006" in plan.notes[0]


def test_strokes_drawn_twice_count_once(tmp_path):
    lines = ("line", "divider a", (5, 0), (5, 6)), ("line", "divider a", (5, 6), (5, 0))
    plan = read_drawing(drawing(tmp_path, *lines))
    assert list(plan.dividers) == ["a"]
    assert "drawn twice" in plan.notes[0]


def test_heights_masts_and_levels(tmp_path):
    file = drawing(
        tmp_path,
        ("point", "heights", (2, 3, 1.1)),
        ("text", "height", "h = 1,2 m"),
        ("line", "mast", (8, 3, 0), (8, 3, 2)),
        ("circle", "mast ring", (7, 2, 1.5), 0.4),
    )
    plan = read_drawing(file)
    np.testing.assert_allclose(plan.heights, [[2, 3, 1.1], [5, 3, 1.2]])
    np.testing.assert_allclose(plan.supports, [[8, 3, 2]])
    assert list(plan.holes) == ["ring"]
    assert plan.flat
    with pytest.warns(FileWarning, match="draw a circle of radius 0.56 around"):
        loaded = project.load(file)
    assert [(t.quantity, t.of, t.value) for t in loaded.targets] == [
        ("height", (2.0, 3.0), 1.1),
        ("height", (5.0, 3.0), 1.2),
    ]
    document, space = drawn.new()
    space.add_lwpolyline(BOX, close=True, dxfattribs={"layer": "outline", "elevation": 105.0})
    document.saveas(tmp_path / "high.dxf")
    surface = project.build(tmp_path / "high.dxf")
    assert surface.plane.point == (0.0, 0.0, 105.0)
    assert surface.vertices[:, 2].min() == 105.0


def test_walls_stand_on_the_ground_beside_a_raised_hole(tmp_path):
    file = drawing(tmp_path, ("line", "divider", (4, 0), (4, 6)), ("circle", "hole", (7, 3, 1.5), 0.8))
    surface = project.build(file)
    wall = np.unique(surface.faces[surface.walls[surface.patch_of_face]])
    assert (surface.vertices[wall[surface.fixed[wall]], 2] == 0.0).all()
    document, space = drawn.new()
    corners = [(x, y, 0.1 * x) for x, y in BOX]
    space.add_polyline3d(corners, close=True, dxfattribs=drawn.on("outline"))
    space.add_line((4, 0), (4, 6), dxfattribs=drawn.on("divider"))
    document.saveas(tmp_path / "tilted.dxf")
    (divider,) = proposed(read_drawing(tmp_path / "tilted.dxf"))["dividers"]
    assert divider["bottom"] == "sloped"


def test_a_height_in_the_drawing_is_met(tmp_path):
    file = drawing(tmp_path, ("point", "height", (5, 3, 1.25)))
    outcome = project.run(file)
    assert outcome.good
    assert outcome.surface.vertices[:, 2].max() == pytest.approx(1.25, abs=0.02)


def test_blocks_layers_that_are_off_and_other_entities(tmp_path):
    document, space = drawn.new()
    bay = document.blocks.new("BAY")
    bay.add_circle((0, 0), 5)
    space.add_blockref("BAY", (3, 3), dxfattribs={"layer": "outline", "xscale": 2.0, "yscale": 1.0})
    document.layers.add("divider old").off()
    space.add_line((3, -2), (3, 8), dxfattribs=drawn.on("divider old"))
    document.saveas(tmp_path / "hall.dxf")
    plan = read_drawing(tmp_path / "hall.dxf")
    (piece,) = plan.outline.pieces
    assert np.linalg.norm(piece.points[1:], axis=1).tolist() == pytest.approx([10.0, 5.0])
    assert not plan.dividers
    assert "'divider old' (1)" in plan.notes[0]


def test_a_name_and_tension_in_the_attribute_of_a_block(tmp_path):
    document, space = drawn.new()
    space.add_lwpolyline(BOX, close=True, dxfattribs=drawn.on("outline"))
    document.blocks.new("TAG").add_attdef("NAME")
    tag = space.add_blockref("TAG", (3, 3), dxfattribs=drawn.on("patch"))
    tag.add_auto_attribs({"NAME": "nave = 7"})
    document.saveas(tmp_path / "hall.dxf")
    (label,) = read_drawing(tmp_path / "hall.dxf").labels
    assert (label.name, label.tension) == ("nave", 7.0)
    tag.attribs[0].is_invisible = True
    document.saveas(tmp_path / "hall.dxf")
    assert not read_drawing(tmp_path / "hall.dxf").labels


def test_a_polyline_smoothed_as_a_spline_is_the_line_shown(tmp_path):
    document, space = drawn.new()
    line = space.add_polyline2d(BOX, close=True, dxfattribs={**drawn.on("outline"), "flags": 4})
    for corner in line.vertices:
        corner.dxf.flags = corner.SPLINE_FRAME_CONTROL_POINT
    shown = [(5, 0.5), (9, 3), (5, 5.5), (1, 3)]
    line.append_vertices(shown, {"flags": line.vertices[0].SPLINE_VERTEX_CREATED})
    document.saveas(tmp_path / "hall.dxf")
    outline = read_drawing(tmp_path / "hall.dxf").outline
    assert [tuple(piece.points[0][:2]) for piece in outline.pieces] == shown


def rhino_outline(path, curve, *corners):
    """A drawing in metres whose outline is a curve and a polyline."""
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Meters
    layer, attributes = rhino3dm.Layer(), rhino3dm.ObjectAttributes()
    layer.Name = "Outline"
    attributes.LayerIndex = model.Layers.Add(layer)
    model.Objects.AddCurve(curve, attributes)
    if corners:
        line = rhino3dm.Polyline([rhino3dm.Point3d(x, y, 0.0) for x, y in corners])
        model.Objects.AddPolyline(line, attributes)
    model.Write(str(path), 7)
    return read_drawing(path, "m").outline


def test_a_free_curve_of_rhino_is_the_curve_drawn(tmp_path):
    points = [rhino3dm.Point3d(x, y, 0.0) for x, y in ((0, 0), (2, -2), (5, 1), (7, -1), (10, 0))]
    curve = rhino3dm.NurbsCurve.Create(False, 3, points)
    outline = rhino_outline(tmp_path / "a.3dm", curve, (10, 0), (10, 6), (0, 6), (0, 0))
    ends = np.linspace(curve.Domain.T0, curve.Domain.T1, 2001)
    drawn_points = np.array([(p.X, p.Y) for p in map(curve.PointAt, ends)])
    length = np.linalg.norm(np.diff(drawn_points, axis=0), axis=1).sum()
    assert outline.closed
    assert outline.length == pytest.approx(length + 22.0, rel=1e-4)
    assert sum(len(piece.points) == 4 for piece in outline.pieces) == 2  # as exact Bézier curves
    found = np.array(outline.at(outline.dense))[:, :2]
    low = found[(found[:, 1] < 0.3) & (found[:, 0] > 1e-6) & (found[:, 0] < 10.0 - 1e-6)]
    away = np.linalg.norm(low[:, None] - drawn_points, axis=2).min(axis=1)
    assert len(low) > 10
    assert away.max() < 0.01


def test_an_ellipse_of_rhino_is_an_ellipse(tmp_path):
    """Its curve is rational: points have weights."""
    curve = rhino3dm.NurbsCurve.CreateFromCircle(rhino3dm.Circle(rhino3dm.Point3d(0, 0, 0), 1.0))
    for k in range(len(curve.Points)):
        p = curve.Points[k]
        curve.Points[k] = rhino3dm.Point4d(3.0 * p.X, 2.0 * p.Y, p.Z, p.W)
    outline = rhino_outline(tmp_path / "a.3dm", curve)
    x, y = np.array(outline.at(outline.dense))[:, :2].T
    assert np.ptp(x) == pytest.approx(6.0, rel=1e-3)
    np.testing.assert_allclose((x / 3.0) ** 2 + (y / 2.0) ** 2, 1.0, atol=1e-6)


def test_curves_of_rhino_stay_exact(tmp_path):
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters

    def on(name):
        layer = rhino3dm.Layer()
        layer.Name = name
        attributes = rhino3dm.ObjectAttributes()
        attributes.LayerIndex = model.Layers.Add(layer)
        return attributes

    def at(*points):
        return [rhino3dm.Point3d(1000.0 * x, 1000.0 * y, 1000.0 * z) for x, y, z in points]

    edge = on("Outline")
    model.Objects.AddPolyline(rhino3dm.Polyline(at((8, 18, 0), (8, 0, 0), (0, 0, 0), (0, 18, 0))), edge)
    model.Objects.AddArc(rhino3dm.Arc(*at((0, 18, 0), (4, 22, 0), (8, 18, 0))), edge)
    model.Objects.AddLine(*at((0, 18, 0), (8, 18, 0)), on("divider chancel"))
    eye = rhino3dm.Circle(*at((4, 9, 2)), 1200.0)
    model.Objects.AddCurve(rhino3dm.NurbsCurve.CreateFromCircle(eye), on("hole eye"))
    model.Objects.AddTextDot("nave", *at((4, 5, 0)), on("patch"))
    path = tmp_path / "hall.3dm"
    model.Write(str(path), 7)
    with mock.patch("pcmc.project.drawn.read_strokes", wraps=strokes.read_strokes) as reads:
        loaded = project.load(path)
    assert reads.call_count == 1  # of the whole file: no second look at what kind it is
    assert loaded.specified
    assert not loaded.has_file
    plan = read_drawing(path, "m")
    assert (plan.unit, plan.units) == ("mm", "m")
    (half,) = [piece for piece in plan.outline.pieces if piece.sweep]
    assert np.linalg.norm(half.points[1]) == pytest.approx(4.0, rel=1e-12)
    assert abs(half.sweep) == pytest.approx(math.pi, rel=1e-12)
    assert curve_data(plan.holes["eye"]) == {"circle": {"centre": [4.0, 9.0, 2.0], "radius": 1.2}}
    assert [(d["name"], d["bottom"]) for d in proposed(plan)["dividers"]] == [("chancel", "held")]
    with refused(FileError, what=str(path)):
        raise_for_overwriting(path)
    pcmc.write(tmp_path / "roof.3dm", plan_from(proposed(plan)).surface())
    assert not project.is_drawing(tmp_path / "roof.3dm")


def raise_for_overwriting(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        project.run_project(
            replace(project.load(path), output=project.Output(files=[path]), folder=path.parent)
        )


def test_the_least_tension_is_that_of_the_paper_for_round_and_long_plans():
    """α = p R / 2 over a circle, p R over a barrel of half-width R; the proposal has room above it."""
    barrel = shapely.box(0, 0, 2, 200)
    assert least_tension(shapely.Point(0, 0).buffer(3.0, quad_segs=200)) == pytest.approx(1.5, rel=1e-3)
    assert least_tension(barrel) == pytest.approx(1.0, rel=0.02)
    side = 1.0 / (2.0 + math.sqrt(math.pi))  # a unit square's Cheeger constant is 2 + √π
    assert least_tension(shapely.box(0, 0, 1, 1)) == pytest.approx(side, rel=1e-6)
    assert ABOVE_LEAST > 1.0


def test_the_reading_process_gives_plain_values(tmp_path):
    content = read_arrays("plan/reading_drawings.py", "dxf_entities", drawing(tmp_path))
    assert content["unit"] == 6  # metres in DXF
    assert [entity["layer"] for entity in content["entities"]] == ["outline"]
    assert len(content["entities"][0]["pieces"]) == 4


@pytest.mark.parametrize("miss", [*at_night(3e-3), -3e-3, 7e-3, *at_night(-7e-3)])
def test_masts_and_supports_that_just_miss_the_outline_are_moved_to_it(tmp_path, miss):
    def held(x, name):
        lines = (
            ("line", "support", (0, 6, 5), (0, 0, 5)),
            ("point", "mast", (10, 0, 2)),
            ("line", "mast", (10 + x, 6 + x, 0), (10 + x, 6 + x, 3)),
            ("point", "support", (10 + x, 3, 4)),
        )
        lines = (("line", "support", (x, 6 - x, 5), (x, 0, 5)), *lines[1:])
        folder = tmp_path / name
        folder.mkdir()
        return read_drawing(drawing(folder, *lines))

    exact, near = held(0.0, "exact"), held(miss, "near")
    for one, other in zip(near.supports, exact.supports, strict=True):
        ends = [s.at([0.0, 1.0]) if hasattr(s, "at") else s for s in (one, other)]
        np.testing.assert_allclose(*ends, atol=1e-12)
    assert not exact.notes
    text = "4 points of supports moved by up to"
    assert any(text in note for note in near.notes)
    assert (
        plan_from(proposed(near)).surface().vertices == plan_from(proposed(exact)).surface().vertices
    ).all()
