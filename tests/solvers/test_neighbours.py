"""Neighbours of a film swapped: closed forms before and after, undone swaps, roofs, and what is refused."""

import numpy as np
import pytest
from nightly import at_night
from periodic_cases import honeycomb, honeycomb_energy, scattered, steiner_films

import pcmc
from generators.cells import _foam
from pcmc.certificate.diagnosis import SWAP
from pcmc.forces.functional import patch_areas
from pcmc.meshing.elevation import elevate
from pcmc.meshing.local_refinement import refine_faces
from pcmc.meshing.neighbour_swap import swap
from pcmc.plan import Divider, Plan
from pcmc.solvers import solve_once

MEET = "'south-west' and 'south-east' now meet, and 'north-west' and 'north-east'"


def between_plates(films: pcmc.Surface) -> pcmc.Surface:
    """The same films between two plates that they slide on, instead of periodic."""
    height = films.vertices[:, 2]
    top = pcmc.Plane((0, 0, 1), (0, 0, 1), "top")
    return films.rebuilt(images=(), on_plane=height == 0.0, on_planes={top: height == 1.0})


@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize("width", [0.2, 0.56])
def test_a_film_that_vanishes_opens_the_other_way(width: float, periodic: bool) -> None:
    films = steiner_films(width, 1.0) if periodic else between_plates(steiner_films(width, 1.0))
    vanished = pcmc.solve(films)
    assert not vanished.converged
    swapped = pcmc.swap_neighbours(vanished.surface)
    assert swapped.kept
    assert swapped.surface is swapped.result.surface
    assert str(swapped).startswith(f"{MEET}; E = ")
    assert swapped.result.energy == pytest.approx(1.0 + width * 3**0.5, abs=1e-12)  # Steiner's tree, exact
    assert swapped.result.certificate.verdict is pcmc.Verdict.STABLE
    assert swapped.surface.periodic == periodic


