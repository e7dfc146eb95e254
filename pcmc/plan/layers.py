"""What the layers of a drawing mean, and the texts and points on those for heights and names."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from ..base.arrays import Floats
from ..base.errors import PlanError
from ..base.units import MICROMETRES, length_factor
from ..base.validate import checked_name
from ..surface.pieces import point_text
from .strokes import Stroke

MEANINGS = {
    "outline": "the closed edge of the roof",
    "divider NAME": "a line between patches; a wall stands below it",
    "hole NAME": "a closed edge of an opening, held at its height",
    "upright NAME": "a straight divider whose wall stands upright",
    "cable NAME": "a cable along a free edge, or across the roof",
    "free": "a part of an edge that nothing holds; it gets a cable",
    "mirror": "straight edges at which the roof goes on as its mirror image",
    "support": "points and curves that hold the roof where they are drawn",
    "mast NAME": "a point or a vertical line whose top holds the roof, or a closed ring",
    "height": "points through which the roof should pass, or texts such as 4.5",
    "patch NAME": "a point or a text inside a part of the plan: its name, or its name = its tension",
}
"""The layers that a drawing of a plan may have."""

ROLES = tuple(key.split()[0] for key in MEANINGS)
UNDERSTOOD = ", ".join(MEANINGS)
NUMBER = r"\d+(?:[.,]\d+)?"
_NAME = re.compile(rf"({'|'.join(ROLES)})(?:e?s|\d+)?(?:[\s_:.=-]+(.*))?", re.I | re.S)
_HEIGHT = re.compile(rf"\D*?([-+]?{NUMBER})\s*({'|'.join(MICROMETRES)})?")


@dataclass(frozen=True)
class Layer:
    """A layer's role, one of ``ROLES``, and the name that follows it, or ""."""

    role: str
    name: str = ""


def layer_of(name: str) -> Layer | None:
    """The role of a layer; None for one that means nothing here. Case does not count in the role.

    >>> layer_of("DIVIDER-north wall"), layer_of("Holes"), layer_of("furniture")
    (Layer(role='divider', name='north wall'), Layer(role='hole', name=''), None)
    """
    own = re.split(r"::|\||\$\d+\$", name)[-1].strip()  # of nested layers, or of one bound from outside
    match = _NAME.fullmatch(own)
    return None if match is None else Layer(match[1].lower(), (match[2] or "").strip())


def left_out(layers: Mapping[str, int]) -> str:
    """A sentence on layers that mean nothing here, with the role that each may be a misspelling of."""
    parts = []
    for name, count in list(layers.items())[:12]:
        near = get_close_matches(re.split(r"[\s_:.-]+", name.strip().lower())[0], ROLES, n=1, cutoff=0.75)
        hint = f", did you mean {near[0]!r}?" if near else ""
        parts.append(f"{name!r} ({count} {'entity' if count == 1 else 'entities'}{hint})")
    more = f" and {len(layers) - 12} more" if len(layers) > 12 else ""
    return f"layers left out: {', '.join(parts)}{more}; understood are {UNDERSTOOD}"


@dataclass(frozen=True)
class Label:
    """The name of a part of the plan, a point (x, y) inside it, and its tension, if the drawing has one."""

    name: str
    point: tuple[float, float]
    tension: float | None = None


def heights_of(strokes: Sequence[Stroke], drawn: str, units: str) -> Floats:
    """(h,3) points of layers "height", in ``units``; a text gives the height where it stands, in
    the unit ``drawn`` or its own."""
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
    for layer, stroke in ((layer, stroke) for layer, strokes in layers for stroke in strokes):
        if stroke.point is None:
            continue
        text = stroke.text or layer.name
        name, equals, value = (part.strip() for part in text.partition("="))
        name = name or layer.name
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
