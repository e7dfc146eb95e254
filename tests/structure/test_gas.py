"""Gas that gives way with its volume, and cushions: two sheets that enclose it."""

from dataclasses import replace

import numpy as np
import pytest
from nightly import at_night
from programs import needs_ccx
from refusals import refused
from scipy.linalg import eigh
from scipy.optimize import brentq
from starts import spherical_cap
from structures import model_of
from under_load import ALPHA, THICK, cap, parts, stiffness, strip

import pcmc
from pcmc import Material, Patch, Room, SelfWeight, Snow, Surface, Wind
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.base.units import Units
from pcmc.forces.rooms import room_volume_gradients
from pcmc.plan import Plan
from pcmc.stability.equilibrium import Equilibrium
from pcmc.structure import Gas, analyse
from pcmc.structure.section import Structure
from pcmc.surface.values import in_the_open


@pytest.mark.nightly
@needs_ccx
def test_enclosed_gas_gives_way_as_the_volume_does():
    """(p_a + p) V = const with ΔV = A w of the sphere: p falls by q κ / (1 + κ), κ = (p_a + p) A / (k V)."""
    young, suction, outside = 1e6, 0.2, 100.0
    material, loads = Material(young), [Wind({"cap": suction}, name="suction")]
    model = model_of(cap(), material=material, thickness=THICK, loads=loads, gas=Gas(ambient=outside))
    found = analyse(model)
    case, form = found["suction"], found.cases[0]
    assert (outside + case.pressure) * case.volume == pytest.approx((outside + 1.0) * form.volume, rel=1e-6)
    kappa = (outside + 1.0) * sphere_area() / (stiffness(young) * form.volume)
    assert 1.0 - case.pressure == pytest.approx(suction * kappa / (1.0 + kappa), rel=0.02)
    held = model_of(
        cap(), material=material, thickness=THICK, loads=[Wind({"cap": suction + case.pressure - 1.0})]
    )
    same = analyse(held)["wind"].results.deflections
    np.testing.assert_allclose(case.results.deflections, same, atol=1e-5 * same.max())


def test_a_cap_past_its_fold_is_held_by_the_gas():
    """V = π h (3 + h²) / 6 and p = 4 α h / (1 + h²): a saddle, as dp/dV < 0; but the gas's p falls faster.

    With the gas A is A + κ g gᵀ, κ = (p_a + p) / V, of index 0 where 1 + κ gᵀ A⁻¹ g < 0.
    """
    h = 2.0 * ALPHA + np.sqrt(4.0 * ALPHA**2 - 1.0)
    volume, slope = np.pi * h * (3.0 + h * h) / 6.0, np.pi * (1.0 + h * h) / 2.0
    exact = slope * (1.0 + h * h) ** 2 / (4.0 * ALPHA * (1.0 - h * h))  # dV/dp
    given = spherical_cap(0.15, alpha=ALPHA)
    large = pcmc.solve(given.rebuilt(rooms=[Room("dome", {"cap": 1}, volume)])).surface
    pressed = large.rebuilt(rooms=[])
    at = Equilibrium.of(pressed)
    second, g = at.factorised(), at.space.to_coordinates(room_volume_gradients(large, large.vertices)[0])
    assert second.negative == 1
    change = g @ second.solve(g)
    assert change == pytest.approx(exact, rel=0.01)
    kappa = Gas(ambient=0.0).pressure(pressed) / volume
    assert 1.0 + kappa * change < 0.0
    matrix, mass = second.matrix.toarray(), np.diag(at.mass)
    lowest = eigh(matrix + kappa * np.outer(g, g), mass, eigvals_only=True)[0]
    held = pcmc.certify(large)
    assert held.index == 0
    assert lowest == pytest.approx(held.eigenvalues[0], rel=0.01)  # it sways; the breathing mode is stiffer
    with refused(SurfaceError, found=pcmc.Verdict.SADDLE):
        model_of(pressed, gas=Gas(ambient=0.0))
    assert model_of(large, gas=Gas(ambient=0.0)).certificate.certified


def sphere_area():
    """Of the cap of height h = 2α - √(4α² - 1) on the unit circle: 4π α h."""
    return 4.0 * np.pi * ALPHA * (2.0 * ALPHA - np.sqrt(4.0 * ALPHA**2 - 1.0))


