"""The numbers that README and documentation state, each with the key of ``results/`` that it is.

``stated.toml`` has, by page, sentences whose fields ``{expression:format}`` stand for measured numbers, and
the numbers that are given: settings, dimensions of an example, known constants. A test finds each sentence in
its page and no other number. Those of ``results/REPORT.md`` are fields of ``report.py`` and ``paper.toml``.
``python -m studies numbers`` prints all of them with their keys.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context, Decimal
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd

from pcmc.base.errors import OptionError

from . import report
from .paper import paper, read_measured
from .words import keys

STATED = Path(__file__).with_name("stated.toml")
RESULTS = Path(__file__).resolve().parent.parent / "results"
FIELD = re.compile(r"\{([^{}]+):(\.\d+[ef])( up| down)?\}")
KEY = re.compile(r"(?P<table>\w+/\w+)\((?P<cell>[^()]*)\)|[a-z]\w*\.[\w.-]+")
WHICH = ("only", "first", "least", "largest", "median", "count")


@dataclass(frozen=True)
class Sentence:
    """A part of a sentence on a page, and its measured numbers.

    Attributes
    ----------
    page : its file, from the checkout's folder.
    says : the words with today's numbers.
    numbers : (number as written, expression of keys) for each.
    """

    page: str
    says: str
    numbers: tuple[tuple[str, str], ...]


def sentences(results: Path = RESULTS) -> list[Sentence]:
    """The sentences with measured numbers, filled."""
    return [
        filled(template, results, page)
        for page, entry in _stated().items()
        for template in entry.get("measured", [])
    ]


def given(page: str) -> list[str]:
    """The numbers of a page that are not measured, as they are written."""
    return [number for number in str(_stated().get(page, {}).get("given", "")).split(", ") if number]


def filled(template: str, results: Path, page: str = "") -> Sentence:
    """A template with its fields in place of their numbers."""
    numbers = tuple(
        (written(value_of(field[1], results), field[2], (field[3] or "").strip()), field[1])
        for field in FIELD.finditer(template)
    )
    each = iter(numbers)
    return Sentence(page, FIELD.sub(lambda field: next(each)[0], template), numbers)


def written(value: float, form: str, to: str = "") -> str:
    """A number as a page has it: with this format, rounded "up" or "down" where it is a bound.

    >>> written(5.149e-6, ".1e"), written(5.149e-6, ".1e", "up"), written(96.6, ".0f", "down")
    ('5.1e-6', '5.2e-6', '96')
    >>> written(29835.26, ".0f")
    '29 835'
    """
    rounding = {"up": ROUND_CEILING, "down": ROUND_FLOOR, "": ROUND_HALF_EVEN}[to]
    digits = int(form[1:-1])
    exact = Decimal(repr(value))
    if form.endswith("e"):
        return f"{Context(prec=digits + 1, rounding=rounding).create_decimal(exact):{form}}"
    text = f"{exact.quantize(Decimal(1).scaleb(-digits), rounding):,{form}}"
    return text.replace(",", " ") if value >= 1e4 else text.replace(",", "")


def value_of(expression: str, results: Path = RESULTS) -> float:
    """The number of an expression of keys with ``+ - * /``.

    A key is ``study.key`` of ``measured.csv``, or ``study/table(column; which; column=value; ...)``: of the
    rows with these values the "only", "first", "least", "largest" or "median" number, or the "count" of rows.
    ``column=one|other`` are rows with either, ``column!=value`` those with another value.
    """
    names: dict[str, float] = {}

    def named(key: re.Match[str]) -> str:
        name = f"key{len(names)}"
        cell = key["cell"].split("; ") if key["table"] else []
        names[name] = _cell(results, key["table"], *cell) if cell else _measured(results, key[0])
        return name

    found: Any = pd.eval(KEY.sub(named, expression), local_dict=names, engine="python")
    return float(found)


def listed_numbers() -> Iterator[tuple[str, str, str]]:
    """Page, number as written, key: of README, documentation and report."""
    for sentence in sentences():
        for number, expression in sentence.numbers:
            yield sentence.page, number, expression
    claims, figures = paper()
    texts = [text for name, text in vars(report).items() if name.isupper() and isinstance(text, str)]
    texts += [text for claim in claims for text in (claim.says, claim.fails)]
    texts += [figure.unknown for figure in figures]
    used = [key for text in texts for key in keys(text)] + [claim.ours for claim in claims]
    numbers = read_measured(RESULTS)
    for key in (key for key in dict.fromkeys(used) if key in numbers):
        yield "results/REPORT.md", f"{numbers[key]:.6g}", key


@cache
def _stated() -> dict[str, dict[str, list[str] | str]]:
    return tomllib.loads(STATED.read_text(encoding="utf-8"))


@cache
def _table(path: Path) -> pd.DataFrame:
    return pd.read_csv(path)


def _measured(results: Path, key: str) -> float:
    study = key.partition(".")[0]
    return float(_table(results / study / "measured.csv").set_index("key").value[key])


def _cell(results: Path, table: str, column: str, which: str, *where: str) -> float:
    rows = _table(results / f"{table}.csv")
    for condition in where:
        name, _, values = condition.partition("=")
        chosen = rows[name.rstrip("!")].astype(str).isin(values.split("|"))
        rows = rows[~chosen if name.endswith("!") else chosen]
    if which not in WHICH or not len(rows) or (which == "only" and len(rows) > 1):
        raise OptionError(f"{table}: expected {WHICH}, found {which!r} of {len(rows)} rows with {where}")
    numbers = rows[column]
    if which == "count":
        return float(len(rows))
    if which in ("only", "first"):
        return float(numbers.iloc[0])
    return float({"least": numbers.min, "largest": numbers.max, "median": numbers.median}[which]())
