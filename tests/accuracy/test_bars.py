"""Error bars where they once failed: minimal surfaces, guessed curves, orders that are coincidences."""

from dataclasses import replace
from itertools import chain

import numpy as np
import pytest
from scipy.spatial import Delaunay

from generators import spherical_cap
from pcmc import MeshVerdict, Patch, Plane, Room, Surface, certify, check_mesh, solve, solve_to_accuracy
from pcmc.accuracy import mesh_check
from pcmc.accuracy.adaptive import AccuracyStatus
from pcmc.accuracy.extrapolation import extrapolate
from pcmc.accuracy.quantities import readings
from pcmc.meshing.held_curves import held_corners
from studies.coverage import forms as coverage_forms
from studies.coverage import weights as coverage_weights
from studies.coverage.bars import STUDY
from studies.coverage.meshes import disc, one_patch
from studies.folder import Folder
from studies.study import perform

FORMS = {(c.family, c.name): c for c in (*coverage_forms.helicoids(), *coverage_forms.scherk())}
HELICOIDS = [name for family, name in FORMS if family == "helicoid" and "from -0.6" in name]
SCHERK = [name for family, name in FORMS if family == "Scherk" and "9 squares, moved 0.4" in name]


def checked(family, name):
    return checked_case(FORMS[family, name])


def checked_case(case):
    return case, check_mesh(solve(case.start(), target="stationary"), corners=case.corners)


def holds(case, check):
    rows = [(check.row(*quantity), exact) for quantity, exact in case.exact.items()]
    held = ((abs(row.value - x) <= row.error, abs(row.limit - x) <= row.limit_error) for row, x in rows)
    return all(chain.from_iterable(held))


@pytest.mark.parametrize("name", HELICOIDS)
def test_helicoids_are_not_held_by_the_mesh(name):
    """Coarse meshes are nearly exact at the vertices: moves grow, but are none beside the shape's error."""
    case, check = checked("helicoid", name)
    assert check.verdict is MeshVerdict.PERSISTS
    assert holds(case, check)


@pytest.mark.parametrize("name", SCHERK)
def test_curves_beside_corners_are_in_the_bars(name):
    """Beside a corner a curve is guessed from one side only; the bars were 1.5 to 4 times too small."""
    case, check = checked("Scherk", name)
    assert holds(case, check)
    row = check.row("area", "film")
    assert row.limit_error <= 10.0 * abs(row.limit - case.exact["area", "film"])
    assert check.curve_doubts["area", "film"] > 0.5 * row.limit_error


@pytest.mark.parametrize("seed", range(5))
def test_a_curve_of_few_edges_may_have_no_corners(seed):
    """A flat film in the wire r = 1 + 0.15 cos 3θ. At some of its 14 vertices it turns by more than 40°.

    These were corners without a doubt, and the bars up to three times too small; those of limits 50 times.
    """
    plan, faces, rim = disc(0.45, seed)
    plan *= 1.0 + 0.15 * np.cos(3.0 * np.arctan2(plan[:, 1], plan[:, 0]))[:, None]
    film = one_patch(np.pad(plan, ((0, 0), (0, 1))), faces, Patch("film", 1.0, 0.0), rim)
    assert len(held_corners(film)) >= 4
    row, exact = check_mesh(solve(film)).row("area", "film"), np.pi * (1.0 + 0.5 * 0.15**2)
    assert abs(row.value - exact) <= row.error
    assert abs(row.limit - exact) <= row.limit_error


def test_doubts_are_known_where_finer_meshes_come_to_rest_downhill_alone(monkeypatch):
    """They were solved in one way alone, and all bars were infinite."""
    case = FORMS["Scherk", SCHERK[0]]
    film = solve(case.start())
    usual = check_mesh(film, 2, corners=case.corners)
    solve_once = mesh_check.solve_once

    def lame(start, method, callback, target, iterations):
        return solve_once(
            start, method, callback, target=target, iterations=iterations * (target == "minimum")
        )

    monkeypatch.setattr(mesh_check, "solve_once", lame)
    downhill = check_mesh(film, 2, corners=case.corners)
    assert usual.curve_doubts
    assert downhill.curve_doubts == pytest.approx(usual.curve_doubts, rel=1e-3, abs=1e-9)


