"""Refinement keeps areas, volumes, patches and supports, and carries fields along."""

import numpy as np
import pytest
from refusals import refused

from pcmc import Patch, Plane, Surface, solve
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.forces.functional import patch_areas, patch_volumes
from pcmc.forces.pinching import standing_part
from pcmc.meshing.refinement import held_midpoints, prolongation, refine
from pcmc.plan import Divider, Plan


def tent(plane: Plane | None = None) -> Surface:
    """Two roof slopes over [-1,1]×[0,4], a ridge along y, and a wall of one row under it.

    The ridge's ends are fixed corners on Π; 2 and 3 are ridge vertices, 4 and 5 slide below them.
    """
    X = [[0, 0, 0], [0, 4, 0], [0, 1, 1], [0, 3, 1], [0, 1, 0], [0, 3, 0],
         [-1, 0, 0], [-1, 4, 0], [1, 0, 0], [1, 4, 0]]  # fmt: skip
    left = [[0, 2, 6], [2, 3, 6], [3, 7, 6], [3, 1, 7]]
    right = [[0, 8, 2], [2, 8, 3], [3, 8, 9], [3, 9, 1]]
    wall = [[0, 4, 2], [4, 5, 2], [5, 3, 2], [5, 1, 3]]
    return Surface(
        X,
        left + right + wall,
        [0] * 4 + [1] * 4 + [2] * 4,
        [Patch("left", 3.0), Patch("right", 2.0), Patch("wall", 1.0, pressure=0.0)],
        fixed=[0, 1, 6, 7, 8, 9],
        on_plane=[4, 5],
        plane=plane or Plane(),
    )


def middle_of(surface: Surface, a: int, b: int) -> int:
    edges = surface.topology.edges
    return surface.n + int(np.flatnonzero((edges == sorted((a, b))).all(axis=1))[0])


def test_counts_areas_and_volumes_are_kept():
    coarse = tent()
    fine = refine(coarse, levels=2)
    assert fine.m == 16 * coarse.m
    assert fine.patches == coarse.patches
    assert fine.plane == coarse.plane
    np.testing.assert_allclose(patch_areas(fine), patch_areas(coarse), rtol=1e-13)
    np.testing.assert_allclose(patch_volumes(fine), patch_volumes(coarse), rtol=1e-13)
    np.testing.assert_array_equal(refine(coarse, levels=0).vertices, coarse.vertices)


def test_curves_stay_curves():
    coarse = tent()
    fine = refine(coarse)
    count = lambda t: [int(t.boundary_edge.sum()), int(t.junction_edge.sum())]  # noqa: E731
    assert count(fine.topology) == [2 * c for c in count(coarse.topology)]
    assert len(fine.topology.junctions) == len(coarse.topology.junctions)


@pytest.mark.parametrize(
    ("a", "b", "fixed", "sliding"),
    [
        (0, 6, True, False),  # fixed boundary edge
        (6, 7, True, False),
        (0, 4, False, True),  # wall's bottom, from the fixed corner
        (4, 5, False, True),  # wall's bottom
        (0, 2, False, False),  # ridge: a junction edge
        (2, 4, False, False),  # inside the wall
        (3, 9, False, False),  # inside a slope
    ],
)
def test_supports_of_midpoints(a, b, fixed, sliding):
    fine = refine(tent())
    v = middle_of(tent(), a, b)
    assert (bool(fine.fixed[v]), bool(fine.on_plane[v])) == (fixed, sliding)


def test_interior_edge_between_fixed_vertices_is_free():
    square = Surface(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        [[0, 1, 2], [0, 2, 3]],
        [0, 0],
        [Patch("a", 1.0)],
        fixed=range(4),
    )
    assert not refine(square).fixed[middle_of(square, 0, 2)]


def test_interior_edge_between_sliding_vertices_is_free():
    square = Surface(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        [[0, 1, 2], [0, 2, 3]],
        [0, 0],
        [Patch("a", 1.0)],
        on_plane=range(4),
    )
    assert refine(square).free.sum() == 1
    assert refine(square).free[middle_of(square, 0, 2)]


def test_a_patch_that_lies_on_the_plane_stays_on_it():
    """An octahedron that stands on its middle: the ground there, and the line around it, slide on Π."""
    X = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, 0]]
    F = [[k, (k + 1) % 4, top] for top in (4, 5) for k in range(4)]
    patches = [Patch("drop", 1.0), Patch("ground", 0.5, pressure=0.0)]
    fine = refine(Surface(X, F, [0] * 4 + [1] * 4, patches, on_plane=[0, 1, 2, 3, 5]), levels=2)
    np.testing.assert_array_equal(fine.on_plane, fine.vertices[:, 2] == 0.0)


