"""Checks of single values, for the whole package. Each error names the parameter.

``where`` names the owner of the parameter, such as the patch of a tension; ``hint``, what to do, ends the
message; ``error`` is the exception to raise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import field, fields
from functools import partial
from numbers import Integral, Real
from operator import ge, gt, le, lt
from reprlib import Repr
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

from .errors import OptionError, PcmcError, unknown

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

LARGEST = 1e50  # of a coordinate, tension or pressure: the squares of forces stay finite
MOST = 2**31 - 1  # of a count: more steps, levels or vertices than that no run can have
LONGEST = 100  # characters of a name

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
    rules = ((above, ">", gt), (least, "≥", ge), (below, "<", lt), (most, "≤", le))
    limits = [(limit, sign, holds) for limit, sign, holds in rules if limit is not None]
    if not (math.isfinite(given) and all(holds(given, limit) for limit, _, holds in limits)):
        bounds = " and ".join(f"{sign} {limit:g}" for limit, sign, _ in limits)
        refuse(name, value, f"a finite number {bounds}".rstrip(), where, hint, error)
    return given


def real(value: object) -> float:
    """A real number as a float; NaN for anything else, and where a float cannot hold it.

    >>> real(2), real("2"), real(10**400)
    (2.0, nan, nan)
    """
    try:
        return float(value) if isinstance(value, Real) and not isinstance(value, bool) else math.nan
    except OverflowError:
        return math.nan


def parsed(text: str) -> float:
    """The number in a text; ValueError for another text, and for 1_000, which Python alone reads as one."""
    if "_" in text or not text.isascii():
        raise ValueError(f"no number: {text!r}")
    return float(text)


def positive(name: str, value: object) -> float:
    """A finite float > 0."""
    return number(name, value, above=0.0)


def integer(name: str, value: object, least: int = 0, *, most: int = MOST, hint: str = "") -> int:
    """An int ≥ least and ≤ most.

    >>> integer("iterations", 2.5)
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: iterations: expected a whole number ≥ 0, found 2.5
    """
    if not isinstance(value, Integral) or isinstance(value, bool) or not least <= int(value) <= most:
        above = isinstance(value, Integral) and int(value) > most
        bounds = f"≥ {least} and ≤ {most}" if above else f"≥ {least}"
        refuse(name, value, f"a whole number {bounds}", hint=hint)
    return int(value)


def flag(name: str, value: object) -> bool:
    """True or False; 0, 1 and others are refused."""
    if not isinstance(value, bool):
        refuse(name, value, "True or False")
    return value


def callback(name: str, value: object, expected: str) -> None:
    """Refuse what is called at each step and is no function, nor None."""
    if not (value is None or callable(value)):
        refuse(name, value, expected)


def sequence(
    name: str, value: Any, expected: str = "a list", error: type[PcmcError] = OptionError
) -> list[Any]:
    """The entries of a list or of anything like it; not of a text, nor of what can be read but once.

    >>> sequence("seams", (1, 2))
    [1, 2]
    """
    try:
        found = None if isinstance(value, str | bytes | Iterator) else list(value)
    except TypeError:
        found = None
    return refuse(name, value, expected, error=error) if found is None else found


def cloth(what: str, text: str, warp: float, weft: float, poisson: float) -> None:
    """Refuse stiffnesses with ν² weft ≥ warp: such a cloth is not stable. ``text`` begins the message."""
    if poisson**2 * weft >= warp:
        raise OptionError(f"{text} = {warp / poisson**2:.4g}, found {weft:g}", what=what, found=weft)


def triple(name: str, value: Any, *, error: type[PcmcError] = OptionError) -> tuple[float, float, float]:
    """Three finite numbers.

    >>> triple("normal", [0, 0, 1])
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


def limited(default: Any, check: Callable[..., object], **limits: object) -> Any:
    """A field of an options dataclass, with the check of this module that ``check_options`` makes of it."""
    return field(default=default, metadata={"check": partial(check, **limits)})


