"""Cases and combinations under CalculiX, against closed forms; what is overloaded is answered."""

import doctest
import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
from programs import needs_ccx
from scipy.integrate import solve_bvp
from scipy.optimize import brentq
from starts import spherical_cap
from structures import model_of, pyramid, square
from under_load import ALPHA, THICK, cap, parts, stiffness, strip

import pcmc
from generators.grid import grid_faces
from pcmc import Material, Patch, Plane, SelfWeight, Snow, Surface, Wind
from pcmc.plan import Divider, Plan
from pcmc.structure import analyse, analysis
from pcmc.structure.loads import load_steps
from pcmc.surface.geometry import area_vectors
from pcmc.surface.pieces import to_space


def disc(edge):
    """A flat film over the unit disc."""
    cap = spherical_cap(edge)
    flat = cap.moved(cap.vertices * [1.0, 1.0, 0.0])
    return flat.retensioned(tensions={"cap": 2.0}, pressures={"cap": 0.0})


@needs_ccx
@pytest.mark.nightly
@pytest.mark.parametrize("edges", [[0.2, 0.1], [0.2, 0.1, 0.05]])
def test_a_flat_membrane_sinks_as_a_paraboloid(edges):
    """w = q (R² - r²) / 4T, to the second order in the edge; the load is small."""
    off = []
    for edge in edges:
        model = model_of(disc(edge), loads=[Snow(1e-3, patches=["cap"])], anyway=True)
        found = -analyse(model)["snow"].results.deflections
        x, y, _ = model.surface.vertices.T
        off.append(np.sqrt(np.mean((found / (1e-3 / 8.0) - (1.0 - x**2 - y**2)) ** 2)))
    assert np.polyfit(np.log(edges), np.log(off), 1)[0] == pytest.approx(2.0, abs=0.25)
    assert off[-1] < 0.8 * edges[-1] ** 2


@needs_ccx
def test_an_upward_deflection_of_rounding_is_none():
    masts = [[0, 0, 4], [10, 0, 0], [10, 10, 3], [0, 10, 0]]
    outline = [mast[:2] for mast in masts]
    cables = {"edge": "cable", "cable": 9.0, "supports": masts, "tension": 1.0, "pressure": 0.0}
    sail = pcmc.solve(Plan(outline, edge_length=1.5, weight=0.01, **cables).surface()).surface
    model = pcmc.StructuralModel(sail, Material(5e5), thickness=1e-3, cable_area=1e-4, loads=[Snow(0.05)])
    snow = analyse(model).table.set_index("case").loc["snow"]
    assert snow["down"] > 0.01
    assert snow["up"] == 0.0


@needs_ccx
def test_the_example_of_analyse_prints_what_it_says():
    """Doctests leave it out, as they run where the program is missing, too."""
    example = analyse.__doc__.replace("# doctest: +SKIP", "")
    test = doctest.DocTestParser().get_doctest(example, dict(vars(analysis)), "analyse", None, 0)
    assert doctest.DocTestRunner(verbose=False).run(test).failed == 0


@needs_ccx
def test_a_cap_under_more_pressure_grows_as_a_sphere():
    """Apart from a narrow ring at its rim, which may raise it as a whole, it is larger by w / R."""
    young = 1e6
    model = model_of(cap(0.1), material=Material(young), thickness=THICK, loads=[Wind({"cap": 0.2})])
    found = analyse(model)["wind"].results
    X, inside = model.surface.vertices, np.linalg.norm(model.surface.vertices[:, :2], axis=1) < 0.5
    grown = (found.displacements * X)[inside, :2].sum() / (X[inside, :2] ** 2).sum()
    assert grown == pytest.approx(0.2 / stiffness(young) / (2.0 * ALPHA), rel=0.01)
    middle = np.linalg.norm(model.surface.vertices[model.surface.faces].mean(axis=1)[:, :2], axis=1) < 0.5
    np.testing.assert_allclose(found.principal_forces[middle], 1.2 * ALPHA, rtol=0.01)


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
        cap(0.17), material=Material(1e5), thickness=THICK, loads=[Snow(1.8), Snow(0.3, name="light")]
    )
    found = analyse(heavy)
    assert [case.carried for case in found.cases] == [True, False, True]
    assert 0.5 < found["snow"].share < 0.95
    assert found.remedy > 1.0
    assert analyse(analysis.prestressed(heavy, found.remedy)).carried
    assert found["light"].taut == 1.0
    taut = found["snow"].taut
    assert 0.0 < taut < found["snow"].share
    at_taut = analyse(replace(heavy, loads=[Snow(taut * 1.8)]))["snow"].results.principal_forces
    assert abs(np.nanmin(at_taut)) < 0.03 * ALPHA
    first, mesh, last = found.answers()
    assert mesh == analysis.MESH
    assert first.startswith(f"snow: {100 * found['snow'].share:.0f} % of its loads carried")
    assert "'cap'" in first
    assert last.startswith("tried: ")
    total = found["snow"].results.reactions.sum(axis=0)[2]
    at_share = np.pi * (found["snow"].share * 1.8 - 1.0)
    assert total == pytest.approx(at_share, rel=0.05)


