"""The walls below the dividers of a plan, with their tensions and the planes that hold upright ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import PlanError
from ..meshing.walls import UpperEdge, WallMesh, build_walls
from ..surface import Patch, Plane, Room
from ..surface.curves import Curve
from ..surface.pieces import to_space
from ..surface.values import balanced_wall
from .draft import Draft
from .edges import NONE
from .lines import SNAP, PlanLine
from .parts import BALANCED

if TYPE_CHECKING:
    from .plan import Plan

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
        place = draft.drawn.points[mixed[0]].round(6).tolist()
        problem = "a wall with a sloped bottom meets one whose bottom is on the plane"
        raise PlanError(f"at {place} {problem}; give both the same bottom", what="bottom", where=place)
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
    line, _ = draft.divider(number)
    net = np.abs(roof.laws[:, 0] - roof.laws[:, 1])
    pressure = min(float(net[faces].min(initial=np.inf)) for faces in beside)
    width = float(draft.radii[draft.mesh.region[np.concatenate(beside)]].min())
    most = most_in_corners(line.curve, draft.lines[0], draft.plan.edge_length, pressure)
    tensions = [roof.laws[faces, 2].tolist() for faces in beside]
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
        in_corner = np.linalg.norm(corners - away[0], axis=1).min() <= near
        if in_corner and width < NARROW * WEDGE * edge_length:
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
        along = line.curve.at(line.curve.dense)[:, :2]
        start, way = along[0], along[-1] - along[0]
        across = np.array([-way[1], way[0]]) / (np.linalg.norm(way) or 1.0)
        if line.curve.closed or np.abs((along - start) @ across).max() > SNAP * draft.plan.edge_length:
            raise line.error("is not straight, so no plane can hold its wall upright; remove upright = true")
        foot, tip = to_space(np.array([[*start, 0.0], [*(start + across), 0.0]]), draft.plan.plane)
        own = walls.faces[divider_of_wall[walls.label] == number]
        held = np.zeros(len(draft.mesh.points) + len(walls.vertices), dtype=bool)
        held[np.concatenate([*(chain.vertices for chain in chains), own.ravel()])] = True
        planes.append((Plane(tuple(foot), tuple(tip - foot)), held))
    return planes


def rooms_of(plan: Plan, walls: Sequence[Patch], sides: Sequence[Sides]) -> list[Room]:
    """The rooms of prescribed volume: below their patches, between the walls to other rooms."""
    rooms = []
    for number, (name, room) in enumerate(plan.rooms.items()):
        signs = {
            wall.name: (s.left == number) - (s.right == number) for wall, s in zip(walls, sides, strict=True)
        }
        around = dict.fromkeys(room.patches, 1) | {wall: sign for wall, sign in signs.items() if sign}
        rooms.append(Room(name, tuple(around.items()), room.volume))
    return rooms
