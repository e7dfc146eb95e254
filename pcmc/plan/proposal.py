"""Values that a first roof succeeds with, for what a drawing does not say: edge length, tensions, walls."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import compress, filterfalse, product
from typing import Any

import numpy as np

from ..base.errors import OptionError, PlanError, unknown
from ..base.libraries import shapely
from ..base.tolerances import ON
from ..surface.curves import Curve
from ..surface.pieces import two_digits
from ..surface.values import balanced_wall
from .draft import most_in_corners
from .drawing import Drawing
from .edges import cable_for
from .lines import Kind, PlanLine
from .parts import CableLine, Divider, Hole, PatchSpec, check_count, check_keys
from .plan import Chosen, Plan

TRIANGLES = 1500  # of a first roof, about
FINEST = 6000  # triangles at most, where a part is small
ACROSS = 2.5  # edges from the middle of the smallest part to its edge, at least
ABOVE_LEAST = 1.6  # a first tension, over the least at which a roof over the plan exists
SAMPLES = 16  # points of a divider at which its neighbours are looked up
SMALL_HOLE = 0.05  # of the plan's area; smaller holes change its least tension little
MANY, ROUGH = 4000, 1e-5  # curves of more points are simplified, by so much of their length
NEAR = 1e-4  # of the length of all parts' edges: a part this near to a point of a divider is beside it


@dataclass(frozen=True, eq=False)
class Part:
    """A part of the plan: its polygon, the point farthest from its edge, and its distance from there."""

    area: Any
    middle: tuple[float, float]
    radius: float


def parts_of(outline: Curve, holes: Sequence[Curve], dividers: Iterable[Curve], gap: float) -> list[Part]:
    """The parts into which the dividers cut the plan, from left to right; lines nearer than ``gap`` meet."""
    lines = [_line(curve) for curve in (outline, *holes)]
    lines += [_line(curve, 2e-3 * outline.length) for curve in dividers]
    noded = shapely.set_precision(shapely.union_all(lines, grid_size=1e-3 * gap), 0.0)
    roof = _roof_area(outline, holes)
    polygons = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    check_count("patches", len(polygons) - len(holes))
    parts = [Part(p, *largest_circle(p)) for p in polygons]
    inside = [part for part in parts if shapely.contains_xy(roof, *part.middle)]
    return sorted(inside, key=lambda part: (round(part.area.centroid.x, 6), round(part.area.centroid.y, 6)))


def first_edge_length(parts: Sequence[Part], holes: Iterable[Curve]) -> float:
    """The edge length of a first mesh: about 1500 triangles, more where a part or a hole is small."""
    area = sum(part.area.area for part in parts)
    least, most = (math.sqrt(area / (count * math.sqrt(0.1875))) for count in (FINEST, TRIANGLES))
    rims = (curve.length / 12.0 for curve in holes)
    return two_digits(max(min([most, *(part.radius / ACROSS for part in parts), *rims]), least))


def edge_length_for(plan: Plan) -> float:
    """The edge length of a first mesh of a plan; that of the plan if its outline encloses no area.

    >>> from .plan import Plan
    >>> edge_length_for(Plan([[0, 0], [6000, 0], [6000, 4000], [0, 4000]], tension=3000.0))
    190.0
    """
    parts = _parts_of_plan(plan)
    return first_edge_length(parts, [hole.curve for hole in plan.holes]) if parts else plan.edge_length


def _parts_of_plan(plan: Plan) -> list[Part]:
    outline = plan.outline.local(plan.plane)
    holes, dividers = ([p.curve.local(plan.plane) for p in some] for some in (plan.holes, plan.dividers))
    return parts_of(outline, holes, dividers, NEAR * outline.length)


def least_tensions(plan: Plan, whole: float) -> dict[str, float]:
    """The mean of the least tensions per pressure over the ``whole`` plan and over the part of each patch.

    A wall that pulls hard makes a roof of each part; one that hardly pulls leaves one roof over the plan. A
    balanced wall is in between, and so is the mean, √(α_part α_whole).

    >>> from .plan import Plan
    >>> line, patches = [[4, 0], [4, 8]], {"west": {"tension": 1}, "east": {"tension": 1}}
    >>> plan = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], [line], patches=patches)
    >>> {name: round(least, 2) for name, least in least_tensions(plan, 3.0).items()}
    {'west': 2.05, 'east': 2.52}
    """
    parts, mirrors = _parts_of_plan(plan), [mirror.local(plan.plane) for mirror in plan.mirrors]
    means = {}
    for number, patch in enumerate(plan.patches):
        owned = parts[number : number + 1] if patch.at is None else _parts_at(parts, patch.at)
        areas = [_unfolded(part.area, mirrors) for part in owned]
        pieces = [one for area in areas for one in shapely.get_parts(area)]  # an image apart is as large
        means[patch.name] = math.sqrt(whole * max(map(least_tension, pieces), default=whole))
    return means


def plan_area(plan: Plan) -> Any:
    """The whole plan on Π without its holes, as a polygon; small level holes are filled."""
    holes = [hole.curve.local(plan.plane) for hole in plan.holes]
    area = _roof_area(plan.outline.local(plan.plane), holes, SMALL_HOLE)
    return _unfolded(area, [mirror.local(plan.plane) for mirror in plan.mirrors])


def _unfolded(area: Any, mirrors: Sequence[Curve]) -> Any:
    """A polygon and its images behind straight lines, in rounds, as a piece of 60° or 45° has images of
    images; between parallel lines, where they never end, a strip of several."""
    for mirror in (*mirrors, *mirrors) if len(mirrors) > 1 else mirrors:
        a, b = mirror.at([0.0, 1.0])[:, :2]
        along = (b - a) / np.linalg.norm(b - a)
        turn = 2.0 * np.outer(along, along) - np.eye(2)
        image = shapely.transform(area, lambda xy, a=a, turn=turn: a + (xy - a) @ turn)
        area = shapely.union_all([area, image], grid_size=ON * math.sqrt(area.area))
    return area


def _roof_area(outline: Curve, holes: Iterable[Curve], smallest: float = 0.0) -> Any:
    """The plan without its holes, as a polygon; level holes below a share of its area are filled."""
    area = whole = shapely.make_valid(shapely.Polygon(_line(outline).coords))
    for curve in holes:
        hole = shapely.make_valid(shapely.Polygon(_line(curve).coords))
        level = curve.pieces[0].points.shape[1] == 2  # a raised one carries the roof
        if not level or hole.area > smallest * whole.area:
            area = shapely.difference(area, hole)
    return area


def _line(curve: Curve, further: float = 0.0) -> Any:
    """The curve as a polyline; an open one ``further`` at both ends, so that it meets the chords of arcs."""
    xy = curve.at(curve.dense)[:, :2]
    if further and not curve.closed:
        out = [curve.reversed().pieces[-1].direction(1), curve.pieces[-1].direction(1)]
        xy = np.concatenate([[xy[0] + further * out[0][:2]], xy, [xy[-1] + further * out[1][:2]]])
    line = shapely.LineString(xy)
    return shapely.simplify(line, ROUGH * line.length, preserve_topology=False) if len(xy) > MANY else line


def largest_circle(area: Any) -> tuple[tuple[float, float], float]:
    """The centre and radius of the largest circle in a polygon."""
    radius_line = shapely.maximum_inscribed_circle(area, tolerance=0.01 * math.sqrt(area.area))
    x, y = radius_line.coords[0]
    return (x, y), float(radius_line.length)


def least_tension(area: Any, pressure: float = 1.0) -> float:
    """The tension below which no roof over the area is in equilibrium, force/length.

    Over every part D of the plan the pressure p |D| is carried by the tension along its edge, at most
    α |∂D|, so α ≥ p sup |D| / |∂D| = p / h with Cheeger's constant h. In a convex plan 1/h is the r at which
    the plan made narrower by r all around has the area π r² (Kawohl and Lachand-Robert, 2006); in others this
    is an estimate.

    >>> round(least_tension(shapely.Point(0, 0).buffer(4.0, quad_segs=64)), 2)
    2.0
    """
    low, high = 0.0, math.sqrt(area.area / math.pi)
    for _ in range(30):
        r = 0.5 * (low + high)
        low, high = (r, high) if shapely.buffer(area, -r).area > math.pi * r * r else (low, r)
    return pressure * low


def proposed(drawing: Drawing, given: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The keys of a plan for a drawing: those ``given``, and values for all others.

    An entry of ``dividers``, ``holes`` or ``cables`` with the ``name`` of a drawn one and no curve changes
    that one; others are added. PlanError or OptionError for a name that the drawing does not have.
    """
    return proposal(drawing, given)[0]


