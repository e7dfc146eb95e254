"""Reading a project file: every key and value is checked before any work."""

from __future__ import annotations

import re
import tomllib
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..advice.rises import RISES, Rise, mast_note, take_rises, taken, with_rises
from ..base import validate
from ..base.arrays import toml
from ..base.errors import FileError, FileWarning, OptionError, PcmcError, unknown
from ..base.files import PathLike, as_path, check_regular, system_error
from ..base.units import NO_UNITS, Units, unlikely_size
from ..cloth.settings import CuttingOptions
from ..design import Parameter, Target
from ..plan import Plan, plan_from
from ..plan.drawing import Drawing
from ..plan.proposal import edge_length_for
from ..solvers import find_method
from ..structure.section import Structure, check_members
from .checking import PART, check_project_keys, in_file
from .drawn import Chosen, check_beside, is_drawing, leads_outside, with_drawing
from .settings import AccuracyWanted, MeshFile, Output, Remeshing, section_of

TOML = ".toml"
ELSEWHERE = "name files in it, and give --folder to write them elsewhere"
LARGEST = 4_000_000  # bytes of a project file
DEEP = re.compile(rf"(?<![\w\"'-])(?:{PART}[ \t]*\.[ \t]*){{30}}")  # TOML's reader takes its square


@dataclass(frozen=True, eq=False)
class Project:
    """The contents of a project file: its specification, before anything is meshed."""

    path: Path
    plan: Plan | None = None  # None where a mesh is given
    mesh: MeshFile | None = None  # None where a plan is given
    text: str = field(default="", repr=False)  # of the file; empty for a drawing and a mesh alone
    data: Mapping[str, Any] = field(default_factory=dict, repr=False)  # as TOML reads the text
    units: Units = NO_UNITS  # of all its numbers, and of the files written
    method: str = "newton"
    options: Mapping[str, Any] = field(default_factory=dict)  # of the method, as in ``pcmc.solve``
    wanted: AccuracyWanted = field(default_factory=AccuracyWanted)
    mesh_check: bool | None = None  # also solve on finer meshes; None if the file does not say
    margin: Sequence[str] = ()  # what margins are wanted of, as in ``pcmc.margin``
    verify: bool = False  # prove that an exact equilibrium is near
    swap: Sequence[str] = ()  # films and walls to open the other way; those of a command, no key names them
    search: bool = True  # try further starts where the first leads to no equilibrium
    remeshing: Sequence[Remeshing] = ()  # in order
    targets: Sequence[Target] = ()  # those for ``rises`` are the last
    vary: Sequence[Parameter] = ()
    target_tolerance: float | None = None  # ``tolerance`` of ``pcmc.meet``; None for the default
    structure: Structure | None = None
    pattern: CuttingOptions | None = None
    output: Output = field(default_factory=Output)
    folder: Path | None = None  # made for the output if it is missing; None if the names include theirs
    drawing: Drawing | None = None  # that the plan refers to, or that ``path`` is
    rises: Sequence[Rise] = ()  # heights that the plan has instead of tensions; each is one of the targets
    chosen: Chosen = field(default_factory=Chosen)  # for the drawing, where neither it nor the file says

    def __post_init__(self) -> None:
        order, output = self.options.get("order"), self.output
        flat: dict[str, Any] = {"solve.accuracy": self.wanted.accuracy, "solve.margin": self.margin}
        flat["solve.verify"] = self.verify
        flat |= {f"output.{key}": getattr(output, key) for key in ("net", "structure", "tolerance")}
        flat |= {"pattern": self.pattern, "structure.run": self.structure is not None and self.structure.run}
        for key in (key for key, wanted in flat.items() if wanted and order not in (None, 1)):
            text = f"the elements are curved, of order {order}, and {key} is for flat triangles alone; type"
            text += " order = 1 under [solve], or leave it out"
            raise OptionError(text, what="solve.order", found=order)

    @property
    def inputs(self) -> list[Path]:
        """All files that it is read from, which nothing writes over."""
        drawing = [] if self.drawing is None else [self.drawing.path]
        return [self.path, *drawing, *([] if self.mesh is None else [self.path.parent / self.mesh.file])]

    @property
    def specified(self) -> bool:
        """Whether it is a project file or a drawing: a mesh alone does not say what roof is wanted."""
        return bool(self.data)

    @property
    def has_file(self) -> bool:
        """Whether it is a project file: a drawing or a mesh alone says nothing about solving it."""
        return self.specified and self.path.suffix.lower() == TOML

    @property
    def where_to_type(self) -> str:
        """Where to type advice: "type in roof.toml"; of a drawing alone, after the command that writes it."""
        here = f"type in {self.path.with_suffix(TOML).name}"
        return here if self.has_file else f"write a project ({self.plan_command}) and {here}"

    @property
    def plan_command(self) -> str:
        """The command that writes the project of a drawing."""
        return f"pcmc plan {self.path} -o {self.path.with_suffix(TOML)}"

    def solved_by(self, method: str) -> Project:
        """The same project with another method; a warning names the options that it leaves out."""
        if method == self.method:
            return self
        find_method(method)
        if self.options:
            left = ", ".join(f"{name} = {value}" for name, value in self.options.items())
            text = f"{self.path}: method {method} solves without the file's options of {self.method}: {left}"
            warnings.warn(text, FileWarning, stacklevel=2)
        return replace(self, method=method, options={})

    def in_folder(self, folder: PathLike) -> Project:
        """The same project with its output in a folder; FileError for output that a link leads out of it."""
        base = Path(folder)
        for path in self.output.paths:
            place = (base / path).parent.resolve()
            if not place.is_relative_to(base.resolve()):
                text = f"{self.path}: {path} is outside the folder {base}, in {place}; {ELSEWHERE}"
                raise FileError(text, what="output", found=str(path), expected=str(base))
        return replace(self, output=self.output.in_folder(base), folder=base)


