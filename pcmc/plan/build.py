"""The Surface of a plan: its mesh, heights, patches, supports and walls."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import PlanError, PlanWarning, SurfaceError
from ..meshing.angles import improve_angles
from ..surface import Patch, Plane, Surface
from ..surface.wall_tensions import balanced_wall
from .arrangement import Arrangement, arrange, hole_points
from .corners import most_in_corners
from .curves import Curve
from .heights import dome, harmonic_heights
from .lines import SNAP, Kind, Line
from .parts import BALANCED, EDGES, Area, PlanData
from .pieces import to_local, to_space
from .planar import PlanarMesh, locate, signed_areas, triangulate
from .walls import UpperEdge, WallMesh, build_walls

MAX_TRIANGLES = 5_000_000
MAX_EDGES = 200_000  # along a line
MAX_RISE = 10.0  # of the initial surface, over the size of the plan
GOOD_ANGLE = 28.0  # degrees; the slope makes triangles sharper than they are in plan


@dataclass(frozen=True, eq=False)
class _Draft:
    """A plan with its lines, and its plane mesh, whose first points are those of the lines."""

    plan: PlanData
    lines: Sequence[Line]
    supports_on_edge: Sequence[Curve]
    drawn: Arrangement
    mesh: PlanarMesh


@dataclass(frozen=True, eq=False)
class _Roof:
    """Positions (n,3), heights (n,) of the surface that the boundary spans, fixed (n,); of each triangle (m,)
    the pressure and tension."""

    positions: Floats
    base: Floats
    fixed: Bools
    pressure: Floats
    tension: Floats


def build_surface(plan: PlanData) -> Surface:
    """The mesh of the plan at its initial height, with its walls and supports."""
    _check_size(plan)
    draft = _drafted(plan)
    mesh = draft.mesh
    fixed, sliding = _supports(draft)
    if not (fixed | sliding).any():
        raise PlanError("nothing holds the roof; fix an edge or give supports", what="supports")
    if (fixed | sliding).all():
        raise PlanError("every vertex of the mesh is held; use a smaller edge_length", what="edge_length")
    _warn_of_free_edges(draft, fixed | sliding)
    given = np.full(len(mesh.points), np.nan)
    given[: len(draft.drawn.heights)] = draft.drawn.heights
    base = harmonic_heights(mesh.points, mesh.triangles, given)
    patches, patch_of_face = _patches(plan, mesh)
    height = base + dome(mesh.points, mesh.triangles, fixed | sliding, plan.rise)
    inner = np.arange(len(base)) >= len(draft.drawn.points)
    raised = improve_angles(np.column_stack([mesh.points, height]), mesh.triangles, inner, GOOD_ANGLE)
    pressure, tension = np.array([[p.pressure, p.tension] for p in patches])[patch_of_face].T
    roof = _Roof(to_space(raised, plan.plane), base, fixed, pressure, tension)
    walls, wall_patches, divider_of_label = _walls(draft, roof)
    return Surface(
        np.concatenate([roof.positions, walls.vertices]),
        np.concatenate([mesh.triangles, walls.faces]),
        np.concatenate([patch_of_face, walls.label + len(patches)]),
        (*patches, *wall_patches),
        np.concatenate([fixed, walls.fixed]),
        np.concatenate([sliding, walls.sliding]),
        plan.plane,
        on_planes=_upright_planes(draft, walls, divider_of_label),
    )


def _drafted(plan: PlanData) -> _Draft:
    lines, on_edge = _lines(plan)
    spots = np.array([to_local(p, plan.plane) for p in plan.supports if not isinstance(p, Curve)])
    stops = np.concatenate([np.zeros((0, 2)), *(c.at([0.0, len(c.pieces)])[:, :2] for c in on_edge)])
    drawn = arrange(lines, plan.edge_length, spots.reshape(-1, 3), stops)
    edges = np.concatenate([chain.edges for chain in drawn.chains])
    try:
        mesh = triangulate(drawn.points, edges, plan.edge_length, hole_points(drawn, lines))
    except SurfaceError as error:
        problem = f"lines of the plan are too close to each other for edges of length {plan.edge_length:g}"
        raise PlanError(f"{problem}: {error}", what="edge_length", found=plan.edge_length) from None
    return _Draft(plan, lines, on_edge, drawn, mesh)


def _check_size(plan: PlanData) -> None:
    """Refuse lengths that are probably mistakes, before they fill the memory."""

    def error(key: str, value: float, problem: str) -> PlanError:
        return PlanError(f"{key}={value:g} {problem}", what=key, found=value)

    x, y = plan.outline.local(plan.plane).at(plan.outline.dense)[:, :2].T
    area = 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))
    count = area / math.sqrt(0.1875) / plan.edge_length / plan.edge_length  # its square may be 0 or infinite
    size = float(np.hypot(np.ptp(x), np.ptp(y)))
    if count > MAX_TRIANGLES:
        problem = f"would make about {count:.2g} triangles; at most {MAX_TRIANGLES} are allowed"
        raise error("edge_length", plan.edge_length, problem)
    if plan.edge_length > size:
        problem = f"is longer than the plan, {size:.4g} from corner to corner; use a smaller one"
        raise error("edge_length", plan.edge_length, problem)
    if plan.rise is not None and plan.rise > MAX_RISE * size:
        problem = f"is more than {MAX_RISE:g} times the plan's size, {size:.4g}; use a smaller one"
        raise error("rise", plan.rise, problem)
    lines = {"the outline": plan.outline} | {hole.name: hole.curve for hole in plan.holes}
    lines |= {f"divider {divider.name!r}": divider.curve for divider in plan.dividers}
    lines |= {f"support {k}": s for k, s in enumerate(plan.supports, 1) if isinstance(s, Curve)}
    for name, curve in lines.items():
        if curve.length > MAX_EDGES * plan.edge_length:
            problem = (
                f"{name} is {curve.length:.3g} long, more than {MAX_EDGES} edges of {plan.edge_length:g}"
            )
            raise PlanError(f"{problem}; draw it as long as the plan", what=name, found=curve.length)
    for hole in plan.holes:
        xy = hole.curve.local(plan.plane).at(hole.curve.dense)[:, :2]
        extent = float(np.ptp(xy, axis=0).max())
        if extent <= SNAP * plan.edge_length:
            problem = f"is only {extent:g} wide, too little for edges of length {plan.edge_length:g}"
            problem += "; leave it out, or use a smaller edge_length"
            raise PlanError(f"{hole.name} {problem}", what=hole.name, found=extent)


def _lines(plan: PlanData) -> tuple[list[Line], list[Curve]]:
    """The lines to draw, in the coordinates of Π, and the supports that lie on the boundary."""
    lines = [Line("the outline", Kind.OUTLINE, plan.outline.local(plan.plane))]
    lines += [Line(h.name, Kind.HOLE, h.curve.local(plan.plane)) for h in plan.holes]
    boundary = list(lines)
    lines += [Line(f"divider {d.name!r}", Kind.DIVIDER, d.curve.local(plan.plane)) for d in plan.dividers]
    on_edge, snap = [], SNAP * plan.edge_length
    for number, support in enumerate(plan.supports, start=1):
        if isinstance(support, Curve):
            local = support.local(plan.plane)
            if all(any(b.nearest(xy)[1] <= snap for b in boundary) for xy in local.at(local.dense)[:, :2]):
                on_edge.append(local)
            else:
                lines.append(Line(f"support {number}", Kind.SUPPORT, local))
    return lines, on_edge


def _supports(draft: _Draft) -> tuple[Bools, Bools]:
    """(n,) fixed and sliding vertices."""
    plan, drawn = draft.plan, draft.drawn
    edges = [plan.edge, *(hole.edge for hole in plan.holes)]  # the first lines are the boundary
    masks = {kind: np.zeros(len(draft.mesh.points), dtype=bool) for kind in EDGES}
    boundary: set[int] = set()
    for chain in drawn.chains:
        if draft.lines[chain.line].kind is Kind.SUPPORT:
            masks["fixed"][chain.vertices] = True
        elif chain.line < len(edges):
            masks[edges[chain.line]][chain.vertices] = True
            boundary.update(chain.vertices.tolist())
    for support in draft.supports_on_edge:
        strip = Line("support", Kind.SUPPORT, support)
        for vertex in boundary:
            if strip.nearest(drawn.points[vertex])[1] <= SNAP * plan.edge_length:
                masks["fixed"][vertex] = True
    masks["fixed"][drawn.spots] = True
    return masks["fixed"], masks["sliding"] & ~masks["fixed"]


def _warn_of_free_edges(draft: _Draft, held: Bools) -> None:
    """Warn of free edges: the tension of the patch has nothing to pull against there."""
    for number, line in enumerate(draft.lines):
        chains = [c.vertices for c in draft.drawn.chains if c.line == number and line.bounds]
        free = list(dict.fromkeys(v for chain in chains for v in chain if not held[v]))
        if free:
            place = draft.drawn.points[free[0]].round(4).tolist()
            text = (
                f"nothing holds {line.name} at {place} ({len(free)} such vertices): the tension has"
                " nothing to pull against there, and there is probably no equilibrium; fix the edge,"
                " along a curve in space if it should be above the plane"
            )
            warnings.warn(text, PlanWarning, stacklevel=4)


def _patches(plan: PlanData, mesh: PlanarMesh) -> tuple[list[Patch], Ints]:
    """The plan's patches and the patch of each triangle."""
    count = int(mesh.region.max()) + 1
    area = signed_areas(mesh.points, mesh.triangles)
    weight = np.bincount(mesh.region, area, count)
    middle = mesh.points[mesh.triangles].mean(axis=1)
    centroid = np.stack([np.bincount(mesh.region, area * m, count) / weight for m in middle.T], axis=1)
    areas = plan.patches
    if not areas:
        assert plan.tension is not None
        areas = tuple(Area(f"patch {k + 1}", plan.tension) for k in range(count))
    located = [a for a in areas if a.at is not None]
    if not located:
        if len(areas) != count:
            problem = (
                f"the dividers cut the plan into {count} parts, but there are {len(areas)} patches"
                f" ({', '.join(a.name for a in areas)}); give one for each part, or place them with at="
            )
            raise PlanError(problem, what="patches", found=len(areas), expected=count)
        owner: Ints = np.argsort(np.lexsort(centroid.round(6).T[::-1]))
    elif len(located) < len(areas):
        missing = next(a.name for a in areas if a.at is None)
        problem = f"patch {missing!r} has no at=; give it to all patches or to none"
        raise PlanError(problem, what="at", where=missing)
    else:
        owner = _located(areas, mesh, count, centroid)
    patches = [Patch(a.name, a.tension, a.pressure) for a in areas]
    return patches, owner[mesh.region]


