"""Branches of equilibria: closed forms, folds and changes of index located, endings, errors."""

import numpy as np
import pytest
from shapes import octahedron, pyramid
from tables import same

from generators import four_fans, spherical_cap, two_caps, two_squares
from pcmc import Direction, Parameter, certify, follow, solve
from pcmc.contact import pull_and_capacity, standing
from pcmc.continuation import Ending, FollowOptions
from pcmc.continuation.between import GOALS, root
from pcmc.continuation.point import Lost, at_parameter, correct
from pcmc.continuation.shape import Shape
from pcmc.continuation.tracing import Tracer
from pcmc.errors import MissingExtra, OptionError, SurfaceError
from pcmc.plot import diagram

AT_REST = 8**-0.5  # height of the pyramid at rest under tension 1 and pressure 1


def orders(errors):
    errors = np.abs(errors)
    return np.log2(errors[:-1] / errors[1:])


def tension_of_height(h):
    """Of a cap over the unit disc: the sphere of radius 2α has α = (1 + h²) / 4h."""
    return (1.0 + h**2) / (4.0 * h)


@pytest.fixture(scope="module")
def caps():
    """The cap's branch from α = 0.6 down, round the fold and up to 1.5 times the hemisphere."""
    return [
        follow(solve(spherical_cap(edge)).surface, "cap", until={"height": 1.5}, step=-0.05)
        for edge in (0.2, 0.1, 0.05)
    ]


@pytest.fixture(scope="module")
def small_cap():
    return solve(spherical_cap(0.25)).surface


# ------------------------------------------------------------------------------ the cap's fold


def test_cap_folds_at_the_hemisphere_with_second_order(caps):
    for branch in caps:
        assert branch.ending is Ending.REACHED
        assert branch.events.kind.tolist().count("fold") == 1
    tension = np.array([branch.folds.parameter[0] for branch in caps])
    height = np.array([branch.folds.height[0] for branch in caps])
    assert orders(tension - 0.5) == pytest.approx(2.0, abs=0.2)
    assert orders(height - 1.0) == pytest.approx(2.0, abs=0.2)
    assert abs(tension[-1] - 0.5) < 1e-3


def test_cap_is_stable_below_the_fold_and_a_saddle_of_index_1_above(caps):
    for branch in caps:
        points, fold = branch.points, branch.folds.iloc[0]
        below = points.arclength < fold.arclength
        assert below.sum() >= 3
        assert (~below).sum() >= 3
        assert (points["index"] == np.where(below, 0, 1)).all()
        assert ((points.lowest_eigenvalue > 0) == below).all()
        assert ((points.slope < 0) == below).all()
        change = branch.events[branch.events.kind == "index"].iloc[0]
        assert (change.index_before, change.index_after) == (0, 1)
        assert change.parameter == pytest.approx(fold.parameter, rel=1e-4)
        assert change.height == pytest.approx(fold.height, rel=1e-3)


def test_unstable_cap_as_high_as_asked_has_the_sphere_s_tension_to_second_order(caps):
    end = [branch.points.iloc[-1] for branch in caps]
    assert [row.height for row in end] == pytest.approx([1.5] * 3, rel=1e-9)
    error = np.array([row.parameter for row in end]) - tension_of_height(1.5)
    assert orders(error) == pytest.approx(2.0, abs=0.2)
    volume = np.pi / 6.0 * 1.5 * (3.0 + 1.5**2)
    assert orders(np.array([row.volume for row in end]) - volume) == pytest.approx(2.0, abs=0.2)


def test_every_point_is_the_equilibrium_that_its_row_describes(caps):
    branch = caps[1]
    assert branch.points.residual.max() <= 1e-10
    for row in (0, 2, 6, len(branch.points) - 1):
        surface, point = branch.surfaces[row], branch.points.iloc[row]
        found = certify(surface)
        assert surface.tensions[0] == point.parameter == point["tension cap"]
        assert found.energy == pytest.approx(point.energy, rel=1e-12)
        assert found.volume == pytest.approx(point.volume, rel=1e-12)
        assert found.index == point["index"]
        assert surface.vertices[:, 2].max() == point.height
        assert found.residual == pytest.approx(point.residual, rel=1e-2, abs=1e-14)
        assert found.curvature_error < 1e-8


def test_fold_lies_where_it_lies_whatever_the_steps_and_the_control(small_cap):
    found = {
        (control, step): follow(small_cap, "cap", control=control, step=-step, largest=step, folds=1)
        for control, step in (
            ("arclength", 0.05), ("arclength", 0.15), ("volume", 0.05), ("height", 0.1),
        )
    }  # fmt: skip
    for branch in found.values():
        assert branch.ending is Ending.FOLDS
    first, *others = (branch.events.set_index("kind").parameter for branch in found.values())
    for other in others:
        assert other["fold"] == pytest.approx(first["fold"], rel=1e-4)
        assert other["index"] == pytest.approx(first["index"], rel=1e-4)


