"""Surfaces known in closed form: Delaunay's, films, lenses, minimal surfaces, drums.

What is asserted is the order at which meshes come near them, and that the Morse index changes where
theory says: at lengths π r k of a cylinder, at conjugate points of unduloids and catenoids.
"""

import numpy as np
import pytest
from convergence import orders
from refusals import refused
from scipy.optimize import brentq
from scipy.special import lpmv
from shapes import disc

import generators
from generators import (
    catenoid,
    catenoid_exact,
    catenoid_fold,
    catenoid_neck,
    cylinder,
    cylinder_exact,
    delaunay,
    delaunay_exact,
    delaunay_force,
    delaunay_limit,
    enneper,
    enneper_exact,
    hemisphere,
    hemisphere_exact,
    lens,
    lens_circle,
    lens_exact,
    skew_quadrilateral,
    skew_quadrilateral_exact,
    spherical_cap,
    spherical_cap_exact,
    tetrahedral_film,
    tetrahedral_film_exact,
    unduloid_length,
)
from pcmc import Patch, Room, Surface, Verdict, certify, energy, solve
from pcmc.base.errors import OptionError
from pcmc.forces.functional import patch_areas, volume

pytestmark = pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")


def stationary(start):
    result = solve(start, target="stationary")
    assert result.converged
    return result


def edges(exact, around):
    """Edge lengths, each half of the last, with these segments around a tube; its rows should double too."""
    (meridian,) = exact.shapes.values()
    edge = 2.0 * np.pi * meridian.r.max() / around
    rows = meridian.length / (np.sqrt(3.0) * edge)
    assert abs(rows - round(rows)) < 0.1
    return edge, 0.5 * edge, 0.25 * edge


def radii(surface):
    return np.hypot(*surface.vertices.T[:2])


# ---- exact vertices: the closed form itself, without a solver -----------------------------------

EXACT = {
    "cylinder": ({"length": 3.6}, edges(cylinder_exact(length=3.6), 24)),
    "catenoid": ({}, edges(catenoid_exact(), 41)),
    "delaunay": ({"waviness": 1.5}, edges(delaunay_exact(waviness=1.5), 45)),
    "hemisphere": ({}, (0.4, 0.2, 0.1)),
    "lens": ({}, (0.4, 0.2, 0.1)),
    "skew_quadrilateral": ({}, (0.1, 0.05, 0.025)),
    "enneper": ({"radius": 1.2}, (0.2, 0.1, 0.05)),
    "spherical_cap": ({"upper": True}, (0.1, 0.05, 0.025)),
}


@pytest.mark.parametrize("name", EXACT)
def test_the_mesh_with_exact_vertices_has_the_area_volume_and_energy_of_the_closed_form(name):
    arguments, lengths = EXACT[name]
    exact = getattr(generators, f"{name}_exact")(**arguments)
    meshes = [getattr(generators, name)(h, **arguments, exact=True) for h in lengths]
    assert max(exact.distance(mesh).max() for mesh in meshes) < 1e-6
    assert orders(np.array([patch_areas(mesh).sum() for mesh in meshes]) - exact.area)[-1] == (
        pytest.approx(2.0, abs=0.2)
    )
    assert orders(np.array([energy(mesh) for mesh in meshes]) - exact.energy)[-1] == (
        pytest.approx(2.0, abs=0.2)
    )
    if exact.volume:
        assert orders(np.array([volume(mesh) for mesh in meshes]) - exact.volume)[-1] == (
            pytest.approx(2.0, abs=0.2)
        )


def test_bad_input_is_refused():
    with refused(OptionError, what="half_distance", found=0.7, expected=catenoid_fold()):
        catenoid(half_distance=0.7)
    with refused(OptionError, what="waviness", found=1.0):
        delaunay(waviness=1.0)
    with refused(OptionError, what="centre", found="top"):
        delaunay(centre="top")
    with refused(OptionError, what="alpha_film", found=2.5):
        lens(alpha_film=2.5)
    with refused(OptionError, what="radius", found=1.8):
        enneper(radius=1.8)
    with refused(OptionError, what="edge_length", found=0.0):
        skew_quadrilateral(0.0)


# ---- cylinder: the second variation is α ((kπ/L)² + (m² - 1)/r²) --------------------------------


