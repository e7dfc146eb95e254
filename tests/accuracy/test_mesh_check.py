"""The mesh check: error bars that hold the true error, all verdicts, bad input refused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nightly import at_night
from refusals import refused
from shapes import cap, disc, pyramid
from support_cases import lens, on_unit_circle

from generators import (
    joined_caps,
    joined_caps_exact,
    spherical_cap,
    spherical_cap_exact,
    two_caps,
    two_squares,
)
from pcmc import MeshVerdict, Patch, Surface, certify, check_mesh, solve
from pcmc.accuracy import mesh_check
from pcmc.accuracy.persistence import compared, shape_order
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.forces.pinching import standing_part
from pcmc.meshing.held_curves import smooth_midpoints
from pcmc.meshing.refinement import held_midpoints, refine
from pcmc.plan import Divider, Plan
from pcmc.solvers import solve_once
from studies.folder import Folder
from studies.questions.mesh_check import STUDY
from studies.study import perform


@pytest.mark.parametrize("alpha", [0.51, *at_night(0.6), 1.0, *at_night(5.0)])
def test_the_bars_of_a_cap_hold_its_true_errors(alpha):
    exact = spherical_cap_exact(alpha=alpha)
    found = check_mesh(solve(spherical_cap(0.2, alpha=alpha)))
    assert found.verdict is MeshVerdict.PERSISTS
    truth = {"height": exact.height, "area": exact.area, "volume": exact.volume, "energy": exact.energy}
    truth["reaction"] = -np.pi
    for quantity, value in truth.items():
        row = found.row(quantity, "cap" if quantity in ("height", "area") else "")
        assert abs(row.value - value) <= row.error <= 5.0 * abs(row.value - value), quantity
        assert abs(row.limit - value) <= row.limit_error < 0.2 * row.error, quantity
        assert row.order == pytest.approx(2.0, abs=0.4), quantity


def test_joined_caps_persist_and_their_limits_are_the_exact_values():
    exact = joined_caps_exact()
    found = check_mesh(solve(joined_caps(1.0)))
    assert found.verdict is MeshVerdict.PERSISTS
    for row, value in (
        (found.row("energy"), exact.energy),
        (found.row("volume"), exact.volume),
        (found.row("height", "left"), exact.height),
    ):
        assert abs(row.value - value) <= row.error <= 2.0 * abs(row.value - value)
        assert abs(row.limit - value) <= row.limit_error < 0.2 * row.error


def test_the_height_of_a_cushions_lower_sheet_is_that_of_its_lowest_point():
    """Over a circle of radius 3 the sheets are caps of the radii 2α/p, 4 and 6."""
    plan = Plan({"circle": {"centre": [0, 0], "radius": 3.0}}, edge_length=0.8, tension=2.0, cushion=1.5)
    found = check_mesh(solve(plan.surface()))
    for name, value in ("patch 1", 4.0 - np.sqrt(7.0)), ("patch 1 below", np.sqrt(27.0) - 6.0):
        row = found.row("height", name)
        assert abs(row.value - value) <= row.error <= 5.0 * abs(row.value - value)
        assert abs(row.limit - value) <= row.limit_error < 0.2 * row.error
        assert row.order == pytest.approx(2.0, abs=0.4)


def test_exact_quantities_have_bars_at_rounding_and_no_order():
    """A flat film has its area on every mesh; the volume below it is 0."""
    t = np.linspace(0.0, 1.0, 4)
    X = np.array([[x, y, 0.0] for x in t for y in t])
    k = np.arange(16).reshape(4, 4)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    F = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    rim = np.isin(X[:, :2], (0.0, 1.0)).any(axis=1)
    film = Surface(X, F, [0] * len(F), [Patch("film", 2.0, 0.0)], fixed=rim)
    found = check_mesh(film)
    for quantity in ("area", "energy"):
        row = found.row(quantity, "film" if quantity == "area" else "")
        assert row.value == pytest.approx(1.0 if quantity == "area" else 2.0, abs=1e-12)
        assert row.error < 1e-8
        assert np.isnan(row.order)


def test_a_saddle_is_followed_as_a_saddle():
    found = check_mesh(solve(two_squares(12, alpha_aux=2.0), target="stationary"))
    assert found.verdict is MeshVerdict.PERSISTS
    assert "saddle of index 1" in found.detail


def test_a_stable_surface_that_turns_into_a_saddle_changes():
    found = check_mesh(solve(two_squares(6, alpha_aux=2.0)))
    assert found.verdict is MeshVerdict.CHANGES
    assert "saddle of index 1" in found.detail
    assert "hold the bottom of 'wall'" in found.advice


def test_what_changes_on_the_second_mesh_changes_though_the_third_is_lost(monkeypatch):
    starts = []

    def tired(start, method, callback, target, iterations):
        starts.append(start)
        return solve_once(start, method, callback, target=target, iterations=1 if starts[1:] else iterations)

    monkeypatch.setattr(mesh_check, "solve_once", tired)
    found = check_mesh(solve(two_squares(6, alpha_aux=2.0)), boundary="polygon")
    assert [len(starts), len(found.surfaces)] == [3, 2]  # the third mesh is tried downhill, too
    assert found.verdict is MeshVerdict.CHANGES
    assert np.isnan(found.row("height", "left").limit)


def test_a_stable_roof_that_comes_to_rest_downhill_alone_is_not_called_held_by_the_mesh():
    """Three walls that meet, one at rest: on 2832 triangles the search for any equilibrium goes astray."""
    outline = [[10, 0], [5, 8.66], [-5, 8.66], [-10, 0], [-5, -8.66], [5, -8.66]]
    ends, walls = ([10, 0], [-5, 8.66], [-5, -8.66]), (6.7, 4.4, 5.0)
    dividers = [Divider([[0, 0], end], wall=wall) for end, wall in zip(ends, walls, strict=True)]
    patches = {
        "a": {"tension": 3.19, "at": [3, 4]},
        "b": {"tension": 3.79, "at": [-6, 0]},
        "c": {"tension": 4.22, "at": [3, -4]},
    }
    start = Plan(outline, dividers, edge_length=2.0, patches=patches).surface()
    assert check_mesh(solve(start)).persists


@pytest.mark.parametrize("edge", [1.2, 0.6], ids=["drifts", "collapses"])
def test_a_junction_that_slips_at_its_end_is_held_by_the_mesh(edge):
    found = check_mesh(solve(two_caps(edge)))
    assert found.verdict is MeshVerdict.HELD_BY_MESH
    assert abs(found.place[0]) < 0.5  # near a corner (0.25, ±2.905, 0)
    assert abs(abs(found.place[1]) - 2.905) < 0.6
    assert "hold the bottom of 'wall'" in found.advice


def test_a_coarse_mesh_may_carry_more_than_its_boundary_can():
    """Below α = R/2 there is no cap; one of few triangles is at rest a little below it."""
    found = check_mesh(solve(spherical_cap(0.2, alpha=0.495)))
    assert found.verdict is MeshVerdict.HELD_BY_MESH
    assert "the pressure is 1.009 times what the boundary's tension could carry" in found.detail
    assert np.isnan(found.table.limit).all()
    assert np.isinf(found.table.error).all()


def test_a_surface_that_jumps_to_another_is_another_shape():
    start = two_caps(1.2, alpha_large=3.5, alpha_small=3.0, alpha_aux=1.0)
    found = check_mesh(solve_once(start, target="stationary"))
    assert found.verdict is MeshVerdict.CHANGES
    assert "it is another shape" in found.detail


def test_a_shape_of_coarse_triangles_alone_needs_finer_ones():
    """The full roof over an L: with every wall held, the mesh is all that one can change."""
    corners = [[0, 0], [10, 0], [10, 4], [4, 4], [4, 10], [0, 10]]
    valley = Divider([[0, 0], [4, 4]], wall=0.64)
    found = check_mesh(solve(Plan(corners, [valley], tension=1.8481, edge_length=1.0).surface()))
    assert found.verdict is MeshVerdict.CHANGES
    assert found.advice.startswith("take finer triangles: edge_length = 0.58 in [plan]")
    assert found.advice in found.brief()


def test_a_junction_that_comes_down_changes():
    """A junction that rests all along, and one that stands: as if a finer mesh had lifted it."""
    resting, standing = (solve(two_squares(4, alpha_aux=wall)) for wall in (3.0, 1.0))
    found = compared([resting.surface, standing.surface], [resting.certificate, standing.certificate])
    assert found.verdict is MeshVerdict.CHANGES
    assert "the junction over 'wall' rests on the plane along 0 of its length 4, here along 4" in found.reason


def test_a_line_between_walls_that_will_lie_down_is_held_by_the_mesh():
    outline = [[0, 0], [12, 0], [12, 8], [0, 8]]
    tee = [Divider([[5, 0], [5, 8]], wall=1.5), Divider([[5, 4], [12, 4]], wall=1.5)]
    cross = [Divider([[6, 0], [6, 8]], wall=1.5), Divider([[0, 4], [12, 4]], wall=1.5)]
    upright = [Divider(divider.curve, wall=1.5, upright=True) for divider in tee]
    for dividers, verdict in ((tee, "HELD_BY_MESH"), (cross, "PERSISTS"), (upright, "PERSISTS")):
        plan = Plan(outline, dividers=dividers, tension=4.0, edge_length=1.2)
        found = check_mesh(solve(plan.surface()))
        assert found.verdict is MeshVerdict[verdict]
        assert ("leans ever more at its foot" in str(found)) is (dividers is tee)
    assert found.place is None


def test_near_a_junction_whose_wall_is_held_there_is_nothing_to_hold():
    """The top of the junction of two caps is drawn up: another shape, and no end that only the mesh holds."""
    slides = joined_caps(1.0, exact=True)
    held = slides.rebuilt(fixed=slides.fixed | slides.on_plane, on_plane=())
    junction = held.topology.junctions[0].vertices
    X, top = held.vertices.copy(), junction[held.vertices[junction, 2].argmax()]
    X[top, 2] += 2.0
    for caps, advice in ((slides, "hold the bottom of 'wall'"), (held, "")):
        found = compared([caps, caps.moved(X)], [certify(caps)] * 2)
        assert found.verdict is MeshVerdict.CHANGES
        assert found.place == pytest.approx(held.vertices[top].tolist())
        assert found.advice.split(":")[0] == advice


@settings(max_examples=5, deadline=None)
@given(st.integers(-3, 3), st.integers(-3, 3))
def test_scales_of_length_and_force_scale_the_table(length, force):
    """q → s q for heights, s² for areas, …; orders stay."""
    size, strength = 10.0**length, 10.0**force
    one = check_mesh(solve(cap(4)))
    start = cap(4)
    patch = Patch("cap", 0.6 * strength * size, strength)
    scaled = Surface(start.vertices * size, start.faces, start.patch_of_face, [patch], start.fixed)
    two = check_mesh(solve(scaled))
    scale = {"height": size, "area": size**2, "volume": size**3, "energy": strength * size**3}
    scale |= {"reaction": strength * size**2, "reaction per length": strength * size}
    scale["lowest eigenvalue"] = strength / size
    for (_, a), (_, b) in zip(one.table.iterrows(), two.table.iterrows(), strict=True):
        if a.quantity == "thrust":  # zero by symmetry
            continue
        for column in ("value", "error", "limit", "limit_error"):
            assert b[column] == pytest.approx(scale[a.quantity] * a[column], rel=1e-4), (a.quantity, column)
        assert b.order == pytest.approx(a.order, abs=1e-4, nan_ok=True)  # of a pull that no mesh changes


def test_a_line_where_two_sheets_end_has_bars():
    """A lens on a ring: its pull is 2 α cos θ inwards, and the two foils' loads cancel."""
    check = check_mesh(solve(lens()), boundary=on_unit_circle)
    exact = 2.0 * (0.36 - 0.25) ** 0.5
    row = check.row("reaction per length", "foil | foil below")
    assert abs(row.value - exact) <= row.error < 0.1 * exact
    assert abs(row.limit - exact) <= row.limit_error < 0.01 * exact
    assert row.order == pytest.approx(2.0, abs=0.3)
    assert check.row("reaction", "foil | foil below").value == pytest.approx(0.0, abs=1e-9)


