"""Drawings: exact sections, panels at true size, and files that other programs read."""

from __future__ import annotations

import re
import sys
import warnings
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import combinations

import ezdxf
import numpy as np
import pytest
import rhino3dm
from refusals import refused
from shapely.geometry import Polygon

import pcmc
from generators import hypar_roof, spherical_cap, two_squares
from pcmc.base.errors import FileError, OptionError, SurfaceError
from pcmc.base.units import Units
from pcmc.cli import main
from pcmc.drawings import FORMATS, drawing_set
from pcmc.drawings.panel_sheets import panel_sheets, triangles_at_true_size
from pcmc.drawings.sheet import LAYERS, SMALL, SheetLine, box, corner, drawing_area
from pcmc.drawings.views import ELEVATIONS, profile
from pcmc.plan import Plan
from pcmc.surface import mirrored
from pcmc.surface.colours import patch_colors
from pcmc.surface.geometry import cross_2d, edge_vectors
from pcmc.surface.sections import section

UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def squares():
    """Example 1 at rest."""
    return pcmc.solve(two_squares(6, alpha_aux=1.0)).surface


@pytest.fixture(scope="module")
def drawings(squares):
    return drawing_set(squares, "m", sheet="A3", tolerance=0.01, name="two squares")


def length(points, closed=False):
    ends = np.append(points, points[:1], axis=0) if closed else points
    return float(np.linalg.norm(np.diff(ends, axis=0), axis=1).sum())


# ------------------------------------------------------------------------------------ sections


def test_the_sections_of_a_sphere_come_near_its_circles_with_order_2():
    """At height h the cap of a sphere of radius r has a circle of radius √(r² - (h + d)²)."""
    errors = []
    for edge in (0.3, 0.15, 0.075):
        cap = pcmc.solve(spherical_cap(edge_length=edge)).surface
        top, rim = cap.vertices[:, 2].max(), np.linalg.norm(cap.vertices[:, :2], axis=1).max()
        radius = (top**2 + rim**2) / (2.0 * top)
        (line,) = section(cap, 0.5 * top * UP, UP)
        assert line.closed
        assert np.abs(line.points[:, 2] - 0.5 * top).max() <= 1e-14
        circle = np.sqrt(radius**2 - (0.5 * top - top + radius) ** 2)
        errors.append(abs(length(line.points, True) / (2.0 * np.pi * circle) - 1.0))
    assert 1.7 < np.log2(errors[0] / errors[-1]) / 2.0 < 2.3  # it swings: the plane cuts where it happens to


def test_every_point_of_a_section_is_on_an_edge_and_in_the_plane(squares):
    normal = np.array([0.6, 0.8, 0.0])
    topo, X = squares.topology, squares.vertices
    lines = section(squares, np.array([0.3, 0.1, 0.0]), normal)
    assert {line.patch for line in lines} == {0, 1, 2}  # the wall, too
    for line in lines:
        assert np.abs((line.points - [0.3, 0.1, 0.0]) @ normal).max() <= 1e-13
        a, b = X[topo.edges[:, 0]], X[topo.edges[:, 1]]
        for point in line.points:
            detour = np.linalg.norm(point - a, axis=1) + np.linalg.norm(point - b, axis=1)
            assert (detour - np.linalg.norm(b - a, axis=1)).min() <= 1e-12


def test_a_plane_through_vertices_gives_one_line_per_patch_and_one_at_the_rim_none(squares):
    lines = section(squares, np.zeros(3), np.array([0.0, 1.0, 0.0]))
    assert sorted(line.patch for line in lines if line.patch < 2) == [0, 1]
    left = next(line for line in lines if line.patch == 0)
    assert sorted({float(left.points[0, 0]), float(left.points[-1, 0])}) == pytest.approx([-4.0, 0.0])
    assert (np.linalg.norm(np.diff(left.points, axis=0), axis=1) > 0.0).all()
    assert section(squares, np.zeros(3), UP) == []


