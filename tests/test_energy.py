"""The energy against its identities, its Taylor expansion and the paper's formulas."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import cap, hexagon, octahedron, pyramid, rotation, shaken, three_patches

from generators import two_caps, two_squares
from pcmc import Patch, Plane, Surface, energy, gradient, hessian, kernels
from pcmc.energy import (
    apply_supports,
    energy_and_gradient,
    energy_at,
    patch_areas,
    patch_volumes,
    volume,
)
from pcmc.topology import POINT

seeds = st.integers(0, 2**32 - 1)
small = st.floats(-10.0, 10.0)


def generic() -> Surface:
    """Fig. 4 on a tilted plane away from the origin, shaken: nothing vanishes by symmetry."""
    return shaken(three_patches(3, Plane((1, 2, 3), (1, -2, 2))))


def forms(surface, **keywords):
    """E and ∇E with the supports left out."""
    return energy_and_gradient(surface, supports=False, **keywords)


def terms(surface):
    """(A, ∇A, Hess A) and (V, ∇V, Hess V) of the whole surface, as energies of unit weights."""
    names = [p.name for p in surface.patches]
    ones, none = dict.fromkeys(names, 1.0), dict.fromkeys(names, 0.0)
    area = surface.retensioned(ones, pressures=none)
    both = surface.retensioned(ones, pressures=ones)
    (A, dA), (E, dE) = forms(area), forms(both)
    return (A, dA, hessian(area)), (A - E, dA - dE, hessian(area) - hessian(both))


# ---- closed forms -------------------------------------------------------------------------------


def test_energy_of_the_pyramid():
    for h in (0.3, 1.0, 2.0):
        expected = 4 * 2.5 * np.sqrt(1 + h**2) - 4 * h / 3
        assert energy(pyramid(2.5, h)) == pytest.approx(expected, rel=1e-15)


def test_areas_and_volumes():
    ball = octahedron(2.0)
    assert patch_areas(ball) == pytest.approx([4 * np.sqrt(3)])
    assert patch_volumes(ball) == pytest.approx([4 / 3])
    assert energy(ball) == pytest.approx(8 * np.sqrt(3) - 4 / 3)
    fig4 = three_patches(3)
    assert patch_areas(fig4)[3:] == pytest.approx(0.5 * 3 * 1.5)  # right triangles 3 by 1.5
    assert volume(fig4) == pytest.approx(patch_volumes(fig4)[:3].sum())


def test_volume_is_seen_from_the_plane():
    plane = Plane((1, 2, 3), (2, 1, 2))
    assert volume(three_patches(3, plane)) == pytest.approx(volume(three_patches(3)), rel=1e-13)
    assert energy(three_patches(3, plane)) == pytest.approx(energy(three_patches(3)), rel=1e-13)


# ---- identities ---------------------------------------------------------------------------------


def test_translations_cost_no_area():
    (_, dA, _), _ = terms(generic())
    assert np.abs(dA.sum(axis=0)).max() < 1e-13


def test_translations_of_a_closed_surface_cost_nothing():
    dE = forms(shaken(octahedron()))[1]
    assert np.abs(dE.sum(axis=0)).max() < 1e-14


def test_rotations_cost_neither_area_nor_volume():
    surface = generic()
    X = surface.vertices - surface.plane.point
    for _, d, _ in terms(surface):
        assert np.abs(np.cross(X, d).sum(axis=0)).max() < 1e-12


def test_area_is_of_degree_two_and_volume_of_degree_three():
    surface = generic()
    X = surface.vertices - surface.plane.point
    (A, dA, HA), (V, dV, HV) = terms(surface)
    assert (X * dA).sum() == pytest.approx(2 * A, rel=1e-14)
    assert (X * dV).sum() == pytest.approx(3 * V, rel=1e-13)
    np.testing.assert_allclose(HA @ X.ravel(), dA.ravel(), atol=1e-13)
    np.testing.assert_allclose(HV @ X.ravel(), 2 * dV.ravel(), atol=1e-13)


def test_hessian_is_symmetric_and_knows_the_rigid_motions():
    surface = generic()
    (_, dA, HA), (_, dV, HV) = terms(surface)
    for H in (HA, HV):
        assert abs(H - H.T).max() < 1e-15
    shift = np.tile(np.eye(3), (surface.n, 1))
    assert np.abs(HA @ shift).max() < 1e-13
    X = surface.vertices - surface.plane.point
    for axis in np.eye(3):  # turning the surface turns its gradient
        turn = np.cross(axis, X)
        for d, H in ((dA, HA), (dV, HV)):
            np.testing.assert_allclose(H @ turn.ravel(), np.cross(axis, d).ravel(), atol=1e-13)


# ---- Taylor expansion ---------------------------------------------------------------------------


def slopes(value, first, second, surface, moves):
    """Orders at which E(X + h v) - Σ terms vanishes without and with the second derivative."""
    h = 2.0 ** -np.arange(3, 8)
    rest = np.array([value(surface.vertices + s * moves) - value(surface.vertices) for s in h])
    rest -= h * (first * moves).sum()
    bend = rest - 0.5 * h**2 * (moves.ravel() @ (second @ moves.ravel()))
    return [np.polyfit(np.log(h), np.log(np.abs(r)), 1)[0] for r in (rest, bend)]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("term", ["area", "volume", "energy"])
def test_taylor_slopes_of_every_term(term, seed):
    surface = generic()
    moves = np.random.default_rng(seed).standard_normal((surface.n, 3))
    (_, dA, HA), (_, dV, HV) = terms(surface)
    loose = replace(surface, on_plane=())

    def area(X):
        return patch_areas(loose.moved(X)).sum()

    def held(X):
        return patch_volumes(loose.moved(X)).sum()

    value, first, second = {
        "area": (area, dA, HA),
        "volume": (held, dV, HV),
        "energy": (lambda X: energy_at(surface, X), forms(surface)[1], hessian(surface)),
    }[term]
    assert slopes(value, first, second, surface, 0.1 * moves) == pytest.approx([2, 3], abs=0.1)


def cases(surface):
    """The seven kinds of vertex of Sec. 2.3: a mask (n,) for each."""
    t = surface.topology
    wall = surface.pressures[surface.patch_of_face] == 0.0
    in_roof, in_wall = np.zeros((2, surface.n), bool)
    in_roof[surface.faces[~wall]] = True
    in_wall[surface.faces[wall]] = True
    stem = (t.vertex_kind == POINT) & t.on_junction & ~in_roof  # where it stands on Π
    for curve in t.junctions:
        stem[curve.vertices] |= not in_roof[curve.vertices].all()
    held = surface.fixed | surface.on_plane
    return {
        1: in_roof & ~in_wall & ~held,
        2: in_wall & ~in_roof & ~stem & ~held,
        3: in_roof & in_wall & ~stem & ~held,
        4: surface.on_plane,
        5: surface.fixed,
        6: stem & ~in_roof & ~held,
        7: stem & in_roof & ~held,
    }


def test_every_vertex_is_of_one_of_the_seven_kinds():
    kinds = cases(three_patches(3))
    assert [int(mask.sum()) for mask in kinds.values()] == [12, 3, 6, 7, 18, 2, 1]
    assert (sum(mask.astype(int) for mask in kinds.values()) == 1).all()


@pytest.mark.parametrize("case", range(1, 8))
def test_taylor_slopes_at_each_kind_of_vertex(case):
    surface = generic()
    mask = cases(surface)[case]
    moves = np.random.default_rng(case).standard_normal((surface.n, 3)) * mask[:, None]
    allowed = apply_supports(surface, moves.copy())
    if case == 5:
        assert not allowed.any()
        assert not gradient(surface)[mask].any()
        allowed = moves  # what the supports carry is still the derivative along any move
        first = forms(surface)[1]
    else:
        first = gradient(surface)
        assert np.abs(first[mask]).max(axis=1).min() > 1e-3
    found = slopes(lambda X: energy_at(surface, X), first, hessian(surface), surface, 0.1 * allowed)
    assert found == pytest.approx([2, 3], abs=0.15)


def star_sums(surface, p):
    """∇A_i and ∇V_i at vertex p by patch, (15a), (17a) and (15b), (17b) with the sign put right."""
    X = surface.vertices - surface.plane.point
    area, held = np.zeros((2, len(surface.patches), 3))
    for face, i in zip(surface.faces.tolist(), surface.patch_of_face, strict=True):
        if p in face:
            k = face.index(p)
            q, r = X[face[(k + 1) % 3]], X[face[(k + 2) % 3]]
            cross = np.cross(q - X[p], r - X[p])
            area[i] += 0.5 * np.cross(cross / np.linalg.norm(cross), r - q)
            held[i] += np.cross(q, r) / 6.0
    return area, held


@pytest.mark.parametrize("case", range(1, 8))
def test_gradient_is_the_papers_formula(case):
    surface = generic()
    alpha, normal = surface.tensions, np.array(surface.plane.normal)
    g = gradient(surface)
    roof = surface.pressures == 1.0
    for p in np.flatnonzero(cases(surface)[case]):
        area, held = star_sums(surface, p)
        touching = np.abs(area).sum(axis=1) > 0
        pull = alpha @ area
        expected = {
            1: pull - held[roof].sum(axis=0),  # (14)
            2: pull,  # (16)
            3: pull - held[roof].sum(axis=0),  # (18)
            4: pull - (pull @ normal) * normal,  # (19)
            5: np.zeros(3),
            6: pull,  # (21)
            7: pull - held[roof].sum(axis=0),  # (22)
        }[case]
        np.testing.assert_allclose(g[p], expected, atol=1e-13)
        assert touching.sum() == {1: 1, 2: 1, 3: 3, 5: touching.sum(), 6: 3, 7: 6}.get(
            case, 3 if p in surface.topology.junctions[-1].vertices else 1
        )


# ---- rigid motions, scaling, labels -------------------------------------------------------------


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seeds, st.tuples(small, small, small))
def test_rigid_motions_turn_the_gradient(seed, shift):
    surface = shaken(three_patches(3))
    R, shift = rotation(seed), np.array(shift)
    plane = Plane(shift + R @ surface.plane.point, R @ surface.plane.normal)
    X = surface.vertices @ R.T + shift
    # Rounding may lift sliding vertices off the turned plane by far less than the check allows.
    other = Surface(
        X, surface.faces, surface.patch_of_face, surface.patches,
        surface.fixed, surface.on_plane, plane,
    )  # fmt: skip
    assert energy(other) == pytest.approx(energy(surface), rel=1e-12)
    np.testing.assert_allclose(gradient(other), gradient(surface) @ R.T, atol=1e-11)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.floats(1e-3, 1e3))
def test_scaling_lengths_and_tensions(scale):
    surface = shaken(three_patches(3))
    tensions = {p.name: scale * p.tension for p in surface.patches}
    other = surface.moved(scale * surface.vertices).retensioned(tensions)
    assert energy(other) == pytest.approx(scale**3 * energy(surface), rel=1e-12)
    np.testing.assert_allclose(gradient(other) / scale**2, gradient(surface), atol=1e-12)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seeds)
def test_labels_do_not_matter(seed):
    surface = shaken(three_patches(3))
    rng = np.random.default_rng(seed)
    vertex, face, patch = (rng.permutation(k) for k in (surface.n, surface.m, 6))
    turned = (np.arange(3) + rng.integers(0, 3, (surface.m, 1))) % 3  # start at another corner
    F = np.argsort(vertex)[surface.faces[face]]
    other = Surface(
        surface.vertices[vertex], np.take_along_axis(F, turned, axis=1),
        np.argsort(patch)[surface.patch_of_face[face]], [surface.patches[k] for k in patch],
        surface.fixed[vertex], surface.on_plane[vertex],
    )  # fmt: skip
    assert energy(other) == pytest.approx(energy(surface), rel=1e-13)
    np.testing.assert_allclose(gradient(other), gradient(surface)[vertex], atol=1e-13)
    np.testing.assert_allclose(patch_areas(other), patch_areas(surface)[patch], rtol=1e-13)


def test_turning_a_patch_over_turns_its_pressure():
    surface = shaken(pyramid())
    under = Surface(
        surface.vertices, surface.faces[:, ::-1], [0] * 4, [Patch("roof", 1.0, -1.0)], range(4)
    )
    assert energy(under) == pytest.approx(energy(surface), rel=1e-15)
    np.testing.assert_allclose(gradient(under), gradient(surface), atol=1e-15)


# ---- threads ------------------------------------------------------------------------------------


@pytest.fixture
def small_blocks(monkeypatch):
    monkeypatch.setattr(kernels, "BLOCK", 10)


def test_blocks_cover_every_triangle_once(small_blocks):
    for count in (1, 9, 10, 25, 81, 1000):
        for workers in (1, 2, 3, 8):
            ranges = kernels.blocks(count, workers)
            assert len(ranges) <= workers
            assert ranges[0][0] == 0
            assert ranges[-1][1] == count
            assert all(a[1] == b[0] for a, b in pairwise(ranges))


@pytest.mark.parametrize("workers", [1, 2, 3, 8])
def test_threads_do_not_change_the_answer(small_blocks, workers):
    surface = generic()
    E, g = forms(surface, workers=1)
    again = [forms(surface, workers=workers) for _ in range(3)]
    for other, d in again:
        assert other == pytest.approx(E, rel=1e-14)
        np.testing.assert_allclose(d, g, atol=1e-14)
        assert other == again[0][0]  # the same bytes every time
        assert d.tobytes() == again[0][1].tobytes()


def test_a_mesh_of_two_real_blocks():
    points, faces = hexagon(110)  # 72 600 triangles
    X = np.column_stack([points, 0.01 * (points**2).sum(axis=1)])
    surface = Surface(X, faces, [0] * len(faces), [Patch("big", 1.0)], fixed=[0])
    assert len(kernels.blocks(surface.m, 2)) == 2
    one, two = (forms(surface, workers=w) for w in (1, 2))
    assert two[0] == pytest.approx(one[0], rel=1e-12)
    np.testing.assert_allclose(two[1], one[1], atol=1e-9 * np.abs(one[1]).max())


# ---- supports and odd triangles -----------------------------------------------------------------


def test_supports_take_what_they_carry():
    surface = generic()
    free, held = gradient(surface), forms(surface)[1]
    assert not free[surface.fixed].any()
    assert np.abs(free[surface.on_plane] @ surface.plane.normal).max() < 1e-14
    np.testing.assert_array_equal(free[surface.free], held[surface.free])


def test_a_triangle_without_area_has_no_area_gradient():
    surface = pyramid()
    flat = surface.vertices.copy()
    flat[4] = [1, 0, 0]  # on the side between vertices 0 and 3
    g = forms(surface.moved(flat))[1]
    assert np.isfinite(g).all()
    assert np.isfinite(hessian(surface.moved(flat)).data).all()


def test_energy_without_gradient_is_the_same():
    surface = generic()
    X = shaken(surface, seed=3).vertices
    assert energy_at(surface, X) == pytest.approx(energy_and_gradient(surface, X)[0], rel=1e-15)
    assert energy(surface.moved(X)) == energy_at(surface, X)


def test_second_order_of_the_sampled_cap():
    error = [energy(cap(rings)) - 1.5039191689 for rings in (8, 16, 32)]
    orders = np.log2(np.abs(np.array(error[:-1]) / error[1:]))
    assert orders == pytest.approx([2, 2], abs=0.15)


# ---- unequal pressures --------------------------------------------------------------------------


def rooms(wall: float) -> Surface:
    """Two rooms of pressures 1.5 and 1 and the wall between, its normal from the first to the second."""
    surface = two_squares(3, alpha_aux=1.0, height=1.0)
    X = surface.vertices[surface.faces[surface.patch_of_face == surface.patch_index("wall")]]
    assert np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]).sum(axis=0)[0] > 0.0
    rng = np.random.default_rng(5)
    raised = surface.vertices + 0.05 * rng.standard_normal((surface.n, 3)) * surface.free[:, None]
    return surface.moved(raised).retensioned(pressures={"left": 1.5, "right": 1.0, "wall": wall})


def seen_from(surface: Surface, point) -> Surface:
    return replace(surface, plane=Plane(point))


def test_a_wall_that_carries_the_difference_makes_rooms():
    """Then Σ p V is Σ over rooms of p times the room's volume, and no point of Π is special."""
    surface = rooms(0.5)
    here, there = surface, seen_from(surface, (7.0, -3.0, 0.0))
    assert energy(there) == pytest.approx(energy(here), rel=1e-13)
    np.testing.assert_allclose(gradient(there), gradient(here), atol=1e-13)
    left, right, wall = patch_volumes(there)
    assert left + wall == pytest.approx(patch_volumes(here)[0] + patch_volumes(here)[2], rel=1e-12)
    tension = float(surface.tensions @ patch_areas(surface))
    assert energy(there) == pytest.approx(tension - 1.5 * (left + wall) - (right - wall))


