"""The motion space: what it is made of at each kind of vertex, and that the rest changes no shape."""

import numpy as np
import pytest
from motion_cases import SURFACES, TILTED, against, seam, touching
from shapes import disc, placed, pyramid, rotation, shaken, three_patches

from generators import two_squares
from pcmc import Patch, Plane, Surface, energy, gradient, solve
from pcmc.forces.functional import energy_and_gradient
from pcmc.forces.motion_space import force_scale, motion_space, vertex_classes
from pcmc.forces.pinching import resting_links, standing_part
from pcmc.surface.topology import CURVE, POINT, SHEET

pytestmark = pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")


def frame_and_space(surface: Surface):
    classes = vertex_classes(surface)
    return classes, motion_space(surface, classes, surface.vertices)


@pytest.mark.parametrize("name", SURFACES)
def test_the_basis_is_orthonormal_and_within_the_supports(name):
    surface = SURFACES[name]()
    _, space = frame_and_space(surface)
    used = np.arange(3) < space.dimension[:, None]
    gram = np.einsum("vcd,ved->vce", space.basis, space.basis)
    np.testing.assert_allclose(gram, used[:, :, None] * np.eye(3), atol=1e-14)
    assert (space.dimension[surface.fixed] == 0).all()
    heights = space.basis[surface.on_plane] @ np.array(surface.plane.normal)
    np.testing.assert_allclose(heights, 0.0, atol=1e-14)
    assert space.size == space.dimension.sum() > 0


@pytest.mark.parametrize("name", SURFACES)
def test_pull_and_push_are_transposes_and_project_is_a_projection(name):
    surface = SURFACES[name]()
    _, space = frame_and_space(surface)
    random = np.random.default_rng(1)
    s, v = random.standard_normal(space.size), random.standard_normal((surface.n, 3))
    assert space.to_coordinates(v) @ s == pytest.approx((v * space.to_vectors(s)).sum(), rel=1e-12)
    np.testing.assert_allclose(space.to_coordinates(space.to_vectors(s)), s, atol=1e-14)
    once = space.project(v)
    np.testing.assert_allclose(space.project(once), once, atol=1e-14)
    assert np.abs(v - once).max() > 0.1


def test_each_kind_of_vertex_has_its_dimension():
    surface = shaken(three_patches())
    classes, space = frame_and_space(surface)
    free, sliding = surface.free, surface.on_plane
    for kind, dimension in ((SHEET, 1), (CURVE, 2), (POINT, 3)):
        assert (classes.kind[free] == kind).any()
        assert (space.dimension[free & (classes.kind == kind)] == dimension).all()
    assert (space.dimension[sliding & (classes.kind == CURVE)] == 1).all()
    assert (space.dimension[sliding & (classes.kind == POINT)] == 2).all()


def test_directions_are_the_normal_and_the_plane_across_the_curve():
    surface = shaken(three_patches(plane=TILTED))
    classes, space = frame_and_space(surface)
    X = surface.vertices
    corners = X[classes.faces]
    vector = np.zeros_like(X)
    for corner in range(3):
        np.add.at(
            vector,
            classes.faces[:, corner],
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
        )
    sheet = surface.free & (classes.kind == SHEET)
    normal = vector[sheet] / np.linalg.norm(vector[sheet], axis=1)[:, None]
    np.testing.assert_allclose(space.basis[sheet, 0], normal, atol=1e-14)
    assert classes.curve.tolist() == np.flatnonzero(classes.kind == CURVE).tolist()
    for v, (one, two) in zip(classes.curve, classes.beside, strict=True):
        if not surface.free[v]:
            continue
        # the chord weighted by lengths or not: both lie in the plane of the two edges
        tangent = np.cross(*space.basis[v, :2])
        plane = np.cross(X[one] - X[v], X[two] - X[v])
        assert abs(tangent @ plane) < 1e-12 * np.linalg.norm(plane) + 1e-13
        assert abs(tangent @ (X[one] - X[two])) > 0.9 * np.linalg.norm(X[one] - X[two])


def test_sliding_inside_a_sheet_and_where_the_sheet_lies_in_the_plane():
    """An apex held to a plane moves along it where the roof's normal does, and not at all otherwise."""
    level = pyramid(on_plane=[4], plane=Plane((0, 0, 1.0)))
    assert frame_and_space(level)[1].dimension[4] == 0
    normal = np.array([1.0, 2.0, 2.0]) / 3.0
    slope = pyramid(on_plane=[4], plane=Plane((0, 0, 1.0), normal))
    space = frame_and_space(slope)[1]
    assert space.dimension[4] == 1
    up = np.array([0.0, 0.0, 1.0])
    along = up - (up @ normal) * normal
    np.testing.assert_allclose(np.abs(space.basis[4, 0] @ along), np.linalg.norm(along), rtol=1e-12)


