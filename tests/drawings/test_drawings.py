"""Drawings: their sheets, marks and points, the command, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused
from shapes import bubbles

import pcmc
from generators import hypar_roof, spherical_cap, two_squares
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.base.units import Units
from pcmc.cli import main
from pcmc.drawings import drawing_set, dxf
from pcmc.drawings.sheet import MEMBERS, SheetLine, Text, box, column, place_labels
from pcmc.drawings.views import model_curves, plan_view
from pcmc.io.mesh_data import scaled_surface
from pcmc.plan import Plan
from pcmc.surface import mirrored


def test_setting_out_begins_with_the_ends_of_the_ridge(squares, drawings):
    first = drawings.points.iloc[:2][["point", *"xyz"]].to_numpy().tolist()
    ridge = squares.vertices[squares.topology.junctions[0].vertices]
    assert sorted(first[k][1:] for k in (0, 1)) == sorted(ridge[[0, -1]].tolist())
    assert [row[0] for row in first] == ["P1", "P2"]


def test_no_text_of_a_sheet_covers_another(drawings):
    sail = drawing_set(pcmc.solve(hypar_roof(8, weight=0.02)).surface, "m", sheet="A3", tolerance=0.1)
    for sheet in (*drawings.sheets, *sail.sheets):
        boxes = np.array([box(text) for text in sheet.drawn()[1]])
        low, high = boxes[:, None, 0], boxes[None, :, 1]
        both = (low < high).all(axis=2)
        assert (both & both.T).sum() == len(boxes), sheet.title


def test_a_cushion_has_the_dimensions_of_its_rim():
    """Its two sheets leave no open edge: the rim is the line where they meet."""
    plan = Plan([[0, 0], [5, 0], [6, 3], [1, 4]], edge_length=1.0, tension=1.5, pressure=0.4, cushion=1.2)
    sheets = drawing_set(pcmc.solve(plan.surface()).surface, "m", sheet="A3").sheets
    found = {sheet.title: sorted({d.text for d in sheet.dimensions}) for sheet in sheets}
    assert found["Plan"] == ["1.000", "3.000", "4.000", "6.000"]
    assert found["Elevations"] == ["4.000", "6.000"]


@pytest.mark.parametrize(
    ("unit", "factor"), [("m", 1.0), ("mm", 1e3), ("mm", 0.5), ("m", 5e-4), ("m", 300.0)]
)
def test_numbers_have_four_digits_in_every_unit_and_size(squares, unit, factor):
    """From a model of a few millimetres to a roof of kilometres, each at a scale that fills its sheet."""
    about = {"sheet": "A4", "tolerance": 0.01 * factor}
    drawings = drawing_set(scaled_surface(squares, factor), Units(unit, "kN"), **about)
    sheets = {sheet.title: sheet for sheet in drawings.sheets}
    texts = {title: {text.text for text in sheet.texts} for title, sheet in sheets.items()}
    shown = [float(dimension.text) for dimension in sheets["Plan"].dimensions]
    sizes = np.ptp(squares.vertices[:, :2], axis=0) * factor
    assert max(shown) == pytest.approx(sizes.max(), rel=1e-3)
    rim = np.concatenate([line.points for line in sheets["Plan"].lines if line.layer == "PCMC-RIM"])
    assert 40.0 < np.ptp(rim, axis=0).max() < 250.0  # mm
    forces = pcmc.certify(squares).supports[["force_x", "force_y", "force_z"]].to_numpy()
    assert {f"{force:.2f}" for force in forces.ravel()} <= texts["Supports"]
    (largest,) = pcmc.panels(squares, 0.01).families["area"].nlargest(1) * factor**2
    assert column([largest])[0] in texts["Families of panels"]
    assert f"area, {unit}²" in texts["Families of panels"]


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
    assert marks_of(drawings) == {"NOT CERTIFIED: not converged"}


def marks_of(drawings):
    """The marks in the model and on the sheets, each with one."""
    doc = dxf.document(drawings)
    found = [space.query("TEXT[layer=='PCMC-MARK']") for space in doc.layouts]
    assert [len(marks) for marks in found] == [1] * (len(drawings.sheets) + 1)
    return {mark.dxf.text for marks in found for mark in marks}


def test_a_roof_that_cuts_itself_and_one_that_misses_its_targets_are_marked(squares):
    near = bubbles(0.9 * 2.0 * spherical_cap(0.25).vertices[:, 0].max())
    assert marks_of(drawing_set(near, "m")) == {"NOT TO BE BUILT: it cuts itself"}
    assert marks_of(drawing_set(squares, "m", mark="TARGETS NOT MET")) == {"TARGETS NOT MET"}


def test_a_mark_of_several_lines_is_refused_before_a_file_is_written(tmp_path, squares):
    """The second line would be a line of the file."""
    model, net = pcmc.StructuralModel(squares, pcmc.Material(1e6), 0.001), pcmc.panel_net(squares, 0.3)
    for write in (
        lambda mark: drawing_set(squares, "m", mark=mark),
        lambda mark: pcmc.write(tmp_path / "roof.obj", squares, mark=mark),
        lambda mark: pcmc.write_structure(tmp_path / "roof.inp", model, mark=mark),
        lambda mark: net.write_obj(tmp_path / "net.obj", mark=mark),
    ):
        with refused(OptionError, what="mark"):
            write("TARGETS\nNOT MET")
    assert not list(tmp_path.iterdir())


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


def test_the_name_of_a_line_stands_at_its_middle():
    roof = spherical_cap(0.3)
    stay = SheetLine(np.array([[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]]), MEMBERS, name="stay")
    view = plan_view(roof, [*model_curves(roof), stay], [])
    assert [(at.tolist(), name) for at, name, _ in view.texts] == [([2.0, 0.0], "stay")]


def test_labels_keep_off_lines_where_there_is_room():
    slanted = SheetLine(np.array([[-40.0, -30.0], [40.0, 30.0]]), "PCMC-RIDGE")
    labels = [Text(at * slanted.points[1] + [0.5, 1.0], f"P{k}") for k, at in enumerate((-0.5, 0.0, 0.5))]
    across = np.array([0.6, -0.8])  # at right angles to the line, which goes through 0
    for lines in ([], [slanted]):
        placed = place_labels(labels, [], lines, rings=2)
        (x0, y0), (x1, y1) = np.moveaxis([box(label) for label in placed], 0, -1)
        sides = np.sign([np.array(corner).T @ across for corner in ((x0, y0), (x0, y1), (x1, y0), (x1, y1))])
        assert (sides != sides[0]).any() == (not lines)
    field = [SheetLine(np.array([[-40.0, y], [40.0, y]]), "PCMC-RIDGE") for y in np.arange(-30.0, 30.0)]
    full, free = (np.array([label.at for label in place_labels(labels, [], some)]) for some in (field, []))
    np.testing.assert_array_equal(full, free)  # without room as without lines
