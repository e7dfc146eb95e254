"""The start shape of a project: the mesh of its plan, or the mesh in its file."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..base.errors import PlanError
from ..base.units import Units
from ..io.mesh_data import MeshData
from ..surface import Surface
from .file import PathLike, Project, in_file, load
from .mesh import first_tensions, read_mesh


@dataclass(frozen=True, eq=False)
class Start:
    """The start shape of a project.

    Attributes
    ----------
    surface : before it is solved.
    units : of its numbers.
    project : the project, with the targets for the rise of a mesh, which its file does not name.
    data : all that the file of a mesh holds; None for a plan.
    """

    surface: Surface
    units: Units
    project: Project
    data: MeshData | None = None

    def with_surface(self, surface: Surface) -> Start:
        """The same with another surface."""
        return replace(self, surface=surface, data=None)


def start_of(project: Project) -> Start:
    """The start shape of a project. Errors as in ``load``."""
    if project.mesh is not None:
        surface, data = read_mesh(project.path, project.mesh, project.units)
        units = Units(data.units.length, project.units.force or data.units.force)
        surface, targets, vary = first_tensions(surface, project.mesh)
        if targets:
            project = replace(project, targets=[*project.targets, *targets], vary=[*project.vary, *vary])
        return Start(surface, units, project, data)
    assert project.plan is not None
    layers = {} if project.drawing is None else project.drawing.layers
    with in_file(project.path):
        try:
            return Start(project.plan.surface(), project.units, project)
        except PlanError as error:
            if error.what not in layers:
                raise
            text = f"{error} ({layers[str(error.what)]})"
            raise PlanError(text, what=error.what, where=error.where, found=error.found) from None


def surface_of(project: Project) -> Surface:
    """The start shape of a project, as a surface alone."""
    return start_of(project).surface


def build(path: PathLike) -> Surface:
    """The start shape of the project in a file. Errors as in ``load``."""
    return surface_of(load(path))
