"""Arguments that several commands have: files, NAME=VALUE, views."""

from __future__ import annotations

import ast
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import project as projects
from ..base import validate
from ..base.errors import FileError, OptionError, unknown
from ..base.units import LENGTHS
from ..forces.rooms import refuse_varied_pressure
from ..io import FORMATS, READ_ONLY
from ..project import Outcome, Project
from ..project.output import OnStep
from ..surface import Surface

TOML, DXF = ".toml", ".dxf"


def option(metavar: str, meaning: str, *names: str, **more: Any) -> Any:
    """An option of a command: what stands for its value, and its help."""
    return typer.Option(*names, metavar=metavar, help=meaning, **more)


INPUT = "A surface, a project (.toml), or a drawing (.dxf, .3dm)."
Input = Annotated[Path, typer.Argument(metavar="FILE", help=INPUT)]
_EVERY = "A bare VALUE applies to every patch under pressure"
Settings = Annotated[list[str] | None, option("NAME=VALUE", f"Tension of a patch. {_EVERY}.", "--tension")]
Pressures = Annotated[
    list[str] | None,
    option("NAME=VALUE", f"Pressure on a patch. {_EVERY}; wall pressures are updated.", "--pressure"),
]
Weights = Annotated[
    list[str] | None,
    option("NAME=VALUE", "Weight of a patch per area. A bare VALUE applies to every patch.", "--weight"),
]
SNOW = "Snow on a patch, per area of the plan. A bare VALUE applies to every patch under pressure."
Snows = Annotated[list[str] | None, option("NAME=VALUE", SNOW, "--snow")]
Cables = Annotated[
    list[str] | None, option("NAME=VALUE", "Tension of a cable. A bare VALUE applies to all.", "--cable")
]
Volumes = Annotated[
    list[str] | None, option("NAME=VALUE", "Volume of a room that has one already.", "--volume")
]
ViewName = Annotated[str, option("NAME", "diagonal, elevation, plan, or AZIMUTH,ELEVATION in degrees.")]
Colour = Annotated[str, option("NAME", "patches, curvature, error or reactions.", "--colour", "--color")]
START = "The start shape of a project, before it is solved, instead of its designed roof."
Start = Annotated[bool, typer.Option("--start", help=START)]
CACHE = "Keep a project's roof and take it from there the next time; --no-cache solves it again."
Cache = Annotated[bool, typer.Option("--cache/--no-cache", help=CACHE)]
WHOLE = "Unfold a surface at its mirror planes: the whole roof instead of its piece."
Whole = Annotated[bool, typer.Option("--whole", help=WHOLE)]
UNITS = (
    f"Unit of the lengths: {', '.join(LENGTHS)}. A file in another one is converted; by default the file's."
)
FileUnits = Annotated[str, option("NAME", UNITS, "--units")]
MANY_FILES = option("FILE", "File to write; may be repeated.", "-o", "--output")


def number(text: str | float) -> float:
    """The number in an option. The error shows the text, which typer's own parser does not."""
    try:
        return validate.parsed(str(text))
    except ValueError:
        raise typer.BadParameter(f"expected a number, found {text!r}") from None


def integer(text: str | int) -> int:
    """The whole number in an option; see ``number``."""
    try:
        validate.parsed(str(text))  # which refuses 1_000
        return int(text)
    except ValueError:
        raise typer.BadParameter(f"expected a whole number, found {text!r}") from None