@pytest.mark.parametrize("radius", [1.0, 0.5])
def test_the_softest_mode_of_a_cylinder(radius):
    length, alpha = 1.5 * np.pi * radius, 3.0
    exact = alpha * (np.pi**2 / length**2 - 1.0 / radius**2)
    certificates = [
        stationary(
            cylinder(2.0 * np.pi * radius / n, radius=radius, length=length, alpha=alpha, exact=True)
        ).certificate
        for n in (12, 24, 48)
    ]
    assert [c.index for c in certificates] == [1, 1, 1]
    error = np.array([c.eigenvalues[0] for c in certificates]) - exact
    assert orders(error) == pytest.approx(2.0, abs=0.25)


@pytest.mark.parametrize(("turns", "index"), [(0.75, 0), (1.25, 1), (1.9, 1), (2.1, 2), (3.1, 3)])
def test_a_cylinder_loses_a_way_of_being_stable_at_each_half_wave(turns, index):
    """Under given pressure at L = π r, 2 π r, …; at given volume the first of these does not count,
    and Plateau and Rayleigh's limit 2 π r is where the index goes from 1 to 2.
    """
    result = stationary(cylinder(np.pi / 12.0, length=turns * np.pi, exact=True))
    assert result.certificate.index == cylinder_exact(length=turns * np.pi).index == index
    assert result.certificate.verdict is (Verdict.SADDLE if index else Verdict.STABLE)


@pytest.mark.parametrize("length", [2.0, 4.0, 7.0])
def test_the_index_of_a_meridian_is_the_cylinder_s(length):
    (meridian,) = cylinder_exact(length=length).shapes.values()
    assert meridian.index(1.0) == cylinder_exact(length=length).index


# ---- a drop on the ground: its tension there is -α cos θ, θ the angle at which it meets the ground ---


def drop(rings, angle, volume=1.0):
    """A drop of tension 1 that wets the plane, from a hemisphere; the wetted disc is a patch, too."""
    cap = hemisphere(np.pi / rings, exact=True)
    inner, (x, y, z) = ~cap.on_plane, 0.5 * cap.vertices.T
    share = np.arctan2(np.hypot(x, y), z) / np.maximum(np.hypot(x, y), 1e-9)
    wet = np.stack([share * x, share * y, 0.0 * z], axis=1)[inner] * 2.0 / np.pi
    other = np.where(inner, cap.n - 1 + np.cumsum(inner), np.arange(cap.n))
    X, F = np.concatenate([np.stack([x, y, z], axis=1), wet]), np.concatenate([cap.faces, other[cap.faces]])
    patches = [Patch("drop", 1.0), Patch("ground", -np.cos(angle), pressure=0.0)]
    rooms = [Room("drop", {"drop": 1}, volume)]
    return Surface(X, F, np.repeat([0, 1], cap.m), patches, on_plane=np.unique(other), rooms=rooms)


def test_a_drop_on_the_ground_meets_it_at_young_s_angle():
    angle = np.radians(120.0)
    radius = np.cbrt(3.0 / (np.pi * (2.0 + np.cos(angle)) * (1.0 - np.cos(angle)) ** 2))
    exact = np.array([radius * (1.0 - np.cos(angle)), radius * np.sin(angle), 2.0 / radius])

    def errors(rings, order=1):
        result = solve(drop(rings, angle), order=order)
        assert result.converged
        assert result.certificate.index == 0
        assert result.certificate.junctions["sum_alpha_n_max"][0] < 1.5 / rings  # the plane has sin θ
        X, rim = result.surface.vertices, result.surface.topology.edges[result.surface.topology.seam_edge]
        wet = np.hypot(*(X[np.unique(rim)] - X[rim].mean(axis=(0, 1)))[:, :2].T).max()
        return np.abs([X[:, 2].max(), wet, result.rooms["pressure"][0]] - exact)

    coarse, fine = errors(4), errors(8)
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.25)
    assert (errors(4, order=2) < 0.05 * coarse).all()


# ---- Delaunay's surfaces ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("waviness", "centre", "reach", "around"),
    [(0.4, "bulge", 1.2, 13), (0.4, "neck", 0.6, 13), (1.5, "bulge", 1.2, 23)],
    ids=["bulge", "neck", "nodoid"],
)
def test_unduloids_and_nodoids(waviness, centre, reach, around):
    shape = {"waviness": waviness, "centre": centre, "reach": reach}
    exact = delaunay_exact(**shape)
    (meridian,) = exact.shapes.values()
    away, force = [], []
    for length in edges(exact, around):
        result = stationary(delaunay(length, **shape))
        assert result.certificate.verdict is Verdict.STABLE
        assert exact.index == 0
        away.append(exact.distance(result.surface).max())
        ends = result.certificate.boundaries["reaction_z"].to_numpy()
        assert ends.sum() == pytest.approx(0.0, abs=1e-12)
        force.append(ends.max() - np.pi * meridian.r[0] ** 2 - delaunay_force(waviness=waviness))
    assert orders(away) == pytest.approx(2.0, abs=0.35)
    assert orders(force)[-1] == pytest.approx(2.0, abs=0.25)