# ---------------------------------------------------------------------------------- panel sheets


@pytest.mark.parametrize(("name", "millimetres"), [("A4", 60.0), ("A3", 100.0), ("A1", 250.0)])
def test_panels_on_sheets_are_congruent_apart_and_within_the_frame(squares, name, millimetres):
    schedule = pcmc.panels(squares, 0.01)
    sheets = panel_sheets(triangles_at_true_size(schedule, millimetres), name)
    assert len(sheets) > 1
    number = 0
    low, high = corner(), corner() + drawing_area(name)
    for sheet in sheets:
        outlines = [line.points for line in sheet.lines if line.layer == "PCMC-CUT"]
        for outline in outlines:
            face = squares.faces[schedule.panels["face"][number]]
            solid = np.linalg.norm(edge_vectors(squares.vertices[face]), axis=1)
            flat = np.linalg.norm(edge_vectors(np.pad(outline, ((0, 0), (0, 1)))), axis=1)
            assert np.abs(flat / millimetres - solid).max() <= 1e-9
            turn = cross_2d(outline[1] - outline[0], outline[2] - outline[0])
            assert turn > 0.0  # outside up, never turned over
            assert (outline >= low - 1e-9).all()
            assert (outline <= high + 1e-9).all()
            number += 1
        shapes = [Polygon(outline) for outline in outlines]
        assert max((a.intersection(b).area for a, b in combinations(shapes, 2)), default=0.0) < 1e-9
    assert number == len(schedule.panels)


def test_labels_of_neighbours_name_each_other_and_the_same_edge(squares):
    schedule = pcmc.panels(squares, 0.01)
    labels = {}
    number = 0
    for sheet in panel_sheets(triangles_at_true_size(schedule, 100.0), "A3"):
        texts = [text.text for text in sheet.texts if text.layer == "PCMC-LABEL"]
        for k in range(0, len(texts), 3):
            number += 1
            labels[number] = texts[k : k + 3]
    seen = 0
    for panel, edges in labels.items():
        for text in edges:
            others, edge = re.fullmatch(r"(\d+|rim) / e(\d+)", text).groups()
            face = squares.faces[schedule.panels["face"][panel - 1]]
            assert set(squares.topology.edges[int(edge)]) <= set(face)
            if others != "rim":
                assert f"{panel} / e{edge}" in labels[int(others)]
                seen += 1
    assert seen == 2 * int((schedule.edges["neighbour"] > 0).sum())


def test_panels_larger_than_the_sheet_are_flat_at_true_size_in_model_space(tmp_path, squares):
    drawings = drawing_set(squares, "m", sheet="A4", tolerance=0.01, panel_sheets=True)
    titles = [sheet.title for sheet in drawings.sheets]
    assert titles[-1] == "Panels larger than A4: flat at true size in the model space of the .dxf"
    listed = [text.text for sheet in drawings.sheets for text in sheet.texts if sheet.title == titles[-1]]
    assert {str(k) for k in drawings.schedule.panels["panel"]} <= set(listed)
    drawings.write(tmp_path / "roof.dxf")
    doc = ezdxf.readfile(tmp_path / "roof.dxf")
    outlines = [np.array(o.get_points("xy")) for o in doc.modelspace().query('LWPOLYLINE[layer=="PCMC-CUT"]')]
    assert len(outlines) == len(drawings.schedule.panels)
    for outline, face in zip(outlines, drawings.schedule.panels["face"], strict=True):
        solid = np.linalg.norm(edge_vectors(squares.vertices[squares.faces[face]]), axis=1)
        flat = np.linalg.norm(edge_vectors(np.pad(outline, ((0, 0), (0, 1)))), axis=1)
        assert np.abs(flat - solid).max() <= 1e-9
    shapes = [Polygon(outline) for outline in outlines]
    assert max(a.intersection(b).area for a, b in combinations(shapes, 2)) < 1e-9
    assert min(outline[:, 0].min() for outline in outlines) > squares.vertices[:, 0].max()
    longest = drawings.schedule.panels[["a", "b", "c"]].max(axis=1).median()
    some = panel_sheets(
        triangles_at_true_size(drawings.schedule, 400.0 / longest), "A3"
    )  # some fit, and some do not
    assert {sheet.title.split()[1] == "larger" for sheet in some} == {True, False}


