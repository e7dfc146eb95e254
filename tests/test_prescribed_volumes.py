"""Rooms of prescribed volume: their pressures are results, and motions keep their volumes."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from shapes import octahedron, pyramid

import generators
import pcmc
from pcmc import Direction, Line, Patch, Plane, Room, Surface, Target
from pcmc.base.errors import FreeSurfaceWarning, LostWarning, OptionError, SurfaceError
from pcmc.design import Parameter, meet, sensitivities
from pcmc.design.targets import measure
from pcmc.energy.functional import energy_and_gradient, patch_areas
from pcmc.energy.rooms import (
    prescribed_volumes,
    room_pressures,
    room_volume_gradients,
    room_volumes,
    with_room_pressures,
)
from pcmc.meshing.local_refinement import refine_faces
from pcmc.meshing.refinement import refine
from pcmc.stability.modes import lowest, morse_index, second_variation
from pcmc.surface.mirroring import mirrored
from studies import evolver

DOUBLE, TRIPLE = 9.139421678069, 13.128168244433  # least areas around volumes of 1


def cap(volume: float, edge_length: float = 0.25, **arguments) -> Surface:
    """A cap over the unit disc, with its volume prescribed."""
    surface = generators.spherical_cap(edge_length, **arguments)
    return replace(surface, rooms=[Room("room", {"cap": 1}, volume)])


def cap_height(volume: float) -> float:
    """h of the cap over the unit disc: V = π h (3 + h²) / 6."""
    return float(np.roots([1.0, 0.0, 3.0, -6.0 * volume / np.pi]).real.max())


def raised(height: float = 0.5) -> Surface:
    """A pyramid over a square whose fixed boundary lies at a height over Π."""
    roof = pyramid(rooms=[Room("room", {"roof": 1}, 2.0)])
    return replace(roof, vertices=roof.vertices + height * np.eye(3)[2])


def arch() -> Surface:
    """A quarter of a cube's shell: a roof and one side on Π, open along a fixed arch."""
    X = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 1], [2, 0, 1]]
    F = [[2, 3, 4], [2, 4, 5], [3, 0, 4], [1, 2, 5]]
    return Surface(
        X, F, [0] * 4, [Patch("roof", 1.0)], [0, 1, 2, 3, 4, 5], rooms=[Room("r", {"roof": 1}, 1.0)]
    )


def order(errors) -> np.ndarray:
    """Observed orders on meshes of halved edges."""
    errors = np.abs(errors)
    return np.log2(errors[:-1] / errors[1:])


# ---- volumes -------------------------------------------------------------------------------------


def test_volumes_are_those_enclosed():
    assert room_volumes(pyramid(rooms=[Room("r", {"roof": 1}, 1.0)])) == pytest.approx(4 / 3)
    for height in (0.0, 0.5, -0.3):  # a flat fan over the boundary
        assert room_volumes(raised(height)) == pytest.approx(4 / 3)
    ball = octahedron(fixed=[0])
    assert room_volumes(replace(ball, rooms=[Room("r", {"bubble": 1}, 1.0)])) == pytest.approx(4 / 3)
    assert room_volumes(arch()) == pytest.approx(1.0)  # half of a box of 2: the arch is closed flat down to Π
    bubbles = generators.triple_bubble(0.4, exact=True)
    assert room_volumes(bubbles) == pytest.approx([room_volumes(bubbles)[0]] * 3)
    assert room_volumes(bubbles).sum() == pytest.approx(pcmc.certify(bubbles).volume)


def test_volumes_do_not_depend_on_where_the_surface_is():
    far = Plane((1e6, 2e6, 0.0))
    for surface in (raised(), arch(), cap(1.0)):
        moved = Surface(surface.vertices + far.point, surface.faces, surface.patch_of_face, surface.patches,
                        surface.fixed, plane=far, rooms=surface.rooms)  # fmt: skip
        assert room_volumes(moved) == pytest.approx(room_volumes(surface), rel=1e-8)
        assert room_volumes(replace(moved, plane=Plane())) == pytest.approx(room_volumes(surface), rel=1e-8)


