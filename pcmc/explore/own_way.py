"""A project's own way to a roof: from its start shape, with walls balanced beside the tensions asked for."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection
from copy import deepcopy
from pathlib import Path

from .. import project as projects
from ..base.errors import MissingExtra, PcmcError
from ..meshing.remeshing import remesh
from ..solvers.result import Result
from ..surface import Surface
from .following import AT_REST, attempt, values_of, wanted


def own_start(path: Path, asked: Surface, moved: Collection[str] = ()) -> Surface | None:
    """The start shape of a project with the values of a surface; None where the project has none for them.

    Walls have the tensions that the project gives them beside the new tensions of its patches; those in
    ``moved`` have the surface's.
    """
    values = values_of(asked)
    walls = {patch.name for patch in asked.patches if patch.wall} - set(moved)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # they were shown when the project was opened
            data = deepcopy(projects.read_data(path)[1])
            patches = data.setdefault("plan", {}).setdefault("patches", {})
            if not isinstance(patches, dict):
                return None
            for patch in asked.patches:
                if not patch.auxiliary:
                    patches.setdefault(patch.name, {})["tension"] = patch.tension
            start = projects.surface_of(projects.project_of(path, data))
        kept = {name: tension for name, tension in values["tensions"].items() if name not in walls}
        return wanted(start, {**values, "tensions": kept})
    except (PcmcError, MissingExtra):  # such as for a file that holds another plan by now
        return None


def solved_own_way(path: Path, start: Surface, stop: Callable[[], bool]) -> Result | None:
    """A start shape solved, remeshed and solved again as its project asks for; None where that fails."""
    try:
        stages = projects.load(path).remeshing
        for stage in (one for one in stages if one.when == "before"):
            start = remesh(start, **stage.options)
        result = attempt(start, stop, target="minimum")
        for stage in (one for one in stages if one.when == "after"):
            if result.certificate.verdict not in AT_REST:
                return None
            result = attempt(remesh(result.surface, **stage.options), stop, target="minimum")
    except (PcmcError, MissingExtra):
        return None
    return result if result.certificate.verdict in AT_REST else None