# ---------------------------------------------------------------------------------------- files


def test_the_dxf_passes_the_audit_and_has_the_roof_in_its_units(tmp_path, squares, drawings):
    drawings.write(tmp_path / "roof.dxf")
    doc = ezdxf.readfile(tmp_path / "roof.dxf")
    audit = doc.audit()
    assert not audit.errors
    assert not audit.fixes
    assert doc.header["$INSUNITS"] == ezdxf.units.M
    assert doc.header["$MEASUREMENT"] == 1
    assert doc.dimstyles.get("PCMC").dxf.dimtxt == SMALL
    assert {line.dxf.dimstyle for sheet in doc.layouts for line in sheet.query("DIMENSION")} == {"PCMC"}
    for name, layer in LAYERS.items():
        assert doc.layers.get(name).dxf.lineweight == layer.weight
    model = doc.modelspace()
    assert len(model.query("3DFACE")) == int((~squares.walls[squares.patch_of_face]).sum())
    ridge = [np.array(list(line.points())) for line in model.query('POLYLINE[layer=="PCMC-RIDGE"]')]
    junction = squares.vertices[squares.topology.junctions[0].vertices]
    assert sum(map(length, ridge)) == pytest.approx(length(junction), abs=1e-12)
    points = np.array([tuple(p.dxf.location) for p in model.query("POINT")])
    assert np.array_equal(points, drawings.points[["x", "y", "z"]].to_numpy())
    assert {text.dxf.text for text in model.query("TEXT")} == set(drawings.points["point"])
    assert len(doc.layouts) == 1 + len(drawings.sheets)
    assert doc.layouts.names_in_taborder()[1:4] == ["Plan", "Elevations", "Sections at heights"]
    first = doc.layouts.get("Plan")
    assert (first.dxf.paper_width, first.dxf.paper_height) == FORMATS["A3"]
    shown = {text.dxf.text for text in first.query("TEXT")}
    assert {"Plan", f"sheet 1 of {len(drawings.sheets)}"} <= shown


def test_sheets_are_dimensioned_between_corners_of_the_outline_not_over_the_bulge(tmp_path, squares):
    bulge = np.where(squares.free[:, None], [1.0, 3.0, 1.0], 1.0)
    moved = drawing_set(squares.moved(squares.vertices * bulge), "m", sheet="A3", anyway=True)
    assert np.ptp(moved.surface.vertices, axis=0)[1] > 5.0  # the outline is 8 by 4
    moved.write(tmp_path / "roof.dxf")
    doc = ezdxf.readfile(tmp_path / "roof.dxf")
    assert not doc.audit().errors

    def measured(name, angle):
        entities = [d for d in doc.layouts.get(name).query("DIMENSION") if d.dxf.angle == angle]
        return sorted(round(d.get_measurement() * d.override().get("dimlfac"), 6) for d in entities)

    assert measured("Plan", 0.0) == [4.0, 4.0, 8.0]
    assert measured("Plan", 90.0) == [4.0]
    assert measured("Elevations", 0.0) == [4.0, 4.0, 8.0, 8.0]
    top = f"+{squares.vertices[:, 2].max():.3f}"
    texts = [text.dxf.text for text in doc.layouts.get("Elevations").query('TEXT[layer=="PCMC-DIM"]')]
    assert sorted(set(texts)) == sorted({top, "±0.000"})


