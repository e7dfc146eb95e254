"""The geometric solver against closed forms: order of convergence, verdicts, and where nothing exists."""

import numpy as np
import pytest
from nightly import at_night
from starts import double_bubble, joined_caps, sphere, spherical_cap

from generators import double_bubble_exact, joined_caps_exact, sphere_exact, spherical_cap_exact
from pcmc import certify, energy, solve
from pcmc.certificate import Verdict
from pcmc.forces.functional import volume
from pcmc.forces.rigid_motions import rigid_motions
from pcmc.meshing.refinement import refine
from pcmc.solvers.result import Status

pytestmark = pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")
nightly = pytest.mark.nightly


def order(errors, sizes):
    """Slope of log error over log size, by least squares."""
    return np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0]


def root_mean_square(values):
    return np.sqrt(np.mean(values**2))


def sizes(surfaces):
    """A length that measures the triangles: 1/√m."""
    return [surface.m**-0.5 for surface in surfaces]


@pytest.mark.parametrize("alpha", [0.505, 0.6, 1.0])
def test_the_cap_is_of_second_order(alpha):
    exact = spherical_cap_exact(alpha=alpha)
    results = [solve(spherical_cap(edge, alpha=alpha)) for edge in (0.25, 0.125, 0.0625)]
    assert all(result.certificate.verdict is Verdict.STABLE for result in results)
    surfaces = [result.surface for result in results]
    h = sizes(surfaces)
    away = [root_mean_square(exact.distance(surface)) for surface in surfaces]
    slack = 0.5 if alpha < 0.51 else 0.25  # next to the fold the error of the edge is felt at its root
    assert order(away, h) == pytest.approx(2.0, abs=slack)
    assert order([energy(s) - exact.energy for s in surfaces], h) == pytest.approx(2.0, abs=slack)


def test_just_above_the_fold_it_is_the_lower_cap():
    """At α = 0.505 R both caps are near the hemisphere; from below it is the stable one."""
    result = solve(spherical_cap(0.1, alpha=0.505))
    assert result.converged
    assert result.certificate.verdict is Verdict.STABLE
    height = result.surface.vertices[:, 2].max()
    assert height < 1.0
    assert height == pytest.approx(spherical_cap_exact(alpha=0.505).height, abs=0.02)


def test_the_upper_cap_is_a_saddle_of_index_one():
    """The other part of the same sphere, more than half of it: height 2 α + √(4 α² - R²)."""
    upper = 1.2 + np.sqrt(1.44 - 1.0)
    result = solve(spherical_cap(0.1, height=upper), target="stationary")
    assert result.converged
    assert result.surface.vertices[:, 2].max() == pytest.approx(upper, abs=0.05)
    assert result.certificate.verdict is Verdict.SADDLE
    assert result.certificate.index == 1


@pytest.mark.parametrize("method", ["minimum", *at_night("stationary")])
def test_below_the_fold_there_is_no_equilibrium(method):
    result = solve(spherical_cap(0.125, alpha=0.45), target=method)
    found = result.certificate
    assert not result.converged
    assert np.isfinite(result.surface.vertices).all()
    assert np.isfinite(result.energy)
    assert np.isfinite(result.history.select_dtypes("number")).all(axis=None)
    assert result.iterations <= 200
    assert found.verdict is Verdict.NO_EQUILIBRIUM
    assert found.load_ratio == pytest.approx(1.0 / 0.9, rel=0.02)
    assert "1.11 times what the boundary's tension could carry" in found.detail
    assert not found.certified
    assert "no equilibrium" in str(found)
    assert np.isfinite(np.array([v for v in found.numbers().values() if isinstance(v, float)])).all()


@pytest.mark.parametrize("edge", [0.25, *at_night(0.0625)])
def test_below_the_fold_at_other_refinements(edge):
    result = solve(spherical_cap(edge, alpha=0.45))
    assert result.certificate.verdict is Verdict.NO_EQUILIBRIUM


