"""Lines and texts on the pages of a PDF file, of their true size, with texts that can be searched."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..base.libraries import require
from .sheet import LAYERS, Sheet, SheetLine, Text

FONT, BOLD = "DejaVuSans", "DejaVuSans-Bold"
CAPITAL = 0.73  # height of a capital in the size of its font
COLORS = {1: "#D00000", 3: "#008000", 5: "#0040C0", 6: "#A000A0", 7: "#000000", 8: "#909090"}


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


def paint_sheet(canvas: Any, lines: Sequence[SheetLine], texts: Sequence[Text], boxed: bool = False) -> None:
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
