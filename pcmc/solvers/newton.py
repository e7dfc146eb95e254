"""The geometric solver: Bᵀ∇E = 0 in the motion space, to rounding, on any refinement.

Each iteration tries a Newton step on the residual r = Bᵀ∇E, whose frames B turn with the surface. GMRES
inverts its derivative (``linearise``), preconditioned by a factorisation of Bᵀ(∂²E)B that is used as long
as it contracts. Where a minimum is sought and the matrix is indefinite, it is shifted; near a saddle the
solver follows the lowest mode. Where a Newton step overshoots or spoils triangles, smooth descent steps come
first. Between steps vertices are redistributed along the shape while triangles are poor, and junctions that
come down to Π are set to rest there. A run may pass a shallow minimum, or go a step too far, until triangles
collapse. Then the solver starts once more: towards any stationary point, which it returns if it is a minimum
or none was asked for; or, if that is what has failed, with smooth steps first.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np

from ..base.errors import SurfaceError
from ..certificate.diagnosis import describe_saddle, held_wall_down, slipping_ends
from ..contact.pinching import find_walls
from ..forces.functional import energy
from ..forces.rooms import check_rooms, room_pressures
from ..meshing.refinement import refinable, refine
from ..stability.factorisation import SingularMatrix
from ..stability.modes import ways_down
from ..surface import Surface
from .attempt import CRAWLS, DESCENTS, POOR, History, NewtonOptions, NewtonRun
from .result import Callback, Result, Status

__all__ = ["NewtonOptions", "newton"]

LOST = (Status.DEGENERATE, Status.STALLED)  # worth a second attempt


def newton(
    surface: Surface, options: NewtonOptions | None = None, callback: Callback | None = None
) -> Result:
    """Solve with the geometric solver; see ``pcmc.solve``."""
    options = options or NewtonOptions()
    _refuse_loose_parts(surface)
    check_rooms(surface)
    refinable("levels", options.levels, surface.m)
    history, first = History(callback), surface
    for level in range(options.levels + 1):
        end = _solve_level(surface, options, history, level)
        if end.status is not Status.CONVERGED or level == options.levels:
            break
        surface = refine(end.state.result_surface())
    reached = end.state.result_surface()
    return Result(
        surface=reached,
        status=end.status,
        method="newton",
        energy=energy(reached) if reached.rooms else end.state.energy,
        iterations=len(history.rows) - 1,
        evaluations=history.evaluations,
        rows=history.rows,
        note=history.note,
        room_changes=tuple((room_pressures(reached) - room_pressures(first)).tolist()),
    )


def _solve_level(surface: Surface, options: NewtonOptions, history: History, level: int) -> NewtonRun:
    """Solve on one mesh; where a junction comes down on a held bottom, once more so that it can rest."""
    end = _attempts(surface, options, history, level)
    if end.status not in LOST:
        return end
    if not held_wall_down(end.state.result_surface(), end.state.walls.pinchable):
        return end
    if not find_walls(surface, held=True).held.any():
        return end
    rows, note = len(history.rows), history.note
    again = _attempts(surface, options, history, level, held=True)
    if again.status in (Status.CONVERGED, Status.SADDLE, Status.STOPPED):
        return again
    del history.rows[rows:]
    history.note = note
    return end


def _attempts(
    surface: Surface, options: NewtonOptions, history: History, level: int, held: bool = False
) -> NewtonRun:
    """Solve on one mesh; where that fails, once more from the same start in another way."""
    first = NewtonRun(surface, options, history, level, held=held).run()
    for more in (*CRAWLS[1:], inf):
        if first.status is not Status.SADDLE:
            break
        end = _saddle_near(first, must_slip=first.crawl == CRAWLS[0])
        if end is not None:
            return end
        first.crawl = more
        first.run()
    if first.status not in LOST:
        return first
    rows, minimum = len(history.rows), options.target == "minimum"
    other_way = replace(options, target="stationary")
    second = NewtonRun(surface, other_way, history, level, 0 if minimum else DESCENTS, held).run()
    if second.status is Status.STOPPED:
        if second.state.relative < first.state.relative:
            return second
        first.status = Status.STOPPED
    if not minimum and second.status is Status.CONVERGED and second.state.quality >= POOR:
        return second
    if minimum and _rests(second, must_slip=True):
        return second
    del history.rows[rows:]
    return first


def _saddle_near(crawling: NewtonRun, must_slip: bool) -> NewtonRun | None:
    """The saddle from which an attempt only crawls, or a minimum there; None if there is neither.

    ``must_slip``: only a saddle in whose lowest mode an end of a junction slips.
    """
    history, rows = crawling.history, len(crawling.history.rows)
    other_way = replace(crawling.options, target="stationary")
    held = crawling.state.held
    end = NewtonRun(crawling.surface_uphill(), other_way, history, crawling.level, held=held).run()
    if end.status is Status.STOPPED or _rests(end, must_slip):
        return end
    del history.rows[rows:]
    history.note = ""
    return None


def _rests(end: NewtonRun, must_slip: bool) -> bool:
    """Whether an attempt to find any stationary point ends what was asked for: a minimum, or the saddle.

    The saddle ends it, with status SADDLE, if an end of a junction slips in its lowest mode, as the way
    down then leads to collapsed triangles, or if that does not matter. The history's note names it.
    """
    if end.status is not Status.CONVERGED or end.state.quality < POOR:
        return False
    surface = end.state.result_surface()
    try:
        index, mode = ways_down(surface)
    except SingularMatrix:
        return False
    if index == 0:
        return True
    if slipping_ends(surface, mode) or not must_slip:
        end.status, end.history.note = Status.SADDLE, describe_saddle(surface, index, mode)
        return True
    end.history.note = f"a saddle of index {index} is near: target='stationary' returns it"
    return False


def _refuse_loose_parts(surface: Surface) -> None:
    """Refuse a part with an open edge and no support: nothing stops it from moving away."""
    topo = surface.topology
    open_parts = topo.components[topo.edges[topo.boundary_edge, 0]]
    loose = np.setdiff1d(open_parts, topo.components[surface.held])
    if len(loose):
        vertex = int(np.flatnonzero(topo.components == loose[0])[0])
        face = int(np.flatnonzero((surface.faces == vertex).any(axis=1))[0])
        name = surface.patches[surface.patch_of_face[face]].name
        raise SurfaceError(
            f"the part of the surface around vertex {vertex} (patch {name!r}) has an open boundary"
            " and no support; hold it with fixed= or on_plane=, or remove it",
            what=name,
            where=vertex,
        )
