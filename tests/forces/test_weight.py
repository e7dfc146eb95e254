"""Self-weight and snow: closed forms, the local target of curvature, verdicts."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from refusals import refused

import pcmc
from generators import barrel, catenary, hypar_roof, spherical_cap
from generators.grid import grid_faces
from pcmc import Cable, Direction, Patch, Plane, Surface, Target, Verdict, solve
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.design.targets import measure


def hanging(squares: int, weight: float = 1.0) -> Surface:
    return barrel(squares, alpha=2.0, pressure=0.0, weight=weight, rise=-0.2)


def test_a_long_barrel_hangs_in_a_catenary():
    errors = []
    for squares in (4, 8, 16):
        X = solve(hanging(squares)).surface.vertices
        errors.append(np.abs(X[:, 2] - catenary(2.0, 2.0)(X[:, 0])).max())
    assert errors[-1] < 1e-3
    assert [np.log2(a / b) for a, b in pairwise(errors)] == pytest.approx([2.0, 2.0], abs=0.05)


def test_its_curvature_is_the_local_target_up_to_the_mesh():
    errors = [pcmc.certify(solve(hanging(n)).surface) for n in (6, 12)]
    assert errors[1].verdict is Verdict.STABLE
    assert errors[1].curvature_error < 3e-3
    assert np.log2(errors[0].curvature_error / errors[1].curvature_error) == pytest.approx(2.0, abs=0.35)
    middle = errors[1].patches.target[0]  # between w/2(α + w z) at the supports' and the middle's slope
    assert -0.3 < middle < -0.25


def test_supports_carry_the_weight():
    certificate = pcmc.certify(solve(hanging(16)).surface)
    assert certificate.load == pytest.approx(-certificate.patches.area[0], rel=1e-12)
    assert certificate.support == pytest.approx(-certificate.load, rel=1e-3)


def test_beyond_its_widest_span_nothing_hangs():
    """α/w = 1.45 spans 1.3255 · 1.45 = 1.92 at most, and the supports are 2 apart."""
    with refused(OptionError, what="span", found=2.0):
        catenary(2.0, 1.45)
    assert not solve(hanging(8, weight=2.0 / 1.45)).converged
    assert solve(hanging(8, weight=2.0 / 1.6)).converged


def test_a_sheet_under_compression_is_named():
    """A flat square at z = -3, where α + w z = 1 - 1.5; the pressure carries its weight."""
    side = np.linspace(-1.0, 1.0, 5)
    X = np.array([[x, y, -3.0] for x in side for y in side])
    rim = np.abs(X[:, :2]).max(axis=1) == 1.0
    low = Surface(X, grid_faces(4, 4), [0] * 32, [Patch("low", 1.0, 0.5, weight=0.5)], fixed=rim)
    certificate = pcmc.certify(low)
    assert certificate.residual < 1e-12
    assert certificate.verdict is Verdict.SADDLE
    assert "patch 'low' is under compression in 32 triangles" in certificate.detail
    assert "-0.5" in certificate.detail


def test_the_weight_can_be_followed():
    start = solve(hanging(6, weight=0.5)).surface
    branch = pcmc.follow(start, Direction(weights={"vault": 1.0}), stop=1.0)
    end, direct = branch.last, solve(hanging(6)).surface
    assert pcmc.energy(end) == pytest.approx(pcmc.energy(direct), rel=1e-6)


def test_a_heavy_patch_has_no_single_curvature():
    with refused(OptionError, what="of", found="vault"):
        measure(hanging(4), Target("curvature", "vault"))


def test_snow_is_a_change_of_pressure():
    cap = spherical_cap(0.25, alpha=0.8)
    snowed = solve(cap.with_snow(0.25)).surface
    lower = solve(cap.retensioned(pressures={"cap": 0.75})).surface
    np.testing.assert_array_equal(snowed.vertices, lower.vertices)
    z, F = snowed.vertices[:, 2], snowed.faces
    a, b, c = (snowed.vertices[F[:, k], :2] for k in range(3))
    plan = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    potential = 0.25 * float(plan @ z[F].mean(axis=1))
    assert (snowed.pressures.tolist(), snowed.snows.tolist()) == ([1.0], [0.25])
    still = snowed.retensioned(snows={"cap": 0.0})
    assert pcmc.energy(snowed) - pcmc.energy(still) == pytest.approx(potential, rel=1e-12)


def test_snow_on_a_free_edge_is_refused():
    with refused(SurfaceError, what="snow"):
        hypar_roof(4).with_snow(0.1)
    assert hypar_roof(4).with_snow(0.0).pressures.tolist() == [0.0]


def test_a_weight_without_tension_is_refused():
    with refused(SurfaceError, what="tension", where="a"):
        Patch("a", 0.0, 0.0, weight=1.0)


@pytest.mark.parametrize("heavy", ["film", "rope"])
def test_behind_a_level_mirror_plane_a_weight_would_pull_up(heavy):
    """Half of a film in an upright frame came to rest, and the whole that it stood for was not at rest."""
    x, z = np.meshgrid(np.linspace(-2.0, 2.0, 5), np.linspace(0.0, 2.0, 3), indexing="ij")
    X = np.stack([x.ravel(), 0.0 * x.ravel(), z.ravel()], axis=1)
    patches = [Patch("film", 1.0, 0.3, weight=0.2 * (heavy == "film"))]
    rope = replace(Cable.along("rope", 1.0, [6, 7, 8]), weight=0.2 * (heavy == "rope"))
    middle = Plane(normal=(0, 0, 1), name="middle", mirror=True)
    faces, rim = grid_faces(4, 2), (np.abs(X[:, 0]) == 2.0) | (X[:, 2] == 2.0)
    parts = {"fixed": rim, "on_planes": {middle: X[:, 2] == 0.0}, "plane": Plane((0, 0, -1))}
    with refused(SurfaceError, what="weights"):
        Surface(X, faces, np.zeros(16, int), patches, cables=[rope], **parts)
    light = [replace(rope, weight=0.0)]
    half = Surface(X, faces, np.zeros(16, int), [Patch("film", 1.0, 0.3)], cables=light, **parts)
    kind = "weights" if heavy == "film" else "cable_weights"
    with refused(SurfaceError, what="weights"):
        half.retensioned(**{kind: {heavy: 0.2}})
