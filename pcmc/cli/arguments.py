"""What the commands are given: files, NAME=VALUE, views."""

from __future__ import annotations

import ast
import math
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import project as projects
from ..base.errors import FileError, OptionError, unknown
from ..io import FORMATS, read_bare
from ..surface import Surface
from ..surface.wall_pressures import with_pressures

TOML = ".toml"

Input = Annotated[Path, typer.Argument(metavar="FILE", help="A surface, or a project (.toml).")]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--tension",
        metavar="NAME=VALUE",
        help="Tension of a patch; VALUE alone: of all under pressure.",
    ),
]
Pressures = Annotated[
    list[str] | None,
    typer.Option(
        "--pressure",
        metavar="NAME=VALUE",
        help="Pressure on a patch; VALUE alone: on all under pressure. Walls follow.",
    ),
]
ViewName = Annotated[
    str,
    typer.Option(
        metavar="NAME", help="diagonal, elevation, plan, or AZIMUTH,ELEVATION in degrees."
    ),
]
Colour = Annotated[
    str,
    typer.Option(
        "--colour", "--color", metavar="NAME", help="patches, curvature, error or reactions."
    ),
]


def number(text: str | float) -> float:
    """A number as an option has it; what else is found there is said, which typer's own parser hides."""
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter(f"expected a number, found {text!r}") from None


def whole(text: str | int) -> int:
    """A whole number as an option has it; see ``number``."""
    try:
        return int(text)
    except ValueError:
        raise typer.BadParameter(f"expected a whole number, found {text!r}") from None


def surface_in(file: Path) -> Surface:
    """A surface from its file, or the one that a project starts from."""
    check_input(file)
    return projects.build(file) if file.suffix.lower() == TOML else read_bare(file)


def check_input(file: Path) -> None:
    """Refuse a file that is neither a project nor a surface by its name."""
    suffix = file.suffix.lower()
    if suffix not in (TOML, *FORMATS):
        raise FileError(f"{file}: {unknown('suffix', suffix, [TOML, *FORMATS])}")


def retensioned(surface: Surface, tension: list[str] | None, pressure: list[str] | None) -> Surface:
    loaded = [patch.name for patch in surface.patches if not patch.auxiliary]
    tensions, pressures = (
        _by_name(loaded, tension, "--tension"),
        _by_name(loaded, pressure, "--pressure"),
    )
    return with_pressures(surface, tensions, pressures)


def _by_name(names: list[str], given: list[str] | None, option: str) -> dict[str, float]:
    """Values by patch from NAME=VALUE, and VALUE for those named; the later ones win."""
    found: dict[str, float] = {}
    for text in given or ():
        name, sign, value = text.rpartition("=")
        try:
            amount = float(value)
        except ValueError:
            amount = math.nan
        if (sign and not name) or math.isnan(amount):
            raise OptionError(f"{option}: expected NAME=NUMBER or NUMBER, found {text!r}")
        found |= {name: amount} if name else dict.fromkeys(names, amount)
    return found


def values_of(text: str) -> tuple[str, list[Any]]:
    """A name and its values from NAME=V1,V2.

    >>> values_of("alpha=2,4.5"), values_of("wall=upright")
    (('alpha', [2, 4.5]), ('wall', ['upright']))
    """
    name, sign, values = text.partition("=")
    if not (name and sign and all(values.split(","))):
        raise OptionError(f"expected NAME=VALUE or NAME=V1,V2, found {text!r}")
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
        azimuth, elevation = (float(part) for part in text.split(","))
    except ValueError:
        return text
    return azimuth, elevation
