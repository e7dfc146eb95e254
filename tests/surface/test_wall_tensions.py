"""Walls without a tension: chosen so that their junctions balance."""

import numpy as np
import pytest
from refusals import refused

from pcmc import solve
from pcmc.base.errors import OptionError, PlanError
from pcmc.certificate.verdict import Verdict
from pcmc.plan import Divider, Plan
from pcmc.surface.values import balanced_wall

HALL = [[0, 0], [12, 0], [12, 6], [0, 6]]


def tension_of(plan, name):
    surface = plan.surface()
    return surface.patches[surface.patch_index(name)].tension


@pytest.mark.parametrize(("west", "east"), [(4.0, 4.0), (5.0, 4.0), (100.0, 5.0), (100.0, 1.0), (3.001, 3.0)])
def test_the_wall_is_well_between_the_difference_and_the_sum(west, east):
    wall = balanced_wall([(west, east)])
    assert abs(west - east) + 0.2 * min(west, east) < wall < west + east - 0.2 * min(west, east)


def test_of_several_neighbours_all_balance_if_they_can():
    wall = balanced_wall([(5.0, 4.0), (1.2, 1.0)])
    assert 1.0 < wall < 2.2


def test_a_divider_without_a_wall_tension_gets_one_from_its_neighbours():
    patches = {"west": {"tension": 5.0}, "east": {"tension": 4.0}}
    seam = [[6, 0], [6, 6]]
    for divider in (seam, Divider(seam), {"curve": seam, "wall": "balanced"}):
        assert tension_of(Plan(HALL, [divider], patches=patches, edge_length=1.5), "wall 1") == 2.2
    plan = Plan(HALL, [Divider(seam, 1.7)], patches=patches, edge_length=1.5)
    assert tension_of(plan, "wall 1") == 1.7


def test_a_wall_into_a_corner_pulls_less():
    across = Plan(HALL, [[[0, 0], [12, 6]]], tension=5.0, edge_length=0.5)
    assert 0.0 < tension_of(across, "wall 1") < 0.5


def test_a_wall_is_no_other_text():
    with refused(OptionError, found="heavy"):
        Plan(HALL, [Divider([[6, 0], [6, 6]], "heavy")], tension=5.0)


UNEQUAL = {"west": {"tension": 6.0}, "east": {"tension": 4.0}}


def upright_hall(edge_length=1.0, **more):
    return Plan(HALL, [Divider([[6, 0], [6, 6]], 3.0, **more)], patches=UNEQUAL, edge_length=edge_length)


def test_an_upright_wall_stays_in_its_plane_and_a_free_one_leans():
    for upright in (True, False):
        result = solve(upright_hall(upright=upright).surface())
        assert result.certificate.verdict is Verdict.STABLE
        surface = result.surface
        wall = np.unique(surface.faces[surface.patch_of_face == surface.patch_index("wall 1")])
        away = np.abs(surface.vertices[wall, 0] - 6.0).max()
        assert away < 1e-12 if upright else away > 0.2


def test_an_upright_wall_balances_tensions_that_no_wall_could():
    surface = Plan(HALL, [Divider([[6, 0], [6, 6]], 0.5, upright=True)], patches=UNEQUAL).surface()
    assert solve(surface).certificate.verdict is Verdict.STABLE


def test_only_a_straight_wall_can_be_upright():
    bent = Divider({"arc": [[6, 0], [7, 3], [6, 6]]}, upright=True)
    with refused(PlanError, what="divider 'wall 1'"):
        Plan(HALL, [bent], patches=UNEQUAL, edge_length=1.0).surface()
    with refused(OptionError, found="yes"):
        Plan(HALL, [Divider([[6, 0], [6, 6]], upright="yes")], patches=UNEQUAL)
