"""What holds a roof badly, and what does instead: rings for single points, cables for free edges.

A membrane held at one point has a peak there that is as thin as its triangles: how high the forces are
depends on the mesh, and on some meshes it comes to rest, on others not. A ring carries it on any mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats
from ..plan import Divider, Hole, Plan
from ..plan.edges import usual_cable
from ..plan.lines import SNAP, Kind, PlanLine
from ..surface.curves import Curve
from ..surface.pieces import two_digits
from .rises import Rise

SHARES = (0.06, 0.12, 0.25)  # of the way from a point to the nearest line: the radii of rings that are tried
LEAST = 0.25  # smallest radius of a ring over the length of edges


@dataclass(frozen=True, eq=False)
class Mast:
    """A point inside the plan that holds the roof."""

    number: int  # its place among the plan's supports
    point: Floats  # (3,) in the coordinates of Π
    clearance: float  # distance in plan to the nearest line or other point that is held
    least: float  # the smallest radius of a ring that the triangles beside it can follow

    @property
    def text(self) -> str:
        """The point as it is typed: [x, y, z]."""
        return f"[{', '.join(f'{value:.6g}' for value in self.point)}]"

    @property
    def has_room(self) -> bool:
        """Whether a ring fits between it and what is next to it."""
        return self.clearance > 2.0 * self.least

    def radius(self, share: float) -> float:
        """The radius of a ring around it."""
        return two_digits(max(share * self.clearance, self.least))


def point_masts(plan: Plan) -> list[Mast]:
    """The supports of a plan that are points inside it and on no line.

    >>> square = [[0, 0], [8, 0], [8, 8], [0, 8]]
    >>> tent = Plan(square, edge_length=1, tension=1.0, pressure=0.0, supports=[[0, 0], [4, 3, 2]])
    >>> [(mast.text, mast.clearance) for mast in point_masts(tent)]
    [('[4, 3, 2]', 3.0)]
    """
    given = {k: np.asarray(s, dtype=float) for k, s in enumerate(plan.supports) if not isinstance(s, Curve)}
    if not given:
        return []
    parts: Sequence[Hole | Divider] = (*plan.holes, *plan.dividers)
    curves = [s for s in plan.supports if isinstance(s, Curve)]
    curves += [plan.outline, *(part.curve for part in parts)]
    lines = [PlanLine("line", Kind.SUPPORT, curve.local(plan.plane)) for curve in curves]
    points = np.array([plan.plane.to_local(p) if len(p) == 3 else np.append(p, 0.0) for p in given.values()])
    away = np.min([line.nearest(points[:, :2])[1] for line in lines], axis=0)
    inside = away > SNAP * plan.edge_length
    if len(points) > 1:
        near, _ = cKDTree(points[:, :2]).query(points[:, :2], k=[2])
        away = np.minimum(away, np.ravel(near))
    found = zip(given, points, away.tolist(), inside, strict=True)
    least = LEAST * plan.edge_length
    return [Mast(number, point, clearance, least) for number, point, clearance, free in found if free]


def with_rings(plan: Plan, masts: Sequence[Mast], share: float) -> Plan:
    """The plan with a held ring around each point instead of the point."""
    left_out = {mast.number for mast in masts}
    supports = [s for k, s in enumerate(plan.supports) if k not in left_out]
    circles = [{"circle": {"centre": mast.point.tolist(), "radius": mast.radius(share)}} for mast in masts]
    rings = [Hole(circle, name=f"mast {number}") for number, circle in enumerate(circles, 1)]
    return replace(plan, supports=supports, holes=[*plan.holes, *rings])


def ring_lines(masts: Sequence[Mast], share: float, *, drawn: bool) -> list[str]:
    """What to type, or to draw, for these rings."""
    lines = []
    for number, mast in enumerate(masts, 1):
        radius = f"{mast.radius(share):g}"
        x, y, z = (f"{value:.6g}" for value in mast.point)
        if drawn:
            lines.append(f"draw a circle of radius {radius} around ({x}, {y}) at height {z} on layer 'mast'")
            lines.append(f"delete the point or line at ({x}, {y}) there")
            continue
        curve = f"{{circle = {{centre = [{x}, {y}, {z}], radius = {radius}}}}}"
        lines += ["[[plan.holes]]", f'name = "mast {number}"', f"curve = {curve}"]
        lines.append(f"[plan] supports: remove {mast.text}")
    return lines


def mast_note(plan: Plan) -> str:
    """Warn about a roof held at single points, with the change to make; empty if it is not."""
    masts = point_masts(plan)
    if not masts:
        return ""
    points = ", ".join(mast.text for mast in masts[:4])
    change = (
        f"hold it on a ring, in [[plan.holes]], instead: {ring_lines(masts[:1], SHARES[1], drawn=False)[2]}"
    )
    if tight := [mast for mast in masts if not mast.has_room]:
        change = f"{tight[0].text} is too near to what is held beside it for a ring: move it there, or away"
    return (
        f"the roof is held at {'a single point' if len(masts) == 1 else 'single points'} inside, {points}:"
        f" there it has a peak as thin as the triangles, which comes to rest on some meshes and not on"
        f" others; {change}"
    )


def as_sail(plan: Plan, rises: Sequence[Rise] = ()) -> Plan | None:
    """The plan with a cable along each free edge and without pressure; None if no edge is free.

    A tension that stands for a rise becomes 1: a sail has the height of its supports.

    >>> square = [[0, 0], [8, 0], [8, 8], [0, 8]]
    >>> tent = Plan(square, edge_length=1, tension=2.0, edge="free", supports=[[0, 0, 1], [8, 8]])
    >>> sail = as_sail(tent)
    >>> sail.edge, sail.cable, sail.pressure
    ('cable', 24.0, 0.0)
    """
    if all(part.edge != "free" for part in (plan, *plan.holes)):
        return None
    if rises and plan.tension is not None:
        plan = replace(plan, tension=1.0)
    risen = {rise.patch for rise in rises}
    patches = [replace(a, pressure=0.0, tension=1.0 if a.name in risen else a.tension) for a in plan.patches]
    cabled: dict[str, Any] = {"edge": "cable", "cable": usual_cable(plan)}
    holes = [replace(hole, **cabled) if hole.edge == "free" else hole for hole in plan.holes]
    edge = cabled if plan.edge == "free" else {}
    return replace(plan, pressure=0.0, patches=patches, holes=holes, **edge)