def _located(areas: Sequence[Area], mesh: PlanarMesh, count: int, centroid: Floats) -> Ints:
    """(count,) the area that each part of the plan belongs to."""
    owner = np.full(count, -1)
    for number, one in enumerate(areas):
        points = np.atleast_2d(np.array(one.at, dtype=float))
        for point, triangle in zip(points, locate(mesh, points), strict=True):
            if triangle < 0:
                problem = f"patch {one.name!r}: its point {point.tolist()} is not inside the plan"
                raise PlanError(problem, what="at", where=one.name, found=point.tolist())
            part = mesh.region[triangle]
            if owner[part] not in (-1, number):
                problem = (
                    f"patches {areas[owner[part]].name!r} and {one.name!r} are in the same part of the"
                    f" plan (around {centroid[part].round(3).tolist()}); draw a divider between them"
                )
                raise PlanError(problem, what="at", where=one.name)
            owner[part] = number
    bare = np.flatnonzero(owner < 0)
    if len(bare):
        place = centroid[bare[0]].round(3).tolist()
        problem = f"the part of the plan around {place} has no patch ({len(bare)} such parts)"
        raise PlanError(f"{problem}; add one with at= inside it", what="patches", where=place)
    return owner


def _upright_planes(draft: _Draft, walls: WallMesh, divider_of_label: Ints) -> tuple[tuple[Plane, Ints], ...]:
    """The vertical plane of each upright divider, and the vertices of its wall and junction."""
    planes = []
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
        chains = [c.vertices for c in draft.drawn.chains if c.line == 1 + len(draft.plan.holes) + number]
        own = walls.faces[divider_of_label[walls.label] == number]
        planes.append(
            (Plane(tuple(foot), tuple(tip - foot)), np.unique(np.concatenate([*chains, own.ravel()])))
        )
    return tuple(planes)


