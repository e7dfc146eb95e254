"""A mesh with new vertices on its curves, which remeshing then keeps; and size fields: the edge length wanted
at each vertex, and how an edge is cut by it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints
from ..base.errors import OptionError
from ..surface import Surface
from ..surface.geometry import area_vectors, segment_lengths, vertex_sums
from ..surface.held_curve import EdgesOnCurves
from ..surface.topology import SIDES, edge_places
from .quality import edge_lengths
from .refinement import (
    Projection,
    edge_columns,
    held_midpoints,
    onto_circles_of,
    projected,
    prolongation,
    refine,
)


@dataclass(frozen=True, eq=False)
class CurveMesh:
    """A mesh whose curves stay: a patch for each face, edges of curves, and supports."""

    X: Floats
    F: Ints
    patch: Ints
    curves: Ints  # (c,2) the edges of curves
    support: Bools  # as ``Surface.support_columns``
    source: Ints  # (n,) the number of each vertex in the mesh before MMG, or -1
    cable: Ints  # (c,) the number of the cable on each of ``curves``, or -1
    on: EdgesOnCurves  # where these are on curves that were drawn


def cut_curves(surface: Surface, along_curves: Floats, project: Projection | None = None) -> CurveMesh:
    """The mesh with new vertices on its curves, about ``along_curves`` (n,) apart."""
    first, counts = surface.n, _pieces(surface, along_curves)
    # 1→4 keeps the triangles' shape, cutting single edges does not
    while len(counts) and np.median(counts) >= 2.0:
        along_curves = prolongation(surface) @ along_curves
        surface = refined_round(surface)
        counts = _pieces(surface, along_curves)
    stay, cable = _curve_edges(surface)
    mesh = CurveMesh(
        surface.vertices,
        surface.faces,
        surface.patch_of_face,
        curves=surface.topology.edges[stay],
        support=surface.support_columns,
        source=np.arange(surface.n),
        cable=cable[stay],
        on=surface.edges_on_curves[stay],
    )
    support = edge_columns(surface)[stay]
    while (counts > 1).any():
        mesh, along_curves, counts, support = _cut_once(mesh, along_curves, counts, support)
    new = mesh.support[:, 0] & (np.arange(len(mesh.X)) >= first)
    new[mesh.curves[mesh.on.drawn]] = False
    X = mesh.X.copy()
    if project is not None and new.any():
        X[new] = projected(project, X[new])
    onto_circles_of(surface, mesh.support & new[:, None], X)
    return replace(mesh, X=X)


def _curve_edges(surface: Surface) -> tuple[Bools, Ints]:
    """(e,) the edges that must stay: curves, cables, held ones; the number of the cable on each, or -1."""
    cable = np.full(len(surface.topology.edges), -1)
    for index, each in enumerate(surface.cables):
        cable[surface.topology.edge_numbers(each.edges)] = index
    fixed, sliding = held_midpoints(surface)
    return surface.topology.curve_edge | fixed | sliding | (cable >= 0), cable


def refined_round(surface: Surface) -> Surface:
    """1→4 with the new vertices off the curves on cubics that end square to the vertex normals.

    With t the components of the edge b - a across the normals at its ends, the middle of the cubic is
    (a + b)/2 + (t_a - t_b)/8.
    """
    topo, n = surface.topology, surface.n
    chosen = np.flatnonzero(~_curve_edges(surface)[0])
    # the normals of each sheet at its vertices
    corner = surface.patch_of_face[:, None].astype(np.int64) * n + surface.faces
    key, place = np.unique(corner, return_inverse=True)
    total = vertex_sums(area_vectors(surface.vertices[surface.faces]), place.reshape(-1, 3), len(key))
    total /= np.maximum(np.linalg.norm(total, axis=1), 1e-300)[:, None]
    patch_of_edge = np.zeros(len(topo.edges), dtype=np.int64)
    patch_of_edge[topo.edge_of_face] = surface.patch_of_face[:, None]
    normals = total[np.searchsorted(key, patch_of_edge[chosen, None] * n + topo.edges[chosen])]
    start, end = surface.vertices[topo.edges[chosen].T]
    edge = (end - start)[:, None]
    across = edge - (edge * normals).sum(axis=2, keepdims=True) * normals
    rise, fine = (across[:, 0] - across[:, 1]) / 8.0, refine(surface)
    most = 0.2 * np.linalg.norm(edge[:, 0], axis=1)
    rise *= np.minimum(1.0, most / np.maximum(np.linalg.norm(rise, axis=1), 1e-300))[:, None]
    X = fine.vertices.copy()
    X[n + chosen] += rise
    return fine.moved(X)


def _pieces(surface: Surface, size: Floats) -> Ints:
    """(c,) into how many pieces each curve edge is to be cut."""
    chosen, _ = _curve_edges(surface)
    start, end = size[surface.topology.edges[chosen]].T
    return np.maximum(1, np.rint(edges_between(edge_lengths(surface)[chosen], start, end))).astype(np.int64)


def _cut_once(
    mesh: CurveMesh, size: Floats, counts: Ints, support: Bools
) -> tuple[CurveMesh, Floats, Ints, Bools]:
    """Every curve edge that is to be cut, cut in two, with its triangles."""
    cut = counts > 1
    ends, pieces, on = mesh.curves[cut], counts[cut], mesh.on[cut]
    first = pieces // 2
    (size_start, size_end), (start, end) = size[ends].T, mesh.X[ends.T]
    share = place_between(first / pieces, size_start, size_end)
    at, points = on.between(share)
    points = np.where(on.drawn[:, None], points, start + share[:, None] * (end - start))
    number = len(mesh.X) + np.arange(len(ends))
    halves = np.stack([ends[:, 0], number], 1), np.stack([number, ends[:, 1]], 1)
    X = np.concatenate([mesh.X, points])
    size = np.concatenate([size, size_start + share * (size_end - size_start)])
    kept = np.concatenate([np.flatnonzero(~cut), np.flatnonzero(cut), np.flatnonzero(cut)])
    new = CurveMesh(
        X,
        *cut_triangles(mesh.F, mesh.patch, ends, number),
        curves=np.concatenate([mesh.curves[~cut], *halves]),
        support=np.concatenate([mesh.support, support[cut]]),
        source=np.arange(len(X)),
        cable=mesh.cable[kept],
        on=mesh.on.cut(cut, at),
    )
    return new, size, np.concatenate([counts[~cut], first, pieces - first]), support[kept]


def cut_triangles(
    F: Ints, patch: Ints, ends: Ints, number: Ints, first: Ints | None = None
) -> tuple[Ints, Ints]:
    """Triangles with a new vertex on one, two or three sides, replaced by two, three or four.

    The edges ``ends`` (k,2) get the vertices ``number`` (k,). With two cut sides a line leads to the middle
    of one of them from the corner opposite: of the side opposite corner ``first`` (m,), where that is given.
    """
    place = edge_places(F[:, SIDES], ends)
    middle = np.where(place >= 0, number[place], -1)
    count = (middle >= 0).sum(axis=1)
    # turn each triangle so that its cut sides come first: opposite corners 0, then 0 and 1
    turn = np.argmax(middle >= 0, axis=1)
    turn = np.where((count == 2) & (middle[:, 0] >= 0) & (middle[:, 2] >= 0), 2, turn)
    roll = (np.arange(3) + turn[:, None]) % 3
    a, b, c = np.take_along_axis(F.astype(np.int64), roll, axis=1).T
    p, q, r = np.take_along_axis(middle, roll, axis=1).T  # on the sides opposite a, b, c
    if first is not None:
        count[(count == 2) & (first == (turn + 1) % 3)] = -2
    templates = {
        0: [(a, b, c)],
        1: [(a, b, p), (a, p, c)],
        2: [(c, q, p), (q, a, p), (a, b, p)],
        -2: [(c, q, p), (q, b, p), (a, b, q)],
        3: [(a, r, q), (b, p, r), (c, q, p), (p, q, r)],
    }
    faces, owner = [], []
    for cuts, corners in templates.items():
        chosen = np.flatnonzero(count == cuts)
        faces.append(np.stack([np.stack(t, axis=1)[chosen] for t in corners], 1).reshape(-1, 3))
        owner.append(np.repeat(patch[chosen], len(corners)))
    return np.concatenate(faces), np.concatenate(owner)


def sizes_at(X: Floats, points: Floats, size: Floats) -> Floats:
    """(k,) the edge lengths wanted at X (k,3), each as at the nearest of ``points``, where it is ``size``."""
    if size.min() == size.max():
        return np.full(len(X), size[0])
    return np.asarray(size[cKDTree(points).query(X)[1]])


def check_sizes(edge_length: npt.ArrayLike, n: int) -> Floats:
    """(n,) an edge length per vertex, all finite and > 0.

    >>> check_sizes([0.5, -1.0], 2)
    Traceback (most recent call last):
    pcmc.base.errors.OptionError: edge_length of vertex 1: expected a finite number > 0, found -1.0
    """
    try:
        size = np.asarray(edge_length, dtype=float)
    except (TypeError, ValueError):
        size = np.empty(0)
    if size.shape != (n,):
        message = f"edge_length: expected a number, or an array of shape ({n},), found shape {size.shape}"
        raise OptionError(message, what="edge_length", found=size.shape, expected=(n,))
    wrong = ~(np.isfinite(size) & (size > 0.0))
    if wrong.any():
        vertex = int(np.argmax(wrong))
        value, expected = float(size[vertex]), "a finite number > 0"
        message = f"edge_length of vertex {vertex}: expected {expected}, found {value}"
        raise OptionError(message, what="edge_length", where=vertex, found=value, expected=expected)
    return size


def limit_growth(X: Floats, edges: Ints, size: Floats, growth: float) -> Floats:
    """(n,) the largest sizes ≤ ``size`` that grow by at most ``growth`` - 1 per length along the edges.

    h_i = min over j of size_j + (growth - 1) d_ij: the shortest ways from a vertex more, size_j away from j.

    >>> X = np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0.0]])
    >>> limit_growth(X, np.array([[0, 1], [1, 2]]), np.array([0.1, 9.0, 9.0]), 1.5).tolist()
    [0.1, 0.6, 1.6]
    """
    n = len(X)
    ends = np.concatenate([edges, np.column_stack([np.full(n, n), np.arange(n)])])
    weight = np.concatenate([(growth - 1.0) * segment_lengths(X, edges), size])
    graph: Any = coo_array((weight, (ends[:, 0], ends[:, 1])), shape=(n + 1, n + 1)).tocsr()
    return np.asarray(dijkstra(graph, directed=False, indices=[n])[0, :n])


def edges_between(length: Floats, start: Floats, end: Floats) -> Floats:
    """How many edges fit on a way whose wanted edge length h runs linearly from start to end: ∫ ds / h.

    >>> edges_between(np.array([3.0, 3.0]), np.array([1.0, 1.0]), np.array([1.0, 4.0])).round(6).tolist()
    [3.0, 1.386294]
    """
    ratio = end / start
    near = np.abs(ratio - 1.0) < 1e-9
    mean = np.where(near, 1.0, (ratio - 1.0) / np.where(near, 1.0, np.log(ratio)))
    return np.asarray(length / (start * mean))


def place_between(part: Floats, start: Floats, end: Floats) -> Floats:
    """Share of the way after which ``part`` of its edges lie; see ``edges_between``.

    >>> place_between(np.array([0.5, 0.5]), np.array([1.0, 1.0]), np.array([1.0, 4.0])).round(6).tolist()
    [0.5, 0.333333]
    """
    ratio = end / start
    near = np.abs(ratio - 1.0) < 1e-9
    bent = np.expm1(part * np.log(ratio)) / np.where(near, 1.0, ratio - 1.0)
    return np.where(near, part, bent)


def triangles_for(areas: Floats, size: Floats) -> Floats:
    """(m,) how many equilateral triangles of side ``size`` (m,) cover triangles of these areas (m,).

    >>> triangles_for(np.array([1.0]), np.array([0.1])).round().tolist()
    [231.0]
    """
    return np.asarray(areas / (math.sqrt(3.0) / 4.0 * size**2))