def test_the_one_line_that_carries_half_a_roof_has_its_whole_reaction():
    """The mirror plane is a support, too, but carries nothing upwards: the line's reaction is the loads'."""
    ell = [[0, 0], [6, 0], [6, 4], [3, 4], [3, 8], [0, 8]]
    half = Plan(ell, mirrors=[[[0, 0], [6, 0]]], edge_length=1.5, tension=4.0).surface()
    check = check_mesh(solve(half))
    row = check.row("reaction", "patch 1")
    assert (row.limit, row.limit_error) == (check.row("reaction").limit, check.row("reaction").limit_error)
    assert row.limit == pytest.approx(-36.0)


def test_other_numbers_of_meshes():
    result = solve(spherical_cap(0.25))
    exact = spherical_cap_exact()
    bars = []
    for meshes in (2, 3, 4):
        found = check_mesh(result, meshes)
        assert [s.m for s in found.surfaces] == [result.surface.m * 4**k for k in range(meshes)]
        row = found.row("energy")
        assert abs(row.value - exact.energy) <= row.error
        assert abs(row.limit - exact.energy) <= row.limit_error
        bars.append(row.limit_error)
    assert bars[0] > 3.0 * bars[1] > 9.0 * bars[2]


def test_bad_input_is_refused():
    surface = solve(pyramid()).surface
    with refused(OptionError, what="meshes", found=1, expected="a whole number ≥ 2"):
        check_mesh(surface, 1)
    with refused(OptionError, what="meshes", found=64, expected=50):
        check_mesh(surface, most_triangles=50)
    with refused(OptionError, what="boundary", found="smoth"):
        check_mesh(surface, boundary="smoth")
    with refused(SurfaceError, what="surface", found="str"):
        check_mesh("surface")
    with pytest.raises(SurfaceError, match="needs a surface at rest; solve it first"):
        check_mesh(pyramid())
    with refused(OptionError, what="quantity", found="hight of roof"):
        check_mesh(surface).row("hight", "roof")


