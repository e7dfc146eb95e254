"""What vertices may do that slide on several planes, or on planes and lines: the common directions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, Ints, read_only
from ..base.errors import SurfaceError
from ..curves.plane import Plane
from . import checks
from .circle import Circle, Guide
from .line import Line
from .topology import Topology

FLAT = 1e-9  # sine of an angle up to which two directions count as parallel
NEAR = 1e-9  # of the size: a vertex this near to a plane lies on it


class Supports(NamedTuple):
    """The supports as they were given, before vertices on several planes became those of lines and points.

    Attributes
    ----------
    fixed, on_plane : (n,) masks, on_plane also of vertices that are fixed.
    on_line : as in Surface, without the lines that two planes have in common.
    """

    fixed: Bools
    on_plane: Bools
    on_line: tuple[tuple[Guide, Bools], ...]

    def fixed_and_sliding(self) -> tuple[Bools, Bools]:
        """(n,) masks of vertices that are fixed or slide along a line, and of the others that slide on Π."""
        fixed = np.any([self.fixed, *(along for _, along in self.on_line)], axis=0)
        return fixed, self.on_plane & ~fixed

    @property
    def stays(self) -> Bools:
        """(n,) vertices that are fixed, and on no line."""
        return self.fixed & ~np.any(
            [np.zeros_like(self.fixed), *(along for _, along in self.on_line)], axis=0
        )

    def frozen(self) -> Supports:
        """The same with arrays that cannot be written to."""
        lines = tuple((line, read_only(along)) for line, along in self.on_line)
        return Supports(read_only(self.fixed), read_only(self.on_plane), lines)

    @property
    def bound(self) -> Bools:
        """(n,) vertices that are fixed, on Π, or on a line."""
        held = self.fixed | self.on_plane
        for _, along in self.on_line:
            held = held | along
        return held


def plane_masks(given: Any, n: int) -> tuple[tuple[Plane, Bools], ...]:
    """The planes besides Π, each with the (n,) mask of its vertices."""
    pairs = given.items() if isinstance(given, Mapping) else given
    expected = "a mapping from Planes to vertices"
    if not isinstance(pairs, Iterable):
        validate.refuse("on_planes", given, expected, error=SurfaceError)
    masks = []
    for pair in pairs:
        if not (isinstance(pair, Sequence) and len(pair) == 2 and isinstance(pair[0], Plane)):
            validate.refuse("on_planes", given, expected, error=SurfaceError)
        masks.append((pair[0], checks.mask(pair[1], n, "on_planes")))
    return tuple(masks)


def completed(
    planes: Sequence[tuple[Plane, Bools]], X: Floats, at_end: Bools, fixed: Bools
) -> tuple[tuple[Plane, Bools], ...]:
    """The planes with the vertices that lie on them, and belong to them, although not given.

    These are fixed vertices of the boundary (``at_end``) and, of a mirror plane, all those of the boundary.
    """
    near = NEAR * max(checks.bounding_size(X), 1e-300)
    parts = []
    for plane, mask in planes:
        there = at_end & (np.abs(plane.height(X)) <= near)
        parts.append((plane, mask | (there if plane.mirror else there & fixed)))
    return tuple(parts)


def check_mirrors(
    planes: Sequence[tuple[Plane, Bools]], X: Floats, F: Ints, patch: Ints, names: Sequence[str]
) -> None:
    """Refuse a mirror plane that the surface crosses, or that one of its triangles lies in."""
    near = NEAR * checks.bounding_size(X)
    for plane, mask in planes:
        if not plane.mirror:
            continue
        height = plane.height(X)
        sides = before, behind = int((height > near).sum()), int((height < -near).sum())
        if before and behind:
            raise SurfaceError(
                f"the surface crosses the {plane}: {before} vertices are in front of it and {behind} behind;"
                " keep one half, as pcmc.cut(surface, plane) gives it, or leave the mirror plane out",
                what="on_planes",
                where=str(plane),
                found=sides,
            )
        refuse_in_mirror(plane, mask, F, patch, names)


def refuse_in_mirror(plane: Plane, mask: Bools, F: Ints, patch: Ints, names: Sequence[str]) -> None:
    """Refuse a triangle with all its vertices in a mirror plane, given by their mask (n,)."""
    flat = np.flatnonzero(mask[F].all(axis=1))
    if len(flat):
        name = names[patch[flat[0]]]
        raise SurfaceError(
            f"patch {name!r} lies in the {plane} (triangle {flat[0]}), so it is its own mirror image;"
            " use a mirror plane that it does not lie in, or model the whole",
            what="on_planes",
            where=name,
            found=int(flat[0]),
        )


def common_point(point: Floats, planes: Sequence[Plane]) -> Floats:
    """(3,) the point nearest to ``point`` that lies on the first plane and on as many more as possible.

    >>> wall = Plane((2, 0, 0), (1, 0, 0))
    >>> common_point(np.zeros(3), [Plane(), wall, Plane((5, 0, 0), (1, 0, 0))]).tolist()
    [2.0, 0.0, 0.0]
    """
    chosen: list[Plane] = []
    for plane in planes:
        normals = np.array([p.normal for p in (*chosen, plane)])
        away = -np.array([float(p.height(point)) for p in (*chosen, plane)])
        move = np.linalg.lstsq(normals, away, rcond=FLAT)[0]
        if np.abs(normals @ move - away).max() <= 1e-12 * (1.0 + np.abs(away).max()):
            chosen.append(plane)
            point = point + move
    return point


def mirror_edges(planes: Sequence[tuple[Plane, Bools]], topo: Topology) -> Bools:
    """(e,) edges of one triangle that lie in a mirror plane."""
    inside = np.zeros(len(topo.edges), dtype=bool)
    for plane, mask in planes:
        if plane.mirror:
            inside |= mask[topo.edges].all(axis=1)
    return topo.boundary_edge & inside


def symmetric_part(planes: Sequence[tuple[Plane, Bools]], vectors: Floats) -> Floats:
    """Leave of vectors (n,3) at vertices in mirror planes the part along all of these, in place.

    Of the whole surface the sum over the images of a vector is this part, times their number.
    """
    mirrors = [(plane, mask) for plane, mask in planes if plane.mirror]
    if not mirrors:
        return vectors
    on = np.array([mask for _, mask in mirrors])
    some = np.flatnonzero(on.any(axis=0))
    for pattern in np.unique(on[:, some], axis=1).T:
        here = some[(on[:, some] == pattern[:, None]).all(axis=0)]
        normals = np.array([plane.normal for (plane, _), used in zip(mirrors, pattern, strict=True) if used])
        _, sizes, directions = np.linalg.svd(normals, full_matrices=False)
        across = directions[sizes > FLAT]
        vectors[here] -= vectors[here] @ across.T @ across
    return vectors


def guides_and_points(
    planes: Sequence[tuple[Plane, Bools]], fixed: Bools, lines: Sequence[tuple[Guide, Bools]]
) -> tuple[list[tuple[Guide, Bools]], Bools]:
    """Lines that vertices on two planes slide along, and (n,) the vertices that cannot move at all.

    ``lines`` are those given, each with its vertices; those of them that also lie on a plane keep their line
    if it lies in the plane, and cannot move otherwise. The vertices of three planes that meet in a point
    cannot move. Returned are all lines, the given ones first.
    """
    on = np.array([mask for _, mask in planes]).reshape(len(planes), len(fixed))
    guided = np.zeros(len(fixed), dtype=bool)
    held = np.zeros(len(fixed), dtype=bool)
    kept: list[tuple[Guide, Bools]] = []
    for guide, along in lines:
        guided |= along
        leaves = np.zeros(len(fixed), dtype=bool)
        for (plane, _), mask in zip(planes, on, strict=True):
            if not _lies_in(guide, plane):
                leaves |= along & mask
        held |= leaves
        kept.append((guide, along & ~leaves))
    several = np.flatnonzero((on.sum(axis=0) > 1) & ~fixed & ~guided)
    for pattern in np.unique(on[:, several], axis=1).T:
        chosen = several[(on[:, several] == pattern[:, None]).all(axis=0)]
        meeting = [plane for (plane, _), used in zip(planes, pattern, strict=True) if used]
        direction = _common_direction(meeting, int(chosen[0]))
        along = np.zeros(len(fixed), dtype=bool)
        along[chosen] = True
        if direction is None:
            held |= along
        elif direction.any():
            kept.append((Line(_common_point(meeting), tuple(direction.tolist())), along))
    return kept, held


def _lies_in(guide: Guide, plane: Plane) -> bool:
    """Whether a line or circle through a point of the plane stays in it."""
    normal = np.array(plane.normal)
    if isinstance(guide, Circle):
        return bool(np.linalg.norm(np.cross(guide.normal, normal)) <= FLAT)
    return bool(abs(np.array(guide.direction) @ normal) <= FLAT)


def _common_direction(planes: Sequence[Plane], vertex: int) -> Floats | None:
    """(3,) the direction within all planes; zero for one plane given several times, None for a point."""
    normals = np.array([plane.normal for plane in planes])
    _, sizes, directions = np.linalg.svd(normals)
    rank = int((sizes > FLAT).sum())
    gap = normals @ np.array(_common_point(planes)) - _offsets(planes)
    scale = 1.0 + float(np.abs([plane.point for plane in planes]).max())
    if np.abs(gap).max() > FLAT * scale:
        names = ", ".join(map(str, planes))
        message = f"on_planes: vertex {vertex} slides on planes that do not meet: {names}; remove it from one"
        raise SurfaceError(message, what="on_planes", where=vertex, found=names)
    if rank == 3:
        return None
    return directions[2] if rank == 2 else np.zeros(3)


def _common_point(planes: Sequence[Plane]) -> tuple[float, float, float]:
    """The point of all planes that is nearest to the origin, in the least squares."""
    normals = np.array([plane.normal for plane in planes])
    x, y, z = np.linalg.lstsq(normals, _offsets(planes), rcond=FLAT)[0].tolist()
    return x, y, z


def _offsets(planes: Sequence[Plane]) -> Floats:
    return np.array([np.dot(plane.normal, plane.point) for plane in planes])
