"""The patches of a plan: which area each part between the dividers belongs to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import PlanError
from ..meshing.planar import PlanarMesh, locate, signed_areas
from ..surface import Patch
from .parts import Area, PlanData


def patches_of(plan: PlanData, mesh: PlanarMesh) -> tuple[list[Patch], Ints]:
    """The plan's patches and the patch (m,) of each triangle of its mesh.

    Raises
    ------
    PlanError
        Where the areas that are given and the parts between the dividers are not one to one.
    """
    count = int(mesh.region.max()) + 1
    area = signed_areas(mesh.points, mesh.triangles)
    weight = np.bincount(mesh.region, area, count)
    middle = mesh.points[mesh.triangles].mean(axis=1)
    centroid = np.stack([np.bincount(mesh.region, area * m, count) / weight for m in middle.T], axis=1)
    areas = plan.patches
    if not areas:
        assert plan.tension is not None
        values = {"tension": plan.tension, "pressure": plan.pressure, "weight": plan.weight}
        areas = tuple(Area(f"patch {k + 1}", **values) for k in range(count))
    located = [a for a in areas if a.at is not None]
    if not located:
        if len(areas) != count:
            problem = (
                f"the dividers cut the plan into {count} parts, but there are {len(areas)} patches"
                f" ({', '.join(a.name for a in areas)}); give one for each part, or place them with at="
            )
            raise PlanError(problem, what="patches", found=len(areas), expected=count)
        owner: Ints = np.argsort(np.lexsort(centroid.round(6).T[::-1]))
    elif len(located) < len(areas):
        missing = next(a.name for a in areas if a.at is None)
        problem = f"patch {missing!r} has no at=; give it to all patches or to none"
        raise PlanError(problem, what="at", where=missing)
    else:
        owner = _located(areas, mesh, count, centroid)
    snows = [plan.snow if a.snow is None else a.snow for a in areas]
    patches = [
        Patch(a.name, a.tension, a.pressure, weight=a.weight, snow=s)
        for a, s in zip(areas, snows, strict=True)
    ]
    return patches, owner[mesh.region]


def _located(areas: Sequence[Area], mesh: PlanarMesh, count: int, centroid: Floats) -> Ints:
    """(count,) the area that each part of the plan belongs to."""
    owner = np.full(count, -1)
    for number, one in enumerate(areas):
        points = np.atleast_2d(np.array(one.at, dtype=float))
        for point, triangle in zip(points, locate(mesh, points), strict=True):
            if triangle < 0:
                problem = f"patch {one.name!r}: its point {point.tolist()} is not inside the plan"
                raise PlanError(problem, what="at", where=one.name, found=point.tolist())
            part = mesh.region[triangle]
            if owner[part] not in (-1, number):
                problem = (
                    f"patches {areas[owner[part]].name!r} and {one.name!r} are in the same part of the"
                    f" plan (around {centroid[part].round(3).tolist()}); draw a divider between them"
                )
                raise PlanError(problem, what="at", where=one.name)
            owner[part] = number
    bare = np.flatnonzero(owner < 0)
    if len(bare):
        place = centroid[bare[0]].round(3).tolist()
        problem = f"the part of the plan around {place} has no patch ({len(bare)} such parts)"
        raise PlanError(f"{problem}; add one with at= inside it", what="patches", where=place)
    return owner
