"""Whether a surface is found again on finer meshes, and if not what it becomes, and where."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..base.arrays import Bools, Floats, Ints
from ..base.tolerances import FAILED
from ..certificate import Certificate
from ..certificate.balance import overload
from ..certificate.diagnosis import worst_face
from ..certificate.tables import names_of
from ..forces.pinching import standing_part
from ..forces.wall_rows import find_walls
from ..solvers.result import Result, Status
from ..stability.equilibrium import Equilibrium
from ..surface import Surface
from ..surface.geometry import segment_lengths
from ..surface.pieces import point_text
from ..surface.topology import components
from .extrapolation import LOWEST

FAR = 0.25  # of the surface's extent: a finer surface this far away is another shape
FLAT = 0.1  # of its size: the least extent that counts
STILL = 1e-8  # of its size: moves up to here are none
MATTERS = 0.1  # of what a refinement adds to the shape: smaller moves show no trend (0.7 and more where
# the mesh holds a surface, 0.15 to 2 where it converges, below 0.03 on meshes of symmetric minimal surfaces)
CONTACT = 1.5  # order where a rest ends: beside it a junction rises as the distance to the power of 3/2
BEGINS = 1.0  # order where a rest begins: it grows from nothing, by whole edges
RESTED = 0.1  # of a junction's length: a smaller change of contact is none
REACH = 0.3  # of a junction's length: this near to it a place belongs to it
LIMIT = 0.5**LOWEST  # of the step before: what moves by less has a limit in sight, as for error bars
FURTHER = 3  # meshes ahead at which an eigenvalue that only falls, a line that leans, or a rest is foreseen
RUNNING_AWAY = {Status.DIVERGED: "it inflates without bound", Status.VANISHED: "it shrinks to nothing"}


class MeshVerdict(Enum):
    """Whether a surface depends on its mesh. The value is a sentence."""

    PERSISTS = "persists: finer meshes have the same surface"
    CHANGES = "changes: finer meshes have another surface"
    HELD_BY_MESH = "held by the mesh: finer meshes do not hold this surface"


class Finding(NamedTuple):
    """A verdict, its reason, the place it speaks of (or None), and what to type (or nothing)."""

    verdict: MeshVerdict
    reason: str
    place: tuple[float, ...] | None = None
    advice: str = ""


def lost(start: Surface, result: Result) -> Finding:
    """The finding where the solver reaches no equilibrium from the start on a finer mesh.

    The place is that of the start: where the solver ends, a surface may be far away.
    """
    surface = result.surface
    worst, quality = worst_face(surface, standing_part(surface).walls.pinchable)
    if result.status in RUNNING_AWAY:
        what = f"{RUNNING_AWAY[result.status]}, most"
        vertices = np.linalg.norm(surface.vertices - start.vertices, axis=1).argmax(keepdims=True)
    elif quality < FAILED:
        what, vertices = "its triangles collapse", surface.faces[worst]
    else:
        left = np.linalg.norm(Equilibrium.of(surface).unbalanced, axis=1)
        what, vertices = "its forces do not come to rest", left.argmax(keepdims=True)
    place, load = start.vertices[vertices].mean(axis=0), overload(surface)
    reason = f"on {surface.m} triangles the solver finds no equilibrium near this one: {what}"
    return _at(MeshVerdict.HELD_BY_MESH, start, reason, place, "" if load is None else f"; {load}")


def compared(surfaces: Sequence[Surface], certificates: Sequence[Certificate]) -> Finding:
    """The finding about surfaces at rest, each on a refinement of the mesh before."""
    first = certificates[0]
    for surface, certificate in zip(surfaces[1:], certificates[1:], strict=True):
        if certificate.index != first.index:
            becomes = "stable" if certificate.index == 0 else f"a saddle of index {certificate.index}"
            was = "stable" if first.index == 0 else f"of index {first.index}"
            reason = f"on {surface.m} triangles it is {becomes}, here {was}; the motion that turns is largest"
            return _at(MeshVerdict.CHANGES, surface, reason, _where_softest(surface, certificate))
    size = max(float(np.ptp(surfaces[0].plane.height(surfaces[0].vertices))), FLAT * surfaces[0].size)
    moves = [_moves(a, b) for a, b in pairwise(surfaces)]
    for (surface, fine), move in zip(pairwise(surfaces), moves, strict=True):
        if contact := _other_contact(surface, fine):
            return contact
        far, place = float(move.max()), surface.vertices[int(move.argmax())]
        if far > FAR * size:
            reason = f"on {fine.m} triangles it is another shape, {far:.3g} away"
            return _at(MeshVerdict.CHANGES, surface, reason, place)
    if _order(surfaces, moves) < 0.0:
        before, last = (_mean(move) for move in moves[-2:])
        moved = f"by {before:.2g}, then {last:.2g} in the mean"
        reason = f"each finer surface is farther from the last one ({moved}), most"
        return _at(MeshVerdict.HELD_BY_MESH, surfaces[-1], reason, surfaces[-2].vertices[moves[-1].argmax()])
    return _falling_line(surfaces) or _stability(surfaces, certificates)


def shape_order(surfaces: Sequence[Surface]) -> float:
    """Observed order of the surface itself: log2 of the last two mean moves from mesh to mesh.

    Infinite with fewer than three meshes, or where the last move is none beside the error of the shape: a
    coarse mesh may be at rest on the smooth surface itself, so that first moves are small and later ones
    larger. The error is how far the last refinement's new vertices are from the middles of their edges.
    At most 3/2 where a junction rests on its bottom on the last three meshes, or will on far finer ones: that
    where its rest ends. At most 1 where one begins to rest on these meshes, or will on the next ones.
    """
    order = _order(surfaces, [_moves(a, b) for a, b in pairwise(surfaces[-3:])])
    if len(surfaces) < 3 or surfaces[0].periodic:
        return order
    # at an end it rises as c s - k s log(1/s): by k log 2 less on each finer mesh, until it rests
    slopes = np.array([_end_slopes(surface)[: surfaces[-2].n] for surface in surfaces[-2:]])
    ends = np.flatnonzero(np.isfinite(slopes).all(axis=0))
    before, last = slopes[:, ends]
    rests, junction = _rests(surfaces[-3:])
    always, sometimes = np.all(rests, axis=0), np.any(rests, axis=0)
    soon = (last <= FURTHER * (before - last)) & ~always[junction[ends]]  # what rests has no slope
    if np.any(sometimes & ~always) or soon.any():
        return min(order, BEGINS)
    return min(order, CONTACT) if np.any(always) or (last < before).any() else order


def _rests(surfaces: Sequence[Surface]) -> tuple[Bools, Ints]:
    """(meshes,n) whether junction k rests somewhere on a mesh, and (n,) the k of the last one's vertices."""
    junction = components(find_walls(surfaces[-1], held=True).top_edges, surfaces[-1].n)
    rests = np.zeros((len(surfaces), surfaces[-1].n), dtype=bool)
    for row, surface in zip(rests, surfaces, strict=True):
        row[junction[np.flatnonzero(standing_part(surface).resting)]] = True
    return rests, junction


