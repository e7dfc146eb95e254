"""Remeshing keeps curves, patches and supports, and its triangles are good."""

import builtins

import numpy as np
import pytest
from refusals import refused
from scipy.spatial import cKDTree
from support_cases import lens

import generators
from pcmc import Patch, Surface, solve
from pcmc.base.errors import MissingExtra, OptionError
from pcmc.forces.functional import patch_areas
from pcmc.meshing.curve_cutting import CurveMesh, cut_curves
from pcmc.meshing.quality import edge_lengths, improve_angles, minimum_angle
from pcmc.meshing.refinement import refine
from pcmc.meshing.remeshing import _remesh_with_mmg, remesh, size_note
from pcmc.plan import Plan
from pcmc.surface.geometry import angles


def patch_angles(surface: Surface) -> dict[str, float]:
    X, F = surface.vertices, surface.faces
    a, b = X[F[:, [1, 2, 0]]] - X[F], X[F[:, [2, 0, 1]]] - X[F]
    cosine = np.einsum("fij,fij->fi", a, b)
    angle = np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=2), cosine)).min(axis=1)
    of = surface.patch_of_face
    return {p.name: float(angle[of == k].min()) for k, p in enumerate(surface.patches)}


def sharpest_corner(surface: Surface) -> float:
    """The smallest angle between two curve edges of one triangle: no mesh there can do better."""
    on_curve = surface.topology.curve_edge[surface.topology.edge_of_face]
    sides = surface.vertices[surface.faces[:, [2, 0, 1]]] - surface.vertices[surface.faces[:, [1, 2, 0]]]
    corners = []
    for k in range(3):  # the sides opposite the other two corners meet at corner k
        i, j = (k + 1) % 3, (k + 2) % 3
        a, b = (sides[on_curve[:, i] & on_curve[:, j], m] for m in (i, j))
        length = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
        corners.append(np.degrees(np.arccos(-(a * b).sum(axis=1) / length)))
    return float(np.concatenate(corners).min())


def cut_evenly(surface: Surface, length: float) -> CurveMesh:
    size = np.full(surface.n, length)
    return cut_curves(surface, size)


def curve_edges(surface: Surface) -> np.ndarray:
    return surface.topology.edges[surface.topology.curve_edge]


def assert_same_curves(old: Surface, new: Surface) -> None:
    """Old curve vertices stay, new ones lie on old edges, and the length is the same."""
    before, after = curve_edges(old), curve_edges(new)
    gap, number = cKDTree(new.vertices).query(old.vertices[np.unique(before)])
    assert gap.max() == 0.0
    np.testing.assert_array_equal(new.fixed[number], old.fixed[np.unique(before)])
    np.testing.assert_array_equal(new.on_plane[number], old.on_plane[np.unique(before)])
    a, b = (old.vertices[before[:, k]] for k in (0, 1))
    points = new.vertices[np.unique(after)][:, None]
    along = b - a
    t = np.clip(((points - a) * along).sum(axis=2) / (along**2).sum(axis=1), 0.0, 1.0)
    distance = np.linalg.norm(points - a - t[..., None] * along, axis=2).min(axis=1)
    assert distance.max() <= 1e-12 * old.size
    length = lambda s, e: np.linalg.norm(np.diff(s.vertices[e], axis=1), axis=2).sum()  # noqa: E731
    assert length(new, after) == pytest.approx(length(old, before), rel=1e-12)
    key = lambda s: sorted(c.sheets for c in s.topology.junctions)  # noqa: E731
    assert key(new) == key(old)
    assert len(new.topology.boundary_loops) == len(old.topology.boundary_loops)


@pytest.mark.parametrize(
    ("example", "length"),
    [(generators.two_caps, 1.2), (generators.two_caps, 0.8), (generators.bezier_hall, 4.6)],
)
def test_a_solved_example_to_half_the_edge_length(example, length):
    solved = solve(example(length)).surface
    h = float(edge_lengths(solved).mean())
    fine = remesh(solved, h / 2)
    assert_same_curves(solved, fine)
    assert fine.patches == solved.patches
    assert min(patch_angles(fine).values()) >= min(24.0, sharpest_corner(solved) - 1e-6)
    assert sharpest_corner(solved) > 19.0
    assert 3.0 < fine.m / solved.m < 6.0
    assert edge_lengths(fine).mean() == pytest.approx(h / 2, rel=0.1)
    np.testing.assert_allclose(patch_areas(fine), patch_areas(solved), rtol=0.01)
    again = solve(fine)
    assert again.converged
    np.testing.assert_allclose(patch_areas(again.surface), patch_areas(solved), rtol=0.05)


