"""The search for an equilibrium beyond the first start, and the proofs that there is none."""

import dataclasses

import numpy as np
import pytest
from nightly import at_night
from random_meshes import random_surface
from shapes import pyramid
from starts import sphere, spherical_cap, two_caps, two_squares

from generators import spherical_cap_exact
from pcmc import Cable, Verdict, certify, solve, write
from pcmc.certificate.balance import strained_junction, unheld
from pcmc.certificate.proof import Overload, UnbalancedJunction, Unheld
from pcmc.io import native
from pcmc.plan import Divider, Hole, Plan
from pcmc.solvers import solve_once
from pcmc.solvers.result import Status
from pcmc.solvers.starts import low_start
from pcmc.sweep import solve_case

pytestmark = pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")

HEIGHTS = (0.001, 0.05, 0.3, 1.0, 2.5, 5.0, 8.0)


def paraboloid(height, alpha, edge=0.25):
    """A disc of radius 1 raised to this height in the middle."""
    cap = spherical_cap(edge, alpha=alpha)
    X = cap.vertices * [1.0, 1.0, 0.0]
    X[:, 2] = height * (1.0 - (X**2).sum(axis=1)) * cap.free
    return cap.moved(X)


@pytest.mark.parametrize("alpha", [0.51, 1.0, *at_night(0.6, 0.8, 3.0)])
def test_every_cap_above_the_fold_is_found_from_any_height(alpha):
    for height in HEIGHTS:
        result = solve(paraboloid(height, alpha))
        assert result.converged, height
        assert result.certificate.verdict is Verdict.STABLE
        top = result.surface.vertices[:, 2].max()
        # near the fold the height goes as the square root of what is left
        assert top == pytest.approx(
            spherical_cap_exact(alpha=alpha).height, abs=0.13 if alpha < 0.55 else 0.02
        )


@pytest.mark.parametrize(
    ("alpha", "heights"), [(0.45, HEIGHTS[::6]), *at_night((0.3, HEIGHTS[::2]), (0.45, HEIGHTS[2:5:2]))]
)
def test_every_cap_below_the_fold_ends_with_balance_as_proof(alpha, heights):
    for height in heights:
        result = solve(paraboloid(height, alpha))
        assert result.status is Status.NO_EQUILIBRIUM
        assert result.proofs == (Overload(pytest.approx(0.5 / alpha, rel=0.02)),)
        fold = result.tried[-1]
        assert fold.way == "pressure"
        assert fold.value == pytest.approx(2.0 * alpha, rel=0.03)
        found = result.certificate
        assert found.verdict is Verdict.NO_EQUILIBRIUM
        assert [p.ratio for p in found.proofs] == pytest.approx([p.ratio for p in result.proofs])
        assert found.tried == result.tried
        for text in (result.message, found.detail, str(found)):
            assert f"folds at {fold.value:.3f} of the pressure" in text


@pytest.mark.nightly
def test_the_fold_tends_to_the_hemisphere_with_the_mesh():
    errors = [solve(paraboloid(0.3, 0.45, edge)).tried[-1].value - 0.9 for edge in (0.25, 0.125)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.3)


def test_where_the_first_start_converges_nothing_else_is_tried():
    one, all_starts = solve_once(paraboloid(0.3, 0.6)), solve(paraboloid(0.3, 0.6))
    assert one.evaluations == all_starts.evaluations
    assert one.rows == all_starts.rows
    np.testing.assert_array_equal(one.surface.vertices, all_starts.surface.vertices)


def test_the_note_tells_which_start_led_there():
    result = solve(paraboloid(5.0, 0.6))
    assert "found from a lower start, as the given start led to none (diverged)" in result.message
    history = result.history
    assert history["iteration"].is_monotonic_increasing
    assert result.energy == history["energy"].iloc[-1]
    assert result.iterations == history["iteration"].iloc[-1]
    assert result.evaluations > solve_once(paraboloid(5.0, 0.6)).evaluations


def test_an_inflated_mesh_is_spread_anew():
    """Its plan is no plan any more: triangles lie on each other."""
    inflated = solve_once(paraboloid(5.0, 0.6))
    assert inflated.status is Status.DIVERGED
    again = inflated.surface.retensioned({"cap": 0.7})
    assert solve(again).certificate.verdict is Verdict.STABLE
    low = low_start(again)
    assert low.vertices[:, 2].max() == pytest.approx(0.1 * np.sqrt(8.0), rel=1e-6)


# ---- starts keep to the supports