def test_taylor_slopes_of_the_lagrangian():
    bubbles = generators.double_bubble(0.8, volumes=(1.0, 0.7))
    d = np.sin(3.0 * bubbles.vertices[:, [1, 2, 0]] + 0.5)
    change = np.array([0.7, -0.4])

    def lagrangian(t):
        there = with_room_pressures(bubbles, t * change)
        X = bubbles.vertices + t * d
        value, slope = energy_and_gradient(there, X)
        moved = there.moved(X)
        delta = room_pressures(moved) - room_pressures(bubbles)
        by_pressure = prescribed_volumes(moved) - room_volumes(moved)
        return value + delta @ prescribed_volumes(moved), (slope * d).sum() + by_pressure @ change

    steps = 0.02 * 0.5 ** np.arange(4)
    value, slope = lagrangian(0.0)
    second = [abs(lagrangian(t)[0] - value - t * slope) for t in steps]
    third = [abs(lagrangian(t)[0] - value - 0.5 * t * (slope + lagrangian(t)[1])) for t in steps]
    assert order(second) == pytest.approx(2.0, abs=0.1)
    assert order(third) == pytest.approx(3.0, abs=0.1)


def test_taylor_slopes_of_a_volume():
    surface = cap(1.0)
    d = np.random.default_rng(1).normal(size=surface.vertices.shape) * surface.free[:, None]
    slope = (room_volume_gradients(surface)[0] * d).sum()
    steps = 0.1 * 0.5 ** np.arange(5)
    values = np.array([room_volumes(surface.moved(surface.vertices + t * d))[0] for t in steps])
    errors = values - room_volumes(surface)[0] - steps * slope
    assert order(errors) == pytest.approx(2.0, abs=0.1)


# ---- refused -------------------------------------------------------------------------------------


def test_rooms_that_do_not_close_are_refused():
    bubbles = generators.double_bubble(0.8)
    with refused(SurfaceError, what="rooms", where="left") as caught:
        pcmc.solve(replace(bubbles, rooms=[Room("left", {"left": 1}, 1.0)]))
    assert "does not close" in str(caught.value)
    assert "near [0.0" in str(caught.value)
    with refused(SurfaceError, what="rooms", where="left"):  # the wall's normal points out of the left one
        room_volumes(replace(bubbles, rooms=[Room("left", {"left": 1, "wall": -1}, 1.0)]))
    roof = raised()
    with refused(SurfaceError, what="rooms", where="room", found=[1, 2]):
        room_volumes(replace(roof, fixed=[0, 1, 3]))
    arched = arch()  # its arch ends free in the air
    with refused(SurfaceError, what="rooms", where="r"):
        room_volumes(replace(arched, fixed=[0, 2, 3, 4, 5]))


def test_a_fixed_boundary_must_not_end_on_a_plane_above_the_ground():
    X, F = [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], [[0, 1, 2], [0, 2, 3]]
    front = {Plane(normal=(0, 1, 0), mirror=True): [0, 1]}
    rooms = [Room("r", {"roof": 1}, 1.0)]
    square = Surface(X, F, [0, 0], [Patch("roof", 1.0)], range(4), on_planes=front, rooms=rooms)
    with refused(SurfaceError, what="rooms", where="r", found=[0.0, 0.0, 1.0]) as caught:
        room_volumes(square)
    assert "plane=" in str(caught.value)
    assert room_volumes(replace(square, plane=Plane((0, 0, 1)))) == pytest.approx(0.0)


def test_a_piece_between_mirror_planes_has_its_share_of_the_volume():
    n = 6
    t = np.linspace(0.0, 1.0, n + 1)
    x, y = np.meshgrid(t, t, indexing="ij")
    X = np.stack([x, y, 0.3 * (1.0 - x**2) * (1.0 - y**2)], axis=-1).reshape(-1, 3)
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    F = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    mirrors = {
        Plane(normal=(1, 0, 0), name="x", mirror=True): number[0],
        Plane(normal=(0, 1, 0), name="y", mirror=True): number[:, 0],
    }
    fixed = np.unique(np.append(number[-1], number[:, -1]))
    quarter = Surface(X, F, np.zeros(len(F), dtype=int), [Patch("roof", 1.0)], fixed, on_planes=mirrors,
                      rooms=[Room("r", {"roof": 1}, 0.4)])  # fmt: skip
    result = pcmc.solve(quarter)
    assert result.certificate.index == 0
    whole = mirrored(result.surface)
    assert [room.volume for room in whole.rooms] == [1.6]
    assert room_volumes(whole)[0] == pytest.approx(1.6, rel=1e-10)
    certificate = pcmc.certify(whole)
    assert certificate.residual < 1e-10
    assert certificate.index == 0