def test_walls_that_share_a_line_and_slide():
    start = generators.three_patches()
    fine = remesh(start, 0.5 * float(edge_lengths(start).mean()))
    assert_same_curves(start, fine)
    assert fine.on_plane.sum() == refine(start).on_plane.sum()
    assert fine.fixed.sum() == refine(start).fixed.sum()
    assert minimum_angle(fine) > 20.0


def test_a_wall_that_has_vanished_below_a_resting_junction():
    rested = solve(generators.two_squares(alpha_aux=3.0))
    assert len(rested.certificate.pinched) == 3
    again = solve(remesh(rested.surface, 1.0))
    assert again.converged
    assert len(again.certificate.pinched) == 3
    assert again.surface.m > 2 * rested.surface.m
    np.testing.assert_allclose(again.energy, rested.energy, rtol=0.02)


def test_a_thin_wall_keeps_its_triangles_where_they_are_better():
    start = generators.two_caps(1.2)
    before = patch_angles(start)
    assert before["wall"] == pytest.approx(sharpest_corner(start), rel=0.02)
    assert before["wall"] < 12.0
    fine = patch_angles(remesh(start, 0.6))
    assert fine["wall"] > 0.8 * before["wall"]
    assert min(fine["large"], fine["small"]) > 20.0


def test_good_triangles_in_corners_are_left_alone():
    mesh = cut_evenly(generators.two_squares(), 0.5)
    done = _remesh_with_mmg(mesh, np.full(len(mesh.X), 0.5), 1.2, 0.05)
    assert angles(done.X[done.F[done.patch == 2]]).min() > 25.0


@pytest.mark.filterwarnings("ignore:no vertex is fixed")
def test_a_closed_surface_without_curves():
    ball = generators.sphere()
    fine = remesh(ball, 0.5 * float(edge_lengths(ball).mean()))
    assert minimum_angle(fine) > 25.0
    assert not fine.topology.curve_edge.any()


def test_new_vertices_lie_near_the_smooth_surface():
    """A cap of the sphere of radius 1.2 about (0, 0, -√0.44), over the unit disc."""
    cap = generators.spherical_cap()
    X = cap.vertices.copy()
    X[:, 2] = np.sqrt(1.44 - X[:, 0] ** 2 - X[:, 1] ** 2) - np.sqrt(0.44)
    cap = cap.moved(np.where(cap.fixed[:, None], cap.vertices, X))
    distance = [
        np.abs(np.linalg.norm(s.vertices[s.free] + [0, 0, np.sqrt(0.44)], axis=1) - 1.2).mean()
        for s in (remesh(cap, 0.5 * float(edge_lengths(cap).mean())), refine(cap))
    ]
    assert distance[0] < 0.25 * distance[1]


def test_finer_near_curves():
    start = generators.bezier_hall(4.6)
    fine = remesh(start, 5.0, near_curves=1.2)
    assert_same_curves(start, fine)
    length = edge_lengths(fine)
    assert length[fine.topology.curve_edge].mean() == pytest.approx(1.2, rel=0.2)
    assert np.percentile(length, 95) > 3.0
    assert minimum_angle(fine) > 20.0


def test_finer_where_it_bends():
    start = generators.bezier_hall(4.6)
    assert remesh(start, 5.0, chord=0.05).m > 1.5 * remesh(start, 5.0).m


def test_coarser_inside_but_not_along_curves():
    fine = refine(Plan([[0, 0], [8, 0], [8, 6], [0, 6]], tension=4.0, edge_length=0.5).surface())
    coarse = remesh(fine, 1.0)
    assert_same_curves(fine, coarse)
    assert coarse.m < 0.5 * fine.m
    assert minimum_angle(coarse) > 20.0


def test_held_points_and_lines_inside_a_patch_stay():
    beam = [[3, 3, 2], [6, 3, 2]]
    start = Plan(
        [[0, 0], [8, 0], [8, 6], [0, 6]], supports=[beam, [2, 4, 1.5]], tension=4.0, edge_length=0.8
    ).surface()
    fine = remesh(start, 0.3)
    inside = fine.vertices[fine.fixed & ~fine.topology.on_boundary]
    assert (np.abs(inside - [2, 4, 1.5]).max(axis=1) < 1e-12).sum() == 1
    on_beam = inside[np.abs(inside[:, 2] - 2.0) < 1e-12]
    np.testing.assert_allclose(on_beam[:, 1], 3.0)
    assert len(on_beam) == len(inside) - 1 == 9


