"""Graded meshes: fine near points, with angles that do not depend on how fine."""

import numpy as np
import pytest
from refusals import refused

import pcmc
from generators import four_fans, spherical_cap, three_patches, two_caps, two_squares
from pcmc.base.errors import OptionError
from pcmc.forces.functional import patch_areas, patch_volumes
from pcmc.forces.pinching import standing_part
from pcmc.forces.wall_rows import find_walls
from pcmc.meshing.local_refinement import refine_faces, refine_near
from pcmc.meshing.quality import edge_lengths
from pcmc.meshing.refinement import refine
from pcmc.meshing.remeshing import remesh
from pcmc.plan import Divider, Plan, circle
from pcmc.surface.geometry import angles

SHAPES = {
    "squares": lambda: two_squares(6),
    "parallel": lambda: two_squares(6, diagonals="parallel"),
    "caps": lambda: two_caps(1.0),
    "fans": lambda: four_fans(5),
    "patches": lambda: three_patches(5),
}


def ends(surface):
    """The ends of the junctions."""
    return np.unique(
        np.concatenate([c.vertices[[0, -1]] for c in surface.topology.junctions if not c.closed])
    )


@pytest.mark.parametrize("shape", SHAPES)
def test_no_depth_makes_the_angles_worse(shape):
    coarse = SHAPES[shape]()
    corners = coarse.vertices[ends(coarse)]
    worst = angles(coarse.vertices[coarse.faces]).min()
    smallest, counts = [], []
    for levels in (4, 8, 16):
        fine = refine_near(coarse, corners, levels, 0.1 * coarse.size)
        smallest.append(angles(fine.vertices[fine.faces]).min())
        counts.append(fine.m)
        nearest = edge_lengths(fine)[np.isin(fine.topology.edges, ends(coarse)).any(axis=1)]
        start = edge_lengths(coarse)[np.isin(coarse.topology.edges, ends(coarse)).any(axis=1)]
        assert nearest.min() == pytest.approx(start.min() / 2**levels, rel=1e-9)
        assert nearest.max() <= 1.000001 * start.max() / 2**levels
    assert min(smallest) >= 0.5 * worst
    assert smallest[2] == pytest.approx(smallest[1], abs=1e-3)
    per_level = np.diff(counts) / [4, 8]
    assert per_level[1] == pytest.approx(per_level[0], rel=0.05)  # a level costs the same at every depth


