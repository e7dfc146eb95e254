"""Sheets as the pages of a PDF file, of their true size, with texts that can be searched."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Floats
from ..base.errors import MissingExtra
from .sheet import LAYERS, Line, Sheet

INCH = 25.4  # mm
POINT = INCH / 72.0  # mm
CAPITAL = 0.73  # height of a capital in the size of its font
ALIGN: dict[str, Any] = {"L": "left", "C": "center", "R": "right"}
COLORS = {1: "#D00000", 3: "#008000", 5: "#0040C0", 6: "#A000A0", 7: "#000000", 8: "#808080"}


def write_pdf(sheets: Sequence[Sheet], path: Path) -> None:
    """A page per sheet; the file has no date, so the same sheets give the same bytes."""
    try:
        from matplotlib.backends.backend_pdf import FigureCanvasPdf, PdfPages
        from matplotlib.collections import LineCollection
        from matplotlib.figure import Figure
        from matplotlib.text import Text
    except ImportError:
        raise MissingExtra("matplotlib", "plot") from None

    with PdfPages(path, metadata={"CreationDate": None}) as pages:
        for sheet in sheets:
            width, height = sheet.size
            figure = Figure(figsize=(width / INCH, height / INCH))
            FigureCanvasPdf(figure)
            axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, width), ylim=(0.0, height))
            axes.set_axis_off()
            lines_of_sheet, texts = sheet.drawn()
            for layer, lines in _by_layer(lines_of_sheet).items():
                look = LAYERS[layer]
                points = look.weight / 100.0 / POINT
                axes.add_collection(LineCollection(lines, colors=COLORS[look.color], linewidths=points))
            for text in texts:
                figure.add_artist(
                    Text(
                        *text.at,
                        text.text,
                        transform=axes.transData,
                        color=COLORS[LAYERS[text.layer].color],
                        fontsize=text.height / CAPITAL / POINT,
                        horizontalalignment=ALIGN[text.align],
                        verticalalignment="center_baseline",
                        rotation=text.turn,
                        rotation_mode="anchor",
                        parse_math=False,
                    )
                )
            pages.savefig(figure)


def _by_layer(drawn: Sequence[Line]) -> dict[str, list[Floats]]:
    """The lines of each layer, closed ones with their first point at the end too."""
    lines = defaultdict(list)
    for line in drawn:
        points = np.append(line.points, line.points[:1], axis=0) if line.closed else line.points
        lines[line.layer].append(points)
    return lines
