"""Walls that pinch: what hangs from where, what goes when a junction rests on Π, and when it lifts."""

import numpy as np
import pytest
from nightly import at_night
from shapes import placed, rotation, shaken
from starts import double_bubble, four_fans, two_caps, two_squares, uneven

from pcmc import Patch, Surface, Verdict, certify, energy, solve
from pcmc.forces.motion_space import motion_space, vertex_classes
from pcmc.forces.pinching import (
    StandingPart,
    lift,
    place_wall_rows,
    pull_and_capacity,
    resting_links,
    resting_vertices,
    top_spacing,
)
from pcmc.forces.wall_rows import find_walls
from pcmc.meshing.quality import triangle_quality
from pcmc.solvers.state import SolverState

pytestmark = pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")


def crest_of(surface, walls):
    """Free crest vertices in order along y (all these walls stand on x = 0)."""
    free = np.flatnonzero(walls.top_free)
    return free[np.argsort(surface.vertices[free, 1])]


def pressed(n=6, count=2, drop=0.0, **arguments):
    """Two squares whose junction rests on Π at the first ``count`` vertices from one corner."""
    surface = uneven(two_squares(n, **arguments), drop)
    walls = find_walls(surface)
    resting = np.zeros(surface.n, dtype=bool)
    resting[crest_of(surface, walls)[:count]] = True
    standing = StandingPart.of(surface, walls, resting).surface
    full = surface.moved(StandingPart.of(surface, walls, resting).whole_positions(standing.vertices))
    return full, walls, resting, standing


def elsewhere(surface, seed=0):
    """The surface turned and moved, its plane with it, and the map of points."""
    R, shift = rotation(seed), np.array([3.0, -1.0, 2.0])
    return placed(surface, R, shift), lambda X: X @ R.T + shift


def test_which_walls_can_pinch():
    surface = two_squares(6)
    walls = find_walls(surface)
    assert walls.pinchable.tolist() == [False, False, True]
    assert len(walls.top_edges) == 6
    assert walls.top_free.sum() == 5
    assert walls.corner.sum() == 2
    assert surface.fixed[walls.corner].all()
    wall = np.unique(surface.faces[surface.patch_of_face == 2])
    crest = np.unique(walls.top_edges)
    np.testing.assert_array_equal(walls.rows.vertices, np.setdiff1d(wall, crest))
    assert walls.wall_below.tolist() == [2] * 6
    assert find_walls(four_fans(4)).pinchable.sum() == 4


def test_a_wall_that_does_not_stand_on_the_plane_cannot():
    walls = find_walls(double_bubble(1.2))
    assert not walls.pinchable.any()
    assert not walls.top_free.any()
    assert len(walls.rows.vertices) == len(walls.top_edges) == 0


@pytest.mark.parametrize(
    "make",
    [lambda: two_squares(6), lambda: four_fans(5), lambda: two_caps(0.8)],
    ids=["two squares", "four fans", "two caps"],
)
def test_each_wall_vertex_hangs_where_it_is(make):
    surface = make()
    walls = find_walls(surface)
    np.testing.assert_allclose(place_wall_rows(surface, walls, surface.vertices), surface.vertices, atol=1e-2)
    i, j = walls.rows.top_ends.T
    for part in (walls.rows.fraction, walls.rows.relative_height):
        assert ((part >= 0.0) & (part <= 1.0)).all()
    crest = np.unique(walls.top_edges)
    assert np.isin(i, crest).all()
    assert np.isin(j, crest).all()
    foot = np.abs(surface.plane.height(surface.vertices[walls.rows.vertices])) < 1e-12
    assert (walls.rows.relative_height[foot] == 0.0).all()
    assert (walls.rows.relative_height[~foot] > 0.0).all()


