"""Walls that can pinch: which they are, and their rows, where their vertices lie below the top edges."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..base.arrays import Bools, Floats, Ints, distinct, mask_of
from ..base.tolerances import ON
from ..surface import Surface
from ..surface.checks import lying
from ..surface.geometry import area_vectors, vertex_sums
from ..surface.images import expect_no_images
from ..surface.supports import Admissible, members
from ..surface.topology import curve_neighbours

SNAP = 1e-3  # of a top edge: a vertex this near to the line below a top vertex belongs on that line
SAMPLES = 65  # points on each line from a foot to its top, to find the line that is nearest to a vertex
MAX_OFFSET = 4.0  # heights of the top edge that a wall vertex may be off the line below its place there


@dataclass(frozen=True, eq=False)
class WallRows:
    """Wall vertices below the top edges of their walls.

    With X_i, X_j the ends of a top edge, P = (1 - λ) X_i + λ X_j, n the normal of Π and z the height over it,

        P + (ρ - 1) D + z(P) o,   D = z(P) n

    is the place of a vertex; where the bottom is held, D = P - Q, Q between the held vertices below i and j,
    and |D| stands for z(P) in front of o.
    """

    vertices: Ints  # (w,) their indices
    top_ends: Ints  # (w,2) the ends i, j of the top edge above each
    fraction: Floats  # (w,) λ, how far P is from i to j
    relative_height: Floats  # (w,) ρ, 0 at the bottom and 1 at the top
    offset: Floats  # (w,3) o, how far a leaning or bulging wall is off the line below P, over its height
    feet: Ints  # (w,2) the held bottom vertices below i and j; -1 where the bottom slides

    def top_places(self, X: Floats) -> Floats:
        """(w,3) the places P on the top edges, with the surface's vertices at X (n,3)."""
        return self._between(X[self.top_ends[:, 0]], X[self.top_ends[:, 1]])

    def _between(self, start: Floats, end: Floats) -> Floats:
        return np.asarray((1.0 - self.fraction[:, None]) * start + self.fraction[:, None] * end)

    def places(self, surface: Surface, X: Floats) -> Floats:
        """(w,3) where the rows lie, with the top edges at X (n,3)."""
        drop = self.drops(surface, X)
        aside = self.heights(surface, drop)[:, None] * self.offset
        return np.asarray(self.top_places(X) + (self.relative_height[:, None] - 1.0) * drop + aside)

    def heights(self, surface: Surface, drop: Floats) -> Floats:
        """(w,) |D| of D (w,3); over a sliding bottom z(P), < 0 below Π, so that places are linear in X."""
        held = self.feet[:, 0] >= 0
        return np.where(held, np.linalg.norm(drop, axis=1), drop @ np.array(surface.plane.normal))

    def drops(self, surface: Surface, X: Floats) -> Floats:
        """(w,3) D, from the bottom up to the top edge."""
        top, held = self.top_places(X), self.feet[:, 0] >= 0
        drop = surface.plane.height(top)[:, None] * np.array(surface.plane.normal)
        drop[held] = (top - self._between(X[self.feet[:, 0]], X[self.feet[:, 1]]))[held]
        return np.asarray(drop)


