"""The certificate: its numbers against their definitions and closed forms, and every verdict."""

from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from scipy.optimize import brentq
from shapes import pyramid, shaken, three_patches
from starts import double_bubble, four_fans, joined_caps, sphere, spherical_cap, two_squares

from generators import spherical_cap_exact
from pcmc import Patch, Surface, certify, curvature_error, energy, gradient, mean_curvature, solve
from pcmc.certificate import Evidence, Verdict
from pcmc.certificate.balance import coarseness, conormal_sum, load_ratio, reactions_per_length
from pcmc.certificate.verdict import Findings, judge
from pcmc.contact.pinching import standing_part
from pcmc.energy.functional import patch_areas, volume
from pcmc.meshing.quality import triangle_quality
from pcmc.plan import Divider, Plan
from pcmc.solvers.result import Status
from pcmc.stability.modes import morse_index

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
    for word in (
        "stable: at rest",
        "residual",
        "Morse index",
        "left | right | wall",
        "per_length_max",
    ):
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
    sums = conormal_sum(surface)
    expected = -np.stack([0 * angles, np.cos(angles), np.sin(angles)], axis=1).T @ tensions
    junction = surface.topology.junction_edge
    assert junction.sum() == 2
    np.testing.assert_allclose(sums[junction], [expected, expected], atol=1e-14)
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
    surface = solve(
        joined_caps(1.0, alpha_left=4, alpha_right=4, alpha_aux=1, depth=5), target="stationary"
    )
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
        rise = sum(
            energy(surface.moved(surface.vertices + s * mode)) for s in (1, -1)
        ) - 2 * energy(surface)
        assert rise == pytest.approx(value * t**2, rel=0.02)  # E'' along the mode is λ
    assert certify(surface, modes=0).index == 1
    assert len(certify(surface, modes=0).eigenvalues) == 0


@pytest.mark.parametrize("surface", [shaken(pyramid(), 0.2), two_squares(4), four_fans(4)])
def test_forces_left_are_not_converged(surface):
    found = certify(surface)
    assert found.verdict is Verdict.NOT_CONVERGED
    assert found.index is None
    assert len(found.eigenvalues) == len(found.modes) == 0
    assert f"{found.residual:.1e}" in found.detail
    assert found.numbers()["lowest_eigenvalue"] is None
    assert "Morse index  -" in str(found)


def test_the_tolerance_decides():
    surface = solve(two_squares(4), iterations=3).surface
    residual = certify(surface).residual
    assert 1e-12 < residual < 0.1
    assert certify(surface, tolerance=2 * residual).verdict is Verdict.STABLE
    assert certify(surface, tolerance=0.5 * residual).verdict is Verdict.NOT_CONVERGED


def test_a_neutral_surface():
    """Walls that meet over a disc: at some tension of theirs a sideways shift costs nothing."""

    def lowest(alpha_aux):
        found = solve(four_fans(4, alpha_aux=alpha_aux), target="stationary").certificate
        return found.eigenvalues[0]

    assert lowest(2.0) > 0.0 > lowest(4.0)
    critical = brentq(lowest, 2.0, 4.0, xtol=1e-3)
    found = solve(four_fans(4, alpha_aux=critical), target="stationary").certificate
    assert found.index in (0, 2)
    near = solve(four_fans(4, alpha_aux=critical - 2e-3), target="stationary").certificate
    assert near.verdict is Verdict.NEUTRAL
    assert near.certified
    assert "softest mode" in near.detail


def beside_a_stiff_cap(soft: Surface, times: float) -> Surface:
    """The cap and, three away, one at rest that is so many times as stiff."""
    stiff = solve(spherical_cap(0.25, alpha=0.6 * times)).surface
    patches = [Patch("soft", 0.6), Patch("stiff", 0.6 * times)]
    return Surface(
        np.concatenate([soft.vertices, stiff.vertices + np.array([3.0, 0.0, 0.0])]),
        np.concatenate([soft.faces, soft.n + stiff.faces]),
        np.repeat([0, 1], [soft.m, stiff.m]),
        patches,
        fixed=np.concatenate([soft.fixed, stiff.fixed]),
    )


def test_a_mode_is_soft_beside_the_tension_of_what_it_moves():
    """Not beside that of another part, or of a wall that is down: both used to make it neutral."""
    cap = solve(spherical_cap(0.25))
    found = certify(beside_a_stiff_cap(cap.surface, 1e6))
    assert found.eigenvalues[0] == pytest.approx(cap.certificate.eigenvalues[0], rel=1e-9)
    assert found.verdict is Verdict.STABLE
    down = solve(two_squares(6, alpha_aux=3e3)).certificate
    assert len(down.pinched) == 5
    assert down.verdict is Verdict.STABLE


