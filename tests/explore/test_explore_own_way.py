"""Explore: where following leads nowhere, a project's own walls or start shape do; and new triangles."""

from __future__ import annotations

import numpy as np
import pytest
from browsing import Explored, needs_browser
from explore_cases import followed

import pcmc
from generators import spherical_cap
from pcmc import explore
from pcmc.explore import following
from pcmc.explore.following import ProjectFallback, Reached
from pcmc.explore.roof import read_roof
from pcmc.explore.session import Session, solved_start
from pcmc.project.values import data_with_values

CAP = spherical_cap(edge_length=0.25)
OPEN_WALL = """[plan]
edge_length = 1.0
outline = [[0, 0], [12, 0], [12, 6], [0, 6]]
dividers = [[[6, 0], [6, 6]]]
[plan.patches]
west = {tension = 5.0}
east = {tension = 5.0}
"""


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "hall.toml"
    path.write_text(OPEN_WALL)
    return path


def own(path):
    return ProjectFallback(path, read_roof(path, start_shape=True).project.data)


def tensions(surface):
    return {p.name: p.tension for p in surface.patches}


def test_walls_that_a_project_leaves_open_follow_the_tensions(path):
    start = solved_start(read_roof(path, use_cache=False).surface)
    asked = {"tensions": {"east": 9.0}}
    assert Session(start).settle(asked).failure is not None  # 9 against 5 and the wall
    session = Session(start, fallback=own(path))
    state = session.settle(asked)
    path.write_text(OPEN_WALL.replace("east = {tension = 5.0}", "east = {tension = 9.0}"))
    again = read_roof(path, use_cache=False).surface
    assert tensions(state.surface) == tensions(again)
    assert tensions(state.wanted) == tensions(again)
    assert state.failure is None
    assert f"walls balanced beside the new tensions: wall 1 {again.patches[2].tension:g}" in state.note
    assert state.surface.vertices[:, 2].max() == pytest.approx(again.vertices[:, 2].max(), rel=0.02)
    assert session.undo().surface is start.surface
    assert session.state().note == ""


def test_walls_that_were_moved_stay(path):
    start = solved_start(read_roof(path, use_cache=False).surface)
    state = Session(start, fallback=own(path)).settle({"tensions": {"east": 9.0, "wall 1": 1.0}})
    assert state.failure is not None
    assert "cannot balance" in state.failure.detail
    assert state.note == ""
    state = Session(start, fallback=own(path)).settle({"tensions": {"wall 1": 1.0}})
    assert state.failure is None
    assert tensions(state.surface)["wall 1"] == 1.0


def test_a_roof_that_following_does_not_reach_is_solved_from_the_start_shape(path, monkeypatch):
    start = solved_start(read_roof(path, use_cache=False).surface)
    nowhere = Reached(start.surface, None, pcmc.certify(CAP.retensioned({"cap": 0.01})))
    monkeypatch.setattr(following, "reach", lambda *arguments, **options: nowhere)
    path.write_text(OPEN_WALL + "[remesh]\nedge_length = 0.8\n")
    state = Session(start, fallback=own(path)).settle({"tensions": {"east": 4.0}})
    assert state.failure is None
    assert "from the start shape" in state.note
    assert tensions(state.surface)["east"] == 4.0
    assert state.surface.m > 1.2 * start.surface.m
    failed = Session(start).settle({"tensions": {"east": 4.0}})  # without the project
    assert failed.failure is nowhere.failed


@pytest.mark.parametrize(
    ("key", "asked"),
    [
        ("tension = 5.0", {"patch 1": 5.0, "patch 2": 9.0}),
        ("rise = 1.0", {"patch 1": 4.0, "patch 2": 4.5}),
    ],
)
def test_a_project_with_one_tension_or_a_rise_has_its_own_way_too(path, key, asked):
    path.write_text(OPEN_WALL.partition("[plan.patches]")[0] + key + "\n")
    before = read_roof(path, start_shape=True).surface
    wanted = before.retensioned(asked)
    walls = {("tensions", patch.name) for patch in wanted.patches if patch.wall}
    project, start = data_with_values(path, own(path).data, wanted, walls)[1:]
    assert tensions(start).items() >= asked.items()
    assert not project.targets
    assert tensions(start)["wall 1"] != tensions(before)["wall 1"]  # balanced anew


def test_why_a_project_has_no_own_way_is_said(path, monkeypatch):
    start = solved_start(read_roof(path, use_cache=False).surface)
    nowhere = Reached(start.surface, None, pcmc.certify(CAP.retensioned({"cap": 0.01})))
    monkeypatch.setattr(following, "reach", lambda *arguments, **options: nowhere)
    way = own(path)
    del way.data["plan"]["patches"]["west"]  # as if the plan were another one
    state = Session(start, fallback=way).settle({"tensions": {"east": 4.0}})
    assert state.failure is nowhere.failed
    assert "one for each part" in state.note


def poor_cap():
    """A cap at rest with triangles far from equilateral."""
    X = CAP.vertices.copy()
    free = np.setdiff1d(np.arange(CAP.n), np.flatnonzero(CAP.held))
    corner = free[np.argmin(np.linalg.norm(X[free] - X[free].mean(axis=0), axis=1))]
    ring = np.unique(CAP.faces[(CAP.faces == corner).any(axis=1)])
    other = ring[ring != corner][0]
    X[corner] += 0.96 * (X[other] - X[corner])
    return pcmc.solve(CAP.moved(X), min_quality=0.0).surface


def test_new_triangles_for_the_surface_shown():
    start = solved_start(poor_cap())
    assert start.certificate.quality < 0.3
    session = Session(start)
    state = session.remesh()
    assert state.failure is None
    assert state.certificate.quality > 0.5
    assert state.surface.patches == start.surface.patches
    assert session.undo().surface is start.surface


@pytest.mark.nightly
@needs_browser
def test_the_page_offers_new_triangles_and_shows_walls_that_follow(driver, path):
    running = explore.start(poor_cap())
    try:
        page = Explored(driver, running.url)
        page.find("#remesh").click()
        page.idle()
        assert not page.find("#remesh").is_displayed()
        assert page.verdict == "stable"
        page.find("#undo").click()
        page.idle()
        assert page.find("#remesh").is_displayed()
    finally:
        running.close()
    with followed(path) as running:
        page = Explored(driver, running.url)
        page.enter("Tension α of east", 9)
        assert page.verdict == "stable"
        assert "Walls balanced beside the new tensions" in page.text("#verdict .detail")
        wall = float(page.number("Tension α of wall 1").get_attribute("value"))
        assert wall > 4.0
        assert page.complaints() == []
