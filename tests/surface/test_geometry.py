"""Triangles: identities of edges, areas and angles, and the compiled layer against the vectorised one."""

import numpy as np
import pytest
from shapes import generic, octahedron, rotation, shaken

from pcmc.forces.functional import patch_areas
from pcmc.surface import geometry
from pcmc.surface.geometry import (
    angles,
    area_vectors,
    bounding_size,
    cross_2d,
    edge_vectors,
    face_areas,
    segment_lengths,
    vertex_area_vectors,
    vertex_sums,
)

SURFACE = generic()
P = SURFACE.vertices[SURFACE.faces]


def test_edges_close_and_are_opposite_their_corners():
    edges = edge_vectors(P)
    assert np.abs(edges.sum(axis=1)).max() < 1e-15
    np.testing.assert_array_equal(edges[:, 0], P[:, 2] - P[:, 1])
    ends = SURFACE.topology.edges
    lengths = segment_lengths(SURFACE.vertices, ends)[SURFACE.topology.edge_of_face]
    np.testing.assert_allclose(np.linalg.norm(edges, axis=2), lengths, rtol=1e-15)


def test_area_vectors_are_across_the_triangles_and_cancel_on_a_closed_surface():
    vectors = area_vectors(P)
    assert np.abs(np.einsum("fkd,fd->fk", edge_vectors(P), vectors)).max() < 1e-15
    ball = shaken(octahedron())
    assert np.abs(area_vectors(ball.vertices[ball.faces]).sum(axis=0)).max() < 1e-15


def test_areas_are_herons():
    a, b, c = np.linalg.norm(edge_vectors(P), axis=2).T
    s = (a + b + c) / 2
    np.testing.assert_allclose(face_areas(P), np.sqrt(s * (s - a) * (s - b) * (s - c)), rtol=1e-12)
    by_patch = np.bincount(SURFACE.patch_of_face, face_areas(P))
    np.testing.assert_allclose(patch_areas(SURFACE), by_patch, rtol=1e-14)


def test_angles_add_up_and_follow_the_law_of_sines():
    found = np.radians(angles(P))
    np.testing.assert_allclose(found.sum(axis=1), np.pi, rtol=1e-12)
    edges = np.linalg.norm(edge_vectors(P), axis=2)
    diameter = edges.prod(axis=1) / (2.0 * face_areas(P))
    np.testing.assert_allclose(edges / np.sin(found), diameter[:, None].repeat(3, 1), rtol=1e-9)
    flat = P[:, :, :2]
    upright = np.concatenate([flat, np.zeros_like(flat[:, :, :1])], axis=2)
    np.testing.assert_allclose(angles(flat), angles(upright), atol=1e-6)


def test_stars_are_sums_of_faces():
    vectors, areas = vertex_area_vectors(SURFACE.vertices, SURFACE.faces)
    expected = vertex_sums(area_vectors(P), SURFACE.faces, SURFACE.n)
    np.testing.assert_allclose(vectors, expected, atol=1e-14)
    assert areas.sum() == pytest.approx(3.0 * patch_areas(SURFACE).sum(), rel=1e-14)


def test_the_bounding_box():
    X = np.random.default_rng(0).standard_normal((40, 3))
    assert bounding_size(X) == pytest.approx(np.linalg.norm(np.ptp(X, axis=0)), rel=1e-15)
    assert bounding_size(X[:, :2]) == pytest.approx(np.hypot(*np.ptp(X[:, :2], axis=0)), rel=1e-15)
    assert bounding_size(X[:1]) == bounding_size(X[:0]) == 0.0


def test_three_vectors_are_those_of_numpy():
    a, b, c, d = (tuple(row) for row in np.random.default_rng(1).standard_normal((4, 3)).tolist())
    assert geometry.cross(a, b) == pytest.approx(np.cross(a, b), rel=1e-14)
    both = np.cross(a, b) + np.cross(c, d)
    assert geometry.cross_sum(a, b, c, d) == pytest.approx(both, rel=1e-13)
    assert geometry.dot(a, b) == pytest.approx(np.dot(a, b), rel=1e-14)
    assert geometry.norm(a) == pytest.approx(np.linalg.norm(a), rel=1e-15)
    assert geometry.sub(geometry.add(a, b), b) == pytest.approx(a, rel=1e-14)
    assert geometry.divided(geometry.scaled(2.0, a), 2.0) == a


def test_the_plane_cross_product_is_the_area_seen_from_above():
    turned = P @ rotation(3)
    u, v = turned[:, 1] - turned[:, 0], turned[:, 2] - turned[:, 0]
    np.testing.assert_allclose(cross_2d(u[:, :2], v[:, :2]), 2.0 * area_vectors(turned)[:, 2], atol=1e-15)
