"""Periodic surfaces: forces, second variation, volumes and index do not depend on how the cell is cut out."""

import numpy as np
import pytest
from convergence import orders
from nightly import at_night
from periodic_cases import bay, scattered, tube
from refusals import refused

import pcmc
from generators import kelvin_foam, minimal_cell, weaire_phelan_foam
from generators.cells import LATTICES
from pcmc import Patch, Room, Surface
from pcmc.base.errors import SurfaceError
from pcmc.certificate import Verdict
from pcmc.diagnostics import check_gradient, check_hessian
from pcmc.forces.functional import energy_and_gradient, patch_areas
from pcmc.forces.motion_space import MotionSpace
from pcmc.forces.rooms import room_volume_gradients, room_volumes
from pcmc.stability.equilibrium import Equilibrium

AREAS = {"P": 2.345102884, "D": 3.837785, "G": 3.091444}  # in the cube


def shaken(surface, size=0.01, seed=1):
    moves = np.random.default_rng(seed).standard_normal(surface.vertices.shape)
    return surface.moved(surface.vertices + size * surface.spread(moves))


@pytest.mark.parametrize("pressure", [0.0, 1.3])
def test_gradient_and_hessian_have_the_slopes_of_taylor(pressure):
    for cell in (
        minimal_cell("G").retensioned(None, {"film": pressure}),
        bay(4, pressure=pressure, weight=0.2),
    ):
        rough = shaken(cell, 0.003)
        assert check_gradient(rough).passed
        assert check_hessian(rough).passed


@pytest.mark.parametrize("kind", ["P", "D", "G"])
def test_forces_do_not_depend_on_which_vertices_stand_for_their_images(kind):
    cell = shaken(minimal_cell(kind).retensioned(None, {"film": 1.3}))
    other = scattered(cell, LATTICES[kind])
    one, two = (energy_and_gradient(surface)[1] for surface in (cell, other))
    here, there = (surface.original[surface.faces] for surface in (cell, other))
    assert two[there] == pytest.approx(one[here], abs=1e-13)
    assert not two[other.images[:, 0]].any()
    assert one.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-13)


def test_forces_and_energy_do_not_depend_on_the_origin():
    cell = shaken(minimal_cell("D").retensioned(None, {"film": 0.7}))
    away = cell.rebuilt(vertices=cell.vertices + np.array([3.1, -2.2, 0.7]))
    (e, g), (f, h) = map(energy_and_gradient, (cell, away))
    assert f == pytest.approx(e, rel=1e-13)
    assert h == pytest.approx(g, abs=1e-13)


def test_the_linearised_forces_are_the_derivative_of_the_forces():
    """To second order of the step."""
    cell = shaken(minimal_cell("P").retensioned(None, {"film": 1.3}))
    move = cell.spread(np.random.default_rng(2).standard_normal(cell.vertices.shape))
    at, errors = Equilibrium.of(cell), []
    for step in (1e-3, 5e-4):
        ahead, behind = (Equilibrium.of(cell.moved(cell.vertices + s * step * move)) for s in (1, -1))
        change = at.space.to_coordinates(ahead.unbalanced - behind.unbalanced) / (2.0 * step)
        errors.append(np.linalg.norm(change - at.jacobian(move)))
    assert orders(errors)[0] == pytest.approx(2.0, abs=0.1)


def test_curves_of_a_foam_turn_across_the_seam_as_inside():
    foam = shaken(kelvin_foam(1))
    other = scattered(foam, LATTICES["G"])
    residuals = [Equilibrium.of(surface).residual for surface in (foam, other)]
    assert residuals[1] == pytest.approx(residuals[0], rel=1e-10)


def test_images_have_the_motions_of_their_vertices():
    at = Equilibrium.of(shaken(minimal_cell("P")))
    assert np.linalg.norm(at.unbalanced) == pytest.approx(np.linalg.norm(at.forces), rel=1e-12)
    assert at.norm == pytest.approx(np.linalg.norm(at.forces), rel=1e-12)
    motion = at.space.to_vectors(np.random.default_rng(0).standard_normal(at.space.size))
    image, vertex = at.surface.images.T
    assert np.array_equal(motion[image], motion[vertex])
    assert at.space.project(motion) == pytest.approx(motion)
    assert not len(MotionSpace.of(np.zeros((1, 3, 3)), np.zeros(1, dtype=int)).original)


