"""Vertices that slide along circles: the natural condition at the end of a junction on a round outline."""

import copy
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from scipy.optimize import brentq

import pcmc
from generators import three_patches
from pcmc import Circle, Patch, Surface, certify, solve
from pcmc.base.errors import SurfaceError
from pcmc.forces.functional import energy_and_gradient, energy_at
from pcmc.forces.jacobian import linearise
from pcmc.forces.motion_space import motion_space, vertex_classes
from pcmc.forces.pattern import hessian_pattern
from pcmc.forces.rigid_motions import rigid_motions
from pcmc.forces.second_variation import assemble, hessian
from pcmc.meshing.local_refinement import refine_near
from pcmc.meshing.refinement import refine
from pcmc.meshing.remeshing import remesh
from pcmc.surface.supports import apply_supports, onto_circles

NEAR, FAR = 3.0, 2.0  # distances of the two held edges from the axis
FLIP = NEAR / (NEAR - 1.0) * (FAR + 1.0) / FAR  # tension of the second film at which the first gives way


def films(one: float, other: float, angle: float = 0.0, second: float = math.pi) -> Surface:
    """Two flat films that meet in a junction of one edge, whose ends slide along unit circles.

    The first film's other edge is held at the distance NEAR and the angle 0, the second's at FAR and
    ``second``.
    Per length E = α |p - q| + β |p - q'|, p on the unit circle.
    """
    places = [(1.0, angle), (NEAR, 0.0), (FAR, second)]
    X = [[r * math.cos(a), y, r * math.sin(a)] for r, a in places for y in (0.0, 1.0)]
    F = [[0, 2, 3], [0, 3, 1], [4, 0, 1], [4, 1, 5]]
    patches = [Patch("one", one, pressure=0.0), Patch("other", other, pressure=0.0)]
    circles = {Circle((0, y, 0), (0, 1, 0), 1.0): [y] for y in (0, 1)}
    return Surface(X, F, [0, 0, 1, 1], patches, fixed=range(2, 6), on_line=circles)


def roofs() -> Surface:
    """Fig. 4 with its whole rim free to slide along itself."""
    given = three_patches(3)
    X = given.vertices
    rim = given.fixed & (np.abs(np.linalg.norm(X[:, :2], axis=1) - 10.0) < 1e-9)
    return replace(given, on_line={Circle((0, 0, 0), (0, 0, 1), 10.0): rim})


def along_circles(surface: Surface, amount: float) -> np.ndarray:
    """A random motion along the supports, (n,3)."""
    moves = np.random.default_rng(0).standard_normal((surface.n, 3))
    return amount * apply_supports(surface, moves)


@pytest.mark.parametrize(("one", "other", "second"), [(2, 1, 2.0), (1, 1.5, 2.5), (1.2, 0.8, -1.3)])
def test_an_end_slides_to_where_the_forces_along_the_circle_balance(one, other, second):
    """d/dθ of α √(1 + R² - 2 R cos θ) + β √(1 + r² - 2 r cos(θ - ψ)) is zero."""

    def pull(angle):
        near, far = (
            weight * r * math.sin(a) / math.sqrt(1.0 + r * r - 2.0 * r * math.cos(a))
            for weight, r, a in ((one, NEAR, angle), (other, FAR, angle - second))
        )
        return near + far

    result = solve(films(one, other, 0.5 * second, second), "newton")
    assert result.converged
    ends = result.surface.vertices[:2]
    expected = brentq(pull, *sorted((0.0, second)), xtol=1e-14)
    np.testing.assert_allclose(np.arctan2(ends[:, 2], ends[:, 0]), expected, atol=1e-8)
    np.testing.assert_allclose(np.hypot(ends[:, 0], ends[:, 2]), 1.0, atol=1e-14)
    tangent = np.array([-math.sin(expected), 0.0, math.cos(expected)])
    reactions = certify(result.surface).reactions[:2]
    np.testing.assert_allclose(reactions @ tangent, 0.0, atol=1e-8)
    assert (np.linalg.norm(reactions, axis=1) > 0.05).all()


@pytest.mark.parametrize(("tension", "index"), [(0.95 * FLIP, 0), (1.05 * FLIP, 1)])
def test_the_index_flips_where_the_curvature_says(tension, index):
    """E'' = α R / (R - 1) - β r / (r + 1) at θ = 0; without the circle's curvature it is never negative."""
    assert certify(films(1.0, tension)).index == index