def proposal(drawing: Drawing, given: Mapping[str, Any] | None = None) -> tuple[dict[str, Any], Chosen]:
    """The same keys, and which of their values were chosen."""
    values, chosen = dict(given or {}), Chosen()
    sail = drawing.loose or bool(drawing.cables) or values.get("edge") in ("free", "cable")
    holes = list(drawing.holes.values())
    try:
        parts = parts_of(drawing.outline, holes, drawing.dividers.values(), drawing.gap)
    except PlanError as error:
        raise error.in_file(drawing.path) from None
    specs = _patches(parts, drawing, values.pop("patches", {}))
    if (tension := values.pop("tension", None)) is None:
        roof = _unfolded(_roof_area(drawing.outline, holes, SMALL_HOLE), drawing.mirrors)
        tension = two_digits(ABOVE_LEAST * least_tension(roof))
        chosen.tensions.update({spec["name"]: tension for spec in specs if spec["tension"] is None})
    common = {"pressure": 0.0} if sail else {}  # an edge that nothing holds closes no space for a pressure
    common |= {key: values.pop(key) for key in ("pressure", "weight") if key in values}
    for spec, (key, value) in product(specs, common.items()):
        spec.setdefault(key, value)
    tensions = [tension if spec["tension"] is None else spec["tension"] for spec in specs]
    if "edge_length" not in values:
        chosen.edge_length = first_edge_length(parts, holes)
    edge_length = values.pop("edge_length", chosen.edge_length)
    outline = PlanLine("the outline", Kind.OUTLINE, drawing.outline)
    tree = shapely.STRtree([part.area for part in parts])
    near = NEAR * sum(part.area.length for part in parts)
    points = [support for support in drawing.supports if not isinstance(support, Curve)]
    cable = cable_for(drawing.outline, max(tensions), points)
    if drawing.loose and values.setdefault("edge", "cable") == "cable" and "cable" not in values:
        values["cable"] = chosen.cables[""] = cable
    cables = _changed(drawing.cables, values.pop("cables", []), "cable", CableLine)
    for entry in cables:
        if isinstance(entry, dict) and entry.get("name") in drawing.cables and "tension" not in entry:
            entry["tension"] = chosen.cables[entry["name"]] = cable
    dividers = _changed(drawing.dividers, values.pop("dividers", []), "divider", Divider)
    for entry in dividers:
        if not isinstance(entry, dict) or entry.get("name") not in drawing.dividers:
            continue
        name, curve = entry["name"], entry["curve"]
        upright = entry.setdefault("upright", True) if name in drawing.upright else False
        if sail or name in drawing.ridges:
            entry.setdefault("wall", False)
        else:
            entry.setdefault("bottom", "held" if drawing.flat else "sloped")
            if "wall" not in entry:
                most = most_in_corners(curve, outline, edge_length)
                wall = _wall_tension(curve, tree, tensions, near, most, upright)
                entry["wall"] = chosen.walls[name] = wall
        if name in drawing.ridges:
            entry.setdefault("cable", cable)
    patches: dict[str, dict[str, Any]] = {}
    for spec, own in zip(specs, tensions, strict=True):
        name, spec["tension"] = spec.pop("name"), own
        same = patches.setdefault(name, spec)
        if same["tension"] != own:
            text = f"{drawing.path}: the parts of {name!r} have the tensions {same['tension']:g} and"
            raise PlanError(f"{text} {own:g}; give it one", what="patch", where=name)
        if same is not spec:  # several parts of one name are one patch
            same["at"] = [*_as_points(same["at"]), *_as_points(spec["at"])]
    plan: dict[str, Any] = {"outline": drawing.outline, "edge_length": edge_length}
    plan["holes"] = _changed(drawing.holes, values.pop("holes", []), "hole", Hole)
    plan |= {"dividers": dividers, "supports": [*drawing.supports, *values.pop("supports", [])]}
    plan |= {"patches": patches} | ({"cables": cables} if cables else {})
    plan |= {"mirrors": [*drawing.mirrors, *values.pop("mirrors", [])]} if drawing.mirrors else {}
    plan |= {"plane": {"point": [0.0, 0.0, drawing.level]}} if drawing.level != 0.0 else {}
    return plan | values, chosen