def on_the_arcs(points):
    """Points (k,3) near the outline of the joined caps put on its two circular arcs."""
    shapes = joined_caps_exact().shapes
    out = points.copy()
    for side, sign in ((shapes["left"], -1), (shapes["right"], 1)):
        here = sign * points[:, 0] > 0
        away = points[here, :2] - side.centre[:2]
        radius = np.sqrt(side.radius**2 - side.centre[2] ** 2)
        out[here, :2] = side.centre[:2] + radius * away / np.linalg.norm(away, axis=1)[:, None]
    return out


@pytest.fixture(scope="module")
def caps():
    """One mesh refined twice, its new outline on the arcs, solved from scratch each time."""
    surfaces = [refine(joined_caps(1.0), levels, on_the_arcs) for levels in (0, 1, 2)]
    results = [solve(surface) for surface in surfaces]
    assert all(result.converged for result in results)
    return results


def test_joined_caps_are_stable_and_of_second_order(caps):
    exact = joined_caps_exact()
    assert all(result.certificate.verdict is Verdict.STABLE for result in caps)
    assert min(result.certificate.eigenvalues[0] for result in caps) > 0.05
    surfaces = [result.surface for result in caps]
    h = sizes(surfaces)
    away = [exact.distance(surface).max() for surface in surfaces]
    assert order(away, h) == pytest.approx(2.0, abs=0.3)
    assert away[2] < 0.005
    assert order([energy(s) - exact.energy for s in surfaces], h) == pytest.approx(2.0, abs=0.1)
    assert order([volume(s) - exact.volume for s in surfaces], h) == pytest.approx(2.0, abs=0.2)
    wall = [np.abs(_wall(surface)).max() for surface in surfaces]
    assert order(wall, h) == pytest.approx(2.0, abs=0.3)


def _wall(surface):
    """x of the wall's vertices, which is 0 in the closed form."""
    return surface.vertices[np.unique(surface.faces[surface.patch_of_face == 2]), 0]


def test_junction_of_the_caps_balances_in_the_limit(caps):
    left = [result.certificate.junctions["sum_alpha_n_mean"].max() for result in caps]
    assert left[2] < 0.35 * left[0]
    assert max(result.certificate.junctions["force_left"].max() for result in caps) < 1e-8


@nightly
@pytest.mark.parametrize("edge", [0.5, 0.35, 0.25])
def test_joined_caps_are_stable_at_every_refinement(edge):
    result = solve(joined_caps(edge))
    assert result.converged
    assert result.certificate.verdict is Verdict.STABLE
    assert result.certificate.eigenvalues[0] > 0.05
    assert joined_caps_exact().distance(result.surface).max() < 0.12 * edge**2


@pytest.mark.parametrize("edge", [1.0, 0.5, pytest.param(0.25, marks=nightly)])
def test_joined_caps_with_a_weak_wall_are_a_saddle_of_index_one(edge):
    tensions = {"alpha_left": 4.0, "alpha_right": 4.0, "alpha_aux": 1.0, "depth": 5.0}
    result = solve(joined_caps(edge, **tensions), target="stationary")
    assert result.converged
    assert result.certificate.verdict is Verdict.SADDLE
    assert result.certificate.index == 1
    assert joined_caps_exact(**tensions).distance(result.surface).max() < 0.15 * edge**2 + 0.01
    mode = result.certificate.modes[0]
    assert np.abs(mode[:, 0]).max() > 0.5 * np.abs(mode).max()  # the wall moves sideways


def bubbles(make, edges, **tensions):
    results = [solve(make(edge, **tensions), target="stationary") for edge in edges]
    for result in results:
        assert result.converged
        assert result.certificate.residual <= 1e-10
        assert result.certificate.curvature_error < 1e-9
    return results


def fitted_sphere(X):
    """Centre and radius of the sphere nearest to points, by least squares: |x|² = 2 c·x + r² - |c|²."""
    A = np.column_stack([2 * X, np.ones(len(X))])
    c = np.linalg.lstsq(A, (X**2).sum(axis=1), rcond=None)[0]
    return c[:3], np.sqrt(c[3] + c[:3] @ c[:3])


