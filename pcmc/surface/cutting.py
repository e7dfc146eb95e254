"""The part of a symmetric surface on one side of a plane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Ints
from ..base.errors import SurfaceError
from ..curves.plane import Plane
from .cable import Cable
from .room import Room
from .supports import NEAR, refuse_in_mirror
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
    SurfaceError
        If a triangle crosses the plane or lies in it, or nothing lies on one side of it.

    >>> from pcmc import Patch
    >>> square = Surface([[-1, 0, 0], [0, -1, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3], [1, 2, 3]], [0, 0],
    ...                  [Patch("floor", 1.0)], fixed=range(4))
    >>> half = cut(square, Plane(normal=(1, 0, 0)))
    >>> half.vertices.tolist(), half.on_planes[0][0].mirror
    ([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], True)
    """
    expect_surface(surface)
    if not isinstance(plane, Plane):
        validate.refuse("plane", plane, "a Plane", error=SurfaceError)
    plane = replace(plane, mirror=True)
    height = plane.height(surface.vertices)
    side = np.where(np.abs(height) <= NEAR * surface.size, 0, np.sign(height)).astype(int)
    corners = side[surface.faces]
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
    vertices = np.unique(surface.faces[stays])
    number = np.full(surface.n, -1)
    number[vertices] = np.arange(len(vertices))
    patches, patch = np.unique(surface.patch_of_face[stays], return_inverse=True)
    given, X = surface.given_supports, surface.vertices[vertices]
    X = X - (height[vertices] * (side[vertices] == 0))[:, None] * np.array(plane.normal)
    planes = tuple((other, mask[vertices]) for other, mask in surface.on_planes if mask[vertices].any())
    lines = tuple((guide, mask[vertices]) for guide, mask in given.on_line if mask[vertices].any())
    edges = surface.topology.edges
    left = np.zeros(len(edges), dtype=bool)
    left[surface.topology.edge_of_face[stays]] = True
    return surface.rebuilt(
        vertices=X,
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


def _cut_cables(surface: Surface, side: Ints, number: Ints) -> tuple[Cable, ...]:
    """The cables of the part that stays; of one in the plane, half the tension."""
    cables = []
    for cable in surface.cables:
        ends = side[cable.edges]
        inside, stays = (ends == 0).all(axis=1), (ends >= 0).all(axis=1)
        if inside.any() and not inside[stays].all():
            text = f"cable {cable.name!r} lies in the plane in part; make that part a cable of its own"
            raise SurfaceError(text, what="cables", where=cable.name)
        if stays.any():
            share = 0.5 if inside.any() else 1.0
            cables.append(Cable(cable.name, share * cable.tension, number[cable.edges[stays]]))
    return tuple(cables)


def _cut_rooms(surface: Surface, stays: Bools) -> tuple[Room, ...]:
    """The rooms of the part that stays; of one that the plane cuts, half the volume."""
    left = {surface.patches[p].name for p in np.unique(surface.patch_of_face[stays])}
    gone = {surface.patches[p].name for p in np.unique(surface.patch_of_face[~stays])}
    rooms = []
    for room in surface.rooms:
        patches = tuple((name, sign) for name, sign in room.patches if name in left)
        if patches:
            halved = any(name in gone for name, _ in room.patches)
            rooms.append(Room(room.name, patches, room.volume * (0.5 if halved else 1.0)))
    return tuple(rooms)
