"""Curves: closed forms of length and position, joints, and curves from plain data."""

import numpy as np
import pytest
from refusals import refused

from pcmc import Plane
from pcmc.base.errors import OptionError
from pcmc.surface.curve_data import curve
from pcmc.surface.curves import arc, bezier, circle, join, polyline
from pcmc.surface.pieces import to_local, to_space


def test_lengths_in_closed_form():
    assert polyline([[0, 0], [3, 0], [3, 4]], closed=True).length == pytest.approx(12.0)
    assert circle([1, 2], 3.0).length == pytest.approx(6 * np.pi, rel=5e-4)
    assert arc([2, 0], [0, 2], [-2, 0]).length == pytest.approx(2 * np.pi, rel=5e-4)
    parabola = bezier([[0, 0], [1, 2], [2, 0]])  # y = 2x - x²
    exact = np.sqrt(5) + np.arcsinh(2) / 2
    assert parabola.length == pytest.approx(exact, rel=5e-4)


def test_points_lie_on_the_curve_to_rounding():
    c = circle([1, 2], 3.0)
    points = c.at(c.between(0.0, 1.0, 0.5))
    np.testing.assert_allclose(np.linalg.norm(points - [1, 2], axis=1), 3.0, rtol=1e-14)
    t = np.linspace(0, 1, 7)
    cubic = bezier([[0, 0, 1], [1, 2, 0], [3, -1, 2], [4, 1, 5]])
    weights = np.stack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3], axis=1)
    exact = weights @ [[0, 0, 1], [1, 2, 0], [3, -1, 2], [4, 1, 5]]
    np.testing.assert_allclose(cubic.at(t), exact, atol=1e-14)


@pytest.mark.parametrize(
    ("start", "through", "end", "angle"),
    [
        ([1, 0], [0, 1], [-1, 0], np.pi),
        ([1, 0], [0, -1], [-1, 0], np.pi),  # clockwise
        ([1, 0], [-1, 0], [0, -1], 1.5 * np.pi),
        ([1, 0, 0], [0, 0, 1], [-1, 0, 0], np.pi),  # upright
    ],
)
def test_arcs_pass_their_three_points(start, through, end, angle):
    path = arc(start, through, end)
    np.testing.assert_allclose(path.at([0.0, 1.0]), [start, end], atol=1e-14)
    distance = np.linalg.norm(path.at(np.linspace(0, 1, 3601)) - through, axis=1)
    assert distance.min() < 1e-3
    assert path.length == pytest.approx(angle, rel=5e-4)


def test_spacing_is_even_and_bends_get_enough_edges():
    line = polyline([[0, 0], [10, 0]])
    np.testing.assert_allclose(np.diff(line.between(0.0, 1.0, 3.0)), 1 / 3)
    assert len(circle([0, 0], 0.01).between(0.0, 1.0, 1.0)) == 7  # an edge per 45°
    ring = polyline([[0, 0], [4, 0], [4, 4], [0, 4]], closed=True)
    around = ring.at(ring.between(3.0, 5.0, 1.0))  # over the closing point: the sides at x = 0, y = 0
    assert (around.min(axis=1) == 0.0).all()
    assert len(around) == 7


def test_corners_are_turns_above_ten_degrees():
    angle = np.radians([0, 0, 5, 5, 40])
    path = polyline(np.cumsum(np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0))
    assert path.corners.tolist() == [3.0]
    tangent = join(polyline([[0, 0], [1, 0]]), arc([1, 0], [2, 1], [1, 2]))
    assert tangent.corners.tolist() == []


def test_reversed_runs_backwards():
    path = join(polyline([[0, 0], [2, 0]]), arc([2, 0], [1, 1], [0, 0]))
    t = np.linspace(0, 2, 9)
    np.testing.assert_allclose(path.reversed().at(2.0 - t), path.at(t), atol=1e-14)


