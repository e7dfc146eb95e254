"""A plan drawn: its lines in the coordinates of Π, cut where they meet, and its plane mesh; the walls below
its dividers, with their tensions and the planes that hold upright ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..base.arrays import Bools, Floats, Ints, mask_of
from ..base.errors import PlanError, SurfaceError
from ..base.libraries import shapely
from ..meshing.planar import SIDES, PlanarMesh, signed_areas, triangulate
from ..meshing.walls import UpperEdge, WallMesh, build_walls
from ..surface import Patch, Plane, Room
from ..surface.curves import Curve
from ..surface.geometry import bounding_size, segment_lengths
from ..surface.pieces import point_text, to_local, to_space, two_digits
from ..surface.topology import components
from ..surface.values import balanced_wall
from .arrangement import Arrangement, Chain, arrange, hole_points
from .edges import NONE, Boundary, boundary, check_lines
from .lines import SNAP, Kind, LineTree, PlanLine, is_straight
from .parts import BALANCED, check_count

if TYPE_CHECKING:
    from .plan import Plan

MAX_TRIANGLES = 500_000  # of a plan's mesh, which takes about a minute; finer ones are made by remeshing
MAX_POINTS = 1_000_000  # of all lines, where they are measured
AT_EDGES = 3  # triangles for each edge of a line, about, where these are shorter than the others
SMALLEST = 0.4  # of the edge length squared: a triangle of these edges is larger
MAX_EDGES = 200_000  # along a line
MAX_RISE = 10.0  # of the initial surface, over the size of the plan


@dataclass(frozen=True, eq=False)
class Draft:
    """A plan with its lines and its plane mesh."""

    plan: Plan
    lines: Sequence[PlanLine]  # the outline, then the holes, the dividers, and the supports off the boundary
    supports_on_edge: Sequence[Curve]
    drawn: Arrangement
    mesh: PlanarMesh  # in the coordinates of Π; its first points are those of ``drawn``
    edges: Boundary

    def divider(self, number: int) -> tuple[PlanLine, Sequence[Chain]]:
        """The line of a divider, and its chains."""
        line = 1 + len(self.plan.holes) + number
        return self.lines[line], self.drawn.along(line)

    @cached_property
    def radii(self) -> Floats:
        """2 A / L of each part of the plan, with its area A and the length L of its edge: R of a circle."""
        region, points, triangles = self.mesh.region, self.mesh.points, self.mesh.triangles
        owned = np.column_stack([np.repeat(region, 3), np.sort(triangles[:, SIDES].reshape(-1, 2), axis=1)])
        own, times = np.unique(owned, axis=0, return_counts=True)
        length = np.bincount(own[times == 1, 0], segment_lengths(points, own[times == 1, 1:]))
        return 2.0 * np.bincount(region, signed_areas(points, triangles)) / length


def drafted(plan: Plan) -> Draft:
    """Draw the lines of a plan and mesh what is between them; PlanError if they do not fit together."""
    lines, on_edge, drawn = _arranged(plan)
    edges = np.concatenate([chain.edges for chain in drawn.chains])
    _check_count(plan, lines[0].xy, len(edges))
    try:
        mesh = triangulate(drawn.points, edges, plan.edge_length, hole_points(drawn, lines))
    except SurfaceError as error:
        problem = f"lines of the plan are too close to each other for edges of length {plan.edge_length:g}"
        raise PlanError(f"{problem}: {error}", what="edge_length", found=plan.edge_length) from None
    areas = signed_areas(mesh.points, mesh.triangles)
    part = np.bincount(mesh.region, areas)
    least = int(np.argmin(part))
    if part[least] < SMALLEST * plan.edge_length**2:  # lines that just miss each other
        own, area = mesh.region == least, part[least]
        middle = mesh.points[mesh.triangles[own]].mean(axis=1).T @ areas[own] / area
        finer = two_digits(math.sqrt(area), math.floor)
        problem = (
            f"the part of the plan around {point_text(middle)} has the area {area:.3g}, less than a triangle"
            f" with edges of {plan.edge_length:g}; if its lines should meet in one point, draw them so,"
            f" otherwise use edge_length = {finer:g} or less"
        )
        raise PlanError(problem, what="edge_length", where=tuple(middle.tolist()), found=float(area))
    return Draft(plan, lines, on_edge, drawn, mesh, boundary(plan, lines, on_edge, drawn))


def part_count(plan: Plan, drawn: Arrangement | None = None) -> int:
    """The number of parts into which the lines cut the plan, without its mesh; errors as in ``drafted``.

    By Euler's formula e - v + c for e chains between v vertices in c connected pieces, less the holes."""
    drawn = drawn or _arranged(plan)[2]
    ends = np.array([chain.vertices[[0, -1]] for chain in drawn.chains])
    used, renumbered = np.unique(ends, return_inverse=True)
    pieces = components(renumbered.reshape(-1, 2), len(used))
    return len(ends) - len(used) + 1 + int(pieces.max()) - len(plan.holes)


