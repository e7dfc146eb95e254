"""The table of supports: its rows add up to the loads, in forces and in moments."""

from __future__ import annotations

import numpy as np
import pytest
from pictures import near
from support_cases import cables_between_walls, half_with_mirror

import pcmc
from generators import catenoid, spherical_cap, two_squares
from pcmc import Plane, Target, cut, plot
from pcmc.base.units import Units
from pcmc.certificate.quantities import figures
from pcmc.certificate.supports import balance_sentence
from pcmc.design.targets import measure
from pcmc.forces.pinching import standing_part
from pcmc.meshing.refinement import refine
from pcmc.plan import Divider, Plan
from pcmc.plot import pictures
from pcmc.surface.colours import rgb
from pcmc.surface.geometry import area_vectors

FORCE, MOMENT = ["force_x", "force_y", "force_z"], ["moment_x", "moment_y", "moment_z"]
ROOMS = {"south east": [9, 1, 1.0], "north": [6, 5, 1.2], "south west": [3, 1, 0.8]}
MAST = {"supports": [[0, 0, 0], [8, 0, 1], [8, 6, 0], [0, 6, 1]]}
SIDES = [[[0, 0, 0], [8, 0, 1]], [[8, 0, 1], [8, 6, 0]]]


def hall_of_upright_walls():
    """Three upright walls meet over rooms of different pressures."""
    ends = {"a": [6, 0], "b": [12, 4], "c": [0, 4]}
    walls = [Divider([end, [6, 3]], 0.8, name, upright=True) for name, end in ends.items()]
    rooms = {name: {"tension": 4.0, "pressure": p, "at": [x, y]} for name, (x, y, p) in ROOMS.items()}
    return Plan([[0, 0], [12, 0], [12, 6], [0, 6]], walls, edge_length=1.0, patches=rooms).surface()


def on_masts(**more):
    """A sail of some weight between cables, on four masts."""
    sail = {"roof": {"tension": 4.0, "pressure": 0.0, "weight": 0.2}}
    options = {"edge": "cable", "cable": 30.0, "patches": sail} | MAST | more
    return Plan([[0, 0], [8, 0], [8, 6], [0, 6]], edge_length=1.0, **options).surface()


def resting():
    """Two squares over a wall that is so strong that it is pinched."""
    return two_squares(6, alpha_aux=3.0)


def wedge():
    """A sixth of a cap, between two mirror planes at 60°."""
    planes = Plane(normal=(0, 1, 0), mirror=True), Plane(normal=(0.75**0.5, -0.5, 0), mirror=True)
    return cut(cut(spherical_cap(0.3, alpha=0.6), planes[0]), planes[1])


def against_glass(slope=0.0):
    """Half a cap whose edge slides on a wall of glass."""
    half = cut(spherical_cap(0.3, alpha=0.6), Plane(normal=(0, 1, 0), mirror=True))
    X = half.vertices + slope * np.outer(half.vertices[:, 2], [0.0, 1.0, 0.0])
    ((plane, edge),) = half.on_planes
    up = np.sign(half.vertices[:, 1].sum())
    return half.rebuilt(vertices=X, on_planes={Plane(plane.point, (0.0, up, -up * slope), "glass"): edge})


def against_a_slope():
    return against_glass(0.2)


CASES = {  # how many supports there are of each kind
    hall_of_upright_walls: {"line": 6, "upright plane": 3},
    half_with_mirror: {"line": 3, "mirror": 3},
    on_masts: {"point": 4},
    cables_between_walls: {"line": 2, "point": 1, "cable end": 2},
    resting: {"line": 2, "ground": 2},
    wedge: {"line": 1, "mirror": 2},
    against_glass: {"line": 1, "upright plane": 1},
    against_a_slope: {"line": 1, "plane": 1},
}


@pytest.fixture(scope="module", params=CASES, ids=lambda case: case.__name__)
def solved(request):
    return request.param, pcmc.solve(request.param(), target="stationary")


def wrench(places, forces, about):
    return np.array([forces.sum(axis=0), np.cross(places - about, forces).sum(axis=0)])


