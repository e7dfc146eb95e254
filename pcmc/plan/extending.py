"""Lines whose ends just miss each other, or the lines that they should reach, moved to meet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats
from ..curves.curves import Curve
from ..surface.topology import components
from .lines import Kind, Line, LineTree
from .paths import bent

EXACT = 1e-9  # of the tolerance: what is nearer than this meets already


def extended(
    curves: Mapping[str, Curve], edges: Sequence[Curve], tolerance: float, what: str = "dividers"
) -> tuple[dict[str, Curve], str]:
    """The curves with ends moved that just miss each other or a line, and a note; ``what`` names them.

    Ends within ``tolerance`` of each other meet in one point, or in a corner of an edge that is as near.
    This point, and each other end, is moved onto the nearest line that it just misses. Only the course in
    plan counts.
    """
    names = [name for name, curve in curves.items() if not curve.closed]
    if not names:
        return dict(curves), ""
    rims = [Line("an edge", Kind.OUTLINE, edge) for edge in edges if _extent(edge)]
    corners = np.concatenate([np.zeros((0, 2)), *(rim.corners for rim in rims)])
    drawn = np.concatenate([curves[name].at([0.0, len(curves[name].pieces)]) for name in names])[:, :2]
    points = np.concatenate([drawn, corners])
    group = components(cKDTree(points).query_pairs(tolerance, output_type="ndarray"), len(points))
    members: list[list[int]] = [[] for _ in range(int(group.max()) + 1)]
    for k, number in enumerate(group.tolist()):
        members[number].append(k)
    place = np.array([points[own[-1:] if own[-1] >= len(drawn) else own].mean(axis=0) for own in members])
    settled = [own[-1] >= len(drawn) for own in members]  # in a corner
    result = dict(curves)
    for others in ((), tuple(curves)):  # onto the edges first, then onto each other
        lines = [*rims, *(Line("a line", Kind.DIVIDER, result[k]) for k in others if _extent(result[k]))]
        owners = [None] * len(rims) + [name for name in others if _extent(result[name])]
        for number, passing in enumerate(LineTree(lines).at(place, tolerance) if lines else ()):
            own = {names[k // 2] for k in members[number] if k < len(drawn)}
            reached = [lines[i].curve.at([t])[0, :2] for i, t in passing if owners[i] not in own]
            if reached and not settled[number]:
                place[number] = min(reached, key=lambda xy: float(np.linalg.norm(xy - place[number])))
        steps = place[group[: len(drawn)]] - drawn
        steps[np.linalg.norm(steps, axis=1) <= EXACT * tolerance] = 0.0
        for name, both in zip(names, steps.reshape(-1, 2, 2), strict=True):
            result[name] = _with_ends(curves[name], np.pad(both, ((0, 0), (0, 1))))
    lengths = np.linalg.norm(steps, axis=1)
    moved = np.count_nonzero(lengths)
    note = f"{moved} end{'s' if moved > 1 else ''} of {what} moved by up to {lengths.max():.3g} to the lines"
    return result, f"{note} that they meet" if moved else ""


def settled(
    supports: Sequence[Floats | Curve], edges: Sequence[Curve], tolerance: float
) -> tuple[list[Floats | Curve], str]:
    """Points (3,), and curves by their ends and joints, moved in plan onto edges that they just miss; a note.

    A point within ``tolerance`` of a corner of an edge goes there, otherwise onto the nearest edge as near.
    """
    rims = [Line("an edge", Kind.OUTLINE, edge) for edge in edges if _extent(edge)]
    corners = np.concatenate([rim.corners for rim in rims])
    lengths = [0.0]

    def steps(points: Floats) -> Floats:
        """(k,3) how far each point moves."""
        xy = points[:, :2]
        nearest = xy.copy()
        away = np.full(len(xy), tolerance)
        for rim in rims:
            t, distance = rim.nearest(xy)
            nearer = distance <= away
            nearest[nearer], away[nearer] = rim.curve.at(t)[nearer, :2], distance[nearer]
        if len(corners):
            apart, corner = (np.asarray(found) for found in cKDTree(corners).query(xy))
            nearest[apart <= tolerance] = corners[corner[apart <= tolerance]]
        moves = nearest - xy
        moves[np.linalg.norm(moves, axis=1) <= EXACT * tolerance] = 0.0
        lengths.extend(np.linalg.norm(moves, axis=1).tolist())
        return np.pad(moves, ((0, 0), (0, 1)))

    result: list[Floats | Curve] = []
    for support in supports:
        if not isinstance(support, Curve):
            result.append(support + steps(support[None])[0])
            continue
        count = len(support.pieces)
        joints = steps(support.at(np.arange(count + (not support.closed), dtype=float)))
        ends = np.roll(joints, -1, axis=0) if support.closed else joints[1:]
        parts = zip(support.pieces, joints, ends, strict=False)
        pieces = tuple(
            bent(piece, start, end) if start.any() or end.any() else piece for piece, start, end in parts
        )
        result.append(replace(support, pieces=pieces))
    moved = np.count_nonzero(lengths)
    note = (
        f"{moved} point{'s' if moved > 1 else ''} of supports moved by up to {max(lengths):.3g} to the edges"
    )
    return result, f"{note} that they just miss" if moved else ""


def _extent(curve: Curve) -> bool:
    return bool(np.ptp(curve.at(curve.dense)[:, :2], axis=0).any())


def _with_ends(curve: Curve, steps: Floats) -> Curve:
    """The curve with its two ends moved by these vectors."""
    if not steps.any():
        return curve
    pieces = list(curve.pieces)
    pieces[0] = bent(pieces[0], steps[0], np.zeros(3))
    pieces[-1] = bent(pieces[-1], np.zeros(3), steps[1])
    return replace(curve, pieces=tuple(pieces))