@pytest.mark.parametrize("waviness", [0.2, 0.4])
def test_unduloids_turn_unstable_at_their_conjugate_point(waviness):
    limit = delaunay_limit(waviness=waviness)
    for reach, index in ((limit - 0.15, 0), (limit + 0.15, 1)):
        shape = {"waviness": waviness, "centre": "neck", "reach": reach}
        assert delaunay_exact(**shape).index == index
        assert stationary(delaunay(0.25, **shape)).certificate.index == index


def test_the_conjugate_point_of_the_thinnest_waves_is_that_of_the_cylinder():
    assert delaunay_limit(waviness=1e-3) == pytest.approx(0.5 * np.pi, abs=2e-3)


def test_unduloids_leave_the_cylinder_at_the_length_pi():
    waves = np.array([0.02, 0.01])
    bend = [unduloid_length(B) - np.pi - B for B in waves]
    assert bend[0] / bend[1] == pytest.approx(4.0, abs=0.1)


# ---- catenoids between rings of radius 1: c cosh(h/c) = 1 ---------------------------------------


@pytest.mark.parametrize(("deep", "verdict"), [(False, Verdict.STABLE), (True, Verdict.SADDLE)])
def test_catenoids(deep, verdict):
    shape = {"half_distance": 0.6, "deep": deep}
    exact, c = catenoid_exact(**shape), catenoid_neck(**shape)
    around = 29 if deep else 49
    assert exact.area == pytest.approx(np.pi * c**2 * (1.2 / c + np.sinh(1.2 / c)), rel=1e-10)
    away, area, pull = [], [], []
    for length in edges(exact, around):
        result = stationary(catenoid(length, **shape))
        assert result.certificate.verdict is verdict
        assert result.certificate.index == exact.index == int(deep)
        away.append(exact.distance(result.surface).max())
        area.append(result.energy - exact.energy)
        pull.append(result.certificate.boundaries["reaction_z"].max() - 2.0 * np.pi * c)
    for errors in (away, area, pull):
        assert orders(errors) == pytest.approx(2.0, abs=0.35)


def test_the_widest_catenoid():
    assert catenoid_fold() == pytest.approx(0.6627434193491816, abs=1e-15)
    near, far = 0.98 * catenoid_fold(), 1.03 * catenoid_fold()
    assert solve(catenoid(0.2, half_distance=near)).certificate.verdict is Verdict.STABLE
    apart = catenoid(0.2, half_distance=near)
    assert not solve(apart.moved(apart.vertices * [1.0, 1.0, far / near])).converged


def test_a_film_meets_the_plane_at_a_right_angle():
    """Half a catenoid, its neck free on Π: the same neck as that of the whole one."""
    c, error = catenoid_neck(), []
    for length in edges(catenoid_exact(), 41):
        result = solve(catenoid(length, half=True))
        assert result.certificate.verdict is Verdict.STABLE
        error.append(radii(result.surface)[result.surface.on_plane].mean() - c)
    assert orders(error)[-1] == pytest.approx(2.0, abs=0.25)


# ---- bubbles and lenses -------------------------------------------------------------------------


def test_a_bubble_on_the_plane_is_a_hemisphere():
    """Free to slide: modes α (l (l + 1) - 2) / R² with l + m even, the two translations left out."""
    size, lowest, lift = [], [], []
    for rings in (4, 8, 16):
        result = stationary(hemisphere(np.pi / rings))
        certificate = certify(result.surface, modes=4)
        assert certificate.verdict is Verdict.SADDLE
        assert certificate.index == hemisphere_exact().index == 1
        Y, rim = result.surface.vertices, result.surface.on_plane
        size.append(np.linalg.norm(Y - Y[rim].mean(axis=0), axis=1).max() - 2.0)
        lowest.append(certificate.eigenvalues - [-0.5, 1.0, 1.0, 1.0])
        lift.append(certificate.support + 4.0 * np.pi)  # the load on its circle
    assert orders(size) == pytest.approx(2.0, abs=0.2)
    assert orders(lift) == pytest.approx(2.0, abs=0.2)
    assert orders(np.array(lowest)) == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize("tensions", [(1.0, 1.3, 1.8), (1.0, 1.0, 1.0)], ids=["unequal", "120°"])
