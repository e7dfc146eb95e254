"""A surface solved as its project says: remeshed, its targets met, as accurate as asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import count
from typing import Any

from ..accuracy import AccuracyStatus, solve_to_accuracy
from ..base.errors import OptionError
from ..certificate.diagnosis import VANISHED, vanished_films
from ..design import DesignStatus, NoStart, Target, meet
from ..design.targets import measure
from ..solvers import solve, solve_once
from ..solvers.neighbours import swap_neighbours
from ..solvers.result import Progress, Result, Status
from ..surface import Surface
from .checking import in_file
from .file import Project
from .outcome import OnStep, Outcome, ignore
from .settings import AccuracyWanted

FLATTER = 2.0  # times the first tensions for heights, where these are too low


def solve_project(project: Project, surface: Surface, progress: OnStep = ignore) -> Outcome:
    """Solve a surface with the project's options, remesh it, meet its targets; write nothing.

    Only a good roof is remeshed. The accuracy comes last; targets are met once more on its mesh.
    """
    notes = list[str]()
    about: dict[str, Any] = {"project": project, "unfold": project.output.whole}
    with in_file(project.path):
        for stage in project.remeshing:
            if stage.when == "before":
                progress("remeshing")
                surface, note = stage.remeshed(surface)
                notes.append(note)
        after = [stage for stage in project.remeshing if stage.when == "after"]
        if project.wanted.accuracy and not after and not project.targets:
            outcome = _solve_to_accuracy(project, surface, progress)
            return replace(outcome, notes=[*filter(None, notes), *outcome.notes], **about)
        flat = replace(project, options={**project.options, "order": None}) if after else project
        outcome = _solve_or_meet(flat if "order" in project.options else project, surface, progress)
        notes += outcome.notes
        for stage in after:
            if outcome.good:
                progress("remeshing")
                before, (surface, note) = outcome, stage.remeshed(outcome.surface)
                outcome = _again(project if stage is after[-1] else flat, surface, progress)
                notes += [note, *outcome.notes]
                notes += _met_before(project.targets, before, outcome)
        if project.wanted.accuracy and outcome.good:
            accurate = _solve_to_accuracy(project, outcome.surface, progress)
            if project.targets and accurate.good:
                outcome = replace(_again(project, accurate.surface, progress), accurate=accurate.accurate)
                notes += outcome.notes
            else:
                outcome = replace(accurate, design=outcome.design)
    return replace(outcome, notes=[note for note in notes if note], **about)


def solve_and_swap(project: Project, surface: Surface, report: OnStep) -> tuple[Outcome, bool]:
    """The same, with other neighbours of the project's films to ``swap``; and whether the surface has these.

    They are swapped on the first mesh and with the first tensions; what else the project asks for follows.
    """
    known = {patch.name for patch in surface.patches}
    for name in project.swap:
        if name != VANISHED:
            surface.patch_index(name)  # refuses an unknown one before the work
    options = {key: value for key, value in project.options.items() if key not in ("order", "levels")}
    first = replace(project, options=options, targets=(), remeshing=(), wanted=AccuracyWanted())
    outcome, kept = solve_project(first, surface, report), False
    surface, note = outcome.surface, "nothing swapped: no film or wall between two junctions has vanished"
    vanished = vanished_films(surface)
    if films := [film for name in project.swap for film in ([name] if name in known else vanished)]:
        report("swapping neighbours")
        how: dict[str, Any] = {"method": project.method, "callback": reporter(report), **options}
        swapped = swap_neighbours(surface, list(dict.fromkeys(films)), **how)
        if swapped.result.status is Status.STOPPED:
            raise KeyboardInterrupt
        surface, kept, note = swapped.surface, swapped.kept, swapped.message
    if kept or outcome.good:
        outcome = solve_project(project, surface, report)
    return replace(outcome, notes=[note, *outcome.notes], project=project), kept


def _again(project: Project, surface: Surface, report: OnStep) -> Outcome:
    """Solve the surface on another mesh, and meet the targets there."""
    outcome = _solve_or_meet(replace(project, targets=()), surface, report)
    if project.targets and outcome.good:  # otherwise its verdict is the better explanation
        outcome = _solve_or_meet(project, outcome.surface, report)
    return outcome


def _met_before(targets: Sequence[Target], before: Outcome, after: Outcome) -> list[str]:
    """Note that the targets were met on the mesh before, with which values, and what the finer reaches."""
    if before.design is None:
        return []
    values = ", ".join(f"{label} {value:.6g}" for label, value in before.design.parameters["value"].items())
    met = f"targets met on the first mesh, {before.surface.m} triangles, with {values}"
    where = f"on the new one, {after.surface.m} triangles"
    if after.design is not None:
        return [met if after.good else f"{met}; {where}, {after.design.status.value}"]

    reached = ", ".join(f"{target.label} {measure(after.surface, target).value:.6g}" for target in targets)
    return [f"{met}; {where}, the surface does not come to rest with them; it has {reached}"]


def _solve_or_meet(project: Project, surface: Surface, report: OnStep) -> Outcome:
    """Solve the surface, or meet its targets, and certify it.

    If the search finds no start, it starts again: from a flatter roof where heights are wanted, whose walls
    balance as its tensions are equal; then from the roof without targets, if that is certified.
    """
    if not project.targets:
        return _solve(project, surface, report)

    starts = [surface]
    if project.rises:
        names = [name for parameter in project.vary[-len(project.rises) :] for name in parameter.names]
        most = max(surface.patches[surface.patch_index(name)].tension for name in names)
        starts.append(surface.retensioned(dict.fromkeys(names, FLATTER * most)))
    for start in starts:
        with suppress(NoStart):
            return _meet(project, start, report)
    outcome = _solve(project, surface, report)
    if not outcome.good:
        return replace(outcome, notes=["targets not tried: without them there is no stable roof, either"])
    return _meet(project, outcome.surface, report)


def _solve(project: Project, surface: Surface, report: OnStep) -> Outcome:
    solver = solve if project.search else solve_once
    result = solver(surface, project.method, reporter(report), **project.options)
    return _certified(result, report, result.status is Status.STOPPED)


def _meet(project: Project, surface: Surface, report: OnStep) -> Outcome:
    _newton_alone(project, "meet targets")
    solves, tolerance = count(1), project.target_tolerance
    options: dict[str, Any] = {**project.options} | ({} if tolerance is None else {"tolerance": tolerance})
    options["callback"] = lambda row: report(f"meeting the targets: solve {next(solves)}")
    design = meet(surface, project.targets, project.vary, **options)
    return _certified(design.result, report, design.status is DesignStatus.STOPPED, design=design)


def _certified(result: Result, report: OnStep, stopped: bool, **found: Any) -> Outcome:
    """The outcome of a search, unless Ctrl-C ``stopped`` it, which ends the command."""
    if stopped:
        raise KeyboardInterrupt
    report("certifying")
    result.certificate  # noqa: B018 — computed here, while the progress is shown
    return Outcome(result, **found)


def _solve_to_accuracy(project: Project, surface: Surface, report: OnStep) -> Outcome:
    def callback(row: Mapping[str, Any]) -> None:
        report(f"accuracy: {row['triangles']} triangles, error {row['excess']:.2g} of the accuracy wanted")

    _newton_alone(project, "reach an accuracy")
    report("solving to the accuracy")
    accurate = solve_to_accuracy(surface, callback=callback, **vars(project.wanted), **project.options)
    return _certified(accurate.result, report, accurate.status is AccuracyStatus.STOPPED, accurate=accurate)


def _newton_alone(project: Project, act: str) -> None:
    if (found := project.method) != "newton":
        message = f"only method 'newton' can {act}, found {found!r}"
        raise OptionError(message, what="solve.method", found=found, expected="newton")


def reporter(report: OnStep) -> Callable[[Progress], None]:
    """A solver's callback that reports its step and the forces left."""

    def callback(state: Progress) -> None:
        force = state.row.get("residual", state.row["gradient_squared"])
        report(f"solving: step {state.iteration}, forces left {force:.1e}")

    return callback