def test_plane_coordinates_there_and_back():
    plane = Plane((1, 2, 3), (1, -2, 2))
    points = np.random.default_rng(0).normal(size=(5, 3))
    local = to_local(points, plane)
    np.testing.assert_allclose(local[:, 2], plane.height(points), atol=1e-14)
    np.testing.assert_allclose(to_space(local, plane), points, atol=1e-14)
    np.testing.assert_array_equal(Plane().axes, np.eye(3))
    on_plane = circle([0, 0], 2.0).local(plane).at([0.3])
    assert on_plane[0, 2] == 0.0
    in_space = circle([1, 2, 3], 2.0)
    np.testing.assert_allclose(
        to_space(in_space.local(plane).at([0.3]), plane), in_space.at([0.3]), atol=1e-14
    )


def test_curves_from_plain_data():
    assert curve([[0, 0], [1, 0], [0, 1]], closed=True).closed
    assert not curve([[0, 0], [1, 0], [0, 1]]).closed
    assert curve([[0, 0], [1, 0], [0, 1], [0, 0]]).closed
    path = curve([{"bezier": [[0, 0], [1, 1], [2, 0]]}, {"polyline": [[2, 0], [0, 0]]}])
    assert path.closed
    assert curve(path) is path
    assert curve({"polyline": [[0, 0], [1, 0], [0, 1]], "closed": True}).closed


LINE, BEND = [[0, 0], [1, 0]], {"bezier": [[0, 0], [1, 1]]}


@pytest.mark.parametrize(
    ("spec", "fields"),
    [
        ([[0, 0]], {"what": "polyline", "found": 1, "expected": 2}),
        ([[0, 0], [0, 0]], {"what": "polyline", "where": 0}),
        ([[0, 0], [1, np.nan]], {"what": "polyline", "where": 1}),
        ([[0, 0], [1]], {"what": "polyline", "found": [[0, 0], [1]]}),
        ([[0, 0, 0, 0], [1, 1, 1, 1]], {"what": "polyline", "found": (2, 4)}),
        ("outline", {"what": "polyline", "found": "outline"}),
        ({"spline": [[0, 0], [1, 1]]}, {"what": "curve", "found": "spline"}),
        ({"arc": [[0, 0], [1, 1]]}, {"what": "arc", "found": 2, "expected": 3}),
        ({"arc": [[0, 0], [1, 1], [2, 2]]}, {"what": "arc", "found": None}),
        ({"circle": {"centre": [0, 0]}}, {"what": "circle", "found": {"centre": [0, 0]}}),
        ({"bezier": [[1, 1], [1, 1]]}, {"what": "bezier"}),
        ({"bezier": [[0, 0], [1, 1]], "closed": True}, {"what": "closed"}),
        ({"bezier": [[0, 0], [1, 1]], "arc": []}, {"what": "curve", "found": ["bezier", "arc"]}),
        ([{"polyline": LINE}, {"polyline": [[2, 0], [1, 1]]}], {"what": "join", "where": 1}),
        ([{"polyline": LINE}, {"polyline": [[1, 0, 0], [1, 1, 0]]}], {"what": "join", "where": None}),
        ([{"circle": {"centre": [0, 0], "radius": 1}}, BEND], {"what": "join", "where": 0}),
    ],
)
def test_bad_curves_are_refused(spec, fields):
    with refused(OptionError, **fields):
        curve(spec)


def test_an_unknown_curve_has_a_hint():
    with pytest.raises(OptionError, match=r"a list of them, without join: .{polyline = \.\.\.}, {arc"):
        curve({"join": [{"polyline": [[0, 0], [4, 0]]}, {"arc": [[4, 0], [2, 3], [0, 0]]}]})
    with pytest.raises(OptionError, match="radius stands in the table of its curve"):
        curve({"circle": [5, 3], "radius": 1})
    with pytest.raises(OptionError, match="unknown curve 'circl'; did you mean 'circle'"):
        curve({"circl": {}})


@pytest.mark.parametrize("radius", [-1.0, 0, np.inf, "x"])
def test_a_radius_is_positive(radius):
    with pytest.raises(OptionError, match="circle: radius: expected a finite number > 0"):
        circle([0, 0], radius)


def test_a_closed_polyline_needs_three_points():
    with refused(OptionError, what="polyline", found=2, expected=3):
        polyline([[0, 0], [1, 0]], closed=True)
    with refused(OptionError, what="join"):
        join()
