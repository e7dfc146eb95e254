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
from .planar import by_corners, convex, planarity, torsion
from .sheet import Sheet

INSIDE, EDGE, CORNER = 0, 1, 2
KINDS = np.array(["inside", "edge", "corner"])
SHORT = 0.1  # of the size: the ends of an edge that is shorter become one node
SLIVER = 0.02  # of the size squared: twice the area of a panel between a rim and its chord that is left out
PLACES = 1e5  # on an edge that are told apart


class SheetNet(NamedTuple):
    """A sheet with the coordinates of its net."""

    name: str
    faces: Ints  # in the surface
    sheet: Sheet
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
        after = np.arange(len(self.corner)) + 1
        after[self.start[1:] - 1] = self.start[:-1]
        return np.sort(np.stack([self.corner, self.corner[after]], axis=1), axis=1)


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
    """One net of all sheets, without short edges."""
    columns: list[tuple[Any, ...]] = []
    loops: list[Ints] = []
    patch: list[str] = []
    total = 0
    for part, one in zip(parts, nets, strict=True):
        columns.append(_nodes(surface, part, one, total))
        loops += [loop + total for loop in np.split(one.corner, one.start[1:-1])]
        patch += [part.name] * (len(one.start) - 1)
        total += len(one.face)
    key, points, normal, kinds, on_line, turned = (
        np.concatenate(rows) for rows in zip(*columns, strict=True)
    )
    number: Ints
    _, keep, number = np.unique(key, axis=0, return_index=True, return_inverse=True)
    P, kind = points[keep], kinds[keep]
    number = np.asarray(number).reshape(-1)
    N = np.stack([np.bincount(number, column, len(P)) for column in normal.T], axis=1)
    stays = _merged(P, kind, [number[loop] for loop in loops], SHORT * size)
    number = stays[number]
    loops = [loop[number[loop] != number[np.roll(loop, 1)]] for loop in loops]
    shown = [k for k, loop in enumerate(loops) if len(loop) > 2 and not _sliver(P, kind, number[loop], size)]
    uses = np.bincount(np.concatenate([number[loops[k]] for k in shown]), minlength=len(P))
    needed = (kind != EDGE) | (uses > 1)  # else no other panel ends there
    loops = [loop[needed[number[loop]]] for loop in loops]
    shown = [k for k in shown if len(loops[k]) > 2 and not _sliver(P, kind, number[loops[k]], size)]
    state = [_state(on_line[loops[k]], kind[number[loops[k]]], parts) for k in shown]
    used, corner = np.unique(np.concatenate([number[loops[k]] for k in shown]), return_inverse=True)
    return JoinedNets(
        P[used],
        N[used] / np.linalg.norm(N[used], axis=1)[:, None],
        kind[used],
        np.append(0, np.cumsum([len(loops[k]) for k in shown])),
        corner,
        [patch[k] for k in shown],
        state,
        np.array([turned[loops[k]].mean() for k in shown]),
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


def _state(on_line: Bools, kind: Ints, parts: Sequence[SheetNet]) -> str:
    if not on_line.all():
        return "cut"
    follows = any(len(part.umbilics) for part in parts)
    return "umbilic" if follows and len(kind) != 4 and (kind == INSIDE).all() else "whole"


def _merged(P: Floats, kind: Ints, loops: list[Ints], short: float) -> Ints:
    """(n,) for each node the one that it is merged with: at the ends of edges shorter than ``short``.

    A corner stays, else a node of a ridge or rim; two corners are not merged.
    """
    pairs = np.concatenate([np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops])
    label = components(pairs[segment_lengths(P, pairs) < short], len(P))
    first = np.lexsort((-kind, label))
    stays = first[np.unique(label[first], return_index=True)[1]]
    crowded = np.bincount(label[kind == CORNER], minlength=len(stays)) > 1
    return np.where(crowded[label], np.arange(len(P)), stays[label])


def _sliver(P: Floats, kind: Ints, loop: Ints, size: float) -> bool:
    """Whether a panel is only what lies between a rim and its chord."""
    twice = np.linalg.norm(np.cross(P[loop], np.roll(P[loop], -1, axis=0)).sum(axis=0))
    return bool((kind[loop] != INSIDE).all() and twice < SLIVER * size**2)


def net_tables(
    surface: Surface, joined: JoinedNets, P: Floats, axes: Floats
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Nodes, panels and beams of a net with nodes at P (n,3); see ``PanelNet``."""
    start, corner, N = joined.start, joined.corner, joined.normals
    middle, area = np.zeros((len(start) - 1, 3)), np.zeros(len(start) - 1)
    for chosen, loops in by_corners(start, corner):
        Q = P[loops]
        middle[chosen] = Q.mean(axis=1)
        area[chosen] = 0.5 * np.linalg.norm(np.cross(Q, np.roll(Q, -1, axis=1)).sum(axis=1), axis=1)
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
            "area": area,
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
