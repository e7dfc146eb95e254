"""Surfaces known in closed form that are no part of the package: Delaunay's, films, lenses, drums.

What is asserted is the order at which meshes come near them, and that the Morse index changes where
theory says: at lengths π r k of a cylinder, at conjugate points of unduloids and catenoids.
"""

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.optimize import brentq
from scipy.special import lpmv
from shapes import disc, tube

from generators import spherical_cap
from pcmc import Patch, Surface, Verdict, certify, solve
from pcmc.energy.functional import volume

pytestmark = pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")

AROUND = (12, 24, 48)


def orders(errors):
    errors = np.abs(errors)
    return np.log2(errors[:-1] / errors[1:])


def rows(length, around, radius=1.0):
    """An even number of rows that makes triangles of a tube about equilateral."""
    return 2 * max(1, round(length / (2.0 * np.sqrt(3.0) * np.pi * radius / around)))


def stationary(start, swell=1.01):
    """The equilibrium found from a start whose free vertices are moved away from the axis."""
    X = start.vertices.copy()
    X[start.free, :2] *= swell
    result = solve(start.moved(X), target="stationary")
    assert result.converged
    return result


def straight(radius, bottom, top):
    """The profile of a cylinder."""
    return lambda t: (radius + 0.0 * t, bottom + (top - bottom) * t)


def radii(surface):
    return np.hypot(*surface.vertices.T[:2])


# ---- cylinder: the second variation is α ((kπ/L)² + (m² - 1)/r²) --------------------------------


def cylinder(around, length, radius=1.0, tension=1.0):
    """Radius r needs the pressure α / r."""
    patch = Patch("tube", tension, tension / radius)
    return tube(rows(length, around, radius), around, straight(radius, 0.0, length), patch)


@pytest.mark.parametrize("radius", [1.0, 0.5])
def test_the_softest_mode_of_a_cylinder(radius):
    length, tension = 1.5 * np.pi * radius, 3.0
    exact = tension * (np.pi**2 / length**2 - 1.0 / radius**2)
    found = [stationary(cylinder(n, length, radius, tension), 1.0).certificate for n in AROUND]
    assert [c.index for c in found] == [1, 1, 1]
    error = np.array([c.eigenvalues[0] for c in found]) - exact
    assert orders(error) == pytest.approx(2.0, abs=0.25)


@pytest.mark.parametrize(("turns", "index"), [(0.75, 0), (1.25, 1), (1.9, 1), (2.1, 2), (3.1, 3)])
def test_a_cylinder_loses_a_way_of_being_stable_at_each_half_wave(turns, index):
    """Under given pressure at L = π r, 2 π r, …; at given volume the first of these does not count,
    and Plateau and Rayleigh's limit 2 π r is where the index goes from 1 to 2.
    """
    found = stationary(cylinder(24, turns * np.pi), 1.0).certificate
    assert found.index == index
    assert found.verdict is (Verdict.SADDLE if index else Verdict.STABLE)


# ---- Delaunay's surfaces, mean curvature ½: r = √(1 + B² + 2 B sin s), dz = (1 + B sin s)/r ds ----


def delaunay(B, middle, half):
    """Profile over s in middle ± half, s the arc length: a neck at -π/2, a bulge at π/2."""
    s = np.linspace(middle - half, middle + half, 4001)
    r = np.sqrt(1.0 + B * B + 2.0 * B * np.sin(s))
    z = cumulative_simpson((1.0 + B * np.sin(s)) / r, x=s, initial=0.0)
    share = np.linspace(0.0, 1.0, len(s))
    return (lambda t: (np.interp(t, share, r), np.interp(t, share, z))), r, z


def conjugate(B):
    """Arc length from the neck at which the change with B of the unduloid is tangential."""

    def across(half):
        s = np.linspace(-0.5 * np.pi, half - 0.5 * np.pi, 2001)
        sine = np.sin(s)
        r = np.sqrt(1.0 + B * B + 2.0 * B * sine)
        r_B, r_s, z_s = (B + sine) / r, B * np.cos(s) / r, (1.0 + B * sine) / r
        z_B = cumulative_simpson(sine / r - (1.0 + B * sine) * (B + sine) / r**3, x=s, initial=0.0)
        return (r_B * z_s - z_B * r_s)[-1]

    return brentq(across, 0.05, 2.5)


