"""Whether motions are soft is counted: it depends neither on the modes asked for nor on an iteration."""

import numpy as np
import pytest
from nightly import at_night
from scipy.optimize import brentq

import pcmc
from generators import catenoid, four_fans, spherical_cap, two_caps
from pcmc import BoundaryMotion, Patch, Surface, Verdict, certify, solve
from pcmc.stability import modes as stability_modes
from pcmc.stability.equilibrium import Equilibrium
from pcmc.stability.factorisation import SingularMatrix
from pcmc.stability.modes import ArpackError, count_soft, lowest


def needle(height):
    """A pyramid over a square, of one unknown, at rest: E'' falls as the cube of its height."""
    corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, height]]
    faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    tension = (1.0 + height**2) ** 0.5 / (3.0 * height)
    return Surface(corners, faces, [0] * 4, [Patch("roof", tension)], fixed=range(4))


@pytest.mark.parametrize("modes", [0, *at_night(1), 3])
def test_neutral_at_the_hemisphere_whatever_modes_are_asked_for(modes):
    surface = solve(spherical_cap(0.1, alpha=0.501)).surface
    branch = pcmc.follow(surface, "cap", step=-0.02, folds=1)
    (row,) = np.flatnonzero(branch.events.kind == "fold")
    found = certify(branch.event_surfaces[row], modes=modes)
    assert found.verdict is Verdict.NEUTRAL
    assert "at a fold or a branching" in found.detail
    assert len(found.eigenvalues) == modes


def raised_catenoid():
    """A catenoid whose rings move apart, to its fold at the half-distance 0.6627 as the mesh has it."""
    film = solve(catenoid(0.2, half_distance=0.55)).surface
    rings = film.vertices[film.pinned]

    def apart(half_distance):
        return np.column_stack([rings[:, :2], np.sign(rings[:, 2]) * half_distance])

    return pcmc.follow(film, BoundaryMotion(apart, 0.55), step=0.05, folds=1)


def lowered_caps():
    start = solve(two_caps(1.2), target="stationary").surface
    down = pcmc.Direction({"large": -1.0, "small": -1.0}, relative=True)
    return pcmc.follow(start, down, folds=1)


@pytest.mark.parametrize("branch", [raised_catenoid, *at_night(lowered_caps)])
def test_certify_says_that_a_surface_is_at_a_fold(branch):
    """Where curves move or the mesh is coarse, the mesh's fold is not quite where its eigenvalue is 0."""
    found = branch()
    (row,) = np.flatnonzero(found.events.kind == "fold")
    for modes in (0, 1):
        certificate = certify(found.event_surfaces[row], modes=modes)
        assert "at a fold or a branching, or near one" in certificate.detail
    assert "fold" not in certify(found.surfaces[0]).detail


@pytest.mark.parametrize("alpha_aux", [1.0, 2.0, 3.0, 4.0])
def test_the_counts_are_those_of_the_computed_eigenvalues(alpha_aux):
    surface = solve(four_fans(4, alpha_aux=alpha_aux), target="stationary").surface
    variation = Equilibrium.of(surface)
    system = variation.factorised()
    weighted = system.matrix.toarray() / np.sqrt(np.outer(variation.tension_mass, variation.tension_mass))
    values = np.linalg.eigvalsh(weighted)
    for band in (0.01, 0.3, 3.0):
        counts = count_soft(variation, band, 2.0 * band)[0]
        assert counts.index == (values < 0.0).sum()
        assert counts.below == (values < -band).sum() or counts.soft == 0
        assert counts.soft == (np.abs(values) < band).sum()
        assert counts.near == (np.abs(values) < 2.0 * band).sum()


@pytest.mark.parametrize("modes", [0, 1])
def test_a_surface_of_one_unknown_can_be_neutral(modes):
    assert certify(needle(1.0), modes=modes).verdict is Verdict.STABLE
    found = certify(needle(300.0), modes=modes)
    assert (found.verdict, found.index) == (Verdict.NEUTRAL, 0)
    assert len(found.eigenvalues) == modes


@pytest.mark.parametrize(
    ("bound", "below", "above"),
    [
        (0.01, (Verdict.NEUTRAL, "1 softest mode within ±0.01 α/size²"), (Verdict.STABLE, "1 softest mode")),
        (1.0, (Verdict.STABLE, "1 softest mode within ±1 α/size²"), (Verdict.STABLE, None)),
    ],
)
def test_a_fold_is_named_up_to_the_bounds_that_the_certificate_tells(bound, below, above):
    """λ size²/α of a pyramid over a square is 3 (8 + h²)/(1 + h²)²; certificates have ±0.01 and ±1."""
    for times, (verdict, words) in ((0.97, below), (1.03, above)):
        height = brentq(lambda h, t=times: 3.0 * (8.0 + h * h) / (1.0 + h * h) ** 2 - t * bound, 1.0, 99.0)
        found = certify(needle(height))
        assert found.verdict is verdict
        assert ("softest mode" in found.detail) == (words is not None)
        assert words is None or words in found.detail


def test_without_convergence_the_verdict_is_undecided(monkeypatch, small_cap):
    def fails(*_, **__):
        raise ArpackError(-9999)

    finer = solve(spherical_cap(0.2)).surface
    assert certify(finer).verdict is Verdict.STABLE
    monkeypatch.setattr(stability_modes, "eigsh", fails)
    found = certify(finer)
    assert found.verdict is Verdict.UNDECIDED
    assert "the eigenvalues did not converge" in found.detail
    assert "modes=0" in found.detail
    assert certify(finer, modes=0).verdict is Verdict.STABLE
    with pytest.raises(SingularMatrix, match="did not converge"):
        lowest(Equilibrium.of(finer).factorised(), 1)


def test_a_stable_roof_is_factorised_once(monkeypatch):
    cap = solve(spherical_cap(0.25)).surface
    shifts, factorised = [], Equilibrium.factorised

    def counted(self, shift=0.0):
        shifts.append(shift)
        return factorised(self, shift)

    monkeypatch.setattr(Equilibrium, "factorised", counted)
    assert certify(cap).verdict is Verdict.STABLE
    assert len(shifts) == 1
