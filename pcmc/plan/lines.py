"""The lines of a plan in the plane Π: checks of each, and where two of them meet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any

import numpy as np
import shapely

from ..base.arrays import Floats
from ..base.errors import PlanError
from ..surface.geometry import cross_2d
from .curves import Curve

SNAP = 0.01  # of the edge length: lines nearer to each other than this meet


class Kind(IntEnum):
    """Kinds of lines. Where lines meet, the one with the lowest kind gives the position of the point."""

    OUTLINE = 0
    HOLE = 1
    SUPPORT = 2
    DIVIDER = 3


@dataclass(frozen=True, eq=False)
class Line:
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
    def reach(self) -> Floats:
        """(k,) the length of that polyline up to each of its points."""
        return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self.xy, axis=0), axis=1))])

    @cached_property
    def shape(self) -> Any:
        """The polyline as a shapely LineString."""
        if self.reach[-1] == 0.0:
            raise self.error("has no length in plan")
        return shapely.LineString(self.xy)

    def error(self, problem: str, where: object = None, found: object = None) -> PlanError:
        """The error about this line: its name, and what is wrong with it."""
        return PlanError(f"{self.name} {problem}", what=self.name, where=where, found=found)

    def nearest(self, xy: Floats) -> tuple[float, float]:
        """The parameter of the curve's point nearest to xy, and its distance."""
        t = float(np.interp(self.shape.project(shapely.Point(xy)), self.reach, self.curve.dense))
        width, last = 2.0 / 64.0, float(len(self.curve.pieces))
        for _ in range(8):  # each round narrows the bracket 16 times
            trial = np.clip(t + width * np.linspace(-1.0, 1.0, 33), 0.0, last)
            distance = np.linalg.norm(self.curve.at(trial)[:, :2] - xy, axis=1)
            best = int(np.argmin(distance))
            t, width = float(trial[best]), width / 16.0
        return t, float(distance[best])


def point_text(xy: Floats) -> str:
    """A point, for messages."""
    return f"({xy[0]:.6g}, {xy[1]:.6g})"


def overlap(one: Line, other: Line, where: str) -> PlanError:
    """The error for two lines that coincide along some length."""
    return one.error(f"runs along {other.name} {where}; leave that part out", where, other.name)


def check_line(one: Line) -> None:
    """Boundaries are closed, and no line crosses itself."""
    if one.bounds and not one.curve.closed:
        gap = float(np.linalg.norm(one.xy[-1] - one.xy[0]))
        ends = f"it starts at {point_text(one.xy[0])} and ends at {point_text(one.xy[-1])}"
        raise one.error(f"is open: {ends}, {gap:.3g} apart; close it", found=gap)
    if not one.shape.is_simple:
        pieces = shapely.get_parts(shapely.node(one.shape))
        joints = np.concatenate([np.array(p.coords)[[0, -1]] for p in pieces])
        places, count = np.unique(joints.round(9), axis=0, return_counts=True)
        place = places[np.argmax(count)]
        raise one.error(f"crosses itself at {point_text(place)}", tuple(place.tolist()))


def check_holes(lines: Sequence[Line]) -> None:
    """Holes lie inside the outline and apart from each other."""
    outline = shapely.Polygon(lines[0].xy)
    holes = [(one, shapely.Polygon(one.xy)) for one in lines if one.kind is Kind.HOLE]
    for place, (one, area) in enumerate(holes):
        if not outline.contains_properly(area):
            where = "crosses or touches" if outline.intersects(area) else "lies outside"
            raise one.error(f"{where} the outline; a hole must be inside the outline")
        for other, other_area in holes[:place]:
            if area.intersects(other_area):
                problem = f"and {one.name} touch or overlap; join them into one"
                raise other.error(problem, found=one.name)


def inside(lines: Sequence[Line]) -> Callable[[Floats], bool]:
    """A function that tests whether a point is inside the outline and outside all holes."""
    area = shapely.Polygon(lines[0].xy, [one.xy for one in lines if one.kind is Kind.HOLE])
    return lambda xy: bool(shapely.contains_xy(area, *xy))


def lines_at(lines: Sequence[Line], xy: Floats, snap: float, leave_out: int = -1) -> list[tuple[int, float]]:
    """Lines that pass through a point, with their parameter there."""
    near = [(number, *one.nearest(xy)) for number, one in enumerate(lines) if number != leave_out]
    return [(number, t) for number, t, distance in near if distance <= snap]


def crossing(one: Line, s: float, two: Line, t: float) -> tuple[float, float]:
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
        new_s, new_t = (s + float(cross_2d(gap, along_t)) / turn, t + float(cross_2d(gap, along_s)) / turn)
        new_s = min(max(new_s, 0.0), float(len(one.curve.pieces)))
        new_t = min(max(new_t, 0.0), float(len(two.curve.pieces)))
        new_gap = apart(new_s, new_t)
        if np.linalg.norm(new_gap) >= np.linalg.norm(gap):
            break
        s, t, gap = new_s, new_t, new_gap
    return s, t
