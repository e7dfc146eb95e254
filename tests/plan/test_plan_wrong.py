"""Every way in which a plan can be wrong."""

import json
import re
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from nightly import at_night
from refusals import refused

from pcmc.base.errors import MissingExtra, OptionError, PlanError, SurfaceError
from pcmc.plan import PatchSpec, Plan, patch_names, plan_from
from pcmc.surface.curve_data import curve
from pcmc.surface.curves import circle, polyline
from tests.plan.test_plan import BOX, vertices_of

COURT = {"curve": circle([17, 5], 2)}
WALL = [[10, 0], [10, 12]]
BETWEEN = 3.85 * np.array([np.cos(np.pi / 8), np.sin(np.pi / 8)])  # two vertices of the outline, an octagon
COARSE = {
    "outline": circle([0, 0], 4),
    "holes": [polyline([[0, 0], [1, 0], BETWEEN], closed=True)],
    "edge_length": 3.5,
}


def tension(changes):
    """A tension for all patches, if none has its own."""
    return {} if "patches" in changes else {"tension": 5.0}


COMB = [[[x, 0], [x, 12]] for x in np.linspace(1, 19, 200)] + [
    [[0, y], [20, y]] for y in np.linspace(1, 11, 200)
]
GRID = [[[x, 0], [x, 12]] for x in np.linspace(0, 20, 47)[1:-1]] + [
    [[0, y], [20, y]] for y in np.linspace(0, 12, 47)[1:-1]
]
FLAT = {"tension": 1, "at": [1, 1]}
ONE, OUTLINE = "divider 'wall 1'", "the outline"
SLOPED = {
    "outline": [[0, 0, 1], [20, 0, 2], [20, 12, 1], [0, 12, 1]],
    "dividers": [{"curve": WALL, "bottom": "sloped"}, [[0, 6], [10, 6]]],
}


@pytest.mark.parametrize(
    ("changes", "fields"),
    [
        ({"outline": [[0, 0], [4, 4], [4, 0], [0, 4]]}, {"what": OUTLINE, "where": (2.0, 2.0)}),
        ({"outline": polyline(BOX)}, {"what": OUTLINE, "found": 12.0}),
        ({"outline": [[0, 0, 0], [9, 0, 0], [4, 0, 4]]}, {"what": OUTLINE}),
        ({"holes": [polyline([[1, 1], [2, 1], [2, 2]])]}, {"what": "hole 1"}),
        ({"holes": [circle([30, 5], 2)]}, {"what": "hole 1"}),
        ({"holes": [{**COURT, "name": "court"}, circle([19, 5], 2)]}, {"what": "hole 2"}),
        ({"holes": [circle([6, 5], 2), circle([8, 5], 1)]}, {"what": "hole 1", "found": "hole 2"}),
        ({"dividers": [[[10, 0], [10, 9]]]}, {"what": ONE, "where": (10.0, 9.0), "found": 3.0}),
        ({"dividers": [[[25, 0], [25, 9]]]}, {"what": ONE}),
        ({"dividers": [WALL, [[0, 6], [9, 6]]]}, {"what": "divider 'wall 2'", "found": 1.0}),
        ({"dividers": [[[0, 0], [20, 0]]]}, {"what": ONE, "found": OUTLINE}),
        ({"dividers": [[[1, 0.004], [9, 0]]]}, {"what": ONE, "found": OUTLINE}),
        ({"supports": [[25, 3]]}, {"what": "supports", "where": (25.0, 3.0)}),
        ({"supports": [[17, 5]], "holes": [COURT]}, {"what": "supports", "where": (17.0, 5.0)}),
        ({"dividers": [[[2, 0], [8, 12], [8, 0], [2, 12]]]}, {"what": ONE, "where": (5.0, 6.0)}),
        ({"dividers": [[[5, 5, 0], [5, 5, 3]]]}, {"what": ONE}),
        ({"dividers": [WALL], "patches": {"a": {"tension": 1}}}, {"found": 1, "expected": 2}),
        ({"dividers": [WALL], "patches": {"a": FLAT}}, {"what": "patches", "where": [15.0, 6.0]}),
        ({"patches": {"a": FLAT, "b": {"tension": 1, "at": [9, 1]}}}, {"what": "at", "where": "b"}),
        ({"patches": {"a": {"tension": 1, "at": [1, 99]}}}, {"where": "a", "found": [1.0, 99.0]}),
        ({"patches": {"a": FLAT, "b": {"tension": 1}}}, {"what": "at", "where": "b"}),
        ({"edge": "free"}, {"what": "supports"}),
        (SLOPED, {"what": "bottom"}),
        (COARSE, {"what": OUTLINE, "found": "hole 1"}),
        ({"edge_length": 20.0}, {"what": "edge_length"}),
        ({"edge_length": 30.0}, {"what": "edge_length", "found": 30.0}),
        ({"edge_length": 1e-4}, {"what": "edge_length", "found": 1e-4}),
        ({"rise": 1e6}, {"what": "rise", "found": 1e6}),
        ({"holes": [circle([17, 5], 1e-9)]}, {"what": "hole 1"}),
        ({"dividers": [WALL, [[10, 6], [10.1, 12]]]}, {"what": "edge_length", "found": pytest.approx(0.3)}),
        ({"edge_length": 0.01}, {"what": "edge_length", "found": 0.01}),
        ({"dividers": COMB}, {"what": "dividers", "found": 200 * 202 + 2 * 200}),
        ({"dividers": GRID}, {"what": "patches", "found": 46 * 46, "expected": 2000}),
    ],
)
def test_wrong_plans_are_refused(changes, fields):
    with refused(PlanError, **fields):
        plan_from({"outline": BOX, "edge_length": 1.0, **tension(changes), **changes}).surface()


