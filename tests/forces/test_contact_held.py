"""Walls with held bottoms that pinch: a junction that comes down rests on the curve of its bottom."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from nightly import at_night
from shapes import placed, rotation
from starts import four_fans, stationary, two_squares, uneven

import pcmc
from pcmc import Patch, Surface, Verdict, certify, check_mesh, energy, solve
from pcmc.forces.functional import energy_and_gradient
from pcmc.forces.pinching import (
    StandingPart,
    lift,
    pull_and_capacity,
    pull_directions,
    resting_vertices,
    spans,
    standing_part,
    top_spacing,
)
from pcmc.forces.wall_rows import _held_feet, find_walls
from pcmc.meshing.quality import triangle_quality
from pcmc.meshing.refinement import refine
from pcmc.plan import Divider, Plan, plan_from
from pcmc.solvers.newton import NewtonOptions, newton
from pcmc.solvers.state import SolverState


def held(surface):
    """The same surface with the bottoms of its walls fixed."""
    return surface.rebuilt(fixed=surface.held)


def example(n, alpha_aux, right=2.0):
    """Example 1 with its wall held, and a right patch of another tension."""
    return held(two_squares(n, alpha_aux=alpha_aux)).retensioned({"right": right})


def contact(surface):
    """Which vertices rest, their pull, and what their wall can take."""
    walls = find_walls(surface)
    resting = resting_vertices(surface, walls)
    return resting, *pull_and_capacity(StandingPart.of(surface, walls, resting))


def pressed(n=6, count=2, right=2.0, drop=0.0):
    """Example 1, its junction pressed onto the held bottom at the first ``count`` vertices from one end.

    The pressure right of the wall is less by ``drop``.
    """
    surface = uneven(example(n, 3.0, right), drop)
    walls = find_walls(surface, held=True)
    free = np.flatnonzero(walls.top_free)
    resting = np.zeros(surface.n, dtype=bool)
    resting[free[np.argsort(surface.vertices[free, 1])][:count]] = True
    standing = StandingPart.of(surface, walls, resting).surface
    full = surface.moved(StandingPart.of(surface, walls, resting).whole_positions(standing.vertices))
    return full, find_walls(full), resting, standing


def elsewhere(surface, seed=0):
    """The surface turned and moved, its plane with it."""
    R, shift = rotation(seed), np.array([3.0, -1.0, 2.0])
    return placed(surface, R, shift)


def test_a_standing_wall_that_is_held_pinches_only_when_asked():
    surface = example(6, 1.0)
    assert not find_walls(surface).pinchable.any()
    walls = find_walls(surface, held=True)
    assert walls.pinchable.tolist() == [False, False, True]
    assert not walls.sliding.any()
    top = np.flatnonzero(walls.held)
    assert len(top) == 5
    np.testing.assert_array_equal(surface.vertices[walls.foot[top], :2], surface.vertices[top, :2])
    np.testing.assert_array_equal(surface.vertices[walls.foot[top], 2], 0.0)
    assert (walls.foot[walls.corner] == np.flatnonzero(walls.corner)).all()


def test_the_first_vertex_may_be_a_foot():
    """Beside the resting ones a top leans over its foot: ℓ is that of the bottom, be the foot's number 0."""
    full, walls, resting, _ = pressed()
    tops = np.flatnonzero(walls.held & ~resting)
    top = tops[np.argsort(full.vertices[tops, 1])][0]
    leaning = full.moved(
        full.vertices + np.where(np.arange(full.n) == top, 0.7, 0.0)[:, None] * [1.0, 0.0, 0.0]
    )
    order = np.concatenate([[walls.foot[top]], np.delete(np.arange(full.n), walls.foot[top])])
    faces = np.argsort(order)[full.faces]
    other = Surface(leaning.vertices[order], faces, full.patch_of_face, full.patches, fixed=full.fixed[order])
    for here, there in zip(contact(leaning), contact(other), strict=True):
        np.testing.assert_allclose(there, here[order], rtol=1e-12, atol=1e-14)


