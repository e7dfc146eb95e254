"""Random small meshes: each ends in a verdict or in an error of the house, with no warning."""

import warnings

import numpy as np
import pytest
from random_meshes import random_surface

import pcmc
from pcmc import Patch, Surface, Verdict, solvers
from pcmc.base.errors import FreeSurfaceWarning, SurfaceError
from pcmc.meshing.refinement import refine

METHODS = (
    {"method": "newton", "iterations": 15},
    {"method": "newton", "iterations": 10, "target": "stationary"},
    {"method": "nesterov", "iterations": 5},
    {"method": "lbfgs", "evaluations": 20},
)


@pytest.mark.slow
@pytest.mark.parametrize("hundred", range(2))
def test_random_meshes_end_in_a_verdict_or_a_named_error(hundred):
    solved, refusals = 0, []
    for seed in range(100 * hundred, 100 * hundred + 100):
        try:
            surface = random_surface(seed)
        except SurfaceError as error:
            refusals.append(error.what)
            continue
        assert np.isfinite(pcmc.energy(surface)), f"seed {seed}"
        assert isinstance(pcmc.certify(surface).verdict, Verdict), f"seed {seed}"
        try:
            solve = pcmc.solve if seed % 16 < 2 else solvers.solve  # the search for further starts takes long
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
    assert solved > 80
    assert None not in refusals


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
