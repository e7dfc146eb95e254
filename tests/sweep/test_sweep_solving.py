"""The case most sweeps want: build, solve, certify."""

import subprocess
import sys
from dataclasses import replace

import pytest

import pcmc
from generators import double_bubble, two_squares
from pcmc.base.errors import OptionError
from pcmc.sweep import Sweep, run, solve_case
from pcmc.sweep.solving import case_row


def test_solve_case_gives_the_solvers_and_the_surfaces_numbers():
    values = solve_case("generators:two_squares", "lbfgs", n=4, alpha_aux=1.0, tolerance=1e-6)
    assert values["status"] == "converged"
    assert values["gradient_squared"] <= 1e-6
    result = pcmc.solve(two_squares(4, alpha_aux=1.0), "lbfgs", tolerance=1e-6)
    assert values["energy"] == result.energy
    assert values["triangles"] == result.surface.m
    assert values["verdict"] == result.certificate.verdict.name.lower().replace("_", " ")
    assert values["residual"] == result.certificate.residual
    assert values["right.area"] == result.certificate.patches["area"][1]
    assert values["boundary 0.length"] == result.certificate.boundaries["length"][0]


def with_volume(volume):
    """A generator that calls a parameter as the certificate calls a number."""
    return two_squares(4, alpha=volume)


def test_solve_case_renames_a_number_that_a_parameter_has_the_name_of():
    values = solve_case("tests.sweep.test_sweep_solving:with_volume", "nesterov", volume=2.0, iterations=0)
    assert "volume" not in values
    assert values["volume_reached"] == pcmc.certify(two_squares(4, alpha=2.0)).volume


def test_a_room_with_the_name_of_a_wall_leaves_the_wall_its_numbers():
    bubbles = double_bubble(0.6, volumes=(1.0, 1.0))
    left, right = bubbles.rooms
    values = case_row(pcmc.solve(bubbles.rebuilt(rooms=(replace(left, name="wall"), right))), ())
    assert values["wall.pressure"] == 0.0
    assert values["room wall.pressure"] == values["left.pressure"] > 1.0


def test_solve_case_in_a_sweep():
    grid = {"alpha": [1.0, 2.0], "iterations": [3, 1000]}
    fixed = {"generator": "generators:two_squares", "method": "nesterov", "n": 4}
    result = run(Sweep(solve_case, grid, fixed), workers=1)
    assert result["status"].tolist()[::2] == ["iteration limit"] * 2
    assert result["iterations_taken"].tolist()[::2] == [3, 3]
    assert result["energy"].is_unique


@pytest.mark.parametrize(
    ("fixed", "words"),
    [
        ({"generator": "generators:two_square"}, "'generators:two_square' cannot be found"),
        ({"generator": "generators:two_squares", "method": "newtn"}, "did you mean 'newton'"),
        ({"generator": "generators:two_squares", "alpha_au": 3}, "'alpha_au'; did you mean 'alpha_aux'"),
        ({"generator": "generators:two_squares", "gama": 3}, "'gama'; did you mean 'gamma'"),
        ({"generator": "generators:two_squares", "gamma": -1.0}, "gamma: expected"),
        ({}, "needs the parameter 'generator'"),
    ],
)
def test_solve_case_refuses_unknown_names_before_any_case(fixed, words):
    with pytest.raises(OptionError, match=words):
        Sweep("pcmc.sweep:solve_case", {"alpha": [1.0]}, {"method": "nesterov"} | fixed)


POSTPONED = """
import sys
import numpy
from pcmc.sweep.case_script import postpone
postpone("numpy.f2py")
postpone("numpy.no_such_part")
postpone("no_such_package.part")
import scipy.linalg
print("numpy.f2py.crackfortran" in sys.modules)
print(callable(numpy.f2py.run_main), "numpy.f2py.crackfortran" in sys.modules)
"""


def test_what_no_case_needs_is_imported_when_it_is_used():
    found = subprocess.run([sys.executable, "-c", POSTPONED], capture_output=True, text=True, check=True)
    assert found.stdout.split() == ["False", "True", "True"]