def test_a_vertex_is_in_the_row_of_its_own_top_where_the_junction_leans_along_its_wall():
    """It was in that of the top nearest in plan, such as the corner, and a refined wall had no area there."""
    full, full_walls, resting, _ = pressed()
    lean = np.where(resting | full.fixed, 0.0, 1.0)[:, None] * [0.0, -1.0, 0.0]
    leaning = full.moved(full.vertices + lean * full.plane.height(full.vertices)[:, None])
    walls = find_walls(leaning)
    rows, tops = walls.rows, np.flatnonzero(walls.held)
    above = np.full(leaning.n, -1)
    above[walls.foot[tops]] = tops
    feet = np.flatnonzero(above[rows.vertices] >= 0)
    assert len(feet) == len(tops)
    at = rows.top_ends[np.arange(len(rows.vertices)), rows.fraction.astype(int)]
    assert at[feet].tolist() == above[rows.vertices[feet]].tolist()
    upright = full_walls.rows
    assert upright.vertices.tolist() == rows.vertices.tolist()
    assert at.tolist() == upright.top_ends[np.arange(len(at)), upright.fraction.astype(int)].tolist()


def test_walls_that_cannot_pair_their_vertices_cannot_pinch():
    line = [[0, -2, 0], [0, -1, 1], [0, 0, 2], [0, 1, 1], [0, 2, 0]]
    X = np.array([*line, [-2, 0, 0], [2, 0, 0], [0, 0, 0]], dtype=float)
    left, right = ([[i, i + 1, 5] for i in range(4)], [[i + 1, i, 6] for i in range(4)])
    wall = [[0, 7, 1], [7, 2, 1], [7, 3, 2], [7, 4, 3]]  # three free vertices over one
    patches = [Patch("left", 2.0), Patch("right", 2.0), Patch("wall", 1.0, pressure=0.0)]
    surface = Surface(X, [*left, *right, *wall], [0] * 4 + [1] * 4 + [2] * 4, patches, fixed=[0, 4, 5, 6, 7])
    assert not find_walls(surface, held=True).pinchable.any()


@pytest.mark.parametrize("count", [1, 3, 5])
def test_what_is_left_when_a_junction_rests_on_a_held_bottom(count):
    full, walls, resting, standing = pressed(count=count)
    np.testing.assert_array_equal(resting_vertices(full, walls), resting)
    np.testing.assert_array_equal(full.vertices[full.fixed], example(6, 3.0).vertices[full.fixed])
    assert standing.fixed[resting].all()
    assert triangle_quality(standing.vertices, standing.faces).min() > 0.1
    assert energy(standing) == pytest.approx(energy(full), rel=1e-13)
    again = StandingPart.of(full, walls, resting).surface
    np.testing.assert_array_equal(again.faces, standing.faces)
    np.testing.assert_array_equal(again.vertices, standing.vertices)


@pytest.mark.parametrize("drop", [0.0, 0.3])
@pytest.mark.parametrize("count", [1, 3, 5])
def test_pull_less_capacity_is_what_a_lift_to_any_side_gains(count, drop):
    """(E(lifted by t u) - E) / t tends to capacity - f·u, least along f; u across the bottom."""
    full, walls, resting, standing = pressed(count=count, right=3.0, drop=drop)
    part = StandingPart.of(full, walls, resting)
    pull, capacity = pull_and_capacity(part)
    along_pull = directions_of_pull(part)
    assert np.abs(along_pull[resting, 0]).min() > 0.05  # it pulls sideways, too
    step, spacing = 1e-6, 4 / 6
    for v in np.flatnonzero(resting):
        one = np.arange(full.n) == v
        for angle in (0.0, 0.7, -1.1):
            u = along_pull.copy()
            c, s = np.cos(angle), np.sin(angle)
            u[v] = [c * u[v, 0] + s * u[v, 2], 0.0, c * u[v, 2] - s * u[v, 0]]
            slope = (energy(lift(full, walls, one, step, u)) - energy(full)) / (step * spacing)
            gain = capacity[v] - c * pull[v]
            if v in standing.faces[standing.patch_of_face == 2]:
                assert slope > gain - 2e-5  # the wall that stands beside it folds, which costs more
            else:
                assert slope == pytest.approx(gain, abs=2e-5)
        assert capacity[v] == pytest.approx(3.0 * spacing, rel=1e-12)


