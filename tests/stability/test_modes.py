"""Morse index and lowest modes against dense eigenvalues and closed forms; rigid motions set apart."""

import numpy as np
import pytest
import scipy.linalg
from motion_cases import SURFACES, TILTED
from shapes import disc, pyramid, rotation, shaken, three_patches
from starts import double_bubble, sphere, two_squares

import pcmc
from generators import four_fans
from pcmc import Patch, Surface, certify, hessian, mirrored, solve
from pcmc.forces.motion_space import motion_space, vertex_classes
from pcmc.forces.pattern import Pattern
from pcmc.forces.rigid_motions import rigid_modes, rigid_motions
from pcmc.plan import Plan
from pcmc.stability import modes
from pcmc.stability.bordered import negatives_without
from pcmc.stability.equilibrium import Equilibrium
from pcmc.stability.factorisation import factoriser
from pcmc.stability.modes import lowest

pytestmark = pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")

LARGER = ("three patches", "three patches, tilted", "wall without tension", "bubbles")


def system_of(surface, backend=None):
    return Equilibrium.of(surface, backend).factorised()


def dense_pencil(surface, system):
    """BᵀHB and M on the complement of the rigid motions, and the basis Z of that."""
    B = np.stack(
        [system.of.space.to_vectors(column).ravel() for column in np.eye(len(system.of.mass))], axis=1
    )
    H = B.T @ hessian(surface).toarray() @ B
    Z = scipy.linalg.null_space(system.of.excluded.T) if system.of.excluded.shape[1] else np.eye(len(H))
    return Z.T @ H @ Z, Z.T @ (system.of.mass[:, None] * Z), Z


def flat_disc(rings, tension=2.0):
    flat, faces = disc(rings)
    patch = Patch("film", tension, pressure=0.0)
    rim = np.hypot(*flat.T) > 1 - 1e-9
    return Surface(np.column_stack([flat, 0 * flat[:, 0]]), faces, [0] * len(faces), [patch], fixed=rim)


@pytest.mark.parametrize("backend", [None, "superlu"])
@pytest.mark.parametrize("name", LARGER)
def test_index_and_lowest_modes_are_those_of_the_dense_pencil(name, backend):
    surface = SURFACES[name]()
    system = system_of(surface, backend=backend)
    H, M, Z = dense_pencil(surface, system)
    values, vectors = scipy.linalg.eigh(H, M)
    assert system.negative == (values < 0).sum()
    count = system.negative + 1
    found, modes = lowest(system, count)
    np.testing.assert_allclose(found, values[:count], atol=1e-9 * np.abs(values).max())
    assert modes.shape == (count, surface.n, 3)
    mass = np.zeros(surface.n)
    mass[np.repeat(np.arange(surface.n), system.of.space.dimension)] = system.of.mass
    gram = np.einsum("ivd,jvd,v->ij", modes, modes, mass)
    np.testing.assert_allclose(gram, np.eye(count), atol=1e-9)
    s = np.stack([system.of.space.to_coordinates(mode) for mode in modes], axis=1)
    np.testing.assert_allclose(system.of.excluded.T @ s, 0.0, atol=1e-9)
    wholly = Z @ vectors[:, :count]
    residue = s - wholly @ (wholly.T @ (system.of.mass[:, None] * s))
    np.testing.assert_allclose(residue, 0.0, atol=1e-6)


@pytest.mark.parametrize("name", ["three patches, tilted", "wall without tension"])
def test_the_matrix_and_the_mass_are_whole(name):
    surface = SURFACES[name]()
    system = system_of(surface)
    H = dense_pencil(surface, system)[0]
    np.testing.assert_allclose(system.matrix.toarray(), H, atol=1e-13 * np.abs(H).max())
    corners = surface.vertices[system_faces(surface)]
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    mass = np.bincount(system_faces(surface).ravel(), np.repeat(doubled / 6.0, 3), surface.n)
    np.testing.assert_allclose(system.of.mass, np.repeat(mass, system.of.space.dimension), rtol=1e-12)


def system_faces(surface):
    return vertex_classes(surface).faces


@pytest.mark.parametrize("seed", range(5))
def test_negatives_on_the_complement_of_any_columns(seed):
    random = np.random.default_rng(seed)
    A = random.standard_normal((12, 12))
    A = A + A.T
    Q = np.linalg.qr(random.standard_normal((12, seed)))[0]
    rows, columns = np.triu_indices(12)
    pattern = Pattern(
        np.searchsorted(rows, np.arange(13)).astype(np.int32), columns.astype(np.int32), np.empty((0, 3))
    )
    factor = factoriser(pattern).factor(A[rows, columns])
    Z = scipy.linalg.null_space(Q.T) if seed else np.eye(12)
    assert negatives_without(factor, Q) == (np.linalg.eigvalsh(Z.T @ A @ Z) < 0).sum()


def test_a_flat_film_vibrates_as_a_drum():
    """λ = α (j₀₁/R)² with j₀₁ = 2.404826, approached at second order in the edge length."""
    exact = 2.0 * 2.404825557695773**2
    error = []
    for rings in (4, 8, 16):
        system = system_of(flat_disc(rings))
        assert system.negative == 0
        error.append(abs(lowest(system, 1)[0][0] - exact))
    order = np.log2(np.array(error[:-1]) / error[1:])
    assert order == pytest.approx(2.0, abs=0.15)


