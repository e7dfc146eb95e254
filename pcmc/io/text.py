"""Lines of text from columns of numbers."""

from __future__ import annotations

import numpy as np


def format_rows(template: str, *columns: np.ndarray) -> str:
    """The template filled with each row of the columns; ``%r`` writes a float exactly.

    >>> format_rows("v %r %d\\n", np.array([0.1, 2.0]), np.array([3, 4]))
    'v 0.1 3\\nv 2.0 4\\n'
    """
    return "".join(template % row for row in zip(*(column.tolist() for column in columns), strict=True))
