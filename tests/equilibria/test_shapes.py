"""The distance of two shapes: which surfaces are the same equilibrium."""

import numpy as np
import pytest
from refusals import refused

from generators import spherical_cap, spherical_cap_exact
from pcmc import Patch, Surface
from pcmc.base.errors import SurfaceError
from pcmc.equilibria import shape_distance
from pcmc.equilibria.shapes import Shape

SMALL, LARGE = spherical_cap_exact(), spherical_cap_exact(upper=True)


def turned(surface, angle):
    """A cap with its inside turned about z: the same shape, other vertices on it."""
    X = surface.vertices.copy()
    c, s = np.cos(angle), np.sin(angle)
    inside = ~surface.fixed
    X[inside, :2] = X[inside, :2] @ np.array([[c, s], [-s, c]])
    return surface.moved(X)


def test_vertices_that_slide_along_a_shape_change_it_to_second_order():
    surfaces = {edge: spherical_cap(edge, exact=True) for edge in (0.2, 0.1)}
    same = [shape_distance(surface, turned(surface, 0.25 * edge)) for edge, surface in surfaces.items()]
    assert same[0] < 0.02 * 0.2
    assert np.log2(same[0] / same[1]) == pytest.approx(2.0, abs=0.5)
    other = spherical_cap(0.1, height=0.7)
    assert shape_distance(surfaces[0.1], other) == pytest.approx(0.1, rel=0.4)


def test_a_small_part_that_leans_the_other_way_is_another_shape():
    """In the mean two mirror images are near, as most of them is common; at the top they are not."""
    cap = spherical_cap(0.125)
    x, y, _ = cap.vertices.T
    lean = 0.03 * np.exp(-(x**2 + y**2) / 0.1) * [[0.0], [0.0], [1.0]]
    one, other = (Shape.of(cap.moved(cap.vertices + sign * lean.T)) for sign in (1.0, -1.0))
    assert one.distance(other) < 0.2 * one.edge
    assert not one.same_as(other)


def test_other_triangles_on_a_cap_of_three_rings_are_no_other_shape():
    cap = spherical_cap(1.0 / 3.0, exact=True)
    assert all(Shape.of(cap).same_as(Shape.of(turned(cap, angle))) for angle in np.linspace(0.1, 1.0, 7))


def test_of_two_sheets_the_nearest_vertex_may_be_on_the_wrong_one():
    """Two flat sheets, one above the other; which of them has a vertex in its middle changes no shape."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    fan, halves = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [[0, 1, 2], [0, 2, 3]]
    corners = np.concatenate([square, [[0.5, 0.5, 0.0]], square])
    one, other = (
        Surface(
            corners + np.repeat([[0.0, 0.0, low], [0.0, 0.0, 0.1 - low]], [5, 4], axis=0),
            np.concatenate([fan, np.array(halves) + 5]),
            [0] * 6,
            [Patch("film", 1.0, 0.0)],
            fixed=[0],
        )
        for low in (0.0, 0.1)
    )
    assert shape_distance(one, other) == 0.0


def test_a_surface_shrunk_to_a_point_has_no_distance():
    cap = spherical_cap(0.5)
    with refused(SurfaceError, what="other"):
        shape_distance(cap, cap.moved(0.0 * cap.vertices))


def test_the_distance_is_symmetric_and_as_long_as_the_unit():
    one, other = spherical_cap(0.25), spherical_cap(0.2, height=0.5)
    there = shape_distance(one, other)
    assert shape_distance(other, one) == pytest.approx(there, rel=1e-14)
    scaled = [surface.moved(3.0 * surface.vertices) for surface in (one, other)]
    assert shape_distance(*scaled) == pytest.approx(3.0 * there, rel=1e-12)


# ---- what is refused, and stopping ----------------------------------------------------------------
