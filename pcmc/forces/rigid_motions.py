"""The rigid motions that the supports leave free."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Floats
from ..base.tolerances import ONLY_SLIDES
from ..surface import Circle, Surface
from ..surface.supports import members
from .motion_space import MotionSpace, perpendicular


def rigid_motions(surface: Surface) -> Floats:
    """(k,2,3) translations and rotations about the centroid, k = 0 to 6, that no support resists.

    Entry (i,0) is the translation, (i,1) the rotation vector, scaled so that the six are orthonormal
    when lengths are measured in sizes of the surface.
    """
    X, size, free = surface.vertices, surface.size or 1.0, np.eye(6)  # 0 where all vertices are at one point
    if surface.periodic or not surface.free.all():
        elsewhere = surface.onto_supports(X + size * np.cos(1.618 * np.arange(X.size)).reshape(-1, 3))
        here, there = _resisted(surface, X), _resisted(surface, elsewhere)
        free = _unresisted(here)
        # a flat half turns about its two masts: out of its mirror plane, but not with the first step
        if len(_unresisted(there)) < len(free):
            free = _unresisted(here + there)
    motions = free.reshape(-1, 2, 3).copy()
    motions[:, 1] /= size
    return motions


def _resisted(surface: Surface, X: Floats) -> Floats:
    """(6,6) RᵀR of the rows R of velocities that supports resist at X (n,3), about the surface's centroid."""
    size = surface.size or 1.0
    arm = (X - surface.vertices.mean(axis=0)) / size
    held = surface.fixed & ~members(surface.on_line, surface.n)
    rows = [_row(arm[held], axis) for axis in np.eye(3)]
    for line, along in surface.on_line:
        if isinstance(line, Circle):
            outward = X[along] - np.array(line.centre)
            across = [np.array(line.normal), outward / line.radius]
        else:
            across = list(perpendicular(np.array([line.direction])))
        rows += [_row(arm[along], axis) for axis in across]
    rows += [_row(arm[mask], np.array(plane.normal)) for plane, mask in surface.sliding]
    between = np.subtract(*surface.vertices[surface.images.T]) / size  # rotations would turn these
    rows += [_row(between, axis) * [0, 0, 0, 1, 1, 1] for axis in np.eye(3)]
    resisted = np.concatenate(rows)
    return np.asarray(resisted.T @ resisted)


def _unresisted(resisted: Floats) -> Floats:
    """(k,6) what of the six motions is resisted nowhere."""
    _, s, vt = np.linalg.svd(resisted)
    return np.asarray(vt[s <= 1e-10 * s[0]])


def rigid_modes(space: MotionSpace, motions: Floats, X: Floats) -> tuple[Floats, Floats]:
    """(N,k) orthonormal: rigid motions as they appear in the motion space at X; and (k,2,3) these motions.

    Of the given motions those drop out that only slide the surface along itself, like a sphere's rotations.
    """
    if not len(motions):
        return np.zeros((space.size, 0)), motions
    fields = [rigid_field(motion, X) for motion in motions]
    lengths = np.array([float(np.linalg.norm(f)) or 1.0 for f in fields])  # 0: all on the axis of rotation
    parts = np.stack([space.to_coordinates(f) / k for f, k in zip(fields, lengths, strict=True)], axis=1)
    u, s, vt = np.linalg.svd(parts, full_matrices=False)
    some = s > ONLY_SLIDES
    return u[:, some], np.tensordot(vt[some] / s[some, None] / lengths, motions, axes=1)


def rigid_field(motion: Floats, X: Floats) -> Floats:
    """(n,3) how a rigid motion (2,3) moves points X (n,3)."""
    return np.asarray(motion[0] + np.cross(motion[1], X - X.mean(axis=0)))


def net_forces(motions: Floats, X: Floats, forces: Floats) -> Floats:
    """(k,) the forces (n,3) at X (n,3) along rigid motions (k,2,3): how they change E together."""
    moment = np.cross(X - X.mean(axis=0), forces).sum(axis=0)
    return np.asarray(motions[:, 0] @ forces.sum(axis=0) + motions[:, 1] @ moment)


def _row(arm: Floats, axis: Floats) -> Floats:
    """(k,6): velocity along ``axis``, (3,) or (k,3), of points at ``arm`` for unit motions."""
    return np.concatenate([np.broadcast_to(axis, arm.shape), np.cross(arm, axis)], axis=1)
