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
# of a page: blocks of code and output, tables of directives, formulas, comments, headings, links, list marks
NO_PROSE = re.compile(
    r"<!-- summary: begin -->.*?<!-- summary: end -->|<!--.*?-->|^```.*?^```|^:::.*?^:::|\$\$.*?\$\$"
    r"|\$[^$\n]*(?:\n[^$\n]+)?\$|^#.*?$|<[^>]*>|https?://\S+|^\s*\d+\.\s|\{[a-z:]+\}`[^`]*`",
    re.S | re.M,
)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:[ ,]\d{3})*(?:\.\d+)?(?:e[-+]?\d+)?(?![\w])")


def numbers_in(text: str) -> list[str]:
    """The numbers that a text states, as they are written.

    >>> numbers_in("Example 2, Fig. 16: 7 of 26 meshes, at α 4 and 1.5e-3 of ‖∇E‖²; see `results/9`")
    ['7', '26', '1.5e-3']
    """
    return NUMBER.findall(NAMES.sub(" ", text))


def prose(page: str) -> str:
    """The sentences of a page in one line, without code, formulas, headings and what commands write.

    >>> prose("# 1 roof\\n\\nIt is 3 m high,\\n$h = 3$.\\n\\n```sh\\npcmc 5\\n```\\n")
    'It is 3 m high, .'
    """
    return " ".join(NO_PROSE.sub(" ", page).split())