def test_the_rows_of_a_wall_follow_its_crest():
    surface = two_squares(6)
    walls = find_walls(surface)
    X = surface.vertices.copy()
    crest = crest_of(surface, walls)
    X[crest] = X[crest] * [1, 1, 1.7] + [0.3, 0.0, 0.0]
    moved = place_wall_rows(surface, walls, X)
    rows = walls.rows
    assert ((rows.fraction == 0.0) | (rows.fraction == 1.0)).all()
    owner = np.where(rows.fraction == 0.0, rows.top_ends[:, 0], rows.top_ends[:, 1])
    np.testing.assert_allclose(moved[rows.vertices, :2], X[owner, :2], atol=1e-12)
    height = rows.relative_height * X[owner, 2]
    np.testing.assert_allclose(moved[rows.vertices, 2], height, atol=1e-12)
    others = np.setdiff1d(np.arange(surface.n), rows.vertices)
    np.testing.assert_array_equal(moved[others], X[others])


def test_the_crest_is_where_a_roof_is_too():
    """A wall's triangle may reach from one vertex of the junction to the next but one."""
    line = [[0, -2, 0], [0, -1, 1], [0, 0, 2], [0, 1, 1], [0, 2, 0]]
    X = np.array([*line, [-2, 0, 0], [2, 0, 0], [0, -1, 0], [0, 1, 0]], dtype=float)
    left, right = ([[i, i + 1, 5] for i in range(4)], [[i + 1, i, 6] for i in range(4)])
    wall = [[1, 3, 2], [7, 8, 3], [7, 3, 1], [0, 7, 1], [8, 4, 3]]
    patches = [Patch("left", 2.0), Patch("right", 2.0), Patch("wall", 1.0, pressure=0.0)]
    surface = Surface(
        X, [*left, *right, *wall], [0] * 4 + [1] * 4 + [2] * 5, patches, fixed=[0, 4, 5, 6], on_plane=[7, 8]
    )
    walls = find_walls(surface)
    assert walls.top_edges.tolist() == [[0, 1], [1, 2], [2, 3], [3, 4]]
    assert np.flatnonzero(walls.top_free).tolist() == [1, 2, 3]


def test_with_a_motion_space_only_what_lies_along_the_wall():
    surface = shaken(two_squares(6), 0.02)
    walls = find_walls(surface)
    space = motion_space(surface, vertex_classes(surface), surface.vertices)
    X = surface.vertices.copy()
    X[walls.top_free] += [0.1, 0.0, 0.2]
    change = place_wall_rows(surface, walls, X, space) - X
    np.testing.assert_allclose(space.project(change), 0.0, atol=1e-14)
    assert np.abs(change).max() > 0.05


def test_hanging_turns_with_the_plane():
    surface = two_squares(6)
    turned, place = elsewhere(surface)
    here, there = find_walls(surface), find_walls(turned)
    X = surface.vertices.copy()
    X[here.top_free] += [0.3, 0.0, 0.5]
    expected = place(place_wall_rows(surface, here, X))
    np.testing.assert_allclose(place_wall_rows(turned, there, place(X)), expected, atol=1e-12)


@pytest.mark.parametrize("count", [1, 3, 5])
def test_what_is_left_when_a_junction_rests(count):
    full, walls, resting, standing = pressed(count=count)
    assert resting.sum() == count
    np.testing.assert_array_equal(resting_vertices(full, walls), resting)
    assert triangle_quality(standing.vertices, standing.faces).min() > 0.1
    assert standing.on_plane[resting].all()
    outer = full.patch_of_face != 2
    assert (standing.patch_of_face != 2).sum() == outer.sum()
    if count == 5:
        assert (standing.patch_of_face != 2).all()
    # what is gone has no area, so E is that of the full surface with its wall pressed flat
    assert energy(standing) == pytest.approx(energy(full), rel=1e-13)
    again = StandingPart.of(full, walls, resting).surface
    np.testing.assert_array_equal(again.faces, standing.faces)
    np.testing.assert_allclose(again.vertices, standing.vertices, atol=1e-14)


