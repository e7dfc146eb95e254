"""A honeycomb that nothing holds, from starts far from rest."""

import numpy as np
import pytest
from periodic_cases import honeycomb, honeycomb_energy

import pcmc


@pytest.mark.parametrize("shear", [0.0, 0.6, 0.9])
def test_a_sheared_honeycomb_has_the_energy_of_the_shortest_nets(shear: float) -> None:
    # its pressures are equal: what rounding leaves of them is no pressure at a free edge
    u, v = np.array([1.0, 0.0]), np.array([0.5 + shear * 0.75**0.5, 0.75**0.5])
    result = pcmc.solve(honeycomb(u, v))
    assert result.energy == pytest.approx(4.0 * honeycomb_energy(u, v), rel=1e-12)
    assert result.certificate.verdict is pcmc.Verdict.NEUTRAL  # but for translations


@pytest.mark.parametrize("film", ["b", "c"])
def test_a_film_that_starts_very_narrow_gets_wide(film: str) -> None:
    # only descent leads away from there; it must not shift the foam, which nothing holds
    u, v = np.array([1.0, 0.0]), np.array([0.453, 0.866])
    middle = {"b": 0.5 * v, "c": 0.5 * u}[film]
    result = pcmc.solve(honeycomb(u, v, 0.1 * (u + v) / 3.0 + 0.9 * middle))
    assert result.energy == pytest.approx(4.0 * honeycomb_energy(u, v), rel=1e-12)