@needs_ccx
def test_where_nothing_is_slack_a_roof_is_not_said_to_give_way():
    found = analyse(model_of(square(8), loads=[Snow(1e-4, patches=["film"])], anyway=True))
    rest, snow = found.cases
    [told] = replace(found, cases=(rest, replace(snow, share=0.14)), remedy=0.0).answers()[:1]
    assert told.startswith(
        "snow: 14 % of its loads carried, then CalculiX finds no equilibrium; nothing is slack"
    )
    assert told.endswith("so this may be the program's convergence, not the roof")


@needs_ccx
def test_combinations_add_loads_with_their_factors():
    """On a film that answers in proportion the deflections add up, self-weight with its own factor."""
    loads = [SelfWeight(), Snow(1e-4, patches=["film"]), Wind({"film": 2e-4})]
    sums = {"uls": {"snow": 1.5, "wind": 0.5}, "light": {"self-weight": 0.0, "snow": 1.0}}
    found = analyse(model_of(square(8), loads=loads, combinations=sums, anyway=True))
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


@pytest.mark.parametrize("plane", [Plane((10, 0, 3)), Plane((0, 0, 0), (1, 0, 0))])
def test_a_zone_lies_where_the_plan_has_it(plane):
    """Its points are those of Π, as all points of a plan are, wherever Π lies."""
    film = square(8)
    moved = film.rebuilt(vertices=to_space(film.vertices, plane), plane=plane)
    strip = [(0.0, 0.0), (0.25, 0.0), (0.25, 1.0), (0.0, 1.0)]
    here, there = (
        model_of(s, loads=[Snow(0.3, ["film"], area=strip)], anyway=True).steps[1].forces
        for s in (film, moved)
    )
    np.testing.assert_allclose(there @ plane.axes.T, here, atol=1e-15)


@pytest.mark.parametrize("degrees", [15.0, 30.0, 45.0])
def test_a_sheet_on_the_slope_between_two_zones_is_in_one(degrees):
    """A flat side of 30° had the wind of the zones [0, 30] and [30, 90] together; the other side is steep."""
    z, steep = 2.0 * np.tan(np.radians(degrees)), 3.0
    X = [[0, 0, 0], [4, 0, 0], [4, 2, z], [0, 2, z], [4, 2 + z / steep, 0], [0, 2 + z / steep, 0]]
    faces = [[0, 1, 2], [0, 2, 3], [3, 2, 4], [3, 4, 5]]
    gable = Surface(X, faces, [0] * 4, [Patch("roof", 1.0, 0.0)], fixed=range(6))
    zones = Wind({"roof": 1.0}, slopes=(0, degrees)), Wind({"roof": 3.0}, slopes=(degrees, 90))
    assert load_steps(gable, [zones])[1].pressures.tolist() == [1.0, 1.0, 3.0, 3.0]
    flat = gable.moved(np.array(X) * [1, 1, 0])
    assert load_steps(flat, [Wind({"roof": 1.0}, slopes=(0, 10))])[1].pressures.tolist() == [1.0] * 4


