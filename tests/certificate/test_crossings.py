"""Surfaces that cut themselves: which triangles cross, and what pcmc reports."""

import re
from itertools import combinations

import numpy as np
import pytest
from shapes import bubbles

import generators
import pcmc
from pcmc import Patch, Plane, Surface, cli
from pcmc.certificate.crossings import crossing_pairs, crossing_table

SHAPES = [
    *(
        "two_squares",
        "two_caps",
        "four_fans",
        "bezier_hall",
        "three_patches",
        "double_bubble",
        "spherical_cap",
    ),
    *("joined_caps", "catenoid", "enneper", "lens"),
]


def goes_through(one, other):
    """Whether a side of a triangle (3,3) goes through another."""
    a, b, c = other
    for p, q in zip(one, np.roll(one, 1, axis=0), strict=True):
        t, u, v = np.linalg.solve(np.column_stack([q - p, a - b, a - c]), a - p)
        if 0.0 < t < 1.0 and u > 0.0 and v > 0.0 and u + v < 1.0:
            return True
    return False


@pytest.mark.parametrize("count", [1, 4, 5, 90])
def test_the_pairs_are_those_of_every_pair_tried(count):
    corners = np.random.default_rng(count).normal(size=(count, 3, 3))
    faces = np.arange(3 * count).reshape(-1, 3)
    soup = Surface(corners.reshape(-1, 3), faces, [0] * count, [Patch("a", 1.0)], fixed=range(3 * count))
    expected = [
        (i, j)
        for i, j in combinations(range(count), 2)
        if goes_through(corners[i], corners[j]) or goes_through(corners[j], corners[i])
    ]
    assert [tuple(pair) for pair in crossing_pairs(soup).tolist()] == expected
    assert count < 90 or len(expected) > 500


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_two_bubbles_cut_each_other_where_they_are_near(size):
    rim = 2.0 * generators.spherical_cap(0.25).vertices[:, 0].max()
    near = pcmc.certify(bubbles(0.9 * rim, size))
    assert near.certified
    (row,) = near.crossings.to_dict("records")
    assert (row["patch"], row["other"]) == ("west", "east")
    assert row["x"] == pytest.approx(0.45 * rim * size, abs=0.25 * size)
    assert abs(row["y"]) < 0.3 * size
    assert "cuts itself  'west' cuts 'east' near (" in near.text()
    assert not re.search(r"e-1[0-9]", near.text().partition("support name")[2])  # zero forces are shown as 0
    apart = pcmc.certify(bubbles(1.01 * rim, size))
    assert not apart.cuts_itself
    assert "cuts itself" not in apart.text()


@pytest.mark.parametrize("name", [name for name in SHAPES if hasattr(generators, name)])
def test_shapes_that_touch_themselves_along_junctions_and_planes_do_not_cut_themselves(name):
    start = getattr(generators, name)()
    for surface in (start, pcmc.solve(start, iterations=30).surface):
        assert not len(crossing_pairs(surface))


def test_a_part_that_goes_through_its_mirror_plane_cuts_its_image():
    mirror = Plane((0, 0, 0), (1, 0, 0), mirror=True)
    X = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1, 1, 1.0]])
    faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    tent = Surface(X, faces, [0] * 4, [Patch("tent", 1.0)], fixed=[1, 2], on_planes=[(mirror, [0, 3])])
    assert not len(crossing_table(tent))
    leaning = tent.moved(X - [[0], [0], [0], [0], [1.5]] * np.array([1, 0, 0]))
    assert crossing_table(leaning)[["patch", "other"]].to_numpy().tolist() == [["tent", str(mirror)]]


def test_the_command_says_that_a_roof_cuts_itself(tmp_path, capsys):
    rim = 2.0 * generators.spherical_cap(0.25).vertices[:, 0].max()
    pcmc.write(tmp_path / "near.pcmc", bubbles(0.9 * rim))
    assert cli.main(["solve", str(tmp_path / "near.pcmc")]) == 0
    assert "not to be built as it is: 'west' cuts 'east' near (" in capsys.readouterr().out