def test_the_seam_of_the_cell_may_be_anywhere() -> None:
    films = scattered(steiner_films(1.0, 1.0).rebuilt(fixed=()), [[0, 0, 1]])
    held = films.rebuilt(fixed=np.isclose(np.abs(films.vertices[:, :2]), 0.5).all(axis=1))
    swapped = pcmc.swap_neighbours(held, "middle")
    assert swapped.result.energy == pytest.approx(1.0 + 3**0.5, abs=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_turned_and_renumbered_films_with_patches_turned_over(seed: int) -> None:
    films, rng = steiner_films(0.5, 1.0), np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    order, rows = rng.permutation(films.n), rng.permutation(films.m)
    faces = np.argsort(order)[films.faces]
    over = (rng.random(5) < 0.5)[films.patch_of_face]
    faces = np.where(over[:, None], faces[:, ::-1], faces)[rows]
    X = (films.vertices @ turn.T + rng.normal(size=3))[order]
    images, parts = pcmc.images_in(X, [turn[:, 2]]), (films.patch_of_face[rows], films.patches)
    other = pcmc.Surface(X, faces, *parts, fixed=films.fixed[order], images=images)
    swapped = pcmc.swap_neighbours(pcmc.solve(other).surface)
    assert swapped.result.energy == pytest.approx(1.0 + 0.5 * 3**0.5, abs=1e-12)


def cone(width: float, depth: float) -> pcmc.Surface:
    """The same films from the origin, where all end, up to a plate that they slide on."""
    films = between_plates(steiner_films(width, depth))
    X, height = films.vertices.copy(), films.vertices[:, 2]
    X[:, :2] *= height[:, None]
    number = np.where(height == 0.0, 0, np.arange(films.n))
    faces = number[films.faces]
    left = (faces[:, [1, 2, 0]] != faces).all(axis=1)
    used, faces = np.unique(faces[left], return_inverse=True)
    parts = films.patch_of_face[left], films.patches
    fixed, (top, on_top) = (films.fixed | (height == 0.0))[used], films.on_planes[0]
    return pcmc.Surface(X[used], faces.reshape(-1, 3), *parts, fixed, on_planes={top: on_top[used]})


def test_a_film_whose_junctions_have_an_end_in_common() -> None:
    swapped = pcmc.swap_neighbours(cone(0.5, 1.0), "middle")
    assert swapped.kept
    assert swapped.result.energy == pytest.approx(pcmc.solve(cone(1.0, 0.5)).energy, rel=1e-3)


def test_junctions_with_different_numbers_of_vertices() -> None:
    films = pcmc.solve(between_plates(steiner_films(0.5, 1.0))).surface
    finer = refine_faces(films, films.patch_faces([2, 3]))
    assert pcmc.swap_neighbours(finer).result.energy == pytest.approx(1.0 + 0.5 * 3**0.5, abs=1e-12)


def test_a_film_that_vanishes_again_is_put_back() -> None:
    films = pcmc.solve(steiner_films(2.0, 1.0)).surface  # wider than √3: no film along y is at rest
    swapped = pcmc.swap_neighbours(films, "middle")
    assert not swapped.kept
    assert swapped.surface is films
    assert str(swapped) == "undone, as nothing comes to rest after the swap: patch 'middle' vanishes again"


def test_swapped_twice_is_as_before() -> None:
    films = pcmc.solve(steiner_films(1.0, 1.0))
    once = pcmc.swap_neighbours(films.surface, "middle")
    twice = pcmc.swap_neighbours(once.surface, ["middle"])
    assert twice.kept
    assert twice.result.energy == pytest.approx(films.energy, abs=1e-12)
    assert "'south-west' and 'north-west' now meet, and 'south-east' and 'north-east'" in str(twice)


@pytest.mark.parametrize(("tension", "gone"), [(1.40, False), (1.43, True)])
def test_a_film_with_a_high_tension_does_not_open(tension: float, gone: bool) -> None:
    # at the middle of a square the sheets pull it with √2; with more, all four meet along one line
    films = steiner_films(1.0, 1.0).retensioned({"middle": tension})
    swapped = pcmc.swap_neighbours(pcmc.solve(films).surface, "middle")
    half = 0.5 * tension  # of the film's pull is balanced by a sheet at the angle of cos = half
    energy = 2.0 * 2**0.5 if gone else tension + 2.0 * (1.0 - half**2) ** 0.5
    assert swapped.result.energy == pytest.approx(energy, abs=1e-12)
    assert (len(swapped.surface.patches) == 4) == gone
    assert ("patch 'middle' is gone, and the four beside it meet at one junction" in str(swapped)) == gone


@pytest.mark.parametrize("shear", [1.1, *at_night(1.3)])
def test_a_honeycomb_sheared_on_becomes_that_of_the_next_lattice(shear: float) -> None:
    u, v = np.array([1.0, 0.0]), np.array([0.5 + shear * 0.75**0.5, 0.75**0.5])
    stopped = pcmc.solve(honeycomb(u, v))
    swapped = pcmc.swap_neighbours(stopped.surface, ["b00", "b01", "b10", "b11"])
    assert swapped.kept
    assert swapped.result.energy == pytest.approx(4.0 * honeycomb_energy(u, v - u), rel=1e-12)
    assert pcmc.room_volumes(swapped.surface) == pytest.approx(0.75**0.5, rel=1e-9)
    assert stopped.certificate.verdict.name == ("NEUTRAL" if stopped.converged else "DEGENERATE")
    assert pcmc.room_volumes(stopped.surface) == pytest.approx(0.75**0.5, rel=1e-6)


def test_energies_are_told_at_the_volumes_and_without_the_work_of_pressures() -> None:
    foam = honeycomb([1.0, 0.0], [0.5 + 1.1 * 0.75**0.5, 0.75**0.5])
    foam = pcmc.solve(foam.retensioned({"a00": 1.3})).surface
    swapped = pcmc.swap_neighbours(foam, ["b00", "b01", "b10", "b11"])
    assert np.abs(swapped.surface.pressures).max() > 0.1
    areas = [surface.tensions @ patch_areas(surface) for surface in (swapped.surface, foam)]
    assert str(swapped).endswith("E = {:.7g}, {:.7g} before".format(*areas))


def test_kelvins_foam_stretched_until_its_squares_vanish() -> None:
    sides = np.array([1.35, 0.9, 1.0 / (1.35 * 0.9)])
    cube = _foam(np.array([[0.0, 0.0, 0.0], [0.5, 0.5, 0.5]]), np.eye(3), 1, 1.0, 1.0)
    X = cube.vertices * sides
    vanished = pcmc.solve(cube.rebuilt(vertices=X, images=pcmc.images_in(X, np.diag(sides))))
    assert "and 1 more may vanish" in vanished.certificate.detail
    swapped = pcmc.swap_neighbours(vanished.surface)
    assert swapped.kept
    assert swapped.result.certificate.index == 0
    assert swapped.result.energy < vanished.energy - 0.005
    assert pcmc.room_volumes(swapped.surface) == pytest.approx(0.5, rel=1e-9)
    assert not swapped.surface.walls.any()  # whatever rounding makes of pressures that are 0
    assert not len(swapped.result.certificate.leaning)
    sentences = str(swapped).split("; ")
    assert len(set(sentences)) == len(sentences)


def roof(width: float, depth: float, **pressures: float) -> pcmc.Surface:
    """Four rooms below a raised rim; the wall "middle" along x is between those in south and north."""
    x, y = 0.5 * width, 0.5 * depth
    rim = [[-x, -y, 2.0], [x, -y, 2.0], [x, y, 2.0], [-x, y, 2.0]]
    ends, way = ([-0.5, 0.0], [0.5, 0.0]), 2.0
    lines = {
        "south-west": (rim[0][:2], ends[0]),
        "north-west": (rim[3][:2], ends[0]),
        "south-east": (rim[1][:2], ends[1]),
        "north-east": (rim[2][:2], ends[1]),
        "middle": ends,
    }
    walls = [Divider([*line], name=name, wall=way, bottom="sliding") for name, line in lines.items()]
    surface = Plan(rim, walls, edge_length=0.6, tension=6.0).surface()
    return surface.retensioned(pressures=pressures)


def name_at(surface: pcmc.Surface, x: float, y: float) -> str:
    """The room of the roof over a place."""
    middle = surface.vertices[surface.faces].mean(axis=1)
    far = np.linalg.norm(middle[:, :2] - [x, y], axis=1) + 1e9 * surface.walls[surface.patch_of_face]
    return surface.patches[surface.patch_of_face[far.argmin()]].name


def test_below_a_roof_two_rooms_become_neighbours() -> None:
    start = roof(3.2, 6.0)
    west, east = name_at(start, -1.2, 0.0), name_at(start, 1.2, 0.0)
    vanished = solve_once(start)
    sentence = f"patch 'middle' may vanish: '{west}' and '{east}' then meet; {SWAP}"
    assert sentence in vanished.certificate.detail
    swapped = pcmc.swap_neighbours(vanished.surface)
    assert swapped.kept
    assert str(swapped).startswith(f"'{west}' and '{east}' now meet; E = ")
    assert swapped.result.certificate.verdict is pcmc.Verdict.STABLE
    assert swapped.surface.walls.tolist() == start.walls.tolist()
    wall = swapped.surface.patch_index("middle")
    (ridge,) = (c for c in swapped.surface.topology.junctions if wall in c.sheets and min(c.sheets) < 4)
    assert len(ridge.vertices) > 3  # several columns of triangles, so that it can bend
    other = pcmc.solve(roof(6.0, 3.2))  # turned by 90°, on a mesh of its own
    assert swapped.result.energy == pytest.approx(other.energy, rel=2e-3)
    assert swapped.result.energy < vanished.energy


def test_the_pressure_of_the_new_wall_is_that_between_its_rooms() -> None:
    start = roof(3.8, 6.0)
    west = name_at(start, -1.5, 0.0)
    start = start.retensioned(pressures={west: 1.05, name_at(start, 0.0, 2.0): 1.02})
    assert not start.uncancelled.any()
    swapped, _ = swap(solve_once(start).surface, "middle")
    assert not swapped.uncancelled.any()
    assert abs(swapped.patches[swapped.patch_index("middle")].pressure) == pytest.approx(0.05, abs=1e-12)
    assert pcmc.solve(swapped).converged


def test_what_cannot_be_swapped_is_refused_in_a_line() -> None:
    films = steiner_films(1.0, 1.0)
    for given, name, sentence in (
        (films, "midle", "unknown patch 'midle'; did you mean 'middle'?"),
        (films, "south-west", "patch 'south-west' is no film between two junctions"),
        (films.rebuilt(fixed=np.ones(films.n, dtype=bool)), "middle", "held at different places"),
        (films, 5, "patches: expected the name of a film, or a list of names, found 5"),
        (films, None, "no film between two junctions has vanished; name the one to swap"),
        (elevate(between_plates(films), 2), "middle", "order"),
    ):
        with pytest.raises(pcmc.errors.PcmcError, match=sentence) as refused:
            pcmc.swap_neighbours(given, name)
        assert "\n" not in str(refused.value)
    plates = between_plates(films)
    end = int(plates.topology.junctions[0].vertices[0])
    beside = int(plates.topology.edges[(plates.topology.edges == end).any(axis=1)].max())
    cabled = plates.rebuilt(cables=[pcmc.Cable("stay", 0.1, [[end, beside]])])
    with pytest.raises(pcmc.errors.SurfaceError, match="cable 'stay' runs on or to patch 'middle'"):
        swap(cabled, "middle")
