"""Projects solved: opened or designed for commands, pages and notebooks; or run, with all their files."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..advice.advice import Task, advice, apexes_below_supports, chosen_values
from ..base.errors import BalanceWarning, OptionError
from ..base.files import PathLike
from ..base.files import folder as output_folder
from ..certificate.balance import unbalanced
from ..certificate.diagnosis import VANISHED, vanished_films
from ..forces.pinching import standing_part
from ..io import metres_note
from ..plan import Plan
from ..solvers import solve, solve_once
from ..solvers.result import Progress, Result, Status
from ..structure.calculix import expect_program
from ..surface import Surface
from . import cache
from .checking import in_file
from .file import Project, load
from .outcome import EXTENSIVE, OnStep, Outcome, ignore
from .settings import AccuracyWanted, of_material
from .start import start_of
from .writing import check_outputs, project_files, write_all

if TYPE_CHECKING:
    from ..design import Target

Changed = Callable[[Surface], Surface]


def opened(
    path: Project | PathLike,
    progress: OnStep | None = None,
    *,
    units: str = "",
    start: bool = False,
    changed: Changed | None = None,
    use_cache: bool = True,
) -> Outcome:
    """What is in a file: the designed roof of a project or a drawing, or the surface in any other file.

    ``units`` is the unit of length that the roof is to be in; with ``start`` a project has its start shape,
    not solved. The others are as of ``designed``. Errors as in ``load`` and ``pcmc.read``.

    >>> roof = opened("notebooks/roof.toml", start=True)
    >>> roof.result is None, roof.certificate.certified
    (True, False)
    """
    project = path if isinstance(path, Project) else load(path, units=units)
    if project.specified and not start:
        return designed(project, progress, changed=changed, use_cache=use_cache)
    return start_of(project).changed(changed)


def designed(
    project: Project | PathLike,
    progress: OnStep | None = None,
    *,
    changed: Changed | None = None,
    use_cache: bool = True,
) -> Outcome:
    """The roof that a project describes: solved, its targets met, remeshed, as accurate as asked for.

    Nothing is written but the cache: a good roof is kept there, and comes from there the next time. A roof
    that is not certified, or misses a target, is solved again each time.

    Parameters
    ----------
    project : a Project, or the path of its file.
    progress : called with a few words at each step.
    changed : applied to the initial surface; such a roof is neither kept nor taken from the cache.
    use_cache : False solves in any case, and keeps nothing.

    Returns
    -------
    Outcome : ``surface`` is the roof, ``good`` whether it is what the project asks for. With ``whole = true``
        ``shown`` is the whole roof.

    Errors and warnings as of ``run``; KeyboardInterrupt for Ctrl-C, and nothing is kept.

    Examples
    --------
    >>> roof = designed("notebooks/roof.toml")
    >>> roof.good, [f"{area:.0f}" for area in roof.certificate.patches["area"][:3]]
    (True, ['78', '174', '150'])
    """
    if not isinstance(project, Project):
        project = load(project)
    use_cache = use_cache and changed is None
    known = cache.cached(project) if use_cache else None
    if known is not None:
        return replace(known, unfold=project.output.whole, project=project)
    outcome = solve_from_start(project, progress or ignore, changed)
    if use_cache:
        cache.keep(project, outcome)
    return outcome


def run(
    path: PathLike, out_dir: PathLike | None = None, progress: OnStep | None = None, *, anyway: bool = False
) -> Outcome:
    """Mesh, solve, meet the targets, certify, and write all output of a project.

    Parameters
    ----------
    path : the project file.
    out_dir : folder for the output, made if it is missing; by default that of the project file.
    progress : called with a few words at each step.
    anyway : write the output even if the surface is not certified or misses a target.

    Returns
    -------
    Outcome : ``files`` is empty, and nothing is written, if the surface is not certified or misses a target.

    Raises
    ------
    FileError, PlanError, OptionError : one line that names the file. Nothing is written.

    Warns
    -----
    BalanceWarning : before solving, if the tensions at a junction cannot balance.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> plan = "[plan]\\noutline = [[0, 0], [6, 0], [6, 4], [0, 4]]\\ntension = 3.0\\n"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "hall.toml")
    ...     _ = path.write_text(plan + '[output]\\nfiles = ["hall.pcmc"]', encoding="utf-8")
    ...     outcome = run(path)
    >>> outcome.good, outcome.certificate.verdict.name, [file.name for file in outcome.files]
    (True, 'STABLE', ['hall.pcmc'])
    """
    project = load(path)
    project = project if out_dir is None else project.in_folder(out_dir)
    return run_project(project, progress, anyway=anyway)


def run_project(
    project: Project,
    progress: OnStep | None = None,
    *,
    changed: Changed | None = None,
    anyway: bool = False,
    use_cache: bool = True,
    check_after: bool = True,
    swap: Sequence[str] = (),
) -> Outcome:
    """As ``run``, for a loaded project; ``changed`` is applied to its initial surface, solved in any case.

    ``swap`` names films and walls whose neighbours are to be swapped, see ``swap_neighbours``; ``VANISHED``
    are all that have vanished. Such a roof is not kept in the cache.

    The mesh check comes last, so that Ctrl-C during it leaves the files; before a report, which shows it.
    Without ``check_after`` the caller makes it.
    """
    progress = progress or ignore
    project = project if project.folder is not None else project.in_folder(project.path.parent)
    outputs = project.output.paths
    check_outputs(outputs, project.folder, inputs=project.inputs)
    outcome = solve_from_start(project, progress, changed, swap)
    if project.output.whole:
        progress("certifying the whole")
        outcome.whole  # noqa: B018 — computed here, while the progress is shown
    for what in project.margin if outcome.certified else ():
        outcome.margin(what, progress)
    if outcome.good or anyway:
        with in_file(project.path):
            outcome.analysis(anyway, progress)
    if outputs and (outcome.good or anyway):
        jobs = project_files(project, outcome, anyway, progress)
        with output_folder(project.folder or Path()):
            outcome = replace(outcome, files=write_all(jobs, progress))
    if use_cache and changed is None and not swap:
        cache.keep(project, outcome)
    if check_after and project.mesh_check and outcome.wants_mesh_check():
        outcome.check_mesh(progress)
    return outcome


def solve_from_start(
    project: Project, report: OnStep, changed: Changed | None, swap: Sequence[str] = ()
) -> Outcome:
    """Make the start shape of a project, and solve it; ``changed`` and ``swap`` as of ``run_project``."""
    report("reading" if project.plan is None else "meshing the plan")
    given = start_of(project)
    start = given.changed(changed)
    project, surface = start.project or project, start.surface
    _check_wishes(project, surface)
    solved, swapped = _solve_and_swap(project, surface, report, swap)
    notes = [*solved.notes]
    starts = [v for v in project.vary if v.value(surface) != v.value(given.surface)]  # given by ``changed``
    if starts:
        label, more = starts[0].label, " and others" * (len(starts) > 1)
        notes.append(f"{label}{more}: the value given is where the search begins; the targets decide it")
    if project.has_file:  # a drawing alone is proposed as a whole
        notes = [*chosen_values(project.plan, project.chosen.text, surface), *notes]
    if project.drawing is not None or start.data is not None:
        notes += metres_note(project.output.files, start.units.length)
    if project.output.whole and any(target.quantity in EXTENSIVE for target in project.targets):
        notes.append("targets of areas, volumes and lengths are those of the part between the mirror planes")
    outcome = replace(solved, notes=notes, units=start.units, data=start.data)
    if outcome.good or swapped:
        return outcome
    notes += apexes_below_supports(project.plan, surface, project.targets, start.units)
    report("looking for advice")
    drawing = "" if project.drawing is None else project.drawing.path.name
    names = ("rises", "targets", "vary", "method", "options", "units")
    task = Task(project.plan, project.where_to_type, drawing, *(getattr(project, name) for name in names))

    def try_plan(plan: Plan, surface: Surface, targets: Sequence[Target]) -> Outcome:
        plain = replace(project, plan=plan, targets=targets, remeshing=(), wanted=AccuracyWanted())
        return solve_project(plain, surface)

    return replace(outcome, advice=advice(task, given.surface, surface, outcome, try_plan))


def _check_wishes(project: Project, surface: Surface) -> None:
    """Refuse what the surface cannot give, and warn where a junction cannot balance, before the work."""
    with in_file(project.path):
        structure, output = project.structure, project.output
        if project.output.whole and not any(plane.mirror for plane, _ in surface.on_planes):
            text = "the roof has no mirror planes, so it is the whole already; leave out whole"
            raise OptionError(f"{text}, or give the plan mirrors", what="whole")
        if structure is not None and (output.structure is not None or structure.run):
            structure.check(surface, project.plan, output.whole)
        if structure is not None and structure.run:
            expect_program()
        if project.pattern is not None and (output.pattern or output.report):
            of_material(project.pattern, structure, surface)
        if project.margin:
            from ..accuracy.varied import Varied  # takes long to import

            for what in project.margin:
                Varied.of(surface, what)
    pinchable = standing_part(surface).walls.pinchable
    if imbalance := unbalanced(surface, pinchable):
        unless = ", unless the junction rests on the plane" if pinchable.any() else ""
        warnings.warn(f"{imbalance.imbalance}{unless}; solving anyway", BalanceWarning, stacklevel=4)


def _solve_and_swap(
    project: Project, surface: Surface, report: OnStep, names: Sequence[str]
) -> tuple[Outcome, bool]:
    """Solve a surface, with other neighbours of the named films; and whether it has these.

    They are swapped on the first mesh and with the first tensions; what else the project asks for follows.
    """
    if not names:
        return solve_project(project, surface, report), False
    from ..equilibria import swap_neighbours  # takes long to import

    known = {patch.name for patch in surface.patches}
    for name in names:
        if name != VANISHED:
            surface.patch_index(name)  # refuses an unknown one before the work
    options = {key: value for key, value in project.options.items() if key not in ("order", "levels")}
    first = replace(project, options=options, targets=(), remeshing=(), wanted=AccuracyWanted())
    outcome, kept = solve_project(first, surface, report), False
    surface, note = outcome.surface, "nothing swapped: no film or wall between two junctions has vanished"
    vanished = vanished_films(surface)
    if films := [film for name in names for film in ([name] if name in known else vanished)]:
        report("swapping neighbours")
        how: dict[str, Any] = {"method": project.method, "callback": reporter(report), **options}
        swapped = swap_neighbours(surface, list(dict.fromkeys(films)), **how)
        if swapped.result.status is Status.STOPPED:
            raise KeyboardInterrupt
        surface, kept, note = swapped.surface, swapped.kept, swapped.message
    if kept or outcome.good:
        outcome = solve_project(project, surface, report)
    return replace(outcome, notes=[note, *outcome.notes], project=project), kept


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
    from ..design.targets import measure  # needed by projects with targets only

    reached = ", ".join(f"{target.label} {measure(after.surface, target).value:.6g}" for target in targets)
    return [f"{met}; {where}, the surface does not come to rest with them; it has {reached}"]


def _solve_or_meet(project: Project, surface: Surface, report: OnStep) -> Outcome:
    """Solve the surface, or meet its targets, and certify it.

    If the search finds no start, it starts again from the roof without targets, if that is certified.
    """
    if not project.targets:
        return _solve(project, surface, report)
    from ..design import NoStart  # needed by projects with targets only

    try:
        return _meet(project, surface, report)
    except NoStart:
        outcome = _solve(project, surface, report)
        if not outcome.good:
            return replace(outcome, notes=["targets not tried: without them there is no stable roof, either"])
        return _meet(project, outcome.surface, report)


def _solve(project: Project, surface: Surface, report: OnStep) -> Outcome:
    solver = solve if project.search else solve_once
    result = solver(surface, project.method, reporter(report), **project.options)
    return _certified(result, report, result.status is Status.STOPPED)


def _meet(project: Project, surface: Surface, report: OnStep) -> Outcome:
    from ..design import DesignStatus, meet  # needed by projects with targets only

    _newton_alone(project, "meet targets")
    solves, options = count(1), dict(project.options)
    options["callback"] = lambda row: report(f"meeting the targets: solve {next(solves)}")
    if project.target_tolerance is not None:
        options["tolerance"] = project.target_tolerance
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
    """Solve on finer and finer meshes, and certify."""
    from ..accuracy import AccuracyStatus, solve_to_accuracy

    def callback(row: Mapping[str, Any]) -> None:
        report(f"accuracy: {row['triangles']} triangles, error {row['excess']:.2g} of the accuracy wanted")

    _newton_alone(project, "reach an accuracy")
    report("solving to the accuracy")
    wanted = vars(project.wanted) | dict(project.options)
    accurate = solve_to_accuracy(surface, callback=callback, **wanted)
    stopped = accurate.status is AccuracyStatus.STOPPED
    return _certified(accurate.result, report, stopped, accurate=accurate)


def _newton_alone(project: Project, act: str) -> None:
    if project.method != "newton":
        message = f"only method 'newton' can {act}, found {project.method!r}"
        raise OptionError(message, what="solve.method", found=project.method, expected="newton")


def reporter(report: OnStep) -> Callable[[Progress], None]:
    """A solver's callback that reports its step and the forces left."""

    def callback(state: Progress) -> None:
        force = state.row.get("residual", state.row["gradient_squared"])
        report(f"solving: step {state.iteration}, forces left {force:.1e}")

    return callback
