"""Sheets of paper: their formats, layers, lines and texts, in millimetres from the lower left corner; and
their pages in a PDF file, of true size, with texts that can be searched."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ..base.arrays import Floats
from ..base.libraries import require
from ..base.validate import one_line
from ..certificate import Certificate
from ..surface.geometry import lengths_along

FORMATS = {"A4": (210.0, 297.0), "A3": (420.0, 297.0), "A2": (594.0, 420.0), "A1": (841.0, 594.0)}
FORMATS["A0"] = (1189.0, 841.0)
"""Width and height of the sheet formats, mm: ISO 216, landscape but for A4."""

DECIMALS = {"m": 3, "cm": 1, "mm": 0, "ft": 4, "in": 2}  # about a millimetre or better
LENGTHS = {*"xyz", *"abc", "length", "width", "cut length"}  # columns of tables
DIGITS = 4  # of the largest number of a column, and of the size of a small roof

MISSED = "TARGETS NOT MET"  # mark of a roof that misses them
MARGIN, STRIP = 10.0, 16.0  # mm: around the frame; height of the title strip within it
GAP = 8.0  # mm between views
CORNER = np.array([MARGIN + GAP, MARGIN + STRIP + GAP])  # mm: the lower left one of what is drawn
NEAR = 0.5  # mm between points of a line that texts keep off
SMALL, LARGE = 2.5, 3.5  # mm: heights of letters
WIDTH = 0.72  # of a letter, in its height, for what must fit


class SheetLayer(NamedTuple):
    color: int  # by AutoCAD's index
    weight: int  # width of its lines, 1/100 mm
    about: str  # what it holds


MEMBERS = "PCMC-MEMBER"
LAYERS = {
    "PCMC-RIDGE": SheetLayer(1, 50, "junctions of the roof: ridges and valleys"),
    "PCMC-RIM": SheetLayer(7, 50, "rims of the roof"),
    "PCMC-WALL": SheetLayer(3, 35, "bottoms and ends of walls"),
    "PCMC-MIRROR": SheetLayer(8, 35, "lines in mirror planes, where the roof goes on"),
    "PCMC-CABLE": SheetLayer(6, 70, "cables"),
    MEMBERS: SheetLayer(30, 70, "members of the structural model"),
    "PCMC-PANEL": SheetLayer(8, 13, "edges of panels"),
    "PCMC-SECTION": SheetLayer(5, 50, "sections of the roof"),
    "PCMC-SECTION-WALL": SheetLayer(3, 35, "sections of walls"),
    "PCMC-POINT": SheetLayer(6, 18, "setting-out points"),
    "PCMC-SUPPORT": SheetLayer(5, 50, "masts and other supports of one point"),
    "PCMC-DIM": SheetLayer(7, 18, "dimensions and levels"),
    "PCMC-TEXT": SheetLayer(7, 18, "texts, numbers and tables"),
    "PCMC-FRAME": SheetLayer(7, 35, "frames of sheets"),
    "PCMC-CUT": SheetLayer(7, 25, "outlines of panels at true size, and of strips with allowances"),
    "PCMC-SEAM": SheetLayer(5, 25, "seams of cloth"),
    "PCMC-NOTCH": SheetLayer(1, 25, "notches along seams"),
    "PCMC-WARP": SheetLayer(3, 25, "arrows of the warp"),
    "PCMC-LABEL": SheetLayer(5, 13, "labels of edges of panels and strips"),
    "PCMC-MARK": SheetLayer(1, 35, "what must not be overlooked"),
}


def length_decimals(unit: str, size: float) -> int:
    """Decimals of the lengths of a roof: a millimetre or better, and four digits of its size.

    >>> length_decimals("m", 24.0), length_decimals("mm", 24e3), length_decimals("mm", 3.0)
    (3, 0, 3)
    """
    return max(DECIMALS[unit], DIGITS - 1 - math.floor(math.log10(size)))


def column(values: Iterable[float], digits: int = DIGITS) -> list[str]:
    """Numbers with as many decimals as the largest of them needs; nothing for what is not known.

    >>> column([6.0, 12.3456, -1e-14, math.nan])
    ['6.00', '12.35', '0.00', '–']
    >>> column([6.17e-6, 1.6e-7])
    ['6.170e-06', '1.600e-07']
    """
    numbers = np.asarray(list(values), dtype=float)
    largest = float(np.abs(numbers[np.isfinite(numbers)]).max(initial=0.0))
    if largest > 0.0 and not 1e-4 <= largest < 1e9:
        return ["–" if not math.isfinite(x) else f"{x:.{digits - 1}e}" for x in numbers]
    decimals = max(digits - 1 - math.floor(math.log10(largest)), 0) if largest else 0
    texts = [f"{x:.{decimals}f}" if math.isfinite(x) else "–" for x in numbers]
    return [text.removeprefix("-") if not text.strip("-0.") else text for text in texts]


class SheetLine(NamedTuple):
    """A polyline (k,2), mm; or (k,3) in the model, with its name and the numbers of its vertices."""

    points: Floats
    layer: str
    closed: bool = False
    name: str = ""
    vertices: tuple[int, ...] = ()


class Text(NamedTuple):
    """A line of text: the middle of its line at ``at`` (2,), mm, ``turn`` in degrees; align L, C or R."""

    at: Sequence[float] | Floats
    text: str
    height: float = SMALL
    layer: str = "PCMC-TEXT"
    align: str = "L"
    turn: float = 0.0


class Dimension(NamedTuple):
    """The distance of two points (2,) mm along an axis, 0 or 1, shown where the other coordinate is ``at``.

    ``unit`` is the length that 1 mm stands for, in the unit of the roof.

    >>> Dimension(np.array([5.0, 9.0]), np.array([45.0, 7.0]), 0, 2.0, 0.1, 2).text
    '4.00'
    """

    start: Floats
    end: Floats
    axis: int
    at: float
    unit: float
    decimals: int

    @property
    def text(self) -> str:
        """The distance as it is written."""
        return f"{abs(self.end - self.start)[self.axis] * self.unit:.{self.decimals}f}"

    def drawn(self) -> tuple[list[SheetLine], Text]:
        """Its lines and its text, for files that have no dimensions of their own."""
        ends = np.array([self.start, self.end])
        feet = ends.copy()
        feet[:, 1 - self.axis] = self.at
        away = np.sign(feet - ends)
        lines = [feet, *np.stack([ends + away, feet + away], axis=1), *(feet[:, None] + TICK)]
        beside = np.array([0.0, SMALL] if self.axis == 0 else [-SMALL, 0.0])
        place = feet.mean(axis=0) + 0.8 * beside
        text = Text(place, self.text, layer="PCMC-DIM", align="C", turn=90.0 * self.axis)
        return [SheetLine(line, "PCMC-DIM") for line in lines], text


TICK = np.array([[-0.8, -0.8], [0.8, 0.8]])  # mm
Lines = Sequence[SheetLine]


@dataclass
class Sheet:
    """A sheet being drawn: what is on it, in millimetres."""

    title: str
    format: str
    scale: str = ""
    lines: list[SheetLine] = field(default_factory=list)
    texts: list[Text] = field(default_factory=list)
    dimensions: list[Dimension] = field(default_factory=list)
    places: list[tuple[float, Floats]] = field(default_factory=list)  # of views: x is at factor · x + shift

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, mm."""
        return FORMATS[self.format]

    def drawn(self) -> tuple[list[SheetLine], list[Text]]:
        """All lines and texts, those of dimensions too."""
        parts = [dimension.drawn() for dimension in self.dimensions]
        return self.lines + [line for lines, _ in parts for line in lines], self.texts + [t for _, t in parts]


