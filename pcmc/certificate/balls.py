"""Ball arithmetic for compiled loops: a number is (value, radius), and the exact one is within the radius.

With u = 2⁻⁵³ each operation of floating point is off by at most u times its result; products and quotients
may lose 2⁻¹⁰²² more by underflow. For exact a ∈ A ± α, b ∈ B ± β:

    |ab - AB| ≤ |A| β + α (|B| + β)          |1/a - 1/A| ≤ α / (|A| (|A| - α)),  here for α ≤ |A|/2
    |√a - √A| ≤ α / √A,  A > 0

Radii are sums and products of positive floats and so themselves right up to u for each operation. ``SAFE``
covers four million of these in sequence: who uses a radius multiplies with it once.
"""

from __future__ import annotations

from math import inf, sqrt

from ..base.arrays import Floats
from ..base.compiled import inlined
from ..surface.geometry import Vector

Ball = tuple[float, float]
Balls = tuple[Ball, Ball, Ball]  # a three-vector of them

U = 2.0**-53
TINY = 2.0**-1022
SAFE = 1.0 + 5e-10


@inlined
def exact(a: float) -> Ball:
    return a, 0.0


@inlined
def plus(a: Ball, b: Ball) -> Ball:
    value = a[0] + b[0]
    return value, a[1] + b[1] + U * abs(value)


@inlined
def minus(a: Ball, b: Ball) -> Ball:
    value = a[0] - b[0]
    return value, a[1] + b[1] + U * abs(value)


@inlined
def times(a: Ball, b: Ball) -> Ball:
    value = a[0] * b[0]
    return value, abs(a[0]) * b[1] + a[1] * (abs(b[0]) + b[1]) + U * abs(value) + TINY


@inlined
def reciprocal(a: Ball) -> Ball:
    """1 / a; a radius of infinity where zero is not far enough."""
    size, value = abs(a[0]), 1.0 / a[0] if a[0] != 0.0 else 0.0
    if not a[1] <= 0.5 * size or size < 1e-150:
        return value, inf
    return value, a[1] / size / (size - a[1]) + U * abs(value) + TINY


@inlined
def square_root(a: Ball) -> Ball:
    """√a; a radius of infinity where a is not surely positive."""
    if not a[1] <= 0.5 * a[0]:
        return 0.0, inf
    value = sqrt(a[0])
    return value, (a[1] / value if a[1] > 0.0 else 0.0) + U * value + TINY


@inlined
def row(X: Floats, i: int) -> Balls:
    """Row i of floats X (n,3)."""
    return exact(X[i, 0]), exact(X[i, 1]), exact(X[i, 2])


@inlined
def of(a: Vector) -> Balls:
    return exact(a[0]), exact(a[1]), exact(a[2])


@inlined
def plus3(a: Balls, b: Balls) -> Balls:
    return plus(a[0], b[0]), plus(a[1], b[1]), plus(a[2], b[2])


@inlined
def minus3(a: Balls, b: Balls) -> Balls:
    return minus(a[0], b[0]), minus(a[1], b[1]), minus(a[2], b[2])


@inlined
def times3(s: Ball, a: Balls) -> Balls:
    return times(s, a[0]), times(s, a[1]), times(s, a[2])


@inlined
def dot3(a: Balls, b: Balls) -> Ball:
    return plus(plus(times(a[0], b[0]), times(a[1], b[1])), times(a[2], b[2]))


@inlined
def cross3(a: Balls, b: Balls) -> Balls:
    return (
        minus(times(a[1], b[2]), times(a[2], b[1])),
        minus(times(a[2], b[0]), times(a[0], b[2])),
        minus(times(a[0], b[1]), times(a[1], b[0])),
    )


@inlined
def gather(value: Floats, radius: Floats, at: int, a: Ball) -> None:
    """Add a to entry ``at`` of an array of balls."""
    value[at] += a[0]
    radius[at] += a[1] + U * abs(value[at])