def test_a_bubble_has_the_eigenvalues_of_the_sphere():
    """λ = α (l(l+1) - 2)/r²: one way down, l = 0; no cost for l = 1; five equal ones for l = 2."""
    error, triangles = [], []
    for edge in (0.8, 0.4):
        surface = sphere(edge, exact=True)
        system = system_of(surface)
        assert (system.negative, system.of.excluded.shape[1]) == (1, 3)
        values, _ = lowest(system, 6)
        assert values[1:] == pytest.approx(1.0, abs=2e-3)
        assert np.ptp(values[1:]) < 1e-9
        error.append(abs(values[0] + 0.5))
        triangles.append(surface.m)
    order = 2 * np.log(error[0] / error[1]) / np.log(triangles[1] / triangles[0])
    assert order == pytest.approx(2.0, abs=0.1)


def test_runs_repeat_to_the_last_bit():
    first, second = (lowest(system_of(SURFACES["three patches"]()), 3) for _ in range(2))
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(first[1], second[1])


EQUATOR = np.flatnonzero(np.abs(sphere(1.6, exact=True).vertices[:, 2]) < 1e-9)


def held(fixed, sliding):
    surface = sphere(1.6, exact=True)
    parts = (surface.vertices, surface.faces, surface.patch_of_face, surface.patches)
    return Surface(*parts, fixed=list(fixed), on_plane=list(sliding))


@pytest.mark.parametrize(
    ("fixed", "sliding", "left"),
    [((), (), 6), ((0,), (), 3), ((0, 1), (), 1), ((0, 1, 2), (), 0), ((), EQUATOR[:1], 5), ((), EQUATOR, 3)],
)
def test_rigid_motions_that_supports_leave_free(fixed, sliding, left):
    surface = held(fixed, sliding)
    motions = rigid_motions(surface)
    assert motions.shape == (left, 2, 3)
    arm = surface.vertices - surface.vertices.mean(axis=0)
    for translation, turn in motions:
        field = translation + np.cross(turn, arm)
        np.testing.assert_allclose(field[list(fixed)], 0.0, atol=1e-9)
        np.testing.assert_allclose(field[list(sliding), 2], 0.0, atol=1e-9)
        assert np.abs(field).max() > 0.1
    assert np.linalg.matrix_rank(motions.reshape(left, 6), tol=1e-6) == left


def test_a_roof_of_one_unknown_has_one_mode():
    values, vectors = lowest(system_of(pyramid()), 1)
    assert values.shape == (1,)
    assert np.count_nonzero(np.linalg.norm(vectors[0], axis=1)) == 1


def test_an_ordinary_roof_has_no_rigid_motion():
    for surface in (pyramid(), two_squares(3), three_patches(plane=TILTED)):
        assert len(rigid_motions(surface)) == 0
        assert system_of(surface).of.excluded.shape[1] == 0


def test_a_flat_half_does_not_turn_about_its_masts():
    """The first step of that turn keeps points in the mirror plane. It is the lowest mode of the whole."""
    rim, side = [[0, 0], [6, 0], [6, 8], [0, 8]], [[[6, 0], [6, 8]]]
    sail = {"edge": "cable", "cable": 16.0, "supports": [[0, 0], [0, 8]], "tension": 1.0, "pressure": 0.0}
    half = solve(Plan(rim, mirrors=side, edge_length=2.0, **sail).surface())
    assert len(rigid_motions(half.surface)) == 0
    whole = certify(mirrored(half.surface))
    assert half.certificate.eigenvalues[0] == pytest.approx(whole.eigenvalues[0], rel=1e-6)


def test_a_spheres_turning_only_slides_it():
    surface = sphere(0.8, exact=True)
    space = motion_space(surface, vertex_classes(surface), surface.vertices)
    Q = rigid_modes(space, rigid_motions(surface), surface.vertices)[0]
    assert Q.shape == (space.size, 3)
    np.testing.assert_allclose(Q.T @ Q, np.eye(3), atol=1e-12)
    shift = space.to_coordinates(np.tile([1.0, 2.0, 3.0], (surface.n, 1)))
    np.testing.assert_allclose(Q @ (Q.T @ shift), shift, atol=1e-12 * np.linalg.norm(shift))


def test_a_double_bubble_turns_about_its_axis_unseen():
    surface = double_bubble(0.8, exact=True)
    R = rotation(4)
    turned = surface.moved(surface.vertices @ R.T)
    for bubbles in (surface, turned):
        assert system_of(bubbles).of.excluded.shape[1] == 5


def test_index_does_not_count_rigid_motions():
    surface = shaken(sphere(0.8, exact=True), 0.01)
    system = system_of(surface)
    assert system.negative == 1
    assert negatives_without(system.factor, np.zeros((len(system.of.mass), 0))) >= 1


def test_modes_of_equal_eigenvalues_do_not_depend_on_rounding(monkeypatch):
    """The cross of walls leans sideways in two directions alike: any mixture of both is a mode."""
    surface = pcmc.solve(four_fans(rings=7), target="stationary").surface
    eigsh, found = modes.eigsh, []
    for angle in (0.0, 0.4, 2.0):

        def turned(*given, _angle=angle, **options):
            values, vectors = eigsh(*given, **options)
            pair = np.flatnonzero(values < 0.0)
            turn = np.array([[np.cos(_angle), -np.sin(_angle)], [np.sin(_angle), np.cos(_angle)]])
            vectors[:, pair] = vectors[:, pair] @ turn
            return values, vectors

        monkeypatch.setattr(modes, "eigsh", turned)
        found.append(pcmc.certify(surface))
    assert found[0].index == 2
    for other in found[1:]:
        np.testing.assert_allclose(other.modes, found[0].modes, atol=1e-6 * np.abs(found[0].modes).max())
        assert other.detail == found[0].detail
