"""The panels between the lines of a net: a roof's triangles are cut along the lines, and pieces joined.

Each triangle has coordinates u, v. Lines are u = 0, ±1, …, v = 0, ±1, … or the sides of hexagons. Across
edges the coordinates may jump by z → ±z + c with whole c: lines go on there. A panel is what edges of
triangles join of the pieces. It has a node where three panels or two and a rim meet, and at corners of rims.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints
from ..base.compiled import compiled
from ..base.errors import OptionError
from ..base.libraries import load_library
from ..meshing.planar import twins
from ..surface import Surface
from ..surface.geometry import cross_2d, segment_lengths, unit_vectors
from ..surface.topology import components
from .planar import before, polygon_areas
from .sheet import SheetMesh

SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])  # corners of the panels from their place
HEXAGON = np.array([[0, 1], [6, -1], [12, 1], [12, 5], [6, 7], [0, 5]]) / 6.0  # and i + j even
GRID = 1e-10  # of a step: cuts lie on a grid so fine
SAME = 1e-8  # of the size: points that are so near are one
ROUNDING = 1e-6  # of barycentric coordinates
INSIDE, EDGE, CORNER = 0, 1, 2
SHORT = 0.1  # of the size: the ends of an edge that is shorter become one node
BESIDE = 0.15  # of the size: beside a corner, √SLIVER and more, so that no sliver has the corner
SLIVER = 0.02  # of the size squared: twice the area of a panel between a rim and its chord that is left out


class SheetNet(NamedTuple):
    """A sheet with the coordinates of its net."""

    name: str
    faces: Ints  # in the surface
    sheet: SheetMesh
    at: Floats  # (m,3,2)
    umbilics: Ints  # vertices of the sheet
    on_line: Bools  # (n,) vertices on boundary curves that are lines of the net
    turned: Floats  # (m,) degrees from the principal directions, NaN if the net does not follow them


class Net(NamedTuple):
    """Nodes and panels, counter-clockwise from outside. Nodes on ridges are shared."""

    points: Floats  # (n,3)
    normals: Floats  # (n,3)
    kind: Ints  # (n,) INSIDE, EDGE or CORNER
    start: Ints  # (p+1,) of each panel in ``corner``
    corner: Ints  # nodes of the panels, one after the other
    sheet: Ints  # (p,)
    cut: Bools  # (p,) by a rim that is no line of the net
    turned: Floats  # (p,)

    @property
    def beams(self) -> Ints:
        """(e,2) the nodes of each edge."""
        return np.unique(self.sides, axis=0)

    @property
    def sides(self) -> Ints:
        """(k,2) the nodes of each side of each panel, ascending."""
        return np.sort(np.stack([self.corner, self.corner[before(self.start)]], axis=1), axis=1)


def counted(count: Ints) -> tuple[Ints, Ints]:
    """Each number k as often as ``count[k]`` says, and which time it is, from 0.

    >>> [found.tolist() for found in counted(np.array([2, 0, 3]))]
    [[0, 0, 2, 2, 2], [0, 1, 0, 1, 2]]
    """
    number = np.repeat(np.arange(len(count)), count)
    return number, np.arange(len(number)) - np.repeat(np.cumsum(count) - count, count)


def net(surface: Surface, parts: Sequence[SheetNet], size: float, hexagons: bool = False) -> Net:
    """The net of a roof's sheets; OptionError where a panel is no polygon, as one with a hole."""
    topo, faces = surface.topology, np.concatenate([part.faces for part in parts])
    row, piece, weights = _pieces(np.concatenate([part.at for part in parts]), hexagons)
    sheet = np.repeat(np.arange(len(parts)), [len(part.faces) for part in parts])[row]
    F = surface.faces[faces[row]]
    points = np.einsum("kc,kci->ki", weights, surface.vertices[F])
    vertex = components(cKDTree(points).query_pairs(SAME * size, output_type="ndarray"), len(points))
    panel, ends, rim = _outlines(row, piece, sheet, vertex)
    # on ridges and rims a side of a panel is split where panels beyond it end
    opposite = weights[ends].sum(axis=1).argmin(axis=1)
    edge = topo.edge_of_face[faces[row[ends[:, 0]]], opposite]
    first, last = surface.vertices[topo.edges[edge]].transpose(1, 0, 2)
    place = np.einsum("kei,ki->ke", points[ends] - first[:, None], last - first)
    edge[~rim], place[~rim] = len(topo.edges) + np.flatnonzero(~rim), [0.0, 1.0]
    side, tail, head, share = _split(edge, vertex[ends], place)
    start, loop, bad = _loops(panel[ends[side, 0]], tail, head)
    if len(bad):
        name = parts[sheet[np.flatnonzero(panel == bad[0])[0]]].name
        text = f"size: no net of panels of {size:g} fits patch {name!r}"
        raise OptionError(f"{text}; choose a smaller size, or a finer mesh", what="size", found=size)
    # nodes are the corners, and where three sides meet
    is_corner = np.concatenate([part.sheet.boundary()[1][part.sheet.F] for part in parts])[row]
    kind = np.zeros(int(vertex.max()) + 1, dtype=np.int64)
    kind[tail[rim[side]]] = EDGE
    kind[vertex[(is_corner & (weights > 1.0 - ROUNDING)).any(axis=1)]] = CORNER
    sides = np.unique(np.sort(np.stack([tail, head], axis=1), axis=1), axis=0)
    is_node = (kind == CORNER) | (np.bincount(sides.ravel(), minlength=len(kind)) > 2)
    order, owner = side[loop], np.repeat(np.arange(len(start) - 1), np.diff(start))
    (a, b), t = ends[order].T, share[loop, None]
    on_line = np.concatenate([part.on_line[part.sheet.F] for part in parts])[row[a]]
    on_line[np.arange(len(a)), opposite[order]] = True
    cut = np.bincount(owner, rim[order] & ~on_line.all(axis=1)) > 0
    turned = np.bincount(panel, np.concatenate([part.turned for part in parts])[row]) / np.bincount(panel)
    normals = np.concatenate([part.sheet.normals[part.sheet.F] for part in parts])[row[a]]
    normal = np.einsum("kc,kci->ki", weights[a] + t * (weights[b] - weights[a]), normals)
    kept = np.flatnonzero(is_node[tail[loop]])
    used, corner = np.unique(tail[loop[kept]], return_inverse=True)
    once = np.unique(np.stack([corner, sheet[a[kept]]]), axis=1, return_index=True)[1]
    mean = np.zeros((len(used), 3))
    np.add.at(mean, corner[once], normal[kept[once]])
    at, first = points[np.unique(vertex, return_index=True)[1][used]], a[start[:-1]]
    begins = np.searchsorted(owner[kept], np.arange(len(start)))
    about = kind[used], begins, corner, sheet[first], cut, turned[panel[first]]
    return Net(at, unit_vectors(mean), *about)


