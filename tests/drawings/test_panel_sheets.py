"""Sheets of panels at true size: congruent, apart, within the frame, and labelled."""

from __future__ import annotations

import re
from itertools import combinations

import ezdxf
import numpy as np
import pytest
from shapely.geometry import Polygon

import pcmc
from pcmc.drawings import drawing_set
from pcmc.drawings.panel_sheets import panel_sheets, triangles_at_true_size
from pcmc.drawings.sheet import CORNER, drawing_area
from pcmc.panelling.schedule import packed
from pcmc.surface.geometry import cross_2d, edge_vectors


@pytest.mark.parametrize(("name", "millimetres"), [("A4", 60.0), ("A3", 100.0), ("A1", 250.0)])
def test_panels_on_sheets_are_congruent_apart_and_within_the_frame(squares, name, millimetres):
    schedule = pcmc.panels(squares, 0.01)
    sheets = panel_sheets(triangles_at_true_size(schedule, millimetres), name)
    assert len(sheets) > 1
    number = 0
    low, high = CORNER, CORNER + drawing_area(name)
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


def test_panels_of_very_different_sizes_do_not_lie_on_each_other():
    """A large one reached below several small ones, and the next large one on it."""
    rng = np.random.default_rng(0)
    for _ in range(30):
        panels = [rng.random((3, 2)) * rng.choice([10.0, 40.0, 150.0]) for _ in range(12)]
        pages: dict[int, list[Polygon]] = {}
        for page, corners in packed(panels, 400.0, 200.0):
            pages.setdefault(page, []).append(Polygon(corners))
        for placed in pages.values():
            assert all(one.distance(other) > 0.0 for one, other in combinations(placed, 2))


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