def wall_rows(
    surface: Surface, roof_vertex: Bools, top_edges: Ints, wall_edges: Ints, foot: Ints | None
) -> WallRows:
    """The rows of one wall: its vertices below the nearest of its ``top_edges`` (k,2), seen along n.

    ``foot`` (n,) gives the held bottom vertex below each top vertex, if the bottom is held. Then a vertex is
    below the top vertex whose line from its foot is nearest, also where the junction leans along the wall.

    Where the top edge lies on the bottom its height shows nothing. There ρ is that of the vertex's row: steps
    along ``wall_edges`` from the foot, over those from foot to top.
    """
    vertices = distinct(wall_edges, surface.n)
    vertices = vertices[~roof_vertex[vertices]]
    X, zero, none = surface.vertices, np.zeros(len(vertices)), np.zeros((len(vertices), 3))
    if foot is None:
        ends, fraction = _nearest(surface.plane.nearest(X), vertices, top_edges)
        feet, bottom = np.full_like(ends, -1), surface.on_ground
    else:
        edge, tops = np.empty(surface.n, dtype=np.int64), np.flatnonzero(foot >= 0)
        edge[top_edges.ravel()] = np.repeat(np.arange(len(top_edges)), 2)
        at = np.linspace(0.0, 1.0, SAMPLES)[:, None, None]  # on the lines from the feet to the top
        points = ((1.0 - at) * X[foot[tops]] + at * X[tops]).reshape(-1, 3)
        above = tops[np.asarray(cKDTree(points).query(X[vertices])[1]) % len(tops)]
        ends = top_edges[edge[above]]
        fraction = (ends[:, 1] == above).astype(float)
        feet, bottom = foot[ends], surface.pinned
    rows = WallRows(vertices, ends, fraction, zero, none, feet)
    drop = rows.drops(surface, X)
    top = rows.heights(surface, drop)
    share = np.einsum("ij,ij->i", X[vertices] - rows.places(surface, X), drop)
    stands = np.abs(top) > ON * surface.size
    relative = np.clip(np.divide(share, top**2, out=zero.copy(), where=stands), 0.0, 1.0)
    if not stands.all():  # steps to the foot, over those to the foot and to the top
        inner = mask_of(vertices, surface.n)
        tops = np.unique(wall_edges[~(inner | surface.pinned)[wall_edges]])
        # a corner is foot and top at once: no path may lead through it
        links = wall_edges[(inner | mask_of(tops, surface.n))[wall_edges].all(axis=1)]
        goals = vertices[bottom[vertices]], tops
        down, up = (_steps(links, goal, surface.n, nearest=True)[vertices] for goal in goals)
        reached = np.isfinite(down + up)
        steps = np.where(reached, down / np.where(reached, down + up, 1.0), 0.5)
        relative = np.where(stands, relative, steps)
    relative[bottom[vertices]] = 0.0
    rows = replace(rows, relative_height=relative)
    offset = np.divide(X[vertices] - rows.places(surface, X), top[:, None], out=none, where=stands[:, None])
    offset[np.linalg.norm(offset, axis=1) > MAX_OFFSET] = 0.0
    return replace(rows, offset=offset)


def _nearest(flat: Floats, vertices: Ints, top_edges: Ints) -> tuple[Ints, Floats]:
    """The top edge (w,2) nearest to each wall vertex, seen along Π's normal, and λ there."""
    start, side = flat[top_edges[:, 0]], flat[top_edges[:, 1]] - flat[top_edges[:, 0]]
    length = np.einsum("ij,ij->i", side, side)
    few = range(1, 1 + min(4, len(top_edges)))
    near = np.asarray(cKDTree(start + 0.5 * side).query(flat[vertices], k=few)[1])
    fraction = np.einsum("wkj,wkj->wk", flat[vertices][:, None] - start[near], side[near])
    fraction = np.clip(fraction / np.where(length > 0.0, length, 1.0)[near], 0.0, 1.0)
    foot = start[near] + fraction[:, :, None] * side[near]
    best = np.linalg.norm(flat[vertices][:, None] - foot, axis=2).argmin(axis=1)
    row = np.arange(len(vertices))
    fraction = fraction[row, best]
    fraction = np.where(fraction < SNAP, 0.0, np.where(fraction > 1.0 - SNAP, 1.0, fraction))
    return top_edges[near[row, best]], fraction


def _steps(edges: Ints, goals: Ints, n: int, nearest: bool = False) -> Floats:
    """(g,n) the least number of edges (k,2) from each goal to each vertex, or (n,) from the nearest goal."""
    graph = coo_array((np.ones(len(edges)), edges.T), shape=(n, n)).tocsr()
    options: dict[str, Any] = {"directed": False, "unweighted": True, "min_only": nearest}
    return np.asarray(dijkstra(graph, indices=goals, **options))