def test_without_a_resting_vertex_nothing_changes():
    surface = two_squares(4)
    walls = find_walls(surface)
    assert not resting_vertices(surface, walls).any()
    assert StandingPart.of(surface, walls, resting_vertices(surface, walls)).surface is surface


def test_pinching_turns_with_the_plane():
    full, walls, resting, standing = pressed()
    turned, place = elsewhere(two_squares(6))
    there = find_walls(turned)
    turned = turned.moved(place(full.vertices))
    np.testing.assert_array_equal(resting_vertices(turned, there), resting)
    parts = StandingPart.of(full, walls, resting), StandingPart.of(turned, there, resting)
    other = parts[1].surface
    np.testing.assert_array_equal(other.faces, standing.faces)
    np.testing.assert_allclose(other.vertices, place(standing.vertices), atol=1e-12)
    for one, two in zip(*map(pull_and_capacity, parts), strict=True):
        np.testing.assert_allclose(one, two, atol=1e-12)


def test_a_foot_that_still_carries_a_triangle_stays_where_it_slid():
    surface, walls, resting, _ = pressed()
    crest = crest_of(surface, walls)
    under = surface.vertices[crest[1]] * [1.0, 1.0, 0.0]
    gap = np.linalg.norm(surface.vertices - under, axis=1)
    foot = np.flatnonzero((gap < 1e-9) & surface.on_plane)
    X = surface.vertices.copy()
    X[foot] += 0.01 * (X[crest[0]] - X[crest[1]]) * [1.0, 1.0, 0.0]
    surface = surface.moved(X)
    walls = find_walls(surface)
    standing = StandingPart.of(surface, walls, resting).surface
    assert len(foot) == 1
    assert np.isin(foot, standing.faces).all()
    moved = StandingPart.of(surface, walls, resting).whole_positions(standing.vertices)
    np.testing.assert_array_equal(moved[foot], X[foot])


def test_curves_and_neighbours_of_the_resting_part():
    full, walls, resting, _ = pressed(count=2)
    crest = crest_of(full, walls)
    corner = np.flatnonzero(walls.corner)
    corner = corner[np.argsort(full.vertices[corner, 1])][0]
    expected = [(crest[0], corner), (crest[0], crest[1]), (crest[1], crest[0]), (crest[1], crest[2])]
    assert sorted(map(tuple, resting_links(walls, resting).tolist())) == sorted(expected)
    level = StandingPart.of(full, walls, resting).classes.level
    assert np.flatnonzero(level).tolist() == [crest[2]]
    spacing = top_spacing(full, walls)
    assert spacing[corner] == pytest.approx(4 / 6)
    assert np.isinf(spacing[np.setdiff1d(np.arange(full.n), walls.top_edges)]).all()


@pytest.mark.parametrize("drop", [0.0, 0.3])
@pytest.mark.parametrize("count", [1, 3, 5])
def test_pull_less_capacity_is_what_lifting_gains(count, drop):
    """(E(lifted by z) - E(resting)) / z tends to capacity - pull."""
    full, walls, resting, _ = pressed(count=count, drop=drop)
    pull, capacity = pull_and_capacity(StandingPart.of(full, walls, resting))
    assert (capacity[~resting] == 0).all()
    assert (pull[~resting] == 0).all()
    spacing = top_spacing(full, walls)
    for v in np.flatnonzero(resting):
        one = np.arange(full.n) == v
        fraction = 1e-6
        slope = (energy(lift(full, walls, one, fraction)) - energy(full)) / (fraction * spacing[v])
        assert slope == pytest.approx(capacity[v] - pull[v], abs=1e-5)
        assert capacity[v] == pytest.approx(2.0 * 4 / 6, rel=1e-12)  # α_w times the spacing