def _walls(draft: _Draft, roof: _Roof) -> tuple[WallMesh, list[Patch], Ints]:
    """The walls, their patches, and the divider of each: one patch for each difference of pressure along it.

    A wall takes the pressure on the left of its divider less that on the right.
    """
    plan, X = draft.plan, roof.positions
    floor, level = np.zeros(len(X)), np.zeros(len(X), dtype=bool)
    walled = []
    for chain in draft.drawn.chains:
        number = chain.line - 1 - len(plan.holes)
        if draft.lines[chain.line].kind is not Kind.DIVIDER or plan.dividers[number].wall is None:
            continue
        if plan.dividers[number].bottom == "sloped":
            floor[chain.vertices] = roof.base[chain.vertices]
        else:
            level[chain.vertices] = True
        difference = _difference(draft.mesh.triangles, roof.pressure, *chain.vertices[:2])
        walled.append((chain.vertices, (number, difference)))
    mixed = np.flatnonzero(level & (floor != 0.0))
    if len(mixed):
        place = draft.drawn.points[mixed[0]].round(6).tolist()
        problem = "a wall with a sloped bottom meets one whose bottom is on the plane"
        raise PlanError(f"at {place} {problem}; give both the same bottom", what="bottom", where=place)
    kinds = sorted(dict.fromkeys(kind for _, kind in walled), key=lambda kind: kind[0])
    tops = [UpperEdge(v, kinds.index(k), plan.dividers[k[0]].bottom != "sliding") for v, k in walled]
    patches = []
    for number, difference in kinds:
        divider, alike = plan.dividers[number], [kind for kind in kinds if kind[0] == number]
        suffix = f"-{alike.index((number, difference)) + 1}" if len(alike) > 1 else ""
        tension = _balanced(draft, roof, number) if divider.wall == BALANCED else divider.wall
        patches.append(Patch(divider.name + suffix, tension, difference, wall=True))
    numbers = np.array([number for number, _ in kinds], dtype=np.int64)
    return build_walls(X, tops, plan.edge_length, plan.plane, roof.fixed, floor), patches, numbers


