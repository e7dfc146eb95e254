"""Curves to draw a plan with: polylines, Bézier curves, arcs, circles, ellipses, and paths made of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Bools, Floats, Ints
from ..base.errors import OptionError
from ..base.tolerances import ON
from .geometry import in_edges, lengths_along
from .guides import Plane
from .pieces import Alike, Piece

CORNER = math.radians(10.0)  # a joint that turns by more is a corner
NEAR = 0.5  # of the edge length: an extreme nearer to another stop than this becomes no vertex
EDGE_TURN = math.radians(45.0)  # largest turn of a bend along one edge
LEVEL = 1e-12  # product of slopes beside a joint, up to which a coordinate may turn there
BESIDE = 0.25  # in parameter: how far beside such a joint its coordinate is compared
MOST_UNEVEN = 1e6  # weights of a rational curve: where they differ by more, it is corners to rounding
PLATEAU = 1e-12  # of the length: changes of a coordinate up to this are none
DENSE = 64  # points per curved piece, for lengths and crossings; fewer where there are many pieces,
DENSEST, FEWEST = 4096, 4  # about so many on a curve, and at least so many on each piece


@dataclass(frozen=True, eq=False)
class Curve:
    """Pieces joined end to end. Its parameter t runs from 0 to the number of pieces.

    Plane points (x, y) are coordinates on Π (by default the plane z = 0); points (x, y, z) are
    positions in space.
    """

    pieces: tuple[Piece, ...]
    closed: bool = False

    def at(self, t: npt.ArrayLike) -> Floats:
        """(n,d) points at parameters t (n,)."""
        t = np.atleast_1d(np.asarray(t, dtype=float))
        piece = np.clip(np.floor(t).astype(int), 0, len(self.pieces) - 1)
        points = np.empty((len(t), self.pieces[0].points.shape[1]))
        for place, alike in self._groups:
            chosen = np.flatnonzero(place[piece] >= 0)
            if len(chosen):
                points[chosen] = alike.at(place[piece[chosen]], (t - piece)[chosen])
        return points

    @cached_property
    def _groups(self) -> list[tuple[Ints, Alike]]:
        """The pieces by their kind, and (p,) the place of each piece among those, -1 for another kind."""
        kinds = [(piece.sweep != 0.0, len(piece.points), piece.weights is not None) for piece in self.pieces]
        groups = []
        for kind in dict.fromkeys(kinds):
            mine = np.array([other == kind for other in kinds])
            place = np.where(mine, np.cumsum(mine) - 1, -1)
            groups.append((place, Alike.of([self.pieces[k] for k in np.flatnonzero(mine)])))
        return groups

    @cached_property
    def _straight(self) -> tuple[Floats, Bools]:
        """(p,2,d) the first and last control points of the pieces, and (p,) which of these are lines."""
        ends = np.array([piece.points[[0, -1]] for piece in self.pieces])
        return ends, np.array([not piece.sweep and len(piece.points) == 2 for piece in self.pieces])

    @cached_property
    def dense(self) -> Floats:
        """(k,) ascending parameters, dense enough to measure lengths by chords."""
        curved = min(DENSE, max(FEWEST, DENSEST // len(self.pieces)))
        steps = np.where(self._straight[1], 1, curved)
        piece = np.repeat(np.arange(len(steps)), steps)
        place = np.arange(len(piece)) - np.repeat(np.cumsum(steps) - steps, steps)
        return np.append(piece + place / steps[piece], float(len(self.pieces)))

    @cached_property
    def lengths(self) -> Floats:
        """(k,) the length along the curve up to each dense parameter."""
        return lengths_along(self.at(self.dense))

    @property
    def length(self) -> float:
        """Length of the whole curve."""
        return float(self.lengths[-1])

    @cached_property
    def corners(self) -> Floats:
        """(c,) parameters of the joints where the curve turns by more than 10°; no open ends."""
        joints = np.arange(0 if self.closed else 1, len(self.pieces))
        starts, ends = self._directions
        cosines = np.einsum("ij,ij->i", ends[joints - 1], starts[joints])
        return joints[np.arccos(np.clip(cosines, -1.0, 1.0)) > CORNER].astype(float)

    @cached_property
    def _directions(self) -> tuple[Floats, Floats]:
        """(p,d) the unit tangents of the pieces at their starts, and at their ends."""
        (points, straight), d = self._straight, self.pieces[0].points.shape[1]
        along = points[:, 1] - points[:, 0]
        starts = along / np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None]
        ends, curved = starts.copy(), np.flatnonzero(~straight)
        for end, tangents in enumerate((starts, ends)):
            tangents[curved] = np.reshape([self.pieces[k].direction(end) for k in curved], (-1, d))
        return starts, ends

    @cached_property
    def extremes(self) -> Floats:
        """(e,) ascending parameters, no open ends, at which a curved piece is farthest along x or y.

        >>> circle([0, 0], 2.0).extremes.tolist()
        [0.0, 0.25, 0.5, 0.75]
        """
        inside = [number + piece.extremes() for number, piece in enumerate(self.pieces)]
        curved = ~self._straight[1]
        joints = np.arange(0 if self.closed else 1, len(self.pieces))
        joints = joints[curved[joints - 1] | curved[joints]]
        starts, ends = self._directions[0][joints, :2], self._directions[1][joints - 1, :2]
        sides = np.stack([(joints - BESIDE) % len(self.pieces), joints, joints + BESIDE])
        before, here, after = (self.at(t)[:, :2] for t in sides)
        low = np.minimum(np.sign(here - before) * (here - after), np.sign(here - after) * (here - before))
        farthest = (ends * starts < LEVEL) & (low > PLATEAU * self.length)
        return np.sort(np.concatenate([*inside, joints[farthest.any(axis=1)].astype(float)]))

    def parameter(self, length: Floats) -> Floats:
        """(n,) parameters at lengths (n,) along the curve."""
        return np.interp(length, self.lengths, self.dense)

    def samples(self, spacing: float) -> Floats:
        """(n,d) points along the whole curve, no farther apart than ``spacing``, its joints among them."""
        even = self.parameter(np.linspace(0.0, self.length, 2 + int(self.length / spacing)))
        return self.at(np.union1d(even, self.dense))

    def between(self, start: float, end: float, edge_length: float) -> Floats:
        """(k,) parameters strictly between two others, at about equal lengths near ``edge_length``.

        The extremes are among them, but not those nearer than half an edge to an end or to one before;
        between these the lengths are equal. Bends get at least an edge per 45°. On a closed curve ``end``
        may exceed the last parameter.

        >>> arc([1, 0], [0, 1], [-1, 0]).between(0.0, 1.0, 0.65).round(12).tolist()  # not 5 equal edges
        [0.25, 0.5, 0.75]
        """
        low, high = self._lengths_at(np.array([start, end]))
        stops, extremes = [low], np.concatenate([self.extremes, self.extremes + float(len(self.pieces))])
        inside = slice(*np.searchsorted(extremes, [start, end]))
        for length in self._lengths_at(extremes[inside]).tolist():
            if in_edges(min(length - stops[-1], high - length), edge_length) >= NEAR:
                stops.append(length)
        inner = []
        for first, second in pairwise([*stops, high]):
            bend = self._turning(first, second)
            count = max(
                1, int(np.rint(in_edges(second - first, edge_length))), math.ceil(bend / EDGE_TURN - 1e-9)
            )
            inner.append(first + (second - first) * np.arange(count) / count)
        return self._parameter_around(np.concatenate(inner)[1:])

    def middle(self, start: npt.ArrayLike, end: npt.ArrayLike, share: Floats | float = 0.5) -> Floats:
        """(n,) the parameters half of the way from ones to others, or another share, as in ``between``."""
        low, high = (self._lengths_at(np.atleast_1d(np.asarray(t, dtype=float))) for t in (start, end))
        return self.parameter((low + share * (high - low)) % self.length)

    def _parameter_around(self, length: Floats) -> Floats:
        """``parameter`` of lengths (n,) that may go around a closed curve twice."""
        return self.parameter(np.where(length > self.length, length - self.length, length))

    def _lengths_at(self, t: Floats) -> Floats:
        """(n,) the length along the curve up to parameters t, which may go around a closed curve twice."""
        around = t > len(self.pieces)
        return np.interp(t - around * len(self.pieces), self.dense, self.lengths) + around * self.length

    def _turning(self, low: float, high: float) -> float:
        """The angle through which the smooth pieces turn between two lengths along the curve."""
        inner = np.concatenate([self.lengths[:-1], self.lengths[:-1] + self.length])
        first, last = np.searchsorted(inner, low, side="right"), np.searchsorted(inner, high)
        if last == first:
            return 0.0
        where = np.concatenate([[low], inner[first:last], [high]])
        steps = np.diff(self.at(self._parameter_around(where)), axis=0)
        length = np.linalg.norm(steps, axis=1)
        steps = steps[length > 0] / length[length > 0, None]
        turns = np.arccos(np.clip(np.einsum("ij,ij->i", steps[:-1], steps[1:]), -1.0, 1.0))
        return float(turns[turns <= CORNER].sum())

    def reversed(self) -> Curve:
        """The same curve run backwards."""
        return Curve(tuple(piece.reversed() for piece in self.pieces[::-1]), self.closed)

    def mapped(self, matrix: Floats, shift: Floats) -> Curve:
        """The curve where the affine map x → M x + b takes it."""
        return replace(self, pieces=tuple(piece.mapped(matrix, shift) for piece in self.pieces))

    @property
    def controls(self) -> Floats:
        """(k,d) points that an affine map takes along with the curve."""
        return np.concatenate([piece.controls for piece in self.pieces])

    def part(self, low: float, high: float, at: Floats) -> tuple[Curve, Floats]:
        """The open curve from one parameter to another, and its parameters for those ``at`` (n,) of this one.

        On a closed curve ``high`` may exceed the last parameter.

        >>> quarter, at = circle([0, 0], 2.0).part(0.75, 1.25, np.array([0.75, 1.0, 1.25]))
        >>> at.tolist(), round(quarter.length, 3)
        ([0.0, 1.0, 2.0], 6.283)
        """
        joints = np.arange(math.floor(low) + 1, math.ceil(high))
        stops = np.concatenate([[low], joints, [high]])
        piece = np.floor(stops[:-1]).astype(int)
        cuts = zip(piece % len(self.pieces), stops[:-1] - piece, stops[1:] - piece, strict=True)
        part = Curve(tuple(self.pieces[k].part(start, end) for k, start, end in cuts))
        return part, np.interp(at, stops, np.arange(float(len(stops))))

    def local(self, plane: Plane) -> Curve:
        """The curve in the coordinates of Π: two along it, and the height above it."""
        return replace(self, pieces=tuple(piece.local(plane) for piece in self.pieces))


def polyline(points: npt.ArrayLike, closed: bool = False) -> Curve:
    """Straight segments from point to point, (k,2) or (k,3), k ≥ 2.

    >>> polyline([[0, 0], [3, 0], [3, 4]]).length
    7.0
    """
    P = checked_points(points, "polyline", 2)
    if closed and len(P) > 2 and np.array_equal(P[0], P[-1]):
        P = P[:-1]
    if closed and len(P) < 3:
        raise curve_error("polyline", f"closed, it needs 3 points, found {len(P)}", found=len(P), expected=3)
    following = np.roll(P, -1, axis=0) if closed else P[1:]
    double = np.flatnonzero((P[: len(following)] == following).all(axis=1))
    if len(double):
        first = int(double[0])
        both = f"points {first} and {(first + 1) % len(P)}"
        raise curve_error("polyline", f"{both} are both {P[first].tolist()}; remove one", where=first)
    pieces = tuple(Piece(np.stack(ends)) for ends in zip(P, following, strict=False))
    return _closed_if_ends_meet(Curve(pieces, closed))


def bezier(control: npt.ArrayLike, weights: npt.ArrayLike | None = None) -> Curve:
    """The Bézier curve with control points (k,2) or (k,3), of degree k - 1 ≥ 1.

    ``weights`` (k,) > 0 make it rational, as a span of a NURBS curve is.

    >>> bezier([[0, 0], [1, 2], [2, 0]]).at([0.5]).tolist()
    [[1.0, 1.0]]
    >>> quarter = bezier([[1, 0], [1, 1], [0, 1]], weights=[1, 0.5**0.5, 1])
    >>> round(float(np.linalg.norm(quarter.at([0.3]))), 12)
    1.0
    """
    P = checked_points(control, "bezier", 2)
    if np.ptp(P, axis=0).max() == 0.0:
        raise curve_error("bezier", f"all control points are {P[0].tolist()}")
    if weights is None:
        return _closed_if_ends_meet(Curve((Piece(P),)))
    given = [validate.positive("bezier: weights", w) for w in np.ravel(np.array(weights, dtype=object))]
    if len(given) != len(P):
        problem = f"expected a weight for each of its {len(P)} control points, found {len(given)}"
        raise curve_error("bezier", problem, found=len(given), expected=len(P))
    if max(given) > MOST_UNEVEN * min(given):
        text = f"weights from {min(given):g} to {max(given):g}; the largest may be {MOST_UNEVEN:g} times the"
        raise curve_error("bezier", f"{text} smallest", found=max(given))
    return _closed_if_ends_meet(Curve((Piece(P, weights=np.array(given)),)))


def arc(start: npt.ArrayLike, through: npt.ArrayLike, end: npt.ArrayLike) -> Curve:
    """The circular arc from ``start`` over ``through`` to ``end``, (2,) or (3,) each.

    >>> round(arc([1, 0], [0, 1], [-1, 0]).length, 3)
    3.141
    """
    a, b, c = checked_points([start, through, end], "arc", 3)
    u, v = b - a, c - a
    uu, uv, vv = u @ u, u @ v, v @ v
    area = uu * vv - uv * uv  # squared area of the parallelogram
    if area <= 1e-24 * max(uu, vv) ** 2:
        raise curve_error("arc", "its three points lie on one line; use a polyline")
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
    c = checked_points([centre], "circle", 1)[0]
    axes = validate.positive("circle: radius", radius) * np.eye(2, len(c))
    return Curve((Piece(np.concatenate([[c], axes]), 2.0 * math.pi),), closed=True)


def ellipse(centre: npt.ArrayLike, axes: npt.ArrayLike, sweep: float = 360.0) -> Curve:
    """The ellipse, or an arc of it, about ``centre`` (2,) or (3,).

    ``axes`` are two vectors from the centre: to the start, and to the point a quarter turn on. ``sweep`` is
    the angle, degrees, in which these count as 0 and 90; 360 is the whole ellipse. Two axes of one length
    at a right angle, in space, give a circle in any plane.

    >>> ellipse([0, 0], [[3, 0], [0, 1]], 90).at([1.0]).round(12).tolist()
    [[0.0, 1.0]]
    """
    middle = checked_points([centre], "ellipse", 1)
    P = checked_points([*middle, *checked_points(axes, "ellipse", 2, exactly=True)], "ellipse", 3)
    u, v = P[1:]
    if (u @ u) * (v @ v) - (u @ v) ** 2 <= 1e-24 * max(u @ u, v @ v) ** 2:
        raise curve_error("ellipse", "its axes lie on one line; use a polyline", found=P[1:].tolist())
    angle = validate.number("ellipse: sweep", sweep)
    if not 0.0 < abs(angle) <= 360.0:
        raise curve_error("ellipse", f"sweep must be between 0 and 360 degrees, found {angle:g}", found=angle)
    return Curve((Piece(P, math.radians(angle)),), closed=abs(angle) == 360.0)


def join(*curves: Curve) -> Curve:
    """One path from several open curves, each starting where the one before ends (to 1e-9).

    >>> join(polyline([[0, 0], [2, 0]]), arc([2, 0], [1, 1], [0, 0])).closed
    True
    """
    if not curves:
        raise curve_error("join", "give at least one curve")
    closed = [number for number, curve in enumerate(curves) if curve.closed]
    if closed and len(curves) > 1:
        fault = f"curve {closed[0]} is closed; only open curves can be joined"
        raise curve_error("join", fault, where=closed[0])
    if len({curve.pieces[0].points.shape[1] for curve in curves}) > 1:
        raise curve_error("join", "some curves are plane and some in space; give all in space")
    tolerance = ON * max(curve.length for curve in curves)
    for number in range(1, len(curves)):
        before, after = _end(curves[number - 1], 1), _end(curves[number], 0)
        if np.linalg.norm(after - before) > tolerance:
            gap = f"curve {number} starts at {after.tolist()}, but curve {number - 1} ends at"
            raise curve_error("join", f"{gap} {before.tolist()}", where=number)
    return _closed_if_ends_meet(Curve(tuple(piece for curve in curves for piece in curve.pieces)))


def _closed_if_ends_meet(path: Curve) -> Curve:
    """The path as a closed one if it ends where it starts."""
    gap = float(np.linalg.norm(_end(path, 1) - _end(path, 0)))
    return replace(path, closed=path.closed or gap <= ON * path.length)


def _end(path: Curve, end: int) -> Floats:
    return path.at([float(end * len(path.pieces))])[0]


def curve_error(what: str, problem: str, **fields: object) -> OptionError:
    """The error about a kind of curve."""
    return OptionError(f"{what}: {problem}", what=what, **fields)


def checked_points(points: Any, what: str, least: int, exactly: bool = False) -> Floats:
    """(k,2) or (k,3) the points, checked."""
    try:
        P = np.array(points)
    except (TypeError, ValueError):
        P = np.array("ragged")
    if P.dtype.kind not in "iuf":  # numpy would take the text "8" for a number
        raise curve_error(what, "expected points, all [x, y] or all [x, y, z]", found=points)
    P = P.astype(float)
    if P.ndim != 2 or P.shape[1] not in (2, 3):
        found = f"{len(P)} lists of points; a curve is one" if P.ndim == 3 else f"shape {P.shape}"
        raise curve_error(what, f"expected points [x, y] or [x, y, z], found {found}", found=P.shape)
    if len(P) < least or (exactly and len(P) != least):
        raise curve_error(what, f"expected {least} points, found {len(P)}", found=len(P), expected=least)
    bad = np.flatnonzero(~np.isfinite(P).all(axis=1))
    if len(bad):
        raise curve_error(what, f"point {bad[0]} = {P[bad[0]].tolist()} is not finite", where=int(bad[0]))
    return P