def test_impossible_volumes_are_refused():
    with pytest.warns(FreeSurfaceWarning):
        ball = octahedron(fixed=())
    with refused(SurfaceError, what="volume", where="r", found=-1.0):
        pcmc.solve(replace(ball, rooms=[Room("r", {"bubble": 1}, -1.0)]))
    with refused(SurfaceError, what="rooms", where="r", found=pytest.approx(-4 / 3)):
        pcmc.solve(replace(ball, rooms=[Room("r", {"bubble": -1}, 1.0)]))
    with refused(SurfaceError, what="volume", where="r", found=0.0):
        Room("r", {"bubble": 1}, 0.0)
    slack = replace(ball.retensioned({"bubble": 0.0}, {"bubble": 0.0}), rooms=[Room("r", {"bubble": 1}, 1.0)])
    with refused(SurfaceError, what="rooms", where="bubble"):
        pcmc.solve(slack)


def test_a_volume_that_no_motion_changes_is_refused():
    rigid = pyramid(fixed=range(5), rooms=[Room("room", {"roof": 1}, 1.0)])
    with refused(SurfaceError, what="rooms", where="room") as caught:
        pcmc.solve(rigid)
    assert "no motion changes its volume" in str(caught.value)
    assert pcmc.certify(rigid).verdict.name == "NOT_CONVERGED"


def test_a_volume_is_prescribed_once_and_around_patches_that_are_there():
    roof = pyramid()
    with refused(SurfaceError, what="rooms", where="again"):
        replace(roof, rooms=[Room("room", {"roof": 1}, 1.0), Room("again", {"roof": -1}, 2.0)])
    bubbles = generators.double_bubble(0.8, volumes=(1.0, 1.0))
    both = Room("both", {"left": 1, "right": 1}, 2.0)
    with refused(SurfaceError, what="rooms", where="both"):
        replace(bubbles, rooms=[*bubbles.rooms, both])
    with refused(OptionError, what="room 'room': patch", found="rof"):
        replace(roof, rooms=[Room("room", {"rof": 1}, 1.0)])


@pytest.mark.parametrize("method", ["nesterov", "lbfgs"])
def test_flows_of_first_order_refuse_rooms(method):
    with refused(OptionError, what="method", found=method, expected="newton") as caught:
        pcmc.solve(cap(1.0), method)
    assert "method='newton'" in str(caught.value)


def test_a_pressure_that_is_a_result_cannot_be_varied():
    at_rest = pcmc.solve(cap(1.0)).surface
    for act in (
        lambda: pcmc.follow(at_rest, Direction(pressures={"cap": 1.0}), 2.0),
        lambda: sensitivities(at_rest, Target("apex"), Parameter("cap", "pressure")),
        lambda: meet(at_rest, Target("apex", None, 1.0), Parameter("cap", "pressure")),
    ):
        with refused(OptionError, what="parameter", where="cap") as caught:
            act()
        assert "'room'" in str(caught.value)
    with refused(OptionError, what="room", found="rom"):
        pcmc.follow(at_rest, Direction(volumes={"rom": 1.0}), 2.0)
    motion = pcmc.BoundaryMotion(lambda _: at_rest.vertices[at_rest.fixed], start=1.0)
    with refused(OptionError, what="parameter", found="room"):
        pcmc.follow(at_rest, motion, 2.0)


# ---- at rest -------------------------------------------------------------------------------------


@pytest.mark.parametrize("volume", [0.3, 1.0, 2.0, 3.0, 8.0])
def test_caps_on_both_sides_of_the_hemisphere(volume):
    """The hemisphere has 2.09."""
    height = cap_height(volume)
    radius = (1.0 + height**2) / (2.0 * height)
    heights, pressures = [], []
    for edge_length in (0.4, 0.2, 0.1):
        result = pcmc.solve(cap(volume, edge_length, height=0.8 * height))
        assert result.converged
        assert room_volumes(result.surface)[0] == pytest.approx(volume, rel=1e-10)
        assert (result.certificate.verdict.name, result.certificate.index) == ("STABLE", 0)
        heights.append(result.surface.vertices[:, 2].max() - height)
        pressures.append(result.surface.pressures[0] - 1.2 / radius)
    assert order(heights)[-1] == pytest.approx(2.0, abs=0.3)
    assert order(pressures)[-1] == pytest.approx(2.0, abs=0.3)
    # the same surface under the pressure reached, without the condition, has the known index
    free = replace(result.surface, rooms=())
    assert morse_index(free) == (0 if volume < 2.09 else 1)


