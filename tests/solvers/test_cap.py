"""A cap over a disc, α = 0.6 and R = 1: the equilibrium approaches the sphere at second order."""

import numpy as np
import pytest
from convergence import orders

from generators import spherical_cap, spherical_cap_exact
from pcmc import curvature_error, energy, gradient, solve

EXACT = {"energy": 1.5039191689, "height": 0.5366750419}
EDGES = (0.25, 0.125, 0.0625, 0.03125)


@pytest.fixture(scope="module")
def solved():
    results = [solve(spherical_cap(edge)) for edge in EDGES]
    assert all(result.converged for result in results)
    return [result.surface for result in results]


def test_the_closed_form():
    exact = spherical_cap_exact()
    assert exact.energy == pytest.approx(EXACT["energy"], abs=5e-11)
    assert exact.height == pytest.approx(EXACT["height"], abs=5e-11)


def test_energy_error_falls_four_fold_with_each_halving(solved):
    error = np.array([energy(surface) for surface in solved]) - EXACT["energy"]
    assert (error < 0).all()  # the rim is inscribed in the circle
    assert orders(error) == pytest.approx(2.0, abs=0.2)
    assert orders(error)[-1] == pytest.approx(2.0, abs=0.05)
    assert abs(error[-1]) < 6e-5


def test_height_and_distance_from_the_sphere_are_of_second_order(solved):
    height = [surface.vertices[:, 2].max() - EXACT["height"] for surface in solved]
    away = [spherical_cap_exact().distance(surface).max() for surface in solved]
    assert orders(height) == pytest.approx(2.0, abs=0.2)
    assert orders(away) == pytest.approx(2.0, abs=0.25)


def test_curvature_is_exact_by_one_measure_and_of_second_order_by_the_other(solved):
    for surface in solved:
        assert np.nanmax(np.abs(curvature_error(surface, "variational"))) < 1e-8
    cotangent = [np.nanmax(np.abs(curvature_error(surface))) for surface in solved]
    assert orders(cotangent) == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("method", ["nesterov", "lbfgs"])
def test_the_other_solvers_come_to_the_same_cap(method, solved):
    options = {"nesterov": {"t0": 0.05, "iterations": 5000}, "lbfgs": {}}[method]
    result = solve(spherical_cap(EDGES[0]), method, tolerance=1e-12, **options)
    assert result.converged
    # They move vertices along the surface, too, and so end with a little less energy.
    assert -2e-3 < result.energy - energy(solved[0]) <= 1e-9
    assert np.abs(gradient(result.surface)).max() < 1e-6
    assert np.nanmax(np.abs(curvature_error(result.surface, "variational"))) < 1e-4
