"""Arguments that several commands have: files, NAME=VALUE, views."""

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
        help="Tension of a patch. A bare VALUE applies to every patch under pressure.",
    ),
]
Pressures = Annotated[
    list[str] | None,
    typer.Option(
        "--pressure",
        metavar="NAME=VALUE",
        help="Pressure on a patch. A bare VALUE applies to every patch under pressure; wall pressures are"
        " updated.",
    ),
]
ViewName = Annotated[
    str, typer.Option(metavar="NAME", help="diagonal, elevation, plan, or AZIMUTH,ELEVATION in degrees.")
]
Colour = Annotated[
    str, typer.Option("--colour", "--color", metavar="NAME", help="patches, curvature, error or reactions.")
]


def number(text: str | float) -> float:
    """The number in an option. The error shows the text, which typer's own parser does not."""
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter(f"expected a number, found {text!r}") from None


def integer(text: str | int) -> int:
    """The whole number in an option; see ``number``."""
    try:
        return int(text)
    except ValueError:
        raise typer.BadParameter(f"expected a whole number, found {text!r}") from None


def surface_in(file: Path) -> Surface:
    """The surface in a file, or the start surface of a project."""
    check_input(file)
    return projects.build(file) if file.suffix.lower() == TOML else read_bare(file)


def check_input(file: Path) -> None:
    """Refuse a file whose suffix is neither a project's nor a surface's."""
    suffix = file.suffix.lower()
    if suffix not in (TOML, *FORMATS):
        raise FileError(
            f"{file}: {unknown('suffix', suffix, [TOML, *FORMATS])}",
            what=str(file),
            found=suffix,
            expected=(TOML, *FORMATS),
        )


def retensioned(surface: Surface, tension: list[str] | None, pressure: list[str] | None) -> Surface:
    """The surface with the tensions and pressures of the command line."""
    loaded = [patch.name for patch in surface.patches if not patch.auxiliary]
    tensions, pressures = (_by_name(loaded, tension, "--tension"), _by_name(loaded, pressure, "--pressure"))
    return with_pressures(surface, tensions, pressures)


def _by_name(names: list[str], given: list[str] | None, option: str) -> dict[str, float]:
    """Value by patch, from NAME=VALUE, or VALUE for all ``names``. A later one replaces an earlier one."""
    values: dict[str, float] = {}
    for text in given or ():
        name, sign, value = text.rpartition("=")
        try:
            amount = float(value)
        except ValueError:
            amount = math.nan
        if (sign and not name) or math.isnan(amount):
            raise OptionError(
                f"{option}: expected NAME=NUMBER or NUMBER, found {text!r}", what=option, found=text
            )
        values |= {name: amount} if name else dict.fromkeys(names, amount)
    return values


def values_of(text: str) -> tuple[str, list[Any]]:
    """A name and its values from NAME=V1,V2.

    >>> values_of("alpha=2,4.5"), values_of("wall=upright")
    (('alpha', [2, 4.5]), ('wall', ['upright']))
    """
    name, sign, values = text.partition("=")
    if not (name and sign and all(values.split(","))):
        expected = "NAME=VALUE or NAME=V1,V2"
        raise OptionError(
            f"expected {expected}, found {text!r}", what="values", found=text, expected=expected
        )
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
