"""The studies of solvers, stability, refinement and existence: fits, cones, categories, small runs."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from nightly import at_night
from programs import needs_evolver
from tables import last_row

from generators import four_fans, spherical_cap, two_squares
from pcmc import certify, energy, sweep
from pcmc.accuracy import AccuracyStatus
from pcmc.base.errors import OptionError, SweepError
from pcmc.meshing.quality import triangle_quality
from pcmc.meshing.refinement import refine
from pcmc.solvers import solve
from studies import cases
from studies.cases import run_sweep
from studies.corners.cone import cone
from studies.examples.flow import NOISE
from studies.folder import Folder
from studies.orders import limit_order, slope
from studies.questions import accuracy, bench, curved, refinement, solvers, stability
from studies.reference import kratos
from studies.registry import STUDIES, chosen, of_the_paper
from studies.study import perform

RESULTS = Path(__file__).parents[2] / "results"

# ------------------------------------------------------------------------------------ registry


def test_extras_are_all_that_reproduce_leaves_out():
    extras, paper = {s.name for s in chosen(["extras"])}, {s.name for s in of_the_paper()}
    assert extras | paper == set(STUDIES)
    assert not extras & paper
    assert {"solvers", "stability", "refinement", "alpha_grid_geometric"} <= extras
    assert "alpha_grid" in paper
    with pytest.raises(OptionError, match="did you mean 'extras'"):
        chosen(["extra"])


# -------------------------------------------------------------------------------------- sweeps

HALVES = sweep.Sweep("pcmc.sweep.examples:ratio", {"over": [1, 2, 3]}, {"under": 2})


def test_a_sweep_that_was_stopped_goes_on_and_leaves_no_store(tmp_path):
    folder = Folder(tmp_path)
    store = tmp_path / "build" / f"halves-{HALVES.fingerprint[:8]}.sqlite"
    store.parent.mkdir()

    def stop(progress):
        raise StopIteration

    assert len(sweep.run(HALVES, store, workers=1, on_record=stop)) == 1
    first = sweep.read_store(store)[0]
    found = run_sweep(folder, "halves", HALVES, workers=1)
    assert found["value"].tolist() == [0.5, 1.0, 1.5]
    times = folder.read_table("halves_times")
    assert times.wall_time[first.case] == pytest.approx(first.wall_time, abs=6e-4)  # not run again
    assert not store.parent.exists()


def test_an_incomplete_sweep_is_an_error_that_says_how_to_go_on(tmp_path, monkeypatch):
    monkeypatch.setattr(cases, "run", lambda *_, **__: pd.DataFrame({"value": [0.5]}))
    with pytest.raises(SweepError, match=r"1 of 3 cases .* run the study again"):
        run_sweep(Folder(tmp_path), "halves", HALVES)


def test_a_case_that_fails_stops_a_study_and_is_tried_again_by_the_next(tmp_path):
    broken = sweep.Sweep("pcmc.sweep.examples:ratio", {"over": [1, 2]}, {"under": 0})
    for last in (2, 4):  # each run replaces both records
        with pytest.raises(SweepError, match=r"2 of 2 cases failed; case 0 raised: ZeroDivision"):
            run_sweep(Folder(tmp_path), "halves", broken, workers=1)
        (store,) = (tmp_path / "build").iterdir()
        assert (last_row(store), len(sweep.read_store(store))) == (last, 2)


# -------------------------------------------------------------------------------------- orders


def test_fitted_slope_and_its_standard_error():
    h = 0.5 ** np.arange(6)
    noise = np.exp(0.1 * np.array([1, -1, 1, 1, -1, -1]))
    found = slope(h, 2.0 * h**1.5 * noise)
    assert abs(found.order - 1.5) < 3.0 * found.standard_error < 0.3
    # by the textbook: residual variance over the spread of log h
    x, y = np.log(h), np.log(2.0 * h**1.5 * noise)
    left = y - np.polyval(np.polyfit(x, y, 1), x)
    error = math.sqrt((left @ left) / 4 / ((x - x.mean()) ** 2).sum())
    assert found.standard_error == pytest.approx(error, rel=1e-9)
    assert math.isnan(slope(h[:2], h[:2]).order)
    assert slope(h, np.where(h < 0.1, 0.0, h**2)).points == 4


def test_order_towards_an_unknown_limit():
    h = 0.5 ** np.arange(6)
    found = limit_order(h, 5.0 + 0.3 * h**1.3)
    assert found.order == pytest.approx(1.3, abs=1e-5)
    assert found.limit == pytest.approx(5.0, abs=1e-7)
    noise = 1.0 + 0.05 * np.random.default_rng(0).standard_normal(6)
    rough = limit_order(h, 5.0 + 0.3 * h**2 * noise)
    assert 0.0 < abs(rough.order - 2.0) < 3.0 * rough.standard_error < 0.2
    assert math.isnan(limit_order(h[:3], h[:3]).order)


# ---------------------------------------------------------------------------------------- cone


@pytest.mark.parametrize("tensions", [(4.0, 3.0, 4.0), (4.0, 4.0, 2.0), (6.0, 4.0, 6.0)])
def test_cone_is_in_balance_at_its_crest(tensions):
    found = cone(tensions, stability.opening())
    assert found is not None
    assert sum(found.azimuths) == pytest.approx(stability.opening())
    crest = np.array([math.cos(found.height), 0.0, math.sin(found.height)])
    total = np.zeros(3)
    for sign, azimuth, arc, tension in zip((1, -1), found.azimuths, found.arcs, tensions, strict=False):
        outline = np.array([math.cos(azimuth), sign * math.sin(azimuth), 0.0])
        assert math.acos(crest @ outline) == pytest.approx(arc)
        along = outline - (outline @ crest) * crest
        total += tension * along / np.linalg.norm(along)
    total += tensions[2] * np.array([math.sin(found.height), 0.0, -math.cos(found.height)])
    assert np.abs(total).max() < 1e-9
    assert found.length > max(found.slip)


def test_cone_of_equal_patches_has_the_smaller_exponent_of_two():
    found = cone((4.0, 4.0, 2.0), stability.opening())
    assert found is not None
    arc, nu, h = found.arcs[0], found.exponent, found.height
    sideways = 8.0 * math.cos(found.angles[0]) ** 2 / math.tan(nu * arc) - 2.0 * math.tan(nu * h)
    assert sideways == pytest.approx(0.0, abs=1e-9)
    assert nu < math.pi / (2.0 * arc)  # the crest's motion up and down


def test_no_cone_without_balance():
    assert cone((4.0, 3.0, 0.5), stability.opening()) is None
    assert cone((4.0, 3.0, 7.5), stability.opening()) is None
    assert cone((6.0, 4.0, 4.0), stability.opening()) is None


# ----------------------------------------------------------------------------------- stability


def test_critical_wall_is_zero_or_infinite_where_the_sign_does_not_change():
    walls = np.array([1.0, 2.0, 3.0])
    assert stability.critical_wall(walls, np.array([-1.0, -2.0, -3.0])) == 0.0
    assert stability.critical_wall(walls, np.array([3.0, 2.0, 1.0])) == math.inf
    assert stability.critical_wall(walls, np.array([3.0, np.nan, -1.0])) == pytest.approx(2.5)


def test_corner_of_example_2():
    assert math.degrees(stability.opening()) == pytest.approx(284.478, abs=1e-3)
    for patch in stability.OUTLINES:
        centre, radius = stability.OUTLINES[patch]
        out = stability.CORNER - centre
        assert np.linalg.norm(out) == pytest.approx(radius)
        assert out @ stability.tangent(patch) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.nightly
def test_example_3_turns_into_a_saddle_as_its_walls_pull_harder(tmp_path, monkeypatch):
    family = stability.Family("fans", "Fans", four_fans, (5,), 20.0, 10.0, (0.5, 3.0), (5, 3.0))
    monkeypatch.setattr(stability, "FAMILIES", (family,))
    monkeypatch.setattr(stability, "CORNER_LENGTHS", (1.2,))
    perform(stability.STUDY, tmp_path, short=True)
    folder = Folder(tmp_path / "stability")
    records = folder.read_table("records")
    assert records["index"].tolist() == [0, 2]
    assert folder.read_table("critical").critical_wall.between(2.0, 3.0).all()
    pushed = folder.read_mesh("fans")["at rest"]
    assert triangle_quality(pushed.vertices, pushed.faces).min() > 0.5
    crest = folder.read_table("crest")
    assert crest.status.eq("converged").all()
    # the crest is symmetric only if the patches are: here it leans to one side, and is over Π
    assert crest.height[0] > 20.0
    for name in ("eigenvalues-fans", "mode-fans", "critical", "crest"):
        assert folder.figure(name).is_file()


# ---------------------------------------------------------------------------------- refinement


def test_outline_points_go_to_the_nearest_circle():
    family = refinement.FAMILIES[1]
    (xl, _, rl), (xr, _, rr) = family.circles
    points = np.array([[xl - 1.1 * rl, 0.0, 0.0], [xr + 0.9 * rr, 0.0, 0.0]])
    found = family.rounded(points)
    assert np.allclose(found, [[xl - rl, 0, 0], [xr + rr, 0, 0]])


def test_moved_is_the_normal_part_only():
    coarse = two_squares(4, height=1e-9)
    fine = refine(coarse)
    assert refinement._moved(coarse, fine) == 0.0
    rise = np.where(fine.on_plane, 0.0, 0.1)  # the wall's foot stays on the plane
    up = fine.moved(fine.vertices + np.stack([0.3 + 0.0 * rise, 0.0 * rise, rise], axis=1))
    # the wall is upright, its vertices see the move along x; the roofs' see the one along z
    inside = coarse.topology.interior & ~coarse.fixed
    wall = np.zeros(coarse.n, dtype=bool)
    wall[coarse.faces[coarse.patch_of_face == 2]] = True
    share = wall[inside].mean()
    expected = math.sqrt(share * 0.3**2 + (1.0 - share) * 0.1**2)
    assert refinement._moved(coarse, up) == pytest.approx(expected, rel=1e-6)


def test_closed_forms_are_met_with_second_order(tmp_path, monkeypatch):
    monkeypatch.setattr(refinement, "FAMILIES", refinement.FAMILIES[:3])
    monkeypatch.setattr(refinement, "_alone", refinement.run_family)
    perform(refinement.STUDY, tmp_path, short=True, steps=["data", "table"])
    folder = Folder(tmp_path / "refinement")
    orders = folder.read_table("orders").set_index(["family", "quantity"])
    for family in ("cap", "joined_caps"):
        for quantity in ("energy", "position"):
            assert orders.order[family, quantity] == pytest.approx(2.0, abs=0.2)
    records = folder.read_table("records")
    assert (records.largest_error_variational == NOISE).all()  # the bound: all are below it
    assert "seconds" not in records.columns
    claim = folder.read_table("fig09")
    assert claim.verdict.tolist() == ["confirmed"] * 2
    worse = records.assign(largest_error_cotangent=1.0 + records.level)
    assert refinement._claim(worse).verdict.tolist() == ["of the mean only"] * 2
    again = pd.concat([records, records.assign(level=records.level + 3)])
    verdicts = ["confirmed"] * 2 + ["not confirmed"] + ["confirmed"] * 2
    assert refinement._claim(again).verdict.tolist() == verdicts


# -------------------------------------------------------------------------------------- curved


def test_the_quickest_runs_that_are_accurate_enough(tmp_path):
    perform(curved.STUDY, tmp_path, short=True, steps=["data", "table"])
    folder = Folder(tmp_path / "curved")
    records = folder.read_table("records").set_index(["program", "elements"])
    assert "seconds" not in records.columns
    assert records.error["pcmc", "order 8"] < 1e-12
    # the same mesh, the same flat triangles, and quadratic ones that differ in their quadrature
    assert records.error["evolver", "linear"] == pytest.approx(records.error["pcmc", "flat"], rel=1e-3)
    assert records.error["evolver", "quadratic"] == pytest.approx(records.error["pcmc", "order 2"], rel=0.02)
    runs = pd.DataFrame(
        {
            "program": ["pcmc", "pcmc", "evolver"],
            "elements": ["flat", "order 2", "linear"],
            "error": [1e-5, 1e-6, 1e-4],
            "seconds": [1.0, 0.5, 2.0],
        }
    )
    row = curved._cheapest(runs, curved.CASES[0], 1e-4)
    assert (row["pcmc_elements"], row["evolver_elements"], row["theirs_over_ours"]) == (
        "order 2",
        "linear",
        4.0,
    )
    assert math.isnan(curved._cheapest(runs, curved.CASES[0], 1e-5)["theirs_over_ours"])
    assert curved._cheapest(runs, curved.CASES[0], 1e-7) == {}


@pytest.mark.nightly
def test_a_mesh_graded_towards_the_corner_of_an_l_keeps_its_order():
    even, graded = (
        [
            solve(curved.graded(edge, levels), target="stationary", order=2).energy
            for edge in (0.3, 0.15, 0.075)
        ]
        for levels in (0, 6)
    )
    assert np.log2((even[0] - even[1]) / (even[1] - even[2])) < 1.6  # 4/3 from the corner's r^(2/3)
    assert np.log2((graded[0] - graded[1]) / (graded[1] - graded[2])) > 2.5


# ------------------------------------------------------------------------------------- solvers


def test_solvers_side_by_side_on_one_small_mesh(tmp_path, monkeypatch):
    example = solvers.Example("small", "Small", lambda n: two_squares(n, alpha_aux=1.0), (4,), 0.005)
    monkeypatch.setattr(solvers, "EXAMPLES", (example,))
    perform(solvers.STUDY, tmp_path, short=True)
    folder = Folder(tmp_path / "solvers")
    summary = folder.read_table("summary").set_index("method")
    geometric = [solvers.GEOMETRIC, solvers.DEFAULT]
    assert summary.at_rest[geometric].eq(1).all()
    assert summary.verdicts[geometric].eq("1 stable").all()
    assert summary.at_rest.drop(geometric).eq(0).all()
    histories = folder.read_table("histories")
    for _, mine in histories.groupby("method"):
        assert mine.evaluation.is_monotonic_increasing
    ends = histories.groupby("method").residual.last()
    records = folder.read_table("records").set_index("method").residual
    assert np.allclose(ends[records.index], records, rtol=1e-9)
    for column in ("seconds", "wall_time"):
        assert column not in histories.columns
    assert folder.figure("residual-time").is_file()


# ------------------------------------------------------------------------------------ accuracy


@pytest.mark.nightly
@pytest.mark.parametrize("family", accuracy.FAMILIES, ids=lambda family: family.name)
def test_adaptive_meshes_go_on_up_to_the_limit_of_triangles(family, tmp_path):
    """The boundary is known: a guess is never as good as the accuracy that is asked for."""
    found = accuracy.adaptive(family, family.quantities[1], 700)
    assert found.status is AccuracyStatus.TRIANGLES
    assert len(found.history) > 1


def test_every_ladder_of_stored_bars_has_several_meshes():
    bars = pd.read_csv(RESULTS / "accuracy" / "bars.csv")
    assert bars.groupby(["family", "quantity", "meshes"]).triangles.nunique().min() >= 3


# --------------------------------------------------------------------------------------- bench


@pytest.mark.parametrize(
    "program", ["pcmc", pytest.param("Surface Evolver", marks=needs_evolver), "NLopt L-BFGS", "scipy L-BFGS"]
)
def test_each_program_of_the_bench_brings_a_cap_to_rest_and_is_heard_where_there_is_none(program):
    run = bench.PROGRAMS[program]
    end = run(spherical_cap(0.3, alpha=0.6))
    assert energy(end.surface) == pytest.approx(bench.CASES["cap"].exact, rel=0.01)
    assert certify(end.surface, modes=0).residual < 1e-4
    none = run(spherical_cap(0.3, alpha=0.45))
    assert none.surface is None or certify(none.surface, modes=0).residual > bench.REST
    assert none.said


EXACT = [name for name, case in bench.CASES.items() if case.exact == case.exact]


@pytest.mark.parametrize("name", [*EXACT[:3], *at_night(*EXACT[3:])])
def test_the_energies_of_the_bench_come_to_those_of_smooth_surfaces_with_the_square_of_the_edges(name):
    case = bench.CASES[name]
    errors = []
    for size in (case.sizes[0], case.sizes[0] / 2 if case.sizes[0] < 1 else 2 * case.sizes[0]):
        end, left = bench.through(bench.newton, case, case.build(size))
        assert left <= bench.REST
        errors.append(abs(bench.held_energy(end.surface) - case.exact))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)


def test_a_program_that_moves_vertices_alone_gets_the_pressure_that_leaves_the_least_forces():
    start = bench.CASES["inflation"].build(4)
    rest = bench.newton(start).surface
    assert certify(bench.ended(start, rest.vertices), modes=0).residual < 1e-9
    assert certify(start.moved(rest.vertices), modes=0).residual > 0.1
    assert bench.ended(start, 1e4 * rest.vertices) is None


def test_the_form_finding_of_kratos_gets_the_tensions_the_pressures_and_the_supports(monkeypatch):
    given = {}

    def answer(timeout, **model):
        given.update(model)
        return {"seconds": 2.0, "X": model["X"], "said": "at rest"}

    monkeypatch.setattr(kratos, "_answer", answer)
    surface = bench.CASES["two squares"].build(4)
    end = bench.kratos_form(surface)
    assert (end.seconds, end.said) == (2.0, "at rest")
    assert np.array_equal(given["fixed"][:, 0], surface.fixed)
    assert np.array_equal(given["fixed"][:, 2], surface.held)
    assert np.array_equal(given["prestress"], surface.tensions[surface.patch_of_face])
    assert np.array_equal(given["pressures"], surface.pressures[surface.patch_of_face])
    assert bench.kratos_form(bench.CASES["inflation"].build(2)).said.startswith("not asked")
