"""A whole design in one TOML file: plan, solver, targets and what is written.

::

    [plan]                    # keys as of pcmc.plan.Plan
    edge_length = 1.0
    outline = [[0, 0], [8, 0], [8, 4], [0, 4]]
    patches = {roof = {tension = 3.0}}

    [solve]                   # method, and the options of the method
    target = "minimum"

    [targets]                 # optional
    meet = [{quantity = "apex", of = "roof", value = 1.0}]
    vary = ["roof"]

    [output]
    files = ["roof.obj", "roof.glb"]
    picture = "roof.png"
"""

from __future__ import annotations

import os
import re
import tomllib
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import io
from .certificate import Certificate
from .curvature import curvature_error, mean_curvature
from .errors import FileError, FileWarning, OptionError, PcmcError, unknown
from .files import whole
from .keys import check_keys, options_of, tables
from .plan import Plan, plan_from
from .solvers import solve
from .solvers.result import Progress, Result, Status
from .surface import Surface

if TYPE_CHECKING:
    from .design import Design, Parameter, Target

PathLike = str | os.PathLike[str]
Say = Callable[[str], object]
WRONG_KIND = (
    TypeError,
    ValueError,
    AttributeError,
)  # what a text for a number and the like lead to
COLOURS = ("patches", "curvature", "error")


@dataclass(frozen=True, eq=False)
class Project:
    """What a project file says.

    Attributes
    ----------
    path : the file.
    plan : where the surface comes from; None where ``path`` is a surface itself.
    method, options : as of ``pcmc.solve``.
    targets, vary : as of ``pcmc.meet``; both empty where nothing is aimed at.
    files, picture : what is written, relative to the file's folder.
    view, colour : of the picture; ``colour`` is one of ``COLOURS``.
    """

    path: Path
    plan: Plan | None
    method: str
    options: Mapping[str, Any]
    targets: Sequence[Target] = ()
    vary: Sequence[Parameter] = ()
    files: Sequence[str] = ()
    picture: str | None = None
    view: Any = "diagonal"
    colour: str = "patches"


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


def load(path: PathLike) -> Project:
    """Read a project file.

    Raises
    ------
    FileError : in one line, naming file and line, for a file that cannot be read, is not TOML, or has an
        unknown key (with the nearest known one); naming file and element for a bad value.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror or error})") from None
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: byte {error.start} is not text; is it a TOML file?") from None
    except tomllib.TOMLDecodeError as error:
        raise FileError(f"{path}: not TOML: {error}") from None
    check_keys(path, text, data)
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
        return io.read(project.path)
    try:
        return project.plan.surface()
    except PcmcError as error:
        raise type(error)(f"{project.path}: {error}") from None
    except WRONG_KIND as error:
        raise FileError(f"{project.path}: a value of the wrong kind ({error})") from None


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
    """
    project, say = load(path), progress or _silent
    folder = project.path.parent if out_dir is None else Path(out_dir)
    names = [*project.files, *([project.picture] if project.picture else [])]
    check_outputs(folder / name for name in names)
    say("meshing the plan")
    result, design = settle(project, surface_of(project), say)
    outcome = Outcome(result, (), design)
    if not (outcome.good or anyway):
        return outcome
    if out_dir is not None:
        folder.mkdir(parents=True, exist_ok=True)
    files = [folder / name for name in project.files]
    picture = None if project.picture is None else folder / project.picture
    written = save(result, files, picture, view=project.view, colour=project.colour, progress=say)
    return Outcome(result, written, design)


def settle(
    project: Project, surface: Surface, progress: Say | None = None
) -> tuple[Result, Design | None]:
    """Solve a surface as the project says, or meet its targets."""
    say, design = progress or _silent, None
    try:
        if project.targets:
            design = _aim(project, surface, say)
            result = design.result
        else:
            result = uninterrupted(solve(surface, project.method, reporter(say), **project.options))
    except PcmcError as error:
        raise type(error)(f"{project.path}: {error}") from None
    say("certifying")
    result.certificate  # noqa: B018 — computed here, while the progress is shown
    return result, design


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


