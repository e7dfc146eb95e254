"""One smooth piece of a curve, and coordinates on Π."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Floats
from ..surface import Plane


@dataclass(frozen=True, eq=False)
class Piece:
    """One smooth piece: a Bézier curve of any degree, or an arc if ``sweep`` is not 0.

    Attributes
    ----------
    points : (k,d) Bézier control points; of an arc (3,d) the centre, and the vectors from there to
        its start and to the point a quarter turn on. These need not be as long as each other, nor at a
        right angle: then the arc is one of an ellipse.
    sweep : the angle of the arc, radians.
    weights : (k,) > 0 of the control points of a rational Bézier curve; None if all are 1.
    """

    points: Floats
    sweep: float = 0.0
    weights: Floats | None = None

    def at(self, t: Floats) -> Floats:
        """(n,d) points at t (n,) in 0..1."""
        if self.sweep:
            centre, u, v = self.points
            angle = (self.sweep * t)[:, None]
            return centre + np.cos(angle) * u + np.sin(angle) * v
        control = self.points
        if self.weights is not None:  # homogeneous coordinates
            control = np.column_stack([control * self.weights[:, None], self.weights])
        level = np.broadcast_to(control, (len(t), *control.shape))
        s = t[:, None, None]
        while level.shape[1] > 1:  # de Casteljau
            level = (1.0 - s) * level[:, :-1] + s * level[:, 1:]
        last = level[:, 0]
        return last if self.weights is None else last[:, :-1] / last[:, -1:]

    def direction(self, end: int) -> Floats:
        """(d,) unit tangent at the start (0) or at the end (1)."""
        if self.sweep:
            _, u, v = self.points
            angle = self.sweep * end
            tangent = math.copysign(1.0, self.sweep) * (v * math.cos(angle) - u * math.sin(angle))
        else:
            tangent = _first_step(self.points) if end == 0 else -_first_step(self.points[::-1])
        length = float(np.linalg.norm(tangent))
        return tangent / length if length > 0.0 else tangent

    def reversed(self) -> Piece:
        """The same piece from its end to its start."""
        if not self.sweep:
            return Piece(self.points[::-1], weights=None if self.weights is None else self.weights[::-1])
        centre, u, v = self.points
        c, s = math.cos(self.sweep), math.sin(self.sweep)
        return Piece(np.stack([centre, u * c + v * s, u * s - v * c]), self.sweep)

    def local(self, plane: Plane) -> Piece:
        """The piece in the coordinates of Π."""
        local = to_local(self.points, plane)
        if self.sweep and self.points.shape[1] == 3:  # the last two rows are vectors, not points
            local[1:] = (self.points @ plane.axes.T)[1:]
        return Piece(local, self.sweep, self.weights)


def to_local(points: Floats, plane: Plane) -> Floats:
    """(n,3) coordinates on Π and heights above it, of plane (n,2) or space points (n,3)."""
    if points.shape[-1] == 3:
        return plane.to_local(points)
    return np.concatenate([points, np.zeros((*points.shape[:-1], 1))], axis=-1)


def to_space(local: Floats, plane: Plane) -> Floats:
    """(n,3) positions of points given by coordinates on Π and height."""
    return local @ plane.axes + np.array(plane.point)


def _first_step(control: Floats) -> Floats:
    """From the first control point to the first one that differs from it."""
    steps = control[1:] - control[0]
    moved = np.flatnonzero((steps != 0.0).any(axis=1))
    return steps[moved[0]] if len(moved) else steps[0]
