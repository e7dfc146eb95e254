"""The lines of a plan in the plane Π: checks of each, and where two of them meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import PlanError
from ..base.libraries import shapely
from ..surface.curves import Curve
from ..surface.geometry import cross_2d
from ..surface.pieces import point_text

SNAP = 0.01  # of the edge length: lines nearer to each other than this meet
SAG = 1e-3  # of a curve's length: no curve is farther from the chords between its dense points
BLOCK = 64  # chords of a line that are looked up at once
TINY = 1e-300  # no chord without length divides by zero
MOST_CROSSINGS = 20_000  # of lines

Cut = list[tuple[int, float]]  # numbers of lines, and the parameter on each, of one vertex


class Kind(IntEnum):
    """Kinds of lines. Where lines meet, the one with the lowest kind gives the position of the point."""

    OUTLINE = 0
    HOLE = 1
    SUPPORT = 2
    DIVIDER = 3


@dataclass(frozen=True, eq=False)
class PlanLine:
    """A named curve of a plan, in the coordinates of Π: two in the plane, and the height."""

    name: str
    kind: Kind
    curve: Curve

    @property
    def bounds(self) -> bool:
        """Whether the line is part of the plan's boundary."""
        return self.kind in (Kind.OUTLINE, Kind.HOLE)

    @cached_property
    def xy(self) -> Floats:
        """(k,2) its projection on Π as a dense polyline."""
        xy = self.curve.at(self.curve.dense)[:, :2]
        if self.curve.closed:
            xy[-1] = xy[0]  # not only to rounding, so that shapely sees a ring
        return xy

    @cached_property
    def shape(self) -> Any:
        """The polyline as a shapely LineString."""
        if not np.ptp(self.xy, axis=0).any():
            raise self.error("has no length in plan")
        return shapely.LineString(self.xy)

    @cached_property
    def chords(self) -> Any:
        """(k-1,) the segments of the polyline."""
        return shapely.linestrings(np.stack([self.xy[:-1], self.xy[1:]], axis=1))

    @cached_property
    def tree(self) -> Any:
        """Of the chords."""
        return shapely.STRtree(self.chords)

    @property
    def straight(self) -> bool:
        """Whether the chords are the line itself."""
        return len(self.xy) == len(self.curve.pieces) + 1

    def error(self, problem: str, where: object = None, found: object = None) -> PlanError:
        """The error about this line: its name, and what is wrong with it."""
        return PlanError(f"{self.name} {problem}", what=self.name, where=where, found=found)

    def nearest(self, xy: Floats) -> tuple[Floats, Floats]:
        """(n,) parameters of the curve's points nearest to points (n,2), and (n,) their distances."""
        return self.nearest_to(xy, self.tree.nearest(shapely.points(xy)))

    def nearest_to(self, xy: Floats, chord: Ints) -> tuple[Floats, Floats]:
        """As ``nearest``, where the nearest chords (n,) are known."""
        start, along = self.xy[chord], self.xy[chord + 1] - self.xy[chord]
        share = np.einsum("ij,ij->i", xy - start, along) / np.maximum((along**2).sum(axis=1), TINY)
        low, high = self.curve.dense[chord], self.curve.dense[chord + 1]
        t = low + np.clip(share, 0.0, 1.0) * (high - low)
        trials, last = np.linspace(-1.0, 1.0, 33), float(len(self.curve.pieces))
        for width in () if self.straight else 2.0 / 64.0 / 16.0 ** np.arange(8):
            trial = np.clip(t[:, None] + width * trials, 0.0, last)  # narrows the bracket 16 times
            at = self.curve.at(trial.ravel())[:, :2].reshape(*trial.shape, 2)
            t = trial[np.arange(len(t)), np.argmin(np.linalg.norm(at - xy[:, None], axis=2), axis=1)]
        return t, np.linalg.norm(self.curve.at(t)[:, :2] - xy, axis=1)