def place_labels(
    labels: Sequence[Text], others: Sequence[Text], lines: Lines, rings: int = 6, needed: bool = True
) -> list[Text]:
    """Labels at or beside their places, so that none covers another text; nor a line, where there is room.

    One without room within ``rings`` steps of its height stays if it is ``needed``, else it is left out.
    """
    steps = np.indices((2 * rings + 1, 2 * rings + 1)).reshape(2, -1).T - rings
    steps = steps[np.hypot(*steps.T).argsort(kind="stable")]
    boxes, count, placed = np.empty((len(others) + len(labels), 2, 2)), len(others), []
    boxes[:count] = np.array([box(text) for text in others]).reshape(-1, 2, 2)
    drawn = np.concatenate([np.empty((0, 2)), *map(_points_along, lines)])
    for label in labels:
        tries = box(label) + 0.8 * label.height * steps[:, None]
        low, high = tries.min(axis=(0, 1)), tries.max(axis=(0, 1))
        taken = boxes[:count]
        near = taken[((low < taken[:, 1]) & (taken[:, 0] < high)).all(axis=1)]
        covers = ((tries[:, None, 0] < near[:, 1]) & (near[:, 0] < tries[:, None, 1])).all(axis=2).any(axis=1)
        on = drawn[((low < drawn) & (drawn < high)).all(axis=1)]
        crossed = ((tries[:, None, 0] < on) & (on < tries[:, None, 1])).all(axis=2).any(axis=1)
        if needed or not covers.all():
            k = int((2 * covers + crossed).argmin())
            placed.append(label._replace(at=label.at + tries[k, 0] - box(label)[0]))
            boxes[count], count = tries[k], count + 1
    return placed


