"""What one sheet of a cushion gets, the other follows; names alone make no cushion."""

from pcmc.plan import Divider, PatchSpec, Plan

RECTANGLE = [[0, 0], [6, 0], [6, 4], [0, 4]]


def values(surface, field):
    return {patch.name: getattr(patch, field) for patch in surface.patches}


def test_both_sheets_come_back_from_no_pressure():
    cushion = Plan(RECTANGLE, edge_length=1.0, tension=2.0, pressure=0.4, cushion=1.2).surface()
    flat = cushion.retensioned(pressures={"patch 1": 0.0})
    again = flat.retensioned(pressures={"patch 1": 1.0}, tensions={"patch 1": 4.0})
    assert values(again, "pressure") == {"patch 1": 1.0, "patch 1 below": 1.0}
    assert values(again, "tension") == {"patch 1": 4.0, "patch 1 below": 4.8}


def test_half_a_cushion_has_two_sheets():
    half = Plan(RECTANGLE, edge_length=1.0, tension=2.0, cushion=1.5, mirrors=[[[6, 0], [6, 4]]]).surface()
    assert values(half.retensioned({"patch 1": 4.0}), "tension") == {"patch 1": 4.0, "patch 1 below": 6.0}
    assert values(half.with_snow(0.3), "snow") == {"patch 1": 0.3, "patch 1 below": 0.0}


def test_patches_of_a_roof_with_such_names_are_on_their_own():
    patches = [PatchSpec("hall", 2.0), PatchSpec("hall below", 2.0)]
    divider = Divider([[3, 0], [3, 4]], wall=0.5)
    roof = Plan(RECTANGLE, [divider], patches=patches, edge_length=1.0).surface()
    assert values(roof.retensioned({"hall": 4.0}), "tension")["hall below"] == 2.0
    assert values(roof.retensioned(pressures={"hall": 0.5}), "pressure")["hall below"] == 1.0
    assert values(roof.with_snow(0.3), "snow")["hall below"] == 0.3