def test_a_wall_between_mirrors_is_found_from_far_above():
    """The vertices of its end stay in the mirror plane, where the mean of their neighbours does not lie."""
    patches = {"south": {"tension": 4.0}, "north": {"tension": 3.0}}
    outline, mirror = [[0, 0], [6, 0], [6, 8], [0, 8]], [[6, 0], [6, 8]]
    wall = Divider([[0, 4], [6, 4]], 3.0)
    half = Plan(outline, [wall], patches=patches, mirrors=[mirror], edge_length=0.6).surface()
    result = solve(half.moved(half.vertices * [1.0, 1.0, 30.0]))
    assert result.converged
    assert "from a lower start" in result.note
    assert result.energy == pytest.approx(solve(half).energy, rel=1e-3)  # vertices lie elsewhere along it


def test_an_upright_wall_in_a_y_under_snow_ends_in_a_status():
    at = {"a": [3, 6], "b": [17, 6], "c": [10, 11]}
    patches = {name: {"tension": 2.5, "at": place} for name, place in at.items()}
    walls = [Divider([[10, 5], end], 2.0, upright=end[1] == 0) for end in ([10, 0], [4, 12], [16, 12])]
    hall = [[0, 0], [20, 0], [20, 12], [0, 12]]
    roof = Plan(hall, walls, patches=patches, edge_length=0.6, snow=0.5).surface()
    low = low_start(roof)
    ((plane, mask),) = low.on_planes
    assert np.abs(plane.height(low.vertices[mask])).max() < 1e-12
    assert solve(roof).status in (Status.CONVERGED, Status.DEGENERATE)


def test_the_crown_of_a_quarter_is_low_in_a_low_start():
    """It slides along the line where the mirrors meet."""
    outline, mirrors = [[0, 0], [5, 0], [5, 5], [0, 5]], [[[5, 0], [5, 5]], [[0, 5], [5, 5]]]
    quarter = Plan(outline, tension=4.0, mirrors=mirrors).surface()
    x, y, _ = quarter.vertices.T
    X = np.stack([x, y, x * y], axis=1)
    low = low_start(quarter.moved(X))
    crown = int(quarter.vertices[:, :2].sum(axis=1).argmax())
    assert X[crown, 2] == 25.0
    assert low.vertices[crown, 2] == pytest.approx(low.vertices[:, 2].max()) == pytest.approx(0.1 * 50**0.5)


def test_the_flow_of_the_paper_is_not_rescued():
    for method in ("nesterov", "lbfgs"):
        result = solve(paraboloid(5.0, 0.6), method)
        assert not result.converged
        assert result.proofs == result.tried == ()


def test_two_sheets_of_one_tension_are_not_strained():
    def strained(wall, west):
        patches = {"west": {"tension": west}, "east": {"tension": 3.0}}
        divider = Divider([[4, 0], [4, 4]], wall=wall)
        outline = [[0, 0], [8, 0], [8, 4], [0, 4]]
        return strained_junction(Plan(outline, [divider], edge_length=1.0, patches=patches).surface())

    assert strained(None, 3.0) is None
    assert strained(None, 4.0) is not None
    assert strained(1.0, 4.0).remedy == ("wall 1", 1.9, True)


def test_tensions_that_cannot_balance_are_the_proof():
    surface = two_squares(4, alpha_aux=1.0).retensioned({"left": 4.0, "right": 2.0})
    result = solve(surface)
    assert result.status is Status.NO_EQUILIBRIUM
    remedy = ("wall", 2.6, True)
    held = surface.rebuilt(fixed=surface.fixed | surface.on_plane, on_plane=())  # or an end slips
    assert solve(held.retensioned({"wall": 2.6})).converged
    assert result.proofs == (UnbalancedJunction(("left", "right", "wall"), 4.0, (1.0, 2.0), remedy),)
    assert result.certificate.verdict is Verdict.NO_EQUILIBRIUM
    assert certify(surface).proofs == result.proofs


