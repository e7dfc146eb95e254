"""The geometric solver when it is stopped, reaches a limit, or is asked wrongly."""

from functools import partial

import numpy as np
import pytest
from backends import every_backend
from refusals import refused
from starts import four_fans, spherical_cap, two_caps, two_squares

from pcmc import energy, solve
from pcmc.base.errors import MissingExtra, OptionError
from pcmc.certificate import Verdict
from pcmc.solvers.newton import NewtonOptions
from pcmc.solvers.result import Status
from pcmc.stability.factorisation import BACKENDS, installed

pytestmark = [
    pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning"),
    every_backend,
]


def stop_at(iteration, error):
    """A callback that raises at an iteration, and the surfaces it has been shown."""
    seen = []

    def callback(progress):
        seen.append(progress.surface())
        if progress.iteration == iteration:
            raise error

    return callback, seen


@pytest.mark.parametrize("error", [StopIteration, KeyboardInterrupt])
@pytest.mark.parametrize("iteration", [0, 3])
def test_stopped_on_request(backend, error, iteration):
    callback, seen = stop_at(iteration, error)
    result = solve(two_caps(0.8), callback=callback, backend=backend)
    assert result.status is Status.STOPPED
    assert "stopped on request" in result.message
    assert not result.converged
    assert result.iterations == iteration
    assert len(result.history) == len(seen) == iteration + 1
    np.testing.assert_array_equal(result.surface.vertices, seen[-1].vertices)
    assert result.energy == result.history["energy"].iloc[-1]
    assert result.energy == pytest.approx(energy(result.surface), rel=1e-14)
    assert result.certificate.verdict is Verdict.NOT_CONVERGED


@pytest.mark.parametrize("call", [1, 3, 5, 6])
def test_interrupted_in_the_middle_of_a_step(backend, call, monkeypatch):
    """Ctrl-C comes while a trial shape is being measured: the result is the last finished step's."""
    from pcmc.stability import equilibrium

    measured = equilibrium.energy_and_gradient
    calls = iter(range(10**6))

    def pressed(surface, X, supports):
        if next(calls) == call:
            raise KeyboardInterrupt
        return measured(surface, X, supports=supports)

    monkeypatch.setattr(equilibrium, "energy_and_gradient", pressed)
    result = solve(two_caps(0.8), backend=backend)
    assert result.status is Status.STOPPED
    assert result.energy == pytest.approx(energy(result.surface), rel=1e-14)
    assert result.energy == result.history["energy"].iloc[-1]


def test_stopped_on_a_refined_level(backend):
    def callback(progress):
        if progress.row["level"] == 1:
            raise StopIteration

    surface = spherical_cap(0.5)
    result = solve(surface, callback=callback, levels=2, backend=backend)
    assert result.status is Status.STOPPED
    assert result.surface.m == 4 * surface.m
    assert result.history["level"].iloc[-1] == 1


def test_other_exceptions_pass_through(backend):
    callback, seen = stop_at(2, ZeroDivisionError("mine"))
    with pytest.raises(ZeroDivisionError, match="mine"):
        solve(two_squares(4), callback=callback, backend=backend)
    assert len(seen) == 3


def test_the_callback_is_shown_each_row(backend):
    rows = []
    result = solve(
        two_squares(4), callback=lambda p: rows.append((p.iteration, dict(p.row))), backend=backend
    )
    assert [i for i, _ in rows] == list(range(len(result.history)))
    assert [row["energy"] for _, row in rows] == result.history["energy"].tolist()


@pytest.mark.parametrize("iterations", [0, 1, 2])
def test_the_iteration_limit(backend, iterations):
    surface = two_caps(0.8)
    result = solve(surface, iterations=iterations, backend=backend)
    assert result.status is Status.ITERATION_LIMIT
    assert result.iterations == iterations
    assert result.energy == pytest.approx(energy(result.surface), rel=1e-14)
    if iterations == 0:
        np.testing.assert_array_equal(result.surface.vertices, surface.vertices)