def test_strong_forces_do_not_hide_what_a_weak_patch_lacks():
    found = certify(beside_a_stiff_cap(spherical_cap(0.25), 1e8))
    assert found.residual < 1e-8
    assert found.curvature_error > 0.1
    assert found.verdict is Verdict.NOT_CONVERGED
    assert found.detail.startswith("the forces left in patch 'soft' are 9.7e-02 of its own")
    both = solve(beside_a_stiff_cap(spherical_cap(0.25), 1e8), tolerance=1e-18)
    assert both.certificate.verdict is Verdict.STABLE


def test_no_equilibrium_from_the_load_alone():
    found = certify(spherical_cap(0.25, alpha=0.45))
    assert found.load_ratio == pytest.approx(1.0 / 0.9, rel=0.03)
    assert found.verdict is Verdict.NO_EQUILIBRIUM
    assert f"{found.load_ratio:.2f} times what the boundary's tension could carry" in found.detail
    huge = certify(spherical_cap(0.25, alpha=1e-40)).detail
    assert huge == "the pressure is 4.96e+39 times what the boundary's tension could carry"
    assert certify(spherical_cap(0.25, alpha=0.55)).verdict is Verdict.NOT_CONVERGED


@pytest.mark.parametrize("alpha", [0.6, 1.0])
def test_the_load_ratio_of_a_disc_is_its_radius_over_twice_the_tension(alpha):
    surface = spherical_cap(0.1, alpha=alpha, exact=True)
    assert load_ratio(surface) == pytest.approx(0.5 / alpha, rel=2e-3)
    assert load_ratio(double_bubble(0.8)) == 0.0


def test_what_is_fixed_inside_carries_too():
    """A ring that holds a cap half way lets it stand below the tension of the hemisphere."""
    cap = spherical_cap(0.1, alpha=0.45)
    away = np.hypot(*cap.vertices.T[:2])
    ring = np.abs(away - 0.5) < 0.03
    held = Surface(cap.vertices, cap.faces, cap.patch_of_face, cap.patches, fixed=cap.fixed | ring)
    assert load_ratio(cap) == pytest.approx(1.0 / 0.9, rel=3e-3)
    both_sides = 2.0 * away[ring].mean()
    assert load_ratio(held) == pytest.approx(1.0 / 0.9 / (1.0 + both_sides), rel=5e-3)
    assert certify(held).verdict is Verdict.NOT_CONVERGED
    assert solve(held).certificate.verdict is Verdict.STABLE
    column = Surface(
        cap.vertices, cap.faces, cap.patch_of_face, cap.patches, fixed=cap.fixed | (away == 0)
    )
    star = np.linalg.norm(cap.vertices[1] - cap.vertices[2])
    carried = 0.45 * (2.0 * np.pi + 0.5 * 6.0 * star)
    assert load_ratio(column) == pytest.approx(np.pi / carried, rel=4e-3)


def test_a_load_just_above_what_tension_carries_is_no_proof_on_a_coarse_mesh():
    """The smooth cap ends at α = 1/2; that of edge length 0.2 is still there a little below."""
    surface = spherical_cap(0.2, alpha=0.495)
    assert 1.0 < load_ratio(surface) < 1.0 + coarseness(surface) < 1.1
    before = certify(surface)
    assert before.verdict is Verdict.NOT_CONVERGED
    assert f"{before.load_ratio:.3f} times what the boundary's tension could carry" in before.detail
    after = solve(surface)
    assert after.converged
    assert after.certificate.verdict is Verdict.STABLE
    assert after.certificate.load_ratio > 1.0


def test_coarseness_falls_with_the_square_of_the_edge_length():
    coarse, fine = coarseness(spherical_cap(0.2)), coarseness(spherical_cap(0.1))
    assert coarse == pytest.approx(0.04, rel=0.15)
    assert coarse / fine == pytest.approx(4.0, rel=0.15)
    assert coarseness(double_bubble(0.8)) == 0.0
    assert coarseness(pyramid(0.4)) > 0.5  # at rest down to α = 1/3, where the ratio is 1.5


def test_without_any_tension_every_shape_is_at_rest():
    slack = pyramid().retensioned({"roof": 0.0}, {"roof": 0.0})
    found = certify(slack)
    assert found.verdict is Verdict.NEUTRAL
    assert found.detail == "no patch has a tension: every shape is at rest"


def test_a_collapsed_triangle_is_named():
    surface = solve(spherical_cap(0.25)).surface
    X = surface.vertices.copy()
    face = 40
    a, b, c = surface.faces[face]
    assert surface.free[c]
    X[c] = 0.5 * (X[a] + X[b])
    found = certify(surface.moved(X))
    assert found.verdict is Verdict.DEGENERATE
    assert "of patch 'cap' near [" in found.detail
    assert found.quality < 1e-3


