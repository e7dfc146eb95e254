"""The stress of a cell beside the energies of its neighbours, and cells of free size beside closed forms."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from nightly import at_night
from scipy.linalg import expm

from generators import kelvin_foam, minimal_cell, weaire_phelan_foam
from pcmc import Patch, Room, Surface, cell_stress, free_cell, images_in, solve
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.forces.functional import patch_areas
from pcmc.solvers.result import Status
from pcmc.surface.images import lattice_of
from studies.orders import richardson, slope

ASKEW = np.array([[0.3, 0.4, -0.2], [0.4, -0.5, 0.6], [-0.2, 0.6, 0.9]])
BOX = np.diag([1.1, 1.0, 1.0 / 1.1])


def area(surface: Surface) -> float:
    return float(surface.tensions @ patch_areas(surface))


def volume(surface: Surface) -> float:
    return abs(float(np.linalg.det(lattice_of(surface))))


def stretched(surface: Surface, stretch) -> Surface:
    return surface.rebuilt(vertices=surface.vertices @ stretch)


def at_rest(surface: Surface) -> Surface:
    result = solve(surface, target="stationary")
    assert result.converged
    return result.surface


def held_inside(kind: str, share: float) -> Surface:
    """A minimal surface's cell with this share of it on one side."""
    cell = minimal_cell(kind, 1)
    return cell.rebuilt(rooms=[Room("inside", {"film": 1}, share * volume(cell))])


def unequal_bubbles() -> Surface:
    """The foam of Weaire and Phelan with one bubble a tenth larger."""
    foam = weaire_phelan_foam(0)
    first, *others = foam.rooms
    return foam.rebuilt(rooms=[replace(first, volume=1.1 * first.volume), *others])


@pytest.mark.parametrize(
    "start",
    [
        lambda: minimal_cell("G", 1),
        lambda: held_inside("G", 0.45),
        lambda: stretched(kelvin_foam(1), expm(0.05 * ASKEW)),
        unequal_bubbles,
    ],
    ids=["gyroid", "gyroid at a volume", "Kelvin askew", "unequal bubbles"],
)
def test_the_stress_is_the_change_of_the_energy_at_rest_with_the_cell(start):
    rest = at_rest(start())
    rate = volume(rest) * float((cell_stress(rest) * ASKEW).sum())
    steps = 0.004 * 0.5 ** np.arange(4)
    left = [abs(area(at_rest(stretched(rest, expm(t * ASKEW)))) - area(rest) - t * rate) for t in steps]
    assert abs(rate) > 1e-2
    assert slope(steps, np.array(left)).order == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(("free", "ways"), [("size", 1), *at_night(("lengths", 3)), ("shape", 3)])
def test_the_p_surface_balances_a_suction_where_its_energy_has_a_maximum(free, ways):
    """E = c s² in a cube of side s, so c s² + p s³ is stationary at s = -2c / (3p)."""
    cell = at_rest(minimal_cell("P", 1))
    side = 2.0 * area(cell) / 3.0
    found = free_cell(stretched(cell, 1.3 * np.eye(3)), -1.0, free=free)
    assert np.abs(found.stretch - np.eye(3) * side / 1.3).max() < 1e-7
    assert np.abs(found.stress - np.eye(3)).max() < 1e-7
    assert (found.pressure, found.ways_down, found.certificate.index) == (-1.0, ways, 1)


def test_a_stretched_box_of_kelvins_foam_becomes_a_cube_again():
    """Its area over volume^(2/3) is printed as 5.306 (Weaire and Phelan 1994)."""
    areas, away = [], []
    for level in (1, 2, 3):
        start = stretched(kelvin_foam(level), BOX)
        found = free_cell(start)
        assert found.ways_down == 0
        assert volume(found.surface) == pytest.approx(volume(start), rel=1e-9)
        away.append(np.abs(BOX @ found.stretch - np.eye(3)).max())
        areas.append(2.0 * area(found.surface) / volume(found.surface) ** (2.0 / 3.0))
    assert away[0] < 2e-4
    assert away[2] < away[1] < away[0] / 2.0
    assert richardson(np.array(areas), (2, 4)) == pytest.approx(5.3063, abs=1e-4)


def test_a_foam_under_the_pressure_that_it_balanced_comes_to_the_same_cell():
    kept = free_cell(kelvin_foam(1))
    found = free_cell(stretched(kelvin_foam(1), 1.2 * np.eye(3)), kept.pressure, free="size")
    assert kept.pressure == pytest.approx(-2.0 / 3.0 * area(kept.surface) / volume(kept.surface), rel=1e-9)
    assert volume(found.surface) == pytest.approx(volume(kept.surface), rel=1e-6)
    assert found.ways_down == 1


def test_what_rounding_leaves_of_the_pressure_on_a_film_is_no_given_one():
    foam = at_rest(weaire_phelan_foam(0))
    name = next(patch.name for patch in foam.patches if patch.pressure == 0.0)
    rounded = foam.retensioned(pressures={name: 3e-13 * foam.pressures.max()})
    assert cell_stress(rounded) == pytest.approx(cell_stress(foam), abs=1e-9)


@pytest.mark.parametrize("pressure", [0.0, *at_night(1.0)])
def test_where_no_size_balances_the_pressure_the_nearest_that_does_is_named(pressure):
    with pytest.raises(OptionError, match=r"found no cell for a pressure of .* pass pressure=-1\.609,"):
        free_cell(minimal_cell("P", 1), pressure, free="size")


def test_ctrl_c_in_a_solve_ends_the_search_for_a_cell(monkeypatch):
    def stopped(surface, **options):
        return replace(solve(surface, **options), status=Status.STOPPED)

    monkeypatch.setattr(import_module("pcmc.equilibria.free_cell"), "solve", stopped)
    with pytest.raises(KeyboardInterrupt):
        free_cell(kelvin_foam(1))


def test_of_a_surface_that_is_not_at_rest_there_is_no_stress():
    foam = kelvin_foam(1)
    with pytest.raises(SurfaceError, match="cell_stress: not at rest"):
        cell_stress(foam.rebuilt(vertices=foam.vertices @ np.diag([1.1, 1.0, 1.0])))


def test_what_a_cell_that_is_free_cannot_have_is_refused():
    corners = [[x, y, 0.0] for y in range(4) for x in range(4)]
    first = [k for k in range(12) if k % 4 < 3]
    faces = [[k, k + 1, k + 5] for k in first] + [[k, k + 5, k + 4] for k in first]
    images = images_in(corners, [[3, 0, 0], [0, 3, 0]])
    flat = Surface(corners, faces, [0] * 18, [Patch("film", 1.0, 0.0)], images=images)
    with pytest.raises(SurfaceError, match="periodic in three directions, found 2"):
        cell_stress(flat)
    cell = minimal_cell("P", 1)
    with pytest.raises(SurfaceError, match="this one is held"):
        free_cell(cell.rebuilt(fixed=cell.original == cell.original[0]), 1.0)
    with pytest.raises(SurfaceError, match="'film' has a given pressure"):
        cell_stress(cell.retensioned(None, {"film": 1.0}))
    with pytest.raises(OptionError, match="nothing free"):
        free_cell(cell, free="size")
    with pytest.raises(OptionError, match="free"):
        free_cell(cell, free="angles")
    with pytest.raises(SurfaceError, match="does not come to rest"):
        free_cell(stretched(minimal_cell("P", 2), np.diag([1.1, 1.0, 1.0])), -1.0)