def test_index_changes_across_the_located_place_and_nowhere_else(caps):
    event = caps[1].events.set_index("kind").loc["index"]
    row = int((caps[1].points.arclength < event.arclength).sum()) - 1
    for shift, index in ((-1e-3, 0), (1e-3, 1)):
        near = follow(
            caps[1].surfaces[row], "cap", until={"height": event.height + shift}, step=-0.05
        )
        assert certify(near.last).index == index


def test_following_the_parameter_alone_ends_at_the_fold(small_cap, caps):
    branch = follow(small_cap, "cap", 0.4, control="parameter")
    assert branch.ending is Ending.LOST
    fold = follow(small_cap, "cap", 0.4, folds=1).folds.parameter[0]
    assert branch.points.parameter.iloc[-1] == pytest.approx(fold, rel=1e-4)


def test_the_way_back_leads_to_the_start(caps):
    end = caps[0].last
    back = follow(end, "cap", until={"height": caps[0].points.height[0]}, step=-0.05)
    assert back.ending is Ending.REACHED
    assert back.events.kind.tolist().count("fold") == 1
    assert back.points.parameter.iloc[-1] == pytest.approx(0.6, rel=1e-3)
    assert back.events.index_after.tolist()[-1] == 0


def test_lengths_twice_and_tensions_twice_give_the_branch_twice_as_large(small_cap):
    twice = small_cap.moved(2.0 * small_cap.vertices).retensioned({"cap": 1.2})
    one, two = (follow(s, "cap", step=-0.05, folds=1) for s in (small_cap, twice))
    assert two.points.parameter.to_numpy() == pytest.approx(2.0 * one.points.parameter, rel=1e-9)
    assert two.points.volume.to_numpy() == pytest.approx(8.0 * one.points.volume, rel=1e-8)
    assert two.folds.parameter[0] == pytest.approx(2.0 * one.folds.parameter[0], rel=1e-9)


def test_same_branch_twice_gives_the_same_tables(small_cap):
    one, two = (follow(small_cap, "cap", step=-0.05, folds=1) for _ in range(2))
    same(one.points, two.points)
    same(one.events, two.events)


# ------------------------------------------------------------------------- what λ may stand for


def pyramid_height(ratio):
    """h with α h / √(1 + h²) = p/3, for ratio = p/3α."""
    return ratio / np.sqrt(1.0 - ratio**2)


@pytest.mark.parametrize(
    ("parameter", "ratio"),
    [
        ("roof", lambda v: 1.0 / (3.0 * v)),
        (Parameter("roof"), lambda v: 1.0 / (3.0 * v)),
        (Parameter("roof", "pressure"), lambda v: v / 3.0),
        (Direction(pressures={"roof": 2.0}), lambda v: 2.0 * v / 3.0),
        (Direction({"roof": -1.0}, relative=True), lambda v: 1.0 / (3.0 * (1.0 - v))),
        (Direction({"roof": 1.0}, {"roof": 0.5}, relative=True),
         lambda v: (1.0 + 0.5 * v) / (3.0 * (1.0 + v))),
    ],
    ids=["tension", "Parameter", "pressure", "weight", "relative", "both"],
)  # fmt: skip
@pytest.mark.parametrize("sign", [1, -1])
def test_pyramid_follows_its_closed_form(parameter, ratio, sign):
    branch = follow(pyramid(height=AT_REST), parameter, step=0.05 * sign, steps=4)
    assert branch.ending is Ending.STEPS
    value = branch.points.parameter.to_numpy()
    assert (np.sign(np.diff(value)) == sign).all()
    assert branch.points.height.to_numpy() == pytest.approx(pyramid_height(ratio(value)), rel=1e-9)


def test_ratio_keeps_the_lower_tension_and_names_what_varies():
    start = solve(two_caps(2.0), target="stationary").surface
    branch = follow(start, Direction.ratio(start, "large", "small"), steps=1)
    assert branch.points.parameter[0] == pytest.approx(4.0 / 3.0)
    assert branch.last.tensions[0] == pytest.approx(3.0 * branch.points.parameter.iloc[-1])
    assert branch.last.tensions[1:].tolist() == [3.0, 4.0]
    assert branch.points["tension large"].iloc[-1] == branch.last.tensions[0]
    assert "tension small" not in branch.points


# ------------------------------------------------------------------------------------- endings


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


# ---------------------------------------------------------------- several patches and walls


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
        assert certify(solve(near, target="stationary", care=0.0).surface).index == index