def _arranged(plan: Plan) -> tuple[list[PlanLine], list[Curve], Arrangement]:
    """The lines in the coordinates of Π, the supports on the boundary, and the lines cut where they meet."""
    lines = [PlanLine("the outline", Kind.OUTLINE, plan.outline.local(plan.plane))]
    lines += [PlanLine(h.name, Kind.HOLE, h.curve.local(plan.plane)) for h in plan.holes]
    lines += [PlanLine(f"divider {d.name!r}", Kind.DIVIDER, d.curve.local(plan.plane)) for d in plan.dividers]
    curves = [(k, support) for k, support in enumerate(plan.supports, 1) if isinstance(support, Curve)]
    supports = [PlanLine(f"support {k}", Kind.SUPPORT, curve.local(plan.plane)) for k, curve in curves]
    _check_size(plan, [*lines, *supports])
    tree, on_edge = LineTree([line for line in lines if line.bounds]), []
    for line in supports:
        if tree.leaves(line.curve, 0.5 * plan.edge_length, SNAP * plan.edge_length) is None:
            on_edge.append(line.curve)
        else:
            lines.append(line)
    check_lines(plan, lines)
    points = [to_local(p, plan.plane) for p in plan.supports if not isinstance(p, Curve)]
    named = [np.array([*point, np.nan]) for point in plan.points.values()]  # vertices, but not held
    cut = [*on_edge, *(c.local(plan.plane) for c in (*(part.curve for part in plan.cables), *plan.mirrors))]
    cut_points = np.concatenate([np.zeros((0, 2)), *(c.at([0.0, len(c.pieces)])[:, :2] for c in cut)])
    drawn = arrange(lines, plan.edge_length, np.reshape([*points, *named], (-1, 3)).astype(float), cut_points)
    check_count("patches", part_count(plan, drawn))
    return lines, on_edge, replace(drawn, required=drawn.required[: len(points)])


def _check_size(plan: Plan, lines: Sequence[PlanLine]) -> None:
    """Refuse lengths that are probably mistakes, before they fill the memory."""
    points = sum(len(part.curve.dense) for part in (*plan.cables, *lines))
    if points > MAX_POINTS:
        problem = f"the lines of the plan have {points} points; at most {MAX_POINTS} are read: draw them with"
        raise PlanError(f"{problem} fewer", what="outline", found=points, expected=MAX_POINTS)
    _check_count(plan, lines[0].xy, 0)
    size = bounding_size(lines[0].xy)
    if plan.edge_length > size:
        problem = f"edge_length={plan.edge_length:g} is longer than the plan, {size:.4g} from corner to"
        raise PlanError(f"{problem} corner; use a smaller one", what="edge_length", found=plan.edge_length)
    if plan.rise is not None and plan.rise > MAX_RISE * size:
        problem = f"rise={plan.rise:g} is more than {MAX_RISE:g} times the plan's size, {size:.4g}; use a"
        raise PlanError(f"{problem} smaller one", what="rise", found=plan.rise)
    for line in lines:
        if line.curve.length > MAX_EDGES * plan.edge_length:
            problem = f"is {line.curve.length:.3g} long, more than {MAX_EDGES} edges of {plan.edge_length:g};"
            raise line.error(f"{problem} draw it as long as the plan", found=line.curve.length)
    for line in lines:
        extent = float(np.ptp(line.xy, axis=0).max())
        if line.kind is Kind.HOLE and extent <= SNAP * plan.edge_length:
            problem = f"is only {extent:g} wide, too little for edges of length {plan.edge_length:g};"
            raise line.error(f"{problem} leave it out, or use a smaller edge_length", found=extent)


