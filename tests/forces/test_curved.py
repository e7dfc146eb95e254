"""Curved elements: derivatives, identities, and the order of closed forms."""

import dataclasses
from functools import partial

import numpy as np
import pytest
from cable_cases import hanging, heavy_net
from hypothesis import given, settings
from hypothesis import strategies as st
from programs import needs_evolver
from scipy.optimize import brentq

from generators import (
    delaunay,
    delaunay_exact,
    double_bubble,
    double_bubble_exact,
    joined_caps,
    joined_caps_exact,
    spherical_cap,
    spherical_cap_exact,
    triple_bubble,
)
from pcmc import Patch, Surface, energy, solve
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.diagnostics import check_gradient, check_hessian, taylor
from pcmc.forces.elements import energy_mesh
from pcmc.forces.functional import energy_and_gradient, patch_areas, patch_volumes
from pcmc.forces.rooms import room_volumes
from pcmc.forces.second_variation import hessian, hessian_product
from pcmc.forces.volume_below import volume_below, volume_below_gradient
from pcmc.meshing.elevation import elevate
from pcmc.meshing.refinement import refine
from studies.reference import evolver


def onto_rim(points):
    """Points of the unit circle's polygon on the circle."""
    return points / np.linalg.norm(points[:, :2], axis=1)[:, None]


def shaken(order, seed=0, **values):
    """A cap's mesh of elements of an order, all nodes moved at random; nothing is held at its place."""
    flat = refine(spherical_cap(0.5), order.bit_length() - 1)
    moves = 0.05 / order**2 * np.random.default_rng(seed).standard_normal((flat.n, 3))
    surface = flat.rebuilt(vertices=flat.vertices + moves, order=order)
    return surface.retensioned(**{kind: {"cap": value} for kind, value in values.items()})


@pytest.mark.parametrize("order", [2, 4])
@pytest.mark.parametrize("weight", [0.0, 0.7])
def test_taylor_slopes(order, weight):
    surface = shaken(order, weights=weight)
    assert check_gradient(surface).passed
    assert check_hessian(surface).passed


@pytest.mark.parametrize("order", [2, 4])
def test_taylor_slopes_with_cables_and_their_weights(order):
    surface = elevate(heavy_net(), order)
    moves = 0.05 / order**2 * np.random.default_rng(2).standard_normal((surface.n, 3))
    surface = surface.moved(surface.vertices + np.where(surface.fixed[:, None], 0.0, moves))
    assert check_gradient(surface).passed
    assert check_hessian(surface).passed


def test_a_rope_along_sides_of_elements_hangs_in_its_catenary():
    """z + τ/g = c cosh(x/c) from (-1, 1) to (1, 1); E = τ L + g ∫ z ds, in a sheet that stays flat."""
    c = brentq(lambda c: c * np.cosh(1.0 / c) - 2.0, 1.0, 5.0)
    exact = c + 0.5 * c**2 * np.sinh(2.0 / c) + 4.0  # g ∫ c cosh(x/c) ds, and the sheet
    errors = []
    for columns in (2, 4, 8):
        result = solve(hanging(columns), order=2)
        assert (result.converged, result.surface.order) == (True, 2)
        errors.append(abs(result.energy - exact))
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx([4.0, 4.0], abs=0.5)
    nodes = result.surface.cable_sides.ends
    assert nodes.shape == (8, 3)
    x, _, z = result.surface.vertices[np.unique(nodes)].T
    assert np.abs(z - (c * np.cosh(x / c) - 1.0)).max() < 1e-5


def test_a_cable_that_ends_within_a_side_is_refused():
    curved = elevate(heavy_net(), 2)
    part = dataclasses.replace(curved.cables[0], edges=curved.cables[0].edges[:1])
    with pytest.raises(SurfaceError, match=r"^cable 'edge': its edges are no whole sides of elements"):
        dataclasses.replace(curved, cables=[part])


@pytest.mark.nightly
def test_taylor_slopes_of_order_8():
    surface = shaken(8, weights=0.7)
    assert check_gradient(surface).passed
    assert check_hessian(surface).passed


@pytest.mark.parametrize("order", [1, 2, 4])
def test_products_are_those_of_the_matrix(order):
    surface = shaken(order, weights=0.7)
    d = np.random.default_rng(1).standard_normal((surface.n, 3))
    product = hessian_product(surface, energy_mesh(surface), surface.vertices, d)
    np.testing.assert_allclose(product.ravel(), hessian(surface) @ d.ravel(), atol=1e-12)


