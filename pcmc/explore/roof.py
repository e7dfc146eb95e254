"""The roof that a page opens: a surface, and the project that it comes from."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .. import project as projects
from ..base.files import system_error
from ..base.units import NO_UNITS, Units
from ..design import Parameter, Target
from ..io import read_bare
from ..surface import Surface

Signature = tuple[tuple[str, tuple[int, ...]], ...]


@dataclass(frozen=True, eq=False)
class Roof:
    """What a page opens.

    Attributes
    ----------
    surface : the designed roof of a project, its start shape, or any other surface.
    title : at the top of the page; downloads are named after it.
    units : of its numbers.
    path : of the file that it was read from; None for a surface from a program.
    text : of the project file when it was read; empty for other files.
    data : of the project when it was read; empty for other files.
    targets, vary : those of the project.
    note : how the project ended, in one sentence; empty where that needs no words.
    met : whether the project met its targets and is certified.
    good : False where the project has no roof to show: ``note`` says why.
    signature : of the file and those it refers to, before they were read.
    """

    surface: Surface
    title: str = ""
    units: Units = NO_UNITS
    path: Path | None = None
    text: str = ""
    data: Mapping[str, Any] = field(default_factory=dict)
    targets: tuple[Target, ...] = ()
    vary: tuple[Parameter, ...] = ()
    note: str = ""
    met: bool = False
    good: bool = True
    signature: Signature = ()

    @property
    def name(self) -> str:
        """The name of downloads, without suffix.

        >>> Roof(None, "halls/nave & apse").name, Roof(None, path=Path("a/roof.toml")).name, Roof(None).name
        ('halls-nave & apse', 'roof', 'surface')
        """
        name = self.path.stem if self.path is not None else self.title
        kept = "".join("-" if c in '\\/:*?"<>|' or not c.isprintable() else c for c in name)
        return kept.strip(" .")[:80] or "surface"

    @property
    def is_project(self) -> bool:
        """Whether the roof has a project that changes can be saved to."""
        return self.path is not None and projects.is_project(self.path)


def read_roof(
    path: str | os.PathLike[str],
    *,
    start_shape: bool = False,
    use_cache: bool = True,
    progress: Callable[[str], None] | None = None,
    report: Callable[[projects.Outcome], None] | None = None,
) -> Roof:
    """The roof in a file: of a project the designed one, its targets met.

    Parameters
    ----------
    path : of a project, a drawing or a surface.
    start_shape : of a project, show the shape before it is solved.
    use_cache : take the designed roof from the cache, and keep it there.
    progress : called with a few words at each step.
    report : called with the outcome of a project.

    Raises
    ------
    FileError, PlanError, OptionError : as ``pcmc.project.designed`` and ``pcmc.read``.
    """
    path = Path(path)
    before = signature(path)
    if not projects.is_project(path):
        surface, data = read_bare(path)
        return Roof(surface, path.name, data.units, path, signature=before)
    project = projects.load(path)
    text = text_of(path) if path.suffix.lower() == ".toml" else ""
    more: dict[str, Any] = {"path": path, "text": text, "signature": before}
    more["data"] = projects.read_data(path)[1]
    more |= {"targets": tuple(project.targets), "vary": tuple(project.vary)}
    if start_shape:
        note = "the targets are not met yet: the page opened its start shape" if project.targets else ""
        return Roof(projects.surface_of(project), path.name, project.units, note=note, **more)
    outcome = projects.designed(project, progress, use_cache=use_cache)
    if report is not None:
        report(outcome)
    certificate, design = outcome.certificate, outcome.design
    note = "" if design is None else design.text(outcome.units)
    if not certificate.certified:
        note = "; ".join(filter(None, (note, certificate.verdict.value, certificate.detail)))
    more |= {
        "good": certificate.index is not None,
        "met": certificate.certified and bool(design and design.met),
    }
    return Roof(outcome.surface, path.name, outcome.units, note=note, **more)


def signature(path: Path) -> Signature:
    """What tells that a file, or one that it refers to, was saved, replaced, or can no longer be read."""
    states: list[tuple[str, tuple[int, ...]]] = []
    for file in projects.files_of(path):
        try:
            state, readable = file.stat(), os.access(file, os.R_OK)
            seen = (state.st_mtime_ns, state.st_size, state.st_mode, state.st_ino, readable)
            states.append((str(file), seen))
        except (OSError, ValueError):  # missing, or no name of a file
            states.append((str(file), ()))
    return tuple(states)


def text_of(path: Path) -> str:
    """The text of a project file, its ends of lines as they are; FileError if it cannot be read."""
    try:
        return path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise system_error(path, "read", error) from None
