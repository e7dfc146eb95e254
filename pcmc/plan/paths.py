"""Strokes joined end to end, and ends moved onto the lines that they just miss: small gaps are closed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..base.tolerances import ON
from ..surface.curves import Curve, arc
from ..surface.parts import listed
from ..surface.pieces import Piece
from ..surface.topology import components
from .lines import Kind, LineTree, PlanLine
from .strokes import Stroke


@dataclass(frozen=True, eq=False)
class JoinedPath:
    """A curve of one or several strokes, their layer and labels; how many strokes end at each of its ends."""

    curve: Curve
    layer: str
    labels: tuple[str, ...]
    strokes_at_ends: tuple[int, int]

    @property
    def source(self) -> str:
        """Its layer and strokes, for messages."""
        return f"layer {self.layer!r}: {listed(self.labels)}"

    @property
    def ends(self) -> Floats:
        """(2,3) its first and last point."""
        return _ends(self.curve)


def join_strokes(strokes: Sequence[Stroke], tolerance: float) -> tuple[list[JoinedPath], list[str]]:
    """The paths that strokes make whose ends are nearer to each other than ``tolerance``; notes on changes.

    Paths end where one stroke ends or more than two meet. Where a gap is closed, an arc keeps its place and a
    line moves; of two alike each moves half of the way. Strokes drawn twice count once.

    >>> from ..surface.curves import polyline
    >>> lines = [[[0, 0, 0], [4, 0, 0]], [[0, 3, 0], [0, 0.001, 0]], [[4, 0, 0], [0, 3, 0]]]
    >>> strokes = [Stroke("outline", f"LINE {k}", polyline(points)) for k, points in enumerate(lines)]
    >>> (path,), notes = join_strokes(strokes, 0.01)
    >>> path.curve.closed, notes
    (True, ["layer 'outline': 1 gap closed, up to 0.001 long (closed are gaps up to 0.01)"])
    """
    drawn = [(stroke.curve, stroke.label) for stroke in strokes if stroke.curve is not None]
    if not drawn:
        return [], []
    layer, single = strokes[0].layer, _single([curve for curve, _ in drawn], tolerance)
    doubles = [label for (_, label), alone in zip(drawn, single, strict=True) if not alone]
    doubled = f"layer {layer!r}: drawn twice or without length, left out: {listed(doubles)}"
    notes, kept = [doubled] if doubles else [], list(compress(drawn, single))
    if not kept:
        return [], notes
    curves, labels = zip(*kept, strict=True)
    ends = np.concatenate([_ends(curve) for curve in curves])
    node = components(cKDTree(ends).query_pairs(tolerance, output_type="ndarray"), len(ends))
    count = int(node.max()) + 1
    # a node is where its only curved stroke ends, else in the middle of its ends
    curved = np.repeat([bool(c.pieces[0].sweep) or len(c.pieces[0].points) > 2 for c in curves], 2)
    weight = np.where(np.bincount(node, curved, count)[node] > 0.0, curved, 1.0)
    total = np.bincount(node, weight, count)
    places = np.stack([np.bincount(node, weight * x, count) / total for x in ends.T], axis=1)
    alone = np.bincount(node, minlength=count)[node] == 1
    places[node[alone]] = ends[alone]
    of_node = pd.DataFrame(ends).groupby(node)
    gaps = np.linalg.norm(of_node.max() - of_node.min(), axis=1)
    gaps[gaps <= ON * tolerance] = 0.0
    moved = []
    for curve, both, old in zip(curves, places[node].reshape(-1, 2, 3), ends.reshape(-1, 2, 3), strict=True):
        steps = both - old
        steps[np.linalg.norm(steps, axis=1) <= 1e-12 * curve.length] = 0.0
        closed = bool(np.linalg.norm(both[1] - both[0]) <= 1e-9 * curve.length)
        moved.append(replace(_with_ends(curve, steps), closed=closed))
    if gaps.any():
        number = np.count_nonzero(gaps)
        text = f"layer {layer!r}: {number} gap{'s' if number > 1 else ''} closed, up to {gaps.max():.3g} long"
        notes.insert(0, f"{text} (closed are gaps up to {tolerance:.3g})")
    return _walk(moved, layer, labels, node.reshape(-1, 2)), notes


def _ends(curve: Curve) -> Floats:
    return curve.at([0.0, float(len(curve.pieces))])


def _single(curves: Sequence[Curve], tolerance: float) -> list[bool]:
    """Which curves have a length and repeat no earlier one, by points at their quarters."""
    marks = np.array([c.at(c.parameter(c.length * np.linspace(0.0, 1.0, 5))) for c in curves])
    flat = np.round(marks.reshape(len(curves), -1) / tolerance, 3)
    _, first, which = np.unique(flat, axis=0, return_index=True, return_inverse=True)
    ways = [way.reshape(len(first), -1) for way in (marks[first], marks[first][:, ::-1])]
    tree = cKDTree(ways[0])
    alike: list[Any] = [tree.query_ball_point(way, tolerance, p=np.inf) for way in ways]
    single, taken = [], np.zeros(len(first), dtype=bool)
    for curve, mark in zip(curves, which.reshape(-1), strict=True):
        single.append(curve.length > tolerance and not taken[[*alike[0][mark], *alike[1][mark]]].any())
        taken[mark] |= single[-1]
    return single


def _walk(curves: Sequence[Curve], layer: str, labels: Sequence[str], nodes: Ints) -> list[JoinedPath]:
    """Follow strokes from node to node, first from ends and forks, then around the loops that are left."""
    at_node: dict[int, list[int]] = {}
    for place, node in enumerate(nodes.ravel().tolist()):
        at_node.setdefault(node, []).append(place // 2)
    count = {node: len(there) for node, there in at_node.items()}
    left, paths = set(range(len(curves))), []
    for begin in (*(node for node in at_node if count[node] != 2), *at_node):
        for start in at_node[begin]:
            node, following = begin, [start] if start in left else []
            pieces, names = list[Piece](), dict[str, None]()
            while following:
                k = following[0]
                left.discard(k)
                forward = nodes[k, 0] == node
                pieces += (curves[k] if forward else curves[k].reversed()).pieces
                names[labels[k]] = None
                node = int(nodes[k, int(forward)])
                goes_on = node != begin and count[node] == 2
                following = [other for other in at_node[node] if other in left] if goes_on else []
            if pieces:
                path = Curve(tuple(pieces), closed=node == begin)
                paths.append(JoinedPath(path, layer, tuple(names), (count[begin], count[node])))
    return paths


def meet_lines(
    curves: Mapping[str, Curve], edges: Sequence[Curve], tolerance: float, what: str
) -> tuple[dict[str, Curve], list[str]]:
    """The curves with ends moved that just miss each other or a line, and notes; ``what`` names them.

    Ends within ``tolerance`` of each other meet in one point, or in a corner of an edge. This point, and each
    other end, is moved onto the nearest line that it just misses. Only the course in plan counts.
    """
    names = [name for name, curve in curves.items() if not curve.closed]
    if not names:
        return dict(curves), []
    rims, corners = _rims(edges)
    drawn = np.concatenate([_ends(curves[name]) for name in names])[:, :2]
    points = np.concatenate([drawn, corners])
    group = components(cKDTree(points).query_pairs(tolerance, output_type="ndarray"), len(points))
    last = np.cumsum(np.bincount(group))
    members = [own.tolist() for own in np.split(np.argsort(group, kind="stable"), last[:-1])]
    in_corner = [own[-1] >= len(drawn) for own in members]
    met = (own[-1:] if at else own for own, at in zip(members, in_corner, strict=True))
    place = np.array([points[own].mean(axis=0) for own in met])
    result = dict(curves)
    for others in ((), tuple(curves)):  # onto the edges first, then onto each other
        named = [name for name in others if _extent(result[name])]
        lines = [*rims, *(PlanLine("a line", Kind.DIVIDER, result[name]) for name in named)]
        owners = [None] * len(rims) + named
        for number, passing in enumerate(LineTree(lines).at(place, tolerance) if lines else ()):
            own = {names[k // 2] for k in members[number] if k < len(drawn)}
            reached = [lines[i].curve.at([t])[0, :2] for i, t in passing if owners[i] not in own]
            if reached and not in_corner[number]:
                place[number] = min(reached, key=lambda xy: float(np.linalg.norm(xy - place[number])))
        steps = _steps(place[group[: len(drawn)]] - drawn, tolerance)
        for name, both in zip(names, steps.reshape(-1, 2, 3), strict=True):
            result[name] = _with_ends(curves[name], both)
    return result, _note(steps, f"end{{s}} of {what}", "the lines that they meet")


def meet_edges(
    supports: Sequence[Floats | Curve], edges: Sequence[Curve], tolerance: float
) -> tuple[list[Floats | Curve], list[str]]:
    """Points (3,), and curves by their ends and joints, moved in plan onto corners and edges that they just
    miss; notes."""
    rims, corners = _rims(edges)
    joints = [
        s.at(np.arange(len(s.pieces) + (not s.closed), dtype=float)) if isinstance(s, Curve) else s[None]
        for s in supports
    ]
    xy = np.concatenate([np.zeros((0, 3)), *joints])[:, :2]
    nearest, away = xy.copy(), np.full(len(xy), tolerance)
    for rim in rims if len(xy) else ():
        t, distance = rim.nearest(xy)
        nearer = distance <= away
        nearest[nearer], away[nearer] = rim.curve.at(t)[nearer, :2], distance[nearer]
    if len(corners) and len(xy):
        apart, corner = (np.asarray(found) for found in cKDTree(corners).query(xy))
        nearest[apart <= tolerance] = corners[corner[apart <= tolerance]]
    steps = _steps(nearest - xy, tolerance)
    result: list[Floats | Curve] = []
    of_support = np.split(steps, np.cumsum([len(j) for j in joints])[:-1])
    for support, own in zip(supports, of_support, strict=False):
        if isinstance(support, Curve):
            parts = zip(support.pieces, own, np.roll(own, -1, axis=0), strict=False)
            result.append(replace(support, pieces=tuple(_bent(*part) for part in parts)))
        else:
            result.append(support + own[0])
    return result, _note(steps, "point{s} of supports", "the edges that they just miss")


def _rims(edges: Sequence[Curve]) -> tuple[list[PlanLine], Floats]:
    """The edges that have a length in plan, and (c,2) their corners."""
    rims = [PlanLine("an edge", Kind.OUTLINE, edge) for edge in edges if _extent(edge)]
    return rims, np.concatenate([np.zeros((0, 2)), *(rim.curve.at(rim.curve.corners)[:, :2] for rim in rims)])


def _extent(curve: Curve) -> bool:
    return bool(np.ptp(curve.at(curve.dense)[:, :2], axis=0).any())


def _steps(steps: Floats, tolerance: float) -> Floats:
    """(k,3) the steps (k,2) in plan, those to nearly the same place left out."""
    steps[np.linalg.norm(steps, axis=1) <= ON * tolerance] = 0.0
    return np.pad(steps, ((0, 0), (0, 1)))


def _note(steps: Floats, what: str, where: str) -> list[str]:
    lengths = np.linalg.norm(steps, axis=1)
    moved = np.count_nonzero(lengths)
    what = what.format(s="s" if moved > 1 else "")
    return [f"{moved} {what} moved by up to {lengths.max():.3g} to {where}"] if moved else []


def _with_ends(curve: Curve, steps: Floats) -> Curve:
    """The curve with its two ends moved by the vectors (2,3)."""
    pieces = list(curve.pieces)
    pieces[0] = _bent(pieces[0], steps[0], np.zeros(3))
    pieces[-1] = _bent(pieces[-1], np.zeros(3), steps[1])
    return replace(curve, pieces=tuple(pieces)) if steps.any() else curve


def _bent(piece: Piece, at_start: Floats, at_end: Floats) -> Piece:
    """The piece with its ends moved by these vectors; an arc of a circle stays one."""
    if not (at_start.any() or at_end.any()):
        return piece
    t = np.linspace(0.0, 1.0, len(piece.points))[:, None]
    if not piece.sweep:
        return replace(piece, points=piece.points + (1.0 - t) * at_start + t * at_end)
    _, u, v = piece.points
    circular = abs(u @ u - v @ v) + abs(u @ v) <= 1e-9 * (u @ u)
    start, middle, end = piece.at(np.array([0.0, 0.5, 1.0]))
    if circular and abs(piece.sweep) < 6.2:
        return arc(start + at_start, middle + 0.5 * (at_start + at_end), end + at_end).pieces[0]
    # the least change of centre and vectors that moves start and end so
    c, s = np.cos(piece.sweep), np.sin(piece.sweep)
    change = np.linalg.lstsq(np.array([[1.0, 1.0, 0.0], [1.0, c, s]]), np.stack([at_start, at_end]))[0]
    return replace(piece, points=piece.points + change)
