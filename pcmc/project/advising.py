"""What to type where a roof does not come to rest, misses its targets, or is not held by finer meshes."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from typing import NamedTuple

from ..advice.advice import changes, coarse, firmer_walls, flatter, improved, loosened, lower_lines
from ..advice.rises import SHARES, as_sail, point_masts, ring_lines, take_rises, with_rings, with_rises
from ..base.arrays import toml, toml_key
from ..base.errors import PcmcError
from ..certificate.balance import strained_junction
from ..design import Target
from ..plan import Plan
from ..surface import Surface
from .file import Project
from .outcome import OnStep, Outcome, ignore
from .settings import AccuracyWanted
from .solving import solve_project

Changed = Callable[[Surface], Surface]
TRIES = 3  # plans tried


class Mended(NamedTuple):
    """A plan that was changed until its roof comes to rest, and what was changed."""

    plan: Plan
    rests: bool
    sail: bool = False  # cables instead of free edges
    rings: Sequence[str] = ()  # what to type or draw for rings instead of single points


def advice(project: Project, given: Surface, start: Surface, outcome: Outcome) -> list[str]:
    """What to type so that a project comes to rest and meets its targets: a heading, and a line a change.

    ``given`` is the start shape of the project, ``start`` the one that was solved, with the command's
    tensions, and ``outcome`` how that ended.
    """
    plan, certified = project.plan, outcome.certificate.certified
    if certified and (plan is None or outcome.design is None or outcome.design.met):
        return []
    if plan is None or start is not given:
        strained = strained_junction(start)
        if strained is None or strained.remedy is None:
            return []
        return ["add to the command:", f"--tension {strained.remedy[0]!r}={strained.remedy[1]:g}"]
    with warnings.catch_warnings(action="ignore"):  # the project's own warnings were shown
        mended = Mended(plan, True) if certified else _mended(project, plan, outcome)
        better, targets, met, reached = mended.plan, project.targets, False, ""
        if mended.sail and project.rises:
            targets = targets[: -len(project.rises)]
        if mended.rests and targets:
            better, met, reached = _with_targets(project, better, outcome.surface, targets)
        lines = changes(plan, better, project.rises if mended.sail else ())
    if not (lines or mended.rings):
        return []
    tried = "which was tried and comes to rest" if mended.rests else "as a first step"
    tried += ", on finer meshes, too" if mended.rings else ""
    if met:
        tried = "which was tried, comes to rest and meets the targets"
    elif mended.rests and targets:
        tried = "which was tried without the targets and comes to rest"
    where = project.where_to_type
    if project.drawing is not None and mended.rings:
        where = f"draw in {project.drawing.path.name}" + (f" and {where}" if lines else "")
    ending = [f"with them, the targets are {reached}"] if reached else []
    causes = ["edges that nothing holds"] if mended.sail else []
    causes += ["a roof held at a single point"] if mended.rings else []
    cause = f"the cause is {' and '.join(causes)}; " if causes else ""
    return [f"{cause}{where}, {tried}:", *lines, *mended.rings, *ending]


def _mended(project: Project, plan: Plan, outcome: Outcome) -> Mended:
    """The plan with other supports if these alone bring it to rest; else with other tensions and walls.

    Free edges get cables; single points get rings, from the size for their heights on, which finer meshes
    hold, too.
    """
    alone = replace(project, targets=())
    sail, masts = as_sail(plan, project.rises), point_masts(plan)
    base, shares = plan if sail is None else sail, [0.0] if sail is not None else []
    if masts:
        fit = all(mast.has_room and not mast.in_mirror for mast in masts)
        shares = [share for share in SHARES if fit and share >= max(mast.share for mast in masts)]
    for share in shares:
        changed = with_rings(base, masts, share)
        trial = _tried(alone, changed, outcome.surface)
        if trial is None or not trial.good or (masts and not _holds(trial)):
            continue
        rings = ring_lines(masts, share, drawn=project.drawing is not None)
        for old, new in zip(plan.patches, changed.patches, strict=True) if project.drawing is None else ():
            if old.at != new.at:  # it was inside a ring
                change = f"at = {toml(new.at)}  (now {toml(old.at)})"
                rings.append(f"[plan.patches] {toml_key(new.name)}: {change}")
        return Mended(changed, True, sail is not None, rings)
    better, certificate = plan, outcome.certificate
    for _ in range(TRIES):
        before, better = better, improved(better, certificate)
        trial = _tried(alone, better, outcome.surface) if changes(before, better) else None
        if trial is None:  # nothing left to change, or too coarse for this plan
            break
        if trial.good:
            return Mended(better, True)
        certificate = trial.certificate
    return Mended(better, False)


def _with_targets(
    project: Project, plan: Plan, surface: Surface, targets: Sequence[Target]
) -> tuple[Plan, bool, str]:
    """The first plan that meets the targets, and whether one does; else the plan, and what it reaches."""
    reached = ""
    for candidate in (plan, loosened(plan, project.vary)):
        if candidate is project.plan or candidate is None:  # tried already, or nothing to loosen
            continue
        trial = _tried(replace(project, targets=targets), candidate, surface)
        if trial is not None and trial.good:
            return candidate, True, ""
        if trial is not None and trial.design is not None:
            reached = reached or trial.design.text(project.units)
    return plan, False, reached


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
    held = check.verdict.name == "HELD_BY_MESH"
    if project.swap or (not held and (design is None or design.met)):  # swapped: not of the plan
        return ""
    own, ways = (len(some) - len(project.rises) for some in (project.targets, project.vary))
    with warnings.catch_warnings(action="ignore"):  # the project's own warnings were shown
        ideas = [firmer_walls(project.plan, outcome.surface, project.rises)]
        ideas += [flatter(project.plan, project.rises)] if held else []
        ideas += [lower_lines(project.plan)] if held and project.drawing is None else []
        for plan, rises, lines in chain(*ideas):
            step("")
            with suppress(PcmcError):  # a height that is too low for a raised outline
                plan, targets, vary = with_rises(plan, rises)
                targets, vary = [*project.targets[:own], *targets], [*project.vary[:ways], *vary]
                wanted = replace(project, targets=targets, vary=vary)
                trial = _tried(wanted, plan, outcome.surface, changed, step)
                if trial is None or not trial.good or not _holds(trial, step):
                    continue
                if rises and rises is not project.rises and not take_rises(project.data)[1]:  # by an option
                    return f"try --{rises[0].kind.replace('_', '-')} {rises[0].value:g}, which persists"
                return "\n  ".join([f"{project.where_to_type}, which was tried and persists:", *lines])
    return ""


def _tried(
    project: Project, plan: Plan, surface: Surface, changed: Changed | None = None, step: OnStep = ignore
) -> Outcome | None:
    """How a plan ends on a mesh that is not fine; None if it has none, as with a patch inside a ring."""
    try:
        plan = coarse(plan, surface)
        start = plan.surface()
        plain = replace(project, plan=plan, remeshing=(), wanted=AccuracyWanted())
        return solve_project(plain, start if changed is None else changed(start), step)
    except PcmcError:
        return None


def _holds(roof: Outcome, step: OnStep = ignore) -> bool:
    check = roof.check_mesh(step)
    return check is not None and check.persists
