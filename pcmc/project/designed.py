"""The roof in a file: for commands, pages, notebooks and reports."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..surface import Surface
from . import cache
from .file import PathLike, Project, load
from .outcome import Outcome
from .output import OnStep, ignore
from .solving import solve_from_start
from .start import start_of

Changed = Callable[[Surface], Surface]


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
    Outcome
        ``outcome.surface`` is the roof, ``outcome.good`` whether it is what the project asks for. With
        ``whole = true`` ``outcome.shown`` is the whole roof.

    Raises
    ------
    FileError, PlanError, OptionError
        As ``run``.
    KeyboardInterrupt
        For Ctrl-C; nothing is kept.

    Warns
    -----
    BalanceWarning
        Before solving, if the tensions at a junction cannot balance.

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
        return replace(known, unfold=project.whole, project=project)
    outcome = solve_from_start(project, progress or ignore, changed)
    if use_cache:
        cache.keep(project, outcome)
    return outcome


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

    Parameters
    ----------
    path : of the file, or a Project.
    progress : called with a few words at each step.
    units : the unit of length that the roof is to be in; see ``load``.
    start : of a project, its start shape, which is not solved.
    changed : applied to the surface of the file, or to the start shape.
    use_cache : as of ``designed``.

    Raises
    ------
    FileError, PlanError, OptionError, SurfaceError : as ``load`` and ``pcmc.read``.

    >>> roof = opened("notebooks/roof.toml", start=True)
    >>> roof.result is None, roof.certificate.certified
    (True, False)
    """
    project = path if isinstance(path, Project) else load(path, units=units)
    if (project.has_file or project.plan is not None) and not start:
        return designed(project, progress, changed=changed, use_cache=use_cache)
    first = start_of(project)
    surface, data = first.surface, first.data
    if changed is not None:
        surface, data = changed(surface), None
    unfold = project.whole
    return Outcome(None, units=first.units, project=first.project, start=surface, unfold=unfold, data=data)