def held_walls(surface: Surface, roof_edge: Bools, all_of_them: bool) -> list[tuple[int, Ints, Ints, Ints]]:
    """Walls with a held bottom that can pinch: patch, edges, top edges, and the foot (n,) of each top vertex.

    These have one top edge to either side of each junction vertex, or end on another plane that it slides on,
    as in a mirror, or where they meet other such walls; none unless a junction rests on one.
    """
    topo, X, rests = surface.topology, surface.vertices, all_of_them
    walls = list[tuple[int, Ints, Ints, Ints]]()
    bottom = topo.boundary_edge & surface.pinned[topo.edges].all(axis=1)
    meeting = np.zeros(surface.n, dtype=np.int64)  # the walls whose top edges have the vertex
    for index in np.flatnonzero(surface.auxiliary).tolist():
        of_wall = topo.edges_of(surface.patch_of_face == index)
        vertices = distinct(topo.edges[of_wall], surface.n)
        top = topo.edges[of_wall[roof_edge[of_wall]]]
        meeting[np.unique(top)] += 1
        if not bottom[of_wall].any() or surface.on_ground[vertices].any():
            continue
        if not len(top):
            continue
        foot = _held_feet(surface, top, topo.edges[of_wall[bottom[of_wall] & ~roof_edge[of_wall]]])
        if foot is None:
            continue
        free = np.unique(top)[~surface.pinned[np.unique(top)]]
        gap = np.linalg.norm(X[free] - X[foot[free]], axis=1)
        rests = rests or bool(lying(gap, X).any())
        walls.append((index, topo.edges[of_wall], top, foot))
    while rests and walls:
        fit = _fit_together(surface, walls, meeting)
        if all(fit):
            return walls
        walls = [wall for wall, good in zip(walls, fit, strict=True) if good]
    return []


def _fit_together(surface: Surface, walls: list[tuple[int, Ints, Ints, Ints]], meeting: Ints) -> list[bool]:
    """Which walls end or meet only on other planes, or at free vertices all of whose walls are here."""
    feet = np.stack([foot for *_, foot in walls])
    sides = np.stack([np.bincount(top.ravel(), minlength=surface.n) for _, _, top, _ in walls])
    together = (sides > 0).sum(axis=0)
    one_foot = (np.where(sides > 0, feet, feet.max(axis=0)) == feet.max(axis=0)).all(axis=0)
    alone = (sides == 2) & (together == 1)
    mirrors = [pair for pair in surface.on_planes if pair[0].mirror]  # whose other walls are not here
    joined = (together > 1) & (together == meeting) & one_foot & ~members(mirrors, surface.n)
    ends = (sides == 1) & (together == 1) & members(surface.on_planes, surface.n)
    good = alone | joined | ends | (sides == 0) | surface.pinned
    return [bool(row.all()) for row in good]


