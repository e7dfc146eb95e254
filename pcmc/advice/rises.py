"""Rises instead of tensions: a first tension for each, and the target that finds the right one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base import validate
from ..base.errors import MissingExtra, OptionError
from ..plan import Plan, patch_names
from ..surface import checks

if TYPE_CHECKING:
    from ..design import Parameter, Target

RISES = ("rise", "apex")  # of a patch
WHOLE = (*RISES, "span_ratio")  # of all patches together
LEAST = 1.15  # times the tension below which no roof over the plan is in equilibrium: the first one at least
LEVEL = 1e-9  # of the outline's length: heights that differ by less are one


@dataclass(frozen=True)
class Rise:
    """A height that a patch, or all patches together, are to have.

    Attributes
    ----------
    patch : its name; None for all together, which get one tension.
    kind : "rise", height of the highest point over a level outline; "apex", over Π; "span_ratio", the span
        of the plan, which is the diameter of the largest circle in it, over its rise.
    value : > 0.
    """

    patch: str | None
    kind: str
    value: float

    def __post_init__(self) -> None:
        validate.number(self.kind, self.value, above=0.0, most=checks.LARGEST)


def take_rises(data: Mapping[str, Any]) -> tuple[dict[str, Any], list[Rise]]:
    """The data of a project without the rises that stand for tensions, and these.

    >>> take_rises({"plan": {"outline": [], "rise": 2.0}})[1]
    [Rise(patch=None, kind='rise', value=2.0)]
    """
    plan = dict(data["plan"])
    patches = {name: dict(values) for name, values in plan.get("patches", {}).items()}
    rises = [rise for name, values in patches.items() for rise in taken(values, RISES, name)]
    if not patches and "tension" not in plan:
        rises = taken(plan, WHOLE, None)
    elif misplaced := [key for key in WHOLE[1:] if key in plan]:
        text = f"plan.{misplaced[0]} is for a plan without tensions; remove it, or the tensions"
        raise OptionError(text, what=f"plan.{misplaced[0]}")
    return {**data, "plan": plan | ({"patches": patches} if patches else {})}, rises


def taken(
    values: dict[str, Any], kinds: Sequence[str], patch: str | None, *, keep: bool = False
) -> list[Rise]:
    """The rise in a table, which is taken out; the tension 1 stands for it, unless ``keep``."""
    given = [kind for kind in kinds if kind in values]
    if not given:
        return []
    if len(given) > 1 or "tension" in values:
        where = "the plan" if patch is None else f"patch {patch!r}"
        both = " and a ".join([*given, *(["tension"] if "tension" in values else [])])
        text = f"{where} has a {both}; give one of them, the others follow"
        raise OptionError(text, what=given[0], where=patch)
    if not keep:
        values["tension"] = 1.0
    return [Rise(patch, given[0], values.pop(given[0]))]


def with_rises(plan: Plan, rises: Sequence[Rise]) -> tuple[Plan, list[Target], list[Parameter]]:
    """The plan with a first tension for each rise, the targets, and the tensions that are to be found."""
    from ..design import Parameter, Target

    if not rises:
        return plan, [], []
    try:
        from ..plan.proposal import largest_circle, least_tension, plan_area
    except ModuleNotFoundError:
        raise MissingExtra("shapely", "plan") from None
    area = plan_area(plan)
    least, span = least_tension(area), 2.0 * largest_circle(area)[1]
    outline = plan.outline.local(plan.plane).at(plan.outline.dense)
    heights = outline[:, 2] if outline.shape[1] > 2 else np.zeros(len(outline))
    level, loads = float(heights.mean()), net_pressures(plan)
    targets, vary = [], []
    for rise in rises:
        if rise.kind != "apex" and np.ptp(heights) > LEVEL * plan.outline.length:
            text = (
                f"{rise.kind}: the outline is not level, so a rise over it is not defined; give apex instead"
            )
            raise OptionError(f"{text}, the greatest height over the plane", what=rise.kind, where=rise.patch)
        over = rise.value if rise.kind != "span_ratio" else span / rise.value
        height = rise.value if rise.kind == "apex" else level + over
        names: str | list[str] = rise.patch or [
            name for name in patch_names(plan) if loads.get(name, plan.pressure - plan.snow)
        ]
        if not names:
            text = f"{rise.kind} is for a roof that a pressure lifts, and none is left here; give"
            raise OptionError(
                f"{text} pressure = ..., or tension = ... instead of {rise.kind}", what=rise.kind
            )
        plan = _retensioned(plan, rise.patch, least, height - level)
        vary.append(Parameter(names))
        targets.append(Target("apex", rise.patch, height))
    return plan, targets, vary


def net_pressures(plan: Plan) -> dict[str, float]:
    """p - s of each of the patches that a plan has, by name."""
    return {a.name: a.pressure - (plan.snow if a.snow is None else a.snow) for a in plan.patches}


def _retensioned(plan: Plan, patch: str | None, least: float, rise: float) -> Plan:
    """The plan with the first tension for a rise, of a patch or of all."""
    if plan.tension is not None:
        return replace(plan, tension=first_tension(least, plan.pressure - plan.snow, rise))
    first = {name: first_tension(least, pressure, rise) for name, pressure in net_pressures(plan).items()}
    if patch is None:
        first = dict.fromkeys(first, max(first.values()))
    patches = [replace(a, tension=first[a.name]) if patch in (None, a.name) else a for a in plan.patches]
    return replace(plan, patches=patches)


def first_tension(least: float, pressure: float, rise: float) -> float:
    """The tension of a cap with this rise over a round plan of a least tension per pressure, to 3 digits.

    α = p (R² + h²) / (4 h), R twice the least tension over p.

    >>> first_tension(1.0, 1.0, 2.0)
    1.15
    """
    radius, strength = 2.0 * least, abs(pressure or 1.0)
    cap = strength * (radius**2 + rise**2) / (4.0 * rise)
    return float(f"{max(cap, LEAST * least * strength):.3g}")