@pytest.mark.parametrize(
    ("B", "middle", "half"),
    [(0.4, 0.5 * np.pi, 1.2), (0.4, -0.5 * np.pi, 0.6), (1.5, 0.5 * np.pi, 1.2)],
    ids=["bulge", "neck", "nodoid"],
)
def test_unduloids_and_nodoids(B, middle, half):
    profile, r, z = delaunay(B, middle, half)
    flux = np.pi * (1.0 - B * B)  # 2 π α r cos φ - π p r², the same at every height
    away, force = [], []
    for around in AROUND:
        mesh = tube(rows(2.0 * half, around, r.max()), around, profile, Patch("tube", 1.0))
        result = stationary(mesh)
        assert result.certificate.verdict is Verdict.STABLE
        surface = result.surface
        away.append(np.abs(radii(surface) - np.interp(surface.vertices[:, 2], z, r)).max())
        ends = result.certificate.boundaries["reaction_z"].to_numpy()
        assert ends.sum() == pytest.approx(0.0, abs=1e-12)
        force.append(ends.max() - np.pi * r[0] ** 2 - flux)
    assert orders(away) == pytest.approx(2.0, abs=0.35)
    assert orders(force)[-1] == pytest.approx(2.0, abs=0.25)


@pytest.mark.parametrize("B", [0.2, 0.4])
def test_unduloids_turn_unstable_at_their_conjugate_point(B):
    limit = conjugate(B)
    index = []
    for half in (limit - 0.15, limit + 0.15):
        profile, *_ = delaunay(B, -0.5 * np.pi, half)
        found = stationary(tube(rows(2.0 * half, 32), 32, profile, Patch("tube", 1.0)))
        index.append(found.certificate.index)
    assert index == [0, 1]


def test_the_conjugate_point_of_the_thinnest_waves_is_that_of_the_cylinder():
    assert conjugate(1e-3) == pytest.approx(0.5 * np.pi, abs=2e-3)


# ---- catenoids between rings of radius 1: c cosh(h/c) = 1 ---------------------------------------

FILM = Patch("film", 1.0, pressure=0.0)
FOLD = brentq(lambda u: u * np.tanh(u) - 1.0, 1.0, 1.5)  # h/c where the two necks meet
WIDEST = 1.0 / np.sinh(FOLD)  # h there: 0.6627


def neck(h, deep=False):
    bounds = (0.05, h / FOLD) if deep else (h / FOLD, 1.0)
    return brentq(lambda c: c * np.cosh(h / c) - 1.0, *bounds)


def catenoid(around, h, c):
    def profile(t):
        z = h * (2.0 * t - 1.0)
        return c * np.cosh(z / c), z

    return tube(rows(2.0 * h, around, 0.8), around, profile, FILM)


@pytest.mark.parametrize(("deep", "verdict"), [(False, Verdict.STABLE), (True, Verdict.SADDLE)])
def test_catenoids(deep, verdict):
    h = 0.5
    c = neck(h, deep)
    area = np.pi * c**2 * (2.0 * h / c + np.sinh(2.0 * h / c))
    away, energy, pull = [], [], []
    for around in AROUND[1:]:
        result = stationary(catenoid(around, h, c))
        found = result.certificate
        assert found.verdict is verdict
        assert found.index == int(deep)
        z = result.surface.vertices[:, 2]
        away.append(np.abs(radii(result.surface) - c * np.cosh(z / c)).max())
        energy.append(result.energy - area)
        pull.append(found.boundaries["reaction_z"].max() - 2.0 * np.pi * c)
    for errors in (away, energy, pull):
        assert orders(errors) == pytest.approx(2.0, abs=0.25)


def test_the_widest_catenoid():
    assert abs(WIDEST - 0.6627) < 1e-4
    for h in (0.98 * WIDEST, 1.03 * WIDEST):
        result = solve(tube(rows(2.0 * h, 32), 32, straight(1.0, -h, h), FILM))
        assert result.converged == (h < WIDEST)
        assert (result.certificate.verdict is Verdict.STABLE) == (h < WIDEST)


