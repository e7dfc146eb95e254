"""Where a branch ends: goals, callbacks, limits, and input that is refused."""

import numpy as np
import pytest
from branches import AT_REST
from shapes import octahedron, pyramid

from generators import two_caps, two_squares
from pcmc import Direction, Parameter, follow, solve
from pcmc.base.errors import MissingExtra, OptionError, SurfaceError
from pcmc.continuation import Ending, FollowOptions
from pcmc.continuation.between import GOALS, root
from pcmc.continuation.point import Lost, at_parameter, correct
from pcmc.continuation.shape import Shape
from pcmc.continuation.tracing import Tracer


@pytest.mark.parametrize(
    ("goal", "value"), [("parameter", 0.55), ("energy", 1.2), ("volume", 1.2), ("height", 0.7)]
)
def test_goals_are_met_exactly(small_cap, goal, value):
    branch = follow(small_cap, "cap", until={goal: value}, step=-0.05)
    assert branch.ending is Ending.REACHED
    assert branch.points[goal].iloc[-1] == pytest.approx(value, rel=1e-9)
    assert branch.last is branch.surfaces[len(branch.points) - 1]


@pytest.mark.parametrize("above", [False, True])
@pytest.mark.parametrize("goal", ["parameter", "energy"])
def test_goal_that_a_step_passes_twice_is_met_the_first_time(small_cap, goal, above):
    """λ and E turn at the fold: both ends of the step over it lie on one side of the goal."""
    start = small_cap
    if above:
        start = follow(small_cap, "cap", until={"height": 1.5}, step=-0.05).last
    whole = follow(start, "cap", step=-0.05, folds=1)
    fold, ends = whole.folds.iloc[0], whole.points.iloc[-2:]
    value = 0.5 * (fold[goal] + ends[goal].min())
    assert fold[goal] < value < ends[goal].min()
    branch = follow(start, "cap", until={goal: value}, step=-0.05)
    assert branch.ending is Ending.REACHED
    assert branch.points[goal].iloc[-1] == pytest.approx(value, rel=1e-9)
    assert ends.arclength.iloc[0] < branch.points.arclength.iloc[-1] < fold.arclength
    assert not len(branch.folds)


def test_goal_beyond_the_fold_of_the_same_step_is_met_after_it(small_cap):
    whole = follow(small_cap, "cap", step=-0.05, until={"height": 1.5})
    fold = whole.folds.iloc[0]
    after = int((whole.points.arclength < fold.arclength).sum())
    height = 0.5 * (fold.height + whole.points.height[after])
    branch = follow(small_cap, "cap", until={"height": height}, step=-0.05)
    assert branch.points.height.iloc[-1] == pytest.approx(height, rel=1e-9)
    assert len(branch.points) == after + 1
    assert branch.folds.parameter[0] == pytest.approx(fold.parameter, rel=1e-6)


@pytest.mark.parametrize("parameter", ["wall", Parameter("left", "pressure")], ids=str)
def test_rates_of_goals_are_their_slopes_along_the_branch(parameter):
    weights = {parameter: 1.0} if isinstance(parameter, str) else {}
    line = Direction(weights, {} if weights else {"left": 1.0})
    start = two_squares(4, alpha_aux=1.0).retensioned({}, {"left": 0.9})  # not alike: one apex
    start = solve(start, target="stationary").surface
    tracer = Tracer(start, line.line(start), {}, FollowOptions(), None)
    stretch = tracer.step(0.05).stretch
    for name in GOALS:
        ahead, behind = (stretch.value(name, t) for t in (1e-3, -1e-3))
        slope = stretch.rate(name, stretch.here)
        assert slope == pytest.approx((ahead - behind) / 2e-3, rel=1e-3)
        assert abs(slope) > 1e-2


