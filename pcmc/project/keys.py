"""The keys that a project file may have; unknown ones are refused with their line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from ..base.errors import FileError, unknown
from ..plan import Area, Divider, Hole, Plan
from ..solvers import METHODS, find_method
from ..surface import Plane
from .remeshing import Remeshing


def options_of(method: str) -> Any:
    """The class of a method's options, such as NewtonOptions."""
    return find_method(method).options


def _keys(kind: Any) -> list[str]:
    return [f.name for f in fields(kind)]


def check_keys(path: Path, text: str, data: Mapping[str, Any]) -> None:
    """Refuse every unknown key of the file, with its line."""

    def check(place: tuple[str, ...], table: Any, known: list[str]) -> None:
        if not isinstance(table, Mapping):
            line = _line(text, place[:-1], place[-1]) if place else 1
            raise FileError(
                f"{path}: line {line}: {'.'.join(place)} must be a table, found {table!r}"
            )
        for key in table:
            if key not in known:
                line, where = (
                    _line(text, place, key),
                    f"key of [{'.'.join(place)}]" if place else "key",
                )
                raise FileError(f"{path}: line {line}: {unknown(where, key, known)}")

    check((), data, ["plan", "solve", "remesh", "targets", "output"])
    for section in data:
        for table in entries(data[section]) if section == "remesh" else [data[section]]:
            check((section,), table, _section_keys(section, table))
    plan = data.get("plan", {})
    for name in ("dividers", "holes", "supports"):
        _check_list(path, text, ("plan",), plan, name)
    for name in ("meet", "vary"):
        _check_list(path, text, ("targets",), data.get("targets", {}), name)
    if "patches" in plan:
        check(
            ("plan", "patches"),
            plan["patches"],
            list(plan["patches"]) if isinstance(plan["patches"], Mapping) else [],
        )
    for name, kind in (("dividers", Divider), ("holes", Hole)):
        for entry in tables(plan.get(name)):
            if "curve" in entry:  # else it is a curve itself
                check(("plan", name), entry, _keys(kind))
    for name, area in plan.get("patches", {}).items():
        check(("plan", "patches", name), area, [k for k in _keys(Area) if k != "name"])
    if "plane" in plan:
        check(("plan", "plane"), plan["plane"], _keys(Plane))
    if "targets" in data:
        from ..design import Parameter, Target

        for name, aim in (("meet", Target), ("vary", Parameter)):
            for entry in tables(data["targets"].get(name)):
                check(("targets", name), entry, _keys(aim))


def _check_list(
    path: Path, text: str, place: tuple[str, ...], table: Mapping[str, Any], key: str
) -> None:
    if not isinstance(table.get(key, []), list):
        line = _line(text, place, key)
        hint = f"; write [[{'.'.join((*place, key))}]]" if isinstance(table[key], Mapping) else ""
        raise FileError(
            f"{path}: line {line}: {key} must be a list, found {table[key]!r:.60}{hint}"
        )


def _section_keys(section: str, table: Any) -> list[str]:
    if section == "plan":
        return _keys(Plan)
    if section == "solve":
        method = table.get("method", "newton") if isinstance(table, Mapping) else "newton"
        return ["method", *(_keys(options_of(method)) if method in METHODS else table)]
    if section == "remesh":
        return _keys(Remeshing)
    if section == "targets":
        return ["meet", "vary"]
    return ["files", "picture", "view", "colour"]


def entries(value: Any) -> list[Any]:
    """A list, or what stands where one may: its only entry."""
    return value if isinstance(value, list) else [value]


def tables(value: Any) -> list[Any]:
    """Those of a list's entries that are tables."""
    return [e for e in value if isinstance(e, Mapping)] if isinstance(value, list) else []


def _line(text: str, place: tuple[str, ...], key: str) -> int:
    """The number of the line where a key stands, in the table at ``place`` or written out in full.

    >>> _line("[plan]\\nrise = 2\\n[solve]\\nrise = 1", ("solve",), "rise")
    4
    """
    named = re.compile(rf"(^|[\s{{,.\[]){_quoted(key)}\s*([=.\]])")
    last = re.compile(rf"(^|[\s{{,.\[]){_quoted(place[-1])}\s*[=.\]]") if place else None
    header: tuple[str, ...] = ()
    best = 0
    for number, line in enumerate(text.splitlines(), 1):
        if head := re.match(r"\s*\[\[?([^\[\]]+)\]\]?\s*(#|$)", line):
            header = tuple(part.strip(" \"'") for part in head[1].split("."))
            if header == (*place, key):
                return number
            continue
        if named.search(line.split("#")[0]) and header == place[: len(header)]:
            if header == place or (last and last.search(line)):
                return number
            best = best or number
    return best or 1


def _quoted(key: str) -> str:
    return rf"[\"']?{re.escape(key)}[\"']?"
