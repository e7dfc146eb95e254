"""Branches of equilibria with a closed form: the cap's fold, and what λ may stand for."""

import numpy as np
import pytest
from branches import AT_REST, tension_of_height
from convergence import orders
from shapes import pyramid
from tables import same

from generators import spherical_cap, two_caps
from pcmc import Direction, Parameter, Patch, Surface, certify, follow, solve
from pcmc.base.errors import OptionError
from pcmc.plot import diagram
from pcmc.solvers.continuation import Ending


@pytest.fixture(scope="module")
def caps():
    """The cap's branch from α = 0.6 down, round the fold and up to 1.5 times the hemisphere."""
    return [
        follow(solve(spherical_cap(edge)).surface, "cap", until={"height": 1.5}, step=-0.05)
        for edge in (0.2, 0.1, 0.05)
    ]


# ------------------------------------------------------------------------------ the cap's fold


@pytest.mark.nightly
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
        for control, step in (("arclength", 0.05), ("arclength", 0.15), ("volume", 0.05), ("height", 0.1))
    }
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
        near = follow(caps[1].surfaces[row], "cap", until={"height": event.height + shift}, step=-0.05)
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


def test_a_load_that_is_0_at_the_start_has_steps_of_one_length_in_all_units(small_cap):
    """In newtons instead of kilonewtons a step was a thousand times as short."""
    newtons = small_cap.retensioned({"cap": 600.0}, {"cap": 1000.0})
    loads = Direction(weights={"cap": 1.0})
    one, two = (follow(s, loads, 0.5 * p).points for s, p in ((small_cap, 1.0), (newtons, 1e3)))
    assert two.parameter.to_numpy() == pytest.approx(1e3 * one.parameter, rel=1e-9)
    assert two.height.to_numpy() == pytest.approx(one.height, rel=1e-8)


def test_how_far_parts_are_apart_does_not_change_a_branch(small_cap):
    """Once steps were measured by the box around all: at 400 the branch was lost at its fold."""
    X, F = small_cap.vertices, [*small_cap.faces, *(small_cap.faces + small_cap.n)]
    loads, folds = Direction({"one": 1.0, "other": 1.0}), []
    for apart in (4.0, 400.0):
        both, owner = np.concatenate([X, np.add(X, [apart, 0.0, 0.0])]), np.repeat([0, 1], small_cap.m)
        patches = [Patch("one", 0.6), Patch("other", 0.6)]
        pair = Surface(both, F, owner, patches, fixed=np.tile(small_cap.fixed, 2))
        folds.append(follow(pair, loads, step=-0.05, folds=1).folds.parameter[0])
    assert folds[1] == pytest.approx(folds[0], rel=1e-7)


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
        (Parameter("roof", "snow"), lambda v: (1.0 - v) / 3.0),
        (Direction(pressures={"roof": 2.0}), lambda v: 2.0 * v / 3.0),
        (Direction({"roof": -1.0}, relative=True), lambda v: 1.0 / (3.0 * (1.0 - v))),
        (
            Direction({"roof": 1.0}, {"roof": 0.5}, relative=True),
            lambda v: (1.0 + 0.5 * v) / (3.0 * (1.0 + v)),
        ),
    ],
    ids=["tension", "Parameter", "pressure", "snow", "weight", "relative", "both"],
)
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


# --------------------------------------------------------------------------------------- pictures


def test_diagram_cuts_the_branch_where_stability_changes(small_cap, tmp_path):
    branch = follow(small_cap, "cap", until={"height": 1.2}, step=-0.05)
    stable, unstable = branch.pieces("parameter", "height")
    assert (stable[0], unstable[0]) == (True, False)
    change = branch.events.set_index("kind").loc["index"]
    for piece, end in ((stable, -1), (unstable, 0)):
        assert piece[1][end].tolist() == [change.parameter, change.height]
    assert diagram({"cap": branch}, tmp_path / "cap.png").shape[2] == 3
    assert (tmp_path / "cap.png").stat().st_size > 1000
    with pytest.raises(OptionError, match=r"'cap'.*'heigt'; did you mean 'height'"):
        diagram({"cap": branch}, y="heigt")
