"""Reading a project file: every key and value is checked before any work."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import io
from ..base.errors import FileError, OptionError, PcmcError
from ..plan import Plan, plan_from
from ..solvers import find_method
from ..surface import Surface
from .checking import check_keys
from .output import check_names, check_picture
from .remeshing import Remeshing, remeshing

if TYPE_CHECKING:
    from ..design import Parameter, Target

PathLike = str | os.PathLike[str]


@dataclass(frozen=True, eq=False)
class Project:
    """The contents of a project file.

    Attributes
    ----------
    path : the file.
    plan : of the surface; None if ``path`` holds a surface itself.
    method, options : as in ``pcmc.solve``.
    remeshing : in order.
    targets, vary : as in ``pcmc.meet``; empty without targets.
    files, picture : the output.
    folder : made for the output if it is missing; None if the names include their folders.
    view, colour : of the picture; ``colour`` is one of ``COLOURS``.
    """

    path: Path
    plan: Plan | None = None
    method: str = "newton"
    options: Mapping[str, Any] = field(default_factory=dict)
    remeshing: Sequence[Remeshing] = ()
    targets: Sequence[Target] = ()
    vary: Sequence[Parameter] = ()
    files: Sequence[PathLike] = ()
    picture: PathLike | None = None
    folder: Path | None = None
    view: Any = "diagonal"
    colour: str = "patches"

    @property
    def outputs(self) -> list[Path]:
        """All files to write."""
        return [Path(f) for f in (*self.files, *([] if self.picture is None else [self.picture]))]

    def in_folder(self, folder: PathLike) -> Project:
        """The same project with its output in a folder."""
        base = Path(folder)
        picture = None if self.picture is None else base / self.picture
        files = [base / name for name in self.files]
        return replace(self, files=files, picture=picture, folder=base)


def load(path: PathLike) -> Project:
    """Read a project file.

    Raises
    ------
    FileError
        If the file cannot be read or is not TOML; for an unknown key (the message names its line and
        the nearest known key), a missing key or a bad value. ``what`` is the key.
    """
    path = Path(path)
    return project_of(path, read_data(path)[1])


def read_data(path: Path) -> tuple[str, dict[str, Any]]:
    """The text of a project file and its data, all keys checked. Errors as in ``load``."""
    try:
        text = path.read_text(encoding="utf-8-sig")  # skips the byte-order mark of Windows editors
        data = tomllib.loads(text)
    except OSError as error:
        raise FileError(
            f"{path}: cannot be read ({error.strerror or error})", what=str(path)
        ) from None
    except UnicodeDecodeError as error:
        raise FileError(
            f"{path}: byte {error.start} is not UTF-8; save the file as UTF-8",
            what=str(path),
            where=error.start,
        ) from None
    except tomllib.TOMLDecodeError as error:
        line, hint = _toml_error(text, str(error))
        raise FileError(f"{path}: not TOML: {error}{hint}", what=str(path), where=line) from None
    try:
        check_keys(text, data)
    except PcmcError as error:
        raise in_file(path, error, FileError) from None
    return text, data


def _toml_error(text: str, message: str) -> tuple[int | None, str]:
    """The line where TOML fails, and a hint if it fails at a letter beyond a-z."""
    place = re.search(r"at line (\d+), column (\d+)", message)
    if place is None:
        return None, ""
    line, column = int(place[1]), int(place[2])
    if text.split("\n")[line - 1][column - 1 :][:1].isascii():
        return line, ""
    return line, "; put names with letters beyond a-z in quotes"


def in_file(path: Path, error: PcmcError, kind: type[PcmcError] | None = None) -> PcmcError:
    """The same error, or one of another kind, with the file at the start of its message."""
    return (kind or type(error))(
        f"{path}: {error}",
        what=error.what,
        where=error.where,
        found=error.found,
        expected=error.expected,
    )


def project_of(path: Path, data: Mapping[str, Any]) -> Project:
    """The project with the given data. Errors as in ``load``."""
    try:
        return _project(path, data)
    except PcmcError as error:
        raise in_file(path, error, FileError) from None


def build(path: PathLike) -> Surface:
    """The mesh of a project's plan, before solving. Errors as in ``load``."""
    return surface_of(load(path))


def surface_of(project: Project) -> Surface:
    """The mesh of the project's plan."""
    if project.plan is None:
        return io.read_bare(project.path)
    try:
        return project.plan.surface()
    except PcmcError as error:
        raise in_file(project.path, error) from None


def _project(path: Path, data: Mapping[str, Any]) -> Project:
    output = data.get("output", {})
    options = dict(data.get("solve", {}))
    method = options.pop("method", "newton")
    find_method(method).options(**options)  # refuses bad values before the plan is meshed
    files, picture = output.get("files", []), output.get("picture")
    check_names(files, picture)
    view, colour = output.get("view", "diagonal"), output.get("colour", "patches")
    check_picture(view, colour)
    stages = data.get("remesh", [])
    return Project(
        path=path,
        plan=plan_from(data["plan"]),
        method=method,
        options=options,
        remeshing=[remeshing(s) for s in (stages if isinstance(stages, list) else [stages])],
        **(_search(data["targets"]) if "targets" in data else {}),
        files=files,
        picture=picture,
        view=tuple(view) if isinstance(view, list) else view,
        colour=colour,
    )


def _search(table: Mapping[str, Any]) -> dict[str, Any]:
    """The targets of a project, and the parameters that may vary."""
    from ..design import Parameter, Target

    for key in ("meet", "vary"):
        if not table[key]:
            raise OptionError(f"targets.{key} is empty; give at least one", what=f"targets.{key}")
    return {
        "targets": [Target(**entry) for entry in table["meet"]],
        "vary": [Parameter(v) if isinstance(v, str) else Parameter(**v) for v in table["vary"]],
    }
