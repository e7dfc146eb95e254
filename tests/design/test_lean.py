"""Walls that lean: how much, as a target, and the derivative."""

from functools import partial

import numpy as np
import pytest
from nightly import at_night
from refusals import refused

from pcmc import Parameter, Target, certify, cli, meet, solve
from pcmc.base.errors import OptionError
from pcmc.design import sensitivities
from pcmc.design.targets import measure
from pcmc.meshing.local_refinement import refine_near
from pcmc.meshing.refinement import refine
from pcmc.meshing.remeshing import remesh
from pcmc.plan import Divider, Plan

HALL = [[0, 0], [12, 0], [12, 6], [0, 6]]
LEAN = Target("lean", "wall 1")


def hall(east=4.0, edge_length=1.0, **more):
    patches = {"west": {"tension": 6.0}, "east": {"tension": east}}
    return Plan(
        HALL, [Divider([[6, 0], [6, 6]], 3.0, **more)], patches=patches, edge_length=edge_length
    ).surface()


def test_a_wall_turned_by_an_angle_leans_by_it():
    surface = hall()
    X = surface.vertices.copy()
    wall = np.unique(surface.faces[surface.patch_of_face == 2])
    X[wall, 0] += np.tan(np.radians(20.0)) * X[wall, 2]
    turned = surface.moved(X)
    assert measure(turned, LEAN).value == pytest.approx(20.0)
    assert certify(turned).leaning["lean"].tolist() == pytest.approx([20.0])
    assert "'wall 1' by 20.0° near (" in certify(turned).text()


def test_the_derivative_by_positions_is_exact():
    surface = solve(hall()).surface
    rng, step = np.random.default_rng(3), 1e-6
    direction = rng.normal(size=(surface.n, 3)) * surface.free[:, None]
    slope = float((measure(surface, LEAN).by_position * direction).sum())
    ends = [measure(surface.moved(surface.vertices + s * step * direction), LEAN).value for s in (1, -1)]
    assert slope == pytest.approx((ends[0] - ends[1]) / (2.0 * step), rel=1e-6)


def test_a_limit_of_the_lean_is_met():
    start = solve(hall())
    assert measure(start.surface, LEAN).value > 8.0
    design = meet(start.surface, Target("lean", "wall 1", at_most=4.0), Parameter("east", high=8.0))
    assert design.met
    assert certify(design.surface).leaning["lean"].max() <= 4.0 * (1.0 + 1e-6)


def test_the_lean_answers_to_tensions_as_solves_do():
    surface, step = solve(hall(), tolerance=1e-12).surface, 1e-4
    slope = sensitivities(surface, LEAN, "east").to_numpy().item()
    ends = [solve(surface.retensioned({"east": 4.0 + s * step}), tolerance=1e-12).surface for s in (1, -1)]
    difference = measure(ends[0], LEAN).value - measure(ends[1], LEAN).value
    assert slope == pytest.approx(difference / (2.0 * step), rel=1e-3)


def test_only_walls_lean():
    with refused(OptionError, what="of"):
        measure(hall(), Target("lean", "west"))
    with refused(OptionError, what="of"):
        measure(Plan(HALL, tension=4.0, edge_length=1.5).surface(), Target("lean"))


STRAIGHT, BENT = "[[6, 0], [6, 6]]", "{arc = [[6, 0], [5.5, 3], [6, 6]]}"


@pytest.mark.parametrize(("curve", "upright"), [(STRAIGHT, "true"), (STRAIGHT, "false"), (BENT, "false")])
def test_the_command_says_which_walls_lean_and_what_can_hold_them(tmp_path, capsys, curve, upright):
    path = tmp_path / "roof.toml"
    path.write_text(
        "[plan]\nedge_length = 1.0\noutline = [[0, 0], [12, 0], [12, 6], [0, 6]]\n"
        f"dividers = [{{curve = {curve}, upright = {upright}}}]\n"
        "[plan.patches]\nwest = {tension = 7.0}\neast = {tension = 3.5}\n"
    )
    assert cli.main(["solve", str(path), "--no-mesh-check"]) == 0
    out = capsys.readouterr().out
    assert ("walls lean from the vertical: 'wall 1'" in out) is (upright == "false")
    assert ("; upright = true under divider 'wall 1'" in out) is (curve == STRAIGHT and upright == "false")


NEAR = partial(refine_near, points=[6, 3, 0.5], levels=2, radius=1.5)


@pytest.mark.parametrize(
    "finer",
    [partial(remesh, edge_length=0.7), *at_night(refine, NEAR)],
    ids=["remeshed", "refined", "refined near"],
)
@pytest.mark.parametrize("turned", [0.0, *at_night(2.0)])
def test_an_upright_wall_stays_upright_on_finer_meshes(finer, turned):
    """All of the wall, and the junction, stay in the plane; so do they once solved."""
    divider = Divider([[6 - turned, 0], [6 + turned, 6]], 3.0, upright=True)
    patches = {"west": {"tension": 6.0, "at": [1, 3]}, "east": {"tension": 4.0, "at": [11, 3]}}
    surface = solve(Plan(HALL, [divider], patches=patches, edge_length=1.0).surface()).surface
    for fine in (finer(surface), solve(finer(surface)).surface):
        assert fine.m > surface.m
        (plane, mask), wall = fine.on_planes[0], fine.patch_index("wall 1")
        own = np.unique(fine.faces[fine.patch_of_face == wall])
        assert mask[own].all()
        assert np.abs(plane.height(fine.vertices[own])).max() < 1e-12 * fine.size
    assert certify(fine).leaning["lean"].max() < 1e-4


def test_a_search_that_brings_a_wall_down_goes_on_with_one_that_stands():
    patches = {"west": {"tension": 2.0, "pressure": 0.4}, "east": {"tension": 2.2, "pressure": 0.3}}
    outline = [[0, 0], [12, 0], [12, 6], [8, 9], [0, 9]]
    start = Plan(outline, [Divider([[7, 0], [5, 9]], 0.7)], patches=patches, edge_length=1.2).surface()
    design = meet(start, Target("lean", "wall 1", 11.6), "wall 1")
    assert design.met
    assert certify(design.surface).leaning["lean"].max() == pytest.approx(11.6, rel=1e-6)
