"""Quality of triangles: 1 for an equilateral one, 0 for a degenerate one; redistribution that raises it, and
larger smallest angles: single vertices of the worst triangles move along the surface.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import splu

from ..base.arrays import Bools, Floats, Ints
from ..base.compiled import compiled
from ..forces.motion_space import motion_space
from ..forces.pinching import StandingPart
from ..surface import Surface
from ..surface.geometry import (
    accumulate,
    add,
    angles,
    area_vectors,
    cross,
    dot,
    norm,
    point,
    scaled,
    segment_lengths,
    sub,
)
from ..surface.supports import apply_supports, onto_circles
from ..surface.topology import SHEET, components

SQRT3 = sqrt(3.0)
SWEEPS = 20  # of redistribution, at most
ANGLE_SWEEPS = 12  # of single vertices
MOST = 400  # vertices a sweep: only the worst triangles are worth the time
TURNS = 2.0 * np.pi * np.arange(8) / 8.0
REACHES = (0.02, 0.06, 0.15)  # of the longest edge of the star


@compiled
def triangle_quality(X: Floats, F: Ints) -> Floats:
    """q = 4√3 area / Σ edge² (m,), 1 for an equilateral triangle, 0 for a degenerate one.

    >>> triangle_quality(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2]])).round(6)
    array([0.866025])
    """
    out = np.zeros(len(F))
    for f in range(len(F)):
        a, b, c = point(X, F[f, 0]), point(X, F[f, 1]), point(X, F[f, 2])
        u, w = sub(b, a), sub(c, a)
        squared_edges = 2.0 * (dot(u, u) + dot(w, w) - dot(u, w))
        if squared_edges != 0.0:
            out[f] = norm(cross(u, w)) * 2.0 * SQRT3 / squared_edges
    return out


def worst_quality(X: Floats, F: Ints) -> float:
    """The smallest triangle quality, 1 where there are no triangles."""
    return float(triangle_quality(X, F).min(initial=1.0))


@compiled
def turns_over(X: Floats, Y: Floats, F: Ints) -> bool:
    """Whether a triangle's normal turns by a right angle or more from X to Y."""
    for f in range(len(F)):
        i, j, k = F[f, 0], F[f, 1], F[f, 2]
        before = cross(sub(point(X, j), point(X, i)), sub(point(X, k), point(X, i)))
        after = cross(sub(point(Y, j), point(Y, i)), sub(point(Y, k), point(Y, i)))
        if dot(before, after) <= 0.0:
            return True
    return False


def minimum_angle(surface: Surface) -> float:
    """The smallest angle of any triangle, degrees."""
    return float(angles(surface.vertices[surface.faces]).min())


def edge_lengths(surface: Surface) -> Floats:
    """(e,) length of each edge, in the order of ``surface.topology.edges``."""
    return segment_lengths(surface.vertices, surface.topology.sides)


@compiled
def _to_star_centres(X: Floats, F: Ints) -> Floats:
    """(n,3) from each vertex to the area-weighted mean of its triangles' centroids; zero where no area is."""
    total, area = np.zeros(X.shape), np.zeros(len(X))
    for f in range(len(F)):
        a, b, c = point(X, F[f, 0]), point(X, F[f, 1]), point(X, F[f, 2])
        weight = 0.5 * norm(cross(sub(b, a), sub(c, a)))
        moment = scaled(weight / 3.0, add(add(a, b), c))
        for k in range(3):
            accumulate(total, F[f, k], moment)
            area[F[f, k]] += weight
    for v in range(len(X)):
        for d in range(3):
            total[v, d] = total[v, d] / area[v] - X[v, d] if area[v] > 0.0 else 0.0
    return total


def redistribute(part: StandingPart, X: Floats, aim: float, *, slide: bool) -> tuple[Floats, float]:
    """The best of a few sweeps of redistribution, (n,3), and the quality of its worst triangle.

    Sweeps end where that is at least ``aim``; triangles of walls that can pinch do not count. Each vertex
    moves from X (n,3) halfway towards the middle of its star, on a curve of its two neighbours there, as far
    as its support lets it and without the part in the motion space, which would change the shape; walls
    follow their crest. With ``slide``, junction vertices at rest on Π slide too. Junctions that can come down
    on a held bottom stay over the vertices of that.
    """
    surface, classes, faces = part.surface, part.classes, part.quality_faces
    best, worst = X, worst_quality(X, faces)
    for _ in range(SWEEPS):
        move = _to_star_centres(X, surface.faces)
        move[classes.kind != SHEET] = 0.0
        move[classes.curve] = X[classes.beside].mean(axis=1) - X[classes.curve]
        move = apply_supports(surface, 0.5 * move, X)
        if not slide:
            move[part.resting] = 0.0
        move[part.walls.held] = 0.0  # these stay over their bottom vertices
        space = motion_space(surface, classes, X)
        moved = onto_circles(surface, X + move - space.project(move))
        X = part.follow(moved, space)
        quality = worst_quality(X, faces)
        if quality > worst:
            best, worst = X, quality
        if quality >= aim:
            break
    return best, worst


