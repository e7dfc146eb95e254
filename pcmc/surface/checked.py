"""The parts of a surface as they are given, checked and in the form that it keeps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..base import validate
from ..base.arrays import read_only
from ..base.errors import SurfaceError
from . import checks
from .guides import Plane
from .held_curve import checked_curves
from .images import check_weights, checked_images, glued
from .lagrange import checked_order, element_nodes, sides_along
from .parts import Patch, checked_cables, checked_rooms, named_parts
from .supports import Supports, check_on, checked_lines, checked_planes


def checked_parts(given: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a Surface by name, of the parameters given for it, and its topology.

    Arrays come back read-only; ``fixed`` also counts the vertices that cannot move because of several planes,
    and those on lines. SurfaceError names the first offending index.
    """
    plane = given["plane"]
    if not isinstance(plane, Plane):
        validate.refuse("plane", plane, "a Plane", error=SurfaceError)
    if plane.mirror:
        message = "plane: Π cannot be a mirror plane; give that plane in on_planes= instead"
        raise SurfaceError(message, what="plane")
    X = read_only(checks.positions(given["vertices"]))
    n, size = len(X), checks.large_enough(X)
    F = read_only(checks.face_array(given["faces"], n))
    patches = named_parts(Patch, "patches", given["patches"])
    if not patches:
        validate.refuse("patches", given["patches"], "a sequence of Patch", error=SurfaceError)
    names = [patch.name for patch in patches]
    patch = read_only(checks.patch_array(given["patch_of_face"], len(F), names))
    fixed, lines = checks.mask(given["fixed"], n, "fixed"), checked_lines(given["on_line"], X)
    supports = Supports(fixed, checks.mask(given["on_plane"], n, "on_plane"), lines)
    images = checked_images(given["images"], X, F, fixed, supports.on_plane)
    topo = glued(F, patch, images, n)
    planes = checked_planes(given["on_planes"], X, F, patch, names, topo, fixed)
    resolved = supports.resolved(plane, planes)
    cables, rooms = checked_cables(given["cables"], topo), checked_rooms(given["rooms"], names)
    check_weights([*patches, *cables], plane, planes, X, images)
    # a vertex that slides on another plane alone may come down to Π like a free one
    bound = fixed | supports.on_plane | supports.guided
    checks.mesh(X, F, patch, topo, patches, bound, plane.height(X))
    check_on([(plane, supports.fixed_and_sliding()[1]), *planes], X, size)
    order = checked_order(given["order"], F, patch)
    curves = checked_curves(given["curves"], X, topo, fixed & ~supports.guided, size)
    parts = {"cables": cables, "on_planes": planes, "on_line": lines, "curves": curves, "order": order > 1}
    if len(images) and (others := [name for name, part in parts.items() if part]):
        message = f"images: a periodic surface cannot have {', '.join(others)}; leave one of both out"
        raise SurfaceError(message, what="images", found=others)
    for cable in cables if order > 1 else ():
        if order * len(sides_along(element_nodes(F, order), order, cable.edges)) < len(cable.edges):
            message = f"cable {cable.name!r}: its edges are no whole sides of elements of order {order};"
            message += " let it run from corner to corner, or give order=1"
            raise SurfaceError(message, what="order", where=cable.name, found=order, expected=1)
    arrays = {"vertices": X, "faces": F, "patch_of_face": patch, "images": images, "topology": topo}
    supported = {"given_supports": supports.frozen(), "on_planes": planes, **resolved}
    named = {"patches": patches, "cables": cables, "rooms": rooms, "curves": curves}
    return {"order": order, **arrays, **supported, **named}
