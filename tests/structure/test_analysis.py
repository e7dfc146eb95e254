"""Cases and combinations under CalculiX, against closed forms; what is overloaded is answered."""

import doctest
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from printed import words_of
from refusals import refused
from scipy.integrate import solve_bvp
from scipy.optimize import brentq
from starts import spherical_cap
from structures import FABRIC, model_of, pyramid, square

import pcmc
from pcmc import Material, Patch, Plane, SelfWeight, Snow, Surface, Wind, cli
from pcmc.base.errors import OptionError
from pcmc.base.units import Units
from pcmc.plan import Plan
from pcmc.structure import Gas, analyse, analysis, calculix
from pcmc.structure.loads import in_the_open

needs_ccx = pytest.mark.skipif(not calculix.available(), reason="ccx is not installed")
ALPHA, THICK = 0.6, 1e-3  # of the cap with the radius 1.2 under the pressure 1


def disc(edge):
    """A flat film over the unit disc."""
    cap = spherical_cap(edge)
    flat = cap.moved(cap.vertices * [1.0, 1.0, 0.0])
    return flat.retensioned(tensions={"cap": 2.0}, pressures={"cap": 0.0})


@needs_ccx
def test_a_flat_membrane_sinks_as_a_paraboloid():
    """w = q (R² - r²) / 4T, to the second order in the edge; the load is small."""
    off = []
    for edge in (0.2, 0.1, 0.05):
        model = model_of(disc(edge), loads=[Snow(1e-3, patches=["cap"])], anyway=True)
        found = -analyse(model)["snow"].results.deflections
        x, y, _ = model.surface.vertices.T
        off.append(np.sqrt(np.mean((found / (1e-3 / 8.0) - (1.0 - x**2 - y**2)) ** 2)))
    assert np.polyfit(np.log([0.2, 0.1, 0.05]), np.log(off), 1)[0] == pytest.approx(2.0, abs=0.25)
    assert off[-1] < 2e-3


@needs_ccx
def test_the_example_of_analyse_prints_what_it_says():
    """Doctests leave it out, as they run where the program is missing, too."""
    example = analyse.__doc__.replace("# doctest: +SKIP", "")
    test = doctest.DocTestParser().get_doctest(example, dict(vars(analysis)), "analyse", None, 0)
    assert doctest.DocTestRunner(verbose=False).run(test).failed == 0


@cache
def cap(edge=0.05):
    return pcmc.solve(spherical_cap(edge, alpha=ALPHA)).surface


def stiffness(young, poisson=0.3):
    """Δp / w of a sphere of radius R = 2α under an even pressure: 2 E t / ((1 - ν) R²) - 2 α / R²."""
    return (2.0 * young * THICK / (1.0 - poisson) - 2.0 * ALPHA) / (2.0 * ALPHA) ** 2


@needs_ccx
def test_a_cap_under_more_pressure_grows_as_a_sphere():
    """Apart from a narrow ring at its rim, which may raise it as a whole, it is larger by w / R."""
    young = 1e6
    model = model_of(cap(), material=Material(young), thickness=THICK, loads=[Wind({"cap": 0.2})])
    found = analyse(model)["wind"].results
    X, inside = model.surface.vertices, np.linalg.norm(model.surface.vertices[:, :2], axis=1) < 0.5
    grown = (found.displacements * X)[inside, :2].sum() / (X[inside, :2] ** 2).sum()
    assert grown == pytest.approx(0.2 / stiffness(young) / (2.0 * ALPHA), rel=0.01)
    middle = np.linalg.norm(model.surface.vertices[model.surface.faces].mean(axis=1)[:, :2], axis=1) < 0.5
    np.testing.assert_allclose(found.principal_forces[middle], 1.2 * ALPHA, rtol=0.01)


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


def sphere_area():
    """Of the cap of height h = 2α - √(4α² - 1) on the unit circle: 4π α h."""
    return 4.0 * np.pi * ALPHA * (2.0 * ALPHA - np.sqrt(4.0 * ALPHA**2 - 1.0))


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


