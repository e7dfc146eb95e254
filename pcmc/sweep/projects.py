"""Sweeps over a designer's own file: a project, or a surface, with some of its numbers replaced."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from .. import project as projects
from ..base.errors import FileError
from ..solvers import find_method
from .grid import Sweep
from .solving import row


def project_sweep(
    path: str | os.PathLike[str],
    grid: Mapping[str, Sequence[Any]],
    fixed: Mapping[str, Any] | None = None,
    *,
    method: str | None = None,
) -> Sweep:
    """The cases of a project at every combination of some of its numbers.

    Parameters
    ----------
    path : of a project (``.toml``) or a surface; as given, it must lead there from every worker too.
    grid, fixed : as of ``Sweep``, by the names of ``pcmc.project.varied``: ``NAME.tension`` and
        ``NAME.pressure`` of patches, and the numbers of the file, such as ``plan.edge_length``.
    method : in place of the project's, whose options are left out then.

    Raises
    ------
    OptionError, FileError, PlanError : for a project that cannot be read or meshed, an unknown name
        (with the nearest one), a value that cannot be; before any case is run.

    Examples
    --------
    >>> sweep = project_sweep("notebooks/roof.toml", {"corner.tension": [5, 6, 7]})
    >>> len(sweep), sweep.fixed["project"]
    (3, 'notebooks/roof.toml')
    """
    fixed = dict(fixed or {})
    if method is not None:
        find_method(method)
    about = {"project": Path(path).as_posix(), "project_digest": projects.digest(path)}
    if method is not None:
        about["method"] = method
    sweep = Sweep(solve_project, grid, about | fixed)
    projects.check_varied(path, dict(sweep.grid) | {name: [value] for name, value in fixed.items()})
    return sweep


def solve_project(
    project: str, project_digest: str, method: str | None = None, **values: Any
) -> dict[str, Any]:
    """Build, solve, remesh a project and meet its targets, with some of its numbers replaced; no output.

    Parameters
    ----------
    project : its file. project_digest : ``pcmc.project.digest`` of it when the sweep was declared, so
        that a case, and the store it is kept in, belongs to one state of the project.
    method : in place of the project's. values : as of ``pcmc.project.varied``.

    Returns
    -------
    dict : as of ``solve_case``; and ``targets_met``, where the project has targets.

    Raises
    ------
    FileError : the file is another one by now.
    """
    found = projects.digest(project)
    if found != project_digest:
        raise FileError(
            f"{project}: has changed since the sweep was begun (it had the digest {project_digest:.12}…, now"
            f" {found:.12}…); take the change back, or sweep anew with a new store"
        )
    design, start = projects.varied(project, values)
    if method not in (None, design.method):
        design = replace(design, method=method, options={})
    outcome = projects.solve_project(design, start)
    told = row(outcome.result, ("project", "project_digest", "method", *values))
    return told if outcome.design is None else told | {"targets_met": outcome.design.met}