def test_root_of_a_function_that_does_not_quite_change_sign():
    assert root(lambda t: t - 0.25, 0.0, 1.0, 1e-12) == pytest.approx(0.25)
    assert root(lambda t: t + 1e-9, 0.0, 1.0, 1e-12) == 0.0
    assert root(lambda t: t - 1.0 - 1e-9, 0.0, 1.0, 1e-12) == 1.0


def test_stop_gives_the_sense_and_where_it_is_now_there_is_nothing_to_do(small_cap):
    up, down = (follow(small_cap, "cap", stop) for stop in (0.7, 0.55))
    assert up.last.tensions[0] == pytest.approx(0.7, rel=1e-9)
    assert down.last.tensions[0] == pytest.approx(0.55, rel=1e-9)
    nothing = follow(small_cap, "cap", small_cap.tensions[0])
    assert (nothing.ending, len(nothing.points)) == (Ending.REACHED, 1)
    assert nothing.events.columns.tolist()[:2] == ["kind", "parameter"]


def test_only_every_so_many_surfaces_are_kept_and_the_last(small_cap):
    branch = follow(small_cap, "cap", step=-0.05, steps=7, keep=3)
    assert sorted(branch.surfaces) == [0, 3, 6, 7]
    assert branch.last.tensions[0] == branch.points.parameter.iloc[-1]


def test_callback_sees_every_point_and_may_stop(small_cap):
    seen = []

    def watch(progress):
        seen.append((progress.iteration, progress.surface().tensions[0], progress.row["height"]))
        if progress.iteration == 2:
            raise StopIteration

    branch = follow(small_cap, "cap", step=-0.05, callback=watch)
    assert branch.ending is Ending.STOPPED
    assert [number for number, _, _ in seen] == [0, 1, 2]
    assert [tension for _, tension, _ in seen] == branch.points.parameter.tolist()
    assert [height for _, _, height in seen] == branch.points.height.tolist()

    def fail(progress):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        follow(small_cap, "cap", callback=fail)


def test_tension_does_not_pass_zero():
    start = solve(two_squares(4, alpha_aux=0.3)).surface
    branch = follow(start, "wall", -1.0)
    assert branch.ending is Ending.LOST
    assert "a tension would reach 0" in branch.message
    assert 0.0 < branch.points.parameter.iloc[-1] < 1e-3


@pytest.mark.slow
def test_mesh_that_collapses_ends_the_branch_with_that_reason():
    start = solve(two_caps(1.2), target="stationary").surface
    branch = follow(start, Direction({"small": 1.0}), 8.0)
    assert branch.ending is Ending.DEGENERATE
    assert "triangles collapse" in branch.detail
    assert branch.points.quality.iloc[-1] < 0.05


# ----------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tensions": [1.0]}, r"Direction\.tensions: expected weights by patch name"),
        ({"tensions": {"roof": 0.0}}, r"Direction\.tensions\['roof'\]: expected a finite weight"),
        ({"pressures": {"roof": np.nan}}, r"Direction\.pressures\['roof'\]: expected a finite"),
        ({"tensions": {"roof": "1"}}, r"not 0, found '1'"),
        ({}, "name at least one patch"),
    ],
)
def test_directions_that_are_none(arguments, message):
    with pytest.raises(OptionError, match=message):
        Direction(**arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"parameter": "rof"}, "unknown patch 'rof'; did you mean 'roof'"),
        ({"parameter": 3}, "parameter: expected the name of a patch, a Parameter or a Direction"),
        ({"parameter": Direction({"roof": 1.0}, {"roof": 2.0})},
         "makes the parameter 1, the pressure of 'roof' makes it 0.5"),
        ({"until": {"hight": 1.0}}, "unknown column in until 'hight'; did you mean 'height'"),
        ({"until": {"height": np.inf}}, r"until\['height'\]: expected a finite number"),
        ({"until": ["height"]}, "until: expected a value by column"),
        ({"until": "height"}, "until: expected a value by column"),
        ({"stop": 0.9, "until": {"parameter": 1.1}}, "are the same goal; give one of them"),
        ({"stop": "1"}, "stop: expected a finite number"),
        ({"callback": 3}, "callback: expected a function of a Progress, found 3"),
        ({"stepp": 1.0}, "unknown option of method 'follow' 'stepp'; did you mean 'step'"),
        ({"step": 0.0}, "step: expected a number that is not 0"),
        ({"control": "volum"}, "unknown control 'volum'; did you mean 'volume'"),
        ({"smallest": 0.1, "largest": 0.01}, "largest: expected a finite number ≥ 0.1"),
        ({"steps": -1}, "steps: expected a whole number"),
        ({"tolerance": 0.0}, "tolerance: expected a finite number > 0"),
        ({"folds": 0}, "folds: expected a whole number ≥ 1"),
        ({"min_quality": 1.0}, "min_quality: expected a finite number ≥ 0 and < 1"),
        ({"keep": 0}, "keep: expected a whole number ≥ 1"),
        ({"remesh": -1.0}, "remesh: expected a finite number > 0"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)  # fmt: skip
