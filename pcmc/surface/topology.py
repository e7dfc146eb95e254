"""Topology of the faces: edges, sheets around an edge, junction curves and points, boundary loops.

A *junction* is an edge that three or more triangles share, a *seam* an edge between two triangles of
different patches, a *boundary* edge belongs to one triangle only. All three are *curve* edges; a vertex
on exactly two curve edges lies on a curve, one on a single or on three or more is a *point*.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.arrays import Bools, Ints, cached_array, distinct, mask_of, read_only
from ..base.compiled import compiled

SHEET, CURVE, POINT = 0, 1, 2
SIDES = [[1, 2], [2, 0], [0, 1]]  # corners of a triangle's sides, in the order of the corners opposite


@dataclass(frozen=True, eq=False)
class EdgeCurve:
    """A chain of curve edges between two points, or a closed loop."""

    vertices: Ints  # (k,) in order along the curve; the first is not repeated when closed
    closed: bool  # whether the last vertex is joined to the first
    sheets: tuple[int, ...]  # the patches that meet along the curve, ascending

    @property
    def pairs(self) -> Ints:
        """(k,2) the ends of its edges, in order along the curve."""
        order = np.append(self.vertices, self.vertices[:1]) if self.closed else self.vertices
        return np.stack([order[:-1], order[1:]], axis=1)

    @property
    def ends(self) -> tuple[Ints, ...]:
        """(2,) each end with the vertex beside it; none of a closed curve."""
        return () if self.closed else (self.vertices[:2], self.vertices[:-3:-1])


@dataclass(frozen=True, eq=False)
class Topology:
    """Edges of a triangle mesh that may branch."""

    faces: Ints
    patch_of_face: Ints
    vertex_count: int
    edges: Ints  # (e,2) each row ascending, rows in lexicographic order
    edge_of_face: Ints  # (m,3) entry (f,k) is the edge opposite corner k of face f
    valence: Ints  # (e,) the number of triangles at each edge
    placed: Ints | None = None  # (m,3) the faces with images of vertices, where some are images of others

    @cached_array
    def sense(self) -> Ints:
        """(m,3) int: +1 where a face runs along the edge of ``edge_of_face`` as its row does, else -1."""
        ascends = self.faces[:, [1, 2, 0]] < self.faces[:, [2, 0, 1]]
        return np.where(ascends, np.int8(1), np.int8(-1))

    @cached_array
    def sides(self) -> Ints:
        """(e,2) the ends of each edge as its first face has them: images of those of ``edges``, or these.

        Only at these places are they as far apart as the edge is long.
        """
        if self.placed is None:
            return self.edges
        face, corner = np.divmod(np.unique(self.edge_of_face, return_index=True)[1], 3)
        ends = self.placed[face[:, None], (corner[:, None] + [1, 2]) % 3]
        return np.where(self.sense[face, corner, None] < 0, ends[:, ::-1], ends)

    @cached_array
    def one_way_edge(self) -> Bools:
        """(e,) bool: edges between two triangles that run along it the same way: the side changes."""
        total = np.bincount(self.edge_of_face.ravel(), self.sense.ravel(), len(self.edges))
        return (self.valence == 2) & (total != 0.0)

    @cached_array
    def fans(self) -> Ints:
        """(n,) int: the number of fans of triangles around each vertex that share no edge there.

        1 within a sheet and along curves, 2 where two sheets only touch, 0 for a vertex without triangles.
        """
        count: Ints = _fans(self.faces, self.edge_of_face, self.edges, self.vertex_count)
        return count

    @cached_array
    def boundary_edge(self) -> Bools:
        """(e,) bool: edges of a single triangle."""
        return self.valence == 1

    @cached_array
    def junction_edge(self) -> Bools:
        """(e,) bool: edges where three or more triangles meet."""
        return self.valence >= 3

    @cached_array
    def neighbours(self) -> Ints:
        """(k,2) the two sides at each edge of exactly two triangles: 3 f + the corner of face f opposite."""
        edge = self.edge_of_face.ravel()
        sides = np.flatnonzero(self.valence[edge] == 2)
        return sides[np.argsort(edge[sides], kind="stable")].reshape(-1, 2)

    @cached_array
    def seam_edge(self) -> Bools:
        """(e,) bool: edges between two triangles of different patches, with no wall between them."""
        patches = np.repeat(self.patch_of_face, 3)
        low = np.full(len(self.edges), np.iinfo(np.int32).max, dtype=np.int32)
        high = np.full(len(self.edges), -1, dtype=np.int32)
        np.minimum.at(low, self.edge_of_face.ravel(), patches)
        np.maximum.at(high, self.edge_of_face.ravel(), patches)
        return (self.valence == 2) & (low != high)

    @cached_array
    def curve_edge(self) -> Bools:
        """(e,) bool: boundary, junction and seam edges."""
        return self.boundary_edge | self.junction_edge | self.seam_edge

    @cached_array
    def vertex_kind(self) -> Ints:
        """(n,) int: SHEET, CURVE or POINT."""
        return vertex_kind(self.edges[self.curve_edge], self.vertex_count)

    def _ends_of(self, edges: Bools) -> Bools:
        """(n,) the vertices of edges (e,)."""
        return mask_of(self.edges[edges], self.vertex_count)

    @cached_array
    def on_boundary(self) -> Bools:
        """(n,) bool: vertices of a boundary edge."""
        return self._ends_of(self.boundary_edge)

    @cached_array
    def on_junction(self) -> Bools:
        """(n,) bool: vertices of a junction or seam edge."""
        return self._ends_of(self.junction_edge | self.seam_edge)

    @cached_array
    def interior(self) -> Bools:
        """(n,) bool: vertices inside a single sheet, where a mean curvature is defined."""
        return ~(self.on_boundary | self.on_junction)

    @cached_property
    def junctions(self) -> tuple[EdgeCurve, ...]:
        """Junction curves and seams, cut at the points where they meet, end or touch a boundary."""
        return self._curves(self.junction_edge | self.seam_edge, self.vertex_kind == POINT)

    @cached_property
    def boundary_loops(self) -> tuple[EdgeCurve, ...]:
        """Boundary curves of each patch's outline, cut where more than two boundary edges meet."""
        return self.curves_among(self.boundary_edge)

    def curves_among(self, chosen: Bools) -> tuple[EdgeCurve, ...]:
        """The curves of the chosen edges (e,), cut where other than two of them meet."""
        return self._curves(chosen, vertex_kind(self.edges[chosen], self.vertex_count) == POINT)

    def edges_of(self, faces: Bools | Ints) -> Ints:
        """The numbers of the edges of some faces, ascending."""
        return distinct(self.edge_of_face[faces], len(self.edges))

    def edge_numbers(self, ends: Ints) -> Ints:
        """(k,) the numbers of the edges that join pairs of vertices (k,2); -1 where none does."""
        return edge_places(ends, self.edges)

    def chains(self, ends: Ints, stop: Bools | bool = False) -> tuple[EdgeCurve, ...]:
        """The curves that edges (k,2) form, cut where they branch and at the vertices ``stop`` (n,)."""
        mask = mask_of(self.edge_numbers(ends), len(self.edges))
        return self._curves(mask, stop | (vertex_kind(ends, self.vertex_count) == POINT))

    @cached_array
    def components(self) -> Ints:
        """(n,) int: label of the connected part that each vertex belongs to."""
        label = components(self.edges, self.vertex_count)
        if self.placed is not None:
            label[self.placed] = label[self.faces]
        return label

    @cached_property
    def in_parts(self) -> bool:
        """Whether its faces form several connected parts."""
        label = self.components[self.edges[:, 0]]
        return bool((label != label[:1]).any())

    def _curves(self, mask: Bools, stop: Bools) -> tuple[EdgeCurve, ...]:
        sides = np.flatnonzero(mask[self.edge_of_face.ravel()])
        sides = sides[np.argsort(self.edge_of_face.ravel()[sides], kind="stable")]
        parts = np.split(self.patch_of_face[sides // 3], np.cumsum(self.valence[mask])[:-1])
        return tuple(
            EdgeCurve(vertices, closed, tuple(sorted(parts[edge].tolist())))
            for vertices, closed, edge in joined(self.edges[mask], stop, self.vertex_count)
        )


def topology(faces: Ints, patch_of_face: Ints, vertex_count: int, placed: Ints | None = None) -> Topology:
    """The topology of faces (m,3) whose patches are ``patch_of_face`` (m,); ``placed`` as in Topology.

    >>> t = topology(np.array([[0, 1, 2], [0, 2, 3]]), np.array([0, 0]), 4)
    >>> t.edges[~t.boundary_edge].tolist(), t.valence.tolist()
    ([[0, 2]], [1, 2, 1, 1, 1])
    """
    corners = np.ascontiguousarray(faces, dtype=np.int32)
    edges, edge_of_face, valence = map(read_only, _number_edges(corners, vertex_count))
    return Topology(faces, patch_of_face, vertex_count, edges, edge_of_face, valence, placed)


def edge_places(wanted: Ints, edges: Ints) -> Ints:
    """(…) the row of ``edges`` (e,2) that joins the vertices of each pair ``wanted`` (…,2); -1 for none.

    >>> edge_places(np.array([[7, 3], [3, 4]]), np.array([[5, 3], [3, 7]])).tolist()
    [1, -1]
    """
    if not len(edges):
        return np.full(wanted.shape[:-1], -1)
    width = 1 + max(int(wanted.max(initial=0)), int(edges.max()))
    keys, sought = (
        np.minimum(pair[..., 0], pair[..., 1]).astype(np.int64) * width
        + np.maximum(pair[..., 0], pair[..., 1])
        for pair in (edges, wanted)
    )
    order = np.argsort(keys, kind="stable")
    place = order[np.minimum(np.searchsorted(keys, sought, sorter=order), len(keys) - 1)]
    return np.asarray(np.where(keys[place] == sought, place, -1))


def joined(pairs: Ints, stop: Bools, vertex_count: int) -> Iterator[tuple[Ints, bool, int]]:
    """Pairs (k,2) of vertices joined to curves that end at the vertices ``stop`` (n,).

    For each curve its vertices in order, whether it is closed, and the first of its pairs.

    >>> curves = joined(np.array([[5, 3], [3, 9], [1, 2]]), np.zeros(10, dtype=bool), 10)
    >>> [(vertices.tolist(), closed) for vertices, closed, _ in curves]
    [([1, 2], False), ([5, 3, 9], False)]
    """
    from scipy.sparse import coo_array  # here, as many surfaces never ask
    from scipy.sparse.csgraph import depth_first_order

    if not len(pairs):
        return
    # each edge end at a stopping vertex gets a vertex of its own, so that chains end there
    split = pairs.astype(np.int64)
    ends = stop[split]
    original = np.concatenate([np.arange(vertex_count), split[ends]])
    count = len(original)
    split[ends] = np.arange(vertex_count, count)
    label = components(split, count)
    degree = np.bincount(split.ravel(), minlength=count)
    members = np.flatnonzero(degree)
    members = members[np.lexsort((degree[members] != 1, label[members]))]  # part by part, its ends first
    starts = members[np.unique(label[members], return_index=True)[1]]
    # one search for all parts, from a vertex more that leads to the start of each
    links = np.concatenate([split, np.stack([np.full(len(starts), count), starts], axis=1)])
    weights = np.arange(1, len(links) + 1)
    half = coo_array((weights, links.T), shape=(count + 1, count + 1))
    order = depth_first_order(half + half.T, count, directed=False)[0][1:]
    order = order[np.argsort(label[order], kind="stable")]
    parts, first_edge = np.unique(label[split[:, 0]], return_index=True)
    pieces = np.split(original[order], np.searchsorted(label[order], parts)[1:])
    yield from zip(pieces, (degree[starts] != 1).tolist(), first_edge.tolist(), strict=True)


def vertex_kind(ends: Ints, vertex_count: int) -> Ints:
    """(n,) int: SHEET, CURVE or POINT, from the ends of the curve edges alone."""
    degree = np.bincount(ends.ravel(), minlength=vertex_count)
    return np.where(degree == 0, SHEET, np.where(degree == 2, CURVE, POINT)).astype(np.int8)


def components(edges: Ints, vertex_count: int) -> Ints:
    """(n,) int: label of each vertex's connected part, in the order of their first vertices.

    >>> components(np.array([[3, 1], [2, 4]]), 5).tolist()
    [0, 1, 2, 1, 2]
    """
    label: Ints = _components(np.ascontiguousarray(edges, dtype=np.int32), vertex_count)
    return label


def one_sided_copies(one: Ints, other: Ints, turned: Bools, count: int) -> Ints:
    """(2 count,) labels of the sides of faces, where pairs of neighbours (k,) share theirs.

    Face f has the sides f, as it is, and f + ``count``, turned over. Those of two neighbours are one, or
    the opposite ones where they are ``turned`` (k,) against each other.
    """
    second = np.append(other + turned * count, other + ~turned * count)
    return components(np.stack([np.append(one, one + count), second], axis=1), 2 * count)


def curve_neighbours(links: Ints, vertex_count: int) -> tuple[Ints, Ints]:
    """The vertices (c,) with exactly two links, and their two neighbours (c,2).

    ``links`` (k,2) are curve edges in both directions: from each end to the other.

    >>> edges = np.array([[0, 1], [1, 4], [4, 2]])
    >>> curve, beside = curve_neighbours(np.concatenate([edges, edges[:, ::-1]]), 5)
    >>> curve.tolist(), beside.tolist()
    ([1, 4], [[4, 0], [2, 1]])
    """
    here, there = links[np.argsort(links[:, 0], kind="stable")].T
    curve = np.flatnonzero(vertex_kind(here, vertex_count) == CURVE)
    first = np.searchsorted(here, curve)
    return curve, np.stack([there[first], there[first + 1]], axis=1)


@compiled
def _join(parent: Ints, a: int, b: int) -> None:
    """Join the trees of a and b; the root of a tree is its smallest node."""
    while parent[a] != a:
        parent[a] = parent[parent[a]]
        a = parent[a]
    while parent[b] != b:
        parent[b] = parent[parent[b]]
        b = parent[b]
    parent[max(a, b)] = min(a, b)


@compiled
def _components(edges: Ints, n: int) -> Ints:
    parent = np.arange(n).astype(np.int32)
    for e in range(len(edges)):
        _join(parent, edges[e, 0], edges[e, 1])
    parts = 0
    for v in range(n):
        if parent[v] == v:
            parent[v] = parts
            parts += 1
        else:  # the label of an earlier vertex
            parent[v] = parent[parent[v]]
    return parent


@compiled
def _fans(F: Ints, edge_of_face: Ints, edges: Ints, n: int) -> Ints:
    parent = np.arange(2 * len(edges)).astype(np.int32)  # node 2 e + s is the end edges[e, s] of edge e
    for f in range(len(F)):
        for c in range(3):
            one, two = edge_of_face[f, c - 1], edge_of_face[f, c - 2]
            a = 2 * one + (edges[one, 1] == F[f, c])
            b = 2 * two + (edges[two, 1] == F[f, c])
            _join(parent, a, b)
    count = np.zeros(n, dtype=np.int64)
    for k in range(len(parent)):
        if parent[k] == k:
            count[edges[k // 2, k % 2]] += 1
    return count


@compiled
def _number_edges(F: Ints, n: int) -> tuple[Ints, Ints, Ints]:
    """``edges``, ``edge_of_face`` and ``valence`` of a Topology, in time proportional to the faces.

    The sides of the faces are put into the bucket of their lower vertex and sorted there by the higher one.
    """
    first = np.zeros(n + 2, dtype=np.int32)
    for f in range(len(F)):
        for k in range(3):
            first[min(F[f, k - 1], F[f, k - 2]) + 2] += 1
    for v in range(n):
        first[v + 2] += first[v + 1]
    higher, place = np.empty((2, 3 * len(F)), dtype=np.int32)
    for f in range(len(F)):
        for k in range(3):
            low, high = min(F[f, k - 1], F[f, k - 2]), max(F[f, k - 1], F[f, k - 2])
            at = first[low + 1]
            higher[at], place[at] = high, 3 * f + k
            first[low + 1] = at + 1  # in the end the bucket of vertex v starts at first[v]
    edges, valence = np.empty((3 * len(F), 2), dtype=np.int32), np.zeros(3 * len(F), dtype=np.int32)
    edge_of_face = np.empty(3 * len(F), dtype=np.int32)
    count = 0
    for v in range(n):
        start, end = first[v], first[v + 1]
        gap = 1  # Shell's sort: by insertion, of buckets with many sides at large distances first
        while 9 * gap < end - start:
            gap = 3 * gap + 1
        while gap > 0:
            for i in range(start + gap, end):
                high, where, j = higher[i], place[i], i
                while j >= start + gap and higher[j - gap] > high:
                    higher[j], place[j] = higher[j - gap], place[j - gap]
                    j -= gap
                higher[j], place[j] = high, where
            gap //= 3
        for i in range(start, end):
            if i == start or higher[i] != higher[i - 1]:
                edges[count, 0], edges[count, 1] = v, higher[i]
                count += 1
            valence[count - 1] += 1
            edge_of_face[place[i]] = count - 1
    return edges[:count].copy(), edge_of_face.reshape(-1, 3), valence[:count].copy()
