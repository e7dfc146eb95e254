"""Units of length and force, and files that carry them."""

import warnings
from contextlib import nullcontext

import ezdxf
import ezdxf.units
import numpy as np
import pytest
import rhino3dm
import trimesh
from drawn import drawing
from refusals import refused

import pcmc
from generators import two_squares
from pcmc import cli
from pcmc.base.errors import FileError, FileWarning, LostWarning, OptionError
from pcmc.base.units import FORCES, LENGTHS, MICROMETRES, Units, conversion_note, length_factor, unlikely_size
from pcmc.io.mesh_data import in_new_unit, scaled_surface
from pcmc.plan.drawing import read_drawing
from pcmc.project import load
from pcmc.surface import Room
from pcmc.surface.colours import patch_colors


@pytest.fixture(scope="module")
def roof():
    """Two patches at rest with a wall between them."""
    return pcmc.solve(two_squares(3, alpha_aux=1.0)).surface


@pytest.mark.parametrize("source", MICROMETRES)
@pytest.mark.parametrize("target", MICROMETRES)
def test_there_and_back_is_the_same_length(source, target):
    assert length_factor(source, target) * length_factor(target, source) == pytest.approx(1.0, rel=1e-15)


def test_factors_are_exact_quotients():
    assert length_factor("yd", "ft") == 3.0
    assert length_factor("cm", "dm") == 0.1
    assert length_factor("ft", "m") == 0.3048
    assert length_factor("mm", "") == length_factor("", "mm") == 1.0
    assert not conversion_note("", "m")
    assert not conversion_note("m", "m")


@pytest.mark.parametrize("code", [1, 2, 3, 4, 5, 6, 7, 10, 13, 14])
def test_a_dxf_drawing_in_any_unit_has_the_size_that_its_code_says(tmp_path, code):
    """The codes of ``$INSUNITS`` against ezdxf's own table; 0 and 21 (US survey feet) are no units here."""
    metres = ezdxf.units.conversion_factor(ezdxf.units.InsertUnits(code), ezdxf.units.M)
    plan = read_drawing(drawing(tmp_path, unit=code), "m")
    size = np.ptp(plan.outline.at(plan.outline.dense), axis=0)[:2]
    np.testing.assert_allclose(size, [10.0 * metres, 6.0 * metres], rtol=1e-8)


@pytest.mark.parametrize(("code", "notes"), [(0, 0), (21, 1)])
def test_a_dxf_drawing_in_an_unknown_unit_says_so(tmp_path, code, notes):
    plan = read_drawing(drawing(tmp_path, unit=code), "m")
    assert not plan.unit
    assert sum("its unit of length (21) is unknown here" in note for note in plan.notes) == notes


def test_every_unit_gives_its_texts():
    for length in LENGTHS:
        for force in FORCES:
            units = Units(length, force)
            assert units.pressure == f"{force}/{length}²"
            assert units.energy == f"{force}·{length}"
    assert (Units().area, Units().volume, Units().pressure) == ("length²", "length³", "force/length²")
    assert not Units()
    assert Units("m")


def test_wrong_units_are_refused():
    with refused(OptionError, what="units", found="meter"):
        Units("meter")
    with refused(OptionError, what="force", found="kg"):
        Units("m", "kg")
    with refused(OptionError, what="units"):
        Units(force="kN")
    with refused(OptionError, what="units", found="furlong"):
        length_factor("furlong", "m")


def size_in_rhino(path):
    """The bounding box of all meshes in a Rhino file, and its unit system, as rhino3dm reads them."""
    model = rhino3dm.File3dm.Read(str(path))
    points = [
        (p.X, p.Y, p.Z)
        for item in model.Objects
        if isinstance(item.Geometry, rhino3dm.Mesh)
        for p in item.Geometry.Vertices.ToPoint3dArray()
    ]
    return np.ptp(points, axis=0), model.Settings.ModelUnitSystem


def in_millimetres(path):
    """A roof of 12 m on 12 m drawn in millimetres by another program."""
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    mesh = rhino3dm.Mesh()
    for x, y, z in ((0, 0, 0), (12000, 0, 0), (12000, 12000, 0), (0, 12000, 0), (6000, 6000, 3000)):
        mesh.Vertices.Add(x, y, z)
    for a, b in ((0, 1), (1, 2), (2, 3), (3, 0)):
        mesh.Faces.AddFace(a, b, 4)
    model.Objects.AddMesh(mesh)
    model.Write(str(path), 7)
    return path