def test_a_held_line_inside_a_patch_is_held_between_its_vertices():
    t = np.arange(5.0)
    x, y = np.meshgrid(t, t, indexing="ij")
    X = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    k = np.arange(25).reshape(5, 5)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    F = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    line = [k[1, 2], k[2, 2], k[3, 2]]
    surface = Surface(X, F, [0] * len(F), [Patch("a", 1.0)], fixed=[*line, k[0, 2]])
    fine = refine(surface)
    assert fine.fixed[middle_of(surface, k[1, 2], k[2, 2])]
    assert fine.fixed[middle_of(surface, k[0, 2], k[1, 2])]  # the line goes on to the boundary
    assert fine.fixed.sum() == 7


def test_seam_across_the_plan_is_free_but_a_held_chain_along_a_junction_is_fixed():
    X = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    square = Surface(X, [[0, 1, 2], [0, 2, 3]], [0, 1], [Patch("a", 1.0), Patch("b", 1.0)], fixed=range(4))
    assert not refine(square).fixed[middle_of(square, 0, 2)]
    base = tent()
    held = base.rebuilt(fixed=[0, 1, 2, 3, 6, 7, 8, 9], on_plane=[4, 5])
    fine = refine(held)
    assert fine.fixed[middle_of(held, 2, 3)]
    assert fine.fixed[middle_of(held, 0, 2)]


def test_fixed_end_above_the_plane_leaves_its_wall_edge_free():
    """A wall's end edge from a raised fixed vertex to a sliding foot does not lie on Π."""
    wall = Surface(
        [[0, 0, 1], [0, 0, 0], [1, 0, 0]],
        [[0, 1, 2]],
        [0],
        [Patch("wall", 1.0, pressure=0.0)],
        fixed=[0],
        on_plane=[1, 2],
    )
    fixed, slides = held_midpoints(wall)
    foot = (wall.topology.edges == [1, 2]).all(axis=1)
    np.testing.assert_array_equal(slides, foot)
    assert not fixed.any()
    refine(wall)  # and the refined surface is accepted: what slides lies on Π


def test_sliding_on_a_tilted_plane():
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    base, shift = tent(), np.array([3.0, -2.0, 5.0])
    tilted = base.rebuilt(vertices=base.vertices @ turn.T + shift, plane=Plane(shift, turn[:, 2]))
    fine = refine(tilted, levels=2)
    assert fine.on_plane.sum() == refine(base, levels=2).on_plane.sum()
    np.testing.assert_allclose(fine.vertices, refine(base, levels=2).vertices @ turn.T + shift, atol=1e-13)


def test_prolongation_carries_linear_fields_exactly():
    coarse = tent()
    P = prolongation(coarse)
    fine = refine(coarse)
    np.testing.assert_allclose(P @ coarse.vertices, fine.vertices, atol=1e-15)
    linear = np.array([2.0, -1.0, 0.5])
    np.testing.assert_allclose(P @ (coarse.vertices @ linear), fine.vertices @ linear, atol=1e-14)


def test_projection_reaches_second_order_on_the_circle():
    angle = 2 * np.pi * np.arange(6) / 6
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    disc = Surface(
        np.concatenate([[[0, 0, 0]], rim]),
        [[0, k + 1, (k + 1) % 6 + 1] for k in range(6)],
        [0] * 6,
        [Patch("disc", 1.0)],
        fixed=range(1, 7),
    )
    onto = lambda p: p / np.linalg.norm(p, axis=1, keepdims=True)  # noqa: E731
    missing = [np.pi - patch_areas(refine(disc, k, onto))[0] for k in range(5)]
    order = np.log2(np.array(missing[:-1]) / missing[1:])
    assert order[-1] == pytest.approx(2.0, abs=0.01)
    fine = refine(disc, 3, onto)
    np.testing.assert_allclose(np.linalg.norm(fine.vertices[fine.fixed], axis=1), 1.0, rtol=1e-15)


@pytest.mark.parametrize("levels", [-1, 1.5, "two", True])
def test_levels_must_be_whole(levels):
    with refused(OptionError, what="levels", found=levels, expected="a whole number ≥ 0"):
        refine(tent(), levels)


def test_bad_projections_are_refused():
    with refused(OptionError, what="project", found=(6, 2), expected=(6, 3)):
        refine(tent(), project=lambda p: p[:, :2])
    first = int(np.flatnonzero(refine(tent()).fixed[tent().n :])[0])
    with refused(SurfaceError, what="vertices", where=tent().n + first):
        refine(tent(), project=lambda p: np.full_like(p, np.nan))


def test_what_rests_on_a_curved_bottom_rests_on_a_finer_mesh():
    arc = {"arc": [[4, 0], [5, 3], [4, 6]]}
    plan = Plan([[0, 0], [9, 0], [9, 6], [0, 6]], [Divider(arc, wall=8.0)], tension=3.2, edge_length=1.5)
    coarse = solve(plan.surface()).surface
    down = standing_part(coarse).resting
    fine = refine(coarse)
    tops = standing_part(coarse).walls.top_edges
    both = int((down | coarse.fixed)[tops].all(axis=1).sum())  # each has a new vertex that rests, too
    assert both >= 3
    assert standing_part(fine).resting.sum() == down.sum() + both
    assert solve(fine).certificate.certified
