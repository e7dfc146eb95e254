"""Vertices that slide along straight lines: the natural condition at the end of a junction."""

import copy
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from nightly import at_night
from refusals import refused

import pcmc
from generators import two_squares
from pcmc import Line, Patch, Surface, certify, solve
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.forces.functional import energy_and_gradient, energy_at
from pcmc.forces.motion_space import motion_space, vertex_classes
from pcmc.forces.second_variation import hessian
from pcmc.meshing.local_refinement import refine_near
from pcmc.meshing.refinement import refine
from pcmc.meshing.remeshing import remesh
from pcmc.surface.supports import apply_supports
from tests.forces.test_linearise import slope

DEEP, BESIDE = 0.7, 0.2


def film(left: float, right: float, wall: float, x: float = 0.0) -> Surface:
    """Two flat films in z = 0 between the lines y = 0 and y = 1, and a third one from where they meet.

    That is a junction of one edge, whose ends slide along the lines; the third film's lower edge is held
    at the depth DEEP and at x = BESIDE.
    """
    X = [[x, 0, 0], [x, 1, 0], [-1, 0, 0], [-1, 1, 0], [1, 0, 0], [1, 1, 0]]
    X += [[BESIDE, 0, -DEEP], [BESIDE, 1, -DEEP]]
    F = [[2, 0, 1], [2, 1, 3], [0, 4, 5], [0, 5, 1], [0, 1, 7], [0, 7, 6]]
    tensions = {"left": left, "right": right, "wall": wall}
    patches = [Patch(name, tension, pressure=0.0) for name, tension in tensions.items()]
    lines = {Line((0, 0, 0), (1, 0, 0)): [0], Line((0, 1, 0), (-2, 0, 0)): [1]}
    return Surface(X, F, [0, 0, 1, 1, 2, 2], patches, fixed=range(2, 8), on_line=lines)


def squares(n: int = 8, wall: float = 1.0) -> Surface:
    """Example 1; its sides across the junction slide along themselves, but for their corners."""
    given = two_squares(n, alpha_aux=wall)
    X = given.vertices
    lines = {}
    for y in (-2.0, 2.0):
        side = given.fixed & (np.abs(X[:, 1] - y) < 1e-9) & (np.abs(X[:, 0]) < 4.0 - 1e-9)
        lines[Line((0, y, 0), (1, 0, 0))] = side
    return replace(given, on_line=lines)


@pytest.mark.parametrize(("left", "right", "wall"), [(2, 3, 2), (3, 2, 1.2), (2, 2, 1), (1.5, 2.5, 1.6)])
def test_an_end_slides_to_where_the_forces_along_the_line_balance(left, right, wall):
    """α_w sin φ = α_r - α_l, φ the angle of the third film from straight down."""
    result = solve(film(left, right, wall), "newton")
    assert result.converged
    phi = math.asin((right - left) / wall)
    np.testing.assert_allclose(result.surface.vertices[:2, 0], BESIDE + DEEP * math.tan(phi), atol=1e-9)
    certificate = certify(result.surface)
    assert certificate.index == 0
    np.testing.assert_allclose(certificate.reactions[:2, 0], 0.0, atol=1e-9)
    assert (certificate.reactions[:2, 2] > 0.1).all()  # the lines carry the film that pulls down


def test_where_no_place_balances_it_runs_away():
    found = solve(film(1.0, 3.0, 1.5), "newton")
    assert not found.converged


def test_taylor_slopes_along_the_lines():
    surface = film(2.0, 3.0, 2.0, x=0.1)
    moves = np.random.default_rng(0).standard_normal((surface.n, 3))
    allowed = 0.1 * apply_supports(surface, moves.copy())
    assert np.abs(allowed[:2, 0]).min() > 0.0
    np.testing.assert_array_equal(np.delete(allowed.ravel(), [0, 3]), 0.0)
    first, H = energy_and_gradient(surface)[1], hessian(surface)
    np.testing.assert_array_equal(np.flatnonzero(first), [0, 3])
    h = 2.0 ** -np.arange(3, 8)
    rest = np.array([energy_at(surface, surface.vertices + s * allowed) for s in h]) - pcmc.energy(surface)
    rest -= h * (first * allowed).sum()
    bend = rest - 0.5 * h**2 * (allowed.ravel() @ (H @ allowed.ravel()))
    orders = [np.polyfit(np.log(h), np.log(np.abs(r)), 1)[0] for r in (rest, bend)]
    assert orders == pytest.approx([2, 3], abs=0.15)