def test_a_rhino_file_in_millimetres_keeps_its_size(tmp_path):
    path = in_millimetres(tmp_path / "mm.3dm")
    with pytest.warns(FileWarning, match=r"lengths converted from mm to m \(1 mm = 0.001 m\)"):
        roof = pcmc.read(path, tensions=3.0)
    assert np.ptp(roof.vertices, axis=0).tolist() == [12.0, 12.0, 3.0]
    assert roof.patches[0].tension == 3.0  # given, in force/m
    assert roof.patches[0].pressure == 1.0  # the file has none
    pcmc.write(tmp_path / "m.3dm", roof, units="m")
    size, unit = size_in_rhino(tmp_path / "m.3dm")
    np.testing.assert_allclose(size, [12.0, 12.0, 3.0], rtol=1e-12)
    assert unit == rhino3dm.UnitSystem.Meters
    same = pcmc.read(path, units="mm")
    pcmc.write(tmp_path / "back.3dm", same, units="mm")
    size, unit = size_in_rhino(tmp_path / "back.3dm")
    np.testing.assert_allclose(size, [12000.0, 12000.0, 3000.0], rtol=1e-12)
    assert unit == rhino3dm.UnitSystem.Millimeters


RHINO = {"Microns": 1e-6, "Millimeters": 1e-3, "Centimeters": 0.01, "Decimeters": 0.1, "Meters": 1.0}
RHINO |= {"Kilometers": 1e3, "Inches": 0.0254, "Feet": 0.3048, "Yards": 0.9144, "Miles": 1609.344}


@pytest.mark.parametrize("system", RHINO)
def test_a_rhino_file_in_any_unit_has_the_size_that_its_unit_says(tmp_path, system):
    path = in_millimetres(tmp_path / "a.3dm")
    model = rhino3dm.File3dm.Read(str(path))
    model.Settings.ModelUnitSystem = getattr(rhino3dm.UnitSystem, system)
    model.Write(str(path), 7)
    with pytest.warns(FileWarning) if system != "Meters" else nullcontext():
        roof = pcmc.read(path, units="m")
    size = RHINO[system] * np.array([12000.0, 12000.0, 3000.0])
    np.testing.assert_allclose(np.ptp(roof.vertices, axis=0), size, rtol=1e-9)


def test_layers_of_a_rhino_file_have_the_colours_of_their_patches(tmp_path, roof):
    pcmc.write(tmp_path / "a.3dm", roof)
    layers = {layer.Name: layer.Color for layer in rhino3dm.File3dm.Read(str(tmp_path / "a.3dm")).Layers}
    for patch, color in zip(roof.patches, patch_colors(roof), strict=True):
        assert layers[patch.name] == (*(255.0 * color).round(), 255)


@pytest.mark.parametrize(
    ("units", "system"),
    [("m", "Meters"), ("mm", "Millimeters"), ("cm", "Centimeters"), ("ft", "Feet"), ("in", "Inches")],
)
def test_a_rhino_file_names_the_unit_that_it_is_written_in(tmp_path, roof, units, system):
    pcmc.write(tmp_path / "a.3dm", roof, units=units)
    assert size_in_rhino(tmp_path / "a.3dm")[1] == getattr(rhino3dm.UnitSystem, system)


def test_the_command_keeps_the_unit_of_a_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    in_millimetres(tmp_path / "mm.3dm")
    assert cli.main(["convert", "mm.3dm", "a.3dm"]) == 0
    size, unit = size_in_rhino("a.3dm")
    assert (size.tolist(), unit) == ([12000.0, 12000.0, 3000.0], rhino3dm.UnitSystem.Millimeters)
    assert cli.main(["convert", "a.3dm", "a.glb"]) == 0
    assert trimesh.load("a.glb").extents.tolist() == pytest.approx([12.0, 3.0, 12.0])
    solving = ["solve", "a.3dm", "--tension", "6000", "-o", "b.3dm", "--no-mesh-check", "--anyway"]
    assert cli.main(solving) in (0, 1)
    assert size_in_rhino("b.3dm")[1] == rhino3dm.UnitSystem.Millimeters
    capsys.readouterr()
    cli.main(["certify", "a.3dm"])
    assert "lengths in mm, tensions in force/mm" in capsys.readouterr().out