@pytest.mark.parametrize("order", [2, 4])
def test_area_is_of_degree_two_and_volume_of_degree_three(order):
    area, both = (shaken(order, tensions=1.0, pressures=p) for p in (0.0, 1.0))
    X = area.vertices
    (A, dA), (E, dE) = (energy_and_gradient(surface, supports=False) for surface in (area, both))
    HA, H = hessian(area), hessian(both)
    for degree, value, first, second in ((2, A, dA, HA), (3, A - E, dA - dE, HA - H)):
        assert (X * first).sum() == pytest.approx(degree * value, rel=1e-12)
        np.testing.assert_allclose(second @ X.ravel(), (degree - 1) * first.ravel(), atol=1e-11)
    assert pytest.approx([patch_areas(area)[0], patch_volumes(area)[0]]) == [A, A - E]


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**20), st.sampled_from([2, 4]))
def test_rigid_motions_change_no_area(seed, order):
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    surface = shaken(order, seed)
    moved = surface.rebuilt(vertices=surface.vertices @ turn.T + rng.standard_normal(3))
    assert patch_areas(moved)[0] == pytest.approx(patch_areas(surface)[0], rel=1e-12)
    G = energy_and_gradient(surface.retensioned(pressures={"cap": 0.0}), supports=False)[1]
    assert np.abs(G.sum(axis=0)).max() < 1e-12
    assert np.abs(np.cross(surface.vertices, G).sum(axis=0)).max() < 1e-12


@pytest.mark.parametrize("order", [2, 4])
def test_flat_elements_are_flat_triangles(order):
    flat = spherical_cap(0.5).retensioned(weights={"cap": 0.3})
    curved = refine(flat, order.bit_length() - 1).rebuilt(order=order)
    assert energy(curved) == pytest.approx(energy(flat), rel=1e-14)
    assert volume_below(curved) == pytest.approx(volume_below(flat), rel=1e-14)


def test_volume_below_and_its_gradient():
    surface = shaken(2)
    grown = lambda X: volume_below(surface.rebuilt(vertices=X, fixed=range(3)))  # noqa: E731
    move = 0.1 * np.random.default_rng(2).standard_normal((surface.n, 3))
    found = taylor(grown, surface.vertices, move, volume_below_gradient(surface, np.ones(1)))
    assert found.passed


@pytest.mark.parametrize(("order", "energy_order", "position_order"), [(2, 3.6, 3.5), (4, 5.6, 5.2)])
def test_a_cap_of_curved_elements(order, energy_order, position_order):
    exact, errors = spherical_cap_exact(), []
    for h in (0.25, 0.125):
        start = elevate(solve(spherical_cap(h)).surface, order, onto_rim)
        result = solve(start)
        here = result.surface
        assert (result.converged, here.order, result.certificate.index) == (True, order, 0)
        away = np.sqrt((exact.distance(here) ** 2).mean())
        below = abs(volume_below(here) - exact.volume)
        errors.append(
            [abs(result.energy - exact.energy), below, abs(patch_areas(here)[0] - exact.area), away]
        )
    energies, volumes, areas, positions = np.log2(np.array(errors[0]) / errors[1])
    assert min(energies, volumes, areas) > energy_order
    assert positions > position_order
    assert errors[1][0] < {2: 1e-6, 4: 1e-10}[order] * exact.energy


def onto_arcs(points):
    """Points near the boundary of ``joined_caps`` on its two arcs."""
    out, spheres = points.copy(), joined_caps_exact().shapes
    for side, here in (("left", points[:, 0] < 0.0), ("right", points[:, 0] > 0.0)):
        centre = np.array(spheres[side].centre)
        away = points[here, :2] - centre[:2]
        radius = np.sqrt(spheres[side].radius ** 2 - centre[2] ** 2)
        out[here, :2] = centre[:2] + radius * away / np.linalg.norm(away, axis=1)[:, None]
    return out