def _wall_tension(
    curve: Curve, parts: Any, tensions: Sequence[float], near: float, most: float, upright: bool
) -> float:
    """The tension of a wall between the parts near a curve; an upright one needs no difference of theirs."""
    points = shapely.points(curve.at(len(curve.pieces) * (np.arange(SAMPLES) + 0.5) / SAMPLES)[:, :2])
    neighbours: list[list[float]] = [[] for _ in points]
    for point, part in zip(*parts.query(points, predicate="dwithin", distance=near), strict=True):
        neighbours[point].append(tensions[part])
    return balanced_wall([[min(t)] if upright and t else t for t in neighbours], most)


def _patches(parts: Sequence[Part], drawing: Drawing, given: Mapping[str, Any]) -> list[dict[str, Any]]:
    """For each part its patch's name, point and values, given or of the drawing; a tension may be None."""
    if not parts:
        text = f"{drawing.path}: the outline encloses no area in plan; draw it around the roof"
        raise PlanError(text, what="outline")
    (names, drawn), specs = _labels(parts, drawing), []
    for k, part in enumerate(parts):
        point = [_rounded(value, part.radius) for value in part.middle]
        point = point if shapely.contains_xy(part.area, *point) else list(part.middle)
        name = names.get(k, "roof" if len(parts) == 1 else f"patch {k + 1}")
        specs.append({"name": name, "tension": drawn.get(name), "at": point})
    for name, attributes in given.items():
        check_keys(attributes, PatchSpec, f"patch {name!r}")
        at = attributes.get("at")
        owned = parts if at is None else _parts_at(parts, at)
        pairs = [(part, spec) for part, spec in zip(parts, specs, strict=True) if part in owned]
        chosen = [spec for _, spec in pairs if at is not None or spec["name"] == name]
        if not chosen:
            known = dict.fromkeys(str(spec["name"]) for spec in specs)
            problem = unknown("patch of the drawing", name, known)
            raise OptionError(f"{drawing.path}: {problem}", what="patches", where=name)
        for spec in chosen:
            spec |= {"name": name} | {key: value for key, value in attributes.items() if key != "at"}
    return specs


