"""A plan in a few lines of text."""

from __future__ import annotations

import numpy as np

from ..curves.curves import Curve
from ..surface.summary import listed
from .parts import Area, Divider, PlanData


def summary(plan: PlanData) -> str:
    """Of a Plan: its size in plan, outline, patches, dividers, holes and supports, a line each."""
    width, depth = np.ptp(plan.outline.at(plan.outline.dense), axis=0)[:2].tolist()
    curves = sum(isinstance(support, Curve) for support in plan.supports)
    parts = {
        "patches": [_patch(area) for area in plan.patches] or [f"all (tension {plan.tension:g})"],
        "dividers": [_divider(divider) for divider in plan.dividers],
        "holes": [f"{hole.name.removeprefix('hole ')} ({hole.edge})" for hole in plan.holes],
        "cables": [f"{line.name or 'cable'} (tension {line.tension:g})" for line in plan.cables],
        "rooms": [f"{name} (volume {room.volume:g})" for name, room in plan.rooms.items()],
        "points": list(plan.points),
    }
    cable = "" if plan.cable is None else f" of tension {plan.cable:g}"
    supports = f"; {len(plan.supports) - curves} points and {curves} curves are held" if plan.supports else ""
    mirrors = f"; mirror images beyond {len(plan.mirrors)} edges" if plan.mirrors else ""
    return "\n".join(
        [
            f"Plan of {width:.4g} × {depth:.4g}, edge length {plan.edge_length:g}",
            f"  outline: {plan.edge}{cable}{supports}{mirrors}",
            *(f"  {name}: {listed(texts)}" for name, texts in parts.items() if texts),
        ]
    )


def _patch(area: Area) -> str:
    load = f"pressure {area.pressure:g}" if area.volume is None else f"volume {area.volume:g}"
    snow = f", snow {area.snow:g}" if area.snow else ""
    return f"{area.name} (tension {area.tension:g}, {load}{snow})"


def _divider(divider: Divider) -> str:
    """A divider with the tension of its wall or cable."""
    wall = f"{divider.wall:g}" if isinstance(divider.wall, int | float) else divider.wall
    loads = {"wall": wall, "cable": None if divider.cable is None else f"{divider.cable:g}"}
    texts = [f"{name} {value}" for name, value in loads.items() if value is not None]
    return f"{divider.name} ({', '.join(texts) or 'no wall'})"
