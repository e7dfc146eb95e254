"""A plan drawn: its lines in the coordinates of Π, cut where they meet, and its plane mesh."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..base.arrays import Floats
from ..base.errors import PlanError, SurfaceError
from ..meshing.planar import SIDES, PlanarMesh, signed_areas, triangulate
from ..surface.curves import Curve
from ..surface.geometry import bounding_size, segment_lengths
from ..surface.pieces import point_text, to_local, two_digits
from ..surface.topology import components
from .arrangement import Arrangement, Chain, arrange, hole_points
from .edges import Boundary, boundary, check_lines
from .lines import SNAP, Kind, LineTree, PlanLine
from .parts import check_count

if TYPE_CHECKING:
    from .plan import Plan

MAX_TRIANGLES = 500_000  # of a plan's mesh, which takes about a minute; finer ones are made by remeshing
MAX_POINTS = 1_000_000  # of all lines, where they are measured
AT_EDGES = 3  # triangles for each edge of a line, about, where these are shorter than the others
SMALLEST = 0.4  # of the edge length squared: a triangle of these edges is larger
MAX_EDGES = 200_000  # along a line
MAX_RISE = 10.0  # of the initial surface, over the size of the plan


@dataclass(frozen=True, eq=False)
class Draft:
    """A plan with its lines and its plane mesh."""

    plan: Plan
    lines: Sequence[PlanLine]  # the outline, then the holes, the dividers, and the supports off the boundary
    supports_on_edge: Sequence[Curve]
    drawn: Arrangement
    mesh: PlanarMesh  # in the coordinates of Π; its first points are those of ``drawn``
    edges: Boundary

    def divider(self, number: int) -> tuple[PlanLine, Sequence[Chain]]:
        """The line of a divider, and its chains."""
        line = 1 + len(self.plan.holes) + number
        return self.lines[line], self.drawn.along(line)

    @cached_property
    def radii(self) -> Floats:
        """2 A / L of each part of the plan, with its area A and the length L of its edge: R of a circle."""
        mesh = self.mesh
        sides = np.sort(mesh.triangles[:, SIDES].reshape(-1, 2), axis=1)
        owned = np.column_stack([np.repeat(mesh.region, 3), sides])
        own, times = np.unique(owned, axis=0, return_counts=True)
        own = own[times == 1]
        length = np.bincount(own[:, 0], segment_lengths(mesh.points, own[:, 1:]))
        return 2.0 * np.bincount(mesh.region, signed_areas(mesh.points, mesh.triangles)) / length


def drafted(plan: Plan) -> Draft:
    """Draw the lines of a plan and mesh what is between them; PlanError if they do not fit together."""
    lines, on_edge, drawn = _arranged(plan)
    edges = np.concatenate([chain.edges for chain in drawn.chains])
    _check_count(plan, lines[0].xy, len(edges))
    try:
        mesh = triangulate(drawn.points, edges, plan.edge_length, hole_points(drawn, lines))
    except SurfaceError as error:
        problem = f"lines of the plan are too close to each other for edges of length {plan.edge_length:g}"
        raise PlanError(f"{problem}: {error}", what="edge_length", found=plan.edge_length) from None
    areas = signed_areas(mesh.points, mesh.triangles)
    part = np.bincount(mesh.region, areas)
    least = int(np.argmin(part))
    if part[least] < SMALLEST * plan.edge_length**2:  # lines that just miss each other
        own, area = mesh.region == least, part[least]
        middle = mesh.points[mesh.triangles[own]].mean(axis=1).T @ areas[own] / area
        finer = two_digits(math.sqrt(area), math.floor)
        problem = (
            f"the part of the plan around {point_text(middle)} has the area {area:.3g}, less than a triangle"
            f" with edges of {plan.edge_length:g}; if its lines should meet in one point, draw them so,"
            f" otherwise use edge_length = {finer:g} or less"
        )
        raise PlanError(problem, what="edge_length", where=tuple(middle.tolist()), found=float(area))
    return Draft(plan, lines, on_edge, drawn, mesh, boundary(plan, lines, on_edge, drawn))


def part_count(plan: Plan) -> int:
    """The number of parts into which the lines cut the plan, without its mesh; errors as in ``drafted``."""
    return _part_count(plan, _arranged(plan)[2])


def _part_count(plan: Plan, drawn: Arrangement) -> int:
    """By Euler's formula e - v + c for e chains between v vertices in c connected pieces, less the holes."""
    ends = np.array([chain.vertices[[0, -1]] for chain in drawn.chains])
    used, renumbered = np.unique(ends, return_inverse=True)
    pieces = components(renumbered.reshape(-1, 2), len(used))
    return len(ends) - len(used) + 1 + int(pieces.max()) - len(plan.holes)


