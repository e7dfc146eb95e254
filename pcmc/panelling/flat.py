"""Triangles laid flat, the angles between neighbours, and panels side by side, to be cut from sheets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import pandas as pd

from ..base.arrays import Floats, Ints
from ..surface.geometry import area_vectors, edge_vectors

SPACE, ROUNDING = 6.0, 1e-9  # mm: between panels; of their places
TURNS = np.radians(np.arange(180.0))  # in which a panel is tried that does not fit as it lies


def laid_flat(P: Floats) -> Floats:
    """(m,3,2) triangles with corners P (m,3,3) laid flat, their outside up: congruent, length.

    The longest edge lies on the x axis and starts at the origin; the third corner is above it.

    >>> laid_flat(np.array([[[0, 0, 1], [0, 0, 5], [0, 3, 1.0]]])).round(12).tolist()
    [[[3.2, 2.4], [0.0, 0.0], [5.0, 0.0]]]
    """
    edges = edge_vectors(P)
    lengths = np.linalg.norm(edges, axis=2)
    every, apex = np.arange(len(P)), lengths.argmax(axis=1)
    first, second = (apex + 1) % 3, (apex + 2) % 3
    base = lengths[every, apex]
    along = edges[every, apex] / base[:, None]
    flat = np.zeros((len(P), 3, 2))
    flat[every, second, 0] = base
    flat[every, apex, 0] = np.einsum("ij,ij->i", P[every, apex] - P[every, first], along)
    flat[every, apex, 1] = 2.0 * np.linalg.norm(area_vectors(P), axis=1) / base
    return flat


def joints(X: Floats, F: Ints, edge_of_face: Ints) -> pd.DataFrame:
    """A row for each pair of triangles that are neighbours at an edge, and for each edge of a single one.

    Columns: ``edge``; ``first``, ``second``, rows of F (-1 for none); ``dihedral``, the angle between the two
    on the inner side of the first, degrees: 180 where they are flat, less at a ridge, more at a valley. Where
    k > 2 triangles meet, the edge has k rows, in turn around it.

    >>> X = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, -1.0]])
    >>> joints(X, np.array([[0, 1, 2], [1, 0, 3]]), np.array([[1, 2, 0], [3, 4, 0]])).dihedral.tolist()
    [135.0, nan, nan, nan, nan]
    """
    order = np.argsort(edge_of_face.ravel(), kind="stable")
    edge, face, side = edge_of_face.ravel()[order], order // 3, order % 3
    _, start, group, count = np.unique(edge, return_index=True, return_inverse=True, return_counts=True)
    lead = start[group]  # the first triangle at each edge: angles are seen from it
    along, normal = edge_vectors(X[F])[face, side], area_vectors(X[F])[face]
    both = np.stack([np.cross(normal, along), normal])
    inward, normal = both / np.maximum(np.linalg.norm(both, axis=2), 1e-300)[..., None]
    sine, cosine = (np.einsum("ij,ij->i", inward, of[lead]) for of in (-normal, inward))
    angle = np.degrees(np.arctan2(sine, cosine)) % 360.0
    angle[start] = 0.0
    turn = np.lexsort((angle, edge))
    edge, face, angle = edge[turn], face[turn], angle[turn]
    after, last = np.arange(len(edge)) + 1, start + count - 1
    after[last] = start
    between = (angle[after] - angle) % 360.0
    between[count[group] == 1] = np.nan
    second = np.where(np.isnan(between), -1, face[after])
    once = np.ones(len(edge), dtype=bool)
    once[last[count == 2]] = False  # two triangles are one pair
    table = pd.DataFrame({"edge": edge, "first": face, "second": second, "dihedral": between})
    return table[once].reset_index(drop=True)


def packed(panels: Iterable[Floats], wide: float, high: float) -> Iterator[tuple[int, Floats]]:
    """The page of each panel (3,2), mm, and the panel placed on it: rows below one another, from y = 0 down.

    >>> panel = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]])
    >>> [(page, placed[0].tolist()) for page, placed in packed([panel] * 3, 30.0, 12.0)]
    [(0, [0.0, -10.0]), (0, [16.0, 0.0]), (1, [0.0, -10.0])]
    """
    page, y, depth = 0, 0.0, 0.0  # of the row that is filled: its top below the page's, and its height
    row: list[tuple[float, Floats]] = []  # how far to the right each reaches, and where it is
    for panel in panels:
        size, placed = np.ptp(panel, axis=0), _beside(row, panel)
        if placed[:, 0].max() > wide + ROUNDING or y + size[1] > high + ROUNDING:
            y, depth, row = y + depth + SPACE, 0.0, []
            if y + size[1] > high + ROUNDING:
                page, y = page + 1, 0.0
            placed = _beside(row, panel)
        row.append((float(placed[:, 0].max()), placed))
        depth = max(depth, float(size[1]))
        yield page, placed - [0.0, y]


def _beside(row: list[tuple[float, Floats]], panel: Floats) -> Floats:
    """The panel (k,2) to the right of those of a row, one side up or the other, as far left as possible. Its
    highest point has y = 0, at the left end of a row its leftmost one x = 0."""
    placements = []
    for turned in (panel, -panel):
        at = turned - np.array([turned[:, 0].min(), turned[:, 1].max()])
        shift = 0.0
        for right, other in reversed(row):  # until it only touches, at a corner of one of the two
            if right + SPACE <= shift:
                continue
            low, high = max(other[:, 1].min(), at[:, 1].min()), min(other[:, 1].max(), at[:, 1].max())
            levels = np.clip(np.append(other[:, 1], at[:, 1]), low, high)
            gap = float((_reach(other, levels).max(axis=0) - _reach(at, levels).min(axis=0)).max())
            shift = max(shift, gap + SPACE)
        placements.append(at + np.array([shift, 0.0]))
    return min(placements, key=lambda placed: float(placed[:, 0].max()))


def _reach(triangle: Floats, levels: Floats) -> Floats:
    """(2,k) the least and the largest x of a triangle at each level y."""
    (a, b), (c, d) = (points.T[..., None] for points in (triangle, np.roll(triangle, -1, axis=0)))
    share = (levels - b) / np.where(d == b, np.nan, d - b)
    sides = np.where((share >= 0.0) & (share <= 1.0), a + share * (c - a), np.nan)
    x = np.concatenate([sides, np.where(levels == b, a, np.nan)])  # where a corner is, also of a level side
    return np.stack([np.nanmin(x, axis=0), np.nanmax(x, axis=0)])


def turned_to_fit(corners: Floats, wide: float, high: float) -> Floats | None:
    """A triangle (3,2) as it lies, or turned so that it is as low as possible; None if it fits in no way."""
    if (np.ptp(corners, axis=0) <= np.array([wide, high]) + ROUNDING).all():
        return corners
    cosine, sine = np.cos(TURNS), np.sin(TURNS)
    turned = corners @ np.array([[cosine, sine], [-sine, cosine]]).transpose(2, 0, 1)
    sizes = np.ptp(turned, axis=1)
    fit = np.flatnonzero((sizes <= np.array([wide, high]) + ROUNDING).all(axis=1))
    return turned[fit[sizes[fit, 1].argmin()]] if len(fit) else None
