"""Tensions tied to each other, and named points of a plan."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from pcmc import Parameter, Target, meet
from pcmc.base.errors import FileError, OptionError, PlanError
from pcmc.design import sensitivities
from pcmc.plan import Plan
from pcmc.project import load, run_project
from pcmc.solvers import solve_once

HALL = [[0, 0], [10, 0], [10, 5], [0, 5]]
PROJECT = """
[plan]
edge_length = 0.8
outline = [[0, 0], [10, 0], [10, 5], [0, 5]]
dividers = [[[5, 0], [5, 5]]]
points = {crown = [2.3, 2.6]}
[plan.patches]
west = {tension = 4.0}
east = {tension = 4.0}
[targets]
meet = [{quantity = "height", of = "crown", value = 0.6}]
vary = [["west", "east"]]
"""


def halves():
    patches = {"west": {"tension": 4.0}, "east": {"tension": 4.0}}
    return Plan(HALL, [[[5, 0], [5, 5]]], patches=patches, edge_length=1.0).surface()


def test_a_tied_parameter_has_the_sum_of_the_slopes():
    roof = solve_once(halves()).surface
    apex = Target("apex", "west")
    single = sensitivities(roof, apex, ["west", "east"]).to_numpy().sum()
    assert sensitivities(roof, apex, [["west", "east"]]).to_numpy() == pytest.approx(single, rel=1e-8)


def test_tied_tensions_are_equal_and_meet_the_target():
    design = meet(halves(), Target("apex", value=0.7), [["west", "east"]])
    assert design.met
    assert list(design.parameters.index) == ["tension of west and east"]
    assert design.surface.patches[0].tension == design.surface.patches[1].tension


def test_wrong_ties_are_refused():
    for patch in ([], ["west", "west"], ["west", 2]):
        with refused(OptionError, what="patch"):
            Parameter(patch)
    with refused(OptionError, what="patch"):
        Parameter(["a", "b"], "volume")
    with refused(OptionError, what="tension of west"):
        meet(halves(), Target("apex", value=0.7), [["west", "east"], "west"])
    with refused(OptionError, found="wst"):
        meet(halves(), Target("apex", value=0.7), [["west", "wst"]])


def test_a_named_point_is_a_free_vertex_of_the_mesh():
    surface = Plan(HALL, tension=4.0, edge_length=1.0, points={"crown": [2.3, 2.6]}).surface()
    away = np.linalg.norm(surface.vertices[:, :2] - [2.3, 2.6], axis=1)
    assert away.min() < 1e-12
    assert surface.free[away.argmin()]
    assert surface.vertices[away.argmin(), 2] > 0.1


def test_a_support_may_have_a_name():
    plan = Plan(HALL, tension=4.0, edge_length=1.0, supports=[[2.3, 2.6, 1.5]], points={"mast": [2.3, 2.6]})
    surface = plan.surface()
    (mast,) = np.flatnonzero(np.linalg.norm(surface.vertices[:, :2] - [2.3, 2.6], axis=1) < 1e-12)
    assert surface.pinned[mast]
    assert surface.vertices[mast, 2] == 1.5
    with refused(PlanError, what="supports", where=(2.3, 2.6)):  # which of the two?
        replace(plan, supports=[[2.3, 2.6, 1.5], [2.3, 2.6, 1.0]]).surface()


def test_wrong_points_are_refused():
    with refused(PlanError, what="supports"):
        Plan(HALL, tension=4.0, points={"crown": [20, 2]}).surface()
    for point in ([1, 2, 3], "here", ["a", 1]):
        with pytest.raises(OptionError, match="crown"):
            Plan(HALL, tension=4.0, points={"crown": point})


def test_a_project_names_its_points_and_ties_its_tensions(tmp_path):
    path = tmp_path / "roof.toml"
    path.write_text(PROJECT)
    outcome = run_project(load(path), use_cache=False)
    assert outcome.good
    west, east, *_ = outcome.surface.patches
    assert west.tension == east.tension
    assert outcome.design.targets["value"].tolist() == pytest.approx([0.6], rel=1e-7)
    path.write_text(PROJECT.replace('"crown"', '"crwn"'))
    with pytest.raises(FileError, match="did you mean 'crown'"):
        load(path)
