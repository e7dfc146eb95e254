"""Both mean curvatures against other ways to compute them, and the error the paper draws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_cases import touching
from refusals import refused
from shapes import cap, octahedron, pyramid, rotation, shaken, three_patches

from pcmc import Patch, Surface, curvature_error, gradient, mean_curvature, solve, target_curvature
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.plan import Plan

METHODS = ["cotangent", "variational"]


def by_cotangents(surface, p):
    """|Σ (cot α + cot β)(x_p - x_q)| / (4 A_b), A_b a third of the star: Meyer et al. (2002)."""
    X, laplacian, area = surface.vertices, np.zeros(3), 0.0
    for face in surface.faces.tolist():
        if p in face:
            k = face.index(p)
            a, b = face[(k + 1) % 3], face[(k + 2) % 3]
            for apex, far in ((a, b), (b, a)):  # the angle at apex is opposite the edge p-far
                u, w = X[p] - X[apex], X[far] - X[apex]
                laplacian += u @ w / np.linalg.norm(np.cross(u, w)) * (X[p] - X[far])
            area += np.linalg.norm(np.cross(X[a] - X[p], X[b] - X[p])) / 6.0
    return np.linalg.norm(laplacian) / (4.0 * area)


def test_cotangent_curvature_is_meyers():
    surface = shaken(cap(4), 0.01)
    H = mean_curvature(surface)
    inside = np.flatnonzero(surface.topology.interior)
    assert H[inside] == pytest.approx([by_cotangents(surface, p) for p in inside], rel=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_the_array_of_curvatures_is_the_callers_own(method):
    surface = pyramid(1.0)
    H = mean_curvature(surface, method)
    H[:] = 7.0
    assert mean_curvature(surface, method)[4] < 7.0


def test_variational_curvature_is_exact_at_a_stationary_vertex():
    # The pyramid's apex is at rest for h / √(1 + h²) = 1 / (3 α); H̄ = 1 / (2 α).
    for alpha in (0.5, 1.0, 4.0):
        sine = 1 / (3 * alpha)
        surface = pyramid(alpha, height=sine / np.sqrt(1 - sine**2))
        assert np.abs(gradient(surface)).max() < 1e-15
        assert mean_curvature(surface, "variational")[4] == pytest.approx(0.5 / alpha, rel=1e-14)
        flatness = np.sqrt(1 - sine**2)  # |Σ A_T ν_T| / Σ A_T of four equal slopes
        assert mean_curvature(surface)[4] == pytest.approx(0.5 / alpha * flatness, rel=1e-14)


@pytest.mark.parametrize("method", METHODS)
def test_curvature_of_a_sphere_converges(method):
    error = [np.nanmean(np.abs(curvature_error(cap(rings), method))) for rings in (8, 16, 32)]
    assert np.log2(np.array(error[:-1]) / error[1:]) == pytest.approx([1.75, 1.75], abs=0.15)


@pytest.mark.parametrize("method", METHODS)
def test_sign_follows_the_orientation(method):
    ball = octahedron()
    inside_out = Surface(ball.vertices, ball.faces[:, ::-1], [0] * 8, ball.patches, fixed=[0])
    H = mean_curvature(ball, method)[1:]  # vertex 0 is held
    assert (H > 0).all()
    assert mean_curvature(inside_out, method)[1:] == pytest.approx(-H)


@pytest.mark.parametrize("method", METHODS)
def test_a_plane_is_not_curved(method):
    surface = pyramid(height=0.0)
    assert mean_curvature(surface, method)[4] == pytest.approx(0.0, abs=1e-15)
    assert curvature_error(surface, method)[4] == pytest.approx(-1.0, abs=1e-15)


@pytest.mark.parametrize("method", METHODS)
def test_no_curvature_on_junctions_and_boundaries(method):
    surface = three_patches(3)
    inside = surface.topology.interior
    assert inside.sum() == 12 + 3
    for values in (mean_curvature(surface, method), target_curvature(surface)):
        assert np.isnan(values[~inside]).all()
        assert np.isfinite(values[inside]).all()


@pytest.mark.parametrize("method", METHODS)
def test_no_curvature_where_sheets_touch(method):
    """There are two; their mean used to count as a large error of a surface at rest."""
    result = solve(touching())
    assert np.isnan(mean_curvature(result.surface, method)).all()
    assert np.isnan(target_curvature(result.surface)).all()
    assert result.certificate.curvature_error == 0.0
    assert result.certificate.patches["mean_H"].isna().all()


def test_targets_and_errors_by_patch():
    surface = three_patches(3)
    unpressed = {p.name: 0.0 for p in surface.patches if p.auxiliary}
    surface = surface.retensioned({"wall0": 0.0}, pressures={"roof1": 2.0, **unpressed})
    target, H, error = (f(surface) for f in (target_curvature, mean_curvature, curvature_error))
    inside = surface.topology.interior
    for k, patch in enumerate(surface.patches):
        mine = np.zeros(surface.n, bool)
        mine[surface.faces[surface.patch_faces([k])]] = True
        mine &= inside
        assert mine.any()
        if patch.auxiliary:
            assert np.isnan(error[mine]).all()
        else:
            expected = patch.pressure / (2 * patch.tension)
            assert target[mine] == pytest.approx(expected)
            assert error[mine] == pytest.approx(H[mine] / expected - 1)
    assert np.isnan(target[mine]).sum() == 0  # the last wall's target is zero


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1), st.floats(1e-3, 1e3), st.sampled_from(METHODS))
def test_curvature_is_a_length_to_the_minus_one(seed, scale, method):
    surface = shaken(cap(3), 0.01)
    other = surface.moved(scale * surface.vertices @ rotation(seed).T)
    expected = mean_curvature(surface, method) / scale
    np.testing.assert_allclose(mean_curvature(other, method), expected, rtol=1e-11)


def test_unknown_method():
    with refused(OptionError, what="method", found="cotan") as caught:
        mean_curvature(pyramid(), "cotan")
    assert caught.match("did you mean 'cotangent'")
    with refused(OptionError, what="method", found="Meyer"):
        curvature_error(pyramid(), "Meyer")


def test_a_wall_without_tension_has_no_target():
    walls = [Patch("roof", 1.0), Patch("wall", 0.0, pressure=0.0)]
    surface = cap(2)
    inner = (np.abs(surface.vertices[surface.faces, :2]).max(axis=(1, 2)) < 0.9).astype(int)
    split = Surface(surface.vertices, surface.faces, inner, walls, fixed=surface.fixed)
    inside = split.topology.interior
    wall = np.zeros(split.n, bool)
    wall[split.faces[inner == 1]] = True
    assert (inside & wall).sum() == 1
    assert np.isnan(target_curvature(split)[inside & wall]).all()
    assert np.isnan(curvature_error(split)[inside & wall]).all()


@pytest.mark.parametrize("quantity", [mean_curvature, target_curvature, curvature_error])
def test_what_is_no_surface_is_refused(quantity):
    with refused(SurfaceError, what="surface", found="list", expected="a Surface"):
        quantity([[0.0, 0.0, 0.0]])


def test_no_curvature_is_asked_for_where_a_support_pulls_inside():
    mast, ridge = [14.0, 4.0, 1.0], [[3.0, 4.0, 1.0], [6.0, 4.0, 1.0]]
    outline = [[0, 0], [18, 0], [18, 8], [0, 8]]
    roof = solve(Plan(outline, supports=[mast, ridge], edge_length=1.0, tension=6.0).surface())
    inside = roof.surface.fixed & ~roof.surface.topology.on_boundary
    assert inside.sum() >= 4
    assert np.isnan(mean_curvature(roof.surface)[inside]).all()
    assert roof.certificate.curvature_error < 1e-8
