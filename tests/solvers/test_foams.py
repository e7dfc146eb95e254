"""A honeycomb that nothing holds, from starts far from rest."""

import re

import numpy as np
import pytest
from nightly import at_night
from periodic_cases import honeycomb, honeycomb_energy, scattered

import pcmc
from generators import weaire_phelan_foam


@pytest.mark.parametrize("shear", [0.0, *at_night(0.6), 0.9])
def test_a_sheared_honeycomb_has_the_energy_of_the_shortest_nets(shear: float) -> None:
    # its pressures are equal: what rounding leaves of them is no pressure at a free edge
    u, v = np.array([1.0, 0.0]), np.array([0.5 + shear * 0.75**0.5, 0.75**0.5])
    result = pcmc.solve(honeycomb(u, v))
    assert result.energy == pytest.approx(4.0 * honeycomb_energy(u, v), rel=1e-12)
    assert result.certificate.verdict is pcmc.Verdict.NEUTRAL  # but for translations


@pytest.mark.parametrize("film", ["b", *at_night("c")])
def test_a_film_that_starts_very_narrow_gets_wide(film: str) -> None:
    # only descent leads away from there; it must not shift the foam, which nothing holds
    u, v = np.array([1.0, 0.0]), np.array([0.453, 0.866])
    middle = {"b": 0.5 * v, "c": 0.5 * u}[film]
    result = pcmc.solve(honeycomb(u, v, 0.1 * (u + v) / 3.0 + 0.9 * middle))
    assert result.energy == pytest.approx(4.0 * honeycomb_energy(u, v), rel=1e-12)


@pytest.mark.parametrize("seed", [0, *at_night(1)])
def test_of_a_foams_energy_what_does_not_depend_on_the_cut_of_its_cell_is_told(seed: int) -> None:
    foam = weaire_phelan_foam(levels=0)
    results = [pcmc.solve(foam), pcmc.solve(scattered(foam, np.eye(3), seed))]
    assert results[1].energy != pytest.approx(results[0].energy, abs=0.01)
    areas = [float(re.findall(r"([\d.]+) of areas", str(result.certificate))[0]) for result in results]
    assert areas[1] == pytest.approx(areas[0], rel=1e-9)
    assert areas[0] == pytest.approx(5.2883, rel=2e-3)  # of the finest meshes
