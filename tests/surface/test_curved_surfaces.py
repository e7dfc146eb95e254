"""What a surface of curved elements goes through: each act is right, or refused in one line."""

import numpy as np
import pytest

from generators import spherical_cap, two_caps, two_squares
from pcmc import Plane, certify, cut, find_equilibria, mirrored, panel_net, solve
from pcmc.base.errors import SurfaceError
from pcmc.forces.functional import energy, patch_areas
from pcmc.forces.volume_below import volume_below
from pcmc.meshing.elevation import elevate
from pcmc.meshing.local_refinement import refine_near
from pcmc.meshing.refinement import refine
from pcmc.meshing.remeshing import remesh
from pcmc.plan import Plan

SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4]]


def half(order):
    """Half of a roof over a rectangle, solved."""
    plan = Plan(SQUARE, edge_length=1.0, patches={"roof": {"tension": 4.0}}, mirrors=[[(4, 0), (4, 4)]])
    return solve(plan.surface(), order=order).surface


@pytest.mark.parametrize("order", [2, 4])
def test_a_half_is_at_rest_as_the_whole_is(order):
    piece = half(order)
    whole = mirrored(piece)
    assert whole.order == order
    assert certify(whole).residual < 1e-12
    for quantity in (energy, volume_below, lambda surface: patch_areas(surface)[0]):
        assert quantity(whole) == pytest.approx(2.0 * quantity(piece), rel=1e-13)
    pushes = [certify(surface).supports["force_z"].sum() for surface in (piece, whole)]
    assert pushes[1] == pytest.approx(2.0 * pushes[0], rel=1e-10)
    back = cut(whole, Plane((4, 0, 0), (-1, 0, 0)))
    assert energy(back) == pytest.approx(energy(piece), rel=1e-13)
    with pytest.raises(SurfaceError, match=r"^triangle \d+ crosses the mirror plane"):
        cut(whole, Plane((4.5, 0, 0), (-1, 0, 0)))  # along edges of small triangles, through elements


@pytest.mark.parametrize("order", [2, 4])
def test_four_elements_have_the_shape_of_one(order):
    piece = half(order)
    fine = refine(piece)
    assert (fine.order, fine.m) == (order, 4 * piece.m)
    assert volume_below(fine) == pytest.approx(volume_below(piece), rel=1e-14)
    assert patch_areas(fine)[0] == pytest.approx(patch_areas(piece)[0], rel=1e-6)  # by quadrature
    assert patch_areas(fine.rebuilt(order=1))[0] < patch_areas(fine)[0] < patch_areas(piece)[0] * (1 + 1e-6)


def test_a_solver_keeps_the_order():
    curved = elevate(spherical_cap(0.5), 2.0)  # a whole number, as of a file
    assert curved.order == 2
    for order in (1, 4):
        with pytest.raises(SurfaceError, match=r"^order: the surface is of order 2 already; give order=2$"):
            solve(curved, order=order)


def test_only_flat_triangles_rest_on_the_plane():
    result = solve(two_caps(), order=2)
    assert (result.converged, result.surface.order) == (True, 1)
    assert "its triangles are flat, though order=2 was asked for: the junction comes" in result.message
    assert result.certificate.certified
    resting = refine(solve(two_squares(4, alpha_aux=4.0)).surface)
    with pytest.raises(
        SurfaceError, match=r"^order: the junction comes down to the plane at vertex \d+, and"
    ):
        certify(resting.rebuilt(order=2))


@pytest.mark.parametrize(
    ("act", "name"),
    [
        (lambda surface: remesh(surface, 0.5), "remesh"),
        (lambda surface: refine_near(surface, np.zeros(3), 1, 1.0), "refine_faces"),
        (lambda surface: panel_net(surface, 0.5), "the net of panels"),
        (find_equilibria, "find_equilibria"),
    ],
)
def test_what_is_for_flat_triangles_refuses_others(act, name):
    with pytest.raises(
        SurfaceError, match=rf"^{name}: only for flat triangles, and the elements are of order 2"
    ):
        act(elevate(spherical_cap(0.5), 2))