def load(path: PathLike, *, units: str = "") -> Project:
    """Read a project file; or a drawing, or the file of a mesh, as a project without output.

    ``units`` is the unit of length of a drawing's or a mesh's project: a file in another one is converted, a
    file without a unit is taken to be in it. A project file says itself which it has.

    FileError : the file is no TOML, or a key is unknown, missing or bad; ``what`` is the key.
    PlanError : a drawing is no plan; ``what`` is its layer.
    FileWarning : for what was changed and left out of a drawing, a plan whose size is unlikely in its unit,
    and a roof held at single points inside.

    >>> import tempfile
    >>> text = 'units = "mm"\\n[plan]\\noutline = [[0, 0], [6000, 0], [6000, 4000]]\\ntension = 3.0'
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "hall.toml").write_text(text, encoding="utf-8")
    ...     project = load(Path(folder, "hall.toml"))
    >>> project.units.length, project.output.files
    ('mm', ())
    """
    path = as_path(path)
    if not is_project(path):
        return Project(path, mesh=MeshFile(path.name), units=Units(units))
    text, data = read_data(path, units)
    project = project_of(path, data, text)
    if units and project.units.length not in ("", units):
        text = f"{path}: the project is in {project.units.length}, not in {units}; leave out --units"
        raise OptionError(text, what="units", found=units, expected=project.units.length)
    if units:
        project = replace(project, units=replace(project.units, length=units))
    plan, drawing, notes = project.plan, project.drawing, list[str]()
    if drawing is not None:
        notes += drawing.notes
    elif plan is not None:
        width = float(np.ptp(plan.outline.at(plan.outline.dense), axis=0).max())
        notes.append(unlikely_size(width, project.units.length))
    if plan is not None:
        notes.append(mast_note(plan, drawn=drawing is not None))
    if notes := [*filter(None, notes)]:
        text = f"{path if drawing is None else drawing.path}: {'; '.join(notes)}"
        warnings.warn(text, FileWarning, stacklevel=2)
    return project


def is_project(path: PathLike) -> bool:
    """Whether a file is a project or the drawing of one; all others hold a surface."""
    return Path(path).suffix.lower() == TOML or is_drawing(Path(path))


def read_data(path: Path, units: str = "") -> tuple[str, dict[str, Any]]:
    """The text of a project file and its data, all keys checked; those of any other file, a drawing, refer
    to it."""
    check_regular(path)
    if path.suffix.lower() != TOML:
        return "", {"plan": {"drawing": path.name}} | ({"units": units} if units else {})
    where: int | None = None
    try:
        if (size := path.stat().st_size) > LARGEST:
            text = f"{path}: {size} bytes are too many for a project; {LARGEST} at most are read"
            raise FileError(text, what=str(path), found=size, expected=LARGEST)
        text = path.read_text(encoding="utf-8-sig")  # skips the byte-order mark of Windows editors
        if deep := DEEP.search(text):
            where = 1 + text.count("\n", 0, deep.start())
            problem = "a key of more than 30 parts; no key of a project has more than five"
            raise FileError(f"{path}: line {where}: {problem}", what=str(path), where=where)
        data = tomllib.loads(text)
    except OSError as error:
        raise system_error(path, "read", error) from None
    except PcmcError:
        raise
    except UnicodeDecodeError as error:
        problem, where = f"byte {error.start} is not UTF-8; save the file as UTF-8", error.start
    except RecursionError:
        problem = "lists or tables in it are nested too deep; no key of a project needs more than five"
    except ValueError as error:  # TOML's, and Python's own limits, such as the digits of an integer
        problem = f"not TOML: {error}"
        if place := re.search(r"at line (\d+), column (\d+)", problem):
            where, column = int(place[1]), int(place[2])
            problem += _toml_hint(problem, text.split("\n")[where - 1], column)
    else:
        with in_file(path, FileError):
            check_project_keys(text, data)
        return text, data
    raise FileError(f"{path}: {problem}", what=str(path), where=where)