def test_a_difference_no_wall_carries_acts_on_the_side_of_the_cones():
    """At the junction alone, by p_1 - p_2 times a third of each triangle to the point of Π."""
    points = np.array([[0.0, 0.0, 0.0], [7.0, -3.0, 0.0]])
    surface = rooms(0.0)
    before, after = (gradient(seen_from(surface, point)) for point in points)
    moved = np.flatnonzero(np.abs(after - before).max(axis=1) > 1e-12)
    seam = np.flatnonzero(surface.topology.on_junction & surface.free)
    np.testing.assert_array_equal(moved, seam)
    expected = np.zeros_like(before)
    X, F = surface.vertices, surface.faces[surface.patch_of_face == surface.patch_index("left")]
    for a, b in ((F[:, k - 1], F[:, k]) for k in range(3)):
        along = surface.topology.on_junction[a] & surface.topology.on_junction[b]
        side = 0.5 / 6.0 * np.cross(X[b] - X[a], points[1] - points[0])[along]
        for end in (a[along], b[along]):
            np.add.at(expected, end, side)
    np.testing.assert_allclose((after - before)[seam], expected[seam], atol=1e-13)


@pytest.mark.parametrize("wall", [0.0, 0.5])
@pytest.mark.parametrize("point", [(0.0, 0.0, 0.0), (7.0, -3.0, 0.0)])
def test_taylor_slopes_under_unequal_pressures(wall, point):
    surface = seen_from(rooms(wall), point)
    X, rng = surface.vertices, np.random.default_rng(6)
    d = apply_supports(surface, rng.standard_normal(X.shape))
    E, slope = energy(surface), float((gradient(surface) * d).sum())
    curve = float(d.ravel() @ (hessian(surface) @ d.ravel()))
    steps = 1e-2 * 0.5 ** np.arange(4)
    first = np.array([energy_at(surface, X + t * d) - E - t * slope for t in steps])
    second = first - 0.5 * steps**2 * curve
    np.testing.assert_allclose(np.diff(np.log2(np.abs(first))), -2.0, atol=0.1)
    np.testing.assert_allclose(np.diff(np.log2(np.abs(second))), -3.0, atol=0.3)