def _points_along(line: SheetLine) -> Floats:
    """(k,2) points of a line, so near that no text is between them."""
    path = np.concatenate([line.points, line.points[: int(line.closed)]])
    along = lengths_along(path)
    at = np.linspace(0.0, along[-1], 2 + int(along[-1] / NEAR))
    return np.stack([np.interp(at, along, x) for x in path.T], axis=1)


def width(text: str, height: float = SMALL) -> float:
    """The width of a text, mm, rather too large."""
    return WIDTH * len(text) * height


def box(text: Text) -> Floats:
    """(2,2) lower and upper corner of what a text covers, with a little room around it."""
    wide = width(text.text, text.height)
    left = {"L": 0.0, "C": 0.5, "R": 1.0}[text.align] * wide
    corners = np.array([[-left - 0.3, -0.7 * text.height], [wide - left + 0.3, 0.7 * text.height]])
    return np.asarray(text.at) + (corners[:, ::-1] if text.turn == 90.0 else corners)


def drawing_area(name: str) -> Floats:
    """(2,) width and height, mm, that a format leaves for drawing; it begins at ``CORNER``."""
    return np.array(FORMATS[name]) - CORNER - (MARGIN + GAP)


def add_frames(sheets: list[Sheet], name: str, units: str, certificate: Certificate, mark: str = "") -> None:
    """Give each sheet its frame, its title strip with its number, and the mark of a roof that needs one."""
    mark = certificate.mark or one_line("mark", mark)
    for number, sheet in enumerate(sheets, start=1):
        width, height = sheet.size
        low, right, top = MARGIN, width - MARGIN, height - MARGIN
        frame = np.array([[low, low], [right, low], [right, top], [low, top]])
        strip = frame[:2] + np.array([0.0, STRIP])
        sheet.lines += [SheetLine(frame, "PCMC-FRAME", True), SheetLine(strip, "PCMC-FRAME")]
        upper, lower = low + 0.7 * STRIP, low + 0.28 * STRIP
        about = [name, certificate.part, f"scale {sheet.scale}" if sheet.scale else "", f"lengths in {units}"]
        sheet.texts += [
            Text((low + 4.0, upper), sheet.title, LARGE),
            Text((low + 4.0, lower), ", ".join(filter(None, about))),
            Text((right - 4.0, upper), f"sheet {number} of {len(sheets)}", LARGE, align="R"),
            Text((right - 4.0, lower), sheet.format, align="R"),
        ]
        if mark:
            fits = min(5.0, (width - 2 * MARGIN - 2 * GAP) / (WIDTH * len(mark)))
            sheet.texts.append(Text((0.5 * width, top - 4.0), mark, fits, "PCMC-MARK", "C"))