def test_the_same_mesh_twice():
    start = generators.two_caps(1.2)
    one, two = remesh(start, 0.7), remesh(start, 0.7)
    np.testing.assert_array_equal(one.vertices, two.vertices)
    np.testing.assert_array_equal(one.faces, two.faces)


@pytest.mark.parametrize("length", [0.9, 0.45, 0.3, 0.19, 0.07])
def test_cutting_curves_keeps_flat_areas_and_orientation(length):
    start = generators.two_squares(2, height=1e-3)
    cut = cut_evenly(start, length)
    again = Surface(cut.X, cut.F, cut.patch, start.patches, *cut.support.T)
    np.testing.assert_allclose(patch_areas(again), patch_areas(start), rtol=1e-6)
    assert_same_curves(start, again)
    assert edge_lengths(again)[again.topology.curve_edge].max() < 1.5 * length


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("edge_length", 0.0, "a finite number > 0"),
        ("edge_length", -np.inf, "a finite number > 0"),
        ("near_curves", -1.0, "a finite number > 0"),
        ("chord", np.inf, "a finite number > 0"),
        ("growth", 1.0, "a finite number > 1"),
    ],
)
def test_wrong_arguments_are_refused(name, value, expected):
    with refused(OptionError, what=name, found=value, expected=expected):
        remesh(generators.two_squares(2), **{"edge_length": 1.0, name: value})


@pytest.mark.parametrize(("name", "value"), [("edge_length", 1e-9), ("near_curves", 1e-9), ("chord", 1e-9)])
def test_lengths_that_no_mesh_has_are_refused_at_once_with_the_least_one(name, value):
    cap = generators.spherical_cap(0.25)
    with pytest.raises(OptionError) as refusal:
        remesh(cap, **{"edge_length": 0.3, name: value})
    error = refusal.value
    assert (error.what, error.found) == (name, value)
    assert value < error.expected < 0.3
    assert f"use {error.expected:g} or more" in str(error)


def test_the_least_chord_is_met():
    cap = generators.spherical_cap(0.25)
    with pytest.raises(OptionError) as refusal:
        remesh(cap, 0.5, chord=1e-9)
    assert remesh(cap, 0.5, chord=refusal.value.expected).m > 2 * remesh(cap, 0.5).m


def test_an_edge_length_that_curves_do_not_allow_is_noted():
    cap = generators.spherical_cap(0.25)
    coarse = remesh(cap, 50.0)
    longest = float(edge_lengths(coarse).max())
    text = f"the edge length 50 is not reached; the longest edge is {longest:.3g}"
    assert size_note(coarse, 50.0).startswith(text)
    assert not size_note(coarse, 0.99 * longest)


def test_without_mmgpy_the_extra_is_named(monkeypatch):
    real = builtins.__import__

    def without(name, *rest, **more):
        if name == "mmgpy":
            raise ImportError(name)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingExtra, match=r"pcmc-surfaces\[remesh\]"):
        remesh(generators.two_squares(2), 0.5)


def test_a_single_triangle():
    one = Surface([[0, 0, 0], [2, 0, 0], [0, 2, 0]], [[0, 1, 2]], [0], [Patch("a", 1.0)], fixed=range(3))
    fine = remesh(one, 0.25)
    assert patch_areas(fine)[0] == pytest.approx(2.0)
    assert minimum_angle(fine) > 20.0


def test_new_triangles_keep_the_side_that_a_pressure_pushes_to():
    """MMG turns sheets so that neighbours run alike; the lower foil of this lens does not, and has p < 0."""
    finer = remesh(solve(lens()).surface, 0.2)
    roof = solve(finer).surface
    assert roof.vertices[:, 2].min() == pytest.approx(-roof.vertices[:, 2].max(), rel=0.02)


def test_a_vertex_where_a_sheet_lies_on_itself_stays():
    X = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.25, 0.5, 0]])
    fan = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    assert (improve_angles(X, np.concatenate([fan, fan[:, ::-1]]), np.arange(5) == 4, goal=40.0) == X).all()