def test_a_lifted_wall_is_back():
    full, walls, resting, _ = pressed(count=3)
    up = lift(full, walls, resting, 0.1)
    assert not resting_vertices(up, walls).any()
    assert up.plane.height(up.vertices[resting]) == pytest.approx(0.1 * 4 / 6)
    assert triangle_quality(up.vertices, up.faces).min() > 0.02
    partly = lift(full, walls, np.arange(full.n) == crest_of(full, walls)[2], 0.1)
    np.testing.assert_array_equal(
        resting_vertices(partly, walls), resting & (partly.plane.height(partly.vertices) == 0)
    )
    assert resting_vertices(partly, walls).sum() == 2


def test_a_vertex_on_no_top_edge_is_not_lifted():
    full, walls, resting, _ = pressed(count=3)
    elsewhere = np.setdiff1d(np.arange(full.n), walls.top_edges)[0]
    up = lift(full, walls, resting | (np.arange(full.n) == elsewhere), 0.1)
    np.testing.assert_array_equal(up.vertices, lift(full, walls, resting, 0.1).vertices)


@pytest.mark.parametrize(("alpha_aux", "lifts"), [(0.5, 3), (50.0, 0)])
def test_a_junction_put_down_comes_up_where_the_wall_cannot_hold_it(alpha_aux, lifts):
    state = SolverState(two_squares(6, alpha_aux=alpha_aux), min_quality=0.45)
    crest = crest_of(state.at.part.whole, state.walls)[:3]
    drop = np.zeros_like(state.at.X)
    drop[crest, 2] = -state.at.X[crest, 2]
    X, down = state.displaced(drop)
    np.testing.assert_array_equal(np.flatnonzero(down), np.sort(crest))
    state.move(X, down)
    np.testing.assert_array_equal(state.resting, down)
    assert state.energy == pytest.approx(energy(state.result_surface()), rel=1e-13)
    assert state.lift_overpulled() == (lifts > 0)
    assert state.resting.sum() == 3 - lifts
    height = state.result_surface().vertices[crest, 2]
    assert ((height > 0.0) == (lifts > 0)).all()
    if lifts:  # its wall is back, with all its rows
        quality = triangle_quality(state.at.X, state.at.surface.faces)
        assert len(quality) == state.at.part.whole.m
        assert quality.min() > 1e-3


def complementary(surface):
    """Whether the pull on each resting vertex is one that its wall can take."""
    walls = find_walls(surface)
    resting = resting_vertices(surface, walls)
    pull, capacity = pull_and_capacity(StandingPart.of(surface, walls, resting))
    return resting, pull, capacity


@pytest.mark.parametrize(("n", "alpha_aux", "count"), [(8, 3.0, 7), (16, 2.0, 2)])
def test_a_converged_contact_is_one(n, alpha_aux, count):
    result = solve(two_squares(n, alpha_aux=alpha_aux), target="stationary")
    assert result.converged
    resting, pull, capacity = complementary(result.surface)
    assert resting.sum() == count
    assert (pull <= capacity * (1 + 1e-9)).all()
    assert (pull[resting] > 0.0).all()
    found = result.certificate
    np.testing.assert_array_equal(found.pinched, np.flatnonzero(resting))
    assert found.curvature_error < 1e-9
    heights = result.surface.plane.height(result.surface.vertices)
    assert (heights[find_walls(result.surface).top_free & ~resting] > 0.0).all()


def test_the_wall_stands_just_below_the_tension_that_keeps_it_down():
    """With the whole junction at rest the shape does not depend on α_w; its largest pull per length is
    the tension below which the wall stands up somewhere."""
    low = solve(two_squares(8, alpha_aux=3.0), target="stationary")
    resting, pull, capacity = complementary(low.surface)
    assert resting.sum() == 7
    threshold = 3.0 * float((pull[resting] / capacity[resting]).max())
    assert 2.5 < threshold < 2.8
    above = solve(two_squares(8, alpha_aux=1.03 * threshold), target="stationary")
    below = solve(two_squares(8, alpha_aux=0.9 * threshold), target="stationary")
    assert above.converged
    assert below.converged
    assert complementary(above.surface)[0].sum() == 7
    assert above.energy == pytest.approx(low.energy, rel=1e-3)  # the triangles may lie elsewhere
    assert complementary(below.surface)[0].sum() < 7