def strip(n=40):
    """A bay of a barrel between two mirror planes: an arc of 90° and radius 1 over y = 0 and 1/n."""
    angle = np.linspace(-np.pi / 4, np.pi / 4, n + 1)
    arc = np.column_stack([np.sin(angle), np.cos(angle) - np.cos(np.pi / 4)])
    width = 1.5 / n
    X = np.array([[x, y, z] for y in (0.0, width) for x, z in arc])
    low = np.arange(n)
    F = np.concatenate(
        [np.column_stack([low, low + 1, low + n + 2]), np.column_stack([low, low + n + 2, low + n + 1])]
    )
    planes = {Plane((0, y, 0), (0, 1, 0)): np.flatnonzero(X[:, 1] == y) for y in (0.0, width)}
    return Surface(
        X, F, np.zeros(2 * n, int), [Patch("bay", 1.0, 1.0)], fixed=[0, n, n + 1, 2 * n + 1], on_planes=planes
    )


def section(D, snow):
    """The sag of the crown of that barrel: a strip with force N = α + D (λ² - 1)/2 per length of its first
    state under the pressure 1 along its normal, and snow on its first plan."""

    def rates(s, y):  # x, z, and the force (H, V) in the strip, by the angle of the first state
        _, _, H, V = y
        force = np.hypot(H, V)
        stretch = 1.0 + (force - 1.0) / D
        for _ in range(20):  # (1 + D (λ² - 1)/2) λ = |force|
            g = (1.0 + D * (stretch**2 - 1.0) / 2.0) * stretch - force
            stretch = stretch - g / (1.0 + D * (3.0 * stretch**2 - 1.0) / 2.0)
        dx, dz = stretch * H / force, stretch * V / force
        return np.array([dx, dz, dz, snow * np.cos(s) - dx])

    def ends(a, b):
        at = np.sin(np.pi / 4)
        return np.array([a[0] + at, a[1], b[0] - at, b[1]])

    s = np.linspace(-np.pi / 4, np.pi / 4, 201)
    first = np.array([np.sin(s), np.cos(s) - np.cos(np.pi / 4), np.cos(s), -np.sin(s)])
    found = solve_bvp(rates, ends, s, first, tol=1e-8, max_nodes=20000)
    assert found.success
    return float(first[1, 100] - found.sol(0.0)[1])


@needs_ccx
def test_a_barrel_under_snow_follows_its_section():
    """A bay between mirror planes: deflection of the crown against the boundary value problem of a strip."""
    young, snow = 2e4, 0.4
    model = model_of(strip(), material=Material(young), thickness=THICK, loads=[Snow(snow)], anyway=True)
    found = analyse(model)["snow"]
    assert found.carried
    crown = -found.results.deflections[20]
    assert crown == pytest.approx(section(young * THICK / (1.0 - 0.3**2), snow), rel=0.01)
    assert crown > 0.01


@needs_ccx
def test_what_is_too_much_is_answered():
    """The share reached, the place, and a prestress that was tried; a remedy scales the carried load."""
    heavy = model_of(
        cap(0.1), material=Material(1e5), thickness=THICK, loads=[Snow(1.4), Snow(0.3, name="light")]
    )
    found = analyse(heavy)
    assert [case.carried for case in found.cases] == [True, False, True]
    assert 0.5 < found["snow"].share < 0.95
    assert found.remedy > 1.0
    assert analyse(analysis.prestressed(heavy, found.remedy)).carried
    assert found["light"].taut == 1.0
    taut = found["snow"].taut
    assert 0.0 < taut < found["snow"].share
    at_taut = analyse(replace(heavy, loads=[Snow(taut * 1.4)]))["snow"].results.principal_forces
    assert abs(np.nanmin(at_taut)) < 0.03 * ALPHA
    first, mesh, last = found.answers()
    assert mesh == analysis.MESH
    assert first.startswith(f"snow: {100 * found['snow'].share:.0f} % of its loads carried")
    assert "'cap'" in first
    assert last.startswith("tried: ")
    total = found["snow"].results.reactions.sum(axis=0)[2]
    at_share = np.pi * (found["snow"].share * 1.4 - 1.0)
    assert total == pytest.approx(at_share, rel=0.05)


