"""The tools that the generators share: the mesher, strips, curves, draped heights, meeting spheres."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

from generators.bezier import chain, cubic, equally_spaced
from generators.builder import Builder
from generators.exact import Sphere
from generators.membranes import membrane, soap_film
from generators.meshing import fill
from generators.sphere_pair import intersection
from generators.strips import strips
from pcmc.base.errors import OptionError


def circle(radius, spacing, centre=(0.0, 0.0)):
    count = round(2.0 * np.pi * radius / spacing)
    angle = 2.0 * np.pi * np.arange(count) / count
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1) + centre


def rectangle(width, depth, spacing):
    x = np.linspace(0.0, width, round(width / spacing) + 1)[:-1]
    y = np.linspace(0.0, depth, round(depth / spacing) + 1)[:-1]
    sides = [(x, 0 * x), (width + 0 * y, y), (width - x, depth + 0 * x), (0 * y, depth - y)]
    return np.concatenate([np.stack(side, axis=1) for side in sides])


def polygon_area(points):
    x, y = points.T
    return 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))


def triangle_areas(points, faces):
    a, b, c = (points[faces[:, k]] for k in range(3))
    u, v = b - a, c - a
    return 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def smallest_angle(points, faces):
    corners = points[faces]
    a, b = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cross = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return np.degrees(np.arctan2(np.abs(cross), (a * b).sum(axis=2))).min()


OUTLINES = {
    "disc": lambda h: [circle(6.0, h)],
    "ring": lambda h: [circle(6.0, h), circle(1.5, h, (1.0, 1.0))[::-1]],
    "rectangle": lambda h: [rectangle(9.0, 5.0, h)],
}


@pytest.mark.parametrize("h", [1.1, 0.7, 0.43, 0.2])
@pytest.mark.parametrize("shape", OUTLINES)
def test_fill_covers_the_region_once(shape, h):
    outlines = OUTLINES[shape](h)
    inner, faces = fill(outlines, h)
    points = np.concatenate([*outlines, inner])
    areas = triangle_areas(points, faces)
    assert (areas > 0.0).all()
    expected = abs(polygon_area(outlines[0])) - sum(abs(polygon_area(o)) for o in outlines[1:])
    assert areas.sum() == pytest.approx(expected, rel=1e-12)
    assert (np.bincount(faces.ravel(), minlength=len(points)) > 0).all()
    assert smallest_angle(points, faces) > 28.0


def test_fill_wants_outlines_as_fine_as_its_spacing():
    left = [[0, 0], [4, 0], [4, 4], [4, 8], [0, 8], [0, 4]]
    right = [[4.1, 8], [8, 8], [8, 0], [4, -2], [0, -2]]
    slit = np.array([[4.1, 2.0], *right, *left, [4.1, 6.0]][::-1])
    with refused(OptionError, what="outlines"):
        fill([slit], 1.0)


@pytest.mark.parametrize("mirrored", [False, True])
def test_strips_fill_the_gap_once(mirrored):
    rng = np.random.default_rng(3)
    segments = rng.integers(0, 7, size=12)
    segments[1:] = np.maximum(segments[1:], segments[:-1] == 0)
    points = np.concatenate(
        [
            np.stack([np.full(s + 1, float(i)), np.linspace(0.0, 1.0, s + 1) * s], axis=1)
            for i, s in enumerate(segments)
        ]
    )
    faces = strips(np.arange(len(points)), segments, np.full(11, mirrored))
    areas = triangle_areas(points, faces)
    assert len(faces) == (segments[:-1] + segments[1:]).sum()
    assert (areas > 0.0).all()
    assert areas.sum() == pytest.approx(0.5 * (segments[:-1] + segments[1:]).sum())


def test_even_strips_lean_to_the_given_side():
    lean = [strips(np.arange(6), np.array([2, 2]), np.array([m])).tolist() for m in (False, True)]
    assert [0, 3, 1] in lean[0]
    assert [0, 3, 4] in lean[1]


def test_a_wall_shares_the_given_side():
    mesh = Builder()
    side = mesh.add_points([[0, 0, 0], [0, 0, 0.9], [0, 0, 2.0]])
    top = np.append(side[-1], mesh.add_points([[1, 0, 1.1], [2, 0, 0]]))
    foot = mesh.add_wall(0, top, mesh.positions(top) * [1, 1, 0], spacing=1.0, side=side)
    assert foot[0] == side[0]
    assert foot[-1] == top[-1]
    wall = mesh.surface([_wall_patch()], on_plane=foot)
    assert wall.n == 6
    # the foot of the middle column is the only new vertex
    areas = triangle_areas(wall.vertices[:, [0, 2]], wall.faces)
    assert (areas > 0.0).all()
    assert areas.sum() == pytest.approx(0.5 * (2.0 + 1.1) + 0.5 * 1.1)


def _wall_patch():
    from pcmc import Patch

    return Patch("wall", 1.0, pressure=0.0)


CONTROLS = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 4.0], [4.0, 4.0, 1.0], [4.0, 8.0, 0.0]])


def test_curves_pass_their_ends_and_touch_their_controls():
    points = cubic(CONTROLS, np.array([0.0, 1e-7, 1.0 - 1e-7, 1.0]))
    assert points[[0, 3]].tolist() == CONTROLS[[0, 3]].tolist()
    np.testing.assert_allclose((points[1] - points[0]) / 3e-7, CONTROLS[1] - CONTROLS[0], atol=1e-5)
    np.testing.assert_allclose((points[3] - points[2]) / 3e-7, CONTROLS[3] - CONTROLS[2], atol=1e-5)


def test_curves_are_cut_evenly_in_plan():
    points = equally_spaced(CONTROLS, 0.01)
    steps = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    assert steps == pytest.approx(0.01, rel=1e-3)
    assert np.ptp(steps) < 1e-4 * steps.mean()


def test_chains_keep_their_knots():
    controls = np.concatenate([CONTROLS, CONTROLS[1:] + CONTROLS[-1]])
    points = chain(controls, 1.7)
    for knot in controls[::3]:
        assert (points == knot).all(axis=1).sum() == 1


def test_soap_films_are_scherks_surface_in_second_order():
    found = []
    for h in (0.16, 0.08):
        outline = rectangle(1.6, 1.6, h) - 0.8
        inner, faces = fill([outline], h)
        plan = np.concatenate([outline, inner])
        x, y = plan.T
        z = np.log(np.cos(x) / np.cos(y))
        film = soap_film(plan, faces, np.arange(len(plan)) < len(outline), z)
        found.append(np.sqrt(((film - z) ** 2).mean()))
    assert np.log2(found[0] / found[1]) > 1.85
    assert found[1] < 2e-3


def test_membranes_are_paraboloids_on_discs():
    for h, bound in ((0.2, 1e-2), (0.1, 2.5e-3)):
        outline = circle(1.0, h)
        inner, faces = fill([outline], h)
        plan = np.concatenate([outline, inner])
        held = np.arange(len(plan)) < len(outline)
        z = membrane(plan, faces, held, np.zeros(len(plan)), 0.5)
        assert z.max() == 0.5
        expected = 0.5 * (1.0 - (plan**2).sum(axis=1))
        assert np.abs(z - expected).max() < bound


def test_stereographic_pictures_come_back():
    ball = Sphere((0.5, 0.0, -1.0), 2.0)
    rng = np.random.default_rng(1)
    pictures = rng.uniform(-1.0, 1.0, (9, 2))
    points = ball.lift(pictures)
    assert np.linalg.norm(points - [0.5, 0.0, -1.0], axis=1) == pytest.approx(2.0)
    np.testing.assert_allclose(ball.project(points), pictures, atol=1e-13)


@pytest.mark.parametrize(
    "pair",
    [
        (Sphere((0.0, 0.0, -1.0), 2.0), Sphere((5.0, 0.0, -1.0), 2.0)),
        (Sphere((0.0, 0.0, -1.0), 2.0), Sphere((0.0, 0.0, -1.0), 2.0)),
        (Sphere((0.0, 0.0, -1.0), 3.0), Sphere((0.5, 0.0, -1.0), 2.0)),
        (Sphere((0.0, 0.0, -2.0), 2.5), Sphere((4.0, 0.0, -2.0), 2.5)),
    ],
    ids=["apart", "the same", "one in the other", "meeting below the plane"],
)
def test_spheres_that_make_no_arc_are_refused(pair):
    with refused(OptionError, what="spheres", found=pair):
        intersection(*pair)
