"""Branches of several patches: changes of index, walls that come down to the plane, new meshes."""

import numpy as np
import pytest
from branches import tension_of_height
from nightly import at_night

from generators import four_fans, two_caps, two_squares
from pcmc import Direction, certify, follow, solve
from pcmc.forces.pinching import pull_and_capacity, standing_part
from pcmc.plan import Divider, Plan
from pcmc.solvers.continuation import Ending
from tests.forces.test_contact_upright import hall


def test_walls_of_the_fans_lose_stability_in_two_directions_at_once():
    walls = {f"wall {k}": 1.0 for k in range(1, 5)}
    start = solve(four_fans(7, alpha_aux=1.5), target="stationary").surface
    branch = follow(start, Direction(walls), 3.0)
    assert branch.ending is Ending.REACHED
    (event,) = branch.events.itertuples()
    assert (event.kind, event.index_before, event.index_after) == ("index", 0, 2)
    for shift, index in ((-2e-4, 0), (2e-4, 2)):
        value = event.parameter * (1.0 + shift)
        row = int((branch.points.parameter < value).sum()) - 1
        near = branch.surfaces[row].retensioned(dict.fromkeys(walls, value))
        assert certify(solve(near, target="stationary", min_quality=0.0).surface).index == index


@pytest.mark.nightly
def test_fold_of_two_caps_on_a_coarse_mesh():
    start = solve(two_caps(1.2), target="stationary").surface
    branch = follow(start, Direction({"large": -1.0, "small": -1.0}, relative=True), folds=1)
    assert branch.ending is Ending.FOLDS
    at = branch.folds.iloc[0]
    assert at["tension large"] == pytest.approx(2.976, abs=0.01)
    assert branch.points.residual.max() <= 1e-10
    lower = start.retensioned({"large": at["tension large"] - 0.02, "small": at["tension small"] - 0.02})
    assert not solve(lower).converged  # no minimum is left; a far saddle is


def test_wall_that_comes_down_to_the_plane_on_the_way_changes_the_contact():
    start = solve(two_squares(8, alpha_aux=1.8)).surface
    branch = follow(start, "wall", 2.3)
    assert branch.ending is Ending.REACHED
    assert "contact" in set(branch.events.kind)
    before, after = certify(start), certify(branch.last)
    assert len(before.pinched) == 0 < len(after.pinched)
    assert after.residual <= 1e-9


@pytest.mark.parametrize("largest", [0.15, *at_night(0.04)])
def test_wall_comes_down_at_the_same_tensions_whatever_the_steps(largest):
    start = solve(two_squares(4, alpha_aux=1.0)).surface
    branch = follow(start, "wall", 3.0, largest=largest)
    assert branch.ending is Ending.REACHED
    assert branch.events.kind.tolist() == ["contact"] * 2
    pinched = {row: len(certify(surface).pinched) for row, surface in branch.surfaces.items()}
    assert list(dict.fromkeys(pinched.values())) == [0, 1, 3]  # each contact changes what rests
    direct = solve(two_squares(4, alpha_aux=3.0), target="stationary").surface
    height = max(direct.vertices[:, 2])
    assert branch.points.height.iloc[-1] == pytest.approx(height, rel=1e-2)  # triangles lie otherwise
    assert branch.points.quality.iloc[-1] > 0.8


@pytest.mark.parametrize("control", ["volume", "height"])
def test_wall_comes_down_under_every_control(control):
    start = solve(two_squares(4, alpha_aux=2.2)).surface
    branch = follow(start, "wall", 2.49, control=control)
    assert branch.ending is Ending.REACHED
    assert set(branch.events.kind) == {"contact"}
    assert len(certify(branch.last).pinched) == 1


def test_junction_that_rests_on_the_plane_is_lifted_when_its_wall_pulls_less():
    start = solve(two_squares(6, alpha_aux=3.0), target="stationary").surface
    branch = follow(start, "wall", 2.51)
    assert branch.ending is Ending.REACHED
    assert set(branch.events.kind) == {"contact"}
    before, after = certify(start), certify(branch.last)
    assert len(before.pinched) == 5 > len(after.pinched) > 0
    for surface in branch.surfaces.values():
        assert certify(surface).residual <= 1e-9


def test_junction_stands_off_as_soon_as_its_wall_pulls_less_than_the_sheets():
    start = solve(two_squares(6, alpha_aux=3.0), target="stationary").surface
    found = standing_part(start)
    pull, capacity = pull_and_capacity(found)
    least = 3.0 * float((pull[found.resting] / capacity[found.resting]).max())
    for part, resting in ((1.001, 5), (0.995, 3)):
        branch = follow(start, "wall", part * least)
        assert branch.ending is Ending.REACHED
        after = certify(branch.last)
        assert len(after.pinched) == resting
        assert after.residual <= 1e-9


def test_ctrl_c_while_a_contact_is_solved_for_ends_the_branch(monkeypatch):
    start = solve(two_squares(6, alpha_aux=3.0), target="stationary").surface

    def pressed(progress):
        raise KeyboardInterrupt

    def interrupted(surface, **options):
        return solve(surface, "newton", pressed, **options)

    monkeypatch.setattr("pcmc.solvers.continuation.tracing.solve_once", interrupted)
    branch = follow(start, "wall", 2.51)
    assert branch.ending is Ending.STOPPED
    assert len(branch.points) > 0 == len(branch.events)


