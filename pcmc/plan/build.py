"""The Surface of a plan: its mesh, heights, patches, supports and walls."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import PlanError, PlanWarning, SurfaceError
from ..meshing.angles import improve_angles
from ..surface import Patch, Surface
from .arrangement import Arrangement, arrange, hole_points
from .curves import Curve, to_local, to_space
from .heights import dome, harmonic_heights
from .lines import SNAP, Kind, Line
from .parts import EDGES, Area
from .plan import Plan
from .planar import PlanarMesh, locate, signed_areas, triangulate
from .walls import UpperEdge, WallMesh, build_walls

MAX_TRIANGLES = 5_000_000
MAX_RISE = 10.0  # of the initial surface, over the size of the plan
GOOD_ANGLE = 28.0  # degrees; the slope makes triangles sharper than they are in plan


def build_surface(plan: Plan) -> Surface:
    """The mesh of the plan at its initial height, with its walls and supports."""
    _check_size(plan)
    lines, on_edge = _lines(plan)
    spots = np.array([to_local(p, plan.plane) for p in plan.supports if not isinstance(p, Curve)])
    stops = np.concatenate([np.zeros((0, 2)), *(c.at([0.0, len(c.pieces)])[:, :2] for c in on_edge)])
    drawn = arrange(lines, plan.edge_length, spots.reshape(-1, 3), stops)
    mesh = _meshed(plan, drawn, hole_points(drawn, lines))
    fixed, sliding = _supports(plan, drawn, lines, on_edge, len(mesh.points))
    if not (fixed | sliding).any():
        raise PlanError("nothing holds the roof; fix an edge or give supports", what="supports")
    if (fixed | sliding).all():
        raise PlanError("every vertex of the mesh is held; use a smaller edge_length", what="edge_length")
    _warn_of_free_edges(drawn, lines, fixed | sliding)
    base, height = _heights(plan, drawn, mesh, fixed | sliding)
    patches, patch_of_face = _patches(plan, mesh)
    raised = np.column_stack([mesh.points, height])
    inner = np.arange(len(raised)) >= len(drawn.points)
    X = to_space(improve_angles(raised, mesh.triangles, inner, GOOD_ANGLE), plan.plane)
    pressure = np.array([p.pressure for p in patches])[patch_of_face]
    walls, wall_patches = _walls(plan, drawn, lines, mesh.triangles, pressure, X, base, fixed)
    return Surface(
        np.concatenate([X, walls.vertices]),
        np.concatenate([mesh.triangles, walls.faces]),
        np.concatenate([patch_of_face, walls.label + len(patches)]),
        (*patches, *wall_patches),
        np.concatenate([fixed, walls.fixed]),
        np.concatenate([sliding, walls.sliding]),
        plan.plane,
    )


def _meshed(plan: Plan, drawn: Arrangement, holes: Sequence[Sequence[float]]) -> PlanarMesh:
    try:
        return triangulate(
            drawn.points, np.concatenate([chain.edges for chain in drawn.chains]), plan.edge_length, holes
        )
    except SurfaceError as error:
        raise PlanError(
            f"lines of the plan are too close to each other for edges of length"
            f" {plan.edge_length:g}: {error}",
            what="edge_length",
            found=plan.edge_length,
        ) from None


def _check_size(plan: Plan) -> None:
    """Refuse lengths that are probably mistakes, before they fill the memory."""

    def error(key: str, problem: str) -> PlanError:
        value = getattr(plan, key)
        return PlanError(f"{key}={value:g} {problem}", what=key, found=value)

    x, y = plan.outline.local(plan.plane).at(plan.outline.dense)[:, :2].T
    area = 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))
    count = area / (np.sqrt(0.1875) * plan.edge_length**2)
    size = float(np.hypot(np.ptp(x), np.ptp(y)))
    if count > MAX_TRIANGLES:
        limit = f"at most {MAX_TRIANGLES} are allowed"
        raise error("edge_length", f"would make about {count:.2g} triangles; {limit}")
    if plan.edge_length > size:
        problem = f"is longer than the plan, {size:.4g} from corner to corner; use a smaller one"
        raise error("edge_length", problem)
    if plan.rise is not None and plan.rise > MAX_RISE * size:
        limit = f"{MAX_RISE:g} times the plan's size, {size:.4g}"
        raise error("rise", f"is more than {limit}; use a smaller one")
    for hole in plan.holes:
        xy = hole.curve.local(plan.plane).at(hole.curve.dense)[:, :2]
        extent = float(np.ptp(xy, axis=0).max())
        if extent <= SNAP * plan.edge_length:
            raise PlanError(
                f"{hole.name} is only {extent:g} wide, too little for edges of length"
                f" {plan.edge_length:g}; leave it out, or use a smaller edge_length",
                what=hole.name,
                found=extent,
            )


def _lines(plan: Plan) -> tuple[list[Line], list[Curve]]:
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


def _supports(
    plan: Plan, drawn: Arrangement, lines: Sequence[Line], on_edge: Sequence[Curve], n: int
) -> tuple[Bools, Bools]:
    """(n,) fixed and sliding vertices."""
    edge = {line.name: hole.edge for line, hole in zip(lines[1:], plan.holes, strict=False)}
    masks = {kind: np.zeros(n, dtype=bool) for kind in EDGES}
    boundary = np.zeros(n, dtype=bool)
    for chain in drawn.chains:
        line = lines[chain.line]
        if line.kind is Kind.SUPPORT:
            masks["fixed"][chain.vertices] = True
        elif line.bounds:
            held = plan.edge if line.kind is Kind.OUTLINE else edge[line.name]
            masks[held][chain.vertices] = True
            boundary[chain.vertices] = True
    for support in on_edge:
        strip = Line("support", Kind.SUPPORT, support)
        for vertex in np.flatnonzero(boundary):
            if strip.nearest(drawn.points[vertex])[1] <= SNAP * plan.edge_length:
                masks["fixed"][vertex] = True
    masks["fixed"][drawn.spots] = True
    return masks["fixed"], masks["sliding"] & ~masks["fixed"]


def _warn_of_free_edges(drawn: Arrangement, lines: Sequence[Line], held: Bools) -> None:
    """Warn of free edges: the tension of the patch has nothing to pull against there."""
    for line in (line for line in lines if line.bounds):
        chains = [c.vertices for c in drawn.chains if lines[c.line] is line]
        free = list(dict.fromkeys(v for chain in chains for v in chain if not held[v]))
        if free:
            place = drawn.points[free[0]].round(4).tolist()
            text = (
                f"nothing holds {line.name} at {place} ({len(free)} such vertices): the tension has"
                " nothing to pull against there, and there is probably no equilibrium; fix the edge,"
                " along a curve in space if it should be above the plane"
            )
            warnings.warn(text, PlanWarning, stacklevel=4)


def _heights(plan: Plan, drawn: Arrangement, mesh: PlanarMesh, held: Bools) -> tuple[Floats, Floats]:
    """(n,) the heights of the surface that the boundary spans, and of the initial surface."""
    given = np.full(len(mesh.points), np.nan)
    given[: len(drawn.heights)] = drawn.heights
    base = harmonic_heights(mesh.points, mesh.triangles, given)
    return base, base + dome(mesh.points, mesh.triangles, held, plan.rise)


def _patches(plan: Plan, mesh: PlanarMesh) -> tuple[list[Patch], Ints]:
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
            raise PlanError(
                f"the dividers cut the plan into {count} parts, but there are {len(areas)} patches"
                f" ({', '.join(a.name for a in areas)}); give one for each part, or place them with at=",
                what="patches",
                found=len(areas),
                expected=count,
            )
        owner: Ints = np.argsort(np.lexsort(centroid.round(6).T[::-1]))
    elif len(located) < len(areas):
        missing = next(a.name for a in areas if a.at is None)
        raise PlanError(
            f"patch {missing!r} has no at=; give it to all patches or to none", what="at", where=missing
        )
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
                raise PlanError(
                    f"patch {one.name!r}: its point {point.tolist()} is not inside the plan",
                    what="at",
                    where=one.name,
                    found=point.tolist(),
                )
            part = mesh.region[triangle]
            if owner[part] not in (-1, number):
                raise PlanError(
                    f"patches {areas[owner[part]].name!r} and {one.name!r} are in the same part of the"
                    f" plan (around {centroid[part].round(3).tolist()}); draw a divider between them",
                    what="at",
                    where=one.name,
                    found=areas[owner[part]].name,
                )
            owner[part] = number
    bare = np.flatnonzero(owner < 0)
    if len(bare):
        raise PlanError(
            f"the part of the plan around {centroid[bare[0]].round(3).tolist()} has no patch"
            f" ({len(bare)} such parts); add one with at= inside it",
            what="patches",
            where=centroid[bare[0]].round(3).tolist(),
        )
    return owner


def _walls(
    plan: Plan,
    drawn: Arrangement,
    lines: Sequence[Line],
    triangles: Ints,
    pressure: Floats,
    X: Floats,
    base: Floats,
    fixed: Bools,
) -> tuple[WallMesh, list[Patch]]:
    """The walls and their patches: one for each divider and each difference of pressure along it.

    A wall takes the pressure on the left of its divider less that on the right.
    """
    first = 1 + len(plan.holes)
    kinds: list[tuple[int, float]] = []
    floor, level = np.zeros(len(X)), np.zeros(len(X), dtype=bool)
    tops = []
    for chain in drawn.chains:
        if lines[chain.line].kind is not Kind.DIVIDER:
            continue
        divider = plan.dividers[chain.line - first]
        if divider.wall is None:
            continue
        if divider.bottom == "sloped":
            floor[chain.vertices] = base[chain.vertices]
        else:
            level[chain.vertices] = True
        one, two = chain.vertices[:2]
        kind = (chain.line - first, _beside(triangles, pressure, one, two))
        if kind not in kinds:
            kinds.append(kind)
        tops.append(UpperEdge(chain.vertices, kinds.index(kind), divider.bottom != "sliding"))
    mixed = np.flatnonzero(level & (floor != 0.0))
    if len(mixed):
        raise PlanError(
            f"at {drawn.points[mixed[0]].round(6).tolist()} a wall with a sloped bottom meets one"
            " whose bottom is on the plane; give both the same bottom",
            what="bottom",
            where=drawn.points[mixed[0]].round(6).tolist(),
        )
    walls = build_walls(X, tops, plan.edge_length, plan.plane, fixed, floor)
    order = sorted(range(len(kinds)), key=lambda k: kinds[k][0])
    walls = replace(walls, label=np.argsort(order)[walls.label] if kinds else walls.label)
    return walls, [_wall_patch(plan, kinds, k) for k in order]


def _beside(triangles: Ints, pressure: Floats, one: int, two: int) -> float:
    """Pressure on the left of the edge from vertex ``one`` to ``two`` less that on its right."""
    ahead = np.roll(triangles, -1, axis=1)
    left = ((triangles == one) & (ahead == two)).any(axis=1)
    right = ((triangles == two) & (ahead == one)).any(axis=1)
    return float(pressure[left].sum() - pressure[right].sum())


def _wall_patch(plan: Plan, kinds: Sequence[tuple[int, float]], number: int) -> Patch:
    divider = plan.dividers[kinds[number][0]]
    alike = [k for k, (line, _) in enumerate(kinds) if line == kinds[number][0]]
    suffix = f"-{alike.index(number) + 1}" if len(alike) > 1 else ""
    assert divider.wall is not None
    return Patch(divider.name + suffix, divider.wall, kinds[number][1], wall=True)