def improve_angles(X: Floats, F: Ints, movable: Bools, goal: float) -> Floats:
    """Vertices (n,3) with fewer angles below ``goal`` degrees.

    Each movable vertex of a triangle below the goal tries places around it in the plane of its star
    and takes the one where the star's smallest angle is largest; nothing else moves, and no star's
    smallest angle gets smaller.

    >>> square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.9, 0.5, 0]])
    >>> fan = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    >>> free = np.array([False, False, False, False, True])
    >>> moved = improve_angles(square, fan, free, goal=40.0)
    >>> bool(angles(moved[fan]).min() > 38.0 > angles(square[fan]).min())
    True
    """
    X = X.copy()
    order = np.argsort(F.ravel(), kind="stable")
    first = np.searchsorted(F.ravel()[order], np.arange(len(X) + 1))
    for _ in range(ANGLE_SWEEPS):
        smallest = angles(X[F]).min(axis=1)
        bad = np.flatnonzero(smallest < goal)
        vertices = F[bad[np.argsort(smallest[bad], kind="stable")]].ravel()
        vertices = vertices[np.sort(np.unique(vertices, return_index=True)[1])]
        chosen = vertices[movable[vertices]][:MOST].tolist()
        moved = [_improve(X, F[order[first[v] : first[v + 1]] // 3], v) for v in chosen]
        if not any(moved):
            break
    return X


def _improve(X: Floats, star: Ints, v: int) -> bool:
    """Move vertex v to the best of the places around it; whether it moved."""
    corner = X[star]
    normal = area_vectors(corner).sum(axis=0)
    if not normal.any():  # as where a sheet lies on itself
        return False
    first = X[star[0][star[0] != v][0]] - X[v]
    first = first - (first @ normal) / (normal @ normal) * normal
    length = np.linalg.norm(first)
    if not length > 0.0:
        return False
    first /= length
    second = np.cross(normal / np.linalg.norm(normal), first)
    reach = np.linalg.norm(corner - X[v], axis=2).max()
    around = np.cos(TURNS)[:, None] * first + np.sin(TURNS)[:, None] * second
    places = X[v] + np.concatenate([np.zeros((1, 3)), *(reach * r * around for r in REACHES)])
    ring = np.where((star == v)[None, :, :, None], places[:, None, None, :], corner[None])
    upright = area_vectors(ring) @ normal > 0.0
    value = np.where(upright.all(axis=1), angles(ring).min(axis=(1, 2)), -1.0)
    best = int(np.argmax(value))
    if value[best] <= value[0] + 1e-6:
        return False
    X[v] = places[best]
    return True


def in_the_middle(faces: Ints, known: Bools, values: Floats, excess: float = 0.0) -> Floats:
    """Values (n,) or (n,k) with the unknown ones the mean of their neighbours', plus an excess.

    Those that no edges join to a known one stay as they are.

    >>> faces, known = np.array([[0, 1, 2], [1, 3, 2]]), np.array([True, False, False, True])
    >>> in_the_middle(faces, known, np.array([0.0, 0.0, 0.0, 1.0]))
    array([0. , 0.5, 0.5, 1. ])
    """
    n = len(known)
    ends = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    i, j = np.concatenate([ends, ends[:, ::-1]]).T
    A = csr_array((np.ones(len(i)), (i, j)), shape=(n, n))
    part = components(ends, n)
    unknown = np.flatnonzero(~known & np.isin(part, part[known]))
    result = np.array(values, dtype=float)
    if len(unknown):
        degree = A.sum(axis=1)
        result[unknown] = 0.0
        L = csr_array(diags_array(degree) - A)[unknown]
        right = excess * (degree[unknown] if result.ndim == 1 else degree[unknown, None]) - L @ result
        result[unknown] = splu(L[:, unknown].tocsc(), permc_spec="MMD_AT_PLUS_A").solve(right)
    return result
