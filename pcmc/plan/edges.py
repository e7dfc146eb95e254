"""The boundary of a plan, edge by edge: what holds it, where it carries a cable, where it meets a mirror."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import PlanError
from ..base.libraries import shapely
from ..base.tolerances import ON
from ..meshing.walls import EDGES
from ..surface import Cable, Patch, Plane
from ..surface.curves import Curve
from ..surface.geometry import angles, bounding_size
from ..surface.pieces import point_text, to_local, to_space, two_digits
from ..surface.topology import SIDES, edge_places
from .arrangement import Arrangement
from .lines import SNAP, Kind, LineTree, PlanLine
from .parts import cable_label

if TYPE_CHECKING:
    from .plan import Plan

NONE = -1  # the cable of an edge without one
CORNER, FLAT = 0.3, 0.1  # share of a sail's corner for each cable; radians below which it is no corner


@dataclass(frozen=True, eq=False)
class Boundary:
    """The edges of the outline and the holes, in order along each."""

    ends: Ints  # (e,2) vertices; each line runs from edge to edge and returns to its first vertex
    line: Ints  # (e,) the number of the line
    state: Any  # (e,) one of EDGES, "mirror", or along a support "held", a free one, or "inside", a mirror
    cable: Ints  # (e,) index into ``cables``, -1 for none
    # tension, weight and name, perhaps empty, of each cable line and edge cable
    cables: tuple[tuple[float, float, str], ...]

    def among(self, *states: str) -> Bools:
        """(e,) the edges in any of these states."""
        return np.isin(self.state, states)

    def vertices(self, *states: str) -> Ints:
        """The ends of the edges in any of these states."""
        return np.unique(self.ends[self.among(*states)])


def boundary(plan: Plan, lines: Sequence[PlanLine], on_edge: Sequence[Curve], drawn: Arrangement) -> Boundary:
    """The boundary of a plan cut into edges; those along the supports ``on_edge`` are fixed. PlanError for a
    mirror that is no straight edge of the outline, and a cable away from the boundary."""
    chains = [chain for chain in drawn.chains if lines[chain.line].bounds]
    chains.sort(key=lambda chain: chain.line)
    ends = np.concatenate([chain.edges for chain in chains])
    line = np.repeat([chain.line for chain in chains], [len(chain.edges) for chain in chains])
    parts = [plan, *plan.holes]
    state = np.array([part.edge for part in parts], dtype="<U8")[line]
    cables = [(part.cable, part.cable_weight, "") for part in parts if part.cable is not None]
    with_cable = np.array([part.cable is not None for part in parts])
    cable = np.where(with_cable, np.cumsum(with_cable) - 1, NONE)[line]
    for number, part in enumerate(plan.cables, start=1):
        along = _along(part.curve.local(plan.plane), drawn.points, ends, SNAP * plan.edge_length)
        if not along.any():
            name = cable_label(part, number)
            raise PlanError(f"{name} is on no edge of the outline or of a hole; draw it along one", what=name)
        state[along], cable[along] = "cable", len(cables)
        cables.append((part.tension, part.weight, part.name))
    supported = np.zeros(len(ends), dtype=bool)
    for support in on_edge:  # a held stretch needs no cable
        along = _along(support, drawn.points, ends, SNAP * plan.edge_length)
        state[along] = np.where(np.isin(state[along], ["free", "cable"]), "held", "fixed")
        cable[along], supported[along] = NONE, True
    for number, distance in enumerate(_mirror_distances(plan, drawn.points), start=1):
        along = (distance == 0.0)[ends].all(axis=1)
        if not along.any():
            problem = f"mirror {number} is no straight edge of the outline; draw it from corner to corner"
            raise PlanError(problem, what=f"mirror {number}")
        own = cable[along & (cable >= with_cable.sum())] - with_cable.sum()
        if len(own):
            name = cable_label(plan.cables[own[0]], int(own[0]) + 1)
            problem = f"{name} runs along mirror {number}, which is inside the whole roof; draw the whole"
            raise PlanError(f"{problem} roof, with a divider that has the cable", what=name)
        state[along], cable[along] = np.where(supported[along], "inside", "mirror"), NONE
    return Boundary(ends, line, state, cable, tuple(cables))


def _along(curve: Curve, points: Floats, ends: Ints, snap: float) -> Bools:
    """(e,) the edges that run along a curve: both ends are on it, and the middle is near."""
    strip, on = PlanLine("cable", Kind.SUPPORT, curve), np.zeros(len(points), dtype=bool)
    rim = np.unique(ends)
    on[rim] = strip.nearest(points[rim])[1] <= snap
    half = np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1) / 2.0
    away = shapely.distance(strip.shape, shapely.points(points[ends].mean(axis=1)))
    return np.asarray(on[ends].all(axis=1) & (away <= 0.5 * half))  # an arc of 45° rises by 0.2 of it


def check_lines(plan: Plan, lines: Sequence[PlanLine]) -> None:
    """Refuse a cable that leaves the boundary, and a mirror that the plan crosses."""
    edges = LineTree([line for line in lines if line.bounds])
    for number, part in enumerate(plan.cables, start=1):
        xy = edges.leaves(part.curve.local(plan.plane), 0.5 * plan.edge_length, SNAP * plan.edge_length)
        if xy is not None:
            name = cable_label(part, number)
            problem = f"{name} is at {point_text(xy)} on no edge of the outline or of a hole; draw it"
            problem += " along one, or give a divider cable = where it crosses the roof"
            raise PlanError(problem, what=name, where=tuple(xy.tolist()))
    for number, distance in enumerate(_mirror_distances(plan, lines[0].xy), start=1):
        if distance.min() < 0.0 < distance.max():
            smaller = np.argmin(distance) if distance.max() > -distance.min() else np.argmax(distance)
            problem = f"the plan crosses mirror {number}: {point_text(lines[0].xy[smaller])} is behind it;"
            problem += " draw the part on one side only, or remove the mirror"
            raise PlanError(problem, what=f"mirror {number}")


def _mirror_distances(plan: Plan, points: Floats) -> list[Floats]:
    """(n,) signed distance of points (n,2) on Π from the line of each mirror, exactly 0 on it."""
    distances = []
    for mirror in plan.mirrors:
        a, b = mirror.local(plan.plane).at([0.0, 1.0])[:, :2]
        along = (b - a) / np.linalg.norm(b - a)
        distance = (points - a) @ [-along[1], along[0]]
        distances.append(np.where(np.abs(distance) <= ON * bounding_size(points), 0.0, distance))
    return distances


def mirror_planes(plan: Plan, vertices: Floats) -> list[tuple[Plane, Bools]]:
    """The plane of each mirror, across Π, and the (n,) mask of the vertices in it."""
    planes, distances = [], _mirror_distances(plan, plan.plane.to_local(vertices)[:, :2])
    for number, (mirror, distance) in enumerate(zip(plan.mirrors, distances, strict=True), start=1):
        a, b = mirror.local(plan.plane).at([0.0, 1.0])
        middle = to_space(((a + b) / 2.0 * [1.0, 1.0, 0.0])[None], plan.plane)[0]
        across = np.array([a[1] - b[1], b[0] - a[0], 0.0]) @ plan.plane.axes
        plane = Plane(tuple(middle.tolist()), tuple(across.tolist()), f"mirror {number}", mirror=True)
        planes.append((plane, distance == 0.0))
    return planes


def edge_cables(edges: Boundary, held: Bools, numbers: count[int]) -> list[Cable]:
    """A Cable for each stretch of the boundary between held vertices; ``numbers`` those without a name."""
    cables = []
    for index, (tension, weight, name) in enumerate(edges.cables):
        ends, line = edges.ends[edges.cable == index], edges.line[edges.cable == index]
        new = held[ends[:, 0]] | (ends[:, 0] != np.roll(ends[:, 1], 1)) | (line != np.roll(line, 1))
        group = np.cumsum(new)
        group[group == 0] = group.max(initial=0)  # the first edges go on from the last
        stretches = [ends[group == k] for k in np.unique(group)]
        for k, stretch in enumerate(stretches, start=1):
            own = f"cable {next(numbers)}" if not name else f"{name}-{k}" if len(stretches) > 1 else name
            cables.append(Cable(own, tension, stretch, weight))
    return cables


def usual_cable(plan: Plan) -> float:
    """A tension of cables with which the edges of a sail bend moderately; see ``cable_for``."""
    tension = max(patch.tension for patch in plan.patches) if plan.tension is None else plan.tension
    points = [p for p in plan.supports if not isinstance(p, Curve)]
    points = [p if len(p) == 2 else to_local(np.array([p]), plan.plane)[0] for p in points]
    return cable_for(plan.outline.local(plan.plane), tension, points)


def cable_for(outline: Curve, tension: float, supports: Sequence[Any]) -> float:
    """A tension for the cables of a sail, two digits: 1.5 α × the size of its outline, or more where it has
    slender corners.

    In a flat sail a cable is an arc of radius T/α, which leaves the chord L of its ends by
    arcsin(α L / (2T)). At a held corner two of them must fit in the angle between the chords; 0.3 of it for
    each leaves room. ``supports`` are points; those on the outline are such corners.

    >>> from ..surface.curves import polyline
    >>> half = [[0, 0], [10, 0], [10, 10]]
    >>> cable_for(polyline(half, closed=True), 1.0, half), cable_for(polyline(half, closed=True), 1.0, ())
    (30.0, 15.0)
    """
    size = float(np.ptp(outline.at(outline.dense)[:, :2], axis=0).max())
    radius = 1.5 * size
    points = np.array([p[:2] for p in supports], dtype=float).reshape(-1, 2)
    t, away = PlanLine("the outline", Kind.OUTLINE, outline).nearest(points)
    if (away <= ON * size).sum() > 2:
        corners = points[[k for k in np.argsort(t) if away[k] <= ON * size]]
        before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
        angle = np.radians(angles(np.stack([before, corners, after], axis=1))[:, 1])
        longer = np.maximum(*(np.linalg.norm(other - corners, axis=1) for other in (before, after)))
        sharp = angle > FLAT
        radius = max([radius, *(longer[sharp] / (2.0 * np.sin(CORNER * angle[sharp]))).tolist()])
    return two_digits(tension * radius)


def raised_heights(plan: Plan, edges: Boundary, drawn: Arrangement, held: Bools) -> Floats:
    """(k,) the heights of the drawn points, with those of the supports; NaN where unknown.

    Between supports an edge changes its height in proportion to the length. A mirror has no height of its
    own: a support there is as one inside."""
    heights, change = drawn.heights.copy(), np.zeros(len(drawn.heights))
    size, rim = bounding_size(drawn.points), np.unique(edges.ends)
    loose = np.setdiff1d(rim, edges.vertices("fixed", "sliding"))
    inside = np.setdiff1d(edges.vertices("mirror", "inside"), edges.vertices(*EDGES, "held"))
    required = iter(drawn.required.tolist())
    for support in plan.supports:
        if isinstance(support, Curve):
            strip = PlanLine("support", Kind.SUPPORT, support.local(plan.plane))
            t, away = strip.nearest(drawn.points[rim])
            on = away <= SNAP * plan.edge_length
            vertices, given = rim[on], strip.curve.at(t[on])[:, 2]
            dimension = support.pieces[0].points.shape[1]
        else:
            vertices, dimension = np.array([next(required)]), len(support)
            given = to_local(np.array([support]), plan.plane)[:, 2]
        if dimension == 2:
            own = np.isin(vertices, inside)
            given, vertices = given[own], vertices[own]
        heights[vertices] = np.where(np.isnan(heights[vertices]), given, heights[vertices])
        steps = given - heights[vertices]
        wrong = np.flatnonzero((np.abs(steps) > ON * size) & ~np.isin(vertices, loose))
        if len(wrong):
            xy, height, there = (a[wrong[0]] for a in (drawn.points[vertices], given, heights[vertices]))
            problem = f"the support at {point_text(xy)} is at height {height:g}, but the edge or line there"
            problem += f" at {there:g}; only on a free edge or a cable a support has its own height"
            raise PlanError(problem, what="supports", where=tuple(xy.tolist()), found=float(height))
        change[vertices] = steps
    for number in np.unique(edges.line) if change.any() else ():
        ring = edges.ends[edges.line == number]
        lengths = np.linalg.norm(np.diff(drawn.points[ring], axis=1)[:, 0], axis=1)
        at, vertices = np.cumsum(lengths) - lengths, ring[:, 0]
        known = held[vertices]
        if known.any():
            heights[vertices] += np.interp(at, at[known], change[vertices[known]], period=lengths.sum())
    heights[inside[~held[inside]]] = np.nan
    return heights


def check_pressures(edges: Boundary, triangles: Ints, patch: Ints, patches: Sequence[Patch]) -> None:
    """Refuse pressure or snow on a patch with a cable along a free edge: it acts on the cone below, too."""
    beside = (edge_places(triangles[:, SIDES], edges.ends[edges.cable != NONE]) >= 0).any(axis=1)
    for k in np.unique(patch[beside]):
        for key, instead in (("pressure", "pressure = 0 (and a weight)"), ("snow", "a weight in its place")):
            if (value := getattr(patches[k], key)) != 0.0:
                name = patches[k].name
                problem = f"patch {name!r} has the {key} {value:g} and a free edge with a cable, which closes"
                problem += f" no space for it; give the patch {instead}, or hold that edge"
                raise PlanError(problem, what=key, where=name, found=value)
