"""From a project to its outcome: built, solved, remeshed, aimed at its targets, certified, written."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.errors import BalanceWarning, OptionError, PcmcError
from ..base.files import folder as made
from ..certificate.balance import unbalanced
from ..certificate.certificate import Certificate
from ..contact.pinching import find_walls
from ..meshing.remeshing import remesh
from ..solvers import solve
from ..solvers.result import Progress, Result, Status
from ..surface import Surface
from .file import Project, load, surface_of
from .output import PathLike, Say, check_names, check_outputs, save, silent

if TYPE_CHECKING:
    from ..design import Design


@dataclass(frozen=True, eq=False)
class Outcome:
    """The end of a project: the result, its certificate, the files written.

    ``design`` is the search for targets, None where the project has none.
    """

    result: Result
    files: Sequence[Path]
    design: Design | None = None

    @property
    def surface(self) -> Surface:
        """The surface reached."""
        return self.result.surface

    @property
    def certificate(self) -> Certificate:
        """Of the surface reached."""
        return self.result.certificate

    @property
    def good(self) -> bool:
        """Whether the surface is certified and every target met."""
        return self.certificate.certified and (self.design is None or self.design.met)


def run(
    path: PathLike, out_dir: PathLike | None = None, progress: Say | None = None, *,
    anyway: bool = False,
) -> Outcome:  # fmt: skip
    """Build, solve, meet the targets, certify, and write all of a project's output.

    Parameters
    ----------
    path : the project file.
    out_dir : folder for the output, made if it is missing; by default that of the project file.
    progress : called with a few words at each step.
    anyway : write the output even if the surface is not certified or misses a target.

    Returns
    -------
    Outcome
        Nothing is written, and ``files`` is empty, if the surface is not certified or misses a target.

    Raises
    ------
    FileError, PlanError, OptionError : in one line, with the file; nothing is written then.

    Warns
    -----
    BalanceWarning : before solving, where the tensions at a junction cannot balance.
    """
    project = load(path)
    return carry_out(
        project.in_folder(project.path.parent if out_dir is None else out_dir),
        progress, anyway=anyway,
    )  # fmt: skip


def carry_out(
    project: Project, progress: Say | None = None, *,
    changed: Callable[[Surface], Surface] | None = None, anyway: bool = False,
) -> Outcome:  # fmt: skip
    """A project already loaded, as ``run``; ``changed`` is applied to the surface it starts from."""
    say, outputs = progress or silent, project.outputs
    check_names(project.files, project.picture)
    check_outputs(outputs, project.folder)
    say("reading" if project.plan is None else "meshing the plan")
    start = surface_of(project)
    start = start if changed is None else changed(start)
    _check_balance(start)
    outcome = settle(project, start, say)
    if not outputs or not (outcome.good or anyway):
        return outcome
    with made(project.folder or Path()):
        written = save(
            outcome.result, project.files, project.picture,
            view=project.view, colour=project.colour, progress=say,
        )  # fmt: skip
    return replace(outcome, files=written)


def _check_balance(surface: Surface) -> None:
    """Say before a long search what the tensions alone tell; it is made all the same."""
    pinchable = find_walls(surface).pinchable
    found = unbalanced(surface, pinchable)
    if found:
        unless = ", unless the junction rests on the plane" if pinchable.any() else ""
        warnings.warn(f"{found}{unless}; solving all the same", BalanceWarning, stacklevel=3)


def settle(project: Project, surface: Surface, progress: Say | None = None) -> Outcome:
    """Solve a surface as the project says, remesh it, meet its targets; nothing is written.

    A surface that is not certified, or misses a target, is not remeshed any further.
    """
    say = progress or silent
    stages = [m for m in project.remeshing if m.when == "after"]
    try:
        for first in project.remeshing:
            if first.when == "before":
                say("remeshing")
                surface = remesh(surface, **first.options)
        outcome = _at_rest(project, surface, say)
        for stage in stages:
            if not outcome.good:
                break
            say("remeshing")
            surface = remesh(outcome.surface, **stage.options)
            outcome = _at_rest(replace(project, targets=()), surface, say)
            if project.targets and outcome.good:  # else its verdict tells more than a search would
                outcome = _at_rest(project, outcome.surface, say)
    except PcmcError as error:
        raise type(error)(f"{project.path}: {error}") from None
    return outcome


def _at_rest(project: Project, surface: Surface, say: Say) -> Outcome:
    """The surface solved, or its targets met, and certified."""
    design = _aim(project, surface, say) if project.targets else None
    if design is not None:
        result = design.result
    else:
        result = uninterrupted(solve(surface, project.method, reporter(say), **project.options))
    say("certifying")
    result.certificate  # noqa: B018 — computed here, while the progress is shown
    return Outcome(result, (), design)


def uninterrupted(result: Result) -> Result:
    """The result; a solver answers Ctrl-C with the best surface so far, a command is to end."""
    if result.status is Status.STOPPED:
        raise KeyboardInterrupt
    return result


def reporter(say: Say) -> Callable[[Progress], None]:
    """A solver's callback that tells how far it is."""

    def report(state: Progress) -> None:
        force = state.row.get("residual", state.row["gradient_squared"])
        say(f"solving: step {state.iteration}, forces left {force:.1e}")

    return report


def _aim(project: Project, surface: Surface, say: Say) -> Design:
    from ..design import DesignStatus, meet  # needed by projects with targets only

    if project.method != "newton":
        raise OptionError(f"targets are met with method 'newton' only, found {project.method!r}")
    count = iter(range(1, 10**6))
    design = meet(
        surface, project.targets, project.vary,
        callback=lambda row: say(f"meeting the targets: solve {next(count)}"), **project.options,
    )  # fmt: skip
    if design.status is DesignStatus.STOPPED:  # as in ``uninterrupted``
        raise KeyboardInterrupt
    return design
