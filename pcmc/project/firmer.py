"""What would help a roof that finer meshes do not hold, or that is stable and misses its targets."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain
from typing import cast

from ..advice.advice import coarse
from ..advice.persisting import firmer_walls, flatter, lower_lines
from ..advice.rises import Rise, take_rises, with_rises
from ..base.errors import PcmcError
from ..plan import Plan
from ..surface import Surface
from .file import Project
from .outcome import OnStep, Outcome, ignore
from .settings import AccuracyWanted
from .solving import solve_project

Changed = Callable[[Surface], Surface]


def firmer(outcome: Outcome, changed: Changed | None = None, progress: OnStep = ignore) -> str:
    """What to type where the mesh check finds that finer meshes do not hold a roof, or it misses its targets.

    Each change is tried and persists. Looked for once; the mesh check, which is made if it is wanted, has it
    as its ``advice`` from then on. Empty for other roofs, for those with other advice, and where nothing
    helps of what is tried. ``changed`` is as of ``run_project``; ``progress`` is called at every step.
    """
    if outcome.mesh_check is None and outcome.wants_mesh_check():
        outcome.check_mesh(progress)
    return outcome.advise(lambda: _found(outcome, changed, lambda _: progress("looking for advice")))


def _found(outcome: Outcome, changed: Changed | None, step: OnStep) -> str:
    check, project, design = outcome.mesh_check, outcome.project, outcome.design
    if check is None or check.advice or outcome.advice or project is None or project.plan is None:
        return ""
    if project.swap:  # the roof has other neighbours than the plan
        return ""
    held = check.verdict.name == "HELD_BY_MESH"
    if not held and (design is None or design.met):
        return ""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the project's own warnings were shown
        tried = [firmer_walls(project.plan, outcome.surface, project.rises)]
        tried += [flatter(project.plan, project.rises)] if held else []
        tried += [lower_lines(project.plan)] if held and project.drawing is None else []
        for plan, rises, lines in chain(*tried):
            if _persists(replace(project, plan=coarse(plan, outcome.surface)), rises, changed, step):
                if rises and rises is not project.rises and not take_rises(project.data)[1]:  # by an option
                    return f"try --{rises[0].kind.replace('_', '-')} {rises[0].value:g}, which persists"
                return "\n  ".join([f"{project.where_to_type}, which was tried and persists:", *lines])
    return ""


def _persists(project: Project, rises: Sequence[Rise], changed: Changed | None, step: OnStep) -> bool:
    """Whether the roof of a plan with these heights instead of the project's is good on finer meshes, too."""
    step("")
    own, ways = len(project.targets) - len(project.rises), len(project.vary) - len(project.rises)
    try:
        plan, targets, vary = with_rises(cast(Plan, project.plan), rises)
        targets, vary = [*project.targets[:own], *targets], [*project.vary[:ways], *vary]
        plain = replace(project, plan=plan, remeshing=(), wanted=AccuracyWanted(), targets=targets, vary=vary)
        start = plan.surface()
        trial = solve_project(plain, start if changed is None else changed(start), step)
    except PcmcError:
        return False
    found = trial.check_mesh(step) if trial.good else None
    return found is not None and found.persists
