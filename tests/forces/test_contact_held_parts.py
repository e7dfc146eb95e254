"""Walls with held bottoms that can pinch: what is left of the roof, its pull, and moves towards a bottom."""

from types import SimpleNamespace

import numpy as np
import pytest
from held_walls import contact, directions_of_pull, example, held, pressed
from starts import four_fans

import pcmc
from pcmc import Patch, Surface, Verdict, energy
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
from pcmc.plan import Divider, Plan
from pcmc.solvers.state import SolverState


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


def test_a_wall_whose_bottom_has_a_gap_has_no_feet():
    """As many vertices above as below do not pair them: a bottom in two pieces has four ends, the top two."""
    rows = np.array([[[x, 0.0, z] for x in range(5)] for z in (1.0, 0.0)]).reshape(-1, 3)
    wall = SimpleNamespace(n=10, on_planes=(), vertices=rows)
    top, bottom = np.array([[0, 1], [1, 2], [2, 3], [3, 4]]), np.array([[5, 6], [7, 8], [8, 9]])
    assert _held_feet(wall, top, top + 5).tolist() == [5, 6, 7, 8, 9, *[-1] * 5]
    assert _held_feet(wall, top, bottom) is None
    assert _held_feet(wall, bottom, top) is None


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
