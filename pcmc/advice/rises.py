"""First tensions for rises, and what holds a roof badly: rings for single points, cables for free edges.

A membrane held at one point has a peak there that is as thin as its triangles: how high the forces are
depends on the mesh, and on some meshes it comes to rest, on others not. A ring that is large enough for its
height carries it on any mesh.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import OptionError
from ..base.libraries import shapely
from ..base.tolerances import ON
from ..design import Parameter, Target
from ..plan import Hole, Plan, patch_names
from ..plan.draft import part_count
from ..plan.edges import usual_cable
from ..plan.lines import SNAP, Kind, PlanLine
from ..plan.parts import BALANCED
from ..plan.proposal import largest_circle, least_tension, least_tensions, plan_area
from ..surface import checks
from ..surface.curves import Curve
from ..surface.pieces import two_digits

RISES = ("rise", "apex")  # of a patch
WHOLE = (*RISES, "span_ratio")  # of all patches together
LEAST = 1.15  # times the tension below which no roof over the plan is in equilibrium: the first one at least


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
    elif misplaced := [key for key in WHOLE if key in plan]:
        text = f"plan.{misplaced[0]} is for a plan without tensions; remove it, or the tensions"
        raise OptionError(text, what=f"plan.{misplaced[0]}")
    return {**data, "plan": plan | ({"patches": patches} if patches else {})}, rises


def taken(
    values: dict[str, Any], kinds: Sequence[str], patch: str | None, *, keep: bool = False
) -> list[Rise]:
    """The rise in a table, which is taken out; the tension 1 stands for it, unless ``keep``."""
    given = [kind for kind in (*kinds, "tension") if kind in values]
    if not given or given == ["tension"]:
        return []
    if len(given) > 1:
        where = "the plan" if patch is None else f"patch {patch!r}"
        text = f"{where} has {' and '.join(given)}; give one of them, the others follow"
        raise OptionError(text, what=given[0], where=patch)
    if not keep:
        values["tension"] = 1.0
    return [Rise(patch, given[0], values.pop(given[0]))]


def with_rises(plan: Plan, rises: Sequence[Rise]) -> tuple[Plan, list[Target], list[Parameter]]:
    """The plan with a first tension for each rise, the targets, and the tensions that are to be found."""
    if not rises:
        return plan, [], []
    part_count(plan)  # refuses lines that do not fit together, which have no area
    area = plan_area(plan)
    least, span = least_tension(area), 2.0 * largest_circle(area)[1]
    leasts = least_tensions(plan, least)
    heights = outline_heights(plan)
    level, lowest, loads = float(heights.mean()), float(heights.min()), net_pressures(plan)
    targets, vary = [], []
    for rise in rises:
        if rise.kind != "apex" and np.ptp(heights) > ON * plan.outline.length:
            text = f"{rise.kind}: the outline is not level, so a rise over it is not defined; give apex"
            text += " instead, the greatest height over the plane"
            raise OptionError(text, what=rise.kind, where=rise.patch)
        over = rise.value if rise.kind != "span_ratio" else span / rise.value
        height = rise.value if rise.kind == "apex" else level + over
        if height - lowest <= ON * plan.outline.length:
            of = f" of {rise.patch!r}" if rise.patch else ""
            text = f"{rise.kind}{of} is {height:g} over the plane, and the outline is at {lowest:g} and more"
            raise OptionError(f"{text}; give a greater one", what=rise.kind, where=rise.patch, found=height)
        names: str | list[str] = rise.patch or [n for n in patch_names(plan) if loads.get(n, loads.get(""))]
        if not names or max(loads.values()) < 0.0:
            text = f"{rise.kind} is for a roof that a pressure lifts, and none is left here; give"
            text += f" pressure = ..., or tension = ... instead of {rise.kind}"
            raise OptionError(text, what=rise.kind)
        plan = _retensioned(plan, rise.patch, leasts.get(rise.patch or "", least), height - lowest)
        vary.append(Parameter(names))
        targets.append(Target("apex", rise.patch, height))
    if any(divider.wall != BALANCED for divider in plan.dividers):  # any wall balances equal tensions
        risen = {rise.patch for rise in rises}
        most = max((area.tension for area in plan.patches if area.name in risen), default=0.0)
        areas = [replace(area, tension=most) if area.name in risen else area for area in plan.patches]
        plan = replace(plan, patches=areas)
    return plan, targets, vary


def outline_heights(plan: Plan) -> Floats:
    """(k,) heights over Π of points of the outline."""
    outline = plan.outline.local(plan.plane).at(plan.outline.dense)
    return outline[:, 2] if outline.shape[1] > 2 else np.zeros(len(outline))


def net_pressures(plan: Plan) -> dict[str, float]:
    """p - s of each of the patches that a plan has, by name; without any, of the whole, under ""."""
    own = {a.name: a.pressure - (plan.snow if a.snow is None else a.snow) for a in plan.patches}
    return own or {"": plan.pressure - plan.snow}


def _retensioned(plan: Plan, patch: str | None, least: float, rise: float) -> Plan:
    if plan.tension is not None:
        return replace(plan, tension=first_tension(least, net_pressures(plan)[""], rise))
    first = {name: first_tension(least, pressure, rise) for name, pressure in net_pressures(plan).items()}
    tension = max(first.values()) if patch is None else first[patch]
    patches = [replace(a, tension=tension) if patch in (None, a.name) else a for a in plan.patches]
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


SHARES = (0.12, 0.25, 0.4, 0.55)  # radii of rings, of the way from a point to the nearest line
LEAST_RING = 0.25  # smallest radius of a ring over the length of edges


class Mast(NamedTuple):
    """A point inside the plan that holds the roof."""

    number: int  # its place among the plan's supports
    point: Floats  # (3,) in the coordinates of Π
    clearance: float  # distance in plan to the nearest line or other point that is held
    height: float  # over the roof without it, about; below 0 under it
    least: float  # the smallest radius of a ring that the triangles beside it can follow
    in_mirror: bool  # whether it is inside of the whole roof alone

    @property
    def text(self) -> str:
        """The point as it is typed: [x, y, z]."""
        return f"[{', '.join(f'{value:.6g}' for value in self.point)}]"

    @property
    def has_room(self) -> bool:
        """Whether a ring fits between it and what is next to it."""
        return self.clearance > 2.0 * self.least

    @property
    def share(self) -> float:
        """The smallest share s of the clearance R at which a ring can be so high over a round plan of it.

        Between rings of radii s R and R at the height h a catenoid that is steep at the inner one ends:
        h = s R arcosh(1 / s).
        """
        steep = abs(self.height) / self.clearance
        return next((share for share in SHARES if share * math.acosh(1.0 / share) >= steep), SHARES[-1])

    @property
    def top(self) -> Floats:
        """(3,) the centre of a ring around it: the point, or nearer to the roof if no ring can be so high."""
        most = SHARES[-1] * math.acosh(1.0 / SHARES[-1]) * self.clearance
        over = self.height - float(np.clip(self.height, -most, most))
        x, y, z = self.point.tolist()
        digits = 1 - math.floor(math.log10(most))  # two of the height over the roof, wherever that is
        return np.array([x, y, round(z - over, digits) if over else z])

    def radius(self, share: float) -> float:
        return two_digits(max(share * self.clearance, self.least))


def point_masts(plan: Plan) -> list[Mast]:
    """The supports of a plan that are points inside it, or inside the whole of it, and on no line.

    >>> square = [[0, 0], [8, 0], [8, 8], [0, 8]]
    >>> tent = Plan(square, edge_length=1, tension=1.0, pressure=0.0, supports=[[0, 0], [4, 3, 2]])
    >>> [(mast.text, mast.clearance) for mast in point_masts(tent)]
    [('[4, 3, 2]', 3.0)]
    """
    given = {k: np.asarray(s, dtype=float) for k, s in enumerate(plan.supports) if not isinstance(s, Curve)}
    if not given:
        return []
    curves = [s for s in plan.supports if isinstance(s, Curve)]
    curves += [part.curve for parts in (plan.holes, plan.dividers) for part in parts]
    every = [PlanLine("line", Kind.SUPPORT, curve.local(plan.plane)) for curve in (*curves, *plan.mirrors)]
    lines, mirrors = every[: len(curves)], every[len(curves) :]
    points = np.array([plan.plane.to_local(p) if len(p) == 3 else np.append(p, 0.0) for p in given.values()])
    snap, places = SNAP * plan.edge_length, shapely.points(points[:, :2])
    rim = PlanLine("outline", Kind.OUTLINE, plan.outline.local(plan.plane)).shape
    within = shapely.intersects(shapely.Polygon(rim).buffer(snap), places)
    in_mirror = np.zeros(len(points), dtype=bool)
    for mirror in mirrors:  # there the roof goes on
        rim = rim.difference(mirror.shape.buffer(snap))
        in_mirror |= mirror.nearest(points[:, :2])[1] <= snap
    others = [line.nearest(points[:, :2])[1] for line in lines]
    away = np.min([shapely.distance(rim, places), *others], axis=0)
    inside = within & (away > 2.0 * snap)  # the end of a mirror is one snap from the rest of the rim
    if len(points) > 1:
        near, _ = cKDTree(points[:, :2]).query(points[:, :2], k=[2])
        away = np.minimum(away, np.ravel(near))
    least, heights = LEAST_RING * plan.edge_length, points[:, 2] - outline_heights(plan).mean() - _dome(plan)
    found = zip(given, points, away.tolist(), heights.tolist(), in_mirror.tolist(), inside, strict=True)
    return [Mast(k, point, far, high, least, cut) for k, point, far, high, cut, free in found if free]


def _dome(plan: Plan) -> float:
    """The height to which pressure lifts the middle of a plan, about: of the flattest cap over its circle."""
    loads, tensions = net_pressures(plan).values(), [area.tension for area in plan.patches]
    if min(loads) <= 0.0:
        return 0.0
    rim = 2.0 * least_tension(plan_area(plan))
    tensions = tensions or [plan.tension or 1.0]
    radius = max(rim, *(2.0 * alpha / p for alpha, p in zip(tensions, loads, strict=True)))
    return radius - math.sqrt(radius**2 - rim**2)


def with_rings(plan: Plan, masts: Sequence[Mast], share: float) -> Plan:
    """The plan with a held ring around each point instead of the point."""
    left_out = {mast.number for mast in masts}
    supports = [s for k, s in enumerate(plan.supports) if k not in left_out]
    circles = [{"circle": {"centre": mast.top.tolist(), "radius": mast.radius(share)}} for mast in masts]
    rings = [Hole(circle, name=f"mast {number}") for number, circle in enumerate(circles, 1)]
    patches = [replace(area, at=_beside(area.at, masts, share)) for area in plan.patches]
    return replace(plan, supports=supports, holes=[*plan.holes, *rings], patches=patches)


def _beside(at: Any, masts: Sequence[Mast], share: float) -> Any:
    """The points that name a patch; those inside a ring are moved out of it."""
    if at is None:
        return None
    points = np.array(at, dtype=float).reshape(-1, 2)
    for centre, radius in [(mast.point[:2], mast.radius(share)) for mast in masts]:
        away = points - centre
        angle = np.arctan2(away[:, 1], away[:, 0])[:, None]
        out = centre + 1.2 * radius * np.hstack([np.cos(angle), np.sin(angle)])
        points = np.where(np.linalg.norm(away, axis=1)[:, None] < 1.1 * radius, out, points)
    return points.round(6).tolist() if np.any(points != np.reshape(at, (-1, 2))) else at


def ring_lines(masts: Sequence[Mast], share: float, *, drawn: bool) -> list[str]:
    """What to type, or to draw, for these rings."""
    lines = []
    for number, mast in enumerate(masts, 1):
        radius = f"{mast.radius(share):g}"
        x, y, z = (f"{value:.10g}" for value in mast.top)
        if drawn:
            lines.append(f"draw a circle of radius {radius} around ({x}, {y}) at height {z} on layer 'mast'")
            lines.append(f"delete the point or line at ({x}, {y}) there")
        else:
            curve = f"{{circle = {{centre = [{x}, {y}, {z}], radius = {radius}}}}}"
            lines += ["[[plan.holes]]", f'name = "mast {number}"', f"curve = {curve}"]
            lines.append(f"[plan] supports: remove {mast.text}")
    return lines


def mast_note(plan: Plan, *, drawn: bool = False) -> str:
    """Warn about a roof held at single points, with the change to type, or to draw; empty if it is not."""
    masts = point_masts(plan)
    if not masts:
        return ""
    points = ", ".join(mast.text for mast in masts[:4])
    ring = ring_lines(masts[:1], max(mast.share for mast in masts), drawn=drawn)
    where, line = ("", ring[0]) if drawn else (", in [[plan.holes]],", ring[2])
    change = f"hold it on a ring{where} instead: {line}"
    if (high := masts[0]).top[2] != high.point[2]:
        change += "; no ring can be as high as the point"
    if cut := [mast for mast in masts if mast.in_mirror]:  # the outline is to leave out its half
        radius = f"of radius {cut[0].radius(cut[0].share):g} around {cut[0].text}"
        change = f"hold it on a ring instead: lead the outline around it on an arc {radius},"
        change += " from mirror to mirror, and give that arc, with its height, as a support"
    if tight := [mast for mast in masts if not mast.has_room]:
        change = f"{tight[0].text} is too near to what is held beside it for a ring: move it there, or away"
    return (
        f"the roof is held at {'a single point' if len(masts) == 1 else 'single points'} inside, {points}:"
        " there it has a peak as thin as the triangles, which comes to rest on some meshes and not on"
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