def test_evidence_of_the_way_decides_what_the_shape_leaves_open():
    away = certify(two_squares(4), evidence=Evidence.INFLATED)
    assert away.verdict is Verdict.NO_EQUILIBRIUM
    assert "inflates" in away.detail
    assert certify(two_squares(4)).verdict is Verdict.NOT_CONVERGED
    gone = certify(two_squares(4), evidence=Evidence.VANISHED)
    assert gone.verdict is Verdict.NO_EQUILIBRIUM
    surface = solve(spherical_cap(0.25)).surface
    assert certify(surface, evidence=Evidence.INFLATED).verdict is Verdict.STABLE
    assert certify(surface, evidence=Evidence.COLLAPSED).verdict is Verdict.DEGENERATE


@pytest.mark.parametrize(
    ("status", "verdict"),
    [
        (Status.DIVERGED, Verdict.NO_EQUILIBRIUM),
        (Status.VANISHED, Verdict.NO_EQUILIBRIUM),
        (Status.DEGENERATE, Verdict.DEGENERATE),
        (Status.STALLED, Verdict.NOT_CONVERGED),
        (Status.STOPPED, Verdict.NOT_CONVERGED),
    ],
)
def test_a_result_passes_on_how_its_solver_ended(status, verdict):
    result = replace(solve(two_squares(4), iterations=0), status=status)
    assert result.certificate.verdict is verdict
    assert result.certify(modes=0).verdict is verdict


def findings(**changes):
    """Findings about a stable pyramid, but for the changes."""
    given = {
        "surface": pyramid(),
        "pinchable": np.array([False]),
        "residual": 0.0,
        "tolerance": 1e-8,
        "quality": 0.9,
        "index": 0,
        "own_residuals": np.zeros(1),
        "softest": 5.0,
        "load_ratio": 0.5,
    }
    return Findings(**(given | changes))


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({}, Verdict.STABLE),
        ({"softest": 1e-3}, Verdict.NEUTRAL),
        ({"softest": -1e-3, "index": 1}, Verdict.SADDLE),
        ({"own_residuals": np.array([1e-4])}, Verdict.NOT_CONVERGED),
        ({"own_residuals": np.array([1e-6])}, Verdict.STABLE),
        ({"index": None}, Verdict.NOT_CONVERGED),
        ({"residual": 1e-7}, Verdict.NOT_CONVERGED),
        ({"residual": 1e-7, "tolerance": 1e-6}, Verdict.STABLE),
        ({"quality": 1e-4}, Verdict.DEGENERATE),
        ({"load_ratio": 1e3}, Verdict.STABLE),
        ({"residual": 1e-7, "load_ratio": 1e3}, Verdict.NO_EQUILIBRIUM),
        ({"residual": 1e-7, "load_ratio": 1.1}, Verdict.NOT_CONVERGED),  # the mesh is coarse
        (
            {"residual": 1e-7, "load_ratio": 1.1, "evidence": Evidence.COLLAPSED},
            Verdict.NO_EQUILIBRIUM,
        ),
        ({"residual": 1e-7, "quality": 1e-4, "load_ratio": 1e3}, Verdict.NO_EQUILIBRIUM),
        ({"evidence": Evidence.VANISHED}, Verdict.STABLE),
        ({"surface": pyramid().retensioned({"roof": 0.0}, {"roof": 0.0})}, Verdict.NEUTRAL),
    ],
)
def test_the_first_rule_that_applies_decides(changes, verdict):
    assert judge(findings(**changes))[0] is verdict


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


def test_every_verdict_names_itself_and_says_what_it_means():
    for verdict in Verdict:
        name, meaning = verdict.value.split(": ")
        assert name.startswith(verdict.name.lower().replace("_", " "))
        assert len(meaning.split()) > 3


def test_the_standing_part_is_computed_once_for_each_surface():
    surface = solve(two_squares(6, alpha_aux=3.0)).surface
    part = standing_part(surface)
    assert part.surface.m < surface.m
    with mock.patch("pcmc.contact.pinching.find_walls", side_effect=AssertionError):
        certify(surface)
        reactions_per_length(surface)
        assert standing_part(surface) is part
    moved = surface.moved(two_squares(6, alpha_aux=3.0).vertices)
    assert standing_part(moved).surface is moved


@pytest.mark.parametrize("make", [four_fans, two_squares])
def test_the_morse_index_alone_is_that_of_the_certificate(make):
    surface = solve(make(5), target="stationary").surface
    assert morse_index(surface) == certify(surface).index


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
