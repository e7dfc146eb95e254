"""How a surface looks as the value of a notebook's cell: a picture above a few lines of text."""

from __future__ import annotations

import html
from base64 import b64encode
from typing import TYPE_CHECKING

from ..base.errors import MissingExtra
from ..solvers.result import Result
from ..surface import Surface
from .figure import png
from .pictures import draw

if TYPE_CHECKING:
    from ..accuracy.adaptive import AccurateResult
    from ..design import Design

WIDTH = 700  # pixels


def cell_html(value: Surface | Result | Design | AccurateResult) -> str:
    """A picture of a surface, or of the one in a result, above its ``repr``; without ``plot`` the text alone.

    >>> from pcmc import Patch
    >>> one = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("a<b", 1.0)], fixed=[0])
    >>> "a&lt;b" in cell_html(one), cell_html(one).count("<img")
    (True, 1)
    """
    text = f"<pre>{html.escape(repr(value))}</pre>"
    try:
        image = draw(value if isinstance(value, Surface) else value.surface, width=WIDTH, legend=True)
    except MissingExtra:
        return text
    return f'<img alt="surface" src="data:image/png;base64,{b64encode(png(image)).decode()}">{text}'
