"""What would help a roof that finer meshes do not hold."""

from __future__ import annotations

import warnings
from dataclasses import replace

from ..advice.walls import firmer_walls
from ..base.errors import PcmcError
from ..plan import Plan
from .outcome import OnStep, Outcome, ignore
from .settings import AccuracyWanted
from .solving import Changed, solve_project


def firmer(outcome: Outcome, changed: Changed | None = None, progress: OnStep = ignore) -> list[str]:
    """What to type so that finer meshes hold a roof, too, where its mesh check finds that they do not.

    A line each; empty for other roofs, and where nothing helps of what is tried; ``changed`` as of
    ``run_project``.
    """
    check, project = outcome.mesh_check, outcome.project
    if check is None or check.verdict.name != "HELD_BY_MESH" or check.advice or outcome.advice:
        return []
    if project is None or project.plan is None:
        return []

    def persists(plan: Plan) -> bool:
        progress("looking for advice")
        plain = replace(project, plan=plan, remeshing=(), wanted=AccuracyWanted())
        try:
            start = plan.surface()
            trial = solve_project(plain, start if changed is None else changed(start))
        except PcmcError:
            return False
        found = trial.check_mesh() if trial.good else None
        return found is not None and found.persists

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the project's own warnings were shown
        return firmer_walls(project.plan, outcome.surface, project.where_to_type, persists)
