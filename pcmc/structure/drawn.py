"""Members as files, drawings and the page have them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.arrays import Floats
from ..base.units import Units
from ..forces.cables import pull_along
from .columns import columns_at_rest
from .frames import bar_axes
from .member_forces import members_at_rest
from .members import Member
from .model import StructuralModel


@dataclass(frozen=True, eq=False)
class DrawnMember:
    """The axis of a member, with its section, and its force at rest where that is known."""

    name: str
    kind: str  # "beam" or "cable" along edges, "column" or "stay" at a point
    member: Member
    points: Floats  # (k,3) of its axis; the first is not repeated where it is closed
    closed: bool = False
    wall: str = ""  # in whose place it is
    forces: tuple[float, float] | None = None  # the least and the largest N at rest, tension above 0

    @property
    def path(self) -> Floats:
        """(b+1,3) its points, the first again at the end where it is closed."""
        return np.vstack([self.points, self.points[:1]]) if self.closed else self.points

    def segments(self, up: Floats) -> tuple[Floats, Floats, Floats]:
        """(b,3) where its pieces begin; (b,3,3) rows along each, across, and upright; (b,) lengths."""
        first = np.arange(len(self.path) - 1)
        return self.path[:-1], *bar_axes(self.path, np.stack([first, first + 1], axis=1), up)

    def texts(self, units: Units) -> dict[str, str]:
        """What it is, in words and numbers with units, by key.

        >>> from pcmc import Material, Profile
        >>> mast = Member([[0, 0, 3], [0, 0, 0]], Profile.circle(0.1), Material(2.1e8), name="mast")
        >>> drawn = DrawnMember("mast", "column", mast, np.array(mast.on), forces=(-9.0, -9.0))
        >>> [drawn.texts(Units("m", "kN"))[key] for key in ("section", "N at rest")]
        ['circle 0.1 m', '-9 kN']
        """
        profile, material = self.member.profile, self.member.material
        length, force = units.behind("length"), units.behind("force")
        texts = {"member": self.name, "kind": self.kind, "in the place of": self.wall}
        texts["section"] = f"{profile.label}{length}" if profile.shape else ""
        texts["area"] = f"{profile.area:.4g}{units.behind('area')}"
        texts["Young's modulus"] = f"{material.young:.4g}{units.behind('pressure')}"
        texts["length"] = f"{np.linalg.norm(np.diff(self.path, axis=0), axis=1).sum():.4g}{length}"
        if self.forces is not None:
            ends = dict.fromkeys(f"{N:.4g}" for N in self.forces)
            texts["N at rest"] = f"{' to '.join(ends)}{force}"
        return {key: text for key, text in texts.items() if text}


def drawn_members(model: StructuralModel) -> tuple[DrawnMember, ...]:
    """All members of a model but its surface's own cables; with forces where the surface is certified.

    >>> from pcmc import Material, Profile
    >>> from pcmc.plan import Plan
    >>> hall = Plan([[0, 0], [4, 0], [4, 2], [0, 2]], [[[2, 0], [2, 2]]], edge_length=0.5, tension=2.0)
    >>> arch = Member("wall 1", Profile.tube(0.1, 0.005), Material(2.1e8))
    >>> model = StructuralModel(hall.surface(), Material(5e5), 1e-3, members=[arch], anyway=True)
    >>> [(one.name, one.kind, one.wall, one.forces) for one in drawn_members(model)]
    [('wall 1', 'beam', 'wall 1', None)]
    """
    X, drawn, known = model.standing.vertices, list[DrawnMember](), model.certificate.certified
    found = {beam.line.name: beam.within[:, 0] for beam in members_at_rest(model)} if known else {}
    for cable in model.standing.cables if known else ():
        found[cable.name] = pull_along(model.standing, cable, cable.edges)
    for name, own in columns_at_rest(model).groupby("member") if known else ():
        found[str(name)] = own["N"].to_numpy()
    forces = {name: (float(N.min()), float(N.max())) for name, N in found.items()}
    for line in model.lines:
        about = line.closed, line.wall, forces.get(line.name)
        drawn.append(DrawnMember(line.name, line.member.kind, line.member, X[line.vertices], *about))
    for bar in model.bars:
        drawn.append(DrawnMember(bar.name, bar.kind, bar.member, bar.points, forces=forces.get(bar.name)))
    return tuple(drawn)