def test_far_from_the_plane_s_point_volumes_are_seen_from_near_by():
    """Forces keep their digits, and energies and volumes differ by a constant at most."""
    near = two_caps(1.2)
    shift = np.array([5e5, 5e6, 0.0])
    far = Surface(
        near.vertices + shift, near.faces, near.patch_of_face, near.patches, fixed=near.fixed,
        on_plane=near.on_plane,
    )  # fmt: skip
    assert np.linalg.norm(far.origin - far.vertices.mean(axis=0)) < near.size
    assert far.origin[2] == 0.0
    np.testing.assert_allclose(
        gradient(far), gradient(near), atol=1e-8 * np.abs(gradient(near)).max()
    )
    assert volume(far) == pytest.approx(volume(near), rel=1e-8)
    assert far.moved(far.vertices + np.array([1e3, 0, 0])).origin is far.origin


def test_where_pressures_do_not_cancel_the_point_of_the_plane_stays():
    """The force of what is left over depends on it."""
    near = two_caps(1.2)
    patches = [
        Patch(p.name, p.tension, p.pressure * (1 + (k == 0))) for k, p in enumerate(near.patches)
    ]
    far = Surface(
        near.vertices + np.array([5e5, 0, 0]), near.faces, near.patch_of_face, patches,
        fixed=near.fixed, on_plane=near.on_plane,
    )  # fmt: skip
    assert far.uncancelled.any()
    assert far.origin.tolist() == [0.0, 0.0, 0.0]
    assert not near.uncancelled.any()
