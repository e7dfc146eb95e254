"""What vertices may do that slide on several planes, or on planes and lines: the common directions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats
from ..base.errors import SurfaceError
from . import checks
from .circle import Circle, Guide
from .line import Line
from .plane import Plane

FLAT = 1e-9  # sine of an angle up to which two directions count as parallel


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
