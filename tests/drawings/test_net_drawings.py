"""Nets of panels as files of the command: true sizes, units, tables, refusals."""

import re

import ezdxf
import numpy as np
import pandas as pd
import pytest
from nightly import at_night

import pcmc
from pcmc.base.units import Units
from pcmc.cli import main
from pcmc.drawings import net_drawings
from pcmc.drawings.sheet import table_sheets
from pcmc.panelling import panel_net
from pcmc.plan import Plan

PATTERN = ["--pattern", "quads", "--size"]


@pytest.fixture(scope="module")
def roof():
    plan = Plan([[0, 0], [3, 0], [3, 2], [0, 2]], edge_length=0.4, patches={"roof": {"tension": 2.0}})
    return pcmc.solve(plan.surface()).surface


@pytest.fixture(scope="module")
def file(roof, tmp_path_factory):
    path = tmp_path_factory.mktemp("net") / "roof.pcmc"
    pcmc.write(path, roof, units=Units("m", "kN"))
    return path


def _area(outline):
    x, y = outline.T
    return 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.mark.parametrize(("unit", "factor"), [*at_night(("m", 1.0)), ("mm", 1000.0)])
def test_each_file_of_the_command_has_the_panels_at_true_size(file, tmp_path, unit, factor, capfd):
    names = ["n.csv", "n.obj", "n.dxf", "n.svg", "n.pdf"]
    outputs = [word for name in names for word in ("-o", str(tmp_path / name))]
    picture = ["--picture", str(tmp_path / "n.png")]
    assert (
        main(
            [
                "panels",
                str(file),
                "--pattern",
                "planar-quads",
                "--size",
                f"{0.5 * factor}",
                "--units",
                unit,
                *outputs,
                *picture,
            ]
        )
        == 0
    )
    assert f"lengths in {unit}" in capfd.readouterr().out
    panels, beams = pd.read_csv(tmp_path / "n.csv"), pd.read_csv(tmp_path / "n-beams.csv")
    nodes = pd.read_csv(tmp_path / "n-nodes.csv")
    assert np.ptp(nodes["x"]) == pytest.approx(3.0 * factor)
    lengths = {tuple(row[:2]): row[2] for row in beams[["node", "other", "length"]].to_numpy()}
    loops = [line.split()[1:] for line in (tmp_path / "n.obj").read_text().splitlines() if line[0] == "f"]
    doc = ezdxf.readfile(tmp_path / "n.dxf")
    assert doc.units == {"m": 6, "mm": 4}[unit]
    cut = [np.array(o.get_points("xy")) for o in doc.modelspace().query('LWPOLYLINE[layer=="PCMC-CUT"]')]
    assert len(cut) == len(panels) == len(loops)
    assert panels["planarity"].max() < 1e-4
    for loop, outline, area in zip(loops, cut, panels["area"], strict=True):
        ends = zip(map(int, loop), map(int, [*loop[1:], loop[0]]), strict=True)
        expected = [lengths[min(pair), max(pair)] for pair in ends]
        sides = np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1)
        assert sides == pytest.approx(expected, rel=1e-6)
        assert _area(outline) == pytest.approx(area, rel=1e-6)
    pages = (tmp_path / "n.pdf").read_bytes().count(b"/Type /Page\n")
    assert pages == len(list(tmp_path.glob("n-*.svg"))) > 3
    assert (tmp_path / "n.png").stat().st_size > 1000


def test_panels_on_the_sheets_have_their_areas_in_square_millimetres_and_do_not_overlap(roof):
    from shapely import Polygon, unary_union

    net = panel_net(roof, 0.25)
    sheets = net_drawings(net, "m", sheet="A0").sheets
    found = []
    for sheet in sheets:
        outlines = [Polygon(line.points) for line in sheet.lines if line.layer == "PCMC-CUT"]
        found += [outline.area for outline in outlines]
        assert unary_union(outlines).area == pytest.approx(sum(outline.area for outline in outlines))
    assert np.sort(found) == pytest.approx(np.sort(net.panels["area"]) * 1e6, rel=1e-6)


def test_a_plan_has_the_number_of_each_panel_and_marks_each_node(roof):
    net = panel_net(roof, 0.5, "quads")
    sheet = net_drawings(net, "m").sheets[0]
    texts = [text.text for text in sheet.texts if text.layer != "PCMC-POINT"]
    assert {str(k) for k in net.panels["panel"]} <= set(texts)
    marks = [line.points.mean(axis=0) for line in sheet.lines if line.layer == "PCMC-POINT"]
    factor, shift = sheet.places[0]
    for at in net.points[:, :2]:
        assert np.abs(np.array(marks) - (factor * at + shift)).max(axis=1).min() < 1e-9


def test_a_panel_with_fewer_edges_than_others_has_empty_cells_in_the_table_of_large_ones(roof):
    net = panel_net(roof, 0.4, "hexagons")
    sheets = [sheet for sheet in net_drawings(net, "m", sheet="A4").sheets if "larger than A4" in sheet.title]
    texts = {text.text for sheet in sheets for text in sheet.texts}
    assert "nan" not in texts
    assert "f, mm" in texts


def test_a_table_has_no_negative_zero_and_its_rule_is_clear_of_the_rows():
    (sheet,) = table_sheets("T", pd.DataFrame({"x": [-1e-9, 2.0]}), "A4", 3)
    assert [text.text for text in sheet.texts] == ["x", "0.000", "2.000"]
    head, row = (text.at[1] for text in sheet.texts[:2])
    rule = sheet.lines[0].points[0][1]
    assert row + sheet.texts[1].height < rule < head


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--pattern", "quads"], "--pattern: needs a --size"),
        (["--size", "1"], "--pattern: needs a --size"),
        ([*PATTERN, "0.5", "--tolerance", "0.1"], "--tolerance: belongs to panels of triangles"),
        ([*PATTERN, "0.5", "--change", "0.1"], "--change: belongs to panels of triangles"),
        ([*PATTERN, "0.5", "--walls"], "--walls: belongs to panels of triangles"),
        ([*PATTERN, "0.5", "--mirror-images", "apart"], "--mirror-images: belongs to panels of triangles"),
        (["--tolerance", "0.1", "--units", "mm"], "--units: belongs to panels of quads and hexagons"),
        (["--tolerance", "0.1", "--direction", "30"], "--direction: belongs to panels of quads and hexagons"),
        (["--tolerance", "0.1", "--sheet", "A3"], "--sheet: belongs to panels of quads and hexagons"),
        ([*PATTERN, "0.5", "-o", "net.stl"], "net.stl: "),
        ([*PATTERN, "-1"], "size"),
        ([*PATTERN, "2"], "too large for patch 'roof'; choose at most 1.5"),
        (["--pattern", "octagons", "--size", "0.5"], "pattern"),
        ([*PATTERN, "0.5", "--sheet", "A9", "-o", "net.pdf"], "A9"),
        ([], "--tolerance: panels of triangles need it"),
    ],
)
def test_the_command_refuses_in_one_line(file, tmp_path, monkeypatch, capfd, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert main(["panels", str(file), *arguments]) != 0
    error = capfd.readouterr().err.strip()
    assert message in error
    assert len(re.findall(r"^pcmc: error", error, re.M)) == 1
    assert "Traceback" not in error
    assert not list(tmp_path.iterdir())
