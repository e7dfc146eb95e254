"""What the pages of a report are made of; a text alone is a paragraph."""

from __future__ import annotations

from typing import NamedTuple

from .plan import PaperPlan


class Heading(NamedTuple):
    """A heading that stays with what follows it."""

    text: str


class NewPage(NamedTuple):
    """The end of a page."""


class Picture(NamedTuple):
    """A picture across the page, as a PNG file, with its title above it."""

    title: str
    png: bytes


class Table(NamedTuple):
    """A table: its title, the head, the rows, and how many columns at the left are words."""

    title: str
    head: list[str]
    rows: list[list[str]]
    words: int = 1


Block = str | Heading | NewPage | Picture | Table | PaperPlan