def _check_count(plan: Plan, outline: Floats, edges: int) -> None:
    """Refuse a mesh of more triangles in an outline (k,2) than are allowed, before it is made."""
    x, y = outline.T
    area = 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))
    h, short = plan.edge_length, AT_EDGES * edges
    count = short + area / math.sqrt(0.1875) / h / h  # the square of h may be 0 or infinite
    if count > MAX_TRIANGLES:
        least = math.sqrt(area / math.sqrt(0.1875) / max(MAX_TRIANGLES - short, 1))
        change = f"use {two_digits(least, math.ceil):g} or more, and refine the roof by [[remesh]]"
        if short > MAX_TRIANGLES / 2:
            change = f"draw the lines with fewer points, they have {edges} edges"
        problem = f"edge_length={h:g} would make about {count:.2g} triangles; at most {MAX_TRIANGLES} are"
        raise PlanError(f"{problem} allowed: {change}", what="edge_length", found=h)


SHARE = 0.6  # of p R, R of the smallest part beside a wall: more would pull a flat roof down
WEDGE = 1.5  # edges from a corner, where the width of the sheets there is taken
CORNER_SHARE = 0.6  # of what those sheets carry
NARROW = 0.82  # sine of the angle, 55 degrees, below which a sheet in a corner counts as narrow


@dataclass(frozen=True, eq=False)
class Roof:
    """The patches over a plan, without its walls."""

    positions: Floats  # (n,3)
    base: Floats  # (n,) heights of the surface that the boundary spans
    fixed: Bools  # (n,)
    laws: Floats  # (m,3) pressure, snow and tension of each triangle
    room: Ints  # (m,) the number of the room of prescribed volume below, -1 for none


class Sides(NamedTuple):
    """A wall: its divider; pressure and snow on the left less those on the right; the rooms there, or -1."""

    divider: int
    pressure: float
    snow: float
    left: int
    right: int


def walls_of(draft: Draft, roof: Roof) -> tuple[WallMesh, list[Patch], list[Sides]]:
    """The walls and their patches: one for each divider and each pair of pressures and rooms along it."""
    plan, X = draft.plan, roof.positions
    floor, level = np.zeros(len(X)), np.zeros(len(X), dtype=bool)
    walled: list[tuple[int, Ints]] = []
    for number, divider in enumerate(plan.dividers):
        for chain in () if divider.wall is None else draft.divider(number)[1]:
            if divider.bottom == "sloped":
                floor[chain.vertices] = roof.base[chain.vertices]
            else:
                level[chain.vertices] = True
            walled.append((number, chain.vertices))
    mixed = np.flatnonzero(level & (floor != 0.0))
    if len(mixed):
        place = draft.drawn.points[mixed[0]]
        problem = f"at {point_text(place)} a wall with a sloped bottom meets one whose bottom is on the"
        raise PlanError(f"{problem} plane; give both the same bottom", what="bottom", where=place.tolist())
    laws, room = np.vstack([roof.laws, np.zeros(3)]), np.append(roof.room, NONE)  # of no triangle, -1
    kinds: dict[Sides, list[tuple[Ints, Ints]]] = {}
    for (number, vertices), faces in zip(walled, _beside(draft, [v for _, v in walled]), strict=True):
        pressure, snow, _ = (laws[faces[0]] - laws[faces[1]]).tolist()
        sides = Sides(number, pressure, snow, *room[faces].tolist())
        kinds.setdefault(sides, []).append((vertices, faces[faces >= 0]))
    tops, patches = list[UpperEdge](), list[Patch]()
    for number, group in groupby(kinds, key=lambda sides: sides.divider):
        divider, alike = plan.dividers[number], list(group)
        tension = divider.wall
        if tension == BALANCED:
            tension = _balanced(draft, roof, number, [faces for sides in alike for _, faces in kinds[sides]])
        for k, sides in enumerate(alike, start=1):
            tops += [UpperEdge(v, len(patches), divider.bottom != "sliding") for v, _ in kinds[sides]]
            name = f"{divider.name}-{k}" if len(alike) > 1 else divider.name
            patches.append(Patch(name, tension, sides.pressure, wall=True, snow=sides.snow))
    return build_walls(X, tops, plan.edge_length, plan.plane, roof.fixed, floor), patches, list(kinds)


