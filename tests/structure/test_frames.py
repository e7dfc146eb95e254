"""Frames of bars against closed forms, with the order of convergence."""

import numpy as np
import pytest
from scipy.optimize import brentq

from pcmc.base.errors import OptionError
from pcmc.structure.frames import BarFrame, balancing_force, bar_axes
from pcmc.structure.material import Profile

UP = np.array([0.0, 0.0, 1.0])
PLANAR = [(0, 1), (0, 3), (0, 5)]  # displacements across and turns out of the plane xz, which it keeps


def frame_along(X, holds=(), closed=False, stiffness=(1e6, 2000.0, 500.0, 300.0)):
    """Bars along points (n,3); ``holds`` are pairs of a point and a coordinate."""
    n = len(X)
    bars = np.stack([np.arange(n), (np.arange(n) + 1) % n], axis=1)[: n if closed else -1]
    rows = np.zeros((len(holds), 6 * n))
    for row, (point, coordinate) in zip(rows, holds, strict=True):
        row[6 * (point % n) + coordinate] = 1.0
    return BarFrame(X, bars, np.tile(stiffness, (len(bars), 1)), rows, UP)


def hinged(*coordinates):
    """Both ends held against displacements and twist."""
    return [(end, k) for end in (0, -1) for k in (0, 1, 2)] + [(0, k) for k in coordinates]


def lumped(widths):
    """Half of each bar's load at its ends."""
    return np.append(widths, 0.0) / 2.0 + np.append(0.0, widths) / 2.0


def straight(n, length=10.0):
    return np.stack([np.linspace(0.0, length, n + 1), np.zeros(n + 1), np.zeros(n + 1)], axis=1)


