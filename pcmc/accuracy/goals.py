"""The accuracy wanted of quantities, by name: ``{"height": 1e-3}`` or ``"height=1e-3"``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from ..base import validate
from ..base.errors import OptionError
from ..surface import Surface
from .estimator import QUANTITIES, Goal

Accuracy = Mapping[str, float] | str


def accuracies(given: Any) -> dict[str, float]:
    """The accuracy (> 0) by the name of a quantity, such as ``"height"`` or ``"height of north"``.

    Parameters
    ----------
    given : a mapping, or text such as ``"height=1e-3, area of north=0.01"``.

    Raises
    ------
    OptionError
        For a quantity that does not exist, an accuracy that is not positive, or none at all.

    Examples
    --------
    >>> accuracies("height=1e-3, area of north=0.01")
    {'height': 0.001, 'area of north': 0.01}
    >>> accuracies({"hight": 1e-3})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    pcmc.base.errors.OptionError: unknown quantity 'hight'; did you mean 'height'? Known: height, ...
    """
    expected = "a table such as {'height': 1e-3}, or a text such as 'height=1e-3'"
    wanted = _from_text(given) if isinstance(given, str) else given
    if not isinstance(wanted, Mapping) or not wanted:
        validate.refuse("accuracy", given, expected)
    found = {}
    for name, value in wanted.items():
        validate.choice("quantity", str(name).partition(" of ")[0], QUANTITIES)
        found[str(name)] = validate.number("accuracy", value, above=0.0, where=str(name))
    return found


def check_places(wanted: Mapping[str, float], surface: Surface) -> None:
    """Refuse a quantity of a patch that the surface does not have."""
    for name in wanted:
        _, of, patch = name.partition(" of ")
        if of:
            surface.patch_index(patch.partition(" near ")[0])


def goals_in(table: pd.DataFrame, wanted: Mapping[str, float]) -> dict[Goal, float]:
    """The accuracy of each row of a mesh check's table that is asked for.

    A quantity alone stands for that of the whole surface, and where there is none, as for heights, for
    those of all patches. With a patch it stands for all curves of that patch, too.
    """
    goals: dict[Goal, float] = {}
    for name, accuracy in wanted.items():
        quantity, _, patch = name.partition(" of ")
        rows = [str(of) for of in table["of"][table["quantity"] == quantity]]
        if patch:
            rows = [of for of in rows if patch in (of, of.partition(" near ")[0])]
        elif "" in rows:
            rows = [""]
        if not rows:
            message = f"accuracy: the surface has no {name}; print(pcmc.check_mesh(...)) shows what it has"
            raise OptionError(message, what="accuracy", found=name)
        goals |= dict.fromkeys(((quantity, of) for of in rows), accuracy)
    return goals


def _from_text(text: str) -> dict[str, float]:
    """Accuracies from ``name=value, name=value``."""
    wanted = {}
    for part in text.split(","):
        name, sign, value = part.rpartition("=")
        try:
            wanted[name.strip()] = validate.parsed(value)
        except ValueError:
            sign = ""
        if not sign or not name.strip():
            validate.refuse("accuracy", part.strip(), "QUANTITY=NUMBER, such as height=1e-3")
    return wanted
