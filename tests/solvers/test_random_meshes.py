"""Random small meshes: each ends in a verdict or in an error of the house, with no warning."""

import warnings

import numpy as np
import pytest
from nightly import at_night
from programs import needs_evolver
from random_meshes import loaded_surface, random_surface

import pcmc
from pcmc import Patch, Surface, Verdict, solvers
from pcmc.base.errors import FreeSurfaceWarning, OptionError, PcmcError, SurfaceError
from pcmc.meshing.refinement import refine
from studies.reference import evolver

METHODS = (
    {"method": "newton", "iterations": 15},
    {"method": "newton", "iterations": 10, "target": "stationary"},
    {"method": "nesterov", "iterations": 5},
    {"method": "lbfgs", "evaluations": 20},
)


@pytest.mark.parametrize("seeds", [range(30), *at_night(range(100), range(100, 200))])
def test_random_meshes_end_in_a_verdict_or_a_named_error(seeds):
    solved, refusals = 0, []
    for seed in seeds:
        try:
            surface = random_surface(seed)
        except SurfaceError as error:
            refusals.append(error.what)
            continue
        assert np.isfinite(pcmc.energy(surface)), f"seed {seed}"
        assert isinstance(pcmc.certify(surface).verdict, Verdict), f"seed {seed}"
        try:
            solve = pcmc.solve if seed % 16 < 2 else solvers.solve_once  # further starts take long
            result = solve(surface, **METHODS[seed // 2 % 4])
        except SurfaceError as error:
            refusals.append(error.what)
            continue
        assert np.isfinite(result.surface.vertices).all(), f"seed {seed}"
        assert np.abs(result.surface.plane.height(result.surface.vertices)[surface.on_plane]).max(
            initial=0.0
        ) < 1e-9 * max(surface.size, result.surface.size), f"seed {seed}"
        assert str(result.certificate), f"seed {seed}"
        solved += 1
    assert solved > 0.8 * len(seeds)
    assert None not in refusals


@pytest.mark.parametrize("seeds", [range(30), *at_night(range(100), range(100, 200))])
@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")
def test_random_forces_end_in_a_verdict_or_a_named_error(seeds):
    built, solved, refusals = 0, 0, []
    for seed in seeds:
        try:
            surface = loaded_surface(seed)
        except SurfaceError as error:
            refusals.append(error.what)
            continue
        built += 1
        assert np.isfinite(pcmc.energy(surface)), f"seed {seed}"
        try:
            assert isinstance(pcmc.certify(surface).verdict, Verdict), f"seed {seed}"
            result = solvers.solve_once(surface, **METHODS[seed // 2 % 4])
            assert str(result.certificate), f"seed {seed}"
        except (SurfaceError, OptionError) as error:
            refusals.append(error.what)
            continue
        solved += 1
        X = result.surface.vertices
        assert np.isfinite(X).all(), f"seed {seed}"
        for plane, mask in surface.on_planes:
            assert np.abs(plane.height(X))[mask].max(initial=0.0) < 1e-8 * result.surface.size, f"seed {seed}"
    assert None not in refusals
    assert "pressure" not in refusals  # a pressure that is no number: a volume that nothing changes
    assert built > 0.85 * len(seeds)
    assert solved > 0.4 * len(seeds)


@pytest.mark.parametrize("suffix", [".pcmc", *at_night(".fe")])
@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")
def test_files_carry_random_forces(suffix, tmp_path):
    carried = 0
    for seed in range(60):
        try:
            surface = loaded_surface(seed)
            pcmc.write(tmp_path / f"a{suffix}", surface)
        except PcmcError:
            continue
        again = pcmc.read(tmp_path / f"a{suffix}")
        carried += 1
        assert pcmc.energy(again) == pytest.approx(pcmc.energy(surface), rel=1e-10, abs=1e-10), f"seed {seed}"
        assert len(again.cables) == len(surface.cables), f"seed {seed}"
        assert [p.mirror for p, _ in again.on_planes] == [p.mirror for p, _ in surface.on_planes], (
            f"seed {seed}"
        )
    assert carried > 30


@needs_evolver
@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")
def test_the_reference_program_has_the_energy_of_random_forces():
    compared = 0
    for seed in range(80):
        try:
            surface = loaded_surface(seed)
        except SurfaceError:
            continue
        if not surface.rooms:  # their pressures are not in its energy
            energy = pcmc.energy(surface)
            assert evolver.energy(surface) == pytest.approx(energy, rel=1e-11, abs=1e-11), f"seed {seed}"
            compared += 1
    assert compared > 30


def bridge() -> Surface:
    """A wall of one triangle whose corners all lie on the roof."""
    X = [[0, 0, 1], [1, 0, 1], [0.5, 0, 0], [0.5, 1, 0.5], [1.5, 1, 0.5]]
    patches = [Patch("wall", 1, 0), Patch("roof", 1)]
    return Surface(X, [[0, 2, 1], [0, 1, 3], [2, 1, 4]], [0, 1, 1], patches, fixed=[3], on_plane=[2])


@pytest.mark.parametrize("options", METHODS, ids=lambda options: options["method"])
def test_a_wall_whose_vertices_all_lie_on_sheets_is_judged_and_solved(options):
    surface = bridge()
    assert pcmc.certify(surface).verdict is not Verdict.STABLE
    result = pcmc.solve(surface, **options)
    assert isinstance(result.certificate.verdict, Verdict)


def test_such_a_wall_can_be_refined():
    assert refine(bridge()).m == 12


def test_sheets_that_follow_their_curves_keep_to_the_plane():
    """A vertex inside a sheet that slides on Π stays there while a junction travels past it."""
    warnings.simplefilter("ignore", FreeSurfaceWarning)
    for seed in (95, 117, 1045, 2045):
        surface = random_surface(seed)
        result = pcmc.solve(surface, iterations=25)
        height = surface.plane.height(result.surface.vertices)
        assert np.abs(height[surface.on_plane]).max(initial=0.0) < 1e-9 * result.surface.size
