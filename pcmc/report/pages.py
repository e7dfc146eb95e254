"""Blocks of a report laid out on A4 pages by reportlab."""

from __future__ import annotations

import io
from collections.abc import Sequence
from functools import cache
from typing import Any
from xml.sax.saxutils import escape

from reportlab import platypus
from reportlab.lib.colors import HexColor
from reportlab.lib.enums import TA_LEFT, TA_RIGHT
from reportlab.lib.pagesizes import A4
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.pdfgen.canvas import Canvas

from ..drawings.sheet import BOLD, FONT, paint_sheet
from .plan import PaperPlan
from .tables import Block, Heading, Table

INK, GREY, RED = "#202020", "#707070", "#C00000"
SIDE, TOP, BOTTOM = 18.0 * mm, 20.0 * mm, 17.0 * mm  # margins of a page
WIDTH = A4[0] - 2.0 * SIDE  # between the margins
CELL = 7.5  # points: letters of a table
TALLEST = 118.0 * mm  # height of a picture at most
FOLLOWING = 45.0 * mm  # of a page are free below where a heading begins: it is not alone


@cache
def _style(font: str, size: float, right: bool = False, **more: Any) -> Any:
    """How a paragraph looks; ``more`` are reportlab's names."""
    look = {"fontName": font, "fontSize": size, "leading": 1.3 * size, "textColor": HexColor(INK)}
    return ParagraphStyle("", **look, alignment=TA_RIGHT if right else TA_LEFT, **more)


HEADING = _style(BOLD, 12.0, spaceBefore=10.0, spaceAfter=4.0, keepWithNext=True)
TITLE = _style(BOLD, 9.5, spaceBefore=6.0, spaceAfter=2.0, keepWithNext=True)
TEXT = _style(FONT, 9.0, spaceBefore=2.0, spaceAfter=2.0)


def pdf(blocks: Sequence[Block], title: str, foot: str, mark: str) -> bytes:
    """The pages as a file, each with its number and that of all; with a mark on each. No date is written."""
    pages: list[dict[str, Any]] = []

    class Numbered(Canvas):
        """A canvas that draws the frames of its pages when it knows how many they are."""

        def showPage(self) -> None:
            pages.append(dict(vars(self)))
            self._startPage()

        def save(self) -> None:
            for number, page in enumerate(pages, start=1):
                self.__dict__.update(page)
                _draw_frame(self, title, foot, mark, f"page {number} of {len(pages)}")
                super().showPage()
            super().save()

    stream = io.BytesIO()
    margins = {"leftMargin": SIDE, "rightMargin": SIDE, "topMargin": TOP, "bottomMargin": BOTTOM}
    about = {"title": title, "author": "pcmc", "creator": "pcmc", "invariant": 1, "lang": "en"}
    document = platypus.SimpleDocTemplate(stream, pagesize=A4, **about, **margins)
    document.build([part for block in blocks for part in _flowables(block)], canvasmaker=Numbered)
    return stream.getvalue()


def _draw_frame(canvas: Any, title: str, foot: str, mark: str, number: str) -> None:
    left, right, upper, lower = SIDE, A4[0] - SIDE, A4[1] - 13.0 * mm, 10.0 * mm
    canvas.setStrokeColor(HexColor(GREY))
    canvas.setLineWidth(0.4)
    canvas.line(left, upper - 2.0 * mm, right, upper - 2.0 * mm)
    canvas.setFont(FONT, 8.0)
    canvas.setFillColor(HexColor(GREY))
    canvas.drawString(left, upper, _cut(title, 90.0 * mm if mark else right - left))
    canvas.drawString(left, lower, _cut(foot, right - left - 30.0 * mm))
    canvas.drawRightString(right, lower, number)
    canvas.setFont(BOLD, 9.0)
    canvas.setFillColor(HexColor(RED))
    canvas.drawRightString(right, upper, mark)


def _cut(text: str, width: float) -> str:
    end = len(text)
    while end and stringWidth(text[:end] + "…", FONT, 8.0) > width:
        end -= 1
    return text[:end] + "…" * (end < len(text))


def _flowables(block: Block) -> list[Any]:
    if isinstance(block, Heading):
        room = platypus.PageBreak() if block.new_page else platypus.CondPageBreak(FOLLOWING)
        return [room, _paragraph(block.text, HEADING)]
    if isinstance(block, str):
        return [_paragraph(block, TEXT)]
    if isinstance(block, PaperPlan):
        return [_Plan(block)]
    title = [_paragraph(block.title, TITLE)] if block.title else []
    if isinstance(block, Table):
        headed = bool(block.head)
        rows = [block.head, *block.rows] if headed else block.rows
        size = max(5.0, CELL * min(1.0, WIDTH / sum(_widths(rows, CELL))))
        widths = _widths(rows, size)
        cells = []
        for k, row in enumerate(rows):
            styles = [_style(BOLD if headed and not k else FONT, size, right) for right in (False, headed)]
            cells.append([_paragraph(text, styles[j >= block.words]) for j, text in enumerate(row)])
        everywhere = (0, 0), (-1, -1)
        look = [("VALIGN", *everywhere, "TOP"), ("LINEBELOW", *everywhere, 0.25, HexColor("#D8D8D8"))]
        paddings = {"TOP": 2.0, "BOTTOM": 2.0, "LEFT": 3.0, "RIGHT": 3.0}
        look += [(f"{side}PADDING", *everywhere, padding) for side, padding in paddings.items()]
        look += [("LINEBELOW", (0, 0), (-1, 0), 0.6, HexColor(INK))] * headed
        widths = [width * min(WIDTH / sum(widths), 1.0) for width in widths]
        place: dict[str, Any] = {"hAlign": "LEFT", "spaceBefore": 4.0, "spaceAfter": 8.0}
        return [*title, platypus.Table(cells, colWidths=widths, repeatRows=int(headed), style=look, **place)]
    image = platypus.Image(io.BytesIO(block.png))
    share = min(WIDTH / image.imageWidth, TALLEST / image.imageHeight)
    image.drawWidth, image.drawHeight = share * image.imageWidth, share * image.imageHeight
    return [platypus.KeepTogether([*title, image])]


class _Plan(platypus.Flowable):
    """A plan to scale, in the middle between the margins."""

    hAlign = "CENTER"

    def __init__(self, plan: PaperPlan) -> None:
        super().__init__()
        self.plan = plan

    def wrap(self, *_: float) -> tuple[float, float]:
        return self.plan.size[0] * mm, self.plan.size[1] * mm

    def draw(self) -> None:
        paint_sheet(self.canv, self.plan.lines, self.plan.texts, boxed=True)


def _widths(rows: Sequence[Sequence[str]], size: float) -> list[float]:
    """The widths of columns, points: a head may break at its spaces, other texts at 60 mm."""

    def least(text: str, head: bool) -> float:
        parts = text.split() if head else [text]
        return max((stringWidth(part, BOLD if head else FONT, size) for part in parts), default=0.0)

    columns = [max(least(text, not k) for k, text in enumerate(texts)) for texts in zip(*rows, strict=True)]
    return [min(width + 10.0, 60.0 * mm) for width in columns]


def _paragraph(text: str, style: Any) -> Any:
    return platypus.Paragraph(escape(text), style)