@pytest.mark.parametrize(("walls", "parts"), [([WALL], ""), ([WALL, [[15, 0], [15, 12]]], " (2 such parts)")])
def test_the_first_part_without_a_patch_is_named(walls, parts):
    text = f"has no patch{parts}; add one with at= inside it"
    with pytest.raises(PlanError, match=re.escape(text)):
        Plan(BOX, walls, edge_length=1.0, patches={"a": FLAT}).surface()


@pytest.mark.parametrize(
    ("end", "text"),
    [
        (9.5, "divider 'wall 1' is nearest, 0.5 away: let it end there"),
        (10.5, "divider 'wall 1' is nearest, 0.5 away: let it end there"),
        (5.0, "straight on, divider 'wall 1' is 5 away: extend the divider to it"),
        (13.0, "straight on, the outline is 7 away: extend the divider to it"),  # wall 1 lies behind
    ],
)
def test_a_divider_that_ends_inside_a_patch_names_the_line_to_lead_it_to(end, text):
    """Before, it was to be extended to the line that it came from, or to one that it crosses already."""
    with refused(PlanError, what="divider 'wall 2'", where=(end, 6.0)) as caught:
        Plan(BOX, [WALL, [[0, 6], [end, 6]]], tension=5.0).surface()
    assert text in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "fields"),
    [
        ({"outlin": BOX}, {"what": "plan", "where": "outlin"}),
        ({"supports": [[np.nan, 2.0]]}, {"what": "support 1"}),
        ({"tension": None}, {"what": "tension"}),
        ({"plane": {"normals": [0, 0, 1]}}, {"what": "plane", "where": "normals"}),
        ({"dividers": [{"curve": WALL, "botom": "held"}]}, {"what": "divider 1", "where": "botom"}),
        ({"dividers": [[[0, 0]]]}, {"what": "divider 1"}),
        ({"holes": [5]}, {"what": "hole 1"}),
        ({"supports": [[[0, 0], [np.inf, 0]]]}, {"what": "support 1", "where": 1}),
        ({"patches": {"a": {"tensions": 1.0}}}, {"what": "patch 'a'", "where": "tensions"}),
        ({"patches": {"a": {"at": [1, 1]}}}, {"what": "tension", "where": "a"}),
        ({"patches": {"a": 3.0}}, {"what": "patch 'a'", "found": 3.0}),
        ({"patches": [PatchSpec("a", 1.0), PatchSpec("a", 1.0)]}, {"what": "name", "found": "a"}),
        ({"patches": {"a": {"tension": 1.0}}, "tension": 2.0}, {"what": "tension"}),
        ({"outline": [["0", "0"], ["8", "0"], ["8", "4"]]}, {"what": "outline"}),
        (
            {"patches": [PatchSpec(f"{k}", 1.0) for k in range(2001)]},
            {"what": "patches", "found": 2001},
        ),
        ({"dividers": [WALL] * 1001}, {"what": "dividers", "found": 1001}),
        ({"points": {"a\nb": [1, 1]}}, {"what": "points"}),
        ({"dividers": [{"curve": WALL, "name": "a\nb"}]}, {"what": "divider 1.name"}),
    ],
)
def test_wrong_values_are_refused_at_once(changes, fields):
    with refused(OptionError, **fields):
        plan_from({"outline": BOX, **tension(changes), **changes})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"edge": "hinged"}, "unknown edge of the outline 'hinged'"),
        ({"dividers": [{"curve": WALL, "bottom": "hold"}]}, "unknown bottom of divider 1 'hold'"),
        ({"holes": [{**COURT, "edge": "fix"}]}, "unknown edge of hole 1 'fix'; did you mean 'fixed'"),
    ],
)
def test_supports_are_named(changes, message):
    with pytest.raises(OptionError, match=message):
        plan_from({"outline": BOX, "tension": 5.0, **changes})


def test_a_sail_that_nothing_holds_is_offered_its_corners():
    raised = [[0, 0, 3], [10, 0, 0], [10, 8, 3]]
    given = {"outline": raised, "edge": "cable", "cable": 10.0, "tension": 1.0, "pressure": 0.0}
    with pytest.raises(PlanError) as caught:
        plan_from(given).surface()
    offered = str(caught.value).partition("such as supports = ")[2].removesuffix(" under [plan]")
    assert json.loads(offered) == raised
    plan_from(given | {"supports": json.loads(offered)}).surface()


