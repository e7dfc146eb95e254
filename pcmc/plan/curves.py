"""Curves to draw a plan with: polylines, Bézier curves, arcs, circles, and paths made of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import OptionError, unknown
from ..surface import Plane
from .coordinates import to_local

CORNER = math.radians(10.0)  # a joint that turns by more is a corner
EDGE_TURN = math.radians(45.0)  # largest turn of a bend along one edge
DENSE = 64  # points per curved piece, for lengths and crossings


@dataclass(frozen=True, eq=False)
class Piece:
    """One smooth piece: a Bézier curve of any degree, or an arc if ``sweep`` is not 0.

    Attributes
    ----------
    points : (k,d) Bézier control points; of an arc (3,d) the centre, and the vectors from there to
        its start and to the point a quarter turn on.
    sweep : the angle of the arc, radians.
    """

    points: Floats
    sweep: float = 0.0

    def at(self, t: Floats) -> Floats:
        """(n,d) points at t (n,) in 0..1."""
        if self.sweep:
            centre, u, v = self.points
            angle = (self.sweep * t)[:, None]
            return centre + np.cos(angle) * u + np.sin(angle) * v
        return _casteljau(self.points, t)

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

    @property
    def straight(self) -> bool:
        """Whether the piece is a segment of a line given by its two ends."""
        return not self.sweep and len(self.points) == 2

    def reversed(self) -> Piece:
        """The same piece from its end to its start."""
        if not self.sweep:
            return Piece(self.points[::-1])
        centre, u, v = self.points
        c, s = math.cos(self.sweep), math.sin(self.sweep)
        return Piece(np.stack([centre, u * c + v * s, u * s - v * c]), self.sweep)


@dataclass(frozen=True, eq=False)
class Curve:
    """Pieces joined end to end. Its parameter t runs from 0 to the number of pieces.

    Plane points (x, y) are coordinates on Π (by default the plane z = 0); points (x, y, z) are
    positions in space. Make curves with ``polyline``, ``bezier``, ``arc``, ``circle``,
    ``join``.
    """

    pieces: tuple[Piece, ...]
    closed: bool = False

    def at(self, t: npt.ArrayLike) -> Floats:
        """(n,d) points at parameters t (n,)."""
        t = np.atleast_1d(np.asarray(t, dtype=float))
        piece = np.clip(np.floor(t).astype(int), 0, len(self.pieces) - 1)
        points = np.empty((len(t), self.pieces[0].points.shape[1]))
        for number in np.unique(piece):
            chosen = piece == number
            points[chosen] = self.pieces[number].at(t[chosen] - number)
        return points

    @cached_property
    def dense(self) -> Floats:
        """(k,) ascending parameters, dense enough to measure lengths by chords."""
        steps = [1 if piece.straight else DENSE for piece in self.pieces]
        parts = [i + np.arange(count) / count for i, count in enumerate(steps)]
        return np.append(np.concatenate(parts), float(len(self.pieces)))

    @cached_property
    def lengths(self) -> Floats:
        """(k,) the length along the curve up to each dense parameter."""
        steps = np.linalg.norm(np.diff(self.at(self.dense), axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def length(self) -> float:
        """Length of the whole curve."""
        return float(self.lengths[-1])

    @cached_property
    def corners(self) -> Floats:
        """(c,) parameters of the joints where the curve turns by more than 10°; no open ends."""
        joints = np.arange(0 if self.closed else 1, len(self.pieces))
        turns = [
            _angle(self.pieces[j - 1].direction(1), self.pieces[j].direction(0)) for j in joints
        ]
        return joints[np.array(turns, dtype=float) > CORNER].astype(float)

    def parameter(self, length: Floats) -> Floats:
        """(n,) parameters at lengths (n,) along the curve."""
        return np.interp(length, self.lengths, self.dense)

    def between(self, start: float, end: float, edge_length: float) -> Floats:
        """(k,) parameters strictly between two others, at equal lengths near ``edge_length``.

        Bends get at least an edge per 45°. On a closed curve ``end`` may exceed the last parameter.
        """
        last, total = float(len(self.pieces)), self.length
        low = float(np.interp(start, self.dense, self.lengths))
        high = float(np.interp(end % last if end > last else end, self.dense, self.lengths))
        high += total if end > last else 0.0
        bend = self._turning(low, high)
        count = max(1, round((high - low) / edge_length), math.ceil(bend / EDGE_TURN - 1e-9))
        inner = low + (high - low) * np.arange(1, count) / count
        return self.parameter(inner % total if end > last else inner)

    def _turning(self, low: float, high: float) -> float:
        """The angle through which the smooth pieces turn between two lengths along the curve."""
        total = self.length
        inner = np.concatenate([self.lengths[:-1], self.lengths[:-1] + total])
        inner = inner[(inner > low) & (inner < high)]
        where = np.concatenate([[low], inner, [high]])
        points = self.at(self.parameter(np.where(where > total, where - total, where)))
        steps = np.diff(points, axis=0)
        length = np.linalg.norm(steps, axis=1)
        steps = steps[length > 0] / length[length > 0, None]
        cosine = np.clip(np.einsum("ij,ij->i", steps[:-1], steps[1:]), -1.0, 1.0)
        turns = np.arccos(cosine)
        return float(turns[turns <= CORNER].sum())

    def reversed(self) -> Curve:
        """The same curve run backwards."""
        return Curve(tuple(piece.reversed() for piece in self.pieces[::-1]), self.closed)

    def local(self, plane: Plane) -> Curve:
        """The curve in the coordinates of Π: two along it, and the height above it."""
        return replace(self, pieces=tuple(_local(piece, plane) for piece in self.pieces))


def polyline(points: npt.ArrayLike, closed: bool = False) -> Curve:
    """Straight segments from point to point, (k,2) or (k,3), k ≥ 2.

    >>> polyline([[0, 0], [3, 0], [3, 4]]).length
    7.0
    """
    P = _points(points, "polyline", 2)
    if closed and len(P) > 2 and np.array_equal(P[0], P[-1]):
        P = P[:-1]
    if closed and len(P) < 3:
        raise OptionError(
            f"polyline: a closed polyline needs 3 points, found {len(P)}",
            what="polyline",
            found=len(P),
            expected=3,
        )
    following = np.roll(P, -1, axis=0) if closed else P[1:]
    double = np.flatnonzero((P[: len(following)] == following).all(axis=1))
    if len(double):
        raise OptionError(
            f"polyline: points {double[0]} and {(double[0] + 1) % len(P)} are both"
            f" {P[double[0]].tolist()}; remove one",
            what="polyline",
            where=int(double[0]),
        )
    pieces = tuple(Piece(np.stack(ends)) for ends in zip(P, following, strict=False))
    return _closed_if_ends_meet(Curve(pieces, closed))


def bezier(control: npt.ArrayLike) -> Curve:
    """The Bézier curve with control points (k,2) or (k,3), of degree k - 1 ≥ 1.

    >>> bezier([[0, 0], [1, 2], [2, 0]]).at([0.5]).tolist()
    [[1.0, 1.0]]
    """
    P = _points(control, "bezier", 2)
    if np.ptp(P, axis=0).max() == 0.0:
        raise OptionError(f"bezier: all control points are {P[0].tolist()}", what="bezier")
    return _closed_if_ends_meet(Curve((Piece(P),)))


def arc(start: npt.ArrayLike, through: npt.ArrayLike, end: npt.ArrayLike) -> Curve:
    """The circular arc from ``start`` over ``through`` to ``end``, (2,) or (3,) each.

    >>> round(arc([1, 0], [0, 1], [-1, 0]).length, 3)
    3.141
    """
    a, b, c = _points([start, through, end], "arc", 3)
    u, v = b - a, c - a
    uu, uv, vv = u @ u, u @ v, v @ v
    area = uu * vv - uv * uv  # squared area of the parallelogram
    if area <= 1e-24 * max(uu, vv) ** 2:
        raise OptionError("arc: its three points lie on one line; use a polyline", what="arc")
    centre = a + (0.5 * vv * (uu - uv) * u + 0.5 * uu * (vv - uv) * v) / area
    first = a - centre
    across = (b - centre) - ((b - centre) @ first) / (first @ first) * first
    second = _toward(across, c - centre, first)
    angles = [math.atan2((p - centre) @ second, (p - centre) @ first) for p in (b, c)]
    through_angle, sweep = (angle % (2 * math.pi) for angle in angles)
    if through_angle > sweep:
        second, sweep = -second, 2 * math.pi - sweep
    return Curve((Piece(np.stack([centre, first, second]), sweep),))


def circle(centre: npt.ArrayLike, radius: float) -> Curve:
    """The circle about ``centre`` (2,), or (3,) for one at a height, parallel to z = 0.

    >>> round(circle([0, 0], 2.0).length / 2, 2)
    6.28
    """
    c = _points([centre], "circle", 1)[0]
    validate.number("circle: radius", radius, above=0.0)
    u, v = np.zeros_like(c), np.zeros_like(c)
    u[0] = v[1] = radius
    return Curve((Piece(np.stack([c, u, v]), 2.0 * math.pi),), closed=True)


def join(*curves: Curve) -> Curve:
    """One path from several open curves, each starting where the one before ends (to 1e-9).

    >>> join(polyline([[0, 0], [2, 0]]), arc([2, 0], [1, 1], [0, 0])).closed
    True
    """
    if not curves:
        raise OptionError("join: give at least one curve", what="join")
    closed = [number for number, curve in enumerate(curves) if curve.closed]
    if closed and len(curves) > 1:
        raise OptionError(
            f"join: curve {closed[0]} is closed; only open curves can be joined",
            what="join",
            where=closed[0],
        )
    dimensions = {curve.pieces[0].points.shape[1] for curve in curves}
    if len(dimensions) > 1:
        raise OptionError(
            "join: some curves are plane and some in space; give all in space", what="join"
        )
    tolerance = 1e-9 * max(curve.length for curve in curves)
    for number in range(1, len(curves)):
        before, after = _end(curves[number - 1], 1), _end(curves[number], 0)
        if np.linalg.norm(after - before) > tolerance:
            raise OptionError(
                f"join: curve {number} starts at {after.tolist()}, but curve {number - 1} ends at"
                f" {before.tolist()}",
                what="join",
                where=number,
            )
    return _closed_if_ends_meet(Curve(tuple(piece for curve in curves for piece in curve.pieces)))


def curve(spec: Any, closed: bool = False) -> Curve:
    """A curve from plain data, as a project file holds it.

    Parameters
    ----------
    spec : a Curve; a list of points; a mapping with one of ``polyline``, ``bezier``, ``arc`` (three
        points) or ``circle`` (``{"centre": …, "radius": …}``); or a list of such mappings, joined.
    closed : whether a list of points is to be closed.

    >>> curve({"circle": {"centre": [0, 0], "radius": 1.0}}).closed
    True
    >>> curve([{"polyline": [[0, 0], [2, 0]]}, {"arc": [[2, 0], [1, 1], [0, 0]]}]).closed
    True
    """
    if isinstance(spec, Curve):
        return spec
    if isinstance(spec, Mapping):
        return _from_mapping(spec)
    if isinstance(spec, Sequence) and spec and isinstance(spec[0], Mapping | Curve):
        return join(*(curve(part) for part in spec))
    return polyline(spec, closed=closed)


def _from_mapping(spec: Mapping[str, Any]) -> Curve:
    makers: dict[str, Any] = {
        "polyline": polyline,
        "bezier": bezier,
        "arc": lambda points: arc(*_points(points, "arc", 3, exactly=True)),
        "circle": lambda circle_spec: circle(**_circle_keys(circle_spec)),
    }
    extra = [key for key in spec if key not in makers and key != "closed"]
    if extra:
        raise OptionError(
            unknown("curve", extra[0], makers), what="curve", found=extra[0], expected=tuple(makers)
        )
    kinds = [key for key in spec if key in makers]
    if len(kinds) != 1:
        raise OptionError(
            f"a curve needs exactly one of {', '.join(makers)}; found {list(spec)}",
            what="curve",
            found=list(spec),
            expected=tuple(makers),
        )
    if "closed" in spec and kinds != ["polyline"]:
        raise OptionError(
            f"only a polyline has the key closed; a {kinds[0]} is closed if it ends at its start",
            what="closed",
        )
    if kinds == ["polyline"]:
        return polyline(spec["polyline"], closed=bool(spec.get("closed", False)))
    made: Curve = makers[kinds[0]](spec[kinds[0]])
    return made


def _circle_keys(spec: Any) -> dict[str, Any]:
    if not isinstance(spec, Mapping) or set(spec) != {"centre", "radius"}:
        raise OptionError(
            f"circle: expected centre and radius, found {spec!r}", what="circle", found=spec
        )
    return dict(spec)


def _closed_if_ends_meet(path: Curve) -> Curve:
    """The path as a closed one if it ends where it starts."""
    gap = float(np.linalg.norm(_end(path, 1) - _end(path, 0)))
    return replace(path, closed=path.closed or gap <= 1e-9 * path.length)


def _end(path: Curve, end: int) -> Floats:
    return path.at([float(end * len(path.pieces))])[0]


def _points(points: Any, what: str, least: int, exactly: bool = False) -> Floats:
    try:
        P = np.array(points)
        if P.dtype.kind not in "iuf":  # numpy would take the text "8" for a number
            raise ValueError
    except (TypeError, ValueError):
        raise OptionError(
            f"{what}: expected points, all [x, y] or all [x, y, z]", what=what, found=points
        ) from None
    P = P.astype(float)
    if P.ndim != 2 or P.shape[1] not in (2, 3):
        raise OptionError(
            f"{what}: expected points [x, y] or [x, y, z], found shape {P.shape}",
            what=what,
            found=P.shape,
        )
    if len(P) < least or (exactly and len(P) != least):
        raise OptionError(
            f"{what}: expected {least} points, found {len(P)}",
            what=what,
            found=len(P),
            expected=least,
        )
    bad = np.flatnonzero(~np.isfinite(P).all(axis=1))
    if len(bad):
        raise OptionError(
            f"{what}: point {bad[0]} = {P[bad[0]].tolist()} is not finite",
            what=what,
            where=int(bad[0]),
        )
    return P


def _local(piece: Piece, plane: Plane) -> Piece:
    if piece.points.shape[1] == 2 or not piece.sweep:
        return Piece(to_local(piece.points, plane), piece.sweep)
    turned = piece.points @ plane.axes.T
    turned[0] = to_local(piece.points[0], plane)
    return Piece(turned, piece.sweep)


def _casteljau(control: Floats, t: Floats) -> Floats:
    level = np.broadcast_to(control, (len(t), *control.shape))
    s = t[:, None, None]
    while level.shape[1] > 1:
        level = (1.0 - s) * level[:, :-1] + s * level[:, 1:]
    return level[:, 0]


def _first_step(control: Floats) -> Floats:
    """From the first control point to the first one that differs from it."""
    steps = control[1:] - control[0]
    moved = np.flatnonzero((steps != 0.0).any(axis=1))
    return steps[moved[0]] if len(moved) else steps[0]


def _angle(u: Floats, v: Floats) -> float:
    return math.acos(float(np.clip(u @ v, -1.0, 1.0)))


def _toward(across: Floats, other: Floats, first: Floats) -> Floats:
    """The vector a quarter turn from ``first`` in the arc's plane, as long as it."""
    if np.linalg.norm(across) <= 1e-12 * np.linalg.norm(first):
        across = other - (other @ first) / (first @ first) * first
    return across * (np.linalg.norm(first) / np.linalg.norm(across))
