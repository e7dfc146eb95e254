"""One smooth piece of a curve, and coordinates on Π."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.tolerances import ON
from .guides import Plane

SAMPLES, BISECTIONS = 66, 60  # of a coordinate of a Bézier curve, and to find where it turns between two


@dataclass(frozen=True, eq=False)
class Piece:
    """One smooth piece: a Bézier curve of any degree, or an arc if ``sweep`` is not 0.

    The ``points`` (k,d) are Bézier control points; of an arc (3,d) the centre, and the vectors from there to
    its start and to the point a quarter turn on. These need not be as long as each other, nor at a right
    angle: then the arc is one of an ellipse.
    """

    points: Floats
    sweep: float = 0.0  # the angle of the arc, radians
    weights: Floats | None = None  # (k,) > 0 of a rational Bézier curve's control points; None if all are 1

    def at(self, t: Floats) -> Floats:
        """(n,d) points at t (n,) in 0..1."""
        return Alike.of([self]).at(np.zeros(len(t), dtype=np.int64), t)

    @property
    def homogeneous(self) -> Floats:
        """(k,d+1) control points times their weights, and the weights."""
        weights = np.ones(len(self.points)) if self.weights is None else self.weights
        return np.column_stack([self.points * weights[:, None], weights])

    @property
    def controls(self) -> Floats:
        """(k,d) the control points; of an arc its centre, and the ends of its axes."""
        return np.concatenate([c := self.points[:1], c + self.points[1:]]) if self.sweep else self.points

    def extremes(self) -> Floats:
        """(e,) ascending parameters inside 0..1 at which x or y is largest or smallest.

        On an arc c + u cos φ + v sin φ these are the angles with tan φ = v / u, in each coordinate. On a
        (rational) Bézier curve N / D they are the roots of N' D - N D', found by bisection.

        >>> Piece(np.array([[5.0, 0], [2, 0], [0, 2]]), math.pi).extremes().tolist()
        [0.5]
        >>> Piece(np.array([[0.0, 0], [1, 3], [2, 0]])).extremes().tolist()
        [0.5]
        """
        if self.sweep:
            _, u, v = self.points[:, :2]
            used = np.hypot(u, v) > ON * np.abs(self.points[1:]).max()
            angles = np.arctan2(v, u)[used][:, None] + math.pi * np.arange(-3, 4)
            t = np.unique(angles / self.sweep)
        elif len(self.points) > 2:
            t = np.unique(np.concatenate([self._turns(k) for k in range(2)]))
        else:
            return np.empty(0)
        return t[(t > ON) & (t < 1.0 - ON)]

    def _turns(self, axis: int) -> Floats:
        """(e,) parameters at which a coordinate of the Bézier curve changes its direction."""
        steps = np.diff(self.points[:, axis])
        if (steps >= 0.0).all() or (steps <= 0.0).all():  # then the curve goes one way, too
            return np.empty(0)
        control = self.homogeneous[:, [axis, -1]]
        control = control / control[:, 1].max()

        def rate(t: Floats) -> Floats:
            (n, d), (dn, dd) = _casteljau(control, t).T, _casteljau(np.diff(control, axis=0), t).T
            return np.asarray(dn * d - n * dd)

        t = np.linspace(0.0, 1.0, SAMPLES)
        slope = rate(t)
        moving = np.flatnonzero(np.abs(slope) > ON * np.ptp(self.points, axis=0).max())
        turned = np.flatnonzero(np.diff(np.sign(slope[moving])))
        low, high = t[moving[turned]], t[moving[turned + 1]]
        sign = np.sign(slope[moving[turned]])
        for _ in range(BISECTIONS if len(low) else 0):
            middle = 0.5 * (low + high)
            before = rate(middle) * sign > 0.0
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return 0.5 * (low + high)

    def direction(self, end: int) -> Floats:
        """(d,) unit tangent at the start (0) or at the end (1)."""
        if self.sweep:
            _, u, v = self.points
            angle = self.sweep * end
            tangent = math.copysign(1.0, self.sweep) * (v * math.cos(angle) - u * math.sin(angle))
        else:  # from the first control point to the first that differs from it, or the same at the end
            steps = self.points[1:] - self.points[0] if end == 0 else self.points[-1] - self.points[-2::-1]
            tangent = steps[np.argmax((steps != 0.0).any(axis=1))]
        length = float(np.linalg.norm(tangent))
        return tangent / length if length > 0.0 else tangent

    def reversed(self) -> Piece:
        """The same piece from its end to its start."""
        if not self.sweep:
            return Piece(self.points[::-1], weights=None if self.weights is None else self.weights[::-1])
        centre, u, v = self.points
        c, s = math.cos(self.sweep), math.sin(self.sweep)
        return Piece(np.stack([centre, u * c + v * s, u * s - v * c]), self.sweep)

    def mapped(self, matrix: Floats, shift: Floats) -> Piece:
        """The piece where the affine map x → M x + b takes it: an arc may become one of an ellipse."""
        whole = np.array([[1.0], [0.0], [0.0]]) if self.sweep else 1.0  # an arc's axes are vectors
        return replace(self, points=self.points @ matrix.T + whole * shift)

    def part(self, start: float, end: float) -> Piece:
        """The piece between two parameters: of a Bézier curve by de Casteljau's algorithm, from each end.

        >>> Piece(np.array([[0.0, 0], [1, 2], [2, 0]])).part(0.5, 1.0).points.tolist()
        [[1.0, 1.0], [1.5, 1.0], [2.0, 0.0]]
        """
        if start == 0.0 and end == 1.0:
            return self
        if self.sweep:
            centre, u, v = self.points
            c, s = math.cos(start * self.sweep), math.sin(start * self.sweep)
            return Piece(np.stack([centre, u * c + v * s, v * c - u * s]), float((end - start) * self.sweep))
        control = _first_part(self.homogeneous, end)
        control = _first_part(control[::-1], 1.0 - start / end)[::-1]
        if self.weights is None:
            return Piece(control[:, :-1])
        return Piece(control[:, :-1] / control[:, -1:], weights=control[:, -1])

    def local(self, plane: Plane) -> Piece:
        """The piece in the coordinates of Π."""
        local = to_local(self.points, plane)
        if self.sweep and self.points.shape[1] == 3:  # the last two rows are vectors, not points
            local[1:] = (self.points @ plane.axes.T)[1:]
        return Piece(local, self.sweep, self.weights)


@dataclass(frozen=True, eq=False)
class Alike:
    """Pieces of one kind, evaluated together."""

    points: Floats  # (p,k,d) as of a Piece; homogeneous, (p,k,d+1), if they are rational
    sweep: Floats  # (p,) of arcs, 0 of others
    rational: bool  # whether they are rational Bézier curves

    @classmethod
    def of(cls, pieces: Sequence[Piece]) -> Alike:
        """The pieces, which have one kind and number of points."""
        rational = pieces[0].weights is not None
        points = [piece.homogeneous if rational else piece.points for piece in pieces]
        return cls(np.array(points), np.array([piece.sweep for piece in pieces]), rational)

    def at(self, number: Ints, t: Floats) -> Floats:
        """(n,d) points of the pieces with these numbers (n,) at t (n,) in 0..1."""
        if self.sweep[0]:
            centre, u, v = self.points[number].transpose(1, 0, 2)
            angle = (self.sweep[number] * t)[:, None]
            return np.asarray(centre + np.cos(angle) * u + np.sin(angle) * v)
        last = _casteljau(self.points[number], t)
        return last[:, :-1] / last[:, -1:] if self.rational else last


def _casteljau(control: Floats, t: Floats) -> Floats:
    """(n,d) polynomials with Bernstein coefficients (k,d), or (n,k,d) one for each, at t (n,)."""
    level = np.broadcast_to(control, (len(t), *control.shape[-2:]))
    s = t[:, None, None]
    while level.shape[1] > 1:
        level = (1.0 - s) * level[:, :-1] + s * level[:, 1:]
    return level[:, 0]


def _first_part(control: Floats, t: float) -> Floats:
    """(k,d) the Bernstein coefficients (k,d) of a polynomial on 0..t instead of 0..1."""
    first = [control[0]]
    while len(control) > 1:
        control = (1.0 - t) * control[:-1] + t * control[1:]
        first.append(control[0])
    return np.array(first)


def to_local(points: Floats, plane: Plane) -> Floats:
    """(n,3) coordinates on Π and heights above it, of plane (n,2) or space points (n,3)."""
    if points.shape[-1] == 3:
        return plane.to_local(points)
    return np.concatenate([points, np.zeros((*points.shape[:-1], 1))], axis=-1)


def to_space(local: Floats, plane: Plane) -> Floats:
    """(n,3) positions of points given by coordinates on Π and height."""
    return local @ plane.axes + np.array(plane.point)


def point_text(point: Floats, size: float | None = None) -> str:
    """A point (2,) or (3,), for messages; its height where that is not 0.

    It has six digits of its largest coordinate and two decimals at least, for those of a survey; a place on a
    surface of some ``size`` is rounded to a ten thousandth of that, or finer.

    >>> point_text(np.array([9.5096189432, 0.0])), point_text(np.array([2.5, 3.25, 4e-16]))
    ('(9.50962, 0)', '(2.5, 3.25)')
    >>> point_text(np.array([500004.738, 5812346.0]))
    '(500004.74, 5812346)'
    >>> point_text(np.array([6.18012, 3.92134, 0.0929]), 15.0)
    '(6.18, 3.921, 0.093)'
    >>> point_text(np.array([6.18012e-5, 3.92134e-5, 0.0929e-5]), 15e-5)
    '(6.18e-05, 3.921e-05, 9.3e-07)'
    """
    largest = min(float(np.abs(point).max(initial=0.0)), 1000.0) if size is None else size
    if largest > 0.0:
        point = np.round(point, (5 if size is None else 4) - math.floor(math.log10(largest))) + 0.0
    shown = point if point[2:].any() else point[:2]
    return f"({', '.join(f'{value:.12g}' for value in shown)})"


def two_digits(value: float, rounded: Callable[[float], int] | None = None) -> float:
    """A number rounded to two digits; one > 0 up with ``math.ceil``, or down with ``math.floor``.

    >>> two_digits(0.3049), two_digits(0.3001, math.ceil), two_digits(0.3001, math.floor)
    (0.3, 0.31, 0.3)
    """
    if rounded is None:
        return float(f"{value:.2g}")
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{rounded(value / step + (1e-9 if rounded is math.ceil else 0.0)) * step:.2g}")
