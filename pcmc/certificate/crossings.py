"""Where a surface cuts itself: the pairs of its triangles that go through each other."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..base.compiled import compiled, inlined
from ..surface import Surface
from ..surface.geometry import add, cross, dot, norm, point, scaled, sub
from ..surface.pieces import point_text

LEAF = 4  # triangles in each of the smallest boxes
CLEAR = 1e-6  # of the size: how far triangles go through each other, where they do not only touch


def crossing_pairs(surface: Surface) -> Ints:
    """(k,2) the triangles that go through each other, each pair once, ascending.

    A side of one crosses the inside of the other, and both its ends are off the other's plane by more than
    ``CLEAR``: triangles that touch do not count, nor those with a common vertex. Of a periodic surface the
    triangles of one cell are compared, of a part between mirror planes those of the part.

    >>> from pcmc import Patch
    >>> X = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, -1], [1, 1, 1], [9, 9, 1]]
    >>> cut = Surface(X, [[0, 1, 2], [3, 4, 5]], [0, 0], [Patch("a", 1.0)], fixed=range(6))
    >>> crossing_pairs(cut).tolist()
    [[0, 1]]
    """
    corners = surface.vertices[surface.faces]
    order = np.asarray(cKDTree(corners.mean(axis=1), leafsize=LEAF).indices)  # neighbours in space follow
    corners, vertices = corners[order].reshape(-1, 3), surface.topology.faces[order]
    # a binary tree of boxes, their least and greatest coordinates: node i has the children 2 i and 2 i + 1
    leaves = 1 << max(-(-len(corners) // (3 * LEAF)) - 1, 0).bit_length()
    boxes = np.full((2 * leaves, 6), np.inf)
    first = np.arange(0, len(corners), 3 * LEAF)
    for sign, half in ((1.0, slice(0, 3)), (-1.0, slice(3, 6))):
        boxes[leaves : leaves + len(first), half] = np.minimum.reduceat(sign * corners, first)
    while leaves > 1:
        below = boxes[leaves : 2 * leaves]
        boxes[leaves // 2 : leaves] = np.minimum(below[::2], below[1::2])
        leaves //= 2
    boxes *= [1.0, 1.0, 1.0, -1.0, -1.0, -1.0]
    pairs = np.sort(order[_crossing(corners, vertices, boxes, CLEAR * surface.size)], axis=1)
    return np.asarray(pairs[np.lexsort(pairs.T[::-1])])


def crossing_table(surface: Surface) -> pd.DataFrame:
    """A row per two patches that cut each other, or one that cuts itself.

    Columns: ``patch``; ``other``, or the mirror plane that it goes through, and so cuts its image; ``x``,
    ``y``, ``z``, the middle of one triangle there, nearest to the middle of all.
    """
    names, patch, rows = [p.name for p in surface.patches], surface.patch_of_face, []
    pairs, middle = crossing_pairs(surface), surface.vertices[surface.faces].mean(axis=1)
    both = np.sort(patch[pairs], axis=1)
    found = [(names[i], names[j], pairs[(both == [i, j]).all(axis=1), 0]) for i, j in np.unique(both, axis=0)]
    for plane, _ in surface.on_planes:
        height = plane.height(surface.vertices)[surface.faces] if plane.mirror else np.zeros((surface.m, 3))
        side = np.sign(height.sum())  # that of most
        through = (side * height < -CLEAR * surface.size).any(axis=1)
        for k in np.unique(patch[through]):
            found.append((names[k], str(plane), np.flatnonzero(through & (patch == k))))
    for one, other, faces in found:
        at = middle[faces]
        rows.append([one, other, *at[np.linalg.norm(at - at.mean(axis=0), axis=1).argmin()]])
    return pd.DataFrame(rows, columns=["patch", "other", *"xyz"])


def crossing_texts(table: pd.DataFrame, size: float) -> list[str]:
    """The rows of a table of crossings in words; ``size`` is that of the surface."""
    return [
        f"{one!r} cuts {'itself' if one == other else repr(other)} near {point_text(np.array(at), size)}"
        for one, other, *at in table.itertuples(index=False, name=None)
    ]


@compiled
def _crossing(X: Floats, F: Ints, boxes: Floats, clear: float) -> Ints:
    """(k,2) the pairs of triangles that cross, with corners X (3 m,3), vertices F (m,3) and boxes."""
    leaves, last = len(boxes) // 2, -(-len(F) // LEAF)
    found, count, stack = np.empty((16, 2), dtype=np.int64), 0, np.empty(64, dtype=np.int64)
    for one in range(last):
        stack[0], top = 1, 1
        while top:
            top -= 1
            node = stack[top]
            if not _meet(boxes, leaves + one, node):
                continue
            if node < leaves:
                stack[top], stack[top + 1] = 2 * node, 2 * node + 1
                top += 2
                continue
            for i in range(one * LEAF, min(one * LEAF + LEAF, len(F))):
                other = node - leaves
                for j in range(max(other * LEAF, i + 1), min(other * LEAF + LEAF, len(F))):
                    if _share(F, i, j):
                        continue
                    if _goes_through(X, i, j, clear) or _goes_through(X, j, i, clear):
                        if count == len(found):
                            found = np.concatenate((found, np.empty_like(found)))
                        found[count, 0], found[count, 1] = i, j
                        count += 1
    return found[:count]


@inlined
def _meet(boxes: Floats, i: int, j: int) -> bool:
    meet = True
    for d in range(3):
        meet = meet and boxes[i, d] <= boxes[j, d + 3] and boxes[j, d] <= boxes[i, d + 3]
    return meet


@inlined
def _share(F: Ints, i: int, j: int) -> bool:
    for a in F[i]:
        for b in F[j]:
            if a == b:
                return True
    return False


@inlined
def _goes_through(X: Floats, i: int, j: int, clear: float) -> bool:
    """Whether a side of triangle i goes through triangle j, with both ends clear of its plane."""
    a, b, c = point(X, 3 * j), point(X, 3 * j + 1), point(X, 3 * j + 2)
    normal = cross(sub(b, a), sub(c, a))
    off = clear * norm(normal)
    for k in range(3):
        p, q = point(X, 3 * i + k), point(X, 3 * i + (k + 1) % 3)
        below, above = dot(normal, sub(p, a)), dot(normal, sub(q, a))
        if min(below, above) < -off and max(below, above) > off:
            x = add(p, scaled(below / (below - above), sub(q, p)))
            first = dot(cross(sub(b, a), sub(x, a)), normal)
            second = dot(cross(sub(c, b), sub(x, b)), normal)
            if first > 0.0 and second > 0.0 and dot(cross(sub(a, c), sub(x, c)), normal) > 0.0:
                return True
    return False
