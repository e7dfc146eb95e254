"""Checks of the keys of a project file; each error has the line of its key."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from ..base.errors import FileError, unknown
from .keys import KINDS, REQUIRED, Section, main_sections, solve_section, target_sections


def check_keys(text: str, data: Mapping[str, Any]) -> None:
    """Check every key of a project file, with its line: known, of the right kind, none missing.

    Parameters
    ----------
    text, data : of the file, as it is written and as TOML reads it.

    Raises
    ------
    FileError
        ``what`` is the dotted key, ``where`` its line.
    """
    root, *below = main_sections()
    _check_table(text, root, (), data)
    method = data.get("solve", {}).get("method", "newton")
    targets = target_sections() if "targets" in data else ()
    for section in (*below, solve_section(str(method)), *targets):
        for place, table in _tables(data, section):
            _check_table(text, section, place, table)


def _tables(data: Any, section: Section) -> Iterator[tuple[tuple[str, ...], Any]]:
    """The tables of the file that a section describes, each with its place."""
    found: list[tuple[tuple[str, ...], Any]] = [((), data)]
    for step in section.name.split("."):
        if step == "NAME":
            found = [((*p, str(name)), t) for p, table in found for name, t in table.items()]
        else:
            found = [((*p, step), table[step]) for p, table in found if step in table]
            listed = [(p, t if isinstance(t, list) else [t]) for p, t in found]
            found = [(p, t) for p, entries in listed for t in entries]
    for place, table in found:
        if isinstance(table, Mapping):
            # a divider or hole without the key "curve" is a curve itself
            if "curve" in table or all(key.name != "curve" for key in section.keys):
                yield place, table
        elif section.name.endswith("NAME"):
            yield place, table


def _check_table(text: str, section: Section, place: tuple[str, ...], table: Any) -> None:
    if not isinstance(table, Mapping):
        raise _wrong_kind(text, place, table, "a table")
    known = {key.name: key for key in section.keys}
    title = f"[{'.'.join(place)}]" if place else "the project"
    for name, value in table.items():
        key = known.get(name)
        if key is not None and not KINDS[key.kind](value):
            raise _wrong_kind(text, (*place, name), value, key.kind)
        if key is not None and key.choices and value not in key.choices:
            message = f"{'.'.join((*place, name))}: {unknown('value', value, key.choices)}"
            raise _error(text, (*place, name), message, found=value, expected=key.choices)
    for name in table:
        if name not in known:
            message = unknown(f"key of {title}", name, known)
            raise _error(text, (*place, name), message, found=name, expected=tuple(known))
    for name, key in known.items():
        if key.default is REQUIRED and name not in table:
            message = f"{title} needs the key {name!r}"
            raise _error(text, (*place, name), message, at=place, expected=key.kind)


def _wrong_kind(text: str, place: tuple[str, ...], value: Any, kind: str) -> FileError:
    name = ".".join(place)
    hint = f"; write [[{name}]]" if kind.startswith("a list") and isinstance(value, Mapping) else ""
    message = f"{name} must be {kind}, found {value!r:.60}{hint}"
    return _error(text, place, message, found=value, expected=kind)


def _error(
    text: str,
    place: tuple[str, ...],
    message: str,
    *,
    at: tuple[str, ...] | None = None,
    found: Any = None,
    expected: Any = None,
) -> FileError:
    """The error about the key at ``place``, with its line or that of another key ``at``."""
    at = place if at is None else at
    line = line_of(text, at[:-1], at[-1], found) if at else 1
    return FileError(
        f"line {line}: {message}", what=".".join(place), where=line, found=found, expected=expected
    )


def line_of(text: str, place: tuple[str, ...], key: str, value: Any = None) -> int:
    """The line of a key in the table at ``place``; the one with its value if several entries have it.

    >>> line_of("[plan]\\nrise = 2\\n[solve]\\nrise = 1", ("solve",), "rise")
    4
    """
    named = re.compile(rf"(^|[\s{{,.\[]){_quoted(key)}\s*([=.\]])")
    last = re.compile(rf"(^|[\s{{,.\[]){_quoted(place[-1])}\s*[=.\]]") if place else None
    header: tuple[str, ...] = ()
    lines = []  # how badly each fits, and its number
    for number, line in enumerate(text.splitlines(), 1):
        if head := re.match(r"\s*\[\[?([^\[\]]+)\]\]?\s*(#|$)", line):
            header = tuple(part.strip(" \"'") for part in head[1].split("."))
            if header == (*place, key):
                lines.append((False, False, number))
        elif named.search(line.split("#")[0]) and header == place[: len(header)]:
            inside = header == place or (last is not None and last.search(line) is not None)
            lines.append((not inside, str(value) not in line, number))
    return min(lines, default=(True, True, 1))[2]


def _quoted(key: str) -> str:
    return rf"[\"']?{re.escape(key)}[\"']?"
