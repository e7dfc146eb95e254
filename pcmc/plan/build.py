"""The Surface of a plan: its mesh, heights, patches, supports and walls."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from itertools import count

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import PlanError, PlanWarning, SurfaceError
from ..curves.pieces import to_space
from ..forces.rooms import check_rooms
from ..meshing.angles import improve_angles
from ..meshing.planar import PlanarMesh, locate, signed_areas
from ..surface import Cable, Patch, Surface
from .draft import Draft, drafted
from .edges import (
    HELD,
    NONE,
    check_pressures,
    edge_cables,
    mirror_planes,
    raised_heights,
    usual_cable,
)
from .heights import dome, harmonic_heights
from .held_lines import held_lines
from .lines import Kind
from .parts import PatchSpec, PlanData
from .walls import Roof, rooms_of, upright_planes, walls_of

GOOD_ANGLE = 28.0  # degrees; the slope makes triangles sharper than they are in plan


def build_surface(plan: PlanData) -> Surface:
    """The mesh of the plan at its initial height, with its walls and supports."""
    draft = drafted(plan)
    mesh, drawn = draft.mesh, draft.drawn
    fixed, sliding = _supports(draft)
    held = fixed | sliding
    if not held.any():
        raise PlanError("nothing holds the roof; fix an edge or give supports", what="supports")
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
    surface = Surface(
        vertices,
        np.concatenate([mesh.triangles, walls.faces]),
        np.concatenate([patch_of_face, walls.label + len(patches)]),
        (*patches, *wall_patches),
        np.concatenate([fixed, walls.fixed]),
        np.concatenate([sliding, walls.sliding]),
        plan.plane,
        on_planes=(*mirror_planes(plan, vertices), *upright_planes(draft, walls, sides)),
        cables=tuple(cables),
        rooms=tuple(rooms_of(plan, wall_patches, sides)),
        curves=(*held_lines(draft, vertices, walls.feet), *walls.uprights),
    )
    try:
        check_rooms(surface)
    except SurfaceError as error:  # a room that does not close, as the missing wall of a plan
        problem, open_edges, _ = str(error).partition("; name the patches that are missing")
        if not open_edges:
            raise
        problem += "; give the dividers around it walls, or make its patches one room with those beside them"
        raise PlanError(problem, what="rooms", where=error.where, found=error.found) from None
    return surface


def _supports(draft: Draft) -> tuple[Bools, Bools]:
    """(n,) fixed and sliding vertices."""
    fixed, sliding = np.zeros((2, len(draft.mesh.points)), dtype=bool)
    fixed[draft.edges.vertices("fixed", HELD)] = True
    sliding[draft.edges.vertices("sliding")] = True
    for chain in draft.drawn.chains:
        if draft.lines[chain.line].kind is Kind.SUPPORT:
            fixed[chain.vertices] = True
    fixed[draft.drawn.required] = True
    return fixed, sliding & ~fixed


def _warn_of_free_edges(draft: Draft, held: Bools) -> None:
    """Warn of free edges: the tension of the patch has nothing to pull against there."""
    edges, plan = draft.edges, draft.plan
    for number, line in enumerate(draft.lines):
        chosen = edges.ends[(edges.line == number) & edges.among("free")]
        free = [v for v in dict.fromkeys(chosen[:, 0].tolist()) if not held[v]]
        if not free:
            continue
        if plan.tension is not None and plan.pressure:  # an edge with a cable closes no space for a pressure
            at_one = usual_cable(replace(plan, tension=1.0))
            keys = f'edge = "cable", cable = {at_one:g}, tension = 1.0, pressure = 0.0'
        else:
            pressed = any(patch.pressure for patch in plan.patches)
            keys = f'edge = "cable", cable = {usual_cable(plan):g}'
            keys += ", and pressure = 0.0 of its patches" if pressed else ""
        place = draft.drawn.points[free[0]].round(4).tolist()
        text = (
            f"nothing holds {line.name} at {place} ({len(free)} such vertices): the tension has nothing to"
            " pull against there, and there is probably no equilibrium; fix the edge, along a curve in space"
            f" if it should be above the plane, or give it a cable: {keys}"
        )
        warnings.warn(text, PlanWarning, stacklevel=4)


def _cables(draft: Draft, held: Bools) -> list[Cable]:
    """The cables of the edges, and those along dividers."""
    numbers = count(1)
    cables = edge_cables(draft.edges, held, numbers)
    for number, divider in enumerate(draft.plan.dividers):
        if divider.cable is not None:
            named = divider.wall is None and not divider.name.startswith("divider ")
            name = divider.name if named else f"cable {next(numbers)}"
            along = [chain.edges for chain in draft.divider(number)[1]]
            cables.append(Cable(name, divider.cable, np.concatenate(along)))
    return cables


def _patches(plan: PlanData, mesh: PlanarMesh) -> tuple[list[Patch], Ints]:
    """The plan's patches and the patch (m,) of each triangle of its mesh.

    Raises
    ------
    PlanError
        Where the patches that are given and the parts between the dividers are not one to one.
    """
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
        problem = f"the dividers cut the plan into {parts} parts, but there are {len(specs)} patches"
        problem += f" ({', '.join(bare)}); give one for each part, or place them with at="
        raise PlanError(problem, what="patches", found=len(specs), expected=parts)
    else:
        owner = np.argsort(np.lexsort(centroid.round(6).T[::-1]))
    patches = []
    for spec in specs:
        snow = plan.snow if spec.snow is None else spec.snow
        patches.append(Patch(spec.name, spec.tension, spec.pressure, weight=spec.weight, snow=snow))
    return patches, owner[mesh.region]


def _located(specs: Sequence[PatchSpec], mesh: PlanarMesh, centroid: Floats) -> Ints:
    """(p,) the patch that each part of the plan belongs to."""
    owner = np.full(len(centroid), -1)
    for number, spec in enumerate(specs):
        points = np.atleast_2d(np.array(spec.at, dtype=float))
        for point, triangle in zip(points, locate(mesh, points), strict=True):
            if triangle < 0:
                problem = f"patch {spec.name!r}: its point {point.tolist()} is not inside the plan"
                raise PlanError(problem, what="at", where=spec.name, found=point.tolist())
            part = mesh.region[triangle]
            if owner[part] not in (-1, number):
                around = centroid[part].round(3).tolist()
                problem = f"patches {specs[owner[part]].name!r} and {spec.name!r} are in the same part of the"
                problem += f" plan (around {around}); draw a divider between them"
                raise PlanError(problem, what="at", where=spec.name)
            owner[part] = number
    bare = np.flatnonzero(owner < 0)
    if len(bare):
        place = centroid[bare[0]].round(3).tolist()
        problem = f"the part of the plan around {place} has no patch ({len(bare)} such parts)"
        raise PlanError(f"{problem}; add one with at= inside it", what="patches", where=place)
    return owner