def test_a_lens_in_a_film_keeps_young_s_law(tensions):
    alphas = dict(zip(("alpha_top", "alpha_bottom", "alpha_film"), tensions, strict=True))
    circle, error, away = lens_circle(**alphas), [], []
    for rings in (3, 6, 12):
        start = lens(np.pi * circle / (3.0 * rings), **alphas)
        (junction,) = start.topology.junctions
        result = stationary(start)
        assert result.certificate.index == 1  # it grows or shrinks
        error.append(radii(result.surface)[junction.vertices].mean() - circle)
        away.append(lens_exact(**alphas).distance(result.surface).max())
    assert orders(error) == pytest.approx(2.0, abs=0.2)
    assert orders(away)[-1] == pytest.approx(2.0, abs=0.35)


# ---- films without pressure ---------------------------------------------------------------------


@pytest.mark.parametrize("n", [1, 2, 4])
def test_the_soap_film_of_a_tetrahedron_is_flat(n):
    start, exact = tetrahedral_film(1.0 / n), tetrahedral_film_exact()
    middle = int(np.linalg.norm(start.vertices, axis=1).argmin())
    assert sum(middle in curve.vertices for curve in start.topology.junctions) == 4
    result = solve(start)
    assert result.certificate.verdict is Verdict.STABLE
    assert result.surface.vertices[middle] == pytest.approx(0.0, abs=1e-12)
    assert exact.distance(result.surface).max() < 1e-12
    assert result.energy == pytest.approx(exact.energy, rel=1e-13)


def test_schwarz_s_surface_in_four_edges_of_a_tetrahedron():
    exact = skew_quadrilateral_exact()
    assert exact.area == pytest.approx(0.6396307855855, abs=5e-14)
    results = [stationary(skew_quadrilateral(h)) for h in (0.1, 0.05, 0.025)]
    assert [r.certificate.verdict for r in results] == [Verdict.STABLE] * 3
    assert orders(np.array([r.energy for r in results]) - exact.energy) == pytest.approx(2.0, abs=0.1)
    assert orders([exact.distance(r.surface).max() for r in results]) == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("radius", [0.8, 1.3])
def test_enneper_s_surface_is_found_and_unstable_beyond_its_hemisphere(radius):
    exact = enneper_exact(radius=radius)
    assert exact.area == pytest.approx(np.pi * (radius**2 + radius**4 + radius**6 / 3.0))
    results = [stationary(enneper(h, radius=radius)) for h in (0.2, 0.1, 0.05)]
    assert [r.certificate.index for r in results] == [exact.index] * 3
    assert exact.index == int(radius > 1.0)
    assert orders(np.array([r.energy for r in results]) - exact.energy)[-1] == pytest.approx(2.0, abs=0.3)
    assert orders([exact.distance(r.surface).max() for r in results])[-1] == pytest.approx(2.0, abs=0.35)


# ---- caps: the upper one, the limit of great tension, and how they vibrate ----------------------


def test_the_upper_cap_is_a_saddle():
    exact = spherical_cap_exact(upper=True)
    assert exact.height == pytest.approx(1.2 + np.sqrt(0.44))
    results = [stationary(spherical_cap(h, upper=True, exact=True)) for h in (0.2, 0.1, 0.05)]
    assert [r.certificate.index for r in results] == [exact.index] * 3 == [1, 1, 1]
    assert orders(np.array([r.energy for r in results]) - exact.energy) == pytest.approx(2.0, abs=0.2)


def test_a_tense_roof_over_an_ellipse_solves_poisson_s_equation():
    """α Δu = -1 over x²/a² + y²/b² ≤ 1: u = a² b² / 2 α (a² + b²) at the top, volume π a b u / 2."""
    a, b, tension = 2.0, 1.0, 1e3
    top = a**2 * b**2 / (2.0 * tension * (a**2 + b**2))
    error, height = [], []
    for rings in (4, 8, 16):
        flat, faces = disc(rings)
        rim = np.isclose(np.hypot(*flat.T), 1.0)
        X = np.column_stack([flat * [a, b], 0.0 * rim])
        surface = solve(Surface(X, faces, [0] * len(faces), [Patch("roof", tension)], fixed=rim)).surface
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
