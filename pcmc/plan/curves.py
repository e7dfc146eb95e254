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
from ..base.errors import OptionError
from ..surface import Plane

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
        level = np.broadcast_to(self.points, (len(t), *self.points.shape))
        s = t[:, None, None]
        while level.shape[1] > 1:  # de Casteljau
            level = (1.0 - s) * level[:, :-1] + s * level[:, 1:]
        return level[:, 0]

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
            return Piece(self.points[::-1])
        centre, u, v = self.points
        c, s = math.cos(self.sweep), math.sin(self.sweep)
        return Piece(np.stack([centre, u * c + v * s, u * s - v * c]), self.sweep)

    def local(self, plane: Plane) -> Piece:
        """The piece in the coordinates of Π."""
        local = to_local(self.points, plane)
        if self.sweep and self.points.shape[1] == 3:  # the last two rows are vectors, not points
            local[1:] = (self.points @ plane.axes.T)[1:]
        return Piece(local, self.sweep)


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
        steps = [DENSE if piece.sweep or len(piece.points) > 2 else 1 for piece in self.pieces]
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
        cosines = [self.pieces[j - 1].direction(1) @ self.pieces[j].direction(0) for j in joints]
        return joints[np.arccos(np.clip(np.array(cosines, dtype=float), -1.0, 1.0)) > CORNER].astype(float)

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
        return replace(self, pieces=tuple(piece.local(plane) for piece in self.pieces))


def to_local(points: Floats, plane: Plane) -> Floats:
    """(n,3) coordinates on Π and heights above it, of plane (n,2) or space points (n,3)."""
    if points.shape[-1] == 3:
        return plane.to_local(points)
    return np.concatenate([points, np.zeros((*points.shape[:-1], 1))], axis=-1)


def to_space(local: Floats, plane: Plane) -> Floats:
    """(n,3) positions of points given by coordinates on Π and height."""
    return local @ plane.axes + np.array(plane.point)


def polyline(points: npt.ArrayLike, closed: bool = False) -> Curve:
    """Straight segments from point to point, (k,2) or (k,3), k ≥ 2.

    >>> polyline([[0, 0], [3, 0], [3, 4]]).length
    7.0
    """
    P = _points(points, "polyline", 2)
    if closed and len(P) > 2 and np.array_equal(P[0], P[-1]):
        P = P[:-1]
    if closed and len(P) < 3:
        raise _error("polyline", f"closed, it needs 3 points, found {len(P)}", found=len(P), expected=3)
    following = np.roll(P, -1, axis=0) if closed else P[1:]
    double = np.flatnonzero((P[: len(following)] == following).all(axis=1))
    if len(double):
        first = int(double[0])
        both = f"points {first} and {(first + 1) % len(P)}"
        raise _error("polyline", f"{both} are both {P[first].tolist()}; remove one", where=first)
    pieces = tuple(Piece(np.stack(ends)) for ends in zip(P, following, strict=False))
    return _closed_if_ends_meet(Curve(pieces, closed))


def bezier(control: npt.ArrayLike) -> Curve:
    """The Bézier curve with control points (k,2) or (k,3), of degree k - 1 ≥ 1.

    >>> bezier([[0, 0], [1, 2], [2, 0]]).at([0.5]).tolist()
    [[1.0, 1.0]]
    """
    P = _points(control, "bezier", 2)
    if np.ptp(P, axis=0).max() == 0.0:
        raise _error("bezier", f"all control points are {P[0].tolist()}")
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
        raise _error("arc", "its three points lie on one line; use a polyline")
    centre = a + (0.5 * vv * (uu - uv) * u + 0.5 * uu * (vv - uv) * v) / area
    first = a - centre
    across, other = (p - centre - ((p - centre) @ first) / (first @ first) * first for p in (b, c))
    if np.linalg.norm(across) <= 1e-12 * np.linalg.norm(first):  # through is opposite start
        across = other
    second = across * (np.linalg.norm(first) / np.linalg.norm(across))
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
    axes = validate.positive("circle: radius", radius) * np.eye(2, len(c))
    return Curve((Piece(np.concatenate([[c], axes]), 2.0 * math.pi),), closed=True)


