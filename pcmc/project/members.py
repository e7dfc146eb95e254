"""The members of a project in the files of its surface, and which files leave them out."""

from __future__ import annotations

import warnings
from functools import partial
from typing import TYPE_CHECKING

from ..base.errors import LostWarning, OptionError
from ..structure.drawn import DrawnMember, drawn_members
from ..structure.member_keys import members_of

if TYPE_CHECKING:
    from ..certificate import Certificate
    from ..surface import Surface
    from .outcome import Outcome


def members_drawn(
    outcome: Outcome, surface: Surface | None = None, certificate: Certificate | None = None
) -> tuple[DrawnMember, ...]:
    """The members on what is shown, or on another surface of the project; none where one cannot be there, as
    in a mirror plane."""
    project = outcome.project
    if project is None or project.structure is None or not has_members(outcome):
        return ()
    make = partial(project.structure.model, surface, True, certificate, outcome.units, project.plan)
    try:
        return drawn_members(outcome.model(project.structure, anyway=True) if surface is None else make())
    except OptionError:
        return ()


def warn_of_members(outcome: Outcome, what: str, held: bool = False) -> None:
    """LostWarning that files leave out the members of the structural model; files that could have ``held``
    them, where they cannot be on what is shown."""
    if has_members(outcome) and not (held and members_drawn(outcome)):
        why = (
            "they are known for a part of the roof alone"
            if held
            else "a wall in whose place one stands is drawn"
        )
        warnings.warn(f"{what}: members are left out; {why}", LostWarning, stacklevel=3)


def has_members(outcome: Outcome) -> bool:
    """Whether a project has members."""
    project = outcome.project
    structure = None if project is None else project.structure
    return project is not None and structure is not None and bool(members_of(structure.members, project.plan))
