"""The study of ends: fits with their uncertainty, labels, supports; Example 1 beside what theory says."""

import math

import numpy as np
import pytest

from generators import four_fans, three_patches, two_caps, two_squares
from pcmc.solvers import solve_once
from studies.corners import ends as corners
from studies.corners import ladder
from studies.corners.cases import CASES
from studies.corners.ladder import LOST, PERSISTS, SADDLE, SINKS, TURNS


def rows(values, **more):
    """Rows of a ladder with these lowest eigenvalues, each on half the edge length."""
    shared = {"status": "converged", "pinched": 0, "index": 0, "walls_quality": 0.5}
    return [
        {**shared, "eigenvalue": value, "edge_length": 0.5**level, **more}
        for level, value in enumerate(values)
    ]


def test_the_law_of_lost_hold_is_fitted_with_its_uncertainty():
    """In 40 ladders with noise the interval of the limit contains it in at least 34: 95 % of 40 is 38."""
    depth = math.log(2.0) * np.arange(10)
    exact = ladder.law(depth, -0.3, 2.0, 1.5)
    found = ladder.loss(rows(exact))
    assert [found[key] for key in ("limit", "loss", "shift")] == pytest.approx([-0.3, 2.0, 1.5], rel=1e-4)
    random, inside = np.random.default_rng(0), 0
    for _ in range(40):
        found = ladder.loss(rows(exact + 1e-3 * random.standard_normal(10)))
        inside += abs(found["limit"] + 0.3) <= found["limit_margin"]
    assert inside >= 34


def test_no_fit_from_few_levels_or_where_the_junction_rests():
    assert math.isnan(ladder.loss(rows(np.arange(6.0)))["limit"])
    assert ladder.loss(rows(np.arange(10.0), pinched=1))["fitted"] == 0


def test_labels():
    good = rows([1.0, 1.0])
    assert ladder.label(good, 1, "sliding") == PERSISTS
    assert ladder.label([good[0], good[1] | {"index": 2}], 1, "sliding") == TURNS
    assert ladder.label([row | {"index": 2} for row in good], 1, "sliding") == SADDLE
    lost = good[1] | {"status": "degenerate"}
    assert ladder.label([good[0], lost], 1, "sliding") == LOST
    assert ladder.label([good[0], lost | {"walls_quality": 1e-5}], 1, "held") == SINKS


@pytest.mark.nightly
def test_ends_and_the_angle_of_the_outline_there():
    for build, count, angle in ((two_squares, 2, 180.0), (four_fans, 4, 180.0), (three_patches, 3, 180.0)):
        surface = build()
        found = ladder.ends(surface)
        assert len(found) == count
        for vertex in found:
            assert ladder.opening(surface, int(vertex)) == pytest.approx(angle, abs=10.0)
    assert ladder.opening(two_caps(0.2), int(ladder.ends(two_caps(0.2))[0])) == pytest.approx(284.4, abs=3.0)


def test_ends_slide_along_a_straight_outline_only():
    square = ladder.free_ends(two_squares(4))
    assert len(square.on_line) == 2
    X = square.vertices
    for line, along in square.on_line:
        assert abs(line.direction[0]) == 1.0
        np.testing.assert_allclose(np.sort(X[along, 0]), np.arange(-3, 4))
    assert not ladder.free_ends(two_caps(1.2)).on_line


def test_the_crest_of_example_1_rises_as_on_a_quarter_plane():
    """dz/ds = A + c - c log(1/s) with c = α_w / (π α), within the fit's own interval and 10 %."""
    found, shapes = ladder.climb(two_squares(8, alpha_aux=0.5), 6, 1.3, "held")
    reached = shapes[-1]
    assert len(found) == 7
    edge = found[-1]["edge_length"]
    fitted = ladder.rise(reached, int(ladder.ends(two_squares(8))[0]), 3.0 * edge, 0.2)
    assert fitted["c"] == pytest.approx(0.5 / (2.0 * math.pi), abs=fitted["c_margin"] + 0.008)
    assert 0.0 < fitted["rest"] < 1e-3