def test_the_volume_is_reached_from_far_away():
    for volume in (-0.4, 0.01, 30.0):
        result = pcmc.solve(cap(volume, 0.25, height=0.8))
        assert result.converged, result.message
        assert room_volumes(result.surface)[0] == pytest.approx(volume, rel=1e-9)
    bubbles = generators.double_bubble(0.5, volumes=(1.0, 1.0))
    noise = np.random.default_rng(1).normal(scale=0.01, size=bubbles.vertices.shape)
    result = pcmc.solve(bubbles.moved(0.3 * bubbles.vertices + noise))
    assert result.converged
    assert room_volumes(result.surface) == pytest.approx(1.0)


def test_the_result_shows_its_rooms():
    result = pcmc.solve(cap(1.0).retensioned(pressures={"cap": 0.2}))
    row = result.rooms.iloc[0]
    assert (row.room, row.prescribed) == ("room", 1.0)
    assert row.volume == pytest.approx(1.0, rel=1e-10)
    assert row.pressure == result.surface.pressures[0]
    assert row.change == pytest.approx(result.surface.pressures[0] - 0.2)
    assert result.energy == pytest.approx(pcmc.energy(result.surface), rel=1e-14)
    assert "prescribed" in str(result.certificate)
    off = pcmc.certify(result.surface.retensioned(volumes={"room": 1.1}))
    assert off.verdict.name == "NOT_CONVERGED"
    assert off.residual == pytest.approx(0.1 / 1.1, rel=1e-6)
    assert pcmc.solve(pyramid()).rooms.empty


def test_solved_by_a_second_start_is_as_good():
    """The pressures at the start do not matter, but for the walls that keep their differences."""
    low, high = (pcmc.solve(cap(1.0).retensioned(pressures={"cap": p})) for p in (0.01, 3.0))
    assert low.surface.pressures == pytest.approx(high.surface.pressures, rel=1e-3)
    assert low.rooms.change[0] > 0.0 > high.rooms.change[0]


@pytest.mark.parametrize(
    ("make", "area", "motions"),
    [
        (lambda h: generators.double_bubble(h, volumes=(1.0, 1.0)), DOUBLE, 5),
        (lambda h: generators.triple_bubble(h), TRIPLE, 6),
    ],
    ids=["two", "three"],
)
def test_bubbles_of_volume_1_that_nothing_holds(make, area, motions):
    errors = []
    for edge_length in (0.4, 0.2, 0.1):
        result = pcmc.solve(make(edge_length))
        assert result.converged
        assert room_volumes(result.surface) == pytest.approx(1.0, rel=1e-10)
        certificate = result.certificate
        assert (certificate.verdict.name, certificate.index) == ("NEUTRAL", 0)
        assert f"{motions} rigid motions" in certificate.detail
        assert certificate.eigenvalues[0] > 1.0
        assert certificate.curvature_error < 1e-6
        errors.append(patch_areas(result.surface).sum() - area)
    assert order(errors)[-1] == pytest.approx(2.0, abs=0.15)
    assert abs(errors[-1]) < 5e-3 * area
    with pytest.warns(FreeSurfaceWarning):  # without the condition the bubbles grow or shrink
        free = replace(result.surface, rooms=())
    assert morse_index(free) == len(result.surface.rooms)


def test_exact_areas():
    assert generators.triple_bubble_exact().area == pytest.approx(TRIPLE, abs=1e-11)
    assert 27 * np.pi / (9 * np.pi) ** (2 / 3) == pytest.approx(DOUBLE, abs=1e-11)
    large = generators.triple_bubble_exact(volume=8.0, alpha=3.0)
    assert large.area == pytest.approx(4.0 * TRIPLE)


def test_unequal_bubbles_balance():
    result = pcmc.solve(generators.double_bubble(0.25, volumes=(1.0, 0.3)))
    left, right, wall = result.surface.pressures
    assert wall == pytest.approx(left - right, rel=1e-12)
    assert right > left
    assert result.certificate.index == 0


