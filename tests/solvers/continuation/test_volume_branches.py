"""Rooms of prescribed volume: branches, weight, sensitivities and targets."""

from dataclasses import replace

import numpy as np
import pytest
from convergence import orders
from refusals import refused
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve
from shapes import pyramid
from volume_cases import cap

import generators
import pcmc
from pcmc import Direction, Room, Target
from pcmc.base.errors import OptionError
from pcmc.design import Parameter, meet, sensitivities
from pcmc.design.targets import measure
from pcmc.forces.rooms import room_pressures, room_volumes


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
    assert orders(heights)[-1] == pytest.approx(2.0, abs=0.3)
    assert orders(radii)[-1] == pytest.approx(2.0, abs=0.3)
    assert max(abs(heights[-1]), abs(radii[-1])) < 0.01


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


def test_a_branch_ends_before_a_volume_of_0_which_no_room_can_have():
    start = pcmc.solve(cap(0.5)).surface
    branch = pcmc.follow(start, Direction(volumes={"room": 1.0}), 0.0, min_quality=0.3)
    assert branch.ending.name == "LOST"
    assert "a volume would be 0 at the parameter 0" in branch.message
    assert 0.0 < branch.points.parameter.iloc[-1] < 1e-3


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
               Target("volume"), Target("reaction per length")]  # fmt: skip
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
