"""Walls whose bottom is held on Π: which can pinch, and the vertices that their junctions come down on."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from ..base.arrays import Bools, Floats, Ints
from ..surface import Surface
from ..surface.checks import lying


def held_walls(
    surface: Surface, roof_edge: Bools, roof_vertex: Bools, low: Bools, all_of_them: bool
) -> list[tuple[int, Ints, Ints, Ints]]:
    """Walls with a held bottom that can pinch: patch, edges, top edges, and the foot (n,) of each top vertex.

    All that have one top edge to either side of each junction vertex; none unless a junction rests on one.
    """
    topo, X, rests = surface.topology, surface.vertices, all_of_them
    walls: list[tuple[int, Ints, Ints, Ints]] = []
    bottom = topo.boundary_edge & (surface.fixed & low)[topo.edges].all(axis=1)
    for index, patch in enumerate(surface.patches):
        if not patch.auxiliary:
            continue
        of_wall = np.unique(topo.edge_of_face[surface.patch_of_face == index])
        vertices = np.unique(topo.edges[of_wall])
        if not bottom[of_wall].any() or surface.on_plane[vertices].any():
            continue
        top = topo.edges[of_wall[roof_edge[of_wall]]]
        below = vertices[surface.fixed[vertices] & ~roof_vertex[vertices]]
        if not len(top) or not low[below].all():
            continue
        foot = held_feet(surface, top, topo.edges[of_wall[bottom[of_wall] & ~roof_edge[of_wall]]])
        free = np.unique(top)[~surface.fixed[np.unique(top)]]
        if foot is None or (np.bincount(top.ravel(), minlength=surface.n)[free] != 2).any():
            continue
        gap = np.linalg.norm(X[free] - X[foot[free]], axis=1)
        rests = rests or bool(lying(gap, X).any())
        walls.append((index, topo.edges[of_wall], top, foot))
    shared = [np.unique(top) for _, _, top, _ in walls]
    count = np.bincount(np.concatenate(shared), minlength=surface.n) if shared else np.empty(0)
    alone = [bool((count[tops[~surface.fixed[tops]]] == 1).all()) for tops in shared]
    return [wall for wall, single in zip(walls, alone, strict=True) if single] if rests else []


def held_feet(surface: Surface, top_edges: Ints, bottom_edges: Ints) -> Ints | None:
    """(n,) the held bottom vertex below each top vertex of a wall, -1 elsewhere; None if they do not pair.

    Both edges (k,2) start from the corners where the wall ends, which are their own feet. The vertices so
    many steps from each corner along the top and along the bottom make a pair.
    """
    chains = np.unique(top_edges), np.unique(bottom_edges)
    corners = chains[0][np.isin(chains[0], chains[1])]
    if not len(corners) or len(chains[0]) != len(chains[1]):
        return None
    steps = []
    for edges, chain in zip((top_edges, bottom_edges), chains, strict=True):
        graph = coo_array((np.ones(len(edges)), edges.T), shape=(surface.n, surface.n)).tocsr()
        steps.append(dijkstra(graph, directed=False, indices=corners, unweighted=True)[:, chain].T)
    count = len(chains[0])
    label = np.unique(np.concatenate(steps), axis=0, return_inverse=True)[1].ravel()
    of_top, of_bottom = label.reshape(2, -1)
    above, below = of_top.argsort(), of_bottom.argsort()
    pairs = np.arange(count)
    if (of_top[above] != pairs).any() or (of_bottom[below] != pairs).any():
        return None
    foot = np.full(surface.n, -1, dtype=np.int64)
    foot[chains[0][above]] = chains[1][below]
    return foot


def across_bottom(vectors: Floats, X: Floats, top_edges: Ints, foot: Ints) -> Floats:
    """The part (n,3) of vectors across the held bottom below the top vertices; X, vectors are (n,3)."""
    chord = np.zeros_like(X)
    edges = top_edges[(foot[top_edges] >= 0).all(axis=1)]
    start, end = foot[edges.T]
    # the two edges at a vertex may run either way, so sum their directions with the sign of the first
    side = X[end] - X[start]
    side /= np.linalg.norm(side, axis=1)[:, None]
    first = np.zeros_like(X)
    first[edges[:, 1]], first[edges[:, 0]] = side, side
    for v in edges.T:
        sign = np.where(np.einsum("ij,ij->i", first[v], side) < 0.0, -1.0, 1.0)
        np.add.at(chord, v, sign[:, None] * side)
    length = np.linalg.norm(chord, axis=1)[:, None]
    tangent = np.divide(chord, length, out=np.zeros_like(X), where=length > 0.0)
    return np.asarray(vectors - np.einsum("ij,ij->i", tangent, vectors)[:, None] * tangent)
