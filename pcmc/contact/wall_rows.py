"""How the vertices of a wall hang from its crest: where along it, and at what share of its height."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..surface import Surface

SNAP = 1e-3  # of a crest edge: a vertex this near to hanging straight below a crest vertex does
FLAT = 1e-9  # height of the crest, relative to the size, below which it tells no rows apart
LEAN = 4.0  # crest heights that a wall vertex may stand off from straight below the crest


def crest_places(X: Floats, ends: Ints, along: Floats) -> Floats:
    """(w,3) the places on the crest that wall vertices hang from."""
    return (1.0 - along[:, None]) * X[ends[:, 0]] + along[:, None] * X[ends[:, 1]]


def places(
    surface: Surface, X: Floats, ends: Ints, along: Floats, share: Floats, lean: Floats
) -> Floats:
    """(w,3) where wall vertices hang with the crest at X (n,3)."""
    above = crest_places(X, ends, along)
    height = surface.plane.height(above)[:, None]
    return above + height * ((share[:, None] - 1.0) * np.array(surface.plane.normal) + lean)


def wall_rows(
    surface: Surface, below: Ints, crest: Ints, sides: Ints
) -> tuple[Ints, Floats, Floats, Floats]:
    """Crest edge ends (w,2), λ, ρ and what wall vertices stand off, by nearness seen along Π's normal.

    ``sides`` are the wall's edges. Where the crest lies on Π its height tells nothing, and ρ is that of
    the vertex's row: steps along edges from the foot, over those from foot to crest.
    """
    X, height = surface.vertices, surface.plane.height(surface.vertices)
    flat = X - height[:, None] * np.array(surface.plane.normal)
    ends, along = _nearest(flat, below, crest)
    above = (1.0 - along) * height[ends[:, 0]] + along * height[ends[:, 1]]
    stands = np.abs(above) > FLAT * surface.size
    share = np.clip(np.divide(height[below], above, out=np.zeros(len(below)), where=stands), 0, 1)
    if not stands.all():
        share = np.where(stands, share, _rows(surface, below, sides))
    share[surface.on_plane[below]] = 0.0
    straight = places(surface, X, ends, along, share, np.zeros((len(below), 3)))
    lean = np.zeros((len(below), 3))
    np.divide(X[below] - straight, above[:, None], out=lean, where=stands[:, None])
    lean[np.linalg.norm(lean, axis=1) > LEAN] = 0.0
    return ends, along, share, lean


def _nearest(flat: Floats, below: Ints, crest: Ints) -> tuple[Ints, Floats]:
    """The crest edge (w,2) nearest to each wall vertex, seen along Π's normal, and λ there."""
    start, side = flat[crest[:, 0]], flat[crest[:, 1]] - flat[crest[:, 0]]
    length = np.einsum("ij,ij->i", side, side)
    near = cKDTree(start + 0.5 * side).query(flat[below], k=min(4, len(crest)))[1]
    near = near.reshape(len(below), -1)
    along = np.einsum("wkj,wkj->wk", flat[below][:, None] - start[near], side[near])
    along = np.clip(along / np.where(length > 0.0, length, 1.0)[near], 0.0, 1.0)
    foot = start[near] + along[:, :, None] * side[near]
    best = np.linalg.norm(flat[below][:, None] - foot, axis=2).argmin(axis=1)
    row = np.arange(len(below))
    along = along[row, best]
    along = np.where(along < SNAP, 0.0, np.where(along > 1.0 - SNAP, 1.0, along))
    return crest[near[row, best]], along


def _rows(surface: Surface, below: Ints, sides: Ints) -> Floats:
    """ρ (w,) by edges (k,2) of the wall: steps to the foot, over those to the foot and to the crest."""
    inner = np.zeros(surface.n, dtype=bool)
    inner[below] = True
    crest = np.unique(sides[~(inner | surface.fixed)[sides]])
    foot = below[surface.on_plane[below]]
    # no way leads through a corner, which is foot and crest at once
    links = sides[(inner | np.isin(np.arange(surface.n), crest))[sides].all(axis=1)]
    graph = coo_array((np.ones(len(links)), links.T), shape=(surface.n, surface.n)).tocsr()
    steps = [
        dijkstra(graph, directed=False, indices=of, unweighted=True, min_only=True)[below]
        for of in (foot, crest)
    ]
    reached = np.isfinite(steps[0]) & np.isfinite(steps[1])
    total = np.where(reached, steps[0] + steps[1], 1.0)
    return np.where(reached, steps[0] / total, 0.5)


def joined(
    parts: list[tuple[Ints, Ints, Floats, Floats, Floats]],
) -> tuple[Ints, Ints, Floats, Floats, Floats]:
    """One list of hanging vertices; one that two walls share hangs from the first."""
    if not parts:
        none = np.empty(0, dtype=int)
        return none, np.empty((0, 2), dtype=int), np.empty(0), np.empty(0), np.empty((0, 3))
    vertex, ends, along, share, lean = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    first = np.unique(vertex, return_index=True)[1]
    return vertex[first], ends[first], along[first], share[first], lean[first]
