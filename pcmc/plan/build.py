"""The Surface of a plan: its mesh, heights, patches, supports and walls."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import count
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints, toml
from ..base.errors import PlanError, PlanWarning, SurfaceError
from ..base.libraries import shapely
from ..base.tolerances import ON
from ..forces.rooms import check_rooms
from ..meshing.planar import PlanarMesh, locate, signed_areas
from ..meshing.quality import improve_angles
from ..surface import Cable, HeldCurve, Patch, Surface
from ..surface.curves import Curve, polyline
from ..surface.geometry import bounding_size
from ..surface.pieces import Piece, point_text, to_space
from ..surface.supports import by_planes, common_point, members
from ..surface.values import BELOW
from .draft import Draft, Roof, drafted, rooms_between, upright_planes, walls_of
from .edges import NONE, check_pressures, edge_cables, mirror_planes, raised_heights, usual_cable
from .lines import SNAP, Kind, PlanLine
from .parts import PatchSpec

if TYPE_CHECKING:
    from .plan import Plan

RISE = 0.3  # of the radius of the largest circle without supports: a shallow dome
FULLNESS = 0.75  # power of the membrane's height; below 1 the dome is steeper at its edge
SLOPE = 0.8  # largest slope of the dome; steeper ones stretch the triangles
LEAST = 0.15  # of that slope: smallest slope, so that walls have room
REACH = 3.0 * SNAP  # of the edge length: farther from a curve no vertex is put where lines meet
FAR = 0.5  # of the size of the outline: of a divider that ends farther beyond it a warning tells
CORNERS = 8  # of the outline, at most, that are named as supports
GOOD_ANGLE = 28.0  # degrees; the slope makes triangles sharper than they are in plan


def build_surface(plan: Plan) -> Surface:
    """The mesh of the plan at its initial height, with its walls and supports."""
    if plan.cushion is not None:
        _check_cushion(plan)
    draft = drafted(plan)
    _warn_of_long_dividers(draft)
    mesh, drawn = draft.mesh, draft.drawn
    fixed, sliding = _supports(draft)
    held = fixed | sliding
    if not held.any():
        corners = toml([piece.points[0].tolist() for piece in plan.outline.pieces[:CORNERS]])
        hint = f"fix an edge or give supports, such as supports = {corners} under [plan]"
        raise PlanError(f"nothing holds the roof; {hint}", what="supports")
    if held.all():
        raise PlanError("every vertex of the mesh is held; use a smaller edge_length", what="edge_length")
    _warn_of_free_edges(draft, held)
    given = np.full(len(mesh.points), np.nan)
    given[: len(drawn.heights)] = raised_heights(plan, draft.edges, drawn, held)
    base = harmonic_heights(mesh.points, mesh.triangles, given)
    patches, patch_of_face = _patches(plan, mesh)
    cables = _cables(draft, held)
    check_pressures(draft.edges, mesh.triangles, patch_of_face, patches)
    height = base
    walled = any(divider.wall is not None for divider in plan.dividers)
    if plan.rise is not None or walled or any(patch.net_pressure != 0.0 for patch in patches):
        height = base + dome(mesh.points, mesh.triangles, held, plan.rise)  # a sail starts without
    inner = np.arange(len(base)) >= len(drawn.points)
    raised = improve_angles(np.column_stack([mesh.points, height]), mesh.triangles, inner, GOOD_ANGLE)
    laws = np.array([[p.pressure, p.snow, p.tension] for p in patches])[patch_of_face]
    room = {name: k for k, room in enumerate(plan.rooms.values()) for name in room.patches}
    room_of_face = np.array([room.get(patch.name, NONE) for patch in patches])[patch_of_face]
    roof = Roof(to_space(raised, plan.plane), base, fixed, laws, room_of_face)
    walls, wall_patches, sides = walls_of(draft, roof)
    vertices = np.concatenate([roof.positions, walls.vertices])
    still = np.concatenate([fixed, walls.fixed])
    uprights = upright_planes(draft, walls, sides)
    planes = (*mirror_planes(plan, vertices), *uprights)
    # where a line ends on an upright one, its end may be off it by the digits that were typed
    moved = members(uprights, len(vertices)) & ~np.pad(fixed, (0, len(walls.vertices)))
    for meeting, rows in by_planes(planes, moved):
        vertices[rows] = [common_point(place, meeting) for place in vertices[rows]]
    surface = Surface(
        vertices,
        np.concatenate([mesh.triangles, walls.faces]),
        np.concatenate([patch_of_face, walls.label + len(patches)]),
        (*patches, *wall_patches),
        still,
        np.concatenate([sliding, walls.sliding]),
        plan.plane,
        on_planes=planes,
        cables=tuple(cables),
        rooms=tuple(rooms_between(plan, wall_patches, sides)),
        curves=(*held_lines(draft, vertices, walls.feet, still), *walls.uprights),
    )
    try:
        check_rooms(surface)
    except SurfaceError as error:  # a room that does not close, as the missing wall of a plan
        problem, open_edges, _ = str(error).partition("; name the patches that are missing")
        if not open_edges:
            raise
        problem += "; give the dividers around it walls, or make its patches one room with those beside them"
        raise PlanError(problem, what="rooms", where=error.where, found=error.found) from None
    return surface if plan.cushion is None else _with_sheet_below(surface, plan.cushion)


def _check_cushion(plan: Plan) -> None:
    """Refuse what two sheets on one rim cannot have."""
    edges = {"the outline": plan.edge} | {hole.name: hole.edge for hole in plan.holes}
    bad = [f'{name} has edge = "{edge}"; make it "fixed"' for name, edge in edges.items() if edge != "fixed"]
    bad += [f"divider {d.name!r} has a wall; type wall = false" for d in plan.dividers if d.wall is not None]
    bad += [f"divider {d.name!r} has a cable; leave it out" for d in plan.dividers if d.cable is not None]
    parts = ("cables", "rooms", "supports")
    bad += [f"the plan has {key}; leave them out" for key in parts if getattr(plan, key)]
    bad += [f"patch {p.name!r} has a volume; give it a pressure instead" for p in plan.patches if p.volume]
    pressures = {f"patch {p.name!r}": p.pressure for p in plan.patches} or {"the plan": plan.pressure}
    bad += [f"{of} has the pressure {p:g}; give one above 0" for of, p in pressures.items() if p <= 0.0]
    if bad:
        text = f"a cushion is two sheets on one fixed rim, with air between them, but {bad[0]}"
        raise PlanError(text, what="cushion", found=plan.cushion)


def _with_sheet_below(surface: Surface, factor: float) -> Surface:
    """The surface and its mirror image in Π, turned over and held at the same fixed vertices; there patches
    have ``factor`` times the tension, and no snow."""
    F, topo = surface.faces.astype(np.int64), surface.topology
    for f in np.flatnonzero(surface.pinned[F].all(axis=1)).tolist():  # both sheets would have this triangle
        sides = np.flatnonzero(topo.valence[topo.edge_of_face[f]] == 2)
        beside = np.flatnonzero((topo.edge_of_face == topo.edge_of_face[f, sides[0]]).any(axis=1))
        g = int(beside[beside != f][0])
        b, a, c = np.roll(F[f], -int(sides[0]))
        d = int(F[g].sum() - a - c)
        if len(sides) > 1 or surface.pinned[d] or surface.patch_of_face[f] != surface.patch_of_face[g]:
            text = "cushion: a triangle has all corners on the rim; use a smaller edge_length"
            raise PlanError(text, what="edge_length", where=surface.vertices[b].round(3).tolist())
        F[f], F[g] = (b, a, d), (b, d, c)
    n, inner, patches = surface.n, ~surface.pinned, surface.patches
    number = np.where(inner, n + np.cumsum(inner) - 1, np.arange(n))
    free = surface.vertices[inner]
    image = free - 2.0 * surface.plane.height(free)[:, None] * np.array(surface.plane.normal)
    below = [replace(p, name=f"{p.name}{BELOW}", tension=factor * p.tension, snow=0.0) for p in patches]
    return Surface(
        np.concatenate([surface.vertices, image]),
        np.concatenate([F, number[F][:, ::-1]]),
        np.concatenate([surface.patch_of_face, surface.patch_of_face + len(patches)]),
        (*patches, *below),
        np.concatenate([surface.pinned, np.zeros(len(free), dtype=bool)]),
        plane=surface.plane,
        on_planes=tuple((plane, np.concatenate([on, on[inner]])) for plane, on in surface.on_planes),
        curves=surface.curves,
    )


def _supports(draft: Draft) -> tuple[Bools, Bools]:
    fixed, sliding = np.zeros((2, len(draft.mesh.points)), dtype=bool)
    lines = [c.vertices for c in draft.drawn.chains if draft.lines[c.line].kind is Kind.SUPPORT]
    for vertices in (draft.edges.vertices("fixed", "held", "inside"), draft.drawn.required, *lines):
        fixed[vertices] = True
    sliding[draft.edges.vertices("sliding")] = True
    return fixed, sliding & ~fixed


def _warn_of_long_dividers(draft: Draft) -> None:
    """Warn of dividers drawn far beyond the outline: what is outside is left out, and may be a slip."""
    outline = shapely.Polygon(draft.lines[0].xy)
    for line in draft.lines:
        if line.kind is Kind.DIVIDER and not line.curve.closed:
            away = shapely.distance(outline, shapely.points(line.xy[[0, -1]]))
            end = int(away.argmax())
            if away[end] > FAR * bounding_size(draft.lines[0].xy):
                text = f"{line.name} ends at {point_text(line.xy[-end])}, {away[end]:.3g} beyond the outline;"
                warnings.warn(f"{text} what is outside is left out", PlanWarning, stacklevel=4)


def _warn_of_free_edges(draft: Draft, held: Bools) -> None:
    """Warn of free edges: the tension of the patch has nothing to pull against there."""
    edges, plan = draft.edges, draft.plan
    for number, line in enumerate(draft.lines):
        chosen = edges.ends[(edges.line == number) & edges.among("free")]
        free = [v for v in dict.fromkeys(chosen[:, 0].tolist()) if not held[v]]
        if not free:
            continue
        whole = plan.tension is not None and bool(plan.pressure)
        more = ", tension = 1.0, pressure = 0.0" if whole else ""  # with a cable it closes no space
        more += ", and pressure = 0.0 of its patches" if any(patch.pressure for patch in plan.patches) else ""
        cable = usual_cable(replace(plan, tension=1.0) if whole else plan)
        text = (
            f"nothing holds {line.name} at {point_text(draft.drawn.points[free[0]])} ({len(free)} such"
            " vertices): the tension has nothing to pull against there, and there is probably no equilibrium;"
            " fix the edge, along a curve in space if it should be above the plane, or give it a cable:"
            f' edge = "cable", cable = {cable:g}{more}'
        )
        warnings.warn(text, PlanWarning, stacklevel=4)


def _cables(draft: Draft, held: Bools) -> list[Cable]:
    numbers = count(1)
    cables = edge_cables(draft.edges, held, numbers)
    for number, divider in enumerate(draft.plan.dividers):
        if divider.cable is not None:
            named = divider.wall is None and not divider.name.startswith("divider ")
            name = divider.name if named else f"cable {next(numbers)}"
            along = np.concatenate([chain.edges for chain in draft.divider(number)[1]])
            cables.append(Cable(name, divider.cable, along, divider.cable_weight))
    return cables


def _patches(plan: Plan, mesh: PlanarMesh) -> tuple[list[Patch], Ints]:
    """The plan's patches and the patch (m,) of each triangle; PlanError unless each part has one."""
    parts = int(mesh.region.max()) + 1
    area = signed_areas(mesh.points, mesh.triangles)
    weight = np.bincount(mesh.region, area, parts)
    middle = mesh.points[mesh.triangles].mean(axis=1)
    centroid = np.stack([np.bincount(mesh.region, area * m, parts) / weight for m in middle.T], axis=1)
    specs: tuple[PatchSpec, ...] = plan.patches
    if not specs:
        assert plan.tension is not None
        values = {"tension": plan.tension, "pressure": plan.pressure, "weight": plan.weight}
        specs = tuple(PatchSpec(f"patch {k + 1}", **values) for k in range(parts))
    bare = [spec.name for spec in specs if spec.at is None]
    if not bare:
        owner = _located(specs, mesh, centroid)
    elif len(bare) < len(specs):
        problem = f"patch {bare[0]!r} has no at=; give it to all patches or to none"
        raise PlanError(problem, what="at", where=bare[0])
    elif len(specs) != parts:
        problem = f"the dividers cut the plan into {parts} parts, but the patches are {len(specs)}"
        problem += f" ({', '.join(bare)}); give one for each part, or place them with at="
        raise PlanError(problem, what="patches", found=len(specs), expected=parts)
    else:
        owner = np.argsort(np.lexsort(centroid.round(6).T[::-1]))
    loads = zip(specs, [plan.snow if spec.snow is None else spec.snow for spec in specs], strict=True)
    patches = [Patch(s.name, s.tension, s.pressure, weight=s.weight, snow=snow) for s, snow in loads]
    return patches, owner[mesh.region]


