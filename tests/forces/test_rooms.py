"""Walls follow the pressures of the rooms that they stand between, whoever changes them."""

import numpy as np
import pytest

import pcmc
from generators import double_bubble, two_squares
from pcmc import Parameter, Target, cli, meet
from pcmc.design import sensitivities
from pcmc.design.targets import measure
from pcmc.forces.pinching import standing_part
from pcmc.plan import Divider, PatchSpec, Plan
from pcmc.surface.values import wall_changes

HALL = """
[plan]
edge_length = 1.5
outline = [[0, 0], [12, 0], [12, 8], [0, 8]]
dividers = [{curve = [[6, 0], [6, 8]], bottom = "held"}]
patches = {west = {tension = 6.0}, east = {tension = 6.0}}
[output]
files = ["hall.pcmc"]
"""


def hall(west=1.0, east=1.0):
    return Plan(
        [[0, 0], [12, 0], [12, 8], [0, 8]],
        [Divider([[6, 0], [6, 8]], 1.0, bottom="held")],
        edge_length=1.5,
        patches=[PatchSpec("west", 6.0, west), PatchSpec("east", 6.0, east)],
    ).surface()


@pytest.mark.parametrize("start", [(1.0, 1.0), (1.2, 0.9), (0.7, 1.1)])
def test_changed_pressures_are_those_of_the_plan_drawn_with_them(start):
    for given in ({"east": 0.8}, {"west": 1.3}, {"west": 1.3, "east": 0.8}):
        rooms = dict(zip(("west", "east"), start, strict=True)) | given
        found, wanted = hall(*start).retensioned(None, given), hall(**rooms)
        assert [p.wall for p in found.patches] == [p.wall for p in wanted.patches]
        np.testing.assert_allclose(found.pressures, wanted.pressures, atol=1e-15)
        assert not found.uncancelled.any()


def test_tensions_and_a_pressure_of_the_wall_itself_are_as_given():
    found = hall().retensioned({"west": 7.0}, {"west": 1.3, "wall 1": 0.1})
    assert found.tensions.tolist() == [7.0, 6.0, 1.0]
    assert found.pressures.tolist() == [1.3, 1.0, 0.1]


def test_a_wall_that_follows_remains_a_wall():
    found = two_squares(3).retensioned(None, {"left": 1.25})
    assert found.pressures.tolist() == [1.25, 1.0, 0.25]
    assert found.walls.tolist() == [False, False, True]
    assert found.retensioned(None, {"left": 1.0}).pressures.tolist() == [1.0, 1.0, 0.0]


@pytest.mark.parametrize("suffix", [".glb", ".3dm", ".ifc"])
def test_a_pinched_wall_with_a_pressure_comes_back_where_patches_are_written_apart(suffix, tmp_path):
    pinched = pcmc.solve(two_squares(16, alpha_aux=2.0), target="stationary").surface
    surface = pinched.retensioned(None, {"left": 1.02})
    assert standing_part(surface).surface.m < surface.m
    pcmc.write(tmp_path / f"a{suffix}", surface)
    again = pcmc.read(tmp_path / f"a{suffix}")
    assert (again.m, again.patches) == (surface.m, surface.patches)


def test_a_wall_that_passes_several_rooms_has_no_one_pressure():
    surface = Plan(
        [[0, 0], [12, 0], [12, 8], [0, 8]],
        [Divider([[6, 0], [6, 8]], name="spine"), Divider([[6, 4], [12, 4]], name="rib")],
        edge_length=1.0,
        patches=[
            PatchSpec("west", 6.0, at=[3, 4]),
            PatchSpec("south", 6.0, at=[9, 2]),
            PatchSpec("north", 6.0, at=[9, 6]),
        ],
    ).surface()
    both = surface.retensioned(None, {"south": 0.9, "north": 0.9})
    assert np.abs(both.pressures).tolist() == pytest.approx([1.0, 0.9, 0.9, 0.1, 0.0])
    one = {p.name: p.pressure for p in surface.retensioned(None, {"south": 0.9}).patches}
    assert (one["spine"], abs(one["rib"])) == (0.0, pytest.approx(0.1))


def test_without_walls_or_changes_nothing_follows():
    bubble = double_bubble(1.0)
    for surface, change in ((bubble, np.ones(3)), (two_squares(3), np.zeros(3))):
        assert not wall_changes(surface, change).any()


def test_the_command_and_its_targets_press_walls_too(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hall.toml").write_text(HALL, encoding="utf-8")
    assert cli.main(["solve", "hall.toml", "--pressure", "east=0.8", "--no-mesh-check"]) == 0
    assert "point of Π" not in capsys.readouterr().out
    assert pcmc.read("hall.pcmc").pressures == pytest.approx([1.0, 0.8, 0.2])


def test_a_height_is_met_by_a_room_s_pressure():
    design = meet(hall(), Target("apex", "west", 2.0), Parameter("west", "pressure"))
    assert design.met
    west, east, wall = design.surface.pressures
    assert (wall, east) == (pytest.approx(west - east), 1.0)
    assert not design.surface.uncancelled.any()


@pytest.mark.parametrize("kind", ["volume", "area", "apex"])
def test_sensitivities_to_a_room_s_pressure_are_slopes_with_its_wall_following(kind):
    tight = {"tolerance": 1e-13, "min_quality": 0.0}
    at_rest = pcmc.solve(hall(1.0, 0.9), **tight).surface
    assert standing_part(at_rest).surface.m == at_rest.m
    target, step = Target(kind, "west"), 1e-3

    def found(west):
        solved = pcmc.solve(at_rest.retensioned(None, {"west": west}), **tight).surface
        return measure(solved, target).value

    slope = (8 * (found(1 + step) - found(1 - step)) - found(1 + 2 * step) + found(1 - 2 * step)) / (
        12 * step
    )
    table = sensitivities(at_rest, target, Parameter("west", "pressure"))
    assert table.iloc[0, 0] == pytest.approx(slope, rel=1e-6)
