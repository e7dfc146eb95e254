"""Targets met, and targets out of reach."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from design_cases import cap, roof_at_rest
from nightly import at_night
from shapes import pyramid

import pcmc
from generators import spherical_cap, two_caps
from pcmc import Design, Parameter, Target, meet
from pcmc.design import DesignStatus
from pcmc.design.targets import measure
from pcmc.plan import Plan, circle


@pytest.fixture
def roof():
    return roof_at_rest()


def gable(tension, ring=False):
    """A roof whose highest point is held: the gables' tips, or a ring, at a height of 6."""
    turns = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    hole = np.stack([6.0 + 2.0 * np.cos(turns), 6.0 + 2.0 * np.sin(turns), np.full(16, 6.0)], axis=1)
    outline = [[0, 0, 3], [6, 0, 6], [12, 0, 3], [12, 10, 3], [6, 10, 6], [0, 10, 3]]
    square = [[0, 0], [12, 0], [12, 12], [0, 12]]
    plan = {"outline": square, "holes": [hole]} if ring else {"outline": outline}
    return Plan(tension=tension, edge_length=1.0, **plan).surface()


# Targets met


def test_two_apexes_from_wrong_tensions(roof):
    wrong = roof.retensioned({"north": 10.0, "east": 9.0, "corner": 8.0})
    targets = [Target("apex", "north", 2.2), Target("apex", "east", 1.8)]
    design = meet(wrong, targets, ["north", "east", "corner"])
    assert isinstance(design, Design)
    assert design.met
    assert design.solves <= 15
    assert design.certificate.certified
    for target in targets:
        assert abs(measure(design.surface, target).value - target.value) < 1e-6
    assert list(design.targets["met"]) == [True, True]
    assert design.message == DesignStatus.MET.value
    values = [design.surface.patches[design.surface.patch_index(n)].tension for n in ("north", "east")]
    np.testing.assert_array_equal(design.parameters["value"][:2], values)
    assert len(design.history) == design.solves
    assert design.history["misfit"].iloc[-1] < 1e-6
    assert dataclasses.is_dataclass(design)


@pytest.mark.parametrize(
    ("ring", "tension"), [(False, 7.0), (True, 40.0), *at_night((False, 40.0), (True, 10.0))]
)
def test_an_apex_above_a_held_one_is_met(ring, tension):
    """There the apex has no derivative: it is that of the held point."""
    roof = gable(tension, ring)
    design = meet(roof, Target("apex", value=6.5), "patch 1")
    assert design.met, design.message
    top = int(design.surface.vertices[:, 2].argmax())
    assert design.surface.vertices[top, 2] == pytest.approx(6.5, rel=1e-6)
    assert design.surface.free[top]
    lower = meet(roof, Target("apex", value=5.0), "patch 1")
    assert lower.status is DesignStatus.CONFLICT
    assert lower.targets["limit"].iloc[0] == 6.0


def test_two_apexes_over_a_wall_that_slides():
    """Example 2: near the goal the solver stalls on a start that is almost at rest."""
    targets = [Target("apex", "large", 3.0), Target("apex", "small", 2.0)]
    design = meet(two_caps(1.2), targets, ["large", "small"])
    assert design.met
    assert design.solves <= 15
    assert design.certificate.certified
    for target in targets:
        assert abs(measure(design.surface, target).value - target.value) < 1e-6


def test_tensions_too_low_for_any_equilibrium_are_raised_first(roof):
    design = meet(
        roof.retensioned({"north": 2.0, "east": 2.0, "corner": 2.0}),
        [Target("volume", None, 450.0)],
        ["north", "east", "corner"],
    )
    assert design.met
    assert measure(design.surface, Target("volume")).value == pytest.approx(450.0, rel=1e-7)


@pytest.mark.parametrize(
    "target",
    [
        Target("height", (0.2, 0.1), 0.3),
        Target("volume", "cap", 0.5),
        Target("area", "cap", 3.5),
        Target("curvature", "cap", 0.8),
        Target("volume", None, at_least=0.6),
    ],
    ids=lambda t: t.label,
)
def test_each_quantity_as_a_target(target):
    surface = cap()
    for kind in ("tension", "pressure"):
        design = meet(surface, [target], [Parameter("cap", kind)])
        assert design.met
        found = measure(design.surface, target).value
        assert found == pytest.approx(target.nearest(found), rel=1e-7)
        assert design.solves <= 10


def test_a_limit_holds_only_where_it_binds():
    surface = cap()
    loose, tight = Target("reaction per length", at_most=2.0), Target("reaction per length", at_most=1.0)
    assert meet(surface, [loose], ["cap"]).solves == 1
    design = meet(surface, [tight], ["cap"])
    assert design.met
    assert measure(design.surface, tight).value <= 1.0 + 1e-7


def test_of_many_solutions_tensions_keep_their_ratios(roof):
    """One target, three tensions: junctions stay in balance when all change alike."""
    design = meet(roof, [Target("apex", "north", 2.5)], ["north", "east", "corner"])
    assert design.met
    change = design.parameters["value"] / design.parameters["start"]
    assert change["tension of north"] < 0.9
    assert np.ptp(change) < 0.1 * (1.0 - change.mean())