@pytest.mark.parametrize("suffix", [".pcmc", ".3dm", ".obj", ".ply", ".vtp", ".vtu", ".glb", ".gltf"])
@pytest.mark.parametrize("length", LENGTHS)
def test_every_format_with_units_gives_the_same_roof_in_another_unit(tmp_path, suffix, length, roof):
    path = tmp_path / f"roof{suffix}"
    pcmc.write(path, roof, units=Units(length, "kN"))
    data = pcmc.io.load(path)
    assert data.units == Units("m" if suffix in (".glb", ".gltf") else length, "kN")
    factor = length_factor(length, "mm")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FileWarning)
        back = pcmc.read(path, units="mm")
    near = 1e-6 if suffix in (".glb", ".gltf") else 1e-12
    size = factor * np.ptp(roof.vertices, axis=0)
    np.testing.assert_allclose(np.ptp(back.vertices, axis=0), size, rtol=near)
    assert back.tensions * factor == pytest.approx(roof.tensions, rel=1e-12)
    assert back.pressures * factor**2 == pytest.approx(roof.pressures, rel=1e-12)
    assert back.plane.point[2] == pytest.approx(factor * roof.plane.point[2], rel=near)


def test_a_roof_at_rest_is_at_rest_in_every_unit(roof):
    scale = pcmc.certify(roof)
    for factor in (1e-3, 304.8):
        other = pcmc.certify(scaled_surface(roof, factor))
        assert other.verdict is scale.verdict is pcmc.Verdict.STABLE
        assert other.volume == pytest.approx(factor**3 * scale.volume, rel=1e-9)
        assert other.load == pytest.approx(scale.load, rel=1e-9)  # forces stay
        assert other.energy == pytest.approx(factor * scale.energy, rel=1e-9)


def test_all_parts_of_a_surface_are_scaled():
    parts = (
        pcmc.Patch("a", 2.0, 3.0, weight=5.0),
        pcmc.Plane((1, 2, 3), (0, 0, 1)),
        pcmc.Line((1, 2, 3), (1, 0, 0)),
        pcmc.Circle((1, 2, 3), (0, 0, 1), 4.0),
        Room("r", {"a": 1}, 7.0),
    )
    patch, plane, line, circle, room = in_new_unit(parts, 2.0)
    assert (patch.tension, patch.pressure, patch.weight) == (1.0, 0.75, 1.25)
    assert plane == pcmc.Plane((2, 4, 6), (0, 0, 1))
    assert line == pcmc.Line((2, 4, 6), (1, 0, 0))
    assert (circle.centre, circle.normal, circle.radius) == ((2, 4, 6), (0, 0, 1), 8.0)
    assert room.volume == 56.0


def test_a_file_that_rhino_scaled_keeps_tensions_supports_and_walls(tmp_path, roof):
    path = tmp_path / "m.3dm"
    pcmc.write(path, roof, units="m")
    model = rhino3dm.File3dm.Read(str(path))
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    for item in model.Objects:  # as Rhino does when the unit of a document is changed
        item.Geometry.Transform(rhino3dm.Transform.Scale(rhino3dm.Point3d(0, 0, 0), 1000.0))
    model.Write(str(path), 7)
    back = pcmc.read(path)
    np.testing.assert_allclose(np.ptp(back.vertices, axis=0), np.ptp(roof.vertices, axis=0), rtol=1e-12)
    assert back.patches == roof.patches
    assert back.fixed.sum() == roof.fixed.sum()


def test_an_unknown_unit_of_rhino_is_noted_and_no_unit_is_none(tmp_path):
    path = in_millimetres(tmp_path / "a.3dm")
    model = rhino3dm.File3dm.Read(str(path))
    for system, notes in ((rhino3dm.UnitSystem.LightYears, 1), (getattr(rhino3dm.UnitSystem, "None"), 0)):
        model.Settings.ModelUnitSystem = system
        model.Write(str(path), 7)
        data = pcmc.io.load(path)
        assert not data.units
        assert sum("LightYears" in note for note in data.notes) == notes