def test_a_film_meets_the_plane_at_a_right_angle():
    """Half a catenoid, its neck free on Π: the same neck as that of the whole one (8)."""
    h = 0.5
    c, error = neck(h), []
    for around in AROUND:
        count = rows(2.0 * h, around, 0.8) // 2
        ends = {"on_plane": range(around), "fixed": range(count * around, (count + 1) * around)}
        result = solve(tube(count, around, straight(1.0, 0.0, h), FILM, **ends))
        assert result.certificate.verdict is Verdict.STABLE
        error.append(radii(result.surface)[:around].mean() - c)
    assert orders(error)[-1] == pytest.approx(2.0, abs=0.25)


# ---- bubbles and lenses -------------------------------------------------------------------------


def dome(rings, radius, opening):
    """Points (n,3) of a sphere's part up to an angle from its top, faces, and which are its rim."""
    flat, faces = disc(rings)
    share = np.hypot(*flat.T)
    out = flat / np.maximum(share, 1e-12)[:, None]
    polar = opening * share
    X = radius * np.column_stack([np.sin(polar)[:, None] * out, np.cos(polar)])
    return X, faces, np.isclose(share, 1.0)


def test_a_bubble_on_the_plane_is_a_hemisphere():
    """Free to slide: modes α (l (l + 1) - 2) / R² with l + m even, the two translations left out."""
    size, lowest, lift = [], [], []
    for rings in (4, 8, 16):
        X, faces, rim = dome(rings, 2.0, 0.5 * np.pi)
        X[rim, 2] = 0.0
        start = Surface(
            X * [1.05, 0.97, 1.03], faces, [0] * len(faces), [Patch("bubble", 1.0)], on_plane=rim
        )
        result = solve(start, target="stationary")
        found = certify(result.surface, modes=4)
        assert found.verdict is Verdict.SADDLE
        assert found.index == 1
        Y = result.surface.vertices
        size.append(np.linalg.norm(Y - Y[rim].mean(axis=0), axis=1).max() - 2.0)
        lowest.append(found.eigenvalues - [-0.5, 1.0, 1.0, 1.0])
        lift.append(found.support + 4.0 * np.pi)  # the load on its circle
    assert orders(size) == pytest.approx(2.0, abs=0.2)
    assert orders(lift) == pytest.approx(2.0, abs=0.2)
    assert orders(np.array(lowest)) == pytest.approx(2.0, abs=0.3)


def lens(rings, top, bottom, film):
    """Two domes over a circle in the middle of a flat film whose outer edge is held, and its radius.

    Radii 2 α balance the pressure 1. Over the circle of radius ρ their slopes have sines ρ / 2 α, so
    the forces across the film always balance; those along it do if √(α_1² - ρ²/4) + √(α_2² - ρ²/4)
    is the film's tension: ρ is twice the height of the triangle with the tensions as its sides.
    """
    s = 0.5 * (top + bottom + film)
    circle = 4.0 * np.sqrt(s * (s - top) * (s - bottom) * (s - film)) / film
    angles = [np.arcsin(0.5 * circle / tension) for tension in (top, bottom)]
    upper, faces, rim = dome(rings, 2.0 * top, angles[0])
    lower = dome(rings, 2.0 * bottom, angles[1])[0]
    upper[:, 2] -= 2.0 * top * np.cos(angles[0])
    lower[:, 2] -= 2.0 * bottom * np.cos(angles[1])
    around = np.flatnonzero(rim)
    around = around[np.argsort(np.arctan2(*upper[around].T[1::-1]))]
    number = np.arange(len(rim))
    number[~rim] = len(rim) + np.arange(np.count_nonzero(~rim))
    X, F, patch = [upper, lower[~rim] * [1, 1, -1]], [faces, number[faces][:, ::-1]], [0, 1]
    inner, count = around, len(rim) + np.count_nonzero(~rim)
    for k in range(1, rings + 1):
        outer = count + np.arange(len(around))
        X.append(upper[around] * [2.0 ** (k / rings), 2.0 ** (k / rings), 0.0])
        ahead, next_ahead = np.roll(inner, -1), np.roll(outer, -1)
        F += [np.stack([inner, outer, next_ahead], 1), np.stack([inner, next_ahead, ahead], 1)]
        patch += [2, 2]
        inner, count = outer, count + len(around)
    patches = [Patch("top", top), Patch("bottom", bottom), Patch("film", film, 0.0)]
    surface = Surface(
        np.concatenate(X),
        np.concatenate(F),
        np.repeat(patch, [len(f) for f in F]),
        patches,
        fixed=inner,
    )
    return surface, around, circle


