"""One call for every solver: what it refuses, and what its results say."""

import pytest
from shapes import pyramid

from pcmc import solve
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.solvers import METHODS
from pcmc.solvers.result import Status


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
    with pytest.raises(OptionError, match="unknown method 'l-bfgs'; did you mean 'lbfgs'"):
        solve(pyramid(), "l-bfgs")
    with pytest.raises(OptionError, match="unknown method 3"):
        solve(pyramid(), 3)


def test_what_is_not_a_surface_or_a_callback():
    with pytest.raises(SurfaceError, match="solve: expected a Surface, found list"):
        solve([1, 2, 3])
    with pytest.raises(OptionError, match="callback: expected a function of a Progress, found 5"):
        solve(pyramid(), "lbfgs", 5)


def test_every_status_says_what_to_do():
    sentences = [status.value for status in Status]
    assert len(set(sentences)) == len(sentences)
    assert all(len(sentence) > 20 for sentence in sentences)