def tidied(net: Net, size: float) -> Net:
    """A net without short edges and slivers."""
    P, kind, start, corner = net.points, net.kind, net.start, net.corner
    # the ends of short edges become one node: a corner, else one of a ridge or rim; two corners both stay
    pairs = np.stack([corner, corner[before(start)]], axis=1)
    short = size * np.where((kind[pairs] == CORNER).any(axis=1), BESIDE, SHORT)
    label = components(pairs[segment_lengths(P, pairs) < short], len(P))
    first = np.lexsort((-kind, label))
    stays = first[np.unique(label[first], return_index=True)[1]]
    crowded = np.bincount(label[kind == CORNER], minlength=len(stays)) > 1
    used = np.where(crowded[label], np.arange(len(P)), stays[label])[corner]
    owner = np.repeat(np.arange(len(start) - 1), np.diff(start))
    shown = used != used[before(start)]
    while True:
        used, owner = used[shown], owner[shown]
        start = np.append(np.flatnonzero(np.diff(owner, prepend=-1)), len(owner))
        on_rim = np.add.reduceat(kind[used] == INSIDE, start[:-1]) == 0
        sliver = on_rim & (2.0 * polygon_areas(P, start, used) < SLIVER * size**2)
        alone = (kind[used] == CORNER) & (np.bincount(used)[used] == 1)
        sliver &= ~np.logical_or.reduceat(alone, start[:-1])  # the corner would be cut off
        shown = np.repeat((np.diff(start) > 2) & ~sliver, np.diff(start))
        uses = np.bincount(used[shown], minlength=len(P))
        shown &= (kind[used] != EDGE) | (uses[used] > 1)  # else no other panel ends there
        if shown.all():
            break
    left = owner[start[:-1]]
    of_panels = {name: getattr(net, name)[left] for name in ("sheet", "cut", "turned")}
    nodes, corner = np.unique(used, return_inverse=True)
    of_nodes = {"points": P[nodes], "normals": net.normals[nodes], "kind": kind[nodes]}
    return net._replace(start=start, corner=corner, **of_panels, **of_nodes)


