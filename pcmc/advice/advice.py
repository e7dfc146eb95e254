"""What was chosen for a project, and the plans to try where its roof does not rest or finer meshes lose it.

Near its end on a straight outline a junction lies down along one of its sheets, unless its wall holds it in
a plane or down on its bottom: weak walls have shapes on coarse meshes that no smooth surface has. Near a
small hole, or a corner that points into the roof, a high roof is steeper than a surface can be.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from ..base.arrays import toml, toml_key
from ..base.errors import OptionError, PcmcError
from ..base.units import Units
from ..certificate.balance import strained_junction
from ..certificate.certificate import Certificate
from ..certificate.proof import Overload
from ..certificate.verdict import Verdict
from ..design import Parameter, Target
from ..plan import Divider, Plan
from ..plan.edges import usual_cable
from ..plan.lines import SNAP, Kind, PlanLine, is_straight
from ..plan.parts import BALANCED
from ..plan.proposal import ABOVE_LEAST, least_tension, plan_area
from ..surface import Plane, Surface
from ..surface.curves import Curve
from ..surface.pieces import to_local, two_digits
from .rises import Rise, net_pressures, outline_heights

BEYOND_FOLD = 1.15  # times the tensions at a fold: a roof well on this side of it
NO_LOADS = ("distance", "tensions")  # a fold on these ways says nothing of the loads
FARTHEST = 20.0  # times the tensions: a fold beyond has another reason, such as an end that slips
TRIANGLES = 5000  # of the meshes that these are tried on, at most about
STRONG = (1.0, 1.6)  # times the largest tension of the patches: such walls rest at their ends, or all along
FLATTER = (0.85, 0.7, 0.5)  # times the heights wanted, or 1 over these times the tensions given
LOWER = (0.7, 0.5, 0.35)  # times the heights of raised lines, at whose ends a sail is steep
SAME = 1e-6  # of the surface's size: heights that differ by less are one

Change = tuple[Plan, Sequence[Rise], list[str]]  # a plan, the heights that it is to have, the lines to type


def chosen_values(plan: Plan | None, drawn: str, surface: Surface, changed: Surface) -> list[str]:
    """The tensions and walls that a project leaves open, a line each for the drawing's and the plan's.

    ``changed`` is its ``surface`` with the tensions that were asked for: walls do not follow them.
    """
    if plan is None:
        return []
    left_open = [divider for divider in plan.dividers if divider.wall == BALANCED]
    pairs = zip(surface.patches, changed.patches, strict=True)
    kept = [a for a, b in pairs if a.tension == b.tension]
    chosen = [a for a in kept if any(_is_wall_of(divider, a.name) for divider in left_open)]
    values = ", ".join(f"{patch.name!r} {patch.tension:g}" for patch in chosen)
    all_kept = len(kept) == len(surface.patches)
    what = "balanced with their neighbours" if all_kept else "that balance the tensions of the file"
    balanced = f"walls {what}: {values} (to choose one, type wall = under its divider)" if chosen else ""
    return [text for text in (drawn, balanced) if text]


def check_apexes(plan: Plan | None, surface: Surface, targets: Sequence[Target], units: Units) -> None:
    """Refuse an apex that is wanted below a part of the patch which is held higher.

    >>> from pcmc import Target
    >>> from pcmc.plan import Hole
    >>> eye = Hole({"circle": {"centre": [4, 4, 2], "radius": 1}}, name="eye")
    >>> plan = Plan([[0, 0], [8, 0], [8, 8], [0, 8]], holes=[eye], tension=5.0, edge_length=1.0)
    >>> check_apexes(plan, plan.surface(), [Target("apex", value=1.5)], Units("m"))
    Traceback (most recent call last):
    pcmc.base.errors.OptionError: hole 'eye' is held at 2 m, so the apex cannot be 1.5 m
    """
    heights, near = surface.plane.height(surface.vertices), SAME * surface.size
    for target in targets:
        highest = target.at_most if target.value is None else target.value
        if target.quantity != "apex" or highest is None:
            continue
        own = surface.roof if target.of is None else np.array([p.name == target.of for p in surface.patches])
        corners = np.unique(surface.faces[own[surface.patch_of_face]])
        top = float(heights[corners[surface.pinned[corners]]].max(initial=-math.inf))
        if top <= highest + near:
            continue
        holes = plan.holes if plan else ()
        rims = ((h.name, h.curve.local(surface.plane).at(h.curve.dense)) for h in holes)
        raised = (name for name, at in rims if at.shape[1] > 2 and abs(float(at[:, 2].max()) - top) <= near)
        holder, unit = next(raised, "a support"), units.behind("length")
        text = f"{holder} is held at {top:.6g}{unit}, so the {target.label} cannot be {highest:.6g}{unit}"
        raise OptionError(text, what="apex", where=target.of, found=highest)


def coarse(plan: Plan, surface: Surface) -> Plan:
    """The plan of a surface with a mesh that is not fine."""
    return replace(plan, edge_length=plan.edge_length * max(1.0, math.sqrt(surface.m / TRIANGLES)))


def loosened(plan: Plan, vary: Sequence[Parameter]) -> Plan | None:
    """The plan with all walls balanced, and the tensions that vary at the mean of the others; or None.

    A wall that was chosen for far tensions holds those that vary near them.
    """
    names = {name for parameter in vary if parameter.kind == "tension" for name in parameter.names}
    others = [area.tension for area in plan.patches if area.name not in names]
    if not others or len(others) == len(plan.patches):
        return None
    mean = float(f"{sum(others) / len(others):.3g}")
    areas = [replace(area, tension=mean) if area.name in names else area for area in plan.patches]
    walls = {divider.name for divider in plan.dividers if divider.wall is not None} - names
    return replace(with_dividers(plan, walls, wall=BALANCED), patches=areas)


def improved(plan: Plan, certificate: Certificate) -> Plan:
    """The plan with the tensions, cables and supports that remove what a certificate complains of."""
    grew = any(isinstance(proof, Overload) for proof in certificate.proofs)
    if grew or certificate.verdict in (Verdict.RAN_AWAY, Verdict.NONE_FOUND):
        plan = _stiffer(plan, certificate)
    # a ring that a cable alone holds is at rest at one radius, and stable at none
    rings = [h for h in plan.holes if h.edge == "cable" and not (h.cable_weight or _supported(plan, h.curve))]
    if rings:
        holes = [replace(h, edge="fixed", cable=None) if h in rings else h for h in plan.holes]
        plan = replace(plan, holes=holes)
    elif plan.cable is not None and plan.cable < (usual := usual_cable(plan)):  # its arcs may not fit
        plan = replace(plan, cable=usual)
    sliding = {divider.name for divider in plan.dividers if divider.bottom == "sliding"}
    plan = with_dividers(plan, sliding, bottom="held")  # only the mesh holds the ends of their junctions
    if certificate.verdict is Verdict.WALL_DOWN:
        balanced = with_dividers(plan, {d.name for d in plan.dividers}, wall=BALANCED)
        plan = balanced if changes(plan, balanced) else with_upright(plan) or plan
    for _ in range(len(plan.dividers) + len(plan.patches)):  # walls at which tensions hardly balance
        strained = strained_junction(plan.surface())
        if strained is None or strained.remedy is None:
            break
        name, tension, _ = strained.remedy
        own = {divider.name for divider in plan.dividers if _is_wall_of(divider, name)}
        areas = [replace(area, tension=tension) if area.name == name else area for area in plan.patches]
        plan = replace(with_dividers(plan, own, wall=BALANCED), patches=areas)
    return plan


def _supported(plan: Plan, curve: Curve) -> bool:
    """Whether a support of the plan is on a curve."""
    line = PlanLine("", Kind.HOLE, curve.local(plan.plane))
    local = [s.local(plan.plane) if isinstance(s, Curve) else np.array([s]) for s in plan.supports]
    places = [s.at(s.dense) if isinstance(s, Curve) else to_local(s, plan.plane) for s in local]
    return any(line.nearest(place[:, :2])[1].min() <= SNAP * plan.edge_length for place in places)


def _stiffer(plan: Plan, certificate: Certificate) -> Plan:
    """All tensions at least at those with which a first roof succeeds, and well beyond a fold."""
    least = ABOVE_LEAST * least_tension(plan_area(plan), max(map(abs, net_pressures(plan).values())))
    folds = [1.0 / a.value for a in certificate.tried if a.folds and a.way not in NO_LOADS and a.value]
    factor = BEYOND_FOLD * max((fold for fold in folds if fold < FARTHEST), default=0.0)

    def higher(tension: float) -> float:
        wanted = max(least, factor * tension)
        return max(tension, two_digits(wanted)) if wanted > tension else tension

    if plan.tension is not None:
        return replace(plan, tension=higher(plan.tension))
    return replace(plan, patches=[replace(area, tension=higher(area.tension)) for area in plan.patches])


def firmer_walls(plan: Plan, surface: Surface, rises: Sequence[Rise]) -> Iterator[Change]:
    """The plan with upright walls, then with strong ones; ``surface`` is its roof, ``rises`` its heights."""
    most = float(surface.tensions[surface.roof].max(initial=0.0))
    walls = {divider.name for divider in plan.dividers if divider.wall is not None}
    strong = [with_dividers(plan, walls, wall=two_digits(times * most)) for times in STRONG if walls]
    for other in filter(None, (with_upright(plan), *strong)):
        with suppress(PcmcError):  # a plan that has no mesh is no advice
            yield other, rises, changes(plan, other)


def flatter(plan: Plan, rises: Sequence[Rise]) -> Iterator[Change]:
    """The plan with lower heights, or with higher tensions where it has no ``rises``; none for a sail."""
    for share in FLATTER if rises or any(net_pressures(plan).values()) else ():
        times = [1.0 / share if rise.kind == "span_ratio" else share for rise in rises]
        lower = [replace(r, value=two_digits(r.value * k)) for r, k in zip(rises, times, strict=True)]
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


def _line(rise: Rise, lower: Rise) -> str:
    place = "[plan]" if rise.patch is None else f"[plan.patches] {toml_key(rise.patch)}:"
    return f"{place} {rise.kind} = {lower.value:g}  (now {rise.value:g})"


def _scaled(plan: Plan, factor: float) -> Plan:
    areas = [replace(area, tension=two_digits(area.tension * factor)) for area in plan.patches]
    return replace(plan, patches=areas, tension=plan.tension and two_digits(plan.tension * factor))


def with_upright(plan: Plan) -> Plan | None:
    """The plan with all walls upright that can be, those under straight lines; None if they are already."""
    near, walls = SNAP * plan.edge_length, [d for d in plan.dividers if d.wall is not None and not d.upright]
    leaning = {d.name for d in walls if is_straight(d.curve.local(plan.plane), near)}
    return with_dividers(plan, leaning, upright=True) if leaning else None


def with_dividers(plan: Plan, names: set[str], **new: Any) -> Plan:
    """The plan with new values of the dividers that have these names."""
    return replace(plan, dividers=[replace(d, **new) if d.name in names else d for d in plan.dividers])


def changes(plan: Plan, other: Plan, instead: Sequence[Rise] = ()) -> list[str]:
    """The lines to type that make the one plan the other; some tensions stand ``instead`` of rises."""
    rows: list[tuple[str, Any, Any, Sequence[str]]] = []
    rows.append(("[plan]", plan, other, ("edge", "cable", "tension", "pressure")))
    for before, after in zip(plan.patches, other.patches, strict=True):
        rows.append((f"[plan.patches] {toml_key(before.name)}:", before, after, ("tension", "pressure")))
    for number, (hole, new) in enumerate(zip(plan.holes, other.holes, strict=False), 1):
        rows.append((f"[[plan.holes]] number {number}:", hole, new, ("edge", "cable")))
    for number, (divider, line) in enumerate(zip(plan.dividers, other.dividers, strict=True), 1):
        place = f"[[plan.dividers]] number {number} ({divider.name!r}):"
        rows.append((place, divider, line, ("wall", "bottom", "upright")))
    alone = [vars(Divider(d.curve, name=f"wall {k}")) for k, d in enumerate(plan.dividers, 1)]
    risen = {"[plan]" if r.patch is None else f"[plan.patches] {toml_key(r.patch)}:": r.kind for r in instead}
    walls, lines = other.surface().patches, []
    for place, before, after, keys in rows:
        for key in keys:
            old, new = getattr(before, key), getattr(after, key)
            kind = risen.get(place) if key == "tension" and new is not None else None
            if key == "pressure" and place == "[plan]" and plan.tension is None:
                continue  # its patches have their own
            if new == old and kind is None:
                continue
            if key == "wall":
                new = next((p.tension for p in walls if _is_wall_of(after, p.name)), None)
                if new == old:  # balanced as it is
                    continue
            why = f"instead of {kind}" if kind else f"now {_shown(old)}"
            if vars(before) in alone:
                why += f"; a curve alone becomes {{curve = ..., {key} = {_shown(new)}}}"
            change = f"remove {key}" if new is None else f"{key} = {_shown(new)}"
            lines.append(f"{place} {change}  ({why})")
    return lines


def _shown(value: Any) -> str:
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else toml(value)


def _is_wall_of(divider: Divider, name: str) -> bool:
    stem, dash, number = name.rpartition("-")
    return name == divider.name or (bool(dash) and stem == divider.name and number.isdigit())