@dataclass(frozen=True)
class Loads:
    """Values of the command line that replace those of a surface: each a list of NAME=VALUE, or VALUE."""

    tension: list[str] | None = None
    pressure: list[str] | None = None
    weight: list[str] | None = None
    cable: list[str] | None = None
    volume: list[str] | None = None
    snow: list[str] | None = None

    def __bool__(self) -> bool:
        """Whether there are any."""
        return any(vars(self).values())

    def of(self, surface: Surface) -> Surface:
        """The surface with these values; wall pressures follow those of their rooms."""
        sheets = [patch.name for patch in surface.patches if not patch.wall]
        loaded = [patch.name for patch in surface.patches if not patch.auxiliary] or sheets
        pressures = by_name(loaded, self.pressure, "--pressure")
        refuse_varied_pressure(surface, map(surface.patch_index, pressures))
        return surface.retensioned(
            by_name(loaded, self.tension, "--tension"),
            pressures,
            weights=by_name(sheets, self.weight, "--weight"),
            snows=by_name(loaded, self.snow, "--snow"),
            cables=by_name([cable.name for cable in surface.cables], self.cable, "--cable"),
            volumes=by_name([room.name for room in surface.rooms], self.volume, "--volume"),
        )


def load(file: Path, units: str = "") -> Project:
    """The project in a file, which may be a mesh or a drawing alone."""
    check_input(file)
    return projects.load(file, units=units)


def opened(file: Path, say: OnStep, loads: Loads | None = None, *, units: str = "", **how: Any) -> Outcome:
    """The roof in a file, with the loads of the command line; ``how`` as of ``pcmc.project.opened``."""
    return projects.opened(load(file, units), say, changed=loads.of if loads else None, **how)


def to_build(project: Project, say: OnStep, *, anyway: bool, cache: bool, whole: bool) -> Outcome:
    """The roof of a project, for what is built: one that misses its targets is refused, unless ``anyway``.

    With ``whole``, or where its project asks for it, the roof is unfolded at its mirror planes.
    """
    roof, file = projects.opened(project, say, use_cache=cache), project.path
    if whole:
        roof = roof.unfolded()
    if roof.certified and not roof.good and not anyway:
        hint = f"pcmc solve {file} shows them, --anyway accepts the roof"
        text = f"{file}: the roof misses its targets or its accuracy; {hint}"
        raise FileError(text, what=str(file))
    return roof


def check_input(file: Path) -> None:
    """Refuse a file whose suffix is neither a project's nor a drawing's nor a surface's."""
    suffix, known = file.suffix.lower(), (TOML, *FORMATS, *READ_ONLY, DXF)
    if suffix not in known:
        raise FileError(f"{file}: {unknown('suffix', suffix, known)}", what=str(file))


def by_name(names: list[str], given: list[str] | None, flag: str) -> dict[str, float]:
    """Value by name, from NAME=VALUE, or VALUE for all ``names``. A later one replaces an earlier one."""
    values: dict[str, float] = {}
    for text in given or ():
        name, sign, value = text.rpartition("=")
        try:
            amount = validate.parsed(value)
        except ValueError:
            amount = math.nan
        if (sign and not name) or math.isnan(amount):
            validate.refuse(flag, text, "NAME=NUMBER or NUMBER")
        if not (name or names):
            message = f"{flag} {text}: the surface has no {flag.removeprefix('--')} that this could replace"
            raise OptionError(message, what=flag, found=text)
        values |= {name: amount} if name else dict.fromkeys(names, amount)
    return values


def values_of(text: str) -> tuple[str, list[Any]]:
    """A name and its values from NAME=V1,V2.

    >>> values_of("alpha=2,4.5"), values_of("wall=upright")
    (('alpha', [2, 4.5]), ('wall', ['upright']))
    """
    name, sign, values = text.partition("=")
    if not (name and sign and all(values.split(","))):
        raise OptionError(f"expected NAME=VALUE or NAME=V1,V2, found {text!r}", what="values", found=text)
    return name, [_value(one) for one in values.split(",")]


def _value(text: str) -> Any:
    words = {"true": True, "false": False, "none": None}
    if text.lower() in words:
        return words[text.lower()]
    try:
        number = ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text
    return number if isinstance(number, int | float) else text


def view_of(text: str) -> Any:
    """The name of a view, or (azimuth, elevation)."""
    try:
        azimuth, elevation = map(validate.parsed, text.split(","))
    except ValueError:
        return text
    return azimuth, elevation
