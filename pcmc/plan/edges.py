"""The boundary of a plan, edge by edge: what holds it, where it carries a cable, where it meets a mirror."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np
import shapely

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import PlanError
from ..curves.curves import Curve
from ..curves.pieces import point_text, to_local, to_space
from ..meshing.walls import EDGES
from ..surface import Cable, Patch, Plane
from .arrangement import Arrangement
from .lines import SNAP, Kind, Line, LineTree
from .parts import PlanData

MIRROR, HELD = "mirror", "held"
STATES = (*EDGES, MIRROR, HELD)  # of an edge of the boundary; held is a free one along a support
ON_MIRROR = 1e-9  # of the plan's size: a boundary this near to a mirror is on it
NONE = -1  # the cable of an edge without one


@dataclass(frozen=True, eq=False)
class Boundary:
    """The edges of the outline and the holes, in order along each.

    Attributes
    ----------
    ends : (e,2) vertices; each line runs from edge to edge and returns to its first vertex.
    line : (e,) the number of the line.
    state : (e,) index into ``STATES``.
    cable : (e,) index into ``cables``, -1 for none.
    cables : tension and name of each cable line and each edge with a cable; the name may be empty.
    """

    ends: Ints
    line: Ints
    state: Ints
    cable: Ints
    cables: tuple[tuple[float, str], ...]

    def vertices(self, *states: str) -> Ints:
        """The ends of the edges in any of these states."""
        chosen = np.isin(self.state, [STATES.index(state) for state in states])
        return np.unique(self.ends[chosen])


def boundary(plan: PlanData, lines: Sequence[Line], on_edge: Sequence[Curve], drawn: Arrangement) -> Boundary:
    """The boundary of a plan cut into edges; those along the supports ``on_edge`` are fixed.

    Raises
    ------
    PlanError
        For a mirror that is no straight edge of the outline, and a cable that is not along the boundary.
    """
    chains = [chain for chain in drawn.chains if lines[chain.line].bounds]
    chains.sort(key=lambda chain: chain.line)
    ends = np.concatenate([chain.edges for chain in chains])
    line = np.concatenate([np.full(len(chain.vertices) - 1, chain.line) for chain in chains])
    parts = [(plan.edge, plan.cable), *((hole.edge, hole.cable) for hole in plan.holes)]
    state = np.array([STATES.index(edge) for edge, _ in parts])[line]
    cables = [(tension, "") for _, tension in parts if tension is not None]
    first = np.cumsum([tension is not None for _, tension in parts]) - 1
    cable = np.where([tension is not None for _, tension in parts], first, NONE)[line]
    middle = drawn.points[ends].mean(axis=1)
    for number, part in enumerate(plan.cables, start=1):
        along = _along(part.curve.local(plan.plane), drawn, ends, middle, SNAP * plan.edge_length)
        if not along.any():
            name = f"cable {part.name!r}" if part.name else f"cable {number}"
            problem = f"{name} is on no edge of the outline or of a hole; draw it along one"
            raise PlanError(problem, what=name)
        state[along], cable[along] = STATES.index("cable"), len(cables)
        cables.append((part.tension, part.name))
    for support in on_edge:  # a held stretch needs no cable
        along = _along(support, drawn, ends, middle, SNAP * plan.edge_length)
        loose = along & np.isin(state, [STATES.index("free"), STATES.index("cable")])
        state[along & ~loose], state[loose], cable[along] = STATES.index("fixed"), STATES.index(HELD), NONE
    for number, one in enumerate(plan.mirrors, start=1):
        on = np.abs(mirror_distance(one, plan.plane, drawn.points)) <= ON_MIRROR * _size(drawn.points)
        along = on[ends].all(axis=1)
        if not along.any():
            problem = f"mirror {number} is no straight edge of the outline; draw it from corner to corner"
            raise PlanError(problem, what=f"mirror {number}")
        state[along], cable[along] = STATES.index(MIRROR), NONE
    return Boundary(ends, line, state, cable, tuple(cables))


def check_lines(plan: PlanData, lines: Sequence[Line]) -> None:
    """Refuse a cable that leaves the boundary, and a mirror that the plan crosses."""
    edges = LineTree([line for line in lines if line.bounds])
    for number, part in enumerate(plan.cables, start=1):
        points = part.curve.local(plan.plane).samples(0.5 * plan.edge_length)[:, :2]
        for xy, places in zip(points, edges.at(points, SNAP * plan.edge_length), strict=True):
            if not places:
                name = f"cable {part.name!r}" if part.name else f"cable {number}"
                problem = (
                    f"{name} is at {point_text(xy)} on no edge of the outline or of a hole; draw it along"
                )
                problem += " one, or give a divider cable = where it crosses the roof"
                raise PlanError(problem, what=name, where=tuple(xy.tolist()))
    xy = lines[0].xy
    for number, one in enumerate(plan.mirrors, start=1):
        distance = mirror_distance(one, plan.plane, xy)
        near = ON_MIRROR * _size(xy)
        if (distance > near).any() and (distance < -near).any():
            far = xy[int(np.argmin(distance) if distance.max() > -distance.min() else np.argmax(distance))]
            problem = (
                f"the plan crosses mirror {number}: {point_text(far)} is behind it; draw the part on one"
            )
            raise PlanError(f"{problem} side only, or remove the mirror", what=f"mirror {number}")


def mirror_distance(mirror: Curve, plane: Plane, points: Floats) -> Floats:
    """(n,) signed distance of points (n,2) on Π from the line of a mirror."""
    a, b = mirror.local(plane).at([0.0, 1.0])[:, :2]
    along = (b - a) / np.linalg.norm(b - a)
    return np.asarray((points - a) @ [-along[1], along[0]])


def mirror_planes(plan: PlanData, vertices: Floats) -> list[tuple[Plane, Bools]]:
    """The plane of each mirror, across Π, and the (n,) mask of the vertices in it."""
    local = plan.plane.to_local(vertices)
    planes = []
    for number, mirror in enumerate(plan.mirrors, start=1):
        a, b = mirror.local(plan.plane).at([0.0, 1.0])
        middle = to_space(((a + b) / 2.0 * [1.0, 1.0, 0.0])[None], plan.plane)[0]
        across = np.array([a[1] - b[1], b[0] - a[0], 0.0]) @ plan.plane.axes
        plane = Plane(tuple(middle.tolist()), tuple(across.tolist()), f"mirror {number}", mirror=True)
        near = ON_MIRROR * _size(local[:, :2])
        planes.append((plane, np.abs(mirror_distance(mirror, plan.plane, local[:, :2])) <= near))
    return planes


def edge_cables(edges: Boundary, held: Bools, numbers: count[int]) -> list[Cable]:
    """A Cable for each stretch of the boundary between held vertices; ``numbers`` those without a name."""
    cables = []
    for index, (tension, name) in enumerate(edges.cables):
        parts = _stretches(edges, index, held)
        for k, ends in enumerate(parts, start=1):
            own = f"cable {next(numbers)}" if not name else f"{name}-{k}" if len(parts) > 1 else name
            cables.append(Cable(own, tension, ends))
    return cables


def usual_cable(plan: PlanData) -> float:
    """A tension of cables with which the edges of a sail bend moderately; see ``cable_for``."""
    tension = max(area.tension for area in plan.patches) if plan.tension is None else plan.tension
    return cable_for(plan.outline.local(plan.plane), tension)


def cable_for(outline: Curve, tension: float) -> float:
    """1.5 α × the size of the outline, two digits."""
    return float(f"{1.5 * tension * np.ptp(outline.at(outline.dense)[:, :2], axis=0).max():.2g}")


def raised_heights(plan: PlanData, edges: Boundary, drawn: Arrangement, held: Bools) -> Floats:
    """(k,) the heights of the drawn points, with those of the supports; NaN where unknown.

    Between the supports an edge changes its height in proportion to the length from one to the next.
    """
    heights = drawn.heights.copy()
    on_mirror = edges.vertices(MIRROR)
    kept = np.setdiff1d(on_mirror, edges.vertices(*EDGES, HELD))
    change = np.zeros(len(heights))
    size, rim = _size(drawn.points), np.unique(edges.ends)
    loose = np.setdiff1d(rim, edges.vertices("fixed", "sliding"))
    spots = iter(drawn.spots.tolist())
    for support in plan.supports:
        if isinstance(support, Curve):
            strip = Line("support", Kind.SUPPORT, support.local(plan.plane))
            t, away = strip.nearest(drawn.points[rim])
            on = away <= SNAP * plan.edge_length
            vertices, given = rim[on], strip.curve.at(t[on])[:, 2]
            own = support.pieces[0].points.shape[1] == 3
        else:
            vertices, own = np.array([next(spots)]), len(support) == 3
            given = to_local(np.array([support]), plan.plane)[:, 2]
        if not own:
            continue
        unknown = np.isnan(heights[vertices])
        heights[vertices[unknown]] = given[unknown]
        steps = given - heights[vertices]
        wrong = np.flatnonzero((np.abs(steps) > ON_MIRROR * size) & ~np.isin(vertices, loose))
        if len(wrong):
            xy, height, there = (a[wrong[0]] for a in (drawn.points[vertices], given, heights[vertices]))
            problem = f"the support at {point_text(xy)} is at height {height:g}, but the edge or line there"
            problem += f" at {there:g}; only on a free edge or a cable a support has its own height"
            raise PlanError(problem, what="supports", where=tuple(xy.tolist()), found=float(height))
        change[vertices] = steps
    if change.any():
        for number in np.unique(edges.line):
            ring = edges.ends[edges.line == number]
            lengths = np.linalg.norm(np.diff(drawn.points[ring], axis=1)[:, 0], axis=1)
            at = np.cumsum(lengths) - lengths
            vertices = ring[:, 0]
            known = held[vertices]
            if known.any():
                steps = np.interp(at, at[known], change[vertices[known]], period=float(lengths.sum()))
                heights[vertices] += steps
    heights[kept] = np.nan
    return heights


def check_pressures(edges: Boundary, triangles: Ints, patch: Ints, patches: Sequence[Patch]) -> None:
    """Refuse pressure or snow on a patch with a cable along a free edge: it acts on the cone below, too."""
    free = np.sort(edges.ends[edges.cable != NONE], axis=1)
    n = np.array([int(triangles.max()) + 1, 1])
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    beside = np.isin(sides @ n, free @ n).any(axis=1)
    for k in np.unique(patch[beside]):
        for key, instead in (("pressure", "pressure = 0 (and a weight)"), ("snow", "a weight in its place")):
            name, value = patches[k].name, getattr(patches[k], key)
            if value != 0.0:
                problem = f"patch {name!r} has the {key} {value:g} and a free edge with a cable, which closes"
                problem += f" no space for it; give the patch {instead}, or hold that edge"
                raise PlanError(problem, what=key, where=name, found=value)


def strip_mask(strip: Line, points: Floats, among: Ints, snap: float) -> Ints:
    """Those of the points ``among`` that lie on a line."""
    return among[strip.nearest(points[among])[1] <= snap]


def _along(curve: Curve, drawn: Arrangement, ends: Ints, middle: Floats, snap: float) -> Bools:
    """(e,) the edges that run along a curve: both ends are on it, and the middle is near."""
    strip = Line("cable", Kind.SUPPORT, curve)
    on = np.zeros(len(drawn.points), dtype=bool)
    on[strip_mask(strip, drawn.points, np.unique(ends), snap)] = True
    half = np.linalg.norm(drawn.points[ends[:, 1]] - drawn.points[ends[:, 0]], axis=1) / 2.0
    away = shapely.distance(strip.shape, shapely.points(middle))
    return np.asarray(on[ends].all(axis=1) & (away <= 0.5 * half))  # an arc of 45° rises by 0.2 of it


def _stretches(edges: Boundary, cable: int, held: Bools) -> list[Ints]:
    """The edges (k,2) of each stretch of a cable between held vertices, in order."""
    chosen = edges.cable == cable
    ends, line = edges.ends[chosen], edges.line[chosen]
    if not len(ends):
        return []
    new = held[ends[:, 0]] | (ends[:, 0] != np.roll(ends[:, 1], 1)) | (line != np.roll(line, 1))
    group = np.cumsum(new) - 1
    if not new[0]:  # the first edge goes on from the last
        group[group == -1] = group.max()
    group = np.maximum(group, 0)
    return [ends[group == k] for k in np.unique(group)]


def _size(points: Floats) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))
