"""What a page asks and the server answers: requests checked by one table, and answers in one run of bytes.

An answer is a JSON header and the arrays that it names:
4 bytes     length of the header, little-endian
header      JSON, padded with spaces to a multiple of 4 bytes; "arrays" lists [name, type, count]
arrays      one after another, little-endian, 4 bytes a number: "f" float32, "u" uint32
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from http import HTTPStatus
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.arrays import plain
from ..base.errors import unknown
from ..base.validate import checked_name
from ..design import Parameter, Target
from ..surface.values import KINDS

TYPES = {"f": "<f4", "u": "<u4"}
LONGEST_NAME = 1000  # characters
MOST_AIMS = 100  # targets, and parameters, of one request
Check = Callable[[str, Any], Any]  # the value of a key, given its place in the request; else RequestError


class RequestError(Exception):
    """A request that the server answers with one line of error."""

    def __init__(self, line: str, status: HTTPStatus = HTTPStatus.BAD_REQUEST) -> None:
        super().__init__(line)
        self.status = status


def check_request(keys: Mapping[str, Check], asked: Mapping[str, Any], where: str = "") -> dict[str, Any]:
    """The values in a request; a key that is not in the table is refused, one ending in ? may be missing.

    >>> check_request({"number": whole, "name?": name}, {"number": 3})
    {'number': 3}
    """
    known = {key.removesuffix("?"): check for key, check in keys.items()}
    if odd := [key for key in asked if key not in known]:
        raise RequestError(where + unknown("key", odd[0][:60], known))
    given = (key for key in known if key in asked or key in keys)
    return {key: known[key](where + key, asked.get(key)) for key in given}


def or_null(check: Check) -> Check:
    """The check of a value that may be null."""
    return lambda what, value: None if value is None else check(what, value)


def of_type(words: str, *types: type) -> Check:
    """The check of a value of one of these types; true and false are no numbers."""

    def check(what: str, value: Any) -> Any:
        if not isinstance(value, types) or (isinstance(value, bool) and bool not in types):
            raise RequestError(f"{what}: expected {words}, found {value!r:.60}")
        return value

    return check


whole, truth = of_type("a whole number", int), of_type("true or false", bool)
real, text = of_type("a number", int, float), of_type("a name", str)


def name(what: str, value: Any) -> str:
    """A text that is not too long."""
    if len(text(what, value)) > LONGEST_NAME:
        raise RequestError(f"{what}: a name of {len(value)} characters: {value[:40]!r}...")
    return str(value)


def as_float(what: str, value: Any) -> float:
    """A float."""
    try:
        return float(real(what, value))
    except OverflowError:
        raise RequestError(f"{what}: expected a number up to 1.8e308") from None


def place(what: str, value: Any, words: str = "a point [x, y, z]", size: int = 3) -> list[float]:
    """A point."""
    if not isinstance(value, list) or len(value) != size:
        raise RequestError(f"{what}: expected {words}, found {value!r:.60}")
    return [as_float(what, x) for x in value]


def variant_name(what: str, value: Any) -> str:
    """The name of a new variant."""
    words = " ".join(name(what, value).split())
    if not 0 < len(words) <= 60:
        raise RequestError(f"{what}: expected 1 to 60 characters, found {len(words)}")
    return checked_name(what, words)


def file_name(what: str, value: Any) -> str:
    """The name of a file to save."""
    if not name(what, value).strip():
        raise RequestError(f"{what}: give the file a name, such as variant.toml")
    return str(value.strip())


def owner(what: str, value: Any) -> str | tuple[float, ...]:
    """What a target is of: a name, or the point of a height."""
    return name(what, value) if isinstance(value, str) else tuple(place(what, value, "a name or a point", 2))


def patches(what: str, value: Any) -> str | tuple[str, ...]:
    """A name, or those of patches that are tied: they change together."""
    return tuple(name(what, one) for one in value) if isinstance(value, list) else name(what, value)


def values_by_name(check: Check) -> Check:
    """Values by name."""

    def values(kind: str, listed: Any) -> dict[str, Any]:
        if not isinstance(listed, dict):
            raise RequestError(f"{kind}: expected numbers by name")
        return {name(kind, one): check(f"{kind}: {one!r}", value) for one, value in listed.items()}

    return values


def entries(keys: Mapping[str, Check], made: Callable[..., Any]) -> Check:
    """Objects, at least one, each with the first of the keys."""
    first = next(iter(keys))  # without it there is no object

    def objects(what: str, listed: Any) -> tuple[Any, ...]:
        if not isinstance(listed, list) or not listed or not all(isinstance(entry, dict) for entry in listed):
            raise RequestError(f"{what}: expected a list of objects, at least one")
        if len(listed) > MOST_AIMS:
            raise RequestError(f"{what}: {len(listed)} are too many; at most {MOST_AIMS}")
        if not all(first in entry for entry in listed):
            raise RequestError(f"{what}: each needs a {first}")
        return tuple(made(**check_request(keys, entry, f"{what}: ")) for entry in listed)

    return objects


LIMIT = or_null(as_float)
VALUES = {f"{kind}?": values_by_name(as_float) for kind in KINDS} | {"points?": values_by_name(place)}
LIMITS = dict.fromkeys(("value?", "at_most?", "at_least?"), LIMIT)
TARGET = {"quantity": name, "of?": or_null(owner), **LIMITS, "name?": name}
PARAMETER = {"patch": patches, "kind?": name, "low?": LIMIT, "high?": LIMIT}
NUMBER: dict[str, Check] = {"number": whole}
ACTS: dict[str, dict[str, Check]] = {
    "follow": VALUES,
    "settle": VALUES,
    "meet": {"targets": entries(TARGET, Target), "vary": entries(PARAMETER, Parameter)},
    "keep": {"name": variant_name},
    "forget": NUMBER,
    "recall": NUMBER,
    "compare": {"number?": or_null(whole)},
    **{act: {} for act in ("stabilise", "remesh", "undo", "redo", "reset", "stop", "state")},
}
"""The acts of a session, with the arguments that each takes; they answer with its state."""
REQUESTS: dict[str, dict[str, Check]] = ACTS | {
    "open": {"session?": or_null(name)},
    "margin": {"what": name},
    "save": {"name": file_name, "replace?": truth},
    **{act: {} for act in ("check", "verify", "families", "news")},
}
"""All requests; those that are no acts answer with something else."""


def pack(header: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]] | None = None) -> bytes:
    """One answer; float arrays become float32, integers uint32.

    >>> packed = pack({"a": float("nan")}, {"x": np.array([1.5])})
    >>> unpack(packed)
    ({'a': None}, {'x': array([1.5], dtype=float32)})
    """
    listed, blocks = [], []
    for name, array in (arrays or {}).items():
        kind = "f" if array.dtype.kind == "f" else "u"
        listed.append([name, kind, int(array.size)])
        blocks.append(np.ascontiguousarray(array, dtype=TYPES[kind]).tobytes())
    packed = json.dumps(plain({**header, "arrays": listed}), allow_nan=False).encode()
    packed += b" " * (-len(packed) % 4)
    return b"".join([len(packed).to_bytes(4, "little"), packed, *blocks])


def unpack(message: bytes) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    """Header and flat arrays of an answer: the inverse of ``pack``."""
    start = 4 + int.from_bytes(message[:4], "little")
    header = json.loads(message[4:start])
    arrays = {}
    for name, kind, count in header.pop("arrays"):
        arrays[name] = np.frombuffer(message, TYPES[kind], count, start)
        start += 4 * count
    return header, arrays