def test_the_rows_add_up_to_the_loads(solved):
    """In forces and moments, up to what the mesh leaves: ∇E at the vertices that are not held."""
    case, result = solved
    found, part = result.certify(), standing_part(result.surface).surface
    table, X = found.supports, part.vertices
    assert found.certified
    assert table["kind"].value_counts().to_dict() == CASES[case]
    assert table["support"].is_unique
    about = found.balance[[*"xyz"]].to_numpy()[0]
    rows = wrench(table[[*"xyz"]].to_numpy(), table[FORCE].to_numpy(), about)
    rows[1] += table[MOMENT].to_numpy().sum(axis=0)
    corners, patch = X[part.faces], part.patch_of_face
    areas, heavy = area_vectors(corners), part.weights[patch]
    push = part.net_pressures[patch, None] * areas - np.outer(
        heavy * np.linalg.norm(areas, axis=1), [0, 0, 1]
    )
    loads = wrench(corners.mean(axis=1), push, about)
    size = np.abs(found.reactions).sum()
    np.testing.assert_allclose(rows, wrench(X, found.reactions, about), atol=1e-13 * size * part.size)
    np.testing.assert_allclose(rows + loads, -wrench(X, pcmc.gradient(part), about), atol=1e-12 * size)
    np.testing.assert_allclose(found.remainder, rows + loads, atol=1e-12 * size)
    assert 0.0 < found.balance["force_share"].iloc[-1] < 0.05
    assert "the supports carry the loads" in str(found)


def test_at_a_corner_a_wall_of_glass_carries_nothing_along_itself():
    x, y = np.indices((4, 4)).reshape(2, 16)
    a = np.flatnonzero((x < 3) & (y < 3))
    F = np.concatenate([np.stack([a, a + 4, a + 5], axis=1), np.stack([a, a + 5, a + 1], axis=1)])
    glass = {Plane(normal=(0, 1, 0)): y == 0, Plane((0, 3, 0), (0, -1, 0)): y == 3}
    sail = pcmc.Surface(np.stack([x, y, 0 * x], axis=1), F, [0] * 18, [pcmc.Patch("sail", 2.0, 0.0)],
                        fixed=(x == 0) | (x == 3), on_planes=glass)  # fmt: skip
    forces = pcmc.certify(sail).supports.sort_values(["x", "y"])[FORCE].to_numpy()
    assert forces == pytest.approx(np.array([[-6, 0, 0], [0, -6, 0], [0, 6, 0], [6, 0, 0]]), abs=1e-12)


def test_glass_carries_nothing_along_itself_where_a_curved_sheet_is_fixed_beside_it():
    table = pcmc.solve(against_glass()).certificate.supports.set_index("kind")
    assert table.loc["upright plane", ["force_x", "force_z"]].to_numpy(float) == pytest.approx(0.0, abs=1e-9)
    assert table.loc["line", "force_z"] == pytest.approx(-0.5 * np.pi, rel=0.03)  # half the load on the disc


def test_the_sentence_of_balance_tells_whether_there_are_loads():
    """Of a film without loads the forces of its supports cancel, up to what the solver leaves of them."""
    film = pcmc.solve(catenoid(0.4, half_distance=0.5), tolerance=1e-6).surface
    film = pcmc.certify(film.moved(film.vertices @ [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]]))
    table = film.balance
    assert balance_sentence(table) in str(film)
    table.loc[2, ["force_share", "moment_share"]] = 2e-7, 3e-8
    told = "the forces of the supports cancel to 2e-07 of them in x, y and z, and to 3e-08 in moments"
    assert balance_sentence(table) == told


def test_what_rounding_leaves_of_a_balance_is_0():
    x, y = np.indices((4, 4)).reshape(2, 16)
    a = np.flatnonzero((x < 3) & (y < 3))
    F = np.concatenate([np.stack([a, a + 4, a + 5], axis=1), np.stack([a, a + 5, a + 1], axis=1)])
    flat = pcmc.Surface(np.stack([x, y, 0 * x], axis=1) * 0.37, F, [0] * 18, [pcmc.Patch("sail", 2.3, 0.0)],
                        fixed=(x % 3 == 0) | (y % 3 == 0))  # fmt: skip
    table = pcmc.certify(flat).balance
    assert table[["force_share", "moment_share"]].iloc[-1].tolist() == [0.0, 0.0]
    assert "cancel to 0 of them in x, y and z, and to 0 in moments" in balance_sentence(table)