def _located(specs: Sequence[PatchSpec], mesh: PlanarMesh, centroid: Floats) -> Ints:
    owner = np.full(len(centroid), -1)
    for number, spec in enumerate(specs):
        points = np.atleast_2d(np.array(spec.at, dtype=float))
        for point, triangle in zip(points, locate(mesh, points), strict=True):
            if triangle < 0:
                problem = f"patch {spec.name!r}: its point {point.tolist()} is not inside the plan"
                raise PlanError(problem, what="at", where=spec.name, found=point.tolist())
            part = mesh.region[triangle]
            if owner[part] not in (-1, number):
                around = point_text(centroid[part])
                problem = f"patches {specs[owner[part]].name!r} and {spec.name!r} are in the same part of the"
                problem += f" plan (around {around}); draw a divider between them"
                raise PlanError(problem, what="at", where=spec.name)
            owner[part] = number
    bare = np.flatnonzero(owner < 0)
    if len(bare):
        place = centroid[bare[0]]
        others = f" ({len(bare)} such parts)" if len(bare) > 1 else ""
        problem = f"the part of the plan around {point_text(place)} has no patch{others}; add one with at="
        problem += " inside it"
        raise PlanError(problem, what="patches", where=place.round(3).tolist())
    return owner


def stiffness(points: Floats, triangles: Ints) -> csr_array:
    """(n,n) cotangent matrix L of plane triangles: uᵀ L u = ∫ |∇u|² for u linear on each.

    >>> L = stiffness(np.array([[0, 0], [1, 0], [0, 1.0]]), np.array([[0, 1, 2]]))
    >>> L.toarray().tolist()
    [[1.0, -0.5, -0.5], [-0.5, 0.5, 0.0], [-0.5, 0.0, 0.5]]
    """
    X = points[triangles]
    opposite = X[:, [2, 0, 1]] - X[:, [1, 2, 0]]
    area = signed_areas(points, triangles)
    local = np.einsum("tik,tjk->tij", opposite, opposite) / (4.0 * area[:, None, None])
    row, column = np.repeat(triangles, 3, axis=1), np.tile(triangles, (1, 3))
    n = len(points)
    return csr_array(coo_array((local.ravel(), (row.ravel(), column.ravel())), shape=(n, n)))