def test_a_bubble_has_no_stable_equilibrium_and_one_that_is_not():
    """The sphere of radius 2 α/p, at rest with index 1, is the answer where a minimum is asked for."""
    result = solve(sphere(0.8))
    assert result.status is Status.SADDLE
    assert result.proofs == ()
    assert "none is stable" in result.message
    found = result.certificate
    assert found.verdict is Verdict.SADDLE
    assert found.index == 1
    assert np.linalg.norm(result.surface.vertices, axis=1) == pytest.approx(2.0, rel=0.05)
    sought = solve(sphere(0.8), target="stationary")
    assert sought.converged
    assert sought.energy == pytest.approx(result.energy, rel=1e-12)
    away = solve_once(sphere(0.8)).certificate
    assert away.verdict is Verdict.RAN_AWAY
    assert "no equilibrium" not in str(away)
    limp = sphere(0.8).retensioned(None, {patch.name: 0.0 for patch in sphere(0.8).patches})
    for target in ("minimum", "stationary"):
        (proof,) = solve(limp, target=target).proofs
        assert proof == Unheld(0)
    assert certify(limp).verdict is Verdict.NO_EQUILIBRIUM


def test_of_a_bubble_drawn_out_far_none_is_found_and_a_saddle_was_sought_too():
    bubble = sphere(0.8)
    result = solve(bubble.moved(bubble.vertices * [1.0, 4.0, 8.0]))
    assert result.status is Status.NONE_FOUND
    assert [attempt.way for attempt in result.tried] == ["given start", "stationary point"]
    assert "sought as any stationary point" in result.message


def test_a_part_that_nothing_holds_falls_under_its_weight():
    heavy = sphere(0.8).retensioned(weights={"bubble": 0.1})
    result = solve(heavy)
    assert result.proofs == certify(heavy).proofs == (Unheld(0, falls=True),)
    assert unheld(heavy.rebuilt(fixed=[0])) is None
    lifting = dataclasses.replace(heavy, cables=[Cable("balloon", 0.1, heavy.topology.edges[:1], -0.1)])
    assert unheld(lifting) is None


def test_a_way_that_crawls_ends_at_the_saddle_and_names_the_ends_that_slip():
    surface = two_squares(64, alpha_aux=1.0)
    saddle = solve(surface, target="stationary")
    result = solve(surface)
    assert result.status is Status.SADDLE
    assert result.iterations < 3 * saddle.iterations
    assert result.energy == pytest.approx(saddle.energy, rel=1e-12)
    found = result.certificate
    assert found.verdict is Verdict.SADDLE
    for text in (result.message, found.detail):
        assert "index 1: 1 way down; the mode moves the junction left | right | wall most" in text
        assert "(0, -2)" in text
        assert "(0, 2)" in text
        assert "slip: one edge away the junction moves 0.54 as far" in text


def test_stopped_in_the_search_the_first_result_is_the_best():
    first = solve_once(paraboloid(5.0, 0.3))
    seen = []

    def callback(progress):
        seen.append(progress.row)
        if len(seen) > first.iterations + 6:
            raise StopIteration

    result = solve(paraboloid(5.0, 0.3), callback=callback)
    assert result.status is Status.STOPPED
    assert [row["iteration"] for row in seen] == list(range(len(seen)))
    np.testing.assert_array_equal(result.surface.vertices, first.surface.vertices)


@pytest.mark.parametrize("step", ["newton", "branch"])
def test_an_empty_iterator_in_a_callback_is_no_request_to_stop_a_search(step):
    """The first start leads nowhere; the callback fails in what is tried next."""
    first = solve_once(paraboloid(5.0, 0.45))

    def callback(progress):
        beyond = progress.row["iteration"] > first.iterations
        if beyond and (progress.row["step"] == "branch") == (step == "branch"):
            next(iter([]))

    with pytest.raises(RuntimeError, match="StopIteration out of next"):
        solve(paraboloid(5.0, 0.45), callback=callback)


def test_what_fails_on_a_finer_mesh_is_searched_for_there():
    """One free vertex is at rest where no smooth roof would be: refined, the roof runs away, and its branch
    folds."""
    first = solve_once(pyramid(0.4), levels=1)
    assert first.rows[-1]["level"] == 1
    result = solve(pyramid(0.4), levels=1)
    assert result.status is Status.NO_EQUILIBRIUM
    assert result.surface.m == first.surface.m
    assert result.tried[-1].folds


def test_stopped_on_the_branch_and_errors_pass_through():
    def stop(kind):
        def callback(progress):
            if progress.row["step"] == "branch":
                raise kind("on the branch")

        return callback

    surface = paraboloid(5.0, 0.45)
    assert solve(surface, callback=stop(StopIteration)).status is Status.STOPPED
    assert solve(surface, callback=stop(KeyboardInterrupt)).status is Status.STOPPED
    with pytest.raises(ZeroDivisionError, match="on the branch"):
        solve(surface, callback=stop(ZeroDivisionError))
    with pytest.raises(ValueError, match="on the branch"):
        solve(surface, callback=stop(ValueError))


