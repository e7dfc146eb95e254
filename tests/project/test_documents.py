"""Everything in one file: a project's drawings, schedule, structural model, report and pictures."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import ezdxf
import ifcopenshell
import numpy as np
import pytest
import pyvista
import rhino3dm
import trimesh
from nightly import at_night
from PIL import Image
from printed import words_of
from refusals import refused
from starts import spherical_cap

import pcmc
from pcmc import cli, io, project
from pcmc.base.errors import FileError
from pcmc.project.writing import draw_picture
from pcmc.structure import calculix

ROOF = Path(__file__).resolve().parents[2] / "notebooks" / "roof.toml"
UNITS = 'units = "m"\nforce = "kN"\n'
STRUCTURE = "[structure]\nyoung = 1e6\nthickness = 0.001\nsnow = 0.6\n"
SMALL = """
[plan]
edge_length = 1.0
outline = [[0, 0], [4, 0], [4, 3], [0, 3]]
patches = {roof = {tension = 4.0}}
"""
EVERYTHING = """
[output]
files = ["roof.ifc", "roof.3dm", "roof.glb"]
picture = "roof.png"
views = ["diagonal", "plan", "elevation"]
drawings = ["roof.dxf", "sheets.pdf"]
panels = "schedule.csv"
tolerance = 0.02
structure = "roof.inp"
report = "report.pdf"
"""


def test_one_command_writes_what_other_programs_read(tmp_path, monkeypatch, capsys):
    """The L-shaped roof: IFC, Rhino, glTF, DXF, PDF, CalculiX, tables, each by another reader."""
    import ezdxf
    import ifcopenshell
    import ifcopenshell.validate
    import rhino3dm
    import trimesh

    monkeypatch.chdir(tmp_path)
    plan = (
        ROOF.read_text(encoding="utf-8")
        .split("[output]")[0]
        .replace("edge_length = 0.7", "edge_length = 2.4")
    )
    (tmp_path / "roof.toml").write_text(UNITS + plan + STRUCTURE + EVERYTHING, encoding="utf-8")
    assert cli.main(["solve", "roof.toml"]) == 0
    assert "persists" in capsys.readouterr().out
    roof = pcmc.read("roof.3dm")
    outside = ~roof.walls[roof.patch_of_face]
    size = np.ptp(roof.vertices, axis=0)

    model = ifcopenshell.open("roof.ifc")
    log = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(model, log)
    assert not log.statements
    assert len(model.by_type("IfcRoof")) == 1
    rhino = rhino3dm.File3dm.Read("roof.3dm")
    assert str(rhino.Settings.ModelUnitSystem).endswith("Meters")
    scene = trimesh.load_scene("roof.glb")
    np.testing.assert_allclose(np.sort(scene.extents), np.sort(size), rtol=1e-6)
    drawing = ezdxf.readfile("roof.dxf")
    assert not drawing.audit().errors
    assert len(drawing.modelspace().query("3DFACE")) == outside.sum()
    with Path("schedule.csv").open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == outside.sum()
    with Image.open("roof.png") as picture:
        width, height = picture.size
    assert width > 1.5 * height  # three views side by side
    if calculix.available():
        calculix.run_file(Path("roof.inp").absolute())
        data = Path("roof.dat").read_text(encoding="utf-8")
        assert "total force" in data or "forces" in data
    pages = words_of("report.pdf")
    text = "\n".join(pages)
    assert f"page {len(pages)} of {len(pages)}" in pages[-1]
    for name in ("Mesh check", "F1 ", "roof.dxf", "schedule-edges.csv", "roof.inp", "wall 3", "kN/m"):
        assert name in text
    assert "Setting-out points" in "\n".join(words_of("sheets.pdf"))


def test_all_documents_appear_together_or_none(tmp_path, monkeypatch):
    (tmp_path / "roof.toml").write_text(UNITS + SMALL + STRUCTURE + EVERYTHING, encoding="utf-8")
    (tmp_path / "roof.dxf").write_text("old")

    def fail(path, **rest):
        Path(path).write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pcmc.project.writing.write_structure", fail)
    with refused(FileError, what=str(tmp_path / "roof.inp")):
        project.run(tmp_path / "roof.toml")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["roof.dxf", "roof.toml"]
    assert (tmp_path / "roof.dxf").read_text() == "old"


OUTPUT = "[output]\n"
UNFINISHED = "[solve]\niterations = 1\n"
MISSED = '[targets]\nmeet = [{quantity = "apex", value = 30.0}]\nvary = ["roof"]\n'


@pytest.mark.parametrize(
    ("text", "key"),
    [
        (SMALL + OUTPUT + 'drawings = ["a.dxf"]', "units"),
        (SMALL + OUTPUT + 'report = "a.pdf"', "units"),
        (UNITS + SMALL + OUTPUT + 'structure = "a.inp"', "structure"),
        (UNITS + SMALL + "[structure]\nyoung = 1e6\n" + OUTPUT + 'structure = "a.inp"', "thickness"),
        (UNITS + SMALL + "[structure]\nthickness = 1e-3\n" + OUTPUT + 'structure = "a.inp"', "young"),
        (UNITS + SMALL + OUTPUT + 'report = "a.pdf"\ntolerance = 0', "tolerance"),
        (UNITS + SMALL + OUTPUT + 'panels = "a.csv"', "tolerance"),
        (UNITS + SMALL + OUTPUT + 'drawings = ["a.dxf"]\npanel_sheets = true', "tolerance"),
        (UNITS + SMALL + OUTPUT + 'report = "../a.pdf"', "output"),
        (UNITS + SMALL + OUTPUT + 'drawings = ["a.dwg"]', "a.dwg"),
        (UNITS + SMALL + OUTPUT + 'panels = "a.txt"\ntolerance = 1', "a.txt"),
        (UNITS + SMALL + OUTPUT + 'structure = "a.txt"', "a.txt"),
        (UNITS + SMALL + OUTPUT + 'report = "a.txt"', "a.txt"),
        (UNITS + SMALL + OUTPUT + 'picture = "a.png"\nview = "plan"\nviews = ["plan"]', "output.views"),
        (UNITS + SMALL + OUTPUT + 'picture = "a.png"\nviews = []', "views"),
        (
            UNITS + SMALL + OUTPUT + 'picture = "a.png"\nviews = ["plan", "plan"]\ncolour = "reactions"',
            "views",
        ),
        (UNITS + SMALL + OUTPUT + 'drawings = ["a.dxf"]\nsheet = "B2"', "output.sheet"),
        (SMALL + OUTPUT + 'net = ["a.dxf"]\nnet_size = 1.0', "units"),
        (SMALL + OUTPUT + 'net = ["a.obj"]', "net_size"),
        (SMALL + OUTPUT + "net_size = 1.0", "net"),
        (SMALL + OUTPUT + 'files = ["a.obj"]\nview = "plan"', "view"),
        (SMALL + OUTPUT + 'files = ["a.obj"]\nviews = ["plan"]', "views"),
        (SMALL + OUTPUT + 'report = "a.pdf"\ncolour = "error"', "colour"),
        (SMALL + OUTPUT + 'net = ["a.obj"]\nnet_size = -1.0', "net_size"),
        (SMALL + OUTPUT + 'net = ["a.stl"]\nnet_size = 1.0', "a.stl"),
        (SMALL + OUTPUT + 'net = ["a.obj"]\nnet_size = 1.0\nnet_pattern = "octagons"', "output.net_pattern"),
        (SMALL + "[solve]\norder = 2\n[pattern]\nwidth = 2.0\n", "solve.order"),
    ],
)
def test_bad_documents_are_refused_before_the_roof_is_solved(tmp_path, monkeypatch, text, key):
    monkeypatch.setattr("pcmc.project.designing.solve_project", None)
    (tmp_path / "roof.toml").write_text(text, encoding="utf-8")
    with refused(FileError, what=key) as caught:
        project.run(tmp_path / "roof.toml")
    assert "\n" not in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == ["roof.toml"]


def test_a_proof_of_curved_elements_is_refused_before_the_roof_is_solved(tmp_path, monkeypatch, capsys):
    """An option of the command was refused when all was solved and written."""
    monkeypatch.setattr("pcmc.project.designing.solve_project", None)
    (tmp_path / "roof.toml").write_text(SMALL + "[solve]\norder = 2\n", encoding="utf-8")
    assert cli.main(["solve", str(tmp_path / "roof.toml"), "--verify"]) == cli.BAD_INPUT
    assert "solve.verify is for flat triangles alone" in capsys.readouterr().err


def test_a_patch_that_is_not_there_is_refused_before_the_roof_is_solved(tmp_path, monkeypatch):
    monkeypatch.setattr("pcmc.project.designing.solve_project", None)
    wind = STRUCTURE + "wind = {rof = 1.0}\n"
    (tmp_path / "roof.toml").write_text(UNITS + SMALL + wind + EVERYTHING, encoding="utf-8")
    with refused(pcmc.errors.OptionError, found="rof"):
        project.run(tmp_path / "roof.toml")


def test_panels_larger_than_a_sheet_are_in_model_space(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    output = 'files = ["a.obj"]\ndrawings = ["a.dxf"]\ntolerance = 0.1\npanel_sheets = true\nsheet = "A4"\n'
    (tmp_path / "roof.toml").write_text(UNITS + SMALL + OUTPUT + output, encoding="utf-8")
    assert cli.main(["solve", "roof.toml", "--no-mesh-check"]) == 0
    assert cli.main(["draw", "roof.toml", "-o", "b.dxf"]) == 0
    for name in ("a.dxf", "b.dxf"):
        doc = ezdxf.readfile(tmp_path / name)
        assert "Panels larger than A4" in doc.layouts.names()
        assert len(doc.modelspace().query('LWPOLYLINE[layer=="PCMC-CUT"]')) == 26


def test_a_project_with_a_net_writes_its_files_as_the_command_does(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    output = 'net = ["net.obj", "net.csv", "net.dxf", "net.pdf"]\nnet_size = 0.6\nsheet = "A2"\n'
    output += 'net_pattern = "quads"\nnet_direction = 20.0\n'
    (tmp_path / "roof.toml").write_text(UNITS + SMALL + OUTPUT + output, encoding="utf-8")
    assert cli.main(["solve", "roof.toml", "--no-mesh-check"]) == 0
    names = {"net.obj", "net.csv", "net-nodes.csv", "net-beams.csv", "net.dxf", "net.pdf"}
    assert {path.name for path in tmp_path.iterdir()} == names | {"roof.toml"}
    polygons = [line for line in Path("net.obj").read_text().splitlines() if line.startswith("f ")]
    layouts = ezdxf.readfile("net.dxf").layouts.names()
    assert len(polygons) == len(Path("net.csv").read_text().splitlines()) - 1
    assert {"Panels and nodes in plan", "Nodes", "Panels"} < set(layouts)
    assert len(words_of("net.pdf")) == len(layouts) - 1  # besides the model
    options = ["panels", "roof.toml", "--pattern", "quads", "--size", "0.6", "-o", "same.obj"]
    for direction, same in ((), True), (("--direction", "20"), True), (("--direction", "0"), False):
        assert cli.main([*options, *direction]) == 0
        assert (Path("same.obj").read_bytes() == Path("net.obj").read_bytes()) == same


def test_an_uncertified_roof_writes_nothing_or_marked_documents(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = UNITS + SMALL + UNFINISHED + STRUCTURE + EVERYTHING
    (tmp_path / "roof.toml").write_text(text, encoding="utf-8")
    assert cli.main(["solve", "roof.toml"]) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["roof.toml"]
    assert cli.main(["solve", "roof.toml", "--allow-uncertified"]) == 1
    assert (tmp_path / "roof.inp").exists()
    for name in ("report.pdf", "sheets.pdf"):
        assert all("NOT CERTIFIED" in page for page in words_of(name))


MARKED = {  # what each format has of a mark, besides sheets and pages
    ".pcmc": lambda path: io.load(path).certificate["mark"],
    ".ifc": lambda path: ifcopenshell.open(path).by_type("IfcRoof")[0].Name.removeprefix("Roof, "),
    ".obj": lambda path: path.read_text().splitlines()[1].removeprefix("# "),
    ".fe": lambda path: path.read_text().splitlines()[1].removeprefix("// "),
    ".ply": lambda path: path.read_bytes().split(b"\n")[3].decode().removeprefix("comment "),
    ".vtp": lambda path: pyvista.read(path).field_data["mark"][0],
    ".glb": lambda path: trimesh.load_scene(path).metadata["pcmc mark"],
    ".usda": lambda path: re.search('string mark = "(.*)"', path.read_text())[1],
    ".3dm": lambda path: next(
        one.Geometry.Text
        for one in rhino3dm.File3dm.Read(str(path)).Objects
        if one.Attributes.Name == "PCMC-MARK"
    ),
    ".inp": lambda path: path.read_text().splitlines()[1].split("; ")[1],
}


@pytest.mark.parametrize(
    ("change", "mark"), [(UNFINISHED, "NOT CERTIFIED: not converged"), (MISSED, "TARGETS NOT MET"), ("", "")]
)
@pytest.mark.filterwarnings("ignore::pcmc.base.errors.LostWarning")
def test_files_have_the_mark_of_a_roof_that_is_not_in_order(tmp_path, monkeypatch, change, mark):
    """Each in its own way, and again where they are converted; a picture has it in a corner."""
    monkeypatch.chdir(tmp_path)
    names = [f"roof{suffix}" for suffix in MARKED if suffix != ".inp"]
    output = f"[output]\nfiles = {names}\nstructure = 'roof.inp'\npicture = 'roof.png'\n"
    text = UNITS + SMALL.partition("[solve]")[0] + change + STRUCTURE + output
    (tmp_path / "roof.toml").write_text(text, encoding="utf-8")
    drawn = []

    def draw(_surface, path, *, mark, **_look):
        drawn.append(mark)
        path.touch()

    monkeypatch.setattr("pcmc.project.writing.draw", draw)
    cli.main(["solve", "roof.toml", "--allow-uncertified"])
    if mark:
        assert {suffix: read(Path(f"roof{suffix}")) for suffix, read in MARKED.items()} == dict.fromkeys(
            MARKED, mark
        )
        io.write(
            "bare.pcmc", io.read("roof.pcmc"), mark=mark
        )  # without a certificate, as is an unfolded roof
        for name in ("roof.pcmc", "bare.pcmc"):
            assert cli.main(["convert", name, "again.obj"]) == 0
            assert MARKED[".obj"](Path("again.obj")) == mark
    else:
        assert not any(b"NOT" in Path(name).read_bytes() for name in names)
    assert drawn == [mark]
    io.read("roof.3dm")  # without a note on objects that are left out


PART = "part of a roof that goes on behind its mirror planes"


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.LostWarning")
def test_files_tell_that_they_hold_a_part_of_a_roof(tmp_path, monkeypatch):
    """Where a program shows it, not only in the data that pcmc reads back; the whole roof has no mark."""
    monkeypatch.chdir(tmp_path)
    half = SMALL.replace("patches =", "mirrors = [[[4, 0], [4, 3]]]\npatches =")
    names = [f"roof{suffix}" for suffix in MARKED if suffix != ".inp"]
    output = f"[output]\nfiles = {names}\nstructure = 'roof.inp'\n"
    (tmp_path / "roof.toml").write_text(UNITS + half + STRUCTURE + output, encoding="utf-8")
    assert cli.main(["solve", "roof.toml", "--no-mesh-check"]) == 0
    read_by = {suffix: read for suffix, read in MARKED.items() if suffix not in (".inp", ".pcmc")}
    found = {suffix: read(Path(f"roof{suffix}")) for suffix, read in read_by.items()}
    assert found == dict.fromkeys(read_by, PART)
    assert Path("roof.inp").read_text().splitlines()[1].endswith(f"; {PART}")
    assert f"\no {PART}\n" in Path("roof.obj").read_text()
    assert ifcopenshell.open("roof.ifc").by_type("IfcProject")[0].Name == f"Roof, {PART}"
    assert io.load("roof.obj").patches == io.load("roof.pcmc").patches
    assert cli.main(["convert", "roof.pcmc", "whole.ifc", "--whole"]) == 0
    assert ifcopenshell.open("whole.ifc").by_type("IfcProject")[0].Name == "Roof"


@pytest.mark.parametrize("colour", ["patches", "curvature", "error", "reactions"])
@pytest.mark.parametrize("views", [["plan"], ["plan", "elevation"]])
def test_a_picture_of_any_colour_has_the_mark(monkeypatch, colour, views):
    marks, labels, views = [], [], views[: 1 if colour == "reactions" else 2]

    def seen(*_, mark, label="", **_look):
        marks.append(mark)
        labels.append(label)

    for drawn in ("draw", "panel", "reactions"):
        monkeypatch.setattr(f"pcmc.project.writing.{drawn}", seen)
    draw_picture(spherical_cap(0.5), "roof.png", views, colour, mark="TARGETS NOT MET")
    assert marks == ["TARGETS NOT MET"]
    assert ("Meyer's mean curvature" in labels[0]) == (colour in ("curvature", "error"))


def test_the_plan_drawing_is_not_written_over(tmp_path, monkeypatch):
    import ezdxf

    doc = ezdxf.new(units=6)
    doc.modelspace().add_lwpolyline(
        [(0, 0), (4, 0), (4, 3), (0, 3)], close=True, dxfattribs={"layer": "outline"}
    )
    doc.saveas(tmp_path / "hall.dxf")
    before = (tmp_path / "hall.dxf").read_bytes()
    (tmp_path / "roof.toml").write_text('[plan]\ndrawing = "hall.dxf"\n[output]\ndrawings = ["hall.dxf"]\n')
    with refused(FileError, what=str(tmp_path / "hall.dxf")):
        project.run(tmp_path / "roof.toml")
    assert (tmp_path / "hall.dxf").read_bytes() == before


def test_remesh_writes_no_documents(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "roof.toml").write_text(UNITS + SMALL + OUTPUT + 'report = "a.pdf"\n', encoding="utf-8")
    assert cli.main(["remesh", "roof.toml", "--edge-length", "0.8", "-o", "fine.pcmc"]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["fine.pcmc", "roof.toml"]


@pytest.mark.parametrize("command", ["solve", *at_night("report", "draw", "structure")])
def test_documents_of_a_symmetric_roof_show_the_whole(tmp_path, monkeypatch, command):
    """The plan is one half; the drawing has all of its triangles, the report its full width."""
    import ezdxf

    monkeypatch.chdir(tmp_path)
    half = SMALL.replace("patches", "mirrors = [[[4, 0], [4, 3]]]\npatches")
    output = 'whole = true\ndrawings = ["roof.dxf"]\nreport = "roof.pdf"\nstructure = "roof.inp"\n'
    (tmp_path / "roof.toml").write_text(UNITS + half + STRUCTURE + OUTPUT + output, encoding="utf-8")
    name = {"report": "roof.pdf", "draw": "roof.dxf", "structure": "roof.inp"}.get(command)
    quick = ["--no-mesh-check"] if command in ("solve", "report") else []
    assert cli.main([command, "roof.toml", *(["-o", name] if name else []), *quick]) == 0
    if (tmp_path / "roof.dxf").exists():
        faces = ezdxf.readfile("roof.dxf").modelspace().query("3DFACE")
        x = [corner[0] for face in faces for corner in face.wcs_vertices()]
        assert (min(x), max(x)) == pytest.approx((0.0, 8.0))
    if (tmp_path / "roof.inp").exists():
        lines = (tmp_path / "roof.inp").read_text(encoding="utf-8").splitlines()
        nodes = lines[lines.index(next(line for line in lines if line.startswith("*NODE"))) + 1 :]
        x = [float(line.split(",")[1]) for line in nodes[: next(k for k, n in enumerate(nodes) if "*" in n)]]
        assert (min(x), max(x)) == pytest.approx((0.0, 8.0))
    if (tmp_path / "roof.pdf").exists():
        assert "8.000 × 3.000 m" in "\n".join(words_of("roof.pdf"))


def test_a_picture_has_its_views_side_by_side(tmp_path):
    text = SMALL + OUTPUT + 'picture = "a.png"\ncolour = "error"\nviews = ["plan", [30, 20]]\n'
    (tmp_path / "roof.toml").write_text(text, encoding="utf-8")
    assert project.run(tmp_path / "roof.toml").good
    with Image.open(tmp_path / "a.png") as picture:
        pixels = np.asarray(picture.convert("RGB")).mean(axis=2)
    upper = (pixels[: pixels.shape[0] // 2] < 250).any(axis=0)
    parts = np.flatnonzero(np.diff(upper.astype(int)) == 1)
    assert len(parts) == 2