def test_modes_keep_the_volume_and_are_those_of_the_dense_pencil():
    surface = pcmc.solve(generators.double_bubble(0.7, volumes=(1.0, 0.6))).surface
    system = second_variation(surface)
    values, modes = lowest(system, 3)
    Z = np.linalg.svd(system.excluded.T)[2][system.excluded.shape[1] :].T
    H, M = system.matrix.toarray(), np.diag(system.mass)
    root = np.linalg.cholesky(Z.T @ M @ Z)
    inverse = np.linalg.inv(root)
    dense = np.linalg.eigvalsh(inverse @ (Z.T @ H @ Z) @ inverse.T)
    np.testing.assert_allclose(values, dense[:3], rtol=1e-8)
    assert system.negative == (dense < 0).sum() == 0
    growth = np.einsum("rnd,knd->rk", room_volume_gradients(surface), modes)
    assert np.abs(growth).max() < 1e-9


def connected_caps(volume: float) -> Surface:
    """Two caps over unit discs apart from each other, with one pressure and one volume together."""
    one = generators.spherical_cap(0.34, height=1.3)
    aside = 2.5 * np.eye(3)[0]
    X = np.concatenate([one.vertices - aside, one.vertices + aside])
    F = np.concatenate([one.faces, one.faces + one.n])
    patches = [Patch("left", 1.0), Patch("right", 1.0)]
    room = Room("both", {"left": 1, "right": 1}, volume)
    return Surface(X, F, np.repeat([0, 1], one.m), patches, np.tile(one.fixed, 2), rooms=[room])


def test_of_two_connected_bubbles_one_swallows_the_other():
    """Equal ones are a saddle beyond the hemisphere, whatever their volume together."""
    small, large = (pcmc.solve(connected_caps(volume), target="stationary") for volume in (3.0, 6.0))
    assert (small.certificate.index, large.certificate.index) == (0, 1)
    assert large.certificate.verdict.name == "SADDLE"
    mode = large.certificate.modes[0]
    assert abs((room_volume_gradients(large.surface)[0] * mode).sum()) < 1e-9
    result = pcmc.solve(large.surface)
    assert result.converged, result.message
    assert result.certificate.index == 0
    assert room_volumes(result.surface)[0] == pytest.approx(6.0, rel=1e-9)
    heights = [result.surface.vertices[part, 2].max() for part in np.split(np.arange(result.surface.n), 2)]
    assert min(heights) < 0.7 < 1.5 < max(heights)
    assert heights[0] * heights[1] == pytest.approx(1.0, rel=0.2)  # two caps of one sphere over one disc
    areas = [patch_areas(end.surface).sum() for end in (large, result)]
    assert areas[1] < areas[0]


def cylinder(edge_length: float, length: float, between: str) -> Surface:
    """A cylinder of the volume that it has, between fixed rings or plates that its ends slide on."""
    surface = generators.cylinder(edge_length, length=length, exact=True)
    rooms = [Room("inside", {"tube": 1}, 1.0)]
    if between == "rings":
        surface = replace(surface, rooms=rooms)
    else:
        lid = Plane((0.0, 0.0, length), (0.0, 0.0, 1.0), "lid")
        low, high = np.isclose(surface.vertices[:, 2], 0.0), np.isclose(surface.vertices[:, 2], length)
        mesh = surface.vertices, surface.faces, surface.patch_of_face, surface.patches
        surface = Surface(*mesh, on_plane=low, on_planes={lid: high}, rooms=rooms)
    return surface.retensioned(volumes={"inside": room_volumes(surface)[0]})


@pytest.mark.parametrize(("between", "limit"), [("rings", 2.0 * np.pi), ("plates", np.pi)])
def test_a_cylinder_of_prescribed_volume_is_stable_up_to_a_length(between, limit):
    """Plateau's limit 2πR between rings, πR between plates; under a given pressure both are half of that."""

    def softest(length: float, edge_length: float) -> float:
        certificate = pcmc.solve(cylinder(edge_length, length, between), target="stationary").certificate
        assert (certificate.index == 1) == (certificate.eigenvalues[0] < 0.0)
        return float(certificate.eigenvalues[0])

    span = 0.95 * limit, 1.01 * limit
    errors = [brentq(softest, *span, args=(h,), xtol=1e-4) - limit for h in (0.6, 0.3, 0.15)]
    assert order(errors) == pytest.approx(2.0, abs=0.25)
    assert abs(errors[-1]) < 0.0025 * limit