def _beside(draft: Draft, chains: Sequence[Ints]) -> Ints:
    """(k,2) the triangles on the left and on the right of the first edges of chains, -1 for none."""
    edges = np.reshape([chain[:2] for chain in chains], (-1, 2)).astype(np.int64)
    triangles, n = draft.mesh.triangles, len(draft.mesh.points)
    keys = (triangles * n + np.roll(triangles, -1, axis=1)).ravel()
    order = np.argsort(keys)
    wanted = np.stack([edges @ [n, 1], edges @ [1, n]], axis=1)
    place = order[np.minimum(np.searchsorted(keys, wanted, sorter=order), len(keys) - 1)]
    return np.where(keys[place] == wanted, place // 3, NONE)


def _balanced(draft: Draft, roof: Roof, number: int, beside: Sequence[Ints]) -> float:
    """A tension with which all junctions of a divider balance; ``beside`` are the triangles at each."""
    faces, curve = np.concatenate(beside), draft.divider(number)[0].curve
    pressure = float(np.abs(roof.laws[faces, 0] - roof.laws[faces, 1]).min(initial=np.inf))
    most = most_in_corners(curve, draft.lines[0], draft.plan.edge_length, pressure)
    width = float(draft.radii[draft.mesh.region[faces]].min())
    tensions = [roof.laws[own, 2].tolist() for own in beside]
    if draft.plan.dividers[number].upright:  # its plane takes the difference
        tensions = [[min(part)] for part in tensions]
    return balanced_wall(tensions, min(most, SHARE * pressure * width) or np.inf)


def most_in_corners(curve: Curve, outline: PlanLine, edge_length: float, pressure: float = 1.0) -> float:
    """The most by which a wall may exceed the difference of its neighbours, where it runs into a corner.

    There the sheets on both sides get narrow, and carry the wall only as long as its tension is less than
    p w, with w their width, which is taken an edge and a half from the corner; 0.6 of that leaves room.
    Infinite where both sides are wide.
    """
    corners, near = outline.curve.at(outline.curve.corners)[:, :2], 1e-3 * outline.curve.length
    most = math.inf
    for one in () if curve.closed or not len(corners) else (curve, curve.reversed()):
        away = one.at(one.parameter(np.array([0.0, WEDGE * edge_length])))[:, :2]
        width = float(outline.tree.query_nearest(shapely.Point(away[1]), return_distance=True)[1][0])
        if np.linalg.norm(corners - away[0], axis=1).min() <= near and width < NARROW * WEDGE * edge_length:
            most = min(most, CORNER_SHARE * pressure * width)
    return most


def upright_planes(draft: Draft, walls: WallMesh, sides: Sequence[Sides]) -> list[tuple[Plane, Bools]]:
    """The vertical plane of each upright divider, and the (n,) mask of its wall and junction."""
    planes = []
    divider_of_wall = np.array([side.divider for side in sides], dtype=np.int64)
    for number, divider in enumerate(draft.plan.dividers):
        if not divider.upright:
            continue
        line, chains = draft.divider(number)
        if not is_straight(line.curve, SNAP * draft.plan.edge_length):
            raise line.error("is not straight, so no plane can hold its wall upright; remove upright = true")
        along = line.curve.at(line.curve.dense)[:, :2]
        start, way = along[0], along[-1] - along[0]
        across = np.array([-way[1], way[0]]) / (np.linalg.norm(way) or 1.0)
        foot, tip = to_space(np.array([[*start, 0.0], [*(start + across), 0.0]]), draft.plan.plane)
        own = walls.faces[divider_of_wall[walls.label] == number]
        held = np.concatenate([*(chain.vertices for chain in chains), own.ravel()])
        every = len(draft.mesh.points) + len(walls.vertices)
        planes.append((Plane(tuple(foot), tuple(tip - foot)), mask_of(held, every)))
    return planes


def rooms_between(plan: Plan, walls: Sequence[Patch], sides: Sequence[Sides]) -> list[Room]:
    """The rooms of prescribed volume: below their patches, between the walls to other rooms."""
    rooms = []
    for number, (name, room) in enumerate(plan.rooms.items()):
        signs = [(s.left == number) - (s.right == number) for s in sides]
        between = {wall.name: sign for wall, sign in zip(walls, signs, strict=True) if sign}
        rooms.append(Room(name, tuple((dict.fromkeys(room.patches, 1) | between).items()), room.volume))
    return rooms
