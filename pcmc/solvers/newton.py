"""The geometric solver: Bᵀ∇E = 0 in the motion space, to rounding, on any refinement.

Each iteration tries a Newton step on r = Bᵀ∇E, whose frames B turn with the surface. GMRES inverts its
derivative (``linearise``), preconditioned by a factorisation of Bᵀ(∂²E)B, used as long as it contracts.
Where a minimum is sought and the matrix is indefinite, it is shifted; near a saddle the solver follows the
lowest mode. Where a step overshoots or spoils triangles, smooth descent steps come first. Where triangles
collapse, the solver starts once more: towards any stationary point, which it returns if it is a minimum or
none was asked for; or, if that is what has failed, with smooth steps first.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import Any

import numpy as np

from ..base.errors import CurvedContactError, SurfaceError
from ..base.tolerances import POOR
from ..certificate.diagnosis import describe_saddle, held_wall_down, slipping_ends, slipping_rings
from ..forces.functional import energy
from ..forces.rooms import check_rooms, prescribed_volumes, room_pressures, room_volumes
from ..forces.wall_rows import find_walls
from ..meshing.elevation import elevate
from ..meshing.refinement import refinable, refine
from ..stability.factorisation import SingularMatrix
from ..stability.modes import descent_mode
from ..surface import Surface
from .attempt import DESCENTS, SLOW_DESCENT_STEPS, Log, NewtonOptions, NewtonRun
from .result import Callback, Result, Status

__all__ = ["NewtonOptions", "newton"]

NEAR = 2.0  # times the volume: up to this a start is left as it is
LOST = (Status.DEGENERATE, Status.STALLED)  # worth a second attempt


def newton(
    surface: Surface, options: NewtonOptions | None = None, callback: Callback | None = None
) -> Result:
    """Solve with the geometric solver; see ``pcmc.solve``."""
    options = options or NewtonOptions()
    _refuse_loose_parts(surface)
    check_rooms(surface)
    refinable(options.levels, surface.m)
    log, first, rows = Log(callback), surface, list[dict[str, Any]]()
    surface = _with_volumes(surface)
    order = options.order or surface.order
    if order != surface.order > 1:
        elevate(surface, order)  # refuses it before the work
    last = options.levels + (order > surface.order)
    end = _solve_level(surface, options, log, 0, rows)
    for level in range(1, last + 1):
        if end.status is not Status.CONVERGED:
            break
        reached, end.clear = end.state.result_surface(), None
        try:
            surface = refine(reached) if level <= options.levels else elevate(reached, order)
            end = _solve_level(surface, options, log, level, end.rows)
        except CurvedContactError as error:
            why = str(error).removeprefix("order: ").removesuffix("; give order=1")
            end.note = f"its triangles are flat, though order={order} was asked for: {why}"
    reached = end.state.result_surface()
    return Result(
        surface=reached,
        status=end.status,
        method="newton",
        energy=energy(reached) if reached.rooms else end.state.energy,
        iterations=len(end.rows) - 1,
        evaluations=log.evaluations,
        rows=end.rows,
        note=end.note,
        rounded=end.status is Status.CONVERGED and end.state.at.residual > options.tolerance,
        room_changes=tuple((room_pressures(reached) - room_pressures(first)).tolist()),
        clear=[end.clear] if end.clear else [],
    )


def _with_volumes(surface: Surface) -> Surface:
    """Closed rooms that nothing holds, in the size at which they have the prescribed volume together.

    So they come to rest from a start of any size. One that is not far off stays as it was drawn.
    """
    if surface.held.any() or surface.periodic or not surface.rooms:
        return surface
    times = prescribed_volumes(surface).sum() / room_volumes(surface).sum()
    if 1.0 / NEAR <= times <= NEAR:
        return surface
    X, middle = surface.vertices, surface.vertices.mean(axis=0)
    return surface.moved(middle + np.cbrt(times) * (X - middle))


def _solve_level(
    surface: Surface, options: NewtonOptions, log: Log, level: int, rows: list[dict[str, Any]]
) -> NewtonRun:
    """Solve on one mesh; where that fails, once more so that junctions can rest on held bottoms."""
    end = _attempts(NewtonRun(surface, options, log, level, rows))
    lost = end.status in LOST
    if lost and (surface.periodic or surface.order > 1):  # where no wall can pinch
        lost = held_wall_down(end.state.result_surface(), end.state.walls.pinchable)
    if not (lost and find_walls(surface, held=True).held.any()):
        return end
    again = _attempts(NewtonRun(surface, options, log, level, end.rows, held=True))
    return again if again.status in (Status.CONVERGED, Status.SADDLE, Status.STOPPED) else end


def _attempts(first: NewtonRun) -> NewtonRun:
    """Run it; where that fails, once more from the same start in another way."""
    start, options = first.state.at.part.whole, first.options
    first.run()
    for more in (*SLOW_DESCENT_STEPS[1:], inf):
        if first.status is not Status.SADDLE:
            break
        # the saddle from which it only crawls, or a minimum there
        near = _to_any(first, first.surface_before_descent(), first.state.held)
        if near.status is Status.STOPPED or _rests(near, first.patience == SLOW_DESCENT_STEPS[0]):
            return near
        first.patience = more
        first.run()
    ring = slipping_rings(start, np.ones_like(start.vertices))  # which shrinks slowly, to nothing
    if first.status not in LOST and not (ring and first.status is Status.ITERATION_LIMIT):
        return first
    minimum = options.target == "minimum"
    second = _to_any(first, start, first.held, 0 if minimum else DESCENTS)
    if second.status is Status.STOPPED:
        if second.state.at.residual < first.state.at.residual:
            return second
        first.status = Status.STOPPED
    if not minimum and second.status is Status.CONVERGED and second.state.quality >= POOR:
        return second
    if minimum and _rests(second, must_slip=True):
        return second
    first.note = second.note
    return first


def _to_any(first: NewtonRun, surface: Surface, held: bool, smooth_steps: int = 0) -> NewtonRun:
    """An attempt to find any stationary point, from a surface."""
    options = replace(first.options, target="stationary")
    return NewtonRun(surface, options, first.log, first.level, first.rows, smooth_steps, held).run()


def _rests(end: NewtonRun, must_slip: bool) -> bool:
    """Whether an attempt to find any stationary point ends what was asked for: a minimum, or the saddle.

    The saddle does, with status SADDLE, if an end or a ring slips in its lowest mode or need not.
    """
    if end.status is not Status.CONVERGED or end.state.quality < POOR:
        return False
    surface = end.state.result_surface()
    try:
        index, mode = descent_mode(surface)
    except SingularMatrix:
        return False
    if index == 0:
        return True
    if slipping_ends(surface, mode) or slipping_rings(surface, mode) or not must_slip:
        end.status, end.note = Status.SADDLE, describe_saddle(surface, index, mode)
        return True
    end.note = f"a saddle of index {index} is near: target='stationary' returns it"
    return False


def _refuse_loose_parts(surface: Surface) -> None:
    """Refuse a part with an open edge and no support: nothing stops it from moving away."""
    topo = surface.topology
    loose = np.setdiff1d(topo.components[topo.edges[topo.boundary_edge, 0]], topo.components[surface.held])
    if len(loose):
        vertex = int(np.flatnonzero(topo.components == loose[0])[0])
        face = int(np.flatnonzero((surface.faces == vertex).any(axis=1))[0])
        name = surface.patches[surface.patch_of_face[face]].name
        text = f"the part of the surface around vertex {vertex} (patch {name!r}) has an open boundary and no"
        text += " support; hold it with fixed= or on_plane=, or remove it"
        raise SurfaceError(text, what=name, where=vertex)
