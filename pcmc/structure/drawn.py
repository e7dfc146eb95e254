"""Members as files, drawings and the page have them: with their forces at rest."""

from __future__ import annotations

from dataclasses import replace

from ..forces.cables import pull_along
from .columns import columns_at_rest
from .member_forces import members_at_rest
from .members import PlacedMember
from .model import StructuralModel


def drawn_members(model: StructuralModel) -> tuple[PlacedMember, ...]:
    """All members of a model but its surface's own cables; with forces where the surface is certified.

    >>> from pcmc import Material, Member, Profile
    >>> from pcmc.plan import Plan
    >>> hall = Plan([[0, 0], [4, 0], [4, 2], [0, 2]], [[[2, 0], [2, 2]]], edge_length=0.5, tension=2.0)
    >>> arch = Member("wall 1", Profile.tube(0.1, 0.005), Material(2.1e8))
    >>> model = StructuralModel(hall.surface(), Material(5e5), 1e-3, members=[arch], anyway=True)
    >>> [(one.name, one.kind, one.wall, one.forces) for one in drawn_members(model)]
    [('wall 1', 'beam', 'wall 1', None)]
    """
    members = *model.lines, *model.bars
    if not model.certificate.certified:
        return members
    found = {beam.line.name: beam.within[:, 0] for beam in members_at_rest(model)}
    found |= {cable.name: pull_along(model.standing, cable, cable.edges) for cable in model.standing.cables}
    found |= {str(name): own["N"].to_numpy() for name, own in columns_at_rest(model).groupby("member")}
    forces = {name: (float(N.min()), float(N.max())) for name, N in found.items()}
    return tuple(replace(member, forces=forces.get(member.name)) for member in members)
