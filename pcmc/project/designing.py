"""Roofs of projects: opened or designed for commands, pages and notebooks; or run, with all their files."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

from ..accuracy.varied import Varied
from ..advice.advice import check_apexes, chosen_values
from ..base.errors import BalanceWarning, OptionError
from ..base.files import PathLike
from ..base.files import folder as output_folder
from ..base.units import Units
from ..certificate.balance import unbalanced
from ..forces.pinching import standing_part
from ..io import metres_note
from ..structure.calculix import expect_program
from ..surface import Surface
from ..surface.lagrange import expect_flat
from . import cache
from .advising import Changed, advice, firmer
from .checking import in_file
from .file import Project, load
from .outcome import OnStep, Outcome, ignore
from .settings import of_material
from .solving import solve_and_swap, solve_project
from .start import start_of
from .writing import check_outputs, project_files, write_all


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

    ``units`` is the unit of length wanted; with ``start`` a project has its start shape, not solved. The
    others are as of ``designed``. Errors as in ``load`` and ``pcmc.read``.

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
    that is not certified, or misses a target, is solved again each time. ``progress`` is called with a few
    words at each step; ``changed`` is applied to the initial surface, and such a roof is neither kept nor
    taken from the cache; with ``use_cache`` False no other is. ``surface`` of the outcome is the roof,
    ``good`` whether it is what the project asks for; with ``whole = true`` ``shown`` is the whole roof.

    Errors and warnings as of ``run``; KeyboardInterrupt for Ctrl-C, and nothing is kept.

    >>> roof = designed("notebooks/roof.toml")
    >>> roof.good, [f"{area:.0f}" for area in roof.certificate.patches["area"][:3]]
    (True, ['78', '174', '150'])
    """
    project = project if isinstance(project, Project) else load(project)
    progress = progress or ignore
    mesh = _mesh_of(project, progress)
    kept = cache.path_for(project, mesh) if use_cache and changed is None else None
    if (known := cache.cached(kept)) is not None:
        given = mesh or Outcome(None, units=project.units, project=project)
        about = {name: getattr(given, name) for name in ("units", "project", "data")}
        return replace(known, unfold=project.output.whole, **about)
    outcome = solve_from_start(project, progress, changed, mesh)
    cache.keep(kept, outcome)
    return outcome


def run(
    path: PathLike, out_dir: PathLike | None = None, progress: OnStep | None = None, *, anyway: bool = False
) -> Outcome:
    """Mesh, solve, meet the targets, certify, and write all output of a project.

    ``out_dir`` is the folder for the output, made if it is missing; by default that of the project file.
    ``progress`` is called with a few words at each step. If the surface is not certified or misses a target,
    nothing is written and ``files`` is empty, unless ``anyway``.

    FileError, PlanError, OptionError : one line that names the file. Nothing is written.
    BalanceWarning : before solving, if the tensions at a junction cannot balance.

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
    return run_project(project if out_dir is None else project.in_folder(out_dir), progress, anyway=anyway)


def run_project(
    project: Project,
    progress: OnStep | None = None,
    *,
    changed: Changed | None = None,
    anyway: bool = False,
    use_cache: bool = True,
    check_after: bool = True,
) -> Outcome:
    """As ``run``, for a loaded project; ``changed`` is applied to its initial surface, solved in any case.

    The mesh check comes last, so that Ctrl-C during it leaves the files; before a report, which shows it. A
    roof that it does not hold is tried with changes; see ``firmer``. Without ``check_after`` the caller does.
    """
    progress = progress or ignore
    project = project if project.folder is not None else project.in_folder(project.path.parent)
    outputs = project.output.paths
    check_outputs(outputs, project.folder, inputs=project.inputs, pictures=[project.output.picture])
    mesh = _mesh_of(project, progress)
    kept = cache.path_for(project, mesh) if use_cache and changed is None and not project.swap else None
    outcome = solve_from_start(project, progress, changed, mesh)
    if project.output.whole:
        progress("certifying the whole")
        outcome.whole  # noqa: B018 — computed here, while the progress is shown
    for what in project.margin if outcome.certified else ():
        outcome.margin(what, progress)
    if outcome.good or anyway:
        with in_file(project.path):
            outcome.analysis(anyway, progress)
        if project.output.report is not None:
            firmer(outcome, changed, progress)
        if outputs:
            jobs = project_files(project, outcome, anyway, progress)
            with output_folder(project.folder or Path()):
                outcome = replace(outcome, files=write_all(jobs, progress))
    cache.keep(kept, outcome)
    if check_after and project.mesh_check:
        firmer(outcome, changed, progress)
    return outcome


def _mesh_of(project: Project, report: OnStep) -> Outcome | None:
    """The start shape of a project that is in a file; None where the plan has to be meshed for it."""
    if project.plan is not None:
        return None
    report("reading")
    return start_of(project)


def solve_from_start(
    project: Project, report: OnStep, changed: Changed | None, mesh: Outcome | None
) -> Outcome:
    """Solve a project from its start shape, its ``mesh`` where it has one, with ``changed`` applied."""
    if mesh is None:
        report("meshing the plan")
    given = mesh or start_of(project)
    start = given.changed(changed)
    project, surface = start.project or project, start.surface
    _check_wishes(project, surface, start.units)
    if project.swap:
        solved, swapped = solve_and_swap(project, surface, report)
    else:
        solved, swapped = solve_project(project, surface, report), False
    notes = [*solved.notes]
    starts = [v for v in project.vary if v.value(surface) != v.value(given.surface)]  # given by ``changed``
    if starts:
        label, more = starts[0].label, " and others" * (len(starts) > 1)
        notes.append(f"{label}{more}: the value given is where the search begins; the targets decide it")
    if project.has_file:  # a drawing alone is proposed as a whole
        notes = [*chosen_values(project.plan, project.chosen.text, given.surface, surface), *notes]
    if project.drawing is not None or start.data is not None:
        notes += metres_note(project.output.files, start.units.length)
    outcome = replace(solved, notes=notes, units=start.units, data=start.data)
    if outcome.good or swapped:
        return outcome
    report("looking for advice")
    return replace(outcome, advice=advice(project, given.surface, surface, outcome))


def _check_wishes(project: Project, surface: Surface, units: Units) -> None:
    """Refuse what the surface cannot give, and warn where a junction cannot balance, before the work."""
    with in_file(project.path):
        structure, output = project.structure, project.output
        check_apexes(project.plan, surface, project.targets, units)
        if output.georeference is not None:
            output.georeference.check(surface, units)
        if output.whole and not any(plane.mirror for plane, _ in surface.on_planes):
            text = "the roof has no mirror planes, so it is the whole already; leave out whole"
            raise OptionError(f"{text}, or give the plan mirrors", what="whole")
        if structure is not None and (output.structure is not None or structure.run):
            structure.check(surface, project.plan, output.whole)
            if structure.run:
                expect_program()
        if project.pattern is not None and (output.pattern or output.report):
            of_material(project.pattern, structure, surface)
        if project.verify:
            expect_flat(surface, "verify")
        for what in project.margin:
            Varied.of(surface, what)
    pinchable = standing_part(surface).walls.pinchable
    if imbalance := unbalanced(surface, pinchable):
        unless = ", unless the junction rests on the plane" if pinchable.any() else ""
        warnings.warn(f"{imbalance.imbalance}{unless}; solving anyway", BalanceWarning, stacklevel=4)
