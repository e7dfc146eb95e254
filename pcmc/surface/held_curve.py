"""The curves that held lines were drawn as, with the vertices that are held on them.

A finer mesh is a mesh of the drawing as long as its new vertices lie on these curves, and not on the edges
or on curves fitted to them.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, Ints, read_only
from ..base.errors import CurveWarning, SurfaceError
from ..base.tolerances import ON, ON_CURVE
from .curve_data import exact_curve, exact_data
from .curves import Curve
from .topology import Topology


@dataclass(frozen=True, eq=False)
class HeldCurve:
    """A drawn curve in space, and the vertices that are held on it.

    >>> from .curves import polyline
    >>> ridge = HeldCurve(polyline([[0, 0, 1], [4, 0, 1]]), np.array([7, 3, 9]), np.array([0.0, 0.5, 1.0]))
    >>> ridge.edges.tolist()
    [[7, 3], [3, 9]]
    """

    curve: Curve  # with points (x, y, z)
    vertices: Ints  # (k,) k ≥ 2, each joined to the next by an edge; closed: the last is the first again
    at: Floats  # (k,) ascending, the parameter of each vertex on the curve

    @property
    def edges(self) -> Ints:
        """(k-1,2) from vertex to vertex."""
        return np.stack([self.vertices[:-1], self.vertices[1:]], axis=1)

    @property
    def points(self) -> Floats:
        """(k,3) the places of the vertices on the curve."""
        return self.curve.at(self.at)

    def plain(self) -> list[Any]:
        """As JSON holds it: the pieces of the curve to the last digit, the vertices, their parameters."""
        return [exact_data(self.curve), self.vertices.tolist(), self.at.tolist()]

    @classmethod
    def from_plain(cls, row: Any) -> HeldCurve:
        """That of such data, which may come from any file; TypeError or ValueError for others."""
        pieces, vertices, at = row
        return cls(exact_curve(pieces), np.array(vertices), np.array(at, dtype=np.float64))

    def mapped(self, matrix: Floats, shift: Floats) -> HeldCurve:
        """With its curve where x → M x + b takes it."""
        return replace(self, curve=self.curve.mapped(matrix, shift))


@dataclass(frozen=True, eq=False)
class EdgesOnCurves:
    """Edges, and where their ends are on curves."""

    curves: Sequence[Curve]
    own: Ints  # (e,) the number of each edge's curve, -1 for an edge of no curve
    at: Floats  # (e,2) the parameters of its ends there

    @classmethod
    def of(cls, held: Sequence[HeldCurve], topo: Topology) -> EdgesOnCurves:
        """Of all edges of a mesh."""
        own, at = np.full(len(topo.edges), -1), np.zeros((len(topo.edges), 2))
        for number, one in enumerate(held):
            edge, (start, end) = topo.edge_numbers(one.edges), one.edges.T
            span = np.stack([one.at[:-1], one.at[1:]], axis=1)
            own[edge], at[edge] = number, np.where((start < end)[:, None], span, span[:, ::-1])
        return cls([one.curve for one in held], own, at)

    def __getitem__(self, chosen: Bools | Ints) -> EdgesOnCurves:
        return replace(self, own=self.own[chosen], at=self.at[chosen])

    @property
    def drawn(self) -> Bools:
        """(e,) the edges of a curve."""
        return self.own >= 0

    def between(self, share: Floats | float = 0.5) -> tuple[Floats, Floats]:
        """(e,) parameters, and (e,3) points, a share of the length of its curve along each edge."""
        share = np.broadcast_to(share, self.own.shape)
        t, points = np.zeros(len(self.own)), np.full((len(self.own), 3), np.nan)
        for number in np.unique(self.own[self.drawn]):
            mine = self.own == number
            t[mine] = self.curves[number].middle(*self.at[mine].T, share[mine])
            points[mine] = self.curves[number].at(t[mine])
        return t, points

    def cut(self, chosen: Bools, t: Floats) -> EdgesOnCurves:
        """The edges that are not chosen, the first halves of those that are, cut at t (k,), their second."""
        (start, end), own = self.at[chosen].T, self.own[chosen]
        halves = np.stack([start, t], axis=1), np.stack([t, end], axis=1)
        at = np.concatenate([self.at[~chosen], *halves])
        return replace(self, own=np.concatenate([self.own[~chosen], own, own]), at=at)

    def joined(self, ends: Ints) -> tuple[HeldCurve, ...]:
        """The edges (e,2) joined along each curve; a gap ends one part and begins another."""
        parts = []
        for number in np.unique(self.own[self.drawn]):
            mine = self.own == number
            falls = (self.at[mine, 0] > self.at[mine, 1])[:, None]
            at = np.where(falls, self.at[mine][:, ::-1], self.at[mine])
            edges = np.where(falls, ends[mine][:, ::-1], ends[mine])
            order = np.argsort(at[:, 0])
            at, edges = at[order], edges[order]
            gaps = 1 + np.flatnonzero((edges[1:, 0] != edges[:-1, 1]) | (at[1:, 0] != at[:-1, 1]))
            for e, t in zip(np.split(edges, gaps), np.split(at, gaps), strict=True):
                vertices, places = np.append(e[:, 0], e[-1, 1]), np.append(t[:, 0], t[-1, 1])
                parts.append(HeldCurve(self.curves[number], vertices, places))
        return tuple(parts)


def checked_curves(given: Any, X: Floats, topo: Topology, fixed: Bools, size: float) -> tuple[HeldCurve, ...]:
    """Curves with fixed vertices (n,3) on them and edges of the mesh between these, no edge on two of them.

    SurfaceError has the number of the first curve that is wrong.
    """
    parts: tuple[Any, ...] = tuple(given) if isinstance(given, Iterable) else (None,)
    if not all(isinstance(part, HeldCurve) for part in parts):
        validate.refuse("curves", given, "a sequence of HeldCurve", error=SurfaceError)
    checked, taken = list[HeldCurve](), np.zeros(len(topo.edges), dtype=bool)
    for number, part in enumerate(parts):
        fault = _fault(part, X, topo, fixed, taken, ON_CURVE * size)
        if fault:
            raise SurfaceError(f"curves: curve {number} {fault}", what="curves", where=number)
        taken[topo.edge_numbers(part.edges)] = True
        V, t = np.asarray(part.vertices, dtype=np.int64), np.asarray(part.at, dtype=np.float64)
        checked.append(HeldCurve(part.curve, read_only(V), read_only(t)))
    return tuple(checked)


def _fault(part: HeldCurve, X: Floats, topo: Topology, fixed: Bools, taken: Bools, near: float) -> str:
    """What is wrong with a curve, or nothing; ``taken`` (e,) are the edges of those before."""
    V, t = np.asarray(part.vertices), np.asarray(part.at)
    shaped = V.ndim == 1 and len(V) > 1 and t.shape == V.shape
    typed = V.dtype.kind in "iu" and t.dtype.kind == "f"
    in_space = isinstance(part.curve, Curve) and part.curve.pieces[0].points.shape[1] == 3
    if not (shaped and typed and in_space):
        return "needs a curve in space, and two or more vertices with a parameter each"
    if V.min() < 0 or V.max() >= len(X):
        return f"has vertices outside 0..{len(X) - 1}"
    if not (t[0] >= 0.0 and t[-1] <= len(part.curve.pieces) and (np.diff(t) > 0.0).all()):
        return f"needs ascending parameters in 0..{len(part.curve.pieces)}"
    edges = topo.edge_numbers(part.edges)
    if (edges < 0).any():
        ends = part.edges[np.argmax(edges < 0)].tolist()
        return f"joins the vertices {ends}, which no edge of the mesh joins"
    if taken[edges].any() or len(np.unique(edges)) < len(edges):
        return "runs along an edge that is on a curve already"
    if not fixed[V].all():
        return f"has the vertex {V[np.argmin(fixed[V])]}, which is not fixed"
    away = np.linalg.norm(part.points - X[V], axis=1)
    if not away.max() <= near:
        return f"does not pass through vertex {V[np.argmax(away)]}, which is {away.max():.3g} away from it"
    return ""


def followed(held: Sequence[HeldCurve], X: Floats, size: float) -> tuple[HeldCurve, ...]:
    """The curves where their vertices are now, X (n,3), for an affine motion of these.

    All kinds of curves are mapped by an affine map x → M x + b exactly. It is found from the vertices of the
    curve alone or, where these do not determine it, of all curves together; so rings may move apart. A
    CurveWarning tells where the motion is no such map: then the curve is left out.
    """
    kept, every = list[HeldCurve](), np.concatenate([np.empty(0, int), *(one.vertices for one in held)])
    before = np.concatenate([np.empty((0, 3)), *(one.points for one in held)])
    for one in held:
        P, Q = one.points, X[one.vertices]
        if np.linalg.norm(P - Q, axis=1).max() <= ON_CURVE * size:
            kept.append(one)
            continue
        alone = _carried(one.curve, P, Q, ON_CURVE * size)
        curve = alone or _carried(one.curve, before, X[every], ON_CURVE * size)
        kept += [replace(one, curve=curve)] if curve else []
    if len(kept) < len(held):
        text = f"{len(held) - len(kept)} of {len(held)} curves that held vertices were drawn on are left out,"
        text += " as these vertices were moved off them: a finer mesh has to guess the boundary between them"
        warnings.warn(text, CurveWarning, stacklevel=3)
    return tuple(kept)


def _carried(curve: Curve, P: Floats, Q: Floats, near: float) -> Curve | None:
    """The curve under the affine map p → M p + b that takes P to Q (k,3), to ``near``; None without one.

    M is 1 across what P spans, which the curve must not leave.
    """
    middle, there = P.mean(axis=0), Q.mean(axis=0)
    change = np.linalg.lstsq(P - middle, (Q - there) - (P - middle), rcond=ON)[0]
    matrix = np.eye(3) + change.T
    shift = there - matrix @ middle
    _, sizes, axes = np.linalg.svd(P - middle, full_matrices=False)
    within, away = axes[sizes > ON * sizes[0]], curve.controls - middle
    spanned = np.abs(away - away @ within.T @ within).max() <= ON_CURVE * (sizes[0] + np.abs(away).max())
    reached = np.linalg.norm(P @ matrix.T + shift - Q, axis=1).max() <= near
    return curve.mapped(matrix, shift) if spanned and reached else None
