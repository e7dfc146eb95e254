"""One call for every solver: what it refuses, and what its results say."""

from unittest import mock

import pytest
from refusals import refused
from shapes import pyramid

from pcmc import solve
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.solvers import METHODS, find_method
from pcmc.solvers.lbfgs import LbfgsOptions
from pcmc.solvers.nesterov import NesterovOptions
from pcmc.solvers.newton import NewtonOptions
from pcmc.solvers.result import Status, until_stopped


@pytest.mark.parametrize("method", METHODS)
def test_every_method_solves_the_pyramid(method):
    result = solve(pyramid(), method)
    assert result.status is Status.CONVERGED
    assert result.message.startswith(f"{method}: converged")
    assert result.surface.vertices[4, 2] == pytest.approx(8**-0.5, abs=1e-4)
    assert {"evaluation", "energy", "gradient_squared"} <= set(result.history.columns)


@pytest.mark.parametrize("method", METHODS)
def test_unknown_options_are_refused_with_the_nearest(method):
    with pytest.raises(OptionError, match=f"unknown option of method '{method}' 'tolerence'; did"):
        solve(pyramid(), method, tolerence=1e-3)


def test_unknown_methods_are_refused_with_the_nearest():
    known = ("newton", "nesterov", "lbfgs")
    with refused(OptionError, what="method", found="l-bfgs", expected=known) as error:
        solve(pyramid(), "l-bfgs")
    assert "did you mean 'lbfgs'?" in str(error.value)
    with refused(OptionError, what="method", found=3):
        solve(pyramid(), 3)


def test_what_is_not_a_surface_or_a_callback():
    with refused(SurfaceError, what="surface", found="list"):
        solve([1, 2, 3])
    with refused(OptionError, what="callback", found=5):
        solve(pyramid(), "lbfgs", 5)


@pytest.mark.parametrize(
    ("name", "options"), [("newton", NewtonOptions), ("nesterov", NesterovOptions), ("lbfgs", LbfgsOptions)]
)
def test_a_method_is_a_function_and_its_options(name, options):
    method = find_method(name)
    assert method.options is options
    assert method.solve(pyramid(), options(), None).method == name


def test_every_status_says_what_happened_and_what_to_do():
    for status in set(Status) - {Status.CONVERGED}:
        happened, to_do = status.value.split("; ", 1)
        assert happened
        assert to_do


def test_a_request_to_stop_becomes_a_status_in_one_place():
    for error in (StopIteration, KeyboardInterrupt):
        assert until_stopped(mock.Mock(side_effect=error), Status.STOPPED) is Status.STOPPED
    assert until_stopped(lambda: Status.STALLED, Status.STOPPED) is Status.STALLED
    with pytest.raises(ZeroDivisionError):
        until_stopped(mock.Mock(side_effect=ZeroDivisionError), Status.STOPPED)


@pytest.mark.parametrize("method", METHODS)
def test_a_request_to_stop_at_the_last_iteration(method):
    """The flow and L-BFGS have converged there; Newton would still look for a way down from a saddle."""
    tolerance = {"newton": 1e-12, "nesterov": 1e-8, "lbfgs": 1e-8}[method]
    column = "residual" if method == "newton" else "gradient_squared"

    def callback(progress):
        if progress.row[column] <= tolerance:
            raise StopIteration

    result = solve(pyramid(), method, callback)
    expected = Status.STOPPED if method == "newton" else Status.CONVERGED
    assert result.status is expected
    assert result.history[column].iloc[-1] <= tolerance
