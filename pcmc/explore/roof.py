"""The roof that a page opens: an outcome, how its file was when it was read, and the watch of that file."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from .. import project as projects
from ..base.errors import MissingExtra, PcmcError
from ..base.units import NO_UNITS, Units
from ..design import Parameter, Target
from ..project.drawn import files_of
from ..surface import Surface

EVERY = 0.5  # seconds between two looks at the files
Signature = tuple[tuple[str, tuple[int, ...]], ...]


@dataclass(frozen=True, eq=False)
class ShownRoof:
    """What a page opens."""

    outcome: projects.Outcome  # of a project, of its start shape, or of a surface alone
    title: str = ""  # at the top of the page; downloads are named after it
    signature: Signature = ()  # of the file and those it refers to, before they were read

    @classmethod
    def of(cls, surface: Surface, title: str = "", units: Units = NO_UNITS) -> ShownRoof:
        """A surface from a program.

        >>> ShownRoof.of(None, "halls/nave & apse").name, ShownRoof.of(None).name
        ('halls-nave & apse', 'surface')
        """
        return cls(projects.Outcome.of(surface, units), title)

    @property
    def surface(self) -> Surface:
        """The designed roof of a project, its start shape, or any other surface."""
        return self.outcome.surface

    @property
    def project(self) -> projects.Project | None:
        """The project behind it, also of a drawing; None for any other file, and a surface from a program."""
        project = self.outcome.project
        return project if project is not None and project.specified else None

    @property
    def path(self) -> Path | None:
        """The file that it was read from."""
        return None if self.outcome.project is None else self.outcome.project.path

    @property
    def aims(self) -> tuple[tuple[Target, ...], tuple[Parameter, ...]]:
        """The targets of its project, and what may vary for them."""
        project = self.project
        return ((), ()) if project is None else (tuple(project.targets), tuple(project.vary))

    @cached_property
    def note(self) -> str:
        """How the project ended, in one sentence; empty where that needs no words."""
        outcome, certificate = self.outcome, self.outcome.certificate
        if outcome.result is None:
            return "the targets are not met yet: the page opened its start shape" if self.aims[0] else ""
        note = "" if outcome.design is None else outcome.design.text(outcome.units)
        if not certificate.certified:
            note = "; ".join(filter(None, (note, certificate.verdict.value, certificate.detail)))
        return note

    @property
    def good(self) -> bool:
        """Whether the project has a roof to show; if not, ``note`` says why."""
        return self.outcome.result is None or self.outcome.certificate.index is not None

    @property
    def name(self) -> str:
        """The name of downloads, without suffix."""
        name = self.outcome.name or self.title
        kept = "".join("-" if c in '\\/:*?"<>|' or not c.isprintable() else c for c in name)
        return kept.strip(" .")[:80] or "surface"


def read_roof(
    path: str | os.PathLike[str],
    *,
    start_shape: bool = False,
    use_cache: bool = True,
    progress: Callable[[str], None] | None = None,
    report: Callable[[projects.Outcome], None] | None = None,
) -> ShownRoof:
    """The roof in a file, as ``pcmc.project.opened``: of a project the designed one, its targets met.

    ``start_shape`` shows the shape before it is solved; ``progress`` is called with a few words at each step,
    ``report`` with the outcome of a project. Errors as ``pcmc.project.opened``.
    """
    path = Path(path)
    before = signature(path)
    outcome = projects.opened(path, progress, start=start_shape, use_cache=use_cache)
    if report is not None and outcome.result is not None:
        report(outcome)
    return ShownRoof(outcome, path.name, before)


def signature(path: Path) -> Signature:
    """What tells that a file, or one that it refers to, was saved, replaced, or can no longer be read."""
    states: list[tuple[str, tuple[int, ...]]] = []
    for file in files_of(path):
        try:
            state, readable = file.stat(), os.access(file, os.R_OK)
            seen = (state.st_mtime_ns, state.st_size, state.st_mode, state.st_ino, readable)
            states.append((str(file), seen))
        except (OSError, ValueError):  # missing, or no name of a file
            states.append((str(file), ()))
    return tuple(states)


class Watch:
    """A thread that reads a roof again whenever its files change."""

    def __init__(
        self, path: Path, seen: Signature, read: Callable[[], ShownRoof], show: Callable[[ShownRoof], None]
    ):
        self.path, self.seen = path, seen
        self._read, self._show = read, show
        self.problem = ""  # why the newest save has no roof, in one line
        self.working = False  # whether the roof of a save is being computed
        self._end = threading.Event()
        threading.Thread(target=self._run, daemon=True).start()

    def close(self) -> None:
        """End the thread."""
        self._end.set()

    def _run(self) -> None:
        last = self.seen
        while not self._end.wait(EVERY):
            now = signature(self.path)
            if now != self.seen and now == last:  # saved, and no longer being written
                self.seen = now
                self._follow()
            last = now

    def _follow(self) -> None:
        self.working = True
        try:
            roof = self._read()
            if roof.good:
                self._show(roof)
            self.problem = "" if roof.good else roof.note
        except (PcmcError, MissingExtra, OSError) as error:
            self.problem = " ".join(str(error).replace(f"{self.path}: ", "").split())
        except Exception as error:  # the net: the page must learn that its shape is an old one
            self.problem = " ".join(f"{type(error).__name__}: {error}".split())
        finally:
            self.working = False