def test_a_tolerance_that_rounding_cannot_meet_counts_as_met(backend):
    result = solve(two_squares(4, alpha_aux=1.0), tolerance=1e-30, backend=backend)
    assert result.status is Status.CONVERGED
    assert result.iterations <= 20
    assert 1e-30 < result.certificate.residual < 1e-14
    assert result.message.startswith("newton: converged: rounding lets no step lower the residual")


def test_a_loose_tolerance_ends_early(backend):
    tight = solve(two_caps(0.8), backend=backend)
    loose = solve(two_caps(0.8), tolerance=1e-3, backend=backend)
    assert loose.converged
    assert loose.iterations < tight.iterations
    assert tight.certificate.residual < loose.certificate.residual <= 1e-3


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ({"tolerance": 0.0}, "tolerance: expected a finite number > 0, found 0.0"),
        ({"tolerance": float("nan")}, "tolerance: expected a finite number > 0, found nan"),
        ({"iterations": -1}, "iterations: expected a whole number ≥ 0, found -1"),
        ({"iterations": 2.5}, "iterations: expected a whole number ≥ 0, found 2.5"),
        ({"target": "minimal"}, "unknown target 'minimal'; did you mean 'minimum'"),
        ({"levels": -1}, "levels: expected a whole number ≥ 0, found -1"),
        ({"levles": 1}, "unknown option of method 'newton' 'levles'; did you mean 'levels'"),
        ({"min_quality": "x"}, "min_quality: expected a finite number ≥ 0 and < 1, found 'x'"),
        ({"inflation": 0.5}, "inflation: expected a finite number > 1, found 0.5"),
        ({"inflation": float("nan")}, "inflation: expected a finite number > 1, found nan"),
    ],
)
def test_options_are_checked_by_name(backend, option, message):
    with pytest.raises(OptionError, match=f"^{message}"):
        solve(two_squares(4), **{"backend": backend} | option)


def test_a_backend_that_does_not_exist_is_refused(backend):
    with refused(OptionError, what="backend", found="pardisso", expected=BACKENDS):
        solve(two_squares(4), backend="pardisso")


def test_stopped_on_the_second_way_the_first_one_counts_if_it_came_farther(backend):
    """The second way starts again at residual 0.2 and is stopped there."""
    seen = []

    def callback(progress):
        seen.append(progress.row)
        if progress.row["step"] == "start" and len(seen) > 1:
            raise StopIteration

    result = solve(four_fans(7), callback=callback, backend=backend)
    assert result.status is Status.STOPPED
    assert len(result.history) == len(seen) - 1
    assert result.history["residual"].iloc[-1] < seen[-1]["residual"]
    assert result.energy == result.history["energy"].iloc[-1]
    assert result.energy == pytest.approx(energy(result.surface), rel=1e-12)


def test_a_backend_that_is_not_installed_is_named_with_its_extra(backend, monkeypatch):
    monkeypatch.setattr("pcmc.stability.factorisation.installed", lambda: ("superlu",))
    with pytest.raises(MissingExtra, match=r"pypardiso is not installed.*\[fast\]"):
        solve(two_squares(4), backend="pardiso")
    assert solve(two_squares(4)).converged


def test_options_are_values(backend):
    assert NewtonOptions(backend=backend) == NewtonOptions(backend=backend)
    assert NewtonOptions().target == "minimum"


@pytest.mark.parametrize("make", [partial(two_squares, 6), partial(two_caps, 0.8), partial(four_fans, 5)])
def test_every_backend_gives_the_same(backend, make):
    first = solve(make(), target="stationary", backend=installed()[0])
    other = solve(make(), target="stationary", backend=backend)
    assert other.status is first.status
    assert abs(other.iterations - first.iterations) <= 1
    assert other.energy == pytest.approx(first.energy, rel=1e-9)
    assert other.certificate.index == first.certificate.index
