"""Walls: auxiliary patches from the borders between patches down to Π."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, Ints
from ..base.errors import OptionError, SurfaceError, unknown
from ..base.tolerances import ON
from ..surface import HeldCurve, Patch, Plane, Surface
from ..surface.curves import polyline
from ..surface.geometry import bounding_size, in_edges, lengths_along
from ..surface.pieces import to_space
from ..surface.topology import EdgeCurve
from .planar import triangulate
from .quality import edge_lengths

BOTTOMS = ("sliding", "held")
EDGES = ("fixed", "sliding", "free", "cable")


@dataclass(frozen=True, eq=False)
class UpperEdge:
    """The upper edge of a wall."""

    vertices: Ints  # (k,) along it, first = last if it is closed
    label: int  # of the wall's faces
    held: bool = False  # whether its bottom is held, or else slides on Π


@dataclass(frozen=True, eq=False)
class WallMesh:
    """Walls to append to a mesh."""

    vertices: Floats  # the new ones
    faces: Ints
    label: Ints  # of each face
    fixed: Bools  # supports of the new vertices
    sliding: Bools
    feet: Mapping[tuple[int, int], Ints]  # by an upper edge's first two vertices, those along its held bottom
    uprights: tuple[HeldCurve, ...]  # the vertical lines that are held, below fixed vertices


def add_walls(
    surface: Surface,
    tension: float | Mapping[tuple[str, str], float] = 1.0,
    bottom: str = "held",
    edge_length: float | None = None,
) -> Surface:
    """Add a wall, down to Π, under every border between two patches that has none.

    Walls share a vertical line where borders meet. The wall under the border of "a" and "b" is the
    patch "wall-a-b"; its normals point from a to b, and its pressure is that of a less that of b.

    Parameters
    ----------
    tension : of all walls, force/length; or a mapping from pairs of patch names, for those borders
        only.
    bottom : "held" on Π in all directions, or "sliding" there.
    edge_length : of the walls' triangles; by default the mean length of the borders' edges.

    Raises
    ------
    OptionError : a pair of patches without a border, or an unknown ``bottom``.
    SurfaceError : a border is not above Π, so that there is no room for a wall.

    >>> from pcmc.plan import Divider, Plan
    >>> seam = Divider([[2, 0], [2, 2]], wall=None)
    >>> rectangle = [[0, 0], [4, 0], [4, 2], [0, 2]]
    >>> bare = Plan(rectangle, [seam], edge_length=0.5, tension=2.0).surface()
    >>> [p.name for p in add_walls(bare).patches]
    ['patch 1', 'patch 2', 'wall-patch 1-patch 2']
    """
    validate.choice("bottom", bottom, BOTTOMS)
    names = [p.name for p in surface.patches]
    borders = [c for c in surface.topology.junctions if len(set(c.sheets)) == len(c.sheets) == 2]
    pairs = {(names[a], names[b]) for a, b in (c.sheets for c in borders)}
    given = tension if isinstance(tension, Mapping) else dict.fromkeys(pairs, tension)
    chosen = dict[tuple[str, str], float]()
    for (a, b), value in given.items():
        pair = (a, b) if (a, b) in pairs else (b, a)
        if pair not in pairs:
            known = [f"{p}-{q}" for p, q in sorted(pairs)]
            raise OptionError(unknown("border", f"{a}-{b}", known), what="tension", where=(a, b))
        chosen[pair] = float(value)
    walled = [c for c in borders if (names[c.sheets[0]], names[c.sheets[1]]) in chosen]
    if not walled:
        return surface
    label, patches = _labels(surface, walled, chosen)
    tops = list[UpperEdge]()
    for border, number in zip(walled, label, strict=True):  # with its first patch on the left
        chain = np.append(border.vertices, border.vertices[:1]) if border.closed else border.vertices
        own = surface.faces[surface.patch_of_face == border.sheets[0]]
        along = (own == chain[0]) & (own[:, [1, 2, 0]] == chain[1])
        tops.append(UpperEdge(chain if along.any() else chain[::-1], number, bottom == "held"))
    if edge_length is None:
        edge_length = float(edge_lengths(surface)[surface.topology.seam_edge].mean())
    walls = build_walls(surface.vertices, tops, edge_length, surface.plane, surface.pinned)
    columns = np.zeros((len(walls.vertices), surface.support_columns.shape[1]), dtype=bool)
    columns[:, 0], columns[:, 1] = walls.fixed, walls.sliding
    return surface.with_mesh(
        np.concatenate([surface.support_columns, columns]),
        vertices=np.concatenate([surface.vertices, walls.vertices]),
        faces=np.concatenate([surface.faces, walls.faces]),
        patch_of_face=np.concatenate([surface.patch_of_face, walls.label + len(names)]),
        patches=(*surface.patches, *patches),
        curves=(*surface.held_curves, *walls.uprights),
    )


def build_walls(
    vertices: Floats,
    tops: Sequence[UpperEdge],
    edge_length: float,
    plane: Plane,
    fixed: Bools,
    floor: Floats | None = None,
) -> WallMesh:
    """The walls under the given upper edges.

    A wall is developed into the plane (length along its foot, height), meshed there without moving
    its upper edge, and placed upright again. Its ends are vertical lines, shared by all walls that end
    there; an end on the floor is a single vertex. A line under a fixed vertex is fixed; other lines
    are free above their foot.

    Parameters
    ----------
    vertices : (n,3) of the mesh, in space.
    fixed : (n,) bool, its fixed vertices.
    floor : (n,) the height above Π of the wall's bottom below each vertex; 0 by default.

    Raises
    ------
    SurfaceError : an upper edge is not above the floor.
    """
    builder, n = _Builder(vertices, plane, edge_length, fixed, floor), len(vertices)
    for top in tops:
        builder.add_wall(top)
    new = np.array(builder.points[n:]).reshape(-1, 3)
    held, sliding = (np.isin(np.arange(len(new)) + n, list(ids)) for ids in (builder.held, builder.sliding))
    faces, label = np.concatenate(builder.faces), np.concatenate(builder.labels)
    everywhere = np.concatenate([vertices, to_space(new, plane)])
    lines = [line for vertex, line in builder.lines.items() if fixed[vertex] and len(line) > 1]
    uprights = [HeldCurve(polyline(everywhere[v]), np.array(v), np.arange(float(len(v)))) for v in lines]
    return WallMesh(everywhere[n:], faces, label, held, sliding & ~held, builder.feet, tuple(uprights))


class _Builder:
    """The walls built so far, in the coordinates of Π; new vertices are numbered after the mesh's own."""

    def __init__(
        self, vertices: Floats, plane: Plane, edge_length: float, fixed: Bools, floor: Floats | None
    ) -> None:
        self.local = plane.to_local(vertices)
        self.tolerance = ON * bounding_size(vertices)
        self.edge_length, self.fixed = edge_length, fixed
        self.floor = np.zeros(len(vertices)) if floor is None else floor
        self.points = list(self.local)
        self.faces: list[Ints] = [np.zeros((0, 3), dtype=np.int64)]
        self.labels: list[Ints] = [np.zeros(0, dtype=np.int64)]
        self.held: set[int] = set()
        self.sliding: set[int] = set()
        self.lines: dict[int, list[int]] = {}
        self.feet: dict[tuple[int, int], Ints] = {}

    def add_points(self, points: Sequence[Floats] | Floats) -> list[int]:
        """The numbers of new points."""
        self.points += list(points)
        return list(range(len(self.points) - len(points), len(self.points)))

    def check(self, top: UpperEdge) -> None:
        height = self.local[top.vertices, 2] - self.floor[top.vertices]
        low = height <= self.tolerance
        low[[0, -1]] &= low.all() | (height[[0, -1]] < -self.tolerance)
        if low.any():
            first = int(np.argmax(low))
            vertex, found = int(top.vertices[first]), float(height[first])
            text = f"no room for a wall under vertex {vertex}, {found:.3g} above the wall's bottom,"
            text += f" at {self.local[vertex].round(6).tolist()} ({low.sum()} such vertices);"
            text += " raise it, or use shorter edges if both ends of the wall are held"
            raise SurfaceError(text, what="vertices", where=vertex, found=found)

    def line(self, vertex: int, supported: set[int]) -> list[int]:
        """Vertices of the vertical line under a vertex, from the foot up to the vertex itself."""
        if vertex not in self.lines:
            (x, y, top), bottom = self.local[vertex], self.floor[vertex]
            height = top - bottom
            rows = 0 if height <= self.tolerance else max(1, int(np.rint(in_edges(height, self.edge_length))))
            new = [np.array([x, y, bottom + height * k / rows]) for k in range(rows)]
            self.lines[vertex] = [*self.add_points(new), vertex]
            if self.fixed[vertex]:
                self.held.update(self.lines[vertex][:-1])
        ids = self.lines[vertex]
        supported.update(ids[:-1][:1])
        return ids

    def add_wall(self, top: UpperEdge) -> None:
        self.check(top)
        chain, supported = top.vertices, self.held if top.held else self.sliding
        along = lengths_along(self.local[chain, :2])
        left, right = self.line(int(chain[0]), supported), self.line(int(chain[-1]), supported)
        middle = chain[1:-1]
        foot = self.add_points(np.column_stack([self.local[middle, :2], self.floor[middle]]))
        supported.update(foot)
        if top.held and not self.floor[chain].any():
            self.feet[int(chain[0]), int(chain[1])] = np.array([left[0], *foot, right[0]])
        # counter-clockwise from the left foot; a line without rows is the chain's end itself
        start, end = left[:-1], right[:-1]
        ids = np.array([*start[:1], *foot, *end, *chain[::-1], *start[:0:-1]], dtype=np.int64)
        ends = [0.0] * len(start[:1]), [along[-1]] * len(end), [0.0] * len(start[1:])
        s = [*ends[0], *along[1:-1], *ends[1], *along[::-1], *ends[2]]
        outline, ring = np.stack([s, [self.points[i][2] for i in ids]], axis=1), np.arange(len(ids))
        mesh = triangulate(outline, np.stack([ring, np.roll(ring, -1)], axis=1), self.edge_length)
        s, height = mesh.points[len(ids) :].T
        x, y = (np.interp(s, along, self.local[chain, k]) for k in (0, 1))
        number = np.array([*ids, *self.add_points(np.column_stack([x, y, height]))])
        self.faces.append(number[mesh.triangles])
        self.labels.append(np.full(len(mesh.triangles), top.label))


def _labels(
    surface: Surface, borders: Sequence[EdgeCurve], tension: Mapping[tuple[str, str], float]
) -> tuple[list[int], list[Patch]]:
    """A label for each border, and the labels' patches: one for each pair of patches. Where a pair's borders
    cross, as of four quarters, each is a patch of its own: a patch must not have four faces at an edge."""
    kinds = []
    for place, border in enumerate(borders):
        ends = [c.vertices[[0, -1]] for c in borders if c.sheets == border.sheets and not c.closed]
        crossing = bool(ends) and np.bincount(np.concatenate(ends)).max() > 2
        kinds.append((border.sheets, place if crossing else -1))
    names = list(dict.fromkeys(kinds))
    patches = []
    for sheets, number in names:
        a, b = (surface.patches[k] for k in sheets)
        alike = [n for s, n in names if s == sheets]
        suffix = "" if number < 0 else f"-{alike.index(number) + 1}"
        value = tension[a.name, b.name]
        pressure, snow = a.pressure - b.pressure, a.snow - b.snow
        patches.append(Patch(f"wall-{a.name}-{b.name}{suffix}", value, pressure, wall=True, snow=snow))
    return [names.index(kind) for kind in kinds], patches