def test_volumes_between_planes_are_those_enclosed_and_their_gradients():
    surface = cylinder(0.5, 3.0, "plates")
    assert room_volumes(surface)[0] == pytest.approx(3.0 * np.pi, rel=0.03)
    d = np.sin(2.0 * surface.vertices[:, [1, 2, 0]] + 0.3) + 0.4 * surface.vertices
    d[~surface.free, 2] = 0.0
    slope = (room_volume_gradients(surface)[0] * d).sum()
    steps = 0.1 * 0.5 ** np.arange(4)
    values = np.array([room_volumes(surface.moved(surface.vertices + t * d))[0] for t in steps])
    errors = values - room_volumes(surface)[0] - steps * slope
    assert order(errors)[-1] == pytest.approx(2.0, abs=0.1)


def heavy_profile(volume: float, alpha: float, weight: float) -> tuple[float, float]:
    """Height and foot radius of a heavy bubble on Π, which meets Π at a right angle.

    E = ∫ σ(z) dA - p V with the effective tension σ = α + w z is stationary where p = σ (κ₁ + κ₂) + w n_z.
    From the apex down, with s along the profile and φ its slope, r' = cos φ, z' = -sin φ, n_z = cos φ, and

        φ' = (p - w cos φ) / σ(z) - sin φ / r,    φ' = (p - w) / 2σ at the apex, φ = π/2 on Π.
    """

    def ends(height: float, pressure: float):
        def rates(_, y):
            r, z, phi, _ = y
            sigma = alpha + weight * z
            bend = (pressure - weight * np.cos(phi)) / sigma
            other = np.sin(phi) / r if r > 1e-12 else 0.5 * bend
            return [np.cos(phi), -np.sin(phi), bend - other, np.pi * r**2 * np.sin(phi)]

        def upright(_, y):
            return y[2] - 0.5 * np.pi

        upright.terminal = True
        return solve_ivp(
            rates, (0.0, 10.0), [0.0, height, 0.0, 0.0], events=upright, rtol=1e-11, atol=1e-12
        ).y

    def misfit(unknown):
        y = ends(*unknown)
        return [y[1, -1], y[3, -1] - volume]

    radius = (1.5 * volume / np.pi) ** (1.0 / 3.0)
    height, pressure = fsolve(misfit, [0.9 * radius, 2.0 * alpha / radius], xtol=1e-12)
    return height, ends(height, pressure)[0, -1]


def test_the_profile_without_weight_is_the_half_ball():
    assert heavy_profile(2 * np.pi / 3, 1.0, 1e-12) == pytest.approx((1.0, 1.0), abs=1e-9)


def test_a_heavy_bubble_has_the_profile_of_its_weight():
    height, radius = heavy_profile(2 * np.pi / 3, 1.0, 1.5)
    assert height < 0.9 < 1.05 < radius
    heights, radii = [], []
    for edge_length in (0.4, 0.2, 0.1):
        half = generators.hemisphere(edge_length, alpha=0.5)
        bubble = half.retensioned({"bubble": 1.0}, weights={"bubble": 1.5})
        result = pcmc.solve(replace(bubble, rooms=[Room("inside", {"bubble": 1}, 2 * np.pi / 3)]))
        assert result.converged, result.message
        assert (result.certificate.verdict.name, result.certificate.index) == ("NEUTRAL", 0)
        X = result.surface.vertices
        foot = X[result.surface.on_plane]
        heights.append(X[:, 2].max() - height)
        radii.append(np.linalg.norm(foot - foot.mean(axis=0), axis=1).mean() - radius)
    assert order(heights)[-1] == pytest.approx(2.0, abs=0.3)
    assert order(radii)[-1] == pytest.approx(2.0, abs=0.3)
    assert max(abs(heights[-1]), abs(radii[-1])) < 0.01


# ---- continuation, sensitivities, targets ---------------------------------------------------------


