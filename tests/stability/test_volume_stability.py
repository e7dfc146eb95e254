"""Rooms of prescribed volume: bubbles, and the motions that keep the volumes."""

from dataclasses import replace

import numpy as np
import pytest
from convergence import orders
from nightly import at_night
from scipy.optimize import brentq
from volume_cases import DOUBLE, TRIPLE, connected_caps, cylinder

import generators
import pcmc
from pcmc.base.errors import FreeSurfaceWarning
from pcmc.forces.functional import patch_areas
from pcmc.forces.rooms import room_volume_gradients, room_volumes
from pcmc.stability.equilibrium import Equilibrium
from pcmc.stability.modes import lowest


@pytest.mark.parametrize(
    ("make", "area", "motions"),
    [
        (lambda h: generators.double_bubble(h, volumes=(1.0, 1.0)), DOUBLE, 5),
        (lambda h: generators.triple_bubble(h), TRIPLE, 6),
    ],
    ids=["two", "three"],
)
def test_bubbles_of_volume_1_that_nothing_holds(make, area, motions):
    errors = []
    for edge_length in (0.4, 0.2, 0.1):
        result = pcmc.solve(make(edge_length))
        assert result.converged
        assert room_volumes(result.surface) == pytest.approx(1.0, rel=1e-10)
        certificate = result.certificate
        assert (certificate.verdict.name, certificate.index) == ("NEUTRAL", 0)
        assert f"{motions} rigid motions" in certificate.detail
        assert certificate.eigenvalues[0] > 1.0
        assert certificate.curvature_error < 1e-6
        errors.append(patch_areas(result.surface).sum() - area)
    assert orders(errors)[-1] == pytest.approx(2.0, abs=0.15)
    assert abs(errors[-1]) < 5e-3 * area
    with pytest.warns(FreeSurfaceWarning):  # without the condition the bubbles grow or shrink
        free = replace(result.surface, rooms=())
    assert Equilibrium.of(free).factorised().negative == len(result.surface.rooms)


def test_exact_areas():
    assert generators.triple_bubble_exact().area == pytest.approx(TRIPLE, abs=1e-11)
    assert 27 * np.pi / (9 * np.pi) ** (2 / 3) == pytest.approx(DOUBLE, abs=1e-11)
    large = generators.triple_bubble_exact(volume=8.0, alpha=3.0)
    assert large.area == pytest.approx(4.0 * TRIPLE)


def test_unequal_bubbles_balance():
    result = pcmc.solve(generators.double_bubble(0.25, volumes=(1.0, 0.3)))
    left, right, wall = result.surface.pressures
    assert wall == pytest.approx(left - right, rel=1e-12)
    assert right > left
    assert result.certificate.index == 0


def test_modes_keep_the_volume_and_are_those_of_the_dense_pencil():
    surface = pcmc.solve(generators.double_bubble(0.7, volumes=(1.0, 0.6))).surface
    system = Equilibrium.of(surface).factorised()
    values, modes = lowest(system, 3)
    Z = np.linalg.svd(system.of.excluded.T)[2][system.of.excluded.shape[1] :].T
    H, M = system.matrix.toarray(), np.diag(system.of.mass)
    root = np.linalg.cholesky(Z.T @ M @ Z)
    inverse = np.linalg.inv(root)
    dense = np.linalg.eigvalsh(inverse @ (Z.T @ H @ Z) @ inverse.T)
    np.testing.assert_allclose(values, dense[:3], rtol=1e-8)
    assert system.negative == (dense < 0).sum() == 0
    growth = np.einsum("rnd,knd->rk", room_volume_gradients(surface), modes)
    assert np.abs(growth).max() < 1e-9


