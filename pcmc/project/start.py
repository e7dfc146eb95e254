"""The start shape of a project: the mesh of its plan, or the mesh in its file with tensions and supports."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..advice.rises import first_tension
from ..base import validate
from ..base.arrays import Bools
from ..base.errors import FileWarning, OptionError, PlanError
from ..base.files import PathLike
from ..base.units import NO_UNITS, Units, unlikely_size
from ..design import Parameter, Target
from ..io import read_bare
from ..io.mesh_data import MeshData
from ..surface import Surface
from ..surface.geometry import area_vectors, segment_lengths
from ..surface.pieces import point_text
from ..surface.values import sheets_below
from .checking import in_file
from .file import Project, load
from .outcome import Outcome
from .settings import BOUNDARY, GROUND, MeshFile

NEAR = 1e-6  # of the size: vertices this near to a line or to the lowest level are on it


def start_of(project: Project) -> Outcome:
    """The start shape of a project, not solved: its ``project`` also has the targets for the rise of a mesh.
    Errors as in ``load``."""
    if project.mesh is not None:
        surface, data = read_mesh(project.path, project.mesh, project.units)
        own, force = data.units.force, project.units.force
        if own and force not in ("", own):
            text = f"{project.path}: force = {force!r}, but the tensions in {project.mesh.file} are in {own};"
            text += f" make it {own!r}, or leave it out"
            raise OptionError(text, what="force", found=force, expected=own)
        units = Units(data.units.length, force or own)
        width = float(np.ptp(surface.vertices, axis=0).max())
        if note := unlikely_size(width, units.length, what="mesh"):
            warnings.warn(f"{project.path}: {note}", FileWarning, stacklevel=2)
        surface, targets, vary = first_tensions(surface, project.mesh)
        typed = targets and project.mesh.rises[0].kind in project.data.get("mesh", ())
        for name in vary[0].names if typed else ():
            if "tension" in project.mesh.patches.get(name, ()):  # the command's --rise takes its place
                text = f"{project.path}: the mesh has {project.mesh.rises[0].kind} and a tension of {name!r},"
                raise OptionError(f"{text} which is found for it; leave out one", what="mesh.patches")
        if targets:
            project = replace(project, targets=[*project.targets, *targets], vary=[*project.vary, *vary])
        return Outcome.of(surface, units, project, data)
    assert project.plan is not None
    layers = {} if project.drawing is None else project.drawing.layers
    with in_file(project.path):
        try:
            return Outcome.of(project.plan.surface(), project.units, project)
        except PlanError as error:
            if error.what not in layers:
                raise
            text = f"{error} ({layers[str(error.what)]})"
            raise PlanError(text, what=error.what, where=error.where, found=error.found) from None


def surface_of(project: Project) -> Surface:
    """The start shape of a project, as a surface alone."""
    return start_of(project).surface


def build(path: PathLike) -> Surface:
    """The start shape of the project in a file. Errors as in ``load``.

    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "hall.toml")
    ...     text = "[plan]\\noutline = [[0, 0], [6, 0], [6, 4], [0, 4]]\\ntension = 3.0"
    ...     _ = path.write_text(text, encoding="utf-8")
    ...     start = build(path)
    >>> [patch.tension for patch in start.patches], start.size > 6.0
    ([3.0], True)
    """
    return surface_of(load(path))


def read_mesh(path: Path, mesh: MeshFile, units: Units = NO_UNITS) -> tuple[Surface, MeshData]:
    """The surface of a project's mesh in the project's units, and all that its file holds. A file without
    a unit is in ``mesh.units``, or the project's."""
    surface, data = read_bare(path.parent / mesh.file, units.length, mesh.units)
    changes: dict[str, Any] = {}
    values: dict[str, dict[str, float]] = {kind: {} for kind in ("tensions", "pressures", "weights", "snows")}
    if mesh.tension is not None:
        loaded = {p.name for p in surface.patches if not p.auxiliary} - {*sheets_below(surface).values()}
        if all("tension" in mesh.patches.get(name, ()) for name in loaded):
            text = "mesh.tension: no patch under pressure is without its own in mesh.patches; leave it out"
            raise OptionError(text, what="mesh.tension", found=mesh.tension)
        values["tensions"] |= dict.fromkeys(loaded, mesh.tension)
    for name, own in mesh.patches.items():
        patch = surface.patches[surface.patch_index(name)]  # refuses one that is not there
        for key in own.keys() - {"wall"}:
            values[f"{key}s"][name] = own[key]
        if "wall" in own:  # without a pressure of its own, which follows from those beside it
            pressure = 0.0 if own["wall"] and name in data.bare else patch.pressure
            walled = replace(patch, wall=own["wall"], pressure=pressure)
            patches = changes.get("patches", surface.patches)
            changes["patches"] = [walled if p.name == name else p for p in patches]
    if len(mesh.supports):
        fixed = surface.original[_supported(surface, mesh.supports)]
        changes |= {"fixed": np.isin(surface.original, fixed), "on_plane": (), "on_line": ()}  # images, too
        changes["on_planes"] = tuple((plane, on) for plane, on in surface.on_planes if plane.mirror)
    if changes:
        surface = surface.rebuilt(**changes)
    if any(values.values()):
        surface = surface.retensioned(**values)
    return (surface.with_held_snow() if changes else surface), data