@pytest.mark.parametrize("n", [5, 8, *at_night(6, 10, 12)])
@pytest.mark.parametrize("alpha_aux", [2.2, 2.4, 2.5, 2.6, 2.7, 2.8, 3.0])
def test_any_strength_of_wall_settles(n, alpha_aux):
    """Near the strength that keeps the junction down it stands off by less than 1/1000 of an edge."""
    result = solve(two_squares(n, alpha_aux=alpha_aux), target="stationary")
    assert result.converged
    assert result.certificate.residual < 1e-11
    resting, pull, capacity = complementary(result.surface)
    assert (pull <= capacity * (1 + 1e-9)).all()
    heights = result.surface.plane.height(result.surface.vertices)
    assert (heights[find_walls(result.surface).top_free & ~resting] > 0.0).all()


def mirrored(surface, how):
    """The surface hanging below Π: with its pressure turned round, or its faces."""
    faces = surface.faces if how == "pressure" else surface.faces[:, ::-1]
    sign = -1.0 if how == "pressure" else 1.0
    return Surface(
        surface.vertices * [1, 1, -1],
        faces,
        surface.patch_of_face,
        [Patch(p.name, p.tension, sign * p.pressure) for p in surface.patches],
        fixed=surface.fixed,
        on_plane=surface.on_plane,
    )


@pytest.mark.parametrize("how", ["pressure", "faces"])
def test_below_the_plane_walls_pinch_and_stand_off_alike(how):
    above = solve(two_squares(6, alpha_aux=3.0))
    below = solve(mirrored(two_squares(6, alpha_aux=3.0), how))
    assert below.energy == pytest.approx(above.energy, rel=1e-12)
    assert len(below.certificate.pinched) == len(above.certificate.pinched) == 5
    lifted_up = solve(above.surface.retensioned({"wall": 1.0}))
    lifted_down = solve(below.surface.retensioned({"wall": 1.0}))
    assert len(lifted_down.certificate.pinched) == 0
    assert lifted_down.energy == pytest.approx(lifted_up.energy, rel=1e-12)


@pytest.mark.parametrize("target", ["minimum", "stationary"])
def test_a_junction_that_is_pulled_through_the_plane_goes_there(target):
    """It used to stay on Π, pulled down harder than its wall holds, and to count as converged."""
    start = two_squares(6, alpha_aux=1.0)
    result = solve(start.retensioned(pressures={"left": -1.0, "right": -1.0}), target=target)
    assert result.converged
    assert result.certificate.verdict is Verdict.STABLE
    crest = find_walls(result.surface).top_free
    assert (result.surface.vertices[crest, 2] < -0.1).all()
    assert result.energy == pytest.approx(solve(start).energy, rel=2e-3)


@pytest.mark.parametrize("weak", [0.0, 0.1, 1.0])
def test_a_wall_too_weak_for_its_junction_is_not_at_rest(weak):
    surface = solve(two_squares(8, alpha_aux=3.0)).surface.retensioned({"wall": weak})
    found = certify(surface)
    assert found.verdict is Verdict.NOT_CONVERGED
    assert found.residual > 0.05
    assert "at 7 pinched vertices" in found.detail


def test_a_wall_under_pressure_pinches_like_one_without():
    """Where its height vanishes so does what presses on it."""
    given = two_squares(6, alpha_aux=3.0)
    plain = solve(given)
    patches = [Patch(p.name, p.tension, p.pressure, wall=p.auxiliary) for p in given.patches]
    wall = given.patch_index("wall")
    patches[wall] = Patch("wall", 3.0, 1e-3, wall=True)
    pressed = solve(given.rebuilt(patches=patches))
    assert pressed.converged
    assert len(pressed.certificate.pinched) == 5
    assert pressed.energy == pytest.approx(plain.energy, rel=1e-6)  # vertices lie elsewhere
