"""The Hessian and the stiffness assembled in motion-space unknowns, against dense algebra."""

import numpy as np
import pytest
from motion_cases import SURFACES, seam

from pcmc import hessian
from pcmc.forces.motion_space import motion_space, vertex_classes
from pcmc.forces.pattern import hessian_pattern
from pcmc.forces.second_variation import assemble

pytestmark = pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")


def ready(surface, crest=None):
    classes = vertex_classes(surface, crest)
    space = motion_space(surface, classes, surface.vertices)
    return classes, space, hessian_pattern(classes, space)


def dense_basis(space):
    """B (3n,N)."""
    return np.stack([space.to_vectors(column).ravel() for column in np.eye(space.size)], axis=1)


def symmetric(pattern, data):
    upper = pattern.matrix(data).toarray()
    return upper + np.triu(upper, 1).T


def dense_laplacian(surface):
    """L_α (n,n) from the angles: -½ α (cot β + cot γ) summed over the triangles at each edge.

    A cable adds τ/ℓ to its edges; a weight adds w z to the tension of triangles, and g z to that of cables,
    where it is positive.
    """
    L = np.zeros((surface.n, surface.n))
    height = surface.plane.height(surface.vertices)
    for cable in surface.cables:
        for a, b in cable.edges:
            tension = cable.tension + max(cable.weight * height[[a, b]].mean(), 0.0)
            pull = tension / np.linalg.norm(surface.vertices[a] - surface.vertices[b])
            L[[a, b], [b, a]] -= pull
            L[[a, b], [a, b]] += pull
    for face, patch in zip(surface.faces, surface.patch_of_face, strict=True):
        for corner in range(3):
            apex, a, b = np.roll(face, -corner)
            u, w = (
                surface.vertices[a] - surface.vertices[apex],
                surface.vertices[b] - surface.vertices[apex],
            )
            tension = surface.tensions[patch] + max(surface.weights[patch] * height[face].mean(), 0.0)
            weight = 0.5 * tension * (u @ w) / np.linalg.norm(np.cross(u, w))
            L[[a, b], [b, a]] -= weight
            L[[a, b], [a, b]] += weight
    return L


def relative(found, expected):
    return np.abs(found - expected).max() / np.abs(expected).max()


@pytest.mark.parametrize("name", SURFACES)
def test_it_is_the_energys_hessian_between_the_bases(name):
    surface = SURFACES[name]()
    classes, space, pattern = ready(surface)
    B = dense_basis(space)
    found = symmetric(pattern, assemble(surface, classes, space, pattern, surface.vertices))
    assert relative(found, B.T @ hessian(surface).toarray() @ B) < 1e-13


@pytest.mark.parametrize("name", SURFACES)
def test_the_stiffness_is_the_weighted_cotangent_laplacian(name):
    surface = SURFACES[name]()
    classes, space, pattern = ready(surface)
    B = dense_basis(space)
    L = np.kron(dense_laplacian(surface), np.eye(3))
    found = symmetric(pattern, assemble(surface, classes, space, pattern, surface.vertices, 0.0, 1.0))
    assert relative(found, B.T @ L @ B) < 1e-12


def test_both_add_up():
    surface = SURFACES["three patches"]()
    classes, space, pattern = ready(surface)

    def data(hessian, stiffness):
        return assemble(surface, classes, space, pattern, surface.vertices, hessian, stiffness)

    np.testing.assert_allclose(data(2.0, 0.3), 2.0 * data(1.0, 0.0) + 0.3 * data(0.0, 1.0), atol=1e-12)


def test_other_places_than_the_surfaces_own():
    """The positions given count; the frames are those given, too."""
    surface = SURFACES["three patches"]()
    classes, space, pattern = ready(surface)
    X = surface.vertices + space.to_vectors(0.01 * np.sin(np.arange(space.size)))
    B = dense_basis(space)
    found = symmetric(pattern, assemble(surface, classes, space, pattern, X))
    assert relative(found, B.T @ hessian(surface.moved(X)).toarray() @ B) < 1e-13


def test_with_a_crease():
    surface = seam()
    classes, space, pattern = ready(surface, np.array([[6, 7], [7, 6], [7, 8], [8, 7]]))
    assert space.dimension.max() == 3
    B = dense_basis(space)
    found = symmetric(pattern, assemble(surface, classes, space, pattern, surface.vertices))
    assert relative(found, B.T @ hessian(surface).toarray() @ B) < 1e-13


@pytest.mark.parametrize("name", SURFACES)
def test_the_pattern_is_the_upper_triangle_of_neighbours_in_order(name):
    surface = SURFACES[name]()
    classes, space, pattern = ready(surface)
    assert pattern.size == space.size
    vertex = np.repeat(np.arange(surface.n), space.dimension)
    near = np.eye(surface.n, dtype=bool)
    for face in classes.faces:
        near[np.ix_(face, face)] = True
    expected = np.triu(near[np.ix_(vertex, vertex)])
    for row in range(pattern.size):
        columns = pattern.indices[pattern.indptr[row] : pattern.indptr[row + 1]]
        np.testing.assert_array_equal(columns, np.flatnonzero(expected[row]))
        assert columns[0] == row
