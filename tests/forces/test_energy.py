"""The energy against its identities, its Taylor expansion and the paper's formulas."""

from dataclasses import replace

import numpy as np
import pytest
from shapes import cap, generic, octahedron, pyramid, shaken, three_patches

from pcmc import Plane, energy, gradient, hessian
from pcmc.diagnostics import taylor
from pcmc.forces.functional import energy_and_gradient, energy_at, patch_areas, patch_volumes, volume
from pcmc.surface.supports import apply_supports
from pcmc.surface.topology import POINT


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
    return [taylor(value, surface.vertices, moves, first, bend).slope for bend in (None, second)]


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
        at_foot = 3 if surface.topology.vertex_kind[p] == POINT else 1  # where a junction ends on Π
        assert touching.sum() == {1: 1, 2: 1, 3: 3, 4: at_foot, 5: at_foot, 6: 3, 7: 6}[case]


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