@pytest.mark.parametrize("kind", ["P", "D", "G"])
def test_volumes_of_what_wraps_around_a_cell(kind):
    """Of each labyrinth half the cell, however it is cut out."""
    half = 0.5 * np.linalg.det(LATTICES[kind])
    cell = minimal_cell(kind).rebuilt(rooms=[Room("inside", {"film": 1}, half)])
    for surface in (cell, scattered(cell, LATTICES[kind], 1), scattered(cell, LATTICES[kind], 2)):
        assert room_volumes(surface) == pytest.approx(half, rel=1e-12)
    rough, step = shaken(cell), 1e-6
    move = cell.spread(np.random.default_rng(3).standard_normal(cell.vertices.shape))
    ahead, behind = (room_volumes(rough.moved(rough.vertices + s * step * move))[0] for s in (1, -1))
    slope = float((room_volume_gradients(rough)[0] * move).sum())
    assert (ahead - behind) / (2.0 * step) == pytest.approx(slope, rel=1e-6)


def test_volumes_of_bubbles_are_those_of_voronoi_cells():
    """Of the points of A15: 125/1024 and 129/1024."""
    assert room_volumes(weaire_phelan_foam(0)) * 1024 == pytest.approx([125] * 2 + [129] * 5)


def test_volumes_are_exact_in_cells_that_are_sheared_and_turned_over():
    """x → x A + b takes each volume |det A| times."""
    foam, random = weaire_phelan_foam(0), np.random.default_rng(5)
    for A in random.standard_normal((6, 3, 3)):
        rooms = [
            Room(room.name, {name: int(sign * np.sign(np.linalg.det(A))) for name, sign in room.patches}, 1.0)
            for room in foam.rooms
        ]
        moved = foam.rebuilt(vertices=foam.vertices @ A + random.standard_normal(3), rooms=rooms)
        assert room_volumes(moved) == pytest.approx(abs(np.linalg.det(A)) * room_volumes(foam), rel=1e-12)


def test_the_volume_of_a_tube_is_its_section_times_its_length():
    errors = [room_volumes(tube(3.0, around))[0] - 3.0 * np.pi for around in (12, 24, 48)]
    assert orders(errors) == pytest.approx(2.0, abs=0.1)
    other = scattered(tube(3.0, 12), [[0, 0, 3]])
    assert room_volumes(other)[0] - 3.0 * np.pi == pytest.approx(errors[0], rel=1e-10)


def test_rooms_on_a_mesh_too_coarse_are_refused():
    """Both sides of a single layer of films cannot be the room's."""
    foam = kelvin_foam(0)
    film = foam.patches[0].name
    with refused(SurfaceError, what="rooms"):
        room_volumes(foam.rebuilt(rooms=[Room("half open", {film: 1}, 0.5)]))


@pytest.mark.parametrize("kind", ["P", "D", *at_night("G")])
def test_triply_periodic_minimal_surfaces(kind):
    """Area of order 2; index 1 in the cell, and 0 where the volumes of both sides are kept (Ross 1992)."""
    cells, errors = round(1.0 / np.linalg.det(LATTICES[kind])), []
    for levels in (1, 2, 3):
        found = pcmc.solve(minimal_cell(kind, levels), target="stationary")
        errors.append(cells * found.energy - AREAS[kind])
    assert orders(errors)[-1] == pytest.approx(2.0, abs=0.05)
    assert (found.certificate.verdict, found.certificate.index) == (Verdict.SADDLE, 1)
    half = Room("inside", {"film": 1}, 0.5 / cells)
    held = pcmc.certify(pcmc.solve(minimal_cell(kind, 2).rebuilt(rooms=[half])).surface)
    assert (held.verdict, held.index) == (Verdict.NEUTRAL, 0)
    assert Equilibrium.of(found.surface).rigid.shape[1] == 3


def test_kelvins_foam():
    """Area of a cell over volume^(2/3): 5.306 (Weaire and Phelan 1994)."""
    areas = []
    for levels in (1, 2, 3):
        found = pcmc.solve(kelvin_foam(levels))
        assert found.certificate.index == 0
        areas.append(2.0 * patch_areas(found.surface).sum() / 0.5 ** (2.0 / 3.0))
    assert (4.0 * areas[2] - areas[1]) / 3.0 == pytest.approx(5.3063, abs=1e-4)


