"""The certificate: its numbers against their definitions and closed forms."""

from unittest import mock

import numpy as np
import pandas as pd
import pytest
from shapes import pyramid, shaken, three_patches
from starts import double_bubble, four_fans, joined_caps, sphere, spherical_cap, two_squares

from generators import spherical_cap_exact
from pcmc import Patch, Surface, certify, curvature_error, energy, gradient, mean_curvature, solve
from pcmc.certificate import Verdict
from pcmc.certificate.forces import Forces, sheet_pulls
from pcmc.certificate.tables import lean_texts
from pcmc.forces.functional import patch_areas, volume
from pcmc.forces.pinching import standing_part
from pcmc.meshing.quality import triangle_quality
from pcmc.plan import Divider, Plan
from pcmc.stability.equilibrium import Equilibrium

pytestmark = pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")


@pytest.fixture(scope="module")
def squares():
    return solve(two_squares(6, alpha_aux=1.0))


def test_a_roof_at_rest(squares):
    surface, found = squares.surface, squares.certificate
    assert found.verdict is Verdict.STABLE
    assert found.certified
    assert found.detail == ""
    assert found.index == 0
    assert found.eigenvalues[0] > 0.0
    assert found.residual < 1e-10
    assert found.energy == pytest.approx(energy(surface), rel=1e-14)
    assert found.volume == pytest.approx(volume(surface), rel=1e-14)
    assert found.curvature_error < 1e-9
    assert len(found.pinched) == 0


def test_the_middle_of_a_curve_is_0_where_it_is_rounding(squares):
    """The junction is x = 0 and symmetric in y = 0; so are the heights of its two ends."""
    (row,) = squares.certificate.junctions.to_dict("records")
    assert (row["middle_x"], row["middle_y"]) == (0.0, 0.0)
    apex = squares.surface.vertices[squares.surface.topology.junctions[0].vertices, 2].max()
    assert row["middle_z"] == pytest.approx(apex, rel=1e-12)


def test_a_wall_that_is_pinched_all_along_has_no_bad_triangle():
    found = solve(two_squares(4, alpha=2.0, alpha_aux=6.0), target="stationary").certificate
    (quality,) = found.patches.quality[found.patches.patch == "wall"]
    assert (found.verdict, quality) == (Verdict.STABLE, 1.0)


def test_walls_that_lean_are_told_the_worst_first():
    rows = [["a", 3.0, 0, 0, 1], ["b", 0.04, 0, 0, 1], ["c", 7.25, 1.5, 0, 2]]
    table = pd.DataFrame(rows, columns=["wall", "lean", *"xyz"])
    assert lean_texts(table, 3.0) == ["'c' by 7.2° near (1.5, 0, 2)", "'a' by 3.0° near (0, 0, 1)"]
    assert lean_texts(table.iloc[:0], 3.0) == []


def test_the_rows_of_the_patches(squares):
    surface, table = squares.surface, squares.certificate.patches.set_index("patch")
    assert list(table.index) == ["left", "right", "wall"]
    np.testing.assert_allclose(table["area"], patch_areas(surface), rtol=1e-14)
    assert table["tension"].tolist() == [2.0, 2.0, 1.0]
    assert table["target"].tolist() == [0.25, 0.25, 0.0]
    quality = triangle_quality(surface.vertices, surface.faces)
    for name in table.index:
        faces = surface.patch_of_face == surface.patch_index(name)
        assert table.quality[name] == quality[faces].min()
    for method in ("variational", "cotangent"):
        error = np.abs(curvature_error(surface, method))
        inside = np.zeros(surface.n, dtype=bool)
        inside[surface.faces[surface.patch_of_face == 0]] = True
        error = error[inside & np.isfinite(error)]
        assert table[f"{method}_max"]["left"] == error.max()
        assert table[f"{method}_mean"]["left"] == pytest.approx(error.mean(), rel=1e-12)
        assert np.isnan(table[f"{method}_max"]["wall"])  # relative to zero there is none
    assert table["variational_max"]["left"] < 1e-9 < table["cotangent_max"]["left"] < 0.03
    assert table["mean_H"]["right"] == pytest.approx(0.25, abs=1e-9)
    mean = mean_curvature(surface, "variational")
    assert squares.certificate.curvature_error == pytest.approx(
        np.nanmax(np.abs(curvature_error(surface, "variational")))
    )
    assert np.nanmax(np.abs(mean)) < 0.26


