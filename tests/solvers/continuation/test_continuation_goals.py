"""Where a branch ends: goals, callbacks, limits, and input that is refused."""

import numpy as np
import pytest
from branches import AT_REST
from nightly import at_night, night_but
from refusals import refused
from shapes import octahedron, pyramid

from generators import two_caps, two_squares
from pcmc import Direction, Parameter, follow, solve
from pcmc.base.errors import MissingExtra, OptionError, SurfaceError
from pcmc.solvers.continuation import Ending, FollowOptions
from pcmc.solvers.continuation.branch_point import NotOnBranch, correct, fixed_parameter
from pcmc.solvers.continuation.options import CONTROLS
from pcmc.solvers.continuation.segment import root
from pcmc.solvers.continuation.state import QUANTITIES, BranchMesh, BranchState
from pcmc.solvers.continuation.tracing import Tracer


@pytest.mark.parametrize(
    ("goal", "value"), [("parameter", 0.55), ("energy", 1.2), ("volume", 1.2), ("height", 0.7)]
)
def test_goals_are_met(small_cap, goal, value):
    branch = follow(small_cap, "cap", until={goal: value}, step=-0.05)
    assert branch.ending is Ending.REACHED
    assert branch.points[goal].iloc[-1] == pytest.approx(value, rel=1e-11)
    assert branch.last is branch.surfaces[len(branch.points) - 1]


@pytest.mark.parametrize("control", night_but(CONTROLS, "arclength"))
def test_a_branch_ends_to_the_last_digit_at_the_parameter_asked_for(control):
    for stop in (0.71, 0.83, 0.9, 1.3):
        roof = pyramid(height=AT_REST)
        branch = follow(roof, "roof", stop, control=control)
        assert branch.points.parameter.iloc[-1] == branch.last.patches[0].tension == stop
        branch = follow(roof, Direction(pressures={"roof": 1 / 3}), 3 / stop, control=control)
        assert branch.points.parameter.iloc[-1] == 3 / stop
        assert (
            branch.points["pressure roof"].iloc[-1] == branch.last.patches[0].pressure == (1 / 3) * (3 / stop)
        )
        branch = follow(roof, Direction({"roof": stop - 1.0}, relative=True), 1.0, control=control)
        assert branch.points.parameter.iloc[-1] == 1.0
        assert branch.last.patches[0].tension == 1.0 + (stop - 1.0)
    assert branch.points.residual.iloc[-1] < 1e-10


@pytest.mark.parametrize("above", [False, *at_night(True)])
@pytest.mark.parametrize("goal", ["parameter", *at_night("energy")])
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
    start = two_squares(4, alpha_aux=1.0).retensioned({}, {"left": 0.9, "wall": 0.0})  # not alike: one apex
    start = solve(start, target="stationary").surface
    tracer = Tracer(start, line.line(start), {}, FollowOptions(), None)
    segment = tracer.step(0.05)[0]
    for name in QUANTITIES:
        ahead, behind = (segment.value(name, t) for t in (1e-3, -1e-3))
        slope = segment.derivative(name, segment.start)
        assert slope == pytest.approx((ahead - behind) / 2e-3, rel=1e-3)
        assert abs(slope) > 1e-2


def test_root_of_a_function_that_does_not_quite_change_sign():
    assert root(lambda t: t - 0.25, 0.0, 1.0, 1e-12) == pytest.approx(0.25)
    assert root(lambda t: t + 1e-9, 0.0, 1.0, 1e-12) == 0.0
    assert root(lambda t: t - 1.0 - 1e-9, 0.0, 1.0, 1e-12) == 1.0


def test_stop_gives_the_sense_and_where_it_is_now_there_is_nothing_to_do(small_cap):
    up, down = (follow(small_cap, "cap", stop) for stop in (0.7, 0.55))
    assert (up.last.tensions[0], down.last.tensions[0]) == (0.7, 0.55)
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


def test_mesh_that_collapses_ends_the_branch_with_that_reason():
    start = solve(two_caps(1.2), target="stationary").surface
    branch = follow(start, Direction({"small": 1.0}), 8.0)
    assert branch.ending is Ending.DEGENERATE
    assert "triangles collapse" in branch.detail
    assert branch.points.quality.iloc[-1] < 0.05


def test_a_mesh_that_collapses_says_that_new_meshes_were_in_vain(monkeypatch):
    pytest.importorskip("mmgpy")

    def refuse(surface, edge_length):
        raise SurfaceError("no mesh", what="surface")

    monkeypatch.setattr("pcmc.solvers.continuation.tracing.remesh", refuse)
    start = solve(two_caps(1.2), target="stationary").surface
    branch = follow(start, Direction({"small": 1.0}), 8.0, remesh=1.2)
    assert branch.ending is Ending.DEGENERATE
    assert branch.detail.endswith("; the last new mesh led to no point of the branch")


# ----------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("arguments", "fields"),
    [
        ({"tensions": [1.0]}, {"what": "Direction.tensions", "found": [1.0]}),
        ({"tensions": {"roof": 0.0}}, {"what": "Direction.tensions", "where": "roof", "found": 0.0}),
        ({}, {"what": "Direction"}),
    ],
)
def test_directions_that_name_nothing_are_refused(arguments, fields):
    with refused(OptionError, **fields):
        Direction(**arguments)


