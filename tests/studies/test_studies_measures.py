"""What the studies measure: yardsticks, turns, starts, errors, groups of vertices."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from generators import four_fans, spherical_cap, two_caps, two_squares
from pcmc import curvature_error, solve
from pcmc.forces.functional import energy_and_gradient
from studies.benchmarks.run import numpy_energy_and_gradient
from studies.examples import example1
from studies.examples.flow import NOISE, Case, errors, start_of, turn
from studies.examples.mesh_search import GROUPS, groups, holders


@pytest.mark.parametrize("surface", [two_squares(5), two_caps(1.2)], ids=["squares", "caps"])
def test_numpy_yardstick_agrees_with_the_compiled_loop(surface):
    mine, theirs = numpy_energy_and_gradient(surface), energy_and_gradient(surface)
    assert mine[0] == pytest.approx(theirs[0], rel=1e-13)
    assert np.allclose(mine[1], theirs[1], atol=1e-13 * np.abs(theirs[1]).max())


def test_turn_between_two_flat_sheets_is_their_angle():
    surface = two_squares(4, height=1.0)
    X = surface.vertices.copy()
    X[:, 2] *= 0.0
    roof = np.unique(surface.faces[surface.patch_faces([0, 1])])
    X[roof, 2] = 1.0 + np.abs(X[roof, 0]) * math.tan(math.radians(20.0))
    middle = int(np.argmin(np.linalg.norm(X - [0.0, 0.0, 1.0], axis=1)))
    assert turn(surface.moved(X), middle, ("left", "right")) == pytest.approx(40.0)
    X[roof, 2] = 1.0 - np.abs(X[roof, 0]) * math.tan(math.radians(20.0))
    assert turn(surface.moved(X), middle, ("left", "right")) == pytest.approx(-40.0)


def test_a_wall_stands_until_it_first_comes_down_however_it_bounces():
    heights = {run: [1.0, 0.5, 0.04, 0.3, 0.2] for run in example1.STANDING}
    *_, other = heights
    heights[other] = [1.0, 0.9, 0.8, 0.7, 0.6]
    tables = [
        pd.DataFrame({"run": run, "iteration": range(5), "height": column}) for run, column in heights.items()
    ]
    assert example1._standing_numbers(pd.concat(tables, ignore_index=True)) == {
        "stands_until": 1,
        "stands_until_without_momentum": 1,
        "least_height_3_parallel": 0.6,
        "iterations_of_least_height": example1.LAST,
    }


def test_a_flow_starts_from_the_same_bits_whatever_the_last_digits_of_a_linear_solver():
    surface = four_fans(5)
    noise = 1e-12 * np.random.default_rng(1).standard_normal((surface.n, 3))
    cases = [
        Case("a", lambda X=X: surface.moved(X), {}) for X in (surface.vertices, surface.vertices + noise)
    ]
    one, other = (start_of(case).vertices for case in cases)
    assert not np.array_equal(surface.vertices, surface.vertices + noise)
    assert np.array_equal(one, other)
    np.testing.assert_allclose(one, surface.vertices, rtol=0.0, atol=1e-6)


def test_errors_below_rounding_are_written_as_a_bound_and_others_as_they_are():
    exact = errors(solve(spherical_cap(0.3), tolerance=1e-13).surface)
    assert exact["largest_error_variational"] == exact["mean_error_variational"] == NOISE
    assert exact["largest_error_cotangent"] > 1e-4
    flat = spherical_cap(0.3)
    assert errors(flat)["largest_error_variational"] == np.nanmax(
        np.abs(curvature_error(flat, "variational"))
    )


def test_every_vertex_that_can_move_is_in_one_group_and_the_shares_add_to_one():
    surface = two_caps(1.2)
    masks = groups(surface)
    assert tuple(masks) == GROUPS
    assert np.array_equal(sum(m.astype(int) for m in masks.values()), (~surface.fixed).astype(int))
    shares = holders(surface)
    assert sum(shares[f"share {g}"] for g in GROUPS) == pytest.approx(1.0)