@needs_ccx
@pytest.mark.parametrize("outside", [0.0, *at_night(100.0)])
def test_p_v_is_constant_under_self_weight_and_down_to_no_pressure_outside(outside):
    """As under the same load as snow; without air outside, a soft cap does not turn inside out."""
    soft, loads = Material(2e3), [SelfWeight(gravity=1.0), Snow(0.5)]
    model = model_of(cap(0.4), material=replace(soft, density=980.0), thickness=THICK, loads=loads)
    table = analyse(replace(model, gas=Gas(ambient=outside))).table
    assert (table["volume"] > 0.0).all()
    assert table["pressure"].is_monotonic_increasing
    product = (outside + table["pressure"]) * table["volume"]
    assert product.to_numpy() == pytest.approx(product[0], rel=1e-3)  # in CalculiX the form moves a little


@needs_ccx
def test_a_factor_on_the_form_is_one_on_the_pressure_to_which_the_gas_is_filled():
    """Filled, the roof is as under that pressure without a gas; then p V stays what it is there."""
    outside, loads, material = 10.0, [Snow(0.2)], Material(2e4)
    model = model_of(cap(0.3), material=material, thickness=THICK, loads=loads, gas=Gas(ambient=outside))
    sums = {"filled": {"form": 1.5}, "uls": {"form": 1.5, "snow": 1.0}}
    found = analyse(replace(model, combinations=sums))
    open_air = analyse(replace(model, combinations={"filled": {"form": 1.5}}, gas=None))
    filled, case = found["filled"], found["uls"]
    assert filled.pressure == pytest.approx(1.5, abs=1e-5)
    same = open_air["filled"].results.deflections
    np.testing.assert_allclose(filled.results.deflections, same, atol=1e-5 * same.max())
    assert (outside + case.pressure) * case.volume == pytest.approx((outside + 1.5) * filled.volume, rel=1e-5)
    acting = [(Snow(0.2), Wind({"cap": case.pressure - 1.0}))]
    held = analyse(replace(model, loads=acting, gas=None)).cases[1]
    np.testing.assert_allclose(case.results.deflections, held.results.deflections, atol=1e-6)


def bay_of_a_cushion(n):
    """The barrel of ``strip`` and its mirror image below, held at the same edges."""
    bay = strip(n)
    below = np.where(bay.fixed, np.arange(bay.n), bay.n + np.cumsum(~bay.fixed) - 1)
    X = np.concatenate([bay.vertices, (bay.vertices * [1.0, 1.0, -1.0])[~bay.fixed]])
    planes = {plane: np.union1d(np.flatnonzero(on), below[np.flatnonzero(on)]) for plane, on in bay.on_planes}
    faces = np.concatenate([bay.faces, below[bay.faces][:, ::-1]])
    sheets = [Patch("top", 1.0), Patch("bottom", 1.0)]
    return Surface(X, faces, np.repeat([0, 1], bay.m), sheets, fixed=bay.fixed.nonzero()[0], on_planes=planes)


def cushion_under(q, D, outside):
    """The pressure of the gas, and the heights of both sheets of that cushion, under q on its upper sheet.

    A sheet is an arc of radius R and half angle θ over its chord, R sin θ = 1/√2, λ times its first length
    π/2; its tension (α + D (λ² - 1) / 2) λ is R times the pressure across it. R² (2θ - sin 2θ) / 2 is
    the area under it, and (p_a + p) V stays what it was."""
    chord = np.sin(np.pi / 4)

    def sheet(pressure):
        def excess(angle):
            stretch = 2.0 * angle * chord / np.sin(angle) / (np.pi / 2)
            return (1.0 + D * (stretch**2 - 1.0) / 2.0) * stretch - pressure * chord / np.sin(angle)

        angle = brentq(excess, 0.05, 1.5)
        radius = chord / np.sin(angle)
        return radius**2 * (2.0 * angle - np.sin(2.0 * angle)) / 2.0, radius * (1.0 - np.cos(angle))

    first = (outside + 1.0) * 2.0 * sheet(1.0)[0]
    p = brentq(lambda p: (outside + p) * (sheet(p - q)[0] + sheet(p)[0]) - first, q + 1e-3, 3.0)
    return p, sheet(p - q)[1], sheet(p)[1]