def join(*curves: Curve) -> Curve:
    """One path from several open curves, each starting where the one before ends (to 1e-9).

    >>> join(polyline([[0, 0], [2, 0]]), arc([2, 0], [1, 1], [0, 0])).closed
    True
    """
    if not curves:
        raise _error("join", "give at least one curve")
    closed = [number for number, curve in enumerate(curves) if curve.closed]
    if closed and len(curves) > 1:
        raise _error("join", f"curve {closed[0]} is closed; only open curves can be joined", where=closed[0])
    if len({curve.pieces[0].points.shape[1] for curve in curves}) > 1:
        raise _error("join", "some curves are plane and some in space; give all in space")
    tolerance = 1e-9 * max(curve.length for curve in curves)
    for number in range(1, len(curves)):
        before, after = _end(curves[number - 1], 1), _end(curves[number], 0)
        if np.linalg.norm(after - before) > tolerance:
            gap = (
                f"curve {number} starts at {after.tolist()}, but curve {number - 1} ends at {before.tolist()}"
            )
            raise _error("join", gap, where=number)
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
    known = ("polyline", "bezier", "arc", "circle")
    kinds = [key for key in spec if key != "closed"]
    for key in kinds:
        validate.choice("curve", key, known)
    if len(kinds) != 1:
        problem = f"a curve needs exactly one of {', '.join(known)}; found {list(spec)}"
        raise OptionError(problem, what="curve", found=list(spec), expected=known)
    (kind,) = kinds
    value = spec[kind]
    if kind == "polyline":
        return polyline(value, closed=bool(spec.get("closed", False)))
    if "closed" in spec:
        problem = f"only a polyline has the key closed; a {kind} is closed if it ends at its start"
        raise OptionError(problem, what="closed")
    if kind == "bezier":
        return bezier(value)
    if kind == "arc":
        return arc(*_points(value, "arc", 3, exactly=True))
    if not isinstance(value, Mapping) or set(value) != {"centre", "radius"}:
        raise _error("circle", f"expected centre and radius, found {value!r}", found=value)
    return circle(**value)


def _closed_if_ends_meet(path: Curve) -> Curve:
    """The path as a closed one if it ends where it starts."""
    gap = float(np.linalg.norm(_end(path, 1) - _end(path, 0)))
    return replace(path, closed=path.closed or gap <= 1e-9 * path.length)


def _end(path: Curve, end: int) -> Floats:
    return path.at([float(end * len(path.pieces))])[0]


def _error(what: str, problem: str, **fields: object) -> OptionError:
    """The error about a kind of curve."""
    return OptionError(f"{what}: {problem}", what=what, **fields)


def _points(points: Any, what: str, least: int, exactly: bool = False) -> Floats:
    """(k,2) or (k,3) the points, checked."""
    try:
        P = np.array(points)
    except (TypeError, ValueError):
        P = np.array("ragged")
    if P.dtype.kind not in "iuf":  # numpy would take the text "8" for a number
        raise _error(what, "expected points, all [x, y] or all [x, y, z]", found=points)
    P = P.astype(float)
    if P.ndim != 2 or P.shape[1] not in (2, 3):
        raise _error(what, f"expected points [x, y] or [x, y, z], found shape {P.shape}", found=P.shape)
    if len(P) < least or (exactly and len(P) != least):
        raise _error(what, f"expected {least} points, found {len(P)}", found=len(P), expected=least)
    bad = np.flatnonzero(~np.isfinite(P).all(axis=1))
    if len(bad):
        raise _error(what, f"point {bad[0]} = {P[bad[0]].tolist()} is not finite", where=int(bad[0]))
    return P


def _first_step(control: Floats) -> Floats:
    """From the first control point to the first one that differs from it."""
    steps = control[1:] - control[0]
    moved = np.flatnonzero((steps != 0.0).any(axis=1))
    return steps[moved[0]] if len(moved) else steps[0]