@pytest.mark.parametrize(("axis", "column", "inertia"), [(2, 4, 2000.0), (1, 5, 500.0)])
def test_a_straight_beam_has_the_moment_and_the_deflection_of_the_tables(axis, column, inertia):
    """M = w L²/8 at the points exactly, 5 w L⁴ / 384 E I with the second order of the lumped load."""
    off = []
    for n in (4, 8, 16):
        X, forces = straight(n), np.zeros((n + 1, 3))
        forces[:, axis] = -3.0 * lumped(np.full(n, 10.0 / n))
        solved = frame_along(X, hinged(3)).solved(forces)
        within = solved.within(np.arange(n))[0]
        assert within[n // 2, column] == pytest.approx(3.0 * 100.0 / 8.0)
        shear = within[:, 1 if axis == 2 else 2]
        np.testing.assert_allclose(shear, 3.0 * (5.0 - X[:, 0]), atol=1e-9)  # dM/ds, also at the ends
        np.testing.assert_allclose(solved.reactions.sum(axis=0), -forces.sum(axis=0), atol=1e-9)
        off.append(1.0 + solved.displacements[n // 2, axis] / (5 * 3.0 * 1e4 / 384.0 / inertia))
    assert np.polyfit(np.log([4, 8, 16]), np.log(off), 1)[0] == pytest.approx(-2.0, abs=0.01)


def test_a_column_buckles_under_eulers_load_to_the_fourth_order():
    """π² E I/L² about the weaker axis with hinged ends, four times that with clamped ones."""
    euler, bars = np.pi**2 * 500.0 / 100.0, [2, 4, 8]
    off = [frame_along(straight(n), hinged(3)).buckling(-np.ones(n)) / euler - 1.0 for n in bars]
    assert np.polyfit(np.log(bars), np.log(off), 1)[0] == pytest.approx(-4.0, abs=0.1)
    clamped = frame_along(straight(16), [(end, k) for end in (0, -1) for k in range(6)])
    assert clamped.buckling(np.full(16, -2.0)) == pytest.approx(4.0 * euler / 2.0, rel=1e-4)
    assert clamped.buckling(np.ones(16)) == np.inf
    one_bar = frame_along(straight(1), [(end, k) for end in (0, -1) for k in range(6)])
    assert one_bar.buckling(np.array([-1.0])) == np.inf
    both = BarFrame(
        np.concatenate([straight(8), straight(8) + 5.0 * UP]),
        np.concatenate([frame_along(straight(8)).bars + first for first in (0, 9)]),
        np.tile((1e6, 2000.0, 500.0, 300.0), (16, 1)),
        np.kron(np.eye(2), frame_along(straight(8), hinged(3)).holds),
        UP,
    )
    alone = frame_along(straight(8), hinged(3)).buckling(-np.ones(8))
    assert both.buckling(-np.repeat([0.0, 1.0], 8)) == pytest.approx(alone)
    assert both.buckling(-np.repeat([3.0, 1.0], 8)) == pytest.approx(alone / 3.0)


def buckling_of_an_arc(half):
    """q R³/E I of an arc of the angle 2 ``half`` with hinged ends under an even radial load that keeps its
    direction, in its plane: with v along it, θ = v'' + v and k = q R³/E I the conditions (θ'' + k θ)'' +
    θ'' + k θ = 0 and v = v' = θ' = 0 at the ends, for v even, which is w = -v' odd."""

    def unsolvable(k):
        root, (s, c) = np.sqrt(k), (np.sin(half), np.cos(half))
        a, b = np.cos(root * half), -root * np.sin(root * half)
        return np.linalg.det(
            [[a / (1 - k), half * s / 2, c], [b / (1 - k), (s + half * c) / 2, -s], [b, -s, 0.0]]
        )

    shallow = (np.pi / half) ** 2 - 1.0  # of a pressure that turns with it: Timoshenko and Gere, 7.4
    return brentq(unsolvable, 0.9 * shallow, 1.2 * shallow), shallow


@pytest.mark.parametrize("half", [0.5, 1.0])
def test_an_arch_buckles_in_its_plane_under_the_load_of_the_closed_form(half):
    off, bars = [], [16, 32, 64]
    exact, following = buckling_of_an_arc(half)
    for n in bars:
        at = np.linspace(-half, half, n + 1)
        X = 10.0 * np.stack([np.sin(at), 0.0 * at, np.cos(at)], axis=1)
        held = [(end, k) for end in (0, -1) for k in (0, 2)]
        held += [(point, k) for point in range(n + 1) for k in (1, 3, 5)]  # it stays in its plane
        arch = frame_along(X, held, stiffness=(1e9, 2000.0, 500.0, 300.0))
        off.append(arch.buckling(np.full(n, -2000.0 / 10.0**2)) / exact - 1.0)
    assert np.polyfit(np.log(bars), np.log(off), 1)[0] == pytest.approx(-2.0, abs=0.1)
    assert exact == pytest.approx(following + 1.0, rel=0.03)  # as shallow arches have it


def test_a_ring_buckles_out_of_its_plane_and_held_there_within_it():
    """Under an even load q that keeps its direction: q R³/E I = 9/(4 + E I/G J), else 4, order 2."""
    bars, off = [10, 20, 40], []
    for n in bars:
        at = 2.0 * np.pi * np.arange(n) / n
        X, thrust = 5.0 * np.stack([np.cos(at), np.sin(at), 0.0 * at], axis=1), np.full(n, -100.0 / 5.0**2)
        upright = [(point, 2) for point in range(n)]
        rings = [frame_along(X, held, True, (1e6, 100.0, 100.0, 80.0)) for held in ((), upright)]
        exact = 9.0 / (4.0 + 100.0 / 80.0), 4.0
        off.append([ring.buckling(thrust) / value - 1.0 for ring, value in zip(rings, exact, strict=True)])
    for column in np.transpose(off):
        assert np.polyfit(np.log(bars), np.log(column), 1)[0] == pytest.approx(-2.0, abs=0.1)
        assert column[-1] < 0.01
    assert rings[1].buckling(1e-8 * thrust) == np.inf  # so far from it the factor is rounding


def test_clamped_ends_take_a_twelfth():
    n = 32
    forces = np.zeros((n + 1, 3))
    forces[:, 2] = -3.0 * lumped(np.full(n, 10.0 / n))
    ends = [(end, k) for end in (0, -1) for k in range(6)]
    solved = frame_along(straight(n), ends).solved(forces)
    assert solved.within(np.arange(n))[0][[0, n // 2, -1], 4] == pytest.approx(
        [-3.0 * 100 / 12, 3.0 * 100 / 24, -3.0 * 100 / 12], rel=3e-3
    )
    assert solved.moments[0, 1] == pytest.approx(-3.0 * 100 / 12, rel=3e-3)


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_a_portal_has_the_forces_of_both_sides_at_its_corners(turn):
    """An even load w on the beam, clamped feet, k = E I' h / E I L: H = w L²/4 h (k + 2), M = 2 H h/3 at the
    corners, N = -H in the beam and -w L/2 in the columns. A corner had the mean of both sides: N of neither,
    and moments that nearly cancelled."""
    n, h, L, up = 32, 4.0, 6.0, np.array([np.sin(turn), 0.0, np.cos(turn)])
    rise, along = np.linspace(0.0, h, n + 1), np.linspace(0.0, L, n + 1)
    x = np.concatenate([0.0 * rise, along[1:-1], 0.0 * rise + L])
    z = np.concatenate([rise, 0.0 * along[1:-1] + h, rise[::-1]])
    X = np.outer(x, np.cross([0.0, 1.0, 0.0], up)) + np.outer(z, up)
    forces = np.zeros_like(X)
    forces[n : 2 * n + 1] = -np.outer(3.0 * lumped(np.full(n, L / n)), up)
    rows = np.zeros((12, 6 * len(X)))
    rows[:6, :6] = rows[6:, -6:] = np.eye(6)
    stiffness = np.repeat([[1e9, EI, EI, 9.0] for EI in (100.0, 250.0, 100.0)], n, axis=0)
    bars = np.stack([np.arange(3 * n), np.arange(3 * n) + 1], axis=1)
    within, at = BarFrame(X, bars, stiffness, rows, up).solved(forces).within(np.arange(3 * n))
    H = 3.0 * L**2 / (4.0 * h * (2.5 * h / L + 2.0))
    assert at[[n, n + 1]].tolist() == [n, n]
    N, V, M = within[[n, n + 1], 0], *(np.linalg.norm(within[[n, n + 1], k : k + 2], axis=1) for k in (1, 4))
    np.testing.assert_allclose(N, [-9.0, -H], rtol=2e-3)
    np.testing.assert_allclose(V, [H, 9.0], rtol=2e-3)
    np.testing.assert_allclose(M, 2.0 * H * h / 3.0, rtol=2e-3)


@pytest.mark.parametrize("first", [0, 3])
def test_a_square_ring_has_the_moments_of_its_sides_and_their_shear_at_its_corners(first):
    """Pulled outwards with q: N = V = q a/2, M = -q a²/12 at corners, V the same on any mesh."""
    side = np.arange(8) / 8.0
    X = np.concatenate([np.stack([side, 0.0 * side], axis=1) - 0.5 for _ in range(4)])
    for k in range(4):
        turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
        X[8 * k : 8 * k + 8] = X[8 * k : 8 * k + 8] @ np.linalg.matrix_power(turn, k)
    X = np.roll(np.pad(X, ((0, 0), (0, 1))), first, axis=0)
    edges = np.roll(X, -1, axis=0) - X
    pull = 0.5 * 6.0 * np.cross(edges + np.roll(edges, 1, axis=0), UP)
    within, at = frame_along(X, closed=True).solved(pull).within(np.arange(32), closed=True)
    corners = within[np.flatnonzero(np.diff(at) == 0) + 1]
    assert len(corners) == (4 if first else 3)  # the first is the first and the last row
    assert at[[0, -1]].tolist() == ([0, 31] if first else [0, 32])
    np.testing.assert_allclose(within[:, 0], 3.0)
    np.testing.assert_allclose(np.abs(corners[:, 2]), 3.0)
    np.testing.assert_allclose(corners[:, 5], -6.0 / 12.0 * (1.0 - 1.0 / 64.0), rtol=1e-6)


def arch(n, shape):
    """An arch of the half span 5, and half of each bar's span at its ends."""
    X = straight(n)
    X[:, 0] -= 5.0
    X[:, 2] = shape(X[:, 0])
    return X


def test_a_parabolic_arch_under_an_even_load_does_not_bend():
    """H = w L²/(8 f); the moments vanish, but for the shortening of the arch."""
    X = arch(20, lambda x: 4.0 * (1.0 - (x / 5.0) ** 2))
    forces = np.zeros_like(X)
    forces[:, 2] = -2.0 * lumped(np.diff(X[:, 0]))
    solved = frame_along(X, hinged(3), stiffness=(1e10, 100.0, 100.0, 100.0)).solved(forces)
    assert solved.reactions[0] == pytest.approx([2.0 * 100 / (8 * 4.0), 0.0, 10.0])
    assert np.abs(solved.within(np.arange(20))[0][:, 4]).max() < 1e-5 * 2.0 * 100.0 / 8.0
    N, share = balancing_force(X, forces, closed=False)
    middle = np.array([0, 0, 1.0]) @ (X[1] - X[0]) / np.linalg.norm(X[1] - X[0])
    assert share > 0.05
    assert N < 0.0
    assert middle > 0.0


def test_a_two_hinged_half_circle_has_the_thrust_of_its_closed_form():
    """An even load per span: H = 4 w R / 3 π, M = w R²/2 sin²θ - H R sin θ, to the fourth order; a crown
    load: H = P/π."""
    off = []
    for n in (16, 32, 64):
        angle = np.linspace(np.pi, 0.0, n + 1)
        X = 5.0 * np.stack([np.cos(angle), 0.0 * angle, np.sin(angle)], axis=1)
        frame = frame_along(X, hinged(3), stiffness=(1e9, 100.0, 100.0, 100.0))
        forces = np.zeros_like(X)
        forces[:, 2] = -2.0 * lumped(np.diff(X[:, 0]))
        solved, H = frame.solved(forces), 4.0 * 2.0 * 5.0 / (3.0 * np.pi)
        exact = 25.0 * np.sin(angle) ** 2 - 5.0 * H * np.sin(angle)
        off.append(np.abs(solved.within(np.arange(n))[0][:, 4] - exact).max() / 25.0)
        point = np.zeros_like(X)
        point[n // 2, 2] = -7.0
    assert solved.reactions[0] == pytest.approx([H, 0.0, 10.0], rel=2e-3, abs=1e-9)
    assert frame.solved(point).reactions[0, 0] == pytest.approx(7.0 / np.pi, rel=2e-3)
    assert np.polyfit(np.log([16, 32, 64]), np.log(off), 1)[0] == pytest.approx(-4.0, abs=0.1)


def test_a_curved_cantilever_has_the_moments_and_shear_of_its_closed_form_with_order_two():
    """A quarter circle under an even load q per length, of bars of two lengths, clamped at one end: b from
    its free end, V = q R b, M = q R² (1 - cos b), T = q R² (b - sin b)."""
    off = []
    for n in (16, 32, 64):
        angle = np.linspace(0.0, np.pi / 2.0, n + 1)
        angle[1:-1:2] += 0.25 * (angle[1] - angle[0])
        X = 4.0 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
        forces = -3.0 * lumped(4.0 * np.diff(angle))[:, None] * UP
        within = frame_along(X, [(0, k) for k in range(6)]).solved(forces).within(np.arange(n))[0]
        b = np.pi / 2.0 - angle
        exact = np.stack([12.0 * b, -48.0 * (b - np.sin(b)), -48.0 * (1.0 - np.cos(b))], axis=1)
        off.append(np.abs(within[:, [1, 3, 4]] - exact).max(axis=0) / np.abs(exact).max(axis=0))
    assert (off[-1] < 0.003).all()
    assert (np.polyfit(np.log([16, 32, 64]), np.log(off), 1)[0] < -1.9).all()


def test_a_ring_that_nothing_holds_carries_its_pull_without_bending():
    """N = q R with the second order of its sides; what is out of balance is left out."""
    off = []
    for n in (16, 32, 64):
        angle = 2.0 * np.pi * np.arange(n) / n
        X = 2.0 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
        pull = 3.0 * X / 2.0 * (2.0 * np.pi * 2.0 / n)
        within = frame_along(X, closed=True).solved(pull + 0.1 * UP).within(np.arange(n), closed=True)[0]
        np.testing.assert_allclose(within[:, 4:], 0.0, atol=1e-6)
        N, share = balancing_force(X, pull, closed=True)
        assert share < 1e-12
        assert pytest.approx(N) == within[0, 0]
        off.append(within[0, 0] / 6.0 - 1.0)
    assert np.polyfit(np.log([16, 32, 64]), np.log(off), 1)[0] == pytest.approx(-2.0, abs=0.02)


def test_a_straight_line_has_no_force_of_its_own_wherever_it_lies():
    """Turned, it had a force over the rounding of its turns, whose wall would pull as much as the sheets."""
    X = np.outer(np.linspace(0.0, 1.0, 9), [0.3, 0.5, 0.7]) + 1e3
    assert balancing_force(X, np.ones((9, 3)), closed=False) == (0.0, 1.0)


def test_a_bar_that_stands_has_axes_too():
    axes, _ = bar_axes(np.array([[0.0, 0, 0], [0, 0, 2]]), np.array([[0, 1]]), UP)
    np.testing.assert_allclose(axes[0] @ axes[0].T, np.eye(3), atol=1e-15)


@pytest.mark.parametrize(
    "profile", [Profile.tube(0.2, 0.01), Profile.rectangle(0.1, 0.3), Profile(2.0, 5.0, 3.0)]
)
def test_the_equal_rectangle_is_as_stiff(profile):
    b, h, f = profile.equal_rectangle
    found = f * b * h, f * b * h**3 / 12.0, f * h * b**3 / 12.0
    assert found == pytest.approx((profile.area, *profile.moments), rel=1e-10)


def test_sections_have_the_numbers_of_the_tables():
    """Area, second moment, and torsion of what is round in multiples of π; torsion of rectangles within 0.2 %
    of the exact series."""
    tube, solid = Profile.tube(4.0, 0.5), Profile.circle(4.0)
    assert (tube.area / np.pi, tube.upright / np.pi) == pytest.approx((7.0 / 4.0, 175.0 / 64.0))
    assert (solid.area / np.pi, solid.upright / np.pi) == pytest.approx((4.0, 4.0))
    assert (tube.torsion / np.pi, solid.torsion / np.pi) == pytest.approx((175.0 / 32.0, 8.0))
    for ratio, share in ((1.0, 0.14058), (2.0, 0.22868), (10.0, 0.31233)):
        assert Profile.rectangle(0.5, 0.5 * ratio).torsion / (ratio * 0.5**4) == pytest.approx(
            share, rel=2e-3
        )
    with pytest.raises(OptionError, match="at most half the diameter, 2, found 3"):
        Profile.tube(4.0, 3.0)