def onto_rings(points):
    """Points near the rings of ``delaunay`` on them."""
    start = delaunay(0.6, exact=True)
    radius = np.linalg.norm(start.vertices[start.fixed][0, :2])
    on = points.copy()
    on[:, :2] *= radius / np.hypot(*points.T[:2])[:, None]
    return on


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")
@pytest.mark.parametrize(
    ("make", "exact", "project"),
    [
        (partial(joined_caps, 0.7), joined_caps_exact(), onto_arcs),
        (partial(delaunay, 0.6), delaunay_exact(), onto_rings),
        (partial(double_bubble, 1.0), double_bubble_exact(), None),
    ],
    ids=["two joined caps", "unduloid", "double bubble"],
)
def test_closed_forms_with_junctions_and_waves(make, exact, project):
    start, errors = make(), []
    for flat in (start, refine(start, 1, project)):
        reached = solve(flat, target="stationary").surface
        result = solve(elevate(reached, 2, project), target="stationary")
        assert result.converged
        errors.append(abs(result.energy - exact.energy))
        assert errors[-1] < 0.01 * abs(energy(reached) - exact.energy)
    assert np.log2(errors[0] / errors[1]) > 3.6


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")
def test_a_double_bubble_that_nothing_holds_comes_to_rest_on_fine_meshes():
    exact, flat, errors = double_bubble_exact().energy, double_bubble(1.0), []
    for _ in range(3):
        flat = refine(solve(flat, target="stationary").surface)
        result = solve(elevate(flat, 2), target="stationary", iterations=6)
        assert result.converged
        errors.append(abs(result.energy - exact))
    assert np.log2(errors[0] / errors[1]) > 4.5
    assert np.log2(errors[1] / errors[2]) > 4.5


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")
def test_elements_follow_a_junction_that_bends():
    flat, exact = solve(double_bubble(1.0), target="stationary").surface, double_bubble_exact().energy
    errors = [
        abs(solve(elevate(flat, order), target="stationary").energy / exact - 1.0) for order in (2, 4, 8)
    ]
    assert errors[1] < 1e-2 * errors[0]
    assert errors[2] < 1e-12


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")
def test_three_bubbles_of_volume_1_have_the_area_of_the_literature():
    result = solve(triple_bubble(0.5), order=4)
    assert (result.converged, result.surface.order, result.certificate.index) == (True, 4, 0)
    np.testing.assert_allclose(room_volumes(result.surface), 1.0, rtol=1e-10)
    assert patch_areas(result.surface).sum() == pytest.approx(13.128168244433, rel=2e-5)


def test_the_variational_curvature_is_exact_at_rest():
    result = solve(elevate(solve(spherical_cap(0.25)).surface, 2, onto_rim))
    assert result.certificate.curvature_error < 1e-9


def test_wrong_elements_are_refused():
    surface = refine(spherical_cap(0.5), 1)
    with pytest.raises(SurfaceError, match=r"^order: expected 1, 2, 4 or 8, found 3$"):
        surface.rebuilt(order=3)
    with pytest.raises(SurfaceError, match=r"^order 2: the 4 faces from face 4 on are not one triangle cut"):
        surface.rebuilt(order=2, faces=surface.faces[[0, 1, 2, 3, 5, 4, *range(6, surface.m)]])
    with pytest.raises(SurfaceError, match=r"^order 2: the 4 faces from face 92 on are not"):
        surface.rebuilt(order=2, faces=surface.faces[:-1], patch_of_face=surface.patch_of_face[:-1])
    patch = surface.patch_of_face.copy()
    patch[6] = 1
    patches = [*surface.patches, Patch("other", 1.0)]
    with pytest.raises(SurfaceError, match=r"^order 2: the element of the 4 faces from face 4 on is in two"):
        surface.rebuilt(order=2, patch_of_face=patch, patches=patches)
    with pytest.raises(SurfaceError, match=r"^order: the surface is of order 2 already; give order=2$"):
        elevate(surface.rebuilt(order=2), 4)


def test_solve_raises_the_order_itself():
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0.2]]
    roof = Surface(
        corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4, [Patch("roof", 1.0)], range(4)
    )
    result = solve(roof, order=2, levels=1)
    assert (result.converged, result.surface.order, len(result.surface.nodes)) == (True, 2, 16)
    assert result.history.level.max() == 2
    assert solve(result.surface).surface.order == 2  # stays
    with pytest.raises(OptionError, match=r"^order: expected 1, 2, 4 or 8, found 5$"):
        solve(roof, order=5)


@needs_evolver
def test_surface_evolver_has_the_same_energy_of_order_2():
    flat = solve(spherical_cap(0.25)).surface
    onto = (
        "foreach vertex vv where vv.fixed do { rr := sqrt(vv.x^2+vv.y^2); vv.x := vv.x/rr; vv.y := vv.y/rr }"
    )
    steps = f"quadratic\nhessian_normal on\n{onto}\n" + "hessian\n" * 4
    theirs = evolver.energy(flat, steps, upright=True)
    ours = solve(elevate(flat, 2, onto_rim)).energy
    assert ours == pytest.approx(theirs, rel=1e-7)
    assert abs(ours / spherical_cap_exact().energy - 1.0) < 1e-5
