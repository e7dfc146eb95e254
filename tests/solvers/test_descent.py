"""Sheets carried along with their curves, and the way down that is smooth."""

import numpy as np
import pytest
from backends import every_backend
from cable_cases import net
from shapes import disc

from pcmc import Patch, Surface
from pcmc.forces.motion_space import motion_space, vertex_classes
from pcmc.solvers.smoother import HarmonicExtension


@every_backend
@pytest.mark.parametrize("gap", [1e-2, 1e-7])
def test_sheets_are_carried_along_rigidly_however_thin_a_triangle_beside_the_boundary(backend, gap):
    flat, F = disc(4)
    X = np.column_stack([flat, np.zeros(len(flat))])
    rim = np.linalg.norm(X, axis=1) > 0.99
    inside = int(np.flatnonzero(~rim)[np.linalg.norm(X[~rim] - X[rim][0], axis=1).argmin()])
    X[inside] = X[rim][0] + gap * (X[inside] - X[rim][0])
    film = Surface(X, F, np.zeros(len(F), int), [Patch("film", 1.0)], fixed=rim)
    classes = vertex_classes(film)
    shift = np.array([0.3, -0.2, 0.0])
    carried = HarmonicExtension(film, classes, X, backend).extend(
        motion_space(film, classes, X), np.where(rim[:, None], shift, 0.0)
    )
    np.testing.assert_allclose(carried, np.broadcast_to(shift, X.shape), atol=1e-5)


def test_sheets_are_carried_along_alike_whatever_they_weigh():
    """Their weights are left out as their tensions are: with them the way depended on the units."""
    heavy = net()
    light = heavy.retensioned(weights={"a": 0.0, "b": 0.0})
    motion = np.random.default_rng(0).standard_normal((heavy.n, 3))
    classes = vertex_classes(heavy)
    carried = [HarmonicExtension(s, classes, s.vertices).harmonic(motion) for s in (heavy, light)]
    np.testing.assert_array_equal(*carried)