def harmonic_heights(points: Floats, triangles: Ints, heights: Floats) -> Floats:
    """(n,) the harmonic function with the given heights; NaN is unknown.

    >>> square = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [1, 1.0]])
    >>> fan = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    >>> harmonic_heights(square, fan, np.array([0, 0, 3, 3, np.nan])).tolist()
    [0.0, 0.0, 3.0, 3.0, 1.5]
    """
    known = ~np.isnan(heights)
    if np.ptp(heights[known]) == 0.0:
        return np.full(len(points), heights[known][0])
    L, given = stiffness(points, triangles), np.where(known, heights, 0.0)
    return _solve(L, -(L @ given), known) + given


def dome(points: Floats, triangles: Ints, held: Bools, rise: float | None = None) -> Floats:
    """(n,) heights of an initial dome: 0 where held, at most ``rise``, never steep at the edge.

    The shape is (u / max u)^0.75 for a membrane under pressure: Δu = -1, u = 0 at held vertices, free
    edges elsewhere. ``rise`` is by default 0.3 of the radius of the largest circle without held
    vertices. The height is between 0.12 and 0.8 times the distance from the held vertices; both
    slopes grow with a larger rise.
    """
    area = np.abs(signed_areas(points, triangles))
    load = np.bincount(triangles.ravel(), np.repeat(area / 3.0, 3), len(points)).astype(float)
    u = np.maximum(_solve(stiffness(points, triangles), load, held), 0.0)
    distance = np.asarray(cKDTree(points[held]).query(points)[0])
    radius = float(distance.max())
    rise = RISE * radius if rise is None else rise
    slope = max(SLOPE, SLOPE / RISE * rise / radius)
    return np.clip(rise * (u / u.max()) ** FULLNESS, LEAST * slope * distance, slope * distance)