@pytest.mark.nightly
def test_the_foam_of_weaire_and_phelan():
    """5.288 (Weaire and Phelan 1994); six bubbles of one pressure, and two of a higher one."""
    areas = []
    for levels in (0, 1, 2):
        found = pcmc.solve(weaire_phelan_foam(levels))
        areas.append(patch_areas(found.surface).sum())
    assert (4.0 * areas[2] - areas[1]) / 3.0 == pytest.approx(5.288, abs=5e-4)
    rooms = found.certificate.rooms
    assert rooms["difference"].abs().max() < 1e-12
    assert rooms["pressure"].to_numpy() == pytest.approx([0.3325] * 2 + [0.0] * 5, abs=2e-3)
    assert found.certificate.index == 0
    points = found.surface.topology.vertex_kind == 2
    assert points.sum() == 46


@pytest.mark.parametrize(("length", "index"), [(5.5, 0), (7.5, 2)])
def test_a_tube_pinches_where_it_is_longer_than_it_is_round(length, index):
    """Plateau and Rayleigh: at a fixed volume a period longer than 2π R has two ways down, cos and sin."""
    found = pcmc.solve(tube(length), target="stationary").certificate
    assert found.index == index
    free = pcmc.certify(pcmc.solve(tube(length, rooms=False), target="stationary").surface)
    assert free.index == index + 1


def test_a_bay_between_images_is_that_between_mirrors():
    one, two = (pcmc.solve(bay(8, mirrors, pressure=0.9, weight=0.05)) for mirrors in (False, True))
    assert one.converged
    assert one.energy == pytest.approx(two.energy, rel=1e-12)
    assert one.certificate.verdict is Verdict.STABLE
    assert one.certificate.support == pytest.approx(two.certificate.support, rel=1e-10)
    assert one.certificate.volume == pytest.approx(two.certificate.volume, rel=1e-10)
    force, moment = one.certificate.remainder
    assert force == pytest.approx(np.zeros(3), abs=1e-2)
    assert np.isnan(moment).all()  # the forces across the seam have moments
    assert "moments" not in str(one.certificate)
    assert len(one.certificate.supports) == 2


def test_a_wall_that_cannot_balance_says_so_also_between_images():
    """That a wall which comes down is not for a periodic surface would be no reason here."""
    roof = bay(4)
    top = np.flatnonzero(roof.vertices[:, 1] == 0.5)
    a, b, c, d = top[:-1], top[1:], roof.n + np.arange(1, 5), roof.n + np.arange(4)
    X = np.concatenate([roof.vertices, roof.vertices[top] * [1, 1, 0]])
    F = np.concatenate([roof.faces, np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    patch = (roof.vertices[roof.faces, 1].mean(axis=1) > 0.5).tolist() + 8 * [2]
    patches = [Patch("left", 1.0, -0.3), Patch("right", 3.0, -0.3), Patch("wall", 0.1, 0.0, wall=True)]
    fixed, images = [*np.flatnonzero(roof.fixed), *range(roof.n, len(X))], pcmc.images_in(X, [[1, 0, 0]])
    found = pcmc.solve(Surface(X, F, patch, patches, fixed, images=images)).certificate
    assert found.verdict is Verdict.NO_EQUILIBRIUM, found.detail


def test_the_height_of_a_vault_without_end():
    """That of a circle of radius α / p, to second order."""
    heights = [pcmc.solve(bay(n)).surface.vertices[:, 2].max() for n in (8, 16, 32)]
    assert orders(np.array(heights) - (1.0 - 0.75**0.5)) == pytest.approx(2.0, abs=0.1)


def test_curvature_is_that_of_the_whole_star_at_the_seam():
    cell = pcmc.solve(minimal_cell("P", 2), target="stationary").surface
    H = pcmc.mean_curvature(cell, "variational")
    assert np.abs(H).max() < 1e-8
    assert H[cell.images[:, 0]].tolist() == H[cell.images[:, 1]].tolist()


def test_junctions_of_a_foam_have_their_lengths_across_the_seam():
    """36 half edges of a truncated octahedron of edge √2/4, each shared by three: 12 edges in the cell."""
    table = pcmc.certify(kelvin_foam(1)).junctions
    assert table["length"].to_numpy() == pytest.approx([2**0.5 / 4] * 12)


def test_a_periodic_film_without_pressure_needs_no_support():
    film = minimal_cell("P")
    assert np.isnan(pcmc.certify(film).volume)
    assert isinstance(film.patches[0], Patch)
    assert pcmc.certify(pcmc.solve(film, target="stationary").surface).proofs == ()
