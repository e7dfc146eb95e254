"""What pages are made of, by reportlab: headings, paragraphs, tables that go on overleaf, pictures."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any
from xml.sax.saxutils import escape

from ..drawings.pdf import BOLD, FONT, paint, register_fonts
from .plan import PaperPlan
from .tables import Table

INK, GREY, RED = "#202020", "#707070", "#C00000"
SIDE, TOP, BOTTOM = 18.0, 20.0, 17.0  # mm: margins of a page
TEXT, CELL = 9.0, 7.5  # points
WIDEST = 118.0  # mm: height of a picture at most


def pdf(story: Callable[[], list[Any]], title: str, foot: str, mark: str) -> bytes:
    """The pages as a file. ``story`` gives their content anew; a mark stands on each of them.

    The content is laid out twice, as each page shows the number of all. No date is written.
    """
    register_fonts()
    _, count = _laid_out(story(), title, foot, mark, 0)
    return _laid_out(story(), title, foot, mark, count)[0]


def _laid_out(story: list[Any], title: str, foot: str, mark: str, count: int) -> tuple[bytes, int]:
    """The file, and the number of its pages."""
    from reportlab.lib.colors import HexColor
    from reportlab.lib.pagesizes import A4
    from reportlab.lib.units import mm
    from reportlab.platypus import SimpleDocTemplate

    def frame(canvas: Any, document: Any) -> None:
        width, height = A4
        left, right, upper, lower = SIDE * mm, width - SIDE * mm, height - 13.0 * mm, 10.0 * mm
        canvas.setStrokeColor(HexColor(GREY))
        canvas.setLineWidth(0.4)
        canvas.line(left, upper - 2.0 * mm, right, upper - 2.0 * mm)
        canvas.setFont(FONT, 8.0)
        canvas.setFillColor(HexColor(GREY))
        canvas.drawString(left, upper, _cut(canvas, title, 90.0 * mm if mark else right - left))
        canvas.drawString(left, lower, _cut(canvas, foot, right - left - 30.0 * mm))
        canvas.drawRightString(right, lower, f"page {document.page} of {count}")
        if mark:
            canvas.setFont(BOLD, 9.0)
            canvas.setFillColor(HexColor(RED))
            canvas.drawRightString(right, upper, mark)

    stream = io.BytesIO()
    margins = {"leftMargin": SIDE * mm, "rightMargin": SIDE * mm}
    margins |= {"topMargin": TOP * mm, "bottomMargin": BOTTOM * mm}
    document = SimpleDocTemplate(
        stream, pagesize=A4, title=title, author="pcmc", creator="pcmc", invariant=1, lang="en", **margins
    )
    document.build(story, onFirstPage=frame, onLaterPages=frame)
    return stream.getvalue(), document.page


def _cut(canvas: Any, text: str, width: float) -> str:
    """The text, shortened to a width in points."""
    whole = text
    while text and canvas.stringWidth(text + "…", FONT, 8.0) > width:
        text = text[:-1]
    return whole if text == whole else text + "…"


def heading(text: str) -> Any:
    """A heading that stays with what follows it."""
    return _paragraph(text, BOLD, 12.0, before=10.0, after=4.0, keep=True)


def paragraph(text: str) -> Any:
    """A paragraph of running text."""
    return _paragraph(text, FONT, TEXT, before=2.0, after=2.0)


def new_page() -> Any:
    """The end of a page."""
    from reportlab.platypus import PageBreak

    return PageBreak()


def picture(title: str, png: bytes) -> list[Any]:
    """A picture across the page, with its title above it."""
    from reportlab.lib.units import mm
    from reportlab.platypus import Image, KeepTogether

    image = Image(io.BytesIO(png))
    share = min((_width() * mm) / image.imageWidth, WIDEST * mm / image.imageHeight)
    image.drawWidth, image.drawHeight = share * image.imageWidth, share * image.imageHeight
    return [KeepTogether([*([_title(title)] if title else []), image])]


def plan(drawing: PaperPlan) -> Any:
    """A plan to scale, in the middle between the margins."""
    from reportlab.lib.units import mm
    from reportlab.platypus import Flowable

    class _Plan(Flowable):
        hAlign = "CENTER"

        def wrap(self, *_: float) -> tuple[float, float]:
            return drawing.size[0] * mm, drawing.size[1] * mm

        def draw(self) -> None:
            paint(self.canv, drawing.lines, drawing.texts, boxed=True)

    return _Plan()


def table(content: Table) -> list[Any]:
    """A table with its title. It goes on overleaf with its head; a wide one has smaller letters."""
    from reportlab.lib.colors import HexColor
    from reportlab.lib.units import mm
    from reportlab.platypus import Table as Grid

    headed = bool(content.head)
    size, rows = CELL, [content.head, *content.rows] if headed else content.rows
    widths = _widths(rows, size)
    if sum(widths) > _width() * mm:
        size = max(5.0, size * _width() * mm / sum(widths))
        widths = _widths(rows, size)
    cells = [
        [
            _cell(text, size, bold=headed and not k, right=headed and j >= content.words)
            for j, text in enumerate(row)
        ]
        for k, row in enumerate(rows)
    ]
    spare = _width() * mm / sum(widths)
    look = [("VALIGN", (0, 0), (-1, -1), "TOP"), ("LINEBELOW", (0, 0), (-1, -1), 0.25, HexColor("#D8D8D8"))]
    look += [(f"{side}PADDING", (0, 0), (-1, -1), 2.0) for side in ("TOP", "BOTTOM")]
    look += [(f"{side}PADDING", (0, 0), (-1, -1), 3.0) for side in ("LEFT", "RIGHT")]
    if headed:
        look.append(("LINEBELOW", (0, 0), (-1, 0), 0.6, HexColor(INK)))
    grid = Grid(
        cells,
        colWidths=[width * min(spare, 1.0) for width in widths],
        repeatRows=int(headed),
        style=look,
        hAlign="LEFT",
        spaceBefore=4.0,
        spaceAfter=8.0,
    )
    return [*([_title(content.title)] if content.title else []), grid]


def _widths(rows: Sequence[Sequence[str]], size: float) -> list[float]:
    """The widths of columns, points: a head may break at its spaces, other texts at 60 mm."""
    from reportlab.lib.units import mm
    from reportlab.pdfbase.pdfmetrics import stringWidth

    def least(text: str, head: bool) -> float:
        parts = text.split() if head else [text]
        return max((stringWidth(part, BOLD if head else FONT, size) for part in parts), default=0.0)

    columns = zip(*rows, strict=True)
    return [
        min(max(least(text, not k) for k, text in enumerate(texts)) + 10.0, 60.0 * mm) for texts in columns
    ]


def _cell(text: str, size: float, *, bold: bool, right: bool) -> Any:
    return _paragraph(text, BOLD if bold else FONT, size, right=right)


def _title(text: str) -> Any:
    return _paragraph(text, BOLD, 9.5, before=6.0, after=2.0, keep=True)


def _width() -> float:
    """Between the margins, mm."""
    return 210.0 - 2.0 * SIDE


def _paragraph(
    text: str,
    font: str,
    size: float,
    *,
    before: float = 0.0,
    after: float = 0.0,
    keep: bool = False,
    right: bool = False,
) -> Any:
    from reportlab.platypus import Paragraph

    return Paragraph(escape(text), _style(font, size, before, after, keep, right))


@cache
def _style(font: str, size: float, before: float, after: float, keep: bool, right: bool) -> Any:
    from reportlab.lib.colors import HexColor
    from reportlab.lib.enums import TA_LEFT, TA_RIGHT
    from reportlab.lib.styles import ParagraphStyle

    return ParagraphStyle(
        "",
        fontName=font,
        fontSize=size,
        leading=1.3 * size,
        textColor=HexColor(INK),
        spaceBefore=before,
        spaceAfter=after,
        keepWithNext=keep,
        alignment=TA_RIGHT if right else TA_LEFT,
        splitLongWords=True,
    )
