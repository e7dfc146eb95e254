"""∇E and its derivative in frozen frames, each number enclosed in a ball.

E is a sum over triangles and cable edges. With the formulas of ``forces.triangles`` a
triangle of tension α, weight w and pressure p acts like one of tension τ = α + w z̄, and

    ∂E/∂i     = ½ τ ν × e_i + w A n/3 - p (x_j × x_k)/6
    ⟨b_i, ∂²E/∂i∂j b_j⟩ = τ (e_i·e_j)/(4A) ⟨b_i,ν⟩⟨b_j,ν⟩ + ⟨p x_k/6 - ½ τ ν, b_j × b_i⟩
                          + w (⟨b_i,g_i⟩⟨n,b_j⟩ + ⟨b_i,n⟩⟨g_j,b_j⟩)/3,      g_i = ½ ν × e_i

(without the skew part for j = i). A flat piece that closes a volume on a plane, -p ⟨c, a × b⟩/6 with its
apex c, is a triangle b, a, c of pressure p alone whose third corner does not move. A cable edge of direction
t adds ±τ t and ±τ (1 - t tᵀ)/ℓ.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled, inlined
from ..forces.flat_pieces import flat_pieces
from ..forces.motion_space import MotionSpace, VertexClasses
from ..forces.pattern import Pattern, pair_place, row_place
from ..surface import Surface
from ..surface.geometry import vector
from . import balls
from .balls import Ball, Balls, exact, gather, minus, plus, times


class MeshArrays(NamedTuple):
    """Triangles and cable edges with what acts on them, for compiled loops."""

    X: Floats  # (n+k,3) positions, those of the k flat pieces' apices last
    faces: Ints  # (m,3) corners; a flat piece has its apex last
    offset: Ints  # (m,3) as in ``Pattern``
    patch: Ints  # (m,)
    tension: Floats  # (m,)
    weight: Floats  # (m,)
    pressure: Floats  # (m,)
    origin: Floats  # (3,) where volumes are seen from
    point: Floats  # (3,) of Π, and its normal
    normal: Floats
    ends: Ints  # (c,2) cable edges, and their tension (c,)
    pull: Floats
    corner: Ints  # (e,) vertices where flat pieces end, and the normals there (e,3)
    push: Floats

    def of_volume(self, signs: Floats) -> MeshArrays:
        """The elements whose energy is Σ s_i V_i, with s (k,) of the patches; the push is as before."""
        zero = 0.0 * self.tension
        return self._replace(tension=zero, weight=zero, pressure=-signs[self.patch], pull=0.0 * self.pull)


def mesh_arrays(surface: Surface, classes: VertexClasses, pattern: Pattern) -> MeshArrays:
    """The elements of a standing part at its own vertices."""
    F, offset, patch = classes.faces, pattern.offset, classes.patch_of_face
    X, (ends, pull, _) = surface.vertices, surface.cable_edges
    tension, weight = surface.tensions[patch], surface.weights[patch]
    corner: Ints = np.empty(0, dtype=np.int64)
    push = np.empty((0, 3))
    if pieces := flat_pieces(surface):
        here = classes.active[pieces.face]
        f: Ints = (np.cumsum(classes.active) - 1)[pieces.face[here]]
        i = pieces.corner[here]
        apex = len(X) + np.arange(len(f))
        F = np.concatenate([F, np.stack([F[f, (i + 1) % 3], F[f, i], apex], axis=1)])
        zero = 0 * offset[f, i]
        offset = np.concatenate([offset, np.stack([offset[f, i], zero, zero], axis=1)])
        X = np.concatenate([X, pieces.apex[here] + surface.origin])
        patch = np.concatenate([patch, patch[f]])
        tension, weight = np.append(tension, 0.0 * f), np.append(weight, 0.0 * f)
        corner, push = pieces.end, pieces.normal
    plane = surface.plane
    pressure, pull = surface.net_pressures[patch], np.array(pull)
    at = np.array(surface.origin), np.array(plane.point), np.array(plane.normal)
    faces, places, patches, cables = (np.array(part, dtype=np.int64) for part in (F, offset, patch, ends))
    laws = tension, weight, pressure
    return MeshArrays(np.array(X), faces, places, patches, *laws, *at, cables, pull, corner, push)


@inlined
def _triangle(items: MeshArrays, f: int) -> tuple[Balls, Balls, Balls]:
    F, X = items.faces, items.X
    return balls.row(X, F[f, 0]), balls.row(X, F[f, 1]), balls.row(X, F[f, 2])


@inlined
def _bent(items: MeshArrays, f: int, a: Balls, b: Balls, c: Balls) -> tuple[Ball, Ball, Ball, Balls]:
    """2A, 1/(2A), τ and ν of triangle f with the corners a, b, c."""
    area_vector = balls.cross3(balls.minus3(b, a), balls.minus3(c, a))
    twice = balls.square_root(balls.dot3(area_vector, area_vector))
    one = balls.reciprocal(twice)
    tension = exact(items.tension[f])
    if items.weight[f] != 0.0:
        P, n = balls.of(vector(items.point)), balls.of(vector(items.normal))
        third = times(exact(items.weight[f]), balls.reciprocal(exact(3.0)))
        away = balls.plus3(balls.plus3(balls.minus3(a, P), balls.minus3(b, P)), balls.minus3(c, P))
        tension = plus(tension, times(third, balls.dot3(away, n)))
    return twice, one, tension, balls.times3(one, area_vector)


@compiled
def forces(items: MeshArrays, pressures: Floats) -> tuple[Floats, Floats]:
    """∇E (n,3) and the radii of its balls; ``pressures`` (e,) act on the ends of flat pieces."""
    value, radius = np.zeros_like(items.X), np.zeros_like(items.X)
    F, n, half = items.faces, balls.of(vector(items.normal)), exact(0.5)
    origin = balls.of(vector(items.origin))
    sixth = balls.reciprocal(exact(6.0))
    for f in range(len(F)):
        x = _triangle(items, f)
        y = (balls.minus3(x[0], origin), balls.minus3(x[1], origin), balls.minus3(x[2], origin))
        press = times(exact(items.pressure[f]), sixth)
        pulls = items.tension[f] != 0.0 or items.weight[f] != 0.0
        if pulls:
            twice, _, tension, nu = _bent(items, f, x[0], x[1], x[2])
            half_nu = balls.times3(times(half, tension), nu)
            down = balls.times3(times(times(exact(items.weight[f]), sixth), twice), n)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            force = balls.times3(press, balls.cross3(y[k], y[j]))
            if pulls:
                force = balls.plus3(force, balls.plus3(balls.cross3(half_nu, balls.minus3(x[k], x[j])), down))
            for d in range(3):
                gather(value[F[f, i]], radius[F[f, i]], d, force[d])
    for e in range(len(items.ends)):
        i, j = items.ends[e, 0], items.ends[e, 1]
        side = balls.minus3(balls.row(items.X, j), balls.row(items.X, i))
        one = balls.reciprocal(balls.square_root(balls.dot3(side, side)))
        force = balls.times3(times(exact(items.pull[e]), one), side)
        for d in range(3):
            gather(value[j], radius[j], d, force[d])
            gather(value[i], radius[i], d, (-force[d][0], force[d][1]))
    for e in range(len(items.corner)):
        push = balls.times3(exact(-pressures[e]), balls.row(items.push, e))
        for d in range(3):
            gather(value[items.corner[e]], radius[items.corner[e]], d, push[d])
    return value, radius


@compiled
def coordinates(space: MotionSpace, value: Floats, radius: Floats) -> tuple[Floats, Floats]:
    """Bᵀ of vectors (n,3) in balls: (N,) values and radii."""
    out, error = np.zeros(space.start[-1]), np.zeros(space.start[-1])
    for v in range(len(space.dimension)):
        x, r = value[v], radius[v]
        force = ((x[0], r[0]), (x[1], r[1]), (x[2], r[2]))
        for c in range(space.dimension[v]):
            at = space.start[v] + c
            out[at], error[at] = balls.dot3(balls.row(space.basis[v], c), force)
    return out, error


@compiled
def second_variation(items: MeshArrays, space: MotionSpace, pattern: Pattern) -> tuple[Floats, Floats]:
    """B₀ᵀ ∇²E B₀ in the pattern: (k,) values and radii."""
    value, radius = np.zeros(len(pattern.indices)), np.zeros(len(pattern.indices))
    F, dimension, half = items.faces, np.append(space.dimension, np.zeros(len(items.X), np.int64)), exact(0.5)
    origin, n = balls.of(vector(items.origin)), balls.of(vector(items.normal))
    sixth, third = balls.reciprocal(exact(6.0)), balls.reciprocal(exact(3.0))
    for f in range(len(F)):
        x = _triangle(items, f)
        edge = (balls.minus3(x[2], x[1]), balls.minus3(x[0], x[2]), balls.minus3(x[1], x[0]))
        press, heavy = times(exact(items.pressure[f]), sixth), times(exact(items.weight[f]), third)
        pulls = items.tension[f] != 0.0 or items.weight[f] != 0.0
        bend, nu, half_nu = exact(0.0), edge[0], edge[0]
        if pulls:
            _, one, tension, nu = _bent(items, f, x[0], x[1], x[2])
            half_nu = balls.times3(times(half, tension), nu)
            bend = times(half, times(tension, one))
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            v, w = F[f, i], F[f, j]
            q = balls.times3(press, balls.minus3(x[k], origin))
            if pulls:
                q = balls.minus3(q, half_nu)
            along = times(bend, balls.dot3(edge[i], edge[i]))
            across = times(bend, balls.dot3(edge[i], edge[j]))
            for r in range(dimension[v]):
                b = balls.row(space.basis[v], r)
                lean = balls.dot3(b, nu) if pulls else exact(0.0)
                for s in range(r, dimension[v]):
                    c = balls.row(space.basis[v], s)
                    entry = times(times(along, lean), balls.dot3(c, nu)) if pulls else exact(0.0)
                    if heavy[0] != 0.0:
                        entry = plus(entry, times(heavy, _slope(b, c, nu, edge[i], edge[i], n)))
                    gather(value, radius, row_place(space, pattern, v, r) + s, entry)
                for s in range(dimension[w]):
                    c = balls.row(space.basis[w], s)
                    entry = balls.dot3(q, balls.cross3(c, b))
                    if pulls:
                        entry = plus(entry, times(times(across, lean), balls.dot3(c, nu)))
                    if heavy[0] != 0.0:
                        entry = plus(entry, times(heavy, _slope(b, c, nu, edge[i], edge[j], n)))
                    gather(value, radius, pair_place(space, pattern, v, r, w, s, items.offset[f, i]), entry)
    _add_cables(items, space, pattern, value, radius)
    return value, radius


@inlined
def _slope(b: Balls, c: Balls, nu: Balls, e_i: Balls, e_j: Balls, n: Balls) -> Ball:
    """⟨b, g_i⟩⟨n, c⟩ + ⟨b, n⟩⟨g_j, c⟩, g = ½ ν × e."""
    first = times(balls.dot3(b, balls.cross3(nu, e_i)), balls.dot3(n, c))
    return times(exact(0.5), plus(first, times(balls.dot3(c, balls.cross3(nu, e_j)), balls.dot3(b, n))))


@compiled
def _add_cables(
    items: MeshArrays, space: MotionSpace, pattern: Pattern, value: Floats, radius: Floats
) -> None:
    dimension, start, indptr = space.dimension, space.start, pattern.indptr
    for e in range(len(items.ends)):
        i, j = min(items.ends[e, 0], items.ends[e, 1]), max(items.ends[e, 0], items.ends[e, 1])
        side = balls.minus3(balls.row(items.X, j), balls.row(items.X, i))
        one = balls.reciprocal(balls.square_root(balls.dot3(side, side)))
        t, stiff = balls.times3(one, side), times(exact(items.pull[e]), one)
        for v, w, sign in ((i, i, 1.0), (j, j, 1.0), (i, j, -1.0)):
            for r in range(dimension[v]):
                at = row_place(space, pattern, v, r)
                if v != w and dimension[w] > 0:
                    low, high = indptr[start[v] + r], indptr[start[v] + r + 1]
                    at = low + np.searchsorted(pattern.indices[low:high], start[w])
                b = balls.row(space.basis[v], r)
                for s in range(r if v == w else 0, dimension[w]):
                    c = balls.row(space.basis[w], s)
                    turn = minus(balls.dot3(b, c), times(balls.dot3(b, t), balls.dot3(c, t)))
                    entry = times(stiff, turn)
                    gather(value, radius, at + s, (sign * entry[0], entry[1]))


@compiled
def signed_volumes(items: MeshArrays, signs: Floats, patch_of_end: Ints) -> tuple[Floats, Floats]:
    """(r,) Σ s_i V_i for each row of signs (r,k), flat pieces included, and its radius."""
    value, radius = np.zeros(len(signs)), np.zeros(len(signs))
    origin, sixth = balls.of(vector(items.origin)), balls.reciprocal(exact(6.0))
    for f in range(len(items.faces)):
        x = _triangle(items, f)
        y = (balls.minus3(x[0], origin), balls.minus3(x[1], origin), balls.minus3(x[2], origin))
        cone = times(sixth, balls.dot3(y[0], balls.cross3(y[1], y[2])))
        for r in range(len(signs)):
            if signs[r, items.patch[f]] != 0.0:
                gather(value, radius, r, times(exact(signs[r, items.patch[f]]), cone))
    for e in range(len(items.corner)):
        v = balls.minus3(balls.row(items.X, items.corner[e]), origin)
        for r in range(len(signs)):
            end = exact(signs[r, patch_of_end[e]])
            gather(value, radius, r, times(end, balls.dot3(v, balls.row(items.push, e))))
    return value, radius
