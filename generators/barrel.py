"""A long barrel that hangs under its own weight between two parallel supports: a catenary."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from pcmc import Patch, Surface
from pcmc.base import validate
from pcmc.base.arrays import Floats
from pcmc.base.errors import OptionError

from .grid import grid_faces

FOLD = 1.1996786402577338  # a/c at which c cosh(a/c) is least


def hanging_barrel(
    squares: int = 8, *, span: float = 2.0, length: float = 1.0, tension: float = 2.0, weight: float = 1.0
) -> Surface:
    """A barrel between supports on Π at x = ± span/2, its ends held in the exact shape, starting flat.

    Its shape is z + α/w = c cosh(x/c): the catenary of a chain that pulls α + w z where it is at height z.

    Parameters
    ----------
    squares : across the span.
    span, length : of the barrel.
    tension, weight : α and w of the patch "barrel".

    >>> hanging_barrel(4).m
    16
    """
    squares = validate.integer("squares", squares, least=2)
    rows = max(1, round(squares * length / span))
    shape = catenary(span, tension / weight)
    x, y = np.meshgrid(
        np.linspace(-0.5, 0.5, squares + 1) * span, np.linspace(0.0, length, rows + 1), indexing="ij"
    )
    ends = (y == 0.0) | (y == length)
    z = np.where(ends, shape(x), 0.0)
    held = ends | (np.abs(x) == 0.5 * span)
    X = np.stack([x, y, z], axis=2).reshape(-1, 3)
    patch = [Patch("barrel", tension, 0.0, weight=weight)]
    return Surface(X, grid_faces(squares, rows), np.zeros(2 * squares * rows, dtype=int), patch, held.ravel())


def catenary(span: float, ratio: float) -> Callable[[Floats], Floats]:
    """z(x) = c cosh(x/c) - α/w with z = 0 at x = ± span/2: the flatter of the two, which is stable.

    ``ratio`` is α/w; the span is at most 1.3255 of it.

    >>> z = catenary(2.0, 2.0)
    >>> round(float(z(0.0)), 6), bool(abs(z(1.0)) < 1e-12)
    (-0.303324, True)
    """
    half = 0.5 * span
    if half * np.cosh(FOLD) / FOLD > ratio:
        widest = 2.0 * ratio * FOLD / np.cosh(FOLD)
        message = f"no catenary spans {span:g} at α/w = {ratio:g}; at most {widest:g}"
        raise OptionError(message, what="span", found=span, expected=widest)
    c = brentq(lambda c: c * np.cosh(half / c) - ratio, half / FOLD, 2.0 * ratio, xtol=1e-15)
    return lambda x: c * np.cosh(np.asarray(x) / c) - ratio