@pytest.mark.parametrize("tensions", [(1.0, 1.3, 1.8), (1.0, 1.0, 1.0)], ids=["unequal", "120°"])
def test_a_lens_in_a_film_keeps_young_s_law(tensions):
    error = []
    for rings in (3, 6, 12):
        start, around, circle = lens(rings, *tensions)
        result = stationary(start, 1.03)
        assert result.certificate.index == 1  # it grows or shrinks
        error.append(radii(result.surface)[around].mean() - circle)
    assert orders(error) == pytest.approx(2.0, abs=0.2)


# ---- flat films ---------------------------------------------------------------------------------

CORNERS = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])


def tetrahedron(n, centre):
    """The six triangles from a tetrahedron's edges to a point inside: four triple lines meet there."""
    number: dict[tuple[float, ...], int] = {}
    F, patch, held = [], [], set()
    pairs = [(a, b) for a in range(4) for b in range(a + 1, 4)]
    for k, (a, b) in enumerate(pairs):

        def at(i, j, a=a, b=b):
            place = centre + (CORNERS[a] - centre) * i / n + (CORNERS[b] - centre) * j / n
            return number.setdefault(tuple(place.round(9).tolist()), len(number))

        for i in range(n):
            for j in range(n - i):
                F.append([at(i, j), at(i + 1, j), at(i, j + 1)])
                F += [[at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]] if i + j < n - 1 else []
        patch += [k] * n**2
        held |= {at(i, n - i) for i in range(n + 1)}
    films = [Patch(f"film {a}{b}", 1.0, pressure=0.0) for a, b in pairs]
    return Surface(np.array(list(number)), F, patch, films, fixed=sorted(held))


@pytest.mark.parametrize("n", [1, 2, 4])
def test_the_soap_film_of_a_tetrahedron_is_flat(n):
    start = tetrahedron(n, np.array([0.1, 0.05, -0.08]))
    middle = int(np.linalg.norm(start.vertices, axis=1).argmin())
    assert sum(middle in curve.vertices for curve in start.topology.junctions) == 4
    result = solve(start)
    assert result.certificate.verdict is Verdict.STABLE
    assert result.surface.vertices[middle] == pytest.approx(0.0, abs=1e-12)
    assert result.energy == pytest.approx(6.0 * np.sqrt(2.0), rel=1e-13)


# ---- caps: the limit of great tension, and how they vibrate -------------------------------------


def test_a_tense_roof_over_an_ellipse_solves_poisson_s_equation():
    """α Δu = -1 over x²/a² + y²/b² ≤ 1: u = a² b² / 2 α (a² + b²) at the top, volume π a b u / 2."""
    a, b, tension = 2.0, 1.0, 1e3
    top = a**2 * b**2 / (2.0 * tension * (a**2 + b**2))
    error, height = [], []
    for rings in (4, 8, 16):
        flat, faces = disc(rings)
        rim = np.isclose(np.hypot(*flat.T), 1.0)
        X = np.column_stack([flat * [a, b], 0.0 * rim])
        surface = solve(
            Surface(X, faces, [0] * len(faces), [Patch("roof", tension)], fixed=rim)
        ).surface
        error.append(volume(surface) / (0.5 * np.pi * a * b * top) - 1.0)
        height.append(surface.vertices[:, 2].max() / top - 1.0)
    assert orders(error) == pytest.approx(2.0, abs=0.1)
    assert abs(height[-1]) < 1e-3


def test_the_softest_mode_of_a_cap():
    """α (ν (ν + 1) - 2) / R² with ν the first zero of the Legendre function P_ν at the rim."""
    tension, radius = 0.6, 1.2
    at_rim = np.sqrt(1.0 - 1.0 / radius**2)
    degree = brentq(lambda nu: lpmv(0, nu, at_rim), 1.05, 4.0)
    exact = tension * (degree * (degree + 1.0) - 2.0) / radius**2
    error = [
        solve(spherical_cap(edge)).certificate.eigenvalues[0] - exact
        for edge in (0.25, 0.125, 0.0625, 0.03125)
    ]
    assert orders(error)[1:] == pytest.approx(2.0, abs=0.25)