@pytest.mark.parametrize("height", [1.2, 3.0])
def test_heights_that_only_a_coarse_mesh_carries_are_met(height):
    """α h / √(1 + h²) = 1/3: at h = 1.2 the load is 1.15 times what the smooth boundary carries."""
    design = meet(pyramid(), Target("apex", "roof", height), "roof")
    assert design.met
    assert design.surface.tensions[0] == pytest.approx(np.sqrt(1 + height**2) / height / 3, rel=1e-6)


def test_points_that_are_not_worth_a_solve_are_rows_without_one():
    seen: list[pd.Series] = []
    start = cap().retensioned({"cap": 0.3})
    design = meet(start, Target("apex", None, 0.3), "cap", callback=seen.append)
    assert design.met
    status = design.history.status
    assert status[0] == "overloaded"
    assert design.history["tension of cap"][0] == 0.3
    assert design.history[["apex", "misfit"]].iloc[0].isna().all()
    assert design.solves == (status != "overloaded").sum() < len(status) == len(seen)


def test_a_height_just_below_the_limit_is_met():
    design = meet(cap(), [Target("apex", None, 1.0)], ["cap"])
    assert design.met
    assert design.solves <= 10


# Targets out of reach


def test_an_unreachable_height_is_refused_with_the_limit():
    """Caps end at the hemisphere, of height 1; on a mesh a little above, with order two."""
    above = []
    for edge in (0.35, 0.2):
        surface = spherical_cap(edge, alpha=1.5)
        limits = []
        for height in (1.2, 5.0):
            design = meet(surface, [Target("apex", "cap", height)], ["cap"])
            assert design.status is DesignStatus.AT_FOLD
            assert design.solves <= 15
            limit = design.targets["limit"].iloc[0]
            assert f"apex of cap: wanted {height:g}, nearest reachable {limit:.6g}" in design.message
            reason = "it grew without bound; raise the tensions"  # which are what is sought
            assert dataclasses.replace(design, reason=reason).message.endswith(
                "a step further, it grew without bound"
            )
            assert design.targets["value"].iloc[0] == pytest.approx(limit, rel=1e-2)
            assert design.certificate.residual < 1e-10
            limits.append(limit)
        assert limits[0] == pytest.approx(limits[1], rel=2e-4)
        assert meet(surface, [Target("apex", "cap", 0.998 * limits[0])], ["cap"]).met
        above.append(limits[0] - 1.0)
    assert 0.0 < above[1] < 0.4 * above[0]


def test_a_bound_in_the_way(roof):
    design = meet(roof, [Target("apex", "north", 9.0)], [Parameter("north", low=5.5)])
    assert design.status is DesignStatus.AT_BOUND
    assert design.parameters["value"].iloc[0] == 5.5
    there = pcmc.solve(roof.retensioned({"north": 5.5})).surface
    nearest = measure(there, Target("apex", "north")).value
    assert design.targets["limit"].iloc[0] == pytest.approx(nearest, rel=1e-6)


def test_a_tension_that_stays_and_a_bound_that_is_reached_keep_their_last_digit():
    """The unknown is 1/α, and 1/(1/49) is not 49."""
    for tension in (24.5, 29.4, 49.0, 50.47, 58.8, 62.23):
        roof = pyramid(tension=tension)
        met = meet(roof, Target("apex", "roof", at_least=0.0), "roof")
        assert met.parameters["value"].iloc[0] == met.surface.patches[0].tension == tension
        low, high = 0.9 * tension, 1.1 * tension
        bounded = meet(roof, Target("apex", "roof", 9.0), Parameter("roof", low=low, high=high))
        assert bounded.status is DesignStatus.AT_BOUND
        assert bounded.surface.patches[0].tension == low


def test_targets_that_contradict_each_other():
    targets = [Target("curvature", "cap", 0.5), Target("curvature", "cap", 0.8)]
    design = meet(cap(), targets, ["cap"])
    assert design.status is DesignStatus.CONFLICT
    found = design.targets["value"].iloc[0]
    # least squares of (q - 0.5) / 0.5 and (q - 0.8) / 0.8
    assert found == pytest.approx((1 / 0.5 + 1 / 0.8) / (1 / 0.25 + 1 / 0.64), rel=1e-3)


def test_a_parameter_without_influence(roof):
    design = meet(roof, [Target("curvature", "north", 0.2)], ["east"])
    assert design.status is DesignStatus.CONFLICT
    assert design.solves == 1


def test_the_limit_of_solves():
    design = meet(cap(), [Target("apex", None, 0.9)], ["cap"], solves=2)
    assert design.status is DesignStatus.SOLVES
    assert design.solves == 2


@pytest.mark.parametrize("size", [3e-4, 1e-3, 1.0, 1e3])
def test_a_target_is_met_in_any_unit_of_length(size):
    plan = Plan(circle([0, 0], 4.0 * size), tension=3.4 * size, edge_length=0.28 * size)
    found = meet(plan.surface(), Target("apex", value=1.331727 * size), "patch 1")
    assert found.status is DesignStatus.MET
    assert found.surface.tensions[0] == pytest.approx(3.33604 * size, rel=1e-4)
