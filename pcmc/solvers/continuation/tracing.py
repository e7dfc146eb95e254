"""From point to point along a branch: steps, the events between them, and the mesh.

A step goes along the tangent, and Newton's method brings it back onto the branch (``branch_point``). Where a
goal, a fold or a change of index lies between two points, the branch is searched there (``segment``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ...base.errors import NoBranch, SurfaceError
from ...base.tolerances import EVENT_ACCURACY, START_RESIDUAL
from ...forces.rooms import room_pressures
from ...meshing.quality import redistribute, turns_over
from ...meshing.remeshing import remesh
from ...surface import Surface
from .. import solve_once
from ..result import Callback, Progress, unless_stopped
from .branch_point import (
    BranchPoint,
    ContactChanged,
    MeshCollapsed,
    NotOnBranch,
    Tangent,
    along_branch,
    branch_point,
    correct,
    fixed_arclength,
    fixed_height,
    fixed_parameter,
    fixed_volume,
)
from .options import Ending, FollowOptions
from .parameters import ParameterLine
from .segment import Segment, crosses_goal
from .state import BranchMesh, BranchState

QUALITY_LOSS = 0.7  # ratio of triangle qualities, new to old, below which a step is refused
CLEARLY_BETTER = 1.02  # ratio of the qualities of a redistributed mesh and the old one
CONTACT_STEP = 0.02  # length of a step at which a new contact, solved for by itself, is near enough
BEND = 0.1  # correction over step length that the next step aims at
MAX_BEND = 0.5  # correction over step length above which a step is refused
MANY_ITERATIONS = 7  # a correction that took more Newton steps may have ended on another branch


class Tracer:
    """A branch while it is followed from ``first``, or else from a surface; ``here`` is its last point."""

    def __init__(
        self,
        surface: Surface,
        line: ParameterLine,
        goals: Mapping[str, float],
        options: FollowOptions,
        callback: Callback | None,
        first: BranchPoint | None = None,
    ) -> None:
        self.line, self.goals, self.options, self.callback = line, goals, options, callback
        self.rows: list[dict[str, Any]] = []
        self.events: list[dict[str, Any]] = []
        self.surfaces: dict[int, Surface] = {}
        self.arclength, self.held = 0.0, False  # whether walls with held bottoms can pinch
        self.in_vain = ""  # what became of the last new mesh, if it was not used
        self.here = first or self.first_point(self.mesh(surface))

    def mesh(self, surface: Surface) -> BranchMesh:
        """A mesh of the branch; where walls with held bottoms have pinched once, they can from then on."""
        mesh = BranchMesh(surface, self.line, self.options.backend, self.held)
        self.held = self.held or bool(mesh.part.walls.held.any())
        return mesh

    def first_point(self, mesh: BranchMesh) -> BranchPoint:
        """The surface given, corrected to the tolerance."""
        start = BranchState(mesh, mesh.surface.vertices, self.line.value)
        free = start.rest.rigid.shape[1]
        if free:
            message = f"follow: nothing holds the surface against {free} rigid motions"
            hint = "it would drift instead of following the parameter; hold it with fixed= or on_plane="
            raise NoBranch(f"{message}; {hint}", what="surface", found=free, expected=0)
        if not (start.parameter_derivative.any() or mesh.part.resting.any()):  # a wall may come back
            reasons = "its patches have no free vertex, or they are flat and only their tension varies"
            raise NoBranch(f"the parameter changes no force: {reasons}", what="parameter")
        try:
            if not start.rest.residual <= START_RESIDUAL:
                raise NotOnBranch(f"relative residual {start.rest.residual:.1e}")
            if start.rest.excess_pull.any():
                raise NotOnBranch("a junction is pulled off the plane harder than its wall can hold")
            given = fixed_parameter(start.parameter, self.line.scale)
            corrected = correct(start, given, self.options.tolerance)
            return branch_point(corrected, math.copysign(1.0, self.options.step))
        except NotOnBranch as reason:
            message = f"follow: the surface is not at rest ({reason}); solve it first, with"
            message += " pcmc.solve(surface, target='stationary').surface where it is a saddle"
            found = start.rest.residual
            raise NoBranch(message, what="surface", found=found, expected=START_RESIDUAL) from None

    def run(self) -> tuple[Ending, str]:
        """Follow the branch to its end; why it ends, and the last difficulty."""
        self.record()
        if any(getattr(self.here.state, name) == goal for name, goal in self.goals.items()):
            return Ending.REACHED, ""
        length, difficulty = min(abs(self.options.step), self.options.largest), ""
        for _ in range(self.options.steps):
            while True:
                try:
                    segment, bend, at_goal, events = self.step(length)
                    break
                except NotOnBranch as reason:
                    length, difficulty = 0.5 * length, str(reason)
                    if length < self.options.smallest and self.let_held_walls_pinch():
                        length = min(CONTACT_STEP, self.options.largest)
                    elif length < self.options.smallest:
                        collapsed = isinstance(reason, MeshCollapsed)
                        return Ending.DEGENERATE if collapsed else Ending.LOST, difficulty + self.in_vain
            self.events += events
            self.arclength += segment.length
            self.here = segment.end
            self.record()
            if at_goal:
                return Ending.REACHED, ""
            folds = sum(event["kind"] == "fold" for event in self.events)
            if self.options.folds is not None and folds >= self.options.folds:
                return Ending.FOLDS, ""
            self.maintain_mesh()
            longer = min(2.0, max(0.5, BEND / max(bend, 1e-9)))
            length = min(longer * length, self.options.largest)
        return Ending.STEPS, difficulty

    def step(self, length: float) -> tuple[Segment, float, bool, list[dict[str, Any]]]:
        """The next segment, of this length, or shorter to a goal; its correction over its length, whether it
        ends at a goal, and the events on it.
        """
        here = self.here.state
        try:
            there = self.solve_at(length)
            if there.rest.excess_pull.any():
                raise ContactChanged(there)
        except ContactChanged as change:
            there = self.solve_contact(change.near)
        bend = self.bend(there, length)
        if there.iterations > MANY_ITERATIONS and there.mesh is here.mesh:
            raise NotOnBranch("the correction hardly converges")
        if turns_over(here.X, there.X, here.mesh.part.quality_faces):
            raise MeshCollapsed("triangles turn over")
        if there.quality < QUALITY_LOSS * min(here.quality, self.options.min_quality):
            raise MeshCollapsed("triangles collapse")
        end = branch_point(there, self.here.tangent)
        segment = Segment(self.here, end, length, self.solve_at)
        goal = segment.first_goal(self.goals)
        if goal is not None:
            if not segment.same_mesh:
                raise NotOnBranch("the contact of a wall with the plane changes just before the goal")
            end = segment.point(goal[0])
            asked = self.goals[goal[1]]
            if goal[1] == "parameter" and end.state.parameter != asked:  # no search finds the last digit
                given = fixed_parameter(asked, self.line.scale)
                end = branch_point(correct(end.state, given, self.options.tolerance), self.here.tangent)
            segment = replace(segment, end=end, length=goal[0])
        return segment, bend, goal is not None, self.events_on(segment)

    def bend(self, there: BranchState, length: float) -> float:
        """Distance of a state from the tangent, over the length of the step."""
        ahead = self.predict(length)
        distance = self.here.tangent.length(there.X - ahead.X, there.parameter - ahead.parameter)
        if there.mesh is not self.here.state.mesh and distance < MAX_BEND * CONTACT_STEP:
            return BEND
        if distance > MAX_BEND * length:
            raise NotOnBranch("the branch bends too sharply for the step")
        return distance / length

    def predict(self, t: float) -> BranchState:
        """The state on the tangent at arclength t from here."""
        here, tangent = self.here.state, self.here.tangent
        return here.step(t * tangent.direction, here.parameter + t * tangent.slope)

    def solve_at(self, t: float) -> BranchState:
        """The state on the branch at arclength t from here, as far as the control says on the tangent."""
        here, tangent, ahead = self.here.state, self.here.tangent, self.predict(t)
        if self.options.control == "parameter":
            asked = fixed_parameter(ahead.parameter, self.line.scale)
        elif self.options.control == "volume":
            growth = float((here.volume_gradient * tangent.direction).sum())
            asked = fixed_volume(here.mesh, here.volume + t * growth)
        elif self.options.control == "height":
            asked = fixed_height(here.mesh, ahead.highest_vertex, ahead.height)
        else:
            asked = fixed_arclength(ahead, tangent.row, tangent.rate)
        return correct(ahead, asked, self.options.tolerance)

    def solve_contact(self, near: BranchState) -> BranchState:
        """The state with a new contact with Π, solved at a fixed parameter, on a mesh of its own."""
        part = near.rest.part
        whole = part.whole_at(part.landed(near.X, near.mesh.reaches_plane(near.X)))
        given = {"tolerance": self.options.tolerance, "backend": self.options.backend}
        result = unless_stopped(solve_once(whole, target="stationary", **given))
        if not result.converged:
            raise NotOnBranch(f"contact of a wall with the plane changes, and {result.message}")
        mesh = self.mesh(result.surface)
        return BranchState(mesh, mesh.surface.vertices, near.parameter, result.iterations)

    def maintain_mesh(self) -> None:
        """Redistribute the vertices where triangles are poor, or remesh, and return to the branch."""
        here, tangent, wanted = self.here.state, self.here.tangent, self.options.min_quality
        if here.quality < wanted:
            X, quality = redistribute(here.mesh.part, here.X, wanted, slide=False)
            if quality > CLEARLY_BETTER * here.quality:
                self.continue_from(replace(here, X=X, iterations=0), tangent)
        here, tangent = self.here.state, self.here.tangent
        if self.options.remesh is not None and here.quality < wanted:
            self.in_vain = "; the last new mesh led to no point of the branch"
            try:
                mesh = self.mesh(remesh(here.whole, self.options.remesh))
            except SurfaceError:
                return
            start = BranchState(mesh, mesh.surface.vertices, here.parameter)
            self.continue_from(start, tangent.on(here, start))
            self.in_vain *= self.here.state is here

    def let_held_walls_pinch(self) -> bool:
        """From here on let walls come down on held bottoms; False if none can, or they already do."""
        here = self.here.state
        if self.held or here.mesh.surface.periodic:
            return False
        self.held = True
        mesh = self.mesh(here.whole)
        if mesh.part.walls.held.any():
            start = BranchState(mesh, mesh.surface.vertices, here.parameter)
            self.continue_from(start, self.here.tangent.on(here, start))
        return self.here.state.mesh is mesh

    def continue_from(self, start: BranchState, tangent: Tangent) -> None:
        """Go on from the point of the branch near a state, on the plane across a tangent.

        Stay on the old mesh if a goal lies between, or an event unless the mesh is very poor.
        """
        here = self.here
        constraint = fixed_arclength(start, tangent.row, tangent.rate)
        try:
            after = branch_point(correct(start, constraint, self.options.tolerance), tangent)
        except NotOnBranch:
            return
        if crosses_goal(here.state, after.state, self.goals):
            return
        events = self.events_between(here, after, 0.0)
        very_poor = here.state.quality <= 0.5 * self.options.min_quality
        if after.state.quality > here.state.quality and (very_poor or not events):
            self.events += events
            self.here = after

    def events_on(self, segment: Segment) -> list[dict[str, Any]]:
        start, end, length = segment.start, segment.end, segment.length
        if not segment.same_mesh or length <= 2.0 * EVENT_ACCURACY:
            events = self.events_between(start, end, length)
            if (start.state.mesh.part.resting != end.state.mesh.part.resting).any():
                events.insert(0, self.event("contact", end.state, length, start.index, end.index))
            return events
        located, fold = [], segment.fold
        if fold is not None:
            at = segment.point(fold).state
            located.append((fold, self.event("fold", at, fold, start.index, end.index)))
        index, sign = start.index, 1 if end.index > start.index else -1
        for t, count in segment.index_changes():
            after, point = index + sign * count, segment.point(t)
            event = self.event("index", point.state, t, index, after, along_branch(point, count))
            located.append((t, event))
            index = after
        return [event for _, event in sorted(located, key=lambda pair: pair[0])]

    def events_between(self, before: BranchPoint, after: BranchPoint, length: float) -> list[dict[str, Any]]:
        """Events between two points that are too near, or too different, to search between them."""
        folds = before.tangent.slope * after.tangent.slope < 0.0
        kinds = ["fold"] * folds + ["index"] * (before.index != after.index)
        return [self.event(kind, after.state, length, before.index, after.index) for kind in kinds]

    def event(
        self, kind: str, at: BranchState, t: float, before: int, after: int, along: float = math.nan
    ) -> dict[str, Any]:
        """A row of the table of events, t from here."""
        return {
            "kind": kind,
            **self.columns(at),
            "arclength": self.arclength + t,
            "index_before": before,
            "index_after": after,
            "along_branch": along,
            "surface": at.whole,
        }

    def record(self) -> None:
        """Add the last point to the table of points, and call the callback."""
        here, number = self.here, len(self.rows)
        row = {
            **self.columns(here.state),
            "arclength": self.arclength,
            "index": here.index,
            "lowest_eigenvalue": here.eigenvalues[0],
            "residual": here.state.rest.residual,
            "quality": here.state.quality,
            "slope": here.tangent.slope,
            "iterations": here.state.iterations,
        }
        self.rows.append(row)
        if (number - 1) % self.options.keep:
            self.surfaces.pop(number - 1, None)
        self.surfaces[number] = self.here.state.whole
        if self.callback is not None:
            self.callback(Progress(number, lambda: here.state.whole, self.rows[-1]))

    def columns(self, at: BranchState) -> dict[str, Any]:
        """The columns of both tables."""
        rooms = zip(at.rest.surface.rooms, room_pressures(at.rest.surface).tolist(), strict=True)
        return {
            "parameter": at.parameter,
            **self.line.columns(at.mesh.surface, at.parameter),
            **{f"pressure {room.name}": pressure for room, pressure in rooms},
            **{name: getattr(at, name) for name in ("energy", "volume", "height")},
        }
