"""Explore: drafts follow their values, as far as there is a way, and every step can be undone."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from browsing import until
from refusals import refused

import pcmc
from generators import bezier_hall, four_fans, spherical_cap
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.certificate.certificate import Verdict
from pcmc.explore.draft import Draft, begin, between, reach
from pcmc.surface.wall_pressures import with_pressures

CAP = spherical_cap(edge_length=0.25)
HALL = bezier_hall(edge_length=10.0)


@pytest.fixture(scope="module")
def cap():
    return begin(CAP)


@pytest.fixture(scope="module")
def hall():
    return begin(HALL)


def rise(surface):
    return surface.vertices[:, 2].max()


def test_a_draft_begins_at_rest_and_leaves_the_surface_given_as_it_was(cap):
    before = CAP.vertices.copy()
    assert cap.found.verdict is Verdict.STABLE
    assert cap.trouble is None
    assert not np.array_equal(cap.surface.vertices, before)
    np.testing.assert_array_equal(CAP.vertices, before)


def test_a_surface_at_rest_is_not_solved_again(cap):
    assert begin(cap.surface).surface is cap.surface


def test_following_gives_the_surface_that_solving_gives(hall):
    values = {"tensions": {"left wall": 12.0}, "pressures": {"middle": 1.02}}
    state = Draft(hall).follow(values)
    assert state.trouble is None
    assert [p.tension for p in state.surface.patches] == [30.0, 30.0, 30.0, 12.0, 15.0]
    wanted = with_pressures(hall.surface, **values)
    assert state.surface.pressures == pytest.approx([1.0, 1.02, 1.0, -0.02, 0.02])
    assert state.surface.patches == wanted.patches
    solved = pcmc.solve(wanted)
    np.testing.assert_allclose(
        state.surface.vertices, solved.surface.vertices, atol=1e-6 * HALL.size
    )
    assert pcmc.certify(state.surface).residual < 1e-8


def test_where_no_equilibrium_exists_the_last_surface_stays(cap):
    draft = Draft(cap)
    state = draft.follow({"tensions": {"cap": 0.3}})
    assert state.surface is cap.surface
    assert state.trouble.verdict is Verdict.NO_EQUILIBRIUM
    assert [p.tension for p in state.asked] == [0.3]
    assert (state.undo, state.redo) == (1, 0)
    back = draft.undo()
    assert back.trouble is None
    assert back.asked == back.surface.patches
    assert (back.undo, back.redo) == (0, 0)


def test_settling_goes_as_far_as_there_is_a_way_and_says_why_not_further(cap):
    wanted = cap.surface.retensioned({"cap": 0.4})
    way = reach(cap.surface, wanted, lambda: False, iterations=40)
    alpha = way.surface.patches[0].tension
    assert 0.47 < alpha < 0.51  # the hemisphere is at 0.5; a coarse mesh goes a little further
    assert rise(way.surface) > 0.75
    assert way.failed.verdict not in (Verdict.STABLE, Verdict.SADDLE)
    assert way.found.verdict is pcmc.certify(way.surface).verdict is Verdict.STABLE


def test_reaching_stops_when_told_and_after_its_attempts(cap):
    wanted = cap.surface.retensioned({"cap": 0.3})
    way = reach(cap.surface, wanted, lambda: True)
    assert way.surface is cap.surface
    assert way.found is None
    halfway = reach(cap.surface, cap.surface.retensioned({"cap": 0.45}), lambda: False, attempts=2)
    assert [p.tension for p in halfway.surface.patches] == pytest.approx([0.525])
    assert halfway.failed is not None


def test_following_goes_halfway_where_the_whole_way_fails(cap):
    draft = Draft(cap)
    state = draft.follow({"tensions": {"cap": 0.45}})
    assert state.trouble is None
    assert state.surface.patches[0].tension == pytest.approx(0.525)
    assert state.asked[0].tension == 0.45


def test_settling_is_steps_that_can_be_undone_and_done_again(cap):
    draft = Draft(cap)
    heights = [rise(draft.settle({"tensions": {"cap": a}}).surface) for a in (0.7, 0.8, 0.9)]
    assert heights == sorted(heights, reverse=True)
    state = draft.undo()
    assert rise(state.surface) == heights[1]
    assert [p.tension for p in state.asked] == [0.8]
    assert (state.undo, state.redo) == (2, 1)
    assert rise(draft.redo().surface) == heights[2]
    draft.undo()
    state = draft.settle({"tensions": {"cap": 0.75}})
    assert (state.undo, state.redo) == (3, 0)  # a new step ends the old future
    state = draft.reset()
    assert state.surface is cap.surface
    assert state.undo == 4


def test_steps_kept_are_bounded_and_the_first_stays(cap, monkeypatch):
    monkeypatch.setattr("pcmc.explore.draft.STEPS_KEPT", 4)
    draft = Draft(cap)
    for k in range(6):
        state = draft.settle({"tensions": {"cap": 0.7 + 0.01 * k}})
    assert state.undo == 3
    for _ in range(3):
        state = draft.undo()
    assert state.surface is cap.surface


def test_a_newer_wish_ends_the_work_on_an_older_one(cap):
    turn = threading.Lock()
    draft = Draft(cap, turn)
    states = {}

    def ask(name, value):
        states[name] = draft.settle({"tensions": {"cap": value}})

    with turn:
        old = threading.Thread(target=ask, args=("old", 0.7))
        old.start()
        until(lambda: draft._asked_for == 1, "the first wish")
        new = threading.Thread(target=ask, args=("new", 0.8))
        new.start()
        until(lambda: draft._asked_for == 2, "the second wish")
    old.join()
    new.join()
    assert states["old"].superseded
    assert not states["new"].superseded
    assert [p.tension for p in draft.surface.patches] == [0.8]
    assert states["new"].undo == 1


def test_a_saddle_is_followed_and_said_and_becomes_stable_with_weaker_walls():
    draft = Draft(begin(four_fans(rings=7)))
    state = draft.state()
    assert state.found.verdict is Verdict.SADDLE
    assert len(state.found.modes)
    state = draft.settle({"tensions": {f"wall {k}": 0.5 for k in range(1, 5)}})
    assert state.trouble is None
    assert state.found.index < 2 or state.found.verdict is Verdict.STABLE


def test_values_that_cannot_be_are_refused_and_change_nothing(cap):
    draft = Draft(cap)
    with pytest.raises(OptionError, match="did you mean 'cap'"):
        draft.follow({"tensions": {"cup": 1.0}})
    with refused(SurfaceError, what="tension", where="cap", found=-1.0):
        draft.settle({"tensions": {"cap": -1.0}})
    state = draft.state()
    assert state.asked == cap.surface.patches
    assert state.trouble is None


def test_between_is_the_straight_way():
    end = HALL.retensioned({"left": 50.0}, {"right": 3.0})
    middle = between(HALL, end, 0.5)
    assert [p.tension for p in middle.patches] == [40.0, 30.0, 30.0, 10.0, 15.0]
    assert [p.pressure for p in middle.patches] == [1.0, 1.0, 2.0, 0.0, 0.0]
    assert between(HALL, end, 1.0).patches == end.patches


def test_a_surface_that_nothing_brings_to_rest_is_shown_as_it_was_given():
    begun = begin(CAP.retensioned({"cap": 0.2}))
    np.testing.assert_array_equal(begun.surface.vertices, CAP.vertices)
    assert begun.trouble.verdict is Verdict.NO_EQUILIBRIUM
    state = Draft(begun).settle({"tensions": {"cap": 0.8}})
    assert state.trouble is None
    assert state.found.verdict is Verdict.STABLE
