"""Orders of convergence fitted to errors, with their standard errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import curve_fit

from pcmc.base.arrays import Floats


@dataclass(frozen=True)
class Order:
    """A fitted order.

    Attributes
    ----------
    order : p of error = C h^p.
    standard_error : of p, by least squares.
    points : how many refinements it rests on.
    limit : what the quantity comes to; NaN where errors were given.
    """

    order: float
    standard_error: float
    points: int
    limit: float = float("nan")

    def row(self) -> dict[str, float]:
        """For a table."""
        return {
            "order": self.order,
            "standard_error": self.standard_error,
            "points": self.points,
            "limit": self.limit,
        }


UNKNOWN = Order(float("nan"), float("nan"), 0)


def slope(h: Floats, error: Floats) -> Order:
    """Slope of log error over log h, through the errors that are positive.

    >>> h = np.array([1.0, 0.5, 0.25])
    >>> found = slope(h, 3.0 * h**2)
    >>> round(found.order, 12), round(found.standard_error, 6)
    (2.0, 0.0)
    """
    good = np.isfinite(error) & (error > 0.0)
    if good.sum() < 3:
        return UNKNOWN
    from scipy.stats import linregress  # here, as it takes a third of a second that few runs need

    line = linregress(np.log(h[good]), np.log(error[good]))
    return Order(float(line.slope), float(line.stderr), int(good.sum()))


def limit_order(h: Floats, values: Floats) -> Order:
    """p, and the limit Q of Q + C h^p, by least squares (Richardson).

    Deviations count relative to h², so that coarse meshes, where higher terms enter, do not rule
    the fit.

    >>> h = 0.5 ** np.arange(5)
    >>> found = limit_order(h, 7.0 - 3.0 * h**2)
    >>> round(found.order, 6), round(found.limit, 6)
    (2.0, 7.0)
    """
    good = np.isfinite(values)
    h, values = h[good] / h[good].max(), values[good]
    if len(h) < 4:
        return UNKNOWN
    spread = float(np.ptp(values)) or 1.0

    def model(h: Floats, p: float, limit: float, factor: float) -> Floats:
        return np.asarray(limit + factor * h**p)

    guess = [2.0, values[-1] / spread, (values[0] - values[-1]) / spread]
    try:
        found, covariance = curve_fit(
            model, h, values / spread, guess, sigma=h**2, maxfev=20_000, xtol=1e-14, ftol=1e-14
        )
    except RuntimeError:  # no least within so many evaluations: the values follow no such law
        return UNKNOWN
    error = float(np.sqrt(covariance[0, 0]))
    return Order(float(found[0]), error, len(h), float(found[1]) * spread)


def richardson(values: Floats, orders: Sequence[float]) -> float:
    """The limit of values on meshes each twice as fine as the last, their error a sum of C h^p.

    The first of the orders p is removed from each two neighbours, then the second, and so on.

    >>> h = 0.5 ** np.arange(3.0)
    >>> round(richardson(1.0 + h**2 - 3.0 * h**4, (2, 4)), 12)
    1.0
    """
    for order in orders:
        values = values[1:] + (values[1:] - values[:-1]) / (2.0**order - 1.0)
    return float(values[-1])
