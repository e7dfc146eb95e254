"""Curves as plain data, as a project file holds them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..base.arrays import Floats
from ..base.validate import LARGEST
from .curves import Curve
from .pieces import Piece

DIGITS = 12  # of the coordinates, counted from the size of the curve
MOST = 1000  # control points of a piece in a file
ROUND = 1e-9  # of its radius: an arc of an ellipse this near to a circle is one


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
    line: list[Any] = []
    for piece in curve.pieces:
        straight = not piece.sweep and len(piece.points) == 2
        if straight:
            ends = _rounded(piece.points, decimals)
            line = line or [ends[0]]
            line.append(ends[1])
        if line and not straight:
            parts.append({"polyline": line})
            line = []
        if not straight:
            parts.append(_table(piece, decimals))
    if line and not parts:
        return {"polyline": line[:-1], "closed": True} if curve.closed else line
    parts += [{"polyline": line}] if line else []
    return parts[0] if len(parts) == 1 else parts


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
    curve = Curve(tuple(pieces))
    starts, ends = (np.array([piece.at(np.array([t]))[0] for piece in pieces]) for t in (0.0, 1.0))
    if (
        np.linalg.norm(starts[1:] - ends[:-1], axis=1) > ROUND * curve.length
    ).any() or not curve.length > 0.0:
        raise ValueError("its pieces do not meet")
    return curve


def _rounded(points: Floats, decimals: int) -> list[Any]:
    rounded: list[Any] = (np.round(points, decimals) + 0.0).tolist()  # no negative zeros
    return rounded


def _table(piece: Piece, decimals: int) -> dict[str, Any]:
    """A Bézier curve, circle, arc or ellipse."""
    if not piece.sweep:
        table: dict[str, Any] = {"bezier": _rounded(piece.points, decimals)}
        if piece.weights is not None:
            table["weights"] = [float(f"{w:.15g}") for w in piece.weights]
        return table
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
