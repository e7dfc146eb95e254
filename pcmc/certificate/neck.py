"""The narrowest neck of a surface: the shortest cut that separates held parts from each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, maximum_flow

from ..base.arrays import Bools, Floats, Ints
from ..base.tolerances import PINCHED
from ..surface import Surface
from ..surface.geometry import segment_lengths
from .forces import held_boundary

UNITS = 500_000_000  # of the length of all edges: the flow counts in whole numbers


@dataclass(frozen=True, eq=False)
class Neck:
    """The shortest cut through the triangles that parts two held curves."""

    girth: float  # its length
    place: Floats  # (3,) its middle
    ratio: float  # girth over the length of the shorter of the two curves

    def __str__(self) -> str:
        place = self.place.round(3) + 0.0
        return (
            f"a neck pinches off near {place.tolist()}: {self.girth:.2g} around,"
            f" {self.ratio:.2g} of the shorter curve that holds it"
        )


def pinched_neck(surface: Surface) -> Neck | None:
    """The narrowest neck between two held curves, if it has pinched off; else None."""
    neck = narrowest_neck(surface)
    return neck if neck is not None and neck.ratio < PINCHED else None


def narrowest_neck(surface: Surface) -> Neck | None:
    """The narrowest neck between two held parts of one connected part; None without two of these.

    A minimal cut: of all sets of edges that part the triangles at one held curve from those at the
    other, the one of least length. It is computed as a maximal flow from triangle to triangle (Ford
    and Fulkerson 1956).

    >>> from pcmc import Patch
    >>> angle = 2 * np.pi * np.arange(6) / 6
    >>> ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> X = np.concatenate([ring, 0.1 * ring + [0, 0, 1], ring + [0, 0, 2]])
    >>> i, j = np.arange(6), (np.arange(6) + 1) % 6
    >>> band = np.concatenate([np.stack([i, j, i + 6], 1), np.stack([j, j + 6, i + 6], 1)])
    >>> film = Surface(X, np.concatenate([band, band + 6]), [0] * 24, [Patch("film", 1.0, 0.0)],
    ...                fixed=np.r_[0:6, 12:18])
    >>> neck = narrowest_neck(film)
    >>> round(neck.girth, 9), round(neck.ratio, 9), neck.place.round(9).tolist()
    (0.6, 0.1, [0.0, 0.0, 1.0])
    """
    groups, lengths = held_groups(surface)
    count = len(lengths) if len(lengths) > 2 else len(lengths) // 2  # of two, one cut parts both
    necks = [_cut(surface, groups, lengths, number) for number in range(count)]
    return min((neck for neck in necks if neck is not None), key=lambda neck: neck.ratio, default=None)


def held_groups(surface: Surface) -> tuple[Ints, Floats]:
    """(n,) number of each vertex's held curve, -1 where there is none; and the curves' lengths.

    Curves are the connected parts of held boundary edges; only those on a connected part of the
    surface that has two or more are numbered. A curve that slides on Π has infinite length: it may
    shrink.
    """
    topo, n = surface.topology, surface.n
    edges = topo.edges[held_boundary(surface)]
    links = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n, n))
    label = connected_components(links, directed=False)[1]
    on_curve = np.zeros(n, dtype=bool)
    on_curve[edges] = True
    curves, first = np.unique(label[on_curve], return_index=True)
    part = topo.components[np.flatnonzero(on_curve)[first]]
    several = curves[np.bincount(part)[part] > 1] if len(part) else curves
    groups, lengths = np.full(n, -1), np.full(len(several), np.inf)
    for number, curve in enumerate(several):
        mine = on_curve & (label == curve)
        groups[mine] = number
        if (surface.fixed & mine).any():
            lengths[number] = segment_lengths(surface.vertices, edges[mine[edges[:, 0]]]).sum()
    return groups, lengths


def _cut(surface: Surface, groups: Ints, lengths: Floats, number: int) -> Neck | None:
    """The shortest cut between one held curve and the others on its part; None if all only slide."""
    topo, X = surface.topology, surface.vertices
    source = groups == number
    others = (groups >= 0) & ~source & np.isin(topo.components, topo.components[source])
    starts, ends = (np.flatnonzero(mask[surface.faces].sum(axis=1) > 1) for mask in (source, others))
    shorter = float(min(lengths[number], lengths[np.unique(groups[others])].min()))
    if not 0.0 < shorter < np.inf or len(np.intersect1d(starts, ends)):
        return None
    inner = np.flatnonzero(topo.valence > 1)
    cut = inner[_minimal_cut(topo.edge_of_face, inner, segment_lengths(X, topo.edges[inner]), starts, ends)]
    girth = segment_lengths(X, topo.edges[cut])
    place = (girth @ X[topo.edges[cut]].mean(axis=1)) / (girth.sum() or 1.0)
    return Neck(float(girth.sum()), place, float(girth.sum()) / shorter)


def _minimal_cut(edge_of_face: Ints, inner: Ints, lengths: Floats, starts: Ints, ends: Ints) -> Bools:
    """(k,) which of the inner edges (k,) make the shortest cut between two sets of triangles.

    Nodes are the triangles, two for each edge, a source and a sink. An edge passes on at most its
    length between the triangles at it.
    """
    m, k = len(edge_of_face), len(inner)
    number = np.full(int(edge_of_face.max()) + 1, -1)
    number[inner] = np.arange(k)
    face, edge = np.repeat(np.arange(m), 3), number[edge_of_face.ravel()]
    face, edge = face[edge >= 0], edge[edge >= 0]
    source, sink, plenty = m + 2 * k, m + 2 * k + 1, 2 * UNITS
    capacity = np.maximum(np.rint(lengths * (UNITS / lengths.sum())), 1.0)
    links = (
        (face, m + edge, plenty),
        (m + np.arange(k), m + k + np.arange(k), capacity),
        (m + k + edge, face, plenty),
        (source, starts, plenty),
        (ends, sink, plenty),
    )
    row, column, data = np.concatenate([np.broadcast_arrays(*link) for link in links], axis=1)
    graph = csr_array(coo_array((data.astype(np.int32), (row, column)), shape=(sink + 1, sink + 1)))
    left = (graph - csr_array(maximum_flow(graph, source, sink).flow)).astype(float)
    left.eliminate_zeros()
    reached = np.zeros(sink + 1, dtype=bool)
    reached[breadth_first_order(left, source, return_predecessors=False)] = True
    return np.asarray(reached[m : m + k] & ~reached[m + k : m + 2 * k])
