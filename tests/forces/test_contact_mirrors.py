"""Junctions at rest on held bottoms that have no corner, or only one: in mirrors, and closed ones."""

import numpy as np
import pytest
from nightly import at_night
from scipy.integrate import quad
from scipy.optimize import brentq, fsolve

import pcmc
from pcmc import Verdict, certify, solve
from pcmc.forces.pinching import standing_part
from pcmc.forces.wall_rows import find_walls
from pcmc.plan import Divider, Plan


@pytest.mark.parametrize("oblique", [*at_night(0.0), 1.0])
@pytest.mark.parametrize(("tension", "at_mirror"), [(1.5, True), (1.2, False)])
def test_in_a_half_it_rests_as_in_the_whole(oblique, tension, at_mirror):
    wall = Divider([[0, 4 - oblique], [6, 4 + oblique]], wall=tension)
    patches = {"south": {"tension": 2.0, "pressure": 0.4, "at": [2, 1]}}
    patches |= {"north": {"tension": 2.2, "pressure": 0.35, "at": [2, 7]}}
    outline, mirror = [[0, 0], [6, 0], [6, 8], [0, 8]], [[6, 0], [6, 8]]
    start = Plan(outline, [wall], edge_length=0.6, mirrors=[mirror], patches=patches).surface()
    half, whole = (pcmc.solve(surface, tolerance=1e-10) for surface in (start, pcmc.mirrored(start)))
    assert half.converged
    assert whole.converged
    assert 2.0 * half.energy == pytest.approx(whole.energy, rel=1e-4)
    at_rest = standing_part(half.surface).resting
    middle = np.abs(half.surface.vertices[:, 0] - 6.0) < 1e-9
    assert at_rest.any()
    assert (at_rest & middle).any() == at_mirror
    assert 2 * at_rest.sum() - (at_rest & middle).sum() == standing_part(whole.surface).resting.sum()


@pytest.mark.parametrize(
    ("upright", "most"),
    [*at_night((True, 6.0)), (False, np.hypot(6.0, np.sqrt(27.0) - np.sqrt(7.0)))],
)
def test_between_two_mirrors_it_rests_as_in_a_long_roof(upright, most):
    """Arcs of radii 6 and 4 over 6 pull the wall up with 3 each, and across it with √27 - √7."""
    patches = {"west": {"tension": 6.0}, "east": {"tension": 4.0}}
    outline, mirrors = [[0, 0], [12, 0], [12, 0.6], [0, 0.6]], [[[0, y], [12, y]] for y in (0, 0.6)]
    for factor in (0.99, 1.01):
        divider = Divider([[6, 0], [6, 0.6]], wall=factor * most, upright=upright)
        plan = Plan(outline, [divider], edge_length=0.3, patches=patches, mirrors=mirrors)
        found = solve(plan.surface())
        assert found.certificate.verdict is Verdict.STABLE
        assert standing_part(found.surface).resting.sum() == (3 if factor > 1.0 else 0)
    arcs = sum(
        r**2 * (angle + 0.5 * np.sin(2.0 * angle))
        for r, angle in [(6.0, np.arcsin(0.5)), (4.0, np.arcsin(0.75))]
    )
    assert found.energy / 0.6 == pytest.approx(arcs, rel=3e-4)


def test_a_closed_wall_comes_down_at_the_pull_of_both_sides():
    """Over the ring r sin = r²/10 + c, with no rise; the mesh is coarse, so that a tenth more does not do."""

    def slope(r, c):
        sine = r / 10.0 + c / r
        return sine / np.sqrt(1.0 - sine**2)

    c = brentq(lambda c: quad(slope, 3.0, 6.0, args=(c,))[0], -2.5, -1.0)
    pull = 1.5 - 5.0 * (0.3 + c / 3.0)
    angle = np.linspace(0.0, 2.0 * np.pi, 49)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    patches = {"in": {"tension": 5.0, "at": [0, 0]}, "out": {"tension": 5.0, "at": [4.5, 0]}}
    for factor in (0.95, 1.25):
        wall = Divider((3.0 * circle).tolist(), wall=factor * pull)
        found = solve(Plan((6.0 * circle[:-1]).tolist(), [wall], edge_length=0.6, patches=patches).surface())
        assert found.certificate.verdict is Verdict.STABLE
        resting = standing_part(found.surface).resting
        assert resting.sum() == (find_walls(found.surface).top_free.sum() if factor > 1.0 else 0)
    assert resting.any()


@pytest.mark.parametrize("half", [*at_night(False), True])
def test_a_ring_whose_bottom_slides_is_a_saddle_that_says_so(half):
    """A cap inside, a catenoid below and a nodoid outside balance at the radius 2.967, unheld."""

    def forces_left(values):
        neck, height, c = values
        top = neck * np.cosh(height / neck)
        inner, outer = np.arcsin(top / 6.0), np.arcsin(top / 6.0 + c / top)

        def slope(r):
            return np.tan(np.arcsin(r / 6.0 + c / r))

        return (
            3.0 * (np.cos(outer) - np.cos(inner)) - np.tanh(height / neck),
            3.0 * (np.sin(inner) - np.sin(outer)) - 1.0 / np.cosh(height / neck),
            height - quad(slope, top, 5.0)[0],
        )

    neck, height, _ = fsolve(forces_left, (2.7, 1.0, -0.8))
    angle = np.linspace(0.0, 2.0 * np.pi, 49)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    patches = {"in": {"tension": 3.0, "at": [0.1, 0]}, "out": {"tension": 3.0, "at": [4.5, 0]}}
    circle = np.roll(circle[:-1], 12, axis=0)[:25] if half else circle
    wall = Divider((2.5 * circle).tolist(), wall=1.0, bottom="sliding")
    mirrors = [[[0, -5], [0, 5]]] if half else []
    outline = (5.0 * (circle if half else circle[:-1])).tolist()
    found = solve(Plan(outline, [wall], edge_length=0.6, patches=patches, mirrors=mirrors).surface())
    assert found.certificate.verdict is Verdict.SADDLE
    assert certify(found.surface, whole=half).index == 3  # it shrinks or grows, or moves to any side
    assert "the bottom of 'wall 1' slips: hold it (" in found.certificate.detail
    top = found.surface.vertices[found.surface.topology.on_junction]
    assert np.linalg.norm(top[:, :2], axis=1) == pytest.approx(neck * np.cosh(height / neck), rel=0.015)
    assert top[:, 2] == pytest.approx(height, rel=0.02)