def without_flat(net: Net, size: float) -> Net:
    """Without triangles that planarity has laid flat on a straight rim; their nodes come to lie on it. The
    panels on both sides of such a triangle reach the rim: their planes meet only there, and so their common
    node comes to lie on it."""
    P, start, corner, sides = net.points, net.start, net.corner, net.sides
    _, row, uses = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    back, rim, count = before(start), uses[row.ravel()] == 1, np.diff(start)
    tip = corner[back[back]]  # of a triangle, opposite the side that ends at a corner
    flat = (count == 3) & (2.0 * polygon_areas(P, start, corner) < SLIVER * size**2)
    flat &= np.add.reduceat(rim, start[:-1]) == 1
    flat &= np.add.reduceat(rim & (net.kind[tip] == INSIDE), start[:-1]) == 1
    on_rim = rim & np.repeat(flat, count)
    tip, first, last = (nodes[on_rim] for nodes in (tip, corner[back], corner))
    along = P[last] - P[first]
    share = np.einsum("ti,ti->t", P[tip] - P[first], along) / np.einsum("ti,ti->t", along, along)
    P, kind = P.copy(), net.kind.copy()
    P[tip], kind[tip] = P[first] + share[:, None] * along, EDGE
    corner, start = corner[np.repeat(~flat, count)], np.append(0, np.cumsum(count[~flat]))
    rest = {name: getattr(net, name)[~flat] for name in ("sheet", "cut", "turned")}
    return net._replace(points=P, kind=kind, start=start, corner=corner, **rest)


