"""Pinched walls solved again: with a weaker wall, on a finer mesh, and left as they are."""

from functools import partial

import numpy as np
import pytest
from backends import every_backend
from refusals import refused
from starts import bezier_hall, stationary, two_caps, two_squares

from pcmc import Surface, certify, solve
from pcmc.base.errors import SurfaceError
from pcmc.forces.pinching import StandingPart, place_wall_rows, resting_vertices, standing_part
from pcmc.forces.wall_rows import find_walls
from pcmc.meshing.quality import triangle_quality
from pcmc.meshing.refinement import refine
from pcmc.solvers.state import SolverState
from pcmc.solvers.steps import Stepper
from pcmc.stability.factorisation import SingularMatrix


def flat(n=8):
    """Two squares whose whole junction rests on Π."""
    return stationary(partial(two_squares, n, alpha_aux=3.0)).surface


def partly(n=16):
    """Two squares whose junction rests on Π next to both corners."""
    return stationary(partial(two_squares, n, alpha_aux=2.0)).surface


def weaker(n, alpha_aux=1.0, **options):
    """The flat one with a wall so weak that it stands up; relative gap of E to the direct way there."""
    result = solve(flat(n).retensioned({"wall": alpha_aux}), target="stationary", **options)
    direct = stationary(partial(two_squares, n, alpha_aux=alpha_aux))
    return result, abs(result.energy / direct.energy - 1.0)


@every_backend
def test_from_a_pinched_surface_to_a_weaker_wall(backend):
    result, gap = weaker(8, backend=backend)
    assert result.converged
    assert len(result.certificate.pinched) == 0
    assert result.certificate.curvature_error < 1e-9
    assert result.certificate.quality > 0.3
    assert gap < 3e-4  # the vertices lie elsewhere along the shape, so E differs by its mesh error


def test_the_way_from_a_pinched_surface_ends_in_the_same_shape():
    """What is left of a difference is that of two meshes of one shape: less than refining changes E."""
    energies = [stationary(partial(two_squares, n, alpha_aux=1.0)).energy for n in (8, 16, 32, 64)]
    for n, here, finer in zip((8, 16, 32), energies, energies[1:], strict=False):
        assert weaker(n)[1] < 0.25 * abs(finer / here - 1.0)


def test_the_rows_of_a_flat_wall_are_known_from_its_mesh():
    start, end = find_walls(two_squares(8, alpha_aux=3.0)), find_walls(flat())
    np.testing.assert_array_equal(start.rows.vertices, end.rows.vertices)
    np.testing.assert_allclose(end.rows.relative_height, start.rows.relative_height, atol=1e-12)
    assert 0.0 < end.rows.relative_height.max() < 1.0
    assert (end.rows.offset == 0.0).all()


@pytest.mark.parametrize("kind", ["descent", "carried"])
def test_a_step_without_a_matrix_is_a_step_that_failed(kind, monkeypatch):
    def singular(*_):
        raise SingularMatrix("a pivot is zero")

    state = SolverState(two_squares(4), min_quality=0.45)
    stepper = Stepper(state, minimum=False)
    X = state.at.X.copy()
    if kind == "descent":
        monkeypatch.setattr("pcmc.solvers.smoother.Smoother.refresh", singular)
        assert not stepper.descend()
    else:
        monkeypatch.setattr("pcmc.solvers.smoother.HarmonicExtension.__init__", singular)
        motion = np.ones_like(X)
        np.testing.assert_array_equal(stepper._with_sheets(motion), motion)
    np.testing.assert_array_equal(state.at.X, X)


@pytest.mark.parametrize("alpha_aux", [1.0, 2.0, 3.0])
def test_levels_through_a_contact(alpha_aux):
    result = solve(two_squares(8, alpha_aux=alpha_aux), target="stationary", levels=2)
    assert result.converged
    found = result.certificate
    assert found.residual < 1e-10
    assert found.curvature_error < 1e-9
    assert found.quality > 0.3
    assert len(found.pinched) == {1.0: 0, 2.0: 4, 3.0: 31}[alpha_aux]
    counts = result.history.groupby("level")["factorisation"].max()
    assert counts[0] <= 60
    assert (counts.diff()[1:] <= 8).all()


