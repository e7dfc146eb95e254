"""Error bars from nested meshes: pure arithmetic over the values of a quantity on each mesh.

With q_0, q_1, … on meshes of edge lengths h, h/2, …, where q_k = q + C (h/2^k)^p + …, the last three
values give the observed order and the limit (Richardson, Aitken):

    d_1 = q_1 - q_0,   d_2 = q_2 - q_1,   p = log2(d_1 / d_2),   q ≈ q_2 + d_2 / (2^p - 1)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base.arrays import Bools, Floats

USUAL = 2.0  # order of smooth surfaces on triangles
LOWEST, HIGHEST = 0.25, 4.0  # orders between which the observed one is used
SAFETY = 2.0  # times the distance of two extrapolations
UNSETTLED = 1.5  # order of the surface's own moves up to which quantities are not believed more
FAST = 2.5  # an order above is a coincidence: on triangles no error shrinks so fast for long
LEAST = 0.05  # of the last correction: least uncertainty of the limit, as equal orders may be a coincidence


class Extrapolation(NamedTuple):
    """Limits (q,) of quantities, and their bars."""

    limit: Floats  # the extrapolated value; NaN where the values come to no limit
    error: Floats  # how far the limit may be from the value on the first mesh; infinite without a limit
    limit_error: Floats  # bar of ``limit``
    order: Floats  # observed p; NaN where the values are equal to rounding, or swing


def extrapolate(
    estimates: Floats,
    rounding: Floats,
    value: Floats | None = None,
    *,
    shape_order: float = USUAL,
    doubt: Floats | float = 0.0,
) -> Extrapolation:
    """Limits and error bars of quantities from their values on nested meshes.

    ======================================  =========================  ======================================
    the last two differences d_1, d_2       limit                      its bar
    ======================================  =========================  ======================================
    both at most ``rounding``               q_2                        ``rounding``
    1.19 ≤ d_1 / d_2 ≤ 16                   q_2 + d_2 / (d_1/d_2 - 1)  2 × its distance from what order 2, and
                                                                       the shape's order, would give; at least
                                                                       0.05 |d_2|, and |d_1| / 12 for
                                                                       d_1 / d_2 > 5.7
    d_1 / d_2 > 16, or a small d_2 of the   q_2 + d_2 / 3              the larger of 2 |d_2| and |d_1| / 12,
    other sign: they swing                                             what order 2 leaves of d_1
    else: no limit in sight                 NaN                        infinite
    only one difference: two meshes         q_1 + d_1 / 3              |d_1|
    only one mesh                           NaN                        infinite
    ======================================  =========================  ======================================

    The bar of the value is its distance from the limit plus the limit's bar. Bars are estimates, not bounds:
    three values cannot show what shrinks more slowly than all that is seen.

    Parameters
    ----------
    estimates : (meshes,q).
    rounding : (q,) differences up to which two values count as equal.
    value : (q,) the values whose bars are wanted, by default the first estimates; of the same limit.
    shape_order : observed order s of the surface itself, from how far it moves from mesh to mesh: what
        corners, ends of junctions, contact or uneven triangles let it have. A quantity may owe a better one
        to errors that cancel. With S = 2^s the last difference would leave d_2 / (S - 1). Up to 1.5 the
        bar is also at least what |d_1| / (S (S - 1)), the rest where d_1 shrinks by S with each mesh, and
        |limit - q_2| differ by; where the signs differ, d_2 may be small by chance, and the bar is at least
        2 |d_1| / (S - 1). If s ≤ 0, no limit is in sight. It counts where s < 2.
    doubt : (q,) how far limits may be off as the curves of the boundary are not known; added to the bars.

    Examples
    --------
    >>> h = np.array([[1.0], [0.5], [0.25]])
    >>> found = extrapolate(7.0 - 3.0 * h**1.5, np.array([1e-12]))
    >>> found.limit.round(12).tolist(), found.order.round(12).tolist(), found.error.round(2).tolist()
    ([7.0], [1.5], [3.29])
    >>> still = extrapolate(np.full((3, 1), 2.0), np.array([1e-12]))
    >>> still.limit.tolist(), still.error.tolist(), still.order.tolist()
    ([2.0], [1e-12], [nan])
    """
    q = np.asarray(estimates, dtype=float)
    value = q[0] if value is None else value
    none, steps = np.full(q.shape[1], np.nan), np.diff(q, axis=0)
    equal = (np.abs(steps[-2:]) <= rounding).all(axis=0) & (len(steps) > 0)
    if len(steps) == 0:
        order, limit, bar = none, none, np.full_like(none, np.inf)
    elif len(steps) == 1:
        order, limit, bar = none, q[-1] + steps[-1] / 3.0, np.abs(steps[-1]) + rounding
    else:
        order, limit, bar = _three(q[-1], steps[-2], steps[-1], rounding, min(shape_order, USUAL))
    if shape_order <= 0.0:
        bar = np.full_like(none, np.inf)
    elif shape_order <= UNSETTLED and len(steps) > 1:
        swing = SAFETY * np.abs(steps[-2]) / (2.0**shape_order - 1.0) * (steps[-2] * steps[-1] < 0.0)
        left = np.abs(steps[-2]) / (2.0**shape_order * (2.0**shape_order - 1.0))
        bar = np.maximum(bar, np.maximum(swing, np.abs(left - np.abs(limit - q[-1]))))
    limit, bar = np.where(equal, q[-1], limit), np.where(equal, rounding, bar) + doubt
    limit, bar = np.where(np.isinf(bar), np.nan, limit), np.where(np.isnan(limit), np.inf, bar)
    error = np.where(np.isnan(limit), np.inf, np.abs(limit - value) + bar)
    return Extrapolation(limit, error, bar, np.where(equal, np.nan, order))


def _three(
    finest: Floats, before: Floats, last: Floats, rounding: Floats, shape_order: float
) -> tuple[Floats, Floats, Floats]:
    """Order, limit and its bar from the last two differences, where these are not rounding alone."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.abs(before) / np.abs(last)
        order = np.log2(ratio)
        observed = finest + last / (ratio - 1.0)
    usual = finest + last / (2.0**USUAL - 1.0)
    shape = finest + last / (2.0**shape_order - 1.0) if shape_order >= LOWEST else usual
    same_sign = before * last > 0.0
    settled = same_sign & (order >= LOWEST) & (order <= HIGHEST)
    swings: Bools = (same_sign & (order > HIGHEST)) | (~same_sign & (np.abs(last) <= np.abs(before)))
    limit = np.where(settled, observed, np.where(swings, usual, np.nan))
    apart = np.maximum(np.abs(observed - usual), np.abs(observed - shape))
    distance = np.maximum(SAFETY * apart, LEAST * np.abs(last))
    fast = np.abs(before) / 12.0  # what order 2 leaves of d_1: d_1 / 4 + d_1 / 16 + … = d_1 / 3 less d_1 / 4
    distance = np.where(order > FAST, np.maximum(distance, fast), distance)
    swinging = np.where(swings, np.maximum(SAFETY * np.abs(last), fast), np.inf)
    return np.where(same_sign, order, np.nan), limit, np.where(settled, distance, swinging) + rounding
