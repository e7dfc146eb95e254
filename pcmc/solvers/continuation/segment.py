"""The part of a branch between two of its points: where it meets a goal, turns, or changes its index.

Everything is a function of the arclength t from the first point, on the mesh of that point. A quantity that
turns on the way may pass a goal twice: the goal is searched for before and behind its turning point.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.tolerances import EVENT_ACCURACY, FOLD_ACCURACY, GOAL_ACCURACY
from ...forces.functional import patch_volumes
from .branch_point import BranchPoint, branch_point
from .state import BranchState


def crosses_goal(before: BranchState, after: BranchState, goals: Mapping[str, float]) -> bool:
    """Whether a goal lies between the quantities of two states."""
    off = (((getattr(at, name) - goal) for at in (before, after)) for name, goal in goals.items())
    return any(one * other < 0.0 for one, other in off)


@dataclass(frozen=True, eq=False)
class Segment:
    """The branch from ``start`` over a ``length`` to ``end``; ``solve`` gives the state at t."""

    start: BranchPoint
    end: BranchPoint
    length: float
    solve: Callable[[float], BranchState]

    @property
    def same_mesh(self) -> bool:
        """Whether both ends have one mesh and one contact, so that the segment can be searched."""
        return self.start.state.mesh is self.end.state.mesh

    def point(self, t: float) -> BranchPoint:
        if t == self.length:
            return self.end
        return branch_point(self.solve(t), self.start.tangent)

    def value(self, name: str, t: float) -> float:
        ends = {0.0: self.start.state, self.length: self.end.state}
        return float(getattr(ends[t] if t in ends else self.solve(t), name))

    def derivative(self, name: str, at: BranchPoint) -> float:
        """dq/dt of a quantity at a point, along the tangent."""
        state, tangent = at.state, at.tangent
        if name == "parameter":
            return tangent.slope
        if name == "height":
            normal = np.array(state.rest.surface.plane.normal)
            return float(tangent.direction[state.highest_vertex] @ normal)
        if name == "volume":
            return float((state.volume_gradient * tangent.direction).sum())
        by_position = float((state.rest.gradient * tangent.direction).sum())
        by_parameter = state.mesh.line.energy_derivative(state.rest.surface, state.X, state.parameter)
        cones = state.rest.surface.room_signs @ patch_volumes(state.rest.shape)
        return by_position + by_parameter * tangent.slope - float(cones @ at.room_rates)

    def turning_point(self, name: str) -> float | None:
        """t at which a quantity is extreme; None where its derivatives at the ends have one sign."""
        from scipy.optimize import fminbound  # slow to import

        first = self.derivative(name, self.start)
        if first * self.derivative(name, self.end) >= 0.0:
            return None
        sense, accuracy = math.copysign(1.0, first), max(EVENT_ACCURACY, FOLD_ACCURACY * self.length)
        end = self.length
        return float(fminbound(lambda t: -sense * self.value(name, t), 0.0, end, xtol=accuracy, disp=0))

    @cached_property
    def fold(self) -> float | None:
        """t at which λ turns, if it does."""
        return self.turning_point("parameter")

    def first_goal(self, goals: Mapping[str, float]) -> tuple[float, str] | None:
        """t at which the first of the goals is met, and its name; None where none is."""
        places = [(self._crossing(name, goal), name) for name, goal in goals.items()]
        return min(((t, name) for t, name in places if t is not None), default=None)

    def _crossing(self, name: str, goal: float) -> float | None:
        ends = [0.0, self.length]
        if self.same_mesh:
            turn = self.fold if name == "parameter" else self.turning_point(name)
            ends[1:1] = [] if turn is None else [turn]
        off = [self.value(name, t) - goal for t in ends]
        for k in range(len(ends) - 1):
            if off[k] * off[k + 1] < 0.0:
                return root(lambda t: self.value(name, t) - goal, ends[k], ends[k + 1], GOAL_ACCURACY)
            if off[k + 1] == 0.0:
                return ends[k + 1]
        return None

    def index_changes(self) -> list[tuple[float, int]]:
        """Each t at which eigenvalues change sign, and how many do so there."""
        known = {0.0: self.start.eigenvalues, self.length: self.end.eigenvalues}

        def eigenvalue(t: float, rank: int) -> float:
            if t not in known:
                known[t] = self.point(t).eigenvalues
            return float(known[t][min(rank, len(known[t]) - 1)])

        low, high = sorted((self.start.index, self.end.index))
        places = sorted(
            root(lambda t: eigenvalue(t, rank), 0.0, self.length, EVENT_ACCURACY)  # noqa: B023
            for rank in range(low, high)
        )
        groups: list[tuple[float, int]] = []
        for t in places:
            if groups and t - groups[-1][0] <= 3.0 * EVENT_ACCURACY:
                groups[-1] = (groups[-1][0], groups[-1][1] + 1)
            else:
                groups.append((t, 1))
        return groups


def root(function: Callable[[float], float], start: float, end: float, accuracy: float) -> float:
    """Where a function changes sign on [start, end]; without a change, the end where it is smaller."""
    from scipy.optimize import brentq  # slow to import

    first, last = function(start), function(end)
    if first * last >= 0.0:
        return start if abs(first) < abs(last) else end
    return float(brentq(function, start, end, xtol=accuracy))