def test_options_that_are_refused(arguments, message):
    with pytest.raises(OptionError, match=message):
        follow(pyramid(height=AT_REST), **{"parameter": "roof"} | arguments)


def test_surfaces_that_no_branch_starts_from():
    with pytest.raises(SurfaceError, match="follow: expected a Surface, found list"):
        follow([], "roof")
    with pytest.raises(SurfaceError, match=r"not at rest \(relative residual .*solve it first"):
        follow(pyramid(height=1.0), "roof")
    pinched = solve(two_squares(6, alpha_aux=3.0), target="stationary").surface
    with pytest.raises(SurfaceError, match=r"not at rest \(a junction is pulled off the plane"):
        follow(pinched.retensioned({"wall": 1.0}), "wall")
    with pytest.raises(OptionError, match="the parameter moves nothing"):
        follow(pyramid(height=AT_REST, fixed=range(5)), "roof")
    flat = pyramid(height=0.0).retensioned({}, {"roof": 0.0})
    with pytest.raises(OptionError, match="as that of a flat patch's tension does"):
        follow(flat, "roof")
    with pytest.raises(SurfaceError, match=r"nothing holds the surface against \d rigid motions"):
        follow(solve(octahedron(fixed=(0,)), target="stationary").surface, "bubble")


def test_tensions_that_are_zero_have_no_ratio_and_no_branch():
    start = solve(two_squares(3, alpha_aux=0.0)).surface
    with pytest.raises(OptionError, match="the tension of 'wall' is 0, where its triangles stop"):
        follow(start, "wall")
    with pytest.raises(OptionError, match=r"Direction\.ratio: patch 'wall' has tension 0"):
        Direction.ratio(start, "left", "wall")


def test_remeshing_without_its_library_is_refused_at_once(monkeypatch):
    monkeypatch.setattr("pcmc.continuation.branch.find_spec", lambda name: None)
    with pytest.raises(MissingExtra, match=r"pcmc-surfaces\[remesh\]"):
        follow(pyramid(height=AT_REST), "roof", remesh=0.5)


def test_every_ending_says_something_else():
    sentences = [ending.value for ending in Ending]
    assert len(set(sentences)) == len(sentences)
    assert FollowOptions().control == "arclength"


def test_a_correction_that_leaves_the_tensions_allowed_is_lost_not_a_contact(monkeypatch):
    """Newton's step may carry λ past 0 and a junction down to Π at once."""
    surface = solve(two_squares(4, alpha_aux=1.0)).surface
    line = Direction({"wall": 1.0}).line(surface)
    shape = Shape(surface)
    monkeypatch.setattr(Shape, "down", lambda self, X: np.ones(len(X), dtype=bool))
    with pytest.raises(Lost, match="a tension would reach 0"):
        correct(shape, line, surface.vertices, 1.0, at_parameter(-5.0, 1.0), 1e-10)