@needs_ccx
def test_a_cushion_with_gas_is_two_arcs():
    """Wind presses the upper sheet of a long cushion: pressure and both heights, to the second order."""
    young, q, outside, off = 2e4, 0.4, 20.0, []
    expected = cushion_under(q, young * THICK / (1.0 - 0.3**2), outside)
    for n in (10, 20):
        about = {"material": Material(young), "thickness": THICK, "gas": Gas(ambient=outside)}
        case = analyse(model_of(bay_of_a_cushion(n), loads=[Wind({"top": -q})], anyway=True, **about))["wind"]
        z = (case.results.model.surface.vertices + case.results.displacements)[:, 2]
        off.append([case.pressure - expected[0], z.max() - expected[1], -z.min() - expected[2]])
    assert expected[0] > 1.15
    np.testing.assert_allclose(off[-1], 0.0, atol=6e-4)
    assert np.log2(off[0][1] / off[1][1]) == pytest.approx(2.0, abs=0.1)


def test_snow_lies_on_the_upper_sheet_of_a_cushion():
    """And wind without named patches acts there: the lower sheet is under it."""
    cushion = Plan([[0, 0], [4, 0], [4, 3], [0, 3]], edge_length=0.5, tension=1.5, cushion=2.0).surface()
    large = cushion.moved(1000.0 * cushion.vertices)
    assert in_the_open(cushion).tolist() == in_the_open(large).tolist() == [True, False]
    step = model_of(cushion, loads=[Snow(0.5)], anyway=True).steps[1]
    assert step.forces.sum(axis=0) == pytest.approx([0.0, 0.0, -6.0])
    section = pcmc.project.Structure(young=1.0, thickness=1.0, zones=[{"case": "gust", "wind": 0.2}])
    assert section.loads_on(cushion)[0][0].pressures == {"patch 1": 0.2}
    assert in_the_open(parts()).all()


def test_the_file_says_that_it_keeps_the_pressure_of_a_gas(tmp_path):
    """Its steps alone are no answer of a roof that is shut in."""
    cushion = Plan([[0, 0], [4, 0], [4, 3], [0, 3]], edge_length=1.0, tension=1.5, cushion=2.0).surface()
    for gas, many in ((None, 0), (Gas(ambient=100.0), 1)):
        pcmc.write_structure(tmp_path / "cushion.inp", model_of(cushion, anyway=True, gas=gas))
        assert (tmp_path / "cushion.inp").read_text().count("keeps the pressure of the gas") == many


def test_snow_lies_on_every_strip_of_a_ridge_of_long_triangles():
    """The middles of neighbours are nearer than a triangle is long, and none is under another."""
    X = [[x, y, z] for y, z in enumerate([0, 1, 2, 1, 0]) for x in (0, 10, 20)]
    faces, patches = [], []
    for k in range(4):
        for a in (3 * k, 3 * k + 1):
            faces += [[a, a + 1, a + 4], [a, a + 4, a + 3]]
            patches += [k, k]
    ridge = Surface(X, faces, patches, [Patch(f"strip {k}", 1.0) for k in range(4)], fixed=range(15))
    assert in_the_open(ridge).all()


def test_a_sheet_under_two_others_is_under_them():
    """Each of the two covers half of the sheet."""
    X = [[x, y, z] for z in (1, 0) for y in (0, 2) for x in (0, 2, 4)]
    faces = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]]
    faces += [[a + 6 for a in face] for face in faces]
    patches = [Patch(name, 1.0) for name in ("west", "east", "ceiling")]
    roof = Surface(X, faces, [0, 0, 1, 1, 2, 2, 2, 2], patches, fixed=range(12))
    assert in_the_open(roof).tolist() == [True, True, False]
    assert roof.with_snow(0.5).snows.tolist() == [0.5, 0.5, 0.0]


def test_a_gas_has_the_pressure_of_the_air_outside_in_any_units():
    model = model_of(parts(), gas=Gas(volume=1.0), units=Units("mm", "N"), anyway=True)
    assert model.gas.outside(model.units) == pytest.approx(0.101325)
    uneven = parts().retensioned(pressures={"east": 2.0})
    with refused(OptionError, what="Gas.patches"):
        model_of(uneven, gas=Gas(ambient=100.0), anyway=True)
    with refused(OptionError, what="Gas.volume"):  # it is flat
        model_of(parts(), gas=Gas(ambient=100.0), anyway=True)


def test_gas_of_two_pressures_is_refused_before_the_work():
    """Before, the roof was solved first."""
    bays = {"west": {"tension": 6.0}, "east": {"tension": 5.0, "pressure": 0.9}}
    plan = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], [[[4, 0], [4, 4]]], edge_length=2.0, patches=bays)
    with refused(OptionError, what="Gas.patches") as caught:
        Structure(young=1e6, thickness=1e-3, gas=True).check(plan.surface(), plan)
    assert "it has one pressure, but 'east' has 0.9 and 'west' 1" in str(caught.value)
