"""A roof with free edges as a sail: cables along these edges, and no pressure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..plan import Plan
from ..plan.edges import usual_cable
from .rises import Rise


def as_sail(plan: Plan, rises: Sequence[Rise] = ()) -> Plan | None:
    """The plan with a cable along each free edge and without pressure; None if no edge is free.

    A tension that stands for a rise becomes 1: a sail has the height of its supports.

    >>> square = [[0, 0], [8, 0], [8, 8], [0, 8]]
    >>> tent = Plan(square, edge_length=1, tension=2.0, edge="free", supports=[[0, 0, 1], [8, 8]])
    >>> sail = as_sail(tent)
    >>> sail.edge, sail.cable, sail.pressure
    ('cable', 24.0, 0.0)
    """
    free = [part for part in (plan, *plan.holes) if part.edge == "free"]
    if not free:
        return None
    if rises and plan.tension is not None:
        plan = replace(plan, tension=1.0)
    named = {rise.patch for rise in rises}
    areas = [
        replace(area, pressure=0.0, tension=1.0 if area.name in named else area.tension)
        for area in plan.patches
    ]
    cable = usual_cable(plan)
    holes = [replace(h, edge="cable", cable=cable) if h.edge == "free" else h for h in plan.holes]
    edge, around = ("cable", cable) if plan.edge == "free" else (plan.edge, plan.cable)
    return replace(plan, pressure=0.0, patches=areas, holes=holes, edge=edge, cable=around)


def sail_lines(plan: Plan, sail: Plan, rises: Sequence[Rise]) -> list[str]:
    """What to type for the sail."""
    lines = []
    if sail.edge != plan.edge:
        lines += ['[plan] edge = "cable"', f"[plan] cable = {sail.cable:g}"]
    for number, (before, after) in enumerate(zip(plan.holes, sail.holes, strict=True), 1):
        if after.edge != before.edge:
            lines.append(f'[[plan.holes]] number {number}: edge = "cable", cable = {after.cable:g}')
    for rise in rises:
        place = "[plan]" if rise.patch is None else f"[plan.patches] {rise.patch}:"
        lines.append(f"{place} tension = 1.0  (instead of {rise.kind})")
    if plan.tension is not None:
        return [*lines, *(["[plan] pressure = 0.0"] if plan.pressure else [])]
    return [*lines, *(f"[plan.patches] {a.name}: pressure = 0.0" for a in plan.patches if a.pressure)]
