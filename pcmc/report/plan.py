"""The plan of a roof at a usual scale, with its overall size and the numbers of its curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.units import Units, length_factor
from ..certificate import Certificate
from ..certificate.supports import support_vertices
from ..drawings import views
from ..drawings.sheet import SheetLine, Text, box, length_decimals, place_labels
from ..surface import Surface
from ..surface.geometry import segment_lengths

FORMAT = "A4"
LEAST_EDGE = 1.2  # mm on paper: shorter edges of panels are not drawn
AROUND = 1.0  # mm kept free around what is drawn
OFF = 0.6  # of the longest edge: a point farther than this from all vertices of a curve is not on it


class PaperPlan(NamedTuple):
    """A plan on paper; lines and texts in mm from the lower left corner."""

    scale: str  # such as "1:200"
    lines: list[SheetLine]
    texts: list[Text]
    size: tuple[float, float]  # width and height, mm


def paper_plan(surface: Surface, certificate: Certificate, units: Units) -> PaperPlan:
    """Panels, ridges, rims, bottoms of walls and cables from above, with the numbers of the tables.

    OptionError if it does not fit a page at the smallest usual scale.
    """
    view = views.plan_view(surface, views.model_curves(surface), ())
    decimals = length_decimals(units.length, surface.size)
    sheet = views.placed([view], "Plan", FORMAT, length_factor(units.length, "mm"), None, decimals)
    panels = [line.points[1] - line.points[0] for line in sheet.lines if line.layer == "PCMC-PANEL"]
    drop = bool(panels) and float(np.linalg.norm(panels, axis=1).mean()) < LEAST_EDGE
    lines = [line for line in sheet.lines if not (drop and line.layer == "PCMC-PANEL")]
    marks, texts = sheet.drawn()
    lines += marks[len(sheet.lines) :]
    ((factor, shift),) = sheet.places
    supports, own = certificate.supports[["x", "y"]].to_numpy(), support_vertices(certificate.acting).items()
    marked = []
    if len(certificate.junctions):
        middles = certificate.junctions[["middle_x", "middle_y"]].to_numpy()
        curves = zip(certificate.acting.standing.topology.junctions, middles, strict=True)
        marked = [(f"J{k}", at, curve.vertices, "PCMC-RIDGE") for k, (curve, at) in enumerate(curves, 1)]
    marked += [(name, at, on, "PCMC-SUPPORT") for (name, on), at in zip(own, supports, strict=True)]
    places = [factor * _beside(surface, at, on) + shift for _, at, on, _ in marked]
    named = zip(marked, places, strict=True)
    labels = [Text(at, name, layer=layer, align="C") for (name, *_, layer), at in named]
    texts += place_labels(labels, texts, [line for line in lines if line.layer != "PCMC-PANEL"])
    return on_paper(sheet.scale, lines, texts)


def _beside(surface: Surface, middle: Floats, on: Ints) -> Floats:
    """The middle (2,) of a curve; of a closed one, whose middle is off it, the nearest of its vertices."""
    away = np.linalg.norm(surface.vertices[on, :2] - middle, axis=1)
    longest = segment_lengths(surface.vertices, surface.topology.sides).max()
    nearest = on[np.round(away / surface.size, 6).argmin()]  # of equal distances the first
    return surface.vertices[nearest, :2] if away.min() > OFF * longest else middle


def on_paper(scale: str, lines: Sequence[SheetLine], texts: Sequence[Text]) -> PaperPlan:
    """Lines and texts of a sheet with no paper around them."""
    boxes = np.array([*(box(text) for text in texts), *([p.min(axis=0), p.max(axis=0)] for p, *_ in lines)])
    corner, top = boxes[:, 0].min(axis=0) - AROUND, boxes[:, 1].max(axis=0) + AROUND
    width, height = map(float, top - corner)
    lines = [line._replace(points=line.points - corner) for line in lines]
    return PaperPlan(scale, lines, [text._replace(at=text.at - corner) for text in texts], (width, height))
