"""The verdict: every one of them is reached, and the first rule that applies decides."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from shapes import pyramid, shaken
from starts import double_bubble, four_fans, spherical_cap, two_squares

import pcmc
from pcmc import Patch, Surface, certify, solve
from pcmc.certificate import Evidence, Verdict
from pcmc.certificate.balance import coarseness, load_ratio
from pcmc.certificate.diagnosis import folded_over
from pcmc.certificate.proof import Attempt
from pcmc.certificate.verdict import Findings, judge
from pcmc.plan import Plan
from pcmc.solvers.result import Status
from pcmc.stability.modes import Spectrum

pytestmark = pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")


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


def test_no_equilibrium_from_the_load_alone():
    found = certify(spherical_cap(0.25, alpha=0.45))
    assert found.load_ratio == pytest.approx(1.0 / 0.9, rel=0.03)
    assert found.verdict is Verdict.NO_EQUILIBRIUM
    assert f"{found.load_ratio:.2f} times what the boundary's tension could carry" in found.detail
    assert found.tried == ()
    huge = certify(spherical_cap(0.25, alpha=1e-40)).detail
    assert (
        huge == "the pressure is 4.96e+39 times what the boundary's tension could carry on any smooth surface"
    )
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
    column = Surface(cap.vertices, cap.faces, cap.patch_of_face, cap.patches, fixed=cap.fixed | (away == 0))
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
    assert "of patch 'cap' near (" in found.detail
    assert found.quality < 1e-3


def test_a_flat_sail_with_triangles_on_their_backs_is_not_certified():
    """A free vertex beyond the rim: at rest, as it moves across the sail only, with 18 for an area of 16."""
    rim = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]
    sail = Surface([*rim, [4.5, 2, 0]], [[k, (k + 1) % 4, 4] for k in range(4)], [0] * 4,
                   [Patch("sail", 1.0, 0.0)], fixed=range(4))  # fmt: skip
    certificate = certify(sail)
    assert certificate.residual < 1e-12
    assert certificate.patches.area[0] == pytest.approx(18.0)
    assert certificate.verdict is Verdict.DEGENERATE
    assert "patch 'sail' is folded near" in certificate.detail
    assert certify(sail.moved([*rim, [3.9, 2, 0]])).certified


@pytest.mark.parametrize("turned", [False, True])
def test_a_fold_along_a_seam_of_two_patches_is_seen(turned):
    """One sheet in two patches, of which one may show its other side: only folded it is named."""
    X = [[0, 0, 0], [2, 0, 0], [4, 0, 0], [4, 4, 0], [2, 4, 0], [0, 4, 0], [4.5, 2, 0], [2, 2, 0]]
    F = [[0, 1, 7], [7, 4, 5], [5, 0, 7], [1, 6, 7], [7, 6, 4], [1, 2, 6], [2, 3, 6], [3, 4, 6]]
    patch = [0, 0, 0, 1, 1, 2, 3, 2]
    faces = [f[::-1] if turned and part == 3 else f for f, part in zip(F, patch, strict=True)]
    patches = [Patch(name, 1.0, 0.0) for name in "abcd"]
    folded = Surface(X, faces, patch, patches, fixed=range(6))
    assert "is folded near" in folded_over(folded, np.zeros(4, dtype=bool))
    flat = folded.moved([*X[:6], [3.5, 2, 0], X[7]])
    assert folded_over(flat, np.zeros(4, dtype=bool)) == ""


def test_a_seam_where_a_cell_goes_on_may_show_the_other_side():
    """A flat strip of two patches, of which one is turned over; they also meet across the cell."""
    X = [[x, y, 0] for x in range(5) for y in range(3)]
    low = [k for k in range(11) if k % 3 < 2]
    F = [[k, k + 3, k + 4] for k in low] + [[k, k + 4, k + 1] for k in low]
    patch = [int(min(face) >= 6) for face in F]
    faces = [face[::-1] if part else face for face, part in zip(F, patch, strict=True)]
    held, images = [k for k in range(15) if k % 3 != 1], [[12 + k, k] for k in range(3)]
    patches = [Patch(name, 1.0, 0.0) for name in "ab"]
    assert certify(Surface(X, faces, patch, patches, fixed=held, images=images)).verdict is Verdict.STABLE


def test_a_steep_tent_and_a_folded_wall_without_tension_are_not_folded_over():
    """No triangle of the tent, of 14° at its ridge, lies on another; the wall has no area that counts."""
    eaves, ridge = [[0, 0, 0], [6, 0, 0], [6, 1, 0], [0, 1, 0]], [[0, 0.5, 4], [6, 0.5, 4]]
    F = [[0, 1, 5], [0, 5, 4], [2, 3, 4], [2, 4, 5]]
    tent = Surface([*eaves, *ridge], F, [0] * 4, [Patch("tent", 1.0)], fixed=range(4))
    assert folded_over(tent, np.zeros(1, dtype=bool)) == ""
    rim, spokes = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], [[k, (k + 1) % 4] for k in range(4)]
    F = [[*spoke, middle] for middle in (4, 5) for spoke in spokes]
    patches = [Patch("sail", 1.0, 0.0), Patch("wall", 0.0, 0.0)]
    certificate = certify(Surface([*rim, [2, 2, 0], [4.5, 2, 0]], F, [0] * 4 + [1] * 4, patches, range(4)))
    assert certificate.verdict is Verdict.STABLE


def test_evidence_of_the_way_decides_what_the_shape_leaves_open():
    away = certify(two_squares(4), evidence=Evidence.INFLATED)
    assert away.verdict is Verdict.RAN_AWAY
    assert "it grew without bound; start lower" in away.detail
    assert away.proofs == ()
    assert certify(two_squares(4)).verdict is Verdict.NOT_CONVERGED
    gone = certify(two_squares(4), evidence=Evidence.VANISHED)
    assert gone.verdict is Verdict.RAN_AWAY
    assert "it shrank to nothing; hold it" in gone.detail
    surface = solve(spherical_cap(0.25)).surface
    assert certify(surface, evidence=Evidence.INFLATED).verdict is Verdict.STABLE
    assert certify(surface, evidence=Evidence.COLLAPSED).verdict is Verdict.DEGENERATE


@pytest.mark.parametrize(
    ("status", "verdict"),
    [
        (Status.DIVERGED, Verdict.RAN_AWAY),
        (Status.VANISHED, Verdict.RAN_AWAY),
        (Status.DEGENERATE, Verdict.DEGENERATE),
        (Status.STALLED, Verdict.NOT_CONVERGED),
        (Status.STOPPED, Verdict.NOT_CONVERGED),
    ],
)
def test_a_result_passes_on_how_its_solver_ended(status, verdict):
    result = replace(solve(two_squares(4), iterations=0), status=status)
    assert result.certificate.verdict is verdict
    assert result.certify(modes=0).verdict is verdict


FOLDED, AWAY = Attempt("pressure", "fold", 0.9, 0.5), Attempt("given start", "diverged")


def findings(**changes):
    """Findings about a stable pyramid, but for the changes."""
    given = {
        "surface": pyramid(),
        "pinchable": np.array([False]),
        "residual": 0.0,
        "tolerance": 1e-8,
        "quality": 0.9,
        "spectrum": Spectrum(0, 0),
        "own_residuals": np.zeros(1),
    }
    return Findings(**(given | changes))


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({}, Verdict.STABLE),
        ({"spectrum": Spectrum(0, 0, soft=1)}, Verdict.NEUTRAL),
        ({"spectrum": Spectrum(1, 0, soft=1)}, Verdict.NEUTRAL),
        ({"spectrum": Spectrum(None, 0, soft=1)}, Verdict.NEUTRAL),
        ({"spectrum": Spectrum(1, 1)}, Verdict.SADDLE),
        ({"rigid": 1}, Verdict.NEUTRAL),
        ({"spectrum": Spectrum(1, 1), "rigid": 3}, Verdict.SADDLE),
        ({"spectrum": Spectrum(2, 1, soft=1)}, Verdict.SADDLE),
        ({"spectrum": Spectrum(0, 0, hidden="ARPACK stops")}, Verdict.UNDECIDED),
        ({"own_residuals": np.array([1e-4])}, Verdict.NOT_CONVERGED),
        ({"own_residuals": np.array([1e-6])}, Verdict.STABLE),
        ({"spectrum": Spectrum()}, Verdict.UNDECIDED),
        ({"residual": 1e-7, "rounding": 1e-8}, Verdict.UNDECIDED),
        ({"residual": 1e-6, "rounding": 1e-8}, Verdict.NOT_CONVERGED),
        ({"residual": 1e-7}, Verdict.NOT_CONVERGED),
        ({"residual": 1e-7, "tolerance": 1e-6}, Verdict.STABLE),
        ({"quality": 1e-4}, Verdict.DEGENERATE),
        ({"surface": pyramid(0.05)}, Verdict.STABLE),
        ({"residual": 1e-7, "surface": pyramid(0.05)}, Verdict.NO_EQUILIBRIUM),
        ({"residual": 1e-7, "surface": pyramid(0.4)}, Verdict.NOT_CONVERGED),  # the mesh is coarse
        (
            {"residual": 1e-7, "surface": pyramid(0.4), "evidence": Evidence.COLLAPSED},
            Verdict.NO_EQUILIBRIUM,
        ),
        ({"residual": 1e-7, "quality": 1e-4, "surface": pyramid(0.05)}, Verdict.NO_EQUILIBRIUM),
        ({"evidence": Evidence.VANISHED}, Verdict.STABLE),
        ({"residual": 1e-7, "evidence": Evidence.VANISHED}, Verdict.RAN_AWAY),
        ({"residual": 1e-7, "evidence": Evidence.INFLATED}, Verdict.RAN_AWAY),
        ({"residual": 1e-7, "tried": (FOLDED,)}, Verdict.NONE_FOUND),
        ({"residual": 1e-7, "tried": (AWAY,), "evidence": Evidence.INFLATED}, Verdict.NONE_FOUND),
        ({"residual": 1e-7, "tried": (Attempt("given start", "stalled"),)}, Verdict.NOT_CONVERGED),
        ({"tried": (FOLDED,)}, Verdict.STABLE),
        ({"surface": pyramid().retensioned({"roof": 0.0}, {"roof": 0.0})}, Verdict.NEUTRAL),
    ],
)
def test_the_first_rule_that_applies_decides(changes, verdict):
    assert judge(findings(**changes))[0] is verdict


STALLED, LATER = Attempt("given start", "stalled"), Attempt("pressure", "diverged", 0.9, 0.5)


@pytest.mark.parametrize(
    ("changes", "words", "not_there"),
    [
        ({}, "", "fold"),
        ({"rigid": 3}, "nothing resists 3 rigid motions; every change of shape at these volumes", "fold"),
        ({"spectrum": Spectrum(0, 0, near=1)}, "1 softest mode within ±1 α/size², index 0", "modes"),
        ({"spectrum": Spectrum(0, 0, near=2)}, "2 softest modes within ±1 α/size², index 0", "0.01"),
        ({"spectrum": Spectrum(0, 0, near=2, soft=1)}, "1 softest mode within ±0.01 α/size²", "modes"),
        ({"spectrum": Spectrum(None, 0, soft=1)}, "of signs that rounding hides", "index"),
        ({"pulled": (7, 9)}, "at 2 pinched vertices, the first 7, the sheets pull harder", "fold"),
        ({"left_over": "something is left"}, "something is left", "fold"),
        ({"residual": 1e-6}, "relative residual 1.0e-06, tolerance 1e-08", "rounding"),
        ({"residual": 1e-6, "tried": (STALLED, LATER)}, str(LATER), str(STALLED)),
        (
            {"residual": 1e-7, "rounding": 1e-8},
            "rounding of the coordinates alone leaves about 1e-08",
            "fold",
        ),
        (
            {"own_residuals": np.array([1e-4])},
            "left in patch 'roof', or in an island of it, are 1.0e-04",
            "–",
        ),
        ({"spectrum": Spectrum(0, 0, hidden="ARPACK stops")}, "but ARPACK stops", "factor"),
        ({"residual": 1e-7, "evidence": Evidence.INFLATED}, "it grew without bound", "shrank"),
        ({"residual": 1e-7, "evidence": Evidence.VANISHED}, "it shrank to nothing", "grew"),
        ({"quality": 1e-4, "tried": (STALLED, LATER)}, str(LATER), str(STALLED)),
    ],
)
def test_the_detail_has_the_reason_and_its_numbers(changes, words, not_there):
    detail = judge(findings(**changes))[1]
    assert words in detail
    assert bool(detail) == bool(words)
    assert not_there not in detail


@pytest.mark.parametrize(("weak", "named"), [(1e-7, True), (1e-5, False), (0.0, False)])
def test_a_hidden_index_is_put_down_to_tensions_that_differ_widely(weak, named):
    one = pyramid()
    patches = [Patch("strong", 1.0, 0.0), Patch("weak", weak, 0.0)]
    both = Surface(one.vertices, one.faces, [0, 0, 1, 1], patches, fixed=one.fixed)
    detail = judge(findings(spectrum=Spectrum(), surface=both, pinchable=np.zeros(2, dtype=bool)))[1]
    assert "cannot be counted" in detail
    assert ("the tensions differ by a factor of 1e+07" in detail) == named
    assert ("the tensions differ" in detail) == named


def test_every_verdict_names_itself_and_says_what_it_means():
    for verdict in Verdict:
        name, meaning = verdict.value.split(": ")
        assert name.startswith(verdict.name.lower().replace("_", " "))
        assert len(meaning.split()) > 3


@pytest.mark.parametrize("moved", [0.0, 1e-3])
def test_coordinates_of_single_precision_are_named_where_they_alone_leave_forces(moved):
    roof = solve(spherical_cap(0.3)).surface
    X = roof.vertices + moved * ~roof.fixed[:, None] * np.random.default_rng(0).standard_normal((roof.n, 3))
    for places, single in ((X, False), (X.astype(np.float32).astype(float), True)):
        found = certify(roof.moved(places))
        assert ("single precision" in found.detail) == (single and not moved)
        assert (found.verdict is Verdict.NOT_CONVERGED) == (single or moved > 0.0)


def test_a_half_in_single_precision_has_its_mirror_in_double(tmp_path):
    """Where it is read, its vertices come exactly onto the plane, here at 20 ft."""
    outline, mirror = [[0, 0], [6.096, 0], [6.096, 7.62], [0, 7.62]], [[6.096, 0], [6.096, 7.62]]
    half = Plan(outline, edge_length=1.0, tension=5.0, mirrors=[mirror]).surface()
    pcmc.write(tmp_path / "half.glb", solve(half).surface)
    found = certify(pcmc.read(tmp_path / "half.glb"))
    assert found.verdict is Verdict.NOT_CONVERGED
    assert "single precision" in found.detail
