"""Members of a project: [structure.members.NAME], and where a plan names them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..base import validate
from ..base.errors import OptionError, unknown
from ..plan import Plan
from ..plan.parts import check_keys, curve_of
from ..surface.curves import Curve
from .material import Material
from .members import ENDS, KINDS, Member
from .profile import Profile

SHAPES: dict[tuple[str, ...], Callable[..., Profile]] = {
    ("diameter", "thickness"): Profile.tube,
    ("diameter",): Profile.circle,
    ("width", "height"): Profile.rectangle,
    ("area", "upright", "sideways"): Profile,
    ("area", "upright"): Profile,
    ("area",): lambda area: Profile(area, area**2 / 12.0),  # of a cable, which does not bend
}


@dataclass(frozen=True)
class MemberSection:
    """A member: an arch, a beam or a cable; dividers and holes of the plan name it.

    Attributes
    ----------
    young : Young's modulus E > 0, force per area.
    poisson : Poisson's ratio ν, 0 ≤ ν < 0.5.
    density : mass per volume, as of the membranes.
    kind : a beam, which an arch is, too, or a cable, without bending stiffness.
    ends : of a beam at supports: hinged, or clamped.
    diameter : of a round section, length.
    thickness : of the wall of a tube, length; without it a round section is solid.
    width, height : of a rectangle, length; the height is upright.
    area : of any other section, length².
    upright, sideways : its second moments of area, length⁴, for bending in the upright plane and out of it;
        by default both are alike. A cable needs none.
    on : names of walls and cables that it takes the place of, besides those of dividers that name it.
    along : curves on edges of the outline or of a hole that it carries, from end to end of each.
    propped : whether columns or a wall carry it upright, all along such an edge.
    bars : columns, or stays where the kind is cable: pairs of points, the support point of the roof, by its
        name in [plan.points] or [x, y], and the foot or anchor, [x, y, z] or [x, y] on Π.
    strength : stress that a column or a stay may have, force per area.
    """

    young: float | None = None
    poisson: float = 0.3
    density: float = 0.0
    kind: str = field(default="beam", metadata={"kind": KINDS})
    ends: str = field(default="hinged", metadata={"kind": ENDS})
    diameter: float | None = None
    thickness: float | None = None
    width: float | None = None
    height: float | None = None
    area: float | None = None
    upright: float | None = None
    sideways: float | None = None
    on: Sequence[str] = ()
    along: Sequence[Any] = field(default=(), metadata={"kind": "a list of curves or tables"})
    propped: bool = False
    bars: Sequence[Any] = field(default=(), metadata={"kind": "a list of pairs of points"})
    strength: float = 0.0

    def profile(self, name: str) -> Profile:
        """Its cross-section; OptionError, with the member's ``name``, where none is given, or two."""
        sizes = tuple(dict.fromkeys(key for keys in SHAPES for key in keys))
        given = {key: getattr(self, key) for key in sizes if getattr(self, key) is not None}
        for keys, make in SHAPES.items():
            if set(keys) == set(given) and (keys != ("area",) or self.kind == "cable"):
                values = [validate.number(key, given[key], above=0.0, where=name) for key in keys]
                return make(*values)
        wanted = "diameter and thickness, width and height, or area and upright"
        found = " and ".join(given) or "none"
        text = f"member {name!r} has no section: expected {wanted} (of a cable area alone), found {found}"
        raise OptionError(text, what="structure.members", where=name)

    def member(self, name: str, on: Any) -> Member:
        """The member along a line, or between two points."""
        if self.young is None:
            text = f"member {name!r} has no material; give it young, Young's modulus"
            raise OptionError(text, what="structure.members", where=name)
        material = Material(self.young, self.poisson, self.density)
        propped = self.propped and isinstance(on, Curve)
        label = on if isinstance(on, str) else name
        return Member(on, self.profile(name), material, self.kind, self.ends, propped, label, self.strength)

    def between(self, name: str, points: Mapping[str, Any]) -> Iterator[Member]:
        """Its columns or stays; ``points`` are those of the plan by name."""
        for pair in self.bars:
            on = list(pair) if isinstance(pair, Sequence) and not isinstance(pair, str) else pair
            if isinstance(on, list) and on and isinstance(on[0], str):
                if on[0] not in points:
                    text = f"member {name!r}: {unknown('point', on[0], list(points))} in [plan.points]"
                    raise OptionError(text, what="structure.members", where=name, found=on[0])
                on[0] = points[on[0]]
            yield self.member(name, on)


def members_of(given: Mapping[str, Mapping[str, Any]], plan: Plan | None) -> tuple[Member, ...]:
    """The members of [structure.members] where they and the plan say; OptionError for what is not there.

    >>> line = {"curve": [[2, 0], [2, 2]], "member": "arch"}
    >>> plan = Plan([[0, 0], [4, 0], [4, 2], [0, 2]], [line], tension=2.0)
    >>> [arch] = members_of({"arch": {"young": 2.1e8, "width": 0.1, "height": 0.2}}, plan)
    >>> arch.on, arch.profile.sizes
    ('wall 1', (0.1, 0.2))
    """
    for name, table in given.items():
        check_keys(table, MemberSection, f"structure.members.{name}")
    known, members = {name: MemberSection(**table) for name, table in given.items()}, list[Member]()
    for name, section in known.items():
        section.profile(name)
        members += [section.member(name, on) for on in section.on]
        curves = [curve_of(curve, f"member {name!r}") for curve in section.along]
        members += [section.member(name, curve) for curve in curves]
        members += section.between(name, plan.points) if plan is not None else ()
    for owner, name, on in () if plan is None else _sites(plan):
        if name not in known:
            text = f"{owner}: {unknown('member', name, list(known))}; add [structure.members.{name}]"
            raise OptionError(text, what="member", where=owner, found=name)
        members.append(known[name].member(name, on))
    return tuple(members)


def _sites(plan: Plan) -> Iterator[tuple[str, str, str | Curve]]:
    """The dividers and holes with a member: their names, that of the member, and where it is."""
    for number, divider in enumerate(plan.dividers, 1):
        if divider.member and divider.wall is None and divider.cable is None:
            text = f"divider {number}: member = {divider.member!r} takes the place of a wall; give it one"
            raise OptionError(text, what="member", where=divider.name)
        if divider.member:
            yield f"divider {number}", divider.member, divider.name
    for hole in plan.holes:
        if hole.member and hole.edge not in ("fixed", "sliding"):
            text = f'{hole.name}: a member carries a held edge, but this is edge = "{hole.edge}"'
            raise OptionError(f'{text}; make it edge = "fixed"', what="member", where=hole.name)
        if hole.member:
            yield hole.name, hole.member, hole.curve
