"""The plan of a roof at a usual scale, with its overall size and the numbers of its curves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from ..base.arrays import Floats
from ..base.units import Units, length_factor
from ..certificate import Certificate
from ..drawings import views
from ..drawings.sheet import LAYERS, Line, Text, apart, box
from ..surface import Surface

FORMAT = "A4"
LEAST_EDGE = 1.2  # mm on paper: shorter edges of panels are not drawn
COLORS = {1: "#D00000", 3: "#008000", 5: "#0040C0", 6: "#A000A0", 7: "#000000", 8: "#B8B8B8"}
LABELS = {"J": "#D00000", "B": "#0040C0", "S": "#0040C0", "C": "#0040C0"}  # by the first letter
CAPITAL = 0.73  # height of a capital in the size of its font
AROUND = 1.0  # mm kept free around what is drawn


@dataclass(frozen=True, eq=False)
class PaperPlan:
    """A plan on paper.

    Attributes
    ----------
    scale : such as "1:200".
    lines, texts : mm from the lower left corner.
    size : width and height, mm.
    """

    scale: str
    lines: list[Line]
    texts: list[Text]
    size: tuple[float, float]


def paper_plan(surface: Surface, certificate: Certificate, units: Units) -> PaperPlan:
    """Panels, ridges, rims, bottoms of walls and cables from above, with the numbers of the tables.

    Raises
    ------
    OptionError : the plan does not fit a page at the smallest usual scale.
    """
    view = views.plan(surface, views.model_curves(surface), ())
    sheet = views.placed([view], "Plan", FORMAT, length_factor(units.length, "mm"), None)
    panels = [line for line in sheet.lines if line.layer == "PCMC-PANEL"]
    edges = [float(np.linalg.norm(line.points[1] - line.points[0])) for line in panels]
    drop = bool(edges) and float(np.mean(edges)) < LEAST_EDGE
    lines = [line for line in sheet.lines if not (drop and line.layer == "PCMC-PANEL")]
    low, _ = view.box
    drawn = [line.points for line in sheet.lines if line.layer not in ("PCMC-TEXT", "PCMC-PANEL")]
    factor = length_factor(units.length, "mm") / float(sheet.scale.removeprefix("1:"))
    shift = np.concatenate(drawn or [line.points for line in panels]).min(axis=0) - factor * low
    labels = _labels("J", certificate.junctions)
    labels += zip(certificate.supports["support"], certificate.supports[["x", "y"]].to_numpy(), strict=True)
    marks, texts = sheet.drawn()
    lines += marks[len(sheet.lines) :]
    places = [(name, (factor * at + shift).tolist()) for name, at in labels]
    texts += apart([Text((x, y), name, align="C") for name, (x, y) in places], texts)
    boxes = np.array([*(box(text) for text in texts), *(_extent(line) for line in lines)])
    corner, top = boxes[:, 0].min(axis=0) - AROUND, boxes[:, 1].max(axis=0) + AROUND
    width, height = map(float, top - corner)
    return PaperPlan(
        sheet.scale,
        [line._replace(points=line.points - corner) for line in lines],
        [text._replace(at=(text.at[0] - float(corner[0]), text.at[1] - float(corner[1]))) for text in texts],
        (width, height),
    )


def draw(plan: PaperPlan, canvas: Any, font: str) -> None:
    """Draw a plan on a canvas of reportlab, from its origin."""
    from reportlab.lib.colors import HexColor
    from reportlab.lib.units import mm

    canvas.setLineJoin(1)
    for line in plan.lines:
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
    for text in plan.texts:
        canvas.saveState()
        canvas.translate(text.at[0] * mm, text.at[1] * mm)
        canvas.rotate(text.turn)
        high, size = text.height * mm, text.height / CAPITAL * mm
        wide = canvas.stringWidth(text.text, font, size) + 0.4 * high
        canvas.setFillColor(HexColor("#FFFFFF"))
        canvas.rect(-0.5 * wide, -0.7 * high, wide, 1.4 * high, stroke=0, fill=1)
        canvas.setFillColor(HexColor(LABELS.get(text.text[0], "#000000")))
        canvas.setFont(font, size)
        canvas.drawCentredString(0.0, -0.5 * high, text.text)
        canvas.restoreState()


def _labels(letter: str, table: pd.DataFrame) -> list[tuple[str, Floats]]:
    """The number of each curve, and its middle in the plan."""
    if not len(table):
        return []
    middles = table[["middle_x", "middle_y"]].to_numpy()
    return [(f"{letter}{k}", at) for k, at in enumerate(middles, start=1)]


def _extent(line: Line) -> Floats:
    return np.array([line.points.min(axis=0), line.points.max(axis=0)])
