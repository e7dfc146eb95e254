"""Checks of the numbers that generators are given."""

from __future__ import annotations

import math
import operator

from pcmc.base.errors import OptionError


def positive(value: float, name: str) -> float:
    """A finite number above 0.

    >>> positive(2, "radius")
    2.0
    """
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not (math.isfinite(number) and number > 0.0):
        raise OptionError(f"{name} must be a finite number > 0, found {value!r}")
    return number


def whole(value: int, name: str, least: int = 1) -> int:
    """A whole number of at least ``least``.

    >>> whole(4, "rings")
    4
    """
    try:
        number = operator.index(value)
    except TypeError:
        number = least - 1
    if number < least:
        raise OptionError(f"{name} must be a whole number ≥ {least}, found {value!r}")
    return number
