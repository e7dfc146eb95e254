"""The part of a symmetric surface on one side of a plane, if the two sides are alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Ints, mask_of
from ..base.errors import SurfaceError
from ..base.tolerances import ON
from .geometry import segment_lengths
from .guides import Plane
from .images import expect_no_images
from .parts import Cable, Room
from .pieces import point_text
from .supports import refuse_in_mirror
from .surface import Surface, expect_surface


def cut(surface: Surface, plane: Plane) -> Surface:
    """The part of a symmetric surface in front of a plane, which becomes a mirror plane of it.

    The mesh must have edges along the plane, as a symmetric mesh can. A room that the plane cuts keeps half
    of its volume, and a cable in the plane half of its tension, so that ``mirrored`` gives the whole back.

    Parameters
    ----------
    plane : its normal points to the part that stays.

    Raises
    ------
    SurfaceError : a triangle crosses the plane or lies in it, nothing lies on one side of it, or the sides
        differ in patches, cables or fixed places.

    >>> from pcmc import Patch
    >>> square = Surface([[-1, 0, 0], [0, -1, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3], [1, 2, 3]], [0, 0],
    ...                  [Patch("floor", 1.0)], fixed=range(4))
    >>> half = cut(square, Plane(normal=(1, 0, 0)))
    >>> half.vertices.tolist(), half.on_planes[0][0].mirror
    ([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], True)
    """
    expect_surface(surface)
    expect_no_images(surface, "cut")
    if not isinstance(plane, Plane):
        validate.refuse("plane", plane, "a Plane", error=SurfaceError)
    plane = replace(plane, mirror=True)
    height = plane.height(surface.vertices)
    side = np.where(np.abs(height) <= ON * surface.size, 0, np.sign(height)).astype(int)
    corners = np.repeat(side[surface.nodes], surface.order**2, axis=0)
    names = [patch.name for patch in surface.patches]
    crossing = np.flatnonzero((corners > 0).any(axis=1) & (corners < 0).any(axis=1))
    if len(crossing):
        text = f"triangle {crossing[0]} crosses the {plane} ({len(crossing)} such triangles); the mesh must"
        raise SurfaceError(f"{text} have edges along the plane", what="plane", where=int(crossing[0]))
    refuse_in_mirror(plane, side == 0, surface.faces, surface.patch_of_face, names)
    stays = np.asarray((corners > 0).any(axis=1))
    if stays.all() or not stays.any():
        where = "in front of" if stays.all() else "behind"
        raise SurfaceError(f"all of the surface is {where} the {plane}", what="plane", where=where)
    _refuse_unlike(surface, plane, side)
    vertices = np.unique(surface.faces[stays])
    number = np.full(surface.n, -1)
    number[vertices] = np.arange(len(vertices))
    patches, patch = np.unique(surface.patch_of_face[stays], return_inverse=True)
    given, edges = surface.given_supports, surface.topology.edges
    planes, lines = (
        [(guide, mask[vertices]) for guide, mask in pairs if mask[vertices].any()]
        for pairs in (surface.on_planes, given.on_line)
    )
    left = mask_of(surface.topology.edge_of_face[stays], len(edges))
    X = np.where((side == 0)[:, None], plane.nearest(surface.vertices), surface.vertices)
    return surface.rebuilt(
        vertices=X[vertices],
        faces=number[surface.faces[stays]],
        patch_of_face=patch,
        patches=tuple(surface.patches[p] for p in patches),
        fixed=given.fixed[vertices],
        on_plane=given.on_plane[vertices],
        on_line=lines,
        on_planes=(*planes, (plane, side[vertices] == 0)),
        cables=_cut_cables(surface, side, number),
        rooms=_cut_rooms(surface, stays),
        curves=surface.edges_on_curves[left].joined(number[edges[left]]),
    )


def _refuse_unlike(surface: Surface, plane: Plane, side: Ints) -> None:
    """Refuse (SurfaceError) a surface whose sides of a plane differ in their patches, cables or fixed places.

    ``side`` (n,) is 1 in front of the plane, -1 behind it, 0 in it. The triangles may differ: a fixed vertex
    may be half an edge of the held curves away from the image of one. A piece between other mirror planes is
    not looked at, as its images go on behind these.
    """
    if any(other.mirror for other, _ in surface.on_planes):
        return
    parts: list[tuple[str, tuple[float, ...], Ints]] = []
    for k, p in enumerate(surface.patches):  # the pressure of a room is a result, and differs with the mesh
        loads = abs(p.pressure) * (not surface.room_signs[:, k].any()), p.weight, abs(p.snow)
        parts.append((f"patch {p.name!r}", (p.tension, *loads), surface.faces[surface.patch_of_face == k]))
    parts += [(f"cable {c.name!r}", (c.tension, c.weight), c.edges) for c in surface.cables]
    digits = [" ".join(f"{number:.5g}" for number in numbers) for _, numbers, _ in parts]  # met, or given
    for sign in (1, -1):
        behind = {kind for kind, (_, _, on) in zip(digits, parts, strict=True) if (sign * side[on] < 0).any()}
        for kind, (name, _, on) in zip(digits, parts, strict=True):
            if (sign * side[on] > 0).any() and kind not in behind:
                text = f"the {plane} divides no symmetric surface: nothing on its other side has the tension"
                raise SurfaceError(f"{text} and the loads of {name}", what="plane", where=name)
    from scipy.spatial import cKDTree  # here, as few surfaces are cut

    X, fixed, edges = surface.vertices, surface.given_supports.fixed, surface.topology.edges
    held = edges[fixed[edges].all(axis=1)]
    reach = 0.5 * segment_lengths(X, held).max(initial=0.0) + 10.0 * ON * surface.size
    for sign in (1, -1):
        here, there = X[fixed & (sign * side > 0)], X[fixed & (sign * side <= 0)]
        image = here - 2.0 * plane.height(here)[:, None] * np.array(plane.normal)
        away = np.asarray(cKDTree(there).query(image)[0]) if len(there) else np.full(len(here), np.inf)
        if len(here) and away.max() > reach:
            text = f"the {plane} divides no symmetric surface: the fixed vertex at"
            at, place = (point_text(places[away.argmax()], surface.size) for places in (here, image))
            raise SurfaceError(f"{text} {at} has no image at {place}", what="plane", where=at)


def _cut_cables(surface: Surface, side: Ints, number: Ints) -> tuple[Cable, ...]:
    """The cables of the part that stays; of one in the plane, half the tension and weight."""
    cables = []
    for cable in surface.cables:
        ends = side[cable.edges]
        inside, stays = (ends == 0).all(axis=1), (ends >= 0).all(axis=1)
        if inside.any() and not inside[stays].all():
            text = f"cable {cable.name!r} lies in the plane in part; make that part a cable of its own"
            raise SurfaceError(text, what="cables", where=cable.name)
        if stays.any():
            cables.append(cable.shared(0.5 if inside.any() else 1.0, number[cable.edges[stays]]))
    return tuple(cables)


def _cut_rooms(surface: Surface, stays: Bools) -> tuple[Room, ...]:
    """The rooms of the part that stays; of one that the plane cuts, half the volume."""
    left, gone = (
        {surface.patches[p].name for p in np.unique(surface.patch_of_face[faces])}
        for faces in (stays, ~stays)
    )
    rooms = []
    for room in surface.rooms:
        patches = tuple((name, sign) for name, sign in room.patches if name in left)
        if patches:
            halved = any(name in gone for name, _ in room.patches)
            rooms.append(Room(room.name, patches, room.volume * (0.5 if halved else 1.0)))
    return tuple(rooms)
