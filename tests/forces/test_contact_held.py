"""Walls with held bottoms that pinch: a junction that comes down rests on the curve of its bottom."""

from functools import partial

import numpy as np
import pytest
from held_walls import contact, directions_of_pull, elsewhere, example, held
from nightly import at_night
from starts import stationary, two_squares

import pcmc
from pcmc import Patch, Surface, Verdict, certify, check_mesh, solve
from pcmc.forces.pinching import StandingPart, pull_and_capacity, standing_part
from pcmc.forces.wall_rows import find_walls
from pcmc.meshing.elevation import elevate
from pcmc.meshing.refinement import refine
from pcmc.plan import Divider, Plan, plan_from
from pcmc.solvers import solve_once
from pcmc.solvers.newton import NewtonOptions, newton


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


@pytest.mark.parametrize("line", [[[6, 4], [12, 4]], [[6, 4], [12, 8]]])
def test_walls_that_end_at_another_rest_together(line):
    walls = [Divider([[6, 0], [6, 8]], wall=2.5), Divider(line, wall=2.5)]
    plan = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], walls, edge_length=0.8, tension=2.0, pressure=0.4)
    result = pcmc.solve(plan.surface())
    assert result.certificate.verdict is Verdict.STABLE
    part = standing_part(result.surface)
    np.testing.assert_array_equal(part.resting, part.walls.top_free)


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


def test_a_wall_of_curved_elements_that_cannot_balance_says_so():
    """That a wall which comes down is for flat triangles alone would be no reason here."""
    sheets = example(2, 0.1).retensioned({"left": 1.0, "right": 5.0}, {"left": 0.3, "right": 0.3})
    found = solve_once(elevate(sheets, 2)).certificate
    assert found.verdict is Verdict.NO_EQUILIBRIUM, found.detail
