"""Lines of text from columns of numbers, without a Python statement per line."""

from __future__ import annotations

from itertools import chain

import numpy as np

CHUNK = 1 << 16


def format_rows(template: str, *columns: np.ndarray) -> str:
    """The template filled with each row of the columns; ``%r`` writes a float exactly.

    >>> format_rows("v %r %d\\n", np.array([0.1, 2.0]), np.array([3, 4]))
    'v 0.1 3\\nv 2.0 4\\n'
    """
    parts = []
    for start in range(0, len(columns[0]), CHUNK):
        block = [column[start : start + CHUNK].tolist() for column in columns]
        filled = tuple(chain.from_iterable(zip(*block, strict=True)))
        parts.append(template * len(block[0]) % filled)
    return "".join(parts)
