"""Sentences made from measured numbers: ``{study.key:.3g}`` in a text stands for the number of that key."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

FIELD = re.compile(r"\{([\w.-]+)(?::([^{}]*))?\}")
MISSING = "(not measured)"


def fill(text: str, measured: Mapping[str, float], words: Mapping[str, str] | None = None) -> str:
    """The text with each field in place of its number; MISSING where there is none.

    A field without a format is written with up to four digits. ``words`` has what stands for other fields.

    >>> fill("{a.met:.0f} of {a.runs} runs, {a.none}", {"a.met": 7.0, "a.runs": 26.0})
    '7 of 26 runs, (not measured)'
    """

    def number(field: re.Match[str]) -> str:
        if words and field[1] in words:
            return words[field[1]]
        value = measured.get(field[1], math.nan)
        return MISSING if math.isnan(value) else format(value, field[2] or ".4g")

    return FIELD.sub(number, text)


def keys(text: str) -> list[str]:
    """The keys of a text's fields.

    >>> keys("{a.met:.0f} of {a.runs}")
    ['a.met', 'a.runs']
    """
    return [field[1] for field in FIELD.finditer(text)]


def listed(words: list[str]) -> str:
    """Words in a row.

    >>> listed(["one", "two", "three"])
    'one, two and three'
    """
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last
