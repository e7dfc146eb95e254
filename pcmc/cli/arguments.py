"""Arguments that several commands have: files, NAME=VALUE, views, and groups of options."""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from .. import project as projects
from ..base import validate
from ..base.errors import FileError, OptionError, unknown
from ..base.files import check_regular
from ..base.units import LENGTHS
from ..io import FORMATS, READ_ONLY
from ..project import Outcome, Output, Project
from ..project.drawn import DXF, files_of
from ..project.file import TOML, is_project
from ..project.outcome import MOST_CHECKED, OnStep
from ..project.varied import with_loads
from ..project.writing import check_outputs
from ..surface import Surface
from ..surface.values import in_the_open, sheets_below
from .options import by_part, option, parsed_unit, switch

READ = (TOML, *FORMATS, *READ_ONLY, DXF)  # suffixes of what commands read

EVERY = "A bare VALUE applies to every patch that is no wall and not named"
CABLES = "A bare VALUE applies to all that are not named"
LOADED = "A bare VALUE applies to every patch under pressure that is not named"
UPDATED = "wall pressures are updated"
MESH_CHECK = f"Solve on two finer meshes, too, for error bars; by default up to {MOST_CHECKED} triangles."
START = "The start shape of a project, before it is solved, instead of its designed roof."
CACHE = "Keep a project's roof and take it from there the next time; --no-cache solves it again."
WHOLE = "Unfold a surface at its mirror planes: the whole roof instead of its piece."
UNITS = f"Unit of the lengths: {', '.join(LENGTHS)}."
UNITS += " A file in another one is converted; by default the file's."
UNCERTIFIED = "Accept a roof that is not certified or misses its targets; every sheet and page is marked."
INPUT = "A surface, a project (.toml), or a drawing (.dxf, .3dm)."
Input = Annotated[Path, typer.Argument(metavar="FILE", help=INPUT)]
ViewName = Annotated[str, option("NAME", "diagonal, elevation, plan, or AZIMUTH,ELEVATION in degrees.")]
Start = Annotated[bool, switch("--start", START)]
Cache = Annotated[bool, switch("--cache/--no-cache", CACHE)]
Whole = Annotated[bool, switch("--whole", WHOLE)]
Uncertified = Annotated[bool, switch("--allow-uncertified", UNCERTIFIED)]
MeshCheck = Annotated[bool | None, switch("--mesh-check/--no-mesh-check", MESH_CHECK)]
FileUnits = Annotated[str, option("NAME", UNITS, parser=parsed_unit)]
SHEET = "Format of the sheets: A4, A3, A2, A1 or A0; by default the project's, or A1."
SheetFormat = Annotated[str | None, option("NAME", SHEET)]
OUTPUT = "-o", "--output"
MANY_FILES = option("FILE", "File to write; may be repeated.", *OUTPUT)


@dataclass(frozen=True)
class Loads:
    """Values of the command line that replace those of a surface: each a list of NAME=VALUE, or VALUE."""

    tension: Annotated[list[str] | None, by_part(f"Tension of a patch. {LOADED}.")] = None
    pressure: Annotated[list[str] | None, by_part(f"Pressure on a patch. {LOADED}; {UPDATED}.")] = None
    weight: Annotated[list[str] | None, by_part(f"Weight of a patch per area. {EVERY}.")] = None
    snow: Annotated[list[str] | None, by_part(f"Snow on a patch, per area of the plan. {LOADED}.")] = None
    cable: Annotated[list[str] | None, by_part(f"Tension of a cable. {CABLES}.")] = None
    cable_weight: Annotated[list[str] | None, by_part("Weight of a cable per length.")] = None
    volume: Annotated[list[str] | None, by_part("Volume of a room that has one already.")] = None

    @property
    def change(self) -> Callable[[Surface], Surface] | None:
        """What gives a surface these values; None if there are none."""
        return self.of if any(getattr(self, f.name) for f in fields(Loads)) else None

    def of(self, surface: Surface) -> Surface:
        """The surface with these values; wall pressures follow those of their rooms."""
        sheets = [patch.name for patch in surface.patches if not patch.wall]
        loaded = [patch.name for patch in surface.patches if not patch.auxiliary] or sheets
        below = sheets_below(surface).values()  # they keep their factor
        out = [p.name for p, out in zip(surface.patches, in_the_open(surface), strict=True) if out]
        names = {"tension": [name for name in loaded if name not in below], "pressure": loaded}
        names |= {"weight": sheets, "snow": [name for name in loaded if name in out]}
        names |= {key: [cable.name for cable in surface.cables] for key in ("cable", "cable_weight")}
        names |= {"volume": [room.name for room in surface.rooms]}
        given = {}
        for key, own in names.items():
            given[f"{key}s"] = by_name(own, getattr(self, key), f"--{key.replace('_', '-')}")
        return with_loads(surface, given)


@dataclass(frozen=True)
class Shown(Loads):
    """What of a file is shown: with other values, designed or not."""

    start: Start = False
    cache: Cache = True

    def roof(self, project: Project, progress: OnStep, whole: bool) -> Outcome:
        """The roof of a project; the ``whole`` one if asked for."""
        check_start(self.start, project.path)
        how: dict[str, Any] = {"changed": self.change, "start": self.start, "use_cache": self.cache}
        roof = projects.opened(project, progress, **how)
        return replace(roof, unfold=whole or roof.unfold)