def is_straight(curve: Curve, tolerance: float) -> bool:
    """Whether a curve on Π is a straight line from its start to its end, to ``tolerance``."""
    along = curve.at(curve.dense)[:, :2] - curve.at(0.0)[:, :2]
    most = tolerance * (float(np.linalg.norm(along[-1])) or 1.0)
    return not curve.closed and bool((np.abs(cross_2d(along[-1], along)) <= most).all())


class LineTree:
    """Which lines pass near points, and where lines cross: a tree of the chords of all lines."""

    def __init__(self, lines: Sequence[PlanLine]) -> None:
        self.lines = lines
        count = [len(line.chords) for line in lines]
        self.owner = np.repeat(np.arange(len(lines)), count)
        self.chord = np.arange(len(self.owner)) - np.repeat(np.cumsum(count) - count, count)
        self.chords = np.concatenate([line.chords for line in lines])
        self.tree = shapely.STRtree(self.chords)
        self.sag = max(0.0 if line.straight else SAG * line.shape.length for line in lines)

    def at(self, xy: Floats, snap: float) -> list[Cut]:
        """For each point (n,2) the lines that pass through it, to ``snap``, with their parameters there."""
        points = shapely.points(xy)
        point, chord = self.tree.query(points, predicate="dwithin", distance=snap + self.sag)
        near = np.argsort(shapely.distance(points[point], self.chords[chord]), kind="stable")
        pair = point[near] * len(self.lines) + self.owner[chord[near]]
        first = near[np.unique(pair, return_index=True)[1]]  # the nearest chord of each line
        point, owner, chord = point[first], self.owner[chord[first]], self.chord[chord[first]]
        passing: list[Cut] = [[] for _ in xy]
        t, distance = np.empty((2, len(point)))
        for number in np.unique(owner):
            own = owner == number
            t[own], distance[own] = self.lines[number].nearest_to(xy[point[own]], chord[own])
        for k in np.flatnonzero(distance <= snap):
            passing[point[k]].append((int(owner[k]), float(t[k])))
        return passing

    def leaves(self, curve: Curve, step: float, snap: float) -> Floats | None:
        """The first point (2,) of a curve, in steps of a length, that is on no line; None if all are."""
        points = curve.samples(step)[:, :2]
        return next((xy for xy, at in zip(points, self.at(points, snap), strict=True) if not at), None)

    @cached_property
    def area(self) -> Any:
        """The polygon inside the outline and outside all holes."""
        area = shapely.Polygon(self.lines[0].xy, [line.xy for line in self.lines if line.kind is Kind.HOLE])
        shapely.prepare(area)
        return area

    def crossings(self) -> list[Cut]:
        """The places where two lines cross that are not both of the boundary."""
        bounds = np.array([line.bounds for line in self.lines])[self.owner]
        own = np.flatnonzero(~bounds)
        one, two = self.tree.query(self.chords[own], predicate="intersects")
        one = own[one]
        once = (self.owner[two] < self.owner[one]) | bounds[two]
        pairs = np.stack([two, one], axis=1)[once & (self.owner[two] != self.owner[one])]
        turned = self.owner[pairs[:, 0]] > self.owner[pairs[:, 1]]
        pairs[turned] = pairs[turned, ::-1]
        if len(pairs) > MOST_CROSSINGS:
            problem = f"the lines of the plan cross at {len(pairs)} places; at most {MOST_CROSSINGS} are"
            raise PlanError(f"{problem} allowed: draw fewer dividers", what="dividers", found=len(pairs))
        pairs = pairs[np.lexsort(self.owner[pairs].T)]
        parts = shapely.intersection(self.chords[pairs[:, 0]], self.chords[pairs[:, 1]])
        places = []
        for pair, part in zip(pairs, parts, strict=True):
            i, j = self.owner[pair].tolist()
            one, two = self.lines[i], self.lines[j]
            start, end = np.array(part.coords)[[0, -1]]
            if part.geom_type != "Point":
                raise overlap(two, one, f"from {point_text(start)} to {point_text(end)}")
            chords = zip((one, two), pair, strict=True)
            s, t = (float(line.nearest_to(start[None], self.chord[[k]])[0][0]) for line, k in chords)
            s, t = (s, t) if one.straight and two.straight else crossing(one, s, two, t)
            places.append([(i, s), (j, t)])
        return places