def test_where_walls_meet_no_lift_gains_more_than_that_along_the_pull():
    """With h(u) + f·u = (E(lifted by t u) - E) / t, no f·u / h(u) is larger than pull over capacity."""
    start = held(four_fans(4)).retensioned({"fan 1": 2.6})
    walls = find_walls(start, held=True)
    assert walls.pinchable.sum() == 4
    resting = walls.top_free
    part = StandingPart.of(start, walls, resting)
    full = part.whole_at(part.surface.vertices)
    force = -energy_and_gradient(part.surface, supports=False)[1]
    pull, capacity = pull_and_capacity(part, force)
    middle = np.bincount(walls.top_edges.ravel(), minlength=full.n) == 4
    v = int(np.flatnonzero(middle)[0])
    step, random = 1e-6 / float(top_spacing(full, walls)[v]), np.random.default_rng(0)

    def share(u):
        ways = np.tile(u / np.linalg.norm(u), (full.n, 1))
        slope = (energy(lift(full, walls, middle, step, ways)) - energy(full)) / 1e-6
        return force[v] @ ways[v] / (slope + force[v] @ ways[v])

    best = pull_directions(part, force)[v]
    assert share(best) == pytest.approx(pull[v] / capacity[v], rel=1e-4)
    assert np.linalg.norm(np.cross(best, force[v])) > 1e-3 * np.linalg.norm(force[v])  # not along the pull
    assert max(share(u) for u in random.standard_normal((200, 3))) < (1.0 + 1e-4) * pull[v] / capacity[v]


def test_strong_walls_that_cross_leave_a_roof_in_each_bay():
    cross = [Divider(line, wall=2.5) for line in ([[6, 0], [6, 8]], [[0, 4], [12, 4]])]
    roof = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], cross, edge_length=0.45, tension=2.0, pressure=0.4)
    bay = Plan([[0, 0], [6, 0], [6, 4], [0, 4]], edge_length=0.45, tension=2.0, pressure=0.4)
    result = pcmc.solve(roof.surface())
    assert result.certificate.verdict is Verdict.STABLE
    part = standing_part(result.surface)
    np.testing.assert_array_equal(part.resting, part.walls.top_free)
    assert result.energy == pytest.approx(4.0 * pcmc.solve(bay.surface()).energy, rel=5e-4)
    assert "walls meet at resting vertex" in pcmc.verify(result.surface).reason


def test_a_strong_wall_between_two_others_comes_down_too():
    """No end of it is a corner, where top and bottom are one vertex."""
    lines = [[4, 0], [4, 8]], [[8, 0], [8, 8]], [[4, 4], [8, 4]]
    about = {"edge_length": 0.5, "tension": 2.0, "pressure": 0.4}
    roof = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], [Divider(line, wall=2.5) for line in lines], **about)
    result = pcmc.solve(roof.surface())
    assert result.certificate.verdict is Verdict.STABLE
    bays = [pcmc.solve(Plan([[0, 0], [4, 0], [4, y], [0, y]], **about).surface()).energy for y in (4, 8)]
    assert result.energy == pytest.approx(2.0 * sum(bays), rel=5e-4)


def test_a_wall_whose_bottom_has_a_gap_has_no_feet():
    """As many vertices above as below do not pair them: a bottom in two pieces has four ends, the top two."""
    rows = np.array([[[x, 0.0, z] for x in range(5)] for z in (1.0, 0.0)]).reshape(-1, 3)
    wall = SimpleNamespace(n=10, on_planes=(), vertices=rows)
    top, bottom = np.array([[0, 1], [1, 2], [2, 3], [3, 4]]), np.array([[5, 6], [7, 8], [8, 9]])
    assert _held_feet(wall, top, top + 5).tolist() == [5, 6, 7, 8, 9, *[-1] * 5]
    assert _held_feet(wall, top, bottom) is None
    assert _held_feet(wall, bottom, top) is None


def test_a_strong_wall_comes_down_on_a_sloped_bottom(tmp_path):
    """Of a tilted plan: a roof in each bay, on finer meshes, too, proved, and read again from a file."""
    about = {"edge_length": 0.8, "tension": 2.0, "pressure": 0.4}

    def tilted(points):
        return [[x, y, 0.2 * x - 0.1 * y] for x, y in points]

    strong = Divider([[6, 0], [6, 8]], wall=2.5, bottom="sloped")
    roof = pcmc.solve(Plan(tilted([[0, 0], [12, 0], [12, 8], [0, 8]]), [strong], **about).surface())
    assert roof.certificate.verdict is Verdict.STABLE
    part = standing_part(roof.surface)
    np.testing.assert_array_equal(part.resting, part.walls.top_free)
    pull, capacity = pull_and_capacity(part)
    count = part.resting.sum()
    assert capacity.sum() == pytest.approx(2.5 * np.hypot(8.0, 0.8) * count / (count + 1), rel=1e-12)
    assert (np.abs(pull) <= capacity).all()
    sides = [tilted([[x, 0], [x + 6, 0], [x + 6, 8], [x, 8]]) for x in (0, 6)]
    bays = [pcmc.solve(Plan(side, **about).surface()).energy for side in sides]
    assert roof.energy == pytest.approx(sum(bays), rel=1e-3)
    assert pcmc.check_mesh(roof).persists
    assert pcmc.verify(roof.surface).proved
    pcmc.write(tmp_path / "a.pcmc", roof)
    assert certify(pcmc.read(tmp_path / "a.pcmc")).verdict is Verdict.STABLE


