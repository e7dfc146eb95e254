"""The rigid motions that the supports leave free."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats
from ..base.tolerances import ONLY_SLIDES
from ..surface import Circle, Surface
from .motion_space import MotionSpace, perpendicular


def rigid_motions(surface: Surface) -> Floats:
    """(k,2,3) translations and rotations about the centroid, k = 0 to 6, that no support resists.

    Entry (i,0) is the translation, (i,1) the rotation vector, scaled so that the six are orthonormal
    when lengths are measured in sizes of the surface.
    """
    size = surface.size or 1.0  # 0 where all vertices are at one point
    arm = (surface.vertices - surface.vertices.mean(axis=0)) / size
    held, free = surface.fixed, np.eye(6)
    for _, along in surface.on_line:
        held = held & ~along
    if not surface.free.all():
        rows = [_row(arm[held], axis) for axis in np.eye(3)]
        for line, along in surface.on_line:
            if isinstance(line, Circle):
                outward = surface.vertices[along] - np.array(line.centre)
                across = [np.array(line.normal), outward / line.radius]
            else:
                across = list(perpendicular(np.array([line.direction])))
            rows += [_row(arm[along], axis) for axis in across]
        rows += [_row(arm[mask], np.array(plane.normal)) for plane, mask in surface.sliding]
        resisted = np.concatenate(rows)
        _, s, vt = np.linalg.svd(resisted.T @ resisted)
        free = vt[s <= 1e-10 * s[0]]
    motions = free.reshape(-1, 2, 3).copy()
    motions[:, 1] /= size
    return motions


def rigid_modes(space: MotionSpace, motions: Floats, X: Floats) -> Floats:
    """(N,k) orthonormal: the given rigid motions as they appear in the motion space at X.

    Those that only slide the surface along itself, like a sphere's rotations, drop out.
    """
    if not len(motions):
        return np.zeros((space.size, 0))
    arm = X - X.mean(axis=0)
    fields = [translation + np.cross(rotation, arm) for translation, rotation in motions]
    lengths = [float(np.linalg.norm(f)) or 1.0 for f in fields]  # 0 where all lies on the axis of rotation
    parts = np.stack([space.to_coordinates(f) / k for f, k in zip(fields, lengths, strict=True)], axis=1)
    u, s, _ = np.linalg.svd(parts, full_matrices=False)
    return u[:, s > ONLY_SLIDES]


def _row(arm: Floats, axis: Floats) -> Floats:
    """(k,6): velocity along ``axis``, (3,) or (k,3), of points at ``arm`` for unit motions."""
    return np.concatenate([np.broadcast_to(axis, arm.shape), np.cross(arm, axis)], axis=1)