@pytest.mark.parametrize("weight", [np.nan, "1", True])
def test_weights_that_are_not_finite_numbers_are_refused(weight):
    with refused(OptionError, what="Direction.pressures", where="roof"):
        Direction(pressures={"roof": weight})


@pytest.mark.parametrize(
    ("arguments", "fields"),
    [
        ({"parameter": 3}, {"what": "parameter", "found": 3}),
        (
            {"parameter": Direction({"roof": 1.0}, {"roof": 2.0})},
            {"what": "parameter", "where": "pressure of 'roof'", "found": 0.5, "expected": 1.0},
        ),
        ({"until": {"hight": 1.0}}, {"what": "column in until", "found": "hight", "expected": QUANTITIES}),
        ({"until": ["height"]}, {"what": "until", "found": ["height"]}),
        ({"until": "height"}, {"what": "until", "found": "height"}),
        ({"stop": 0.9, "until": {"parameter": 1.1}}, {"what": "until"}),
        ({"callback": 3}, {"what": "callback", "found": 3}),
        ({"step": 0.0}, {"what": "step", "found": 0.0}),
        ({"until": {"height": np.inf}}, {"what": "until['height']", "found": np.inf}),
        ({"stop": "1"}, {"what": "stop", "found": "1"}),
        ({"smallest": 0.1, "largest": 0.01}, {"what": "largest", "found": 0.01}),
        ({"steps": -1}, {"what": "steps", "found": -1}),
        ({"tolerance": 0.0}, {"what": "tolerance", "found": 0.0}),
        ({"folds": 0}, {"what": "folds", "found": 0}),
        ({"min_quality": 1.0}, {"what": "min_quality", "found": 1.0}),
        ({"keep": 0}, {"what": "keep", "found": 0}),
        ({"remesh": -1.0}, {"what": "remesh", "found": -1.0}),
    ],
)
def test_arguments_that_are_refused(arguments, fields):
    with refused(OptionError, **fields):
        follow(pyramid(height=AT_REST), **{"parameter": "roof"} | arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"parameter": "rof"}, "unknown patch 'rof'; did you mean 'roof'"),
        ({"stepp": 1.0}, "unknown option of method 'follow' 'stepp'; did you mean 'step'"),
        ({"control": "volum"}, "unknown control 'volum'; did you mean 'volume'"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_unknown_names_are_refused_with_the_nearest_one(arguments, message):
    with pytest.raises(OptionError, match=message):
        follow(pyramid(height=AT_REST), **{"parameter": "roof"} | arguments)


def test_surfaces_that_no_branch_starts_from():
    with refused(SurfaceError, what="surface", found="list"):
        follow([], "roof")
    with refused(SurfaceError, what="surface", expected=1e-4) as caught:
        follow(pyramid(height=1.0), "roof")
    assert caught.value.found > 0.1
    assert "solve it first" in str(caught.value)
    pinched = solve(two_squares(6, alpha_aux=3.0), target="stationary").surface
    with refused(SurfaceError, what="surface") as caught:
        follow(pinched.retensioned({"wall": 1.0}), "wall")
    assert "a junction is pulled off the plane" in str(caught.value)
    with refused(OptionError, what="parameter"):
        follow(pyramid(height=AT_REST, fixed=range(5)), "roof")
    flat = pyramid(height=0.0).retensioned({}, {"roof": 0.0})
    with refused(OptionError, what="parameter"):
        follow(flat, "roof")
    with refused(SurfaceError, what="surface", found=2, expected=0):
        follow(solve(octahedron(fixed=(0,)), target="stationary").surface, "bubble")


def test_tensions_that_are_zero_have_no_ratio_and_no_branch():
    start = solve(two_squares(3, alpha_aux=0.0)).surface
    with refused(OptionError, what="parameter", where="wall", found=0.0):
        follow(start, "wall")
    with refused(OptionError, what="lower", found="wall"):
        Direction.ratio(start, "left", "wall")


def test_what_a_branch_is_asked_for_is_checked(small_cap):
    branch = follow(small_cap, "cap", steps=1)
    for row in ("1", [1], True, -1, 9):
        with refused(OptionError, what="row", found=row):
            branch.resume(row, 0.7)
    for stop in ("0.7", None):
        with refused(OptionError, what="stop", found=stop):
            branch.resume(1, stop)
    with refused(OptionError, what="column", found="hight"):
        branch.pieces("parameter", "hight")


def test_remeshing_without_its_library_is_refused_at_once(monkeypatch):
    monkeypatch.setattr("pcmc.solvers.continuation.branch.find_spec", lambda name: None)
    with pytest.raises(MissingExtra, match=r"pcmc-surfaces\[remesh\]"):
        follow(pyramid(height=AT_REST), "roof", remesh=0.5)


def test_a_correction_that_leaves_the_tensions_allowed_is_lost_not_a_contact(monkeypatch):
    """Newton's step may carry λ past 0 and a junction down to Π at once."""
    surface = solve(two_squares(4, alpha_aux=1.0)).surface
    mesh = BranchMesh(surface, Direction({"wall": 1.0}).line(surface))
    monkeypatch.setattr(BranchMesh, "reaches_plane", lambda self, X: np.ones(len(X), dtype=bool))
    with pytest.raises(NotOnBranch, match="a tension would reach 0"):
        correct(BranchState(mesh, surface.vertices, 1.0), fixed_parameter(-5.0, 1.0), 1e-10)
