"""The numbers in a text, without those that only name something."""

from __future__ import annotations

import re

# a figure, an equation, an example, a section; a tension by its symbol; an exponent; a name in code
NAMES = re.compile(
    r"`[^`]*`|\[[^\]]*\]\([^)]*\)|\((?:\d+|[a-z])\)|[a-zα-ω_‖]\S*²"
    r"|\b(?:Examples?|Ex\.|Figs?\.|Secs?\.|Eqs?\.)\s*\(?\d+(?:\.\d+)*\)?(?:\([a-z]\))?"
    r"(?:(?:,| to| and)\s\d+)*"
    r"|\bα(?:_aux)?(?: of the walls?)?\s\d+(?: than with \d+|, \d+)*"
)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:[ ,]\d{3})*(?:\.\d+)?(?:e[-+]?\d+)?(?![\w])")


def numbers_in(text: str) -> list[str]:
    """The numbers that a text states, as they are written.

    >>> numbers_in("Example 2, Fig. 16: 7 of 26 meshes, at α 4 and 1.5e-3 of ‖∇E‖²; see `results/9`")
    ['7', '26', '1.5e-3']
    """
    return NUMBER.findall(NAMES.sub(" ", text))
