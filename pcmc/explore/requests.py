"""What a page may ask for: the contents of its requests, each checked before anything is done."""

from __future__ import annotations

from collections.abc import Callable
from http import HTTPStatus
from typing import Any

from ..base.errors import unknown
from ..base.validate import checked_name
from ..design import Parameter, Target
from ..surface.values import KINDS

LONGEST_NAME = 1000  # characters
MOST_AIMS = 100  # targets, and parameters, of one request
TARGET_KEYS = ("quantity", "of", "value", "at_most", "at_least", "name")
PARAMETER_KEYS = ("patch", "kind", "low", "high")


class RequestError(Exception):
    """A request that the server answers with one line of error."""

    def __init__(self, line: str, status: HTTPStatus = HTTPStatus.BAD_REQUEST) -> None:
        super().__init__(line)
        self.status = status


def session_name(asked: dict[str, Any]) -> str | None:
    """The session that a page had before, or None."""
    name = asked.get("session")
    if not isinstance(name, str | None):
        raise RequestError(f"session: expected a name, found {name!r:.60}")
    return name


def values(asked: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Numbers, and points, by kind and name."""
    given: dict[str, dict[str, Any]] = {}
    kinds = (*KINDS, "points")
    if odd := [key for key in asked if key not in kinds]:
        raise RequestError(unknown("kind of values", odd[0][:60], kinds))
    for kind in kinds:
        listed = asked.get(kind, {})
        if not isinstance(listed, dict):
            raise RequestError(f"{kind}: expected numbers by name")
        of = _place if kind == "points" else _number
        given[kind] = {_name(kind, name): of(f"{kind}: {name!r}", v) for name, v in listed.items()}
    return given


def _place(what: str, value: Any) -> list[float]:
    if not isinstance(value, list) or len(value) != 3:
        raise RequestError(f"{what}: expected a point [x, y, z], found {value!r:.60}")
    return [_number(what, x) for x in value]


def aims(asked: dict[str, Any]) -> tuple[tuple[Target, ...], tuple[Parameter, ...]]:
    """Targets and the parameters that may vary for them."""
    targets = tuple(Target(**entry) for entry in _entries("targets", asked, TARGET_KEYS))
    vary = tuple(Parameter(**entry) for entry in _entries("vary", asked, PARAMETER_KEYS))
    return targets, vary


def _entries(key: str, asked: dict[str, Any], known: tuple[str, ...]) -> list[dict[str, Any]]:
    listed = asked.get(key)
    if not isinstance(listed, list) or not listed or not all(isinstance(entry, dict) for entry in listed):
        raise RequestError(f"{key}: expected a list of objects, at least one")
    if len(listed) > MOST_AIMS:
        raise RequestError(f"{key}: {len(listed)} are too many; at most {MOST_AIMS}")
    if not all(known[0] in entry for entry in listed):
        raise RequestError(f"{key}: each needs a {known[0]}")
    return [{name: _aim(key, name, value, known) for name, value in e.items()} for e in listed]


def _aim(key: str, name: str, value: Any, known: tuple[str, ...]) -> Any:
    """The value of a key of a target or parameter: a number, a name, or the point of a height."""
    if name not in known:
        raise RequestError(f"{key}: unknown key {name!r:.60}; known: {', '.join(known)}")
    if value is None and name in ("of", "value", "at_most", "at_least", "low", "high"):
        return None
    if name == "patch" and isinstance(value, list):  # tied: they change together
        return tuple(_name(f"{key}: {name}", one) for one in value)
    if name in ("quantity", "patch", "kind", "name") or (name == "of" and isinstance(value, str)):
        return _name(f"{key}: {name}", value)
    if name == "of":
        if not isinstance(value, list) or len(value) != 2:
            raise RequestError(f"{key}: of: expected a name or a point, found {value!r:.60}")
        return tuple(_number(f"{key}: of", x) for x in value)
    return _number(f"{key}: {name}", value)


def place(asked: dict[str, Any]) -> int:
    """The number of a variant, from 0."""
    number = asked.get("number")
    if not isinstance(number, int) or isinstance(number, bool):
        raise RequestError(f"number: expected a whole number, found {number!r:.60}")
    return number


def variant_name(asked: dict[str, Any]) -> str:
    """The name of a new variant."""
    name = " ".join(_name("name", asked.get("name")).split())
    if not 0 < len(name) <= 60:
        raise RequestError(f"name: expected 1 to 60 characters, found {len(name)}")
    return checked_name("name", name)


def varied(asked: dict[str, Any]) -> str:
    """What a margin varies."""
    return _name("what", asked.get("what"))


def file_to_save(asked: dict[str, Any]) -> tuple[str, bool]:
    """The name of a file, and whether it may be replaced."""
    name, replace = _name("name", asked.get("name")), asked.get("replace", False)
    if not name.strip():
        raise RequestError("name: give the file a name, such as variant.toml")
    if not isinstance(replace, bool):
        raise RequestError(f"replace: expected true or false, found {replace!r:.60}")
    return name.strip(), replace


def _name(what: str, value: Any) -> str:
    if not isinstance(value, str):
        raise RequestError(f"{what}: expected a name, found {value!r:.60}")
    if len(value) > LONGEST_NAME:
        raise RequestError(f"{what}: a name of {len(value)} characters: {value[:40]!r}...")
    return value


def _number(what: str, value: Any) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise RequestError(f"{what}: expected a number, found {value!r:.60}")
    try:
        return float(value)
    except OverflowError:
        raise RequestError(f"{what}: expected a number up to 1.8e308") from None


def _nothing(asked: dict[str, Any]) -> tuple[()]:
    return ()


ACTS: dict[str, Callable[[dict[str, Any]], tuple[Any, ...]]] = {
    "follow": lambda asked: (values(asked),),
    "settle": lambda asked: (values(asked),),
    "meet": aims,
    "keep": lambda asked: (variant_name(asked),),
    "forget": lambda asked: (place(asked),),
    "recall": lambda asked: (place(asked),),
    "compare": lambda asked: (None if asked.get("number") is None else place(asked),),
    **dict.fromkeys(("stabilise", "remesh", "undo", "redo", "reset", "stop", "state"), _nothing),
}
"""The arguments that each act of a session takes from a request."""
