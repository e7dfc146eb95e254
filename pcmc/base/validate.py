"""Checks of single values, for the whole package. Each error names the parameter.

``where`` names the owner of the parameter, such as the patch of a tension; ``hint``, what to do, ends the
message; ``error`` is the exception to raise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from numbers import Integral, Real
from reprlib import Repr
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

from .errors import OptionError, PcmcError, unknown

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

LARGEST = 1e50  # of a coordinate, tension or pressure: the squares of forces stay finite
MOST = 2**31 - 1  # of a count: more steps, levels or vertices than that no run can have

Options = TypeVar("Options", bound="DataclassInstance")


def number(
    name: str,
    value: object,
    *,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
    most: float | None = None,
    where: str | None = None,
    hint: str = "",
    error: type[PcmcError] = OptionError,
) -> float:
    """A finite float within its bounds: above < value, least ≤ value, value < below, value ≤ most.

    >>> number("gamma", 1.5, least=0.0, below=1.0)
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: gamma: expected a finite number ≥ 0 and < 1, found 1.5
    """
    given = real(value)
    if not (
        math.isfinite(given)
        and (above is None or given > above)
        and (least is None or given >= least)
        and (below is None or given < below)
        and (most is None or given <= most)
    ):
        limits = [(above, ">"), (least, "≥"), (below, "<"), (most, "≤")]
        bounds = " and ".join(f"{sign} {limit:g}" for limit, sign in limits if limit is not None)
        refuse(name, value, f"a finite number {bounds}".rstrip(), where, hint, error)
    return given


def real(value: object) -> float:
    """A real number as a float; NaN for anything else, and where a float cannot hold it.

    >>> real(2), real("2"), real(10**400)
    (2.0, nan, nan)
    """
    if not isinstance(value, Real) or isinstance(value, bool):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.nan


def parsed(text: str) -> float:
    """The number in a text; ValueError for another text, and for 1_000, which Python alone reads as one.

    >>> parsed("1.5e3")
    1500.0
    """
    if "_" in text or not text.isascii():
        raise ValueError(f"no number: {text!r}")
    return float(text)


def positive(name: str, value: object) -> float:
    """A finite float > 0.

    >>> positive("radius", 2)
    2.0
    """
    return number(name, value, above=0.0)


def integer(
    name: str,
    value: object,
    least: int = 0,
    *,
    most: int = MOST,
    where: str | None = None,
    hint: str = "",
    error: type[PcmcError] = OptionError,
) -> int:
    """An int ≥ least and ≤ most.

    >>> integer("iterations", 2.5)
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: iterations: expected a whole number ≥ 0, found 2.5
    """
    if not isinstance(value, Integral) or isinstance(value, bool) or not least <= int(value) <= most:
        above = isinstance(value, Integral) and int(value) > most
        bounds = f"≥ {least} and ≤ {most}" if above else f"≥ {least}"
        refuse(name, value, f"a whole number {bounds}", where, hint, error)
    return int(value)


def flag(name: str, value: object) -> bool:
    """True or False; 0, 1 and others are refused."""
    if not isinstance(value, bool):
        refuse(name, value, "True or False")
    return value


def vector(name: str, value: Any, *, error: type[PcmcError] = OptionError) -> tuple[float, float, float]:
    """Three finite numbers.

    >>> vector("normal", [0, 0, 1])
    (0.0, 0.0, 1.0)
    """
    try:
        x, y, z = (real(c) for c in value)
    except (TypeError, ValueError):
        x = y = z = math.nan
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        refuse(name, value, "three finite numbers", error=error)
    return x, y, z


def choice(name: str, value: object, known: Sequence[str]) -> str:
    """One of the known names.

    >>> choice("armijo", "suficient", ["printed", "sufficient"])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: unknown armijo 'suficient'; did you mean 'sufficient'? Known: ...
    """
    if not isinstance(value, str) or value not in known:
        found = value if isinstance(value, str) else shown(value)
        raise OptionError(unknown(name, found, known), what=name, found=value, expected=tuple(known))
    return str(value)


def build(kind: type[Options], method: str, given: dict[str, Any]) -> Options:
    """The options dataclass of a method from keyword arguments."""
    names = [f.name for f in fields(kind)]
    for name in given:
        choice(f"option of method {method!r}", name, names)
    return kind(**given)


def refuse(
    name: str,
    value: object,
    expected: str,
    where: str | None = None,
    hint: str = "",
    error: type[PcmcError] = OptionError,
) -> NoReturn:
    """Raise the error for a parameter with a wrong value."""
    owner = "" if where is None else f" of {where!r}"
    message = f"{name}{owner}: expected {expected}, found {shown(value)}{hint and f'; {hint}'}"
    raise error(message, what=name, where=where, found=value, expected=expected)


def shown(value: object) -> str:
    """The value as an error shows it: what is long is cut.

    >>> shown("roof"), shown([0] * 1000), shown(10**5000)
    ("'roof'", '[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, ...]', 'a number of 16610 bits')
    """
    short = Repr()
    short.maxlist = short.maxtuple = short.maxdict = short.maxset = 10
    short.maxstring, short.maxother, short.maxlong = 200, 200, 40
    try:
        return short.repr(value)
    except ValueError:  # Python writes no number of more than some thousand digits
        return f"a number of {value.bit_length()} bits" if isinstance(value, int) else type(value).__name__