def test_a_wall_that_stands_on_one_vertex_pulls_up_none_of_those_beside_it():
    """Its triangle spans from one resting vertex to the next, over the bottom that neither lifts with it."""
    cross = [Divider(line, wall=1.2) for line in ([[6, 0], [6, 8]], [[0, 4], [12, 4]])]
    roof = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], cross, edge_length=0.6, tension=2.0, pressure=0.4)
    full = pcmc.solve(roof.surface())
    assert full.certificate.verdict is Verdict.STABLE  # before, they were lifted and put down in turn
    part, full = standing_part(full.surface), full.surface
    walls, resting = part.walls, part.resting
    pull, capacity = pull_and_capacity(part)
    ways = directions_of_pull(part)
    beside = np.unique(part.surface.faces[spans(part)])
    beside = beside[resting[beside]]
    assert len(beside) >= 2
    for v in beside:
        one, step = np.arange(full.n) == v, 1e-5
        slope = (energy(lift(full, walls, one, step, ways)) - energy(full)) / (
            step * top_spacing(full, walls)[v]
        )
        assert slope == pytest.approx(capacity[v] - pull[v], abs=1e-3)


@pytest.mark.parametrize("line", [[[6, 4], [12, 4]], [[6, 4], [12, 8]]])
def test_walls_that_end_at_another_rest_together(line):
    walls = [Divider([[6, 0], [6, 8]], wall=2.5), Divider(line, wall=2.5)]
    plan = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], walls, edge_length=0.8, tension=2.0, pressure=0.4)
    result = pcmc.solve(plan.surface())
    assert result.certificate.verdict is Verdict.STABLE
    part = standing_part(result.surface)
    np.testing.assert_array_equal(part.resting, part.walls.top_free)


def directions_of_pull(part):
    """As the sheets pull."""
    return pull_directions(part, -energy_and_gradient(part.surface, supports=False)[1])


def test_a_move_past_the_bottom_comes_down_on_it():
    full = example(6, 3.0)
    walls = find_walls(full, held=True)
    part = StandingPart.of(full, walls, np.zeros(full.n, dtype=bool))
    top = int(np.flatnonzero(walls.held)[2])
    height = full.vertices[top, 2]
    for move, expected in [
        ([0, 0, -1.01 * height], True),  # through it
        ([0.05, 0, -0.999 * height], False),  # beside it
        ([0, 0, -0.999 * height], True),  # nearly onto it
        ([0, 0, 0.1], False),
    ]:
        X = full.vertices.copy()
        X[top] += move
        down = part.coming_down(X, full.vertices, 5e-3)
        assert down.sum() == down[top] == expected


def test_a_short_move_slides_no_vertex_far_along_the_junction():
    """To above their feet at once they went however far, and no step was short enough to lower E."""
    full = example(6, 3.0)
    walls = find_walls(full, held=True)
    leaning = full.moved(full.vertices + np.where(walls.top_free, 0.2, 0.0)[:, None] * [0.0, 1.0, 0.0])
    at = SolverState(leaning, 0.45, held=True)
    start = at.at.X
    for step in (1e-2, 1e-3):
        X, down = at.displaced(step * (at.walls.top_free[:, None] * np.array([0.0, 0.0, 1.0])))
        assert not down.any()
        moved = np.linalg.norm(X - start, axis=1)[at.walls.top_free]
        assert (moved > 1.2 * step).any()  # some do slide
        assert (moved < 2.0 * step).all()


