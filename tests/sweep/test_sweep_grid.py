"""What a sweep is declared by: its grid, its case function, how it is run."""

import re

import numpy as np
import pytest
import sweep_cases
from refusals import refused

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


CASE = "sweep_cases:chaos"
HALF = "\ud800"


@pytest.mark.parametrize(
    ("arguments", "fields"),
    [
        ((CASE, {"seed": [1.0]}), {"what": "rate"}),
        ((CASE, {"seed": [1.0]}, {"rate": 1, "colour": 2}), {"what": "colour"}),
        ((CASE, {}), {"what": "grid", "where": None}),
        ((CASE, {"seed": []}), {"what": "grid", "where": "seed"}),
        ((CASE, {"seed": 0.5}), {"what": "grid", "where": "seed", "found": 0.5}),
        ((CASE, {"seed": "abc"}), {"what": "grid", "where": "seed", "found": "abc"}),
        ((CASE, {"seed": {"a", "b"}}), {"what": "grid", "where": "seed", "found": {"a", "b"}}),
        ((CASE, {"seed": np.array(3.0)}), {"what": "grid", "where": "seed"}),
        ((CASE, [("seed", [1.0])]), {"what": "grid", "found": [("seed", [1.0])]}),
        ((CASE, None), {"what": "grid", "found": None}),
        (("sweep_cases:anything", {1: [1.0]}), {"what": "grid", "found": {1: [1.0]}}),
        ((CASE, {"seed": [1.0]}, [3.7]), {"what": "fixed", "found": [3.7]}),
        ((CASE, {"seed": [10**5000]}), {"what": "seed[0]", "found": 10**5000}),
        ((CASE, {"seed": [HALF]}), {"what": "seed[0]", "found": HALF}),
        ((CASE, {"seed": np.ma.array([0.5], mask=[True])}), {"what": "seed[0]"}),
        ((CASE, {"seed": [1, 2, 1]}), {"what": "grid", "where": ("seed", 2), "found": 1}),
        ((CASE, {"seed": [1.0, object]}), {"what": "seed[1]", "found": object}),
        ((CASE, {"seed": [{1: 2}]}), {"what": "seed[0]", "found": {1: 2}}),
        ((CASE, {"seed": [1.0]}, {"seed": 2.0}), {"what": "fixed", "where": "seed"}),
        (("sweep_cases:anything", {"verdict": [1]}), {"what": "verdict"}),
        (("no_such_module:chaos", {"seed": [1.0]}), {"what": "case"}),
        (("sweep_cases:math.pi", {"seed": [1.0]}), {"what": "case"}),
        (("builtins:iter", {"seed": [1.0]}), {"what": "case", "found": "builtins:iter"}),
    ],
)
def test_bad_declarations_are_refused(arguments, fields):
    with refused(OptionError, **fields):
        Sweep(*arguments)


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        ((CASE, {"sed": [1.0], "rate": [1.0]}), r"'sed'; did you mean 'seed'\?"),
        (("sweep_cases", {"seed": [1.0]}), "expected 'package.module:function'"),
        (("sweep_cases:kaos", {"seed": [1.0]}), "'sweep_cases:kaos' cannot be found"),
        ((CASE, {"seed": 0.5}), "a single value belongs to fixed"),
        ((lambda seed: {}, {"seed": [1.0]}), "put it at the top level of a module"),
    ],
)
def test_messages_say_what_to_type(arguments, hint):
    with pytest.raises(OptionError, match=hint):
        Sweep(*arguments)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("workers", 0),
        ("workers", 2.5),
        ("workers", "2"),
        ("time_limit", 0.0),
        ("time_limit", float("nan")),
        ("time_limit", float("inf")),
        ("time_limit", 1e300),
        ("time_limit", "5"),
        ("executor", 4),
        ("scheduler", 4),
        ("on_record", 4),
    ],
)
def test_bad_options_are_refused(name, value):
    with pytest.raises(OptionError, match=f"^{name}.*: expected .*found {re.escape(repr(value))}"):
        run(CHAOS, **{name: value})


def test_options_that_exclude_each_other_are_refused():
    with refused(OptionError, found=("scheduler", "workers")):
        run(CHAOS, workers=2, scheduler="tcp://127.0.0.1:1")