@needs_ccx
def test_combinations_add_loads_with_their_factors():
    """On a film that answers in proportion the deflections add up, self-weight with its own factor."""
    loads = [SelfWeight(), Snow(1e-4, patches=["film"]), Wind({"film": 2e-4})]
    sums = {"uls": {"snow": 1.5, "wind": 0.5}, "light": {"self-weight": 0.0, "snow": 1.0}}
    found = analyse(model_of(square(8), loads=loads, combinations=sums, anyway=True, cable_area=1e-4))
    weight, snow, wind, uls, light = (case.results.deflections for case in found.cases[1:])
    scale = np.abs(weight).max()
    np.testing.assert_allclose(uls, weight + 1.5 * (snow - weight) + 0.5 * (wind - weight), atol=1e-3 * scale)
    np.testing.assert_allclose(light, snow - weight, atol=1e-3 * scale)
    assert list(found.table["case"]) == ["form pressure", "self-weight", "snow", "wind", "uls", "light"]


def test_each_triangle_of_cloth_is_written_with_its_own_warp(tmp_path):
    model = model_of(strip(), material=Material(2e4, 0.3, weft=8e3, shear=3e3), anyway=True)
    pcmc.write_structure(tmp_path / "strip.inp", model)
    text, warp = (tmp_path / "strip.inp").read_text(), {}
    for name, row in re.findall(r"^\*ORIENTATION, NAME=(\w+), .*\n(.*)$", text, re.M):
        elements = re.findall(r"\d+", re.search(rf"^\*ELSET, ELSET={name}\n([^*]*)", text, re.M)[1])
        warp |= {int(element): [float(x) for x in row.split(",")] for element in elements}
    wanted = model.warps(0).reshape(-1, 6)
    assert len(np.unique(wanted.round(9), axis=0)) > 1
    np.testing.assert_allclose([warp[k + 1] for k in model.faces], wanted, atol=1e-9)


@needs_ccx
@pytest.mark.parametrize(("warp", "young"), [((1.0, 0.0, 0.0), 2e4), ((0.0, 1.0, 0.0), 8e3)])
def test_cloth_is_as_stiff_along_the_arc_as_its_warp_or_weft(warp, young):
    """Between mirror planes D = E t / (1 - ν² E_weft / E_warp) with the modulus along the arc."""
    cloth = Material(2e4, 0.3, weft=8e3, shear=3e3, warp=warp)
    model = model_of(strip(), material=cloth, thickness=THICK, loads=[Snow(0.4)], anyway=True)
    along = model.warps(0)[:, 0]
    np.testing.assert_allclose(np.abs(along[:, 1]), warp[1], atol=1e-12)
    crown = -analyse(model)["snow"].results.deflections[20]
    assert crown == pytest.approx(section(young * THICK / (1.0 - 0.3**2 * 0.4), 0.4), rel=0.01)


