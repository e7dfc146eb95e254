"""The same problem said otherwise has the same answer to rounding: turned, scaled, renumbered, on another Π.

Not only the numbers that do not depend on the mesh: every vertex ends in the same place along its sheet,
as each step is the same but for rounding. What rounding may do is multiplied by how nearly singular the
steps' matrices are; the bounds leave room for ten to a hundred times what is seen.
"""

from functools import partial

import numpy as np
import pytest
from nightly import at_night
from shapes import rotation
from starts import bezier_hall, double_bubble, four_fans, joined_caps, spherical_cap, two_caps, two_squares

from generators.grid import grid_faces
from pcmc import Patch, Plane, Surface, Verdict, mean_curvature, solve

pytestmark = pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")

SURFACES = {
    "two squares": partial(two_squares, 6, alpha_aux=1.0),
    "pinched squares": partial(two_squares, 6, alpha_aux=3.0),
    "joined caps": partial(joined_caps, 1.0),
    "weak wall": partial(joined_caps, 1.4, alpha_left=4.0, alpha_right=4.0, alpha_aux=1.0, depth=5.0),
    "cap": partial(spherical_cap, 0.25),
    "two caps": partial(two_caps, 1.2),
    "fans": partial(four_fans, 5),
    "hall": partial(bezier_hall),
    "bubbles": partial(double_bubble, 0.8),
}


def rebuilt(surface, X=None, plane=None, patches=None, order=None, rank=None):
    """The surface with vertices ``order`` (new from old) and patches ``rank`` (new from old)."""
    order = np.arange(surface.n) if order is None else order
    rank = np.arange(len(surface.patches)) if rank is None else rank
    place, seat = np.argsort(order), np.argsort(rank)
    X = surface.vertices if X is None else X
    patches = surface.patches if patches is None else patches
    return Surface(
        X[order],
        place[surface.faces],
        seat[surface.patch_of_face],
        [patches[k] for k in rank],
        fixed=surface.fixed[order],
        on_plane=surface.on_plane[order],
        plane=plane or surface.plane,
    )


def answer(surface):
    """Numbers that do not depend on the place, the size and the numbering of the surface."""
    result = solve(surface, target="stationary")
    assert result.converged
    found = result.certificate
    scale = surface.tensions.max()  # of force/length; lengths go with it, as the pressure stays
    H = mean_curvature(result.surface, "variational")
    X = result.surface.vertices
    centre = X[surface.fixed if surface.fixed.any() else slice(None)].mean(axis=0)
    return {
        "energy": result.energy / scale**3,
        "volume": found.volume / scale**3,
        "curvature": np.sort(H[np.isfinite(H)]) * scale,
        "index": found.index,
        "verdict": found.verdict,
        "pinched": len(found.pinched),
        "eigenvalue": found.eigenvalues[0] * scale,
        "lengths": np.sort(np.linalg.norm(X - centre, axis=1)) / scale,
    }


@pytest.fixture(scope="module")
def answers():
    return {name: answer(make()) for name, make in SURFACES.items()}


def agrees(found, expected):
    for key in ("index", "verdict", "pinched"):
        assert found[key] == expected[key]
    assert found["energy"] == pytest.approx(expected["energy"], rel=1e-13)
    assert found["volume"] == pytest.approx(expected["volume"], rel=1e-12)
    assert found["eigenvalue"] == pytest.approx(expected["eigenvalue"], rel=1e-10)
    size = np.abs(expected["lengths"]).max()
    np.testing.assert_allclose(found["lengths"], expected["lengths"], atol=1e-11 * size)
    np.testing.assert_allclose(found["curvature"], expected["curvature"], atol=1e-11)


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("seed", [*at_night(0), 1])
def test_turned_and_moved_with_its_plane(name, seed, answers):
    surface = SURFACES[name]()
    R, shift = rotation(seed), np.array([10.0, -3.0, 2.0]) * seed
    plane = Plane(R @ surface.plane.point + shift, R @ surface.plane.normal)
    agrees(answer(rebuilt(surface, surface.vertices @ R.T + shift, plane)), answers[name])


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("scale", [1e-3, 1e4])
def test_scaled_in_lengths_and_tensions(name, scale, answers):
    surface = SURFACES[name]()
    patches = [Patch(p.name, scale * p.tension, p.pressure) for p in surface.patches]
    agrees(answer(rebuilt(surface, scale * surface.vertices, patches=patches)), answers[name])


