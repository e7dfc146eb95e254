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
from ..drawings.sheet import LAYERS, SMALL, WIDTH, Line, Text
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
    texts = sheet.texts + _apart([(name, factor * at + shift) for name, at in labels], sheet.texts)
    boxes = np.array([*(_box(text) for text in texts), *(_extent(line) for line in lines)])
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


def _apart(labels: list[tuple[str, Floats]], others: list[Text]) -> list[Text]:
    """Labels at or beside their places, so that none covers another."""
    boxes, placed = [_box(text) for text in others], []
    steps = [(x, y) for r in range(6) for x in range(-r, r + 1) for y in range(-r, r + 1)]
    steps.sort(key=lambda step: step[0] ** 2 + step[1] ** 2)
    for name, at in labels:
        tries = []
        for x, y in steps:
            place = at + np.array([0.8 * x, 0.8 * y]) * SMALL
            tries.append(Text((float(place[0]), float(place[1])), name, align="C"))
        free = (text for text in tries if not any(_meet(_box(text), box) for box in boxes))
        text = next(free, tries[0])
        placed.append(text)
        boxes.append(_box(text))
    return placed


def _box(text: Text) -> Floats:
    """(2,2) lower and upper corner of a text that is centred at its place."""
    half = np.array([0.5 * WIDTH * len(text.text) + 0.3, 0.75]) * text.height
    half = half[::-1] if text.turn == 90.0 else half
    return np.array([text.at - half, text.at + half])


def _extent(line: Line) -> Floats:
    return np.array([line.points.min(axis=0), line.points.max(axis=0)])


def _meet(one: Floats, other: Floats) -> bool:
    return bool((one[0] < other[1]).all() and (other[0] < one[1]).all())