def table_sheets(
    title: str, table: pd.DataFrame, name: str, decimals: int, units: Mapping[str, str] | None = None
) -> list[Sheet]:
    """A table in as many columns and sheets as it needs; its head has the units that columns have.

    ``decimals`` are those of lengths; other numbers have as many as the largest of their kind needs.
    """

    def texts(key: str) -> list[str]:
        values = table[key]
        if values.dtype != float:
            return [str(value) for value in values]
        if key in LENGTHS:
            return [f"{round(x, decimals) + 0.0:.{decimals}f}" for x in values]
        alike = [one for one in table.columns if one[:-1] == key[:-1]]  # such as force_x, force_y, force_z
        numbers = np.array(column(table[alike].to_numpy().ravel()))
        return numbers[alike.index(key) :: len(alike)].tolist()

    rows = [[", ".join(filter(None, (key, (units or {}).get(key)))) for key in table.columns]]
    rows += map(list, zip(*map(texts, table.columns), strict=True))
    widths = np.array([max(map(len, column)) for column in zip(*rows, strict=True)])
    across = np.append(0.0, np.cumsum((widths + 2.0) * WIDTH * SMALL))
    (wide, high), step = drawing_area(name), 1.8 * SMALL
    per_column = int(high / step) - 1
    columns = max(1, int((wide + GAP) // (across[-1] + GAP)))
    sheets = []
    for first in range(1, max(2, len(rows)), per_column):
        place = (first - 1) // per_column % columns
        if place == 0:
            sheets.append(Sheet(title, name))
        left, top = CORNER + np.array([place * (across[-1] + GAP), high])
        right = left + across[1:] - 2.0 * WIDTH * SMALL
        for k, row in enumerate([rows[0], *rows[first : first + per_column]]):
            y = top - (k + 0.5) * step
            sheets[-1].texts += [Text((x, y), text, align="R") for x, text in zip(right, row, strict=True)]
        rule = np.array([[left, top - 0.8 * step], [right[-1], top - 0.8 * step]])
        sheets[-1].lines.append(SheetLine(rule, "PCMC-FRAME"))
    return sheets


FONT, BOLD = "DejaVuSans", "DejaVuSans-Bold"
CAPITAL = 0.73  # height of a capital in the size of its font
COLORS = {1: "#D00000", 3: "#008000", 5: "#0040C0", 6: "#A000A0", 7: "#000000", 8: "#909090", 30: "#E07000"}


def register_fonts() -> None:
    """Make matplotlib's letters, which have Greek, Cyrillic and the signs of units, known to reportlab.

    MissingExtra if one of the two is not installed.
    """
    require("reportlab", extra="report")
    require("matplotlib", extra="plot")
    from matplotlib import get_data_path
    from reportlab.pdfbase import pdfmetrics, ttfonts

    for name in (FONT, BOLD):
        if name not in pdfmetrics.getRegisteredFontNames():
            file = Path(get_data_path(), "fonts", "ttf", f"{name}.ttf")
            pdfmetrics.registerFont(ttfonts.TTFont(name, file))


def write_pdf(sheets: Sequence[Sheet], path: Path) -> None:
    """A page per sheet; the file has no date, so the same sheets give the same bytes."""
    register_fonts()
    from reportlab.lib.units import mm
    from reportlab.pdfgen.canvas import Canvas

    canvas = Canvas(str(path), invariant=1)
    for sheet in sheets:
        canvas.setPageSize([side * mm for side in sheet.size])
        paint_sheet(canvas, *sheet.drawn())
        canvas.showPage()
    canvas.save()


def paint_sheet(canvas: Any, lines: Lines, texts: Sequence[Text], boxed: bool = False) -> None:
    """Draw on a canvas of reportlab, from its origin; ``boxed`` texts hide what is behind them."""
    from reportlab.lib.colors import HexColor
    from reportlab.lib.units import mm

    canvas.setLineJoin(1)
    for line in lines:
        look = LAYERS[line.layer]
        canvas.setStrokeColor(HexColor(COLORS[look.color]))
        canvas.setLineWidth(look.weight / 100.0 * mm)
        path = canvas.beginPath()
        first, *others = (line.points * mm).tolist()
        path.moveTo(*first)
        for point in others:
            path.lineTo(*point)
        if line.closed:
            path.close()
        canvas.drawPath(path)
    for text in texts:
        canvas.saveState()
        canvas.translate(text.at[0] * mm, text.at[1] * mm)
        canvas.rotate(text.turn)
        high, size = text.height * mm, text.height / CAPITAL * mm
        if boxed:
            wide = canvas.stringWidth(text.text, FONT, size) + 0.4 * high
            canvas.setFillColor(HexColor("#FFFFFF"))
            canvas.rect(-0.5 * wide, -0.7 * high, wide, 1.4 * high, stroke=0, fill=1)
        canvas.setFillColor(HexColor(COLORS[LAYERS[text.layer].color]))
        canvas.setFont(FONT, size)
        draw = {"L": canvas.drawString, "C": canvas.drawCentredString, "R": canvas.drawRightString}
        draw[text.align](0.0, -0.5 * high, text.text)
        canvas.restoreState()