def check_options(options: DataclassInstance) -> None:
    """Refuse values that the ``limited`` fields of a dataclass do not allow; their type may allow None."""
    for each in fields(options):
        value, check = getattr(options, each.name), each.metadata.get("check")
        if check is not None and not (value is None and "None" in str(each.type)):
            check(each.name, value)


def options_from(kind: type[Options], method: str, given: dict[str, Any]) -> Options:
    """The options dataclass of a method from keyword arguments."""
    names = [f.name for f in fields(kind)]
    for name in given:
        choice(f"option of method {method!r}", name, names)
    return kind(**given)


def checked_name(
    what: str, name: object, *, empty: bool = False, error: type[PcmcError] = OptionError
) -> str:
    """The name of a part as a plain text: 1 to 100 printable characters, no blank at either end.

    Line breaks, tabs, other control characters and halves of surrogate pairs are not printable; so a name
    stays in one line of a file or message. Each format escapes what is special to it. ``what`` is the
    parameter; with ``empty`` there may be no name, "".

    >>> checked_name("Cable.name", "Süd/Ost")
    'Süd/Ost'
    >>> checked_name("Cable.name", "east\\n")
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: Cable.name: expected no blank at either end, found 'east\\n'; change
    the name
    """
    expected = ""
    if not isinstance(name, str):
        expected = "a text"
    elif not name and not empty:
        expected = "at least one character"
    elif name != name.strip():
        expected = "no blank at either end"
    elif not name.isprintable():
        odd = next(c for c in name if not c.isprintable())
        expected = f"printable characters and none like {odd!a}"
    elif len(name) > LONGEST:
        expected = f"at most {LONGEST} characters and not {len(name)}"
    if expected:
        refuse(what, name, expected, hint="change the name", error=error)
    return str(name)


def one_line(name: str, value: object) -> str:
    """A text in one line, or "": a line break would end the comment or the heading that it stands in."""
    if not (isinstance(value, str) and value.isprintable()):
        refuse(name, value, "a text of one line")
    return value


def names_from_file(given: Iterable[str]) -> tuple[dict[str, str], str]:
    """A name that a part may have for each name in a file of another program, and a note on those changed.

    Characters that are not printable become blanks, long names are cut; different names stay different.

    >>> names_from_file(["roof", " east\\t1", "east 1"])
    ({'roof': 'roof', ' east\\t1': 'east 1 2', 'east 1': 'east 1'}, "1 names were changed, as ' east\\\\t1'")
    """
    names = {name: "".join(c if c.isprintable() else " " for c in name).strip() for name in given}
    names = {name: text[:LONGEST].rstrip() or "unnamed" for name, text in names.items()}
    taken = {name for name, text in names.items() if name == text}
    changed = [name for name in names if name not in taken]
    for name in changed:
        text, number = names[name], 1
        while names[name] in taken:
            number += 1
            names[name] = f"{text[: LONGEST - 10]} {number}"
        taken.add(names[name])
    return names, f"{len(changed)} names were changed, as {changed[0][:40]!r}" if changed else ""


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
    """The value as an error shows it, in one line: what is long is cut.

    >>> shown("roof"), shown([0] * 1000), shown(10**5000)
    ("'roof'", '[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, ...]', 'a number of 16610 bits')
    >>> import numpy as np
    >>> shown(np.eye(2))
    'array([[1., 0.], [0., 1.]])'
    """
    short = Repr()
    short.maxlist = short.maxtuple = short.maxdict = short.maxset = 10
    short.maxstring, short.maxother, short.maxlong = 200, 200, 40
    try:
        return " ".join(line.strip() for line in short.repr(value).split("\n"))
    except ValueError:  # Python writes no number of more than some thousand digits
        return f"a number of {value.bit_length()} bits" if isinstance(value, int) else type(value).__name__