def test_ctrl_c_ends_the_check():
    def stop(progress):
        raise StopIteration

    with pytest.raises(KeyboardInterrupt):
        check_mesh(solve(pyramid()), callback=stop)


# ---- new vertices of held curves -----------------------------------------------------------------


def test_new_vertices_lie_on_circles_of_uneven_edges_and_on_straight_lines():
    rng = np.random.default_rng(5)
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, 40))
    rim = np.stack([3.0 + 2.0 * np.cos(angle), 2.0 * np.sin(angle), 1.0 + 0 * angle], axis=1)
    F = [[0, k + 1, (k + 1) % 40 + 1] for k in range(40)]
    dome = Surface([[3, 0, 2], *rim], F, [0] * 40, [Patch("dome", 1.0)], fixed=range(1, 41))
    away = np.linalg.norm(smooth_midpoints(dome) - [3.0, 0.0, 1.0], axis=1)
    assert away == pytest.approx(2.0, abs=1e-12)
    square = two_squares(4)
    edges = square.topology.edges[held_midpoints(square)[0]]
    assert np.array_equal(smooth_midpoints(square), square.vertices[edges].mean(axis=1))


def test_corners_stay_corners():
    flat, F = disc(1)  # a hexagon turns by 60°
    rim = np.isclose(np.hypot(*flat.T), 1.0)
    hexagon = Surface(np.column_stack([flat, 0.0 * rim]), F, [0] * len(F), [Patch("a", 1.0)], fixed=rim)
    for corner, radius in ((40.0, np.sqrt(0.75)), (70.0, 1.0)):
        away = np.linalg.norm(smooth_midpoints(hexagon, corner), axis=1)
        assert away == pytest.approx(radius, abs=1e-12)


