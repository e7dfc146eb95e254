"""Drawings as files that other programs read: .dxf, .pdf, .svg and .3dm."""

from __future__ import annotations

import re
import sys
import warnings
import xml.etree.ElementTree as ET
from dataclasses import replace

import ezdxf
import numpy as np
import pytest
import rhino3dm
from nightly import at_night
from refusals import refused
from shapes import length

import pcmc
from generators import hypar_roof
from pcmc.base.errors import FileError, MissingExtra
from pcmc.base.units import Units
from pcmc.drawings import FORMATS, drawing_set
from pcmc.drawings.sheet import LAYERS, SMALL
from pcmc.surface.colours import patch_colors


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


def test_a_pdf_alone_needs_no_ezdxf(tmp_path, monkeypatch, drawings):
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    drawings.write(tmp_path / "roof.pdf")
    for suffix in (".dxf", ".svg"):
        with pytest.raises(MissingExtra, match=r"ezdxf is not installed.*pcmc-surfaces\[cad\]"):
            drawings.write(tmp_path / "roof.pdf", tmp_path / f"roof{suffix}")
    assert [path.name for path in tmp_path.iterdir()] == ["roof.pdf"]


def test_a_name_longer_than_dxf_allows_is_cut(tmp_path, squares):
    patches = [replace(patch, name=f"{patch.name} {'x' * 85}") for patch in squares.patches]
    given = (squares.vertices, squares.faces, squares.patch_of_face, patches, squares.fixed)
    roof = pcmc.Surface(*given, on_plane=squares.on_plane)
    drawing_set(roof, "m", sheet="A3", anyway=True).write(tmp_path / "roof.dxf")
    lines = ezdxf.readfile(tmp_path / "roof.dxf").modelspace().query("POLYLINE")
    sizes = [len(line.get_xdata("PCMC")[0].value) for line in lines]
    assert 200 < max(sizes) <= 255


@pytest.mark.parametrize(
    ("units", "code", "metric"),
    [("ft", 2, 0), *at_night(("mm", 4, 1), ("cm", 5, 1), ("in", 1, 0))],
)
def test_units_reach_the_header_and_the_scale(tmp_path, squares, units, code, metric):
    drawings = drawing_set(squares, units, sheet="A0")
    drawings.write(tmp_path / "roof.dxf")
    doc = ezdxf.readfile(tmp_path / "roof.dxf")
    assert (doc.header["$INSUNITS"], doc.header["$MEASUREMENT"]) == (code, metric)
    digits = {one.decimals for sheet in drawings.sheets for one in sheet.dimensions}
    assert digits == {4 if units == "ft" else 3}  # four of a size of 9, a millimetre or better
    plan = drawings.sheets[0]
    rims = np.concatenate([line.points for line in plan.lines if line.layer == "PCMC-RIM"])
    drawn, real = map(int, plan.scale.split(":"))
    scale = real / drawn
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
