"""Kinds of options, and how their values are read."""

from __future__ import annotations

from typing import Any

import typer

from ..base import validate
from ..base.units import LENGTHS


def option(metavar: str, meaning: str, *names: str, **more: Any) -> Any:
    """An option of a command: what stands for its value, and its help."""
    return typer.Option(*names, metavar=metavar, help=meaning, **more)


def amount(metavar: str, meaning: str) -> Any:
    """An option with a number."""
    return option(metavar, meaning, parser=parsed_number)


def count(meaning: str) -> Any:
    """An option with a whole number."""
    return option("NUMBER", meaning, parser=parsed_integer)


def by_part(meaning: str) -> Any:
    """An option with a value for each of some parts; see ``by_name``."""
    return option("NAME=VALUE", meaning)


def switch(name: str, meaning: str) -> Any:
    """An option without a value."""
    return typer.Option(name, help=meaning)


def parsed_number(text: str | float) -> float:
    """The number in an option. The error shows the text, which typer's own parser does not."""
    try:
        return validate.parsed(str(text))
    except ValueError:
        raise typer.BadParameter(f"expected a number, found {text!r}") from None


def parsed_integer(text: str | int) -> int:
    """The whole number in an option; see ``parsed_number``."""
    try:
        validate.parsed(str(text))  # which refuses 1_000
        return int(text)
    except ValueError:
        raise typer.BadParameter(f"expected a whole number, found {text!r}") from None


def parsed_unit(text: str) -> str:
    """A unit of length in an option; empty for none."""
    return validate.choice("--units", text, LENGTHS) if text else text