def test_the_branch_goes_on_where_the_pressure_turns():
    start = pcmc.solve(cap(0.5)).surface
    branch = pcmc.follow(start, Direction(volumes={"room": 1.0}), 6.0, largest=0.3)
    assert branch.ending.name == "REACHED"
    assert not len(branch.events)
    points = branch.points
    assert (points["index"] == 0).all()
    assert points["volume room"].is_monotonic_increasing
    pressure = points["pressure room"]
    top = points.loc[pressure.idxmax()]
    assert top["volume room"] == pytest.approx(2 * np.pi / 3, rel=0.05)  # the hemisphere
    assert top["pressure room"] == pytest.approx(1.2, rel=0.03)
    assert pressure.iloc[-1] < 0.9 * top["pressure room"]
    again = pcmc.solve(branch.last)
    assert again.iterations <= 1
    assert room_volumes(branch.last)[0] == pytest.approx(6.0)
    # without the room the same branch turns there, in the tension
    turned = pcmc.follow(replace(start, rooms=()), Direction(pressures={"cap": 1.0}), folds=1)
    assert turned.folds.volume[0] == pytest.approx(2 * np.pi / 3, rel=0.05)


def test_the_branch_passes_the_flat_disc():
    start = pcmc.solve(cap(0.2)).surface
    branch = pcmc.follow(start, Direction(volumes={"room": 1.0}), -0.2, min_quality=0.3)
    assert branch.ending.name == "REACHED"
    np.testing.assert_allclose(branch.last.pressures, -start.pressures, rtol=1e-3)


def test_volumes_vary_together_with_tensions_up_to_an_energy():
    start = pcmc.solve(cap(0.5)).surface
    direction = Direction({"cap": 0.5}, relative=True, volumes={"room": 0.5})
    branch = pcmc.follow(start, direction, until={"energy": 2.0})
    assert branch.ending.name == "REACHED"
    assert pcmc.energy(branch.last) == pytest.approx(2.0, rel=1e-9)
    last = branch.points.iloc[-1]
    assert last["tension cap"] == pytest.approx(0.6 + 0.5 * last.parameter)
    assert last["volume room"] == pytest.approx(0.5 + 0.5 * last.parameter)


def test_a_small_mesh_has_all_its_modes():
    roof = pcmc.solve(pyramid(rooms=[Room("room", {"roof": 1}, 1.0)])).surface
    branch = pcmc.follow(roof, Direction(volumes={"room": 1.0}), 2.0)
    assert branch.last.vertices[4, 2] == pytest.approx(1.5)


def test_sensitivities_are_the_limits_of_differences():
    targets = [Target("apex"), Target("pressure", "room"), Target("curvature", "cap"), Target("area"),
               Target("volume"), Target("reaction")]  # fmt: skip
    surface = pcmc.solve(cap(1.5, 0.4)).surface
    table = sensitivities(surface, targets, ["cap", Parameter("room", "volume")])
    h = 1e-4

    def quantities(**changes):
        there = pcmc.solve(surface.retensioned(**changes), min_quality=0.0).surface
        return np.array([measure(there, target).value for target in targets])

    tension = quantities(tensions={"cap": 0.6 + h}) - quantities(tensions={"cap": 0.6 - h})
    volume = quantities(volumes={"room": 1.5 + h}) - quantities(volumes={"room": 1.5 - h})
    expected = np.stack([tension, volume], axis=1) / (2 * h)
    np.testing.assert_allclose(table.to_numpy(), expected, atol=1e-6)
    assert table.loc["volume", "volume of room"] == pytest.approx(1.0)
    # dA/dV = p / α at rest
    assert table.loc["area", "volume of room"] == pytest.approx(surface.pressures[0] / 0.6)


def test_a_pressure_is_met_by_a_volume():
    design = meet(pcmc.solve(cap(0.5)).surface, Target("pressure", "room", 1.0), Parameter("room", "volume"))
    assert design.met
    assert room_pressures(design.surface)[0] == pytest.approx(1.0, rel=1e-6)
    assert design.parameters.value.iloc[0] == design.surface.rooms[0].volume
    with refused(OptionError, what="room", found="attic"):
        measure(design.surface, Target("pressure", "attic"))
    with refused(OptionError, what="of", found=None):
        Target("pressure")


# ---- meshes and files ----------------------------------------------------------------------------


def test_meshes_made_from_a_surface_keep_its_rooms():
    surface = pcmc.solve(cap(1.0, 0.4)).surface
    fine = refine(surface)
    assert fine.rooms == surface.rooms
    assert refine_faces(surface, [0, 5]).rooms == surface.rooms
    result = pcmc.solve(surface, levels=1)
    assert result.converged
    assert result.surface.m == 4 * surface.m
    assert room_volumes(result.surface)[0] == pytest.approx(1.0, rel=1e-9)
    check = pcmc.check_mesh(surface)
    assert check.row("volume")["error"] == pytest.approx(0.0, abs=1e-8)