def _toml_hint(problem: str, line: str, column: int) -> str:
    """What to type in a line in which TOML reads no further than a column, which counts from 1.

    >>> _toml_hint("not TOML: Invalid value", "units = m", 9)
    '; put a text in quotes'
    """
    rest = line[column - 1 :]
    rules = (
        (r"", r"[^\x00-\x7f]", "put names with letters beyond a-z in quotes"),
        (r"Expected", r"(?i)[a-z]", "numbers have no unit behind them"),
        (r"Expected", r":", "type = between a key and its value"),
        (r"Invalid value", r"(?i)true|false", "write true or false in small letters"),
        (r"Invalid value", r"(?i)[a-z]", "put a text in quotes"),
        (r"Invalid value", r"\.\d", "write 0.5, not .5"),
        (r"Cannot overwrite", r"", "the key is there twice"),
        (r"Unclosed inline table", r"", "a table in braces ends on its line"),
    )
    if "Expected" in problem and re.search(r"=\s*[-+]?\d+,\d", line):
        return "; numbers have a decimal point, no comma"
    hints = (hint for of, at, hint in rules if of in problem and re.match(at, rest))
    return next((f"; {hint}" for hint in hints), "")


def project_of(
    path: Path, data: Mapping[str, Any], text: str = "", redrawn: Callable[[Plan], Plan] | None = None
) -> Project:
    """The project with the given data, read from a text; ``redrawn`` changes its plan before heights become
    targets. Errors as in ``load``."""
    given, mesh, rises, drawing, chosen = data, None, list[Rise](), None, Chosen()
    with in_file(path, FileError):
        if "mesh" in data:
            if "plan" in data:
                raise FileError("a project has a plan or a mesh, not both; remove one of them", what="plan")
            listed = data["mesh"]
            table: dict[str, Any] = {"file": listed} if isinstance(listed, str) else {**listed}
            check_beside(table["file"], "mesh")
            mesh = MeshFile(rises=taken(table, RISES, None, keep=True), **table)
        else:
            data, rises = take_rises(data)
    if mesh is None:
        data, drawing, chosen = with_drawing(path, data)
    stages = data.get("remesh", [])
    with in_file(path, FileError):
        values = _solving(data.get("solve", {}))
        output, units = _output(data.get("output", {})), Units(data.get("units", ""), data.get("force", ""))
        structure = Structure(**data["structure"]) if "structure" in data else None
        pattern = section_of(CuttingOptions, "pattern", data["pattern"]) if "pattern" in data else None
        output.check(units, structure, pattern)
        values |= {"output": output, "units": units, "structure": structure, "pattern": pattern}
        stages = stages if isinstance(stages, list) else [stages]
        values["remeshing"] = [section_of(Remeshing, "remesh", stage) for stage in stages]
        plan, targets, vary = None, list[Target](), list[Parameter]()
        if mesh is None:
            plan = plan_from(data["plan"])
            if "edge_length" not in data["plan"]:
                plan = replace(plan, edge_length=edge_length_for(plan))
                chosen = replace(chosen, edge_length=plan.edge_length)
            plan, targets, vary = with_rises(plan if redrawn is None else redrawn(plan), rises)
        named = [] if plan is None else [p.member for p in (*plan.dividers, *plan.holes) if p.member]
        if structure is not None:
            check_members(structure.members, plan)
            if structure.enclosed is not None and plan is not None:  # a mesh may have units of its own
                structure.enclosed.outside(units)
            for name, member in structure.members.items():
                if name not in named and not any(member.get(key) for key in ("on", "along", "bars")):
                    text = f"member {name!r} is nowhere; name it in a divider or a hole of the plan, give it"
                    raise OptionError(f"{text} on, along or bars, or remove it", what="member", found=name)
                if plan is None and member.get("bars"):
                    text = f"member {name!r}: bars stand at points of a plan, and here is a mesh; remove bars"
                    raise OptionError(text, what="bars", where=name)
        elif named:
            text = f"member {named[0]!r} has no section; add [structure] with young and thickness of the roof"
            raise OptionError(f"{text}, and [structure.members.{named[0]}]", what="member", found=named[0])
        if "targets" in data:
            own, sought = _search(data["targets"], plan)
            if plan is not None:
                _check_sought_once(rises, sought, plan)
            targets, vary = [*own, *targets], [*sought, *vary]
            values["target_tolerance"] = data["targets"].get("tolerance")
        values |= {"targets": targets, "vary": vary, "rises": rises, "chosen": chosen, "drawing": drawing}
        return Project(path, plan, mesh, text, given, **values)