def test_the_sentence_of_balance_names_the_place_of_moments_without_signs_of_zero():
    table = pcmc.certify(hall_of_upright_walls()).balance
    table[["x", "y", "z"]] = [-0.0, 2.0, -0.0]
    assert " in moments about (0, 2)" in balance_sentence(table)
    assert "loads of the piece between the mirror planes to" in balance_sentence(table, ["plane x = 0"])


def test_what_remains_falls_with_the_mesh():
    coarse = pcmc.solve(spherical_cap(0.4, alpha=0.6)).surface
    fine = pcmc.solve(refine(refine(coarse))).surface
    shares = [pcmc.certify(cap).balance.iloc[-1] for cap in (coarse, fine)]
    assert 0.0 < shares[1]["force_share"] < 0.6 * shares[0]["force_share"]
    assert shares[1]["moment_share"] < 1e-12  # a cap is symmetric


def test_an_upright_wall_under_different_snow_has_no_error_of_curvature():
    """Its plane takes the difference: the wall is flat, and no number says that it should curve."""
    areas = {"west": {"tension": 4.0, "snow": 0.3}, "east": {"tension": 4.0}}
    wall = [Divider([[3, 0], [3, 5]], 1.0, upright=True)]
    plan = Plan([[0, 0], [6, 0], [6, 5], [0, 5]], wall, edge_length=0.3, patches=areas)
    found = pcmc.solve(plan.surface()).certificate
    assert found.certified
    assert found.curvature_error < 1e-9


def test_where_snow_lies_on_one_patch_the_others_have_none_as_a_number():
    """As in the table of patches: a case of a sweep with no snow on one of them has a value there."""
    areas = {"west": {"tension": 4.0, "snow": 0.3}, "east": {"tension": 4.0}}
    roof = Plan(
        [[0, 0], [6, 0], [6, 5], [0, 5]], [[[3, 0], [3, 5]]], edge_length=2.0, patches=areas
    ).surface()
    shown = {(f.quantity, f.of): f.value for f in figures(roof, pcmc.certify(roof))}
    assert [shown["snow", name] for name in areas] == [0.3, 0.0]
    assert [shown["net pressure", name] for name in areas] == [0.7, 1.0]


def test_a_sail_without_pressure_has_no_relative_error_of_curvature():
    """Its target is 0. Any shape of it, at rest or not, had "curvature error 0.00e+00"."""
    rim = [[0, 0, 1], [6, 0, 0], [6, 5, 1], [0, 5, 0]]
    for pressure in (0.0, 0.1):
        sail = Plan(rim, edge_length=2.0, tension=2.0, pressure=pressure).surface()
        (line,) = [line for line in pcmc.certify(sail).text().splitlines() if "curvature error" in line]
        assert (line.split()[-1] == "-") == (pressure == 0.0)


def test_a_rise_is_over_the_outline_and_not_over_the_bottom_of_a_wall():
    """As the key ``rise`` of a plan is; the wall stands on Π, 4 below the outline."""
    outline = [[0, 0, 4], [6, 0, 4], [6, 5, 4], [0, 5, 4]]
    roof = Plan(outline, [[[3, 0], [3, 5]]], edge_length=2.0, tension=5.0).surface()
    shown = {f.quantity: f.value for f in figures(roof, pcmc.certify(roof)) if f.owner == "roof"}
    assert shown["rise"] == pytest.approx(shown["apex"] - 4.0)


