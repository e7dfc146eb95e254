"""Boundaries that slide on several planes: energy, derivatives, volumes, supports, and closed forms."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from programs import needs_evolver
from refusals import refused

import pcmc
from generators import schwarz_p, spherical_cap
from pcmc import Patch, Plane, Surface
from pcmc.base.errors import SurfaceError
from pcmc.certificate.balance import unheld
from pcmc.forces.flat_pieces import flat_pieces
from pcmc.forces.functional import energy_and_gradient, energy_at, patch_volumes, weighted
from pcmc.forces.jacobian import linearise
from pcmc.forces.motion_space import motion_space, vertex_classes
from pcmc.forces.pattern import hessian_pattern
from pcmc.forces.second_variation import assemble, hessian
from pcmc.meshing.local_refinement import refine_faces
from pcmc.meshing.refinement import refine
from pcmc.meshing.remeshing import remesh
from pcmc.surface.geometry import vertex_area_vectors
from pcmc.surface.supports import apply_supports
from studies.reference import evolver

TOP = Plane((0, 0, 2), (0, 0, 1), name="top")


def tube(rings=8, around=12, radius=1.0, tension=1.0, pressure=1.0, length=2.0, **supports):
    """A cylinder between z = 0 and z = ``length``, its ends sliding on two plates."""
    angle, z = 2 * np.pi * np.arange(around) / around, np.linspace(0.0, length, rings + 1)
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    X = np.concatenate([np.column_stack([ring, np.full(around, height)]) for height in z])
    i = np.arange(around * rings)
    right = i - i % around + (i + 1) % around
    F = np.concatenate(
        [np.stack([i, right, right + around], axis=1), np.stack([i, right + around, i + around], axis=1)]
    )
    ends = np.arange(around), np.arange(around) + around * rings
    top = Plane((0, 0, length), (0, 0, 1), name="top")
    supports = {"on_plane": ends[0], "on_planes": {top: ends[1]}} | supports
    return Surface(X, F, np.zeros(len(F), int), [Patch("tube", tension, pressure)], **supports)


def corner_roof(origin=(0.3, 0.2, 0.0), n=5):
    """A bulged square over [0,1]², its sides sliding on four upright planes; Π's point is on none of them."""
    t = np.linspace(0.0, 1.0, n)
    x, y = (axis.ravel() for axis in np.meshgrid(t, t, indexing="ij"))
    z = 1.0 + 0.2 * x * (1 - x) + 0.1 * y + 0.15 * x * y
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(n - 1), np.arange(n - 1), indexing="ij"))
    a = i * n + j
    F = np.concatenate([np.stack([a, a + n, a + n + 1], 1), np.stack([a, a + n + 1, a + 1], 1)])
    walls = {
        Plane((1, 0, 0), (1, 0, 0)): x == 1,
        Plane((0, 1, 0), (0, 1, 0)): y == 1,
        Plane((0, 0, 0), (1, 0, 0)): x == 0,
        Plane((0, 0, 0), (0, 1, 0)): y == 0,
    }
    half = x < 0.5
    patch = np.where(half[F].all(axis=1), 0, 1)
    patches = [Patch("left", 1.0, 0.7), Patch("right", 1.3, 0.7)]
    X = np.stack([x, y, z], axis=1)
    return Surface(X, F, patch, patches, plane=Plane(origin), on_planes=walls)


def random_motion(surface, seed):
    return apply_supports(surface, np.random.default_rng(seed).standard_normal(surface.vertices.shape))


