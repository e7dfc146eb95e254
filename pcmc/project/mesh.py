"""A mesh as a project: ``mesh = "pavilion.obj"``, with tensions, supports and a rise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..advice.rises import RISES, Rise, first_tension, taken
from ..base import validate
from ..base.arrays import Bools, Floats
from ..base.errors import OptionError
from ..base.units import NO_UNITS, Units
from ..io import read_bare
from ..io.mesh_data import MeshData
from ..surface import Patch, Surface
from ..surface.geometry import area_vectors, segment_lengths
from .drawn import check_beside

if TYPE_CHECKING:
    from ..design import Parameter, Target

PATCH_KEYS = ("tension", "pressure", "snow", "weight", "wall")
BOUNDARY, GROUND = "boundary", "ground"
NEAR = 1e-6  # of the size: vertices this near to a line or to the lowest level are on it


@dataclass(frozen=True)
class MeshFile:
    """The mesh of a project.

    Attributes
    ----------
    file : its name, beside the project.
    units : of the file's numbers, where it has none itself; by default those of the project.
    tension : of all patches under pressure that ``patches`` does not name.
    patches : by the names in the file: ``tension``, ``pressure``, ``snow``, ``weight``, ``wall``.
    supports : what is fixed instead of the file's supports: "boundary", all of it; "ground", its lowest
        level; or a list of points and lines [x, y, z], whose vertices are fixed.
    rises : heights that it has instead of tensions.
    """

    file: str
    units: str = ""
    tension: float | None = None
    patches: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    supports: str | Sequence[Any] = ()
    rises: Sequence[Rise] = ()

    def __post_init__(self) -> None:
        if isinstance(self.supports, str):
            validate.choice("mesh.supports", self.supports, (BOUNDARY, GROUND))
        if self.tension is not None:
            validate.positive("mesh.tension", self.tension)


def mesh_of(path: Path, value: Any) -> MeshFile:
    """The mesh that a project names; ``value`` is the name of its file, or the table [mesh].

    >>> mesh_of(Path("hall.toml"), {"file": "hall.obj", "rise": 2.0}).rises
    [Rise(patch=None, kind='rise', value=2.0)]
    """
    table = {"file": value} if isinstance(value, str) else dict(value)
    check_beside(path, table.get("file", ""), "mesh")
    rises = taken(table, RISES, None, keep=True)
    return MeshFile(**table, rises=rises)


def read_mesh(path: Path, mesh: MeshFile, units: Units = NO_UNITS) -> tuple[Surface, MeshData]:
    """The surface of a project's mesh in the project's units, and all that its file holds.

    A file without a unit is taken to be in ``mesh.units``, or else in the project's.
    """
    surface, data = read_bare(path.parent / mesh.file, units.length, mesh.units)
    changes: dict[str, Any] = {}
    if mesh.patches or mesh.tension is not None:
        changes["patches"] = _patches(surface, mesh)
    if len(mesh.supports):
        changes |= {
            "fixed": _supported(surface, mesh.supports),
            "on_plane": (),
            "on_planes": (),
            "on_line": (),
        }
    return (surface.rebuilt(**changes).with_held_snow() if changes else surface), data


def _patches(surface: Surface, mesh: MeshFile) -> list[Patch]:
    for name in mesh.patches:
        surface.patch_index(name)  # refuses one that is not there
    common = {} if mesh.tension is None else {"tension": mesh.tension}
    changes = ({**({} if p.auxiliary else common), **mesh.patches.get(p.name, {})} for p in surface.patches)
    return [replace(p, **change) for p, change in zip(surface.patches, changes, strict=True)]


def _supported(surface: Surface, supports: str | Sequence[Any]) -> Bools:
    """(n,) the vertices that the supports of a project fix."""
    edges = surface.topology.edges[surface.topology.boundary_edge]
    boundary = np.zeros(surface.n, dtype=bool)
    boundary[edges] = True
    if supports == BOUNDARY:
        return boundary
    height = surface.plane.height(surface.vertices)
    if supports == GROUND:
        return np.asarray(boundary & (height <= height[boundary].min() + NEAR * surface.size))
    reach = 0.5 * float(segment_lengths(surface.vertices, surface.topology.edges).mean())
    fixed = np.zeros(surface.n, dtype=bool)
    for number, one in enumerate(supports, start=1):
        points = np.atleast_2d(_points(number, one))
        if len(points) == 1:
            away = np.linalg.norm(surface.vertices - points[0], axis=1)
            found = away == away.min() if away.min() <= reach else np.zeros(surface.n, dtype=bool)
        else:
            found = _distance(surface.vertices, points) <= NEAR * surface.size
        if not found.any():
            text = f"mesh.supports: number {number}, {points.tolist()}, has no vertex of the mesh on it"
            raise OptionError(f"{text}; give points in the units of the project", what="mesh.supports")
        fixed |= found
    return fixed


def _points(number: int, one: Any) -> Floats:
    try:
        points = np.array(one, dtype=float)
    except (TypeError, ValueError):
        points = np.empty(0)
    if points.ndim not in (1, 2) or points.shape[-1:] != (3,) or not np.isfinite(points).all():
        validate.refuse("mesh.supports", one, "a point [x, y, z], or a list of points", str(number))
    return points


def _distance(X: Floats, line: Floats) -> Floats:
    """(n,) the distance of points (n,3) from a line through points (k,3)."""
    away = np.full(len(X), np.inf)
    for a, b in pairwise(line):
        side = b - a
        part = np.clip((X - a) @ side / max(float(side @ side), 1e-300), 0.0, 1.0)
        away = np.minimum(away, np.linalg.norm(X - a - part[:, None] * side, axis=1))
    return away


def first_tensions(surface: Surface, mesh: MeshFile) -> tuple[Surface, list[Target], list[Parameter]]:
    """The mesh with first tensions for its rises, the targets, and what is to be found.

    They are those of a cap; see ``rises.first_tension``. The least tension is p times area over length of the
    boundary's projection.
    """
    from ..design import Parameter, Target

    if not mesh.rises:
        return surface, [], []
    held = surface.topology.edges[surface.topology.boundary_edge]
    heights = surface.plane.height(surface.vertices[held[surface.held[held].all(axis=1)]])
    level = float(heights.mean()) if heights.size else 0.0
    normal = np.array(surface.plane.normal)
    roof = surface.roof[surface.patch_of_face]
    plan = abs(float((area_vectors(surface.vertices[surface.faces[roof]]) @ normal).sum()))
    least = plan / float(segment_lengths(surface.vertices, held).sum())
    names = [p.name for p, pressed in zip(surface.patches, surface.roof, strict=True) if pressed]
    targets, vary = [], []
    for rise in mesh.rises:
        if rise.kind == "rise" and heights.size and np.ptp(heights) > NEAR * surface.size:
            text = f"{rise.kind}: the supports are not level, so a rise over them is not defined; give apex"
            raise OptionError(f"{text} instead, the greatest height over the plane", what=rise.kind)
        height = rise.value if rise.kind == "apex" else level + rise.value
        given = {
            p.name: first_tension(least, p.net_pressure, height - level)
            for p in surface.patches
            if p.name in names
        }
        highest = max(given.values())
        surface = surface.retensioned(dict.fromkeys(given, highest))
        targets.append(Target("apex", None, height))
        vary.append(Parameter(names))
    return surface, targets, vary


def mesh_file(path: Path) -> MeshFile:
    """A surface file as the mesh of a project without other values.

    >>> mesh_file(Path("halls/hall.obj")).file
    'hall.obj'
    """
    return MeshFile(path.name)
