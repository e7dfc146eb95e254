"""The derivative of the forces in the motion space, frames turning, against differences of them."""

import numpy as np
import pytest
from motion_cases import SURFACES
from shapes import octahedron, rotation, shaken
from starts import two_squares

from pcmc import Plane, Surface, solve
from pcmc.forces.functional import energy_and_gradient
from pcmc.forces.jacobian import linearise
from pcmc.forces.motion_space import motion_space, vertex_classes
from pcmc.forces.pinching import standing_part
from pcmc.surface.topology import SHEET

pytestmark = pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")


def equator() -> Surface:
    """A closed surface whose middle slides on a tilted Π: sheet vertices that slide."""
    R = rotation(2)
    plane = Plane((0.0, 0.0, 0.0), R[:, 2])
    X = octahedron(0.7).vertices
    middle = np.abs(X[:, 2]) < 1e-9
    X = X + 0.05 * np.cos(np.arange(X.size).reshape(X.shape)) * np.where(middle[:, None], [1, 1, 0], 1)
    given = octahedron(0.7)
    return Surface(X @ R.T, given.faces, given.patch_of_face, given.patches, on_plane=middle, plane=plane)


def forces(surface, classes, X):
    return motion_space(surface, classes, X).project(energy_and_gradient(surface, X)[1])


def slope(surface, classes):
    """How fast the error of central differences falls when their step is halved: log2 of it."""
    X = surface.vertices
    space = motion_space(surface, classes, X)
    d = np.random.default_rng(0).standard_normal(X.shape)  # off the motion space too
    d[surface.fixed] = 0.0
    d[surface.on_plane] = surface.plane.along(d[surface.on_plane])
    exact = linearise(surface, classes, space, X, energy_and_gradient(surface, X)[1])(d)
    errors = [
        np.abs(
            space.to_coordinates(forces(surface, classes, X + t * d) - forces(surface, classes, X - t * d))
            / (2.0 * t)
            - exact
        ).max()
        for t in surface.size * np.array([2e-5, 1e-5])
    ]
    assert errors[1] < 1e-4 * np.abs(exact).max()
    return np.log2(errors[0] / errors[1])


@pytest.mark.parametrize("name", SURFACES)
def test_it_is_the_limit_of_differences(name):
    surface = SURFACES[name]()
    assert slope(surface, vertex_classes(surface)) == pytest.approx(2.0, abs=0.05)


def test_sheets_that_slide_on_the_plane():
    surface = equator()
    classes = vertex_classes(surface)
    assert (classes.kind[surface.on_plane] == SHEET).all()
    assert slope(surface, classes) == pytest.approx(2.0, abs=0.05)


def test_a_junction_beside_one_that_rests():
    surface = solve(two_squares(6, alpha_aux=2.5), target="stationary").surface
    found = standing_part(surface)
    classes = found.classes
    assert classes.level.any()
    moves = shaken(found.surface, 0.02)
    assert slope(moves, classes) == pytest.approx(2.0, abs=0.05)