CASES = {
    "plates": lambda: tube(rings=3, around=7),
    "room corners": corner_roof,
    "oblique": lambda: tube(
        rings=3,
        around=7,
        plane=Plane((0.2, 0, -1), (0, 0.3, 1)),
        on_plane=(),
        on_planes={TOP: np.arange(21, 28), Plane(normal=(0, 0, -1)): np.arange(7)},
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_taylor_slopes(case):
    surface = CASES[case]()
    d, X = random_motion(surface, 1), surface.vertices
    value, forces = energy_and_gradient(surface, X)
    second = float(d.ravel() @ (hessian(surface) @ d.ravel()))
    steps = 1e-2 * 0.5 ** np.arange(5)
    change = np.array([energy_at(surface, X + t * d) for t in steps]) - value
    first = np.abs(change - steps * (forces * d).sum())
    both = np.abs(change - steps * (forces * d).sum() - 0.5 * steps**2 * second)
    assert np.log2(first[:-1] / first[1:]).min() > 1.9
    assert np.log2(both[:-1] / both[1:]).min() > 2.8


@pytest.mark.parametrize("case", CASES)
def test_volumes_are_enclosed(case):
    """A boundary that slides within its planes changes V by what the moved triangles sweep, and no more."""
    surface = CASES[case]()
    assert flat_pieces(surface)
    X, d = surface.vertices, random_motion(surface, 2)
    area_vector = vertex_area_vectors(X, surface.faces)[0] / 3.0
    moving = weighted(surface, 0.0, -1.0)[1]
    assert abs(float(((moving - area_vector) * d).sum())) < 1e-12 * np.abs(d).sum()


def dense(space):
    """B as a matrix (3n, unknowns)."""
    return np.stack([space.to_vectors(row).ravel() for row in np.eye(space.size)], axis=1)


@pytest.mark.parametrize("case", CASES)
def test_assembled_hessian(case):
    surface = CASES[case]()
    classes = vertex_classes(surface)
    space = motion_space(surface, classes, surface.vertices)
    pattern = hessian_pattern(classes, space)
    data = assemble(surface, classes, space, pattern, surface.vertices)
    B = dense(space)
    assert np.abs(pattern.symmetric(data).toarray() - B.T @ (hessian(surface) @ B)).max() < 1e-13


@pytest.mark.parametrize("case", CASES)
def test_linearised_forces(case):
    """Bᵀ Df[d] is the derivative of the forces f = B Bᵀ ∇E, sliding boundaries included."""
    surface = CASES[case]()
    classes, X = vertex_classes(surface), surface.vertices

    def forces(X):
        return motion_space(surface, classes, X).project(energy_and_gradient(surface, X)[1])

    space = motion_space(surface, classes, X)
    here = linearise(surface, classes, space, X, energy_and_gradient(surface, X)[1])
    d = random_motion(surface, 3)
    d /= np.abs(d).max()
    t = 1e-5
    numeric = space.to_coordinates((forces(X + t * d) - forces(X - t * d)) / (2 * t))
    assert np.abs(here(d) - numeric).max() < 1e-8


@needs_evolver
@pytest.mark.parametrize("case", CASES)
def test_evolver_agrees(case):
    """Energy and forces with constraints, the content of the flat pieces and the corners between them."""
    surface = CASES[case]()
    assert evolver.energy(surface) == pytest.approx(pcmc.energy(surface), rel=1e-12)
    expected = pcmc.gradient(surface)
    np.testing.assert_allclose(evolver.gradient(surface), expected, rtol=0, atol=1e-12 * abs(expected).max())


def test_moving_sideways_changes_no_energy():
    """Between plates the tube may go anywhere: neither energy nor volume depends on where the origin is."""
    surface = tube(rings=3, around=7)
    shifted = surface.moved(surface.vertices + np.array([0.7, -0.4, 0.0]))
    assert pcmc.energy(shifted) == pytest.approx(pcmc.energy(surface), rel=1e-13)
    assert patch_volumes(surface)[0] == pytest.approx(7 * np.sin(2 * np.pi / 7), rel=1e-13)


def test_planes_through_the_origin_cost_nothing():
    walls = {Plane(normal=(1, 0, 0)): [0, 2], Plane(normal=(0, 1, 0)): [1, 2]}
    corner = Surface(
        [[0, 1, 0], [1, 0, 0], [0, 0, 1]],
        [[0, 1, 2]],
        [0],
        [Patch("a", 1.0)],
        on_plane=[0, 1],
        on_planes=walls,
    )
    assert not flat_pieces(corner)
    aside = Surface(
        corner.vertices + np.array([5, 6, 0]),
        corner.faces,
        [0],
        corner.patches,
        on_plane=[0, 1],
        on_planes={Plane((5, 0, 0), (1, 0, 0)): [0, 2], Plane((0, 6, 0), (0, 1, 0)): [1, 2]},
    )
    assert aside.origin.tolist() == [5.0, 6.0, 0.0]
    assert not flat_pieces(aside)
    assert patch_volumes(aside)[0] == pytest.approx(patch_volumes(corner)[0], rel=1e-12)


def arches():
    """Three sheets that meet in one edge between two feet on a plane beside Π; their pressures differ."""
    X = [[1, 0, 0.5], [1, 1, 0.5], [0, 0, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0], [1.2, 0.5, 2]]
    F = [[2, 0, 1], [2, 1, 3], [0, 4, 5], [0, 5, 1], [0, 1, 6]]
    patches = [Patch("left", 1.0, 0.3), Patch("right", 1.0, 0.5), Patch("fin", 1.0, 0.0)]
    beside = Plane((1, 0, 0), (1, 0, 0), name="beside")
    return Surface(X, F, [0, 0, 1, 1, 2], patches, [2, 3, 4, 5, 6], on_planes={beside: [0, 1]})


def test_an_arch_between_two_feet_on_a_plane_closes_nothing():
    """As in refinement, where its middle leaves the plane; only the boundary is closed along a plane."""
    surface = arches()
    assert not flat_pieces(surface)
    assert pcmc.energy(refine(surface)) == pytest.approx(pcmc.energy(surface), rel=1e-13)


@pytest.mark.parametrize("height", [0.05, 0.0, -0.0, 1.5, -0.05])
def test_datafiles_have_planes_at_any_height(tmp_path, height):
    """A formula "z = 05" would be the plane at 5."""
    surface = tube(3, 7)
    lid = Plane((0, 0, height), (0, 0, 1))
    X = surface.vertices + np.array([0.0, 0.0, height])
    moved = Surface(X, surface.faces, surface.patch_of_face, surface.patches, [8], on_planes={lid: range(7)})
    pcmc.write(tmp_path / "a.fe", moved)
    again = pcmc.read(tmp_path / "a.fe")
    assert again.on_planes[0][0].height([0, 0, height]) == pytest.approx(0.0, abs=1e-15)
    assert pcmc.energy(again) == pytest.approx(pcmc.energy(moved), rel=1e-12)


def test_supports_of_several_planes():
    roof = corner_roof()
    corners = np.isin(roof.vertices[:, :2], (0, 1)).all(axis=1)
    assert len(roof.meeting_lines) == 4
    np.testing.assert_array_equal(roof.fixed, corners)
    assert not roof.pinned.any()
    assert roof.held.sum() == 16
    space = motion_space(roof, vertex_classes(roof), roof.vertices)
    assert (space.dimension[corners] == 1).all()
    assert (space.basis[corners, 0] == [0.0, 0.0, 1.0]).all() or (space.basis[corners, 0, 2] == -1).any()


def test_tube_between_plates_is_a_cylinder():
    """At rest under the pressure p the radius is α / p, with an error of order 2; its volume is enclosed."""
    errors = []
    for n in (8, 16, 32):
        result = pcmc.solve(tube(n, 2 * n, radius=1.1), target="stationary")
        assert result.converged
        X = result.surface.vertices
        radius = np.linalg.norm(X[:, :2] - X[:, :2].mean(axis=0), axis=1)
        errors.append([np.abs(radius - 1.0).max(), abs(patch_volumes(result.surface)[0] - 2 * np.pi)])
    orders = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    assert (np.abs(orders - 2.0) < 0.1).all()


@pytest.mark.parametrize("method", ["nesterov", "lbfgs"])
def test_other_solvers_keep_to_the_planes(method):
    half = pcmc.cut(spherical_cap(edge_length=0.4), Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    expected = pcmc.solve(half)
    result = pcmc.solve(
        half, method=method, tolerance=1e-16, **{"lbfgs": {}}.get(method, {"iterations": 5000})
    )
    assert result.converged
    middle = half.on_planes[0][1]
    assert np.abs(result.surface.vertices[middle, 1]).max() < 1e-12
    top, same = (shape.surface.vertices[:, 2].max() for shape in (result, expected))
    assert top == pytest.approx(same, rel=1e-2)


def test_refining_and_remeshing_keep_the_planes():
    roof = corner_roof()
    for finer in (refine(roof), refine_faces(roof, [0, 5]), remesh(roof, 0.15)):
        assert [plane for plane, _ in finer.on_planes] == [plane for plane, _ in roof.on_planes]
        for plane, mask in finer.on_planes:
            near = np.abs(plane.height(finer.vertices)) < 1e-12
            np.testing.assert_array_equal(mask, near)
        assert finer.fixed.sum() == 4


@pytest.mark.parametrize("suffix", [".pcmc", ".fe", ".obj", ".ply"])
def test_files_keep_the_planes(tmp_path, suffix):
    for surface in (corner_roof(), tube(3, 7), schwarz_p(2)):
        pcmc.write(tmp_path / f"a{suffix}", surface)
        again = pcmc.read(tmp_path / f"a{suffix}")
        assert pcmc.energy(again) == pytest.approx(pcmc.energy(surface), rel=1e-13)
        np.testing.assert_array_equal(again.fixed, surface.fixed)
        np.testing.assert_array_equal(again.on_plane, surface.on_plane)
        for (plane, mask), (other, same) in zip(again.on_planes, surface.on_planes, strict=True):
            np.testing.assert_array_equal(mask, same)
            assert (plane.name, plane.mirror) == (other.name, other.mirror)
            assert np.abs(plane.height(surface.vertices[mask])).max() < 1e-12


def test_copies_keep_the_planes():
    roof = corner_roof()
    again = pickle.loads(pickle.dumps(roof))
    assert again.on_planes[0][0] == roof.on_planes[0][0]
    assert not again.given_supports.fixed.flags.writeable
    assert pcmc.energy(again) == pcmc.energy(roof)


def test_a_part_between_plates_cannot_shrink():
    film = tube(3, 7, pressure=0.0)
    assert unheld(film) is None
    onto_floor = tube(3, 7, pressure=0.0, on_planes={})
    assert unheld(onto_floor) is not None


def test_what_it_refuses():
    X, F, patches = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [Patch("a", 1.0)]
    with refused(SurfaceError, what="vertices", where=1):
        Surface(X, F, [0], patches, on_planes={Plane(normal=(1, 0, 0)): [1]})
    with refused(SurfaceError, what="vertices", where=0):  # on the one of two planes alone
        Surface(
            X, F, [0], patches, on_plane=[0], plane=Plane((0, 0, 1)), on_planes={Plane(normal=(0, 1, 0)): [0]}
        )
    three = {Plane((place, 0, 0), (1, 1, 0)): [0] for place in (0, 1)} | {Plane(normal=(0, 1, 0)): [0]}
    with refused(SurfaceError, what="on_planes", where=0) as caught:
        Surface(X, F, [0], patches, on_planes=three)
    assert "planes that do not meet" in str(caught.value)
    with refused(SurfaceError, what="plane"):
        Surface(X, F, [0], patches, plane=Plane(mirror=True))
    for wrong in (3, [3], {"x": [0]}):
        with refused(SurfaceError, what="on_planes"):
            Surface(X, F, [0], patches, on_planes=wrong)
