"""NLopt's L-BFGS: its unknowns, its answers beside the flow's, and every way it ends."""

import contextlib
import gc
import weakref

import numpy as np
import pytest
from nightly import at_night
from shapes import cap, pyramid, shaken, three_patches

from pcmc import Plane, energy, gradient, solve
from pcmc.base.errors import OptionError
from pcmc.forces.functional import energy_and_gradient, energy_at
from pcmc.plan import plan_from
from pcmc.solvers.evaluate import Evaluator
from pcmc.solvers.lbfgs import Coordinates, LbfgsOptions, lbfgs
from pcmc.solvers.result import Status


def generic():
    return shaken(three_patches(3, Plane((1, 2, 3), (1, -2, 2))))


def test_unknowns_are_what_the_supports_leave():
    surface = generic()
    unknowns = Coordinates(surface)
    assert unknowns.count == 3 * surface.free.sum() + 2 * surface.on_plane.sum()
    np.testing.assert_array_equal(unknowns.positions(np.zeros(unknowns.count)), surface.vertices)
    X = unknowns.positions(np.random.default_rng(0).standard_normal(unknowns.count))
    np.testing.assert_array_equal(X[surface.fixed], surface.vertices[surface.fixed])
    assert np.abs(surface.plane.height(X[surface.on_plane])).max() < 1e-14


def test_reduced_gradient_is_the_derivative_by_the_unknowns():
    surface = generic()
    unknowns = Coordinates(surface)
    s = 0.1 * np.random.default_rng(1).standard_normal((2, unknowns.count))
    X = unknowns.positions(s[0])
    g = unknowns.reduce(gradient(surface.moved(X)))
    assert (g**2).sum() / unknowns.unit**2 == pytest.approx((gradient(surface.moved(X)) ** 2).sum())
    h = 1e-6
    ends = [energy_at(surface, unknowns.positions(s[0] + sign * h * s[1])) for sign in (1, -1)]
    assert (ends[0] - ends[1]) / (2 * h) == pytest.approx(g @ s[1], rel=1e-7)


def test_the_pyramid():
    result = solve(pyramid(), "lbfgs", tolerance=1e-18)
    assert result.status is Status.CONVERGED
    assert result.surface.vertices[4] == pytest.approx([0, 0, 1 / np.sqrt(8)], abs=1e-9)


def test_less_energy_in_fewer_evaluations_than_the_flow():
    flow = solve(cap(4), "nesterov", t0=0.05, tolerance=1e-8, iterations=10_000)
    other = solve(cap(4), "lbfgs", tolerance=1e-8)
    assert flow.converged
    assert other.converged
    assert other.energy == pytest.approx(flow.energy, rel=1e-6)
    assert other.evaluations < 0.5 * flow.evaluations


def test_history_and_result_describe_the_surface():
    surface = generic()
    result = solve(surface, "lbfgs", evaluations=25)
    history = result.history
    assert history.columns.tolist() == ["evaluation", "energy", "gradient_squared"]
    assert history.evaluation.tolist() == list(range(1, len(history) + 1))
    assert history.energy[0] == energy_and_gradient(surface)[0]
    E, g = energy_and_gradient(result.surface)
    assert history.energy.iloc[-1] == result.energy == E
    assert history.gradient_squared.iloc[-1] == pytest.approx((g**2).sum(), rel=1e-13)
    assert result.energy <= history.energy.min() + 1e-12
    assert result.evaluations == result.iterations == len(history)
    assert result.method == "lbfgs"


@pytest.mark.parametrize("limit", range(1, 12))
def test_evaluation_limit_returns_the_best(limit):
    result = solve(generic(), "lbfgs", evaluations=limit)
    assert result.status is Status.ITERATION_LIMIT
    # One more where the last trial was not the best, to end the history with the best.
    energies = result.history.energy[:limit]
    assert result.evaluations - limit == (energies.idxmin() != limit - 1)
    assert result.energy == result.history.energy.min()
    assert result.energy == energy_and_gradient(result.surface)[0]


@pytest.mark.parametrize("tolerance", [0, None])
def test_without_tolerance_it_goes_on_until_no_step_helps(tolerance):
    result = solve(pyramid(), "lbfgs", tolerance=tolerance)
    assert result.status is Status.STALLED
    assert result.history.gradient_squared.iloc[-1] < 1e-15


