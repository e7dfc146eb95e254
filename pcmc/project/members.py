"""The members of a project in the files of its surface, and which of them files leave out."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..base.errors import LostWarning, OptionError
from ..structure.member_keys import members_of
from ..structure.members import Member, MemberLine, lines_on

if TYPE_CHECKING:
    from .outcome import Outcome


def members_named(outcome: Outcome) -> tuple[Member, ...]:
    """The members that a project names."""
    if (project := outcome.project) is None or project.structure is None:
        return ()
    return members_of(project.structure.members, project.plan)


def member_lines(outcome: Outcome) -> tuple[MemberLine, ...]:
    """The lines of members on what is shown; none where one cannot be there, as in a mirror plane."""
    try:
        lines = lines_on(outcome.shown.surface, members_named(outcome))
    except OptionError:
        return ()
    return () if outcome.unfold and any(not line.wall for line in lines) else lines


def members_left_out(outcome: Outcome, held: Sequence[MemberLine] = ()) -> str:
    """That a file has no members but those ``held``; empty if it has all."""
    kept = [line.member for line in held]
    labels = dict.fromkeys(member.label for member in members_named(outcome) if member not in kept)
    text = f"members are left out ({', '.join(labels)}); a wall in whose place one stands is drawn"
    return text if labels else ""


def warn_of_members(outcome: Outcome, what: str, held: Sequence[MemberLine] = ()) -> None:
    """LostWarning that surface files or drawings leave out members of the structural model."""
    if text := members_left_out(outcome, held):
        warnings.warn(f"{what}: {text}", LostWarning, stacklevel=3)