def _end_slopes(surface: Surface) -> Floats:
    """(n,) how steeply junctions rise at their ends on Π, the least of several; infinite elsewhere."""
    X, walls = surface.vertices, find_walls(surface, held=True)
    pairs = np.concatenate([walls.top_edges, walls.top_edges[:, ::-1]])
    end, top = pairs[walls.corner[pairs[:, 0]] & walls.top_free[pairs[:, 1]]].T
    held, foot = walls.foot[top] >= 0, X[walls.foot[top]]
    rise = np.where(held, np.linalg.norm(X[top] - foot, axis=1), surface.plane.height(X[top]))
    run = np.linalg.norm(np.where(held[:, None], foot - X[end], surface.plane.along(X[top] - X[end])), axis=1)
    slopes = np.full(surface.n, np.inf)
    np.minimum.at(slopes, end, np.abs(rise) / run)
    return slopes


def _order(surfaces: Sequence[Surface], moves: Sequence[Floats]) -> float:
    if len(surfaces) < 3:
        return np.inf
    (before, last), (coarse, fine) = map(_mean, moves[-2:]), surfaces[-2:]
    middles = coarse.vertices[coarse.topology.edges].mean(axis=1)
    error = _mean(np.linalg.norm(fine.vertices[coarse.n :] - middles, axis=1))
    return float(np.log2(before / last)) if last > STILL * fine.size + MATTERS * error else np.inf


def _mean(moves: Floats) -> float:
    """Root mean square."""
    return float(np.sqrt((moves**2).mean()))


def _moves(coarse: Surface, fine: Surface) -> Floats:
    """(n,) how far the coarse vertices have moved in ways that change the shape, length."""
    space = Equilibrium.of(coarse).space
    return np.linalg.norm(space.project(fine.vertices[: coarse.n] - coarse.vertices), axis=1)


def _falling_line(surfaces: Sequence[Surface]) -> Finding | None:
    """The finding where a line in which walls meet leans ever more at its foot: it will lie down.

    At its foot the walls are planes through their bottoms and the line, and must balance. With all bottoms on
    one side of a straight line, as in a T, they cannot: each finer mesh sees it lean more, by about as much.
    """
    if len(surfaces) < 3:
        return None
    leans = np.zeros((len(surfaces), surfaces[0].n))  # degrees from Π's normal at the feet
    for lean, surface in zip(leans, surfaces, strict=True):
        lines = [curve for curve in surface.topology.junctions if surface.walls[list(curve.sheets)].all()]
        for end, beside in (pair for line in lines for pair in line.ends):
            if surface.pinned[end]:
                step = surface.vertices[beside] - surface.vertices[end]
                run, rise = np.linalg.norm(surface.plane.along(step)), step @ np.array(surface.plane.normal)
                lean[end] = np.degrees(np.arctan2(run, abs(rise)))
    before, step = leans[-2] - leans[-3], leans[-1] - leans[-2]
    falling = (step > 0.0) & (step >= LIMIT * before) & (leans[-1] + FURTHER * step >= 90.0)
    if not falling.any():
        return None
    foot = int(np.where(falling, step, 0.0).argmax())
    values = ", ".join(f"{lean[foot]:.0f}°" for lean in leans)
    reason = f"the line in which walls meet leans ever more at its foot ({values}) and will lie down,"
    return _at(MeshVerdict.HELD_BY_MESH, surfaces[0], reason, surfaces[0].vertices[foot])


