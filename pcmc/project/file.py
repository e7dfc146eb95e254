"""Reading a project file: every key and value is checked before any work."""

from __future__ import annotations

import os
import re
import tomllib
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path, PureWindowsPath
from typing import TYPE_CHECKING, Any

import numpy as np

from ..advice.masts import mast_note
from ..advice.rises import Rise, take_rises, with_rises
from ..base import validate
from ..base.errors import FileError, FileWarning, OptionError, PcmcError, unknown
from ..base.files import as_path, check_name, check_regular, system_error
from ..base.units import NO_UNITS, Units, size_note
from ..plan import Plan, plan_from
from ..solvers import find_method
from ..structure.model import Structure
from .accuracy import AccuracyWanted, take_accuracy
from .checking import check_keys, line_with
from .documents import Documents, documents_of
from .drawn import Chosen, is_drawing, with_drawing
from .mesh import MeshFile, mesh_file, mesh_of
from .output import check_names, check_picture
from .remeshing import Remeshing, remeshing

if TYPE_CHECKING:
    from ..design import Parameter, Target
    from ..plan.drawing import Drawing

PathLike = str | os.PathLike[str]

TOML = ".toml"
ELSEWHERE = "name files in it, and give --folder to write them elsewhere"
LARGEST = 4_000_000  # bytes of a project file
_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
DEEP = re.compile(rf"(?<![\w\"'-])(?:{_PART}[ \t]*\.[ \t]*){{30}}")


@dataclass(frozen=True, eq=False)
class Project:
    """The contents of a project file.

    Attributes
    ----------
    path : the file.
    plan : of the surface; None where a mesh is given.
    mesh : of the surface; None where a plan is given.
    text, data : of the file, as it is written and as TOML reads it; empty for a drawing and a mesh.
    units : of all its numbers, and of the files written.
    method, options : as in ``pcmc.solve``.
    wanted : the accuracy asked for.
    mesh_check : whether the result is solved on finer meshes, too; None if the file does not say.
    margin : what margins are wanted of, as in ``pcmc.margin``.
    verify : whether it is to be proved that an exact equilibrium is near.
    search : whether further starts are tried where the first leads to no equilibrium.
    remeshing : in order.
    targets, vary : as in ``pcmc.meet``; empty without targets.
    misfit : ``tolerance`` of ``pcmc.meet``; None for the default.
    structure : of the structural model; None without [structure].
    files, picture : the output.
    documents : drawings, schedule of panels, structural model and report to write.
    folder : made for the output if it is missing; None if the names include their folders.
    views, colour : of the picture, side by side; ``colour`` is one of ``COLOURS``.
    whole : whether the output is the whole roof that a surface with mirror planes is a part of.
    drawing : that the plan refers to, or that ``path`` is; None if there is none.
    rises : heights that the plan has instead of tensions; each is one of the targets.
    chosen : values for the drawing that neither it nor the file gives.
    """

    path: Path
    plan: Plan | None = None
    mesh: MeshFile | None = None
    text: str = field(default="", repr=False)
    data: Mapping[str, Any] = field(default_factory=dict, repr=False)
    units: Units = NO_UNITS
    method: str = "newton"
    options: Mapping[str, Any] = field(default_factory=dict)
    wanted: AccuracyWanted = field(default_factory=AccuracyWanted)
    mesh_check: bool | None = None
    margin: Sequence[str] = ()
    verify: bool = False
    search: bool = True
    remeshing: Sequence[Remeshing] = ()
    targets: Sequence[Target] = ()
    vary: Sequence[Parameter] = ()
    misfit: float | None = None
    structure: Structure | None = None
    files: Sequence[PathLike] = ()
    picture: PathLike | None = None
    documents: Documents = field(default_factory=Documents)
    folder: Path | None = None
    views: Sequence[Any] = ("diagonal",)
    colour: str = "patches"
    whole: bool = False
    drawing: Drawing | None = None
    rises: Sequence[Rise] = ()
    chosen: Chosen = field(default_factory=Chosen)

    @property
    def outputs(self) -> list[Path]:
        """All files to write."""
        pictures = [] if self.picture is None else [self.picture]
        return [*(Path(f) for f in (*self.files, *pictures)), *self.documents.paths]

    @property
    def inputs(self) -> list[Path]:
        """All files that it is read from, which nothing writes over."""
        drawing = [] if self.drawing is None else [self.drawing.path]
        return [self.path, *drawing, *([] if self.mesh is None else [self.path.parent / self.mesh.file])]

    @property
    def has_file(self) -> bool:
        """Whether it is a project file: a drawing or a mesh alone says nothing about solving it."""
        return bool(self.data) and self.path.suffix.lower() == TOML

    def in_folder(self, folder: PathLike) -> Project:
        """The same project with its output in a folder; FileError for output that a link leads out of it."""
        base = Path(folder)
        for path in self.outputs:
            place = (base / path).parent.resolve()
            if not place.is_relative_to(base.resolve()):
                text = f"{self.path}: {path} is outside the folder {base}, in {place}; {ELSEWHERE}"
                raise FileError(text, what="output", found=str(path), expected=str(base))
        picture = None if self.picture is None else base / self.picture
        files, documents = [base / name for name in self.files], self.documents.in_folder(base)
        return replace(self, files=files, picture=picture, documents=documents, folder=base)


