"""The curves on which a plan's vertices are held, as they were drawn."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..base.arrays import Floats, Ints
from ..curves.curves import Curve, polyline
from ..curves.pieces import Piece
from ..surface import HeldCurve
from .draft import Draft
from .edges import HELD
from .lines import SNAP, Kind, Line

REACH = 3.0 * SNAP  # of the edge length: farther from a curve no vertex is put where lines meet
EXACT = 1e-9  # of the size: a vertex this near to its curve is on it


def held_lines(draft: Draft, X: Floats, feet: Mapping[tuple[int, int], Ints]) -> list[HeldCurve]:
    """The fixed edges of the outline and of holes, the lines of supports, and straight feet of walls.

    Parameters
    ----------
    X : (n,3) vertices of the surface.
    feet : by the first two vertices of the upper edge of a wall, the vertices along its held bottom.
    """
    curves = []
    supports = [Line("support", Kind.SUPPORT, curve) for curve in draft.supports_on_edge]
    fixed = dict(zip(map(tuple, draft.edges.ends.tolist()), draft.edges.among("fixed", HELD), strict=True))
    for chain in draft.drawn.chains:
        line = draft.lines[chain.line]
        if line.kind is Kind.DIVIDER:
            continue
        held = [line.kind is Kind.SUPPORT or fixed[tuple(ends)] for ends in chain.edges.tolist()]
        turns = np.flatnonzero(np.diff([False, *held, False]))
        for first, last in turns.reshape(-1, 2):  # stretches of fixed edges
            V, at = chain.vertices[first : last + 1], chain.at[first : last + 1]
            found = _on_curve(draft, line.curve, V, at, X)
            for support in supports if found is None else ():
                t, _ = support.nearest(draft.drawn.points[V])
                way = slice(None) if t[0] < t[-1] else slice(None, None, -1)
                if found is None and (np.diff(t[way]) > 0.0).all():
                    found = _on_curve(draft, support.curve, V[way], t[way], X)
            curves.append(found or HeldCurve(polyline(X[V]), V, np.arange(float(len(V)))))
    down = np.diag([1.0, 1.0, 0.0])
    for chain in draft.drawn.chains:
        foot = feet.get((int(chain.vertices[0]), int(chain.vertices[1])))
        if foot is not None:
            curve = draft.lines[chain.line].curve.mapped(down, np.zeros(3))
            found = _on_curve(draft, curve, foot, chain.at, X)
            curves += [found] if found else []
    return curves


def _on_curve(draft: Draft, curve: Curve, V: Ints, at: Floats, X: Floats) -> HeldCurve | None:
    """The vertices V (k,) of X (n,3) on a curve in the coordinates of Π, at parameters (k,); None if off it.

    Where lines meet, their common vertex may be a little beside one of them: a straight piece leads there.
    """
    plane = draft.plan.plane
    part, t = curve.part(at[0], at[-1], at)
    part = part.mapped(plane.axes.T, np.array(plane.point))
    there = part.at(t)
    away = np.linalg.norm(X[V] - there, axis=1)
    near = EXACT * float(np.linalg.norm(np.ptp(X, axis=0)))
    if away[1:-1].max(initial=0.0) > near or away.max() > REACH * draft.plan.edge_length:
        return None
    pieces = list(part.pieces)
    if away[0] > near:
        pieces.insert(0, Piece(np.stack([X[V[0]], there[0]])))
        t[1:] += 1.0
    if away[-1] > near:
        pieces.append(Piece(np.stack([there[-1], X[V[-1]]])))
        t[-1] += 1.0
    return HeldCurve(Curve(tuple(pieces)), V, t)
