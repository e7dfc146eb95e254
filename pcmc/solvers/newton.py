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

from contextlib import suppress
from dataclasses import replace

import numpy as np

from ..base.errors import SurfaceError
from ..meshing.refinement import refinable, refine
from ..stability.factorisation import SingularMatrix
from ..stability.modes import morse_index
from ..surface import Surface
from .attempt import DESCENTS, POOR, Attempt, History, NewtonOptions
from .result import Callback, Result, Status

__all__ = ["NewtonOptions", "newton"]

LOST = (Status.DEGENERATE, Status.STALLED)  # worth a second attempt


def newton(
    surface: Surface, options: NewtonOptions | None = None, callback: Callback | None = None
) -> Result:
    """Solve with the geometric solver; see ``pcmc.solve``."""
    options = options or NewtonOptions()
    _refuse_loose_parts(surface)
    refinable("levels", options.levels, surface.m)
    history = History(callback)
    for level in range(options.levels + 1):
        end = _solve_level(surface, options, history, level)
        if end.status is not Status.CONVERGED or level == options.levels:
            break
        surface = refine(end.state.result_surface())
    return Result(
        surface=end.state.result_surface(),
        status=end.status,
        method="newton",
        energy=end.state.energy,
        iterations=len(history.rows) - 1,
        evaluations=history.evaluations,
        rows=history.rows,
        note=history.note,
    )


def _solve_level(surface: Surface, options: NewtonOptions, history: History, level: int) -> Attempt:
    """Solve on one mesh; where that fails, once more from the same start in another way."""
    first = Attempt(surface, options, history, level).run()
    if first.status not in LOST:
        return first
    rows, minimum = len(history.rows), options.target == "minimum"
    other_way = replace(options, target="stationary")
    second = Attempt(surface, other_way, history, level, 0 if minimum else DESCENTS).run()
    if second.status is Status.STOPPED:
        if second.state.relative < first.state.relative:
            return second
        first.status = Status.STOPPED
    if second.status is Status.CONVERGED and second.state.quality >= POOR:
        if not minimum:
            return second
        with suppress(SingularMatrix):
            index = morse_index(second.state.result_surface())
            if index == 0:
                return second
            history.note = f"a saddle of index {index} is near: target='stationary' returns it"
    del history.rows[rows:]
    return first


def _refuse_loose_parts(surface: Surface) -> None:
    """Refuse a part with an open edge and no support: nothing stops it from moving away."""
    topo = surface.topology
    open_parts = topo.components[topo.edges[topo.boundary_edge, 0]]
    loose = np.setdiff1d(open_parts, topo.components[surface.fixed | surface.on_plane])
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
