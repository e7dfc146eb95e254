"""A plan drawn: its lines in the coordinates of Π, cut where they meet, and its plane mesh."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Floats
from ..base.errors import PlanError, SurfaceError
from ..curves.curves import Curve
from ..curves.pieces import point_text, to_local, two_digits
from ..meshing.planar import PlanarMesh, signed_areas, triangulate
from ..surface.topology import components
from .arrangement import Arrangement, arrange, hole_points
from .edges import Boundary, boundary, check_lines
from .lines import SNAP, Kind, Line, LineTree
from .parts import PlanData, check_count

MAX_TRIANGLES = 500_000  # of a plan's mesh, which takes about a minute; finer ones are made by remeshing
MAX_POINTS = 1_000_000  # of all lines, where they are measured
AT_EDGES = 3  # triangles for each edge of a line, about, where these are shorter than the others
SMALLEST = 0.4  # of the edge length squared: a triangle of these edges is larger
MAX_EDGES = 200_000  # along a line
MAX_RISE = 10.0  # of the initial surface, over the size of the plan


@dataclass(frozen=True, eq=False)
class Draft:
    """A plan with its lines and its plane mesh.

    Attributes
    ----------
    lines : the outline, then the holes, the dividers, and the supports that are not on the boundary.
    supports_on_edge : the supports along the outline or a hole.
    drawn : the lines cut where they meet.
    mesh : of the plan, in the coordinates of Π; its first points are those of ``drawn``.
    edges : the boundary, edge by edge.
    """

    plan: PlanData
    lines: Sequence[Line]
    supports_on_edge: Sequence[Curve]
    drawn: Arrangement
    mesh: PlanarMesh
    edges: Boundary


def drafted(plan: PlanData) -> Draft:
    """Draw the lines of a plan and mesh what is between them.

    Raises
    ------
    PlanError
        For lengths that are probably mistakes, and lines that do not fit together.
    """
    lines, on_edge, drawn = _arranged(plan)
    edges = np.concatenate([chain.edges for chain in drawn.chains])
    _check_count(plan, _area(lines[0].xy), len(edges))
    try:
        mesh = triangulate(drawn.points, edges, plan.edge_length, hole_points(drawn, lines))
    except SurfaceError as error:
        problem = f"lines of the plan are too close to each other for edges of length {plan.edge_length:g}"
        raise PlanError(f"{problem}: {error}", what="edge_length", found=plan.edge_length) from None
    _check_parts(plan, mesh)
    return Draft(plan, lines, on_edge, drawn, mesh, boundary(plan, lines, on_edge, drawn))


def part_count(plan: PlanData) -> int:
    """The number of parts into which the lines cut the plan, without its mesh.

    By Euler's formula e - v + c for e chains between v vertices in c connected pieces, less the holes.
    Errors as in ``drafted``.
    """
    *_, drawn = _arranged(plan)
    return _part_count(plan, drawn)


def _part_count(plan: PlanData, drawn: Arrangement) -> int:
    ends = np.array([chain.vertices[[0, -1]] for chain in drawn.chains])
    used, renumbered = np.unique(ends, return_inverse=True)
    pieces = components(renumbered.reshape(-1, 2), len(used))
    return len(ends) - len(used) + 1 + int(pieces.max()) - len(plan.holes)


def _arranged(plan: PlanData) -> tuple[list[Line], list[Curve], Arrangement]:
    """The lines, the supports on the boundary, and the lines cut where they meet."""
    _check_size(plan)
    lines, on_edge = _lines(plan)
    check_lines(plan, lines)
    spots = np.array([to_local(p, plan.plane) for p in plan.supports if not isinstance(p, Curve)])
    cut = [*on_edge, *(c.local(plan.plane) for c in (*(part.curve for part in plan.cables), *plan.mirrors))]
    stops = np.concatenate([np.zeros((0, 2)), *(c.at([0.0, len(c.pieces)])[:, :2] for c in cut)])
    named = np.array([[*point, np.nan] for point in plan.points.values()]).reshape(-1, 3)
    drawn = arrange(lines, plan.edge_length, np.concatenate([spots.reshape(-1, 3), named]), stops)
    # the named points are vertices, but not held
    check_count("patches", _part_count(plan, drawn))
    return lines, on_edge, replace(drawn, spots=drawn.spots[: len(spots)])


def _check_size(plan: PlanData) -> None:
    """Refuse lengths that are probably mistakes, before they fill the memory."""

    def error(key: str, value: float, problem: str) -> PlanError:
        return PlanError(f"{key}={value:g} {problem}", what=key, found=value)

    curves = [plan.outline, *(part.curve for part in (*plan.holes, *plan.dividers, *plan.cables))]
    curves += [support for support in plan.supports if isinstance(support, Curve)]
    points = sum(len(curve.dense) for curve in curves)
    if points > MAX_POINTS:
        problem = f"the lines of the plan have {points} points; at most {MAX_POINTS} are read: draw them with"
        raise PlanError(f"{problem} fewer", what="outline", found=points, expected=MAX_POINTS)
    xy = plan.outline.local(plan.plane).at(plan.outline.dense)[:, :2]
    _check_count(plan, _area(xy), 0)
    size = float(np.linalg.norm(np.ptp(xy, axis=0)))
    if plan.edge_length > size:
        problem = f"is longer than the plan, {size:.4g} from corner to corner; use a smaller one"
        raise error("edge_length", plan.edge_length, problem)
    if plan.rise is not None and plan.rise > MAX_RISE * size:
        problem = f"is more than {MAX_RISE:g} times the plan's size, {size:.4g}; use a smaller one"
        raise error("rise", plan.rise, problem)
    lines = {"the outline": plan.outline} | {hole.name: hole.curve for hole in plan.holes}
    lines |= {f"divider {divider.name!r}": divider.curve for divider in plan.dividers}
    lines |= {f"support {k}": s for k, s in enumerate(plan.supports, 1) if isinstance(s, Curve)}
    for name, curve in lines.items():
        if curve.length > MAX_EDGES * plan.edge_length:
            problem = (
                f"{name} is {curve.length:.3g} long, more than {MAX_EDGES} edges of {plan.edge_length:g}"
            )
            raise PlanError(f"{problem}; draw it as long as the plan", what=name, found=curve.length)
    for hole in plan.holes:
        xy = hole.curve.local(plan.plane).at(hole.curve.dense)[:, :2]
        extent = float(np.ptp(xy, axis=0).max())
        if extent <= SNAP * plan.edge_length:
            problem = f"is only {extent:g} wide, too little for edges of length {plan.edge_length:g}"
            problem += "; leave it out, or use a smaller edge_length"
            raise PlanError(f"{hole.name} {problem}", what=hole.name, found=extent)


def _area(xy: Floats) -> float:
    """The area in an outline (k,2)."""
    x, y = xy.T
    return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))


def _check_count(plan: PlanData, area: float, edges: int) -> None:
    """Refuse a mesh of more triangles than are allowed, before it is made."""
    h, short = plan.edge_length, AT_EDGES * edges
    count = short + area / math.sqrt(0.1875) / h / h  # the square of h may be 0 or infinite
    if count > MAX_TRIANGLES:
        least = math.sqrt(area / math.sqrt(0.1875) / max(MAX_TRIANGLES - short, 1))
        change = f"use {two_digits(least):g} or more, and refine the roof by [[remesh]]"
        if short > MAX_TRIANGLES / 2:
            change = f"draw the lines with fewer points, they have {edges} edges"
        problem = (
            f"edge_length={h:g} would make about {count:.2g} triangles; at most {MAX_TRIANGLES} are allowed"
        )
        raise PlanError(f"{problem}: {change}", what="edge_length", found=h)


def _check_parts(plan: PlanData, mesh: PlanarMesh) -> None:
    """Refuse parts of the plan that are smaller than a triangle: lines that just miss each other."""
    areas = signed_areas(mesh.points, mesh.triangles)
    part = np.bincount(mesh.region, areas)
    least = int(np.argmin(part))
    if part[least] < SMALLEST * plan.edge_length**2:
        own, area = mesh.region == least, part[least]
        middle = mesh.points[mesh.triangles[own]].mean(axis=1).T @ areas[own] / area
        finer = two_digits(math.sqrt(area), math.floor)
        problem = f"the part of the plan around {point_text(middle)} has the area {area:.3g}, less than a"
        problem += (
            f" triangle with edges of {plan.edge_length:g}; if its lines should meet in one point, draw"
        )
        problem += f" them so, otherwise use edge_length = {finer:g} or less"
        raise PlanError(problem, what="edge_length", where=tuple(middle.tolist()), found=float(area))


def _lines(plan: PlanData) -> tuple[list[Line], list[Curve]]:
    """The lines to draw, in the coordinates of Π, and the supports that lie on the boundary."""
    lines = [Line("the outline", Kind.OUTLINE, plan.outline.local(plan.plane))]
    lines += [Line(h.name, Kind.HOLE, h.curve.local(plan.plane)) for h in plan.holes]
    edges = LineTree(lines)
    lines += [Line(f"divider {d.name!r}", Kind.DIVIDER, d.curve.local(plan.plane)) for d in plan.dividers]
    on_edge, snap = [], SNAP * plan.edge_length
    for number, support in enumerate(plan.supports, start=1):
        if isinstance(support, Curve):
            local = support.local(plan.plane)
            if all(edges.at(local.samples(0.5 * plan.edge_length)[:, :2], snap)):
                on_edge.append(local)
            else:
                lines.append(Line(f"support {number}", Kind.SUPPORT, local))
    return lines, on_edge
