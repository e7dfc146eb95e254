"""Checks of solver options. Each error names the parameter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, TypeVar

from .errors import OptionError, unknown

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Options = TypeVar("Options", bound="DataclassInstance")


def number(
    name: str,
    value: object,
    *,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
) -> float:
    """A finite float within its bounds: above < value, least ≤ value, value < below.

    >>> number("gamma", 1.5, least=0.0, below=1.0)
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: gamma: expected a finite number ≥ 0 and < 1, found 1.5
    """
    limits = [(above, ">"), (least, "≥"), (below, "<")]
    text = " and ".join(f"{sign} {limit:g}" for limit, sign in limits if limit is not None)
    found = math.nan
    if isinstance(value, Real) and not isinstance(value, bool):
        found = float(value)
    if not (
        math.isfinite(found)
        and (above is None or found > above)
        and (least is None or found >= least)
        and (below is None or found < below)
    ):
        expected = f"expected a finite number {text}".rstrip()
        raise OptionError(f"{name}: {expected}, found {value!r}")
    return found


def integer(name: str, value: object, least: int = 0) -> int:
    """An int ≥ least.

    >>> integer("iterations", 2.5)
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: iterations: expected a whole number ≥ 0, found 2.5
    """
    if not isinstance(value, Integral) or isinstance(value, bool) or value < least:
        raise OptionError(f"{name}: expected a whole number ≥ {least}, found {value!r}")
    return int(value)


def flag(name: str, value: object) -> bool:
    """True or False and nothing that merely looks like it."""
    if not isinstance(value, bool):
        raise OptionError(f"{name}: expected True or False, found {value!r}")
    return value


def choice(name: str, value: object, known: Sequence[str]) -> str:
    """One of the known words.

    >>> choice("armijo", "suficient", ["printed", "sufficient"])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: unknown armijo 'suficient'; did you mean 'sufficient'? Known: ...
    """
    if value not in known:
        raise OptionError(unknown(name, value, known))
    return str(value)


def build(kind: type[Options], method: str, given: dict[str, Any]) -> Options:
    """The options dataclass of a method from keyword arguments."""
    names = [f.name for f in fields(kind)]
    for name in given:
        if name not in names:
            raise OptionError(unknown(f"option of method {method!r}", name, names))
    return kind(**given)
