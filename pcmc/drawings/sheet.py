"""Sheets of paper: their formats, layers, lines and texts, in millimetres from the lower left corner."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..base.arrays import Floats

FORMATS = {"A4": (210.0, 297.0), "A3": (420.0, 297.0), "A2": (594.0, 420.0), "A1": (841.0, 594.0)}
FORMATS["A0"] = (1189.0, 841.0)
"""Width and height of the sheet formats, mm: ISO 216, landscape but for A4."""

SCALES = (1, 2, 5, 10, 20, 25, 50, 100, 200, 250, 500, 1000, 2000, 5000)
"""The scales that are chosen from where none is given: 1 to this."""

MARGIN, STRIP = 10.0, 16.0  # mm: around the frame; height of the title strip within it
GAP = 8.0  # mm between views
SMALL, LARGE = 2.5, 3.5  # mm: heights of letters
WIDTH = 0.72  # of a letter, in its height, for what must fit


class Layer(NamedTuple):
    """A layer of a drawing: colour by AutoCAD's index, width of its lines in 1/100 mm, and what it holds."""

    color: int
    weight: int
    about: str


LAYERS = {
    "PCMC-RIDGE": Layer(1, 50, "junctions of the roof: ridges and valleys"),
    "PCMC-RIM": Layer(7, 50, "rims of the roof"),
    "PCMC-WALL": Layer(3, 35, "bottoms and ends of walls"),
    "PCMC-CABLE": Layer(6, 70, "cables"),
    "PCMC-PANEL": Layer(8, 13, "edges of panels"),
    "PCMC-SECTION": Layer(5, 50, "sections of the roof"),
    "PCMC-SECTION-WALL": Layer(3, 35, "sections of walls"),
    "PCMC-POINT": Layer(6, 18, "setting-out points"),
    "PCMC-TEXT": Layer(7, 18, "texts, numbers and tables"),
    "PCMC-FRAME": Layer(7, 35, "frames of sheets"),
    "PCMC-CUT": Layer(7, 25, "outlines of panels at true size"),
    "PCMC-LABEL": Layer(5, 13, "labels of panels' edges"),
    "PCMC-MARK": Layer(1, 35, "what must not be overlooked"),
}


class Line(NamedTuple):
    """A polyline (k,2), mm."""

    points: Floats
    layer: str
    closed: bool = False


class Text(NamedTuple):
    """A line of text: the middle of its line at ``at``, mm, ``turn`` in degrees; align L, C or R."""

    at: tuple[float, float]
    text: str
    height: float = SMALL
    layer: str = "PCMC-TEXT"
    align: str = "L"
    turn: float = 0.0


@dataclass
class Sheet:
    """A sheet being drawn: what is on it, in millimetres."""

    title: str
    format: str
    scale: str = ""
    lines: list[Line] = field(default_factory=list)
    texts: list[Text] = field(default_factory=list)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, mm."""
        return FORMATS[self.format]


def room(name: str) -> tuple[float, float]:
    """Width and height, mm, that a format leaves for drawing."""
    width, height = FORMATS[name]
    return width - 2 * MARGIN - 2 * GAP, height - 2 * MARGIN - STRIP - 2 * GAP


def corner() -> Floats:
    """(2,) the lower left corner of that room, mm."""
    return np.array([MARGIN + GAP, MARGIN + STRIP + GAP])


def add_frames(sheets: list[Sheet], name: str, units: str, mark: str) -> None:
    """Give each sheet its frame, its title strip with its number, and the mark, if there is one."""
    for number, sheet in enumerate(sheets, start=1):
        width, height = sheet.size
        low, right, top = MARGIN, width - MARGIN, height - MARGIN
        frame = np.array([[low, low], [right, low], [right, top], [low, top]])
        strip = np.array([[low, low + STRIP], [right, low + STRIP]])
        sheet.lines += [Line(frame, "PCMC-FRAME", True), Line(strip, "PCMC-FRAME")]
        upper, lower = low + 0.7 * STRIP, low + 0.28 * STRIP
        about = [name, f"scale {sheet.scale}" if sheet.scale else "", f"lengths in {units}"]
        sheet.texts += [
            Text((low + 4.0, upper), sheet.title, LARGE),
            Text((low + 4.0, lower), ", ".join(filter(None, about))),
            Text((right - 4.0, upper), f"sheet {number} of {len(sheets)}", LARGE, align="R"),
            Text((right - 4.0, lower), sheet.format, align="R"),
        ]
        if mark:
            fits = min(5.0, (width - 2 * MARGIN - 2 * GAP) / (WIDTH * len(mark)))
            sheet.texts.append(Text((0.5 * width, top - 4.0), mark, fits, "PCMC-MARK", "C"))


def fits(size: Floats, name: str) -> bool:
    """Whether a drawing of this size (2,) in mm fits a format.

    >>> fits(np.array([500.0, 300.0]), "A2"), fits(np.array([500.0, 300.0]), "A3")
    (True, False)
    """
    return bool((np.asarray(size) <= np.array(room(name)) + 1e-9).all())


def table_sheets(title: str, head: list[str], rows: list[list[str]], name: str) -> list[Sheet]:
    """A table in as many columns and sheets as it needs."""
    widths = [max(len(row[k]) for row in [head, *rows]) for k in range(len(head))]
    across = np.append(0.0, np.cumsum([(w + 2.0) * WIDTH * SMALL for w in widths]))
    wide, high = room(name)
    step = 1.8 * SMALL
    per_column = int(high / step) - 1
    columns = max(1, int((wide + GAP) // (across[-1] + GAP)))
    sheets = []
    for start in range(0, max(1, len(rows)), per_column * columns):
        sheet = Sheet(title, name)
        for column in range(columns):
            first = start + column * per_column
            part = rows[first : first + per_column]
            if part or not column:
                low, bottom = corner()
                _add_column(
                    sheet, [head, *part], across, low + column * (across[-1] + GAP), bottom + high, step
                )
        sheets.append(sheet)
    return sheets


def _add_column(
    sheet: Sheet, rows: list[list[str]], across: Floats, left: float, top: float, step: float
) -> None:
    """Rows of a table below one another, the first of them its head; ``across`` are the columns' sides."""
    for k, row in enumerate(rows):
        y = float(top - (k + 0.5) * step)
        sheet.texts += [
            Text((float(left + right - 2.0 * WIDTH * SMALL), y), text, align="R")
            for right, text in zip(across[1:], row, strict=True)
        ]
    rule = np.array([[left, top - step], [left + across[-1] - 2.0 * WIDTH * SMALL, top - step]])
    sheet.lines.append(Line(rule, "PCMC-FRAME"))
