"""Colours that remain distinct with every kind of colour blindness."""

from __future__ import annotations

from itertools import cycle

import numpy as np

from ..base.arrays import Floats
from . import Surface

# Paul Tol's "light" scheme.
SHEETS = ("#77AADD", "#EE8866", "#44BB99", "#EEDD88", "#AAAA00")
WALLS = ("#DDDDDD", "#99DDFF", "#BBCC33", "#FFAABB")


def rgb(color: str) -> Floats:
    """(3,) red, green, blue, 0..1, of "#RRGGBB".

    >>> rgb("#FF0033").tolist()
    [1.0, 0.0, 0.2]
    """
    return np.array([int(color[k : k + 2], 16) / 255.0 for k in (1, 3, 5)])


def patch_colors(surface: Surface) -> Floats:
    """(k,3) RGB: one palette for sheets under pressure, another for walls."""
    sheets, walls = cycle(SHEETS), cycle(WALLS)
    return np.array([rgb(next(walls if wall else sheets)) for wall in surface.walls])
