"""How the forces in the motion space change with the shape: its basis turns along with it.

The forces that a P-CMC surface lacks are f = B Bᵀ ∇E, and along a motion d of the vertices

    Bᵀ Df[d] = Bᵀ (∂²E) d + Bᵀ D(B Bᵀ)[d] ∇E.

The second part vanishes at rest, but for circles. Newton's method converges quadratically only with it:

- inside a sheet, with the area vector a = |a| n:   (∇E - n n·∇E) · Da / |a|;
- on a curve, with the chord c = |c| t between its neighbours:   -(t·∇E) Bᵀ Dc / |c|;
- where a curve slides on a plane the same, with the chord's part along it; where a sheet does, its normal's;
- along a circle, with the tangent t:   Dt · ∇E, without supports; see ``circle_curvatures``.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..base.compiled import compiled, sum_blocks
from ..surface import Surface
from ..surface.geometry import accumulate, cross_sum, divided, dot, norm, point, scaled, sub, vector
from ..surface.topology import SHEET
from .motion_space import MotionSpace, VertexClasses, curve_chords, normal_vectors
from .second_variation import circle_curvatures, hessian_product


def linearise(
    surface: Surface, classes: VertexClasses, space: MotionSpace, X: Floats, gradient: Floats
) -> Callable[[Floats], Floats]:
    """Bᵀ Df[d] (size,), as a function of the motion d (n,3), at X, where ∇E is ``gradient`` (n,3)."""
    freedom, axis = surface.admissible_at(X)
    single = (classes.kind == SHEET) & (space.dimension == 1) & (freedom > 1)
    sheet_factor, area_vector = np.zeros_like(X), normal_vectors(surface, classes, X)
    _across_normals(area_vector, single, freedom, axis, space.basis, gradient, sheet_factor)
    free = freedom[classes.curve]
    rows = np.flatnonzero((space.dimension[classes.curve] == free - 1) & (free > 1))
    chord, vertices = curve_chords(surface, classes, X)[rows], classes.curve[rows]
    across = np.where((freedom == 2)[:, None], axis, 0.0)[vertices]
    chord -= np.einsum("ij,ij->i", chord, across)[:, None] * across
    curve_factor = -np.einsum("ij,ij->i", chord, gradient[vertices]) / np.einsum("ij,ij->i", chord, chord)
    circle_rows, circle_factor = circle_curvatures(surface, space, X)
    moves = np.flatnonzero(space.dimension)

    def times(d: Floats) -> Floats:
        change = hessian_product(surface, classes.mesh(surface), X, d)
        if classes.nodes.shape[1] == 3:

            def work(first: int, last: int, turn: Floats) -> None:
                _add_turns(classes.faces[first:last], classes.rows[first:last], X, d, sheet_factor, turn)

            turn = sum_blocks(work, len(classes.faces), X.shape[:1])
        else:
            turn = (sheet_factor * normal_vectors(surface, classes, X, d)).sum(axis=1)
        change[vertices] += curve_factor[:, None] * curve_chords(surface, classes, d)[rows]
        out = space.to_coordinates(change)
        out[space.start[moves]] += turn[moves]
        out[space.start[circle_rows]] += (circle_factor * d[circle_rows]).sum(axis=1)
        return out

    return times


@compiled
def _across_normals(
    area: Floats, chosen: Bools, freedom: Ints, axis: Floats, basis: Floats, gradient: Floats, out: Floats
) -> None:
    """Write (∇E - n n·∇E) / |a| to out where a sheet may turn, in a plane along it; ``area`` (n,3) has a."""
    for v in range(len(area)):
        if not chosen[v]:
            continue
        b, g, length, shadow = vector(basis[v, 0]), point(gradient, v), norm(point(area, v)), 1.0
        rest = sub(g, scaled(dot(b, g), b))
        if freedom[v] == 2:
            a, n = point(axis, v), divided(point(area, v), length)
            rest = sub(rest, scaled(dot(rest, a), a))
            rest = sub(rest, scaled(dot(rest, n), n))
            shadow = norm(sub(n, scaled(dot(n, a), a)))
        accumulate(out, v, divided(rest, shadow * length))


@compiled
def _add_turns(F: Ints, rows: Ints, X: Floats, D: Floats, sheet_factor: Floats, turn: Floats) -> None:
    """Add ⟨sheet_factor, Da⟩ to turn (n,), a = Σ ½ u × w the vertices' area vectors."""
    for f in range(len(F)):
        i, j, k = F[f, 0], F[f, 1], F[f, 2]
        u, w = sub(point(X, j), point(X, i)), sub(point(X, k), point(X, i))
        Du, Dw = sub(point(D, j), point(D, i)), sub(point(D, k), point(D, i))
        Da = scaled(0.5, cross_sum(Du, w, u, Dw))
        for corner in range(3):
            turn[rows[f, corner]] += dot(point(sheet_factor, rows[f, corner]), Da)
