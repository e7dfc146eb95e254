"""Films that are strips between two junctions, and the sheets beside them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..base.arrays import Floats, Ints
from ..surface import Surface
from ..surface.geometry import segment_lengths
from ..surface.images import lattice_of
from ..surface.topology import EdgeCurve


@dataclass(frozen=True, eq=False)
class Film:
    """A film between two junctions, with the patches A and B beside the one and C and D beside the other."""

    patch: int
    pairs: Ints  # (k,2) vertices of the one junction and of the other, across from each other and in order
    closed: bool  # whether the last pair is joined to the first
    one_side: tuple[int, int]  # A and C, on the same side of the film: these meet if it vanishes
    other_side: tuple[int, int]  # B and D
    width: float  # the mean distance of the pairs, length
    height: float  # length of the shorter junction

    @property
    def sheets(self) -> tuple[int, ...]:
        """A, C, B and D."""
        return (*self.one_side, *self.other_side)

    def meeting(self, surface: Surface, when: str) -> str:
        """Names the patches that meet once the film has vanished: of a wall, the two of the roof at its ends.

        >>> import numpy as np
        >>> from pcmc import Patch
        >>> floor = Surface(np.eye(3), [[0, 1, 2]], [0], [Patch("floor", 1.0)], fixed=range(3))
        >>> Film(0, np.empty((0, 2)), False, (0, 0), (0, 0), 0.0, 1.0).meeting(floor, "then")
        "'floor' and 'floor' then meet, and 'floor' and 'floor'"
        """
        name = [repr(patch.name) for patch in surface.patches]
        (a, c), (b, d) = self.one_side, self.other_side
        if surface.walls[self.patch]:
            sheets = [curve.sheets for curve in surface.topology.junctions]
            beside = [{k for own in sheets if s in own for k in own} for s in (a, b, c, d)]
            ends = [{k for k in one & other if surface.roof[k]} for one, other in (beside[:2], beside[2:])]
            if [len(end) for end in ends] == [1, 1]:
                return f"{name[ends[0].pop()]} and {name[ends[1].pop()]} {when} meet"
        return f"{name[a]} and {name[c]} {when} meet, and {name[b]} and {name[d]}"


def film_of(surface: Surface, patch: int) -> Film | None:
    """The strip that a patch is; None for one of another shape, or without four different patches beside it.
    A film with further sides at junctions, such as a wall below a roof, is a strip across the short ones."""
    topo, original = surface.topology, surface.original
    curves = [curve for curve in topo.junctions if patch in curve.sheets]
    edges = [topo.sides[topo.edge_numbers(curve.pairs)] for curve in curves]
    lengths = [float(segment_lengths(surface.vertices, own).sum()) for own in edges]
    ends = [set() if curve.closed else {int(v) for v in curve.vertices[[0, -1]]} for curve in curves]
    found = list[tuple[float, int, int]]()
    for i, j in combinations(range(len(curves)), 2):
        one, other = curves[i], curves[j]
        rest = [k for k in range(len(curves)) if k not in (i, j)]
        around = {k for curve in (one, other) for k in curve.sheets} - {patch}
        strip = (one.closed, len(one.sheets), len(other.sheets), len(around)) == (other.closed, 3, 3, 4)
        strip = strip and all(len(ends[k] & ends[i]) == len(ends[k] & ends[j]) == 1 for k in rest)
        if strip and surface.fixed[original[sorted(ends[i] & ends[j])]].all():
            found.append((sum(lengths[k] for k in rest), i, j))
    if not found:
        return None
    _, i, j = min(found)
    one, other = curves[i], curves[j]
    pairs, width = _across(surface, one, other)
    (a, b), (c, d) = ([k for k in curve.sheets if k != patch] for curve in (one, other))
    apart = _apart(surface, one, a, b)[pairs[:, 0]] * _apart(surface, other, c, d)[pairs[:, 1]]
    c, d = (c, d) if apart.sum() > 0.0 else (d, c)
    return Film(patch, pairs, one.closed, (a, c), (b, d), width, min(lengths[i], lengths[j]))


def lattice_steps(lattice: Floats, vectors: Floats) -> Ints:
    """(…,d) the whole multiples of the translations (d,3) of a lattice nearest to vectors (…,3)."""
    return np.asarray(np.rint(vectors @ np.linalg.pinv(lattice)).astype(np.int64))


def _across(surface: Surface, one: EdgeCurve, other: EdgeCurve) -> tuple[Ints, float]:
    """(k,2) the vertices of two curves side by side, some of one several times; their mean distance."""
    X, lattice, count = surface.vertices, lattice_of(surface), max(len(one.vertices), len(other.vertices))

    def apart(row: Ints) -> Floats:
        step = X[row[:, 1]] - X[row[:, 0]]
        return np.asarray(np.linalg.norm(step - lattice_steps(lattice, step) @ lattice, axis=1))

    rows = []
    for way in (other.vertices, other.vertices[::-1]):
        if one.closed:
            start = np.broadcast_to(one.vertices[0], len(way))
            way = np.roll(way, -int(apart(np.stack([start, way], axis=1)).argmin()))
        row = list[Ints]()
        for v in (one.vertices, way):
            ends = np.rint(np.linspace(0, len(v) - 1, count)).astype(int)
            row.append(v[np.arange(count) * len(v) // count if one.closed else ends])
        rows.append(np.stack(row, axis=1))
    pairs = min(rows, key=lambda row: float(apart(row).sum()))
    return pairs, float(apart(pairs).mean())


def _apart(surface: Surface, curve: EdgeCurve, one: int, other: int) -> Floats:
    """(n,3) at the vertices of a junction the way across it from the one of two sheets to the other."""
    topo, F, out = surface.topology, surface.faces, np.zeros((surface.n, 3))
    f, k = np.nonzero(np.isin(topo.edge_of_face, topo.edge_numbers(curve.pairs)))
    a, b, c = (surface.vertices[F[f, k - j]] for j in range(3))
    sign = (surface.patch_of_face[f] == other).astype(float) - (surface.patch_of_face[f] == one)
    for j in (1, 2):
        np.add.at(out, surface.original[F[f, k - j]], sign[:, None] * (a - 0.5 * (b + c)))
    return out
