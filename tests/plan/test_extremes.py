"""Curves of a plan keep their size in the mesh: their farthest points along x and y are vertices."""

import math

import numpy as np
import pytest

from pcmc.meshing.remeshing import remesh
from pcmc.plan import Hole, Plan, arc, bezier, circle, ellipse, join, polyline
from pcmc.surface import Plane

APSE = arc([25, 0], [30, 5], [25, 10])
NAVE = join(polyline([[0, 10], [0, 0], [25, 0]]), APSE, polyline([[25, 10], [0, 10]]))
HALF_DEGREES = np.radians(np.arange(0.0, 360.0, 0.5))
AROUND = np.column_stack([1.0 + 3.0 * np.cos(HALF_DEGREES), 2.0 + 3.0 * np.sin(HALF_DEGREES)])
WAVE = 0.5 - math.sqrt(1.0 / 12.0)


def rim(surface):
    """(k,2) the vertices of the boundary, in plan."""
    topo = surface.topology
    return surface.vertices[np.unique(topo.edges[topo.boundary_edge]), :2]


def built(outline, edge_length, **more):
    return Plan(outline, tension=20.0, edge_length=edge_length, **more).surface()


def box(points):
    return np.concatenate([points.min(axis=0), points.max(axis=0)])


def is_mirrored(points, axis, middle):
    """Whether the points (k,2) are symmetric about the line where a coordinate is ``middle``."""
    other = points.copy()
    other[:, axis] = 2.0 * middle - other[:, axis]
    return np.linalg.norm(points[:, None] - other, axis=2).min(axis=1).max() < 1e-9


def tilted(a, b, degrees):
    """An ellipse of half axes a and b turned about the origin, and the corner of its bounding box."""
    turn = math.radians(degrees)
    axes = np.array([[a * math.cos(turn), a * math.sin(turn)], [-b * math.sin(turn), b * math.cos(turn)]])
    return ellipse([0, 0], axes), np.hypot(*axes)


@pytest.mark.parametrize("edge_length", [0.7, 1.0, 1.3, 2.1])
def test_a_nave_with_an_apse_is_as_long_as_drawn_and_symmetric(edge_length):
    points = rim(built(NAVE, edge_length))
    np.testing.assert_allclose(box(points), [0, 0, 30, 10], atol=1e-12)
    assert is_mirrored(points, 1, 5.0)


@pytest.mark.parametrize("edge_length", [0.3, 0.7, 1.0, 1.3, 5.0])
@pytest.mark.parametrize(
    "outline",
    [
        circle([1, 2], 3),
        join(arc([4, 2], [1, 5], [-2, 2]), arc([-2, 2], [1, -1], [4, 2])),  # joined where it is farthest
        join(*(arc(*AROUND[[k, k + 1, (k + 2) % 720]]) for k in range(0, 720, 2))),  # of 1 degree each
        join(arc([3.4, 3.8], [1, 5], [-1.4, 3.8]), arc([-1.4, 3.8], [1, -1], [3.4, 3.8])),
    ],
    ids=["circle", "two halves", "many arcs", "two arcs"],
)
def test_a_circle_is_as_wide_as_drawn_and_symmetric(outline, edge_length):
    points = rim(built(outline, edge_length))
    np.testing.assert_allclose(box(points), [-2, -1, 4, 5], atol=1e-12)
    steps = np.linalg.norm(np.diff(points[np.argsort(np.arctan2(*(points - [1, 2]).T))], axis=0), axis=1)
    assert steps.max() < 1.2 * steps.min()
    assert is_mirrored(points, 0, 1.0)
    if len({round(piece.sweep, 9) for piece in outline.pieces}) == 1:
        assert is_mirrored(points, 1, 2.0)  # drawn so


@pytest.mark.parametrize("degrees", [0.0, 30.0, 77.0])
def test_an_ellipse_is_as_wide_as_drawn(degrees):
    outline, corner = tilted(5.0, 2.0, degrees)
    points = rim(built(outline, 0.8))
    np.testing.assert_allclose(box(points), [*-corner, *corner], atol=1e-12)
    if not degrees:
        assert is_mirrored(points, 0, 0.0)
        assert is_mirrored(points, 1, 0.0)


