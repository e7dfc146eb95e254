"""Supports: what lets a vertex move in no, one, two or all directions, from points, curves and planes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, Ints, cached_array, mask_of, read_only
from ..base.compiled import compiled
from ..base.errors import SurfaceError
from ..base.tolerances import ON, PARALLEL, RESTING_ROUNDED, SAME_PLACE
from . import checks
from .geometry import accumulate, bounding_size, dot, point, scaled
from .guides import Circle, Guide, Line, Plane
from .topology import Topology

Support = TypeVar("Support", bound=Plane | Guide)


class Supports(NamedTuple):
    """The supports as they were given, before vertices on several planes became those of lines and points."""

    fixed: Bools  # (n,)
    on_plane: Bools  # (n,) also of vertices that are fixed
    on_line: tuple[tuple[Guide, Bools], ...]  # as in Surface, without the common lines of two planes

    @property
    def guided(self) -> Bools:
        """(n,) vertices that slide along a line or circle."""
        return members(self.on_line, len(self.fixed))

    def fixed_and_sliding(self) -> tuple[Bools, Bools]:
        """(n,) masks of vertices that are fixed or slide along a line, and of the others that slide on Π."""
        fixed = self.fixed | self.guided
        return fixed, self.on_plane & ~fixed

    def frozen(self) -> Supports:
        """The same with arrays that cannot be written to."""
        lines = tuple((line, read_only(along)) for line, along in self.on_line)
        return Supports(read_only(self.fixed), read_only(self.on_plane), lines)

    def resolved(self, plane: Plane, on_planes: Sequence[tuple[Plane, Bools]]) -> dict[str, Any]:
        """``fixed``, ``on_plane`` and ``on_line`` of a Surface with Π and these other planes.

        Vertices on two planes slide along their common line; those on three that meet in a point cannot
        move. A vertex that slides along a given line keeps it where it lies in all of the vertex' planes, and
        cannot move otherwise.
        """
        lines, fixed = list(self.on_line), self.fixed.copy()
        if on_planes:
            planes = [(plane, self.on_plane), *on_planes]
            for number, (guide, along) in enumerate(lines):
                crossing = [mask for other, mask in planes if not guide.lies_in(other)]
                leaves = along & np.any([np.zeros_like(along), *crossing], axis=0)
                fixed |= leaves
                lines[number] = guide, along & ~leaves
            several = (np.sum([mask for _, mask in planes], axis=0) > 1) & ~self.fixed & ~self.guided
            for meeting, rows in by_planes(planes, several):
                rank, line = _common_line(meeting, int(rows[0]))
                along = mask_of(rows, len(fixed))
                if rank == 3:
                    fixed |= along
                elif rank == 2:  # not one plane given several times
                    lines.append((line, along))
        fixed |= members(lines, len(fixed))
        on_line = tuple((guide, read_only(along)) for guide, along in lines)
        return {"fixed": read_only(fixed), "on_plane": read_only(self.on_plane & ~fixed), "on_line": on_line}


def members(pairs: Iterable[tuple[object, Bools]], n: int) -> Bools:
    """(n,) the vertices of any of the supports."""
    return np.asarray(np.any([np.zeros(n, dtype=bool), *(mask for _, mask in pairs)], axis=0))


class Admissible(NamedTuple):
    """The directions in which the supports let each vertex move."""

    freedom: Ints  # (n,) how many: 0 fixed, 1 along a line or circle, 2 on a plane, 3 free
    axis: Floats  # (n,3) the unit tangent of the line or circle, or the plane's unit normal; else zero

    @classmethod
    def of(cls, fixed: Bools, planes: Iterable[Any], lines: Iterable[Any], X: Floats) -> Admissible:
        """That of vertices at X (n,3) on ``planes`` and ``lines``, each with its (n,) mask."""
        freedom, axis = np.where(fixed, np.int8(0), np.int8(3)), np.zeros(X.shape)
        for plane, mask in planes:
            freedom[mask], axis[mask] = 2, plane.normal
        for guide, mask in lines:
            freedom[mask], axis[mask] = 1, guide.directions(X[mask])
        return cls(read_only(freedom), read_only(axis))

    def part(self, vectors: Floats) -> Floats:
        """The part of vectors (n,3) in these directions, in place."""
        project(self, vectors)
        return vectors

    def projectors(self, vertices: Ints) -> Floats:
        """(k,3,3) the matrices that leave of a vector the part in these directions, of vertices (k,)."""
        freedom, axis = self.freedom[vertices, None, None], self.axis[vertices]
        along = axis[:, :, None] * axis[:, None, :]
        return np.where(freedom == 1, along, np.where(freedom > 1, np.eye(3) - along, 0.0))


class Supported:
    """A surface as its supports see it: which vertices they hold, and how these may move."""

    vertices: Floats
    fixed: Bools
    on_plane: Bools
    plane: Plane
    on_line: tuple[tuple[Guide, Bools], ...]
    on_planes: tuple[tuple[Plane, Bools], ...]
    given_supports: Supports
    images: Ints

    @cached_property
    def meeting_lines(self) -> tuple[tuple[Guide, Bools], ...]:
        """The lines of ``on_line`` that were not given: there two planes meet."""
        return self.on_line[len(self.given_supports.on_line) :]

    @cached_array
    def pinned(self) -> Bools:
        """(n,) vertices that cannot move, or only along a line that was given.

        These are the ``fixed`` ones but for those that slide along the line where two planes meet.
        """
        return self.fixed & ~members(self.meeting_lines, len(self.fixed))

    @cached_array
    def on_ground(self) -> Bools:
        """(n,) vertices that slide on Π, also those on another plane, which slide along the common line."""
        return self.on_plane | (members(self.meeting_lines, len(self.fixed)) & self.given_supports.on_plane)

    @cached_property
    def sliding(self) -> tuple[tuple[Plane, Bools], ...]:
        """The planes that vertices slide on, Π first, each with the (n,) mask of those on it alone."""
        others = ((plane, read_only(mask & ~self.fixed)) for plane, mask in self.on_planes)
        return tuple((p, mask) for p, mask in ((self.plane, self.on_plane), *others) if mask.any())

    @cached_array
    def held(self) -> Bools:
        """(n,) vertices that some support holds: fixed, or sliding on a plane, line or circle."""
        return self.fixed | self.on_plane | members(self.on_planes, len(self.fixed))

    @cached_array
    def supported(self) -> Bools:
        """(n,) the same without those that mirror planes alone hold, where the surface only goes on."""
        planes = [pair for pair in self.on_planes if not pair[0].mirror]
        return self.pinned | self.on_ground | members(planes, len(self.fixed))

    @property
    def free(self) -> Bools:
        """(n,) vertices that no support holds at all."""
        return ~self.held

    @property
    def on_circle(self) -> tuple[tuple[Circle, Bools], ...]:
        """The part of ``on_line`` that is round."""
        return tuple((line, along) for line, along in self.on_line if isinstance(line, Circle))

    @cached_property
    def admissible(self) -> Admissible:
        """The directions in which the supports let each vertex move, where it is now."""
        held = self.fixed.copy()
        held[self.images[:, 0]] = True  # an image moves with its vertex, which has the motions of both
        return Admissible.of(held, self.sliding, self.on_line, self.vertices)

    def admissible_at(self, X: Floats) -> Admissible:
        """The same with the vertices at X (n,3): only along circles do the directions change."""
        return Admissible.of(self.fixed, self.sliding, self.on_line, X) if self.on_circle else self.admissible

    @cached_array
    def support_columns(self) -> Bools:
        """(n,c) whether a vertex is fixed, slides on Π, on each of ``on_planes``, along each given line."""
        given, others = self.given_supports, (*self.on_planes, *self.given_supports.on_line)
        return np.stack([*given.fixed_and_sliding(), *(mask for _, mask in others)], axis=1)

    def onto_supports(self, X: Floats) -> Floats:
        """X (n,3) with fixed vertices where they are, and sliding ones put on their plane, line or circle.

        >>> from pcmc import Patch, Surface
        >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        >>> flat = Surface(corners, [[0, 1, 2]], [0], [Patch("roof", 2.0)], fixed=[0], on_plane=[1])
        >>> flat.onto_supports(flat.vertices + 1.0).tolist()
        [[0.0, 0.0, 0.0], [2.0, 1.0, 0.0], [1.0, 2.0, 1.0]]
        """
        put = np.where(self.fixed[:, None], self.vertices, X)
        for support, sliding in (*self.on_line, *self.sliding):
            put[sliding] = support.nearest(X[sliding])
        return put


def apply_supports(surface: Any, vectors: Floats, X: Floats | None = None) -> Floats:
    """Leave of vectors (n,3) what the supports of a Surface allow, in place.

    Nothing at fixed vertices, the part along the line or circle at those that slide along one, and the part
    along their plane at those that slide there, Eq. (19); at X (n,3) or where the surface has its vertices.
    """
    admissible: Admissible = surface.admissible_at(surface.vertices if X is None else X)
    return admissible.part(vectors)


@compiled
def project(admissible: Admissible, vectors: Floats) -> float:
    """Leave of vectors (n,3) the part in the admissible directions, in place; its squared sum."""
    squared = 0.0
    for v in range(len(vectors)):
        freedom, axis = admissible.freedom[v], point(admissible.axis, v)
        if freedom == 2:
            accumulate(vectors, v, scaled(-dot(point(vectors, v), axis), axis))
        elif freedom < 2:
            along = dot(point(vectors, v), axis) if freedom == 1 else 0.0
            vectors[v, 0], vectors[v, 1], vectors[v, 2] = scaled(along, axis)
        squared += dot(point(vectors, v), point(vectors, v))
    return squared


def onto_circles(surface: Any, X: Floats) -> Floats:
    """X (n,3) with the vertices that slide along a circle put back on it; X itself without any."""
    if surface.on_circle:
        X = X.copy()
    for circle, along in surface.on_circle:
        X[along] = circle.nearest(X[along])
    return X


def guide_masks(what: str, given: Any, n: int, kind: Any, expected: str) -> tuple[tuple[Support, Bools], ...]:
    """The supports of a mapping or of pairs, each with the (n,) mask of its vertices."""
    pairs = given.items() if isinstance(given, Mapping) else given
    if not isinstance(pairs, Iterable):
        validate.refuse(what, given, expected, error=SurfaceError)
    masks = []
    for pair in pairs:
        if not (isinstance(pair, Sequence) and len(pair) == 2 and isinstance(pair[0], kind)):
            validate.refuse(what, given, expected, error=SurfaceError)
        masks.append((pair[0], checks.mask(pair[1], n, what)))
    return tuple(masks)


def checked_lines(given: Any, X: Floats) -> tuple[tuple[Guide, Bools], ...]:
    """The lines and circles that vertices X (n,3) slide along, each with their mask; no vertex on two."""
    expected = "a mapping from Lines or Circles to vertices"
    lines: tuple[tuple[Guide, Bools], ...] = guide_masks("on_line", given, len(X), Guide, expected)
    double = np.sum([np.zeros(len(X), dtype=int), *(along for _, along in lines)], axis=0) > 1
    checks.refuse_rows("vertices", X, double, "slides along two lines", "hold it with fixed= instead")
    check_on(lines, X, bounding_size(X))
    return lines


def check_on(guides: Iterable[tuple[Plane | Guide, Bools]], X: Floats, size: float) -> None:
    """Vertices (n,3) must lie on their plane, line or circle to 1e-9 of the size, or to rounding.

    The first plane is Π.
    """
    near = max(ON * size, RESTING_ROUNDED * float(np.abs(X).max(initial=0.0)))
    for number, (guide, mask) in enumerate(guides):
        away = guide.distance(X)
        bad = mask & (np.abs(away) > near)
        kind = type(guide).__name__.lower()
        if isinstance(guide, Plane):
            place = f"on the {guide if number else kind}"
        else:
            where = f"around {guide.centre}" if isinstance(guide, Circle) else f"through {guide.point}"
            place = f"along the {kind} {where}"
        fault = f"slides {place}, but is {away[bad.argmax()]:.3g} away from it"
        checks.refuse_rows("vertices", X, bad, fault, f"move it onto the {kind} or hold it with fixed=")


def checked_planes(
    given: Any, X: Floats, F: Ints, patch: Ints, names: Sequence[str], topo: Topology, fixed: Bools
) -> tuple[tuple[Plane, Bools], ...]:
    """The planes besides Π, each with the (n,) mask of the vertices that are given, or belong to it, too.

    These are fixed vertices of the boundary on the plane and, of a mirror plane, all those of the boundary.
    A mirror plane that the surface crosses, or that one of its triangles lies in, is refused.
    """
    near, planes = ON * bounding_size(X), list[tuple[Plane, Bools]]()
    expected = "a mapping from Planes to vertices"
    pairs: tuple[tuple[Plane, Bools], ...] = guide_masks("on_planes", given, len(X), Plane, expected)
    for plane, mask in pairs:
        height = plane.height(X)
        there = topo.on_boundary & (np.abs(height) <= max(near, 1e-309))
        mask |= there if plane.mirror else there & fixed
        planes.append((plane, read_only(mask)))
        if not plane.mirror:
            continue
        sides = before, behind = int((height > near).sum()), int((height < -near).sum())
        if before and behind:
            text = f"the surface crosses the {plane}: {before} vertices are in front of it"
            text += f" and {behind} behind; keep one half, as pcmc.cut(surface, plane) gives it,"
            text += " or leave the mirror plane out"
            raise SurfaceError(text, what="on_planes", where=str(plane), found=sides)
        refuse_in_mirror(plane, mask, F, patch, names)
    return tuple(planes)


def refuse_in_mirror(plane: Plane, mask: Bools, F: Ints, patch: Ints, names: Sequence[str]) -> None:
    """Refuse a triangle with all its vertices in a mirror plane, given by their mask (n,)."""
    flat = np.flatnonzero(mask[F].all(axis=1))
    if len(flat):
        name = names[patch[flat[0]]]
        text = f"patch {name!r} lies in the {plane} (triangle {flat[0]}), so it is its own mirror image;"
        text += " use a mirror plane that it does not lie in, or model the whole"
        raise SurfaceError(text, what="on_planes", where=name, found=int(flat[0]))


def mirror_edges(planes: Sequence[tuple[Plane, Bools]], topo: Topology) -> Bools:
    """(e,) edges of one triangle that lie in a mirror plane."""
    inside = [mask[topo.edges].all(axis=1) for plane, mask in planes if plane.mirror]
    return topo.boundary_edge & np.any([np.zeros(len(topo.edges), dtype=bool), *inside], axis=0)


def part_of_roof(surface: Any) -> str:
    """What a surface is of its roof, in words, with the cables that its mirror planes cut along; empty for a
    whole roof."""
    if not any(plane.mirror for plane, _ in surface.on_planes):
        return ""
    inside, number = surface.mirror_edge, surface.topology.edge_numbers
    cut = ", ".join(repr(cable.name) for cable in surface.cables if inside[number(cable.edges)].all())
    half = f" and has half of the force of {cut}" if cut else ""
    return f"part of a roof that goes on behind its mirror planes{half}"


def symmetric_part(planes: Sequence[tuple[Plane, Bools]], vectors: Floats) -> Floats:
    """Leave of vectors (n,3) at vertices in mirror planes the part along all of these, in place.

    Of the whole surface the sum over the images of a vector is this part, times their number.
    """
    mirrors = [(plane, mask) for plane, mask in planes if plane.mirror]
    for inside, rows in by_planes(mirrors, members(mirrors, len(vectors))):
        _, sizes, directions = np.linalg.svd([plane.normal for plane in inside], full_matrices=False)
        across = directions[sizes > PARALLEL]
        vectors[rows] -= vectors[rows] @ across.T @ across
    return vectors


def uncancelled_pressures(topo: Topology, pressure: Floats, masks: Sequence[Bools]) -> Floats:
    """(e,) the sum of the pressures at each edge that is not held, force/area.

    A triangle's pressure (m,) counts with the sense in which the triangle runs along the edge. An edge is
    held if one of the (n,) ``masks`` has both its ends. Where all sums are zero, no force depends on the
    point that volumes are seen from.
    """
    left = np.bincount(topo.edge_of_face.ravel(), (pressure[:, None] * topo.sense).ravel(), len(topo.edges))
    held = np.any([mask[topo.edges].all(axis=1) for mask in masks], axis=0)
    rounding = 1e-12 * np.abs(pressure).max(initial=0.0)
    return np.where(held | (np.abs(left) <= rounding), 0.0, left)


def common_point(point: Floats, planes: Sequence[Plane]) -> Floats:
    """(3,) the point nearest to ``point`` that lies on the first plane and on as many more as possible, those
    that are near before others, in whichever order they are given.

    >>> wall = Plane((2, 0, 0), (1, 0, 0))
    >>> common_point(np.zeros(3), [Plane(), wall, Plane((5, 0, 0), (1, 0, 0))]).tolist()
    [2.0, 0.0, 0.0]
    """
    chosen, off = list[Plane](), {plane: abs(float(plane.height(point))) for plane in planes}
    near = {plane: (round(by / (1.0 + max(off.values())), 9), plane.normal) for plane, by in off.items()}
    for plane in [*planes[:1], *sorted(planes[1:], key=lambda p: (*near[p], p.point))]:
        normals = np.array([p.normal for p in (*chosen, plane)])
        away = -np.array([float(p.height(point)) for p in (*chosen, plane)])
        move = np.linalg.lstsq(normals, away, rcond=PARALLEL)[0]
        if np.abs(normals @ move - away).max() <= SAME_PLACE * (1.0 + np.abs(away).max()):
            chosen.append(plane)
            point = point + move
    return point


def by_planes(planes: Sequence[tuple[Plane, Bools]], chosen: Bools) -> Iterator[tuple[list[Plane], Ints]]:
    """The chosen vertices (n,) by the planes that they lie on: these, and the vertices' numbers."""
    rows = np.flatnonzero(chosen)
    if not len(rows):
        return
    on = np.array([mask[rows] for _, mask in planes])
    for pattern in np.unique(on, axis=1).T:
        used = [plane for (plane, _), there in zip(planes, pattern, strict=True) if there]
        yield used, rows[(on == pattern[:, None]).all(axis=0)]


def _common_line(planes: Sequence[Plane], vertex: int) -> tuple[int, Line]:
    """The rank of the planes' normals, and the line along all planes, of use where that is 2.

    Its point is the one of all planes that is nearest to the origin, in the least squares.
    """
    normals = np.array([plane.normal for plane in planes])
    _, sizes, directions = np.linalg.svd(normals)
    offsets = [np.dot(plane.normal, plane.point) for plane in planes]
    point = np.linalg.lstsq(normals, offsets, rcond=PARALLEL)[0]
    scale = 1.0 + float(np.abs([plane.point for plane in planes]).max())
    if max(abs(float(plane.height(point))) for plane in planes) > PARALLEL * scale:
        names = ", ".join(map(str, planes))
        message = f"on_planes: vertex {vertex} slides on planes that do not meet: {names}; remove it from one"
        raise SurfaceError(message, what="on_planes", where=vertex, found=names)
    line = Line(tuple(point.tolist()), tuple(directions[2].tolist()))
    return int((sizes > PARALLEL).sum()), line