def test_upright_walls_hold_what_neighbours_of_unequal_tension_leave():
    """A long hall of tensions 5 and 4: far from its ends the plane takes their difference."""
    patches = {"west": {"tension": 5.0}, "east": {"tension": 4.0}}
    wall = [Divider([[3, 0], [3, 12]], 1.0, upright=True)]
    hall = Plan([[0, 0], [6, 0], [6, 12], [0, 12]], wall, edge_length=0.6, patches=patches)
    found = pcmc.solve(hall.surface()).certify()
    across = found.supports.set_index("kind").loc["upright plane"]
    assert across["name"] == "wall 1, upright"
    total = found.reactions[:, 0].sum()
    assert abs(across["force_x"]) > 100.0 * abs(total)  # without it the table would not add up
    lines = found.supports[found.supports["kind"] == "line"]["force_x"].sum()
    assert across["force_x"] == pytest.approx(total - lines, rel=1e-9)
    assert across["per_length_max"] == pytest.approx(1.0, rel=0.2)  # the difference, at small slopes


def test_the_largest_reaction_is_one_number(solved):
    """In the table, as a target, among the key figures; the force of a cable has no part in it."""
    _, result = solved
    found, surface = result.certify(), result.surface
    key = ("reaction per length", "roof")
    (shown,) = [f.value for f in figures(surface, found) if (f.quantity, f.owner) == key]
    if np.isnan(found.largest_reaction):
        assert shown is None
        return
    assert shown == pytest.approx(found.largest_reaction, rel=1e-12)
    found_again = measure(surface, Target("reaction per length")).value
    assert found_again == pytest.approx(found.largest_reaction, rel=1e-12)
    assert found.largest_reaction <= 1.2 * surface.tensions.max()


def test_forces_at_points_have_arrows_of_their_own(monkeypatch, solved):
    _, result = solved
    found, drawn = result.certify(), {}
    monkeypatch.setattr(pictures, "vectors", lambda s, field, *_, **more: drawn.update(more, field=field))
    plot.reactions(result.surface, units=Units("m", "kN"))
    at_points = found.supports[found.supports["kind"].isin(["point", "cable end"])]
    sizes = np.sort(np.linalg.norm(drawn["points"], axis=1))[::-1]
    np.testing.assert_allclose(
        sizes[: len(at_points)], np.sort(np.linalg.norm(at_points[FORCE], axis=1))[::-1], rtol=1e-12
    )
    assert not sizes[len(at_points) :].any()
    most = np.linalg.norm(drawn["field"], axis=1).max()
    assert most == pytest.approx(np.nan_to_num(found.largest_reaction), rel=0.05)  # the mean of two edges
    assert (drawn["label"], drawn["points_label"]) == ("kN/m along lines", "kN at points")


def test_forces_at_points_are_blue():
    image = plot.reactions(pcmc.solve(cables_between_walls()).surface)
    assert near(image, rgb("#2166AC")).sum() > 100
    assert near(image, rgb("#B2182B")).sum() > 100


def test_moments_that_cancel_along_lines_are_zero():
    """A flat sheet pulls on its rim and on a ring, each in balance with itself, and no load has a size."""
    ring = {"circle": {"centre": [30, 20], "radius": 5}}
    flat = Plan([[0, 0], [60, 0], [60, 40], [0, 40]], [], [ring], edge_length=3.0, tension=0.3, pressure=0.0)
    assert not pcmc.certify(pcmc.solve(flat.surface()).surface).balance[[*FORCE, *MOMENT]].to_numpy().any()


def test_forces_of_a_rim_that_cancel_are_zero():
    """Both sheets of a cushion pull on its rim inwards alone, and all around."""
    cushion = pcmc.solve(Plan([[0, 0], [6, 0], [6, 4], [0, 4]], tension=3.0, cushion=1.0).surface()).surface
    certificate = pcmc.certify(cushion)
    assert set(certificate.supports["name"]) == {"patch 1 | patch 1 below"}
    (rim,) = certificate.supports[FORCE].to_numpy().tolist()
    assert rim == [0.0, 0.0, 0.0]
    assert certificate.support == 0.0
    assert certificate.supports["per_length_max"][0] > 5.0


def test_places_in_the_coordinates_of_a_survey_are_told_apart():
    corners = [[691000 + x, 5334000 + y] for x, y in ((0, 0), (6, 0), (6, 4), (0, 4))]
    row = str(pcmc.certify(Plan(corners, edge_length=2.0, tension=3.0).surface())).splitlines()[-1]
    assert " 691003 5334002 " in row