@pytest.mark.parametrize("make", [flat, partly])
def test_refined_a_pinched_wall_has_rows_again_where_it_stands(make):
    coarse = make()
    fine = refine(coarse)
    walls = find_walls(fine)
    resting = resting_vertices(fine, walls)
    crest = resting_vertices(coarse, find_walls(coarse))
    assert resting[: coarse.n].tolist() == crest.tolist()
    assert resting.sum() > crest.sum()  # and the middles between
    standing = StandingPart.of(fine, walls, resting).surface
    quality = triangle_quality(standing.vertices, standing.faces)
    before = StandingPart.of(coarse, find_walls(coarse), crest).surface
    assert quality.min() > 0.4 * triangle_quality(before.vertices, before.faces).min()
    rows = walls.rows
    i, j = rows.top_ends.T
    above = fine.plane.height((1 - rows.fraction)[:, None] * fine.vertices[i])
    above += fine.plane.height(rows.fraction[:, None] * fine.vertices[j])
    low = fine.plane.height(fine.vertices[rows.vertices])
    np.testing.assert_allclose(low, rows.relative_height * above, atol=1e-12)
    places = np.column_stack([rows.top_ends, rows.fraction, rows.relative_height])
    standing_rows = places[above > 1e-6]
    assert len(np.unique(standing_rows, axis=0)) == len(standing_rows)


def test_a_wall_pinched_at_its_ends_is_refined_again_and_again():
    """Below the last resting vertex two rows coincide; their new neighbours must not."""
    surface = solve(two_squares(16, alpha_aux=2.0), target="stationary").surface
    for _ in range(2):
        assert standing_part(surface).resting.any()
        result = solve(refine(surface), target="stationary")
        assert result.converged
        surface = result.surface


CONVERGED = {
    "Ex. 1": partial(two_squares, 8, alpha_aux=1.0),
    "Ex. 1, partly flat": partial(two_squares, 16, alpha_aux=2.0),
    "Ex. 1, flat": partial(two_squares, 8, alpha_aux=3.0),
    "Ex. 2, whose wall leans": partial(two_caps, 0.8),
    "Ex. 4": bezier_hall,
}


@pytest.mark.parametrize("make", CONVERGED.values(), ids=CONVERGED)
def test_a_wall_hangs_where_it_stands(make):
    surface = stationary(partial(make)).surface
    place = place_wall_rows(surface, find_walls(surface), surface.vertices)
    np.testing.assert_allclose(place, surface.vertices, atol=1e-12 * surface.size)


@pytest.mark.parametrize("make", CONVERGED.values(), ids=CONVERGED)
def test_what_is_at_rest_stays_at_rest(make):
    near = solve(make(), target="stationary", tolerance=1e-9)
    again = solve(near.surface, target="stationary")
    assert again.converged
    assert again.iterations <= 1
    moved = np.abs(again.surface.vertices - near.surface.vertices).max()
    assert moved < 1e-9 * near.surface.size
    third = solve(again.surface, target="stationary")
    assert third.iterations == 0
    np.testing.assert_array_equal(third.surface.vertices, again.surface.vertices)


def test_a_leaning_wall_lies_flat_with_its_crest():
    """What a wall vertex stands off from straight below its crest goes with the crest's height."""
    surface = stationary(partial(two_caps, 0.8)).surface
    walls = find_walls(surface)
    X = surface.vertices.copy()
    X[walls.top_free] *= [1.0, 1.0, 0.0]
    low = place_wall_rows(surface, walls, X)[walls.rows.vertices]
    i, j = walls.rows.top_ends.T
    corner = ~(walls.top_free[i] & walls.top_free[j])
    above = (1 - walls.rows.fraction)[:, None] * X[i] + walls.rows.fraction[:, None] * X[j]
    np.testing.assert_allclose(low[~corner], above[~corner], atol=1e-12)
    assert np.linalg.norm(walls.rows.offset, axis=1).max() > 0.05


