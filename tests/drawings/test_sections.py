"""Sections of a roof: exact points, and the sheets that show them."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import length

import pcmc
from generators import spherical_cap
from pcmc.drawings import drawing_set
from pcmc.drawings.sheet import SheetLine
from pcmc.drawings.views import ELEVATIONS, profile
from pcmc.surface.sections import section

UP = np.array([0.0, 0.0, 1.0])


def test_the_sections_of_a_sphere_come_near_its_circles_with_order_2():
    """At height h the cap of a sphere of radius r has a circle of radius √(r² - (h + d)²)."""
    errors = []
    for edge in (0.3, 0.15, 0.075):
        cap = pcmc.solve(spherical_cap(edge_length=edge)).surface
        top, rim = cap.vertices[:, 2].max(), np.linalg.norm(cap.vertices[:, :2], axis=1).max()
        radius = (top**2 + rim**2) / (2.0 * top)
        (line,) = section(cap, 0.5 * top * UP, UP)
        assert line.closed
        assert np.abs(line.points[:, 2] - 0.5 * top).max() <= 1e-14
        circle = np.sqrt(radius**2 - (0.5 * top - top + radius) ** 2)
        errors.append(abs(length(line.points, True) / (2.0 * np.pi * circle) - 1.0))
    assert 1.7 < np.log2(errors[0] / errors[-1]) / 2.0 < 2.3  # it swings: the plane cuts where it happens to


def test_every_point_of_a_section_is_on_an_edge_and_in_the_plane(squares):
    normal = np.array([0.6, 0.8, 0.0])
    topo, X = squares.topology, squares.vertices
    lines = section(squares, np.array([0.3, 0.1, 0.0]), normal)
    assert {line.patch for line in lines} == {0, 1, 2}  # the wall, too
    for line in lines:
        assert np.abs((line.points - [0.3, 0.1, 0.0]) @ normal).max() <= 1e-13
        a, b = X[topo.edges[:, 0]], X[topo.edges[:, 1]]
        for point in line.points:
            detour = np.linalg.norm(point - a, axis=1) + np.linalg.norm(point - b, axis=1)
            assert (detour - np.linalg.norm(b - a, axis=1)).min() <= 1e-12


def test_a_plane_through_vertices_gives_one_line_per_patch_and_one_at_the_rim_none(squares):
    lines = section(squares, np.zeros(3), np.array([0.0, 1.0, 0.0]))
    assert sorted(line.patch for line in lines if line.patch < 2) == [0, 1]
    left = next(line for line in lines if line.patch == 0)
    assert sorted({float(left.points[0, 0]), float(left.points[-1, 0])}) == pytest.approx([-4.0, 0.0])
    assert (np.linalg.norm(np.diff(left.points, axis=0), axis=1) > 0.0).all()
    assert section(squares, np.zeros(3), UP) == []


def test_sections_are_at_quarters_of_the_height_and_through_the_middle_or_along_a_line():
    """Of a pyramid over 2 ≤ x ≤ 4, 5 ≤ y ≤ 7, with its tip at (3.5, 6, 3), 2 above its base."""
    X = [[4, 7, 1], [2, 7, 1], [2, 5, 1], [4, 5, 1], [3.5, 6, 3]]
    F = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    roof = pcmc.Surface(X, F, [0] * 4, [pcmc.Patch("roof", 1.0)], fixed=range(4))

    def texts(found):
        sheet = next(sheet for sheet in found.sheets if sheet.title == "Sections along lines")
        return {text.text for text in sheet.drawn()[1]}

    usual = drawing_set(roof, "m", sheet="A3", anyway=True)
    *level, along_x, along_y = usual.sections
    for line, z, side in zip(level, (1.5, 2.0, 2.5), (1.5, 1.0, 0.5), strict=True):
        assert line.closed
        np.testing.assert_allclose(line.points[:, 2], z)
        np.testing.assert_allclose(np.ptp(line.points[:, :2], axis=0), side)
    np.testing.assert_allclose(sorted(along_x.points.tolist()), [[2, 6, 1], [3.5, 6, 3], [4, 6, 1]])
    np.testing.assert_allclose(sorted(along_y.points[[0, -1]].tolist()), [[3, 5, 1], [3, 7, 1]])
    assert texts(usual) >= {"from (2, 6) towards (4, 6)", "from (3, 5) towards (3, 7)", "2.000", "+2.333"}
    diagonal = drawing_set(roof, "m", sheet="A3", anyway=True, lines=[((2.9, 5.9), (3.1, 6.1))])
    assert texts(diagonal) >= {"2.828", "+2.600"}


def test_a_usual_section_between_two_roofs_is_left_out():
    X = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]])
    F = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    two = pcmc.Surface(
        [*X, *(X + np.array([4, 0, 0]))],
        [*F, *(F + 5)],
        [0] * 8,
        [pcmc.Patch("roofs", 1.0)],
        fixed=[*range(4), *range(5, 9)],
    )
    found = drawing_set(two, "m", sheet="A3", anyway=True).sections
    assert [line.points[0, 1] for line in found if np.ptp(line.points[:, 1]) == 0.0] == [0.0, 0.0]


def test_an_elevation_shows_what_faces_the_viewer_with_right_on_the_right():
    axes = {"x": np.array([1.0, 0.0, 0.0]), "y": np.array([0.0, 1.0, 0.0])}
    for title, (right, towards) in ELEVATIONS.items():
        looks = axes[title[-1]] * (1.0 if "along" in title else -1.0)
        assert np.array_equal([*towards, 0.0], -looks)
        assert np.array_equal([*right, 0.0], np.cross(looks, UP))


def test_a_section_is_dimensioned_between_its_ends_or_its_widest_points():
    arch = np.array([[1.0, 2.0, 0.0], [2.0, 2.0, 1.5], [4.0, 2.0, 0.5]])
    ring = np.array([[6.0, 2.0, 1.0], [7.0, 2.0, 2.0], [8.0, 2.0, 1.0], [7.0, 2.0, 0.0]])
    lines = [SheetLine(arch, "PCMC-SECTION"), SheetLine(ring, "PCMC-SECTION", closed=True)]
    view = profile("A", np.array([1.0, 0.0]), np.array([1.0, 0.0]), lines)
    assert sorted(view.stations[0]) == [0.0, 3.0, 5.0, 7.0]
    assert sorted(set(view.levels)) == [0.0, 0.5, 1.0, 2.0]