@dataclass(frozen=True)
class Build:
    """How a roof is prepared for what is built from it."""

    whole: Whole = False
    cache: Cache = True
    allow_uncertified: Uncertified = False

    def roof(self, project: Project, progress: OnStep) -> Outcome:
        """The roof of a project; one that misses its targets is refused, unless it may be uncertified."""
        roof, file = Shown(cache=self.cache).roof(project, progress, self.whole), project.path
        if roof.certified and not roof.good and not self.allow_uncertified:
            hint = f"pcmc solve {file} shows them, --allow-uncertified accepts the roof"
            raise FileError(f"{file}: the roof misses its targets or its accuracy; {hint}", what=str(file))
        return roof


def with_groups(function: Callable[..., int]) -> Callable[..., int]:
    """A command as typer reads it: a parameter of a dataclass becomes an option for each of its fields."""
    parameters, groups = list[inspect.Parameter](), dict[str, Any]()
    for name, parameter in inspect.signature(function, eval_str=True).parameters.items():
        if is_dataclass(group := parameter.annotation):
            groups[name], kinds = group, get_type_hints(group, include_extras=True)
            for field in fields(group):
                changes = {"name": field.name, "default": field.default, "annotation": kinds[field.name]}
                parameters.append(parameter.replace(**changes))
        else:
            parameters.append(parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY))

    @wraps(function)
    def run(**given: Any) -> int:
        for name, group in groups.items():
            given[name] = group(**{field.name: given.pop(field.name) for field in fields(group)})
        return function(**given)

    vars(run).update(__signature__=inspect.Signature(parameters), __annotations__={})
    return run


def load_project(file: Path, units: str = "") -> Project:
    """The project in a file, which may be a mesh or a drawing alone."""
    check_suffix(file)
    return projects.load(file, units=units)


def output_of(file: Path, *more: Path, **output: Any) -> Output:
    """What a command writes, in the terms of a project, and ``more`` files; refused before any work if these
    cannot be written."""
    wanted = Output(**output)
    check_outputs([*wanted.paths, *more], inputs=files_of(file), pictures=[wanted.picture])
    return wanted


def check_suffix(file: Path) -> None:
    """Refuse a file whose suffix is neither a project's nor a drawing's nor a surface's."""
    if (suffix := file.suffix.lower()) not in READ:
        check_regular(file)
        raise FileError(f"{file}: {unknown('suffix', suffix, READ)}", what=str(file))


def by_name(names: list[str], given: list[str] | None, flag: str) -> dict[str, float]:
    """Value by name, from NAME=VALUE, and VALUE for all other ``names``.

    >>> by_name(["west", "east"], ["east=2", "3"], "--tension")
    {'west': 3.0, 'east': 2.0}
    """
    values: dict[bool, dict[str, float]] = {False: {}, True: {}}  # by whether each is named
    for text in given or ():
        name, sign, value = text.rpartition("=")
        amount = math.nan
        with suppress(ValueError):
            amount = validate.parsed(value)
        if (sign and not name) or math.isnan(amount):
            validate.refuse(flag, text, "NAME=NUMBER or NUMBER")
        if not (name or names):
            message = f"{flag} {text}: the surface has no {flag.removeprefix('--')} that this could replace"
            raise OptionError(message, what=flag, found=text)
        new = {name: amount} if name else dict.fromkeys(names, amount)
        if new.keys() & values[bool(name)].keys():
            message = f"{flag}: {name or 'a bare value'} is given twice; keep one"
            raise OptionError(message, what=flag, found=text)
        values[bool(name)] |= new
    return values[False] | values[True]


def named_values(text: str) -> tuple[str, list[Any]]:
    """A name and its values from NAME=V1,V2.

    >>> named_values("alpha=2,4.5"), named_values("wall=upright")
    (('alpha', [2, 4.5]), ('wall', ['upright']))
    """
    name, sign, values = text.partition("=")
    if not (name and sign and all(values.split(","))):
        raise OptionError(f"expected NAME=VALUE or NAME=V1,V2, found {text!r}", what="values", found=text)
    return name, [_value(one) for one in values.split(",")]


def _value(text: str) -> Any:
    with suppress(ValueError, SyntaxError):
        value = ast.literal_eval(text.capitalize() if text.lower() in ("true", "false", "none") else text)
        return value if isinstance(value, int | float | None) else text
    return text


def check_start(start: bool, file: Path) -> None:
    """Refuse --start for a file that holds a surface."""
    if start and not is_project(file):
        text = f"--start: {file.name} is a surface, shown as it is; leave out --start"
        raise OptionError(text, what="--start")


def numbers(
    text: str, flag: str, expected: str = "numbers, with commas between them", size: int = 0
) -> list[float]:
    """The numbers in X,Y,..., which must be ``size`` if that is not 0."""
    with suppress(ValueError):
        found = [validate.parsed(part) for part in text.split(",")]
        if not size or len(found) == size:
            return found
    validate.refuse(flag, text, expected)


def parsed_view(text: str, picture: Path | None) -> Any:
    """The name of a view of a picture, or (azimuth, elevation)."""
    if picture is None and text != "diagonal":
        raise OptionError("--view: is of the picture; give --picture, too, or leave it out", what="--view")
    with suppress(ValueError):
        azimuth, elevation = map(validate.parsed, text.split(","))
        return azimuth, elevation
    return text