def test_a_release_is_in_the_history():
    history = solve(flat().retensioned({"wall": 1.0}), target="stationary").history
    assert history["step"][:2].tolist() == ["start", "release"]
    assert history["resting"][:2].tolist() == [7, 0]


def rebuilt(surface, **changes):
    """The surface with all its checks made again."""
    given = {
        name: changes.get(name, getattr(surface, name))
        for name in ("vertices", "faces", "patch_of_face", "patches", "fixed", "on_plane", "plane")
    }
    return Surface(**given)


@pytest.mark.parametrize("make", [flat, partly])
def test_a_pinched_surface_passes_the_checks(make):
    surface = make()
    areas = triangle_quality(surface.vertices, surface.faces[surface.patch_of_face == 2])
    assert (areas == 0.0).any()
    again = rebuilt(surface)
    np.testing.assert_array_equal(
        resting_vertices(again, find_walls(again)), resting_vertices(surface, find_walls(surface))
    )
    assert certify(again).index == certify(surface).index


def collapsed(surface, face):
    """The surface with one triangle of no area: its first corner moved onto its second."""
    X = surface.vertices.copy()
    X[surface.faces[face, 0]] = X[surface.faces[face, 1]]
    return {"vertices": X}


def test_other_triangles_without_area_are_still_refused():
    surface = flat()
    outer = int(np.flatnonzero(surface.patch_of_face == 0)[9])
    with refused(SurfaceError, what="faces", where=outer):
        rebuilt(surface, **collapsed(surface, outer))
    with pytest.raises(SurfaceError, match="of patch 'wall' has zero area"):
        rebuilt(surface.retensioned({}, {"left": 0.0, "right": 0.0}))  # nothing resting but walls
    with pytest.raises(SurfaceError, match="of patch 'wall' has zero area"):
        rebuilt(surface.retensioned({}, {"wall": 1.0}))
    held = surface.fixed | find_walls(surface).top_free
    with pytest.raises(SurfaceError, match="of patch 'wall' has zero area"):
        rebuilt(surface, fixed=held)


def test_a_standing_wall_with_a_triangle_of_no_area_is_refused():
    surface = two_squares(8)
    walls = find_walls(surface)
    rows = walls.rows
    inside = rows.vertices[(rows.relative_height > 0.0) & (rows.fraction != 0.5)][0]
    face = int(np.flatnonzero((surface.faces == inside).any(axis=1))[0])
    with pytest.raises(SurfaceError, match="of patch 'wall' has zero area"):
        rebuilt(surface, **collapsed(surface, face))
    # nor in a wall that is pinched elsewhere
    surface = partly()
    height = surface.plane.height(surface.vertices)
    wall = np.flatnonzero(surface.patch_of_face == 2)
    face = int(wall[np.argmax(height[surface.faces[wall]].min(axis=1))])
    with pytest.raises(SurfaceError, match="of patch 'wall' has zero area"):
        rebuilt(surface, **collapsed(surface, face))


def test_a_result_carries_what_rests_and_its_positions_show_the_same():
    result = solve(two_squares(8, alpha_aux=3.0))
    carried = standing_part(result.surface)
    assert carried.whole is result.surface
    assert carried.resting.sum() == 7
    shown = standing_part(result.surface.moved(result.surface.vertices))
    assert shown is not carried
    for name in ("resting", "faces_of_whole"):
        np.testing.assert_array_equal(getattr(shown, name), getattr(carried, name))
    np.testing.assert_array_equal(shown.surface.vertices, carried.surface.vertices)
    np.testing.assert_array_equal(carried.whole_positions(carried.surface.vertices), result.surface.vertices)
