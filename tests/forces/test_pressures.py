"""Pressures that differ from patch to patch, and the point of Π that volumes are seen from."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from generators import two_caps, two_squares
from pcmc import Patch, Plane, Surface, energy, gradient, hessian
from pcmc.forces.functional import energy_at, patch_areas, patch_volumes, volume
from pcmc.surface.supports import apply_supports


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
    far = near.rebuilt(vertices=near.vertices + shift)
    assert np.linalg.norm(far.origin - far.vertices.mean(axis=0)) < near.size
    assert far.origin[2] == 0.0
    np.testing.assert_allclose(gradient(far), gradient(near), atol=1e-8 * np.abs(gradient(near)).max())
    assert volume(far) == pytest.approx(volume(near), rel=1e-8)
    assert far.moved(far.vertices + np.array([1e3, 0, 0])).origin is far.origin


def test_shapes_on_one_boundary_are_seen_from_one_point_in_survey_coordinates():
    """Over a rim that leans E has a part by that point, in which two shapes would differ."""
    corners = np.array([[1, 1, 1.2], [-1, 1, 0.8], [-1, -1, 0.8], [1, -1, 1.2], [0, 0, 1.5]])
    F, top, roof = (
        [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
        np.array([0, 0, 0, 0, 1.0]),
        [Patch("roof", 1.0)],
    )
    steps = []
    for shift in ([0.0, 0.0, 0.0], [5e3, 0.0, 0.0]):
        low, high = (corners + shift + top[:, None] * d for d in ([0, 0, 0], [0.5, 0, 1.0]))
        steps.append(np.ptp([energy(Surface(X, F, [0] * 4, roof, fixed=range(4))) for X in (low, high)]))
    assert steps[1] == pytest.approx(steps[0], rel=1e-9)


def test_energy_does_not_depend_on_the_order_of_planes_without_a_common_point():
    """Of three walls around a raised opening that leans; volumes were seen from where the first two meet."""
    corners, hole = (
        np.array([[0, 0, 1], [4, 0, 1], [0, 4, 1.0]]),
        np.array([[1, 1, 1], [2, 1, 1.5], [1, 2, 1.0]]),
    )
    faces = [[k, (k + 1) % 3, j] for k, j in ((0, 3), (1, 4), (2, 5))]
    faces += [[(k + 1) % 3, 3 + (k + 1) % 3, 3 + k] for k in range(3)]
    on = {
        Plane((0, 0, 0), (0, 1, 0)): [0, 1],
        Plane((4, 0, 0), (1, 1, 0)): [1, 2],
        Plane((0, 0, 0), (1, 0, 0)): [2, 0],
    }
    X, roof = np.concatenate([corners, hole]), [Patch("roof", 1.0, 1.0)]
    found = [
        energy(Surface(X, faces, [0] * 6, roof, fixed=[3, 4, 5], on_planes=dict(order)))
        for order in permutations(on.items())
    ]
    assert found == pytest.approx(found[:1] * 6)


def test_where_pressures_do_not_cancel_the_point_of_the_plane_stays():
    """The force of what is left over depends on it."""
    near = two_caps(1.2)
    patches = [Patch(p.name, p.tension, p.pressure * (1 + (k == 0))) for k, p in enumerate(near.patches)]
    far = near.rebuilt(vertices=near.vertices + np.array([5e5, 0, 0]), patches=patches)
    assert far.uncancelled.any()
    assert far.origin.tolist() == [0.0, 0.0, 0.0]
    assert not near.uncancelled.any()