def test_of_two_connected_bubbles_one_swallows_the_other():
    """Equal ones are a saddle beyond the hemisphere, whatever their volume together."""
    small, large = (pcmc.solve(connected_caps(volume), target="stationary") for volume in (3.0, 6.0))
    assert (small.certificate.index, large.certificate.index) == (0, 1)
    assert large.certificate.verdict.name == "SADDLE"
    mode = large.certificate.modes[0]
    assert abs((room_volume_gradients(large.surface)[0] * mode).sum()) < 1e-9
    result = pcmc.solve(large.surface)
    assert result.converged, result.message
    assert result.certificate.index == 0
    assert room_volumes(result.surface)[0] == pytest.approx(6.0, rel=1e-9)
    heights = [result.surface.vertices[part, 2].max() for part in np.split(np.arange(result.surface.n), 2)]
    assert min(heights) < 0.7 < 1.5 < max(heights)
    assert heights[0] * heights[1] == pytest.approx(1.0, rel=0.2)  # two caps of one sphere over one disc
    areas = [patch_areas(end.surface).sum() for end in (large, result)]
    assert areas[1] < areas[0]


@pytest.mark.parametrize(("between", "limit"), [("rings", 2.0 * np.pi), *at_night(("plates", np.pi))])
def test_a_cylinder_of_prescribed_volume_is_stable_up_to_a_length(between, limit):
    """Plateau's limit 2πR between rings, πR between plates; under a given pressure both are half of that."""

    def softest(length: float, edge_length: float) -> float:
        certificate = pcmc.solve(cylinder(edge_length, length, between), target="stationary").certificate
        assert (certificate.index == 1) == (certificate.eigenvalues[0] < 0.0)
        return float(certificate.eigenvalues[0])

    span = 0.95 * limit, 1.01 * limit
    errors = [brentq(softest, *span, args=(h,), xtol=1e-4) - limit for h in (0.6, 0.3, 0.15)]
    assert orders(errors) == pytest.approx(2.0, abs=0.25)
    assert abs(errors[-1]) < 0.0025 * limit


def test_a_cylinder_longer_than_its_limit_is_a_saddle_though_rigid_motions_are_free():
    """At 1.2 πR between plates its waist costs less than nothing; sideways it is free in both directions."""
    certificate = pcmc.solve(cylinder(0.3, 1.2 * np.pi, "plates"), target="stationary").certificate
    assert (certificate.verdict.name, certificate.index) == ("SADDLE", 1)
    shorter = pcmc.solve(cylinder(0.3, 0.8 * np.pi, "plates"), target="stationary").certificate
    assert (shorter.verdict.name, shorter.index) == ("NEUTRAL", 0)
    assert "rigid motions" in shorter.detail


@pytest.mark.parametrize(
    ("softness", "verdict", "named"),
    [(0.9, "NEUTRAL", True), (1.1, "STABLE", True), (90.0, "STABLE", True), (110.0, "STABLE", False)],
)
def test_a_fold_is_named_within_1_and_neutral_within_a_hundredth(softness, verdict, named):
    """A cylinder of its own volume between rings, so long that λ size²/α is ``softness``/100."""

    def certificate(length: float) -> pcmc.Certificate:
        return pcmc.solve(cylinder(0.4, length, "rings"), target="stationary").certificate

    def excess(length: float) -> float:
        surface = cylinder(0.4, length, "rings")
        return float(certificate(length).eigenvalues[0]) * surface.size**2 - softness / 100.0

    found = certificate(brentq(excess, 1.6 * np.pi, 2.02 * np.pi, xtol=1e-9))
    assert (found.verdict.name, found.index) == (verdict, 0)
    assert ("fold" in found.detail) == named


def test_volumes_between_planes_are_those_enclosed_and_their_gradients():
    surface = cylinder(0.5, 3.0, "plates")
    assert room_volumes(surface)[0] == pytest.approx(3.0 * np.pi, rel=0.03)
    d = np.sin(2.0 * surface.vertices[:, [1, 2, 0]] + 0.3) + 0.4 * surface.vertices
    d[~surface.free, 2] = 0.0
    slope = (room_volume_gradients(surface)[0] * d).sum()
    steps = 0.1 * 0.5 ** np.arange(4)
    values = np.array([room_volumes(surface.moved(surface.vertices + t * d))[0] for t in steps])
    errors = values - room_volumes(surface)[0] - steps * slope
    assert orders(errors)[-1] == pytest.approx(2.0, abs=0.1)
