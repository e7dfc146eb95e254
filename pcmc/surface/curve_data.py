"""Curves as plain data, as a project file holds them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import OptionError, unknown
from ..base.validate import LARGEST
from .curves import Curve, arc, bezier, checked_points, circle, curve_error, ellipse, join, polyline
from .pieces import Piece

CURVES = ("polyline", "bezier", "arc", "circle", "ellipse")  # the keys that make a table a curve
DIGITS = 12  # of the coordinates, counted from the size of the curve
MOST = 1000  # control points of a piece in a file
ROUND = 1e-9  # of its radius: an arc of an ellipse this near to a circle is one


def curve(spec: Any, closed: bool = False) -> Curve:
    """A curve from plain data, as a project file holds it.

    Parameters
    ----------
    spec : a Curve; a list of points; a mapping with one of ``polyline``, ``bezier`` (also with
        ``weights``), ``arc`` (three points), ``circle`` (``{"centre": …, "radius": …}``) or ``ellipse``
        (``{"centre": …, "axes": …, "sweep": …}``); or a list of such mappings, joined.
    closed : whether a list of points is to be closed.

    >>> curve({"circle": {"centre": [0, 0], "radius": 1.0}}).closed
    True
    >>> curve([{"polyline": [[0, 0], [2, 0]]}, {"arc": [[2, 0], [1, 1], [0, 0]]}]).closed
    True
    """
    if isinstance(spec, Curve):
        return spec
    if isinstance(spec, Sequence) and spec and isinstance(spec[0], Mapping | Curve):
        return join(*(curve(part) for part in spec))
    if not isinstance(spec, Mapping):
        return polyline(spec, closed=closed)
    besides = {"closed": "polyline", "weights": "bezier"}
    kinds = [key for key in spec if key not in besides]
    if "join" in kinds:
        problem = "a curve of several pieces is a list of them, without join: [{polyline = ...}, {arc = ...}]"
        raise OptionError(problem, what="curve", found=list(spec), expected=CURVES)
    for key in kinds:
        if key in ("centre", "radius", "axes", "sweep"):
            text = f"{key} stands in the table of its curve: {{circle = {{centre = [5, 3], radius = 1}}}}"
            raise OptionError(text, what=key, found=spec[key])
        validate.choice("curve", key, CURVES)
    if len(kinds) != 1:
        problem = f"a curve needs exactly one of {', '.join(CURVES)}; found {list(spec)}"
        raise OptionError(problem, what="curve", found=list(spec), expected=CURVES)
    (kind,) = kinds
    value = spec[kind]
    if kind == "polyline" and "weights" not in spec:
        return polyline(value, closed=bool(spec.get("closed", False)))
    for key, owner in besides.items():
        if key in spec and kind != owner:
            problem = f"only a {owner} has the key {key}"
            if key == "closed":
                problem += "; other curves are closed if they end at their start"
            raise OptionError(problem, what=key)
    if kind == "bezier":
        return bezier(value, spec.get("weights"))
    if kind == "arc":
        return arc(*checked_points(value, "arc", 3, exactly=True))
    needed = {"centre", "radius" if kind == "circle" else "axes"}
    allowed = needed if kind == "circle" else needed | {"sweep"}
    for key in value if isinstance(value, Mapping) else ():
        if key not in allowed:
            raise curve_error(kind, unknown("key", key, sorted(allowed)), where=key)
    if not isinstance(value, Mapping) or not needed <= set(value):
        wanted = "centre and radius" if kind == "circle" else "centre, axes and perhaps sweep"
        raise curve_error(kind, f"expected {wanted}, found {value!r}", found=value)
    return circle(**value) if kind == "circle" else ellipse(**value)


def curve_data(curve: Curve) -> Any:
    """What ``curve`` makes the same curve from: points, a table, or a list of tables.

    >>> from .curves import arc, join, polyline
    >>> curve_data(polyline([[0, 0], [4, 0], [4, 3]]))
    [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]]
    >>> curve_data(join(arc([2, 0], [0, 2], [-2, 0]), polyline([[-2, 0], [2, 0]])))[1]
    {'polyline': [[-2.0, 0.0], [2.0, 0.0]]}
    """
    size = float(np.ptp(curve.at(curve.dense), axis=0).max())
    decimals = DIGITS - math.ceil(math.log10(size))
    parts: list[Any] = []
    for straight, run in groupby(curve.pieces, lambda piece: not piece.sweep and len(piece.points) == 2):
        pieces = list(run)
        if straight:
            corners = np.array([pieces[0].points[0], *(piece.points[1] for piece in pieces)])
            parts.append({"polyline": _rounded(corners, decimals)})
        else:
            parts += [_table(piece, decimals) for piece in pieces]
    if len(parts) > 1 or "polyline" not in parts[0]:
        return parts[0] if len(parts) == 1 else parts
    line = parts[0]["polyline"]
    return {"polyline": line[:-1], "closed": True} if curve.closed else line


def exact_data(curve: Curve) -> list[Any]:
    """Points, sweep and weights of each piece, to the last digit: what ``exact_curve`` makes it from."""
    return [
        [piece.points.tolist(), piece.sweep, None if piece.weights is None else piece.weights.tolist()]
        for piece in curve.pieces
    ]


def exact_curve(rows: Any) -> Curve:
    """The curve in space of such data, which may come from any file; ValueError if it is none.

    >>> from .curves import arc
    >>> half = arc([2, 0, 1], [0, 2, 1], [-2, 0, 1])
    >>> exact_data(exact_curve(exact_data(half))) == exact_data(half)
    True
    """
    pieces = list[Piece]()
    for points, sweep, weights in rows:
        P, angle = np.array(points, dtype=float), float(sweep)
        W = None if weights is None else np.array(weights, dtype=float)
        fits = P.ndim == 2 and P.shape[1] == 3 and 2 <= len(P) <= MOST and bool((np.abs(P) <= LARGEST).all())
        fits &= angle == 0.0 or (len(P) == 3 and W is None and abs(angle) <= 2.0 * math.pi + ROUND)
        fits &= W is None or (W.shape == P.shape[:1] and bool(((W > 0.0) & (W <= LARGEST)).all()))
        if not fits:
            raise ValueError(f"piece {len(pieces)} is none")
        pieces.append(Piece(P, angle, W))
    made = Curve(tuple(pieces))
    starts, ends = (np.array([piece.at(np.array([t]))[0] for piece in pieces]) for t in (0.0, 1.0))
    gaps = np.linalg.norm(starts[1:] - ends[:-1], axis=1)
    if (gaps > ROUND * made.length).any() or not made.length > 0.0:
        raise ValueError("its pieces do not meet")
    return made


def _rounded(points: Floats, decimals: int) -> list[Any]:
    rounded: list[Any] = (np.round(points, decimals) + 0.0).tolist()  # no negative zeros
    return rounded


def _table(piece: Piece, decimals: int) -> dict[str, Any]:
    """A Bézier curve, circle, arc or ellipse."""
    if not piece.sweep:
        weights = {} if piece.weights is None else {"weights": [float(f"{w:.15g}") for w in piece.weights]}
        return {"bezier": _rounded(piece.points, decimals)} | weights
    centre, u, v = piece.points
    radius = float(np.linalg.norm(u))
    circular = abs(float(np.linalg.norm(v)) - radius) + abs(u @ v) / radius <= ROUND * radius
    whole = abs(piece.sweep) >= 2.0 * math.pi - 1e-12
    if circular and not whole:
        return {"arc": _rounded(piece.at(np.array([0.0, 0.5, 1.0])), decimals)}
    if circular and (len(centre) == 2 or abs(u[2]) + abs(v[2]) <= ROUND * radius):
        return {"circle": {"centre": _rounded(centre, decimals), "radius": round(radius, decimals)}}
    axes = {"centre": _rounded(centre, decimals), "axes": _rounded(np.stack([u, v]), decimals)}
    return {"ellipse": axes if whole else axes | {"sweep": float(f"{math.degrees(piece.sweep):.15g}")}}