@pytest.mark.parametrize(
    ("curve", "height", "places"),
    [
        (bezier([[0, 0], [0, 4], [8, 4], [8, 0]]), 3.0, [0.5]),
        (bezier([[0, 0], [4, 6], [8, 0]], weights=[1e-7, 2e-7, 1e-7]), 4.0, [0.5]),
        (bezier([[8, 0], [6, -3], [2, 3], [0, 0]]), math.sqrt(0.75), [WAVE, 1.0 - WAVE]),
    ],
    ids=["cubic", "rational", "wave"],
)
def test_bezier_curves_are_farthest_where_their_derivative_is_zero(curve, height, places):
    assert curve.extremes == pytest.approx(places, abs=1e-14)
    assert np.abs(curve.at(curve.extremes)[:, 1]) == pytest.approx(height, abs=1e-13)


def test_points_that_are_not_farthest_get_no_vertex():
    """Straight lines, the joint of a line and an arc, an inflexion, the ends of open curves."""
    fillet = join(polyline([[0, 0], [2, 0]]), arc([2, 0], [2 + math.sqrt(0.5), 1 - math.sqrt(0.5)], [3, 1]))
    inflexion = bezier([[0, 0], [1, 1], [1, -1], [1, 0], [2, 1]])
    assert fillet.extremes.tolist() == []
    assert polyline([[0, 0], [3, 1], [0, 2]]).extremes.tolist() == []
    assert 0.0 not in inflexion.extremes
    s = bezier([[0, 0], [0, 1], [1, 1], [1, 2]])
    assert s.extremes.tolist() == []


def test_a_kink_between_curves_may_be_farthest():
    low = math.radians(4.0)
    side = [math.cos(low), -math.sin(low)]
    one = arc([-2 * side[0], 2 * side[1]], [-side[0], side[1] + 0.05], [0, 0.2])
    path = join(one, polyline([[0, 0.2], [2, 0.1]]))
    assert 1.0 in path.extremes.tolist()


def test_holes_and_dividers_are_as_wide_as_drawn():
    outline, ring = [[0, 0], [24, 0], [24, 10], [0, 10]], arc([12, 0], [14, 5], [12, 10])
    surface = Plan(
        outline, [ring], [Hole(circle([19, 5], 2.0))], tension=20.0, edge_length=0.7
    ).surface()  # 18 equal edges around the hole would leave out its top
    points = rim(surface)
    hole = points[np.linalg.norm(points - [19, 5], axis=1) < 2.1]
    np.testing.assert_allclose(box(hole), [17, 3, 21, 7], atol=1e-12)
    junction = np.concatenate([c.vertices for c in surface.topology.junctions])
    assert surface.vertices[junction, 0].max() == pytest.approx(14.0, abs=1e-12)


def test_no_short_edges_arise_beside_other_stops():
    """A divider meets the apse a fifth of an edge beside its crown: the mesh keeps the divider's point."""
    height = 5.2
    place = [25 + math.sqrt(25 - (height - 5) ** 2), height]
    surface = Plan(NAVE, [[[0, 5], place]], tension=20.0, edge_length=1.0).surface()
    points = rim(surface)
    assert np.linalg.norm(points - place, axis=1).min() < 1e-12
    assert np.linalg.norm(points - [30, 5], axis=1).min() > 0.1
    near = points[points[:, 0] > 25.1]
    order = near[np.argsort(near[:, 1])]
    assert np.linalg.norm(np.diff(order, axis=0), axis=1).min() > 0.7


def test_the_axes_are_those_of_the_drawing_on_a_tilted_plane():
    plane = Plane((1, 2, 3), (1, -1, 2))
    surface = Plan(NAVE, tension=20.0, edge_length=1.3, plane=plane).surface()
    np.testing.assert_allclose(box(plane.to_local(surface.vertices)[:, :2]), [0, 0, 30, 10], atol=1e-12)


def test_remeshing_keeps_the_size():
    pytest.importorskip("mmgpy")
    fine = remesh(built(NAVE, 1.3), 0.9)
    np.testing.assert_allclose(box(rim(fine)), [0, 0, 30, 10], atol=1e-12)