def test_cables_are_whole_curves_with_names_and_masts_are_marked(tmp_path):
    solved = pcmc.solve(hypar_roof(6)).surface
    first, *others = solved.cables
    sail = solved.rebuilt(cables=[replace(first, name="%%c 20 ^J %%%"), *others])
    drawings = drawing_set(sail, Units("m", "kN"), sheet="A3")
    drawings.write(tmp_path / "sail.dxf")
    doc = ezdxf.readfile(tmp_path / "sail.dxf")
    lines = doc.modelspace().query('POLYLINE[layer=="PCMC-CABLE"]')
    names = [line.get_xdata("PCMC")[0].value for line in lines]
    assert sorted(names) == sorted(cable.name for cable in sail.cables)
    total = sum(length(np.array(list(line.points()))) for line in lines)
    assert total == pytest.approx(pcmc.certify(sail).cables["length"].sum())
    masts = np.array([tuple(p.dxf.location) for p in doc.modelspace().query('POINT[layer=="PCMC-SUPPORT"]')])
    np.testing.assert_array_equal(masts, sail.vertices[sail.pinned])
    plan = {text.plain_text() for text in doc.layouts.get("Plan").query("TEXT")}
    assert {"S1", "S2", "S3", "S4", *names} <= plan
    listed = {text.plain_text() for text in doc.layouts.get("Cables").query("TEXT")}
    assert {"force, kN", *names} <= listed
    assert {"S4", "point", "force_z, kN"} <= {t.dxf.text for t in doc.layouts.get("Supports").query("TEXT")}


def test_setting_out_begins_with_the_ends_of_the_ridge(squares, drawings):
    first = drawings.points.iloc[:2][["point", *"xyz"]].to_numpy().tolist()
    ridge = squares.vertices[squares.topology.junctions[0].vertices]
    assert sorted(first[k][1:] for k in (0, 1)) == sorted(ridge[[0, -1]].tolist())
    assert [row[0] for row in first] == ["P1", "P2"]


def test_sections_are_at_quarters_of_the_height_and_through_the_middle_or_along_a_line():
    """Of a pyramid over 2 ≤ x ≤ 4, 5 ≤ y ≤ 7, with its tip at (3.5, 6, 3), 2 above its base."""
    X = [[4, 7, 1], [2, 7, 1], [2, 5, 1], [4, 5, 1], [3.5, 6, 3]]
    F = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    roof = pcmc.Surface(X, F, [0] * 4, [pcmc.Patch("roof", 1.0)], fixed=range(4))

    def texts(found):
        sheet = next(sheet for sheet in found.sheets if sheet.title == "Sections along lines")
        return {text.text for text in sheet.drawn()[1]}

    usual = drawing_set(roof, "m", sheet="A3", anyway=True)
    *level, along_x, along_y = usual.sections
    for line, z, side in zip(level, (1.5, 2.0, 2.5), (1.5, 1.0, 0.5), strict=True):
        assert line.closed
        np.testing.assert_allclose(line.points[:, 2], z)
        np.testing.assert_allclose(np.ptp(line.points[:, :2], axis=0), side)
    np.testing.assert_allclose(sorted(along_x.points.tolist()), [[2, 6, 1], [3.5, 6, 3], [4, 6, 1]])
    np.testing.assert_allclose(sorted(along_y.points[[0, -1]].tolist()), [[3, 5, 1], [3, 7, 1]])
    assert texts(usual) >= {"from (2, 6) towards (4, 6)", "from (3, 5) towards (3, 7)", "2.000", "+2.333"}
    diagonal = drawing_set(roof, "m", sheet="A3", anyway=True, lines=[((2.9, 5.9), (3.1, 6.1))])
    assert texts(diagonal) >= {"2.828", "+2.600"}


