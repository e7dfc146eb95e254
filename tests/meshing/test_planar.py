"""Plane meshes: they conform, keep their area, and their angles are good."""

import numpy as np
import pytest
from refusals import refused

from pcmc.base.errors import OptionError, SurfaceError
from pcmc.meshing.planar import locate, signed_areas, triangulate


def ring(corners, h):
    """Points along a closed polygon, about h apart."""
    corners = np.asarray(corners, dtype=float)
    parts = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        n = max(1, round(float(np.linalg.norm(b - a)) / h))
        parts.append(a + (b - a) * np.arange(n)[:, None] / n)
    return np.concatenate(parts)


def loop(n, first=0):
    k = np.arange(n)
    return first + np.stack([k, (k + 1) % n], axis=1)


def circle(centre, radius, n):
    angle = 2 * np.pi * np.arange(n) / n
    return np.asarray(centre) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def angles(mesh):
    p = mesh.points[mesh.triangles]
    u, v = p[:, [1, 2, 0]] - p, p[:, [2, 0, 1]] - p
    cosine = np.einsum("tij,tij->ti", u, v)
    return np.degrees(np.arccos(cosine / np.linalg.norm(u, axis=2) / np.linalg.norm(v, axis=2)))


def opposite_angles(mesh, but):
    """Sum of the two angles opposite each inner edge, one left out: at most 180° if Delaunay."""
    side = np.sort(mesh.triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    edge, place, count = np.unique(side, axis=0, return_inverse=True, return_counts=True)
    inner = (count == 2) & (edge != but).any(axis=1)
    return np.bincount(place.ravel(), angles(mesh).ravel())[inner]


def edges(mesh):
    return {
        tuple(sorted(map(int, edge))) for edge in mesh.triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)
    }


L_SHAPE = [[0, 0], [10, 0], [10, 5], [5, 5], [5, 10], [0, 10]]


def with_hole(h):
    rim, hole = ring(L_SHAPE, h), circle([2.5, 2.5], 1.3, round(2 * np.pi * 1.3 / h))
    return np.concatenate([rim, hole]), np.concatenate([loop(len(rim)), loop(len(hole), len(rim))])


@pytest.mark.parametrize("h", [1, 0.5, 0.25])
def test_an_l_with_a_hole(h):
    points, segments = with_hole(h)
    mesh = triangulate(points, segments, h, holes=[[2.5, 2.5]])
    n = len(segments) - len(ring(L_SHAPE, h))
    area = 75.0 - 0.5 * n * 1.3**2 * np.sin(2 * np.pi / n)
    triangle = signed_areas(mesh.points, mesh.triangles)
    assert triangle.sum() == pytest.approx(area, rel=1e-12)
    assert triangle.min() > 0.0
    np.testing.assert_array_equal(mesh.points[: len(points)], points)
    assert {tuple(sorted(map(int, s))) for s in segments} <= edges(mesh)
    assert angles(mesh).min() > 28.0
    lengths = [np.linalg.norm(mesh.points[a] - mesh.points[b]) for a, b in edges(mesh)]
    assert np.mean(lengths) == pytest.approx(h, rel=0.1)
    assert mesh.region.max() == 0


def test_the_same_input_gives_the_same_mesh():
    one, two = (triangulate(*with_hole(0.5), 0.5, holes=[[2.5, 2.5]]) for _ in range(2))
    np.testing.assert_array_equal(one.points, two.points)
    np.testing.assert_array_equal(one.triangles, two.triangles)


def test_segments_inside_cut_regions_and_dangling_ones_do_not():
    points = np.concatenate([ring([[0, 0], [4, 0], [4, 2], [0, 2]], 1.0), [[2, 1], [3, 1]]])
    bottom, top = 2, 8  # (2, 0) and (2, 2)
    split = np.concatenate([loop(12), [[bottom, 12], [12, top]]])
    mesh = triangulate(points, np.concatenate([split, [[12, 13]]]), 1.0)
    assert mesh.region.max() == 1
    left, right = locate(mesh, np.array([[0.5, 1.1], [3.5, 0.9]]))
    assert mesh.region[left] != mesh.region[right]
    assert (12, 13) in edges(mesh)
    areas = np.bincount(mesh.region, signed_areas(mesh.points, mesh.triangles))
    np.testing.assert_allclose(areas, [4.0, 4.0])
    assert locate(mesh, np.array([[9.0, 9.0]])).tolist() == [-1]


def test_a_segment_that_delaunay_leaves_out_is_put_in():
    """A long segment between two rows of points that are much nearer to each other."""
    x = np.linspace(0.5, 9.5, 19)
    row = np.stack([x, 0.1 + 0.01 * x * (10 - x)], axis=1)
    points = np.concatenate([[[0, 0]], row * [1, -1], [[10, 0]], row[::-1]])
    segments = np.concatenate([loop(40), [[0, 20]]])
    mesh = triangulate(points, segments, 50.0)
    assert (0, 20) in edges(mesh)
    assert mesh.region.max() == 1
    assert (opposite_angles(mesh, but=(0, 20)) <= 180.0 + 1e-9).all()
    x_, y_ = points.T
    area = 0.5 * np.sum(x_ * np.roll(y_, -1) - np.roll(x_, -1) * y_)
    assert signed_areas(mesh.points, mesh.triangles).sum() == pytest.approx(area)


def test_fine_segments_grade_the_mesh():
    rim, hole = ring([[0, 0], [10, 0], [10, 10], [0, 10]], 1.0), circle([5.1, 5], 0.4, 10)
    points = np.concatenate([rim, hole])
    segments = np.concatenate([loop(len(rim)), loop(10, len(rim))])
    mesh = triangulate(points, segments, 1.0, holes=[[5.1, 5.0]])
    assert angles(mesh).min() > 20.0
    assert len(mesh.triangles) < 500


@pytest.mark.parametrize(
    ("points", "segments", "h", "holes", "error", "fields"),
    [
        ([[0, 0], [1, 0], [0, 1]], loop(3), 1.0, [[5, 5]], OptionError, {"what": "holes", "where": 0}),
        ([[0, 0], [1, 0], [0, 1], [0, 1]], loop(4), 1.0, (), SurfaceError, {"where": (2, 3)}),
        ([[0, 0], [1, 0], [0, 1]], loop(3)[:2], 1.0, (), SurfaceError, {"found": 2, "expected": 3}),
        ([[0, 0], [1, 0], [2, 0]], loop(3), 1.0, (), SurfaceError, {"what": "points"}),
        ([[0, 0], [2, 2], [2, 0], [0, 2]], loop(4), 5.0, (), SurfaceError, {"what": "segments"}),
        (
            [[0, 0], [2, 0], [2, 2], [0, 2]],
            loop(4)[:3],
            5.0,
            (),
            SurfaceError,
            {"what": "segments", "where": None},
        ),
    ],
)
def test_bad_input_is_refused(points, segments, h, holes, error, fields):
    with refused(error, **fields):
        triangulate(np.array(points, dtype=float), segments, h, holes)


@pytest.mark.parametrize("h", [0.0, -1.0, np.nan, np.inf])
def test_an_edge_length_is_positive(h):
    with pytest.raises(OptionError, match="edge_length: expected a finite number > 0"):
        triangulate(np.array([[0, 0], [1, 0], [0, 1.0]]), loop(3), h)
