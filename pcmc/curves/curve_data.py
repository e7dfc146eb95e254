"""Curves as plain data, as a project file holds them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..base.arrays import Floats
from .curves import Curve
from .pieces import Piece

DIGITS = 12  # of the coordinates, counted from the size of the curve
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
