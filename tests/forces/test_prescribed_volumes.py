"""Rooms of prescribed volume: their volumes, what is refused, and solving."""

from dataclasses import replace

import numpy as np
import pytest
from convergence import orders
from nightly import at_night
from refusals import refused
from shapes import octahedron, pyramid
from volume_cases import cap, cap_height, raised

import generators
import pcmc
from generators.grid import cut_squares
from pcmc import Direction, Patch, Plane, Room, Surface, Target
from pcmc.base.errors import FreeSurfaceWarning, OptionError, SurfaceError
from pcmc.design import Parameter, meet, sensitivities
from pcmc.forces.functional import energy_and_gradient
from pcmc.forces.rooms import (
    prescribed_volumes,
    room_pressures,
    room_volume_gradients,
    room_volumes,
    with_room_pressures,
)
from pcmc.plan import Divider, Plan
from pcmc.stability.equilibrium import Equilibrium
from pcmc.surface.symmetry import mirrored


def arch() -> Surface:
    """A quarter of a cube's shell: a roof and one side on Π, open along a fixed arch."""
    X = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 1], [2, 0, 1]]
    F = [[2, 3, 4], [2, 4, 5], [3, 0, 4], [1, 2, 5]]
    return Surface(
        X, F, [0] * 4, [Patch("roof", 1.0)], [0, 1, 2, 3, 4, 5], rooms=[Room("r", {"roof": 1}, 1.0)]
    )


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


def test_a_rim_closes_alike_however_its_straight_edges_are_divided():
    corners = np.array([[0, 0, 1], [0.5, 0, 2], [1, 0, 1], [1, 1, 1], [0, 1, 1.0]])  # a gable on one side
    volumes = []
    for n in (1, 4):
        sides = [a + (b - a) * np.arange(k)[:, None] / k for a, b, k in zip(corners, np.roll(corners, -1, 0),
                 (n, n, 1, 1, 1), strict=True)]  # fmt: skip
        X = np.concatenate([*sides, [[0.5, 0.5, 2.5]]])
        rim = np.arange(len(X) - 1)
        F = np.stack([rim, np.roll(rim, -1), np.full(len(rim), len(rim))], axis=1)
        tent = Surface(X, F, [0] * len(F), [Patch("tent", 1.0)], rim, rooms=[Room("r", {"tent": 1}, 1.0)])
        volumes.append(room_volumes(tent)[0])
    assert volumes[1] == pytest.approx(volumes[0])


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
    assert orders(second) == pytest.approx(2.0, abs=0.1)
    assert orders(third) == pytest.approx(3.0, abs=0.1)


def test_taylor_slopes_of_a_volume():
    surface = cap(1.0)
    d = np.random.default_rng(1).normal(size=surface.vertices.shape) * surface.free[:, None]
    slope = (room_volume_gradients(surface)[0] * d).sum()
    steps = 0.1 * 0.5 ** np.arange(5)
    values = np.array([room_volumes(surface.moved(surface.vertices + t * d))[0] for t in steps])
    errors = values - room_volumes(surface)[0] - steps * slope
    assert orders(errors) == pytest.approx(2.0, abs=0.1)


def test_rooms_that_do_not_close_are_refused():
    bubbles = generators.double_bubble(0.8)
    with refused(SurfaceError, what="rooms", where="left") as caught:
        pcmc.solve(replace(bubbles, rooms=[Room("left", {"left": 1}, 1.0)]))
    assert "does not close" in str(caught.value)
    assert "near (0" in str(caught.value)
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
    F = cut_squares(number, np.ones((n, n), dtype=bool))
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


@pytest.mark.parametrize("volume", [0.3, *at_night(1.0), 2.0, *at_night(3.0), 8.0])
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
    assert orders(heights)[-1] == pytest.approx(2.0, abs=0.3)
    assert orders(pressures)[-1] == pytest.approx(2.0, abs=0.3)
    # the same surface under the pressure reached, without the condition, has the known index
    free = replace(result.surface, rooms=())
    assert Equilibrium.of(free).factorised().negative == (0 if volume < 2.09 else 1)


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


@pytest.mark.parametrize("times", [1e-3, 1e3])
def test_bubbles_that_nothing_holds_come_to_rest_from_any_size(times):
    one = generators.double_bubble(volumes=(1.0, 1.0))
    other = one.retensioned(volumes={"left": times, "right": times})
    energy = pcmc.solve(one).energy
    assert pcmc.solve(other).energy / times ** (2 / 3) == pytest.approx(energy, rel=4e-3)


def test_a_volume_too_far_from_that_of_the_start_is_reached_in_steps():
    start = cap(0.5)
    far = pcmc.solve(start.retensioned(volumes={"room": 300.0}))
    assert "go there in steps of 3 times the volume or so, each from the surface before" in str(far)
    for volume in (1.5, 4.5, 13.5, 40.5, 120.0, 300.0):
        result = pcmc.solve(start.retensioned(volumes={"room": volume}))
        start = result.surface
    assert result.converged


def test_the_pressure_of_a_room_beside_one_of_given_pressure_is_that_on_its_roof():
    patches = {"west": {"tension": 5.0, "volume": 40.0}, "east": {"tension": 4.5}}
    walls = [Divider([[6, 0], [6, 8]], wall=1.5)]
    plan = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], walls, edge_length=1.5, patches=patches)
    result = pcmc.solve(plan.surface())
    assert result.surface.pressures[2] == pytest.approx(result.surface.pressures[0] - 1.0)  # the wall
    assert result.certificate.rooms.pressure[0] == pytest.approx(result.surface.pressures[0], rel=1e-12)
    design = meet(result.surface, Target("pressure", "west", 1.5), Parameter("west", "volume"))
    assert design.surface.pressures[0] == pytest.approx(1.5, rel=1e-6)


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
