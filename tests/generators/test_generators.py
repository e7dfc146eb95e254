"""The examples and closed forms: their numbers, their meshes, their supports and their exact solutions."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from nightly import at_night
from refusals import refused

import generators
from generators import calibration, fans
from generators.calibration import PRINTED
from pcmc import energy, gradient
from pcmc.base.errors import OptionError
from pcmc.forces.functional import patch_areas, volume
from pcmc.meshing.quality import edge_lengths

# Smallest angle, degrees: of the patches under pressure, and of the walls. A wall's follow from the
# height that it is given over its columns, down to the tip of a right triangle of 8 by 20.
BOUNDS = {
    "two_squares": ({"n": (3, 4, 5, 8, 16, 33)}, 35.0, 33.0),
    "two_caps": ({"edge_length": (1.2, 0.8, 0.5, 0.36, 0.2)}, 32.0, 11.0),
    "four_fans": ({"rings": (5, 7, 10, 13, 14, 28)}, 33.0, 21.8),
    "three_patches": ({"rings": (5, 8, 12)}, 33.0, 21.8),
    "bezier_hall": ({"edge_length": (8.0, 5.0, 3.5, 2.0)}, 25.0, 33.0),
    "spherical_cap": ({"edge_length": (0.2, 0.1, 0.05)}, 44.0, None),
    "joined_caps": ({"edge_length": (1.0, 0.5, 0.25)}, 27.0, 25.0),
    "double_bubble": ({"edge_length": (0.8, 0.4, 0.2)}, 36.0, 36.0),
    "sphere": ({"edge_length": (0.8, 0.4, 0.2)}, 50.0, None),
}
CASES = [
    pytest.param(name, {key: value}, patches, walls, id=f"{name}-{value}")
    for name, (values, patches, walls) in BOUNDS.items()
    for key, members in values.items()
    for value in members
]
CLOSED = ("double_bubble", "sphere")
EXACT = ("spherical_cap", "joined_caps", "double_bubble", "sphere")


def angles(surface, auxiliary):
    """Every angle of the walls, or of the other patches, in degrees."""
    chosen = [i for i, patch in enumerate(surface.patches) if patch.auxiliary == auxiliary]
    corners = surface.vertices[surface.faces[surface.patch_faces(chosen)]]
    a, b = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=2), (a * b).sum(axis=2)))


def used_by(surface, name):
    """The vertices of a patch, as a mask."""
    mask = np.zeros(surface.n, dtype=bool)
    mask[surface.faces[surface.patch_of_face == surface.patch_index(name)]] = True
    return mask


@pytest.mark.parametrize(("name", "arguments", "patches", "walls"), CASES)
def test_triangles_are_good(name, arguments, patches, walls):
    surface = getattr(generators, name)(**arguments)
    assert angles(surface, auxiliary=False).min() > patches
    if walls is not None:
        assert angles(surface, auxiliary=True).min() > walls


@pytest.mark.parametrize("name", BOUNDS)
def test_pressure_pushes_up_and_out(name):
    surface = getattr(generators, name)()
    normals = np.cross(
        surface.vertices[surface.faces[:, 1]] - surface.vertices[surface.faces[:, 0]],
        surface.vertices[surface.faces[:, 2]] - surface.vertices[surface.faces[:, 0]],
    )
    pressed = surface.pressures[surface.patch_of_face] > 0.0
    centroids = surface.vertices[surface.faces].mean(axis=1)
    outwards = centroids if name in CLOSED else [0.0, 0.0, 1.0]
    assert ((normals * outwards).sum(axis=1)[pressed] > 0.0).all()
    assert volume(surface) > 0.0


@pytest.mark.parametrize("name", BOUNDS)
def test_the_same_twice(name):
    one, two = (getattr(generators, name)() for _ in range(2))
    assert one.vertices.tobytes() == two.vertices.tobytes()
    assert one.faces.tobytes() == two.faces.tobytes()


@pytest.mark.parametrize("name", BOUNDS)
def test_walls_hang_on_their_junctions(name):
    surface = getattr(generators, name)()
    topology = surface.topology
    assert not topology.seam_edge.any()
    for i, patch in enumerate(surface.patches):
        if patch.auxiliary:
            mine = [curve for curve in topology.junctions if i in curve.sheets]
            assert len(mine[0].sheets) >= 3
    assert len(np.unique(topology.components)) == 1
    if name not in CLOSED:
        assert (topology.on_boundary == (surface.fixed | surface.on_plane)).all()


def test_two_squares_is_the_papers():
    surface = generators.two_squares()
    X = surface.vertices
    assert np.ptp(X, axis=0).tolist() == [8.0, 4.0, 1.0]
    assert (edge_lengths(surface) >= 0.74).all()
    assert surface.tensions.tolist() == [2.0, 2.0, 2.0]
    assert surface.pressures.tolist() == [1.0, 1.0, 0.0]
    outline = (np.abs(X[:, 0]) == 4.0) | (np.abs(X[:, 1]) == 2.0)
    assert (surface.fixed == outline).all()
    assert (X[surface.fixed, 2] == 0.0).all()
    assert X[surface.on_plane, 0].tolist() == [0.0] * 3
    (junction,) = surface.topology.junctions
    assert junction.vertices.size == 5
    assert X[junction.vertices, 2].max() == X[:, 2].max() == 1.0


@pytest.mark.parametrize("diagonals", ["symmetric", "parallel"])
def test_two_squares_cover_their_plan(diagonals):
    surface = generators.two_squares(6, diagonals=diagonals, height=1e-9)
    assert patch_areas(surface)[:2] == pytest.approx([16.0, 16.0], rel=1e-12)
    assert surface.patch_faces([0, 1]).sum() == 4 * 36


@pytest.mark.parametrize("n", [3, 4, 5])
def test_the_two_squares_are_mirror_images(n):
    """Else the junction is pulled to one side, and over a wall that is down it slides away."""
    surface = generators.two_squares(n)
    middles = surface.vertices[surface.faces[surface.patch_of_face < 2]].mean(axis=1).round(9) + 0.0
    image = np.unique(middles * [-1, 1, 1] + 0.0, axis=0)
    np.testing.assert_array_equal(image, np.unique(middles, axis=0))


def test_symmetric_diagonals_leave_no_triangle_that_cannot_move():
    held = {
        diagonals: generators.two_squares(4, diagonals=diagonals) for diagonals in ("symmetric", "parallel")
    }
    stuck = {k: s.fixed[s.faces].all(axis=1).sum() for k, s in held.items()}
    assert stuck == {"symmetric": 0, "parallel": 2}


def test_two_caps_are_the_papers_spheres():
    surface = generators.two_caps()
    X = surface.vertices
    for name, centre, radius, floor in (
        ("large", (-5.0, 0.0, -17.5), 18.5, 6.0),
        ("small", (3.0, 0.0, -7.5), 8.5, 4.0),
    ):
        mine = used_by(surface, name)
        assert np.linalg.norm(X[mine] - centre, axis=1) == pytest.approx(radius, rel=1e-14)
        rim = X[mine & surface.fixed]
        assert np.hypot(rim[:, 0] - centre[0], rim[:, 1]) == pytest.approx(floor, rel=1e-14)
    (junction,) = surface.topology.junctions
    Y = X[junction.vertices]
    assert Y[:, 0] == pytest.approx(0.25 - 1.25 * Y[:, 2], abs=1e-13)
    assert np.abs(Y[[0, -1], 1]) == pytest.approx(np.sqrt(8.4375))
    assert Y[:, 2].max() == pytest.approx(0.3697, abs=2e-3)
    assert surface.tensions.tolist() == [4.0, 3.0, 4.0]
    assert (X[surface.on_plane, 2] == 0.0).all()


def test_the_caps_wall_is_upright_or_inclined():
    upright, inclined = (generators.two_caps(0.8, wall=w) for w in ("upright", "inclined"))
    foot = inclined.vertices[inclined.on_plane]
    assert foot[:, 0] == pytest.approx(0.25, abs=1e-14)
    mine = inclined.vertices[used_by(inclined, "wall")]
    assert mine[:, 0] == pytest.approx(0.25 - 1.25 * mine[:, 2], abs=1e-13)
    assert upright.vertices[upright.on_plane, 0].min() < 0.0
    assert patch_areas(inclined)[2] > patch_areas(upright)[2]


@pytest.mark.parametrize("mesh", ["rings", "even", "double", "lattice"])
def test_four_fans_are_the_papers(mesh):
    surface = generators.four_fans(7, mesh=mesh)
    X = surface.vertices
    assert patch_areas(surface)[4:] == pytest.approx(80.0, rel=1e-13)
    assert np.hypot(*X[surface.fixed, :2].T) == pytest.approx(20.0, rel=1e-14)
    assert (X[surface.fixed, 2] == 0.0).all()
    for i in range(4):
        wall = X[used_by(surface, f"wall {i + 1}")]
        assert (wall[:, 1 - i % 2] == 0.0).all()
        assert (np.hypot(wall[:, 0], wall[:, 1]) / 20.0 + wall[:, 2] / 8.0).max() < 1.0 + 1e-14
    quarter = np.stack([-X[:, 1], X[:, 0], X[:, 2]], axis=1)
    key = lambda Y: np.sort(Y.round(9) @ [1.0, 1e3, 1e6])  # noqa: E731
    np.testing.assert_allclose(key(quarter), key(X), atol=1e-5)
    centre = [curve for curve in surface.topology.junctions if len(curve.sheets) == 4]
    assert len(centre) == 1
    assert np.ptp(X[centre[0].vertices], axis=0).tolist() == [0.0, 0.0, 8.0]


def test_fans_start_as_soap_films_or_bulge_out_of_a_cone():
    film, cone, sag = (generators.four_fans(10, bulge=b) for b in (None, 0.0, -1.0))
    r = np.hypot(*cone.vertices[:, :2].T)
    roof = cone.topology.interior & ~cone.on_plane
    roof &= ~np.any([used_by(cone, f"wall {i}") for i in (1, 2, 3, 4)], axis=0)
    np.testing.assert_allclose(cone.vertices[roof, 2], 8.0 * (1.0 - r[roof] / 20.0), atol=1e-13)
    assert (sag.vertices[roof, 2] < cone.vertices[roof, 2]).all()
    soap = film.retensioned(pressures={f"fan {i}": 0.0 for i in (1, 2, 3, 4)})
    pull = np.abs(gradient(soap)[roof])
    assert pull[:, 2].max() < 1e-9 * 10.0
    areas = [patch_areas(surface)[0] for surface in (film, sag, cone)]
    assert areas == sorted(areas)


def test_three_patches_meet_at_120_degrees():
    surface = generators.three_patches()
    feet = surface.vertices[surface.on_plane]
    angle = np.degrees(np.arctan2(feet[:, 1], feet[:, 0]))[np.hypot(*feet[:, :2].T) > 1e-9]
    assert set(angle.round(6) + 0.0) == {0.0, 120.0, -120.0}
    sheets = sorted(len(curve.sheets) for curve in surface.topology.junctions)
    assert sheets == [3, 3, 3, 3]
    assert surface.topology.valence.max() == 3


@pytest.mark.parametrize("edge_length", [8.0, 3.5, 2.3])
def test_the_hall_fills_its_box_at_every_resolution(edge_length):
    surface = generators.bezier_hall(edge_length)
    assert np.ptp(surface.vertices, axis=0) == pytest.approx([190.22, 101.56, 29.17], abs=1e-12)
    names = [patch.name for patch in surface.patches]
    assert names == ["left", "middle", "right", "left wall", "right wall"]
    assert surface.tensions.tolist() == [30.0, 30.0, 30.0, 10.0, 15.0]


def test_the_halls_boundaries_are_fixed_and_not_plane():
    surface = generators.bezier_hall()
    assert not surface.on_plane.any()
    assert (surface.fixed == surface.topology.on_boundary).all()
    X = surface.vertices
    hole = X[surface.fixed & used_by(surface, "middle")]
    hole = hole[np.hypot(hole[:, 0] - 97.5, hole[:, 1] - 54.0) < 25.0]
    for curve in (X[surface.fixed], hole, X[surface.topology.junctions[0].vertices]):
        centred = curve - curve.mean(axis=0)
        assert np.linalg.svd(centred, compute_uv=False)[2] > 1.0
    for wall in ("left wall", "right wall"):
        foot = X[used_by(surface, wall) & surface.fixed]
        assert np.ptp(foot[:, 2]) > 2.0
        assert np.ptp(foot[:, 0]) > 0.5


def test_the_cap_has_its_closed_form():
    cap = generators.spherical_cap_exact()
    assert cap.energy == pytest.approx(1.5039191689, abs=5e-11)
    assert cap.height == pytest.approx(0.5366750419, abs=5e-11)
    hemisphere = generators.spherical_cap_exact(radius=2.0, alpha=1.0)
    assert hemisphere.area == pytest.approx(8.0 * np.pi)
    assert hemisphere.volume == pytest.approx(16.0 / 3.0 * np.pi)


@pytest.mark.parametrize("name", EXACT)
def test_vertices_can_start_on_the_exact_solution(name):
    exact = getattr(generators, f"{name}_exact")()
    on, off = (getattr(generators, name)(exact=e) for e in (True, False))
    assert exact.distance(on).max() < 1e-13 * on.size
    assert exact.distance(off).max() > 0.01 * off.size
    if name not in CLOSED:
        assert on.vertices[:, 2].max() == pytest.approx(exact.height, rel=0.01)
    else:
        assert np.ptp(on.vertices[:, 2]) == pytest.approx(exact.height, rel=0.01)


@pytest.mark.parametrize(
    "tensions", [*at_night(((4, 3, 3, 4.5),), ((4, 4, 1, 5),)), (4, 3, 2, 4), (3, 4, 2, 4)]
)
def test_joined_caps_approach_their_closed_form_in_second_order(tensions):
    names = ("alpha_left", "alpha_right", "alpha_aux", "depth")
    values = dict(zip(names, tensions, strict=True))
    exact = generators.joined_caps_exact(**values)
    surfaces = [generators.joined_caps(h, exact=True, **values) for h in (0.5, 0.25)]
    assert_second_order(exact, surfaces)


@pytest.mark.parametrize("tensions", [(1, 1, 1), (1.2, 0.8, 0.7), (0.8, 1.2, 0.7)])
def test_bubbles_approach_their_closed_form_in_second_order(tensions):
    values = dict(zip(("alpha_left", "alpha_right", "alpha_aux"), tensions, strict=True))
    exact = generators.double_bubble_exact(**values)
    surfaces = [generators.double_bubble(h, exact=True, **values) for h in (0.2, 0.1)]
    assert_second_order(exact, surfaces)


@pytest.mark.parametrize("name", ["spherical_cap", "sphere"])
def test_spheres_approach_their_closed_form_in_second_order(name):
    exact = getattr(generators, f"{name}_exact")()
    surfaces = [getattr(generators, name)(h, exact=True) for h in (0.1, 0.05)]
    assert_second_order(exact, surfaces)


def assert_second_order(exact, surfaces):
    """Energy, area and volume err by 4 times less on the finer mesh, for its edges are half as long."""
    h = [edge_lengths(surface).mean() for surface in surfaces]
    for measure, value in (
        (energy, exact.energy),
        (lambda s: patch_areas(s).sum(), exact.area),
        (volume, exact.volume),
    ):
        coarse, fine = (abs(measure(surface) - value) for surface in surfaces)
        assert np.log(coarse / fine) / np.log(h[0] / h[1]) == pytest.approx(2.0, abs=0.15)
    # stationary in the limit: forces on the lattice of vertices fall faster than their number grows
    squared = [float((gradient(surface) ** 2).sum()) for surface in surfaces]
    assert squared[1] < 0.4 * squared[0]


@pytest.mark.parametrize("tensions", [(4.0, 3.0, 3.0, 4.5), (4.0, 3.0, 2.0, 4.0), (4.0, 4.0, 1.0, 5.0)])
def test_the_exact_joined_caps_balance_at_the_junction(tensions):
    *alphas, depth = tensions
    keys = ("alpha_left", "alpha_right", "alpha_aux")
    exact = generators.joined_caps_exact(**dict(zip(keys, alphas, strict=True)), depth=depth)
    left, right = exact.shapes["left"], exact.shapes["right"]
    assert np.subtract(right.centre, left.centre).tolist() == [2.0 * alphas[2], 0.0, 0.0]
    top = np.sqrt(left.radius**2 - left.centre[0] ** 2) - depth
    point = np.array([0.0, 0.0, top])
    pull = np.array([0.0, 0.0, -alphas[2]])
    for alpha, ball, sign in ((alphas[0], left, -1.0), (alphas[1], right, 1.0)):
        n = (point - ball.centre) / ball.radius
        assert np.linalg.norm(n) == pytest.approx(1.0)
        pull += alpha * sign * np.array([n[2], 0.0, -n[0]])
    assert np.abs(pull).max() < 1e-12


def test_closed_surfaces_are_closed_and_warn_of_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name, euler in (("sphere", 2), ("double_bubble", 3)):
            surface = getattr(generators, name)(0.5)
            assert surface.free.all()
            assert not surface.topology.on_boundary.any()
            assert surface.n - len(surface.topology.edges) + surface.m == euler


def test_a_cap_may_be_more_than_a_hemisphere():
    surface = generators.spherical_cap(0.1, alpha=0.55, height=1.5)
    assert surface.vertices[:, 2].max() == pytest.approx(1.5)
    assert np.hypot(*surface.vertices[:, :2].T).max() > 1.05


def test_the_defaults_are_the_calibrated_ones():
    for example, surface, off in (
        ("example2", generators.two_caps(), 0.02),
        ("example3", generators.four_fans(), 0.01),
        ("example3", generators.four_fans(14, mesh="rings"), 5e-4),
        ("example4", generators.bezier_hall(), 0.01),
    ):
        squared = (gradient(surface) ** 2).sum()
        assert squared == pytest.approx(PRINTED[example], rel=off)


@pytest.mark.nightly
def test_the_search_finds_the_defaults(monkeypatch):
    monkeypatch.setattr(calibration, "EDGES_2", (1.2, 0.4, 0.36, 0.34))
    monkeypatch.setattr(calibration, "RINGS_3", (12, 13, 14))
    monkeypatch.setattr(calibration, "EDGES_4", (4.0, 3.5, 3.4))
    found = {(c.example, c.family): c for c in calibration.nearest(calibration.candidates())}
    assert len(found) == 11
    for key, surface, resolution in (
        (("example2", "upright wall"), generators.two_caps(), 0.36),
        (("example3", "soap film, lattice"), generators.four_fans(), 13),
        (("example4", "lattice"), generators.bezier_hall(), 3.5),
    ):
        assert found[key].resolution == resolution
        assert found[key].triangles == surface.m
        assert found[key].squared_gradient == (gradient(surface) ** 2).sum()
    assert found["example3", "soap film, rings"].resolution == 14


BAD = [
    ("two_squares", "n", 1, "a whole number ≥ 2"),
    ("two_squares", "n", 4.5, "a whole number ≥ 2"),
    ("two_squares", "height", 0.0, "a finite number > 0"),
    ("two_squares", "diagonals", "paralel", ("symmetric", "parallel")),
    ("two_caps", "edge_length", -1.0, "a finite number > 0"),
    ("two_caps", "wall", "upritght", ("upright", "inclined")),
    ("four_fans", "rings", 1, "a whole number ≥ 2"),
    ("four_fans", "mesh", "latice", fans.MESHES),
    ("four_fans", "bulge", np.inf, "a finite number"),
    ("three_patches", "radius", "wide", "a finite number > 0"),
    ("bezier_hall", "edge_length", np.inf, "a finite number > 0"),
    ("spherical_cap", "height", -1.0, "a finite number > 0"),
    ("joined_caps", "alpha_left", -4.0, "a finite number > 0"),
    ("sphere", "alpha", 0.0, "a finite number > 0"),
]


@pytest.mark.parametrize(("name", "what", "found", "expected"), BAD)
def test_bad_input_is_refused(name, what, found, expected):
    with refused(OptionError, what=what, found=found, expected=expected):
        getattr(generators, name)(**{what: found})


@pytest.mark.parametrize(
    ("name", "arguments", "fields"),
    [
        ("spherical_cap", {"alpha": 0.45}, {"what": "alpha", "found": 0.45, "expected": 0.5}),
        ("joined_caps", {"alpha_aux": 8.0}, {"what": "depth", "found": 4.5}),
        ("joined_caps", {"depth": 7.0}, {"what": "depth", "found": 7.0}),
        ("double_bubble", {"alpha_aux": 2.0}, {"what": "alpha_aux", "expected": (0.0, 2.0)}),
    ],
)
def test_closed_forms_that_do_not_exist_are_refused(name, arguments, fields):
    with refused(OptionError, **fields):
        getattr(generators, name)(exact=True, **arguments)


def test_an_unknown_example_is_refused():
    with refused(OptionError, what="example", found="exampel2", expected=tuple(PRINTED)):
        next(calibration.candidates(["exampel2"]))