@pytest.mark.parametrize("side", [1, -1])
def test_snow_lies_on_the_upper_half_of_a_gable_that_bulges(side):
    """Both halves have one plan: by the rounding of their sum it hung below the lower one."""
    film = square(6)
    x, y, _ = film.vertices.T
    bulging = film.moved(np.stack([x, -0.2 * np.sin(np.pi * x) * np.sin(np.pi * y), y], axis=1))
    snow = load_steps(bulging.rebuilt(faces=film.faces[:, ::side]), [Snow(1.0)])[1].forces[:, 2]
    assert snow.sum() == pytest.approx(-0.124, abs=1e-3)
    assert snow @ y / snow.sum() > 0.8


@pytest.mark.parametrize("side", [1, -1])
def test_wind_on_a_roof_whose_triangles_face_down_is_told(side):
    """Suction above 0 pushed it down, without a word."""
    film = square(4).rebuilt(faces=square(4).faces[:, ::side])
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        wind = load_steps(film, [Wind({"film": 0.5})])[1]
    assert wind.pressures @ area_vectors(film.vertices[film.faces])[:, 2] == pytest.approx(0.5 * side)
    assert ["wind: the triangles of 'film' face down" in str(one.message) for one in told] == [True] * (
        side < 0
    )


def test_zones_carry_snow_and_wind():
    """Snow within a polygon, and on what is not steep. By the middles of triangles a polygon that cuts them
    had a tenth too much or too little, and one between them nothing."""
    flat = square(8)
    half = [(0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (0.0, 1.0)]
    _, zone = model_of(flat, loads=[Snow(0.3, ["film"], area=half)], anyway=True).steps
    assert zone.forces.sum(axis=0) == pytest.approx([0, 0, -0.15])
    triangle = [(0.0, 0.0), (0.9, 0.0), (0.0, 0.9)]
    _, zone = model_of(flat, loads=[Snow(0.3, ["film"], area=triangle)], anyway=True).steps
    assert zone.forces.sum(axis=0) == pytest.approx([0, 0, -0.3 * 0.405], rel=0.01)
    between = [(0.35, 0.1), (0.45, 0.1), (0.45, 0.9), (0.35, 0.9)]
    _, zone = model_of(square(2), loads=[Snow(0.3, ["film"], area=between)], anyway=True).steps
    assert zone.forces.sum(axis=0)[2] == pytest.approx(-0.3 * 0.08, rel=0.05)
    roof = pyramid()  # its slope is 19.47°
    for wanted, slopes in ((4.0, (0, 20)), (4.0, (19, 90))):
        step = model_of(roof, loads=[Snow(1.0, slopes=slopes)]).steps[1]
        assert step.forces.sum(axis=0)[2] == pytest.approx(-wanted)
    angle = np.degrees(np.arctan(0.125**0.5 / 1.0))
    sliding = model_of(roof, loads=[Snow(1.0, slides=(0.0, 2.0 * angle))]).steps[1]
    assert sliding.forces.sum(axis=0)[2] == pytest.approx(-2.0)
    gust = model_of(flat, loads=[Wind({"film": 0.2}, area=half)], anyway=True)
    assert gust.nodal_loads(gust.steps[1]).sum(axis=0) == pytest.approx([0, 0, 0.1])


def test_materials_by_patch_have_their_own_weight_and_stiffness(tmp_path):
    heavy, light = Material(1e6, density=0.2), Material(2e6, density=0.0)
    model = model_of(parts(), material={"west": heavy, "east": light}, loads=[SelfWeight(10.0)], anyway=True)
    weight = model.nodal_loads(model.steps[1]) - model.nodal_loads(model.steps[0])
    assert weight.sum(axis=0) == pytest.approx([0, 0, -0.2 * 10.0 * 1e-3 * 0.5])
    pcmc.write_structure(tmp_path / "two.inp", model)
    text = (tmp_path / "two.inp").read_text()
    assert "ELSET=PATCH_2, MATERIAL=PATCH_2" in text
    assert "PATCH_1,GRAV" in text
    assert "PATCH_2,GRAV" not in text


@needs_ccx
def test_a_cable_that_would_be_pressed_is_told():
    """CalculiX lets it press as a strut, and the case counted as carried without a word."""
    line = {"curve": [[3, 0], [3, 4]], "cable": 1.0, "wall": False}
    plan = Plan([[0, 0], [6, 0], [6, 4], [0, 4]], [line], edge_length=0.8, tension=1.5, pressure=0.5)
    loads, rope = [Snow(0.05, name="light"), Snow(0.3, name="heavy")], Material(1e8)
    about = {"cable_area": 1e-4, "cable_material": rope, "loads": loads, "material": Material(5e5)}
    found = analyse(model_of(pcmc.solve(plan.surface()).surface, **about), remedy=False)
    assert found.carried
    [told] = [line for line in found.answers() if "strut" in line]
    assert told.startswith("heavy: cable 1 is slack")
    assert f"{-found.cables['least'].min():.3g}" in told


@needs_ccx
@pytest.mark.parametrize("poisson", [0.0, 0.3])
def test_the_tension_of_a_cable_is_along_it_as_it_hangs(poisson):
    """Two edges with N = λ (τ + E a (λ² - 1)/2), and snow q at the vertex between them: 2 N sin θ = q. The
    true stress is that of a section as thin as it has become."""
    cable, stiff = Material(1e4, poisson), 1e4 * 1e-3
    surface, loads = square(2, 1e-6, cable=1.0), [Snow(2.0)]
    model = model_of(
        surface, material=Material(1e-3), cable_area=1e-3, cable_material=cable, loads=loads, anyway=True
    )
    found = analyse(model, remedy=False)["snow"].results

    def pull(w):
        stretch = np.hypot(1.0, 2.0 * w)
        return stretch * (1.0 + stiff * (stretch**2 - 1.0) / 2.0)

    load = 2.0 * 6.0 / 8.0 / 3.0
    sag = brentq(lambda w: 2.0 * pull(w) * w / np.hypot(0.5, w) - load, 0.0, 1.0)
    assert -found.deflections[4] == pytest.approx(sag, rel=1e-4)
    assert found.cable_tensions["tie"] == pytest.approx([pull(sag)] * 2, rel=1e-4)


@needs_ccx
@pytest.mark.parametrize("poisson", [0.0, 0.3])
def test_forces_of_a_sheet_are_in_it_as_it_hangs(poisson):
    """A flat band between mirrors under snow: its force has the same part H along the plan everywhere, and
    the band carries half of the snow at each end, H tan θ."""
    x, y = (values.ravel() for values in np.meshgrid(np.linspace(0, 2, 33), [0, 0.1, 0.2], indexing="ij"))
    sides = {Plane((0, at, 0), (0, at - 0.1, 0), mirror=True): y == at for at in (0.0, 0.2)}
    faces, film = grid_faces(32, 2), [Patch("film", 2.0, 0.0)]
    band = Surface(np.column_stack([x, y, 0.0 * x]), faces, [0] * 128, film, x % 2 == 0.0, on_planes=sides)
    cloth = Material(1e4, poisson)
    model = model_of(band, material=cloth, loads=[Snow(1.0, patches=["film"])], anyway=True)
    found = analyse(model, remedy=False)["snow"].results
    normal = area_vectors((band.vertices + found.displacements)[faces])
    along = found.principal_forces[:, 1] * np.abs(normal[:, 2]) / np.linalg.norm(normal, axis=1)
    (run, _, drop), _ = np.diff((band.vertices + found.displacements)[[0, 3, 6]], axis=0)
    assert along == pytest.approx(np.full(128, along.mean()), rel=2e-3)
    carried = 1.0 - 1.0 / 32  # half of the snow, less that on the vertices of the end
    assert along.mean() * -drop / run == pytest.approx(carried, rel=5e-3)


@needs_ccx
def test_forces_beside_a_contact_are_those_of_the_elements():
    """Where a wall has come down on its bottom, its triangles beside have the corners of what rests there."""
    patches = {"west": {"tension": 4.0, "at": [3, 4]}, "east": {"tension": 4.0, "at": [9, 4]}}
    wall = Divider([[6, 0], [6, 8]], wall=4.5, bottom="held")
    plan = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], [wall], edge_length=0.8, patches=patches)
    model = model_of(pcmc.solve(plan.surface()).surface)
    assert (model.standing.faces[model.active] != model.surface.faces[model.faces]).any()
    found = analyse(model)["form pressure"].results
    tensions = model.surface.tensions[model.surface.patch_of_face[model.faces]]
    assert found.principal_forces[model.faces] == pytest.approx(np.stack(2 * [tensions], axis=1), rel=0.01)
    assert found.taut == 1.0
