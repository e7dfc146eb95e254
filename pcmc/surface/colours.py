"""Colours that remain distinct with every kind of colour blindness."""

from __future__ import annotations

from itertools import cycle

import numpy as np

from ..base.arrays import Floats
from . import Surface

# Paul Tol's "light" scheme.
SHEETS = ("#77AADD", "#EE8866", "#44BB99", "#EEDD88", "#AAAA00")
# Paul Tol's "iridescent" scheme, from pale to dark.
PALE = ("#FEFBE9", "#F5F3C1", "#DDECBF", "#C2E3D2", "#A8D8DC", "#8DCBE4", "#7BBCE7", "#88A5DD", "#9B8AC4")
SCALE = (*PALE, "#9A709E", "#805770", "#46353A")
NO_VALUE = "#999999"
WALLS = ("#DDDDDD", "#99DDFF", "#BBCC33", "#FFAABB")


def rgb(color: str) -> Floats:
    """(3,) red, green, blue, 0..1, of "#RRGGBB".

    >>> rgb("#FF0033").tolist()
    [1.0, 0.0, 0.2]
    """
    return np.array([int(color[k : k + 2], 16) / 255.0 for k in (1, 3, 5)])


def patch_colors(surface: Surface) -> Floats:
    """(k,3) RGB: one palette for the roof, another for walls."""
    sheets, walls = cycle(SHEETS), cycle(WALLS)
    return np.array([rgb(next(walls if wall else sheets)) for wall in surface.walls])


def scalar_colors(values: Floats) -> tuple[Floats, float, float]:
    """(n,3) RGB of numbers (n,), pale for the least to dark for the largest, and these two numbers.

    NaN is grey. If all numbers are equal, they have the middle colour.

    >>> colors, least, most = scalar_colors(np.array([3.0, 1.0, np.nan]))
    >>> (255 * colors).round().astype(int).tolist(), least, most
    ([[70, 53, 58], [254, 251, 233], [153, 153, 153]], 1.0, 3.0)
    """
    known = np.isfinite(values)
    least, most = (float(f(values[known])) if known.any() else 0.0 for f in (np.min, np.max))
    place = np.full(len(values), 0.5)
    if most > least:
        place = (values - least) / (most - least)
    scale = np.array([rgb(color) for color in SCALE])
    at = np.linspace(0.0, 1.0, len(scale))
    colors = np.column_stack([np.interp(place, at, channel) for channel in scale.T])
    return np.where(known[:, None], colors, rgb(NO_VALUE)), least, most


def linear(colors: Floats) -> Floats:
    """Linear red, green, blue of sRGB: proportional to light, as glTF has colours.

    >>> linear(np.array([0.0, 0.5, 1.0])).round(4).tolist()
    [0.0, 0.214, 1.0]
    """
    return np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
