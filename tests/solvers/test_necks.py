"""Films between rings: where the neck pinches off, and how wide apart they may stand."""

import numpy as np
import pytest
from nightly import at_night
from shapes import tube
from starts import spherical_cap

from generators.grid import grid_faces
from pcmc import Circle, Patch, Plane, Surface, Verdict, mirrored, solve
from pcmc.certificate.diagnosis import narrowest_neck
from pcmc.solvers import solve_once
from pcmc.solvers.result import Status

pytestmark = pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")


WIDEST = 0.6627434193491816  # half the distance of unit rings at which catenoids end


def film(half, around=16, pressure=0.0, radius=1.0):
    """A film between two rings, started as a cylinder."""
    rows = 2 * max(1, round(half * around / (np.sqrt(3.0) * np.pi)))
    return tube(
        rows, around, lambda t: (radius + 0.0 * t, half * (2.0 * t - 1.0)), Patch("film", 1.0, pressure)
    )


def test_rings_that_vertices_slide_along_are_moved_apart_as_fixed_ones():
    fixed = film(2.0)
    top = fixed.vertices[:, 2] > 1.0
    keep = np.isin(np.arange(fixed.n), [np.flatnonzero(fixed.fixed & side)[0] for side in (top, ~top)])
    rings = {Circle((0, 0, 2.0 * s), (0, 0, 1), 1.0): fixed.fixed & ~keep & (top == (s > 0)) for s in (1, -1)}
    held, sliding = (solve(f) for f in (fixed, fixed.rebuilt(fixed=keep, on_line=rings)))
    assert sliding.status is held.status is Status.NONE_FOUND
    assert sliding.tried[-1].folds
    assert sliding.tried[-1].value == pytest.approx(held.tried[-1].value, rel=1e-3)


@pytest.mark.parametrize("target", ["minimum", *at_night("stationary")])
@pytest.mark.parametrize("half", [0.7, *at_night(1.0)])
def test_a_neck_between_rings_too_far_apart(half, target):
    result = solve(film(half), target=target)
    assert result.status is Status.NONE_FOUND
    assert result.proofs == ()
    fold = result.tried[-1]
    assert fold.folds
    assert fold.way == "distance"
    assert fold.value * half == pytest.approx(WIDEST, rel=0.02)
    found = result.certificate
    assert found.verdict is Verdict.NONE_FOUND
    assert found.tried == result.tried
    assert "of the distance between the held curves" in found.detail
    assert "remesh" not in result.message
    if target == "minimum":
        assert "a neck pinches off near (0, 0)" in found.detail


def test_half_a_film_with_its_neck_free_on_the_plane():
    def half_film(height):
        bottom, top = range(20), range(6 * 20, 7 * 20)
        patch = Patch("film", 1.0, 0.0)
        return tube(6, 20, lambda t: (1.0 + 0.0 * t, height * t), patch, on_plane=bottom, fixed=top)

    assert solve(half_film(0.6)).certificate.verdict is Verdict.STABLE
    fold = solve(half_film(0.75)).tried[-1]
    assert fold.folds
    assert 0.75 * fold.value == pytest.approx(WIDEST, rel=0.02)


def test_half_of_a_film_behind_a_mirror_plane_pinches_off_as_the_whole():
    """Its neck slides on Π, and at its ends along the line where both planes meet."""
    z, angle = np.meshgrid(np.linspace(0.0, 1.0, 5), np.linspace(0.0, np.pi, 9), indexing="ij")
    X = np.stack([np.cos(angle), np.sin(angle), 0.8 * z], axis=-1).reshape(-1, 3).round(15)
    mirror = {Plane(normal=(0, 1, 0), mirror=True): X[:, 1] == 0.0}
    held = {"fixed": X[:, 2] == 0.8, "on_plane": X[:, 2] == 0.0, "on_planes": mirror}
    half = Surface(X, grid_faces(4, 8)[:, ::-1], np.zeros(64, int), [Patch("film", 1.0, 0.0)], **held)
    for piece in (half, mirrored(half)):
        found = solve(piece)
        assert found.status is Status.NONE_FOUND
        assert "a neck pinches off near (0, 0" in found.certificate.detail


def test_a_neck_that_pinches_off_without_proof_is_called_that():
    pinched = solve_once(film(0.8))
    assert pinched.status is Status.DEGENERATE
    found = pinched.certificate
    assert found.verdict is Verdict.RAN_AWAY
    assert found.detail.startswith("a neck pinches off near")
    assert found.proofs == found.tried == ()


def test_the_neck_is_the_shortest_cut():
    c = 0.3
    profile = lambda t: (c * np.cosh((t - 0.5) / c), t - 0.5)  # noqa: E731
    surface = tube(16, 24, profile, Patch("film", 1.0, 0.0))
    neck = narrowest_neck(surface)
    assert neck.girth == pytest.approx(2 * 24 * c * np.sin(np.pi / 24), rel=1e-9)
    assert neck.place == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert narrowest_neck(spherical_cap(0.25)) is None


def test_cones_that_share_their_tip_alone_have_no_neck():
    """No edge joins them, so no cut parts them; the words of a neck would divide by its length 0."""
    i, ring = np.arange(6), np.exp(2j * np.pi * np.arange(6) / 6)
    X = [[*r, z] for z in (-1.0, 1.0) for r in zip(ring.real, ring.imag, strict=True)]
    F = [[a + k, b + k, 12] for k in (0, 6) for a, b in zip(i, np.roll(i, -1), strict=True)]
    cones = Surface([*X, [0.0, 0.0, 0.0]], F, [0] * 12, [Patch("film", 1.0, 0.0)], fixed=range(12))
    assert narrowest_neck(cones) is None


def test_a_film_under_pressure_stands_farther_apart():
    """At p = α / R the cylinder is at rest up to the length 2 π R."""
    assert solve(film(1.0, pressure=1.0)).certificate.verdict is Verdict.STABLE