@pytest.mark.parametrize("sides", [5, 6, 8])
def test_corners_between_straight_lines_or_that_are_named_are_not_doubted(sides):
    """Each side has two edges; or one, and its ends are named."""
    angle = np.arange(sides) * 2.0 * np.pi / sides
    plan = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    middles = 0.5 * (plan + np.roll(plan, -1, axis=0))
    rim = np.stack([plan, middles], axis=1).reshape(-1, 3)
    for line, corners in ((rim, ()), (plan, range(1, sides + 1))):
        n = len(line)
        fan = [[0, k + 1, (k + 1) % n + 1] for k in range(n)]
        top = np.concatenate([[[0.0, 0.0, 0.3]], line])
        roof = Surface(top, fan, [0] * n, [Patch("roof", 1.0)], fixed=range(1, n + 1))
        assert not check_mesh(solve(roof), 2, corners=corners).curve_doubts


def test_an_accuracy_is_not_reached_beyond_what_is_known_of_the_curves():
    case = FORMS["Scherk", SCHERK[1]]
    found = solve_to_accuracy(case.start(), {"area": 1e-4}, accuracy_of="limit")
    assert found.status is AccuracyStatus.CURVES
    assert "may be 0.00" in found.message
    row = found.values.iloc[0]
    assert abs(row.limit - case.exact["area", "film"]) <= row.limit_error


@pytest.mark.parametrize(
    ("errors", "shape_order"),
    [
        ((-2.24e-4, -5.7e-5, -1.71e-5), 1.66),  # the reaction of a strip that hangs by its weight
        ((0.13, 0.0328, 0.00791), 1.99),  # the energy of a double bubble of unequal tensions
        ((-0.0090, -0.00226, -0.000538), 1.87),  # the height of a cap in a wedge
        ((-2.566e-2, -4.26e-3, -1.66e-3), 2.0),  # an order of 3 that is none
        ((0.1091, 0.0541, 0.0873), 1.0),  # the thrust beside a wall that begins to rest: it swings
    ],
)
def test_orders_that_the_surface_does_not_have_are_not_believed(errors, shape_order):
    found = extrapolate(np.array(errors)[:, None], np.array([1e-12]), shape_order=shape_order)
    assert abs(found.limit[0]) <= found.limit_error[0]
    assert found.limit_error[0] < 1.5 * abs(errors[-1])


@pytest.mark.parametrize(
    ("values", "limit", "bar"),
    [
        ((4.0, 6.25, 6.8125), 7.0, 0.05 * 0.5625),  # order 2: a twentieth of the last difference
        ((4.0, 5.5, 6.25), 7.0, 2.0 * (7.0 - (6.25 + 0.75 / 3.0))),  # order 1: from what order 2 would give
        (
            (4.0, 6.4, 6.7),
            6.7 + 0.3 / 7.0,
            2.4 / 12.0,
        ),  # order 3 is a coincidence: what order 2 leaves of d_1
        ((4.0, 6.25), 7.0, 2.25),  # two meshes: all of the last difference
    ],
)
def test_the_limit_and_its_bar_are_those_of_the_table(values, limit, bar):
    found = extrapolate(np.array(values)[:, None], np.array([1e-15]))
    assert found.limit[0] == pytest.approx(limit, rel=1e-12)
    assert found.limit_error[0] == pytest.approx(bar, rel=1e-12)
    assert found.error[0] == pytest.approx(abs(limit - values[0]) + bar, rel=1e-12)


def test_of_a_surface_that_settles_slowly_a_fast_quantity_is_not_believed_more():
    """Of order 1, where the quantity shows 2: |d_1| / (S (S - 1)) less what is left by order 2, 3/16."""
    found = extrapolate(np.array([[4.0], [6.25], [6.8125]]), np.array([1e-15]), shape_order=1.0)
    assert found.limit[0] == pytest.approx(7.0, rel=1e-12)
    assert found.limit_error[0] == pytest.approx(2.25 / 2.0 - 3.0 / 16.0, rel=1e-12)


