"""Cubic Bézier curves in space, cut into edges of equal length in plan."""

from __future__ import annotations

import numpy as np

from pcmc.base.arrays import Floats

_SAMPLES = 2001  # per curve, to measure its length: relative error below 1e-6


def cubic(controls: Floats, t: Floats) -> Floats:
    """(k,3) points at parameters t (k,) of the curve with four control points (4,3).

    >>> line = np.outer(np.arange(4), [1.0, 0.0, 2.0])
    >>> cubic(line, np.array([0.0, 0.5])).tolist()
    [[0.0, 0.0, 0.0], [1.5, 0.0, 3.0]]
    """
    s = 1.0 - t
    weights = np.stack([s**3, 3.0 * s**2 * t, 3.0 * s * t**2, t**3], axis=-1)
    return weights @ np.asarray(controls, dtype=float)


def equally_spaced(controls: Floats, edge_length: float) -> Floats:
    """(k,3) points of a curve from end to end, at equal distances along its plan.

    >>> line = np.outer(np.arange(4), [1.0, 0.0, 2.0])
    >>> equally_spaced(line, 1.0)[:, 0].round(9).tolist()
    [0.0, 1.0, 2.0, 3.0]
    """
    t = np.linspace(0.0, 1.0, _SAMPLES)
    steps = np.linalg.norm(np.diff(cubic(controls, t)[:, :2], axis=0), axis=1)
    length = np.append(0.0, np.cumsum(steps))
    segments = max(1, round(length[-1] / edge_length))
    return cubic(controls, np.interp(np.linspace(0.0, length[-1], segments + 1), length, t))


def chain(knots_and_controls: Floats, edge_length: float) -> Floats:
    """(k,3) points of consecutive cubics (3c + 1, 3) that share their ends; every knot is a point.

    >>> line = np.outer(np.arange(7), [1.0, 0.0, 2.0])
    >>> len(chain(line, 1.5))
    5
    """
    controls = np.asarray(knots_and_controls, dtype=float)
    pieces = [
        equally_spaced(controls[i : i + 4], edge_length) for i in range(0, len(controls) - 1, 3)
    ]
    return np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])
