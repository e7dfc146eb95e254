"""Orders of convergence fitted to errors, with their standard errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import linregress

from pcmc.arrays import Floats


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
        return {"order": self.order, "standard_error": self.standard_error, "points": self.points,
                "limit": self.limit}  # fmt: skip


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
    line = linregress(np.log(h[good]), np.log(error[good]))
    return Order(float(line.slope), float(line.stderr), int(good.sum()))


def limit_order(h: Floats, values: Floats) -> Order:
    """p, and the limit Q of Q + C h^p, by least squares on relative steps (Richardson).

    Values weigh by h^-2, so that coarse meshes, where higher terms count, do not rule the fit.

    >>> h = 0.5 ** np.arange(5)
    >>> found = limit_order(h, 7.0 - 3.0 * h**2)
    >>> round(found.order, 6), round(found.limit, 6)
    (2.0, 7.0)
    """
    good = np.isfinite(values)
    h, values = h[good] / h[good].max(), values[good]
    if len(h) < 4:
        return UNKNOWN
    weight = h**-2

    def parts(p: float) -> tuple[Floats, Floats]:
        design = np.column_stack([np.ones_like(h), h**p]) * weight[:, None]
        found: Floats = np.asarray(np.linalg.lstsq(design, values * weight, rcond=None)[0], float)
        return found, design @ found - values * weight

    spread = max(float(np.ptp(values)), 1e-300)

    def misfit(p: Floats) -> Floats:
        return parts(float(p[0]))[1] / spread

    fit = least_squares(misfit, [2.0], bounds=(0.05, 6.0))
    limit, factor = parts(float(fit.x[0]))[0]
    # of all three parameters, p's share of the covariance
    p = float(fit.x[0])
    jacobian = np.column_stack([np.ones_like(h), h**p, factor * h**p * np.log(h)]) * weight[:, None]
    scatter = parts(p)[1]
    variance = float(scatter @ scatter) / (len(h) - 3)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * variance
    return Order(p, float(np.sqrt(covariance[2, 2])), len(h), float(limit))
