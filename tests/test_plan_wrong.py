"""Every way in which a plan can be wrong."""

import builtins
import sys

import numpy as np
import pytest

from pcmc.base.errors import MissingExtra, OptionError, PlanError, SurfaceError
from pcmc.plan import Area, Plan, plan_from
from pcmc.plan.curves import arc, circle, curve, join, polyline
from tests.test_plan import BOX, vertices_of

COURT = {"curve": circle([17, 5], 2)}
WALL = [[10, 0], [10, 12]]
WEST, EAST = 3.85 * np.array([[-np.cos(0.4), -np.sin(0.4)], [np.cos(0.4), np.sin(0.4)]])
TURNED = join(arc(WEST, [0, 3.85], EAST), arc(EAST, [0, -3.85], WEST))  # octagons would cross


def tension(changes):
    """Of all patches, where there are none with tensions of their own."""
    return {} if "patches" in changes else {"tension": 5.0}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"outline": [[0, 0], [4, 4], [4, 0], [0, 4]]}, r"the outline crosses itself at \(2, 2\)"),
        ({"outline": polyline(BOX)}, r"the outline is open: .* 12 apart"),
        ({"outline": [[0, 0, 0], [9, 0, 0], [4, 0, 4]]}, "the outline crosses itself"),
        ({"holes": [polyline([[1, 1], [2, 1], [2, 2]])]}, "hole 1 is open"),
        ({"holes": [circle([30, 5], 2)]}, "hole 1 lies outside the outline"),
        ({"holes": [{**COURT, "name": "court"}, circle([19, 5], 2)]}, "hole 2 crosses or touches"),
        ({"holes": [circle([6, 5], 2), circle([8, 5], 1)]}, "hole 1 and hole 2 touch or overlap"),
        ({"dividers": [[[10, 0], [10, 9]]]}, r"'wall 1' ends at \(10, 9\) .* nearest, 3 away"),
        ({"dividers": [[[25, 0], [25, 9]]]}, "divider 'wall 1' lies outside the plan"),
        ({"dividers": [WALL, [[0, 6], [9, 6]]]}, "divider 'wall 1' is nearest, 1 away"),
        ({"dividers": [[[0, 0], [20, 0]]]}, "divider 'wall 1' runs along the outline"),
        ({"dividers": [[[1, 0.004], [9, 0]]]}, "'wall 1' runs along the outline near"),
        ({"supports": [[25, 3]]}, r"the support at \(25, 3\) lies outside the plan"),
        ({"supports": [[17, 5]], "holes": [COURT]}, r"the support at \(17, 5\) lies outside"),
        ({"dividers": [[[2, 0], [8, 12], [8, 0], [2, 12]]]}, "'wall 1' crosses itself at"),
        ({"dividers": [[[5, 5, 0], [5, 5, 3]]]}, "'wall 1' has no length on the plane"),
        ({"dividers": [WALL], "patches": {"a": {"tension": 1}}}, "into 2 parts, but 1 patches"),
        ({"dividers": [WALL], "patches": {"a": {"tension": 1, "at": [1, 1]}}}, "has no patch"),
        (
            {"patches": {"a": {"tension": 1, "at": [1, 1]}, "b": {"tension": 1, "at": [9, 1]}}},
            "patches 'a' and 'b' are at the same part",
        ),
        ({"patches": {"a": {"tension": 1, "at": [1, 99]}}}, r"'a': its point \[1.0, 99.0\]"),
        (
            {"patches": {"a": {"tension": 1, "at": [1, 1]}, "b": {"tension": 1}}},
            "patch 'b' has no at=",
        ),
        ({"edge": "free"}, "nothing holds the roof"),
        (
            {
                "outline": [[0, 0, 1], [20, 0, 2], [20, 12, 1], [0, 12, 1]],
                "dividers": [{"curve": WALL, "bottom": "sloped"}, [[0, 6], [10, 6]]],
            },
            "a wall with a sloped bottom meets one",
        ),
        (
            {"outline": circle([0, 0], 4), "holes": [TURNED], "edge_length": 3.5},
            "the outline and hole 1 cross near .* smaller edge_length",
        ),
        ({"edge_length": 20.0}, "every vertex .* smaller edge_length"),
        ({"rise": 1e6}, r"rise=1e\+06 is more than 10 times the plan's size, 23.32"),
        ({"holes": [circle([17, 5], 1e-9)]}, "hole 1 is only .*e-09 wide, too little for edges"),
        ({"edge_length": 30.0}, "edge_length=30 is longer than the plan, 23.32 from corner"),
        ({"edge_length": 1e-4}, "about 5.5e\\+10 triangles"),
    ],
)  # fmt: skip
def test_wrong_plans_are_refused(changes, message):
    with pytest.raises(PlanError, match=message):
        plan_from({"outline": BOX, "edge_length": 1.0, **tension(changes), **changes}).surface()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"outlin": BOX}, "unknown plan key 'outlin'; did you mean 'outline'"),
        ({"edge_length": 0.0}, "edge_length must be a finite number > 0"),
        ({"edge_length": "1"}, "edge_length must be a finite number > 0"),
        ({"rise": -1.0}, "rise must be"),
        ({"edge": "hinged"}, "outline: edge: unknown value 'hinged'"),
        ({"edge_length": True}, "edge_length must be a finite number > 0, found True"),
        ({"supports": [[np.nan, 2.0]]}, r"support 1: the point \[nan, 2.0\] is not finite"),
        ({"tension": None}, "needs patches with tensions"),
        ({"plane": {"normals": [0, 0, 1]}}, "did you mean 'normal'"),
        ({"dividers": [{"curve": WALL, "botom": "held"}]}, "divider 1 key 'botom'; did you mean"),
        (
            {"dividers": [{"curve": WALL, "bottom": "hold"}]},
            "divider 1: bottom: unknown value 'hold'; did you",
        ),
        ({"dividers": [[[0, 0]]]}, "divider 1: polyline: expected 2 points"),
        ({"holes": [{**COURT, "edge": "fix"}]}, "hole 1: edge: unknown value 'fix'; did you mean"),
        ({"holes": [5]}, "hole 1: polyline: expected points"),
        ({"supports": [[[0, 0], [np.inf, 0]]]}, "support 1: .* is not finite"),
        ({"patches": {"a": {"tensions": 1.0}}}, "patch 'a' key 'tensions'; did you mean 'tension'"),
        ({"patches": {"a": {"at": [1, 1]}}}, "patch 'a' needs a tension"),
        ({"patches": {"a": 3.0}}, "patch 'a' key: expected a table"),
        ({"patches": [Area("a", 1.0), Area("a", 1.0)]}, "the name 'a' is used twice"),
        ({"patches": {"a": {"tension": 1.0}}, "tension": 2.0}, "patches, each .* or one tension="),
        ({"outline": [["0", "0"], ["8", "0"], ["8", "4"]]}, "outline: polyline: expected points"),
    ],
)
def test_wrong_values_are_refused_at_once(changes, message):
    with pytest.raises(OptionError, match=message):
        plan_from({"outline": BOX, **tension(changes), **changes})


def test_a_plan_needs_an_outline():
    with pytest.raises(OptionError, match="needs an outline"):
        plan_from({"tension": 1.0})


def test_a_short_divider_between_edges_still_gets_a_wall():
    surface = Plan(BOX, [[[19, 0], [20, 1]]], tension=5.0, edge_length=2.0).surface()
    assert len(vertices_of(surface, "wall 1")) == 4


def test_walls_need_room_above_the_plane():
    low = [[0, 0, -2], [20, 0, -2], [20, 12, -2], [0, 12, -2]]
    with pytest.raises(SurfaceError, match="no room for a wall"):
        Plan(low, [WALL], tension=5.0).surface()


def test_without_shapely_the_extra_is_named(monkeypatch):
    plan = Plan(curve(BOX, closed=True), tension=5.0)
    real = builtins.__import__

    def without(name, *rest, **more):
        if name == "shapely":
            raise ModuleNotFoundError(name, name=name)
        return real(name, *rest, **more)

    for module in ("pcmc.plan.lines", "pcmc.plan.arrangement", "pcmc.plan.drafting"):
        monkeypatch.delitem(sys.modules, module, raising=False)
    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingExtra, match=r"pcmc-surfaces\[plan\]"):
        plan.surface()
