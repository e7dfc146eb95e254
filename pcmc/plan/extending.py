"""Dividers whose ends just miss the lines that they should reach, extended to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..base.arrays import Floats
from .curves import Curve
from .lines import Kind, Line
from .paths import bent


def extended(
    dividers: Mapping[str, Curve], edges: Sequence[Curve], tolerance: float
) -> tuple[dict[str, Curve], str]:
    """The dividers with each end that is within ``tolerance`` of another line moved onto it, and a note.

    Only the course in plan counts.
    """
    lines = {name: Line(f"divider {name!r}", Kind.DIVIDER, curve) for name, curve in dividers.items()}
    others = [Line("an edge", Kind.OUTLINE, edge) for edge in edges if np.ptp(edge.at(edge.dense)[:, :2])]
    result: dict[str, Curve] = {}
    largest = 0.0
    moved = 0
    for name, curve in dividers.items():
        steps = np.zeros((2, 3))
        for end in () if curve.closed else (0, 1):
            point = curve.at([float(end * len(curve.pieces))])[0, :2]
            near = [line for key, line in lines.items() if key != name and np.ptp(line.xy, axis=0).any()]
            found = [(line, *line.nearest(point[None])) for line in (*others, *near)]
            line, t, gap = min(((line, t[0], gap[0]) for line, t, gap in found), key=lambda entry: entry[2])
            if 1e-9 * tolerance < gap <= tolerance:
                steps[end, :2] = line.curve.at([t])[0, :2] - point
                largest, moved = max(largest, gap), moved + 1
        result[name] = _with_ends(curve, steps)
    note = (
        f"{moved} ends of dividers moved by up to {largest:.3g} to the lines that they meet" if moved else ""
    )
    return result, note


def _with_ends(curve: Curve, steps: Floats) -> Curve:
    """The curve with its two ends moved by these vectors."""
    pieces = list(curve.pieces)
    pieces[0] = bent(pieces[0], steps[0], np.zeros(3))
    pieces[-1] = bent(pieces[-1], np.zeros(3), steps[1])
    return replace(curve, pieces=tuple(pieces))