def test_a_name_longer_than_dxf_allows_is_cut(tmp_path, squares):
    patches = [replace(patch, name=f"{patch.name} {'x' * 85}") for patch in squares.patches]
    given = (squares.vertices, squares.faces, squares.patch_of_face, patches, squares.fixed)
    roof = pcmc.Surface(*given, on_plane=squares.on_plane)
    drawing_set(roof, "m", sheet="A3", anyway=True).write(tmp_path / "roof.dxf")
    lines = ezdxf.readfile(tmp_path / "roof.dxf").modelspace().query("POLYLINE")
    sizes = [len(line.get_xdata("PCMC")[0].value) for line in lines]
    assert 200 < max(sizes) <= 255


def test_an_elevation_shows_what_faces_the_viewer_with_right_on_the_right():
    axes = {"x": np.array([1.0, 0.0, 0.0]), "y": np.array([0.0, 1.0, 0.0])}
    for title, (right, towards) in ELEVATIONS.items():
        looks = axes[title[-1]] * (1.0 if "along" in title else -1.0)
        assert np.array_equal([*towards, 0.0], -looks)
        assert np.array_equal([*right, 0.0], np.cross(looks, UP))


def test_a_section_is_dimensioned_between_its_ends_or_its_widest_points():
    arch = np.array([[1.0, 2.0, 0.0], [2.0, 2.0, 1.5], [4.0, 2.0, 0.5]])
    ring = np.array([[6.0, 2.0, 1.0], [7.0, 2.0, 2.0], [8.0, 2.0, 1.0], [7.0, 2.0, 0.0]])
    lines = [SheetLine(arch, "PCMC-SECTION"), SheetLine(ring, "PCMC-SECTION", closed=True)]
    view = profile("A", np.array([1.0, 0.0]), np.array([1.0, 0.0]), lines)
    assert sorted(view.stations[0]) == [0.0, 3.0, 5.0, 7.0]
    assert sorted(set(view.levels)) == [0.0, 0.5, 1.0, 2.0]


def test_no_text_of_a_sheet_covers_another(drawings):
    sail = drawing_set(pcmc.solve(hypar_roof(8, weight=0.02)).surface, "m", sheet="A3", tolerance=0.1)
    for sheet in (*drawings.sheets, *sail.sheets):
        boxes = np.array([box(text) for text in sheet.drawn()[1]])
        low, high = boxes[:, None, 0], boxes[None, :, 1]
        both = (low < high).all(axis=2)
        assert (both & both.T).sum() == len(boxes), sheet.title


@pytest.mark.parametrize(
    ("units", "code", "metric"), [("mm", 4, 1), ("cm", 5, 1), ("ft", 2, 0), ("in", 1, 0)]
)
def test_units_reach_the_header_and_the_scale(tmp_path, squares, units, code, metric):
    drawings = drawing_set(squares, units, sheet="A0")
    drawings.write(tmp_path / "roof.dxf")
    doc = ezdxf.readfile(tmp_path / "roof.dxf")
    assert (doc.header["$INSUNITS"], doc.header["$MEASUREMENT"]) == (code, metric)
    digits = {one.decimals for sheet in drawings.sheets for one in sheet.dimensions}
    assert digits == {{"mm": 0, "cm": 1, "ft": 4, "in": 2}[units]}
    plan = drawings.sheets[0]
    rims = np.concatenate([line.points for line in plan.lines if line.layer == "PCMC-RIM"])
    scale = int(plan.scale.removeprefix("1:"))
    millimetres = {"mm": 1.0, "cm": 10.0, "ft": 304.8, "in": 25.4}[units]
    assert np.ptp(rims, axis=0).tolist() == pytest.approx(
        [8.0 * millimetres / scale, 4.0 * millimetres / scale]
    )