def part(surface, name):
    return surface.vertices[np.unique(surface.faces[surface.patch_of_face == surface.patch_index(name)])]


@pytest.mark.parametrize("alpha", [1.0, 0.4])
def test_the_bubble_is_a_sphere_and_a_saddle_of_index_one(alpha):
    results = bubbles(sphere, np.array([0.8, 0.4, 0.2]) * alpha, alpha=alpha)
    assert [result.certificate.index for result in results] == [1, 1, 1]
    surfaces = [result.surface for result in results]
    h = sizes(surfaces)
    fits = [fitted_sphere(surface.vertices) for surface in surfaces]
    assert order([radius - 2 * alpha for _, radius in fits], h) == pytest.approx(2.0, abs=0.1)
    round_ = [np.linalg.norm(s.vertices - c, axis=1).std() for s, (c, _) in zip(surfaces, fits, strict=True)]
    assert round_[2] < 1e-3 * alpha
    exact = sphere_exact(alpha=alpha)
    assert order([energy(s) - exact.energy for s in surfaces], h) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(
    ("tensions", "edges"),
    [
        pytest.param((1.0, 1.0, 1.0), (0.8, 0.4, 0.2), marks=nightly),
        ((1.0, 0.8, 0.6), (0.8, 0.6, 0.4)),
        pytest.param((2.0, 1.0, 1.5), (0.8, 0.5, 0.3), marks=nightly),  # the mesh slides far
    ],
)
def test_the_double_bubble_is_two_spheres_and_a_flat_disc(tensions, edges):
    left, right, wall = tensions
    names = {"alpha_left": left, "alpha_right": right, "alpha_aux": wall}
    results = bubbles(double_bubble, edges, **names)
    assert [result.certificate.index for result in results] == [2, 2, 2]
    surfaces = [result.surface for result in results]
    h = sizes(surfaces)
    errors = []
    for surface in surfaces:
        (one, r1), (two, r2) = (fitted_sphere(part(surface, name)) for name in ("left", "right"))
        errors.append([r1 - 2 * left, r2 - 2 * right, np.linalg.norm(one - two) - 2 * wall])
        disc = part(surface, "wall")
        disc = disc - disc.mean(axis=0)
        across = np.abs(disc @ np.linalg.svd(disc)[2][2]).max()
        assert across < (1e-9 if left == right else 0.05 * edges[0] ** 2)
    for column in np.array(errors).T:
        assert order(column, h) == pytest.approx(2.0, abs=0.4)
    exact = double_bubble_exact(**names)
    assert order([energy(s) - exact.energy for s in surfaces], h) == pytest.approx(2.0, abs=0.2)


def test_rigid_motions_are_neutral_and_not_counted():
    result = bubbles(double_bubble, [0.6])[0]
    surface = result.surface
    assert len(rigid_motions(surface)) == 6
    assert result.certificate.index == 2
    R = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    R *= np.linalg.det(R)
    moved = certify(surface.moved(surface.vertices @ R.T + [3.0, -2.0, 7.0]))
    assert moved.index == 2
    assert moved.energy == pytest.approx(result.energy, rel=1e-12)
    # E is the same, but the frames are turned: the lowest eigenvalue is the same number
    assert moved.eigenvalues[0] == pytest.approx(result.certificate.eigenvalues[0], rel=1e-6)


@pytest.mark.parametrize("make", [sphere, double_bubble])
def test_a_bubble_sought_as_a_minimum_ends_at_its_saddle_and_says_so(make):
    """Smaller or larger, E falls: nothing stable exists."""
    result = solve(make(0.8))
    assert not result.converged
    assert np.isfinite(result.surface.vertices).all()
    assert result.status is Status.SADDLE
    assert result.certificate.verdict is Verdict.SADDLE
    assert "shrinks to nothing, so that none is stable" in result.message
