"""Explore: cables, weights and rooms have values, and a piece between mirror planes is drawn whole."""

from __future__ import annotations

import numpy as np
import pytest
from asking import Client
from refusals import refused

import pcmc
from pcmc import explore
from pcmc.base.errors import OptionError
from pcmc.certificate import Verdict
from pcmc.explore.page_data import fields, outline
from pcmc.explore.session import Session, solved_start


def test_cables_weights_and_rooms_have_values_that_move_the_surface():
    square = pcmc.Surface(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0.2], [0.5, -0.1, 0]],
        [[0, 5, 4], [5, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
        [0] * 5,
        [pcmc.Patch("roof", 1.0, 0.5, weight=0.1)],
        fixed=[0, 1, 2, 3],
        cables=[pcmc.Cable("edge", 3.0, [[0, 5], [5, 1]]), pcmc.Cable("inner", 0.0, [[0, 4]])],
    )
    about, arrays = outline(square.retensioned(cables={"inner": 0.1}), np.zeros(3))
    assert [group["kinds"] for group in about["controls"]] == [
        ["tensions", "pressures", "weights"],
        ["cables"],
        ["cables"],
    ]
    drawn = {tuple(sorted(pair)) for pair in arrays["curves"].tolist()}
    assert {(0, 5), (1, 5), (0, 4)} < drawn
    session = Session(solved_start(square))
    state = session.settle({"cables": {"edge": 6.0}, "weights": {"roof": 0.2}})
    assert state.failure is None
    assert state.surface.cables[0].tension == 6.0
    assert state.surface.patches[0].weight == 0.2
    assert state.certificate.verdict is Verdict.STABLE
    at_points = fields(state, np.zeros(3))["points"]  # the ends of the cables, whose arrows are apart
    assert np.flatnonzero(at_points.any(axis=1)).tolist() == [0, 1]
    assert np.linalg.norm(at_points[1]) == pytest.approx(6.0)
    depth = [s.vertices[5, 1] for s in (session.undo().surface, state.surface)]
    assert depth[0] > depth[1] > 0.0  # a stronger cable is straighter
    with refused(OptionError, what="cable", found="egde"):
        session.follow({"cables": {"egde": 1.0}})


def test_a_piece_between_mirror_planes_is_drawn_whole():
    planes = [pcmc.Plane(normal=n, mirror=True) for n in ((1, 0, 0), (0, 1, 0))]
    grid = np.linspace(0.0, 1.0, 5)
    X = np.array([[x, y, 0.0] for y in grid for x in grid])
    corner = np.array([5 * j + i for j in range(4) for i in range(4)])[:, None]
    F = np.concatenate([corner + np.array([0, 1, 6]), corner + np.array([0, 6, 5])])
    supports = {plane: np.flatnonzero(X[:, k] == 0.0) for k, plane in enumerate(planes)}
    fixed = np.flatnonzero((X[:, :2] == 1.0).any(axis=1))
    piece = pcmc.Surface(X, F, [0] * len(F), [pcmc.Patch("roof", 2.0)], fixed=fixed, on_planes=supports)
    running = explore.start(piece)
    try:
        client = Client(running)
        header, arrays = client.ask("/api/open")
        assert header["whole"]
        assert header["triangles"] == 4 * piece.m
        corners = arrays["vertices"].reshape(-1, 3) + running.origin
        assert corners.min(axis=0) == pytest.approx([-1.0, -1.0, 0.0])
        client.ask(f"/api/{header['session']}/keep", {"name": "a"})
        client.ask(f"/api/{header['session']}/compare", {"number": 0})
        header, arrays = client.ask(f"/api/{header['session']}/settle", {"tensions": {"roof": 3.0}})
        assert len(arrays["difference"]) == len(corners)
        assert arrays["difference"].min() < -0.01
        held = np.isfinite(arrays["reactions"].reshape(-1, 3)[:, 0])
        assert held.sum() == 32
    finally:
        running.close()
