"""Parts of one name are told apart by their places, in the coordinates of a survey, too."""

from __future__ import annotations

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
