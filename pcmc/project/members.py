"""The members of a project in the files of its surface, and which files leave them out."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

from ..base.errors import LostWarning, OptionError
from ..structure.columns import drawn_members
from ..structure.section import members_of

if TYPE_CHECKING:
    from ..certificate import Certificate
    from ..structure import Member, PlacedMember, StructuralModel
    from ..surface import Surface
    from .file import Project
    from .outcome import Outcome


def model_with_members(
    outcome: Outcome,
    surface: Surface | None = None,
    certificate: Certificate | None = None,
    cables: bool = False,
) -> StructuralModel | None:
    """The structural model of what is shown, or of another surface of the project; None without members (nor,
    if they count, ``cables``), or where one cannot be there, as in a mirror plane."""
    project = outcome.project
    counts = has_members(outcome) or (cables and outcome.surface.cables)
    if project is None or project.structure is None or not counts:
        return None
    try:
        if surface is None:
            return outcome.model(project.structure, anyway=True)
        about = {"certificate": certificate, "units": outcome.units}
        return project.structure.model(surface, project.plan, anyway=True, **about)
    except OptionError:
        return None


def members_drawn(
    outcome: Outcome, surface: Surface | None = None, certificate: Certificate | None = None
) -> tuple[PlacedMember, ...]:
    """The members of that model, as drawings and the page have them."""
    model = model_with_members(outcome, surface, certificate)
    return () if model is None else drawn_members(model)


def filed_besides(outcome: Outcome) -> dict[str, Any]:
    """What files hold besides the surface, as ``io.write`` takes it: members and the cables' sections of the
    structural model, and the place on a map."""
    besides, model = {"georeference": outcome.output.georeference}, model_with_members(outcome, cables=True)
    if model is None:
        return besides
    members = drawn_members(model) if model.members else ()
    return {**besides, "members": members, "cable_areas": model.cable_areas}


def warn_of_members(outcome: Outcome, what: str, held: bool = False) -> None:
    """LostWarning that files leave out the members of the structural model; files that could have ``held``
    them, where they cannot be on what is shown."""
    project = outcome.project
    if project is None or project.structure is None or not has_members(outcome):
        return
    ropes, why = [cable.name for cable in outcome.surface.cables], ""
    if held:
        try:
            outcome.model(project.structure, anyway=True)
            return
        except OptionError as error:
            why = f"; {error}"
    elif any(isinstance(one.on, str) and one.on not in ropes for one in _members(project)):
        why = "; a wall in whose place one stands is drawn"
    warnings.warn(f"{what}: members are left out{why}", LostWarning, stacklevel=3)


def has_members(outcome: Outcome) -> bool:
    return outcome.project is not None and bool(_members(outcome.project))


def _members(project: Project) -> tuple[Member, ...]:
    return () if project.structure is None else members_of(project.structure.members, project.plan)
