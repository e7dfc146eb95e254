"""Explore: a session follows its values as far as it can, and every step can be undone."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from browsing import until
from refusals import refused

import pcmc
from generators import bezier_hall, four_fans, spherical_cap
from pcmc.accuracy import check_mesh
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.certificate import Verdict
from pcmc.explore.following import between, reach
from pcmc.explore.session import Session, solved_start
from pcmc.plan import Plan
from pcmc.project.values import changeable_values

CAP = spherical_cap(edge_length=0.25)
HALL = bezier_hall(edge_length=10.0)


@pytest.fixture(scope="module")
def cap():
    return solved_start(CAP)


@pytest.fixture(scope="module")
def hall():
    return solved_start(HALL)


def rise(surface):
    return surface.vertices[:, 2].max()


def test_a_draft_begins_at_rest_and_leaves_the_surface_given_as_it_was(cap):
    before = CAP.vertices.copy()
    assert cap.certificate.verdict is Verdict.STABLE
    assert cap.failure is None
    assert not np.array_equal(cap.surface.vertices, before)
    np.testing.assert_array_equal(CAP.vertices, before)


def test_a_surface_at_rest_is_not_solved_again(cap):
    assert solved_start(cap.surface).surface is cap.surface


def test_following_gives_the_surface_that_solving_gives(hall):
    values = {"tensions": {"left wall": 12.0}, "pressures": {"middle": 1.02}}
    state = Session(hall).follow(values)
    assert state.failure is None
    assert [p.tension for p in state.surface.patches] == [30.0, 30.0, 30.0, 12.0, 15.0]
    wanted = hall.surface.retensioned(**values)
    assert state.surface.pressures == pytest.approx([1.0, 1.02, 1.0, -0.02, 0.02])
    assert state.surface.patches == wanted.patches
    solved = pcmc.solve(wanted)
    np.testing.assert_allclose(state.surface.vertices, solved.surface.vertices, atol=1e-6 * HALL.size)
    assert pcmc.certify(state.surface).residual < 1e-8


def test_where_no_equilibrium_exists_the_last_surface_stays(cap):
    session = Session(cap)
    state = session.follow({"tensions": {"cap": 0.3}})
    assert state.surface is cap.surface
    assert state.failure.verdict is Verdict.NO_EQUILIBRIUM
    assert [p.tension for p in state.wanted.patches] == [0.3]
    assert (state.undo, state.redo) == (1, 0)
    back = session.undo()
    assert back.failure is None
    assert back.wanted.patches == back.surface.patches
    assert (back.undo, back.redo) == (0, 0)


def test_settling_goes_as_far_as_there_is_a_way_and_says_why_not_further(cap):
    wanted = cap.surface.retensioned({"cap": 0.4})
    way = reach(cap.surface, wanted, lambda: False, iterations=40)
    alpha = way.surface.patches[0].tension
    assert 0.47 < alpha < 0.51  # the hemisphere is at 0.5; a coarse mesh goes a little further
    assert rise(way.surface) > 0.75
    assert way.failed.verdict not in (Verdict.STABLE, Verdict.SADDLE)
    assert way.certificate.verdict is pcmc.certify(way.surface).verdict is Verdict.STABLE


def test_reaching_stops_when_told_and_after_its_attempts(cap):
    wanted = cap.surface.retensioned({"cap": 0.3})
    way = reach(cap.surface, wanted, lambda: True)
    assert way.surface is cap.surface
    assert way.certificate is None
    halfway = reach(cap.surface, cap.surface.retensioned({"cap": 0.45}), lambda: False, attempts=2)
    assert [p.tension for p in halfway.surface.patches] == pytest.approx([0.525])
    assert halfway.failed is not None


def test_following_goes_halfway_where_the_whole_way_fails(cap):
    session = Session(cap)
    state = session.follow({"tensions": {"cap": 0.45}})
    assert state.failure is None
    assert state.surface.patches[0].tension == pytest.approx(0.525)
    assert state.wanted.patches[0].tension == 0.45


def test_settling_is_steps_that_can_be_undone_and_done_again(cap):
    session = Session(cap)
    heights = [rise(session.settle({"tensions": {"cap": a}}).surface) for a in (0.7, 0.8, 0.9)]
    assert heights == sorted(heights, reverse=True)
    state = session.undo()
    assert rise(state.surface) == heights[1]
    assert [p.tension for p in state.wanted.patches] == [0.8]
    assert (state.undo, state.redo) == (2, 1)
    assert rise(session.redo().surface) == heights[2]
    session.undo()
    state = session.settle({"tensions": {"cap": 0.75}})
    assert (state.undo, state.redo) == (3, 0)  # a new step ends the old future
    state = session.reset()
    assert state.surface is cap.surface
    assert state.undo == 4


def test_steps_kept_are_bounded_and_the_first_stays(cap, monkeypatch):
    monkeypatch.setattr("pcmc.explore.session.MOST_STEPS", 4)
    session = Session(cap)
    for k in range(6):
        state = session.settle({"tensions": {"cap": 0.7 + 0.01 * k}})
    assert state.undo == 3
    for _ in range(3):
        state = session.undo()
    assert state.surface is cap.surface


def test_a_newer_request_ends_the_work_on_an_older_one(cap):
    turn = threading.Lock()
    session = Session(cap, turn)
    states = {}

    def ask(name, value):
        states[name] = session.settle({"tensions": {"cap": value}})

    with turn:
        old = threading.Thread(target=ask, args=("old", 0.7))
        old.start()
        until(lambda: session.arrived == 1, "the first request")
        new = threading.Thread(target=ask, args=("new", 0.8))
        new.start()
        until(lambda: session.arrived == 2, "the second request")
    old.join()
    new.join()
    assert states["old"].superseded
    assert not states["new"].superseded
    assert [p.tension for p in session.surface.patches] == [0.8]
    assert states["new"].undo == 1


def test_acts_are_done_in_order_and_none_is_dropped(cap, hall):
    """While a move is under way: a variant is kept, the file is saved, and newer values are asked for."""
    turn = threading.Lock()
    session = Session(cap, turn)
    acts = [
        lambda: session.settle({"tensions": {"cap": 0.7}}),
        lambda: session.keep("before"),
        lambda: session.renew(hall, session.units, session.fallback),
        lambda: session.compare(0),
        lambda: session.settle({"tensions": {"left wall": 11.0}}),
    ]
    threads = [threading.Thread(target=act) for act in acts]
    with turn:
        for number, thread in enumerate(threads, 1):
            thread.start()
            until(lambda number=number: session.arrived == number, "the request")
    for thread in threads:
        thread.join()
    state = session.state()
    assert [variant.name for variant in state.variants] == ["before"]
    assert state.compared == 0
    assert state.surface.patches[3].tension == 11.0
    assert session.reset().surface is hall.surface


def test_acts_of_a_page_are_done_as_sent_though_connections_overtake_each_other(cap):
    session = Session(cap)
    early = threading.Thread(target=lambda: session.reset(turn=("page", 1)))
    early.start()
    session.settle({"tensions": {"cap": 0.7}}, turn=("page", 0))
    early.join()
    state = session.state()
    assert state.surface is cap.surface
    assert state.wanted is cap.surface  # as the sliders that the answer to the reset has set


def test_the_mesh_check_is_of_the_surface_shown(cap):
    session = Session(cap)
    check = session.check_mesh()
    assert check.surfaces[0] is cap.surface
    assert check.persists


def test_a_surface_that_changes_meanwhile_ends_its_mesh_check(cap, monkeypatch):
    session, solves = Session(cap), []

    def check(surface, callback):
        session.settle({"tensions": {"cap": 0.7}})  # another request, in the middle of the first solve
        solves.append(surface)
        return check_mesh(surface, callback=callback)

    monkeypatch.setattr("pcmc.explore.session.check_mesh", check)
    assert session.check_mesh() is None
    assert solves == [cap.surface]


def test_a_saddle_is_followed_and_becomes_stable_with_weaker_walls():
    session = Session(solved_start(four_fans(rings=7)))
    state = session.state()
    assert state.certificate.verdict is Verdict.SADDLE
    assert len(state.certificate.modes)
    state = session.settle({"tensions": {f"wall {k}": 0.5 for k in range(1, 5)}})
    assert state.failure is None
    assert state.certificate.verdict is Verdict.STABLE


def test_values_that_cannot_be_are_refused_and_change_nothing(cap):
    session = Session(cap)
    with pytest.raises(OptionError, match="did you mean 'cap'"):
        session.follow({"tensions": {"cup": 1.0}})
    with refused(SurfaceError, what="tension", where="cap", found=-1.0):
        session.settle({"tensions": {"cap": -1.0}})
    state = session.state()
    assert state.wanted.patches == cap.surface.patches
    assert state.failure is None


def test_a_single_point_is_moved_and_the_surface_follows():
    masts = [[0, 0, 4], [8, 0, 0], [8, 8, 4], [0, 8, 0]]
    square = [mast[:2] for mast in masts]
    plan = {"edge_length": 1.0, "edge": "cable", "cable": 9.0, "tension": 1.0, "pressure": 0.0}
    session = Session(solved_start(Plan(square, supports=masts, **plan).surface()))
    state = session.settle({"points": {"point 3": [8.5, 8.0, 3.0]}})
    assert state.failure is None
    assert changeable_values(state.surface)["points"]["point 3"] == [8.5, 8.0, 3.0]
    masts[2], square[2] = [8.5, 8.0, 3.0], [8.5, 8.0]
    again = pcmc.solve(Plan(square, supports=masts, **plan).surface())
    assert state.certificate.energy == pytest.approx(again.energy, rel=2e-3)  # another mesh
    assert session.undo().surface.vertices.max() == 8.0
    with refused(OptionError, found="point 9"):
        session.settle({"points": {"point 9": [0, 0, 0]}})


def test_between_is_the_straight_way():
    end = HALL.retensioned({"left": 50.0}, {"right": 3.0})  # the wall beside it follows
    middle = between(HALL, end, 0.5)
    assert [p.tension for p in middle.patches] == [40.0, 30.0, 30.0, 10.0, 15.0]
    assert [p.pressure for p in middle.patches] == [1.0, 1.0, 2.0, 0.0, -1.0]
    assert between(HALL, end, 1.0).patches == end.patches


def test_a_surface_that_nothing_brings_to_rest_is_shown_as_it_was_given():
    begun = solved_start(CAP.retensioned({"cap": 0.2}))
    np.testing.assert_array_equal(begun.surface.vertices, CAP.vertices)
    assert begun.failure.verdict is Verdict.NO_EQUILIBRIUM
    session = Session(begun)
    state = session.settle({"tensions": {"cap": 0.8}})
    assert state.failure is None
    assert state.certificate.verdict is Verdict.STABLE
    assert session.undo().failure is not None  # it is not at rest the second time either
    assert session.reset().failure is not None


def test_another_file_leaves_no_search_behind(cap):
    session = Session(solved_start(spherical_cap(edge_length=0.5)))
    assert session.equilibria("pressure") is session.found
    assert session.visit(1).certificate.verdict is Verdict.SADDLE
    with refused(OptionError, what="number", found=10_000):
        session.visit(10_000)
    session.renew(cap, session.units, session.fallback)
    with refused(OptionError, what="number", found=1):
        session.visit(1)