def test_fold_of_two_caps_on_a_coarse_mesh():
    start = solve(two_caps(1.2), target="stationary").surface
    branch = follow(start, Direction({"large": -1.0, "small": -1.0}, relative=True), folds=1)
    assert branch.ending is Ending.FOLDS
    at = branch.folds.iloc[0]
    assert at["tension large"] == pytest.approx(2.976, abs=0.01)
    assert branch.points.residual.max() <= 1e-10
    lower = start.retensioned(
        {"large": at["tension large"] - 0.02, "small": at["tension small"] - 0.02}
    )
    assert not solve(lower).converged  # no minimum is left; a far saddle is


@pytest.mark.slow
def test_wall_that_comes_down_to_the_plane_on_the_way_changes_the_contact():
    start = solve(two_squares(8, alpha_aux=1.8)).surface
    branch = follow(start, "wall", 2.3)
    assert branch.ending is Ending.REACHED
    assert "contact" in set(branch.events.kind)
    before, after = certify(start), certify(branch.last)
    assert len(before.pinched) == 0 < len(after.pinched)
    assert after.residual <= 1e-9


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
    found = standing(start)
    pull, capacity = pull_and_capacity(found.surface, found.walls, found.rests)
    least = 3.0 * float((pull[found.rests] / capacity[found.rests]).max())
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

    def interrupted(surface, method, **options):
        return solve(surface, method, pressed, **options)

    monkeypatch.setattr("pcmc.continuation.tracing.solve", interrupted)
    branch = follow(start, "wall", 2.51)
    assert branch.ending is Ending.STOPPED
    assert len(branch.points) > 0 == len(branch.events)


@pytest.mark.slow
def test_new_mesh_on_the_way_keeps_to_the_branch(small_cap):
    pytest.importorskip("mmgpy")
    branch = follow(small_cap, "cap", until={"height": 1.5}, step=-0.05, care=0.93, remesh=0.25)
    assert branch.ending is Ending.REACHED
    assert branch.last.m != small_cap.m
    assert branch.points.residual.max() <= 1e-10
    exact = tension_of_height(branch.points.height.to_numpy())
    assert branch.points.parameter.to_numpy() == pytest.approx(exact, rel=0.05)


@pytest.mark.slow
def test_new_mesh_does_not_leap_over_a_goal(small_cap):
    pytest.importorskip("mmgpy")
    options = {"step": -0.05, "care": 0.93, "remesh": 0.25}
    branch = follow(small_cap, "cap", until={"height": 0.8}, steps=2, **options)
    before, after = branch.points.volume.iloc[-1], certify(branch.surfaces[2]).volume
    assert after == pytest.approx(before)
    goal = before + 0.03  # of the mesh made anew after that point it has 0.06 more
    met = follow(small_cap, "cap", until={"volume": goal}, steps=4, **options)
    assert met.ending is Ending.REACHED
    assert met.points.volume.iloc[-1] == pytest.approx(goal, rel=1e-9)


# --------------------------------------------------------------------------------------- pictures


def test_diagram_cuts_the_branch_where_stability_changes(small_cap, tmp_path):
    from pcmc.plot.diagrams import _pieces

    branch = follow(small_cap, "cap", until={"height": 1.2}, step=-0.05)
    stable, unstable = _pieces(branch, "parameter", "height")
    assert (stable[0], unstable[0]) == (True, False)
    change = branch.events.set_index("kind").loc["index"]
    for piece, end in ((stable, -1), (unstable, 0)):
        assert (piece[1][0][end], piece[1][1][end]) == (change.parameter, change.height)
    assert diagram({"cap": branch}, tmp_path / "cap.png").shape[2] == 3
    assert (tmp_path / "cap.png").stat().st_size > 1000
    with pytest.raises(OptionError, match="branch 'cap': unknown column 'heigt'; did you mean"):
        diagram({"cap": branch}, y="heigt")


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
        ({"stop": "1"}, "stop: expected a finite number"),
        ({"callback": 3}, "callback: expected a function of a Progress, found 3"),
        ({"stepp": 1.0}, "unknown option of method 'follow' 'stepp'; did you mean 'step'"),
        ({"step": 0.0}, "step: expected a number that is not 0"),
        ({"control": "volum"}, "unknown control 'volum'; did you mean 'volume'"),
        ({"smallest": 0.1, "largest": 0.01}, "largest: expected a finite number ≥ 0.1"),
        ({"steps": -1}, "steps: expected a whole number"),
        ({"tolerance": 0.0}, "tolerance: expected a finite number > 0"),
        ({"folds": 0}, "folds: expected a whole number ≥ 1"),
        ({"care": 1.0}, "care: expected a finite number ≥ 0 and < 1"),
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
    with pytest.raises(MissingExtra, match=r"pcmc\[remesh\]"):
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
