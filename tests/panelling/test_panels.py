"""Panels: families that keep their promise, unfolded panels, angles, and fewer families."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd
import pytest
from refusals import refused

import pcmc
from generators import spherical_cap, two_caps, two_squares
from pcmc import Patch, Surface
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.base.units import Units
from pcmc.cli import main
from pcmc.panelling.families import triangle_families
from pcmc.plan import Plan
from pcmc.report.tables import MOST_FAMILIES
from pcmc.report.words import panel_text
from pcmc.solvers.result import Status
from pcmc.surface.distance import distances
from pcmc.surface.geometry import edge_vectors, face_areas
from studies.questions import panel_families
from studies.study import perform

TURNS = [[0, 1, 2], [1, 2, 0], [2, 0, 1]]
TURNED_OVER = [[2, 1, 0], [1, 0, 2], [0, 2, 1]]


def edge_lengths(surface, walls=False):
    faces = surface.faces[~surface.walls[surface.patch_of_face] | walls]
    return np.linalg.norm(edge_vectors(surface.vertices[faces]), axis=2)


@pytest.fixture(scope="module")
def squares():
    """Example 1 at rest: its walls pull too little to pinch."""
    return pcmc.solve(two_squares(8, alpha_aux=1.0)).surface


@pytest.fixture(scope="module")
def caps():
    """Example 2 at rest."""
    return pcmc.solve(two_caps(), target="stationary").surface


def orbits(surface, maps):
    """Labels of the panels that isometries of space, given as diagonal signs, carry into one another."""
    faces = surface.faces[~surface.walls[surface.patch_of_face]]
    middle = surface.vertices[faces].mean(axis=1)
    label = np.arange(len(faces))
    for signs in maps:
        image = middle * signs
        apart = np.abs(image[:, None] - middle).max(axis=2)
        assert apart.min(axis=1).max() < 1e-9  # the map is a symmetry of the mesh
        label = np.minimum(label, label[apart.argmin(axis=1)])
    return label


@pytest.mark.parametrize(
    ("mirror_images", "maps", "size"),
    [("alike", [[-1, 1, 1], [1, -1, 1], [-1, -1, 1]], 4), ("apart", [[-1, -1, 1]], 2)],
)
def test_the_families_of_example_1_are_the_orbits_of_its_symmetries(squares, mirror_images, maps, size):
    """Two mirror planes and the half turn; the half turn alone where mirror images are apart."""
    schedule = pcmc.panels(squares, 1e-7, mirror_images=mirror_images)
    label = orbits(squares, maps)
    assert set(np.unique(label, return_counts=True)[1]) == {size}
    assert schedule.count == schedule.at_least == len(np.unique(label)) == 256 // size
    pairs = set(zip(schedule.panels["family"], label, strict=True))
    assert len(pairs) == schedule.count
    assert (schedule.families["count"] == size).all()


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("tolerance", [1e-6, 0.004, 0.02, 0.3, 50.0])
def test_panels_of_a_family_differ_by_at_most_the_tolerance(caps, apart, tolerance):
    lengths = edge_lengths(caps)
    parts = triangle_families(lengths, tolerance, apart)
    orders = {tuple(order) for order in parts.order.tolist()}
    assert orders <= {tuple(order) for order in (TURNS if apart else TURNS + TURNED_OVER)}
    aligned = np.take_along_axis(lengths, parts.order, axis=1)
    for k in range(parts.family.max() + 1):
        assert np.ptp(aligned[parts.family == k], axis=0).max() <= tolerance
    assert parts.at_least <= parts.family.max() + 1


def test_no_two_of_the_incompatible_triangles_could_share_a_family():
    """The bound from below, by brute force: the largest clique is at least as large as ours."""
    lengths = np.random.default_rng(3).uniform(1.0, 1.2, (12, 3))
    for apart in (False, True):
        orders = TURNS if apart else TURNS + TURNED_OVER
        least = np.min([np.abs(lengths[:, None] - lengths[None, :, o]).max(axis=2) for o in orders], axis=0)
        clique = 0
        for chosen in range(1 << 12):
            members = [k for k in range(12) if chosen >> k & 1]
            if all(least[i, j] > 0.08 for i in members for j in members if i < j):
                clique = max(clique, len(members))
        parts = triangle_families(lengths, 0.08, apart)
        assert 1 < parts.at_least <= clique <= parts.family.max() + 1


def test_families_depend_neither_on_the_order_of_faces_nor_on_their_first_corner(caps):
    lengths = edge_lengths(caps)
    order = np.random.default_rng(0).permutation(len(lengths))
    turn = np.random.default_rng(1).integers(3, size=len(lengths))
    turned = np.take_along_axis(lengths, (np.arange(3) + turn[:, None]) % 3, axis=1)
    for apart, tolerance in product((False, True), (0.01, 0.03, 0.1)):
        before = triangle_families(lengths, tolerance, apart)
        after = triangle_families(turned[order], tolerance, apart)
        assert np.array_equal(before.family[order], after.family)
        assert before.at_least == after.at_least


@pytest.mark.parametrize("tolerance", [0.003, 0.1])
def test_a_roof_that_is_turned_has_the_same_schedule(tolerance):
    """Symmetric, so that many lengths are equal but for rounding. Before, families had other numbers, and
    panels with two equal edges were "turned over" as it fell out."""
    roof = pcmc.solve(spherical_cap(0.25)).surface
    before = pcmc.panels(roof, tolerance)
    assert not before.panels.loc[np.isclose(before.panels["a"], before.panels["b"]), "mirrored"].any()
    rng = np.random.default_rng(0)
    for _ in range(4):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        lengths = np.linalg.norm(edge_vectors((roof.vertices @ turn)[roof.faces]), axis=2)
        after = triangle_families(lengths, tolerance)
        assert np.array_equal(before.panels["family"], after.family + 1)
        sizes = np.take_along_axis(lengths, after.order, axis=1)
        assert before.panels[["a", "b", "c"]].to_numpy() == pytest.approx(sizes, abs=1e-9)


def test_a_fine_tolerance_does_not_part_equal_lengths():
    """Rounded to 1e-9 of it, lengths that differ by rounding alone fell to both sides of a step."""
    outline, divider = [[0, 0], [12, 0], [12, 8], [0, 8]], [[4, 0], [4, 8]]
    roof = Plan(outline, [divider], edge_length=1.0, tension=5.0).surface()
    before = triangle_families(edge_lengths(roof), 1e-4, apart=True).family
    rng = np.random.default_rng(0)
    for _ in range(4):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        after = triangle_families(edge_lengths(roof.moved(roof.vertices @ turn)), 1e-4, apart=True).family
        assert np.array_equal(before, after)


def test_a_row_of_triangles_needs_as_few_families_as_intervals():
    """Along a line the fewest cubes are known: 11 lengths, 0.1 apart, in steps of 0.25, take 3 at a time."""
    lengths = np.stack([np.full(11, 3.0), np.full(11, 4.0), 5.0 + 0.1 * np.arange(11)], axis=1)
    assert triangle_families(lengths, 0.25).family.max() + 1 == 4


def test_the_search_leaves_fewer_families_than_the_sweeps():
    """Triangles of families that are dissolved go into those that stay: 10, and 11 where none does."""
    lengths = np.random.default_rng(3).uniform(1.0, 1.4, (80, 3))
    assert triangle_families(lengths, 0.1).family.max() + 1 == 10


def test_areas_add_up_and_flat_panels_are_congruent_to_their_faces(caps):
    schedule = pcmc.panels(caps, 0.01)
    faces = caps.faces[schedule.panels["face"]]
    areas = face_areas(caps.vertices[faces])
    assert abs(schedule.area - areas.sum()) <= 1e-9 * areas.sum()
    assert abs(schedule.families["area"].sum() - areas.sum()) <= 1e-9 * areas.sum()
    for one, other in ((0, 1), (1, 2), (2, 0)):
        flat = np.linalg.norm(schedule.flat[:, one] - schedule.flat[:, other], axis=1)
        solid = np.linalg.norm(caps.vertices[faces[:, one]] - caps.vertices[faces[:, other]], axis=1)
        assert np.abs(flat - solid).max() <= 1e-9
    first, second = schedule.flat[:, 1] - schedule.flat[:, 0], schedule.flat[:, 2] - schedule.flat[:, 0]
    assert (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] > 0.0).all()  # outside up
    assert (schedule.families["spread"] <= 0.01).all()
    assert schedule.families["count"].sum() == len(schedule.panels) == len(faces)


def test_edges_are_counted_once_and_walls_are_no_panels_by_default(squares):
    schedule = pcmc.panels(squares, 0.01)
    totals = schedule.edge_totals.set_index("kind")
    assert abs(totals.loc["boundary", "length"] - 24.0) <= 1e-9  # three sides of two squares of side 4
    junction = squares.topology.junctions[0].vertices
    length = np.linalg.norm(np.diff(squares.vertices[junction], axis=0), axis=1).sum()
    assert abs(totals.loc["junction", "length"] - length) <= 1e-12
    assert set(schedule.panels["patch"]) == {"left", "right"}
    assert "wall" in set(pcmc.panels(squares, 0.01, walls=True).panels["patch"])
    assert np.isnan(schedule.family_of_face[squares.walls[squares.patch_of_face]]).all()


def hipped():
    """Panels with edges 4, 3, 3 and 2, 3, 3 in turn, over a rectangle of 4 on 2."""
    corners = [[2, 1, 0], [-2, 1, 0], [-2, -1, 0], [2, -1, 0], [0, 0, 2]]
    faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    return Surface(corners, faces, [0] * 4, [Patch("hip", 1.0)], fixed=range(4))


def test_the_schedule_prints_the_numbers_of_a_hipped_roof():
    """Areas 2 √5 and 2 √2; between the planes of two neighbours cos = -1/√10."""
    schedule = pcmc.panels(hipped(), 0.1, anyway=True)
    text = str(schedule)
    assert "panels  4 in 2 families, at least 2 are needed" in text
    assert "  area  14.601126" in text
    assert "largest panel  1 of patch 'hip': 3 × 3 × 4, area 4.472" in text
    assert "smallest panel  2 of patch 'hip': 2 × 3 × 3, area 2.828" in text
    assert "edges  24 long: boundary 12 (4), inside 12 (4)" in text
    assert "angles  108.4 to 108.4 degrees between neighbours" in text
    assert "tolerance  0.1, mirror images alike" in text
    words = panel_text(schedule, Units("m"))
    assert "4 flat triangles in 2 families" in words
    assert "by at most 0.1 m in the length of each edge" in words
    assert "an area of 14.60 m², and edges of 24.00 m." in words
    assert "The largest has 4.472 m², the smallest 2.828 m²." in words
    assert "from 108.4° to 108.4°" in words
    assert "more families" not in text
    assert "The table has" not in words


def test_a_family_has_the_middle_of_its_panels_lengths():
    (family,) = pcmc.panels(hipped(), 1.0, anyway=True).families.to_dict("records")
    assert (family["count"], family["mirrored"], family["spread"]) == (4, 0, 1.0)
    assert [family[name] for name in "abc"] == [2.5, 3.0, 3.5]
    assert family["area"] == pytest.approx(4.0 * 5.0**0.5 + 4.0 * 2.0**0.5, rel=1e-14)


def test_the_text_of_many_families_tells_how_many_are_not_shown(squares):
    schedule = pcmc.panels(squares, 1e-7)
    assert schedule.count > MOST_FAMILIES > 12
    assert str(schedule).count("\n... ") == 1
    assert f"\n... {schedule.count - 12} more families" in str(schedule)
    assert f"The table has the {MOST_FAMILIES} largest families." in panel_text(schedule, Units("m"))


def test_angles_of_a_cube_and_around_an_edge_of_three():
    fold = [[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, 0, 1]]  # opens upwards: 90 on the upper side
    two = [Patch("p", 1.0), Patch("q", 1.0)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        valley = Surface(fold, [[0, 1, 2], [1, 0, 3]], [0, 0], [Patch("p", 1.0)], fixed=range(4))
        star = Surface(
            [*fold, [0.5, -1, 0]],
            [[0, 1, 2], [1, 0, 3], [1, 0, 4]],
            [0, 0, 1],
            two,
            fixed=range(5),
        )
    angles = pcmc.panels(valley, 1.0, anyway=True).edges["dihedral"].dropna()
    assert angles.tolist() == pytest.approx([270.0])
    around = pcmc.panels(star, 1.0, anyway=True).edges.dropna()
    assert around["dihedral"].tolist() == pytest.approx([180.0, 90.0, 90.0])
    assert around[["panel", "neighbour"]].to_numpy().tolist() == [[1, 3], [3, 2], [2, 1]]


def test_the_optimiser_lowers_the_number_of_families_and_stays_at_rest(squares):
    before = pcmc.panels(squares, 0.01)
    result = pcmc.fewer_families(squares, 0.01, 0.02)
    assert result.before.count == before.count
    assert result.after.count < before.at_least  # no sorting of the panels before has so few
    assert result.after.certificate.certified
    assert result.after.certificate.curvature_error < 1e-8
    assert 0.0 < result.change < 0.02
    assert result.change < 0.2 * result.moved  # along the shape
    moved = result.surface.vertices
    assert np.array_equal(moved[squares.fixed], squares.vertices[squares.fixed])
    corners = np.unique(squares.faces[before.panels["face"]])
    faces = squares.faces[before.panels["face"]]
    assert distances(moved[corners], squares.vertices, faces).max() == result.change


def test_the_optimiser_without_rest_reports_what_it_costs(squares):
    result = pcmc.fewer_families(squares, 0.02, 0.005, at_rest=False, rounds=6)
    assert result.after.count < result.before.count
    assert 0.0 < result.change <= 0.005
    assert result.after.certificate.curvature_error > 1e-4 > result.before.certificate.curvature_error
    assert "not_converged" in str(result)


def test_ctrl_c_in_the_solve_of_a_round_ends_the_search(squares, monkeypatch):
    def stopped(surface, **options):
        return replace(pcmc.solvers.solve_once(surface, **options), status=Status.STOPPED)

    monkeypatch.setattr("pcmc.panelling.fewer.solve_once", stopped)
    with pytest.raises(KeyboardInterrupt):
        pcmc.fewer_families(squares, 0.01, 0.02)


def test_too_little_room_leaves_the_surface_as_it_is(squares):
    seen = []
    result = pcmc.fewer_families(squares, 0.01, 1e-9, callback=lambda *row: seen.append(row))
    assert result.surface is squares
    assert result.change <= 1e-12
    assert [row[0] for row in seen] == list(range(1, result.rounds + 1))


def test_distances_from_a_triangle_by_brute_force():
    random = np.random.default_rng(5)
    X, points = random.normal(size=(3, 3)), random.normal(size=(40, 3)) * 2.0
    u = np.linspace(0.0, 1.0, 200)
    s, t = (grid.ravel() for grid in np.meshgrid(u, u))
    inside = X[0] + (s * (1 - t))[:, None] * (X[1] - X[0]) + t[:, None] * (X[2] - X[0])
    near = np.linalg.norm(points[:, None] - inside, axis=2).min(axis=1)
    exact = distances(points, X, np.array([[0, 1, 2]]))
    assert (exact <= near + 1e-12).all()
    assert (near - exact).max() < 0.02


@pytest.mark.parametrize("tolerance", [0, -1.0, float("nan"), float("inf"), "1"])
def test_a_tolerance_that_is_no_length_is_refused(squares, tolerance):
    with refused(OptionError, what="tolerance"):
        pcmc.panels(squares, tolerance)


def test_other_bad_input_is_refused(squares):
    with refused(OptionError, what="mirror_images", found="alik"):
        pcmc.panels(squares, 0.1, mirror_images="alik")
    with refused(OptionError, what="change", found=0.0):
        pcmc.fewer_families(squares, 0.1, 0.0)
    with refused(OptionError, what="rounds", found=0):
        pcmc.fewer_families(squares, 0.1, 0.1, rounds=0)
    with refused(SurfaceError, what="surface"):
        pcmc.panels(None, 0.1)


def test_a_surface_that_is_not_certified_is_refused_or_marked():
    start = two_squares(4, alpha_aux=1.0)
    with refused(SurfaceError, what="surface", expected="a certified surface"):
        pcmc.panels(start, 0.1)
    assert "not certified" in str(pcmc.panels(start, 0.1, anyway=True))


def test_walls_alone_have_no_panels():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        film = Surface(
            [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
            [[0, 1, 2]],
            [0],
            [Patch("w", 1.0, 0.0, wall=True)],
            fixed=range(3),
        )
    with refused(SurfaceError, what="surface", found=0):
        pcmc.panels(film, 0.1, anyway=True)
    assert len(pcmc.panels(film, 0.1, walls=True, anyway=True).panels) == 1


def test_the_command_writes_schedule_surface_and_picture(tmp_path, squares, capsys):
    roof, table, fewer = tmp_path / "roof.pcmc", tmp_path / "s.csv", tmp_path / "fewer.pcmc"
    pcmc.write(roof, squares)
    options = ["--tolerance", "0.02", "--change", "0.02", "-o", str(table), "-o", str(fewer)]
    assert main(["panels", str(roof), *options, "--picture", str(tmp_path / "s.png")]) == 0
    said = capsys.readouterr().out
    assert "families" in said
    assert "units" not in said
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"roof.pcmc", "s.csv", "s-families.csv", "s-edges.csv", "fewer.pcmc", "s.png"}
    written = np.loadtxt(table, delimiter=",", skiprows=1, usecols=(5, 6, 7))
    again = pcmc.panels(pcmc.read(fewer), 0.02)
    assert np.array_equal(written, again.panels[["a", "b", "c"]].to_numpy())


@pytest.mark.nightly
def test_the_curve_of_families_against_change_of_shape_has_its_costs(tmp_path, squares, capsys):
    fewer = pcmc.fewer_families(squares, 0.01, 0.02)
    assert fewer.steps.iloc[0].tolist() == [fewer.before.count, 0.0]
    assert fewer.steps.iloc[-1].tolist() == [fewer.after.count, fewer.change]
    assert (np.diff(fewer.steps, axis=0) * [-1, 1] > 0).all()  # fewer families for more change
    costs = fewer.costs(100.0, 20.0)
    assert (costs["cost"] == 100.0 * costs["families"] + 20.0 * len(fewer.after.panels)).all()
    assert costs["cheapest"].tolist() == [False] * (len(costs) - 1) + [True]
    assert fewer.costs(0.0, 20.0)["cheapest"].tolist() == [True] + [False] * (len(costs) - 1)
    halved = fewer.steps.iloc[len(fewer.steps) // 2]
    again = pcmc.fewer_families(squares, 0.01, halved["change"])
    assert again.change <= halved["change"]
    assert again.after.count < fewer.before.count
    roof, table = tmp_path / "roof.pcmc", tmp_path / "s.csv"
    pcmc.write(roof, squares)
    options = ["--tolerance", "0.01", "--change", "0.02", "--cost", "100,20", "-o", str(table)]
    assert main(["panels", str(roof), *options]) == 0
    assert re.search(rf"{fewer.after.count} +\S+ +\S+ cheapest", capsys.readouterr().out)
    assert pd.read_csv(tmp_path / "s-costs.csv")["cost"].tolist() == pytest.approx(costs["cost"].tolist())
    assert (tmp_path / "s-costs.svg").read_text().count("the cheapest") == 1
    for bad, words in (
        (["--change", "0.02", "--cost", "100"], "two numbers FAMILY,PANEL"),
        (["--change", "0.02", "--cost=-1,2"], "--cost: expected a finite number ≥ 0, found -1.0"),
        (["--cost", "1,2"], "--cost: prices what --change finds"),
    ):
        assert main(["panels", str(roof), "--tolerance", "0.01", *bad]) == 2
        assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    "options",
    [
        ["--tolerance", "0"],
        ["--tolerance", "nan"],
        ["--tolerance", "-1"],
        ["--tolerance", "0.1", "--change", "0"],
        ["--tolerance", "0.1", "-o", "{}/s.xlsx"],
        ["--tolerance", "0.1", "-o", "{}/no/s.csv"],
        ["--tolerance", "0.1"],  # it is not certified
    ],
)
def test_the_command_refuses_bad_input_in_one_line(tmp_path, capsys, options):
    start = tmp_path / "start.pcmc"
    pcmc.write(start, two_squares(4, alpha_aux=1.0))
    assert main(["panels", str(start), *(text.format(tmp_path) for text in options)]) == 2
    assert capsys.readouterr().err.strip().count("\n") == 0
    assert {path.name for path in tmp_path.iterdir()} == {"start.pcmc"}


@pytest.mark.nightly
def test_the_study_compares_families_before_and_after(tmp_path):
    perform(panel_families.STUDY, tmp_path, short=True)
    records = pd.read_csv(tmp_path / "panels" / "families.csv")
    assert (records["after"] < records["before"]).all()
    assert records["verdict_after"].tolist() == ["stable", "not_converged"]
    assert {path.name for path in (tmp_path / "panels").glob("*.png")} == {"families.png", "example-1.png"}
