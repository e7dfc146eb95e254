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
from dataclasses import dataclass, replace

import numpy as np

from ..base import validate
from ..base.errors import SurfaceError
from ..meshing.refinement import refine
from ..stability.factorisation import SingularMatrix
from ..stability.modes import morse_index
from ..surface import Surface
from .attempt import DESCENTS, POOR, Attempt, History
from .result import Callback, Result, Status

TARGETS = ("minimum", "stationary")
LOST = (Status.DEGENERATE, Status.STALLED)  # worth a second attempt


@dataclass(frozen=True)
class NewtonOptions:
    """Options of the geometric solver.

    Parameters
    ----------
    tolerance : converged when ‖Bᵀ∇E‖ ≤ tolerance × the norm of the single triangles' forces, or when it
        is below 1e-10 of that norm and rounding lets no step lower it further.
    iterations : the most steps of any kind, on each level and in each attempt.
    target : ``"minimum"`` leaves saddles; ``"stationary"`` converges to them.
    levels : number of 1→4 refinements; the surface is solved before the first and after each.
    min_quality : vertices are redistributed along the shape while the worst triangle has less quality.
    inflation : diverged when the bounding box is more than this many times its first diagonal.
    backend : factorisation, ``"pardiso"`` or ``"superlu"``; None for the fastest here.
    """

    tolerance: float = 1e-12
    iterations: int = 200
    target: str = "minimum"
    levels: int = 0
    min_quality: float = 0.45
    inflation: float = 10.0
    backend: str | None = None

    def __post_init__(self) -> None:
        validate.number("tolerance", self.tolerance, above=0.0)
        validate.integer("iterations", self.iterations)
        validate.choice("target", self.target, TARGETS)
        validate.integer("levels", self.levels)
        validate.number("min_quality", self.min_quality, least=0.0, below=1.0)
        validate.number("inflation", self.inflation, above=1.0)


def newton(
    surface: Surface, options: NewtonOptions | None = None, callback: Callback | None = None
) -> Result:
    """Solve with the geometric solver; see ``pcmc.solve``."""
    options = options or NewtonOptions()
    _refuse_loose_parts(surface)
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