def _solving(table: Mapping[str, Any]) -> dict[str, Any]:
    """What [solve] says, as values of a Project; bad ones are refused before the plan is meshed."""
    given = {name: table[name] for name in ("method", "mesh_check", "margin", "verify") if name in table}
    accuracy = {name: table[name] for name in vars(AccuracyWanted()) if name in table}
    options = {name: v for name, v in table.items() if name not in given and name not in accuracy}
    find_method(given.get("method", "newton")).options(**options)
    return given | {"wanted": section_of(AccuracyWanted, "solve", accuracy), "options": options}


def _output(table: Mapping[str, Any]) -> Output:
    """The output of a project, inside its folder: a project from others must not replace one's files."""
    if "view" in table and "views" in table:
        raise OptionError("output: give view or views, not both", what="output.views")
    output = Output(**table)
    for name in output.names:
        if leads_outside(name):
            text = f"output: {name!r} is outside the project's folder; {ELSEWHERE}"
            raise FileError(text, what="output", found=name)
    return output


def _search(table: Mapping[str, Any], plan: Plan | None) -> tuple[list[Target], list[Parameter]]:
    if "tolerance" in table:
        validate.positive("targets.tolerance", table["tolerance"])
    for key in ("meet", "vary"):
        if not table[key]:
            raise OptionError(f"targets.{key} is empty; give at least one", what=f"targets.{key}")
    points, targets = {} if plan is None else plan.points, []
    for entry in table["meet"]:
        name = entry.get("of")
        if entry["quantity"] == "height" and isinstance(name, str):
            if name not in points:
                text = f"targets.meet: {unknown('point', name, points)}; name it in [plan.points]"
                raise OptionError(text, what="targets.meet", found=name)
            entry = {**entry, "of": points[name], "name": name}
        targets.append(Target(**entry))
    return targets, [Parameter(**v) if isinstance(v, Mapping) else Parameter(v) for v in table["vary"]]


def _check_sought_once(rises: Sequence[Rise], vary: Sequence[Parameter], plan: Plan) -> None:
    for rise in rises:
        own = ([area.name for area in plan.patches] or ["patch 1"]) if rise.patch is None else [rise.patch]
        both = [n for parameter in vary if parameter.kind == "tension" for n in parameter.names if n in own]
        if not both:
            continue
        left = [(p, [n for n in p.names if p.kind != "tension" or n not in own]) for p in vary]
        others = [replace(parameter, patch=names).plain for parameter, names in left if names]
        change = f"type vary = {toml(others)}" if others else "remove vary and its targets"
        where = "[plan]" if rise.patch is None else f"patch {rise.patch!r}"
        text = f"targets.vary: the tension of {both[0]!r} is found for the {rise.kind} of {where}, too;"
        text += f" {change}, or give {where} tension = instead of {rise.kind} ="
        raise OptionError(text, what="targets.vary", where=both[0], found=both[0])


def with_rise(project: Project, wanted: Mapping[str, float | None]) -> Project:
    """The project whose whole roof gets the rise, apex or span ratio given, with one tension."""
    rises = [Rise(None, kind, value) for kind, value in wanted.items() if value is not None]
    if not rises:
        return project
    flag, *others = (f"--{rise.kind.replace('_', '-')}" for rise in rises)
    if others:
        raise OptionError(f"{flag} and {others[0]}: give one of them, the other follows", what=flag)
    own = project.rises or (() if project.mesh is None else project.mesh.rises)
    if project.targets or own:
        has, them = (f"{own[0].kind} = {own[0].value:g}", "it") if own else ("targets", "them")
        raise OptionError(f"{flag}: {project.path.name} has {has} already; change {them} there", what=flag)
    if project.mesh is not None:
        if rises[0].kind not in RISES:
            raise OptionError(f"{flag}: is for a plan, and here is a mesh; give --rise or --apex", what=flag)
        return replace(project, mesh=replace(project.mesh, rises=rises))
    assert project.plan is not None
    plan, targets, vary = with_rises(project.plan, rises)
    return replace(project, plan=plan, targets=targets, vary=vary, rises=rises)
