"""What to type where finer meshes do not hold a roof: walls that stay upright, stronger ones, a flatter roof.

Near its end on a straight outline a junction lies down along one of its sheets, unless its wall holds it in
a plane or down on its bottom: weak walls have shapes on coarse meshes that no smooth surface has. Near a
small hole, or a corner that points into the roof, a high roof is steeper than a surface can be.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..base.arrays import toml_key
from ..plan import Plan
from ..surface import Plane, Surface
from ..surface.curves import Curve
from ..surface.pieces import two_digits
from .advice import changes, with_dividers, with_upright
from .rises import Rise, net_pressures, outline_heights

STRONG = (1.0, 1.6)  # times the largest tension of the patches: such walls rest at their ends, or all along
FLATTER = (0.85, 0.7, 0.5)  # times the heights wanted, or 1 over these times the tensions given
LOWER = (0.7, 0.5, 0.35)  # times the heights of raised lines, at whose ends a sail is steep

Change = tuple[Plan, Sequence[Rise], list[str]]  # a plan, the heights that it is to have, the lines to type


def firmer_walls(plan: Plan, surface: Surface, rises: Sequence[Rise]) -> Iterator[Change]:
    """The plan with upright walls, then with strong ones; ``surface`` is its roof, ``rises`` its heights."""
    most = float(surface.tensions[surface.roof].max(initial=0.0))
    walls = {divider.name for divider in plan.dividers if divider.wall is not None}
    strong = [with_dividers(plan, walls, wall=two_digits(times * most)) for times in STRONG if walls]
    for other in filter(None, (with_upright(plan), *strong)):
        yield other, rises, changes(plan, other)


def flatter(plan: Plan, rises: Sequence[Rise]) -> Iterator[Change]:
    """The plan with lower heights, or with higher tensions where it has no ``rises``; none for a sail."""
    loaded = rises or any(net_pressures(plan).values()) or (plan.tension and plan.pressure != plan.snow)
    for share in FLATTER if loaded else ():
        lower = [_lower(rise, share) for rise in rises]
        other = plan if rises else _scaled(plan, 1.0 / share)
        lines = [_line(*both) for both in zip(rises, lower, strict=True)] or changes(plan, other)
        yield other, lower, lines


def lower_lines(plan: Plan) -> Iterator[Change]:
    """The plan with its raised lines nearer to its outline's level; none where Π is not z = 0."""
    level = float(outline_heights(plan).mean())
    curves = {k: s for k, s in enumerate(plan.supports) if isinstance(s, Curve) and plan.plane == Plane()}
    tops = {k: float(z.max()) for k, c in curves.items() for z in c.at(c.dense).T[2:] if (z != level).any()}
    for share in LOWER if tops else ():
        supports, lines = [*plan.supports], []
        for k, top in tops.items():
            supports[k] = curves[k].mapped(np.diag([1.0, 1.0, share]), np.array([0, 0, (1 - share) * level]))
            over = f" over {level:g}" if level else ""
            change = f"{share:g} times its heights{over}, up to {level + share * (top - level):g}"
            lines.append(f"[plan] supports number {k + 1}: {change}  (now up to {top:g})")
        yield replace(plan, supports=supports), (), lines


def _lower(rise: Rise, share: float) -> Rise:
    value = rise.value / share if rise.kind == "span_ratio" else rise.value * share
    return replace(rise, value=two_digits(value))


def _line(rise: Rise, lower: Rise) -> str:
    place = "[plan]" if rise.patch is None else f"[plan.patches] {toml_key(rise.patch)}:"
    return f"{place} {rise.kind} = {lower.value:g}  (now {rise.value:g})"


def _scaled(plan: Plan, factor: float) -> Plan:
    areas = [replace(area, tension=two_digits(area.tension * factor)) for area in plan.patches]
    whole = None if plan.tension is None else two_digits(plan.tension * factor)
    return replace(plan, patches=areas, tension=whole)
