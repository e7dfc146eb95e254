"""The catenary of a sheet that hangs under its own weight."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from pcmc.base.arrays import Floats
from pcmc.base.errors import OptionError

FOLD = 1.1996786402577338  # a/c at which c cosh(a/c) is least


def catenary(span: float, ratio: float) -> Callable[[Floats], Floats]:
    """z(x) = c cosh(x/c) - α/w with z = 0 at x = ± span/2: the flatter of the two, which is stable.

    So hangs a long barrel of tension α and weight w (``barrel``): a chain that pulls α + w z at height z.

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
