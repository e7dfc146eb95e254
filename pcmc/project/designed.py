"""The designed roof of a project: for commands, pages, notebooks and reports."""

from __future__ import annotations

from collections.abc import Callable

from ..surface import Surface
from . import cache, running
from .file import PathLike, Project, load
from .outcome import Outcome
from .output import OnStep, ignore


def designed(
    project: Project | PathLike,
    progress: OnStep | None = None,
    *,
    changed: Callable[[Surface], Surface] | None = None,
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
        ``outcome.surface`` is the roof, ``outcome.good`` whether it is what the project asks for.

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
        return known
    outcome = running.solve_from_start(project, progress or ignore, changed)
    if use_cache:
        cache.keep(project, outcome)
    return outcome