@pytest.mark.parametrize("name", SURFACES)
def test_more_tension_and_pressure_alike_change_no_shape(name, answers):
    surface = SURFACES[name]()
    patches = [Patch(p.name, 7.0 * p.tension, 7.0 * p.pressure) for p in surface.patches]
    result = solve(rebuilt(surface, patches=patches), target="stationary")
    assert result.converged
    scale = surface.tensions.max()
    assert result.energy / 7.0 / scale**3 == pytest.approx(answers[name]["energy"], rel=1e-13)
    assert result.certificate.index == answers[name]["index"]


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("seed", [*at_night(0), 1])
def test_vertices_patches_and_faces_in_another_order(name, seed, answers):
    surface = SURFACES[name]()
    random = np.random.default_rng(seed)
    order, rank = random.permutation(surface.n), random.permutation(len(surface.patches))
    other = rebuilt(surface, order=order, rank=rank)
    faces = random.permutation(other.m)
    turn = random.integers(3, size=other.m)
    F = np.stack([np.roll(face, k) for face, k in zip(other.faces[faces], turn[faces], strict=True)])
    shuffled = Surface(
        other.vertices,
        F,
        other.patch_of_face[faces],
        other.patches,
        fixed=other.fixed,
        on_plane=other.on_plane,
        plane=other.plane,
    )
    agrees(answer(shuffled), answers[name])


def test_a_tilted_plane_gives_the_surface_tilted():
    """Not only the same numbers: the same vertices, in the tilted frame."""
    surface = SURFACES["two squares"]()
    R = rotation(3)
    plane = Plane(R @ surface.plane.point, R @ surface.plane.normal)
    tilted = solve(rebuilt(surface, surface.vertices @ R.T, plane)).surface
    np.testing.assert_allclose(
        tilted.vertices, solve(surface).surface.vertices @ R.T, atol=1e-12 * surface.size
    )


def test_a_saddle_is_left_the_same_way():
    saddle = solve(
        joined_caps(1.0, alpha_left=4.0, alpha_right=4.0, alpha_aux=1.0, depth=5.0), target="stationary"
    ).surface
    R = rotation(5)
    turned = rebuilt(saddle, saddle.vertices @ R.T, Plane(R @ saddle.plane.point, R @ saddle.plane.normal))
    ways = [solve(surface, iterations=6).history for surface in (saddle, turned)]
    assert "saddle" in ways[0]["step"].to_list()
    assert ways[1]["step"].to_list() == ways[0]["step"].to_list()
    np.testing.assert_allclose(ways[1]["energy"], ways[0]["energy"], rtol=1e-12)


@pytest.mark.parametrize("name", ["two squares", "pinched squares", "two caps", "fans", "hall"])
@pytest.mark.parametrize("shift", [(1e3, -2e3, 0.0), (5e5, 5e6, 800.0)])
def test_drawn_in_a_survey_s_coordinates(name, shift):
    """Only Π's height moves along: its point stays at the origin. Positions keep what digits they have."""
    surface, shift = SURFACES[name](), np.array(shift)
    plane = Plane(np.array(surface.plane.point) + shift * [0, 0, 1], surface.plane.normal)
    there = solve(rebuilt(surface, surface.vertices + shift, plane), target="stationary")
    here = solve(surface, target="stationary")
    assert there.converged
    assert there.iterations <= here.iterations + 2  # it does not wait for what rounding hides
    assert there.certificate.residual < 1e-9
    assert there.certificate.verdict is here.certificate.verdict
    assert len(there.certificate.pinched) == len(here.certificate.pinched)
    lost = 10.0 * np.spacing(np.abs(shift).max()) + 1e-12 * surface.size
    np.testing.assert_allclose(there.surface.vertices - shift, here.surface.vertices, atol=lost)
    np.testing.assert_allclose(
        there.certificate.reactions,
        here.certificate.reactions,
        atol=1e-7 * np.abs(here.certificate.reactions).max(),
    )


@pytest.mark.parametrize("tension", [1e-5, 1e-7])
def test_a_weak_patch_comes_to_rest_in_a_survey_s_coordinates(tension):
    """Beside a strong one its forces hardly count in the residual, and rounding hides none of them."""
    x, y = (each.ravel() for each in np.meshgrid(np.arange(17.0), np.arange(9.0), indexing="ij"))
    faces, shift = grid_faces(16, 8), np.array([4.5e5, 5.4e6, 0.0])
    corners = np.column_stack([x, y, 0.0 * x]) + shift
    patches = [Patch("strong", 1.0, 0.0), Patch("weak", tension, 0.2 * tension)]
    weak, held = (x[faces].mean(axis=1) > 8.0).astype(int), (x % 8.0 == 0.0) | (y % 8.0 == 0.0)
    result = solve(Surface(corners, faces, weak, patches, fixed=held, plane=Plane(shift)))
    assert result.certificate.verdict is Verdict.STABLE, result.certificate.detail