def _balanced(draft: _Draft, roof: _Roof, number: int) -> float:
    """A tension for the wall of a divider with which all of its junctions balance, if there is one."""
    line = 1 + len(draft.plan.holes) + number
    beside = [_beside(draft.mesh.triangles, *c.vertices[:2]) for c in draft.drawn.chains if c.line == line]
    pressure = min(float(np.abs(roof.pressure[faces]).min(initial=np.inf)) for faces in beside)
    curve, outline = draft.lines[line].curve, draft.lines[0].curve
    most = most_in_corners(curve, outline, draft.plan.edge_length, pressure)
    return balanced_wall([roof.tension[faces].tolist() for faces in beside], most or np.inf)


def _beside(triangles: Ints, one: int, two: int) -> Ints:
    """The triangles at the edge between two vertices."""
    return np.flatnonzero((triangles == one).any(axis=1) & (triangles == two).any(axis=1))


def _difference(triangles: Ints, pressure: Floats, one: int, two: int) -> float:
    """Pressure on the left of the edge from vertex ``one`` to ``two`` less that on its right."""
    ahead = np.roll(triangles, -1, axis=1)
    left = ((triangles == one) & (ahead == two)).any(axis=1)
    right = ((triangles == two) & (ahead == one)).any(axis=1)
    return float(pressure[left].sum() - pressure[right].sum())