@pytest.mark.parametrize("rooms", [(), [Room("inside", {"cap": 1}, 1.0)]])
def test_the_rounding_of_each_quantity_has_its_unit(rooms):
    """A hundred times as large under forces 10⁴ times as large, it grows as the quantity itself."""
    cap = solve(spherical_cap(0.4, alpha=0.75)).surface.rebuilt(rooms=rooms)
    (patch,) = cap.patches
    large = Surface(100.0 * cap.vertices, cap.faces, cap.patch_of_face,
                    [Patch(patch.name, 100.0 * patch.tension, patch.pressure)], fixed=cap.fixed,
                    rooms=[replace(room, volume=1e6) for room in rooms])  # fmt: skip
    small, grown = (readings(s, certify(s), s.n) for s in (cap, large))
    assert {"height", "area", "volume", "energy", "reaction"} <= {key[0] for key in small}
    for (name, one), other in zip(small.items(), grown.values(), strict=True):
        if abs(one.value) > 1e-6:
            assert other.rounding / one.rounding == pytest.approx(other.value / one.value, rel=0.5), name


def test_two_meshes_of_one_value_leave_rounding():
    found = extrapolate(np.array([[2.0], [2.0 + 1e-13]]), np.array([1e-12]))
    assert (found.limit[0], found.limit_error[0]) == (2.0 + 1e-13, 1e-12)
    assert np.isnan(found.order[0])


def test_the_top_of_a_paraboloid_in_a_mirror_plane_is_found_between_its_vertices():
    """Half of it, z = 1 - x² - (y - 0.03)²/4 over a grid: the images of vertices lie on it, too."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0.0, 1.0, 6), np.linspace(-1.0, 1.0, 11)))
    X = np.stack([x, y, 1.0 - x**2 - 0.25 * (y - 0.03) ** 2], axis=1)
    mirror = Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), mirror=True)
    rim = (x == 1.0) | (np.abs(y) == 1.0)
    half = Surface(X, Delaunay(X[:, :2]).simplices, [0] * 100, [Patch("roof", 1.0)], fixed=rim,
                   on_planes={mirror: ~rim & (x == 0.0)})  # fmt: skip
    height = readings(half, certify(half), half.n)["height", "roof", "", b""]
    assert height.value < 0.9998
    assert height.estimate == pytest.approx(1.0, abs=1e-12)


def test_heights_in_mirror_planes_are_read_with_the_images():
    """The crown of a barrel of nine squares lies between vertices, the highest of them in mirror planes."""
    case = next(c for c in coverage_weights.barrels() if c.name == "α 2, p 1, w 0.3, 9 squares")
    case, check = checked_case(case)
    row, exact = check.row("height", "vault"), case.exact["height", "vault"]
    assert abs(row.limit - exact) <= row.limit_error < 0.05 * row.error
    assert holds(case, check)


def test_the_reaction_of_an_uneven_mesh_is_that_of_its_loads():
    """The sheet's own forces within itself spoil the sum of the supports: its order of 2.2 was none."""
    case = next(c for c in coverage_forms.random_caps() if c.name == "α 0.53, edge 0.2, seed 1")
    case, check = checked_case(case)
    row = check.row("reaction")
    assert row.value == pytest.approx(-3.13855, abs=2e-5)
    assert abs(row.limit + np.pi) <= row.limit_error < 1e-3
    assert holds(case, check)


@pytest.mark.nightly
def test_the_study_s_bars_hold_in_every_family(tmp_path):
    """On the coarsest mesh of each family; the study has all meshes."""
    perform(STUDY, tmp_path, short=True)
    coverage = Folder(tmp_path / "coverage").read_table("coverage").set_index("family")
    assert coverage.loc["all", "quantities"] > 35
    assert (coverage[["inside_bounded", "limit_inside"]] >= 0.99).all(axis=None)
