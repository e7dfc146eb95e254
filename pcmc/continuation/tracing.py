"""From point to point along a branch: steps, events between them, and the mesh.

A step goes along the tangent, and Newton's method brings it back onto the branch (`point`). Steps
shorten where the branch bends. Where a goal, a fold or a change of index lies between two points, the
branch is searched there (`between`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..base.arrays import Floats
from ..base.errors import OptionError, SurfaceError
from ..energy.rigid_motions import rigid_modes, rigid_motions
from ..meshing.remeshing import remesh
from ..solvers import solve
from ..solvers.result import Callback, Progress, Status
from ..surface import Surface
from .between import EXACT, Stretch, passes, quantity
from .direction import Line
from .options import Ending, FollowOptions
from .point import (
    Border,
    Collapsed,
    Lost,
    Solution,
    Station,
    Touched,
    across,
    at_height,
    at_parameter,
    at_volume,
    correct,
    examine,
    transferred,
)
from .shape import Shape

AT_REST = 1e-4  # relative residual up to which a surface counts as near enough to start from
SPOILT = 0.7  # ratio of triangle qualities, new to old, below which a step is refused
NEAR = 0.02  # length of a step at which new contact, solved for by itself, still counts as the same
BEND = 0.1  # correction over step length that sets the next step
BENT = 0.5  # correction over step length above which a step is refused
WEARY = 7  # Newton steps of a correction: one that took more may have ended on another branch


@dataclass(frozen=True, eq=False)
class Step:
    """A step that succeeded: the stretch gone, the correction over its length, what lies between."""

    stretch: Stretch
    bend: float
    at_goal: bool
    events: list[dict[str, Any]]


class Tracer:
    """A branch while it is followed; ``here`` is its last point."""

    def __init__(
        self,
        surface: Surface,
        line: Line,
        goals: Mapping[str, float],
        options: FollowOptions,
        callback: Callback | None,
    ) -> None:
        self.line, self.goals, self.options, self.callback = line, goals, options, callback
        self.scale = line.scale
        self.rows: list[dict[str, Any]] = []
        self.events: list[dict[str, Any]] = []
        self.surfaces: dict[int, Surface] = {}
        self.arclength = 0.0
        self.here = self.start(Shape(surface, options.backend))

    def start(self, shape: Shape) -> Station:
        """The first point, on the branch to the tolerance."""
        X, value = shape.surface.vertices, self.line.value
        space = shape.space(X)
        drifts = rigid_modes(space, rigid_motions(shape.surface), X).shape[1]
        if drifts:
            raise SurfaceError(
                f"follow: nothing holds the surface against {drifts} rigid motions, and it would"
                " drift instead of following the parameter; hold it with fixed= or on_plane="
            )
        moves = space.to_coordinates(self.line.gradient(shape.surface, X)).any()
        if not (moves or shape.resting.any()):  # a wall that is gone may come back
            raise OptionError(
                "the parameter moves nothing: no vertex of what it names is free, or a change of it"
                " leaves every force as it is, as that of a flat patch's tension does"
            )
        try:
            residual = shape.residual(X)
            if not residual <= AT_REST:
                raise Lost(f"relative residual {residual:.1e}")
            if shape.unheld(self.line, value, X).any():
                raise Lost("a junction is pulled off the plane harder than its wall can hold")
            border = at_parameter(value, self.scale)
            found = correct(shape, self.line, X, value, border, self.options.tolerance)
            return examine(found, self.line, self.scale, math.copysign(1.0, self.options.step))
        except Lost as why:
            raise SurfaceError(
                f"follow: the surface is not at rest ({why}); solve it first, with"
                " pcmc.solve(surface, target='stationary').surface where it is a saddle"
            ) from None

    def run(self) -> tuple[Ending, str]:
        """Follow to the end; why it ended, and the last difficulty."""
        try:
            self.record()
            if any(quantity(self.here, name) == goal for name, goal in self.goals.items()):
                return Ending.REACHED, ""
            return self.advance()
        except (StopIteration, KeyboardInterrupt):
            return Ending.STOPPED, ""

    def advance(self) -> tuple[Ending, str]:
        """Step after step."""
        length, why = min(abs(self.options.step), self.options.largest), ""
        for _ in range(self.options.steps):
            step = None
            while step is None:
                try:
                    step = self.step(length)
                except Lost as lost:
                    length, why = 0.5 * length, str(lost)
                    if length < self.options.smallest:
                        collapsed = isinstance(lost, Collapsed)
                        return Ending.DEGENERATE if collapsed else Ending.LOST, why
            self.events += step.events
            self.arclength += step.stretch.length
            self.here = step.stretch.there
            self.record()
            if step.at_goal:
                return Ending.REACHED, ""
            folds = sum(event["kind"] == "fold" for event in self.events)
            if self.options.folds is not None and folds >= self.options.folds:
                return Ending.FOLDS, ""
            self.tend()
            longer = min(2.0, max(0.5, BEND / max(step.bend, 1e-9)))
            length = min(longer * length, self.options.largest)
        return Ending.STEPS, why

    # -- one step ------------------------------------------------------------------------------

    def step(self, length: float) -> Step:
        """The next point, at this length or nearer where a goal is."""
        here = self.here
        try:
            found = self.solution(length)
            if found.shape.unheld(self.line, found.value, found.X).any():
                raise Touched(found.X, found.value)
        except Touched as touched:
            found = self.resettled(touched)
        bend = self.bend(found, length)
        if found.iterations > WEARY and found.shape is here.shape:
            raise Lost("the correction hardly converges")
        if here.shape.turned(here.X, found.X):
            raise Collapsed("triangles turn over")
        if found.shape.quality(found.X) < SPOILT * min(here.quality, self.options.min_quality):
            raise Collapsed("triangles collapse")
        there = examine(found, self.line, self.scale, here)
        stretch = Stretch(self.line, self.scale, here, there, length, self.solution)
        goal = stretch.goal(self.goals)
        if goal is not None:
            if not stretch.same_mesh:
                raise Lost("the contact of a wall with the plane changes just before the goal")
            stretch = stretch.cut(goal)
        return Step(stretch, bend, goal is not None, self.search(stretch))

    def bend(self, found: Solution, length: float) -> float:
        """How far the point found is from the tangent, over the length of the step."""
        X, value = self.ahead(length)
        apart = self.here.length(found.X - X, found.value - value, self.scale)
        if found.shape is not self.here.shape and apart < BENT * NEAR:
            return BEND
        if apart > BENT * length:
            raise Lost("the branch bends too sharply for the step")
        return apart / length

    def ahead(self, t: float) -> tuple[Floats, float]:
        """The point of the tangent at arclength t from here."""
        here = self.here
        X = here.shape.swept(here.X + t * here.direction, here.shape.space(here.X))
        return X, here.value + t * here.slope

    def solution(self, t: float) -> Solution:
        """The point of the branch at arclength t from here."""
        X, value = self.ahead(t)
        return correct(
            self.here.shape, self.line, X, value, self.border(t, X, value), self.options.tolerance
        )

    def border(self, t: float, X: Floats, value: float) -> Border:
        """What the control prescribes at arclength t from here."""
        here, shape = self.here, self.here.shape
        if self.options.control == "parameter":
            return at_parameter(value, self.scale)
        if self.options.control == "volume":
            growth = float((shape.volume_gradient(here.X) * here.direction).sum())
            return at_volume(shape, here.volume + t * growth)
        if self.options.control == "height":
            return at_height(shape, shape.top(X), shape.height(X))
        return across(X, value, *here.row(self.scale))

    def resettled(self, touched: Touched) -> Solution:
        """Another contact with Π: solved at a fixed parameter, with a shape of its own."""
        shape = self.here.shape
        surface = self.line.applied(shape.landed(touched.X), touched.value)
        result = solve(
            surface, "newton", target="stationary", tolerance=self.options.tolerance,
            backend=self.options.backend,
        )  # fmt: skip
        if result.status is Status.STOPPED:  # solvers keep Ctrl-C to themselves
            raise KeyboardInterrupt
        if not result.converged:
            raise Lost(f"contact of a wall with the plane changes, and {result.message}")
        again = Shape(result.surface, self.options.backend)
        X = again.surface.vertices
        return Solution(again, X, touched.value, again.residual(X), result.iterations)

    def tend(self) -> None:
        """Spread the triangles where they are poor, or remesh, and return to the branch."""
        aim = self.options.min_quality
        if self.here.quality < aim:
            X = self.here.shape.redistribute(self.here.X, aim)
            if X is not None:
                self.settle(self.here, X)
        if self.options.remesh is not None and self.here.quality < aim:
            try:
                shape = Shape(remesh(self.surface(), self.options.remesh), self.options.backend)
            except SurfaceError:
                return
            self.settle(transferred(self.here, shape), shape.surface.vertices)

    def settle(self, near: Station, X: Floats) -> None:
        """Go to the point of the branch at X, across the tangent of a station of the same mesh.

        Not past a goal; and not where that is an event in itself, unless the mesh is very poor. On the
        old mesh both will be found in their places.
        """
        here = self.here
        border = across(X, near.value, *near.row(self.scale))
        try:
            found = correct(near.shape, self.line, X, near.value, border, self.options.tolerance)
            after = examine(found, self.line, self.scale, near)
        except Lost:
            return
        if passes(here, after, self.goals):
            return
        events = self.unlocated(here, after, 0.0)
        if after.quality > here.quality and not (
            events and here.quality > 0.5 * self.options.min_quality
        ):
            self.events += events
            self.here = after

    # -- events --------------------------------------------------------------------------------

    def search(self, stretch: Stretch) -> list[dict[str, Any]]:
        """The events on a stretch, in their order."""
        here, there, length = stretch.here, stretch.there, stretch.length
        if not stretch.same_mesh:
            events = self.unlocated(here, there, length)
            if (here.shape.resting != there.shape.resting).any():
                events.insert(0, self.event("contact", there, length, here.index, there.index))
            return events
        if length <= 2.0 * EXACT:
            return self.unlocated(here, there, length)
        found = []
        if stretch.fold is not None:
            at = stretch.station(stretch.fold)
            event = self.event("fold", at, stretch.fold, here.index, there.index)
            found.append((stretch.fold, event))
        sign = 1 if there.index > here.index else -1
        index = here.index
        for t, count in stretch.index_changes():
            at = stretch.station(t)
            found.append((t, self.event("index", at, t, index, index + sign * count)))
            index += sign * count
        return [event for _, event in sorted(found, key=lambda pair: pair[0])]

    def unlocated(self, before: Station, after: Station, length: float) -> list[dict[str, Any]]:
        """Events between two points too near to each other, or too different, to search between."""
        found = []
        if before.slope * after.slope < 0.0:
            found.append(self.event("fold", after, length, before.index, after.index))
        if before.index != after.index:
            found.append(self.event("index", after, length, before.index, after.index))
        return found

    # -- tables --------------------------------------------------------------------------------

    def event(self, kind: str, at: Station, t: float, before: int, after: int) -> dict[str, Any]:
        """A row of the table of events."""
        return {
            "kind": kind, **self.common(at), "arclength": self.arclength + t,
            "index_before": before, "index_after": after,
        }  # fmt: skip

    def record(self) -> None:
        """Write here down as a row of the table of points, and tell the callback."""
        here, number = self.here, len(self.rows)
        self.rows.append({
            **self.common(here), "arclength": self.arclength, "index": here.index,
            "lowest_eigenvalue": here.eigenvalues[0], "residual": here.residual,
            "quality": here.quality, "slope": here.slope, "iterations": here.iterations,
        })  # fmt: skip
        if (number - 1) % self.options.keep:
            self.surfaces.pop(number - 1, None)
        self.surfaces[number] = self.surface()
        if self.callback is not None:
            self.callback(Progress(number, self.surface, self.rows[-1]))

    def common(self, at: Station) -> dict[str, Any]:
        """What both tables show."""
        return {
            "parameter": at.value, **self.line.columns(at.shape.full, at.value),
            "energy": at.energy, "volume": at.volume, "height": at.height,
        }  # fmt: skip

    def surface(self) -> Surface:
        """The surface at the last point."""
        return self.line.applied(self.here.shape.whole(self.here.X), self.here.value)
