"""Columns, numbers, names and expressions such as "sqrt(2)/2" or "z - 0.5*x" in files of text."""

from __future__ import annotations

import ast
import math
import operator
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any
from urllib.parse import quote

import numpy as np
import pandas as pd

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import FileError

LONGEST = 500  # characters: Python's parser cannot bear any depth of brackets and signs
Fail = Callable[[str], FileError]


def parsed_numbers(words: Sequence[str], kind: type = np.float64) -> Any:
    """The numbers in words; ValueError for another word, and for 1_000, a number to Python alone."""
    if "_" in "".join(words):
        raise ValueError("no number has the character _")
    return np.array(words, dtype=kind)


def escaped(name: str, special: str) -> str:
    """A name without the characters that are special in a format; ``urllib.parse.unquote`` gives it back.

    >>> escaped("50 % of *", "*")
    '50 %25 of %2A'
    """
    return "".join(quote(c, safe="") if c in special or c == "%" else c for c in name)


def constant(expression: str, known: Mapping[str, float], fail: Fail) -> float:
    """Value of an expression of numbers and known names (lower case).

    >>> constant("2*(h - 1)^2", {"h": 4.0}, FileError)
    18.0
    """
    value = linear_expression(expression, known, fail)
    if value[1:].any():
        raise fail(f"expected a number, found {expression.strip()!r}")
    return float(value[0])


def linear_expression(expression: str, known: Mapping[str, float], fail: Fail) -> Floats:
    """(4,) constant and coefficients of x, y, z of an expression that is linear in them.

    >>> linear_expression("z - 0.5*(x + 1)", {}, FileError).tolist()
    [-0.5, -0.5, 0.0, 1.0]
    """
    source = expression.strip().replace("^", "**")
    if odd := re.search(r"\b\d[\w.]*_\w*", source):  # a number to Python
        raise fail(f"{odd[0][:60]!r} is not a number")
    if len(source) > LONGEST:
        raise fail(f"{source[:40]!r}... has {len(source)} characters, more than {LONGEST}")
    try:
        with np.errstate(all="raise"), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Python's own, about what it would not write so
            return _term(ast.parse(source, mode="eval").body, known)
    except (SyntaxError, ValueError, ArithmeticError, RecursionError, MemoryError) as error:
        reason = error.args[0] if error.args else type(error).__name__
        raise fail(f"{expression.strip()[:60]!r} ({reason})") from None


SUM: Mapping[type, Callable[[Any, Any], Any]] = {ast.Add: operator.add, ast.Sub: operator.sub}
AXES = {"x": 1, "y": 2, "z": 3, "x1": 1, "x2": 2, "x3": 3}


def _term(node: ast.expr, known: Mapping[str, float]) -> Floats:
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number) * np.eye(4)[0]
        case ast.Name(id=name) if name.lower() in AXES:
            return np.eye(4)[AXES[name.lower()]]
        case ast.Name(id=name) if name.lower() in known:
            return known[name.lower()] * np.eye(4)[0]
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=inner):
            return _term(inner, known) * (-1.0 if isinstance(sign, ast.USub) else 1.0)
        case ast.BinOp(left=left, op=op, right=right):
            a, b = _term(left, known), _term(right, known)
            if type(op) in SUM:
                return SUM[type(op)](a, b)
            if isinstance(op, ast.Mult) and not (a[1:].any() and b[1:].any()):
                return a[0] * b if not a[1:].any() else b[0] * a
            if isinstance(op, ast.Div) and not b[1:].any():
                return a / b[0]
            if isinstance(op, ast.Pow) and not (a[1:].any() or b[1:].any()):
                return a[0] ** b[0] * np.eye(4)[0]
        case ast.Call(func=ast.Name(id="sqrt"), args=[inner]):
            value = _term(inner, known)
            if not value[1:].any() and value[0] >= 0.0:
                return math.sqrt(value[0]) * np.eye(4)[0]
    raise ValueError(f"{ast.unparse(node)!r} is not a number, a parameter or linear in x, y, z")