def load(path: PathLike, *, units: str = "") -> Project:
    """Read a project file; or a drawing, or the file of a mesh, as a project without output.

    ``units`` is the unit of length of a drawing's or a mesh's project: a file in another one is converted, a
    file without a unit is taken to be in it. A project file says itself which it has.

    Raises
    ------
    FileError
        If the file cannot be read or is not TOML; for an unknown key (the message names its line and
        the nearest known key), a missing key or a bad value. ``what`` is the key.
    PlanError
        For a drawing that is no plan; ``what`` is its layer.

    Warns
    -----
    FileWarning
        For what was changed and left out of a drawing, for a plan whose size is unlikely in its unit,
        and for a roof held at single points inside.
    """
    path = as_path(path)
    if not is_project(path):
        return Project(path, mesh=mesh_file(path), units=Units(units))
    text, data = read_data(path, units)
    project = project_of(path, data, text)
    if units and project.units.length not in ("", units):
        text = f"{path}: the project is in {project.units.length}, not in {units}; leave out --units"
        raise OptionError(text, what="units", found=units, expected=project.units.length)
    if units:
        project = replace(project, units=replace(project.units, length=units))
    if project.drawing is not None and project.drawing.notes:
        text = f"{project.drawing.path}: {'; '.join(project.drawing.notes)}"
        warnings.warn(text, FileWarning, stacklevel=2)
    elif project.drawing is None and project.plan is not None:
        corners = project.plan.outline.at(project.plan.outline.dense)
        width = float(np.ptp(corners, axis=0).max())
        for note in filter(None, (size_note(width, project.units.length), mast_note(project.plan))):
            warnings.warn(f"{path}: {note}", FileWarning, stacklevel=2)
    return project


def is_project(path: PathLike) -> bool:
    """Whether a file is a project or the drawing of one; all others hold a surface."""
    return Path(path).suffix.lower() == TOML or is_drawing(Path(path))


def read_data(path: Path, units: str = "") -> tuple[str, dict[str, Any]]:
    """The text of a project file and its data, all keys checked; a drawing's data refer to it.

    Errors as in ``load``.
    """
    check_regular(path)
    if is_drawing(path):
        return "", {"plan": {"drawing": path.name}} | ({"units": units} if units else {})
    try:
        if path.stat().st_size > LARGEST:
            text = (
                f"{path}: {path.stat().st_size} bytes are too many for a project; {LARGEST} at most are read"
            )
            raise FileError(text, what=str(path), found=path.stat().st_size, expected=LARGEST)
        text = path.read_text(encoding="utf-8-sig")  # skips the byte-order mark of Windows editors
        _check_depth(path, text)
        data = tomllib.loads(text)
    except OSError as error:
        raise system_error(path, "read", error) from None
    except UnicodeDecodeError as error:
        message = f"{path}: byte {error.start} is not UTF-8; save the file as UTF-8"
        raise FileError(message, what=str(path), where=error.start) from None
    except tomllib.TOMLDecodeError as error:
        line, hint = _toml_error(text, str(error))
        raise FileError(f"{path}: not TOML: {error}{hint}", what=str(path), where=line) from None
    except PcmcError:
        raise
    except RecursionError:
        text = f"{path}: lists or tables in it are nested too deep; no key of a project needs more than five"
        raise FileError(text, what=str(path)) from None
    except ValueError as error:  # Python's own limits, such as the digits of an integer
        raise FileError(f"{path}: not TOML: {error}", what=str(path)) from None
    with in_file(path, FileError):
        check_keys(text, data)
    return text, data


