"""A low start: near the lowest surface that the boundary spans, whatever the given start looked like."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats, mask_of
from ..base.tolerances import FAILED, ON, PARALLEL
from ..certificate.forces import total_load
from ..forces.pinching import place_wall_rows
from ..forces.wall_rows import find_walls
from ..meshing.quality import in_the_middle, triangle_quality
from ..surface import Surface
from ..surface.geometry import bounding_size, cross_2d
from ..surface.pieces import to_space

RISE = 0.1  # of the supports' extent along Π: height of a low start over the lowest surface
WIDE = 1.5  # of that extent: a plan that is wider is not kept


def low_start(surface: Surface) -> Surface | None:
    """The same mesh, low over the surface that its boundary spans; None where it spans none.

    The lowest surface has each vertex at the mean height of its neighbours. Over a sound plan the vertices'
    heights over it are scaled down together. Otherwise the mesh is spread anew, each vertex in the middle of
    its neighbours (Tutte 1963), with a low dome on top where there is pressure.

    >>> from pcmc import Patch
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 7]]
    >>> spire = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                 [Patch("roof", 1.0)], fixed=range(4))
    >>> low_start(spire).vertices[4].round(3).tolist()
    [0.0, 0.0, 0.283]
    """
    points, normal = surface.vertices[surface.fixed], np.array(surface.plane.normal)
    if len(points) < 3 or any(abs(normal @ plane.normal) > PARALLEL for plane, _ in surface.on_planes):
        return None  # too few points, or a plane besides Π holds heights
    lengths = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if lengths[1] <= ON * lengths[0]:
        return None  # they lie on one line
    walls = surface.auxiliary[surface.patch_of_face]
    faces = surface.faces[~walls] if not walls.all() else surface.faces
    roof = mask_of(faces, surface.n)
    held = surface.pinned | surface.on_ground
    place = surface.plane.to_local(surface.vertices)
    flat = place[:, :2].copy()
    corners = flat[faces] - flat[faces[:, :1]]
    turns = np.sign(cross_2d(corners[:, 1], corners[:, 2]))
    plan = triangle_quality(place * [1.0, 1.0, 0.0], faces)
    extent, span = bounding_size(flat[roof]), bounding_size(flat[held]) or bounding_size(flat[roof])
    kept = np.abs(turns.sum()) == len(turns) and plan.min() > FAILED and extent < WIDE * span
    low = place.copy()
    if not kept and surface.on_planes:
        return None  # spread anew, its boundary would leave the planes
    if not kept:
        low[:, :2] = in_the_middle(faces, surface.fixed | ~roof, flat)
    known = held | ~roof
    low[:, 2] = in_the_middle(faces, known, place[:, 2])
    # a dome: 1 above the mean of the neighbours
    above = place[:, 2] - low[:, 2] if kept else in_the_middle(faces, known, np.zeros(surface.n), 1.0)
    if not (kept or walls.all()):
        above *= np.sign(total_load(_at(surface, low + above[:, None] * [0.0, 0.0, 1.0]))) or 1.0
    rise, most = RISE * span, float(np.abs(above[roof]).max())
    if surface.net_pressures.any() and most > 0.0:
        low[:, 2] += above * min(1.0, rise / most) if kept else above * (rise / most)
    if roof.all():
        return _at(surface, low)
    # walls below: between their feet and the roof; rows of walls that can pinch right below it
    moved = _at(surface, in_the_middle(surface.faces, roof | held, low))
    if (surface.held & ~(roof | held)).any():  # the others follow those that went back to their planes
        place = surface.plane.to_local(moved.vertices)
        moved = _at(surface, in_the_middle(surface.faces, roof | surface.held, place))
    return moved.moved(place_wall_rows(moved, find_walls(moved), moved.vertices))


def _at(surface: Surface, place: Floats) -> Surface:
    """The surface with its vertices at coordinates (n,3) on and above Π, or where supports let them be."""
    return surface.moved(surface.onto_supports(to_space(place, surface.plane)))
