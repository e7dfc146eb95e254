"""Rooms of different pressures: what the walls between them carry."""

import numpy as np
import pytest

from pcmc import Plane, Verdict, certify, solve
from pcmc.plan import Divider, PatchSpec, Plan, add_walls
from tests.plan.test_plan import vertices_of


def two_rooms(at=(0.0, 0.0), pressures=(1.0, 0.8)):
    x, y = at
    return Plan(
        [[x, y], [x + 12, y], [x + 12, y + 8], [x, y + 8]],
        [Divider([[x + 6, y], [x + 6, y + 8]], 1.0, bottom="held")],
        edge_length=1.5,
        patches=[PatchSpec("west", 6.0, pressures[0]), PatchSpec("east", 6.0, pressures[1])],
    )


def test_a_wall_between_rooms_of_different_pressures_carries_the_difference():
    wall = two_rooms().surface().patches[-1]
    assert (wall.name, wall.auxiliary) == ("wall 1", True)
    assert wall.pressure == pytest.approx(0.2)
    assert two_rooms(pressures=(0.8, 1.0)).surface().patches[-1].pressure == pytest.approx(-0.2)
    assert two_rooms(pressures=(1.0, 1.0)).surface().patches[-1].pressure == 0.0


def test_the_difference_pushes_the_wall_from_the_fuller_room():
    surface = two_rooms().surface()
    result = solve(surface)
    assert result.certificate.verdict is Verdict.STABLE
    wall = vertices_of(surface, "wall 1")
    assert result.surface.vertices[wall, 0].mean() > surface.vertices[wall, 0].mean()


def test_two_pressures_give_one_roof_whatever_the_point_of_the_plane():
    here = two_rooms().surface()
    there = here.rebuilt(plane=Plane((40.0, -30.0, 0.0)))
    one, two = solve(here), solve(there)
    assert two.energy == pytest.approx(one.energy, rel=1e-12)
    assert two.certificate.volume == pytest.approx(one.certificate.volume, rel=1e-12)
    np.testing.assert_allclose(two.surface.vertices, one.surface.vertices, atol=1e-9)
    found = one.certificate
    assert "point of Π" not in found.detail
    assert found.load == pytest.approx(1.0 * 48 + 0.8 * 48, rel=1e-12)
    # what a mesh leaves along its sheets is of second order in the edge length
    assert found.reactions.sum(axis=0) == pytest.approx([0, 0, -found.load], abs=3e-3 * 86.4)
    assert found.support == pytest.approx(found.reactions[:, 2].sum())


def test_a_divider_past_three_rooms_has_a_wall_for_each_difference():
    plan = Plan(
        [[0, 0], [12, 0], [12, 8], [0, 8]],
        [Divider([[6, 0], [6, 8]], 2.0, name="spine"), Divider([[6, 4], [12, 4]], 2.0)],
        edge_length=1.0,
        patches=[
            PatchSpec("west", 6.0, 1.0, at=[3, 4]),
            PatchSpec("south", 6.0, 0.9, at=[9, 2]),
            PatchSpec("north", 6.0, 0.8, at=[9, 6]),
        ],
    )
    walls = {p.name: p.pressure for p in plan.surface().patches if p.wall}
    assert list(walls) == ["spine-1", "spine-2", "wall 2"]
    assert sorted(map(abs, walls.values())) == pytest.approx([0.1, 0.1, 0.2])


def test_pressures_left_over_name_the_rooms_that_they_are_between():
    bays = Plan(
        [[0, 0], [12, 0], [12, 8], [0, 8]],
        [Divider([[4, 0], [4, 8]], wall=None), Divider([[8, 0], [8, 8]], wall=None)],
        edge_length=2.0,
        patches=[PatchSpec(name, 6.0, p) for name, p in (("west", 1.0), ("middle", 0.8), ("east", 0.8))],
    ).surface()
    detail = certify(bays).detail
    assert "along 4 edges that nothing holds (west | middle near (4, " in detail
    assert "the pressures do not cancel: 0.2 is left over" in detail


def test_walls_put_under_a_mesh_carry_the_difference_too():
    bare = Plan(
        [[0, 0], [12, 0], [12, 8], [0, 8]],
        [Divider([[6, 0], [6, 8]], wall=None)],
        edge_length=1.5,
        patches=[PatchSpec("west", 6.0, 1.0), PatchSpec("east", 6.0, 0.8)],
    ).surface()
    found = certify(bare)
    assert "the pressures do not cancel: 0.2 is left over" in found.detail
    assert "edges that nothing holds (west | east near (6, " in found.detail
    wall = add_walls(bare).patches[-1]
    assert wall.pressure == pytest.approx(0.2)
    assert "point of Π" not in certify(add_walls(bare)).detail
