"""A net without short edges and slivers, and the tables of its panels, nodes and beams."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from ..base.arrays import Floats
from ..surface import Surface
from ..surface.geometry import segment_lengths
from ..surface.topology import components
from .distance import distances
from .net import CORNER, EDGE, INSIDE, Net, SheetNet
from .planar import before, convex, planarity, polygon_areas, torsion

KINDS = np.array(["inside", "edge", "corner"])
SHORT = 0.1  # of the size: the ends of an edge that is shorter become one node
BESIDE = 0.15  # of the size: beside a corner, √SLIVER and more, so that no sliver has the corner
SLIVER = 0.02  # of the size squared: twice the area of a panel between a rim and its chord that is left out


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
    number = np.where(crowded[label], np.arange(len(P)), stays[label])
    owner = np.repeat(np.arange(len(start) - 1), np.diff(start))
    used = number[corner]
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
    left, panels = owner[start[:-1]], dict[str, Any](start=start)
    panels |= {name: getattr(net, name)[left] for name in ("sheet", "cut", "turned")}
    nodes, panels["corner"] = np.unique(used, return_inverse=True)
    return net._replace(points=P[nodes], normals=net.normals[nodes], kind=kind[nodes], **panels)


def without_flat(net: Net, size: float) -> Net:
    """Without triangles that planarity has laid flat on a straight rim; their nodes come to lie on it.

    The panels on both sides of such a triangle reach the rim: their planes meet only there, and so their
    common node comes to lie on it.
    """
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


def net_tables(
    surface: Surface, parts: Sequence[SheetNet], net: Net, axes: Floats
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Nodes, panels and beams of a net; see ``PanelNet``."""
    P, N, start, corner = net.points, net.normals, net.start, net.corner
    middle = np.add.reduceat(P[corner], start[:-1]) / np.diff(start)[:, None]
    roof = surface.faces[surface.roof[surface.patch_of_face]]
    away = distances(np.concatenate([P, middle]), surface.vertices, roof)
    cosine = np.einsum("ni,ni->n", axes, N) / np.linalg.norm(axes, axis=1)
    nodes = pd.DataFrame(
        {
            "node": np.arange(len(P)) + 1,
            **dict(zip("xyz", P.T, strict=True)),
            "kind": KINDS[net.kind],
            "distance": away[: len(P)],
            "lean": np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))),
        }
    )
    inside = np.add.reduceat(net.kind[corner] != INSIDE, start[:-1]) == 0
    umbilic = inside & (np.diff(start) != 4) & any(len(part.umbilics) for part in parts)
    panels = pd.DataFrame(
        {
            "panel": np.arange(len(middle)) + 1,
            "patch": [parts[k].name for k in net.sheet],
            "kind": np.select([net.cut, umbilic], ["cut", "umbilic"], "whole"),
            "corners": np.diff(start),
            "area": polygon_areas(P, start, corner),
            "planarity": planarity(P, start, corner),
            "convex": convex(P, start, corner),
            "distance": np.maximum(np.maximum.reduceat(away[corner], start[:-1]), away[len(P) :]),
            "turned": net.turned,
        }
    )
    panel = np.repeat(panels["panel"].to_numpy(), panels["corners"])
    ends, first, row = np.unique(net.sides, axis=0, return_index=True, return_inverse=True)
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