def _held_feet(surface: Surface, top_edges: Ints, bottom_edges: Ints) -> Ints | None:
    """(n,) the held bottom vertex below each top vertex of a wall, -1 elsewhere; None if they do not pair.

    As many steps along the top and along the bottom from each end of the wall make a pair. It ends where top
    and bottom meet, and in planes that one vertex of each lies in. Of one without such ends the nearest pair
    is taken: of the ends between which it hangs from other walls, or of the edges of a closed one.
    """
    n, tops, bottoms = surface.n, np.unique(top_edges), np.unique(bottom_edges)
    corners, count = np.intersect1d(tops, bottoms), len(tops)
    ends = [np.array([corners, corners])]
    for _, on_plane in surface.on_planes:
        pair = [edge[on_plane[edge]] for edge in (tops, bottoms)]
        if len(pair[0]) == len(pair[1]) == 1:
            ends.append(np.array(pair))
    if count != len(bottoms):
        return None
    if sum(map(np.size, ends)) == 0:
        loose = [np.flatnonzero(np.bincount(edges.ravel()) == 1) for edges in (top_edges, bottom_edges)]
        hangs = [*map(len, loose)] == [2, 2]
        above, below = map(np.atleast_2d, loose) if hangs else (top_edges, bottom_edges)
        ways, X = np.concatenate([below, below[:, ::-1]]), surface.vertices
        apart, way = map(np.asarray, cKDTree(X[ways].reshape(-1, 6)).query(X[above].reshape(-1, 6)))
        ends = [np.array([above[apart.argmin()], ways[way[apart.argmin()]]])]
    top_ends, bottom_ends = np.concatenate(ends, axis=1)
    if not len(top_ends):
        return None
    steps = [_steps(top_edges, top_ends, n)[:, tops].T, _steps(bottom_edges, bottom_ends, n)[:, bottoms].T]
    label = np.unique(np.concatenate(steps), axis=0, return_inverse=True)[1].reshape(2, -1)
    above, below = label.argsort(axis=1)
    if any((np.sort(labels) != np.arange(count)).any() for labels in label):
        return None
    foot = np.full(n, -1, dtype=np.int64)
    foot[tops[above]] = bottoms[below]
    return foot


@dataclass(frozen=True, eq=False)
class Walls:
    """The walls that can pinch: the lower edge slides on Π or is held there, the top edge is a junction."""

    rows: WallRows  # where their other vertices lie below the top edges
    top_edges: Ints  # (k,2)
    wall_below: Ints  # (k,) the patch of the wall below each of them
    top_free: Bools  # (n,) free vertices of top edges: these can come to rest on Π
    corner: Bools  # (n,) fixed vertices of top edges on Π or the bottom, where a wall ends
    side: Floats  # (n,) +1 or -1, the side of Π a vertex is on; on Π, the side the pressure pushes it to
    pinchable: Bools  # (patches,) the patches that are such walls
    foot: Ints  # (n,) for vertices of top edges the vertex below it on a held bottom; -1 elsewhere
    admissible: Admissible  # how the supports let each vertex move

    @property
    def held(self) -> Bools:
        """(n,) the junction vertices that come to rest on a held bottom."""
        return self.top_free & (self.foot >= 0)

    @property
    def meeting(self) -> Bools:
        """(n,) the vertices of more than two top edges: there walls meet."""
        return np.asarray(np.bincount(self.top_edges.ravel(), minlength=len(self.foot)) > 2)

    @property
    def sliding(self) -> Bools:
        """(patches,) the walls whose bottom slides on Π."""
        held = np.zeros_like(self.pinchable)
        held[self.wall_below[(self.foot[self.top_edges] >= 0).all(axis=1)]] = True
        return self.pinchable & ~held

    def rising(self, surface: Surface) -> Floats:
        """(n,3) the way up from Π, by 1, that the supports of each vertex leave it: along a leaning plane."""
        normal = np.array(surface.plane.normal)
        way = self.admissible.part(np.tile(normal, (len(self.foot), 1)))
        rise = (way @ normal)[:, None]
        return np.divide(way, rise, out=way, where=rise > 0.0)

    @cached_property
    def _over_bottom(self) -> tuple[Ints, Ints]:
        """The vertices (k,) between two top edges over a held bottom, and the other ends (k,2) of these."""
        edges = self.top_edges[(self.foot[self.top_edges] >= 0).all(axis=1)]
        return curve_neighbours(np.concatenate([edges, edges[:, ::-1]]), len(self.foot))

    def across_bottom(self, vectors: Floats, X: Floats) -> Floats:
        """The part (n,3) of vectors across the held bottom below each top vertex, as its supports allow it.

        At an end of a bottom, and where walls meet, they alone say which part; X and vectors are (n,3)."""
        vertices, beside = self._over_bottom
        sides = X[self.foot[beside]] - X[self.foot[vertices]][:, None]
        one, other = np.moveaxis(sides / np.linalg.norm(sides, axis=2)[..., None], 1, 0)
        # the two may run either way: along the bottom they are alike
        chord = one + np.where(np.einsum("ij,ij->i", one, other) < 0.0, -1.0, 1.0)[:, None] * other
        length = np.linalg.norm(chord, axis=1)[:, None]
        tangent = np.divide(chord, length, out=np.zeros_like(chord), where=length > 0.0)
        across = vectors.copy()
        across[vertices] -= np.einsum("ij,ij->i", tangent, across[vertices])[:, None] * tangent
        return self.admissible.part(across)


