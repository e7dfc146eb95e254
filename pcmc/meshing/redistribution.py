"""Spreading vertices along the shape, so that its triangles get better and nothing else changes."""

from __future__ import annotations

from ..base.arrays import Floats
from ..contact.pinching import StandingPart, place_wall_rows
from ..energy.motion_space import motion_space
from .quality import towards_star_centres, worst_quality

SWEEPS = 20  # at most


def redistribute(part: StandingPart, X: Floats, aim: float, *, slide: bool) -> tuple[Floats, float]:
    """The best of a few sweeps of redistribution, (n,3), and the quality of its worst triangle.

    Sweeps end where that is at least ``aim``. Each vertex moves towards the middle of its star, without
    the part in the motion space, which would change the shape; walls follow their crest.

    Parameters
    ----------
    part : the standing part of the surface; triangles of walls that can pinch do not count.
    X : (n,3) where its vertices are.
    slide : whether junction vertices at rest on Π may slide along their junction.
    """
    surface, classes, faces = part.surface, part.classes, part.quality_faces
    best, worst = X, worst_quality(X, faces)
    for _ in range(SWEEPS):
        move = towards_star_centres(surface, X, classes.kind, classes.curve, classes.beside)
        if not slide:
            move[part.resting] = 0.0
        space = motion_space(surface, classes, X)
        X = place_wall_rows(surface, part.walls, X + move - space.project(move), space)
        quality = worst_quality(X, faces)
        if quality > worst:
            best, worst = X, quality
        if quality >= aim:
            break
    return best, worst