def test_smooth_curves_are_met_with_order_four():
    """An ellipse, its vertices at even angles."""
    error = []
    for count in (16, 32, 64):
        angle = 2.0 * np.pi * np.arange(count) / count
        rim = np.stack([2.0 * np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        F = [[0, k + 1, (k + 1) % count + 1] for k in range(count)]
        plate = Surface([[0, 0, 0], *rim], F, [0] * count, [Patch("plate", 1.0)], fixed=range(1, count + 1))
        new = smooth_midpoints(plate, 60.0)
        error.append(np.abs(np.hypot(new[:, 0] / 2.0, new[:, 1]) - 1.0).max())
    assert np.log2(np.array(error[:-1]) / error[1:]).min() > 3.0


def test_sliding_vertices_stay_on_the_plane():
    surface = solve(two_caps(1.2)).surface
    fine = refine(surface, 1, lambda _: smooth_midpoints(surface))
    assert np.abs(fine.vertices[fine.on_plane, 2]).max() < 1e-12


@pytest.mark.nightly
def test_the_study_s_bars_hold_the_true_errors(tmp_path):
    """On the coarsest mesh of each closed form; the study has all meshes."""
    perform(STUDY, tmp_path, short=True)
    folder = Folder(tmp_path / "mesh_check")
    coverage = folder.read_table("coverage").set_index("family").loc["all"]
    assert coverage.quantities > 30
    assert coverage.inside >= 0.9
    assert coverage.width_over_5 == 0.0
    assert coverage.width_median < 1.2
    verdicts = folder.read_table("verdicts").set_index("example").verdict
    assert verdicts["L-shaped roof"] == "persists"
    assert verdicts["Example 1, wall 1"] == "held by mesh"
    assert folder.figure("coverage").stat().st_size > 10_000


# ---- the command, projects and sweeps ------------------------------------------------------------


def test_bars_count_that_a_junction_begins_to_rest_on_the_finest_mesh():
    """What the coarser ones show is another way of standing: its order tells nothing of what is to come."""
    divider = Divider({"arc": [[5.04, 0], [5.79, 3.42], [5.92, 6.84]]}, wall=2.4)
    corners = [[0, 0], [9.68, 0], [10.56, 6.84], [0, 6.84]]
    first = check_mesh(solve(Plan(corners, [divider], edge_length=0.98, tension=3.31).surface()))
    assert [standing_part(surface).resting.any() for surface in first.surfaces] == [False, False, True]
    truth = check_mesh(first.surfaces[-1])
    for name in ("patch 1", "patch 2"):
        (bar, limit), finer = first.row("height", name)[["limit_error", "limit"]], truth.row("height", name)
        assert abs(limit - finer.limit) <= bar + finer.limit_error
        assert bar < 0.01 * limit


def test_a_junction_begins_to_rest_beside_one_that_rests_on_all_meshes():
    """Each counts by itself: with the heavy wall alone the order is that where a rest ends."""
    light = Divider({"arc": [[5.04, 0], [5.79, 3.42], [5.92, 6.84]]}, wall=2.4)
    heavy = Divider([[10.5, 0], [10.5, 6.84]], wall=6.0)
    corners = [[0, 0], [15, 0], [15, 6.84], [0, 6.84]]
    plan = Plan(corners, [light, heavy], edge_length=0.98, tension=3.31)
    surfaces = check_mesh(solve(plan.surface())).surfaces
    rest = [surface.vertices[standing_part(surface).resting, 0] for surface in surfaces]
    assert [bool((x > 7.0).any()) for x in rest] == [True, True, True]
    assert [bool((x < 7.0).any()) for x in rest] == [False, False, True]
    assert shape_order(surfaces) == 1.0
    alone = replace(plan, dividers=plan.dividers[1:])
    assert shape_order(check_mesh(solve(alone.surface())).surfaces) == 1.5


def test_bars_count_that_a_junction_will_rest_on_its_bottom():
    """It does on the fifth mesh; on each before it rises less at its ends, and orders seem better."""
    corners = [[4.279, -0.593], [1.957, 5.107], [-2.269, 3.567], [-4.675, 1.009], [-2.668, -4.268]]
    wall = Divider([[3.118, 2.257], [-3.6715, -1.6295]], wall=1.53)
    patches = {"one": {"tension": 4.9, "pressure": 0.701, "at": [0.2, -0.55]}, "two": {"tension": 5.4}}
    patches["two"]["at"] = [-0.8, 1.2]
    roof = Plan([*corners, [2.384, -4.236]], [wall], edge_length=1.5, patches=patches).surface()
    found = check_mesh(solve(roof))
    assert found.persists
    assert not any(standing_part(surface).resting.any() for surface in found.surfaces)
    finer = check_mesh(found.surfaces[-1])
    assert standing_part(finer.surfaces[-1]).resting.any()
    for quantity in ("height of two", "lowest eigenvalue"):
        name = quantity.split(" of ")
        (bar, limit), truth = found.row(*name)[["limit_error", "limit"]], finer.row(*name)
        assert abs(limit - truth.limit) <= bar + truth.limit_error
    smooth = check_mesh(solve(joined_caps(1.0)))
    assert shape_order(found.surfaces) == 1.5 < shape_order(smooth.surfaces)
