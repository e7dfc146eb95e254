"""The Surface of a plan: its mesh, heights, patches, supports and walls."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import count, groupby
from typing import NamedTuple

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import PlanError, PlanWarning, SurfaceError
from ..curves.pieces import to_space
from ..forces.rooms import check_rooms
from ..meshing.angles import improve_angles
from ..meshing.planar import SIDES, PlanarMesh, signed_areas
from ..meshing.walls import UpperEdge, WallMesh, build_walls
from ..surface import Cable, Patch, Plane, Room, Surface
from ..surface.geometry import segment_lengths
from ..surface.values import balanced_wall
from .areas import patches_of
from .corners import most_in_corners
from .draft import Draft, drafted
from .edges import (
    HELD,
    NONE,
    STATES,
    check_pressures,
    edge_cables,
    mirror_planes,
    raised_heights,
    usual_cable,
)
from .heights import dome, harmonic_heights
from .held_lines import held_lines
from .lines import SNAP, Kind
from .parts import BALANCED, PlanData

SHARE = 0.6  # of p R, R of the smallest part beside a wall: more would pull a flat roof down
GOOD_ANGLE = 28.0  # degrees; the slope makes triangles sharper than they are in plan


@dataclass(frozen=True, eq=False)
class _Roof:
    """Positions (n,3), heights (n,) of the surface that the boundary spans, fixed (n,); of each triangle (m,)
    pressure, snow, the number of the room of prescribed volume below, -1 for none, and tension."""

    positions: Floats
    base: Floats
    fixed: Bools
    pressure: Floats
    snow: Floats
    room: Ints
    tension: Floats


def build_surface(plan: PlanData) -> Surface:
    """The mesh of the plan at its initial height, with its walls and supports."""
    draft = drafted(plan)
    mesh = draft.mesh
    fixed, sliding = _supports(draft)
    if not (fixed | sliding).any():
        raise PlanError("nothing holds the roof; fix an edge or give supports", what="supports")
    if (fixed | sliding).all():
        raise PlanError("every vertex of the mesh is held; use a smaller edge_length", what="edge_length")
    _warn_of_free_edges(draft, fixed | sliding)
    given = np.full(len(mesh.points), np.nan)
    given[: len(draft.drawn.heights)] = raised_heights(plan, draft.edges, draft.drawn, fixed | sliding)
    base = harmonic_heights(mesh.points, mesh.triangles, given)
    patches, patch_of_face = patches_of(plan, mesh)
    cables = _cables(draft, fixed | sliding)
    check_pressures(draft.edges, mesh.triangles, patch_of_face, patches)
    height = base + _rise(draft, patches, fixed | sliding)
    inner = np.arange(len(base)) >= len(draft.drawn.points)
    raised = improve_angles(np.column_stack([mesh.points, height]), mesh.triangles, inner, GOOD_ANGLE)
    laws = np.array([[p.pressure, p.snow, p.tension] for p in patches])
    pressure, snow, tension = laws[patch_of_face].T
    rooms = _room_of_face(plan, patches, patch_of_face)
    roof = _Roof(to_space(raised, plan.plane), base, fixed, pressure, snow, rooms, tension)
    walls, wall_patches, sides = _walls(draft, roof)
    vertices = np.concatenate([roof.positions, walls.vertices])
    surface = Surface(
        vertices,
        np.concatenate([mesh.triangles, walls.faces]),
        np.concatenate([patch_of_face, walls.label + len(patches)]),
        (*patches, *wall_patches),
        np.concatenate([fixed, walls.fixed]),
        np.concatenate([sliding, walls.sliding]),
        plan.plane,
        on_planes=(*mirror_planes(plan, vertices), *_upright_planes(draft, walls, sides)),
        cables=tuple(cables),
        rooms=tuple(_rooms(plan, wall_patches, sides)),
        curves=(*held_lines(draft, vertices, walls.feet), *walls.uprights),
    )
    _check_rooms(surface)
    return surface


def _check_rooms(surface: Surface) -> None:
    """Refuse a room that does not close, as the missing wall of a plan."""
    try:
        check_rooms(surface)
    except SurfaceError as error:
        problem, open_edges, _ = str(error).partition("; name the patches that are missing")
        if not open_edges:
            raise
        problem += "; give the dividers around it walls, or make its patches one room with those beside them"
        raise PlanError(problem, what="rooms", where=error.where, found=error.found) from None


def _rise(draft: Draft, patches: Sequence[Patch], held: Bools) -> Floats:
    """(n,) what the initial surface rises above the one that the boundary spans."""
    plan, mesh = draft.plan, draft.mesh
    walled = any(divider.wall is not None for divider in plan.dividers)
    if plan.rise is None and not walled and all(patch.net_pressure == 0.0 for patch in patches):
        return np.zeros(len(mesh.points))  # a sail starts without a dome
    return dome(mesh.points, mesh.triangles, held, plan.rise)


def _supports(draft: Draft) -> tuple[Bools, Bools]:
    """(n,) fixed and sliding vertices."""
    drawn, edges = draft.drawn, draft.edges
    fixed, sliding = np.zeros((2, len(draft.mesh.points)), dtype=bool)
    fixed[edges.vertices("fixed", HELD)] = True
    sliding[edges.vertices("sliding")] = True
    for chain in drawn.chains:
        if draft.lines[chain.line].kind is Kind.SUPPORT:
            fixed[chain.vertices] = True
    fixed[drawn.spots] = True
    return fixed, sliding & ~fixed


def _warn_of_free_edges(draft: Draft, held: Bools) -> None:
    """Warn of free edges: the tension of the patch has nothing to pull against there."""
    edges = draft.edges
    for number, line in enumerate(draft.lines):
        chosen = edges.ends[(edges.line == number) & (edges.state == STATES.index("free"))]
        free = [v for v in dict.fromkeys(chosen[:, 0].tolist()) if not held[v]]
        if free:
            place = draft.drawn.points[free[0]].round(4).tolist()
            text = (
                f"nothing holds {line.name} at {place} ({len(free)} such vertices): the tension has"
                " nothing to pull against there, and there is probably no equilibrium; fix the edge, along a"
                " curve in space if it should be above the plane, or give it a cable:"
                f" {_cable_keys(draft.plan)}"
            )
            warnings.warn(text, PlanWarning, stacklevel=4)


def _cable_keys(plan: PlanData) -> str:
    """The keys that make a free edge of a plan one with a cable; it closes no space for a pressure."""
    areas = plan.patches
    if plan.tension is not None and plan.pressure:
        at_one = usual_cable(replace(plan, tension=1.0))
        return f'edge = "cable", cable = {at_one:g}, tension = 1.0, pressure = 0.0'
    pressed = ", and pressure = 0.0 of its patches" if any(area.pressure for area in areas) else ""
    return f'edge = "cable", cable = {usual_cable(plan):g}{pressed}'


def _cables(draft: Draft, held: Bools) -> list[Cable]:
    """The cables of the edges, and those along dividers."""
    numbers = count(1)
    cables = edge_cables(draft.edges, held, numbers)
    first = 1 + len(draft.plan.holes)
    for k, divider in enumerate(draft.plan.dividers):
        if divider.cable is None:
            continue
        parts = [chain.edges for chain in draft.drawn.along(first + k)]
        named = divider.wall is None and not divider.name.startswith("divider ")
        name = divider.name if named else f"cable {next(numbers)}"
        cables.append(Cable(name, divider.cable, np.concatenate(parts)))
    return cables


def _upright_planes(draft: Draft, walls: WallMesh, sides: Sequence[_Sides]) -> list[tuple[Plane, Bools]]:
    """The vertical plane of each upright divider, and the (n,) mask of its wall and junction."""
    planes = []
    divider_of_wall = np.array([side.divider for side in sides], dtype=np.int64)
    for number, divider in enumerate(draft.plan.dividers):
        if not divider.upright:
            continue
        line = draft.lines[1 + len(draft.plan.holes) + number]
        along = line.curve.at(line.curve.dense)[:, :2]
        start, way = along[0], along[-1] - along[0]
        across = np.array([-way[1], way[0]]) / (np.linalg.norm(way) or 1.0)
        if line.curve.closed or np.abs((along - start) @ across).max() > SNAP * draft.plan.edge_length:
            raise line.error("is not straight, so no plane can hold its wall upright; remove upright = true")
        foot, tip = to_space(np.array([[*start, 0.0], [*(start + across), 0.0]]), draft.plan.plane)
        chains = [c.vertices for c in draft.drawn.along(1 + len(draft.plan.holes) + number)]
        own = walls.faces[divider_of_wall[walls.label] == number]
        held = np.zeros(len(draft.mesh.points) + len(walls.vertices), dtype=bool)
        held[np.concatenate([*chains, own.ravel()])] = True
        planes.append((Plane(tuple(foot), tuple(tip - foot)), held))
    return planes


def _room_of_face(plan: PlanData, patches: Sequence[Patch], patch_of_face: Ints) -> Ints:
    """(m,) the room of prescribed volume below each face, -1 for none."""
    room = {name: k for k, room in enumerate(plan.rooms.values()) for name in room.patches}
    return np.array([room.get(patch.name, NONE) for patch in patches], dtype=np.int64)[patch_of_face]


def _walls(draft: Draft, roof: _Roof) -> tuple[WallMesh, list[Patch], list[_Sides]]:
    """The walls and their patches: one for each divider and each pair of pressures and rooms along it.

    A wall takes the pressure on the left of its divider less that on the right.
    """
    plan, X = draft.plan, roof.positions
    floor, level = np.zeros(len(X)), np.zeros(len(X), dtype=bool)
    walled: list[tuple[Ints, int]] = []
    for chain in draft.drawn.chains:
        number = chain.line - 1 - len(plan.holes)
        if draft.lines[chain.line].kind is not Kind.DIVIDER or plan.dividers[number].wall is None:
            continue
        if plan.dividers[number].bottom == "sloped":
            floor[chain.vertices] = roof.base[chain.vertices]
        else:
            level[chain.vertices] = True
        walled.append((chain.vertices, number))
    mixed = np.flatnonzero(level & (floor != 0.0))
    if len(mixed):
        place = draft.drawn.points[mixed[0]].round(6).tolist()
        problem = "a wall with a sloped bottom meets one whose bottom is on the plane"
        raise PlanError(f"at {place} {problem}; give both the same bottom", what="bottom", where=place)
    beside = _beside(draft.mesh.triangles, np.array([v[:2] for v, _ in walled]).reshape(-1, 2))
    kinds: dict[tuple[int, _Sides], list[tuple[Ints, Ints]]] = {}
    for (vertices, number), faces in zip(walled, beside, strict=True):
        kinds.setdefault((number, _sides(roof, *faces)), []).append((vertices, faces[faces >= 0]))
    kinds = dict(sorted(kinds.items(), key=lambda kind: kind[0][0]))
    radii, tops = _radii(draft.mesh), list[UpperEdge]()
    patches: list[Patch] = []
    for number, group in groupby(kinds, key=lambda kind: kind[0]):
        divider, alike = plan.dividers[number], list(group)
        own = [kinds[kind] for kind in alike]
        tension = divider.wall
        if tension == BALANCED:
            faces = [beside for chains in own for _, beside in chains]
            tension = _balanced(draft, roof, number, faces, radii)
        for k, ((_, sides), chains) in enumerate(zip(alike, own, strict=True), start=1):
            tops += [UpperEdge(v, len(patches), divider.bottom != "sliding") for v, _ in chains]
            name = f"{divider.name}-{k}" if len(alike) > 1 else divider.name
            patches.append(Patch(name, tension, sides.pressure, wall=True, snow=sides.snow))
    walls = build_walls(X, tops, plan.edge_length, plan.plane, roof.fixed, floor)
    return walls, patches, [sides._replace(divider=number) for number, sides in kinds]


def _balanced(draft: Draft, roof: _Roof, number: int, beside: Sequence[Ints], radii: Floats) -> float:
    """A tension for the wall of a divider with which all of its junctions balance, if there is one.

    ``beside`` are the triangles at each of its junctions, ``radii`` those of the parts of the plan.
    """
    net = np.abs(roof.pressure - roof.snow)
    pressure = min(float(net[faces].min(initial=np.inf)) for faces in beside)
    line, outline = draft.lines[1 + len(draft.plan.holes) + number], draft.lines[0]
    width = float(radii[draft.mesh.region[np.concatenate(beside)]].min())
    most = most_in_corners(line.curve, outline, draft.plan.edge_length, pressure)
    tensions = [roof.tension[faces].tolist() for faces in beside]
    if draft.plan.dividers[number].upright:  # its plane takes the difference
        tensions = [[min(part)] for part in tensions]
    return balanced_wall(tensions, min(most, SHARE * pressure * width) or np.inf)


def _radii(mesh: PlanarMesh) -> Floats:
    """2 A / L of each part of the plan, with its area A and the length L of its edge: R of a circle."""
    sides = np.sort(mesh.triangles[:, SIDES].reshape(-1, 2), axis=1)
    owned = np.column_stack([np.repeat(mesh.region, 3), sides])
    own, times = np.unique(owned, axis=0, return_counts=True)
    own = own[times == 1]
    length = np.bincount(own[:, 0], segment_lengths(mesh.points, own[:, 1:]))
    return 2.0 * np.bincount(mesh.region, signed_areas(mesh.points, mesh.triangles)) / length


def _beside(triangles: Ints, edges: Ints) -> Ints:
    """(e,2) the triangles on the left and on the right of edges (e,2), -1 for none."""
    n = int(triangles.max()) + 1
    keys = (triangles * n + np.roll(triangles, -1, axis=1)).ravel()
    order = np.argsort(keys)
    wanted = np.stack([edges @ [n, 1], edges @ [1, n]], axis=1)
    place = order[np.minimum(np.searchsorted(keys, wanted, sorter=order), len(keys) - 1)]
    return np.where(keys[place] == wanted, place // 3, NONE)


class _Sides(NamedTuple):
    """Of a wall: the pressure and the snow on the left less those on the right, the rooms there, -1 for none,
    and its divider."""

    pressure: float
    snow: float
    left: int
    right: int
    divider: int = NONE


def _sides(roof: _Roof, left: int, right: int) -> _Sides:
    """The sides of an edge, of the triangles there."""
    there = [face for face in (left, right) if face >= 0]
    sign = np.array([1.0 if face == left else -1.0 for face in there])
    rooms = (int(roof.room[face]) if face >= 0 else NONE for face in (left, right))
    pressure, snow = (float(of[there] @ sign) for of in (roof.pressure, roof.snow))
    return _Sides(pressure, snow, *rooms)


def _rooms(plan: PlanData, walls: Sequence[Patch], sides: Sequence[_Sides]) -> list[Room]:
    """The rooms of prescribed volume: below their patches, between the walls to other rooms."""
    rooms = []
    for number, (name, room) in enumerate(plan.rooms.items()):
        around = dict.fromkeys(room.patches, 1)
        for wall, side in zip(walls, sides, strict=True):
            sign = (side.left == number) - (side.right == number)
            if sign:
                around[wall.name] = sign
        rooms.append(Room(name, tuple(around.items()), room.volume))
    return rooms