def test_a_foot_that_runs_across_the_plane_slides_both_ways():
    """The end of a curve that stands upright on Π: both of its directions are along Π."""
    X = [[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 0]]
    walls = [[0, 5, 1], [0, 2, 5], [0, 5, 3], [0, 4, 5]]
    surface = Surface(
        X,
        walls,
        [0, 1, 2, 3],
        [Patch(f"wall {k}", 1.0, pressure=0.0) for k in range(4)],
        fixed=[0, 1, 2, 3, 4],
        on_plane=[5],
    )
    space = frame_and_space(surface)[1]
    assert space.dimension.tolist() == [0, 0, 0, 0, 0, 2]


@pytest.mark.parametrize("seed", range(3))
def test_the_space_turns_with_the_surface(seed):
    surface = shaken(three_patches(plane=TILTED), seed=seed)
    R = rotation(seed)
    shift = np.array([1.0, -2.0, 0.5])
    turned = placed(surface, R, shift)
    v = np.random.default_rng(seed).standard_normal((surface.n, 3))
    here, there = frame_and_space(surface)[1], frame_and_space(turned)[1]
    np.testing.assert_array_equal(here.dimension, there.dimension)
    np.testing.assert_allclose(there.project(v @ R.T), here.project(v) @ R.T, atol=1e-12)


def test_what_is_left_out_changes_no_shape():
    """Vertices of a folded plane may wander in it, and along the fold: E does not see it."""
    flat, faces = disc(4)
    random = np.random.default_rng(2)
    fold = np.abs(flat[:, 1]) < 1e-9
    flat = flat + 0.03 * random.standard_normal(flat.shape) * np.column_stack([fold + ~fold, ~fold])
    X = np.column_stack([flat, 0.7 * np.abs(flat[:, 1])])
    right = (flat[faces].mean(axis=1)[:, 1] > 0.0).astype(int)
    rim = np.hypot(*flat.T) > 0.9
    patches = [Patch("left", 2.0, pressure=0.4), Patch("right", 3.0)]
    surface = Surface(X, faces, right, patches, fixed=rim)
    _, space = frame_and_space(surface)
    assert {1, 2} <= set(space.dimension.tolist())
    forces = gradient(surface)
    np.testing.assert_allclose(forces - space.project(forces), 0.0, atol=1e-14)
    assert np.abs(forces).max() > 0.01


def test_a_wall_without_tension_has_no_motion_and_its_junction_is_one_smooth_sheet():
    surface = two_squares(4, alpha_aux=0.0)
    classes, space = frame_and_space(surface)
    wall = surface.patch_of_face == 2
    assert not classes.active[wall].any()
    assert classes.active[~wall].all()
    idle = np.setdiff1d(surface.faces[wall], surface.faces[~wall])
    assert classes.idle[idle].all()
    assert (space.dimension[idle] == 0).all()
    crest = np.setdiff1d(
        np.intersect1d(surface.faces[wall], surface.faces[~wall]), np.flatnonzero(surface.fixed)
    )
    assert (classes.kind[crest] == SHEET).all()
    assert (space.dimension[crest] == 1).all()


def test_a_seam_is_smooth_until_tension_or_pressure_differ():
    surface = seam()
    middle = [6, 7, 8]
    assert (vertex_classes(surface).kind[middle] == SHEET).all()
    assert (vertex_classes(surface.retensioned({"north": 3.0})).kind[middle] == CURVE).all()
    pushed = surface.retensioned(pressures={"north": 0.5})
    assert (vertex_classes(pushed).kind[middle] == CURVE).all()


def test_films_are_one_sheet_whichever_way_their_faces_run():
    """Where two patches ran against each other their normals cancelled, and with them the forces."""
    one, other = seam(), against()
    classes = vertex_classes(other)
    assert (classes.kind[[6, 7, 8]] == SHEET).all()
    turned = (classes.faces != other.faces).any(axis=1)
    assert set(other.patch_of_face[turned].tolist()) in ({0}, {1})
    held = [*range(6), *range(9, 15)]
    here, there = (
        solve(Surface(one.vertices, F, one.patch_of_face, other.patches, fixed=held))
        for F in (one.faces, other.faces)
    )
    assert there.converged
    np.testing.assert_allclose(there.surface.vertices, here.surface.vertices, atol=1e-12)
    # under pressure they are pushed apart: what they share is a curve
    pushed = other.retensioned(pressures={"south": 0.3, "north": 0.3})
    assert (vertex_classes(pushed).kind[[6, 7, 8]] == CURVE).all()