def _rounded(value: float, radius: float) -> float:
    """A coordinate with as many digits as tell a point in a circle, and no zero with a sign or an exponent.

    >>> _rounded(8.9e-16, 2.0), _rounded(18.04321, 2.0), _rounded(12345.678, 250.0)
    (0.0, 18.04, 12346.0)
    """
    return round(value, 2 - math.floor(math.log10(radius))) + 0.0


def _as_points(at: Any) -> list[Any]:
    return list(at) if isinstance(at[0], list | tuple) else [at]


def _parts_at(parts: Sequence[Part], at: Any) -> list[Part]:
    inside = [shapely.contains_xy(part.area, *np.transpose(_as_points(at))).any() for part in parts]
    return list(compress(parts, inside))


def _labels(parts: Sequence[Part], drawing: Drawing) -> tuple[dict[int, str], dict[str, float]]:
    """The names that the drawing gives to parts, by the number of the part, and tensions by name."""
    owner, tensions = dict[int, str](), dict[str, float]()
    for label in drawing.labels:
        inside = [k for k, part in enumerate(parts) if shapely.contains_xy(part.area, *label.point)]
        if not inside:
            x, y = label.point
            problem = f"{drawing.path}: the name {label.name!r} at ({x:.6g}, {y:.6g}) is outside the plan"
            raise PlanError(f"{problem}; move it into the part that it names", what="patch", where=label.name)
        other = owner.setdefault(inside[0], label.name)
        if other != label.name:
            problem = f"{drawing.path}: {other!r} and {label.name!r} name one part of the plan; draw a"
            raise PlanError(f"{problem} divider between them, or delete one", what="patch", where=label.name)
        if label.tension is not None and tensions.setdefault(other, label.tension) != label.tension:
            problem = f"{drawing.path}: texts give {other!r} the tensions {tensions[other]:g} and"
            raise PlanError(f"{problem} {label.tension:g}; delete one", what="patch", where=other)
    return owner, tensions


def _changed(drawn: Mapping[str, Curve], given: Sequence[Any], what: str, kind: Any) -> list[Any]:
    """The drawn curves by name with the values given for them, and further entries."""
    entries: dict[str, Any] = {name: {"curve": curve, "name": name} for name, curve in drawn.items()}

    def changes_drawn(entry: Any) -> bool:
        return isinstance(entry, Mapping) and "name" in entry and "curve" not in entry

    for entry in filter(changes_drawn, given):
        if (name := entry["name"]) not in entries:
            problem = f"{unknown(f'{what} of the drawing', name, entries)}; add one with curve = ..."
            raise OptionError(problem, what=f"{what}s", found=name, expected=tuple(entries))
        check_keys(entry, kind, f"{what} {name!r}")
        entries[name] |= entry
    return [*entries.values(), *filterfalse(changes_drawn, given)]