def test_ctrl_c_between_the_points_of_a_branch_ends_the_search(monkeypatch):
    def pressed(*given):
        raise KeyboardInterrupt

    monkeypatch.setattr("pcmc.solvers.continuation.tracing.Tracer.step", pressed)
    result = solve(paraboloid(5.0, 0.45))
    assert result.status is Status.STOPPED
    assert not result.tried


def test_refinement_goes_on_from_a_further_start():
    result = solve(paraboloid(5.0, 0.6), levels=1)
    assert result.certificate.verdict is Verdict.STABLE
    assert result.surface.m == 4 * paraboloid(5.0, 0.6).m
    assert result.history["level"].iloc[-1] == 1


def test_a_surface_at_rest_needs_no_proof():
    """One free vertex is at rest down to α = 1/3, where no smooth roof would be."""
    result = solve(pyramid(0.4))
    assert result.proofs == ()
    assert result.certificate.verdict is Verdict.STABLE


def test_a_coarse_mesh_at_rest_is_not_disproved():
    """Its junction cannot balance on a smooth surface, but triangles balance along the normals alone."""
    result = solve(random_surface(30082), target="stationary", iterations=12)
    assert result.status is Status.ITERATION_LIMIT
    assert result.proofs == ()
    assert result.certificate.verdict is Verdict.STABLE


def test_a_file_keeps_the_proof(tmp_path):
    result = solve(paraboloid(1.0, 0.45))
    write(tmp_path / "cap.pcmc", result.surface, certificate=result.certificate)
    kept = native.read(tmp_path / "cap.pcmc").certificate
    ratio = pytest.approx(result.proofs[0].ratio)
    assert kept["proofs"] == [{"kind": "Overload", "ratio": ratio, "load": "pressure"}]
    assert [row["end"] for row in kept["tried"]] == [attempt.end for attempt in result.tried]
    assert kept["tried"][-1]["value"] == result.tried[-1].value


def test_sweeps_search_only_if_asked():
    case = {"generator": "generators:spherical_cap", "edge_length": 0.25, "alpha": 0.6, "height": 2.5}
    assert solve_case(**case, inflation=2.0)["verdict"] == "ran away"
    assert solve_case(**case, inflation=2.0, search=True)["verdict"] == "stable"


def test_from_equal_tensions_to_those_asked_for():
    """The pressure cannot be raised from low ones: there the stronger patch pulls the wall away."""
    weak = two_caps(2.4, alpha_large=1.0, alpha_small=1.5, alpha_aux=6.0)
    result = solve(weak, target="stationary")
    assert result.status is Status.NONE_FOUND  # the wall slides: its foot may be as long as it likes
    assert result.proofs == ()
    fold = result.tried[-1]
    assert fold.folds
    assert fold.way == "tensions"
    assert 0.0 < fold.value < 1.0
    tensions = dict(fold.tensions)
    assert tensions["large"] > 1.0
    assert tensions["small"] > 1.5
    assert f"folds at large {tensions['large']:.4g}, small" in result.message
    found = solve(two_caps(1.2, alpha_large=6.0, alpha_small=5.0, alpha_aux=16.0), target="stationary")
    assert found.certificate.verdict is Verdict.STABLE
    assert "along the branch from equal tensions" in found.message


def test_an_upright_wall_that_ends_on_a_leaning_one_comes_to_rest():
    """Pinched at their common foot, each wall keeps its own plane; the junction rests on a held bottom."""
    eye = Hole({"circle": {"centre": [8.5, 12, 2.2], "radius": 1.2}}, name="skylight")
    walls = [Divider([[4, 0], [4, 16]]), Divider([[4, 7], [12, 7]], upright=True)]
    patches = {"foyer": (8.0, [2, 8]), "pool": (14.0, [8, 3]), "dive": (13.0, [5, 12])}
    half = Plan(
        [[0, 0], [12, 0], [12, 16], [0, 16]],
        walls,
        holes=[eye],
        edge_length=1.1,
        mirrors=[[[12, 0], [12, 16]]],
        patches={name: {"tension": tension, "at": at} for name, (tension, at) in patches.items()},
    )
    result = solve(half.surface())
    assert result.certificate.verdict is Verdict.STABLE
    surface = result.surface
    for plane, mask in surface.on_planes:
        assert np.abs(plane.height(surface.vertices)[mask]).max() <= 1e-12 * surface.size
    assert "foyer | pool" in set(result.certificate.junctions.junction)  # there the wall has no height left