def test_zones_carry_snow_and_wind():
    """Snow within a polygon, and on what is not steep."""
    flat = square(8)
    half = [(0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (0.0, 1.0)]
    _, zone = model_of(flat, loads=[Snow(0.3, ["film"], area=half)], anyway=True).steps
    assert zone.forces.sum(axis=0) == pytest.approx([0, 0, -0.15])
    triangle = [(0.0, 0.0), (0.9, 0.0), (0.0, 0.9)]
    _, zone = model_of(flat, loads=[Snow(0.3, ["film"], area=triangle)], anyway=True).steps
    inside = (flat.vertices[flat.faces].mean(axis=1)[:, :2].sum(axis=1) < 0.9).mean()
    assert zone.forces.sum(axis=0) == pytest.approx([0, 0, -0.3 * inside])
    roof = pyramid()  # its slope is 19.47°
    for wanted, slopes in ((4.0, (0, 20)), (4.0, (19, 90))):
        step = model_of(roof, loads=[Snow(1.0, slopes=slopes)]).steps[1]
        assert step.forces.sum(axis=0)[2] == pytest.approx(-wanted)
    angle = np.degrees(np.arctan(0.125**0.5 / 1.0))
    sliding = model_of(roof, loads=[Snow(1.0, slides=(0.0, 2.0 * angle))]).steps[1]
    assert sliding.forces.sum(axis=0)[2] == pytest.approx(-2.0)
    gust = model_of(flat, loads=[Wind({"film": 0.2}, area=half)], anyway=True)
    assert gust.nodal_loads(gust.steps[1]).sum(axis=0) == pytest.approx([0, 0, 0.1])


def test_snow_lies_on_the_upper_sheet_of_a_cushion():
    """And wind without named patches acts there: the lower sheet is under it."""
    cushion = Plan([[0, 0], [4, 0], [4, 3], [0, 3]], edge_length=0.5, tension=1.5, cushion=2.0).surface()
    large = cushion.moved(1000.0 * cushion.vertices)
    assert in_the_open(cushion).tolist() == in_the_open(large).tolist() == [True, False]
    step = model_of(cushion, loads=[Snow(0.5)], anyway=True).steps[1]
    assert step.forces.sum(axis=0) == pytest.approx([0.0, 0.0, -6.0])
    section = pcmc.project.Structure(young=1.0, thickness=1.0, zones=[{"case": "gust", "wind": 0.2}])
    assert section.loads_on(cushion)[0].pressures == {"patch 1": 0.2}
    assert in_the_open(parts()).all()


def parts():
    """Two flat films side by side."""
    both = square(2)
    patches = [Patch("west", 2.0, 1.0), Patch("east", 2.0, 1.0)]
    half = (both.vertices[both.faces].mean(axis=1)[:, 0] > 0.5).astype(int)
    return Surface(both.vertices, both.faces, half, patches, fixed=both.fixed)


def test_materials_by_patch_have_their_own_weight_and_stiffness(tmp_path):
    heavy, light = Material(1e6, density=0.2), Material(2e6, density=0.0)
    model = model_of(parts(), material={"west": heavy, "east": light}, loads=[SelfWeight(10.0)], anyway=True)
    weight = model.nodal_loads(model.steps[1]) - model.nodal_loads(model.steps[0])
    assert weight.sum(axis=0) == pytest.approx([0, 0, -0.2 * 10.0 * 1e-3 * 0.5])
    pcmc.write_structure(tmp_path / "two.inp", model)
    text = (tmp_path / "two.inp").read_text()
    assert "ELSET=PATCH_2, MATERIAL=MEMBRANE_2" in text
    assert "PATCH_1,GRAV" in text
    assert "PATCH_2,GRAV" not in text


@pytest.mark.parametrize(
    ("given", "what"),
    [
        ({"loads": [Snow(1.0)], "combinations": {"uls": {"snw": 1.5}}}, "combinations"),
        ({"loads": [Snow(1.0)], "combinations": {"snow": {"snow": 1.5}}}, "combinations"),
        ({"loads": [Snow(1.0), Snow(2.0)], "combinations": {"uls": {"snow": 1.5}}}, "combinations"),
        ({"combinations": {"uls": {}}}, "combinations"),
        ({"combinations": {"uls": {"form": float("nan")}}}, "factor"),
        ({"combinations": [1.0]}, "combinations"),
        ({"gas": True}, "gas"),
        ({"gas": Gas()}, "Gas.ambient"),
        ({"gas": Gas(patches=["rof"], ambient=100.0)}, "patch"),
        ({"material": {"rof": FABRIC}}, "patch"),
        ({"material": {"roof": 1.0}}, "material"),
        ({"loads": [Snow(1.0, area=[(9, 9), (10, 9), (10, 10)])]}, "snow"),
    ],
)
def test_bad_models_are_refused_in_one_line(given, what):
    with refused(OptionError, what=what) as caught:
        model_of(pyramid(), **given).steps  # noqa: B018
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (lambda: Material(1e6, weft=1e6), "Material.shear"),
        (lambda: Material(1e6, 0.4, weft=1e7, shear=1e5), "Material.weft"),
        (lambda: Material(1e6, weft=1e6, shear=1e5, warp=(1, 0)), "Material.warp"),
        (lambda: Snow(1.0, slopes=(30, 10)), "Snow.slopes"),
        (lambda: Snow(1.0, area=[(0, 0), (1, 1)]), "Snow.area"),
        (lambda: Wind({"roof": 1.0}, slopes="steep"), "Wind.slopes"),
        (lambda: Gas(ambient=-1.0), "Gas.ambient"),
        (lambda: Gas(patches="roof"), "Gas.patches"),
    ],
)
def test_bad_values_are_refused_in_one_line(make, what):
    with refused(OptionError, what=what) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_cloth_with_its_warp_across_a_triangle_is_refused(tmp_path):
    model = model_of(square(2), material=Material(1e6, weft=1e6, shear=1e5, warp=(0, 0, 1)), anyway=True)
    with refused(OptionError, what="Material.warp"):
        pcmc.write_structure(tmp_path / "film.inp", model)
    assert not list(tmp_path.iterdir())