@pytest.mark.parametrize(
    ("key", "value"), [("edge_length", 0.0), ("edge_length", "1"), ("edge_length", True), ("rise", -1.0)]
)
def test_lengths_are_positive(key, value):
    with pytest.raises(OptionError, match=rf"{key}: expected a finite number > 0, found {value!r}"):
        plan_from({"outline": BOX, "tension": 5.0, key: value})


def test_a_plan_needs_an_outline():
    with refused(OptionError, what="outline"):
        plan_from({"tension": 1.0})


def test_a_short_divider_between_edges_still_gets_a_wall():
    surface = Plan(BOX, [[[18, 0], [20, 2]]], tension=5.0, edge_length=2.2).surface()
    assert len(vertices_of(surface, "wall 1")) == 4


def test_walls_need_room_above_the_plane():
    low = [[0, 0, -2], [20, 0, -2], [20, 12, -2], [0, 12, -2]]
    with refused(SurfaceError, what="vertices", found=-2.0) as caught:
        Plan(low, [WALL], tension=5.0, rise=1e-3).surface()
    assert "raise it" in str(caught.value)


def test_without_shapely_the_extra_is_named(monkeypatch):
    plan = Plan(curve(BOX, closed=True), tension=5.0)
    monkeypatch.setitem(sys.modules, "shapely", None)
    with pytest.raises(MissingExtra, match=r"pcmc-surfaces\[plan\]"):
        plan.surface()


def test_a_hole_keeps_its_name_however_often_the_plan_is_changed():
    plan = Plan(BOX, holes=[{**COURT, "name": "court"}], tension=5.0)
    for _ in range(3):
        plan = replace(plan, edge_length=0.5 * plan.edge_length)
    assert [hole.name for hole in plan.holes] == ["hole 'court'"]


@pytest.mark.parametrize("closed", [*at_night(False), True])
def test_a_line_with_loops_is_refused_where_it_crosses_itself(closed):
    turn = np.linspace(0.0, 34.0 * np.pi, 20_000)
    radius = 5.0 + 2.0 * np.sin(2.37 * turn)
    loops = polyline(np.stack([10 + radius * np.cos(turn), 6 + 0.5 * radius * np.sin(turn)], axis=1), closed)
    changes = {"outline": loops} if closed else {"dividers": [loops]}
    with refused(PlanError, what=OUTLINE if closed else ONE) as caught:
        plan_from({"outline": BOX, "tension": 5.0, **changes}).surface()
    near = np.linalg.norm(loops.at(loops.dense) - caught.value.where, axis=1)
    assert np.count_nonzero(near < 0.02) > 2  # two stretches pass there


def star(corners):
    turn = np.arange(corners) * 2.0 * np.pi / corners
    radius = 10.0 + (-1.0) ** np.arange(corners) * 10.0 / corners
    return Plan(np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1), tension=5.0)


def comb(dividers):
    places = np.linspace(0.0, 20.0, dividers + 2)[1:-1]
    return Plan(BOX, [[[x, 0], [x, 12]] for x in places], tension=5.0, edge_length=4.0)


@pytest.mark.parametrize(("plan", "few"), [(star, 2000), *at_night((comb, 50))])
def test_the_cost_of_a_plan_grows_as_its_lines_do(plan, few):
    """Four times as many lines take at most 8 times the work; 16 times if each is compared with each."""

    def work(count):
        made, times = plan(count), []
        for _ in range(3):
            begin = time.process_time()
            made = replace(made)
            assert len(patch_names(made)) == (count + 1 if plan is comb else 1)
            times.append(time.process_time() - begin)
        return min(times)

    work(few // 4)  # loads what is compiled
    assert work(4 * few) < 10.0 * work(few)


def test_a_curve_beside_the_keys_of_its_divider():
    """It was "unknown curve 'name'", while polyline is among the known keys of a divider."""
    divider = {"polyline": WALL, "name": "mid"}
    with pytest.raises(OptionError, match=r"divider 1: beside 'name' its curve is a key, too: curve = {poly"):
        Plan(BOX, [divider], tension=5.0, edge_length=2.0).surface()
    assert Plan(BOX, [{"curve": {"polyline": WALL}, "name": "mid"}], tension=5.0, edge_length=2.0).surface().m


def test_a_wall_with_a_held_bottom_on_an_edge_that_slides():
    """It was "curves: curve 0 has the vertex 4, which is not fixed"."""
    with pytest.raises(
        PlanError, match=r"divider 'wall 1' ends on an edge that slides; give it bottom = .sliding., or"
    ):
        Plan(BOX, [{"curve": WALL, "wall": 1.0}], tension=5.0, edge_length=2.0, edge="sliding").surface()