def _check_depth(path: Path, text: str) -> None:
    """Refuse keys of very many parts: TOML's reader takes the square of their number."""
    deep = DEEP.search(text)
    if deep is not None:
        line = 1 + text.count("\n", 0, deep.start())
        message = f"{path}: line {line}: a key of more than 30 parts; no key of a project has more than five"
        raise FileError(message, what=str(path), where=line)


def _toml_error(text: str, message: str) -> tuple[int | None, str]:
    """The line where TOML fails, and a hint if it fails at a letter beyond a-z."""
    place = re.search(r"at line (\d+), column (\d+)", message)
    if place is None:
        return None, ""
    line, column = int(place[1]), int(place[2])
    plain = text.split("\n")[line - 1][column - 1 :][:1].isascii()
    return line, "" if plain else "; put names with letters beyond a-z in quotes"


@contextmanager
def in_file(path: Path, kind: type[PcmcError] | None = None) -> Iterator[None]:
    """Put the file, and the line of what was found, in front of an error's message; raise it as ``kind``."""
    try:
        yield
    except PcmcError as error:
        line = 0 if str(error).startswith("line ") else line_with(path, error.found)
        raise error.in_file(f"{path}: line {line}" if line else path, kind) from None


def project_of(
    path: Path, data: Mapping[str, Any], text: str = "", redrawn: Callable[[Plan], Plan] | None = None
) -> Project:
    """The project with the given data, which were read from a text. Errors as in ``load``.

    ``redrawn`` is applied to the plan, before heights and named points of it become targets.
    """
    given, mesh = data, None
    with in_file(path, FileError):
        rises = list[Rise]()
        if "mesh" in data:
            mesh = mesh_of(path, data["mesh"])
        else:
            data, rises = take_rises(data)
    data, drawing, chosen = with_drawing(path, data) if mesh is None else (data, None, Chosen())
    output, options, stages = data.get("output", {}), dict(data.get("solve", {})), data.get("remesh", [])
    method, mesh_check = options.pop("method", "newton"), options.pop("mesh_check", None)
    margin = options.pop("margin", [])
    proved = options.pop("verify", False)
    files, picture = output.get("files", []), output.get("picture")
    colour = output.get("colour", "patches")
    with in_file(path, FileError):
        wanted = take_accuracy(options)
        find_method(method).options(**options)  # refuses bad values before the plan is meshed
        documents = documents_of(output)
        _check_inside([*files, *([] if picture is None else [picture]), *documents.names])
        check_names(files, picture)
        views = _views(output)
        check_picture(views, colour)
        units = Units(data.get("units", ""), data.get("force", ""))
        structure = Structure(**data["structure"]) if "structure" in data else None
        documents.check(units, structure)
        plan, targets, vary = None, list["Target"](), list["Parameter"]()
        if mesh is None:
            plan = plan_from(data["plan"])
            plan, targets, vary = with_rises(plan if redrawn is None else redrawn(plan), rises)
        misfit = None
        if "targets" in data:
            search = _search(data["targets"], plan)
            if plan is not None:
                _check_sought_once(rises, search["vary"], plan)
            targets, vary = [*search["targets"], *targets], [*search["vary"], *vary]
            misfit = search["misfit"]
        return Project(
            path=path,
            plan=plan,
            mesh=mesh,
            text=text,
            data=given,
            units=units,
            method=method,
            options=options,
            wanted=wanted,
            mesh_check=mesh_check,
            margin=margin,
            verify=proved,
            remeshing=[remeshing(s) for s in (stages if isinstance(stages, list) else [stages])],
            targets=targets,
            vary=vary,
            misfit=misfit,
            structure=structure,
            files=files,
            picture=picture,
            documents=documents,
            views=[tuple(view) if isinstance(view, list) else view for view in views],
            colour=colour,
            whole=output.get("whole", False),
            drawing=drawing,
            rises=rises,
            chosen=chosen,
        )


