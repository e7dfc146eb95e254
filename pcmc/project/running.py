"""The roof in a file: opened or designed for commands, pages and notebooks; or run, with all its files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ..base.files import PathLike
from ..base.files import folder as output_folder
from . import cache
from .file import Project, load
from .outcome import OnStep, Outcome, ignore
from .solving import Changed, solve_from_start
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
) -> Outcome:
    """As ``run``, for a loaded project; ``changed`` is applied to its initial surface, solved in any case.

    The mesh check comes last, so that Ctrl-C during it leaves the files; before a report, which shows it.
    Without ``check_after`` the caller makes it.
    """
    progress = progress or ignore
    project = project if project.folder is not None else project.in_folder(project.path.parent)
    outputs = project.output.paths
    check_outputs(outputs, project.folder, inputs=project.inputs)
    outcome = solve_from_start(project, progress, changed)
    if project.output.whole:
        progress("certifying the whole")
        outcome.whole  # noqa: B018 — computed here, while the progress is shown
    for what in project.margin if outcome.certified else ():
        outcome.margin(what, progress)
    if outputs and (outcome.good or anyway):
        jobs = project_files(project, outcome, anyway, progress)
        with output_folder(project.folder or Path()):
            outcome = replace(outcome, files=write_all(jobs, progress))
    if use_cache and changed is None:
        cache.keep(project, outcome)
    if check_after and project.mesh_check and outcome.wants_mesh_check():
        outcome.check_mesh(progress)
    return outcome