def test_nlopts_wordless_failure_is_a_status(monkeypatch):
    measure = Evaluator.__call__

    def uphill(self, X):
        point = measure(self, X)
        return point._replace(gradient=-point.gradient)

    monkeypatch.setattr(Evaluator, "__call__", uphill)
    result = solve(generic(), "lbfgs")
    assert result.status is Status.STALLED
    assert "no further step" in result.message


def test_over_inflation_is_divergence():
    below_the_fold = cap(4).retensioned({"cap": 0.3})
    result = solve(below_the_fold, "lbfgs")
    assert result.status is Status.DIVERGED
    assert np.isfinite(result.surface.vertices).all()
    assert result.energy == energy_and_gradient(result.surface)[0]


def test_numbers_beyond_the_floats_end_with_the_last_finite_surface(monkeypatch):
    measure = Evaluator.__call__

    def breaking(self, X):
        point = measure(self, X)
        return point._replace(energy=np.nan) if self.count == 6 else point

    monkeypatch.setattr(Evaluator, "__call__", breaking)
    result = solve(generic(), "lbfgs")
    assert result.status is Status.NON_FINITE
    assert np.isfinite(result.energy)
    assert np.isfinite(result.history.energy).all()


def test_triangles_that_collapse_lower_the_energy_and_the_message_says_what_to_type():
    outline = [[0, 0], [12, 0], [12, 8], [0, 8]]
    surface = plan_from({"outline": outline, "edge_length": 1.0, "tension": 4.0}).surface()
    result = solve(surface, "lbfgs")
    assert result.status is Status.STALLED
    assert result.energy < solve(surface).energy
    assert "its triangles collapse, as that lowers E" in result.message
    assert "method='newton'" in result.message


def test_nothing_to_move():
    result = solve(pyramid(fixed=range(5)), "lbfgs")
    assert (result.status, result.evaluations) == (Status.CONVERGED, 1)
    assert result.energy == energy(pyramid())


@pytest.mark.parametrize("request_", [StopIteration, KeyboardInterrupt])
def test_a_callback_stops_it(request_):
    seen = []

    def callback(progress):
        seen.append((progress.row["evaluation"], progress.row["energy"], progress.surface()))
        if progress.iteration == 9:  # a trial that is worse than the point before
            raise request_

    result = solve(generic(), "lbfgs", callback)
    assert result.status is Status.STOPPED
    assert [k for k, _, _ in seen] == list(range(1, 10))
    best = min(seen, key=lambda one: one[1])
    assert best is not seen[-1]
    assert result.energy == best[1]
    np.testing.assert_array_equal(result.surface.vertices, best[2].vertices)


@pytest.mark.parametrize("place", [1, 5])
def test_other_exceptions_of_a_callback_pass_through(place):
    calls = []

    def callback(progress):
        calls.append(progress.iteration)
        if progress.iteration == place:
            raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        solve(generic(), "lbfgs", callback)
    assert len(calls) == place


def test_the_same_run_gives_the_same_bytes():
    one, two = (solve(generic(), "lbfgs", evaluations=60) for _ in range(2))
    assert one.history.to_csv() == two.history.to_csv()
    assert one.surface.vertices.tobytes() == two.surface.vertices.tobytes()


def fail(progress):
    raise ZeroDivisionError


def stop(progress):
    raise StopIteration


@pytest.mark.parametrize("callback", [*at_night(None), fail, *at_night(stop)])
def test_nothing_of_a_run_stays_in_memory(callback):
    surface = generic()
    alive = weakref.ref(surface)
    with contextlib.suppress(ZeroDivisionError):
        lbfgs(surface, LbfgsOptions(evaluations=5), callback)
    del surface
    gc.collect()
    assert alive() is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tolerance": np.inf}, "tolerance: expected a finite number ≥ 0, found inf"),
        ({"evaluations": 0}, "evaluations: expected a whole number ≥ 1, found 0"),
        ({"memory": -1}, "memory: expected a whole number ≥ 0, found -1"),
        ({"inflation": 0.5}, r"inflation: expected a finite number > 1, found 0\.5"),
        ({"iterations": 5}, "unknown option of method 'lbfgs' 'iterations'; did you mean"),
    ],
)
def test_bad_options_are_named(options, message):
    with pytest.raises(OptionError, match=message):
        solve(pyramid(), "lbfgs", **options)
