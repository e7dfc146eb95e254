"""What a project file says, read and checked."""

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
from ..surface import Surface
from .keys import check_keys, entries, options_of, tables
from .output import check_names, check_picture
from .remeshing import Remeshing, remeshing

if TYPE_CHECKING:
    from ..design import Parameter, Target

PathLike = str | os.PathLike[str]
WRONG_KIND = (
    TypeError,
    ValueError,
    AttributeError,
)  # what a text for a number and the like lead to


@dataclass(frozen=True, eq=False)
class Project:
    """What a project file says.

    Attributes
    ----------
    path : the file.
    plan : where the surface comes from; None where ``path`` is a surface itself.
    method, options : as of ``pcmc.solve``.
    remeshing : in the order in which it is done.
    targets, vary : as of ``pcmc.meet``; both empty where nothing is aimed at.
    files, picture : what is written.
    folder : where to, made if it is missing; None where the names say it all.
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
        """All that is written."""
        return [Path(f) for f in (*self.files, *([] if self.picture is None else [self.picture]))]

    def in_folder(self, folder: PathLike) -> Project:
        """The same with its output in a folder."""
        base = Path(folder)
        picture = None if self.picture is None else base / self.picture
        files = [base / name for name in self.files]
        return replace(self, files=files, picture=picture, folder=base)


def load(path: PathLike) -> Project:
    """Read a project file.

    Raises
    ------
    FileError : in one line, naming file and line, for a file that cannot be read, is not TOML, or has an
        unknown key (with the nearest known one); naming file and element for a bad value.
    """
    path = Path(path)
    return project_of(path, read_data(path)[1])


def read_data(path: Path) -> tuple[str, dict[str, Any]]:
    """The text of a project file and what it says, every key known. Errors as in ``load``."""
    try:
        text = path.read_text(encoding="utf-8-sig")  # editors on Windows begin a file with a mark
        data = tomllib.loads(text)
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror or error})") from None
    except UnicodeDecodeError as error:
        raise FileError(
            f"{path}: byte {error.start} is not text in UTF-8; save it as that"
        ) from None
    except tomllib.TOMLDecodeError as error:
        raise FileError(f"{path}: not TOML: {error}{_quotes(text, str(error))}") from None
    check_keys(path, text, data)
    return text, data


def _quotes(text: str, said: str) -> str:
    """What to do where TOML stops at a letter beyond a-z."""
    place = re.search(r"at line (\d+), column (\d+)", said)
    if place is None or text.split("\n")[int(place[1]) - 1][int(place[2]) - 1 :][:1].isascii():
        return ""
    return "; names with letters beyond a-z stand in quotes"


def project_of(path: Path, data: Mapping[str, Any]) -> Project:
    """The project in a file that says ``data``. Errors as in ``load``."""
    try:
        return _project(path, data)
    except PcmcError as error:
        raise FileError(f"{path}: {error}") from None
    except WRONG_KIND as error:
        raise FileError(f"{path}: a value of the wrong kind ({error})") from None


def build(path: PathLike) -> Surface:
    """The surface that a project starts from: the mesh of its plan, not solved. Errors as in ``load``."""
    return surface_of(load(path))


def surface_of(project: Project) -> Surface:
    """The mesh of the project's plan."""
    if project.plan is None:
        return io.read_bare(project.path)
    try:
        return project.plan.surface()
    except PcmcError as error:
        raise type(error)(f"{project.path}: {error}") from None
    except WRONG_KIND as error:
        raise FileError(f"{project.path}: a value of the wrong kind ({error})") from None


def _project(path: Path, data: Mapping[str, Any]) -> Project:
    if "plan" not in data:
        raise OptionError("a project needs a [plan]")
    output = data.get("output", {})
    options = dict(data.get("solve", {}))
    method = options.pop("method", "newton")
    options_of(method)(**options)  # refuses bad values before the plan is meshed
    aims = data.get("targets", {})
    files, picture = output.get("files", []), output.get("picture")
    if not isinstance(files, list) or not all(isinstance(f, str) for f in files):
        raise OptionError(f"output files: expected a list of names, found {files!r}")
    if not isinstance(picture, str | None):
        raise OptionError(f"output picture: expected a name, found {picture!r}")
    check_names(files, picture)
    view, colour = output.get("view", "diagonal"), output.get("colour", "patches")
    check_picture(view, colour)
    return Project(
        path=path,
        plan=plan_from(data["plan"]),
        method=method,
        options=options,
        remeshing=tuple(remeshing(entry) for entry in entries(data.get("remesh", []))),
        **(_aims(aims) if aims else {}),
        files=files,
        picture=picture,
        view=tuple(view) if isinstance(view, list) else view,
        colour=colour,
    )


def _aims(table: Mapping[str, Any]) -> dict[str, Any]:
    """The targets of a project, and what may vary."""
    from ..design import Parameter, Target

    if not table.get("meet") or not table.get("vary"):
        raise OptionError("[targets] needs both: meet, what is wanted, and vary, what may change")
    for key in ("quantity", "patch"):
        for entry in tables(table["meet" if key == "quantity" else "vary"]):
            if key not in entry:
                raise OptionError(f"targets: {entry!r} needs the key {key!r}")
    return {
        "targets": [Target(**entry) for entry in table["meet"]],
        "vary": [Parameter(v) if isinstance(v, str) else Parameter(**v) for v in table["vary"]],
    }