@pytest.mark.parametrize("shape", SHAPES)
def test_a_graded_mesh_is_the_same_surface(shape):
    coarse = SHAPES[shape]()
    fine = refine_near(coarse, coarse.vertices[ends(coarse)], 5, 0.2 * coarse.size)
    np.testing.assert_allclose(patch_areas(fine), patch_areas(coarse), rtol=1e-13)
    np.testing.assert_allclose(patch_volumes(fine), patch_volumes(coarse), rtol=1e-13, atol=1e-13)
    assert fine.patches == coarse.patches
    np.testing.assert_array_equal(fine.vertices[: coarse.n], coarse.vertices)
    np.testing.assert_array_equal(fine.fixed[: coarse.n], coarse.fixed)
    np.testing.assert_array_equal(fine.on_plane[: coarse.n], coarse.on_plane)
    assert len(fine.topology.junctions) == len(coarse.topology.junctions)
    assert fine.topology.fans.tolist()[: coarse.n] == coarse.topology.fans.tolist()
    # conforming: every curve edge of the coarse mesh is covered by curve edges of the fine one
    length = [edge_lengths(s)[s.topology.curve_edge].sum() for s in (coarse, fine)]
    assert length[0] == pytest.approx(length[1], rel=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_within_a_large_radius_it_is_the_uniform_refinement(shape):
    coarse = SHAPES[shape]()
    fine, uniform = refine_near(coarse, [0, 0, 0], 2, 100 * coarse.size), refine(coarse, 2)
    for one in (fine, uniform):
        assert (one.n, one.m) == (uniform.n, uniform.m)
    rows = lambda s: sorted(np.sort(np.round(s.vertices[s.faces], 9).reshape(s.m, 9)).tolist())  # noqa: E731
    assert rows(fine) == rows(uniform)
    order = lambda s: np.lexsort(np.round(s.vertices, 9).T)  # noqa: E731
    for support in ("fixed", "on_plane"):
        a, b = getattr(fine, support)[order(fine)], getattr(uniform, support)[order(uniform)]
        np.testing.assert_array_equal(a, b)


def test_repeated_calls_do_not_spoil_the_angles():
    surface = two_caps(1.0)
    corner = surface.vertices[ends(surface)]
    worst = angles(surface.vertices[surface.faces]).min()
    radius = 0.5
    for _ in range(12):
        surface = refine_near(surface, corner, 1, radius)
        radius *= 0.5
    assert angles(surface.vertices[surface.faces]).min() >= 0.5 * worst


def test_the_cap_on_a_graded_mesh_is_at_rest_and_nearer_to_the_sphere():
    cap = spherical_cap(4, alpha=0.6)
    round_edge = lambda p: p / np.linalg.norm(p[:, :2], axis=1)[:, None]  # noqa: E731
    fine = refine_near(cap, [0, 0, 1], 2, 10.0, round_edge)
    one, two = (pcmc.solve(s, "newton") for s in (cap, fine))
    exact = 1.2 - np.sqrt(1.2**2 - 1.0)
    error = [abs(r.surface.vertices[:, 2].max() - exact) for r in (one, two)]
    assert one.converged
    assert two.converged
    assert error[1] < error[0] / 10


@pytest.mark.parametrize("alpha_aux", [1.0, 2.0])
def test_walls_pinch_on_graded_meshes(alpha_aux):
    """Example 1: at wall 2 the junction rests near its ends, on every mesh."""
    coarse = two_squares(8, alpha_aux=alpha_aux)
    fine = refine_near(coarse, coarse.vertices[ends(coarse)], 3, 1.0)
    walls = find_walls(fine)
    rows = walls.rows
    np.testing.assert_allclose(rows.places(fine, fine.vertices), fine.vertices[rows.vertices], atol=1e-12)
    results = [pcmc.solve(s, "newton", target="stationary") for s in (coarse, fine)]
    assert all(r.converged for r in results)
    heights = [r.surface.vertices[:, 2].max() for r in results]
    assert heights[1] == pytest.approx(heights[0], rel=0.02)


def test_a_pinched_wall_is_refined_where_it_rests():
    solved = pcmc.solve(two_squares(8, alpha_aux=2.5), "newton", target="stationary").surface
    resting = standing_part(solved).resting
    assert resting.any()
    place = solved.vertices[np.flatnonzero(resting)[0]]
    fine = refine_near(solved, place, 2, 0.6)
    again = pcmc.solve(fine, "newton", target="stationary")
    assert again.converged
    assert standing_part(again.surface).resting.sum() > resting.sum()


def resting_roof(curve, *more):
    """A roof whose strong walls with held bottoms rest all along."""
    dividers = [Divider(line, wall=2.5) for line in (curve, *more)]
    plan = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], dividers, edge_length=0.8, tension=2.0, pressure=0.4)
    solved = pcmc.solve(plan.surface())
    assert standing_part(solved.surface).resting.any()
    return solved.surface


@pytest.mark.parametrize(
    "finer", [lambda s: refine_faces(s, np.ones(s.m, dtype=bool)), lambda s: remesh(s, 0.5)]
)
def test_walls_that_cross_and_rest_are_lifted_with_area(finer):
    """Beside a crossing a vertex at rest had its place straight between two others of its triangle."""
    solved = resting_roof([[6, 0], [6, 8]], [[0, 4], [12, 4]])
    again = pcmc.solve(finer(solved))
    assert again.certificate.verdict is pcmc.Verdict.STABLE
    part = standing_part(again.surface)
    np.testing.assert_array_equal(part.resting, part.walls.top_free)


def test_vertices_over_a_held_bottom_stay_pairs_however_often_they_are_cut():
    """From the second level on the bottom was not cut below the junction, which could not come down again."""
    solved = resting_roof(circle([6, 4], 2))
    again = pcmc.solve(refine_near(solved, solved.vertices[standing_part(solved).resting][0], 3, 1.5))
    assert again.certificate.verdict is pcmc.Verdict.STABLE
    assert standing_part(again.surface).resting.sum() > standing_part(solved).resting.sum()


def test_what_it_refuses():
    square = two_squares(4)
    for points in ([[0, 0]], [[0, 0, np.nan]]):
        with refused(OptionError, what="points"):
            refine_near(square, points, 1, 1.0)
    with refused(OptionError, what="levels", found=-1):
        refine_near(square, [0, 0, 0], -1, 1.0)
    with refused(OptionError, what="radius", found=0.0):
        refine_near(square, [0, 0, 0], 1, 0.0)
    for chosen in ([square.m], [0.5]):
        with refused(OptionError, what="chosen", found=chosen):
            refine_faces(square, chosen)
    assert refine_faces(square, []) is square
