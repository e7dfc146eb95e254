"""Parts of one name are told apart by their places, in the coordinates of a survey, too."""

from __future__ import annotations

import pytest

import pcmc
from pcmc.accuracy.quantities import readings
from pcmc.design import Target
from pcmc.plan import Hole, Plan

EAST, NORTH = 512340.25, 5412340.75


def test_two_courtyards_have_a_row_each():
    holes = [
        Hole({"circle": {"centre": [EAST + x, NORTH + 3.0], "radius": 1.0}}, name="yard") for x in (3, 9)
    ]
    corners = [[EAST, NORTH], [EAST + 12, NORTH], [EAST + 12, NORTH + 6], [EAST, NORTH + 6]]
    roof = pcmc.solve(Plan(corners, edge_length=1.0, tension=6.0, holes=holes).surface())
    rows = [
        (one.quantity, one.of) for one in readings(roof.surface, roof.certificate, roof.surface.n).values()
    ]
    assert len(set(rows)) == len(rows)


def test_two_heights_have_a_name_each():
    labels = [Target("height", (EAST + x, NORTH), 1.0).label for x in (0.1, 0.2)]
    assert labels == ["height at (512340.35, 5412340.75)", "height at (512340.45, 5412340.75)"]


def test_a_roof_there_has_the_mesh_the_margin_and_the_cloth_of_the_same_roof_here():
    roofs = []
    for x, y in ((0.0, 0.0), (500000.0, 5812345.0)):
        corners, line = [[x, y], [x + 12, y], [x + 12, y + 8], [x, y + 8]], [[x + 4, y], [x + 4, y + 8]]
        hole = Hole({"circle": {"centre": [x + 8, y + 4], "radius": 1.0}})
        plan = Plan(corners, [line], edge_length=1.5, tension=2.6, holes=[hole])
        roofs.append(pcmc.solve(plan.surface()).surface)
    pressure = [pcmc.margin(roof, "pressure", meshes=1).factor for roof in roofs]
    assert pressure[1] == pytest.approx(pressure[0], rel=0.01)
    strain = [pcmc.cutting_pattern(roof, width=2.0).table["strain_rms"].max() for roof in roofs]
    assert strain[1] == pytest.approx(strain[0], rel=0.2)  # the meshes differ a little
