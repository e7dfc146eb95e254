"""The strokes of a drawing, .dxf or .3dm, and what its layers mean.

Drawings are read in a process of their own, with limits of time and memory. Arcs, circles, ellipses and
Bézier curves stay what they are; a NURBS curve becomes its spans, which are rational Bézier curves.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Floats
from ..base.errors import FileError, PlanError, unknown
from ..base.files import check_regular, system_error
from ..base.libraries import read_arrays, require
from ..base.tolerances import ON
from ..base.units import MICROMETRES, length_factor, unit_in_file
from ..base.validate import checked_name
from ..surface.curves import Curve
from ..surface.pieces import Piece, point_text

LIBRARIES = {".dxf": "ezdxf", ".3dm": "rhino3dm"}  # that read drawings, by suffix
READERS = {".dxf": "dxf_entities", ".3dm": "rhino_entities"}
LARGEST = 1e12  # of a coordinate; beyond, the digits of a double are too few for a roof
HIGHEST_DEGREE = 11  # of a NURBS curve, in Rhino


@dataclass(frozen=True, eq=False)
class Stroke:
    """An entity of a drawing: a curve, a point or a text."""

    layer: str  # its name in the drawing
    label: str  # what to look for in the drawing: kind and handle, such as "LINE 2F"
    curve: Curve | None = None
    point: Floats | None = None  # (3,) of a point or a text
    text: str | None = None


@dataclass(frozen=True, eq=False)
class Strokes:
    """The strokes of a drawing, its unit ("" for none), what no plan uses, by layer; a note on its unit."""

    unit: str
    strokes: Sequence[Stroke]
    others: Mapping[str, Mapping[str, int]]
    hidden: Mapping[str, int]
    note: str = ""


def read_strokes(path: Path, units: str = "") -> Strokes:
    """All strokes of a drawing, in ``units``, such as "m", or in its own unit.

    FileError for a file that is no drawing, damaged or too large; MissingExtra without the library.
    """
    check_regular(path)
    suffix = path.suffix.lower()
    if suffix not in LIBRARIES:
        text = f"{path}: {unknown('suffix of a drawing', suffix, LIBRARIES)}"
        raise FileError(text, what=str(path), found=suffix, expected=tuple(LIBRARIES))
    require(LIBRARIES[suffix], extra="cad")
    try:
        path.open("rb").close()
        contents = read_arrays("plan/reading_drawings.py", READERS[suffix], path)
        unit, note = unit_in_file(contents["unit"])
        factor = length_factor(unit, units)
        strokes = [stroke for entity in contents["entities"] for stroke in _strokes(entity, factor)]
    except OSError as error:
        raise system_error(path, "read", error) from None
    except FileError as error:
        raise error.in_file(path, what=str(path)) from None
    return Strokes(unit, strokes, contents["others"], contents["hidden"], note)


def _strokes(entity: Mapping[str, Any], factor: float) -> list[Stroke]:
    """The strokes of an entity, scaled: one, or several where its pieces do not follow each other."""
    label, layer = f"{entity['kind']} {entity['handle']}", entity["layer"]
    place = f"layer {layer!r}, {label}"
    if "point" in entity:
        text = entity.get("text")
        text = None if text is None else re.sub(r"\s+", " ", text).strip()[:200]
        point = factor * _coordinates([entity["point"]], layer, place)[0]
        return [Stroke(layer, label, point=point, text=text)]
    runs, before = list[list[Piece]](), np.zeros(3)
    for piece in (piece for raw in entity["pieces"] for piece in _pieces(raw, layer, place)):
        ends = piece.at(np.array([0.0, 1.0])) if piece.sweep else piece.points[[0, -1]]
        size = float(np.linalg.norm(piece.points, axis=1).max())
        if not piece.sweep and np.ptp(piece.points, axis=0).max() <= 1e-14 * size:
            continue  # a point drawn twice in a polyline
        if not runs or np.linalg.norm(before - ends[0]) > ON * (size + 1.0):
            runs.append([])
        runs[-1].append(replace(piece, points=factor * piece.points))
        before = ends[1]
    return [Stroke(layer, label, Curve(tuple(run))) for run in runs]


def _coordinates(points: Any, layer: str, place: str) -> Floats:
    """(k,3) the points, all of them numbers of a size that a roof may have."""
    P = np.array(points, dtype=np.float64).reshape(-1, 3)
    for found in P[~(np.abs(P) <= LARGEST).all(axis=1)].tolist():
        text = f"{place}: its point {found} is not a number up to {LARGEST:g}; draw it again"
        raise FileError(text, where=layer, found=found)
    return P


def _pieces(raw: tuple[Any, ...], layer: str, place: str) -> list[Piece]:
    kind, *values = raw
    if kind != "nurbs":
        return [Piece(_coordinates(values[0], layer, place), float(values[1]) if kind == "arc" else 0.0)]
    degree, knots, points, weights = values
    P, t = _coordinates(points, layer, place), np.array(knots, dtype=np.float64)
    w = np.ones(len(P)) if weights is None else np.array(weights, dtype=np.float64)
    sound = 1 <= degree <= HIGHEST_DEGREE and len(t) == len(P) + degree + 1 and len(w) == len(P) > degree
    if not sound or not np.isfinite(t).all() or (np.diff(t) < 0.0).any() or not (w > 0.0).all():
        text = f"{place}: its knots, weights and degree {degree} make no spline; draw it again"
        raise FileError(text, where=layer)
    spans = bezier_spans(degree, t, P, w)
    return [Piece(points, weights=None if weights is None else weight) for points, weight in spans]


def bezier_spans(degree: int, knots: Floats, points: Floats, weights: Floats) -> list[tuple[Floats, Floats]]:
    """Control points (degree + 1, d) and weights (degree + 1,) of each span of a NURBS curve.

    Control point i of the span [a, b] is the value of its blossom at degree - i times a and i times b
    (Ramshaw), by de Boor's algorithm.

    >>> square = np.array([[0.0, 0], [1, 2], [2, 0], [3, 2]])
    >>> spans = bezier_spans(2, np.array([0, 0, 0, 1, 2, 2, 2.0]), square, np.ones(4))
    >>> [points.tolist() for points, _ in spans]
    [[[0.0, 0.0], [1.0, 2.0], [1.5, 1.0]], [[1.5, 1.0], [2.0, 0.0], [3.0, 2.0]]]
    """
    control = np.column_stack([points * weights[:, None], weights])
    first = np.arange(degree, len(points))
    first = first[knots[first] < knots[first + 1]]  # the knots at which the spans begin
    ends = knots[first], knots[first + 1]
    values = []
    for i in range(degree + 1):
        d = control[first[:, None] + np.arange(-degree, 1)]
        for r in range(1, degree + 1):
            at = ends[r > degree - i]
            for k in range(degree, r - 1, -1):
                low, high = knots[k + first - degree], knots[k + 1 + first - r]
                share = ((at - low) / (high - low))[:, None]
                d[:, k] = (1.0 - share) * d[:, k - 1] + share * d[:, k]
        values.append(d[:, degree])
    homogeneous = np.stack(values, axis=1)
    weight = homogeneous[:, :, -1]
    return list(zip(homogeneous[:, :, :-1] / weight[:, :, None], weight, strict=True))


MEANINGS = {  # of the layers that a drawing of a plan may have
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
        text, problem = stroke.text or layer.name, ""
        name, equals, value = (part.strip() for part in text.partition("="))
        name = name or layer.name
        if not name:
            problem = "this patch has no name; write it as a text, or name the layer 'patch NAME'"
        elif equals and not re.fullmatch(NUMBER, value):
            problem = f"{value!r} in {text!r} is no tension; write a number, such as {name} = 4.5"
        if problem:
            raise _error(stroke, problem, text)
        checked_name(f"layer {stroke.layer!r}, {stroke.label}", name, error=PlanError)
        x, y, _ = stroke.point.tolist()
        labels.append(Label(name, (x, y), _value(value) if equals else None))
    return labels


def _value(text: str) -> float:
    """The number of a text, whose decimals follow a point or a comma."""
    return float(text.replace(",", "."))


def _error(stroke: Stroke, problem: str, found: str) -> PlanError:
    where, at = f"layer {stroke.layer!r}", "" if stroke.point is None else f" at {point_text(stroke.point)}"
    return PlanError(f"{where}, {stroke.label}{at}: {problem}", what=where, found=found)