def _supported(surface: Surface, supports: str | Sequence[Any]) -> Bools:
    X, boundary = surface.vertices, np.zeros(surface.n, dtype=bool)
    outer = surface.topology.boundary_edge & ~surface.mirror_edge  # at a mirror the roof goes on
    boundary[surface.topology.edges[outer]] = True
    if isinstance(supports, str) and not boundary.any():
        text = f"mesh.supports: the surface has no boundary for {supports!r}; leave supports out,"
        raise OptionError(f"{text} or name points", what="mesh.supports", found=supports)
    if supports == BOUNDARY:
        return boundary
    height = surface.plane.height(X)
    if supports == GROUND:
        return np.asarray(boundary & (height <= height[boundary].min() + NEAR * surface.size))
    reach = 0.5 * float(segment_lengths(X, surface.topology.edges).mean())
    fixed = np.zeros(surface.n, dtype=bool)
    for number, one in enumerate(supports, start=1):
        points = np.empty(0)
        with suppress(TypeError, ValueError):
            points = np.array(one, dtype=float)
        if points.ndim not in (1, 2) or points.shape[-1:] != (3,) or not np.isfinite(points).all():
            validate.refuse("mesh.supports", one, "a point [x, y, z], or a list of points", str(number))
        line, away = np.atleast_2d(points), np.full(surface.n, np.inf)
        for a, b in pairwise(line) if len(line) > 1 else [(line[0], line[0])]:
            side = b - a
            part = np.clip((X - a) @ side / max(float(side @ side), 1e-300), 0.0, 1.0)
            away = np.minimum(away, np.linalg.norm(X - a - part[:, None] * side, axis=1))
        found = away <= NEAR * surface.size
        if len(line) == 1:
            found = (away == away.min()) & (away.min() <= reach)
            if NEAR * surface.size < away.min() <= reach:
                text = f"mesh.supports: number {number} is {away.min():.3g} from the nearest vertex, at"
                warnings.warn(f"{text} {point_text(X[found][0])}, which is fixed", FileWarning, stacklevel=4)
        if not found.any():
            text = f"mesh.supports: number {number}, {line.tolist()}, has no vertex of the mesh on it"
            raise OptionError(f"{text}; give points in the units of the project", what="mesh.supports")
        fixed |= found
    return fixed


def first_tensions(surface: Surface, mesh: MeshFile) -> tuple[Surface, list[Target], list[Parameter]]:
    """The mesh with first tensions for its rises, the targets, and what is to be found.

    The least tension of these caps is p times area over length of the boundary's projection.
    """
    if not mesh.rises:
        return surface, [], []
    edges, supported = surface.topology.edges, surface.supported
    outer = surface.topology.boundary_edge & ~surface.mirror_edge
    held = edges[outer if outer.any() else supported[edges].all(axis=1)]  # the rim of a cushion
    heights = surface.plane.height(surface.vertices[held[supported[held].all(axis=1)]])
    level = float(heights.mean()) if heights.size else 0.0
    below = sheets_below(surface).values()  # which keep their factor
    pressed = [p for p, loaded in zip(surface.patches, surface.roof, strict=True) if loaded]
    names, targets, vary = [p.name for p in pressed if p.name not in below], [], []
    roof = np.array([p.name in names for p in surface.patches])[surface.patch_of_face]
    vectors = area_vectors(surface.vertices[surface.faces[roof]])
    plan = float((vectors @ np.array(surface.plane.normal)).sum())  # below 0 if the triangles face down
    if max(p.net_pressure * plan for p in pressed) <= 0.0:
        text = f"{mesh.rises[0].kind} is for a roof that a pressure lifts, and none does here;"
        raise OptionError(f"{text} give another pressure, or a tension", what=mesh.rises[0].kind)
    least = abs(plan) / float(segment_lengths(surface.vertices, held).sum())
    for rise in mesh.rises:
        if rise.kind == "rise" and heights.size and np.ptp(heights) > NEAR * surface.size:
            text = f"{rise.kind}: the supports are not level, so a rise over them is not defined; give apex"
            raise OptionError(f"{text} instead, the greatest height over the plane", what=rise.kind)
        height = rise.value if rise.kind == "apex" else level + rise.value
        highest = max(first_tension(least, p.net_pressure, height - level) for p in pressed)
        surface = surface.retensioned(dict.fromkeys(names, highest))
        targets.append(Target("apex", None, height))
        vary.append(Parameter(names))
    return surface, targets, vary