def test_the_numbers_and_the_printed_table(squares):
    found = squares.certificate
    numbers = found.numbers()
    assert numbers["verdict"] == "stable"
    assert numbers["index"] == 0
    assert numbers["lowest_eigenvalue"] == found.eigenvalues[0]
    assert numbers["curvature_error_cotangent"] == found.patches["cotangent_max"].max()
    assert numbers["pinched"] == 0
    assert all(isinstance(value, str | int | float) for value in numbers.values())
    text = str(found)
    for word in ("stable: at rest", "residual", "Morse index", "left | right | wall", "per_length_max"):
        assert word in text
    assert max(map(len, text.splitlines())) < 130
    assert len(text.splitlines()) < 30


def three_sheets(tensions, angles):
    """Flat sheets of four triangles each that meet along the x axis, at these angles."""
    X = [np.array([x, 0.0, 0.0]) for x in (0, 0.5, 1)]
    F, patch = [], []
    for k, angle in enumerate(angles):
        i = len(X)
        X += [[x, np.cos(angle), np.sin(angle)] for x in (0, 0.5, 1)]
        F += [[0, i, i + 1], [0, i + 1, 1], [1, i + 1, i + 2], [1, i + 2, 2]]
        patch += [k] * 4
    patches = [Patch(f"sheet {k}", alpha, pressure=0.0) for k, alpha in enumerate(tensions)]
    return Surface(X, F, patch, patches, fixed=[0, 2, *range(3, len(X))])


def test_conormals_add_up_with_their_tensions():
    """Σ α n with n outwards from each sheet, so minus the direction in which the sheet lies."""
    angles = np.array([0.3, 2.0, 4.4])
    tensions = np.array([1.0, 2.5, 0.7])
    surface = three_sheets(tensions, angles)
    expected = -np.stack([0 * angles, np.cos(angles), np.sin(angles)], axis=1).T @ tensions
    junction = surface.topology.edges[surface.topology.junction_edge]
    assert len(junction) == 2
    np.testing.assert_allclose(sheet_pulls(surface, junction), [expected, expected], atol=1e-14)
    row = certify(surface).junctions.iloc[0]
    assert row["junction"] == "sheet 0 | sheet 1 | sheet 2"
    assert row["length"] == 1.0
    assert row["sum_alpha_n_mean"] == pytest.approx(np.linalg.norm(expected))
    assert row["sum_alpha_n_max"] == pytest.approx(np.linalg.norm(expected))
    # each side of the middle vertex pulls it with ½ α times the edge
    assert row["force_left"] == pytest.approx(np.linalg.norm(expected))


def test_conormals_balance_at_120_degrees():
    surface = three_sheets([2.0] * 3, np.array([0, 2, 4]) * np.pi / 3)
    row = certify(surface).junctions.iloc[0]
    assert row["sum_alpha_n_max"] < 1e-14
    assert row["force_left"] < 1e-13


def test_the_exact_bubbles_balance_as_the_mesh_is_refined():
    left = [
        certify(double_bubble(edge, exact=True), modes=0).junctions["sum_alpha_n_mean"].max()
        for edge in (0.8, 0.4, 0.2)
    ]
    assert left[0] < 0.5
    assert left[2] < 0.35 * left[0]
    assert left[1] < 0.6 * left[0]


def test_modes_are_fields_that_one_can_move_along():
    surface = solve(joined_caps(1.0, alpha_left=4, alpha_right=4, alpha_aux=1, depth=5), target="stationary")
    assert surface.converged
    surface = surface.surface
    found = certify(surface, modes=3)
    assert found.verdict is Verdict.SADDLE
    assert found.detail.startswith("index 1")
    assert not found.certified
    assert found.modes.shape == (3, surface.n, 3)
    assert (np.diff(found.eigenvalues) >= 0.0).all()
    assert found.eigenvalues[0] < 0.0 < found.eigenvalues[1]
    t = 1e-3 * surface.size / np.abs(found.modes[0]).max()
    for k, value in enumerate(found.eigenvalues[:2]):
        mode = t * found.modes[k]
        rise = sum(energy(surface.moved(surface.vertices + s * mode)) for s in (1, -1)) - 2 * energy(surface)
        assert rise == pytest.approx(value * t**2, rel=0.02)  # E'' along the mode is λ
    assert certify(surface, modes=0).index == 1
    assert len(certify(surface, modes=0).eigenvalues) == 0