@dataclass(frozen=True)
class TextSection:
    """A part of a text file. A form feed stands for a line end that does not end a statement."""

    text: str
    first_line: int = 1
    known: Mapping[str, float] = field(default_factory=dict)  # parameters of expressions by name

    def error(self, problem: str, row: int | None = None, offset: int = 0, found: str = "") -> FileError:
        """An error on the given line of those that are not blank (from 0), or at an offset into the text."""
        if row is not None:
            starts = [m.start() for m in re.finditer(r"^[^\S\n]*\S", self.text, re.M)]
            offset = starts[min(row, len(starts) - 1)]
        line, found = self.first_line + line_ends(self.text[:offset]), " ".join(found.split())[:60]
        text = f"line {line}: {problem}" + (f", found {found!r}" if found else "")
        return FileError(text, where=line, found=found or None)

    def columns(self, pattern: str, what: str) -> list[tuple[str, ...]]:
        """For each group of the pattern its texts on all lines that are not blank."""
        matches = re.findall(rf"^[^\S\n]*{pattern}$", self.text, re.M)
        lines = re.findall(r"^[^\S\n]*\S[^\n]*$", self.text, re.M)
        one = re.compile(rf"[^\S\n]*{pattern}")
        if len(matches) != len(lines):
            row = next(k for k, line in enumerate(lines) if not one.fullmatch(line))
            raise self.error(f"expected {what}", row, found=lines[row])
        return list(zip(*matches, strict=True)) or [()] * one.groups

    def integers(self, words: Sequence[str], row: int | Ints | None = None) -> Ints:
        """Integers from words of the given rows, by default one of each row."""
        try:
            return np.array(words, dtype=np.int64)
        except (OverflowError, ValueError):
            bad = next((k for k, word in enumerate(words) if len(word.lstrip("-0")) > 18), 0)
            at = bad if row is None else int(np.broadcast_to(row, len(words))[bad])
            raise self.error("expected whole numbers below 2^63", at, found=words[bad][:40]) from None

    def numbers(self, words: Sequence[str], row: int | None = None) -> Floats:
        """Floats from words of the given row, by default one of each row: numbers, or expressions."""
        try:
            return parsed_numbers(words)
        except ValueError:
            rows = range(len(words)) if row is None else [row] * len(words)
            named = zip(words, rows, strict=True)
            return np.array([constant(word, self.known, partial(self.error, row=k)) for word, k in named])

    def values(self, rest: Sequence[str], key: str, default: float = 0.0) -> tuple[Floats, Bools]:
        """(k,) the number after a key in what follows each element, and where there is one."""
        pattern = re.compile(rf"\b(?:{key})\s+\{{?([^\s{{}}]+)", re.I)
        code, kinds, first = kinds_of(rest)
        value, given = np.full(len(kinds), default), np.zeros(len(kinds), dtype=bool)
        for k, words in enumerate(kinds):
            if hit := pattern.search(words):
                value[k], given[k] = self.numbers((hit[1],), int(first[k]))[0], True
        return value[code], given[code]

    def places(self, ids: Ints, wanted: Ints, what: str, row: Ints | None = None) -> Ints:
        order = np.argsort(ids, kind="stable")
        place = order[np.minimum(np.searchsorted(ids, wanted, sorter=order), len(ids) - 1)]
        bad = np.flatnonzero(ids[place] != wanted)
        if len(bad):
            problem, at = f"there is no {what} {wanted[bad[0]]}", bad if row is None else row[bad]
            raise self.error(problem, int(at[0]))
        return place


def line_ends(content: str) -> int:
    return content.count("\n") + content.count("\f")


def kinds_of(rest: Sequence[str]) -> tuple[Ints, Any, Ints]:
    """The number of each text, the different texts, and where each is first."""
    code, kinds = pd.factorize(np.array(rest, dtype=object))
    return code, kinds, np.unique(code, return_index=True)[1]
