"""Sweeps over a designer's own file: a project, or a surface, with some of its numbers replaced."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from .. import project as projects
from ..base import validate
from ..base.errors import FileError
from ..base.files import PathLike
from ..project.varied import with_units
from .grid import Sweep
from .solving import case_row, mesh_columns


def project_sweep(
    path: PathLike,
    grid: Mapping[str, Sequence[Any]],
    fixed: Mapping[str, Any] | None = None,
    *,
    method: str | None = None,
    mesh_check: bool = False,
    search: bool = False,
) -> Sweep:
    """The cases of a project at every combination of some of its numbers.

    Parameters
    ----------
    path : of a project (``.toml``) or a surface; every worker must be able to open it by this path.
    grid, fixed : as of ``Sweep``, by the names of ``pcmc.project.varied``: ``NAME.tension`` and
        ``NAME.pressure`` of patches, the numbers of the file, such as ``plan.edge_length``, and shifts of
        lines, such as ``wall 1.x``.
    method : replaces the project's method and its options; a warning names these.
    mesh_check, search : as of ``solve_case``; the project's own key ``solve.mesh_check`` counts, too.

    Raises
    ------
    OptionError, FileError, PlanError : before any case runs: for a project that cannot be read or meshed, an
        unknown name (with the nearest known one), or a value that is not allowed.

    >>> sweep = project_sweep("notebooks/roof.toml", {"corner.tension": [5, 6, 7]})
    >>> len(sweep), sweep.fixed["project"]
    (3, 'notebooks/roof.toml')
    """
    fixed = dict(fixed or {})
    about: dict[str, Any] = {"project": Path(path).as_posix(), "project_digest": projects.digest(path)}
    if method is not None:
        projects.load(path).solved_by(method)
        about["method"] = method
    flags = {"mesh_check": mesh_check, "search": search}
    about |= {name: True for name, value in flags.items() if validate.flag(name, value)}
    sweep = Sweep(solve_varied, grid, about | fixed)
    projects.check_varied(path, dict(sweep.grid) | {name: [value] for name, value in fixed.items()})
    return sweep


def column_labels(path: PathLike, names: Iterable[str]) -> dict[str, str]:
    """The names of columns with the units of a project or a surface; see ``with_units``."""
    with warnings.catch_warnings(action="ignore"):  # the sweep showed them
        start = projects.start_of(projects.load(path))
    cables = {cable.name for cable in start.surface.cables}
    mine = cables - {patch.name for patch in start.surface.patches}
    return with_units(names, start.units, mine | {f"cable {name}" for name in cables})


def solve_varied(
    project: str,
    project_digest: str,
    method: str | None = None,
    mesh_check: bool = False,
    search: bool = False,
    **values: Any,
) -> dict[str, Any]:
    """Build and solve a project, with its remeshing and targets and some of its numbers replaced.

    ``project_digest`` is ``pcmc.project.digest`` of the file when the sweep was declared, as a case and its
    store belong to one state of the project: FileError if it has changed. The rest as of ``project_sweep``.

    Returns numbers as ``solve_case``, but none of a shape that is not at rest; for each name in the
    project's ``solve.margin`` the margin, its bar and what ends it, such as ``pressure.margin``; and
    ``targets_met`` and ``accuracy_reached``, if targets or an accuracy are asked for.
    With mirror planes they are those of the whole roof if the project has ``whole = true``, otherwise of the
    part between them; ``extent`` says which.
    """
    digest = projects.digest(project)
    if digest != project_digest:
        text = f"{project}: has changed since the sweep was begun (its digest was {project_digest:.12}…, now"
        text += f" it is {digest:.12}…); undo the change, or begin a new sweep with a new store"
        raise FileError(text, what=project, found=digest, expected=project_digest)
    design, start = projects.varied(project, values)
    if method is not None:
        design = design.solved_by(method)
    outcome = projects.solve_project(replace(design, search=search), start)
    names = ("project", "project_digest", "method", "mesh_check", "search", *values)
    answer = case_row(outcome.solved, names, outcome)
    if mesh_check or design.mesh_check:
        answer |= mesh_columns(outcome)
    for what in design.margin if outcome.certificate.index is not None else ():
        answer |= outcome.margin(what).numbers()
    answer |= {} if outcome.design is None else {"targets_met": outcome.design.met}
    return answer | ({} if outcome.accurate is None else {"accuracy_reached": outcome.accurate.reached})
