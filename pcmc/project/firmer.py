"""What would help a roof that finer meshes do not hold, or that is stable and misses its targets."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain

from ..advice.advice import coarse
from ..advice.persisting import firmer_walls, flatter
from ..advice.rises import Rise, take_rises, with_rises
from ..base.errors import PcmcError
from ..plan import Plan
from .outcome import OnStep, Outcome, ignore
from .settings import AccuracyWanted
from .solving import Changed, solve_project


def firmer(outcome: Outcome, changed: Changed | None = None, progress: OnStep = ignore) -> list[str]:
    """What to type where the mesh check finds that finer meshes do not hold a roof, or it misses its targets.

    Each is tried and persists. A line each; empty for other roofs, for those with other advice, and where
    nothing helps of what is tried; ``changed`` as of ``run_project``.
    """
    check, project, design = outcome.mesh_check, outcome.project, outcome.design
    if check is None or check.advice or outcome.advice or project is None or project.plan is None:
        return []
    held = check.verdict.name == "HELD_BY_MESH"
    if not held and (design is None or design.met):
        return []
    own = len(project.targets) - len(project.rises)
    sought = project.vary[: len(project.vary) - len(project.rises)]

    def persists(plan: Plan, rises: Sequence[Rise]) -> bool:
        progress("looking for advice")
        try:
            plan, targets, vary = with_rises(coarse(plan, outcome.surface), rises)
            plain = replace(project, plan=plan, remeshing=(), wanted=AccuracyWanted())
            plain = replace(plain, targets=[*project.targets[:own], *targets], vary=[*sought, *vary])
            start = plan.surface()
            trial = solve_project(plain, start if changed is None else changed(start))
        except PcmcError:
            return False
        found = trial.check_mesh() if trial.good else None
        return found is not None and found.persists

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the project's own warnings were shown
        tried = [firmer_walls(project.plan, outcome.surface, project.rises)]
        tried += [flatter(project.plan, project.rises)] if held else []
        for plan, rises, lines in chain(*tried):
            if persists(plan, rises):
                if rises and rises is not project.rises and not take_rises(project.data)[1]:  # by an option
                    return [f"try --{rises[0].kind.replace('_', '-')} {rises[0].value:g}, which persists"]
                return [f"{project.where_to_type}, which was tried and persists:", *lines]
    return []