def test_pdf_pages_and_svg_files_have_the_size_of_their_sheets(tmp_path, drawings):
    written = drawings.write(tmp_path / "roof.pdf", tmp_path / "roof.svg")
    count = len(drawings.sheets)
    names = ["roof.pdf", *(f"roof-{k + 1}.svg" for k in range(count))]
    assert [path.name for path in written] == names
    data = (tmp_path / "roof.pdf").read_bytes()
    boxes = re.findall(rb"/MediaBox \[ *0 0 ([\d.]+) ([\d.]+) *\]", data)
    assert len(boxes) == count
    for sides in boxes:
        assert [float(side) * 25.4 / 72.0 for side in sides] == pytest.approx(FORMATS["A3"], abs=0.01)
    root = ET.parse(tmp_path / "roof-1.svg").getroot()
    assert (root.get("width"), root.get("height")) == ("420mm", "297mm")
    drawings.write(tmp_path / "again.pdf")
    assert (tmp_path / "again.pdf").read_bytes() == data


def test_all_files_appear_together_or_none(tmp_path, monkeypatch, drawings):
    def fail(sheets, path):
        path.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    (tmp_path / "roof.dxf").write_text("old")
    monkeypatch.setattr(sys.modules["pcmc.drawings.drawing_set"], "write_pages", fail)
    with refused(FileError, what=str(tmp_path / "roof.pdf")):
        drawings.write(tmp_path / "roof.dxf", tmp_path / "roof.pdf", tmp_path / "roof.svg")
    assert [path.name for path in tmp_path.iterdir()] == ["roof.dxf"]
    assert (tmp_path / "roof.dxf").read_text() == "old"
    with refused(FileError, found=".dwg"):
        drawings.write(tmp_path / "roof.dwg")


def test_rhino_files_have_ridges_rims_and_walls_as_curves(tmp_path, squares):
    path = tmp_path / "roof.3dm"
    pcmc.write(path, squares)
    model = rhino3dm.File3dm.Read(str(path))
    lengths = {}
    for item in model.Objects:
        if isinstance(item.Geometry, rhino3dm.PolylineCurve):
            name = model.Layers[item.Attributes.LayerIndex].Name
            line = item.Geometry
            points = np.array([[p.X, p.Y, p.Z] for p in (line.Point(k) for k in range(line.PointCount))])
            lengths[name] = lengths.get(name, 0.0) + length(points)
    junction = squares.vertices[squares.topology.junctions[0].vertices]
    assert lengths["PCMC-RIDGE"] == pytest.approx(length(junction), abs=1e-9)
    assert lengths["PCMC-RIM"] == pytest.approx(24.0, abs=1e-9)
    assert "PCMC-WALL" in lengths
    shown = np.round(255.0 * patch_colors(squares)).astype(int).tolist()
    colors = {layer.Name: layer.Color for layer in model.Layers}
    assert [colors[patch.name] for patch in squares.patches] == [(*rgb, 255) for rgb in shown]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        again = pcmc.read(path)
    assert np.array_equal(np.sort(again.vertices, axis=0), np.sort(squares.vertices, axis=0))


# ------------------------------------------------------------------------------------- bad input


@pytest.mark.parametrize("units", [None, "", "parsec", 3])
def test_units_that_are_missing_or_unknown_are_refused(squares, units):
    with refused(OptionError, what="units", found=units):
        drawing_set(squares, units)


@pytest.mark.parametrize(
    ("options", "fields"),
    [
        ({"sheet": "B2"}, {"what": "sheet"}),
        ({"scale": 0}, {"what": "scale"}),
        ({"scale": 10, "sheet": "A4"}, {"what": "scale", "expected": "A0"}),
        ({"scale": 1, "sheet": "A4"}, {"what": "scale", "expected": None}),
        ({"heights": [9.0]}, {"what": "heights", "found": 9.0}),
        ({"heights": [float("nan")]}, {"what": "heights"}),
        ({"lines": [((0, 50), (1, 50))]}, {"what": "lines"}),
        ({"lines": [((1, 1), (1, 1))]}, {"what": "lines"}),
        ({"panel_sheets": True}, {"what": "tolerance"}),
        ({"tolerance": 0.0}, {"what": "tolerance"}),
    ],
)
def test_what_cannot_be_drawn_is_refused(squares, options, fields):
    with refused(OptionError, **fields):
        drawing_set(squares, "m", **options)