def test_a_remeshed_room_keeps_its_volume():
    pytest.importorskip("mmgpy")
    from pcmc.meshing.remeshing import remesh

    again = remesh(pcmc.solve(cap(1.0, 0.3)).surface, 0.2)
    assert room_volumes(pcmc.solve(again).surface)[0] == pytest.approx(1.0, rel=1e-9)


def test_sliding_along_a_line_off_the_plane_keeps_the_fan():
    X = [[0, 0, 1], [1, 0, 1], [2, 0, 1], [2, 2, 1], [0, 2, 1], [1, 1, 1.5]]
    F = [[0, 1, 5], [1, 2, 5], [2, 3, 5], [3, 4, 5], [4, 0, 5]]
    line = Line((0, 0, 1), (1, 0, 0))
    surface = Surface(X, F, [0] * 5, [Patch("roof", 1.0)], [0, 2, 3, 4], on_line={line: [1]},
                      rooms=[Room("r", {"roof": 1}, 1.0)])  # fmt: skip
    slid = surface.moved(surface.vertices + np.eye(3)[0] * 0.3 * (np.arange(6) == 1)[:, None])
    assert room_volumes(surface) == pytest.approx(2 / 3)
    assert room_volumes(slid) == pytest.approx(2 / 3)


@pytest.mark.parametrize("suffix", [".pcmc", ".fe"])
def test_files_carry_rooms(suffix, tmp_path):
    bubbles = generators.double_bubble(0.8, volumes=(1.0, 0.7))
    path = tmp_path / f"bubbles{suffix}"
    pcmc.write(path, bubbles)
    again = pcmc.read(path)
    assert again.rooms == bubbles.rooms
    np.testing.assert_allclose(again.pressures, bubbles.pressures, atol=1e-14)
    assert again.walls.tolist() == bubbles.walls.tolist()
    with pytest.warns(LostWarning, match="volumes of rooms"):
        pcmc.write(tmp_path / "bubbles.obj", bubbles)


@pytest.mark.skipif(not evolver.available(), reason="evolver is not installed")
@pytest.mark.parametrize("name", ["bubbles", "raised roof", "cap", "plates"])
def test_evolver_has_the_same_volumes_energy_and_gradient(name):
    bubbles = generators.double_bubble(0.8, volumes=(1.0, 0.7))
    surface = {
        "bubbles": bubbles,
        "raised roof": raised(),
        "cap": cap(1.0, 0.4),
        "plates": cylinder(0.6, 3.0, "plates"),
    }[name]
    out = evolver.run(surface, 'foreach body bb do printf "V %.17g %.17g\\n", bb.volume, bb.target')
    found = evolver.numbers(out, "V", 2)
    np.testing.assert_allclose(found[:, 0], room_volumes(surface), rtol=1e-12)
    np.testing.assert_allclose(found[:, 1], prescribed_volumes(surface), rtol=1e-12)
    # its energy leaves out the pressures of bodies whose volume is prescribed
    bare = with_room_pressures(surface, -room_pressures(surface))
    assert evolver.energy(surface) == pytest.approx(pcmc.energy(bare), rel=1e-12)
    forces = pcmc.gradient(bare)
    np.testing.assert_allclose(evolver.gradient(surface), forces, rtol=0, atol=1e-12 * abs(forces).max())


@pytest.mark.skipif(not evolver.available(), reason="evolver is not installed")
def test_evolver_stays_at_rest_where_we_do(tmp_path):
    surface = pcmc.solve(generators.double_bubble(0.6, volumes=(1.0, 0.7))).surface
    out = evolver.run(
        surface, 'hessian_normal on\nhessian\nforeach body bb do printf "P %.17g\\n", bb.pressure'
    )
    np.testing.assert_allclose(evolver.numbers(out, "P", 1)[:, 0], room_pressures(surface), rtol=1e-6)
    dump = tmp_path / "out.dmp"
    evolver.run(surface, f'dump "{dump}"')
    assert [room.volume for room in pcmc.read(dump).rooms] == [1.0, 0.7]