def _pieces(at: Floats, hexagons: bool) -> tuple[Ints, Ints, Floats]:
    """The pieces of triangles with coordinates ``at`` (m,3,2) between lines, counter-clockwise. (k,) the
    triangle of each corner of a piece; (k,) its piece, ascending; (k,3) its place in the triangle."""
    shapely = load_library("shapely", "plan")
    shape = HEXAGON if hexagons else SQUARE
    low = np.floor(at.min(axis=1)) - hexagons
    size = (np.ceil(at.max(axis=1)) + hexagons - low).astype(np.int64)
    row, k = counted(size.prod(axis=1))
    place = low[row] + np.stack([k % size[row, 0], k // size[row, 0]], axis=1)
    if hexagons:
        row, place = (values[place.sum(axis=1) % 2 == 0] for values in (row, place))
    tiles, cut = shapely.polygons(place[:, None] + shape), shapely.polygons(at)[row]
    crossed = ~shapely.covers(tiles, cut)
    cut[crossed] = shapely.intersection(cut[crossed], tiles[crossed], grid_size=GRID)
    found = np.flatnonzero(shapely.area(cut) > 0.0)
    double = cross_2d(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
    cut = shapely.orient_polygons(cut[found], exterior_cw=double[row[found]] < 0.0)  # where lines fold
    points, piece = shapely.get_coordinates(cut, return_index=True)
    row, open_ = row[found][piece], np.append(piece[1:] == piece[:-1], False)  # a ring ends where it starts
    row, piece, points = row[open_], piece[open_], points[open_]
    a, b, c = at[row].transpose(1, 0, 2)
    first, second = cross_2d(c - b, points - b) / double[row], cross_2d(a - c, points - c) / double[row]
    return row, piece, np.stack([first, second, 1.0 - first - second], axis=1)


def _outlines(row: Ints, piece: Ints, sheet: Ints, vertex: Ints) -> tuple[Ints, Ints, Bools]:
    """From corners of pieces (k,): (k,) the panel of each; (s,2) those at the ends of the sides of panels,
    counter-clockwise; and (s,) whether these are on a rim of their sheet."""
    start = np.append(np.flatnonzero(np.diff(piece, prepend=-1)), len(piece))
    ends = np.stack([before(start), np.arange(len(piece))], axis=1)
    ends = ends[vertex[ends[:, 0]] != vertex[ends[:, 1]]]
    sides = np.column_stack([sheet[ends[:, 0]], np.sort(vertex[ends], axis=1)])
    pair = twins(np.unique(sides, axis=0, return_inverse=True)[1].ravel())
    inner = np.ptp(row[ends[pair, 0]], axis=1) > 0  # else between two panels, on a line in a triangle
    panel = components(piece[ends[pair[inner], 0]], int(piece[-1]) + 1)[piece]
    rim, outer = np.ones((2, len(ends)), dtype=bool)
    rim[pair] = False
    outer[pair[(panel[ends[pair, 0]] == panel[ends[pair[:, ::-1], 0]]).all(axis=1)]] = False
    return panel, ends[outer], rim[outer]


def _split(edge: Ints, ends: Ints, place: Floats) -> tuple[Ints, Ints, Ints, Floats]:
    """Sides of panels from vertex to vertex of all that have ``ends`` (s,2) on their edge, at ``place``. (k,)
    the side that each is a part of, its two vertices, and where on the side it starts, 0 to 1."""
    spots = np.stack([np.repeat(edge, 2), ends.ravel()], axis=1)
    spots, index, number = np.unique(spots, axis=0, return_index=True, return_inverse=True)
    place = place.ravel()[index]
    order = np.lexsort((place, spots[:, 0]))
    start, end = np.argsort(order)[number.ravel()].reshape(-1, 2).T
    side, k = counted(np.abs(end - start))
    at = start[side] + np.sign(end - start)[side] * (k + np.arange(2)[:, None])
    (tail, head), (first, last) = order[at], place[order[[start, end]]][:, side]
    return side, spots[tail, 1], spots[head, 1], (place[tail] - first) / (last - first)


@compiled
def _loops(panel: Ints, tail: Ints, head: Ints) -> tuple[Ints, Ints, Ints]:
    """The sides of each panel in turn: where each starts (p+1,), the sides; panels that are no polygon."""
    width, count = max(tail.max(), head.max()) + 1, len(panel)
    order = np.argsort(panel * width + tail)
    begins = (panel * width + tail)[order]
    after = order[np.searchsorted(begins, panel * width + head) % count]
    seen, bad = np.zeros(count, dtype=np.bool_), np.ones(panel.max() + 1, dtype=np.int64)  # 0: one loop
    start, loop = [0], [0]
    for side in range(count):
        at = side
        while not seen[at]:
            seen[at] = True
            loop.append(at)
            if panel[after[at]] != panel[at] or tail[after[at]] != head[at]:
                bad[panel[at]] += count + 1
            at = after[at]
        if len(loop) - 1 > start[-1]:
            bad[panel[side]] -= 1
            start.append(len(loop) - 1)
    return np.array(start), np.array(loop)[1:], np.flatnonzero(bad)