def moebius(count: int = 24) -> Surface:
    """A band of two patches with half a twist, its edge held; no way of running suits both ends."""
    angle = 2.0 * np.pi * np.arange(count) / count
    out = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    half = 0.3 * (np.cos(0.5 * angle)[:, None] * out + np.sin(0.5 * angle)[:, None] * [0, 0, 1])
    X = np.concatenate([out + half, out, out - half])
    F = []
    for i in range(count):
        here = [i, count + i, 2 * count + i]
        there = [i + 1, count + i + 1, 2 * count + i + 1] if i < count - 1 else [2 * count, count, 0]
        for a, b, c, d in zip(here, there, here[1:], there[1:], strict=False):
            F += [[a, b, c], [b, d, c]]
    half_way = np.repeat([0, 1], len(F) // 2)
    films = [Patch("first", 1.0, pressure=0.0), Patch("second", 1.0, pressure=0.0)]
    return Surface(X, F, half_way, films, fixed=[*range(count), *range(2 * count, 3 * count)])


def test_a_moebius_band_keeps_a_curve_where_its_side_changes():
    surface = moebius()
    classes = vertex_classes(surface)
    middle = np.flatnonzero(surface.free)
    assert np.count_nonzero(classes.kind[middle] == CURVE) == 1
    assert np.count_nonzero(classes.kind[middle] == SHEET) == len(middle) - 1
    result = solve(surface)
    assert result.converged
    seam = middle[classes.kind[middle] == CURVE]
    along = result.surface.vertices[classes.beside[np.isin(classes.curve, seam)]]
    left = gradient(result.surface)[seam]
    assert np.abs(np.cross(left, along[:, 1] - along[:, 0])).max() < 1e-10


def test_a_vertex_that_sheets_share_without_an_edge_moves_in_all_directions():
    """Along the sum of their normals alone it was at rest where each sheet still pulled it."""
    surface = touching()
    classes, space = frame_and_space(surface)
    assert classes.kind[4] == POINT
    assert space.dimension[4] == 3
    result = solve(surface)
    assert result.converged
    assert np.abs(gradient(result.surface)[4]).max() < 1e-11
    assert np.abs(gradient(surface)[4]).min() > 0.01


def test_a_crest_at_rest_is_a_curve_whatever_meets_there():
    surface = seam()
    classes = vertex_classes(surface, np.array([[6, 7], [7, 6], [7, 8], [8, 7]]))
    assert classes.kind[[6, 7, 8]].tolist() == [POINT, CURVE, POINT]
    assert motion_space(surface, classes, surface.vertices).dimension[[6, 7, 8]].tolist() == [3, 2, 3]


def test_where_a_standing_wall_begins_a_resting_vertex_keeps_to_the_crest():
    """Three curves meet there, two sheets' junction and the wall's foot; only the junction counts."""
    surface = solve(two_squares(6, alpha_aux=2.5), target="stationary").surface
    found = standing_part(surface)
    classes, resting = found.classes, found.resting
    links = resting_links(found.walls, resting)
    tip = np.unique(links[(found.walls.top_free & ~resting)[links[:, 1]], 0])
    assert len(tip) == 2
    assert (classes.kind[tip] == CURVE).all()
    space = motion_space(found.surface, classes, found.surface.vertices)
    assert (space.dimension[tip] == 1).all()
    one, two = found.surface.vertices[classes.beside[np.isin(classes.curve, tip)]].transpose(1, 0, 2)
    assert np.einsum("ij,ij->i", two - one, space.basis[tip, 0]) == pytest.approx(0.0, abs=1e-12)


def test_a_curve_that_turns_back_on_itself_moves_in_all_directions():
    surface = seam()
    classes = vertex_classes(surface, np.array([[7, 6], [7, 8]]))
    X = surface.vertices.copy()
    X[8] = 2 * X[7] - X[8]
    X[8] += X[6] - X[8]  # both neighbours in one place: no tangent
    assert motion_space(surface, classes, X).dimension[7] == 3


def test_the_residual_is_the_slope_of_the_energy_along_the_basis():
    surface = SURFACES["three patches, tilted"]()
    _, space = frame_and_space(surface)
    X = surface.vertices
    residual = space.to_coordinates(energy_and_gradient(surface, X)[1])
    s = np.random.default_rng(3).standard_normal(space.size)
    t = 1e-5
    slope = (
        energy(surface.moved(X + t * space.to_vectors(s)))
        - energy(surface.moved(X - t * space.to_vectors(s)))
    ) / (2 * t)
    assert residual @ s == pytest.approx(slope, rel=1e-8)


def test_force_scale_is_the_norm_of_the_triangles_forces():
    surface = pyramid(1.5)
    classes = vertex_classes(surface)
    # four triangles with sides 2, √3, √3: each corner is pulled with ½ α of the side opposite
    assert force_scale(surface, classes, surface.vertices) == pytest.approx(0.75 * np.sqrt(4 * 10.0))
    assert force_scale(surface, classes, 0 * surface.vertices) == 1.0