def _check_sought_once(rises: Sequence[Rise], vary: Sequence[Parameter], plan: Plan) -> None:
    """Refuse a tension that both a rise and [targets] find."""
    for rise in rises:
        areas = [area.name for area in plan.patches] or ["patch 1"]
        own = areas if rise.patch is None else [rise.patch]
        both = [n for parameter in vary if parameter.kind == "tension" for n in parameter.names if n in own]
        if not both:
            continue
        names = [name for parameter in vary for name in parameter.names if name not in own]
        change = f"type vary = [{', '.join(map(_quoted, names))}]" if names else "remove vary and its targets"
        where = "[plan]" if rise.patch is None else f"patch {rise.patch!r}"
        text = f"targets.vary: the tension of {both[0]!r} is found for the {rise.kind} of {where}, too;"
        text += f" {change}, or give {where} tension = instead of {rise.kind} ="
        raise OptionError(text, what="targets.vary", where=both[0], found=both[0])


def _quoted(name: str) -> str:
    """A name as TOML writes it."""
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'


def raised(project: Project, wanted: Mapping[str, float | None]) -> Project:
    """The project whose whole roof gets the rise, apex or span ratio given, with one tension."""
    rises = [Rise(None, kind, value) for kind, value in wanted.items() if value is not None]
    if not rises:
        return project
    flag = f"--{rises[0].kind.replace('_', '-')}"
    if len(rises) > 1:
        text = f"{flag} and --{rises[1].kind.replace('_', '-')}: give one of them, the other follows"
        raise OptionError(text, what=flag)
    if project.targets or (project.mesh is not None and project.mesh.rises):
        text = f"{flag}: {project.path.name} has targets already; change them there"
        raise OptionError(text, what=flag)
    if project.mesh is not None:
        return replace(project, mesh=replace(project.mesh, rises=rises))
    assert project.plan is not None
    plan, targets, vary = with_rises(project.plan, rises)
    return replace(project, plan=plan, targets=targets, vary=vary, rises=rises)


def _views(output: Mapping[str, Any]) -> list[Any]:
    """The views of the picture: the key views, or view."""
    if "view" in output and "views" in output:
        raise OptionError("output: give view or views, not both", what="output.views")
    return list(output.get("views", [output.get("view", "diagonal")]))


def _check_inside(names: Sequence[str]) -> None:
    """Refuse output outside the project's folder: a project from others must not replace one's files."""
    for name in names:
        check_name(Path(name))
        windows = PureWindowsPath(name)  # knows both kinds of slashes
        if windows.drive or windows.root or ".." in windows.parts:
            text = f"output: {name!r} is outside the project's folder; {ELSEWHERE}"
            raise FileError(text, what="output", found=name)


def _placed(entry: Mapping[str, Any], plan: Plan | None) -> Mapping[str, Any]:
    """A target, with the point of the plan that a height names."""
    if entry["quantity"] != "height" or not isinstance(entry.get("of"), str):
        return entry
    name, points = entry["of"], {} if plan is None else plan.points
    if name not in points:
        text = f"targets.meet: {unknown('point', name, points)}; name it in [plan.points]"
        raise OptionError(text, what="targets.meet", found=name)
    return {**entry, "of": points[name], "name": name}


def _search(table: Mapping[str, Any], plan: Plan | None) -> dict[str, Any]:
    """The targets of a project, and the parameters that may vary."""
    from ..design import Parameter
    from ..margins.targets import Target

    if "tolerance" in table:
        validate.positive("targets.tolerance", table["tolerance"])
    for key in ("meet", "vary"):
        if not table[key]:
            raise OptionError(f"targets.{key} is empty; give at least one", what=f"targets.{key}")
    return {
        "targets": [Target(**_placed(entry, plan)) for entry in table["meet"]],
        "vary": [Parameter(**v) if isinstance(v, Mapping) else Parameter(v) for v in table["vary"]],
        "misfit": table.get("tolerance"),
    }