def _arranged(plan: Plan) -> tuple[list[PlanLine], list[Curve], Arrangement]:
    """The lines in the coordinates of Π, the supports on the boundary, and the lines cut where they meet."""
    lines = [PlanLine("the outline", Kind.OUTLINE, plan.outline.local(plan.plane))]
    lines += [PlanLine(h.name, Kind.HOLE, h.curve.local(plan.plane)) for h in plan.holes]
    lines += [PlanLine(f"divider {d.name!r}", Kind.DIVIDER, d.curve.local(plan.plane)) for d in plan.dividers]
    curves = [(k, support) for k, support in enumerate(plan.supports, 1) if isinstance(support, Curve)]
    supports = [PlanLine(f"support {k}", Kind.SUPPORT, curve.local(plan.plane)) for k, curve in curves]
    _check_size(plan, [*lines, *supports])
    tree, on_edge = LineTree([line for line in lines if line.bounds]), []
    for line in supports:
        if tree.leaves(line.curve, 0.5 * plan.edge_length, SNAP * plan.edge_length) is None:
            on_edge.append(line.curve)
        else:
            lines.append(line)
    check_lines(plan, lines)
    points = [to_local(p, plan.plane) for p in plan.supports if not isinstance(p, Curve)]
    named = [np.array([*point, np.nan]) for point in plan.points.values()]  # vertices, but not held
    cut = [*on_edge, *(c.local(plan.plane) for c in (*(part.curve for part in plan.cables), *plan.mirrors))]
    cut_points = np.concatenate([np.zeros((0, 2)), *(c.at([0.0, len(c.pieces)])[:, :2] for c in cut)])
    required = np.reshape([*points, *named], (-1, 3)).astype(float)
    drawn = arrange(lines, plan.edge_length, required, cut_points)
    check_count("patches", _part_count(plan, drawn))
    return lines, on_edge, replace(drawn, required=drawn.required[: len(points)])


def _check_size(plan: Plan, lines: Sequence[PlanLine]) -> None:
    """Refuse lengths that are probably mistakes, before they fill the memory."""
    points = sum(
        len(curve.dense) for curve in (*(c.curve for c in plan.cables), *(one.curve for one in lines))
    )
    if points > MAX_POINTS:
        problem = f"the lines of the plan have {points} points; at most {MAX_POINTS} are read: draw them with"
        raise PlanError(f"{problem} fewer", what="outline", found=points, expected=MAX_POINTS)
    _check_count(plan, lines[0].xy, 0)
    size = bounding_size(lines[0].xy)
    if plan.edge_length > size:
        problem = (
            f"edge_length={plan.edge_length:g} is longer than the plan, {size:.4g} from corner to corner"
        )
        raise PlanError(f"{problem}; use a smaller one", what="edge_length", found=plan.edge_length)
    if plan.rise is not None and plan.rise > MAX_RISE * size:
        problem = f"rise={plan.rise:g} is more than {MAX_RISE:g} times the plan's size, {size:.4g}; use a"
        raise PlanError(f"{problem} smaller one", what="rise", found=plan.rise)
    for line in lines:
        if line.curve.length > MAX_EDGES * plan.edge_length:
            problem = f"is {line.curve.length:.3g} long, more than {MAX_EDGES} edges of {plan.edge_length:g};"
            raise line.error(f"{problem} draw it as long as the plan", found=line.curve.length)
    for line in lines:
        extent = float(np.ptp(line.xy, axis=0).max())
        if line.kind is Kind.HOLE and extent <= SNAP * plan.edge_length:
            problem = (
                f"is only {extent:g} wide, too little for edges of length {plan.edge_length:g}; leave it"
            )
            raise line.error(f"{problem} out, or use a smaller edge_length", found=extent)


def _check_count(plan: Plan, outline: Floats, edges: int) -> None:
    """Refuse a mesh of more triangles in an outline (k,2) than are allowed, before it is made."""
    x, y = outline.T
    area = 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))
    h, short = plan.edge_length, AT_EDGES * edges
    count = short + area / math.sqrt(0.1875) / h / h  # the square of h may be 0 or infinite
    if count > MAX_TRIANGLES:
        least = math.sqrt(area / math.sqrt(0.1875) / max(MAX_TRIANGLES - short, 1))
        change = f"use {two_digits(least, math.ceil):g} or more, and refine the roof by [[remesh]]"
        if short > MAX_TRIANGLES / 2:
            change = f"draw the lines with fewer points, they have {edges} edges"
        problem = f"edge_length={h:g} would make about {count:.2g} triangles; at most {MAX_TRIANGLES} are"
        raise PlanError(f"{problem} allowed: {change}", what="edge_length", found=h)