def test_what_the_mesh_holds_goes_to_what_a_sliding_end_shows():
    """Example 1, wall 1: the lowest eigenvalue falls through 0 towards the one with natural ends."""
    initial = two_squares(8, alpha_aux=1.0)
    held, _ = ladder.climb(initial, 4, 1.3, "held")
    sliding, _ = ladder.climb(initial, 7, 1.3, "sliding")
    natural, _ = ladder.climb(initial, 3, 1.3, "natural")
    assert ladder.label(sliding, 7, "sliding") == TURNS
    assert ladder.label(natural, 3, "natural") == SADDLE
    assert ladder.label(held, 4, "held") == PERSISTS
    assert (np.diff([row["eigenvalue"] for row in sliding[:7]]) < 0.0).all()
    assert sliding[-1]["pinched"] > 0
    assert sliding[-1]["eigenvalue"] == pytest.approx(natural[-1]["eigenvalue"], rel=0.25)
    assert held[-1]["eigenvalue"] == pytest.approx(held[-2]["eigenvalue"], rel=1e-3)


@pytest.mark.nightly
def test_a_level_solved_anew_has_the_same_shape_with_its_vertices_elsewhere():
    """Example 1, wall 1, held: the energy's step at level 6 is the mesh's, and goes with h²."""
    initial = two_squares(8, alpha_aux=1.0)
    rows, reached = ladder.climb(initial, 6, corners.REACH * initial.size, "held")
    assert [row["anew"] for row in rows] == [False] * 6 + [True]
    assert max(row["slid"] for row in rows[1:6]) < 0.05 < rows[6]["slid"]
    (found,) = ladder.halved(rows, reached, "held")
    assert (found["level"], found["anew"]) == (6, True)
    assert found["step_halved"] == pytest.approx(found["step"] / 4.0, rel=0.3)
    assert ladder.halved(rows[:6], reached[:7], "held") == []  # steps of less and less


@pytest.mark.nightly
def test_a_case_of_the_grid_with_its_bottoms_held_and_sliding():
    held, sliding = (corners.grid_case([1.5, 6.0, 6.0], bottom) for bottom in ("held", "sliding"))
    assert (held["label"], held["levels"], held["index"]) == (PERSISTS, 6, 0)
    assert (sliding["label"], sliding["index"]) == (LOST, 0)
    assert 2 <= sliding["levels"] <= 6


def test_held_bottoms_are_held():
    surface = ladder.hold_bottoms(two_squares(4))
    assert not surface.on_plane.any()
    assert solve_once(surface, "newton").converged


def test_ends_slide_along_a_round_outline():
    for build, radius in ((four_fans, 20.0), (three_patches, 10.0)):
        ((circle, along),) = ladder.free_ends(build()).on_line
        assert circle.radius == pytest.approx(radius, rel=1e-12)
        assert along[ladder.ends(build())].all()


@pytest.mark.nightly
def test_ends_on_a_round_outline_are_held_by_the_mesh_too():
    """Fig. 4: sliding ends make the same saddle; fixed ones lose all hold once the junctions rest there."""
    initial, project = three_patches(7), next(case.project for case in CASES if case.name == "fig4")
    fixed, natural = (
        ladder.climb(initial, 9, corners.REACH * initial.size, bottom, project)[0]
        for bottom in ("sliding", "natural")
    )
    for one, other in zip(fixed, natural, strict=True):
        assert other["energy"] == pytest.approx(one["energy"], rel=1e-12)  # the condition is met by symmetry
        assert other["eigenvalue"] < one["eigenvalue"] + 1e-9
    assert (fixed[-1]["pinched"], natural[-1]["pinched"]) == (3, 3)
    assert (fixed[-1]["index"], natural[-1]["index"]) == (2, 2)
    assert natural[-1]["eigenvalue"] == pytest.approx(fixed[-1]["eigenvalue"], rel=1e-6)
