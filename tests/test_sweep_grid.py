"""What a sweep is declared by: its grid, its case function, how it is run."""

import numpy as np
import pytest
import sweep_cases

from pcmc.base.errors import OptionError
from pcmc.sweep import Sweep, run

CHAOS = Sweep("sweep_cases:chaos", {"rate": [3.7, 3.9]}, {"seed": 0.1})


def test_cases_are_the_product_in_order():
    sweep = Sweep(sweep_cases.echo, {"value": [1, 2.5], "other": ["a", None, [1, {"b": 2}]]})
    assert sweep.case == "sweep_cases:echo"
    assert len(sweep) == 6
    assert list(sweep)[2] == {"value": 1, "other": [1, {"b": 2}]}
    assert list(sweep)[3] == {"value": 2.5, "other": "a"}


def test_lists_in_a_value_may_have_different_lengths():
    values = [[[1, 2], [3]], [[4, [5, {"a": [6]}]]], [], np.eye(2)]
    sweep = Sweep(sweep_cases.echo, {"value": values})
    assert list(sweep.grid["value"]) == [*values[:3], [[1.0, 0.0], [0.0, 1.0]]]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("sweep_cases:chaos", {"sed": [1.0], "rate": [1.0]}), "'sed'; did you mean 'seed'?"),
        (("sweep_cases:chaos", {"seed": [1.0]}), "needs the parameter 'rate'"),
        (("sweep_cases:chaos", {"seed": [1.0]}, {"rate": 1, "colour": 2}), "parameter 'colour'"),
        (("sweep_cases:chaos", {}), "the grid is empty"),
        (("sweep_cases:chaos", {"seed": []}), r"grid\['seed'\] is empty"),
        (("sweep_cases:chaos", {"seed": 0.5}), "a list of values, found 0.5"),
        (("sweep_cases:chaos", {"seed": "abc"}), "a list of values, found 'abc'"),
        (("sweep_cases:chaos", {"seed": {"a", "b"}}), "a list of values, found {'"),
        (("sweep_cases:chaos", {"seed": np.array(3.0)}), r"a list of values, found array\(3"),
        (("sweep_cases:chaos", [("seed", [1.0])]), "grid: expected a dict by parameter names"),
        (("sweep_cases:chaos", None), "grid: expected a dict by parameter names, found None"),
        (("sweep_cases:anything", {1: [1.0]}), "grid: expected a dict by parameter names"),
        (
            ("sweep_cases:chaos", {"seed": [1.0]}, [3.7]),
            "fixed: expected a dict by parameter names",
        ),
        (("sweep_cases:chaos", {"seed": [10**5000]}), "found a whole one of 16610 bits"),
        (("sweep_cases:chaos", {"seed": ["\ud800"]}), r"whole characters, found '\\ud800'"),
        (("sweep_cases:chaos", {"seed": np.ma.array([0.5], mask=[True])}), "found masked"),
        (("sweep_cases:chaos", {"seed": [1, 2, 1]}), "the value 1 twice, at 0 and 2"),
        (
            ("sweep_cases:chaos", {"seed": [1.0, object()]}),
            r"parameter seed\[1\]: expected a number",
        ),
        (("sweep_cases:chaos", {"seed": [{1: 2}]}), r"parameter seed\[0\]: keys must be texts"),
        (("sweep_cases:chaos", {"seed": [1.0]}, {"seed": 2.0}), "in the grid and among the fixed"),
        (("sweep_cases:anything", {"verdict": [1]}), "may not be called 'verdict'"),
        (("sweep_cases:kaos", {"seed": [1.0]}), "'sweep_cases:kaos' cannot be found"),
        (("no_such_module:chaos", {"seed": [1.0]}), "cannot be found"),
        (("sweep_cases", {"seed": [1.0]}), "expected 'package.module:function'"),
        (("sweep_cases:math.pi", {"seed": [1.0]}), "is not a function"),
        (("builtins:iter", {"seed": [1.0]}), "does not say which parameters"),
        ((lambda seed: {}, {"seed": [1.0]}), "cannot be imported by a worker"),
    ],
)
def test_bad_declarations_are_refused(arguments, words):
    with pytest.raises(OptionError, match=words):
        Sweep(*arguments)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"workers": 0}, "workers: expected a whole number ≥ 1, found 0"),
        ({"workers": 2.5}, "workers: expected a whole number"),
        ({"workers": "2"}, "workers: expected a whole number"),
        ({"time_limit": 0.0}, r"time_limit \(seconds; None for no limit\): expected .* > 0"),
        ({"time_limit": float("nan")}, "time_limit .* expected a finite number"),
        ({"time_limit": float("inf")}, "time_limit .* expected a finite number"),
        ({"time_limit": 1e300}, "time_limit .* < "),
        ({"time_limit": "5"}, "time_limit .* found '5'"),
        ({"executor": 4}, "executor: expected one of concurrent.futures, found 4"),
        ({"scheduler": 4}, "scheduler: expected 'tcp://host:8786', found 4"),
        ({"on_record": 4}, "on_record: expected a function of a Progress, found 4"),
        ({"workers": 2, "scheduler": "tcp://127.0.0.1:1"}, "scheduler and workers exclude"),
    ],
)
def test_bad_options_are_refused(options, words):
    with pytest.raises(OptionError, match=words):
        run(CHAOS, **options)
