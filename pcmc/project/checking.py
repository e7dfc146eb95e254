"""Checks of the keys of a project file; each error has the line of its key."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..base.errors import FileError, PcmcError, unknown
from ..surface.curve_data import CURVES
from . import keys
from .keys import KINDS, OR_CURVE, REQUIRED, Section, fits, main_sections, solve_section, target_sections

LONGEST = 1023  # bits of a float's exponent
VALUE = re.compile(r"(?<![\w.])[-+]?(?:\d[\d_]*\.?\d*(?:[eE][-+]?\d+)?|inf|nan)(?![\w.])")  # of TOML
PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""  # of a key of TOML
Place = tuple[str, ...]  # the keys that lead to a table or a value


@contextmanager
def in_file(path: Path, kind: type[PcmcError] | None = None) -> Iterator[None]:
    """Put the file, and the line of what was found, in front of an error's message; raise it as ``kind``."""
    try:
        yield
    except PcmcError as error:
        line = 0 if str(error).startswith("line ") else line_with(path, error.found)
        raise error.in_file(f"{path}: line {line}" if line else path, kind) from None


def check_project_keys(text: str, data: Mapping[str, Any]) -> None:
    """Check every key: known, of the right kind, none missing. ``text`` is the file as it is written."""
    _check_range(text, data, ())
    root, *below = main_sections()
    _check_table(text, root, (), data)
    method = data.get("solve", {}).get("method", "newton")
    targets = target_sections() if "targets" in data else ()
    drawn = isinstance(data.get("plan"), Mapping) and "drawing" in data["plan"]
    for section in (*below, solve_section(str(method)), *targets):
        if drawn and section.name in (*OR_CURVE, "plan.cables"):  # the drawing may have that curve
            keys = (replace(key, default=None) if key.name == "curve" else key for key in section.keys)
            section = replace(section, keys=tuple(keys))
        found: list[tuple[Place, Any]] = [((), data)]
        for step in section.name.split("."):
            if step == "NAME":
                found = [((*p, str(name)), t) for p, table in found for name, t in table.items()]
            else:
                values = [((*p, step), table[step]) for p, table in found if step in table]
                found = [(p, t) for p, v in values for t in (v if isinstance(v, list) else [v])]
        for place, table in found:
            if not section.is_curve(table) if isinstance(table, Mapping) else section.name.endswith("NAME"):
                _check_table(text, section, place, table)


def _check_range(text: str, value: Any, place: Place) -> None:
    if isinstance(value, Mapping):
        for name, item in value.items():
            _check_range(text, item, (*place, name))
    elif isinstance(value, list):
        for item in value:
            _check_range(text, item, place)
    elif isinstance(value, int) and value.bit_length() > LONGEST:
        message = f"{'.'.join(place)}: a number of {value.bit_length()} bits; up to 1.8e308 are read"
        raise _error(text, place, message, expected="a number up to 1.8e308")


def _check_table(text: str, section: Section, place: Place, table: Any) -> None:
    if not isinstance(table, Mapping):
        above, below = ".".join(place[:-2]), ".".join(place[:-1])
        names = [key.name for one in main_sections() if one.name == above for key in one.keys]
        hint = f"; as a key of [{above}] it stands above [{below}]" if place[-1] in names else ""
        raise _wrong_kind(text, place, table, "a table", hint)
    known = {key.name: key for key in section.keys}
    title = f"[{'.'.join(place)}]" if place else "the project"
    for name, value in table.items():
        key, at = known.get(name), (*place, name)
        if key is not None and not fits(value, KINDS[key.kind]):
            raise _wrong_kind(text, at, value, key.kind, section.example(name))
        if key is not None and key.choices and value not in key.choices:
            message = f"{'.'.join(at)}: {unknown('value', value, key.choices)}"
            raise _error(text, at, message, found=value, expected=key.choices)
    for name in table:
        if name not in known:
            curves = CURVES if section.name in OR_CURVE and not known.keys() & table.keys() else ()
            homes = [one.title for one in keys.sections()[:-1] if any(key.name == name for key in one.keys)]
            home = f"{name!r} is a key of {' or '.join(homes[:2])}." if homes else ""
            message = unknown(f"key of {title}", name, [*known, *curves], home)
            raise _error(text, (*place, name), message, found=name, expected=tuple(known))
    for name, key in known.items():
        if key.default is REQUIRED and name not in table and not any(other in table for other in key.unless):
            message = f"{title} needs the key {name!r}{section.example(name)}"
            raise _error(text, (*place, name), message, at=place, expected=key.kind)


def _wrong_kind(text: str, place: Place, value: Any, kind: str, hint: str = "") -> FileError:
    name = ".".join(place)
    hint = f"; write [[{name}]]" if kind.startswith("a list") and isinstance(value, Mapping) else hint
    message = f"{name} must be {kind}, found {value!r:.60}{hint}"
    return _error(text, place, message, found=value, expected=kind)


def _error(text: str, place: Place, message: str, *, at: Place | None = None, **fields: Any) -> FileError:
    """The error about the key at ``place``, with its line or that of another key ``at``."""
    at = place if at is None else at
    line = line_of(text, at[:-1], at[-1], fields.get("found")) if at else 1
    return FileError(f"line {line}: {message}", what=".".join(place), where=line, **fields)


def line_of(text: str, place: Place, key: str, value: Any = None) -> int:
    """The line of a key in the table at ``place``; the one with its value if several entries have it.

    >>> line_of("[plan]\\nrise = 2\\n[solve]\\nrise = 1", ("solve",), "rise")
    4
    """
    named = re.compile(rf"(^|[\s{{,.\[]){_quoted(key)}\s*([=.\]])")
    last = re.compile(rf"(^|[\s{{,.\[]){_quoted(place[-1])}\s*[=.\]]") if place else None
    header: Place = ()
    lines = []  # how badly each fits, and its number
    for number, line in enumerate(text.splitlines(), 1):
        if head := re.match(r"\s*\[\[?([^\[\]]+)\]\]?\s*(#|$)", line):
            header = tuple(part.strip("\"'") for part in re.findall(PART, head[1]))
            if header == (*place, key):
                lines.append((False, False, number))
        elif named.search(_code(line)) and header == place[: len(header)]:
            inside = header == place or (last is not None and last.search(line) is not None)
            lines.append((not inside, str(value) not in line, number))
    return min(lines, default=(True, True, 1))[2]


def line_with(path: Path, found: object) -> int:
    """The only line of a project file that has a name or a number; 0 if none or several have it."""
    if path.suffix.lower() != ".toml" or isinstance(found, bool) or not isinstance(found, str | int | float):
        return 0
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError):
        return 0

    def has(line: str) -> bool:
        if isinstance(found, str):
            return f'"{found}"' in line or f"'{found}'" in line
        return any(str(float(text)) == str(float(found)) for text in VALUE.findall(_code(line)))

    numbers = [number for number, line in enumerate(lines, 1) if has(line)]
    return numbers[0] if len(numbers) == 1 else 0


def _code(line: str) -> str:
    """A line of TOML without its comment."""
    return re.sub(r"""("[^"]*"|'[^']*')|#.*""", r"\1", line)


def _quoted(key: str) -> str:
    return rf"[\"']?{re.escape(key)}[\"']?"