def _stability(surfaces: Sequence[Surface], certificates: Sequence[Certificate]) -> Finding:
    """The finding from the trend of the lowest eigenvalue, where all else persists."""
    index = certificates[0].index
    kind = "stable" if index == 0 else f"a saddle of index {index}"
    reason = f"{kind} on {' and '.join(str(surface.m) for surface in surfaces[1:])} triangles too"
    lowest = [float(c.eigenvalues[0]) for c in certificates if len(c.eigenvalues)]
    if index != 0 or len(lowest) < max(3, len(surfaces)):
        return Finding(MeshVerdict.PERSISTS, reason)
    step, before = lowest[-1] - lowest[-2], lowest[-2] - lowest[-3]
    if not (before < 0.0 and step < LIMIT * before):
        return Finding(MeshVerdict.PERSISTS, reason)
    values = ", ".join(f"{value:.3g}" for value in lowest)
    reason += f", but the lowest eigenvalue falls from mesh to mesh ({values}) with no limit in sight"
    if lowest[-1] + FURTHER * step >= 0.0:
        return Finding(MeshVerdict.PERSISTS, reason)
    reason += f": it would be a saddle within {FURTHER} more refinements, by a motion"
    return _at(MeshVerdict.HELD_BY_MESH, surfaces[-1], reason, _where_softest(surfaces[-1], certificates[-1]))


def _where_softest(surface: Surface, certificate: Certificate) -> Floats:
    """(3,) where the lowest mode moves the surface most."""
    moved = np.linalg.norm(certificate.modes, axis=2).sum(axis=0)  # zero where no mode was computed
    return np.asarray(surface.vertices[moved.argmax()])


def _other_contact(coarse: Surface, fine: Surface) -> Finding | None:
    """The finding where a junction rests on Π along another length, beyond what the mesh resolves."""
    walls = standing_part(coarse).walls
    before, after = _resting_lengths(coarse), _resting_lengths(fine)
    for k in np.flatnonzero(walls.pinchable):
        tops = walls.top_edges[walls.wall_below == k]
        lengths = segment_lengths(coarse.vertices, tops)
        if abs(after[k] - before[k]) > 2.0 * lengths.max() + RESTED * lengths.sum():
            reason = f"on {fine.m} triangles the junction over {coarse.patches[k].name!r} rests on the plane"
            reason += f" along {after[k]:.3g} of its length {lengths.sum():.3g}, here along {before[k]:.3g}"
            place = coarse.vertices[tops].mean(axis=(0, 1))
            return Finding(MeshVerdict.CHANGES, reason, tuple(place.tolist()))
    return None


def _resting_lengths(surface: Surface) -> Floats:
    """(patches,) the length of the junctions over each wall that rests on Π."""
    part = standing_part(surface)
    walls, down = part.walls, part.resting | part.walls.corner
    rests = down[walls.top_edges].all(axis=1) & part.resting[walls.top_edges].any(axis=1)
    lengths = segment_lengths(surface.vertices, walls.top_edges) * rests
    return np.asarray(np.bincount(walls.wall_below, lengths, len(surface.patches)), dtype=float)


def _at(verdict: MeshVerdict, surface: Surface, reason: str, place: Floats, more: str = "") -> Finding:
    """A finding about a place, with advice where it is near a junction that ends over a wall that slides."""
    X, sliding = surface.vertices, standing_part(surface).walls.sliding
    nearest, advice, ending = np.inf, "", ""
    reason += f" near {point_text(place, surface.size)}{more}"
    for curve in surface.topology.junctions:
        ends = [end for end, _ in curve.ends if surface.pinned[end]]
        if not ends or not sliding[list(curve.sheets)].any():
            continue
        length = segment_lengths(X, curve.pairs).sum()
        distance = np.linalg.norm(X[curve.vertices] - place, axis=1).min() / length
        if distance <= min(nearest, REACH):
            nearest, end = distance, X[min(ends, key=lambda v: np.linalg.norm(X[v] - place))]
            names = names_of(surface, curve.sheets)
            wall = next(surface.patches[k].name for k in curve.sheets if sliding[k])
            ending = f"; the junction {names} there ends at {point_text(end, surface.size)}"
            ending += ", where only the mesh holds it"
            advice = f'hold the bottom of {wall!r}: bottom = "held" under its divider in a plan, or add its'
            advice += " lowest vertices to fixed="
    return Finding(verdict, reason + ending, tuple(place.tolist()), advice)
