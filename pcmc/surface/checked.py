"""The parts of a surface as they are given, checked and in the form that it keeps."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..base import validate
from ..base.arrays import Bools, Floats, read_only
from ..base.errors import SurfaceError
from ..curves.plane import Plane
from . import checks, supports
from .cable import checked_cables
from .geometry import bounding_size
from .held_curve import checked_curves
from .patch import Patch
from .room import checked_rooms
from .topology import topology


def checked_parts(
    *,
    vertices: Any,
    faces: Any,
    patch_of_face: Any,
    patches: Any,
    fixed: Any,
    on_plane: Any,
    plane: Any,
    on_line: Any,
    on_planes: Any,
    cables: Any,
    rooms: Any,
    curves: Any,
) -> dict[str, object]:
    """The fields of a Surface by name, and its topology.

    Parameters are those of Surface. Arrays come back read-only; ``fixed`` also counts the vertices that
    cannot move because of several planes, and those on lines.

    Raises
    ------
    SurfaceError
        Naming the first offending index.
    """
    if not isinstance(plane, Plane):
        validate.refuse("plane", plane, "a Plane", error=SurfaceError)
    if plane.mirror:
        message = "plane: Π cannot be a mirror plane; give that plane in on_planes= instead"
        raise SurfaceError(message, what="plane")
    X = read_only(checks.positions(vertices))
    checks.large_enough(X)
    F = read_only(checks.face_array(faces, len(X)))
    members = tuple(patches) if isinstance(patches, Iterable) else ()
    if not members or not all(isinstance(member, Patch) for member in members):
        validate.refuse("patches", patches, "a sequence of Patch", error=SurfaceError)
    names = [member.name for member in members]
    patch = read_only(checks.patch_array(patch_of_face, len(F), members))
    fixed = checks.mask(fixed, len(X), "fixed")
    guides = checks.on_line(on_line, X)
    on_plane = checks.mask(on_plane, len(X), "on_plane")
    planes = supports.plane_masks(on_planes, len(X))
    given = supports.Supports(fixed.copy(), on_plane, tuple(guides))
    topo = topology(F, patch, len(X))
    if planes:
        planes = supports.completed(planes, X, topo.on_boundary, fixed)
        supports.check_mirrors(planes, X, F, patch, names)
        guides, points = supports.guides_and_points([(plane, on_plane), *planes], fixed, guides)
        fixed |= points
    for _, along in guides:
        fixed |= along
    sliding = on_plane & ~fixed
    edge_cables = checked_cables(cables, topo.edges, len(X))
    volumes = checked_rooms(rooms, names)
    # a vertex that slides on another plane alone may come down to Π like a free one
    checks.mesh(X, F, patch, topo, members, given.bound, plane.height(X))
    check_planes(X, plane, sliding, planes, bounding_size(X))
    return {
        "vertices": X,
        "faces": F,
        "patch_of_face": patch,
        "patches": members,
        "fixed": read_only(fixed),
        "on_plane": read_only(sliding),
        "on_line": tuple((guide, read_only(along)) for guide, along in guides),
        "on_planes": tuple((other, read_only(mask)) for other, mask in planes),
        "cables": edge_cables,
        "rooms": volumes,
        "curves": checked_curves(curves, X, topo, given.stays, bounding_size(X)),
        "given_supports": given.frozen(),
        "topology": topo,
    }


def check_planes(
    X: Floats, plane: Plane, sliding: Bools, others: Iterable[tuple[Plane, Bools]], size: float
) -> None:
    """Refuse vertices (n,3) that are not on the plane they slide on: Π, by the mask (n,), or one of others.

    ``size`` is the length that distances are compared with.
    """
    checks.on_plane(plane.height(X), sliding, X, size)
    for other, mask in others:
        checks.on_plane(other.height(X), mask, X, size, str(other))
