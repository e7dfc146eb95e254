"""Curves, heat maps and convergence diagrams."""

import numpy as np
import pandas as pd
from pictures import near
from PIL import Image

from pcmc import plot
from pcmc.plot.curves import add_legend, new_axes
from pcmc.plot.figure import CURVES
from pcmc.surface.colours import rgb


def test_curves(tmp_path):
    steps = np.arange(50)
    frame = pd.DataFrame({"evaluation": 2 * steps, "energy": -1.0 + 0.9**steps})
    frame["gradient_squared"] = 0.5**steps
    frame.loc[10, "energy"] = np.nan
    frames = {"with": frame, "without": frame[:20]}
    for name, options in {
        "energy.png": {},
        "forces.png": {"y": "gradient_squared", "x": "evaluation", "label": "‖∇E‖²"},
    }.items():
        image = plot.histories(frames, tmp_path / name, **options)
        assert near(image, rgb("#0072B2")).any()
        assert near(image, rgb("#D55E00")).any()


def test_a_heatmap_shows_values_marks_and_gaps(tmp_path):
    table = np.array([[1.0, 10.0, np.nan], [-1.0, 1e-3, 1e3]])
    crosses = {"a": np.array([[False, False, False], [False, False, True]])}
    options = {"log": True, "label": "m", "xlabel": "α", "ylabel": "β"}
    plain, marked = (
        plot.heatmap([1, 2, 4], [1, 3], {"a": table}, tmp_path / "h.png", marks=m, **options)
        for m in (None, crosses)
    )
    assert np.array_equal(np.asarray(Image.open(tmp_path / "h.png").convert("RGB")), marked)
    grey = near(plain, rgb("#D9D9D9"), 0.01)
    rows, columns = np.flatnonzero(grey.any(axis=1)), np.flatnonzero(grey.any(axis=0))
    wide = np.ptp(columns) / 3
    at = [
        (rows.min() + (2 * r + 1) * np.ptp(rows) // 4, columns.min() + (2 * c + 1) * np.ptp(columns) // 6)
        for r in range(2)
        for c in range(3)
    ]
    assert [bool(grey[place]) for place in at] == [True, False, False, False, False, True]
    y, x = np.nonzero((plain != marked).any(axis=2))
    assert abs(x.mean() - at[2][1]) < 0.1 * wide
    assert abs(y.mean() - at[2][0]) < 0.1 * wide


def test_convergence_shows_the_slope(monkeypatch):
    labels = []
    monkeypatch.setattr(
        plot.curves, "add_legend", lambda axes, _: labels.extend(axes.get_legend_handles_labels()[1])
    )
    h = np.array([1.0, 0.5, 0.25])
    plot.convergence({"E": (h, 0.3 * h**2)})
    assert labels == ["E: slope 2.00"]


def test_curves_on_each_other_are_all_seen_with_dashes():
    x = np.linspace(0.0, 1.0, 50)
    curves = dict.fromkeys(("below", "above"), (x, x))
    colors = [rgb(color) for color in CURVES[:2]]
    plain, dashed = (plot.lines(curves, dashes=d)[:, 200:700] for d in (False, True))
    below, above = ([near(i, c).sum() for c in colors] for i in (plain, dashed))
    assert below[0] < 0.02 * below[1]
    assert 0.2 < above[0] / above[1] < 6.0


def test_levels_go_across_and_short_logarithmic_axes_have_round_ticks(monkeypatch):
    seen = []
    monkeypatch.setattr(plot.curves, "add_legend", lambda axes, _: seen.append(axes))
    plot.lines({"a": ([0.5, 1.5], [1, 2])}, xscale="log", levels={"bound": 1.5})
    (axes,) = seen
    assert axes.get_legend_handles_labels()[1] == ["a", "bound"]
    assert axes.lines[1].get_xydata()[:, 1].tolist() == [1.5, 1.5]
    ticks = [label.get_text() for label in axes.get_xticklabels()]
    assert ticks == ["0.5", "0.6", "0.8", "1", "1.5"]
    plot.lines({"a": ([0.001, 1.5], [1, 2])}, xscale="log")
    assert len(seen[1].get_xticks(minor=True))


def test_a_curve_with_a_fit_is_points_and_the_fit_a_line_of_its_colour(monkeypatch):
    seen = []
    monkeypatch.setattr(plot.curves, "add_legend", lambda axes, _: seen.append(axes))
    plot.lines({"a": ([1, 2], [1, 2])}, markers=True, fits={"a": ([1, 1.5, 2], [1, 1.4, 2])})
    points, fit = seen[0].lines
    assert (points.get_linestyle(), fit.get_linestyle()) == ("None", "-")
    assert points.get_color() == fit.get_color()
    assert seen[0].get_legend_handles_labels()[1] == ["a"]


def test_a_legend_that_would_cover_a_curve_is_beside_the_axes():
    xs = np.linspace(0.0, 1.0, 200)
    for curves, beside in (
        ({"a": 0.0 * xs, "b": 0.1 * xs}, False),
        ({"a": np.sin(300.0 * xs), "b": xs}, True),
    ):
        figure, axes = new_axes(400, 300, "", "x", "y")
        for label, ys in curves.items():
            axes.plot(xs, ys, label=label)
        add_legend(axes, len(curves))
        assert (axes.get_legend() is None) == beside == bool(figure.legends)