def test_new_mesh_on_the_way_keeps_to_the_branch(small_cap):
    pytest.importorskip("mmgpy")
    branch = follow(small_cap, "cap", until={"height": 1.5}, step=-0.05, min_quality=0.93, remesh=0.25)
    assert branch.ending is Ending.REACHED
    assert branch.last.m != small_cap.m
    assert branch.points.residual.max() <= 1e-10
    exact = tension_of_height(branch.points.height.to_numpy())
    assert branch.points.parameter.to_numpy() == pytest.approx(exact, rel=0.05)


def test_new_mesh_does_not_leap_over_a_goal(small_cap):
    pytest.importorskip("mmgpy")
    options = {"step": -0.05, "min_quality": 0.93, "remesh": 0.25}
    branch = follow(small_cap, "cap", until={"height": 0.8}, steps=2, **options)
    before, after = branch.points.volume.iloc[-1], certify(branch.surfaces[2]).volume
    assert after == pytest.approx(before)
    goal = before + 0.03  # of the mesh made anew after that point it has 0.06 more
    met = follow(small_cap, "cap", until={"volume": goal}, steps=4, **options)
    assert met.ending is Ending.REACHED
    assert met.points.volume.iloc[-1] == pytest.approx(goal, rel=1e-9)


def two_rooms(x, y):
    """Two rooms with a wall between, the plan's corner at (x, y)."""
    outline = [[x, y], [x + 8, y], [x + 8, y + 4], [x, y + 4]]
    wall = Divider([[x + 4, y], [x + 4, y + 4]], wall=1.5, bottom="held")
    rooms = {"west": {"tension": 4.0}, "east": {"tension": 4.0}}
    return solve(Plan(outline, [wall], edge_length=1.0, patches=rooms).surface()).surface


def test_a_branch_in_one_rooms_pressure_does_not_depend_on_where_the_plan_is_drawn():
    direction = Direction(pressures={"west": 1.0})
    here, there = (follow(two_rooms(*at), direction, 1.3) for at in ((0, 0), (40, 7)))
    assert here.ending is there.ending is Ending.REACHED
    for name in ("height", "volume", "energy", "lowest_eigenvalue"):
        np.testing.assert_allclose(here.points[name], there.points[name], rtol=1e-8)
    end = here.points.iloc[-1]
    assert end["pressure wall 1"] == pytest.approx(0.3, rel=1e-12)
    assert here.last.walls.tolist() == [False, False, True]
    assert certify(here.last).detail == ""
    direct = solve(two_rooms(0, 0).retensioned(None, {"west": 1.3}))
    assert direct.energy == pytest.approx(end["energy"], rel=1e-4)
    named = Direction(pressures={"west": 1.0, "wall 1": 0.5}, relative=True)
    assert named.line(two_rooms(0, 0)).rates["pressures"].tolist() == [1.0, 0.0, 0.5]


def test_a_wall_that_follows_its_rooms_stays_a_wall():
    start = two_squares(4)
    line = Direction(pressures={"left": 1.0}).line(start)
    changed = line.surface_at(start, 1.25)
    assert abs(changed.pressures[2]) == 0.25
    assert changed.walls.tolist() == start.walls.tolist() == [False, False, True]
    assert not changed.uncancelled.any()


@pytest.mark.parametrize("upright", [*at_night(True), False])
def test_a_branch_goes_on_where_a_junction_comes_down_on_a_held_bottom(upright):
    """First contact is near 1.216 times the tension of an upright wall, near 1.411 times that of another."""
    start = solve(hall(4.0, 3.0, upright)).surface
    end = 3.9 if upright else 4.5
    branch = follow(start, "wall 1", end)
    assert branch.ending is Ending.REACHED
    assert branch.events.kind.tolist() == ["contact"]
    resting = [int(standing_part(surface).resting.sum()) for surface in branch.surfaces.values()]
    assert resting[0] == 0 < resting[-1] == 2
    direct = solve(start.retensioned({"wall 1": end}))
    assert standing_part(direct.surface).resting.sum() == 2
    assert branch.points.energy.iloc[-1] == pytest.approx(direct.energy, rel=2e-4)  # triangles lie otherwise


@pytest.mark.parametrize("upright", [True, *at_night(False)])
def test_a_branch_goes_on_where_the_last_vertex_lifts_off_a_held_bottom(upright):
    """No vertex that rests shows any longer that the wall can pinch; it is low, and counts for no quality."""
    start = solve(hall(4.0, 6.0, upright)).surface
    branch = follow(start, "wall 1", 3.4)
    assert branch.ending is Ending.REACHED
    resting = [int(standing_part(surface).resting.sum()) for surface in branch.surfaces.values()]
    assert resting[0] == 9 > 0 == resting[-1]
    direct = solve(start.retensioned({"wall 1": 3.4}))
    assert branch.points.energy.iloc[-1] == pytest.approx(direct.energy, rel=1e-4)