def save(
    result: Result, files: Iterable[PathLike], picture: PathLike | None = None, *,
    view: Any = "diagonal", colour: str = "patches", progress: Say | None = None,
) -> list[Path]:  # fmt: skip
    """Write a result to files and a picture of it: all of them, or none.

    Curvatures (1/length), their errors and the certificate go where the format can carry them.
    """
    say, outputs = progress or _silent, [Path(f) for f in files]
    pictures = [] if picture is None else [Path(picture)]
    check_outputs([*outputs, *pictures])
    surface = result.surface
    scalars = {"mean curvature": mean_curvature(surface), "error": curvature_error(surface)}
    with ExitStack() as stack, warnings.catch_warnings():
        warnings.simplefilter("ignore", FileWarning)  # what a format cannot carry is not asked for
        for file in outputs:
            say(f"writing {file.name}")
            temporary = stack.enter_context(whole(file))
            _named(
                file, io.write, temporary, surface, scalars=scalars, certificate=result.certificate
            )
        for file in pictures:
            say(f"drawing {file.name}")
            temporary = stack.enter_context(whole(file))
            _named(file, paint, surface, temporary, view, colour)
    return [*outputs, *pictures]


def paint(surface: Surface, path: PathLike, view: Any, colour: str) -> None:
    """A picture with the patches, the mean curvature (1/length) or its relative error as colours."""
    from .plot import draw  # needs the extra plot, which a project without picture does not

    if colour not in COLOURS:
        raise OptionError(unknown("colour", colour, COLOURS))
    if colour == "curvature":
        draw(surface, path, view=view, scalars=mean_curvature(surface), label="mean curvature")
    elif colour == "error":
        draw(surface, path, view=view, scalars=curvature_error(surface), label="curvature error")
    else:
        draw(surface, path, view=view, legend=True)


def check_outputs(paths: Iterable[Path]) -> None:
    """Refuse, before any work, names that cannot be written."""
    seen: list[Path] = []
    for path in paths:
        suffix = path.suffix.lower()
        if suffix not in (*io.FORMATS, ".png"):
            raise FileError(f"{path}: {unknown('suffix', suffix, [*io.FORMATS, '.png'])}")
        if path.is_dir():
            raise FileError(f"{path}: is a folder; give the name of a file")
        if path in seen:
            raise FileError(f"{path}: is named twice among the output")
        seen.append(path)


def _silent(words: str) -> None:
    pass


def _named(file: Path, write: Callable[..., None], *arguments: Any, **options: Any) -> None:
    """Write, with errors that name the file itself and not the temporary one in its place."""
    if not file.parent.is_dir():
        raise FileError(f"{file}: there is no folder {file.parent}; make it first")
    try:
        write(*arguments, **options)
    except OSError as error:
        raise FileError(f"{file}: cannot be written ({error.strerror or error})") from None
    except PcmcError as error:
        text = re.sub(
            rf"\S*\.{re.escape(file.stem)}-[0-9a-f]+{re.escape(file.suffix)}: ", "", str(error)
        )
        raise FileError(f"{file}: {text}") from None


def _aim(project: Project, surface: Surface, say: Say) -> Design:
    from .design import meet  # needed by projects with targets only

    if project.method != "newton":
        raise OptionError(f"targets are met with method 'newton' only, found {project.method!r}")
    count = iter(range(1, 10**6))
    return meet(
        surface, list(project.targets), list(project.vary),
        callback=lambda row: say(f"meeting the targets: solve {next(count)}"), **project.options,
    )  # fmt: skip


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
    view, colour = output.get("view", "diagonal"), output.get("colour", "patches")
    if colour not in COLOURS:
        raise OptionError(unknown("colour", colour, COLOURS))
    return Project(
        path=path,
        plan=plan_from(data["plan"]),
        method=method,
        options=options,
        **(_aims(aims) if aims else {}),
        files=files,
        picture=picture,
        view=tuple(view) if isinstance(view, list) else view,
        colour=colour,
    )


def _aims(table: Mapping[str, Any]) -> dict[str, Any]:
    """The targets of a project, and what may vary."""
    from .design import Parameter, Target

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