PLANS = (  # where solving on the finer mesh needs a wall that can pinch, though none has come down
    (
        [
            [0, 0],
            [14.12, 0],
            [14.12, 8.72],
            [10.42, 8.72],
            [10.42, 3.53],
            [3.71, 3.53],
            [3.71, 8.72],
            [0, 8.72],
        ],
        [([[-0.02, 2.6026], [14.14, 2.6026]], 0.159), ([[8.1245, -0.02], [8.1245, 3.55]], 0.103)],
        [{"tension": 2.974, "snow": 0.32}, 2.988, {"tension": 3.008, "snow": 0.15}, 2.973],
        0.49,
    ),
    (
        [[0, 0], [15.01, 0], [11.24, 8.2], [4.08, 8.2]],
        [
            ([[4.6164, -0.0198], [3.5357, 7.1318]], 1.917),
            ([[4.064, 3.6357], [1.4116, 2.8702]], 0.751),
            ([[14.0066, 2.2182], [2.7687, 5.6087]], 0.226),
        ],
        [4.362, 4.417, {"tension": 4.366, "snow": 0.52, "pressure": 1.04}, 4.302, 4.437],
        0.5,
    ),
)


@pytest.mark.parametrize(("outline", "lines", "patches", "length"), at_night(*PLANS))
def test_a_roof_that_needs_a_wall_to_pinch_on_a_finer_mesh_persists(outline, lines, patches, length):
    dividers = [{"curve": curve, "wall": wall} for curve, wall in lines]
    settings = {f"p{k + 1}": p if isinstance(p, dict) else {"tension": p} for k, p in enumerate(patches)}
    plan = {"outline": outline, "dividers": dividers, "edge_length": length, "patches": settings}
    check = check_mesh(solve(plan_from(plan).surface()))
    assert check.persists, check.detail


@pytest.mark.parametrize(("n", "alpha_aux", "count"), [(8, 3.0, 7), *at_night((16, 2.0, 2))])
def test_by_symmetry_it_rests_as_where_the_bottom_slides(n, alpha_aux, count):
    result = solve(example(n, alpha_aux))
    assert result.converged
    found = result.certificate
    assert found.verdict is Verdict.STABLE
    assert found.residual < 1e-11
    assert found.curvature_error < 1e-9
    resting, pull, capacity = contact(result.surface)
    assert resting.sum() == count
    np.testing.assert_array_equal(found.pinched, np.flatnonzero(resting))
    assert (pull <= capacity * (1 + 1e-9)).all()
    sliding = stationary(partial(two_squares, n, alpha_aux=alpha_aux))
    assert len(sliding.certificate.pinched) == count
    assert result.energy == pytest.approx(sliding.energy, rel=1e-4)  # its triangles lie elsewhere
    same = certify(held(sliding.surface))
    assert same.verdict is Verdict.STABLE
    assert same.residual < 1e-10
    assert same.energy == pytest.approx(sliding.energy, rel=1e-13)
    np.testing.assert_array_equal(same.pinched, sliding.certificate.pinched)


def test_it_stands_just_below_the_tension_that_keeps_it_down():
    low = solve(example(8, 3.0))
    resting, pull, capacity = contact(low.surface)
    limit = 3.0 * float((pull[resting] / capacity[resting]).max())
    above = solve(low.surface.retensioned({"wall": 1.001 * limit}))
    below = solve(low.surface.retensioned({"wall": 0.99 * limit}))
    assert above.certificate.verdict is below.certificate.verdict is Verdict.STABLE
    assert len(above.certificate.pinched) == 7
    assert 0 < len(below.certificate.pinched) < 7
    weak = certify(low.surface.retensioned({"wall": 0.99 * limit}))
    assert weak.verdict is Verdict.NOT_CONVERGED
    assert "the sheets pull harder than the wall can hold" in weak.detail


def test_a_sideways_pull_takes_the_junction_off():
    """With patches of 2 and 3 the junction is pulled across; a wall of 2 holds it where one of 0.3 cannot."""
    start = example(8, 4.0, right=3.0)
    low = solve(start)
    assert low.certificate.verdict is Verdict.STABLE
    resting, walls = contact(low.surface)[0], find_walls(low.surface)
    assert resting.sum() == 7
    direction = directions_of_pull(StandingPart.of(low.surface, walls, resting))
    assert (direction[resting, 0] > 0.2).all()  # towards the stronger patch
    weak = solve(low.surface.retensioned({"wall": 1.2}))
    assert weak.certificate.verdict is Verdict.STABLE
    assert len(weak.certificate.pinched) < 7
    top = find_walls(weak.surface, held=True).held & ~contact(weak.surface)[0]
    assert (weak.surface.vertices[top, 0] > 0.0).all()


