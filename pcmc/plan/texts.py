"""Texts and points of a drawing that stand for heights, and for the names of parts of the plan."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Floats
from ..base.errors import PlanError
from ..base.units import MICROMETRES, length_factor
from ..base.validate import checked_name
from ..curves.pieces import point_text
from .layers import Layer
from .strokes import Stroke

NUMBER = r"\d+(?:[.,]\d+)?"
_HEIGHT = re.compile(rf"\D*?([-+]?{NUMBER})\s*({'|'.join(MICROMETRES)})?")


@dataclass(frozen=True)
class Label:
    """The name of a part of the plan, a point (x, y) inside it, and its tension, if the drawing has one."""

    name: str
    point: tuple[float, float]
    tension: float | None = None


def heights_of(strokes: Sequence[Stroke], drawn: str, units: str) -> Floats:
    """(h,3) points of layers "height"; a text that is a number gives the height where it stands.

    The number has the unit ``drawn`` of the drawing, or that written after it, and becomes one of ``units``.
    """
    points = []
    for stroke in strokes:
        if stroke.point is None:
            continue
        x, y, z = stroke.point.tolist()
        if stroke.text:
            number = _HEIGHT.fullmatch(stroke.text)
            if number is None or (number[2] and not units):
                wrong = "is no number" if number is None else "has a unit, but the drawing has none"
                raise _error(stroke, f"{stroke.text!r} {wrong}; write the height, such as 4.5", stroke.text)
            z = _value(number[1]) * length_factor(number[2] or drawn, units)
        points.append([x, y, z])
    return np.array(points, dtype=float).reshape(-1, 3)


def labels_of(layers: Sequence[tuple[Layer, Sequence[Stroke]]]) -> list[Label]:
    """The names of parts: of their layers, or texts such as "nave" and "nave = 4,5"."""
    labels = []
    for layer, strokes in layers:
        for stroke in strokes:
            if stroke.point is None:
                continue
            text = stroke.text or layer.name
            name, equals, value = text.partition("=")
            name, value = name.strip() or layer.name, value.strip()
            if not name:
                problem = "this patch has no name; write it as a text, or name the layer 'patch NAME'"
                raise _error(stroke, problem, text)
            if equals and not re.fullmatch(NUMBER, value):
                problem = f"{value!r} in {text!r} is no tension; write a number, such as {name} = 4.5"
                raise _error(stroke, problem, text)
            checked_name(f"layer {stroke.layer!r}, {stroke.label}", name, error=PlanError)
            x, y, _ = stroke.point.tolist()
            labels.append(Label(name, (x, y), _value(value) if equals else None))
    return labels


def _value(text: str) -> float:
    """The number of a text, whose decimals follow a point or a comma."""
    return float(text.replace(",", "."))


def _error(stroke: Stroke, problem: str, found: str) -> PlanError:
    where = f"layer {stroke.layer!r}"
    at = "" if stroke.point is None else f" at {point_text(stroke.point)}"
    return PlanError(f"{where}, {stroke.label}{at}: {problem}", what=where, found=found)
