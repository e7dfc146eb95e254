"""What lies between two points of a branch: where it meets a goal, turns, or changes its index.

Everything is sought as a function of the arclength t from the first point, on the mesh of that point. A
quantity that turns in between may pass a goal twice, with both ends on one side of it: so its turn is
found first, and the goal is sought before it and behind it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..energy.functional import energy_and_gradient, energy_at
from .direction import Line
from .point import Solution, Station, examine

EXACT = 2e-5  # arclength to which events are located, and so λ relative to its scale
FINE = 1e-3  # of the stretch: the same for folds, where λ hardly changes with t
MET = 1e-12  # arclength to which goals are met

_FIELD = {"parameter": "value", "energy": "energy", "volume": "volume", "height": "height"}
GOALS = tuple(_FIELD)  # quantities that a goal may name


def quantity(at: Station, name: str) -> float:
    """The parameter, energy (force·length), volume (length³) or height (length) at a point."""
    return float(getattr(at, _FIELD[name]))


def passes(before: Station, after: Station, goals: Mapping[str, float]) -> bool:
    """Whether a goal lies between two points, by their values alone."""
    return any(
        (quantity(before, name) - goal) * (quantity(after, name) - goal) < 0.0
        for name, goal in goals.items()
    )


@dataclass(frozen=True, eq=False)
class Stretch:
    """The branch between two of its points.

    Attributes
    ----------
    line, scale : the parameter λ, and its size in the metric of arclength.
    here, there : the ends.
    length : arclength t of ``there`` from ``here``.
    solution : the point of the branch at t, on the mesh of ``here``.
    """

    line: Line
    scale: float
    here: Station
    there: Station
    length: float
    solution: Callable[[float], Solution]

    @property
    def same_mesh(self) -> bool:
        """Whether both ends have one mesh and one contact, so that it can be searched."""
        return self.here.shape is self.there.shape

    def station(self, t: float) -> Station:
        """The point at t, examined."""
        if t == self.length:
            return self.there
        return examine(self.solution(t), self.line, self.scale, self.here)

    def cut(self, t: float) -> Stretch:
        """The part of it up to t."""
        return replace(self, there=self.station(t), length=t)

    def value(self, name: str, t: float) -> float:
        """A quantity at t."""
        if t in (0.0, self.length):
            return quantity(self.there if t else self.here, name)
        found, shape = self.solution(t), self.here.shape
        if name == "parameter":
            return found.value
        if name == "energy":
            return energy_at(self.line.applied(shape.surface, found.value), found.X)
        return shape.volume(found.X) if name == "volume" else shape.height(found.X)

    def rate(self, name: str, at: Station) -> float:
        """dq/dt of a quantity at a point, along the tangent."""
        shape = at.shape
        if name == "parameter":
            return at.slope
        if name == "height":
            return float(at.direction[shape.top(at.X)] @ np.array(shape.surface.plane.normal))
        if name == "volume":
            return float((shape.volume_gradient(at.X) * at.direction).sum())
        surface = self.line.applied(shape.surface, at.value)
        slide = float((energy_and_gradient(surface, at.X)[1] * at.direction).sum())
        return slide + self.line.energy_rate(surface, at.X) * at.slope

    # -- turns and goals -----------------------------------------------------------------------

    def turn(self, name: str) -> float | None:
        """t at which a quantity is extreme; None where its rates at the ends have one sign."""
        from scipy.optimize import minimize_scalar  # here, so that importing pcmc stays quick

        before = self.rate(name, self.here)
        if before * self.rate(name, self.there) >= 0.0:
            return None
        sense = math.copysign(1.0, before)
        found = minimize_scalar(
            lambda t: -sense * self.value(name, t), bounds=(0.0, self.length), method="bounded",
            options={"xatol": max(EXACT, FINE * self.length)},
        )  # fmt: skip
        return float(found.x)

    @cached_property
    def fold(self) -> float | None:
        """t at which λ turns, if it does."""
        return self.turn("parameter")

    def goal(self, goals: Mapping[str, float]) -> float | None:
        """t at which the first of the goals is met; None where none is."""
        places = [t for name, goal in goals.items() if (t := self._meets(name, goal)) is not None]
        return min(places, default=None)

    def _meets(self, name: str, goal: float) -> float | None:
        ends = [0.0, self.length]
        if self.same_mesh:
            turn = self.fold if name == "parameter" else self.turn(name)
            ends[1:1] = [] if turn is None else [turn]
        off = [self.value(name, t) - goal for t in ends]
        for k in range(len(ends) - 1):
            if off[k] * off[k + 1] < 0.0:
                return root(lambda t: self.value(name, t) - goal, ends[k], ends[k + 1], MET)
            if off[k + 1] == 0.0:
                return ends[k + 1]
        return None

    # -- changes of index ----------------------------------------------------------------------

    def index_changes(self) -> list[tuple[float, int]]:
        """Each t at which eigenvalues change sign, and how many do so there."""
        known = {0.0: self.here.eigenvalues, self.length: self.there.eigenvalues}

        def eigenvalue(t: float, rank: int) -> float:
            if t not in known:
                known[t] = self.station(t).eigenvalues
            values = known[t]
            return float(values[min(rank, len(values) - 1)])

        low, high = sorted((self.here.index, self.there.index))
        places = sorted(
            root(lambda t: eigenvalue(t, rank), 0.0, self.length, EXACT)  # noqa: B023
            for rank in range(low, high)
        )
        groups: list[tuple[float, int]] = []
        for t in places:
            if groups and t - groups[-1][0] <= 3.0 * EXACT:
                groups[-1] = (groups[-1][0], groups[-1][1] + 1)
            else:
                groups.append((t, 1))
        return groups


def root(function: Callable[[float], float], start: float, end: float, accuracy: float) -> float:
    """Where a function changes sign on [start, end]; the end nearer to it where it does not quite."""
    from scipy.optimize import brentq

    first, last = function(start), function(end)
    if first * last >= 0.0:
        return start if abs(first) < abs(last) else end
    return float(brentq(function, start, end, xtol=accuracy))