def test_it_rests_along_a_length_that_does_not_depend_on_the_mesh():
    """Refined from mesh to mesh: the energy converges, and the resting part of the junction too."""
    result, energies, rests = None, [], []
    for _ in range(4):
        result = solve(example(8, 2.4) if result is None else refine(result.surface))
        assert result.certificate.verdict is Verdict.STABLE
        energies.append(result.energy)
        top = find_walls(result.surface, held=True).top_free.sum() + 1
        rests.append(len(result.certificate.pinched) / top)
    differences = -np.diff(energies)
    orders = np.log2(differences[:-1] / differences[1:])
    assert (orders > 1.3).all()
    assert abs(rests[-1] - rests[-2]) < 0.05
    assert 0.1 < rests[-1] < 0.95


def test_it_turns_with_the_plane():
    here, there = solve(example(8, 3.0, right=2.5)), solve(elsewhere(example(8, 3.0, right=2.5)))
    assert there.certificate.verdict is here.certificate.verdict
    np.testing.assert_array_equal(there.certificate.pinched, here.certificate.pinched)
    assert len(here.certificate.pinched)
    assert there.energy == pytest.approx(here.energy, rel=1e-10)


def test_it_hangs_below_the_plane_alike():
    above = example(8, 3.0)
    patches = [Patch(p.name, p.tension, -p.pressure) for p in above.patches]
    below = Surface(above.vertices * [1, 1, -1], above.faces, above.patch_of_face, patches, fixed=above.fixed)
    one, two = solve(above), solve(below)
    np.testing.assert_array_equal(two.certificate.pinched, one.certificate.pinched)
    assert two.energy == pytest.approx(one.energy, rel=1e-12)


@pytest.mark.parametrize("suffix", ["pcmc", "fe", "obj", "vtu", "glb", "3dm"])
@pytest.mark.parametrize(("n", "alpha_aux"), [(8, 3.0), *at_night((16, 2.0))])
def test_files_carry_it(n, alpha_aux, suffix, tmp_path):
    surface = stationary(partial(example, n, alpha_aux)).surface
    before = certify(surface)
    path = tmp_path / f"held.{suffix}"
    pcmc.write(path, surface)
    again = pcmc.read(path)
    after = solve(again).certificate if suffix == "glb" else certify(again)  # single precision in it
    assert after.verdict is before.verdict is Verdict.STABLE
    assert len(after.pinched) == len(before.pinched) > 0
    assert after.energy == pytest.approx(before.energy, rel=1e-6)


def test_a_bottom_with_more_vertices_than_the_junction_is_no_place_to_rest():
    surface = example(8, 3.0)
    topo, F = surface.topology, surface.faces
    ends = surface.fixed[topo.edges].all(axis=1) & topo.boundary_edge
    near = (np.abs(surface.vertices[topo.edges, :2]) < 1.0).all(axis=(1, 2))
    bottom = np.flatnonzero(ends & near)[0]
    a, b = topo.edges[bottom]
    face = int(np.flatnonzero((topo.edge_of_face == bottom).any(axis=1))[0])
    one, two = F[face].copy(), F[face].copy()
    one[one == a], two[two == b] = surface.n, surface.n
    split = Surface(
        np.vstack([surface.vertices, surface.vertices[[a, b]].mean(axis=0)]),
        np.vstack([np.delete(F, face, axis=0), one, two]),
        np.append(np.delete(surface.patch_of_face, face), [2, 2]),
        surface.patches,
        fixed=np.append(surface.fixed, True),
    )
    assert not find_walls(split, held=True).pinchable.any()
    found = newton(split).certificate
    assert found.verdict is Verdict.WALL_DOWN
    assert "comes down on the held bottom of its wall" in found.detail


def test_newton_closes_where_a_junction_is_low_over_its_bottom():
    """Three walls meet; while rows followed the junction to the end, a step left a 15th of the forces."""
    outline = [[10, 0], [5, 8.66], [-5, 8.66], [-10, 0], [-5, -8.66], [5, -8.66]]
    walls = {(10.0, 0.0): 6.7, (-5.0, 8.66): 4.4, (-5.0, -8.66): 5.0}
    dividers = [Divider([[0, 0], end], wall=tension) for end, tension in walls.items()]
    patches = {"a": {"tension": 3.19, "at": [3, 4]}, "b": {"tension": 3.79, "at": [-6, 0]}}
    patches["c"] = {"tension": 4.22, "at": [3, -4]}
    start = Plan(outline, dividers, edge_length=1.6, patches=patches).surface()
    found = newton(start, NewtonOptions(levels=1))
    assert found.converged
    residual = found.history[found.history["step"] == "newton"]["residual"].to_numpy()
    assert residual[-1] < 1e-3 * residual[-2]
