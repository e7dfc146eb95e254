"""Targets that what is drawn rules out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..base.units import Units
from ..plan import Plan
from ..surface import Surface

if TYPE_CHECKING:
    from ..design import Target

SAME = 1e-6  # of the surface's size: heights that differ by less are one


def aims_below_supports(
    plan: Plan | None, surface: Surface, targets: Sequence[Target], units: Units
) -> list[str]:
    """A line for each apex that is wanted below a part of the patch which is held higher.

    >>> from pcmc import Target
    >>> from pcmc.plan import Hole
    >>> eye = Hole({"circle": {"centre": [4, 4, 2], "radius": 1}}, name="eye")
    >>> plan = Plan([[0, 0], [8, 0], [8, 8], [0, 8]], holes=[eye], tension=5.0, edge_length=1.0)
    >>> aims_below_supports(plan, plan.surface(), [Target("apex", value=1.5)], Units("m"))
    ["hole 'eye' is held at 2 m, so the apex cannot be 1.5 m"]
    """
    heights = surface.plane.height(surface.vertices)
    lines = []
    for target in targets:
        highest = target.at_most if target.value is None else target.value
        if target.quantity != "apex" or highest is None:
            continue
        own = surface.roof if target.of is None else np.array([p.name == target.of for p in surface.patches])
        corners = np.unique(surface.faces[own[surface.patch_of_face]])
        held = corners[surface.pinned[corners]]
        if not len(held) or heights[held].max() <= highest + SAME * surface.size:
            continue
        top = float(heights[held].max())
        unit = units.behind("length")
        held_at = f"{_held_at(plan, top, SAME * surface.size)} is held at {top:.6g}{unit}"
        lines.append(f"{held_at}, so the {target.label} cannot be {highest:.6g}{unit}")
    return lines


def _held_at(plan: Plan | None, height: float, near: float) -> str:
    """The hole of a plan whose edge reaches a height, or "a support"."""
    if plan is None:
        return "a support"
    for hole in plan.holes:
        local = hole.curve.local(plan.plane).at(hole.curve.dense)
        if local.shape[1] > 2 and abs(float(local[:, 2].max()) - height) <= near:
            return hole.name
    return "a support"