def test_a_gas_has_the_pressure_of_the_air_outside_in_any_units():
    model = model_of(parts(), gas=Gas(volume=1.0), units=Units("mm", "N"), anyway=True)
    assert model.gas.outside(model.units) == pytest.approx(0.101325)
    uneven = parts().retensioned(pressures={"east": 2.0})
    with refused(OptionError, what="Gas.patches"):
        model_of(uneven, gas=Gas(ambient=100.0), anyway=True)
    with refused(OptionError, what="Gas.volume"):  # it is flat
        model_of(parts(), gas=Gas(ambient=100.0), anyway=True)


PROJECT = """
units = "m"
force = "kN"
[plan]
edge_length = 1.0
outline = [[0, 0], [4, 0], [4, 3], [0, 3]]
patches = {roof = {tension = 4.0}}
[structure]
young = 1e5
thickness = 0.001
snow = 0.3
combinations = {uls = {snow = 1.5, windy = 0.9}}
[[structure.zones]]
case = "windy"
wind = 0.5
area = [[0, 0], [2, 0], [2, 3], [0, 3]]
"""


@needs_ccx
def test_the_command_runs_the_cases_and_writes_tables(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "roof.toml").write_text(PROJECT)
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp", "--run"]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"uls +100 %", printed)
    names = {path.name for path in tmp_path.iterdir()}
    assert names >= {"roof.inp", "roof-cases.csv", "roof-patches.csv", "roof-supports.csv", "roof-cases.png"}
    assert "roof-cables.csv" not in names
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp", "--run", "--snow", "9.0"]) == 0
    assert "snow: it hangs up to" in capsys.readouterr().out
    pcmc.write("cap.pcmc", pcmc.solve(spherical_cap(0.2, alpha=ALPHA)).surface)
    given = ["--young", "1e4", "--thickness", "0.001", "--snow", "2.0"]
    assert cli.main(["structure", "cap.pcmc", "-o", "cap.inp", "--run", *given]) == 1
    assert "tried: with" in capsys.readouterr().out


@needs_ccx
def test_a_project_has_the_cases_in_its_report(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    output = '[output]\nstructure = "roof.inp"\nreport = "roof.pdf"\n'
    (tmp_path / "roof.toml").write_text(PROJECT.replace("snow = 0.3", "snow = 0.3\nrun = true") + output)
    outcome = pcmc.project.run("roof.toml")
    assert {"roof-cases.csv", "roof-cases.png"} <= {path.name for path in outcome.files}
    assert outcome.analysis()["uls"].carried
    assert "Under load" in "".join(words_of(tmp_path / "roof.pdf"))


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("windy = 0.9", "windi = 0.9"),
        ("young = 1e5\n", ""),
        ("wind = 0.5", "wind = 0.5\nsnow = 0.1"),
        ("snow = 0.3", "snow = 0.3\ngas = {ambiance = 1.0}"),
        ("snow = 0.3", "snow = 0.3\npatches = {rof = {young = 1.0}}"),
        ("snow = 0.3", 'snow = 0.3\nrun = "yes"'),
    ],
)
def test_a_project_with_a_mistake_is_refused_in_one_line(before, after, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert before in PROJECT
    (tmp_path / "roof.toml").write_text(PROJECT.replace(before, after))
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_without_the_program_one_line_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(calculix, "PROGRAM", "no-such-program")
    monkeypatch.setattr("pcmc.project.designed", None)  # it is refused before solving
    (tmp_path / "roof.toml").write_text(PROJECT)
    assert cli.main(["structure", "roof.toml", "-o", "roof.inp", "--run"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "apt install calculix-ccx" in error
    with pytest.raises(calculix.CalculixError, match="calculix-ccx"):
        analyse(model_of(pyramid()))