def test_formats_without_units_say_that_they_lose_them(tmp_path, roof):
    for suffix in (".stl", ".fe"):
        with pytest.warns(LostWarning, match="its unit ft"):
            pcmc.write(tmp_path / f"a{suffix}", roof, units="ft")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pcmc.write(tmp_path / "a.obj", roof, units="ft")
        pcmc.write(tmp_path / "b.obj", roof)
        assert not pcmc.io.load(tmp_path / "b.obj").units


def test_wrong_units_of_files_are_refused(tmp_path, roof):
    pcmc.write(tmp_path / "a.obj", roof, units="ft")
    with refused(OptionError, what="units", found="furlong"):
        pcmc.read(tmp_path / "a.obj", units="furlong")
    with refused(OptionError, what="units", found="furlong"):
        pcmc.write(tmp_path / "b.obj", roof, units="furlong")
    with refused(OptionError, what="units", found=12):
        pcmc.write(tmp_path / "b.obj", roof, units=12)
    text = (tmp_path / "a.obj").read_text(encoding="utf-8")
    for wrong in ('["furlong", ""]', "3", '["ft", "ft"]', '["m", "kN", "s"]'):
        (tmp_path / "c.obj").write_text(text.replace('["ft", ""]', wrong), encoding="utf-8")
        with refused(FileError, what=str(tmp_path / "c.obj")):
            pcmc.read(tmp_path / "c.obj")


PROJECT = """
units = "mm"
force = "kN"
[plan]
edge_length = 1000.0
outline = [[0, 0], [4000, 0], [4000, 3000], [0, 3000]]
patches = {roof = {tension = 2.0, pressure = 0.001}}
[output]
files = ["roof.3dm", "roof.glb", "roof.pcmc", "roof.obj"]
picture = "roof.png"
"""


def test_a_project_gives_its_units_to_all_that_it_writes(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "roof.toml").write_text(PROJECT, encoding="utf-8")
    assert cli.main(["solve", "roof.toml", "--no-mesh-check"]) == 0
    assert "lengths in mm, tensions in kN/mm, pressures in kN/mm², reactions in kN" in capsys.readouterr().out
    size, unit = size_in_rhino("roof.3dm")
    assert (size[:2].tolist(), unit) == ([4000.0, 3000.0], rhino3dm.UnitSystem.Millimeters)
    assert trimesh.load("roof.glb").extents[[0, 2]].tolist() == pytest.approx([4.0, 3.0])
    for name in ("roof.pcmc", "roof.obj"):
        assert pcmc.io.load(name).units == Units("mm", "kN")
    assert cli.main(["certify", "roof.pcmc"]) == 0
    assert "tensions in kN/mm" in capsys.readouterr().out
    with pytest.warns(FileWarning, match="converted from mm to m"):
        assert pcmc.certify(pcmc.read("roof.pcmc")).certified  # the same roof in metres


@pytest.mark.parametrize(
    ("lines", "what", "line"),
    [
        ('units = "meter"', "units", 1),
        ("units = 3", "units", 1),
        ('units = "m"\nforce = "kg"', "force", 2),
        ('force = "kN"', "units", None),
    ],
)
def test_wrong_units_of_a_project_are_refused(tmp_path, lines, what, line):
    text = PROJECT.replace('units = "mm"\nforce = "kN"\n', lines + "\n").lstrip()
    (tmp_path / "roof.toml").write_text(text, encoding="utf-8")
    with refused(FileError, what=what, where=line):
        load(tmp_path / "roof.toml")


@pytest.mark.parametrize(
    ("size", "drawn", "note"),
    [
        (0.005, "", "the plan is 5 mm long; check its unit, which is m"),
        (0.005, "mm", "the plan is 5 mm long; is the drawing in m? Its unit is mm: set it to m in CAD"),
        (1200.0, "mm", "the plan is 1.2 km long; check its unit, which is mm"),
        (1.0, "", ""),
        (1000.0, "", ""),
    ],
)
def test_an_unlikely_size_is_named_with_the_unit_that_would_explain_it(size, drawn, note):
    found = unlikely_size(size, "m", drawn)
    assert found.startswith(note)
    assert bool(found) == bool(note)
