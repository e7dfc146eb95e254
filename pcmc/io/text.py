"""Lines of text from columns of numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from urllib.parse import quote

import numpy as np


def format_rows(template: str, *columns: np.ndarray) -> str:
    """The template filled with each row of the columns; ``%r`` writes a float exactly.

    >>> format_rows("v %r %d\\n", np.array([0.1, 2.0]), np.array([3, 4]))
    'v 0.1 3\\nv 2.0 4\\n'
    """
    return "".join(template % row for row in zip(*(column.tolist() for column in columns), strict=True))


def numbers(words: Sequence[str], kind: type = np.float64) -> Any:
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