def find_walls(surface: Surface, held: bool = False) -> Walls:
    """The walls of a surface that can pinch, and their rows.

    With ``held``, or where a junction already rests on one, walls with held bottoms are among them.
    """
    n, topo, X = surface.n, surface.topology, surface.vertices
    roof = ~surface.auxiliary[surface.patch_of_face]
    roof_edge = mask_of(topo.edge_of_face[roof], len(topo.edges))
    roof_vertex = mask_of(surface.faces[roof], n)
    height = surface.plane.height(X)
    low, foot = lying(height, X), np.full(n, -1, dtype=np.int64)
    every = list[tuple[int, Ints, Ints, Ints | None]]()
    for index in np.flatnonzero(surface.auxiliary).tolist():
        of_wall = topo.edges_of(surface.patch_of_face == index)
        edges, top = topo.edges[of_wall], topo.edges[of_wall[roof_edge[of_wall]]]
        top = top[~surface.on_ground[top].all(axis=1)]  # what slides on Π has no height to lose
        if surface.on_ground[edges].any() and len(top):
            every.append((index, edges, top, None))
    none = np.empty((0, 2), dtype=np.int64)
    sliding = np.concatenate([none, *(top for _, _, top, _ in every)])
    for index, edges, top, feet in held_walls(surface, roof_edge, held):
        if not np.isin(top, sliding).any():
            foot = np.where(feet >= 0, feet, foot)
            every.append((index, edges, top, feet))
    if every:
        expect_no_images(surface, "a wall that slides on the plane, or comes down to its held bottom")
    parts = [WallRows(none[:, 0], none, np.empty(0), np.empty(0), np.empty((0, 3)), none)]
    parts += [wall_rows(surface, roof_vertex, top, edges, feet) for _, edges, top, feet in every]
    columns = [np.concatenate([getattr(part, column.name) for part in parts]) for column in fields(WallRows)]
    first = np.unique(columns[0], return_index=True)[1]  # what two walls share belongs to the first
    top_edges = np.concatenate([none, *(top for _, _, top, _ in every)])
    below = np.concatenate([none[:, 0], *(np.full(len(top), index) for index, _, top, _ in every)])
    on_top, pinchable = mask_of(top_edges, n), mask_of(below, len(surface.patches))
    # on Π the side is that of the push of the sheets' pressure along its normal
    near = low[surface.faces].any(axis=1)
    F, patch = surface.faces[near], surface.patch_of_face[near]
    force = (surface.net_pressures * ~surface.auxiliary)[patch] / 3.0
    push = vertex_sums((force * (area_vectors(X[F]) @ np.array(surface.plane.normal)))[:, None], F, n)[:, 0]
    return Walls(
        rows=WallRows(*(values[first] for values in columns)),
        top_edges=top_edges,
        wall_below=below,
        top_free=on_top & ~surface.pinned & ~surface.on_ground,
        corner=on_top & surface.pinned & (low | (foot == np.arange(n))),
        side=np.where(np.where(low, push, height) < 0.0, -1.0, 1.0),
        pinchable=pinchable,
        foot=foot,
        admissible=surface.admissible,
    )