def test_the_derivative_of_the_forces_is_the_limit_of_differences():
    surface = squares(4)
    X = surface.vertices + 0.05 * apply_supports(surface, np.cos(np.arange(3.0 * surface.n)).reshape(-1, 3))
    moved = surface.moved(X)
    assert slope(moved, vertex_classes(moved)) == pytest.approx(2.0, abs=0.05)


def test_only_ends_of_junctions_move_the_shape():
    surface = squares()
    classes = vertex_classes(surface)
    dimension = motion_space(surface, classes, surface.vertices).dimension
    ends = next(c.vertices[[0, -1]] for c in surface.topology.junctions if not c.closed)
    for _, along in surface.on_line:
        assert dimension[along].sum() == 1  # the others only slide along their straight side
        assert dimension[np.intersect1d(np.flatnonzero(along), ends)].tolist() == [1]


@pytest.mark.parametrize("wall", [0.5, *at_night(1.0)])
def test_a_sliding_end_shows_what_the_mesh_holds(wall):
    """With its ends fixed Example 1 is a minimum on this mesh; with sliding ones it is the saddle it is."""
    fixed = solve(two_squares(8, alpha_aux=wall), "newton", target="stationary")
    sliding = solve(squares(8, wall), "newton", target="stationary")
    assert (fixed.certificate.index, sliding.certificate.index) == (0, 1)
    np.testing.assert_allclose(sliding.surface.vertices, fixed.surface.vertices, atol=1e-8)
    assert not solve(squares(8, wall), "newton").converged  # a minimum: the junction runs away


def test_finer_meshes_slide_too():
    coarse = squares(4)
    for fine in (refine(coarse), refine_near(coarse, [0, 2, 0], 3, 1.0), remesh(coarse, 0.5)):
        for (line, along), (same, before) in zip(fine.on_line, coarse.on_line, strict=True):
            assert line is same
            X = fine.vertices
            on_side = line.distance(X) < 1e-9
            on_side &= np.abs(X[:, 0]) < 4.0 - 1e-9
            np.testing.assert_array_equal(along, on_side)
            assert along.sum() >= before.sum()
            assert fine.fixed[along].all()


def test_files_and_copies_keep_the_lines(tmp_path):
    surface = squares(4)
    for suffix in (".pcmc", ".obj"):
        pcmc.write(tmp_path / f"a{suffix}", surface)
    for again in (
        pcmc.read(tmp_path / "a.pcmc"),
        pcmc.read(tmp_path / "a.obj"),
        copy.deepcopy(surface),
        pickle.loads(pickle.dumps(surface)),
    ):
        for (line, along), (same, before) in zip(again.on_line, surface.on_line, strict=True):
            assert line == same
            np.testing.assert_array_equal(along, before)
            assert not along.flags.writeable


def test_what_it_refuses():
    surface = squares(4)
    given = {"vertices": surface.vertices, "faces": surface.faces, "patch_of_face": surface.patch_of_face}
    side = np.flatnonzero(surface.on_line[0][1])
    line, other = surface.on_line[0][0], Line((0, 0, 5), (1, 0, 0))
    with refused(SurfaceError, what="vertices", where=side[0]):
        Surface(**given, patches=surface.patches, on_line={other: side})
    with refused(SurfaceError, what="vertices", where=side[0]):
        Surface(
            **given, patches=surface.patches, on_line=[(line, side), (replace(line, point=(1, -2, 0)), side)]
        )
    for wrong in (3, [3], {"x": side}):
        with refused(SurfaceError, what="on_line"):
            Surface(**given, patches=surface.patches, on_line=wrong)
    with refused(SurfaceError, what="Line.direction"):
        Line((0, 0, 0), (0, 0, 0))
    X = surface.vertices.copy()
    X[side[0], 2] = 0.1
    with refused(SurfaceError, what="vertices", where=side[0]):
        surface.moved(X)
    for method in ("nesterov", "lbfgs"):
        with refused(OptionError, what="method", found=method):
            solve(surface, method)