def _solve(L: csr_array, load: Floats, known: Bools) -> Floats:
    """(n,) u with L u = load at the unknown vertices and u = 0 at the known ones."""
    free, u = np.flatnonzero(~known), np.zeros(len(load))
    if len(free):
        u[free] = splu(L[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A").solve(load[free])
    return u


def held_lines(
    draft: Draft, X: Floats, feet: Mapping[tuple[int, int], Ints], still: Bools
) -> list[HeldCurve]:
    """The fixed edges of outline and holes, the lines of supports, and straight feet of walls, on X (n,3).

    ``feet``: by the first two vertices of the upper edge of a wall, the vertices along its held bottom;
    ``still`` (n,): the fixed vertices.
    """
    curves, edges = [], draft.edges
    supports = [PlanLine("support", Kind.SUPPORT, curve) for curve in draft.supports_on_edge]
    fixed = dict(zip(map(tuple, edges.ends.tolist()), edges.among("fixed", "held", "inside"), strict=True))
    for chain in draft.drawn.chains:
        line = draft.lines[chain.line]
        if line.kind is Kind.DIVIDER:
            continue
        held = [line.kind is Kind.SUPPORT or fixed[tuple(ends)] for ends in chain.edges.tolist()]
        for first, last in np.flatnonzero(np.diff([False, *held, False])).reshape(-1, 2):  # fixed stretches
            V, at = chain.vertices[first : last + 1], chain.at[first : last + 1]
            found = _on_curve(draft, line.curve, V, at, X)
            for support in supports if found is None else ():
                t, _ = support.nearest(draft.drawn.points[V])
                way = slice(None) if t[0] < t[-1] else slice(None, None, -1)
                if found is None and (np.diff(t[way]) > 0.0).all():
                    found = _on_curve(draft, support.curve, V[way], t[way], X)
            curves.append(found or HeldCurve(polyline(X[V]), V, np.arange(float(len(V)))))
    for chain in draft.drawn.chains:
        if (foot := feet.get((int(chain.vertices[0]), int(chain.vertices[1])))) is not None:
            line = draft.lines[chain.line]
            curve = line.curve.mapped(np.diag([1.0, 1.0, 0.0]), np.zeros(3))
            found = _on_curve(draft, curve, foot, chain.at, X)
            if found is not None and not still[foot].all():
                raise line.error('ends on an edge that slides; give it bottom = "sliding", or hold that edge')
            curves += filter(None, [found])
    return curves


def _on_curve(draft: Draft, curve: Curve, V: Ints, at: Floats, X: Floats) -> HeldCurve | None:
    """The vertices V (k,) of X (n,3) on a curve at parameters (k,); None if off it. Where lines meet, their
    common vertex may be a little beside one: a straight piece leads there."""
    part, t = curve.part(at[0], at[-1], at)
    part = part.mapped(draft.plan.plane.axes.T, np.array(draft.plan.plane.point))
    there = part.at(t)
    away = np.linalg.norm(X[V] - there, axis=1)
    near = ON * bounding_size(X)
    if away[1:-1].max(initial=0.0) > near or away.max() > REACH * draft.plan.edge_length:
        return None
    pieces = list(part.pieces)
    if away[0] > near:
        pieces.insert(0, Piece(np.stack([X[V[0]], there[0]])))
        t[1:] += 1.0
    if away[-1] > near:
        pieces.append(Piece(np.stack([there[-1], X[V[-1]]])))
        t[-1] += 1.0
    return HeldCurve(Curve(tuple(pieces)), V, t)
