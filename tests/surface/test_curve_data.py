"""Curves as plain data, as spans of NURBS, and data that are none."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

from pcmc.base.errors import OptionError
from pcmc.plan import bezier, circle, curve, ellipse, join, polyline
from pcmc.plan.strokes import bezier_spans
from pcmc.surface.curve_data import curve_data
from pcmc.surface.curves import arc


def test_spans_of_a_nurbs_circle_are_on_the_circle():
    corner = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
    weights = np.array([1, 0.5**0.5] * 4 + [1])
    knots = np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4.0])
    spans = bezier_spans(2, knots, np.array(corner, dtype=float), weights)
    assert len(spans) == 4
    for points, w in spans:
        on_circle = bezier(points, w).at(np.linspace(0, 1, 9))
        np.testing.assert_allclose(np.linalg.norm(on_circle, axis=1), 1.0, rtol=1e-14)


@pytest.mark.parametrize(
    "path",
    [
        circle([3, 4], 2.0),
        ellipse([1, 2, 3], [[2, 0, 0], [0, 0, 1.5]], -200.0),
        ellipse([0, 0, 1], [[0, 2, 0], [0, 0, 2]]),
        bezier([[0, 0], [1, 3], [4, 0]], [1.0, 0.3, 2.0]),
        join(polyline([[0, 0], [8, 0]]), arc([8, 0], [10, 2], [8, 4]), polyline([[8, 4], [0, 4], [0, 0]])),
    ],
    ids=["circle", "arc of an ellipse", "upright circle", "rational", "joined"],
)
def test_plain_data_of_a_curve_give_it_again(path):
    again = curve(curve_data(path))
    t = np.linspace(0, len(path.pieces), 33)
    np.testing.assert_allclose(again.at(t), path.at(t), atol=1e-10)
    assert again.closed == path.closed
    np.testing.assert_allclose(path.reversed().at(t[::-1]), path.at(t), atol=1e-12)


def test_ellipses_are_refused_by_name():
    for spec, what in (
        ({"ellipse": {"centre": [0, 0]}}, "ellipse"),
        ({"ellipse": {"centre": [0, 0], "axes": [[1, 0], [2, 0]]}}, "ellipse"),
        ({"ellipse": {"centre": [0, 0, 3], "axes": [[1, 0], [0, 2]]}}, "ellipse"),
        ({"ellipse": {"centre": [0, 0], "axes": [[1, 0], [0, 2]], "sweep": 400}}, "ellipse"),
        ({"bezier": [[0, 0], [1, 1]], "weights": [1.0]}, "bezier"),
        ({"bezier": [[0, 0], [1, 1]], "weights": [1.0, -1.0]}, "bezier: weights"),
        ({"bezier": [[0, 0], [1, 1], [2, 0]], "weights": [1.0, 1e30, 1.0]}, "bezier"),
        ({"polyline": [[0, 0], [1, 1]], "weights": [1.0, 1.0]}, "weights"),
    ):
        with refused(OptionError, what=what):
            curve(spec)
