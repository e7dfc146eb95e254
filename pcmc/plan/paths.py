"""Strokes joined end to end: closed loops, and lines from fork to fork; small gaps are closed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..curves.curves import Curve, arc
from ..curves.pieces import Piece
from ..surface.topology import components
from .strokes import Stroke

EXACT = 1e-9  # of the tolerance: ends nearer than this have no gap


@dataclass(frozen=True, eq=False)
class JoinedPath:
    """A curve of one or several strokes, their labels, and how many strokes end at each of its ends."""

    curve: Curve
    labels: tuple[str, ...]
    strokes_at_ends: tuple[int, int] = (2, 2)

    @property
    def ends(self) -> Floats:
        """(2,3) its first and last point."""
        return self.curve.at([0.0, float(len(self.curve.pieces))])


@dataclass(frozen=True, eq=False)
class Joined:
    """Paths, the number of gaps closed, the largest of them, and the labels of strokes drawn twice."""

    paths: Sequence[JoinedPath]
    closed_gaps: int
    largest_gap: float
    doubles: tuple[str, ...]


def join_strokes(strokes: Sequence[Stroke], tolerance: float) -> Joined:
    """The paths that strokes make whose ends are nearer to each other than ``tolerance``.

    Paths end where one stroke ends or more than two meet. Where a gap is closed, an arc keeps its place and a
    line moves; of two alike each moves half of the way. Strokes drawn twice count once.

    >>> from ..curves.curves import polyline
    >>> lines = [[[0, 0, 0], [4, 0, 0]], [[0, 3, 0], [0, 0.001, 0]], [[4, 0, 0], [0, 3, 0]]]
    >>> strokes = [Stroke("outline", f"LINE {k}", polyline(points)) for k, points in enumerate(lines)]
    >>> joined = join_strokes(strokes, 0.01)
    >>> joined.paths[0].curve.closed, joined.closed_gaps, joined.largest_gap
    (True, 1, 0.001)
    """
    once, doubles = _once(strokes, tolerance)
    curves = [stroke.curve for stroke in once if stroke.curve is not None]
    if not curves:
        return Joined((), 0, 0.0, doubles)
    ends = np.concatenate([curve.at([0.0, float(len(curve.pieces))]) for curve in curves])
    node = components(cKDTree(ends).query_pairs(tolerance, output_type="ndarray"), len(ends))
    places = _places(curves, ends, node)
    low, high = np.full((2, len(places), 3), np.inf) * [[[1.0]], [[-1.0]]]
    np.minimum.at(low, node, ends)
    np.maximum.at(high, node, ends)
    gaps = np.linalg.norm(high - low, axis=1)
    gaps[gaps <= EXACT * tolerance] = 0.0
    moved = [_moved(curve, places[node[2 * k : 2 * k + 2]]) for k, curve in enumerate(curves)]
    paths = _walk(moved, [stroke.label for stroke in once], node.reshape(-1, 2))
    return Joined(paths, int(np.count_nonzero(gaps)), float(gaps.max()), doubles)


def _once(strokes: Sequence[Stroke], tolerance: float) -> tuple[list[Stroke], tuple[str, ...]]:
    """The strokes without those that repeat another, and the labels of these; no stroke without length."""
    drawn = [stroke for stroke in strokes if stroke.curve is not None]
    short = np.array([stroke.curve.length <= tolerance for stroke in drawn if stroke.curve is not None])
    marks = np.array([_marks(stroke) for stroke in drawn]).reshape(len(drawn), -1)
    shared, first, which = np.unique(
        np.round(marks / tolerance, 3), axis=0, return_index=True, return_inverse=True
    )
    which = which.reshape(-1)
    tree, turned = cKDTree(marks[first]), marks[first].reshape(-1, 5, 3)[:, ::-1].reshape(len(first), -1)
    alike = [tree.query_ball_point(way, tolerance, p=np.inf) for way in (marks[first], turned)]
    kept, taken, doubles = [], np.zeros(len(shared), dtype=bool), []
    for k, stroke in enumerate(drawn):
        if short[k] or taken[[*alike[0][which[k]], *alike[1][which[k]]]].any():
            doubles.append(stroke.label)
        else:
            kept.append(stroke)
            taken[which[k]] = True
    return kept, tuple(doubles)


def _marks(stroke: Stroke) -> Floats:
    """(5,3) points at the quarters of a stroke."""
    curve = stroke.curve
    assert curve is not None
    return curve.at(curve.parameter(curve.length * np.linspace(0.0, 1.0, 5)))


def _places(curves: Sequence[Curve], ends: Floats, node: Ints) -> Floats:
    """(k,3) the place of each node: the end of its only curved stroke, else the middle of its ends."""
    curved = np.repeat([bool(c.pieces[0].sweep) or len(c.pieces[0].points) > 2 for c in curves], 2)
    count = int(node.max()) + 1
    rank = np.where(curved, 1.0, 0.0)
    weight = np.where(np.bincount(node, rank, count)[node] > 0.0, rank, 1.0)
    total = np.bincount(node, weight, count)
    middle = np.stack([np.bincount(node, weight * x, count) / total for x in ends.T], axis=1)
    alone = np.bincount(node, minlength=count)[node] == 1
    middle[node[alone]] = ends[alone]
    return middle


def _moved(curve: Curve, ends: Floats) -> Curve:
    """The curve with its ends moved to two points."""
    apart = ends - curve.at([0.0, float(len(curve.pieces))])
    apart[np.linalg.norm(apart, axis=1) <= 1e-12 * curve.length] = 0.0
    pieces = [bent(curve.pieces[0], apart[0], np.zeros(3)), *curve.pieces[1:]]
    pieces[-1] = bent(pieces[-1], np.zeros(3), apart[1])
    closed = bool(np.linalg.norm(ends[1] - ends[0]) <= 1e-9 * curve.length)
    return replace(curve, pieces=tuple(pieces), closed=closed)


def bent(piece: Piece, at_start: Floats, at_end: Floats) -> Piece:
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


def _walk(curves: Sequence[Curve], labels: Sequence[str], nodes: Ints) -> list[JoinedPath]:
    """Follow strokes from node to node, first from ends and forks, then around the loops that are left."""
    at_node: dict[int, list[int]] = {}
    for k, pair in enumerate(nodes.tolist()):
        for node in pair:
            at_node.setdefault(node, []).append(k)
    count = {node: len(there) for node, there in at_node.items()}
    left = set(range(len(curves)))
    paths = []
    stops = [node for node in at_node if count[node] != 2]
    for begin in (*stops, *at_node):
        for k in at_node[begin]:
            if k not in left:
                continue
            node, names = begin, []
            pieces: list[Piece] = []
            while True:
                left.discard(k)
                forward = nodes[k, 0] == node
                pieces += (curves[k] if forward else curves[k].reversed()).pieces
                names.append(labels[k])
                node = int(nodes[k, 1] if forward else nodes[k, 0])
                if node == begin or count[node] != 2:
                    break
                following = [other for other in at_node[node] if other in left]
                if not following:
                    break
                k = following[0]
            path = Curve(tuple(pieces), closed=node == begin)
            paths.append(JoinedPath(path, tuple(dict.fromkeys(names)), (count[begin], count[node])))
    return paths