def test_taylor_slopes_along_the_circles():
    surface = films(1.0, 1.5, 0.4)
    X, d = surface.vertices, along_circles(films(1.0, 1.5, 0.4), 0.3)
    assert np.abs(d[:2]).max() > 0.1
    assert not d[2:].any()
    energy, first = energy_and_gradient(surface)
    raw, H = energy_and_gradient(surface, supports=False)[1], hessian(surface)
    bend = np.array([[-X[v, 0], 0.0, -X[v, 2]] for v in range(2)]) * (d[:2] ** 2).sum(axis=1)[:, None]
    second = d.ravel() @ (H @ d.ravel()) + (raw[:2] * bend).sum()
    classes = vertex_classes(surface)
    space = motion_space(surface, classes, X)
    pattern = hessian_pattern(classes, space)
    s = space.to_coordinates(d)
    projected = pattern.symmetric(assemble(surface, classes, space, pattern, X))
    assert s @ (projected @ s) == pytest.approx(second, rel=1e-12)
    h = 2.0 ** -np.arange(3, 8)
    lengths = np.linalg.norm(d[:2], axis=1)
    rest = []
    for t in h:  # by the angle t |d|, so that the arc is exact
        moved = X.copy()
        out, ahead = X[:2] * [1, 0, 1], d[:2] / lengths[:, None]
        turn = (t * lengths)[:, None]
        moved[:2] = X[:2] - out + np.cos(turn) * out + np.sin(turn) * ahead
        rest.append(energy_at(surface, moved) - energy - t * (first * d).sum())
    orders = [np.polyfit(np.log(h), np.log(np.abs(r)), 1)[0] for r in (rest, rest - 0.5 * h**2 * second)]
    assert orders == pytest.approx([2, 3], abs=0.15)


def forces(surface, classes, X):
    return motion_space(surface, classes, X).project(energy_and_gradient(surface, X)[1])


def test_the_derivative_of_the_forces_is_the_limit_of_differences():
    given = roofs()
    shaken = given.vertices + 0.2 * apply_supports(given, np.cos(np.arange(3.0 * given.n)).reshape(-1, 3))
    surface = given.moved(onto_circles(given, shaken))
    classes, X = vertex_classes(surface), surface.vertices
    space = motion_space(surface, classes, X)
    d = np.random.default_rng(1).standard_normal(X.shape)  # off the motion space too
    d[surface.fixed & (space.dimension == 0)] = 0.0
    assert (space.dimension[surface.fixed] == 1).sum() == 3
    d[surface.on_plane] = surface.plane.along(d[surface.on_plane])
    exact = linearise(surface, classes, space, X, energy_and_gradient(surface, X)[1])(d)
    errors = []
    for t in surface.size * np.array([2e-5, 1e-5]):
        change = forces(surface, classes, X + t * d) - forces(surface, classes, X - t * d)
        errors.append(np.abs(space.to_coordinates(change / (2.0 * t)) - exact).max())
    assert errors[1] < 1e-4 * np.abs(exact).max()
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)


def test_only_ends_of_junctions_move_the_shape_and_a_round_outline_turns_freely():
    surface = roofs()
    dimension = motion_space(surface, vertex_classes(surface), surface.vertices).dimension
    ends = [c.vertices[[0, -1]] for c in surface.topology.junctions]
    moves = np.flatnonzero(surface.on_line[0][1] & (dimension > 0))
    assert len(moves) == 3
    assert np.isin(moves, ends).all()
    (motion,) = rigid_motions(surface)  # about the axis
    np.testing.assert_allclose(np.abs(motion[1]) / np.linalg.norm(motion[1]), [0, 0, 1], atol=1e-9)
    assert not len(rigid_motions(replace(surface, on_line=())))


def test_finer_meshes_slide_too():
    coarse = roofs()
    circle = coarse.on_line[0][0]
    end = coarse.vertices[np.flatnonzero(coarse.on_line[0][1])[0]]
    for fine in (refine(coarse), refine_near(coarse, end, 3, 5.0), remesh(coarse, 1.5)):
        ((same, along),) = fine.on_line
        assert same is circle
        assert along.sum() > coarse.on_line[0][1].sum()
        np.testing.assert_array_equal(along, fine.fixed & fine.topology.on_boundary)


def test_an_arc_between_held_vertices_stays_between_them():
    given = roofs()
    ((circle, rim),) = given.on_line
    held = rim & (given.vertices[:, 0] < 0.0)
    coarse = replace(given, on_line={circle: rim & ~held}, fixed=given.fixed)
    for fine in (refine(coarse), remesh(coarse, 1.5)):
        ((_, along),) = fine.on_line
        assert (fine.vertices[along, 0] > coarse.vertices[held, 0].max()).all()
        assert fine.fixed.sum() > along.sum() > (rim & ~held).sum()


def test_files_and_copies_keep_the_circles(tmp_path):
    surface = roofs()
    path = tmp_path / "a.pcmc"
    pcmc.write(path, surface)
    for again in (pcmc.read(path), copy.deepcopy(surface), pickle.loads(pickle.dumps(surface))):
        ((circle, along),) = again.on_line
        assert circle == surface.on_line[0][0]
        np.testing.assert_array_equal(along, surface.on_line[0][1])
        assert not along.flags.writeable


def test_what_it_refuses():
    surface = roofs()
    ((circle, rim),) = surface.on_line
    with refused(SurfaceError, what="vertices", where=int(np.flatnonzero(rim)[0])):
        replace(surface, on_line={Circle((0, 0, 0), (0, 0, 1), 9.0): rim})
    X = surface.vertices.copy()
    X[np.flatnonzero(rim)[1]] *= 1.1
    with refused(SurfaceError, what="vertices", where=int(np.flatnonzero(rim)[1])):
        surface.moved(X)
    with refused(SurfaceError, what="Circle.normal"):
        replace(circle, normal=(0, 0, 0))
    for radius in (0.0, -1.0, math.inf, math.nan):
        with refused(SurfaceError, what="Circle.radius"):
            replace(circle, radius=radius)
