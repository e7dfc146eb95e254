"""Equilibria with poor triangles, solved again on a new mesh."""

from __future__ import annotations

from ..base.errors import MissingExtra, SurfaceError
from ..forces.functional import patch_areas
from ..forces.pinching import standing_part
from ..meshing.quality import worst_quality
from ..meshing.remeshing import remesh
from ..solvers import solve_once
from ..surface import Surface
from .shapes import Shape

MIN_QUALITY = 0.3  # of the worst triangle


def with_good_triangles(surface: Surface) -> Surface:
    """An equilibrium; with poor triangles on a new mesh of about as many, if it is there and mmgpy is.

    Along a branch and on a way down vertices move along the normals: far from the start triangles are long.
    """
    part = standing_part(surface)
    if worst_quality(part.surface.vertices, part.quality_faces) >= MIN_QUALITY:
        return surface
    edge = (4.0 / 3.0**0.5 * float(patch_areas(surface).sum()) / surface.m) ** 0.5
    try:
        result = solve_once(remesh(surface, edge), target="stationary")
    except (MissingExtra, SurfaceError):
        return surface
    near = result.converged and Shape.of(result.surface).distance(Shape.of(surface)) <= edge
    return result.surface if near else surface
