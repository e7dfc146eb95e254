"""The nets of a roof's sheets joined at ridges, and the tables of their panels, nodes and beams."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ..base.arrays import Bools, Floats, Ints
from ..surface import Surface
from ..surface.geometry import area_vectors, segment_lengths, vertex_sums
from ..surface.topology import components
from .distance import distances
from .net import Ends, Net
from .planar import before, convex, planarity, polygon_areas, torsion
from .sheet import SheetMesh

INSIDE, EDGE, CORNER = 0, 1, 2
KINDS = np.array(["inside", "edge", "corner"])
SHORT = 0.1  # of the size: the ends of an edge that is shorter become one node
SLIVER = 0.02  # of the size squared: twice the area of a panel between a rim and its chord that is left out
PLACES = 1e5  # per edge: crossings are distinct if they round to different places


class SheetNet(NamedTuple):
    """A sheet with the coordinates of its net."""

    name: str
    faces: Ints  # in the surface
    sheet: SheetMesh
    at: Floats  # (m,3,2)
    ends: Ends
    umbilics: Ints  # vertices of the sheet
    on_line: Bools  # (n,) vertices on boundary curves that are lines of the net
    turned: Floats  # (m,) degrees from the principal directions, NaN if the net does not follow them


class JoinedNets(NamedTuple):
    """The net of a roof, nodes on ridges shared."""

    points: Floats  # (n,3)
    normals: Floats  # (n,3)
    kind: Ints  # (n,) INSIDE, EDGE or CORNER
    start: Ints
    corner: Ints
    patch: list[str]  # of each panel
    state: list[str]  # "whole", "cut" or "umbilic"
    turned: Floats

    @property
    def beams(self) -> Ints:
        """(e,2) the nodes of each edge."""
        return np.unique(self.sides, axis=0)

    @property
    def sides(self) -> Ints:
        """(k,2) the nodes of each side of each panel, ascending."""
        return np.sort(np.stack([self.corner, self.corner[before(self.start)]], axis=1), axis=1)


def shared_ends(surface: Surface, parts: Sequence[SheetNet]) -> list[tuple[Ints, Floats]]:
    """For each sheet the sides and places on its boundary where lines of the sheets beyond it end."""
    found = [_edges(surface, part, part.ends.side) for part in parts]
    edge = np.concatenate([one for one, _ in found])
    places = [
        np.where(ahead, p.ends.place, 1.0 - p.ends.place) for p, (_, ahead) in zip(parts, found, strict=True)
    ]
    place, owner = np.concatenate(places), np.repeat(np.arange(len(parts)), [len(one) for one, _ in found])
    more = []
    for k, part in enumerate(parts):
        side_of = np.full(len(surface.topology.edges), -1)
        own, ahead = _edges(surface, part, np.arange(part.sheet.F.size))
        side_of[own] = np.arange(len(own))
        others = np.flatnonzero((owner != k) & (side_of[edge] >= 0))
        side = side_of[edge[others]]
        more.append((side, np.where(ahead[side], place[others], 1.0 - place[others])))
    return more


def _edges(surface: Surface, part: SheetNet, side: Ints) -> tuple[Ints, Bools]:
    """The edges of the surface that sides of a sheet are, and whether the sheet runs along as they do."""
    face, k = part.faces[side // 3], side % 3
    return surface.topology.edge_of_face[face, k], surface.topology.sense[face, k] > 0


def joined_nets(surface: Surface, parts: Sequence[SheetNet], nets: Sequence[Net], size: float) -> JoinedNets:
    """One net of all sheets, without short edges and slivers."""
    first = np.cumsum([0] + [len(one.face) for one in nets])
    columns = [_nodes(surface, *one) for one in zip(parts, nets, first.tolist(), strict=False)]
    key, points, normal, kinds, on_line, turned = map(np.concatenate, zip(*columns, strict=True))
    corner = np.concatenate([one.corner + k for one, k in zip(nets, first.tolist(), strict=False)])
    counts = np.concatenate([np.diff(one.start) for one in nets])
    owner = np.repeat(np.arange(len(counts)), counts)
    patch = np.repeat([part.name for part in parts], [len(one.start) - 1 for one in nets])
    number: Ints
    _, keep, number = np.unique(key, axis=0, return_index=True, return_inverse=True)
    P, kind = points[keep], kinds[keep]
    number = np.asarray(number).reshape(-1)
    N = np.stack([np.bincount(number, column, len(P)) for column in normal.T], axis=1)
    start = _starts(owner)
    pairs = number[np.stack([corner, corner[before(start)]], axis=1)]
    number = _merged(P, kind, pairs, SHORT * size)[number]
    shown = number[corner] != number[corner[before(start)]]
    while True:
        corner, owner = corner[shown], owner[shown]
        start, used = _starts(owner), number[corner]
        sliver = (np.add.reduceat(kind[used] == INSIDE, start[:-1]) == 0) & (
            2.0 * polygon_areas(P, start, used) < SLIVER * size**2
        )
        shown = np.repeat((np.diff(start) > 2) & ~sliver, np.diff(start))
        uses = np.bincount(used[shown], minlength=len(P))
        shown &= (kind[used] != EDGE) | (uses[used] > 1)  # else no other panel ends there
        if shown.all():
            break
    used, ends = np.unique(number[corner], return_inverse=True)
    inside = np.add.reduceat(kind[number[corner]] != INSIDE, start[:-1]) == 0
    umbilic = inside & (np.diff(start) != 4) & any(len(part.umbilics) for part in parts)
    cut = ~np.logical_and.reduceat(on_line[corner], start[:-1])
    return JoinedNets(
        P[used],
        N[used] / np.linalg.norm(N[used], axis=1)[:, None],
        kind[used],
        start,
        ends,
        patch[owner[start[:-1]]].tolist(),
        np.select([cut, umbilic], ["cut", "umbilic"], "whole").tolist(),
        np.add.reduceat(turned[corner], start[:-1]) / np.diff(start),
    )


def _nodes(surface: Surface, part: SheetNet, one: Net, total: int) -> tuple[Any, ...]:
    """Of a sheet's nodes: keys that are the same at ridges, points, normals, kinds, whether they are inside
    or on a curve that is a line of the net, and the angle from the principal directions."""
    sheet, count = part.sheet, len(one.face)
    normal = vertex_sums(area_vectors(sheet.X[sheet.F]), sheet.F, len(sheet.X))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    points = np.einsum("nk,nki->ni", one.weights, sheet.X[sheet.F[one.face]])
    shifted = one.towards >= 0  # a hexagon's node, a sixth of the way to its neighbour
    points[shifted] += (points[one.towards[shifted]] - points[shifted]) / 6.0
    rim, side = one.side >= 0, np.maximum(one.side, 0)
    first, last = (sheet.F[side // 3, (side % 3 + step) % 3] for step in (1, 2))
    at_vertex = rim & (one.place == 0.0)
    edge, ahead = _edges(surface, part, side)
    place = np.rint(PLACES * np.where(ahead, one.place, 1.0 - one.place))
    key = np.stack([np.where(rim, edge, -1), np.where(rim, place, total + np.arange(count))], axis=1)
    key[at_vertex] = np.stack([len(surface.topology.edges) + sheet.vertex[first], 0 * first], axis=1)[
        at_vertex
    ]
    kind = np.where(at_vertex, CORNER, np.where(rim, EDGE, INSIDE))
    on_line = ~rim | (part.on_line[first] & part.on_line[last])
    normals = np.einsum("nk,nki->ni", one.weights, normal[sheet.F[one.face]])
    return key, points, normals, kind, on_line, part.turned[one.face]


def _merged(P: Floats, kind: Ints, pairs: Ints, short: float) -> Ints:
    """(n,) for each node the one that it is merged with: at the ends of edges shorter than ``short``.

    A corner stays, else a node of a ridge or rim; two corners are not merged.
    """
    label = components(pairs[segment_lengths(P, pairs) < short], len(P))
    first = np.lexsort((-kind, label))
    stays = first[np.unique(label[first], return_index=True)[1]]
    crowded = np.bincount(label[kind == CORNER], minlength=len(stays)) > 1
    return np.where(crowded[label], np.arange(len(P)), stays[label])


def _starts(owner: Ints) -> Ints:
    """The first corner of each panel and the end, from the panels that corners are of."""
    return np.append(np.flatnonzero(np.diff(owner, prepend=-1)), len(owner))


def without_flat(joined: JoinedNets, P: Floats, size: float) -> tuple[JoinedNets, Floats]:
    """Without triangles that planarity has laid flat on a straight rim; and the nodes P (n,3), theirs on it.

    The panels on both sides of such a triangle reach the rim: their planes meet only there, and so their
    common node comes to lie on it.
    """
    start, corner = joined.start, joined.corner
    _, row, uses = np.unique(joined.sides, axis=0, return_inverse=True, return_counts=True)
    back, rim, count = before(start), uses[row.ravel()] == 1, np.diff(start)
    tip = corner[back[back]]  # of a triangle, opposite the side that ends at a corner
    flat = (count == 3) & (2.0 * polygon_areas(P, start, corner) < SLIVER * size**2)
    flat &= np.add.reduceat(rim, start[:-1]) == 1
    flat &= np.add.reduceat(rim & (joined.kind[tip] == INSIDE), start[:-1]) == 1
    kept = ~np.repeat(flat, count)
    on_rim = rim & ~kept
    tip, first, last = (nodes[on_rim] for nodes in (tip, corner[back], corner))
    along = P[last] - P[first]
    share = np.einsum("ti,ti->t", P[tip] - P[first], along) / np.einsum("ti,ti->t", along, along)
    P, kind = P.copy(), joined.kind.copy()
    P[tip], kind[tip] = P[first] + share[:, None] * along, EDGE
    left = joined._replace(
        kind=kind,
        start=np.append(0, np.cumsum(count[~flat])),
        corner=corner[kept],
        patch=np.array(joined.patch)[~flat].tolist(),
        state=np.array(joined.state)[~flat].tolist(),
        turned=joined.turned[~flat],
    )
    return left, P


def net_tables(
    surface: Surface, joined: JoinedNets, P: Floats, axes: Floats
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Nodes, panels and beams of a net with nodes at P (n,3); see ``PanelNet``."""
    start, corner, N = joined.start, joined.corner, joined.normals
    middle = np.add.reduceat(P[corner], start[:-1]) / np.diff(start)[:, None]
    roof = surface.faces[surface.roof[surface.patch_of_face]]
    away = distances(np.concatenate([P, middle]), surface.vertices, roof)
    cosine = np.einsum("ni,ni->n", axes, N) / np.linalg.norm(axes, axis=1)
    nodes = pd.DataFrame(
        {
            "node": np.arange(len(P)) + 1,
            **dict(zip("xyz", P.T, strict=True)),
            "kind": KINDS[joined.kind],
            "distance": away[: len(P)],
            "lean": np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))),
        }
    )
    panels = pd.DataFrame(
        {
            "panel": np.arange(len(middle)) + 1,
            "patch": joined.patch,
            "kind": joined.state,
            "corners": np.diff(start),
            "area": polygon_areas(P, start, corner),
            "planarity": planarity(P, start, corner),
            "convex": convex(P, start, corner),
            "distance": np.maximum(np.maximum.reduceat(away[corner], start[:-1]), away[len(P) :]),
            "turned": joined.turned,
        }
    )
    panel = np.repeat(panels["panel"].to_numpy(), panels["corners"])
    ends, first, row = np.unique(joined.sides, axis=0, return_index=True, return_inverse=True)
    neighbour = np.zeros(len(ends), dtype=np.int64)
    other = np.ones(len(panel), dtype=bool)
    other[first] = False
    neighbour[row.ravel()[other]] = panel[other]
    beams = pd.DataFrame(
        {
            "beam": np.arange(len(ends)) + 1,
            "node": ends[:, 0] + 1,
            "other": ends[:, 1] + 1,
            "length": segment_lengths(P, ends),
            "panel": panel[first],
            "neighbour": neighbour,
            "torsion": torsion(P, ends, axes),
            "torsion_normal": torsion(P, ends, N),
        }
    )
    return nodes, panels, beams