def test_what_nothing_holds_has_no_reactions():
    found = solve(sphere(1.0), target="stationary").certificate
    assert found.verdict is Verdict.SADDLE
    assert found.index == 1
    assert len(found.boundaries) == len(found.junctions) == 0
    assert not found.reactions.any()


def test_reactions_are_where_supports_are(squares):
    surface, found = squares.surface, squares.certificate
    assert found.reactions.shape == (surface.n, 3)
    assert not found.reactions[surface.free].any()
    normal = np.array(surface.plane.normal)
    sliding = found.reactions[surface.on_plane]
    np.testing.assert_allclose(sliding, (sliding @ normal)[:, None] * normal, atol=1e-14)
    total = found.boundaries[["reaction_x", "reaction_y", "reaction_z"]].sum()
    np.testing.assert_allclose(total, found.reactions.sum(axis=0), atol=1e-12)
    np.testing.assert_allclose(total[:2], 0.0, atol=1e-9)


def test_curves_of_one_name_are_told_apart_by_their_middles():
    """Three bays: the middle one has a boundary on either side."""
    walls = [Divider([[x, 0], [x, 4]]) for x in (4, 8)]
    outline = [[0, 0], [12, 0], [12, 4], [0, 4]]
    found = certify(Plan(outline, walls, edge_length=1.0, tension=3.0).surface())
    middles = ["middle_x", "middle_y", "middle_z"]
    bay = found.boundaries[found.boundaries["boundary"] == "patch 2"]
    assert sorted(map(tuple, bay[middles].round(9).to_numpy())) == [(6, 0, 0), (6, 4, 0)]
    assert found.junctions["middle_x"].round(9).tolist() == [4, 8]
    assert found.junctions["middle_y"].round(9).tolist() == [2, 2]
    assert (found.junctions["middle_z"] > 0.3).all()
    assert "middle_x" in str(found)


def test_the_middle_of_a_closed_curve_is_its_centre():
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) @ np.diag([3.0, 1.0]) + [5.0, 7.0]
    row = certify(Plan(corners, edge_length=1.0, tension=3.0).surface()).boundaries.iloc[0]
    assert row[["middle_x", "middle_y", "middle_z"]].tolist() == pytest.approx([5, 7, 0])


def test_supports_carry_the_whole_load_and_the_tension_of_the_rim():
    surface = solve(spherical_cap(0.1, alpha=0.6)).surface
    found = certify(surface)
    corners = surface.vertices[surface.faces]
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    # not to rounding: along the surface, vertices are not at rest
    np.testing.assert_allclose(found.reactions.sum(axis=0), -area, atol=5e-4 * area[2])
    assert found.boundaries["per_length_max"][0] == pytest.approx(0.6, rel=2e-3)


def test_the_standing_part_is_computed_once_for_each_surface():
    surface = solve(two_squares(6, alpha_aux=3.0)).surface
    part = standing_part(surface)
    assert part.surface.m < surface.m
    with mock.patch("pcmc.forces.pinching.find_walls", side_effect=AssertionError):
        certify(surface)
        Forces.of(surface)
        assert standing_part(surface) is part
    moved = surface.moved(two_squares(6, alpha_aux=3.0).vertices)
    assert standing_part(moved).surface is moved


@pytest.mark.parametrize("make", [four_fans, two_squares])
def test_the_morse_index_alone_is_that_of_the_certificate(make):
    surface = solve(make(5), target="stationary").surface
    assert Equilibrium.of(surface).factorised().negative == certify(surface).index


def test_the_certificate_sees_walls_apart():
    surface = shaken(three_patches(), 0.01)
    found = certify(surface)
    quality = triangle_quality(surface.vertices, surface.faces)
    walls = surface.pressures[surface.patch_of_face] == 0.0
    assert found.quality == quality[~walls].min()
    assert found.walls_quality == quality[walls].min()


def test_the_residual_is_relative_to_the_tension_forces():
    surface = pyramid(1.5, height=0.6)
    found = certify(surface)
    assert found.residual == pytest.approx(np.linalg.norm(gradient(surface)) / found.scale)
    exact = spherical_cap_exact()
    assert certify(spherical_cap(0.125, exact=True)).energy == pytest.approx(exact.energy, rel=2e-3)