def overlap(one: PlanLine, other: PlanLine, where: str) -> PlanError:
    """The error for two lines that coincide along some length."""
    return one.error(f"runs along {other.name} {where}; leave that part out", where, other.name)


def check_line(one: PlanLine) -> None:
    """Boundaries are closed, and no line crosses itself."""
    if one.bounds and not one.curve.closed:
        gap = float(np.linalg.norm(one.xy[-1] - one.xy[0]))
        ends = f"it starts at {point_text(one.xy[0])} and ends at {point_text(one.xy[-1])}"
        raise one.error(f"is open: {ends}, {gap:.3g} apart; close it", found=gap)
    if one.shape.is_simple:
        return
    place, count = one.xy[0], len(one.chords)
    for begin in range(0, count, BLOCK):  # few chords at a time, as loops may cross without number
        i, j = one.tree.query(one.chords[begin : begin + BLOCK], predicate="intersects")
        i += begin
        i, j = i[i < j], j[i < j]
        parts = shapely.intersection(one.chords[i], one.chords[j])
        joined = (j - i == 1) | (one.curve.closed & (j - i == count - 1))
        found = parts[~joined | (shapely.length(parts) > 0.0)]
        if len(found):
            place = np.array(found[0].coords)[0]
            break
    raise one.error(f"crosses itself at {point_text(place)}", tuple(place.tolist()))


def check_holes(lines: Sequence[PlanLine]) -> None:
    """Holes lie inside the outline and apart from each other."""
    outline = shapely.Polygon(lines[0].xy)
    shapely.prepare(outline)
    holes = [one for one in lines if one.kind is Kind.HOLE]
    areas = np.array([shapely.Polygon(one.xy) for one in holes], dtype=object)
    for place in np.flatnonzero(~shapely.contains_properly(outline, areas)):
        where = "crosses or touches" if outline.intersects(areas[place]) else "lies outside"
        raise holes[place].error(f"{where} the outline; a hole must be inside the outline")
    i, j = shapely.STRtree(areas).query(areas, predicate="intersects")
    for first, second in zip(i[i < j], j[i < j], strict=True):
        other = holes[second].name
        raise holes[first].error(f"and {other} touch or overlap; join them into one", found=other)


def crossing(one: PlanLine, s: float, two: PlanLine, t: float) -> tuple[float, float]:
    """The parameters at which two curves cross, by Newton's method from initial guesses."""

    def apart(s: float, t: float) -> Floats:
        return (two.curve.at([t]) - one.curve.at([s]))[0, :2]

    gap, step = apart(s, t), 1e-6
    for _ in range(8):
        along_s = (apart(s - step, t) - apart(s + step, t)) / (2.0 * step)
        along_t = (apart(s, t + step) - apart(s, t - step)) / (2.0 * step)
        turn = float(cross_2d(along_s, along_t))
        if abs(turn) < 1e-9 * float(np.linalg.norm(along_s) * np.linalg.norm(along_t)):
            break
        new_s = min(max(s + float(cross_2d(gap, along_t)) / turn, 0.0), float(len(one.curve.pieces)))
        new_t = min(max(t + float(cross_2d(gap, along_s)) / turn, 0.0), float(len(two.curve.pieces)))
        new_gap = apart(new_s, new_t)
        if np.linalg.norm(new_gap) >= np.linalg.norm(gap):
            break
        s, t, gap = new_s, new_t, new_gap
    return s, t