def test_a_surface_that_is_not_certified_is_refused_or_every_sheet_is_marked():
    start = two_squares(4, alpha_aux=1.0)
    with refused(SurfaceError, what="surface"):
        drawing_set(start, "m")
    drawings = drawing_set(start, "cm", tolerance=0.1, panel_sheets=True, sheet="A3", anyway=True)
    for sheet in drawings.sheets:
        assert [text.text for text in sheet.texts if text.layer == "PCMC-MARK"] == [
            "NOT CERTIFIED: not converged"
        ]


def test_what_is_known_of_a_surface_is_not_computed_again(monkeypatch, squares, drawings):
    def computed(*_, **__):
        raise AssertionError

    certificate, schedule = drawings.certificate, drawings.schedule
    monkeypatch.setattr("pcmc.certificate.certificate.certify", computed)
    again = pcmc.panels(squares, 0.01, certificate=certificate)
    assert again.certificate is certificate
    model = pcmc.StructuralModel(squares, pcmc.Material(1e6), 0.001, certificate=certificate)
    assert model.certificate is certificate
    drawn = drawing_set(squares, "m", sheet="A3", certificate=certificate, schedule=schedule)
    assert (drawn.certificate, drawn.schedule) == (certificate, schedule)
    assert [sheet.title for sheet in drawn.sheets] == [sheet.title for sheet in drawings.sheets]
    other = squares.moved(squares.vertices.copy())
    with refused(OptionError, what="schedule"):
        drawing_set(other, "m", schedule=schedule, certificate=certificate)
    lower = squares.retensioned({"left": 3.7})
    with refused(SurfaceError, what="certificate"):
        pcmc.panels(lower, 0.01, certificate=certificate)


def test_sheets_of_a_half_say_so_and_the_whole_is_twice_as_wide():
    outline = [[0, 0], [4, 0], [4, 6], [0, 6]]
    half = Plan(outline, mirrors=[[[0, 0], [0, 6]]], tension=3.0, edge_length=1.0).surface()
    for surface, part, across in ((half, True, "4.000"), (mirrored(half), False, "8.000")):
        plan = drawing_set(surface, "m", sheet="A3", anyway=True).sheets[0]
        assert any("behind its mirror planes" in text.text for text in plan.texts) is part
        assert plan.dimensions[0].text == across


def test_a_certified_surface_has_no_mark(drawings):
    assert not [t for sheet in drawings.sheets for t in sheet.texts if t.layer == "PCMC-MARK"]


def test_the_command_draws_a_file(tmp_path, squares, capsys):
    roof = tmp_path / "roof.pcmc"
    pcmc.write(roof, squares)
    options = ["--units", "m", "--sheet", "A3", "--height", "0.2", "--line=-4,0.1,4,0.1"]
    assert main(["draw", str(roof), "-o", str(tmp_path / "roof.dxf"), *options]) == 0
    assert "sheets A3" in capsys.readouterr().out
    assert {path.name for path in tmp_path.iterdir()} == {"roof.pcmc", "roof.dxf"}


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["--units", "m", "--scale", "1"],
        ["--units", "m", "--line", "1,2,3"],
        ["--units", "m", "--height", "high"],
        ["--units", "m", "--panel-sheets"],
        ["--units", "m", "-o", "{}/roof.dwg"],
    ],
)
def test_the_command_refuses_bad_input_in_one_line(tmp_path, squares, capsys, options):
    roof = tmp_path / "roof.pcmc"
    pcmc.write(roof, squares)
    words = [text.format(tmp_path) for text in options]
    assert main(["draw", str(roof), "-o", str(tmp_path / "roof.dxf"), *words]) == 2
    assert capsys.readouterr().err.strip().count("\n") == 0
    assert [path.name for path in tmp_path.iterdir()] == ["roof.pcmc"]
